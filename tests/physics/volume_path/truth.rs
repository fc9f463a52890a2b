//! Closed forms and published tables.

use serde_json::{Value, json};

use crate::common::engine::House;
use crate::common::light::{agrees, channel, film, mean, scene, spot};

/// The extinction of a half-space: a cube of 800 mean free paths a side, seen in its middle.
const DENSE: f64 = 400.0;

fn sky(visible: bool) -> Value {
    json!([{"type": "sky", "radiance": 1, "visible": visible}])
}

fn constant() -> Value {
    json!({"builtin": "constant", "resolution": 8})
}

#[test]
fn a_furnace_is_1_everywhere() {
    let shell = House::shared().floats([24, 24, 24], |x, y, z| {
        let r = (x * x + y * y + z * z).sqrt();
        if (0.6..0.7).contains(&r) { 40.0 } else { 0.0 }
    });
    for volume in [constant(), json!({"builtin": "smoke", "resolution": 32}), shell] {
        for (g, tracking) in [(0.0, "auto"), (0.9, "delta"), (-0.9, "weighted"), (0.5, "exact"), (0.0, "march")] {
            let own = json!({"medium": {"sigma_t_per_unit": 5, "albedo": 1, "phase": {"type": "henyey_greenstein", "g": g}},
                "lights": sky(true), "tracking": tracking});
            let camera = json!({"eye": [2.0, 1.1, -1.7], "fov_y_deg": 50});
            let film = film(House::shared(), &scene("volume_path", &volume, &camera, &own, 32, 16));
            for (i, pixel) in film.main.mean.chunks_exact(4).enumerate() {
                for c in &pixel[..3] {
                    assert!((c - 1.0).abs() < 1e-5, "{volume} {own}: pixel {i} is {pixel:?}");
                }
            }
        }
    }
}

#[test]
fn a_furnace_of_six_quads_is_1_within_its_error() {
    // Next-event estimation and chance together have to make 1, with lights outside and inside the volume. Lights do not stop light. The volume is
    // empty around those inside, so that a path which has met one of them meets no other.
    let core = House::shared().floats([24; 3], |x, y, z| f64::from(u8::from(x.abs().max(y.abs()).max(z.abs()) < 0.7)));
    for (half, volume) in [(1.3, constant()), (0.8, core)] {
        let quad = |corner: [f64; 3], u: [f64; 3], v: [f64; 3]| {
            let of = |a: [f64; 3]| a.map(|x| x * half);
            json!({"type": "quad", "corner": of(corner), "edge_u": of(u), "edge_v": of(v)})
        };
        let (x, y, z) = ([2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]);
        let (low, lx, ly, lz) = ([-1.0; 3], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]);
        let lights =
            json!([quad(low, x, y), quad(low, x, z), quad(low, y, z), quad(lz, x, y), quad(ly, x, z), quad(lx, y, z)]);
        for next_event in [true, false] {
            let own = json!({"medium": {"sigma_t_per_unit": 0.4, "albedo": 1, "phase": {"type": "henyey_greenstein", "g": 0.6}},
                "lights": lights, "next_event": next_event});
            let camera = json!({"eye": [0.3, 0.1, -0.2], "fov_y_deg": 90});
            let film = film(House::shared(), &scene("volume_path", &volume, &camera, &own, 48, 64));
            agrees(mean(&film), 1.0, 0.0, &format!("six quads at {half}, next event {next_event}"));
            // Light is scattered on the way. Without that, every sample would be 1.
            assert_eq!(film.main.m2.iter().any(|squares| *squares > 0.0), next_event, "{half}");
        }
    }
}

