//! Macro-cells of the device against brute force.

use cloudchamber::device::Device;
use cloudchamber::device::cells::{CELL, Cells};
use cloudchamber::volume::VoxelType;

use super::open;

/// Whole numbers from a linear congruential generator (Knuth's MMIX).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as u32
    }
}

fn build(device: &mut Device, dims: [usize; 3], voxel: VoxelType, bytes: &[u8]) -> Cells {
    let voxels = device.upload(bytes, 8).unwrap();
    Cells::new(device, &voxels, dims, voxel).unwrap()
}

fn ranges<T: bytemuck::Pod>(device: &Device, cells: &Cells) -> Vec<[T; 2]> {
    let mut out = vec![[T::zeroed(); 2]; cells.dims().iter().product()];
    device.read(&cells.ranges, 0, &mut out).unwrap();
    out
}

/// The voxels that a sample in cell `c` can read, along an axis of `n`.
fn readable(c: usize, n: usize) -> std::ops::Range<usize> {
    (c * CELL).saturating_sub(1)..(c * CELL + CELL + 1).min(n)
}

fn check<T: bytemuck::Pod + PartialOrd + std::fmt::Debug>(
    device: &mut Device,
    dims: [usize; 3],
    voxel: VoxelType,
    voxels: &[T],
    none: [T; 2],
) {
    let cells = build(device, dims, voxel, bytemuck::cast_slice(voxels));
    let found = ranges::<T>(device, &cells);
    let [wide, high, deep] = cells.dims();
    assert_eq!([wide, high, deep], dims.map(|n| n.div_ceil(CELL)));
    for (i, found) in found.into_iter().enumerate() {
        let mut expected = none;
        for z in readable(i / (wide * high), dims[2]) {
            for y in readable(i / wide % high, dims[1]) {
                for x in readable(i % wide, dims[0]) {
                    let v = voxels[x + dims[0] * (y + dims[1] * z)];
                    expected =
                        [if v < expected[0] { v } else { expected[0] }, if v > expected[1] { v } else { expected[1] }];
                }
            }
        }
        assert_eq!(found, expected, "{voxel:?} {dims:?} cell {i}");
    }
}

#[test]
fn cells_span_what_a_sample_can_read() {
    let mut device = open(None, None);
    let mut random = Random(1);
    for dims in [[19, 9, 17], [1, 1, 1], [8, 8, 8], [7, 16, 25], [1, 40, 3]] {
        let count: usize = dims.iter().product();
        let mut numbers = || (0..count).map(|_| random.next()).collect::<Vec<u32>>();
        let bytes: Vec<u8> = numbers().into_iter().map(|n| n as u8).collect();
        check(&mut device, dims, VoxelType::U8, &bytes, [u8::MAX, u8::MIN]);
        let shorts: Vec<i16> = numbers().into_iter().map(|n| n as i16).collect();
        check(&mut device, dims, VoxelType::I16, &shorts, [i16::MAX, i16::MIN]);
        let words: Vec<u16> = numbers().into_iter().map(|n| n as u16).collect();
        check(&mut device, dims, VoxelType::U16, &words, [u16::MAX, u16::MIN]);
        let holes: Vec<f32> =
            numbers().into_iter().map(|n| if n % 3 == 0 { f32::NAN } else { n as f32 - 1e9 }).collect();
        check(&mut device, dims, VoxelType::F32, &holes, [f32::INFINITY, f32::NEG_INFINITY]);
    }
}

#[test]
fn distances_are_chebyshevs() {
    let mut device = open(None, None);
    let dims = [11usize, 7, 9];
    let place = |i: usize| [i % 11, i / 11 % 7, i / 77].map(|u| u as i64);
    for (seed, one_in) in [(1, 3), (2, 40), (3, 400), (4, u32::MAX)] {
        let mut random = Random(seed);
        // A voxel in the middle of a cell, which no other cell reads.
        let mut voxels = vec![0u8; 693 * CELL.pow(3)];
        let mut occupied = Vec::new();
        for i in 0..693 {
            if random.next().is_multiple_of(one_in) {
                let [x, y, z] = place(i).map(|u| u as usize * CELL + 1);
                voxels[x + CELL * 11 * (y + CELL * 7 * z)] = 9;
                occupied.push(place(i));
            }
        }
        let cells = build(&mut device, dims.map(|n| n * CELL), VoxelType::U8, &voxels);
        let distances = cells.distances(&mut device, &[[-3.0, -1.0], [8.5, 9.0]], 0.0).unwrap();
        let mut found = vec![0u8; 693];
        device.read(&distances, 0, &mut found).unwrap();
        let distance = |i: usize| {
            let apart = |other: &[i64; 3]| (0..3).map(|axis| (place(i)[axis] - other[axis]).abs()).max().unwrap();
            occupied.iter().map(apart).min().map_or(255, |apart| apart as u8)
        };
        assert_eq!(found, (0..693).map(distance).collect::<Vec<u8>>(), "one in {one_in}");
    }
}

#[test]
fn distances_end_at_255_and_nothing_is_never_occupied() {
    let mut device = open(None, None);
    let mut voxels = vec![0u8; 300 * CELL];
    voxels[0] = 1;
    let cells = build(&mut device, [300 * CELL, 1, 1], VoxelType::U8, &voxels);
    let mut found = vec![0u8; 300];
    let distances = cells.distances(&mut device, &[[1.0, f32::INFINITY]], 0.0).unwrap();
    device.read(&distances, 0, &mut found).unwrap();
    assert_eq!((found[0], found[1], found[254], found[255], found[299]), (0, 1, 254, 255, 255));

    let nothing = vec![f32::NAN; 2 * CELL.pow(3)];
    let cells = build(&mut device, [2 * CELL, CELL, CELL], VoxelType::F32, bytemuck::cast_slice(&nothing));
    let distances = cells.distances(&mut device, &[[f32::NEG_INFINITY, f32::INFINITY]], 0.0).unwrap();
    let mut found = [0u8; 2];
    device.read(&distances, 0, &mut found).unwrap();
    assert_eq!(found, [255, 255]);
}

#[test]
fn cells_take_little_of_the_memory() {
    let mut device = open(None, None);
    for (voxel, side) in [(VoxelType::U8, 64), (VoxelType::I16, 64), (VoxelType::F32, 64)] {
        let bytes = vec![0u8; voxel.bytes() * side * side * side];
        let cells = build(&mut device, [side; 3], voxel, &bytes);
        let distances = cells.distances(&mut device, &[], 0.0).unwrap();
        assert!(10 * (cells.ranges.len() + distances.len()) <= bytes.len(), "{voxel:?}");
    }
}
