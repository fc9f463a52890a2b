//! Every kernel variant that may be built is what some request asks for, and runs: for each of them a picture of a few pixels, which
//! is the same whatever the type of the voxels.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test says what is wrong by panicking")]

mod common;

use std::collections::BTreeSet;

use cloudchamber::render::Subject;
use cloudchamber::technique;
use cloudchamber::volume::RawQuery;
use common::engine::House;
use common::processes::in_processes;
use serde_json::{Value, json};

const SIDE: usize = 8;

/// Whole numbers from 0 to 200, the same in every type of voxels.
fn volumes(house: &House, value: impl Fn(usize) -> u8) -> Vec<String> {
    let values: Vec<u8> = (0..SIDE.pow(3)).map(value).collect();
    let of = |name: &str, bytes: Vec<u8>| {
        let query = RawQuery {
            dims: Some(format!("{SIDE},{SIDE},{SIDE}")),
            r#type: Some(name.into()),
            spacing: None,
            endian: None,
        };
        house.store().insert(bytes, name, query.parse().unwrap()).unwrap().1
    };
    vec![
        of("u8", values.clone()),
        of("i16", values.iter().flat_map(|v| i16::from(*v).to_le_bytes()).collect()),
        of("u16", values.iter().flat_map(|v| u16::from(*v).to_le_bytes()).collect()),
        of("f32", values.iter().flat_map(|v| f32::from(*v).to_le_bytes()).collect()),
    ]
}

/// Parameters of views that reach all of their variants between them, by technique.
fn views() -> Vec<(&'static str, Value)> {
    let mut all = Vec::new();
    for interpolation in ["nearest", "trilinear", "b_spline", "catmull_rom"] {
        let with = |more: Value| {
            let mut own = more;
            own["interpolation"] = json!(interpolation);
            own
        };
        for more in [json!({}), json!({"shading": true}), json!({"silhouette": {}})] {
            all.push(("emission_absorption", with(more)));
        }
        let half = json!([{"isovalue": 60, "opacity": 0.5}, {"isovalue": 120}]);
        for more in [json!({"isovalue": 90}), json!({"surfaces": half})] {
            if interpolation != "nearest" {
                all.push(("isosurface", with(more)));
            }
        }
        for more in [json!({"mode": "maximum", "exact": false}), json!({"mode": "mean"})] {
            all.push(("projection", with(more)));
        }
        all.push(("slice", with(json!({}))));
    }
    all.push(("isosurface", json!({"isovalue": 90, "sampling": "nearest"})));
    for shading in [false, true] {
        all.push(("emission_absorption", json!({"shading": shading, "order": "back_to_front"})));
        all.push(("emission_absorption", json!({"shading": shading, "pre_integrated": true})));
    }
    for technique in ["single_scatter", "volume_path"] {
        for interpolation in ["nearest", "trilinear"] {
            for tracking in ["march", "delta", "weighted"] {
                all.push((technique, json!({"tracking": tracking, "interpolation": interpolation})));
            }
        }
        all.push((technique, json!({"tracking": "exact", "interpolation": "nearest"})));
    }
    all
}

/// Simulations that reach all of theirs, with the id of a volume.
fn fields(labels: &str) -> Vec<Value> {
    let light = json!({"mu_a_per_mm": 1, "mu_s_per_mm": 9});
    let gammas = json!({"phase": {"type": "klein_nishina"}, "attenuation": {"material": "water"}});
    let mut all = Vec::new();
    for (medium, trackers) in [(light, &["exact", "march", "delta", "weighted"][..]), (gammas, &["exact"])] {
        for tracking in trackers {
            let mut layer = medium.clone();
            layer["thickness_mm"] = json!(0.5);
            for place in [
                json!({"medium": medium, "size_mm": [1, 1, 1], "grid": [8, 8, 8]}),
                json!({"layers": [layer, layer], "grid": [4, 4, 4]}),
                json!({"labels": {"id": labels}, "media": [medium, medium]}),
                json!({"density": {"id": labels}, "medium": medium}),
            ] {
                let mut own = place;
                (own["tracking"], own["photons"]) = (json!(tracking), json!(200));
                all.push(own);
            }
        }
    }
    all
}

/// The mean luminance of a picture of a few pixels, after the label of the variant that it is made by is noted.
fn look(house: &House, request: &Value, reached: &mut BTreeSet<String>) -> f64 {
    let scene = house.scene(request).unwrap_or_else(|e| panic!("{request}: {e}"));
    match scene.subject() {
        Subject::Volume(volume) => reached.insert(scene.view().plan(volume).unwrap().variant.label()),
        Subject::Field(field, _) => reached.insert(field.kernels().unwrap()[0].label()),
    };
    let (film, _) = house.film(request);
    let values = film.main.mean.chunks_exact(4).map(|p| f64::from(p[0] + p[1] + p[2])).collect::<Vec<_>>();
    assert!(values.iter().all(|v| v.is_finite()), "{request}");
    values.iter().sum::<f64>() / values.len() as f64
}

fn request(technique: &str, own: &Value, volume: &Value) -> Value {
    json!({"technique": technique, technique: own, "volume": volume, "image": {"width": 8, "height": 6}, "budget": {"samples": 1}})
}

/// Runs requests that reach every variant of these techniques, and no other.
fn reach(techniques: &[&str]) {
    let house = House::shared();
    let mut reached = BTreeSet::new();
    let varied = volumes(house, |i| (i * 37 % 201) as u8);
    let even = volumes(house, |_| 9);
    for (technique, own) in views().into_iter().filter(|(technique, _)| techniques.contains(technique)) {
        // Through a box that is the same everywhere the way is another.
        let boxed = own["tracking"] == "exact";
        for ids in [Some(&varied), Some(&even).filter(|_| boxed)].into_iter().flatten() {
            let mut looked = |id: &String| look(house, &request(technique, &own, &json!({"id": id})), &mut reached);
            let means: Vec<f64> = ids.iter().map(&mut looked).collect();
            let apart = means.iter().map(|m| (m - means[3]).abs()).fold(0.0, f64::max);
            assert!(means[3] > 0.0 && apart <= 2e-4 * means[3], "{technique} {own}: {means:?} by types");
        }
    }
    if techniques.contains(&"photon_transport") {
        let labels = &volumes(house, |i| u8::from(i % 3 == 0))[0];
        let slab = json!({"mode": "maximum"});
        for own in fields(labels) {
            let request = request("projection", &slab, &json!({"photon_transport": own}));
            assert!(look(house, &request, &mut reached) > 0.0, "{own}: nothing is there");
        }
    }
    let listed = techniques.iter().flat_map(|name| ((technique::find(name).unwrap().source)().variants)());
    let all: BTreeSet<String> = listed.map(|v| v.label()).collect();
    let missed: Vec<_> = all.difference(&reached).collect();
    assert!(missed.is_empty(), "no request here runs {missed:#?}");
    assert!(reached.is_subset(&all), "what is run is in the list: {:?}", reached.difference(&all));
}

#[test]
fn every_variant_is_what_some_request_runs() {
    let half = ["emission_absorption", "isosurface"];
    in_processes("every_variant_is_what_some_request_runs", &["half", "the others"], |part| {
        let is_in = |name: &&str| half.contains(name) == (part == "half");
        reach(&technique::ALL.iter().map(|t| t.name).filter(is_in).collect::<Vec<_>>());
    });
}