#[test]
fn p19_beer_lambert_at_any_angle() {
    for from in [[0.0, 0.0, 1.0], [0.5, 0.3, 1.0], [0.2, 0.9, 1.0]] {
        // The ray stays away from the edges of the faces z = -1 and z = 1 through which it goes.
        let length = 2.0 * from.iter().map(|v| v * v).sum::<f64>().sqrt();
        for sigma in [0.05, 0.7, 2.0] {
            let own = json!({"medium": {"sigma_t_per_unit": sigma, "albedo": 0}, "lights": sky(true)});
            let film = film(House::shared(), &scene("volume_path", &constant(), &spot(from, 0.01), &own, 64, 64));
            agrees(mean(&film), (-sigma * length).exp(), 0.0, &format!("sigma {sigma} from {from:?}"));
            let own = json!({"medium": {"sigma_t_per_unit": sigma, "albedo": 0}, "lights": sky(false)});
            let hidden = crate::common::light::film(
                House::shared(),
                &scene("volume_path", &constant(), &spot(from, 0.01), &own, 64, 64),
            );
            agrees(channel(&hidden, 3), -f64::exp_m1(-sigma * length), 0.0, "alpha");
            assert_eq!(channel(&hidden, 0).0, 0.0, "a sky that is not visible");
        }
    }
}

#[test]
fn p19_through_a_gaussian_by_each_tracker() {
    // Along the axis through the middle, the integral of exp(-r^2 / 2 s^2) is s sqrt(2 pi) erf(1 / (s sqrt 2)).
    let (s, sigma) = (0.3f64, 1.5);
    let depth = sigma * s * (2.0 * std::f64::consts::PI).sqrt() * (1.0 - 8.581_20e-4);
    for (tracking, grid, known_to) in
        [("delta", "local", 2e-4), ("delta", "global", 2e-4), ("weighted", "local", 2e-4), ("exact", "local", 2e-4)]
    {
        let own = json!({"medium": {"sigma_t_per_unit": sigma, "albedo": 0}, "lights": sky(true), "tracking": tracking,
            "majorant": {"grid": grid}});
        // With an odd number of voxels, the ray goes through their middles.
        let volume = json!({"builtin": "gaussian", "resolution": 129});
        let film = film(House::shared(), &scene("volume_path", &volume, &spot([0.0, 0.0, 1.0], 0.007), &own, 64, 64));
        agrees(mean(&film), (-depth).exp(), known_to, tracking);
    }
}

#[test]
fn p14_single_scattering_of_a_half_space() {
    let truth = 0.45 * (1.0 - 2f64.ln());
    for technique in ["volume_path", "single_scatter"] {
        let mut own = json!({"medium": {"sigma_t_per_unit": DENSE, "albedo": 0.9}, "lights": sky(false)});
        if technique == "volume_path" {
            own["max_scatterings"] = json!(1);
        }
        let film = film(House::shared(), &scene(technique, &constant(), &spot([0.0, 0.0, 1.0], 0.01), &own, 64, 256));
        agrees(mean(&film), truth, 0.0, technique);
    }
}

#[test]
fn p8_half_spaces_of_six_albedos() {
    for (albedo, truth) in
        [(0.5, 0.115226), (0.8, 0.285255), (0.9, 0.414947), (0.95, 0.535541), (0.99, 0.752721), (0.999, 0.912845)]
    {
        let own = json!({"medium": {"sigma_t_per_unit": DENSE, "albedo": albedo}, "lights": sky(false)});
        let request = scene("volume_path", &constant(), &spot([0.0, 0.0, 1.0], 0.01), &own, 64, 128);
        agrees(mean(&film(House::shared(), &request)), truth, 5e-7, &format!("albedo {albedo}"));
    }
}

#[test]
fn p2_a_half_space_behind_a_face_that_reflects() {
    let own = json!({"medium": {"sigma_t_per_unit": DENSE, "albedo": 0.9, "index": 1.5}, "lights": sky(true)});
    let request = scene("volume_path", &constant(), &spot([0.0, 0.0, 1.0], 0.01), &own, 64, 256);
    agrees(mean(&film(House::shared(), &request)), 0.2599, 1e-4, "reflectance");
}

