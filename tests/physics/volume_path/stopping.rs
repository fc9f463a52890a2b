//! The end of a render, the distribution of its samples, and its error estimate.

use serde_json::{Value, json};

use crate::common::engine::House;
use crate::common::light::{film, same_picture, scene, total};
use crate::common::with;

fn smoke() -> Value {
    json!({"builtin": "smoke", "resolution": 48})
}

fn camera() -> Value {
    json!({"eye": [1.6, 1.2, -2.2], "up": [0, 1, 0], "fov_y_deg": 60})
}

fn own(more: &Value) -> Value {
    let own = json!({"medium": {"sigma_t_per_unit": 15, "albedo": 0.9}, "lights": [
        {"type": "sun", "direction": [0.4, 0.8, -0.5]}, {"type": "sky", "radiance": 0.2, "visible": false}]});
    with(&own, more)
}

#[test]
fn an_error_stops_no_render_of_fewer_than_16_samples_a_pixel_or_4096_in_all() {
    for technique in ["volume_path", "single_scatter"] {
        let of = |side: u32, most: f64| {
            let mut request = scene(technique, &smoke(), &camera(), &own(&json!({})), side, 1);
            request["budget"] = json!({ "max_error": most });
            House::shared().finish(&request).resource()
        };
        // Pictures of 16², 32² and 64² pixels: 4096 samples in all are 16, 4 and 1 of a pixel. A smaller picture needs 16, too.
        for (side, samples) in [(8, 16), (16, 16), (32, 4), (64, 1)] {
            let resource = of(side, 10.0);
            assert_eq!((&resource["samples"], &resource["stopped_by"]), (&json!(samples), &json!("error")), "{side}");
        }
        let resource = of(48, 0.05);
        assert!(
            resource["samples"].as_u64().unwrap() > 16 && resource["error"].as_f64().unwrap() <= 0.05,
            "{resource}"
        );
        let slope = resource["trace_slope"].as_f64();
        assert!(slope.is_none_or(|s| (s + 0.5).abs() < 0.1), "{technique}: the error falls with the power {slope:?}");
    }
}

#[test]
fn the_stated_error_is_the_real_one() {
    // The truth is a picture of 64 times the samples and another seed.
    let truth = {
        let mut request = scene("volume_path", &smoke(), &camera(), &own(&json!({})), 48, 4096);
        request["seed"] = json!(77);
        film(House::shared(), &request)
    };
    for adaptive in [false, true] {
        let request = scene("volume_path", &smoke(), &camera(), &own(&json!({"adaptive": adaptive})), 48, 64);
        let film = film(House::shared(), &request);
        let (real, stated) = (film.difference(&truth).unwrap(), film.error().total.unwrap());
        println!("adaptive {adaptive}: {real:.4} real, {stated:.4} stated");
        assert!((0.8..1.25).contains(&(stated / real)), "adaptive {adaptive}: {real} real, {stated} stated");
    }
}

#[test]
fn adaptive_samples_go_where_the_noise_is_with_a_bias_below_it() {
    let run = |adaptive: bool, seed: u64| {
        let mut request = scene("volume_path", &smoke(), &camera(), &own(&json!({"adaptive": adaptive})), 64, 96);
        request["seed"] = json!(seed);
        film(House::shared(), &request)
    };
    let (even, placed) = (run(false, 1), run(true, 2));
    let tiles = placed.main.tiles.as_ref().unwrap();
    assert_eq!(tiles.counts.iter().sum::<u32>(), 16 * 96, "{:?}", tiles.counts);
    assert!(tiles.counts.iter().max() > tiles.counts.iter().min(), "{:?}", tiles.counts);
    let (before, after) = (even.error().total.unwrap(), placed.error().total.unwrap());
    println!("error {before:.4} evenly, {after:.4} placed");
    assert!(after < 0.95 * before, "{after} is no less than {before}");
    // The bias over twenty seeds is within their noise, and less than 0.2 % of the mean.
    let sum = |adaptive: bool, first: u64| {
        (first..first + 20).map(|seed| total(&run(adaptive, seed))).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1))
    };
    let (a, b) = (sum(true, 100), sum(false, 200));
    let z = (a.0 - b.0) / (a.1 + b.1).sqrt();
    println!("bias {:.2e} of the mean, z {z:.2}", a.0 / b.0 - 1.0);
    assert!(z.abs() < 3.5 && (a.0 / b.0 - 1.0).abs() < 2e-3, "{a:?} {b:?}");
}

#[test]
fn clamping_says_what_it_takes() {
    let run = |more: &Value| {
        let request = scene("volume_path", &smoke(), &camera(), &own(more), 48, 64);
        let job = House::shared().finish(&request);
        (total(&House::shared().film_of(&job)).0, job.resource()["counts"].clone())
    };
    let (all, counts) = run(&json!({}));
    assert_eq!((&counts["clamped_samples"], counts["clamped_energy"].as_f64()), (&json!(0), Some(0.0)));
    let (kept, counts) = run(&json!({"clamp_luminance": 0.2}));
    let lost = counts["clamped_energy"].as_f64().unwrap();
    assert!(counts["clamped_samples"].as_u64().unwrap() > 0 && lost > 0.001, "{counts}");
    assert!((kept / all - (1.0 - lost)).abs() < 1e-4, "{kept} of {all} are kept, {lost} is said to be lost");
}

#[test]
fn fireflies_are_counted() {
    // A point light in thin smoke has fireflies, since 1 / r² has no finite variance. Fog under a sky has none.
    let bright =
        json!({"medium": {"sigma_t_per_unit": 0.5}, "lights": [{"type": "point", "position": [0.0, 0.0, 0.0]}]});
    let count = |own: &Value| {
        let request = scene("volume_path", &smoke(), &camera(), own, 64, 256);
        House::shared().finish(&request).resource()["counts"]["fireflies"].as_u64().unwrap()
    };
    let sky = json!({"medium": {"sigma_t_per_unit": 5}, "lights": [{"type": "sky", "radiance": 1}]});
    let (wild, calm) = (count(&bright), count(&sky));
    assert!(wild > 20 && calm == 0, "{wild} and {calm}");
}

#[test]
fn the_same_bytes_with_one_lane_within_rounding() {
    let run = |house: &House| film(house, &scene("volume_path", &smoke(), &camera(), &own(&json!({})), 32, 64));
    let one = House::of_lanes(1);
    same_picture(&run(House::shared()), &run(one), "lanes");
    let (again, first) = (run(House::shared()), run(House::shared()));
    assert_eq!(again.main.mean, first.main.mean);
}

#[test]
fn of_one_sample_the_error_is_told_from_the_neighbours() {
    let error = |samples: u32| {
        let job = House::shared().finish(&scene("volume_path", &smoke(), &camera(), &own(&json!({})), 64, samples));
        job.resource()["error"].as_f64().unwrap()
    };
    let (one, many) = (error(1), 16.0 * error(256));
    assert!((0.5..2.0).contains(&(one / many)), "{one} of one sample, {many} by 256");
}
