//! The command line's side of the HTTP contract: it posts a scene, follows its frames, and fetches the last one.

use std::time::Duration;

use futures_util::StreamExt;
use serde_json::Value;

use crate::error::{Error, Result};

/// The number of attempts while the queue is full.
const RETRIES: u32 = 20;

/// The id in a reply.
async fn id_of(reply: reqwest::Response) -> Result<String> {
    let reply: Value = reply.json().await.map_err(Error::internal)?;
    reply["id"].as_str().map(str::to_owned).ok_or_else(|| Error::internal("the server gave no id"))
}

/// A client of a running server.
pub struct Client {
    base: String,
    http: reqwest::Client,
    token: Option<String>,
}

impl Client {
    /// A client of the server at `base`, such as `http://127.0.0.1:8080`.
    ///
    /// # Errors
    /// [`Error::Internal`] when no HTTP client can be made.
    pub fn new(base: &str, token: Option<String>) -> Result<Self> {
        let http =
            reqwest::Client::builder().connect_timeout(Duration::from_secs(10)).build().map_err(Error::internal)?;
        Ok(Self { base: base.trim_end_matches('/').to_owned(), http, token })
    }

    async fn send(
        &self,
        method: reqwest::Method,
        path: &str,
        body: Option<reqwest::Body>,
        kind: &str,
    ) -> Result<reqwest::Response> {
        for attempt in 0..RETRIES {
            let mut request = self.http.request(method.clone(), format!("{}{path}", self.base));
            if let Some(token) = &self.token {
                request = request.bearer_auth(token);
            }
            if let Some(body) = &body {
                let bytes = body.as_bytes().map(<[u8]>::to_vec).unwrap_or_default();
                request = request.header("Content-Type", kind).body(bytes);
            }
            let response = request.send().await.map_err(|e| Error::internal(format!("{}: {e}", self.base)))?;
            if response.status().is_success() {
                return Ok(response);
            }
            let retry = response.headers().get("retry-after").and_then(|v| v.to_str().ok()?.parse::<u64>().ok());
            if let (429, Some(seconds), true) = (response.status().as_u16(), retry, attempt + 1 < RETRIES) {
                tokio::time::sleep(Duration::from_secs(seconds.clamp(1, 60))).await;
                continue;
            }
            return Err(refusal(response).await);
        }
        Err(Error::Unavailable("the server's queue stays full".into()))
    }

    /// Uploads a file to `path` and returns its id.
    ///
    /// # Errors
    /// The server's refusal in its words.
    pub async fn upload(&self, path: &str, bytes: Vec<u8>) -> Result<String> {
        let reply = self.send(reqwest::Method::POST, path, Some(bytes.into()), "application/octet-stream").await?;
        id_of(reply).await
    }

    /// Uploads a form of files to `path` and returns its id.
    ///
    /// # Errors
    /// The server's refusal in its words.
    pub async fn upload_form(&self, path: &str, form: reqwest::multipart::Form) -> Result<String> {
        let mut request = self.http.post(format!("{}{path}", self.base)).multipart(form);
        if let Some(token) = &self.token {
            request = request.bearer_auth(token);
        }
        let reply = request.send().await.map_err(|e| Error::internal(format!("{}: {e}", self.base)))?;
        if reply.status().is_success() { id_of(reply).await } else { Err(refusal(reply).await) }
    }

    /// Posts a render or an export to `path` and follows it to its end, event by event. Returns the bytes behind its `link`, and its resource.
    ///
    /// # Errors
    /// The server's refusal in its words, or the state in which it ended.
    pub async fn run(
        &self,
        path: &str,
        request: &Value,
        link: &str,
        mut event: impl FnMut(&Value),
    ) -> Result<(Vec<u8>, Value)> {
        let body = request.to_string().into_bytes();
        let reply = self.send(reqwest::Method::POST, path, Some(body.into()), "application/json").await?;
        let reply: Value = reply.json().await.map_err(Error::internal)?;
        let to = |link: &str| {
            let found = reply["links"][link].as_str().map(str::to_owned);
            found.ok_or_else(|| Error::internal("the server gave no link"))
        };
        let events = self.send(reqwest::Method::GET, &to("events")?, None, "").await?;
        self.follow(events, &mut event).await?;
        let resource = self.send(reqwest::Method::GET, &to("self")?, None, "").await?;
        let resource: Value = resource.json().await.map_err(Error::internal)?;
        if resource["state"] != "done" {
            return Err(Error::Conflict(format!("it is {}: {}", resource["state"], resource["failure"])));
        }
        let made = self.send(reqwest::Method::GET, &to(link)?, None, "").await?;
        Ok((made.bytes().await.map_err(Error::internal)?.to_vec(), resource))
    }

    /// Reads server-sent events until the stream ends.
    async fn follow(&self, events: reqwest::Response, told: &mut impl FnMut(&Value)) -> Result<()> {
        let mut pending = String::new();
        let mut stream = events.bytes_stream();
        while let Some(piece) = stream.next().await {
            pending += &String::from_utf8_lossy(&piece.map_err(Error::internal)?);
            while let Some(end) = pending.find("\n\n") {
                let event: String = pending.drain(..end + 2).collect();
                let Some(data) = event.lines().find_map(|l| l.strip_prefix("data: ")) else { continue };
                let Ok(data) = serde_json::from_str::<Value>(data) else { continue };
                told(&data);
            }
        }
        Ok(())
    }
}

/// A problem document as an error in the server's own words.
async fn refusal(response: reqwest::Response) -> Error {
    let status = response.status();
    let problem: Value = response.json().await.unwrap_or_default();
    let detail = problem["detail"].as_str().unwrap_or("no explanation");
    Error::Malformed(format!("the server answered {status}: {detail}"))
}

/// Asks `/healthz` once, without any proxy.
///
/// # Errors
/// [`Error::Unavailable`] with the reason.
pub async fn healthcheck(base: &str) -> Result<()> {
    let client =
        reqwest::Client::builder().timeout(Duration::from_secs(5)).no_proxy().build().map_err(Error::internal)?;
    let url = format!("{}/healthz", base.trim_end_matches('/'));
    let response = client.get(&url).send().await.map_err(|e| Error::Unavailable(format!("{url}: {e}")))?;
    if response.status().is_success() {
        Ok(())
    } else {
        Err(Error::Unavailable(format!("{url} answered {}", response.status())))
    }
}
