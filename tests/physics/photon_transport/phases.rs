//! Phase functions: the sampler against the density, by chi² over angles.
//!
//! In a slab with an albedo of 1e-4 all light that leaves has been scattered once. So the angles of that light follow the phase function times a
//! factor in closed form.

use serde_json::{Value, json};

use super::run::{chi_squared_excess, simulate};

const TAU: f64 = 0.7;
const ALBEDO: f64 = 1e-4;

/// The part of a unit of light that leaves a slab of optical thickness TAU per unit of cosine, scattered once: back (mu < 0) or through.
fn once(density: &dyn Fn(f64) -> f64, mu: f64) -> f64 {
    let m = mu.abs();
    let factor = if mu < 0.0 {
        m / (1.0 + m) * (1.0 - (-TAU * (1.0 + 1.0 / m)).exp())
    } else if (1.0 - m).abs() < 1e-7 {
        TAU * (-TAU).exp()
    } else {
        // This is exp(-tau) - exp(-tau / m), without loss of digits.
        m / (1.0 - m) * (-TAU).exp() * -(-TAU * (1.0 - m) / m).exp_m1()
    };
    ALBEDO * 2.0 * std::f64::consts::PI * density(mu) * factor
}

fn integral(f: &dyn Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let n = 2000;
    let h = (b - a) / f64::from(n);
    (0..n).map(|i| f(a + (f64::from(i) + 0.5) * h)).sum::<f64>() * h
}

fn check(name: &str, phase: &Value, density: &dyn Fn(f64) -> f64) {
    let edges: Vec<f64> =
        [0.0, 1.0, 2.0, 4.0].into_iter().chain((1..=12).map(|i| f64::from(i) * 7.0)).chain([90.0]).collect();
    let photons = 3_000_000.0;
    let layer =
        json!({"thickness_mm": TAU, "mu_a_per_mm": 1.0 - ALBEDO, "mu_s_per_mm": ALBEDO, "index": 1, "phase": phase});
    let result =
        simulate(&json!({"photons": photons, "grid": [1, 1, 1], "layers": [layer], "roulette": {"threshold": 0},
        "exit_histogram": {"radius_edges_mm": [0, 1e6], "angle_edges_deg": edges}}));
    let mut z = Vec::new();
    for (side, sign) in [("minus_z", -1.0), ("plus_z", 1.0)] {
        for (cone, ends) in edges.windows(2).enumerate() {
            // Unscattered light leaves at 0.
            let unscattered = if sign > 0.0 && cone == 0 {
                result["ledger"]["unscattered_plus_z"]["value"].as_f64().unwrap()
            } else {
                0.0
            };
            let got = result["exit_histogram"][side][0][cone]["value"].as_f64().unwrap() - unscattered;
            // The integral is over the angle, since the density is smooth there.
            let by_angle = |t: f64| once(density, sign * t.cos()) * t.sin();
            let truth = integral(&by_angle, ends[0].to_radians(), ends[1].to_radians());
            let (expected, counted) = (truth * photons / ALBEDO, got * photons / ALBEDO);
            if expected > 10.0 {
                z.push((counted - expected) / expected.sqrt());
            } else {
                assert!(counted < 40.0, "{name}: {counted} at {side} {ends:?}, where {expected} belong");
            }
        }
    }
    let worst = z.iter().copied().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
    let (excess, bins) = chi_squared_excess(z.into_iter());
    assert!(
        excess < 4.0,
        "{name}: chi² over {bins} bins is {excess:.1} deviations too large; the worst bin is off by {worst:.1}"
    );
}

fn lobe(g: f64) -> impl Fn(f64) -> f64 {
    move |mu| (1.0 - g * g) / (4.0 * std::f64::consts::PI * (1.0 + g * g - 2.0 * g * mu).powf(1.5))
}

