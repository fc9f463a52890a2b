//! Content negotiation: the best type that can be made, by the quality values of `Accept` (RFC 9110, 12.5.1).

use axum::http::{HeaderMap, header};
use mime::Mime;

use crate::error::{Error, Result};

/// The fit of a media range to a type: 2 if exact, 1 by the main type, 0 for anything; `None` if it does not fit.
fn fit(range: &Mime, offer: &str) -> Option<u8> {
    let (main, sub) = offer.split_once('/')?;
    match (range.type_().as_str(), range.subtype().as_str()) {
        ("*", "*") => Some(0),
        (m, "*") if m == main => Some(1),
        (m, s) if m == main && (s == sub || range.essence_str() == offer) => Some(2),
        _ => None,
    }
}

/// The offer that the client prefers; the first offer if it has no preference.
///
/// # Errors
/// [`Error::NotAcceptable`] when it accepts none.
pub fn negotiate(headers: &HeaderMap, offers: &[&'static str]) -> Result<&'static str> {
    let ranges: Vec<Mime> = headers
        .get_all(header::ACCEPT)
        .iter()
        .filter_map(|v| v.to_str().ok())
        .flat_map(|v| v.split(','))
        .filter_map(|range| range.trim().parse().ok())
        .collect();
    if ranges.is_empty() {
        return offers.first().copied().ok_or_else(|| Error::internal("nothing to negotiate"));
    }
    let quality = |range: &Mime| range.get_param("q").and_then(|q| q.as_str().parse::<f32>().ok()).unwrap_or(1.0);
    // The most specific range that fits an offer gives its quality.
    let liked = |offer: &str| {
        ranges
            .iter()
            .filter_map(|r| fit(r, offer).map(|f| (f, quality(r))))
            .max_by_key(|(f, _)| *f)
            .map_or(0.0, |(_, q)| q)
    };
    let mut best = None;
    for offer in offers {
        let q = liked(offer);
        if q > 0.0 && best.is_none_or(|(_, b)| q > b) {
            best = Some((*offer, q));
        }
    }
    best.map(|(offer, _)| offer).ok_or_else(|| Error::NotAcceptable(offers.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    const OFFERS: [&str; 3] = ["application/json", "image/png", "multipart/x-mixed-replace"];

    fn chosen(accept: &str) -> Option<&'static str> {
        let mut headers = HeaderMap::new();
        headers.insert(header::ACCEPT, accept.parse().ok()?);
        negotiate(&headers, &OFFERS).ok()
    }

    #[test]
    fn the_best_liked_offer_wins() {
        for (accept, expected) in [
            ("*/*", Some("application/json")),
            ("image/png", Some("image/png")),
            ("image/*", Some("image/png")),
            ("application/json;q=0.2, image/png;q=0.9", Some("image/png")),
            ("*/*, application/json;q=0", Some("image/png")),
            ("text/html, image/webp, */*;q=0.1", Some("application/json")),
            ("multipart/x-mixed-replace", Some("multipart/x-mixed-replace")),
            ("text/html", None),
        ] {
            assert_eq!(chosen(accept), expected, "for {accept}");
        }
    }
}
