//! Leaves out the parts of a reply that differ from run to run: ids, times, and the texts for people.

use serde_json::{Value, json};

use super::answer::Reply;

/// The headers with times, durations and sizes.
const HEADERS: [&str; 6] = [
    "date",
    "content-length",
    "transfer-encoding",
    "connection",
    "x-cloudchamber-elapsed-ms",
    "x-cloudchamber-device-ms",
];
/// Texts for people.
const TEXTS: [&str; 4] = ["detail", "message", "failure", "tracking_reason"];
/// Lists of texts for people.
const LISTS_OF_TEXTS: [&str; 1] = ["reasons"];

/// A header's value, if it is compared.
pub fn header(name: &str, value: &str) -> Option<String> {
    (!HEADERS.contains(&name)).then(|| value.to_owned())
}

/// A text with the numbers of renders in place of their ids.
pub fn ids(text: &str, renders: &[String]) -> String {
    renders.iter().enumerate().fold(text.to_owned(), |text, (i, id)| text.replace(id.as_str(), &format!("render {i}")))
}

/// A body with the numbers of renders in place of their ids, and without times.
pub fn body(reply: &Reply, renders: &[String]) -> Vec<u8> {
    if let Some(json) = reply.json() {
        let text = ids(&json.to_string(), renders);
        let json = serde_json::from_str(&text).unwrap_or(json);
        return masked("", &json).to_string().into_bytes();
    }
    match reply.media() {
        "text/event-stream" => events(&ids(&String::from_utf8_lossy(&reply.body), renders)).into_bytes(),
        "multipart/x-mixed-replace" => without_times(&reply.body),
        _ => reply.body.clone(),
    }
}

/// True if a field has a time or a duration. A budget's time is part of the request and stays.
fn is_time(key: &str) -> bool {
    (key.ends_with("_ms") && key != "time_ms") || ["created_unix_s", "trace_slope", "photons_per_ms"].contains(&key)
}

/// The value of a field without times and texts. Of a trace, only the last point stays, since the number of points depends on the time.
fn masked(key: &str, value: &Value) -> Value {
    match value {
        _ if is_time(key) => json!("a time"),
        Value::String(_) if TEXTS.contains(&key) => json!("a text"),
        Value::Array(items) if LISTS_OF_TEXTS.contains(&key) => items.iter().map(|_| json!("a text")).collect(),
        Value::Array(items) if key == "trace" => items.last().map(|last| masked("", last)).into_iter().collect(),
        Value::Array(items) => {
            let mut items: Vec<Value> = items.iter().map(|v| masked("", v)).collect();
            if key == "volumes" {
                // Entries that came in the same second are in no order.
                items.sort_by_key(|v| v["reference"].to_string());
            }
            Value::Array(items)
        }
        Value::Object(fields) => fields.iter().map(|(key, v)| (key.clone(), masked(key, v))).collect(),
        other => other.clone(),
    }
}

/// Server-sent events without the numbers of frames, which depend on the time.
fn events(text: &str) -> String {
    let line = |line: &str| match line.split_once(": ") {
        Some(("id", _)) => "id".to_owned(),
        Some(("data", data)) => serde_json::from_str(data).map_or(line.to_owned(), |d| masked("", &d).to_string()),
        _ => line.to_owned(),
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

/// The parts of a stream without the header that has their time.
fn without_times(bytes: &[u8]) -> Vec<u8> {
    let name = b"X-Cloudchamber-Elapsed-Ms: ";
    let is_time = |line: &&[u8]| line.starts_with(name);
    bytes.split_inclusive(|b| *b == b'\n').filter(|line| !is_time(line)).flatten().copied().collect()
}
