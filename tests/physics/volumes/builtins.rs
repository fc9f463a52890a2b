//! Built-in volumes against closed forms.

use crate::common::writers::pointer;
use cloudchamber::volume::builtin::{
    BUILTINS, ELLIPSOIDS, GAUSSIAN_SIGMA, NAMES, SPHERE_RADIUS, build, chamber_value, marschner_lobb_value,
    shepp_logan_value,
};
use cloudchamber::volume::{Volume, VoxelType};
use glam::DVec3;
use std::f64::consts::PI;

/// The integral of a built-in over its box, by the midpoint rule.
fn integral(volume: &Volume) -> f64 {
    let values = (0..volume.voxel_count()).map(|i| f64::from(volume.voxels().unwrap().get_f32(i)));
    values.sum::<f64>() * volume.spacing().iter().product::<f64>()
}

fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "found {found}, expected {expected} within {tolerance}");
}

#[test]
fn all_fill_the_cube_and_keep_their_bounds() {
    for builtin in &BUILTINS {
        for n in [8, 33] {
            let volume = build(builtin.name, n, 5).unwrap();
            assert_eq!((volume.dims(), volume.voxel_type(), volume.unit()), ([n; 3], VoxelType::F32, "unit"));
            let map = volume.world_from_index();
            assert!(map.transform_point3(DVec3::ZERO).abs_diff_eq(DVec3::NEG_ONE, 1e-12));
            assert!(map.transform_point3(DVec3::splat(n as f64)).abs_diff_eq(DVec3::ONE, 1e-12));
            let [min, max] = volume.range();
            let within = |value: f64| value >= builtin.bounds[0] - 1e-6 && value <= builtin.bounds[1] + 1e-6;
            assert!(within(min) && within(max), "{}: {min} to {max}", builtin.name);
            assert_eq!(volume.non_finite(), 0);
        }
    }
    assert_eq!(NAMES.len(), BUILTINS.len());
    assert_eq!(pointer(build("teapot", 64, 0)), "/volume/builtin");
    for n in [0, 7, 513] {
        assert_eq!(pointer(build("sphere", n, 0)), "/volume/resolution");
    }
}

#[test]
fn marschner_lobb_has_its_closed_form() {
    // sin(±π/2) = ±1; the ripple is 1 on the axis (cos 12π) and at r = 1 (cos 0), −1 where cos(πr/2) = 1/12.
    let trough = 2.0 / PI * (1.0f64 / 12.0).acos();
    close(marschner_lobb_value(0.0, 0.0, -1.0), 1.0, 1e-12);
    close(marschner_lobb_value(0.0, 0.0, 1.0), 0.2, 1e-12);
    close(marschner_lobb_value(0.6, 0.8, -1.0), 1.0, 1e-12);
    close(marschner_lobb_value(trough, 0.0, 1.0), 0.0, 1e-12);
    close(marschner_lobb_value(0.0, -trough, -1.0), 0.8, 1e-12);
    close(marschner_lobb_value(0.0, trough, 0.0), 0.4, 1e-12);
    let volume = build("marschner_lobb", 40, 0).unwrap();
    for [x, y, z] in [[0, 0, 0], [39, 0, 20], [7, 30, 11], [20, 20, 39]] {
        let world = volume.world_from_index().transform_point3(DVec3::new(x as f64, y as f64, z as f64) + 0.5);
        close(volume.values().unwrap().at(x, y, z), marschner_lobb_value(world.x, world.y, world.z), 1e-6);
    }
}

#[test]
fn shepp_logan_has_the_greys_of_its_table() {
    for ([x, y, z], expected) in [
        ([0.95, 0.0, 0.0], 0.0),
        ([0.0, 0.9, 0.0], 1.0),
        ([0.0, 0.0, 0.89], 1.0),
        ([0.0, 0.0, 0.0], 0.2),
        ([-0.22, 0.0, -0.25], 0.0),
        ([0.22, 0.0, -0.25], 0.0),
        ([0.0, 0.35, -0.25], 0.4),
        ([0.0, 0.095, -0.25], 0.4),
        ([-0.08, -0.65, -0.25], 0.3),
        ([0.06, -0.65, -0.25], 0.3),
        ([0.06, -0.105, 0.625], 0.4),
        ([0.0, 0.1, 0.625], 0.0),
        // The left ventricle's long axis points to 108°, up and outwards. Its mirror image is brain.
        ([-0.22 - 0.118, 0.361, -0.25], 0.0),
        ([-0.22 + 0.118, -0.361, -0.25], 0.0),
        ([-0.22 - 0.118, -0.361, -0.25], 0.2),
    ] {
        close(shepp_logan_value(x, y, z), expected, 1e-12);
    }
    let mass: f64 =
        ELLIPSOIDS.iter().map(|e| e.grey * 4.0 / 3.0 * PI * e.semi_axes[0] * e.semi_axes[1] * e.semi_axes[2]).sum();
    close(integral(&build("shepp_logan", 96, 0).unwrap()), mass, 0.003 * mass);
}

