//! Levels of processors. Every kernel compiles for each of them, whatever the host is, and a picture that is made at the levels below the host's is
//! the host's own. `./dev test --full` compiles every variant and makes a picture of every technique.

mod builds;
mod compiler;
mod lower;
mod runs;

/// True if the full tests are run.
pub fn is_full() -> bool {
    std::env::var_os("CLOUDCHAMBER_FULL").is_some()
}
