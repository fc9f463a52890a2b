//! Styles against closed forms, on fields with known gradients and curvatures.

use glam::{DVec3, dvec3};
use serde_json::{Value, json};

use crate::common::engine::House;

const SIDE: usize = 9;
const MIDDLE: usize = 4 * (SIDE * (SIDE / 2) + SIDE / 2);

fn white(sigma: f64) -> Value {
    json!({"points": [{"value": 0, "color": [1, 1, 1], "opacity_per_unit": sigma}]})
}

/// The middle pixel of `volume` seen along `-eye`, orthographic, one sample.
fn middle(volume: &Value, eye: DVec3, parameters: &Value) -> [f64; 4] {
    let up = if eye.normalize().y.abs() > 0.9 { [1, 0, 0] } else { [0, 1, 0] };
    let (film, _) = House::shared().film(&json!({
        "technique": "emission_absorption", "volume": volume, "image": {"width": SIDE, "height": SIDE}, "budget": {"samples": 1},
        "camera": {"eye": eye.to_array(), "up": up, "projection": "orthographic", "fov_y_deg": 3}, "emission_absorption": parameters
    }));
    std::array::from_fn(|c| f64::from(film.main.mean[MIDDLE + c]))
}

/// A field that rises by `slope` a unit along x.
fn ramp(slope: f64) -> Value {
    House::shared().floats([40, 40, 40], move |x, _, _| slope * x)
}

#[test]
fn opacity_is_times_the_gradient() {
    let volume = ramp(3.0);
    // The bounds are inside the outermost voxels' centres, where the field is not clamped yet.
    let own = json!({"transfer_function": white(0.2), "gradient_opacity": {"reference": 1.5}, "opacity_threshold": 1});
    let eye = dvec3(0.0, 0.0, 4.0);
    let alpha = middle(&volume, eye, &own)[3];
    let truth = 1.0 - (-2.0f64 * 0.2 * 2.0).exp();
    assert!((alpha - truth).abs() < 1e-3, "{alpha} for {truth}");
}

#[test]
fn a_silhouette_is_opaque_by_its_angle() {
    let volume = ramp(1.0);
    for degrees in [0.0f64, 30.0, 60.0, 90.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let eye = 4.0 * dvec3(cos, 0.0, sin);
        let own = json!({"transfer_function": white(0.3), "silhouette": {"base": 0.5, "gain": 2, "exponent": 3}, "opacity_threshold": 1});
        let alpha = middle(&volume, eye, &own)[3];
        // Over the middle 1.9 the field is linear. Near its two ends it is clamped, which is left out of the bound.
        let factor = 0.5 + 2.0 * (1.0 - cos).powi(3);
        let length = 2.0 / cos.max(sin);
        let truth = 1.0 - (-0.3 * factor * length).exp();
        assert!((alpha - truth).abs() < 0.02, "{degrees}°: {alpha} for {truth}");
    }
}

#[test]
fn tone_goes_from_cool_to_warm() {
    let volume = ramp(-1.0);
    // The normal points to lower values, here towards +x.
    for (towards, f) in [([1, 0, 0], 1.0), ([-1, 0, 0], 0.0), ([0, 1, 0], 0.5)] {
        let own = json!({"transfer_function": white(50.0), "tone": {"cool": [0, 0.1, 0.4], "warm": [0.5, 0.2, 0]},
                         "light": {"direction": towards}});
        let seen = middle(&volume, dvec3(0.2, 0.1, 4.0), &own);
        let truth = [0.5, 0.2, 0.0].map(|w| f * (w + 0.5));
        let cool = [0.0, 0.1, 0.4].map(|c| (1.0 - f) * (c + 0.25));
        for c in 0..3 {
            assert!((seen[c] - truth[c] - cool[c]).abs() < 5e-3, "{towards:?}: {seen:?}");
        }
    }
}

#[test]
fn light_comes_through_a_sheet() {
    let volume = ramp(-1.0);
    let light = |towards: [i32; 3]| json!({"direction": towards, "ambient": 0, "diffuse": 1, "specular": 0});
    let seen = |towards, amount: f64| {
        let own =
            json!({"transfer_function": white(80.0), "translucency": {"amount": amount}, "light": light(towards)});
        middle(&volume, dvec3(4.0, 0.1, 0.2), &own)[0]
    };
    for amount in [0.25, 0.6] {
        let (front, behind) = (seen([1, 0, 0], amount), seen([-1, 0, 0], amount));
        assert!((front - (1.0 - amount)).abs() < 0.01 && (behind - amount).abs() < 0.01, "{amount}: {front}, {behind}");
    }
}

