//! A simulation that is stopped, looked at and resumed.

use std::time::Duration;

use cloudchamber::device::grid::Grid;
use cloudchamber::device::{Device, DeviceConfig};
use cloudchamber::run::sources;
use cloudchamber::technique::{Field, Look, Process, Step};
use cloudchamber::volume::DeviceGrid;
use serde_json::{Value, json};

use super::run::request;
use crate::common::engine::House;

/// A slice so short that a batch of photons is cut by it.
const SLICE: Duration = Duration::from_micros(200);

fn device(field: &dyn Field) -> Device {
    let _opening = crate::common::opening();
    // Launches of few steps leave photons under way.
    let mut device = Device::open(&DeviceConfig { first_steps: 64, strict: true, ..DeviceConfig::pocl() }).unwrap();
    for variant in field.kernels().unwrap() {
        let source = sources().find(|source| source.kernel == variant.kernel).unwrap();
        device.build(&source, &variant).unwrap();
    }
    device
}

/// The grid and the result of a process.
fn look(device: &mut Device, process: &mut dyn Process<Look = Look>, voxels: usize) -> (Vec<f32>, Value) {
    let seen = process.look(device).unwrap();
    (Grid::new(device, seen.voxels, voxels).unwrap().read().unwrap(), seen.result)
}

/// Steps until nothing is half done.
fn to_a_whole(device: &mut Device, process: &mut dyn Process<Look = Look>) -> Step {
    loop {
        let step = process.step(device, SLICE).unwrap();
        if step.is_whole {
            return step;
        }
    }
}

#[test]
fn a_simulation_that_is_stopped_and_resumed_comes_to_the_same_grid() {
    let parameters = json!({"photons": 40_000, "grid": [9, 8, 7], "size_mm": [9, 8, 7],
        "medium": {"mu_a_per_mm": 0.05, "mu_s_per_mm": 1.0}});
    let scene = House::shared().scene(&request(&parameters)).unwrap();
    let field = scene.subject().field().unwrap().field.clone();
    let mut device = device(&*field);
    let voxels = 9 * 8 * 7;

    let mut whole = field.begin(&mut device).unwrap();
    while !whole.step(&mut device, Duration::from_millis(40)).unwrap().progress.is_over() {}
    let (expected, of_whole) = look(&mut device, &mut *whole, voxels);

    let mut process = field.begin(&mut device).unwrap();
    let mut stops = 0;
    loop {
        let step = to_a_whole(&mut device, &mut *process);
        if step.progress.is_over() {
            break;
        }
        if stops < 3 && step.progress.done >= 10_000 * (stops + 1) {
            process.stop(&mut device).unwrap();
            stops += 1;
            let (grid, result) = look(&mut device, &mut *process, voxels);
            assert_eq!(result["photons"], step.progress.done, "it tells what is done");
            assert!(step.progress.done < 40_000 && grid != expected, "only a part is done");
            let absorbed = |of: &Value| of["ledger"]["absorbed"]["value"].as_f64().unwrap();
            // A photon's absorbed part deviates by a half at most.
            let z = (absorbed(&result) - absorbed(&of_whole)) / (0.5 / (step.progress.done as f64).sqrt());
            assert!(z.abs() < 4.0, "the part is a whole simulation of fewer photons: z = {z}, {result}");
        }
    }
    assert_eq!(stops, 3, "it was stopped before its end");
    let (grid, result) = look(&mut device, &mut *process, voxels);
    assert_eq!(grid, expected);
    for (name, entry) in of_whole["ledger"].as_object().unwrap() {
        assert_eq!(result["ledger"][name]["value"], entry["value"], "{name}");
    }
}
