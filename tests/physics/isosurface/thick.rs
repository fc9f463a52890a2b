//! Slabs and balls at random places, along parallel rays. Bodies that are thicker than a step must show.

use glam::{DVec3, dvec3};
use serde_json::json;

use super::cameras::{origin, parallel};
use super::depth::{VOXEL, check, crossings, depths};
use crate::common::engine::House;
use crate::common::writers::Random;
use crate::emission_absorption::oracle::inside;
use crate::projection::grid::Grid;

/// The number of voxels along an axis that gives a voxel its side.
const N: usize = 43;
const ISOVALUE: f64 = 0.5;

fn between(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * (random.next() >> 11) as f64 / (1u64 << 53) as f64
}

fn direction(random: &mut Random) -> DVec3 {
    let (z, turn) = (between(random, -1.0, 1.0), between(random, 0.0, std::f64::consts::TAU));
    let r = (1.0 - z * z).sqrt();
    dvec3(r * turn.cos(), r * turn.sin(), z)
}

/// A bell over the distance from a plane or a point, which is at the isovalue `half` away.
fn body(random: &mut Random, half: f64, ball: bool) -> Grid {
    let normal = direction(random);
    let middle = direction(random) * between(random, 0.0, 0.6);
    let centre = |i: usize| (i as f64 + 0.5) * VOXEL - 1.0;
    let value = |i: usize| {
        let p = dvec3(centre(i % N), centre(i / N % N), centre(i / N / N)) - middle;
        let far = if ball { p.length() } else { p.dot(normal) };
        ISOVALUE.powf((far / half).powi(2)) as f32
    };
    Grid { dims: [N; 3], voxels: (0..N * N * N).map(value).collect() }
}

/// The number of rays that meet something, that meet a body hardly thicker than a step, and that miss a thinner one.
#[derive(Default, Debug)]
struct Seen {
    met: usize,
    thick: usize,
    thin: usize,
}

fn look(grid: &Grid, forward: DVec3, step_voxels: f64, case: &str, seen: &mut Seen) {
    let house = House::shared();
    let own = json!({"isovalue": ISOVALUE, "step_voxels": step_voxels});
    let found = depths(house, &grid.store(house), &parallel(forward), &own);
    for (pixel, found) in found.into_iter().enumerate() {
        let from = origin(pixel, forward);
        let Some((near, far)) = inside(from, forward, DVec3::ONE) else {
            assert!(found.is_none(), "{case}, pixel {pixel}");
            continue;
        };
        let truth = crossings(|t| grid.value(from + forward * t, "trilinear") - ISOVALUE, near, far);
        let step = step_voxels * VOXEL;
        seen.met += usize::from(check(found, &truth, step, &format!("{case}, pixel {pixel}")));
        if let [a, b] = &truth[..] {
            seen.thick += usize::from((1.0..1.5).contains(&((b.t - a.t) / step)));
            seen.thin += usize::from(b.t - a.t < step && found.is_none());
        }
    }
}

#[test]
fn slabs_and_balls_thicker_than_a_step_are_met() {
    let mut random = Random(5);
    for step_voxels in [1.0, 2.0, 4.0] {
        let mut seen = Seen::default();
        for case in 0..8 {
            let ball = case % 2 == 1;
            let half = 0.5 * step_voxels * VOXEL * between(&mut random, 0.6, if ball { 1.8 } else { 1.2 });
            let grid = body(&mut random, half.max(0.4 * VOXEL), ball);
            let forward = direction(&mut random);
            look(&grid, forward, step_voxels, &format!("step {step_voxels}, body {case}"), &mut seen);
        }
        println!("step {step_voxels}: {seen:?}");
        assert!(seen.met > 500 && seen.thick > 100, "step {step_voxels}: {seen:?}");
        assert!(seen.thin > 0, "step {step_voxels}: some are so thin that the bound shows: {seen:?}");
    }
}
