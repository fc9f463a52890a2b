//! `photon_transport` against closed forms and an independent simulation in double precision.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test says what is wrong by panicking")]

mod common;

#[path = "photon_transport/boundaries.rs"]
mod boundaries;
#[path = "photon_transport/extremes.rs"]
mod extremes;
#[path = "photon_transport/gammas.rs"]
mod gammas;
#[path = "photon_transport/oracle.rs"]
mod oracle;
#[path = "photon_transport/phases.rs"]
mod phases;
#[path = "photon_transport/published.rs"]
mod published;
#[path = "photon_transport/random.rs"]
mod random;
#[path = "photon_transport/run.rs"]
mod run;
#[path = "photon_transport/threads.rs"]
mod threads;
#[path = "photon_transport/trackers.rs"]
mod trackers;
#[path = "photon_transport/truth.rs"]
mod truth;
