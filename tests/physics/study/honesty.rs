//! The study of stated errors: its scenes, and its judge.

use std::collections::BTreeSet;

use cloudchamber::study::bench::Reads;
use cloudchamber::study::honesty::honesty;
use cloudchamber::study::honesty::scene::scene;
use cloudchamber::study::honesty::truth::judge;
use cloudchamber::technique;
use serde_json::json;

use super::on_a_bench;

/// The device time for a truth, ms.
const TRUTH_MS: f64 = 5000.0;

#[test]
fn scenes_are_valid_and_reach_every_view_budget_and_option() {
    on_a_bench(|bench| {
        let views: Vec<&str> = technique::views().map(|t| t.name).collect();
        let mut said = BTreeSet::new();
        for number in 0..40 * (views.len() as u64 + 1) {
            let found = scene(bench, number, &[16, 24]).unwrap().expect("a valid scene");
            said.insert(format!("technique {}", found.technique));
            said.insert(format!("moment {}", found.moment.name()));
            said.extend(found.request["budget"].as_object().unwrap().keys().map(|key| format!("budget {key}")));
            said.extend(found.options());
            if number < 5 {
                let again = scene(bench, number, &[16, 24]).unwrap().unwrap();
                assert_eq!(again.request, found.request, "the same number is the same scene");
            }
            if let Some(id) = found.request["volume"]["id"].as_str() {
                bench.assets().volumes().delete(id).unwrap();
            }
        }
        let wanted = views.iter().map(|name| format!("technique {name}")).chain(
            [
                "technique auto",
                "moment end",
                "moment first",
                "moment moved",
                "budget: 1 samples",
                "budget: max_error",
                "budget: time_ms",
                "subject: an upload",
                "subject: a built-in",
                "subject: a field",
                "`emission_absorption`: pre_integrated true",
                "`emission_absorption`: interpolation b_spline",
                "`emission_absorption`: opacity_threshold",
                "`isosurface`: surfaces",
                "`projection`: mode xray",
                "`slice`: thickness",
                "`single_scatter`: tracking weighted",
                "`volume_path`: adaptive true",
            ]
            .map(String::from),
        );
        let missing: Vec<String> = wanted.filter(|name| !said.contains(name)).collect();
        assert!(missing.is_empty(), "{missing:?}: {said:?}");
    });
}

/// Scenes of the quick study: three of each view and of the planner.
const FIXED: std::ops::Range<u64> = 2000..2021;

#[test]
fn stated_errors_keep_their_word_in_a_fixed_part_of_the_study() {
    on_a_bench(|bench| {
        let found = honesty(bench, FIXED, true, &mut |line| eprintln!("{line}")).unwrap();
        let figures = found.figures();
        eprintln!("{figures:?}");
        assert!(figures.known >= 12, "{figures:?}");
        // 19 of 20 are covered; more than two misses of some fifteen are less likely than one in thirty.
        assert!(figures.covered + 2 >= figures.known && figures.nearly == figures.known, "{figures:?}");
        assert!(figures.above <= 1 && figures.median < 1.6, "{figures:?}");
        assert_eq!(figures.asked[0], figures.asked[1], "{figures:?}");
    });
}

#[test]
fn the_judge_finds_the_error_of_a_picture_whose_error_is_known() {
    on_a_bench(|bench| {
        let truth = json!({"technique": "projection", "projection": {"mode": "mean"}, "image": {"width": 24, "height": 16},
            "volume": {"builtin": "gaussian", "resolution": 32}});
        let mut fine = truth.clone();
        (fine["image"], fine["budget"]) = (json!({"width": 5 * 24, "height": 5 * 16}), json!({"samples": 64}));
        let picture = bench.run(&fine, Reads::Blocks(5)).unwrap().values;
        let mean = picture.iter().sum::<f64>() / picture.len() as f64;
        let off =
            |by: f64| picture.iter().enumerate().map(|(i, v)| v + if i % 2 == 0 { by } else { -by } * mean).collect();
        for by in [0.01, 0.3] {
            let picture: Vec<f64> = off(by);
            let found = judge(bench, &truth, &picture, TRUTH_MS).unwrap().unwrap();
            assert!((found.error / by - 1.0).abs() < 0.02 && found.known_to < 0.2 * by, "{by}: {found:?}");
        }
    });
}
