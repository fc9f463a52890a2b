//! Levels of processors: every kernel compiles for each of them, whatever the host, and a picture that is made at the levels below the
//! host's is the host's own. `./dev test --full` compiles every variant and makes a picture of every technique.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test says what is wrong by panicking")]

#[path = "levels/builds.rs"]
mod builds;
mod common;
#[path = "levels/compiler.rs"]
mod compiler;
#[path = "levels/lower.rs"]
mod lower;
#[path = "levels/runs.rs"]
mod runs;

/// Whether all of it is run.
pub fn is_full() -> bool {
    std::env::var_os("CLOUDCHAMBER_FULL").is_some()
}
