//! Permitted and refused requests; volumes of very few voxels; empty pictures, with a warning; the manual's example.

use cloudchamber::error::Error;
use cloudchamber::technique::isosurface;
use serde_json::{Value, json};

use crate::common::engine::House;

#[test]
fn what_makes_no_sense_is_refused_by_its_name() {
    let house = House::shared();
    let twice = json!([{"isovalue": 1}, {"isovalue": 2}, {"isovalue": 1}]);
    for (parameters, pointer) in [
        (json!({"isovalue": "high"}), "/isosurface/isovalue"),
        (json!({"surfaces": []}), "/isosurface/surfaces"),
        (json!({"surfaces": twice}), "/isosurface/surfaces/2/isovalue"),
        (json!({"surfaces": [{"isovalue": 1}], "isovalue": 1}), "/isosurface/isovalue"),
        (json!({"surfaces": [{"isovalue": 1}], "opacity": 0.5}), "/isosurface/opacity"),
        (json!({"surfaces": [{"isovalue": 1, "opacity": 2}]}), "/isosurface/surfaces/0/opacity"),
        (json!({"opacity": 0}), "/isosurface/opacity"),
        (json!({"color": [1, 1, 2]}), "/isosurface/color/2"),
        (json!({"interpolation": "nearest"}), "/isosurface/interpolation"),
        (json!({"interpolation": "b_spline", "sampling": "nearest"}), "/isosurface/interpolation"),
        (json!({"sampling": "nearest", "opacity": 0.5}), "/isosurface/sampling"),
        (json!({"step_voxels": 0}), "/isosurface/step_voxels"),
        (json!({"ambient_occlusion": {"rays": 0}}), "/isosurface/ambient_occlusion/rays"),
        (json!({"ambient_occlusion": {"radius": -1}}), "/isosurface/ambient_occlusion/radius"),
        (json!({"light": {"direction": [0, 0, 0]}}), "/isosurface/light/direction"),
        (json!({"normals": "smooth"}), "/isosurface/normals"),
        (json!({"iso_value": 1}), "/isosurface/iso_value"),
    ] {
        let body = json!({"technique": "isosurface", "volume": {"builtin": "sphere", "resolution": 8}, "isosurface": parameters});
        match house.scene(&body) {
            Err(Error::Invalid(violations)) => assert_eq!(violations[0].pointer, pointer, "{body}"),
            other => panic!("{body}: {:?}", other.err()),
        }
    }
}

fn request(volume: &Value, parameters: &Value) -> Value {
    json!({"technique": "isosurface", "volume": volume, "image": {"width": 24, "height": 20}, "budget": {"samples": 2}, "isosurface": parameters})
}

/// True if the reply has a warning of this code, and true if the picture shows anything.
fn warned(body: &Value, code: &str) -> (bool, bool) {
    let job = House::shared().finish(body);
    let resource = job.resource();
    let warnings = resource["warnings"].as_array().unwrap().clone();
    let film = House::shared().film_of(&job);
    assert!(film.main.mean.iter().all(|v| v.is_finite()));
    (warnings.iter().any(|w| w["code"] == code), film.main.mean.iter().any(|v| *v != 0.0))
}

#[test]
fn an_isovalue_that_no_voxel_reaches_is_an_empty_picture_and_a_warning() {
    let sphere = json!({"builtin": "sphere", "resolution": 16});
    for (isovalue, outside) in [(0.5, false), (1.5, true), (-0.1, true)] {
        let (warned, seen) = warned(&request(&sphere, &json!({"isovalue": isovalue})), "isovalue_outside_range");
        assert_eq!((warned, seen), (outside, !outside), "{isovalue}");
    }
    let mixed = json!({"surfaces": [{"isovalue": 0.5}, {"isovalue": 7}]});
    assert_eq!(warned(&request(&sphere, &mixed), "isovalue_outside_range"), (true, true));
}

#[test]
fn planes_that_remove_everything_leave_an_empty_picture_and_a_warning() {
    let mut body = request(&json!({"builtin": "sphere", "resolution": 16}), &json!({"isovalue": 0.5}));
    body["clip"] = json!({"planes": [{"normal": [1, 0, 0], "point": [2, 0, 0]}]});
    assert_eq!(warned(&body, "clipped_away"), (true, false));
    body["clip"] = json!({"planes": [{"normal": [1, 0, 0], "point": [0, 0, 0]}]});
    assert_eq!(warned(&body, "clipped_away"), (false, true));
}

#[test]
fn hardly_any_voxels_and_voxels_that_are_no_numbers_are_rendered_as_what_they_are() {
    let house = House::shared();
    let looks = [
        json!({"isovalue": 0.5}),
        json!({"isovalue": 0.5, "ambient_occlusion": {}, "normals": "analytic"}),
        json!({"isovalue": 0.5, "sampling": "nearest"}),
        json!({"isovalue": 0.5, "interpolation": "b_spline"}),
        json!({"surfaces": [{"isovalue": 0.5, "opacity": 0.5}, {"isovalue": 0.2}]}),
    ];
    for dims in [[1, 1, 1], [1, 5, 7], [6, 1, 4], [5, 3, 1], [2, 2, 2]] {
        let volume = house.floats(dims, |x, y, z| 0.55 + 0.3 * (x + y + z));
        // A single voxel of 0.55 has no surface at 0.5 if it is interpolated. Without interpolation it is above.
        let single = dims == [1, 1, 1];
        for look in &looks {
            let is_seen = !single || look["sampling"] == "nearest";
            let found = warned(&request(&volume, look), "isovalue_outside_range");
            assert_eq!(found, (single, is_seen), "{dims:?}, {look}");
        }
    }
    // A ramp with a hole of NaN has a surface on both sides of the hole and none around it.
    let hole = house.floats([16; 3], |x, y, z| if x.abs() < 0.3 && y.abs() < 0.3 { f64::NAN } else { 0.5 + 0.5 * z });
    let none = house.floats([16; 3], |_, _, z| if z > 0.0 { f64::NAN } else { 0.1 });
    for look in &looks {
        assert_eq!(warned(&request(&hole, look), "non_finite_voxels"), (true, true), "{look}");
        assert_eq!(warned(&request(&none, &json!({"isovalue": 0.05})), "non_finite_voxels"), (true, false));
    }
}

#[test]
fn the_manuals_example_is_a_picture() {
    let (_, error) = House::shared().film(&isosurface::example());
    let bytes = House::shared().picture(&isosurface::example());
    assert!(bytes.iter().any(|b| *b > 100) && bytes.contains(&0), "a lit surface before black");
    assert!(error.total.unwrap() < 0.5, "{error:?}");
}
