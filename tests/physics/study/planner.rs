//! Plans against truths: permitted reductions, and forbidden ones.

use cloudchamber::plan::{Considered, Plan};
use cloudchamber::study::bench::{Bench, Reads};
use serde_json::{Value, json};

use super::on_a_bench;

/// The truth: the first setting with many samples, and with many photons if its subject is a field; and the square of its random part.
struct Truth {
    values: Vec<f64>,
    own_squared: f64,
}

impl Truth {
    fn of(bench: &Bench, asked: &Value, samples: u64, photons: Option<u64>) -> Self {
        let (_, mut reference) = bench.settings(asked).unwrap().swap_remove(0);
        reference["budget"] = json!({"samples": samples / 2});
        let [a, b] = [98, 99].map(|seed| {
            reference["seed"] = json!(seed);
            if let Some(photons) = photons {
                let field = &mut reference["volume"]["photon_transport"];
                (field["seed"], field["photons"]) = (json!(seed), json!(photons / 2));
            }
            bench.run(&reference, Reads::Luminance).unwrap().values
        });
        let values: Vec<f64> = a.iter().zip(&b).map(|(a, b)| 0.5 * (a + b)).collect();
        // The random part of the truth is independent of the plan's. The difference of two seeds tells it.
        let own_squared = a.iter().zip(&values).map(|(a, t)| (a - t).powi(2)).sum::<f64>() / values.len() as f64;
        Self { values, own_squared }
    }

    /// The error of a picture, relative.
    fn error(&self, bench: &Bench, request: &Value) -> f64 {
        let found = bench.run(request, Reads::Luminance).unwrap().values;
        let mean = self.values.iter().sum::<f64>() / found.len() as f64;
        let squares = found.iter().zip(&self.values).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / found.len() as f64;
        ((squares - self.own_squared) / mean.powi(2)).max(0.0).sqrt()
    }
}

fn plan(bench: &Bench, request: &Value) -> Plan {
    let plan = bench.plan(request).unwrap();
    eprintln!("{}: {} samples, {}, of {}", plan.technique, plan.samples, plan.options, plan.request["volume"]);
    plan
}

#[test]
fn what_is_small_thin_or_sharp_is_not_dropped() {
    on_a_bench(|bench| {
        let image = json!({"width": 128, "height": 128});
        let points = json!([{"value": 0, "color": [0.3, 0.3, 0.3], "opacity_per_unit": 0}, {"value": 1, "color": [1, 1, 1], "opacity_per_unit": 60}]);
        let looked_at = |volume: &Value, error: f64| {
            json!({"technique": "auto", "volume": volume, "image": image, "budget": {"max_error": error},
                "camera": {"eye": [0.3, 0.4, 3], "up": [0, 1, 0], "fov_y_deg": 36}, "emission_absorption": {"transfer_function": {"points": points}}})
        };
        let bright = |p: [f64; 3]| if p.iter().all(|v| v.abs() < 0.03) { 1.0 } else { 0.004 };
        let detail = bench.floats([48; 3], [2.0; 3], bright).unwrap();
        let shell = |p: [f64; 3]| f64::from(u8::from((p.iter().map(|v| v * v).sum::<f64>().sqrt() - 0.7).abs() < 0.03));
        let shell = bench.floats([48; 3], [2.0; 3], shell).unwrap();
        let mut peak = looked_at(&json!({"builtin": "smoke", "resolution": 48}), 0.15);
        peak.as_object_mut().unwrap().remove("emission_absorption");
        peak["medium"] =
            json!({"sigma_t_per_unit": 8, "albedo": 0.95, "phase": {"type": "henyey_greenstein", "g": 0.93}});
        // The sun is behind the cloud. The light that comes through is the forward peak, scattered a few times.
        peak["lights"] =
            json!([{"type": "sun", "direction": [-0.3, -0.4, -3], "irradiance": 3}, {"type": "sky", "radiance": 0.05}]);
        // The lamp of a few pixels is seen past the cloud. Hardly one of its pixels is a pilot's.
        let mut lamp = looked_at(&json!({"builtin": "gaussian", "resolution": 32}), 0.05);
        lamp.as_object_mut().unwrap().remove("emission_absorption");
        lamp["medium"] = json!({"sigma_t_per_unit": 1, "albedo": 0.5});
        lamp["lights"] = json!([{"type": "sphere", "position": [0.73, 0.8, -0.3], "radius": 0.03, "radiance": 60}, {"type": "sky", "radiance": 0.2}]);
        for (name, request, samples) in [
            ("detail", looked_at(&detail, 0.02), 256),
            ("shell", looked_at(&shell, 0.03), 256),
            ("peak", peak, 600),
            ("lamp", lamp, 750),
        ] {
            let asked = request["budget"]["max_error"].as_f64().unwrap();
            let error = Truth::of(bench, &request, samples, None).error(bench, &plan(bench, &request).request);
            assert!(error <= asked, "{name}: {error} for {asked}");
        }
    });
}

