//! Every kernel variant that may be built is what some request asks for, and runs: for each of them a picture of a few pixels, which
//! is the same whatever the type of the voxels.

use std::collections::BTreeSet;

use cloudchamber::device::DeviceConfig;
use cloudchamber::render::Subject;
use cloudchamber::technique::{self, Kind, Technique};
use cloudchamber::volume::RawQuery;
use serde_json::{Value, json};

use crate::common::engine::House;
use crate::common::pictures::with_volumes;
use crate::common::processes::in_processes;

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
        house.store().insert(bytes, name, query.parse().unwrap()).unwrap().1
    };
    vec![
        of("u8", values.clone()),
        of("i16", values.iter().flat_map(|v| i16::from(*v).to_le_bytes()).collect()),
        of("u16", values.iter().flat_map(|v| u16::from(*v).to_le_bytes()).collect()),
        of("f32", values.iter().flat_map(|v| f32::from(*v).to_le_bytes()).collect()),
    ]
}

/// The mean luminance of a picture of a few pixels, after the label of the variant that it is made by is noted.
fn look(house: &House, request: &Value, reached: &mut BTreeSet<String>) -> f64 {
    let scene = house.scene(request).unwrap_or_else(|e| panic!("{request}: {e}"));
    match scene.subject() {
        Subject::Volume(volume) => reached.extend([scene.view().plan(volume).unwrap().variant.label()]),
        Subject::Field(field, _) => reached.extend(field.kernels().unwrap().iter().map(|variant| variant.label())),
    }
    let (film, _) = house.film(request);
    let values = film.main.mean.chunks_exact(4).map(|p| f64::from(p[0] + p[1] + p[2])).collect::<Vec<_>>();
    assert!(values.iter().all(|v| v.is_finite()), "{request}");
    values.iter().sum::<f64>() / values.len() as f64
}

fn request(technique: &str, own: &Value, volume: &Value) -> Value {
    json!({"technique": technique, technique: own, "volume": volume, "image": {"width": 8, "height": 6}, "budget": {"samples": 1}})
}

/// Runs requests that reach every variant of these techniques, and no other.
fn reach(house: &House, techniques: &[&Technique]) {
    let mut reached = BTreeSet::new();
    let varied = volumes(house, |i| (i * 37 % 201) as u8);
    let even = volumes(house, |_| 9);
    for technique in techniques {
        for case in (technique.cases)().all {
            let (name, own) = (technique.name, &case.own);
            if let Kind::Field { .. } = technique.kind {
                let field = with_volumes(&json!({name: own}), house);
                let request = request("projection", &json!({"mode": "maximum"}), &field);
                assert!(look(house, &request, &mut reached) > 0.0, "{own}: nothing is there");
                continue;
            }
            for ids in [Some(&varied), Some(&even).filter(|_| case.is_even_too)].into_iter().flatten() {
                let mut looked = |id: &String| look(house, &request(name, own, &json!({"id": id})), &mut reached);
                let means: Vec<f64> = ids.iter().map(&mut looked).collect();
                let apart = means.iter().map(|m| (m - means[3]).abs()).fold(0.0, f64::max);
                assert!(means[3] > 0.0 && apart <= 2e-4 * means[3], "{name} {own}: {means:?} by types");
            }
        }
    }
    let listed = techniques.iter().flat_map(|t| ((t.source)().variants)());
    let all: BTreeSet<String> = listed.map(|v| v.label()).collect();
    let missed: Vec<_> = all.difference(&reached).collect();
    assert!(missed.is_empty(), "no case of the techniques runs {missed:#?}");
    assert!(reached.is_subset(&all), "what is run is in the list: {:?}", reached.difference(&all));
}

/// Built with warnings as errors: what a device of so many lanes as this one runs is built here, and `device` builds the others.
#[test]
fn every_variant_is_what_some_request_runs() {
    in_processes("variants::every_variant_is_what_some_request_runs", &["0", "1"], |part| {
        let house = House::on(DeviceConfig { strict: true, ..DeviceConfig::pocl() });
        // As many variants in each, about.
        let mut by_size: Vec<&Technique> = technique::ALL.iter().collect();
        by_size.sort_by_key(|t| std::cmp::Reverse(((t.source)().variants)().len()));
        let mut parts = [(0, Vec::new()), (0, Vec::new())];
        for technique in by_size {
            let smaller = usize::from(parts[1].0 < parts[0].0);
            parts[smaller].0 += ((technique.source)().variants)().len();
            parts[smaller].1.push(technique);
        }
        reach(&house, &parts[part.parse::<usize>().unwrap()].1);
    });
}