#[test]
fn the_chamber_is_the_lecture_room() {
    for ([x, y, z], expected) in [
        ([0.5, 0.5, 0.5], 0.1),
        ([0.01, 0.5, 0.5], 100.0),
        ([0.5, 0.01, 0.5], 100.0),
        ([0.5, 0.5, 0.99], 100.0),
        ([0.99, 0.5, 0.5], 0.1),
        ([0.5, 0.5, 0.01], 0.1),
        ([0.5, 0.99, 0.5], 0.1),
        ([0.3, 0.8, 0.3], 100.0),
        ([0.5, 0.8, 0.5], 0.1),
        ([0.5 + 0.031, 0.8, 0.5], 0.1),
        ([0.5 + 0.032, 0.8, 0.5], 100.0),
        ([0.5, 0.77, 0.3], 0.1),
        ([0.5, 0.84, 0.3], 0.1),
        ([0.5, 0.1, 0.5], 4.5),
        ([0.5, 0.19, 0.5], 4.05),
        ([0.5, 0.21, 0.5], 0.1),
    ] {
        close(chamber_value(x, y, z), expected, 1e-12);
    }
    let volume = build("chamber", 100, 0).unwrap();
    close(volume.values().unwrap().at(50, 80, 50), 0.1, 1e-6);
    close(volume.values().unwrap().at(30, 80, 30), 100.0, 1e-6);
    close(volume.values().unwrap().at(50, 10, 50), (1.0 - 0.105) * 5.0, 1e-5);
    close(volume.values().unwrap().at(50, 50, 99), 100.0, 1e-6);
}

#[test]
fn sphere_and_gaussian_have_their_volumes() {
    // The mean of (R + s)³ over the edge's width h, |s| ≤ h/2, is R³ + Rh²/4.
    let (radius, voxel) = (SPHERE_RADIUS, 2.0 / 48.0);
    let ball = 4.0 / 3.0 * PI * (radius.powi(3) + radius * voxel * voxel / 4.0);
    close(integral(&build("sphere", 48, 0).unwrap()), ball, 1e-3);
    let sphere = build("sphere", 64, 0).unwrap();
    assert_eq!((sphere.values().unwrap().at(32, 32, 32), sphere.values().unwrap().at(0, 0, 0)), (1.0, 0.0));
    let edge = (0..64).map(|x| sphere.values().unwrap().at(x, 32, 32)).filter(|&v| v > 0.0 && v < 1.0).count();
    assert!((1..=4).contains(&edge), "an edge of one voxel on each side, found {edge}");
    // The Gaussian is cut at 1 / 0.3 standard deviations, which loses erf's tail of 8.6e-4 along each axis.
    let whole = (2.0 * PI).powf(1.5) * GAUSSIAN_SIGMA.powi(3);
    close(integral(&build("gaussian", 48, 0).unwrap()), whole, 3.5e-3 * whole);
    assert_eq!(build("constant", 8, 0).unwrap().range(), [1.0, 1.0]);
}

#[test]
fn smoke_is_a_puff_that_its_seed_decides() {
    let smoke = build("smoke", 64, 7).unwrap();
    assert_eq!(smoke.voxels().unwrap(), build("smoke", 64, 7).unwrap().voxels().unwrap());
    assert_ne!(smoke.voxels().unwrap(), build("smoke", 64, 8).unwrap().voxels().unwrap());
    let at = |x: usize, y: usize, z: usize| smoke.values().unwrap().at(x, y, z);
    for i in 0..64 {
        for j in 0..64 {
            let faces = [at(0, i, j), at(63, i, j), at(i, 0, j), at(i, 63, j), at(i, j, 0), at(i, j, 63)];
            assert_eq!(faces, [0.0; 6], "nothing is cut off");
        }
    }
    for seed in 0..6 {
        let puff = build("smoke", 32, seed).unwrap();
        let filled = (0..puff.voxel_count()).filter(|&i| puff.voxels().unwrap().get_f32(i) > 0.05).count();
        let share = filled as f64 / puff.voxel_count() as f64;
        assert!((0.03..0.35).contains(&share), "seed {seed}: {share} of the box");
        assert!(puff.range()[1] > 0.8 && puff.range()[1] <= 1.0, "seed {seed}: {:?}", puff.range());
    }
}
