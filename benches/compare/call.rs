//! One call of the list, ready to be sent.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::answer::Compare;
use crate::common::pictures;

/// The values of names in paths, headers and JSON: `{u8}` is the id of a test volume, `{0}` that of the entry's first render, and `{last}` the last
/// id of a reply.
pub type Names = BTreeMap<String, String>;

/// A call.
pub struct Call {
    pub method: reqwest::Method,
    /// The method and the path, as the list has them.
    pub label: String,
    pub path: String,
    pub headers: Vec<(String, String)>,
    pub body: Option<Vec<u8>>,
    pub compare: Compare,
}

/// The text with its names replaced by their values.
fn filled(text: &str, names: &Names) -> String {
    names.iter().fold(text.to_owned(), |text, (name, id)| text.replace(&format!("{{{name}}}"), id))
}

/// Bytes that are 0 except at the places `at`, which are given in hexadecimal digits.
fn sparse(bytes: &Value) -> Vec<u8> {
    let mut made = vec![0; bytes["length"].as_u64().unwrap() as usize];
    for (at, digits) in bytes["at"].as_object().into_iter().flatten() {
        let (at, digits) = (at.parse::<usize>().unwrap(), digits.as_str().unwrap());
        for (i, pair) in digits.as_bytes().chunks(2).enumerate() {
            // The bytes beyond the end of a file that is cut short are left out.
            if let Some(byte) = made.get_mut(at + i) {
                *byte = u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
            }
        }
    }
    made
}

impl Call {
    /// Reads a call of the list: `path`, and if necessary `method`, `headers`, `compare` and a body as `json`, `text` or `bytes`. With a body it is
    /// a POST, else a GET.
    pub fn new(said: &Value, names: &Names) -> Self {
        let json = said.get("json").map(|json| {
            let json = pictures::with_ids(json, &|name| names[name].clone());
            filled(&json.to_string(), names).into_bytes()
        });
        let text = || said["text"].as_str().map(|text| text.as_bytes().to_vec());
        let body = json.clone().or_else(text).or_else(|| said.get("bytes").map(sparse));
        let method = said["method"].as_str().unwrap_or(if body.is_some() { "POST" } else { "GET" });
        let path = said["path"].as_str().unwrap_or_else(|| panic!("a call without a path: {said}"));
        let given = said["headers"].as_object().into_iter().flatten();
        let mut headers: Vec<(String, String)> =
            given.map(|(name, value)| (name.clone(), filled(value.as_str().unwrap(), names))).collect();
        if json.is_some() && said["headers"].get("Content-Type").is_none() {
            headers.push(("Content-Type".into(), "application/json".into()));
        }
        Self {
            method: method.parse().unwrap(),
            label: format!("{method} {path}"),
            path: filled(path, names),
            headers,
            body,
            compare: Compare::of(said),
        }
    }

    /// A GET of a path.
    pub fn get(path: &str, names: &Names, compare: Compare) -> Self {
        Self { compare, ..Self::new(&json!({"path": path}), names) }
    }
}
