//! Gamma photons: Klein and Nishina's cross-section, Compton's energies, attenuation, and an independent simulation.

use std::f64::consts::PI;

use cloudchamber::technique::photon_transport::attenuation::{Attenuation, klein_nishina_cm2};
use serde_json::{Value, json};

use super::oracle::Random;
use super::run::{chi_squared_excess, fraction, judge, simulate, with};

const ELECTRON_KEV: f64 = 510.998_95;

/// The part of its energy that a photon keeps.
fn kept(energy_kev: f64, mu: f64) -> f64 {
    1.0 / (1.0 + energy_kev / ELECTRON_KEV * (1.0 - mu))
}

/// The density per steradian of the cosine, not normalised.
fn density(energy_kev: f64, mu: f64) -> f64 {
    let e = kept(energy_kev, mu);
    e * e * (e + 1.0 / e - 1.0 + mu * mu)
}

fn integral(f: impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let n = 4000;
    let h = (b - a) / f64::from(n);
    (0..n).map(|i| f(a + (f64::from(i) + 0.5) * h)).sum::<f64>() * h
}

#[test]
fn the_cross_section_is_the_published_one() {
    for (kev, truth) in [
        (60.0, 5.456198),
        (100.0, 4.927485),
        (140.0, 4.522955),
        (511.0, 2.865397),
        (662.0, 2.561404),
        (1000.0, 2.112079),
    ] {
        let got = klein_nishina_cm2(kev) * 1e25;
        assert!((got / truth - 1.0).abs() < 1e-6, "{kev} keV: {got} for {truth}");
    }
}

#[test]
fn the_density_of_these_tests_has_the_published_means_and_energies() {
    for (kev, fraction, cosine) in [(140.0, 0.173668, 0.149397), (511.0, 0.344482, 0.291407)] {
        let all = integral(|m| density(kev, m), -1.0, 1.0);
        let lost = integral(|m| density(kev, m) * (1.0 - kept(kev, m)), -1.0, 1.0) / all;
        let mean = integral(|m| density(kev, m) * m, -1.0, 1.0) / all;
        assert!((lost - fraction).abs() < 1e-6 && (mean - cosine).abs() < 1e-6, "{kev} keV: {lost}, {mean}");
    }
    for (kev, side, back) in [(511.0, 255.50, 170.33), (140.0, 109.89, 90.44), (662.0, 288.39, 184.35)] {
        assert!((kev * kept(kev, 0.0) - side).abs() < 0.006 && (kev * kept(kev, -1.0) - back).abs() < 0.006, "{kev}");
    }
}

/// The matter attenuates alike at all energies and scatters one collision in ten thousand, so that all light that leaves has been scattered once.
/// Angles and energies are those of the density.
#[test]
fn angles_and_energies_are_klein_and_nishinas() {
    let (tau, albedo, photons) = (0.7f64, 1e-4, 3_000_000.0);
    let edges: Vec<f64> = (0..=15).map(|i| f64::from(i) * 6.0).collect();
    for kev in [30.0, 140.0, 511.0, 2000.0] {
        let electrons = albedo / (100.0 * klein_nishina_cm2(kev));
        let attenuation = json!({"energies_kev": [1, 100_000], "mu_per_mm": [1, 1], "electrons_per_mm3": electrons});
        let layer =
            json!({"thickness_mm": tau, "index": 1, "phase": {"type": "klein_nishina"}, "attenuation": attenuation});
        let result = simulate(
            &json!({"photons": photons, "grid": [1, 1, 1], "layers": [layer], "roulette": {"threshold": 0}, "source": {"energy_kev": kev},
            "exit_histogram": {"radius_edges_mm": [0, 1e6], "angle_edges_deg": edges}}),
        );
        let all = 2.0 * PI * integral(|m| density(kev, m), -1.0, 1.0);
        let mut z = Vec::new();
        for (side, sign) in [("minus_z", -1.0), ("plus_z", 1.0)] {
            for (cone, ends) in edges.windows(2).enumerate() {
                let unscattered = if sign > 0.0 && cone == 0 { fraction(&result, "unscattered_plus_z").0 } else { 0.0 };
                let got = result["exit_histogram"][side][0][cone]["value"].as_f64().unwrap() - unscattered;
                let moment = |power: i32| {
                    integral(
                        |t| {
                            let m = t.cos();
                            let factor = if sign < 0.0 {
                                m / (1.0 + m) * (1.0 - (-tau * (1.0 + 1.0 / m)).exp())
                            } else {
                                m / (1.0 - m) * (-tau).exp() * -(-tau * (1.0 - m) / m).exp_m1()
                            };
                            2.0 * PI * density(kev, sign * m) / all * kept(kev, sign * m).powi(power) * factor * t.sin()
                        },
                        ends[0].to_radians(),
                        ends[1].to_radians(),
                    )
                };
                z.push((got / albedo - moment(1)) / (moment(2) / photons).sqrt());
            }
        }
        let (excess, bins) = chi_squared_excess(z.iter().copied());
        assert!(excess < 4.0, "{kev} keV: chi² over {bins} bins is {excess:.1} deviations too large: {z:.1?}");
    }
}

