//! `slice` against linear fields, slabs in closed form, and what is refused.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test says what is wrong by panicking")]

mod common;

#[path = "slice/asked.rs"]
mod asked;
#[path = "slice/planes.rs"]
mod planes;
#[path = "slice/slabs.rs"]
mod slabs;
