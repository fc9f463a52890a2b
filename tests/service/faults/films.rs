//! Films stay on the device until they are asked for: those of the newest renders, within a limit.

use serde_json::{Value, json};

use crate::common::Server;
use crate::support::*;

fn scene(seed: u64) -> Value {
    let mut scene = with(small(), "/budget", json!({"samples": 4}));
    scene["seed"] = json!(seed);
    scene
}

#[tokio::test]
async fn films_past_the_limit_are_gone_and_the_newest_never_is() {
    let server = Server::start_with(&["--keep-film-bytes", "1"]);
    let api = Api::new(&server);
    let first = api.finish(&scene(1)).await["id"].as_str().unwrap().to_owned();
    let exr = async |id: &str| api.get(&format!("/v1/renders/{id}/frame.exr")).await;
    assert_eq!(exr(&first).await.status(), 200, "it is the newest");
    let second = api.finish(&scene(2)).await["id"].as_str().unwrap().to_owned();
    let gone = problem(exr(&first).await, 404, "an older film").await;
    assert!(gone["detail"].as_str().is_some_and(|d| d.contains("film any more")), "{gone}");
    assert_eq!(api.get(&format!("/v1/renders/{first}/frame.png")).await.status(), 200, "its picture stays");
    assert_eq!(exr(&second).await.status(), 200);
    let apart = api.get(&format!("/v1/renders/{second}/difference?with={first}")).await;
    problem(apart, 404, "a difference to it").await;
}

#[tokio::test]
async fn a_film_is_that_of_the_newest_camera_also_while_it_runs() {
    let server = shared();
    let api = Api::new(&server);
    let place = api.start(&endless()).await;
    let luminance = |bytes: &[u8]| exr_samples(bytes).1["G"].iter().map(|v| f64::from(*v)).sum::<f64>();
    let exr = || async { api.get(&format!("{place}/frame.exr")).await.bytes().await.unwrap() };
    assert!(luminance(&exr().await) > 0.0);
    // Away from the volume there is nothing to see.
    let away = json!({"eye": [0, -4, 0], "target": [0, -8, 0], "up": [0, 0, 1], "fov_y_deg": 30});
    assert!(api.put(&format!("{place}/camera"), &away).await.status().is_success());
    let mut seen = f64::INFINITY;
    for _ in 0..100 {
        seen = luminance(&exr().await);
        if seen == 0.0 {
            break;
        }
        tokio::time::sleep(std::time::Duration::from_millis(50)).await;
    }
    assert_eq!(seen, 0.0);
    assert!(api.delete(&place).await.status().is_success());
    let after = api.get(&format!("{place}/frame.exr")).await.status().as_u16();
    assert!([200, 404].contains(&after), "{after}");
}
