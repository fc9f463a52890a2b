//! The code of `docs/add-a-technique.md` as a test: a view that looks at no volume, and a field with a decision of the host between its launches.
//! They are files of their own and one list line; nothing else of the service knows them.

mod ball;
mod potential;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use clap::Parser;
use cloudchamber::config::Config;
use cloudchamber::device::DeviceConfig;
use cloudchamber::error::Error;
use cloudchamber::http::Server;
use cloudchamber::study::bench::Reads;
use cloudchamber::study::{self, Case, Scale, Setting, Trial, Truth, study};
use cloudchamber::technique::{self, Technique};
use serde_json::{Value, json};

use crate::common::engine::House;
use crate::common::processes::under_oclgrind;

/// The list line.
const EXAMPLES: &[Technique] = &[ball::TECHNIQUE, potential::TECHNIQUE];

fn files() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/service/example"))
}

/// A folder with all kernels, including the examples'.
fn kernels() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        technique::add(EXAMPLES).unwrap();
        let folder = tempfile::tempdir().unwrap().keep();
        let all = Path::new(env!("CARGO_MANIFEST_DIR")).join("kernels");
        for (from, to) in [
            (all.clone(), folder.clone()),
            (all.join("shared"), folder.join("shared")),
            (files().into(), folder.clone()),
        ] {
            std::fs::create_dir_all(&to).unwrap();
            for file in std::fs::read_dir(from).unwrap().map(|entry| entry.unwrap().path()) {
                if file.extension().is_some_and(|e| e == "cl" || e == "h") {
                    std::fs::copy(&file, to.join(file.file_name().unwrap())).unwrap();
                }
            }
        }
        folder
    })
}

/// A house that has the examples, with warnings as errors.
fn house() -> &'static House {
    static HOUSE: OnceLock<House> = OnceLock::new();
    HOUSE.get_or_init(|| of_lanes(None))
}

fn of_lanes(lanes: Option<u32>) -> House {
    House::on(DeviceConfig { kernels: Some(kernels().into()), strict: true, lanes, ..DeviceConfig::pocl() })
}

/// The ball's picture through parallel rays, `side` pixels across its width.
fn ball(side: usize, albedo: f64) -> Value {
    let camera = json!({"eye": [0, 0, 4], "target": [0, 0, 0], "up": [0, 1, 0], "projection": "orthographic", "fov_y_deg": 2.0 * 0.25f64.atan().to_degrees()});
    json!({"technique": "ball", "ball": {"albedo": albedo}, "camera": camera, "image": {"width": side, "height": side},
        "budget": {"samples": 1}})
}

#[test]
fn a_view_without_a_volume_is_lit_as_its_closed_form_says() {
    let side = 64;
    for house in [house(), &of_lanes(Some(1)), &of_lanes(Some(4))] {
        let (film, error) = house.film(&ball(side, 0.5));
        for (i, pixel) in film.main.mean.chunks_exact(4).enumerate() {
            let [x, y] = [i % side, i / side].map(|p| 2.0 * (p as f64 + 0.5) / side as f64 - 1.0);
            let squared = 1.0 - x * x - y * y;
            // At the silhouette rounding decides the result.
            if squared.abs() > 1e-3 {
                let expected = 0.5 * squared.max(0.0).sqrt();
                assert!((f64::from(pixel[0]) - expected).abs() < 1e-4, "at {x}, {y}: {} for {expected}", pixel[0]);
            }
        }
        assert_eq!(error.discretisation, Some(0.0));
    }
}