#[test]
fn a_narrow_beam_is_attenuated_as_the_tables_say() {
    for (material, kev, per_cm, mm) in [
        ("water", 60.0, 0.2059f64, 50.0f64),
        ("water", 500.0, 0.09687, 100.0),
        ("bone", 100.0, 1.92 * 0.1855, 20.0),
        ("air", 30.0, 1.205e-3 * 0.3538, 1e4),
        ("lead", 150.0, 11.35 * 2.014, 0.5),
        ("lead", 80.0, 11.35 * 2.419, 0.5),
    ] {
        let layer = json!({"thickness_mm": mm, "index": 1, "phase": {"type": "klein_nishina"}, "attenuation": {"material": material}});
        let scene = json!({"photons": 50_000, "grid": [1, 1, 1], "layers": [layer], "source": {"energy_kev": kev}});
        judge(&format!("{material} at {kev} keV"), &scene, (-per_cm * mm / 10.0).exp(), 1e-5, |r| {
            fraction(r, "unscattered_plus_z").0
        });
    }
}

/// One photon through a slab of water, in double precision. Angles come by rejection from a uniform cosine, and each collision absorbs or scatters
/// the photon as a whole. Returns the energy that leaves before and behind the slab, as parts of the whole.
fn photon(random: &mut Random, water: &Attenuation, kev: f64, depth_mm: f64) -> [f64; 2] {
    let (mut z, mut w, mut energy) = (0.0, 1.0, kev);
    loop {
        let (mu, albedo) = water.at(energy);
        z += -random.unit().ln() / mu * w;
        if z < 0.0 || z > depth_mm {
            return if z < 0.0 { [energy / kev, 0.0] } else { [0.0, energy / kev] };
        }
        if random.unit() > albedo || energy < 10.0 {
            return [0.0; 2];
        }
        let cosine = loop {
            let m = 2.0 * random.unit() - 1.0;
            if 2.0 * random.unit() < density(energy, m) {
                break m;
            }
        };
        energy *= kept(energy, cosine);
        let phi = 2.0 * PI * random.unit();
        w = w * cosine + ((1.0 - w * w) * (1.0 - cosine * cosine)).max(0.0).sqrt() * phi.cos();
    }
}

#[test]
fn gammas_through_water_are_what_an_independent_simulation_says() {
    let water = Attenuation { material: Some("water".into()), ..Attenuation::default() };
    for kev in [60.0, 511.0] {
        let mut random = Random(5);
        let n = 300_000;
        let (mut sum, mut squares) = ([0.0; 2], [0.0; 2]);
        for _ in 0..n {
            for (i, v) in photon(&mut random, &water, kev, 100.0).into_iter().enumerate() {
                sum[i] += v;
                squares[i] += v * v;
            }
        }
        let layer = json!({"thickness_mm": 100, "index": 1, "phase": {"type": "klein_nishina"}, "attenuation": {"material": "water"}});
        let scene = json!({"photons": 50_000, "grid": [1, 1, 10], "layers": [layer], "source": {"energy_kev": kev}, "tally": "absorbed"});
        for (i, name) in ["exit_minus_z", "exit_plus_z"].into_iter().enumerate() {
            let mean = sum[i] / f64::from(n);
            let error = ((squares[i] / f64::from(n) - mean * mean) / f64::from(n)).sqrt();
            judge(&format!("{kev} keV {name}"), &scene, mean, error, |r| fraction(r, name).0);
        }
    }
}

#[test]
fn what_does_not_go_with_gammas_names_its_field() {
    let house = crate::common::engine::House::shared();
    let medium = json!({"phase": {"type": "klein_nishina"}, "attenuation": {"material": "water"}});
    let scene = json!({"medium": medium});
    let without = json!({"phase": {"type": "klein_nishina"}});
    let cases: [(Value, &str); 7] = [
        (with(&scene, &json!({"tracking": "delta"})), "tracking"),
        (with(&scene, &json!({"tally": "radiance_gather"})), "tally"),
        (with(&scene, &json!({"source": {"energy_kev": 5}})), "source/energy_kev"),
        (json!({"medium": without}), "medium/attenuation"),
        (json!({"medium": {"attenuation": {"material": "water"}}}), "medium/attenuation"),
        (json!({"medium": {}, "source": {"energy_kev": 50}}), "source/energy_kev"),
        (json!({"layers": [{"thickness_mm": 1}, with(&medium, &json!({"thickness_mm": 1}))]}), "layers/0/phase/type"),
    ];
    for (parameters, field) in cases {
        let request = super::run::request(&parameters);
        let refused = house.scene(&request).err();
        let Some(cloudchamber::error::Error::Invalid(violations)) = refused else { panic!("{parameters} is accepted") };
        assert!(
            violations.iter().any(|v| v.pointer == format!("/volume/photon_transport/{field}")),
            "{parameters}: {violations:?}"
        );
    }
}
