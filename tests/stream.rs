//! Streams, the queue and the end of the service: slow readers, many readers, fairness, cancellation, SIGTERM.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod common;

#[path = "stream/readers.rs"]
mod readers;
#[path = "stream/shutdown.rs"]
mod shutdown;
#[path = "api/support.rs"]
mod support;
#[path = "stream/turns.rs"]
mod turns;
