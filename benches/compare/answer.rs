//! What a server answers, and how much of it is compared.

use std::collections::BTreeMap;

use serde_json::Value;

/// How much of a reply is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compare {
    /// All of it but times, ids and texts for people.
    All,
    /// The fields and their types, for they depend on measured times.
    Shape,
    /// The status and the headers.
    Head,
}

impl Compare {
    /// What an entry or a call says of itself.
    pub fn of(said: &Value) -> Self {
        match said["compare"].as_str() {
            None => Self::All,
            Some("shape") => Self::Shape,
            Some("head") => Self::Head,
            Some(other) => panic!("\"compare\": \"{other}\"; there are shape and head"),
        }
    }

    /// The same for a reply that is no JSON: it has no shape.
    pub fn of_bytes(self) -> Self {
        if self == Self::Shape { Self::Head } else { self }
    }
}

/// A reply to one call.
#[derive(Debug, Clone)]
pub struct Reply {
    /// The method and the path, as the list has them.
    pub label: String,
    /// How much of it is compared.
    pub compare: Compare,
    /// 0 where there was no answer; the body then says why.
    pub status: u16,
    /// By name, with ids and times left out.
    pub headers: BTreeMap<String, String>,
    pub body: Vec<u8>,
}

impl Reply {
    /// The media type without parameters.
    pub fn media(&self) -> &str {
        let declared = self.headers.get("content-type").map_or("", String::as_str);
        declared.split(';').next().unwrap_or_default().trim()
    }

    /// The body as JSON, where it says that it is.
    pub fn json(&self) -> Option<Value> {
        let media = self.media();
        let is_json = media == "application/json" || media.ends_with("+json");
        is_json.then(|| serde_json::from_slice(&self.body).ok()).flatten()
    }
}
