//! The clearance of a voxel: the distance within which all voxels have its label, so that a photon crosses them in one step.

use rayon::prelude::*;

/// For each voxel the greatest r, at most 255, such that all voxels of the grid at most r away along each axis have its label: the Chebyshev distance
/// to the nearest voxel that touches another label, by its face, edge or corner. There are two sweeps; each takes the distances of the neighbours
/// that it has passed (Rosenfeld & Pfaltz, "Sequential Operations in Digital Picture Processing", J. ACM 13(4), 1966). x runs fastest in `labels` and
/// in the result.
pub fn clearances(labels: &[u16], dims: [usize; 3]) -> Vec<u8> {
    let mut clearance = vec![u8::MAX; labels.len()];
    clearance.par_chunks_mut(dims[0]).enumerate().for_each(|(row, out)| mark_borders(labels, dims, row, out));
    let rows = dims[1] * dims[2];
    let mut nearest = vec![0; dims[0] + 2];
    (0..rows).for_each(|row| sweep(&mut clearance, dims, row, 1, &mut nearest));
    (0..rows).rev().for_each(|row| sweep(&mut clearance, dims, row, -1, &mut nearest));
    clearance
}

/// The row of voxels that is dy and dz from a row, if the grid has one.
fn row_beside([_, ny, nz]: [usize; 3], row: usize, [dy, dz]: [isize; 2]) -> Option<usize> {
    let y = (row % ny).checked_add_signed(dy).filter(|y| *y < ny)?;
    let z = (row / ny).checked_add_signed(dz).filter(|z| *z < nz)?;
    Some(z * ny + y)
}

/// Sets voxels that touch another label to 0. A voxel touches another label across an edge or a corner if its neighbour in the row differs in label
/// from it or from the voxel beside that neighbour.
fn mark_borders(labels: &[u16], dims: [usize; 3], row: usize, out: &mut [u8]) {
    let nx = dims[0];
    let own = &labels[row * nx..][..nx];
    let mut differs = vec![false; nx];
    for beside in (0..9).filter_map(|i| row_beside(dims, row, [i % 3 - 1, i / 3 - 1])) {
        let other = &labels[beside * nx..][..nx];
        differs.iter_mut().zip(own.iter().zip(other)).for_each(|(d, (a, b))| *d |= a != b);
    }
    for x in 0..nx {
        let around = x.saturating_sub(1)..(x + 2).min(nx);
        if around.into_iter().any(|i| differs[i] || own[i] != own[x]) {
            out[x] = 0;
        }
    }
}

/// Lowers a row's distances to those of its neighbours in the rows before it (after it for `sense` -1), and in the row itself, plus one. `nearest` is
/// scratch memory: one more than the row at each end.
fn sweep(clearance: &mut [u8], dims: [usize; 3], row: usize, sense: isize, nearest: &mut [u8]) {
    let nx = dims[0];
    nearest.fill(u8::MAX);
    for beside in
        [[-1, 0], [-1, -1], [0, -1], [1, -1]].into_iter().filter_map(|d| row_beside(dims, row, d.map(|n| n * sense)))
    {
        let other = &clearance[beside * nx..][..nx];
        nearest[1..=nx].iter_mut().zip(other).for_each(|(n, r)| *n = (*n).min(*r));
    }
    let line = &mut clearance[row * nx..][..nx];
    for (r, near) in line.iter_mut().zip(nearest.windows(3)) {
        *r = (*r).min(near[0].min(near[1]).min(near[2]).saturating_add(1));
    }
    for x in 1..nx {
        line[x] = line[x].min(line[x - 1].saturating_add(1));
    }
    for x in (1..nx).rev() {
        line[x - 1] = line[x - 1].min(line[x].saturating_add(1));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The clearance by trying one size after the other.
    fn by_looking(labels: &[u16], [nx, ny, nz]: [usize; 3], voxel: usize) -> u8 {
        let at = [voxel % nx, voxel / nx % ny, voxel / nx / ny];
        let same = |r: usize| {
            let range = |a: usize, n: usize| at[a].saturating_sub(r)..(at[a] + r + 1).min(n);
            range(2, nz)
                .all(|z| range(1, ny).all(|y| range(0, nx).all(|x| labels[(z * ny + y) * nx + x] == labels[voxel])))
        };
        (1..=255).find(|r| !same(*r)).map_or(255, |r| r as u8 - 1)
    }

    #[test]
    fn clearances_are_what_looking_around_finds() {
        let dims = [13, 9, 11];
        let count = dims.iter().product::<usize>();
        let ball = |i: usize| {
            let [x, y, z] = [i % 13, i / 13 % 9, i / 117].map(|c| c as i32);
            u16::from((x - 8).pow(2) + (y - 3).pow(2) + (z - 5).pow(2) < 14)
        };
        let corner = |i: usize| u16::from(i == count - 1);
        let noise = |i: usize| u16::from(i * 2_654_435_761 % 97 < 3);
        let stripes = |i: usize| (i / 13 % 9 / 4) as u16;
        for labels in [
            (0..count).map(ball).collect::<Vec<_>>(),
            (0..count).map(corner).collect(),
            (0..count).map(noise).collect(),
            (0..count).map(stripes).collect(),
        ] {
            let wanted: Vec<u8> = (0..count).map(|i| by_looking(&labels, dims, i)).collect();
            assert_eq!(clearances(&labels, dims), wanted);
            assert!(wanted.iter().any(|r| *r > 0), "all of them border on another");
        }
    }

    #[test]
    fn the_clearance_of_one_label_is_as_far_as_a_byte_can_say() {
        assert_eq!(clearances(&[4; 300], [300, 1, 1]), [255; 300]);
        let mut labels = [4; 600];
        labels[599] = 5;
        let clearance = clearances(&labels, [600, 1, 1]);
        assert_eq!(
            (clearance[599], clearance[598], clearance[590], clearance[344], clearance[343], clearance[0]),
            (0, 0, 8, 254, 255, 255)
        );
    }
}
