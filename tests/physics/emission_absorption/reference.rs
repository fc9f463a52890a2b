//! The fast form against the plain reference form (one lane, back to front, every sample, every ray to its end), and the order of the errors in the
//! step.

use serde_json::{Value, json};

use crate::common::engine::House;
use crate::common::mri_head;

/// Numbers from 0 to 1 from a linear congruential generator (Knuth's MMIX).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f64 / (1u64 << 24) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    /// A few points, some of them empty, some nearly opaque.
    fn transfer_function(&mut self) -> Value {
        let count = 2 + (self.next() * 5.0) as usize;
        let mut value = self.between(-20.0, 60.0);
        let points: Vec<Value> = (0..count)
            .map(|_| {
                value += self.between(2.0, 70.0);
                let sigma = if self.next() < 0.4 { 0.0 } else { 10f64.powf(self.between(-3.0, 0.7)) };
                json!({"value": value, "color": [self.next(), self.next(), self.next()], "opacity_per_unit": sigma})
            })
            .collect();
        json!({"points": points})
    }

    fn camera(&mut self) -> Value {
        let far = self.between(40.0, 600.0);
        let (turn, up) = (self.between(0.0, std::f64::consts::TAU), self.between(-1.2, 1.2));
        let eye = [far * turn.cos() * up.cos(), far * turn.sin() * up.cos(), far * up.sin()];
        let target = [self.between(-30.0, 30.0), self.between(-30.0, 30.0), self.between(-30.0, 30.0)];
        let projection = if self.next() < 0.3 { "orthographic" } else { "perspective" };
        json!({"eye": eye, "target": target, "up": [0, 0.1, 1], "fov_y_deg": self.between(10.0, 90.0), "projection": projection})
    }
}

#[test]
fn skipping_ending_and_lanes_change_no_pixel_by_a_grey_level() {
    let (plain, fast) = (House::of_lanes(1), House::shared());
    let (there, here) = (plain.file(mri_head()), fast.file(mri_head()));
    let mut random = Random(11);
    let mut lit = 0;
    for case in 0..50 {
        let (function, camera) = (random.transfer_function(), random.camera());
        let scene = |volume: &Value, parameters: Value| {
            let mut own = json!({"transfer_function": function, "shading": case % 5 == 0});
            own.as_object_mut().unwrap().extend(parameters.as_object().unwrap().clone());
            json!({"technique": "emission_absorption", "volume": volume, "image": {"width": 44, "height": 40}, "camera": camera,
                   "budget": {"samples": 1}, "seed": case, "emission_absorption": own})
        };
        let (slow, _) = plain.film(&scene(&there, json!({"order": "back_to_front", "opacity_threshold": 1})));
        let (quick, _) = fast.film(&scene(&here, json!({})));
        let worst = slow.main.mean.iter().zip(&quick.main.mean).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst <= 1.0 / 255.0, "case {case}: {worst:e} with {function} from {camera}");
        lit += usize::from(slow.main.mean.iter().any(|v| *v > 0.05));
    }
    assert!(lit > 30, "only {lit} of 50 show anything");
}

/// The root mean square over the pixels of the difference from a step 64 times shorter, for steps of 8, 4, 2 and 1 voxels.
fn errors(parameters: &Value) -> Vec<f64> {
    let house = House::shared();
    // Neither value nor slope is 0 at the box's faces, so that the order is the method's own.
    let wave = |x: f64, y: f64, z: f64| 1.5 + (2.0 * x + 0.4).sin() * (1.7 * y).cos() + 0.6 * (2.3 * z + 0.2).sin();
    let volume = house.floats([64, 64, 64], wave);
    let film = |step_voxels: f64| {
        let mut own = json!({"step_voxels": step_voxels, "opacity_threshold": 1, "transfer_function": {"points": [
            {"value": -0.2, "color": [0.1, 0.9, 0.3], "opacity_per_unit": 0.1}, {"value": 1.4, "color": [0.9, 0.1, 0.2], "opacity_per_unit": 0.5},
            {"value": 3.2, "color": [0.1, 0.4, 1], "opacity_per_unit": 1.5}]}});
        own.as_object_mut().unwrap().extend(parameters.as_object().unwrap().clone());
        house.film(&json!({"technique": "emission_absorption", "volume": volume, "image": {"width": 32, "height": 32}, "budget": {"samples": 1},
            "camera": {"eye": [0.4, 0.3, 3], "up": [0, 1, 0], "fov_y_deg": 20}, "emission_absorption": own})).0
    };
    // The truth is of the second-order form, whose error at this step is far below all of them.
    let truth = house.film(&json!({"technique": "emission_absorption", "volume": volume, "image": {"width": 32, "height": 32},
        "budget": {"samples": 1}, "camera": {"eye": [0.4, 0.3, 3], "up": [0, 1, 0], "fov_y_deg": 20}, "emission_absorption": {
        "step_voxels": 0.125, "opacity_threshold": 1, "pre_integrated": true, "transfer_function": {"points": [
            {"value": -0.2, "color": [0.1, 0.9, 0.3], "opacity_per_unit": 0.1}, {"value": 1.4, "color": [0.9, 0.1, 0.2], "opacity_per_unit": 0.5},
            {"value": 3.2, "color": [0.1, 0.4, 1], "opacity_per_unit": 1.5}]}}})).0;
    [8.0, 4.0, 2.0, 1.0].iter().map(|step| truth.difference(&film(*step)).unwrap()).collect()
}

