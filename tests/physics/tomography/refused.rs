//! Requests that are refused, with the field that is wrong.

use cloudchamber::error::Error;
use serde_json::{Value, json};

use crate::common::engine::House;

#[test]
fn wrong_reconstructions_are_refused_at_their_field() {
    let at = "/volume/fbp/sinogram/projection";
    let geometry = |g: Value| json!({"sinogram": {"projection": {"geometry": g}}});
    for (own, pointer) in [
        (geometry(json!({"detector": {"count": [0, 1]}})), format!("{at}/geometry/detector/count/0")),
        (geometry(json!({"detector": {"spacing_mm": [0, 1]}})), format!("{at}/geometry/detector/spacing_mm/0")),
        (geometry(json!({"angles_deg": []})), format!("{at}/geometry/angles_deg")),
        (geometry(json!({"angles_deg": {"count": 1_000_000}})), format!("{at}/geometry/angles_deg")),
        (geometry(json!({"angles_deg": {"from": 30, "to": 30}})), format!("{at}/geometry/angles_deg/to")),
        (geometry(json!({"type": "spiral"})), format!("{at}/geometry/type")),
        (json!({"grid": {"dims": [0, 4, 4]}}), "/volume/fbp/grid/dims/0".into()),
        (json!({"grid": {"center_mm": [0, 0, 50]}}), "/volume/fbp/grid".into()),
        (json!({"filter": "ramp"}), "/volume/fbp/filter".into()),
        (json!({"cutoff": 0}), "/volume/fbp/cutoff".into()),
        (json!({"sinogram": {"projection": {"of": {"phantom": {}}}}}), format!("{at}/of/phantom")),
        (
            json!({"sinogram": {"projection": {"of": {"phantom": {"name": "shepp_logan", "greys": "brown"}}}}}),
            format!("{at}/of/phantom/greys"),
        ),
    ] {
        let request = json!({"technique": "slice", "volume": {"fbp": own}});
        match House::shared().scene(&request) {
            Err(Error::Invalid(all)) => {
                assert!(all.iter().any(|v| v.pointer == pointer), "{own}: {all:?}, not {pointer}")
            }
            other => panic!("{own}: {:?}", other.err()),
        }
    }
    let large = json!({"technique": "slice", "volume": {"fbp": geometry(json!({"angles_deg": {"count": 60_000}, "detector": {"count": [8000, 8000]}}))}});
    assert!(matches!(House::shared().scene(&large), Err(Error::TooLarge { .. })));
    // Deblurring takes four times the grid.
    for (deconvolve, is_refused) in [(false, false), (true, true)] {
        let own = json!({"deconvolve": deconvolve, "grid": {"dims": [2048, 2048, 32], "spacing_mm": [1, 1, 0.01]}});
        let found = House::shared().scene(&json!({"technique": "slice", "volume": {"backprojection": own}}));
        assert_eq!(matches!(found, Err(Error::TooLarge { .. })), is_refused, "{deconvolve}");
    }
}
