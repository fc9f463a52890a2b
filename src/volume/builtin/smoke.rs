//! A puff of smoke: a ball whose surface and inside are stirred by fractal gradient noise.
//!
//! density = smoothstep(edge) · texture, edge = R − |p| + amplitude · fbm(p), where fbm is five octaves of Perlin's
//! gradient noise ("Improving noise", SIGGRAPH 2002) with the lattice's gradients hashed from the seed. Values are in
//! [0, 1], 0 near the box's faces, so that the puff is never cut off.

use crate::split_mix::mix;

/// The radius of the undisturbed ball.
const RADIUS: f64 = 0.5;
/// The amplitude of the noise that moves its surface.
const AMPLITUDE: f64 = 0.55;
/// The noise cells per unit of length in the first octave.
const FREQUENCY: f64 = 2.1;
/// The number of octaves. The last has details of 1/34 of a unit, four voxels at the default resolution.
const OCTAVES: u32 = 5;
/// The ratio of amplitudes from octave to octave.
const GAIN: f64 = 0.52;
/// The depth below the disturbed surface at which the smoke is at its densest.
const SOFTNESS: f64 = 0.35;
/// The smoke ends at this distance from the middle at the latest.
const END: f64 = 0.98;

/// No value of the noise lies beyond this (its greatest is 1.036).
const NOISE_BOUND: f64 = 1.04;

/// The smoke's density at a point of [−1, 1]³.
pub fn value(x: f64, y: f64, z: f64, seed: u64) -> f64 {
    let r = (x * x + y * y + z * z).sqrt();
    if r >= END {
        return 0.0;
    }
    let Some(noise) = fbm([x, y, z], seed, (r - RADIUS) / AMPLITUDE) else { return 0.0 };
    let edge = RADIUS - r + AMPLITUDE * noise;
    let fade = smoothstep((END - r) / 0.2);
    // Billows have dark creases where the noise changes its sign.
    let texture = 0.35 + 0.65 * smoothstep(noise.abs() * 1.6);
    smoothstep(edge / SOFTNESS) * texture * fade
}

/// The function 3t² − 2t³ on [0, 1], constant beyond.
fn smoothstep(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The sum of the octaves, within about ±1; `None` if it is not above `least`, which the first octaves often settle.
fn fbm(at: [f64; 3], seed: u64, least: f64) -> Option<f64> {
    let (mut sum, mut amplitude, mut frequency) = (0.0, 1.0, FREQUENCY);
    for octave in 0..OCTAVES {
        // The seed is mixed first, so that neighbouring seeds do not share octaves.
        let key = mix(seed).wrapping_add(u64::from(octave));
        sum += amplitude * gradient_noise(at.map(|p| p * frequency), key);
        amplitude *= GAIN;
        // The octaves to come add no more than an endless row of them would.
        if sum + NOISE_BOUND * amplitude / (1.0 - GAIN) <= least {
            return None;
        }
        // The factor is not 2, since the lattices of the octaves must not share their zeros.
        frequency *= 2.03;
    }
    (sum > least).then_some(sum)
}

/// Perlin's noise at `at`: 0 at the lattice's points, within ±1.
fn gradient_noise(at: [f64; 3], seed: u64) -> f64 {
    let floor = at.map(f64::floor);
    let within = [0, 1, 2].map(|axis| at[axis] - floor[axis]);
    let cell = floor.map(|p| p as i64);
    let weight = within.map(|t| t * t * t * (t * (t * 6.0 - 15.0) + 10.0));
    let mut sum = 0.0;
    for corner in 0..8 {
        let bit = [0, 1, 2].map(|axis| (corner >> axis) & 1);
        let mut share = 1.0;
        let mut from_corner = [0.0; 3];
        for axis in 0..3 {
            share *= if bit[axis] == 1 { weight[axis] } else { 1.0 - weight[axis] };
            from_corner[axis] = within[axis] - bit[axis] as f64;
        }
        let lattice = [0, 1, 2].map(|axis| cell[axis] + bit[axis]);
        sum += share * along_gradient(hash(lattice, seed), from_corner);
    }
    sum
}

/// The dot product with one of the twelve edge directions of a cube (four of them twice), chosen by four bits.
fn along_gradient(hash: u64, [x, y, z]: [f64; 3]) -> f64 {
    let choice = hash & 15;
    let u = if choice < 8 { x } else { y };
    let v = match choice {
        0..4 => y,
        12 | 14 => x,
        _ => z,
    };
    (if choice & 1 == 0 { u } else { -u }) + (if choice & 2 == 0 { v } else { -v })
}

/// A counter-based random number for a lattice point.
fn hash(lattice: [i64; 3], seed: u64) -> u64 {
    // Large odd constants keep neighbouring coordinates apart; the finaliser does the mixing.
    const KEYS: [u64; 3] = [0x9e37_79b9_7f4a_7c15, 0xc2b2_ae3d_27d4_eb4f, 0x1656_67b1_9e37_79f9];
    let keyed = lattice.iter().zip(KEYS).fold(seed, |sum, (&p, key)| sum.wrapping_add((p as u64).wrapping_mul(key)));
    // The upper bits are the better mixed ones.
    mix(keyed) >> 32
}