#[test]
fn a_view_without_a_volume_is_planned_framed_and_turned() {
    let house = house();
    let job = house
        .finish(&json!({"technique": "ball", "image": {"width": 48, "height": 48}, "budget": {"max_error": 0.05}}));
    let resource = job.resource();
    assert_eq!(
        (resource["state"].as_str(), resource["stopped_by"].as_str()),
        (Some("done"), Some("error")),
        "{resource}"
    );
    let planned = house.finish(
        &json!({"technique": "auto", "ball": {}, "image": {"width": 48, "height": 48}, "budget": {"max_error": 0.05}}),
    );
    assert_eq!(planned.resource()["technique"], "ball");
    let clipped = house.film(&json!({"technique": "ball", "clip": {"planes": [{"normal": [0, 0, 1], "point": [0, 0, 3]}]}, "budget": {"samples": 1}})).0;
    assert!(clipped.main.mean.iter().all(|v| *v == 0.0), "nothing of it is left");
    let refused = house.scene(&json!({"technique": "ball", "ball": {"albedo": 2}}));
    assert!(matches!(refused, Err(Error::Invalid(v)) if v[0].pointer == "/ball/albedo"));
}

/// The potential after some iterations, and the result.
fn potential(own: &Value) -> (Vec<f32>, Value) {
    let job = house().finish(&json!({"technique": "slice", "volume": {"potential": own}, "image": {"width": 8, "height": 8}, "budget": {"samples": 1}}));
    let field = job.field().unwrap();
    ((0..field.voxel_count()).map(|i| field.voxels().unwrap().get_f32(i)).collect(), job.resource()["result"].clone())
}

#[test]
fn a_field_converges_to_its_closed_form_and_stops_when_the_host_says_so() {
    let (values, result) = potential(&json!({"grid": [5, 4, 8], "iterations": 5000, "stop": 1e-7}));
    for (i, value) in values.iter().enumerate() {
        let expected = ((i / 20) as f64 + 0.5) / 8.0;
        assert!((f64::from(*value) - expected).abs() < 1e-5, "voxel {i}: {value} for {expected}");
    }
    let iterations = result["iterations"].as_u64().unwrap();
    assert!((100..5000).contains(&iterations) && result["rms_change"].as_f64().unwrap() <= 1e-7, "{result}");
}

#[test]
fn a_field_converges_as_fast_as_theory_says() {
    // The slowest mode, sin(π z / n), shrinks by (4 + 2 cos(π / n)) / 6 per iteration.
    let n = 12.0;
    let rms = |iterations: u64| {
        potential(&json!({"grid": [3, 3, 12], "iterations": iterations})).1["rms_change"].as_f64().unwrap()
    };
    let rate = (rms(400) / rms(300)).powf(0.01);
    let expected = (4.0 + 2.0 * (std::f64::consts::PI / n).cos()) / 6.0;
    assert!((rate - expected).abs() < 1e-5, "{rate} for {expected}");
}

#[test]
fn a_field_goes_through_the_planner_an_export_and_http() {
    let own = json!({"potential": {"grid": [4, 4, 10], "iterations": 3000, "stop": 1e-8}});
    let job =
        house().export(&json!({"technique": "histogram", "volume": own, "histogram": {"bins": 10, "range": [0, 1]}}));
    let table = String::from_utf8(job.file().unwrap().bytes.to_vec()).unwrap();
    assert!(table.lines().skip(1).all(|line| line.split(',').nth(2) == Some("16")), "{table}");
    let data = tempfile::tempdir().unwrap();
    let flags =
        ["serve", "--listen", "127.0.0.1:0", "--calibrate", "false", "--data-dir", data.path().to_str().unwrap()];
    let mut config = Flags::parse_from(flags).config;
    config.device.kernels = Some(kernels().into());
    let runtime = tokio::runtime::Runtime::new().unwrap();
    runtime.block_on(async {
        let server = Server::bind(&config).await.unwrap();
        let base = format!("http://{}", server.address().unwrap());
        server.engine().ready().await.unwrap();
        let (stop, stopped) = tokio::sync::oneshot::channel::<()>();
        let serving = tokio::spawn(server.run(async { drop(stopped.await) }));
        let http = reqwest::Client::builder().no_proxy().build().unwrap();
        let told: Value = http.get(format!("{base}/v1/techniques")).send().await.unwrap().json().await.unwrap();
        for example in EXAMPLES {
            let of = told["techniques"].as_array().unwrap().iter().find(|t| t["name"] == example.name).unwrap();
            let post = http.post(format!("{base}/v1/renders")).header("Accept", "image/png").json(&of["example"]);
            assert_eq!(post.send().await.unwrap().status(), 200, "{of}");
        }
        let refused = http
            .post(format!("{base}/v1/renders"))
            .json(&json!({"technique": "slice", "volume": {"potential": {"grid": [1, 2, 3]}}}));
        let problem: Value = refused.send().await.unwrap().json().await.unwrap();
        assert_eq!(problem["errors"][0]["pointer"], "/volume/potential/grid/0", "{problem}");
        stop.send(()).unwrap();
        serving.await.unwrap().unwrap();
    });
}

