//! The frames of a job, made of its snapshots: error and PNG, on the runtime's blocking threads, newest first.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Weak};
use std::time::Instant;

use super::report::{Frame, State, TracePoint, Update};
use super::{Job, Snapshot};
use crate::error::Error;
use crate::film::ErrorEstimate;

/// The number of points of the convergence trace that are kept. Past it, every second point is dropped.
const TRACE_POINTS: usize = 512;

/// Encodes frames as long as the job is kept. A snapshot that was overtaken by a newer one is never encoded. This is the one place that reports a
/// job's end, to `ended`.
pub(super) async fn frames(job: Weak<Job>, ended: impl Fn(&Arc<Job>)) {
    let Some((mut snapshots, mut updates)) = job.upgrade().map(|j| (j.snapshots.subscribe(), j.watch())) else {
        return;
    };
    // A snapshot may have come before this task's first turn.
    snapshots.mark_changed();
    let mut encoded_last: Weak<Snapshot> = Weak::new();
    loop {
        tokio::select! {
            changed = snapshots.changed() => if changed.is_err() { return },
            changed = updates.changed() => if changed.is_err() { return },
        }
        let Some(job) = job.upgrade() else { return };
        let state = updates.borrow_and_update().state;
        if matches!(state, State::Cancelled | State::Failed) || (state == State::Done && !job.is_render()) {
            ended(&job);
            return;
        }
        let Some(snapshot) = snapshots.borrow_and_update().clone() else { continue };
        if Weak::ptr_eq(&encoded_last, &Arc::downgrade(&snapshot)) {
            continue;
        }
        encoded_last = Arc::downgrade(&snapshot);
        let encoded = tokio::task::spawn_blocking({
            let snapshot = snapshot.clone();
            move || snapshot.film.png(&snapshot.picture)
        })
        .await;
        job.encoding.store(false, Ordering::Release);
        job.snapshots.send_if_modified(|newest| {
            // The picture is not needed any more.
            newest.take_if(|newest| Arc::ptr_eq(newest, &snapshot));
            false
        });
        match encoded {
            Ok(Ok((png, error))) => {
                if job.publish(&snapshot, png, error) {
                    ended(&job);
                }
            }
            Ok(Err(error)) => drop(job.fail(&error)),
            Err(panic) => drop(job.fail(&Error::internal(panic))),
        }
    }
}

impl Job {
    /// Publishes a frame of `snapshot`. The final frame of the newest camera ends the job, and the result is then `true`. A frame of the camera
    /// before is worth showing while the newest has none: cameras may come faster than frames.
    fn publish(&self, snapshot: &Snapshot, png: Vec<u8>, error: ErrorEstimate) -> bool {
        let mut progress = self.lock();
        if progress.state.is_terminal() {
            return false;
        }
        let newest = snapshot.generation == progress.generation;
        let ends = newest && snapshot.stopped_by.is_some();
        progress.sequence += 1;
        progress.samples = snapshot.film.main.count;
        progress.error = Some(error);
        snapshot.counts.report(&snapshot.film, &mut progress.counts);
        progress.stopped_by = snapshot.stopped_by.filter(|_| ends);
        progress.timings.elapsed_ms = snapshot.elapsed_ms;
        progress.timings.device_ms = snapshot.device_ms;
        let since = |t: Instant| t.elapsed().as_secs_f64() * 1e3;
        let now = since(progress.asked);
        progress.timings.first_frame_ms.get_or_insert(now);
        let before = progress.published.replace(Instant::now());
        if snapshot.is_first {
            let waited = snapshot.elapsed_ms + since(snapshot.made);
            progress.frame_ms = Some(before.map_or(waited, |before| waited.min(since(before))));
        }
        if let Some(result) = &snapshot.result {
            progress.result = Some(result.clone());
        }
        if progress.trace.len() >= TRACE_POINTS {
            let mut index = 0;
            progress.trace.retain(|_| {
                index += 1;
                index % 2 == 1
            });
        }
        if newest {
            progress.trace.push(TracePoint {
                elapsed_ms: snapshot.elapsed_ms,
                samples: snapshot.film.main.count,
                error: error.total,
                stride: snapshot.film.main.stride as u32,
            });
        }
        if ends {
            progress.state = State::Done;
        }
        let frame = Arc::new(Frame {
            sequence: progress.sequence,
            etag: crate::frame::etag(&png),
            png: png.into(),
            samples: snapshot.film.main.count,
            error,
            lowered: snapshot.film.lowered,
            elapsed_ms: snapshot.elapsed_ms,
            device_ms: snapshot.device_ms,
            is_final: ends,
        });
        self.updates.send_replace(Update {
            state: progress.state,
            frame: Some(frame),
            work: None,
            is_handed_over: false,
        });
        ends
    }
}
