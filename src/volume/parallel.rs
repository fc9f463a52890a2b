//! Work over ranges on the machine's cores. Results do not depend on the number of cores.

use std::num::NonZero;
use std::ops::Range;
use std::thread;

/// Below this many voxels a thread costs more than it saves (a start takes about 20 µs).
const WORTH_A_THREAD: usize = 1 << 18;

/// The most threads. Volumes are read beside a running device, and more threads would only take its cores.
const MAX_THREADS: usize = 8;

fn threads_for(voxels: usize) -> usize {
    let cores = thread::available_parallelism().map_or(1, NonZero::get);
    cores.min(MAX_THREADS).min(1 + voxels / WORTH_A_THREAD)
}

/// Calls `work` on consecutive ranges that cover `0..count`, and returns the results in their order.
pub(super) fn over_ranges<R: Send>(count: usize, voxels: usize, work: impl Fn(Range<usize>) -> R + Sync) -> Vec<R> {
    let step = count.div_ceil(threads_for(voxels)).max(1);
    if step >= count {
        return vec![work(0..count)];
    }
    let work = &work;
    thread::scope(|scope| {
        let starts = (0..count).step_by(step);
        let running: Vec<_> = starts.map(|start| scope.spawn(move || work(start..(start + step).min(count)))).collect();
        let joined = running.into_iter().map(|thread| thread.join());
        joined.map(|result| result.unwrap_or_else(|cause| std::panic::resume_unwind(cause))).collect()
    })
}

/// Fills `slices` of equal length, each by `fill(index of the slice, slice)`.
pub(super) fn over_slices<T: Send>(values: &mut [T], slice_len: usize, fill: impl Fn(usize, &mut [T]) + Sync) {
    let slices = values.len() / slice_len.max(1);
    let step = slices.div_ceil(threads_for(values.len())).max(1);
    let fill = &fill;
    thread::scope(|scope| {
        for (part, values) in values.chunks_mut(step * slice_len.max(1)).enumerate() {
            scope.spawn(move || {
                for (slice, values) in values.chunks_mut(slice_len.max(1)).enumerate() {
                    fill(part * step + slice, values);
                }
            });
        }
    });
}
