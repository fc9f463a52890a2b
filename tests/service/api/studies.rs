//! `/v1/studies` and the `study` command.

use serde_json::{Value, json};

use super::commands::{cloudchamber, fails, succeeds};
use crate::common::Server;
use crate::support::*;

#[tokio::test]
async fn what_was_measured_is_served_as_numbers_and_as_charts() {
    let server = shared();
    let api = Api::new(&server);
    let listed = api.get_json("/v1/studies").await;
    let studies = listed["studies"].as_array().unwrap();
    assert!(studies.len() >= 10, "{} studies", studies.len());
    let charts = |of: &Value| {
        of["charts"].as_array().unwrap().iter().map(|c| c.as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let mut all: Vec<String> = Vec::new();
    for study in studies {
        let numbers = api.get_json(study["href"].as_str().unwrap()).await;
        assert_eq!(numbers["name"], study["name"]);
        for field in ["device", "platform", "version", "commit", "processor"] {
            assert!(numbers["machine"][field].as_str().is_some_and(|t| !t.is_empty()), "{field} of {}", study["name"]);
        }
        let points = numbers["lines"].as_array().unwrap().iter().flat_map(|l| l["points"].as_array().unwrap());
        for point in points {
            assert!(point["rmse"].is_number() && point["device_ms"].as_f64().is_some_and(|ms| ms > 0.0), "{point}");
        }
        all.extend(charts(study));
    }
    let stability = &listed["stability"];
    for experiment in stability["experiments"].as_array().unwrap() {
        let verdict = experiment["verdict"].as_str().unwrap();
        assert!(!verdict.contains("silent"), "{}: {verdict}", experiment["name"]);
        all.extend(charts(experiment));
    }
    let honesty = &listed["honesty"];
    let number = |name: &str| honesty[name].as_u64().unwrap();
    assert!(number("covered") <= number("known") && number("known") > 450 && number("scenes") >= 700, "{honesty}");
    assert!(number("covered") * 100 >= number("known") * 95, "{honesty}");
    assert!(api.get_json(honesty["href"].as_str().unwrap()).await["parts"][0]["scenes"].is_array());
    let planner = &listed["planner"];
    let [met, scenes] = ["error_met", "scenes"].map(|name| planner[name].as_u64().unwrap());
    assert!(met <= scenes && met * 100 >= scenes * 95 && scenes >= 90, "{planner}");
    assert!(api.get_json(planner["href"].as_str().unwrap()).await["scenes"].is_array());
    assert!(api.get_json(stability["href"].as_str().unwrap()).await["experiments"].is_array());
    for chart in all {
        let response = api.get(&chart).await;
        assert_eq!(
            (response.status().as_u16(), &response.headers()["content-type"]),
            (200, &"image/svg+xml".parse().unwrap())
        );
        let svg = response.text().await.unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("<text"), "{chart}");
    }
    for wrong in ["nothing", "nothing.svg", "README.md", "..%2fREADME", ".json"] {
        let told = problem(api.get(&format!("/v1/studies/{wrong}")).await, 404, wrong).await;
        assert!(told["detail"].as_str().unwrap().contains("no study"), "{told}");
    }
}

#[tokio::test]
async fn the_study_command_writes_what_the_server_then_serves() {
    let server = Server::start();
    let folder = server.data.path();
    let told = succeeds(&cloudchamber(folder, &["study", "--case", "beer_lambert", "--quick"]));
    assert!(told.contains("| error at most |") && told.contains("emission_absorption"), "{told}");
    for file in ["beer_lambert.json", "beer_lambert.svg", "README.md"] {
        assert!(folder.join("studies").join(file).exists(), "{file}");
    }
    let served = Api::new(&server).get_json("/v1/studies/beer_lambert").await;
    assert_eq!(served["quick"], true, "the data folder's own comes before the one built in");
    fails(&cloudchamber(folder, &["study", "--case", "no_such_case"]), "beer_lambert");
}

#[tokio::test]
async fn an_ordinary_render_warns_with_the_codes_of_the_study() {
    let server = shared();
    let api = Api::new(&server);
    let code = |resource: &Value, code: &str| {
        resource["warnings"].as_array().unwrap().iter().find(|w| w["code"] == code).cloned()
    };
    let scattering = |technique: &str, own: &Value| {
        json!({"technique": technique, "volume": {"builtin": "smoke", "resolution": 24}, "image": {"width": 16, "height": 16},
            "budget": {"samples": 1}, technique: own})
    };
    for (technique, own, missing) in [
        ("single_scatter", json!({}), true),
        ("volume_path", json!({"max_scatterings": 2}), true),
        ("volume_path", json!({}), false),
        ("single_scatter", json!({"medium": {"albedo": 0}}), false),
        ("single_scatter", json!({"medium": {"sigma_t_per_unit": 0.001}}), false),
    ] {
        let found = code(&api.finish(&scattering(technique, &own)).await, "multiple_scattering_missing");
        assert_eq!(found.is_some(), missing, "{technique} {own}: {found:?}");
        if let Some(warning) = found {
            assert!(warning["measured"].as_f64() > warning["bound"].as_f64(), "{warning}");
            assert!(warning["message"].as_str().is_some_and(|m| m.len() > 20), "{warning}");
        }
    }
    for (technique, own) in [
        ("emission_absorption", json!({})),
        ("isosurface", json!({"isovalue": 0.3})),
        ("projection", json!({"mode": "mean"})),
    ] {
        for (step, warns) in [(1.0, false), (2.0, false), (3.0, true)] {
            let mut own = own.clone();
            own["step_voxels"] = json!(step);
            let found = code(&api.finish(&scattering(technique, &own)).await, "coarse_step");
            // A mean is followed from voxel to voxel and has no step.
            assert_eq!(found.is_some(), warns && technique != "projection", "{technique}, step {step}: {found:?}");
        }
    }
}