#[test]
fn two_lights_are_the_sum_of_each() {
    let volume = ramp(-1.0);
    let seen = |light: Value| {
        middle(
            &volume,
            dvec3(2.0, 1.0, 4.0),
            &json!({"transfer_function": white(60.0), "shading": true, "light": light}),
        )
    };
    let one = |d: [f64; 3], c: [f64; 3]| seen(json!({"lights": [{"direction": d, "color": c}], "ambient": 0}));
    let (a, b) = (([1.0, 0.5, 0.2], [1.0, 0.2, 0.1]), ([0.3, -1.0, 0.6], [0.1, 0.5, 1.0]));
    let both =
        seen(json!({"lights": [{"direction": a.0, "color": a.1}, {"direction": b.0, "color": b.1}], "ambient": 0}));
    let (first, second) = (one(a.0, a.1), one(b.0, b.1));
    for c in 0..3 {
        assert!((both[c] - first[c] - second[c]).abs() < 2e-3 && both[c] > 0.05, "{both:?}, {first:?}, {second:?}");
    }
}

/// The middle of an opaque surface at `value`, coloured by curvature only.
fn curved(volume: &Value, value: f64, full: f64) -> [f64; 4] {
    let surface = json!({"points": [
        {"value": value - 0.02, "color": [0.5, 0.5, 0.5], "opacity_per_unit": 0}, {"value": value, "color": [0.5, 0.5, 0.5], "opacity_per_unit": 1e4}]});
    let own = json!({"transfer_function": surface, "curvature": {"full": full, "ridge": [1, 0, 0], "valley": [0, 0, 1]}, "step_voxels": 0.25});
    middle(volume, dvec3(0.0, 0.0, 4.0), &own)
}

#[test]
fn curvature_is_one_over_the_radius() {
    let house = House::shared();
    let radius = |x: f64, y: f64, z: f64| (x * x + y * y + z * z).sqrt();
    let bright = house.floats([64, 64, 64], move |x, y, z| 1.0 - radius(x, y, z));
    let dark = house.floats([64, 64, 64], radius);
    let cylinder = house.floats([64, 64, 64], |x, _, z| 1.0 - (x * x + z * z).sqrt());
    for r in [0.4, 0.7] {
        // At full = 2 / r a ridge is mixed in by half: red goes from 0.5 to 0.75, green and blue to 0.25.
        for (volume, what) in [(&bright, "sphere"), (&cylinder, "cylinder")] {
            let seen = curved(volume, 1.0 - r, 2.0 / r);
            assert!((seen[0] - 0.75).abs() < 0.02 && (seen[1] - 0.25).abs() < 0.02, "{what} of radius {r}: {seen:?}");
        }
        // From inside a bright shell the same surface is a valley. The shell is bright where the radius is large.
        let inside = curved(&dark, r, 2.0 / r);
        assert!(inside[3] > 0.9, "there is something to see: {inside:?}");
    }
    // The far side of the shell is seen through its clipped front.
    let surface = json!({"points": [{"value": 0.58, "color": [0.5, 0.5, 0.5], "opacity_per_unit": 0}, {"value": 0.6, "color": [0.5, 0.5, 0.5], "opacity_per_unit": 1e4}]});
    let (film, _) = house.film(&json!({"technique": "emission_absorption", "volume": dark, "image": {"width": SIDE, "height": SIDE}, "budget": {"samples": 1},
        "camera": {"eye": [0, 0, 4], "up": [0, 1, 0], "projection": "orthographic", "fov_y_deg": 3},
        "clip": {"planes": [{"normal": [0, 0, -1]}]},
        "emission_absorption": {"transfer_function": surface, "curvature": {"full": 2.0 / 0.6, "ridge": [1, 0, 0], "valley": [0, 0, 1]}, "step_voxels": 0.25}}));
    let seen = &film.main.mean[MIDDLE..MIDDLE + 4];
    assert!((seen[2] - 0.75).abs() < 0.03 && (seen[0] - 0.25).abs() < 0.03, "a valley: {seen:?}");
}

#[test]
fn regions_pick_by_value_and_gradient() {
    let volume = ramp(3.0);
    let eye = dvec3(0.0, 0.0, 4.0);
    let seen = |gradient: [f64; 2]| {
        let region = json!({"value": [-9, 9], "gradient": gradient, "color": [0.2, 0.6, 1], "opacity_per_unit": 0.7, "falloff": 0});
        middle(&volume, eye, &json!({"regions": [region], "opacity_threshold": 1}))
    };
    let alpha = 1.0 - (-0.7f64 * 2.0).exp();
    let inside = seen([2.5, 3.5]);
    for (c, colour) in [0.2, 0.6, 1.0].iter().enumerate() {
        assert!((inside[c] - colour * alpha).abs() < 2e-3, "{inside:?} for opacity {alpha}");
    }
    assert!(seen([3.6, 9.0])[3] == 0.0 && seen([0.0, 2.4])[3] == 0.0);
}
