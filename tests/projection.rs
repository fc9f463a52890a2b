//! `projection` against closed forms and a double-precision host reference of the interpolants along a ray.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test says what is wrong by panicking")]

mod common;

#[path = "projection/agreement.rs"]
mod agreement;
#[path = "projection/closed_form.rs"]
mod closed_form;
#[path = "projection/grid.rs"]
mod grid;
#[path = "projection/integrals.rs"]
mod integrals;
#[path = "projection/peaks.rs"]
mod peaks;
#[allow(dead_code, reason = "of another technique's reference, the camera and the box")]
#[path = "emission_absorption/oracle.rs"]
mod rays;
#[path = "projection/shown.rs"]
mod shown;
