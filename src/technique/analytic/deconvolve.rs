//! The deblurring of a plain backprojection, after it: the lecture's order. It runs beside the device's thread, which has other work.

use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use rayon::prelude::*;
use rustfft::num_complex::Complex;
use rustfft::{FftDirection, FftPlanner};

use crate::error::{Error, Result};

/// The device's thread waits so long for a deblurred grid before it does other work.
const WAIT: Duration = Duration::from_millis(2);

/// The grid of a backprojection, and what is cut off once it is deblurred.
#[derive(Clone, Copy)]
pub(super) struct Planes {
    /// Voxels along x and y.
    pub size: [usize; 2],
    pub spacing_mm: [f64; 2],
    /// Voxels on each side along x and y that are left out in the end.
    pub margin: [usize; 2],
}

/// A deblurred grid of some of the views, and another one that is being made.
#[derive(Default)]
pub(super) struct Deblurred {
    under_way: Option<(usize, Receiver<Vec<f32>>)>,
    /// The views that it has, and its voxels.
    newest: Option<(usize, Vec<f32>)>,
}

impl Deblurred {
    /// The views of the newest grid, and its voxels.
    pub fn newest(&self) -> Option<(usize, &[f32])> {
        self.newest.as_ref().map(|(views, voxels)| (*views, &voxels[..]))
    }

    pub fn is_under_way(&self) -> bool {
        self.under_way.is_some()
    }

    /// Begins to deblur a backprojection of `views` views.
    pub fn begin(&mut self, views: usize, values: Vec<f32>, planes: Planes) {
        let (sender, receiver) = channel();
        // Nobody may be left to hear of it.
        rayon::spawn(move || drop(sender.send(planes.deblurred(values))));
        self.under_way = Some((views, receiver));
    }

    /// Takes the grid that is being made if it is there, and waits a little for it if nothing else is to be done. True if it is there.
    ///
    /// # Errors
    /// [`Error::Internal`] if the work has failed.
    pub fn take(&mut self, is_waiting: bool) -> Result<bool> {
        let Some((views, receiver)) = &self.under_way else { return Ok(false) };
        match receiver.recv_timeout(if is_waiting { WAIT } else { Duration::ZERO }) {
            Ok(voxels) => self.newest = Some((*views, voxels)),
            Err(RecvTimeoutError::Timeout) => return Ok(false),
            Err(RecvTimeoutError::Disconnected) => return Err(Error::internal("the deblurring of a grid has failed")),
        }
        self.under_way = None;
        Ok(true)
    }
}

impl Planes {
    /// A backprojection deblurred, without its margin.
    pub fn deblurred(&self, mut values: Vec<f32>) -> Vec<f32> {
        deconvolve(&mut values, self.size, self.spacing_mm);
        cropped(&values, self.size, self.margin)
    }
}

/// Divides the planes of a backprojection by the Fourier transform of its point response.
///
/// A point becomes 1/r, whose transform in two dimensions is 1/|ν| at ν cycles per mm. So each plane's transform is multiplied by |ν|. The grid has a
/// margin, since the transform takes it for periodic; what is beyond the margin is missing, as slow changes of the result. The object ends before the
/// grid does: the mean of the outermost voxels is taken to be 0.
fn deconvolve(values: &mut [f32], [wide, high]: [usize; 2], spacing_mm: [f64; 2]) {
    values.par_chunks_mut(wide * high).for_each(|plane| {
        let mut waves: Vec<Complex<f64>> = plane.iter().map(|v| Complex::new(f64::from(*v), 0.0)).collect();
        transform(&mut waves, [wide, high], FftDirection::Forward);
        let frequency = |i: usize, n: usize, spacing: f64| i.min(n - i) as f64 / (n as f64 * spacing);
        for (i, wave) in waves.iter_mut().enumerate() {
            let (x, y) = (frequency(i % wide, wide, spacing_mm[0]), frequency(i / wide, high, spacing_mm[1]));
            *wave *= x.hypot(y) / (wide * high) as f64;
        }
        transform(&mut waves, [wide, high], FftDirection::Inverse);
        let is_end = |i: usize, n: usize| i == 0 || i + 1 == n;
        let is_rim = |i: usize| is_end(i % wide, wide) || is_end(i / wide, high);
        let rim: Vec<f64> = waves.iter().enumerate().filter(|(i, _)| is_rim(*i)).map(|(_, wave)| wave.re).collect();
        let zero = rim.iter().sum::<f64>() / rim.len().max(1) as f64;
        plane.iter_mut().zip(&waves).for_each(|(v, wave)| *v = (wave.re - zero) as f32);
    });
}

/// The transform of a plane, in place and without a factor: its rows, then its columns.
fn transform(plane: &mut [Complex<f64>], [wide, high]: [usize; 2], direction: FftDirection) {
    let mut planner = FftPlanner::new();
    planner.plan_fft(wide, direction).process(plane);
    let columns = planner.plan_fft(high, direction);
    let mut column = vec![Complex::default(); high];
    for x in 0..wide {
        (0..high).for_each(|y| column[y] = plane[y * wide + x]);
        columns.process(&mut column);
        (0..high).for_each(|y| plane[y * wide + x] = column[y]);
    }
}

/// A grid of [wide, high, deep] voxels without `margin` of them on each side along x and y.
fn cropped(values: &[f32], [wide, high]: [usize; 2], margin: [usize; 2]) -> Vec<f32> {
    let rows = values.chunks_exact(wide).enumerate().filter(|(row, _)| {
        let y = row % high;
        (margin[1]..high - margin[1]).contains(&y)
    });
    rows.flat_map(|(_, row)| row[margin[0]..wide - margin[0]].iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_is_deblurred_beside_the_callers_thread() -> Result<()> {
        let planes = Planes { size: [12, 8], spacing_mm: [1.0, 2.0], margin: [3, 2] };
        let blurred: Vec<f32> = (0..2 * 12 * 8).map(|i| (i % 7) as f32).collect();
        let mut deblurred = Deblurred::default();
        assert!(!deblurred.take(true)? && deblurred.newest().is_none(), "nothing is under way");
        deblurred.begin(5, blurred.clone(), planes);
        assert!(deblurred.is_under_way());
        while !deblurred.take(true)? {}
        let whole = planes.deblurred(blurred);
        assert_eq!(deblurred.newest(), Some((5, &whole[..])));
        assert_eq!(whole.len(), 2 * 6 * 4, "the margin is cut off");
        assert!(!deblurred.is_under_way());
        Ok(())
    }
}
