//! The film's own error estimate against its real error.

use serde_json::{Value, json};

use crate::common::engine::House;
use crate::common::mri_head;

fn request(volume: &Value, samples: u32, step_voxels: f64, seed: u64) -> Value {
    json!({
        "technique": "emission_absorption", "volume": volume, "image": {"width": 96, "height": 96},
        "budget": {"samples": samples}, "seed": seed, "emission_absorption": {"step_voxels": step_voxels}
    })
}

#[test]
fn the_stated_error_is_the_real_one() {
    let house = House::shared();
    for volume in [house.file(mri_head()), json!({"builtin": "smoke", "resolution": 64})] {
        let (truth, _) = house.film(&request(&volume, 256, 0.25, 99));
        for (samples, step, jitter) in
            [(2, 1.0, true), (16, 1.0, true), (64, 1.0, true), (64, 4.0, true), (64, 4.0, false)]
        {
            let mut request = request(&volume, samples, step, 1);
            request["emission_absorption"]["jitter"] = jitter.into();
            let (film, error) = house.film(&request);
            let real = truth.difference(&film).unwrap();
            let ratio = error.total.unwrap() / real;
            // The estimate is never much too small. It may be too large: the discretisation is a bound for a first-order method, which is a
            // multiple of the truth if the method does better; and the pixel offsets are better than random ones.
            let most = if step > 1.0 { 8.0 } else { 4.0 };
            assert!(
                (0.7..most).contains(&ratio),
                "{volume}, {samples} samples, step {step}, jitter {jitter}: says {}, is {real}",
                error.total.unwrap()
            );
        }
    }
}

#[test]
fn noise_falls_at_least_with_the_square_root_of_the_samples_and_is_what_it_is_said_to_be() {
    let house = House::shared();
    let volume = house.file(mri_head());
    let (truth, _) = house.film(&request(&volume, 2048, 1.0, 4));
    let [few, many] = [16, 256].map(|samples| {
        let (film, error) = house.film(&request(&volume, samples, 1.0, 3));
        let (noise, wrong) = (error.noise.unwrap(), film.difference(&truth).unwrap());
        // The noise is the standard error of such pictures, the total less what the step costs an upper bound of this one's: the truth has the same
        // step. It has a noise of its own.
        let bound = (error.total.unwrap().powi(2) - error.bias().powi(2)).sqrt();
        assert!(wrong <= 1.02 * bound && bound <= 4.0 * wrong, "{samples} samples: {wrong}, at most {bound}");
        assert!((0.5..2.0).contains(&(wrong / noise)), "{samples} samples: {wrong}, said to be {noise}");
        noise
    });
    assert!(few / many >= 3.6, "16 samples {few}, 256 samples {many}");
}

#[test]
fn a_shorter_step_is_less_wrong_and_says_so() {
    let house = House::shared();
    let volume = json!({"builtin": "smoke", "resolution": 64});
    let discretisation = |step: f64| house.film(&request(&volume, 256, step, 3)).1.discretisation.unwrap();
    let (long, short) = (discretisation(8.0), discretisation(2.0));
    assert!(short < 0.6 * long, "step 8: {long}, step 2: {short}");
}

#[test]
fn max_error_stops_at_the_error_asked_for() {
    let house = House::shared();
    let mut request = request(&house.file(mri_head()), 1, 1.0, 0);
    request["budget"] = json!({"max_error": 0.02});
    let job = house.finish(&request);
    let resource = job.resource();
    assert_eq!(resource["stopped_by"], "error");
    assert!(resource["error"].as_f64().unwrap() <= 0.02, "{}", resource["error"]);
    assert!(resource["samples"].as_u64().unwrap() >= 2);
}

#[test]
fn voxels_that_are_not_finite_are_empty_and_counted() {
    let house = House::shared();
    let bad = |x: f64, y: f64, z: f64| x * x + y * y + z * z < 0.1;
    let volume = house.floats([32, 32, 32], |x, y, z| match bad(x, y, z) {
        true if x > 0.0 => f64::NAN,
        true if y > 0.0 => f64::INFINITY,
        true => f64::NEG_INFINITY,
        false => 1.0,
    });
    let request = json!({
        "technique": "emission_absorption", "volume": volume, "image": {"width": 64, "height": 64}, "budget": {"samples": 2},
        "camera": {"eye": [0, 0, 5], "up": [0, 1, 0], "fov_y_deg": 40},
        "emission_absorption": {"transfer_function": {"points": [{"value": 1, "color": [1, 1, 1], "opacity_per_unit": 1}]}}
    });
    let job = house.finish(&request);
    let film = house.film_of(&job);
    let error = film.error();
    assert!(film.main.mean.iter().all(|v| v.is_finite()) && error.total.unwrap().is_finite());
    let resource = job.resource();
    assert_eq!(resource["counts"]["non_finite_samples"], 0);
    assert!(resource["counts"]["non_finite_voxels"].as_u64().unwrap() > 100);
    assert_eq!(resource["warnings"][0]["code"], "non_finite_voxels");
    // Through the hole there is less to absorb than beside it.
    let alpha = |column: usize| film.main.mean[4 * (32 * 64 + column) + 3];
    assert!(alpha(32) < alpha(20) - 0.05, "hole {}, beside it {}", alpha(32), alpha(20));
}