#[test]
fn voxels_finer_than_the_pixels_are_averaged_where_that_is_enough() {
    on_a_bench(|bench| {
        let looked_at = |volume: &Value, error: f64| {
            json!({"technique": "auto", "volume": volume, "image": {"width": 64, "height": 48}, "budget": {"max_error": error},
                "camera": {"eye": [0.4, 0.5, 3.2], "up": [0, 1, 0], "fov_y_deg": 40}, "emission_absorption": {}})
        };
        // The volume is smooth, and is seen from so far away that half of its voxels a side suffice.
        let smooth = looked_at(&json!({"builtin": "marschner_lobb", "resolution": 192}), 0.03);
        let found = plan(bench, &smooth);
        assert!(found.request["volume"]["level"].as_u64() > Some(0), "{}", found.request["volume"]);
        let error = Truth::of(bench, &smooth, 128, None).error(bench, &found.request);
        assert!(error <= 0.03, "{error}");
        let level = |c: &&Considered| c.words.contains("of level 1");
        assert!(found.considered.iter().any(|c| level(&c) && c.bias > Some(0.0)), "its bias is measured");

        // The scene has an opaque shell of one voxel. A mean of its voxels would give another picture.
        let shell =
            |p: [f64; 3]| f64::from(u8::from((p.iter().map(|v| v * v).sum::<f64>().sqrt() - 0.7).abs() < 0.006));
        let mut thin = looked_at(&bench.floats([176; 3], [2.0; 3], shell).unwrap(), 0.05);
        thin["emission_absorption"]["transfer_function"] = json!({"points": [
            {"value": 0.45, "color": [0.3, 0.3, 0.3], "opacity_per_unit": 0}, {"value": 0.55, "color": [1, 1, 1], "opacity_per_unit": 300}]});
        let found = plan(bench, &thin);
        assert_eq!(found.request["volume"].get("level"), None, "{}", found.request["volume"]);
        let error = Truth::of(bench, &thin, 128, None).error(bench, &found.request);
        assert!(error <= 0.05, "{error}");
    });
}

