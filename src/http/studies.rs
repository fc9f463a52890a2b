//! `/v1/studies`: the measurements, as numbers and as charts.

use axum::Json;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde_json::{Value, json};

use super::App;
use super::problem::Id;
use crate::error::{Error, Result};
use crate::study::CASES;
use crate::study::honesty::Honesty;
use crate::study::planner::Planned;
use crate::study::record::Record;
use crate::study::results::{HONESTY, PEERS, PLANNER, Results, STABILITY};
use crate::study::stability::Stability;

const ROOT: &str = "/v1/studies";

/// The cases of comparisons with another program, without light and with it, and the setting to choose.
const WHEN: [&str; 2] = ["a volume, and VTK at hand", "a volume to be lit, and VTK at hand"];
const CHOOSE: &str = "the longest step that is wrong by no more than VTK's picture, which the chart has";

/// `GET /v1/studies`.
pub(super) async fn list(State(app): State<App>) -> Result<Json<Value>> {
    let listed = tokio::task::spawn_blocking(move || {
        let results = &app.studies;
        let peers = results.names().into_iter().filter(|name| name.starts_with(PEERS));
        let cases = CASES.iter().map(|c| (c.name.to_owned(), c.when, c.choose)).chain(peers.map(|name| {
            let when = WHEN[usize::from(name.ends_with("_shaded"))];
            (name, when, CHOOSE)
        }));
        let cases: Vec<Value> =
            cases.filter_map(|(name, when, choose)| describe(&name, when, choose, results)).collect();
        json!({"studies": cases, "stability": app.studies.record(STABILITY).as_ref().map(describe_stability),
            "planner": app.studies.record(PLANNER).as_ref().map(describe_planner),
            "honesty": app.studies.record(HONESTY).as_ref().map(describe_honesty)})
    });
    Ok(Json(listed.await.map_err(Error::internal)?))
}

/// A case in short; `None` if it was not measured.
fn describe(name: &str, when: &str, choose: &str, results: &Results) -> Option<Value> {
    let record: Record = results.record(name)?;
    Some(json!({
        "name": record.name, "title": record.title, "when": when, "choose": choose, "truth": record.truth,
        "quick": record.quick, "machine": record.machine, "equal_error": record.equal_error, "equal_time": record.equal_time,
        "href": format!("{ROOT}/{}", record.name), "charts": [format!("{ROOT}/{}.svg", record.name)],
    }))
}

fn describe_stability(found: &Stability) -> Value {
    let experiments = found.experiments.iter().map(|outcome| {
        let map = outcome.findings.heat_map.as_ref().map(|_| format!("{ROOT}/stability_{}_map.svg", outcome.name));
        let charts: Vec<String> = [format!("{ROOT}/stability_{}.svg", outcome.name)].into_iter().chain(map).collect();
        let codes: std::collections::BTreeSet<&String> = outcome.findings.samples().flat_map(|(_, s)| &s.warnings).collect();
        json!({"name": outcome.name, "title": outcome.title, "expected": outcome.expected, "verdict": outcome.verdict.words(),
            "warnings": codes, "quick": outcome.quick, "machine": outcome.machine, "charts": charts})
    });
    json!({"href": format!("{ROOT}/{STABILITY}"),
        "experiments": experiments.collect::<Vec<_>>(), "not_here_yet": found.not_here_yet})
}

fn describe_planner(found: &Planned) -> Value {
    let [error_met, in_time, cheap] = found.figures();
    json!({"href": format!("{ROOT}/{PLANNER}"), "machine": found.machine, "scenes": found.scenes.len(),
        "error_met": error_met, "in_time": in_time, "cheap": cheap})
}

fn describe_honesty(found: &Honesty) -> Value {
    let figures = found.figures();
    let median = Some(figures.median).filter(|median| median.is_finite());
    json!({"href": format!("{ROOT}/{HONESTY}"), "charts": [format!("{ROOT}/{HONESTY}.svg")], "machines": found.machines(),
        "scenes": found.scenes().len(), "known": figures.known, "covered": figures.covered, "nearly": figures.nearly,
        "median": median, "above": figures.above, "asked": figures.asked[0], "within": figures.asked[1]})
}

/// `GET /v1/studies/{id}`: the numbers of a study. `{id}.svg` is its chart.
pub(super) async fn show(State(app): State<App>, Id(name): Id) -> Result<Response> {
    let (file, media) = match name.ends_with(".svg") {
        true => (name.clone(), "image/svg+xml"),
        false => (format!("{name}.json"), "application/json"),
    };
    let found = tokio::task::spawn_blocking(move || app.studies.read(&file)).await.map_err(Error::internal)?;
    let missing = || Error::NotFound { what: "study", id: name.chars().take(100).collect() };
    let headers = [(header::CONTENT_TYPE, media), (header::CACHE_CONTROL, "no-cache")];
    Ok((headers, found.ok_or_else(missing)?).into_response())
}
