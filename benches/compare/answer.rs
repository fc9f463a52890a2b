//! The answers of a server, and the compared part of each.

use std::collections::BTreeMap;

use serde_json::Value;

/// The compared part of a reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compare {
    /// All of it but times, ids and texts for people.
    All,
    /// The fields and their types, since they depend on measured times.
    Shape,
    /// The status and the headers.
    Head,
}

impl Compare {
    /// The part that an entry or a call asks for.
    pub fn of(said: &Value) -> Self {
        match said["compare"].as_str() {
            None => Self::All,
            Some("shape") => Self::Shape,
            Some("head") => Self::Head,
            Some(other) => panic!("\"compare\": \"{other}\"; there are shape and head"),
        }
    }

    /// The part for a reply that is no JSON, since that has no shape.
    pub fn of_bytes(self) -> Self {
        if self == Self::Shape { Self::Head } else { self }
    }
}

/// A reply to one call.
#[derive(Debug, Clone)]
pub struct Reply {
    /// The method and the path, as the list has them.
    pub label: String,
    /// The part of it that is compared.
    pub compare: Compare,
    /// The status, or 0 if there was no answer; the body then has the reason.
    pub status: u16,
    /// The headers by name, with ids and times left out.
    pub headers: BTreeMap<String, String>,
    pub body: Vec<u8>,
}

impl Reply {
    /// The media type without parameters.
    pub fn media(&self) -> &str {
        let declared = self.headers.get("content-type").map_or("", String::as_str);
        declared.split(';').next().unwrap_or_default().trim()
    }

    /// The body as JSON, if its content type says that it is.
    pub fn json(&self) -> Option<Value> {
        let media = self.media();
        let is_json = media == "application/json" || media.ends_with("+json");
        is_json.then(|| serde_json::from_slice(&self.body).ok()).flatten()
    }
}