#[derive(Parser)]
struct Flags {
    #[command(flatten)]
    config: Config,
}

/// The study's case.
const CASE: Case = Case {
    name: "ball",
    title: "A ball under a light at the eye",
    when: "a ball",
    choose: "`ball`",
    trial: |_, _| {
        let side = 32;
        let pixel = |i: usize| {
            let [x, y] = [i % side, i / side].map(|p| 2.0 * (p as f64 + 0.5) / side as f64 - 1.0);
            0.5 * (1.0 - x * x - y * y).max(0.0).sqrt()
        };
        let centres: Vec<f64> = (0..side * side).map(pixel).collect();
        let truth = Truth {
            words: "closed form".into(),
            values: centres.clone(),
            centres: Some(centres),
            size: Some([side; 2]),
            known_to: 1e-6,
        };
        let request = study::view("ball", &Value::Null, &ball(side, 0.5)["camera"], side, 1, &json!({"albedo": 0.5}));
        Ok(Ok(Trial {
            truth,
            settings: vec![Setting::stepped("ball", "samples", 1.0, None, request).reading(Reads::Luminance)],
        }))
    },
};

#[test]
fn its_study_case_is_measured() {
    let record = study(&house().bench(), &CASE, Scale::Quick, &mut |_| ()).unwrap().unwrap();
    let point = &record.lines[0].points[0];
    assert!(point.error.rmse < 0.02 && point.device_ms > 0.0, "{point:?}");
}

#[test]
fn their_tiny_cases_are_clean_under_oclgrind() {
    let log = under_oclgrind("example::their_tiny_cases_are_clean_under_oclgrind", || {
        let config = DeviceConfig { target: "oclgrind".into(), lanes: Some(4), ..DeviceConfig::pocl() };
        let house = House::on(DeviceConfig { kernels: Some(kernels().into()), ..config });
        EXAMPLES.iter().flat_map(|t| (t.cases)().tiny).for_each(|request| drop(house.film(&request)));
    });
    assert_eq!(log.trim(), "");
}

#[test]
fn a_name_that_is_taken_is_refused() {
    let taken = technique::add(&[cloudchamber::technique::slice::TECHNIQUE]);
    assert!(matches!(taken, Err(Error::Conflict(_))));
}

/// The test finds all code of the page in the examples, except for white space; `…` stands for omitted code.
#[test]
fn the_pages_code_is_that_of_the_examples() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |file: &Path| std::fs::read_to_string(file).unwrap();
    let plain = |text: &str| text.split_whitespace().collect::<String>();
    let own: Vec<String> = ["ball.rs", "ball.cl", "potential.rs", "potential.cl", "../example.rs"]
        .iter()
        .map(|name| plain(&read(&files().join(name))))
        .collect();
    let page = read(&root.join("docs/add-a-technique.md"));
    let mut pieces = 0;
    for block in page.split("```").skip(1).step_by(2) {
        let Some(code) = ["rust\n", "c\n"].iter().find_map(|language| block.strip_prefix(language)) else { continue };
        for piece in code.split('…').map(plain).filter(|piece| !piece.is_empty()) {
            assert!(own.iter().any(|text| text.contains(&piece)), "the examples do not say:\n{code}");
            pieces += 1;
        }
    }
    assert!(pieces > 10, "the page has {pieces} pieces of code");
}
