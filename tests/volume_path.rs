//! `volume_path` against closed forms, published tables, itself by other means, and `single_scatter`.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test says what is wrong by panicking")]

mod common;

#[path = "volume_path/agreement.rs"]
mod agreement;
#[path = "volume_path/extremes.rs"]
mod extremes;
#[path = "volume_path/gather.rs"]
mod gather;
#[path = "volume_path/stopping.rs"]
mod stopping;
#[path = "volume_path/truth.rs"]
mod truth;