#[test]
fn a_pane_of_glass_reflects_by_fresnel() {
    // Without extinction, the sky is seen through the pane or reflected by it, and never lost: a furnace, whatever the index.
    let own = json!({"medium": {"sigma_t_per_unit": 0, "index": 1.5}, "lights": sky(true)});
    let request = scene("volume_path", &constant(), &json!({"eye": [2.0, 1.5, 3.0]}), &own, 32, 16);
    for pixel in film(House::shared(), &request).main.mean.chunks_exact(4) {
        assert!((pixel[0] - 1.0).abs() < 1e-5, "{pixel:?}");
    }
    // Under a sky that is only above, the upper face, which is seen at 60 degrees, reflects 0.0892 of it. The light that enters leaves below or is
    // turned back.
    let lights = json!([{"type": "sky", "zenith": 1, "horizon": 1, "ground": 0, "up": [0, 1, 0]}]);
    let own = json!({"medium": {"sigma_t_per_unit": 40, "albedo": 0, "index": 1.5}, "lights": lights});
    let camera = spot([3f64.sqrt(), 1.0, 0.0], 0.01);
    let request = scene("volume_path", &constant(), &with_target(camera, [0.0, 1.0, 0.0]), &own, 64, 64);
    let eta = 1.5f64;
    let (ci, si) = (0.5f64, 0.75f64.sqrt());
    let ct = (1.0 - (si / eta).powi(2)).sqrt();
    let (rs, rp) = ((ci - eta * ct) / (ci + eta * ct), (ct - eta * ci) / (ct + eta * ci));
    agrees(mean(&film(House::shared(), &request)), 0.5 * (rs * rs + rp * rp), 0.0, "a face at 60 degrees");
}

fn with_target(mut camera: Value, target: [f64; 3]) -> Value {
    let eye: Vec<f64> = (0..3).map(|i| camera["eye"][i].as_f64().unwrap() + target[i]).collect();
    camera["eye"] = json!(eye);
    camera["target"] = json!(target);
    camera
}

#[test]
fn emission_of_a_box() {
    // The truth is L = (emission / sigma) (1 - exp(-sigma length)), by colour.
    let (sigma, emission) = ([0.5, 1.0, 2.0], [0.3, 0.2, 0.1]);
    let own = json!({"medium": {"sigma_t_per_unit": sigma, "albedo": 0, "emission": emission}, "lights": []});
    let request = scene("volume_path", &constant(), &spot([0.0, 0.0, 1.0], 0.01), &own, 64, 256);
    let film = film(House::shared(), &request);
    for c in 0..3 {
        let truth = emission[c] / sigma[c] * -f64::exp_m1(-2.0 * sigma[c]);
        agrees(channel(&film, c), truth, 0.0, &format!("colour {c}"));
    }
}

#[test]
fn camera_and_light_change_places() {
    // By Helmholtz reciprocity, the light of a sun of irradiance 1 from b towards a, over the cosine of b, is that of a sun from a towards b.
    let (a, b) = ([0.0, 0.2, 1.0], [0.9, 0.3, 0.5]);
    let cosine = |d: [f64; 3]| d[2] / d.iter().map(|v| v * v).sum::<f64>().sqrt();
    let medium = json!({"sigma_t_per_unit": 60, "albedo": 0.95, "phase": {"type": "henyey_greenstein", "g": 0.7}});
    let brdf = |to: [f64; 3], from: [f64; 3]| {
        let own = json!({"medium": medium, "lights": [{"type": "sun", "direction": from, "irradiance": 1}]});
        let camera = with_target(spot(to, 0.02), [0.0, 0.0, 1.0]);
        let (m, e) = mean(&film(House::shared(), &scene("volume_path", &constant(), &camera, &own, 64, 256)));
        (m / cosine(from), e / cosine(from))
    };
    crate::common::light::agree(brdf(a, b), brdf(b, a), "both ways");
}
