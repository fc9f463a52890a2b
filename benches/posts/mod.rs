//! The common part of the benchmarks of simulations and of light: a server, and a client that posts a render and waits for it.

use serde_json::Value;

use super::common::Server;

/// A server and its client.
pub struct Bench {
    server: Server,
    client: reqwest::Client,
    runtime: tokio::runtime::Runtime,
}

pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

impl Bench {
    /// A server on PoCL, or on the device that `DEVICE` names.
    pub fn new(environment: &[(&str, &str)]) -> Self {
        let device = std::env::var("DEVICE").unwrap_or_else(|_| "pocl".into());
        let server = Server::start_env(&["--device", &device], environment);
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        Self { server, client: reqwest::Client::builder().no_proxy().build().unwrap(), runtime }
    }

    /// Uploads a cube of `side` voxels of a type, as large as `size`, and returns its id.
    #[allow(dead_code, reason = "not every benchmark uploads")]
    pub fn upload(&self, voxels: Vec<u8>, side: usize, voxel: &str, size: f64) -> String {
        let spacing = size / side as f64;
        let query = format!("dims={side},{side},{side}&type={voxel}&spacing={spacing},{spacing},{spacing}");
        let url = format!("{}/v1/volumes?{query}", self.server.url());
        let upload = self.client.post(url).header("Content-Type", "application/octet-stream").body(voxels);
        let reply: Value = self.runtime.block_on(async { upload.send().await.unwrap().json().await.unwrap() });
        reply["id"].as_str().unwrap_or_else(|| panic!("{reply}")).to_owned()
    }

    /// Posts a render and waits for its picture in a format. Returns its place under the server, and the picture.
    pub fn picture(&self, request: &Value, format: &str) -> (String, Vec<u8>) {
        let posted = self.client.post(format!("{}/v1/renders", self.server.url())).json(request);
        let reply: Value = self.runtime.block_on(async { posted.send().await.unwrap().json().await.unwrap() });
        let place = reply["links"]["self"].as_str().unwrap_or_else(|| panic!("{reply}")).to_owned();
        let picture = self.get(&format!("{place}/frame.{format}?wait=final"));
        (place, picture)
    }

    /// The bytes at a place under the server.
    pub fn get(&self, place: &str) -> Vec<u8> {
        let request = self.client.get(format!("{}{place}", self.server.url()));
        self.runtime.block_on(async {
            request.send().await.unwrap().error_for_status().unwrap().bytes().await.unwrap().to_vec()
        })
    }

    /// The render resource at a place.
    pub fn resource(&self, place: &str) -> Value {
        serde_json::from_slice(&self.get(place)).unwrap()
    }
}
