//! Makes frames of a job's snapshots, whose pictures the device has developed: error and PNG, on the runtime's blocking threads, newest first.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Weak};

use super::{Engine, Job, Snapshot, State};
use crate::error::Error;

/// Runs as long as the job is kept. Snapshots that a newer one overtook are never developed. The one place that tells the
/// engine that a job has ended.
pub(super) async fn frames(job: Weak<Job>, engine: Engine) {
    let Some((mut snapshots, mut updates)) = job.upgrade().map(|j| (j.snapshots.subscribe(), j.watch())) else {
        return;
    };
    // A snapshot may have come before this task's first turn.
    snapshots.mark_changed();
    let mut developed_last: Weak<Snapshot> = Weak::new();
    loop {
        tokio::select! {
            changed = snapshots.changed() => if changed.is_err() { return },
            changed = updates.changed() => if changed.is_err() { return },
        }
        let Some(job) = job.upgrade() else { return };
        if matches!(updates.borrow_and_update().state, State::Cancelled | State::Failed) {
            engine.ended(&job);
            return;
        }
        let Some(snapshot) = snapshots.borrow_and_update().clone() else { continue };
        if Weak::ptr_eq(&developed_last, &Arc::downgrade(&snapshot)) {
            continue;
        }
        developed_last = Arc::downgrade(&snapshot);
        let developed = tokio::task::spawn_blocking({
            let snapshot = snapshot.clone();
            move || snapshot.film.png(&snapshot.picture)
        })
        .await;
        job.developing.store(false, Ordering::Release);
        job.snapshots.send_if_modified(|newest| {
            // Its picture is not needed any more.
            newest.take_if(|newest| Arc::ptr_eq(newest, &snapshot));
            false
        });
        match developed {
            Ok(Ok((png, error))) => {
                if job.publish(&snapshot, png, error) {
                    engine.ended(&job);
                }
            }
            Ok(Err(error)) => drop(job.fail(&error)),
            Err(panic) => drop(job.fail(&Error::internal(panic))),
        }
    }
}