#[test]
fn henyey_greenstein_at_any_anisotropy() {
    check("isotropic", &json!({"type": "isotropic"}), &|_| 0.25 / std::f64::consts::PI);
    for g in [0.0, 1e-4, 0.01, 0.3, 0.75, 0.95, -0.5, -0.9] {
        check(&format!("g = {g}"), &json!({"type": "henyey_greenstein", "g": g}), &lobe(g));
    }
}

#[test]
fn two_lobes_rayleigh_and_a_table() {
    let (forward, back) = (lobe(0.85), lobe(-0.4));
    check("two lobes", &json!({"type": "two_term_henyey_greenstein", "g1": 0.85, "g2": -0.4, "weight": 0.7}), &|mu| {
        0.7 * forward(mu) + 0.3 * back(mu)
    });
    let rayleigh = |mu: f64| 3.0 / (16.0 * std::f64::consts::PI) * (1.0 + mu * mu);
    check("Rayleigh", &json!({"type": "rayleigh"}), &rayleigh);
    // The table has a zero, a jump and a steep peak, and is normalised here anew.
    let points = [(-1.0, 3.0), (-0.5, 0.0), (0.0, 0.2), (0.001, 2.0), (0.6, 1.0), (0.9, 1.0), (1.0, 9.0)];
    let area: f64 = points.windows(2).map(|w| 0.5 * (w[0].1 + w[1].1) * (w[1].0 - w[0].0)).sum();
    let table = |mu: f64| {
        let w = points.windows(2).find(|w| mu <= w[1].0).unwrap();
        (w[0].1 + (w[1].1 - w[0].1) * (mu - w[0].0) / (w[1].0 - w[0].0)) / (area * 2.0 * std::f64::consts::PI)
    };
    let (cosines, densities): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
    check("table", &json!({"type": "tabulated", "cosines": cosines, "densities": densities}), &table);
}

#[test]
fn the_gather_sees_the_density_that_is_sampled() {
    // Light goes straight down a thin beam and is seen from so far away that all directions to the eye are one. Each collision is scored with the
    // phase function's density at that angle.
    for (phase, density) in [
        (json!({"type": "henyey_greenstein", "g": 0.6}), Box::new(lobe(0.6)) as Box<dyn Fn(f64) -> f64>),
        (
            json!({"type": "two_term_henyey_greenstein", "g1": 0.5, "g2": -0.2, "weight": 0.25}),
            Box::new(|mu| 0.25 * lobe(0.5)(mu) + 0.75 * lobe(-0.2)(mu)),
        ),
        (json!({"type": "rayleigh"}), Box::new(|mu: f64| 3.0 / (16.0 * std::f64::consts::PI) * (1.0 + mu * mu))),
        (
            json!({"type": "tabulated", "cosines": [-1, 0, 1], "densities": [1, 2, 7]}),
            Box::new(|mu: f64| (if mu < 0.0 { 2.0 + mu } else { 2.0 + 5.0 * mu }) / (6.0 * 2.0 * std::f64::consts::PI)),
        ),
    ] {
        for cosine in [-0.9, -0.2, 0.4, 0.95f64] {
            let far = 1e7;
            let eye = [0.5 + far * (1.0 - cosine * cosine).sqrt(), 0.5, 0.5 + far * cosine];
            let medium = json!({"mu_a_per_mm": 2, "mu_s_per_mm": 0, "index": 1, "phase": phase});
            let scene = json!({"photons": 200_000, "size_mm": [1, 1, 1], "grid": [1, 1, 1], "medium": medium, "tally": "radiance_gather", "eye_mm": eye});
            let job = crate::common::engine::House::shared().finish(&super::run::request(&scene));
            let got = job.field().unwrap().values().unwrap().at(0, 0, 0);
            // The truth is (1 / sigma) times the sum of w P / dV, and 1 - exp(-2) of the light collides.
            let truth = (1.0 - (-2f64).exp()) / 2.0 * density(cosine);
            assert!((got / truth - 1.0).abs() < 0.006, "{phase} at {cosine}: {got} for {truth}");
        }
    }
}