#[test]
fn the_plain_form_is_of_first_order_and_the_pre_integrated_one_of_second() {
    for (parameters, order) in [(json!({}), 1.0), (json!({"pre_integrated": true}), 2.0)] {
        let errors = errors(&parameters);
        let slope = (errors[0] / errors[2]).log2() / 2.0;
        assert!((slope - order).abs() < 0.35, "{parameters}: order {slope:.2} from {errors:?}");
    }
}

#[test]
fn without_jitter_samples_lie_in_the_middle_of_their_steps() {
    // Along z through the middle of the box every step is whole, so the picture is the sum over midpoints, in double precision.
    let house = House::shared();
    let volume = house.floats([64, 64, 64], |_, _, z| 0.5 + 0.4 * (3.0 * z).sin());
    let film = |seed: u64, jitter: bool| {
        house.film(&json!({"technique": "emission_absorption", "volume": volume, "image": {"width": 16, "height": 16},
            "budget": {"samples": 1}, "seed": seed,
            "camera": {"eye": [0, 0, 3], "up": [0, 1, 0], "projection": "orthographic", "fov_y_deg": 20},
            "emission_absorption": {"jitter": jitter, "step_voxels": 4, "opacity_threshold": 1, "transfer_function": {"points": [
                {"value": 0, "color": [1, 1, 1], "opacity_per_unit": 0}, {"value": 1, "color": [1, 1, 1], "opacity_per_unit": 1}]}}}))
            .0
    };
    let value = |z: f64| {
        let at = ((z + 1.0) * 32.0 - 0.5).clamp(0.0, 63.0);
        let voxel = |i: f64| 0.5 + 0.4 * (3.0 * ((i + 0.5) / 32.0 - 1.0)).sin();
        voxel(at.floor()) + (voxel((at.floor() + 1.0).min(63.0)) - voxel(at.floor())) * at.fract()
    };
    // The box is seen from t = 2 to 4, which are ends of steps of 1/8.
    let depth: f64 = (0..16).map(|k| value(1.0 - (f64::from(k) + 0.5) / 8.0) / 8.0).sum();
    let truth = 1.0 - (-depth).exp();
    let (still, again) = (film(1, false), film(2, false));
    assert_eq!(still.main.mean, again.main.mean, "another seed moves samples that are not jittered");
    for p in still.main.mean.chunks_exact(4) {
        assert!((f64::from(p[3]) - truth).abs() < 1e-4, "{} for {truth}", p[3]);
    }
    let moved = film(1, true).main.mean.chunks_exact(4).map(|p| (f64::from(p[3]) - truth).abs()).fold(0.0, f64::max);
    assert!(moved > 1e-3, "jitter changes no more than {moved:e}");
}

#[test]
fn pre_integration_misses_no_spike() {
    // A value rises through a spike a hundredth of a step wide. The integral of the spike must be right whatever the step.
    let house = House::shared();
    let volume = house.floats([32, 32, 32], |_, _, z| z);
    let spike = json!({"points": [
        {"value": -0.01, "color": [1, 1, 1], "opacity_per_unit": 0}, {"value": 0.1, "color": [1, 1, 1], "opacity_per_unit": 0},
        {"value": 0.105, "color": [1, 1, 1], "opacity_per_unit": 200}, {"value": 0.11, "color": [1, 1, 1], "opacity_per_unit": 0},
        {"value": 0.2, "color": [1, 1, 1], "opacity_per_unit": 0}]});
    let truth = 1.0 - (-0.5f64 * 0.01 * 200.0).exp();
    for step_voxels in [0.5, 2.0, 8.0] {
        let (film, _) = house.film(
            &json!({"technique": "emission_absorption", "volume": volume, "image": {"width": 8, "height": 8},
            "budget": {"samples": 1}, "camera": {"eye": [0, 0, 3], "up": [0, 1, 0], "projection": "orthographic", "fov_y_deg": 20},
            "emission_absorption": {"transfer_function": spike, "pre_integrated": true, "step_voxels": step_voxels}}),
        );
        for p in film.main.mean.chunks_exact(4) {
            assert!((f64::from(p[3]) - truth).abs() < 0.01, "step {step_voxels}: {} for {truth}", p[3]);
        }
    }
}
