//! The differences of two replies, each in a line.

use std::collections::BTreeSet;

use serde_json::Value;

use super::answer::{Compare, Reply};
use super::formats;

/// The number of characters of a value for which a line has room.
const SHOWN: usize = 90;
/// The parts of a plan that may differ from run to run.
const CHOSEN: [&str; 2] = ["request", "options"];

fn shown(value: &str) -> String {
    let short: String = value.chars().take(SHOWN).collect();
    if short.len() < value.len() { short + "…" } else { short }
}

/// Every difference of two replies whose ids and times are left out.
pub fn of(old: &Reply, new: &Reply) -> Vec<String> {
    let mut found = Vec::new();
    if old.status != new.status {
        let words = |reply: &Reply| format!("{} {}", reply.status, shown(&String::from_utf8_lossy(&reply.body)));
        found.push(format!("status {}, now {}", words(old), words(new)));
        return found;
    }
    let names: BTreeSet<&String> = old.headers.keys().chain(new.headers.keys()).collect();
    for name in names {
        let [a, b] = [old, new].map(|reply| reply.headers.get(name).map_or("none", String::as_str));
        // The body determines the tag. If a picture depends on measured times, its error does too.
        let is_of_body = name == "etag" || (name.starts_with("x-cloudchamber-") && old.compare == Compare::Head);
        if a != b && !is_of_body {
            found.push(format!("header {name}: {}, now {}", shown(a), shown(b)));
        }
    }
    match (old.compare, old.json(), new.json()) {
        (Compare::Head, ..) => {}
        (Compare::All, Some(a), Some(b)) => walk("", &a, &b, &mut found),
        (Compare::Shape, Some(a), Some(b)) => walk_shapes("", &a, &b, &mut found),
        (..) if old.body != new.body => found.extend(formats::differences(old.media(), &old.body, &new.body)),
        _ => {}
    }
    found
}

/// Walks through two values and collects their differences, by JSON pointer.
pub fn walk(at: &str, old: &Value, new: &Value, found: &mut Vec<String>) {
    match (old, new) {
        (Value::Object(a), Value::Object(b)) => {
            let keys: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
            for key in keys {
                let at = format!("{at}/{}", key.replace('~', "~0").replace('/', "~1"));
                match (a.get(key), b.get(key)) {
                    (Some(a), Some(b)) => walk(&at, a, b, found),
                    (Some(a), None) => found.push(format!("{at}: {}, now missing", shown(&a.to_string()))),
                    (_, b) => {
                        found.push(format!("{at}: new, {}", shown(&b.map_or_else(String::new, Value::to_string))))
                    }
                }
            }
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            a.iter().zip(b).enumerate().for_each(|(i, (a, b))| walk(&format!("{at}/{i}"), a, b, found));
        }
        (Value::Array(a), Value::Array(b)) => found.push(format!("{at}: {} elements, now {}", a.len(), b.len())),
        _ if old == new => {}
        _ => found.push(format!("{at}: {}, now {}", shown(&old.to_string()), shown(&new.to_string()))),
    }
}

/// Collects the fields that differ, or whose types differ. A field that may be missing is of any type, and one that a plan chose is of any shape.
fn walk_shapes(at: &str, old: &Value, new: &Value, found: &mut Vec<String>) {
    let kind = |value: &Value| match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(_) => "number",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    };
    match (old, new) {
        (Value::Null, _) | (_, Value::Null) => {}
        (Value::Object(a), Value::Object(b)) => {
            let keys: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
            for key in keys.into_iter().filter(|key| !CHOSEN.contains(&key.as_str())) {
                match (a.get(key), b.get(key)) {
                    (Some(a), Some(b)) => walk_shapes(&format!("{at}/{key}"), a, b, found),
                    (Some(_), None) => found.push(format!("{at}/{key}: now missing")),
                    _ => found.push(format!("{at}/{key}: new")),
                }
            }
        }
        _ if kind(old) == kind(new) => {}
        _ => found.push(format!("{at}: {}, now {}", kind(old), kind(new))),
    }
}
