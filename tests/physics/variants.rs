//! Every permitted kernel variant is needed by some request, and runs. For each variant there is a picture of a few pixels, which is the same
//! whatever the type of the voxels.

use std::collections::BTreeSet;

use cloudchamber::technique::{self, Kind, Technique};
use cloudchamber::volume::RawQuery;
use serde_json::{Value, json};

use crate::common::engine::{House, kernels_of};
use crate::common::pictures::with_volumes;
use crate::common::processes::in_processes;
use crate::levels::is_full;

const SIDE: usize = 8;

/// Whole numbers from 0 to 200, the same in every type of voxels.
fn volumes(house: &House, value: impl Fn(usize) -> u8) -> Vec<String> {
    let values: Vec<u8> = (0..SIDE.pow(3)).map(value).collect();
    let of = |name: &str, bytes: Vec<u8>| {
        let query = RawQuery {
            dims: Some(format!("{SIDE},{SIDE},{SIDE}")),
            r#type: Some(name.into()),
            spacing: None,
            endian: None,
        };
        house.assets().volumes().insert(bytes, name, query.parse().unwrap()).unwrap().1
    };
    vec![
        of("u8", values.clone()),
        of("i16", values.iter().flat_map(|v| i16::from(*v).to_le_bytes()).collect()),
        of("u16", values.iter().flat_map(|v| u16::from(*v).to_le_bytes()).collect()),
        of("f32", values.iter().flat_map(|v| f32::from(*v).to_le_bytes()).collect()),
    ]
}

/// The mean luminance of a picture of a few pixels. The label of its variant is noted.
fn look(house: &House, request: &Value, reached: &mut BTreeSet<String>) -> f64 {
    let scene = house.scene(request).unwrap_or_else(|e| panic!("{request}: {e}"));
    reached.extend(kernels_of(&scene).iter().map(|variant| variant.label()));
    let (film, _) = house.film(request);
    let values = film.main.mean.chunks_exact(4).map(|p| f64::from(p[0] + p[1] + p[2])).collect::<Vec<_>>();
    assert!(values.iter().all(|v| v.is_finite()), "{request}");
    values.iter().sum::<f64>() / values.len() as f64
}

fn request(technique: &str, own: &Value, volume: &Value) -> Value {
    json!({"technique": technique, technique: own, "volume": volume, "image": {"width": 8, "height": 6}, "budget": {"samples": 1}})
}

/// A variant's label without the type of its voxels.
fn without_type(label: &str) -> String {
    let is_type = |word: &&str| ["u8", "i16", "u16", "f32"].contains(word);
    label.split(' ').filter(|word| !is_type(word)).collect::<Vec<_>>().join(" ")
}

/// The places in [`volumes`] of the types of voxels on which a technique's case runs: the first case on all types, the others on one in turn and on
/// the last, with which it is compared. `--full` runs all on all.
fn types(case: usize) -> Vec<usize> {
    if case == 0 || is_full() { vec![0, 1, 2, 3] } else { vec![case % 3, 3] }
}

/// Runs requests that reach every combination of these techniques' features, and no other.
fn reach(house: &House, techniques: &[&Technique]) {
    let mut reached = BTreeSet::new();
    let varied = volumes(house, |i| (i * 37 % 201) as u8);
    let even = volumes(house, |_| 9);
    for technique in techniques {
        for (at, case) in (technique.cases)().all.into_iter().enumerate() {
            let (name, own) = (technique.name, &case.own);
            if let Kind::Export { .. } = technique.kind {
                for id in &varied {
                    let request = json!({"technique": name, name: own, "volume": {"id": id}});
                    let task = house.export_task(&request);
                    reached
                        .extend(task.export().kernels(task.subject()).unwrap().iter().map(|variant| variant.label()));
                    assert!(!house.export(&request).file().unwrap().bytes.is_empty(), "{request}: nothing is there");
                }
                continue;
            }
            if let Kind::Field { .. } = technique.kind {
                let field = with_volumes(&json!({name: own}), house);
                let request = request("projection", &json!({"mode": "maximum"}), &field);
                assert!(look(house, &request, &mut reached) > 0.0, "{own}: nothing is there");
                continue;
            }
            for ids in [Some(&varied), Some(&even).filter(|_| case.is_even_too)].into_iter().flatten() {
                let mut looked = |id: &String| look(house, &request(name, own, &json!({"id": id})), &mut reached);
                let means: Vec<f64> = types(at).into_iter().map(|of| looked(&ids[of])).collect();
                let last = means[means.len() - 1];
                let apart = means.iter().map(|m| (m - last).abs()).fold(0.0, f64::max);
                assert!(last > 0.0 && apart <= 2e-4 * last, "{name} {own}: {means:?} by types");
            }
        }
    }
    let listed = techniques.iter().flat_map(|t| ((t.source)().variants)());
    let all: BTreeSet<String> = listed.map(|v| v.label()).collect();
    // The comparison is of every variant, or of one for each combination of features.
    let features = |label: &String| if is_full() { label.clone() } else { without_type(label) };
    let [listed, run]: [BTreeSet<String>; 2] = [&all, &reached].map(|labels| labels.iter().map(features).collect());
    let missed: Vec<_> = listed.difference(&run).collect();
    assert!(missed.is_empty(), "no case of the techniques runs {missed:#?}");
    assert!(reached.is_subset(&all), "what is run is in the list: {:?}", reached.difference(&all));
}

#[test]
fn every_variant_is_what_some_request_runs() {
    in_processes("variants::every_variant_is_what_some_request_runs", &["0", "1"], |part| {
        let house = House::shared();
        // Each of the two parts has about as many variants.
        let mut by_size: Vec<&Technique> = technique::ALL.iter().collect();
        by_size.sort_by_key(|t| std::cmp::Reverse(((t.source)().variants)().len()));
        let mut parts = [(0, Vec::new()), (0, Vec::new())];
        for technique in by_size {
            let smaller = usize::from(parts[1].0 < parts[0].0);
            parts[smaller].0 += ((technique.source)().variants)().len();
            parts[smaller].1.push(technique);
        }
        reach(house, &parts[part.parse::<usize>().unwrap()].1);
    });
}