#[test]
fn a_field_gets_the_photons_that_its_picture_needs_and_no_more() {
    on_a_bench(|bench| {
        let cube = json!({"medium": {"mu_a_per_mm": 0.005, "mu_s_per_mm": 1, "index": 1.37}, "grid": [30, 30, 30]});
        let smoke = json!({"density": {"builtin": "smoke", "resolution": 32}, "medium": {"mu_a_per_mm": 1, "mu_s_per_mm": 4},
            "source": {"type": "planar"}, "tally": "absorbed"});
        // The chamber's beam is a bright spot of few pixels. With 128 samples its edge would leave the truth wrong by half of what is judged.
        for (name, field, view, error, samples, more) in [
            ("cube", &cube, json!({"projection": {"mode": "mean"}}), 0.05, 256, 6),
            ("chamber", &json!({"grid": [32, 32, 32]}), json!({"emission_absorption": {}}), 0.08, 1024, 16),
            ("smoke", &smoke, json!({"emission_absorption": {}}), 0.12, 256, 12),
        ] {
            let mut request = json!({"technique": "auto", "volume": {"photon_transport": field},
                "image": {"width": 96, "height": 72}, "budget": {"max_error": error}});
            request.as_object_mut().unwrap().extend(view.as_object().unwrap().clone());
            let found = plan(bench, &request);
            let photons = found.work.unwrap().amount;
            assert_eq!(found.request["volume"]["photon_transport"]["photons"], photons, "{name}");
            let truth = Truth::of(bench, &request, samples, Some(more * photons));
            // A field may be a lucky one, so several are tested. A promise for nineteen in twenty of them is more than true of their mean square.
            let error_with = |photons: u64| {
                let mut planned = found.request.clone();
                let squared = (1..=4).map(|seed| {
                    let field = &mut planned["volume"]["photon_transport"];
                    (field["photons"], field["seed"]) = (json!(photons), json!(seed));
                    truth.error(bench, &planned).powi(2)
                });
                (squared.sum::<f64>() / 4.0).sqrt()
            };
            let (enough, fewer) = (error_with(photons), error_with(photons / 16));
            eprintln!("{name}: {photons} photons, {enough} for {error}, {fewer} with a sixteenth of them");
            assert!(enough <= error && fewer > error, "{name}: {enough}, and {fewer} with a sixteenth of {photons}");
            request["volume"]["photon_transport"]["photons"] = json!(5000);
            let kept = plan(bench, &request);
            assert_eq!(kept.work.map(|w| w.amount), Some(5000), "{name}: what is said is kept");
            let nearest = kept.reasons.iter().any(|reason| reason.contains("comes nearest"));
            assert!(kept.samples < 1000 && nearest, "{name}: {:?}", kept.reasons);
        }
    });
}

#[test]
fn a_reference_that_has_steps_is_not_taken_for_the_truth() {
    on_a_bench(|bench| {
        let cells = |p: [f64; 3]| p.iter().map(|v| ((v + 1.0) * 12.0).floor()).sum::<f64>().rem_euclid(2.0);
        let volume = bench.floats([24; 3], [2.0; 3], cells).unwrap();
        let asked = |view: Value| {
            let mut request = json!({"technique": "auto", "volume": volume, "image": {"width": 48, "height": 32}, "budget": {"max_error": 0.03},
                "camera": {"eye": [0.7, 2.3, 0.4], "fov_y_deg": 37}});
            request.as_object_mut().unwrap().extend(view.as_object().unwrap().clone());
            request
        };
        // Greatest values lie at the corners of voxels. Steps of any length miss them by an amount of first order; the exact way does not.
        let peaks = asked(
            json!({"projection": {"mode": "maximum", "interpolation": "trilinear", "window": {"low": 0.6, "high": 1}}}),
        );
        let found = plan(bench, &peaks);
        assert_eq!(found.considered[0].words, "projection, exact");
        let mut truth = peaks.clone();
        (truth["technique"], truth["projection"]["exact"]) = (json!("projection"), json!(true));
        (truth["budget"], truth["seed"]) = (json!({"samples": 256}), json!(9));
        let values = bench.run(&truth, Reads::Luminance).unwrap().values;
        let error = Truth { values, own_squared: 0.0 }.error(bench, &found.request);
        assert!(error <= 0.03, "{error}: {:?}", found.considered);

        // With a step of the request's own, nothing that the planner tries has a shorter one.
        let ended = asked(json!({"emission_absorption": {"opacity_threshold": 0.8}}));
        assert_eq!(plan(bench, &ended).bound(&ended), None, "no pilot knows what is behind the ends of rays");
        let stepped = asked(json!({"emission_absorption": {"step_voxels": 1.0}}));
        assert_eq!(plan(bench, &stepped).bound(&stepped), None);
        let run = bench.run(&stepped, Reads::Luminance).unwrap();
        assert_eq!(
            (&run.reply["error_parts"]["source"], &run.reply["error_parts"]["planned"]),
            (&json!("picture"), &Value::Null)
        );
    });
}

#[test]
fn a_picture_of_nothing_is_planned_with_the_least_work() {
    on_a_bench(|bench| {
        let nothing = json!({"technique": "auto", "volume": {"builtin": "constant", "resolution": 16}, "isosurface": {"isovalue": 1},
            "image": {"width": 24, "height": 24}, "budget": {"max_error": 0.1}});
        let found = plan(bench, &nothing);
        assert!(found.samples == 1 && found.error.value == 0.0, "{} samples, {:?}", found.samples, found.error);
    });
}
