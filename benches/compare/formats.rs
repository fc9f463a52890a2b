//! The differences of two bodies whose bytes are not the same: by pixels and values, if their format is known.

use std::collections::BTreeMap;

use serde_json::Value;

use super::differences::walk;

/// The differences of two bodies of a media type.
pub fn differences(media: &str, old: &[u8], new: &[u8]) -> Vec<String> {
    let told = match media {
        "image/png" => png(old, new),
        "image/x-exr" => exr(old, new),
        "application/octet-stream" => nrrd(old, new),
        _ => text(old, new),
    };
    match told {
        // The blocks of an EXR have the order in which they were compressed, several at a time.
        Some(told) if told.is_empty() && media == "image/x-exr" => told,
        Some(told) if told.is_empty() => vec![format!("the same {media}, in other bytes")],
        Some(told) => told,
        None => vec![format!("{} bytes of {media}, now {} others", old.len(), new.len())],
    }
}

/// The number of values that differ, and their greatest difference.
fn apart(what: &str, old: &[f64], new: &[f64]) -> Option<String> {
    if old.len() != new.len() {
        return Some(format!("{what}: {} values, now {}", old.len(), new.len()));
    }
    let differs = |a: &f64, b: &f64| a != b && !(a.is_nan() && b.is_nan());
    let pairs: Vec<(f64, f64)> = old.iter().copied().zip(new.iter().copied()).filter(|(a, b)| differs(a, b)).collect();
    let most = pairs.iter().map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    (!pairs.is_empty()).then(|| format!("{what}: {} of {} values differ, by up to {most:.3e}", pairs.len(), old.len()))
}

fn png(old: &[u8], new: &[u8]) -> Option<Vec<String>> {
    let pixels = |bytes: &[u8]| -> Option<Vec<f64>> {
        Some(image::load_from_memory(bytes).ok()?.into_bytes().into_iter().map(f64::from).collect())
    };
    let mut told: Vec<String> = apart("pixels", &pixels(old)?, &pixels(new)?).into_iter().collect();
    let words = |bytes: &[u8]| -> Option<Value> {
        serde_json::from_str(&cloudchamber::frame::read_description(bytes).ok()?).ok()
    };
    walk("description ", &words(old)?, &words(new)?, &mut told);
    Some(told)
}

/// The contents of an EXR.
struct Film {
    /// The values of its channels, by name.
    channels: BTreeMap<String, Vec<f64>>,
    /// The description in its comments.
    words: Value,
    /// Its other attributes.
    others: String,
}

fn film(bytes: &[u8]) -> Option<Film> {
    use exr::prelude::*;
    let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let mut image = image.from_buffered(std::io::Cursor::new(bytes)).ok()?;
    let comments = image.layer_data.attributes.comments.take();
    let values = |c: &AnyChannel<FlatSamples>| c.sample_data.values_as_f32().map(f64::from).collect();
    Some(Film {
        channels: image.layer_data.channel_data.list.iter().map(|c| (c.name.to_string(), values(c))).collect(),
        words: comments.and_then(|text| serde_json::from_str(&text.to_string()).ok()).unwrap_or_default(),
        others: format!("{:?} {:?}", image.attributes, image.layer_data.attributes),
    })
}

fn exr(old: &[u8], new: &[u8]) -> Option<Vec<String>> {
    let [old, new] = [film(old)?, film(new)?];
    if !old.channels.keys().eq(new.channels.keys()) {
        return Some(vec![format!("channels {:?}, now {:?}", old.channels.keys(), new.channels.keys())]);
    }
    let channels = old.channels.iter();
    let mut told: Vec<String> = channels.filter_map(|(name, v)| apart(name, v, &new.channels[name])).collect();
    walk("description ", &old.words, &new.words, &mut told);
    told.extend((old.others != new.others).then(|| format!("attributes {}, now {}", old.others, new.others)));
    Some(told)
}

/// The header of a grid, and its values.
fn grid(bytes: &[u8]) -> Option<(&[u8], Vec<f64>)> {
    let start = bytes.windows(2).position(|w| w == b"\n\n")? + 2;
    let (header, data) = bytes.split_at(start);
    let (words, _) = data.as_chunks::<4>();
    Some((header, words.iter().map(|w| f64::from(f32::from_le_bytes(*w))).collect()))
}

fn nrrd(old: &[u8], new: &[u8]) -> Option<Vec<String>> {
    let ((old_header, old), (new_header, new)) = (grid(old)?, grid(new)?);
    let mut told = text(old_header, new_header)?;
    told.extend(apart("voxels", &old, &new));
    Some(told)
}

/// The first line that differs.
fn text(old: &[u8], new: &[u8]) -> Option<Vec<String>> {
    let [old, new] = [std::str::from_utf8(old).ok()?, std::str::from_utf8(new).ok()?];
    let lines = |text: &str| text.lines().map(str::to_owned).collect::<Vec<_>>();
    let [a, b] = [lines(old), lines(new)];
    let differs = |i: &usize| a.get(*i) != b.get(*i);
    let first = (0..a.len().max(b.len())).find(differs);
    let line = |lines: &[String], i: usize| -> String {
        lines.get(i).map_or("the end".into(), |line| line.chars().take(120).collect())
    };
    Some(first.map(|i| format!("line {}: {}, now {}", i + 1, line(&a, i), line(&b, i))).into_iter().collect())
}
