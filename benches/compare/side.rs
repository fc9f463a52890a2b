//! One of the two servers, and its calls.

use std::path::Path;
use std::time::Duration;

use serde_json::{Value, json};

use super::answer::{Compare, Reply};
use super::call::{Call, Names};
use super::mask;
use crate::common::Server;
use crate::common::pictures::{self, Asked};

/// The time after which an answer counts as missing. A kernel may have to be compiled first.
const PATIENCE: Duration = Duration::from_secs(180);

/// A server, with the ids that it gave.
pub struct Side {
    server: Server,
    client: reqwest::Client,
    /// The ids of test volumes.
    volumes: Names,
    /// The ids of renders, in the order in which they came.
    renders: Vec<String>,
}

impl Side {
    /// Starts a build of the server.
    pub fn start(program: &Path) -> Self {
        let redirected = reqwest::redirect::Policy::none();
        let client = reqwest::Client::builder().no_proxy().timeout(PATIENCE).redirect(redirected).build().unwrap();
        let server = Server::start_program(program, &[("CLOUDCHAMBER_LOG", "warn")]);
        Self { server, client, volumes: Names::new(), renders: Vec::new() }
    }

    /// Uploads all test volumes, and the test sinogram, of which older builds know nothing.
    pub async fn upload_volumes(&mut self) -> Vec<Reply> {
        let mut replies = Vec::new();
        for name in pictures::VOLUMES {
            let (bytes, query) = pictures::upload(name);
            let given = [("dims", query.dims), ("type", query.r#type), ("spacing", query.spacing)];
            let query: Vec<String> = given.into_iter().filter_map(|(k, v)| Some(format!("{k}={}", v?))).collect();
            let said = json!({"method": "POST", "path": format!("/v1/volumes?{}", query.join("&"))});
            let call = Call { label: name.into(), body: Some(bytes), ..Call::new(&said, &self.volumes) };
            let reply = self.send(&call).await;
            let id = reply.json().and_then(|info| info["id"].as_str().map(str::to_owned));
            self.volumes.insert(name.into(), id.unwrap_or_else(|| panic!("{name} was not taken: {reply:?}")));
            replies.push(self.masked(reply));
        }
        let said = json!({"method": "POST", "path": "/v1/sinograms"});
        let call = Call {
            label: pictures::SINOGRAM.into(),
            body: Some(pictures::sinogram()),
            ..Call::new(&said, &self.volumes)
        };
        let reply = self.send(&call).await;
        let id = reply.json().and_then(|info| info["id"].as_str().map(str::to_owned));
        self.volumes.insert(pictures::SINOGRAM.into(), id.unwrap_or_default());
        replies.push(self.masked(reply));
        replies
    }

    /// Sends all calls of an entry. The replies are without this server's ids and without times.
    pub async fn ask(&mut self, asked: &Asked) -> Vec<Reply> {
        let replies = match asked.request["calls"].as_array() {
            Some(calls) => self.ask_calls(&asked.request, calls).await,
            None => self.ask_render(&asked.request, Compare::of(&asked.about)).await.0,
        };
        replies.into_iter().map(|reply| self.masked(reply)).collect()
    }

    /// Posts a render and fetches its results; returns also its id, if it has one. A render that was only just posted may be in any state.
    async fn ask_render(&mut self, request: &Value, compare: Compare) -> (Vec<Reply>, Option<String>) {
        let mut names = self.volumes.clone();
        let mut posted = self.send(&Call::new(&json!({"path": "/v1/renders", "json": request}), &names)).await;
        if posted.status != 202 {
            return (vec![posted], None);
        }
        posted.compare = Compare::Shape;
        let id = posted.json().and_then(|r| r["id"].as_str().map(str::to_owned)).unwrap_or_default();
        names.insert("0".into(), id.clone());
        let mut paths = vec![
            ("/v1/renders/{0}/frame.png?wait=final", compare.of_bytes()),
            ("/v1/renders/{0}/frame.exr?wait=final", compare.of_bytes()),
            ("/v1/renders/{0}", compare),
        ];
        if cloudchamber::technique::fields().any(|t| request["volume"].get(t.name).is_some()) {
            paths.push(("/v1/renders/{0}/field", compare.of_bytes()));
        }
        let mut replies = vec![posted];
        for (path, compare) in paths {
            replies.push(self.send(&Call::get(path, &names, compare)).await);
        }
        (replies, Some(id))
    }

    /// Makes the entry's renders and then its calls, one after the other.
    async fn ask_calls(&mut self, request: &Value, calls: &[Value]) -> Vec<Reply> {
        let mut names = self.volumes.clone();
        for (i, render) in request["renders"].as_array().into_iter().flatten().enumerate() {
            let (replies, id) = self.ask_render(render, Compare::All).await;
            names.insert(i.to_string(), id.unwrap_or_else(|| panic!("a render that is refused: {replies:?}")));
        }
        let mut replies = Vec::new();
        for said in calls {
            let reply = self.send(&Call::new(said, &names)).await;
            if let Some(id) = reply.json().and_then(|told| told["id"].as_str().map(str::to_owned)) {
                names.insert("last".into(), id);
            }
            replies.push(reply);
        }
        replies
    }

    /// Sends a call. If there is no answer, the reply has the reason.
    async fn send(&mut self, call: &Call) -> Reply {
        let mut reply = Reply {
            label: call.label.clone(),
            compare: call.compare,
            status: 0,
            headers: Default::default(),
            body: Vec::new(),
        };
        match self.try_send(call, &mut reply).await {
            Ok(()) => {}
            Err(cause) => (reply.status, reply.body) = (0, cause.to_string().into_bytes()),
        }
        reply
    }

    async fn try_send(&mut self, call: &Call, reply: &mut Reply) -> reqwest::Result<()> {
        let mut request = self.client.request(call.method.clone(), format!("{}{}", self.server.url(), call.path));
        for (name, value) in &call.headers {
            request = request.header(name, value);
        }
        let response = request.body(call.body.clone().unwrap_or_default()).send().await?;
        reply.status = response.status().as_u16();
        for place in ["location", "content-location"] {
            self.note_render(response.headers().get(place).and_then(|v| v.to_str().ok()));
        }
        for (name, value) in response.headers() {
            let value = String::from_utf8_lossy(value.as_bytes());
            if let Some(value) = mask::header(name.as_str(), &value) {
                let value = mask::ids(&value, &self.renders);
                reply.headers.entry(name.to_string()).and_modify(|v| *v += &format!(", {value}")).or_insert(value);
            }
        }
        reply.body = response.bytes().await?.to_vec();
        Ok(())
    }

    fn note_render(&mut self, place: Option<&str>) {
        let id = place.and_then(|place| place.strip_prefix("/v1/renders/"));
        if let Some(id) = id.filter(|id| !self.renders.iter().any(|known| known == id)) {
            self.renders.push(id.to_owned());
        }
    }

    fn masked(&self, reply: Reply) -> Reply {
        let body = mask::body(&reply, &self.renders);
        Reply { body, ..reply }
    }
}
