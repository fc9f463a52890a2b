//! The same bytes on any number of threads and servers.

use serde_json::{Value, json};

use super::run::request;
use crate::common::Server;

/// The grid and the ledger of a server.
fn grid(server: &Server, parameters: &Value) -> (Vec<u8>, Value) {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let client = reqwest::Client::builder().no_proxy().build().unwrap();
    runtime.block_on(async {
        let url = format!("{}/v1/renders", server.url());
        let reply: Value = client.post(url).json(&request(parameters)).send().await.unwrap().json().await.unwrap();
        let url = format!("{}/v1/renders/{}", server.url(), reply["id"].as_str().unwrap());
        client.get(format!("{url}/frame.png?wait=final")).send().await.unwrap().error_for_status().unwrap();
        let nrrd = client.get(format!("{url}/field")).send().await.unwrap().bytes().await.unwrap().to_vec();
        let resource: Value = client.get(url).send().await.unwrap().json().await.unwrap();
        (nrrd, resource["result"]["ledger"].clone())
    })
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let one = Server::start_env(&[], &[("POCL_MAX_PTHREAD_COUNT", "1")]);
    let all = Server::start();
    let medium =
        json!({"mu_a_per_mm": 0.1, "mu_s_per_mm": 1.5, "index": 1.4, "phase": {"type": "henyey_greenstein", "g": 0.8}});
    for parameters in [
        json!({"photons": 60_000, "medium": medium, "size_mm": [10, 10, 10], "grid": [20, 20, 20], "boundary": {"fresnel": true}}),
        // The grid has so many voxels that all cores share one grid.
        json!({"photons": 20_000, "density": {"builtin": "gaussian", "resolution": 240}, "medium": medium, "tally": "absorbed"}),
    ] {
        let (grid_one, ledger_one) = grid(&one, &parameters);
        let (grid_all, ledger_all) = grid(&all, &parameters);
        assert_eq!(ledger_one, ledger_all, "{parameters}");
        assert!(grid_one == grid_all, "{parameters}: the grids differ");
    }
}
