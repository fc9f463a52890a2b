//! `single_scatter` against quadrature in double precision. Its other truths are in `volume_path/`, which it shares.

use crate::common::engine::House;
use crate::common::light::{agree, agrees, film, mean, scene, spot_at};
use serde_json::{Value, json};

/// The single scattering of a point light at `at` in the cube [-1, 1]³ of extinction `sigma`, along z through (x, y), by the midpoint rule.
fn airlight(sigma: f64, albedo: f64, g: f64, at: [f64; 3], [x, y]: [f64; 2]) -> f64 {
    let n = 100_000;
    let mut sum = 0.0;
    for i in 0..n {
        let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(n); // from the eye, which looks along -z
        let to = [at[0] - x, at[1] - y, at[2] - z];
        let r = (to[0] * to[0] + to[1] * to[1] + to[2] * to[2]).sqrt();
        // Light that came along -to is scattered towards +z. The cosine of the turn is that between -to and +z.
        let mu = -to[2] / r;
        let phase = (1.0 - g * g) / (1.0 + g * g - 2.0 * g * mu).powf(1.5) / (4.0 * std::f64::consts::PI);
        sum += sigma * albedo * phase * (-sigma * (1.0 - z) - sigma * r).exp() / (r * r);
    }
    sum * 2.0 / f64::from(n)
}

fn point(sigma: f64, g: f64, at: [f64; 3], equiangular: bool) -> Value {
    json!({"medium": {"sigma_t_per_unit": sigma, "albedo": 0.8, "phase": {"type": "henyey_greenstein", "g": g}},
        "lights": [{"type": "point", "position": at}], "equiangular": equiangular})
}

#[test]
fn a_point_light_in_fog_is_the_airlight_integral() {
    let constant = json!({"builtin": "constant", "resolution": 8});
    for (sigma, g, at, to) in [
        (0.3, 0.0, [0.2, 0.1, -0.2], [0.25, 0.12]),
        (1.0, 0.5, [0.2, 0.1, -0.2], [-0.3, 0.4]),
        (3.0, -0.4, [0.0, 0.0, 0.5], [0.1, 0.0]),
        (0.5, 0.0, [0.3, 0.0, 0.0], [0.32, 0.0]),
    ] {
        // The mean over the spot, by Gauss-Legendre's three points each way.
        let points = [(-0.6f64.sqrt(), 5.0 / 18.0), (0.0, 8.0 / 18.0), (0.6f64.sqrt(), 5.0 / 18.0)];
        let mut truth = 0.0;
        for (x, a) in points {
            for (y, b) in points {
                truth += a * b * airlight(sigma, 0.8, g, at, [to[0] + 0.0035 * x, to[1] + 0.0035 * y]);
            }
        }
        let camera = spot_at([0.0, 0.0, 1.0], [to[0], to[1], 0.0], 0.007);
        let request = scene("single_scatter", &constant, &camera, &point(sigma, g, at, true), 32, 256);
        agrees(mean(&film(House::shared(), &request)), truth, 1e-4 * truth, &format!("sigma {sigma}, g {g}, {at:?}"));
    }
}

#[test]
fn choosing_places_by_angle_changes_the_noise_and_no_mean() {
    let smoke = json!({"builtin": "smoke", "resolution": 48});
    let run = |equiangular: bool, seed: u64| {
        let mut request = scene(
            "single_scatter",
            &smoke,
            &json!({"eye": [1.0, 0.8, -2.5]}),
            &point(4.0, 0.3, [0.3, 0.2, -0.1], equiangular),
            48,
            256,
        );
        request["seed"] = json!(seed);
        film(House::shared(), &request)
    };
    agree(mean(&run(true, 1)), mean(&run(false, 2)), "equiangular");
    // Without equiangular sampling, places near the light are rare and bright, and one picture says little of the noise.
    let noise = |equiangular: bool| {
        let pair = |seed: u64| run(equiangular, seed).difference(&run(equiangular, seed + 100)).unwrap();
        (10..14).map(|seed| pair(seed).powi(2)).sum::<f64>().sqrt()
    };
    let (quiet, loud) = (noise(true), noise(false));
    assert!(quiet < 0.5 * loud, "noise {quiet} with it, {loud} without");
}

#[test]
fn a_shadow_falls_where_the_sun_does_not_reach() {
    // A dense slab is over an empty half, and the part under it is dark.
    let volume = House::shared().floats([16, 16, 16], |_, y, _| {
        if y > 0.5 {
            200.0
        } else if y < 0.0 {
            0.2
        } else {
            0.0
        }
    });
    let own = json!({"medium": {"sigma_t_per_unit": 1}, "lights": [{"type": "sun", "direction": [0, 1, 0]}], "interpolation": "nearest"});
    let camera = spot_at([0.0, 0.0, 1.0], [0.0, -0.5, 0.0], 0.5);
    let dark = mean(&film(House::shared(), &scene("single_scatter", &volume, &camera, &own, 16, 16)));
    assert!(dark.0 < 1e-6, "{dark:?}");
    let own = json!({"medium": {"sigma_t_per_unit": 1}, "lights": [{"type": "sun", "direction": [0, -1, 0]}], "interpolation": "nearest"});
    let bright = mean(&film(House::shared(), &scene("single_scatter", &volume, &camera, &own, 16, 16)));
    assert!(bright.0 > 0.01, "{bright:?}");
}

#[test]
fn a_lamp_far_away_is_a_sun() {
    // The light is ten million lengths away. The angles under which the ray is seen must lose nothing of it.
    let smoke = json!({"builtin": "smoke", "resolution": 32});
    let run = |lights: Value, seed: u64| {
        let own = json!({"medium": {"sigma_t_per_unit": 6, "albedo": 0.8}, "lights": lights});
        let camera = json!({"eye": [1.0, 0.8, -2.5], "up": [0, 1, 0]});
        let mut request = scene("single_scatter", &smoke, &camera, &own, 48, 256);
        request["seed"] = json!(seed);
        mean(&film(House::shared(), &request)).0
    };
    let sun = run(json!([{"type": "sun", "direction": [0.6, 0.8, 0], "irradiance": 1}]), 2);
    for far in [1e3, 1e5, 1e7] {
        let radius = 0.01 * far;
        let lamp = json!([{"type": "sphere", "position": [0.6 * far, 0.8 * far, 0], "radius": radius, "radiance": 1e4 / std::f64::consts::PI}]);
        let lamp = run(lamp, 1);
        assert!((lamp / sun - 1.0).abs() < 0.02, "{far}: {lamp} and {sun}");
    }
}
