//! The service as its users meet it: the real binary, HTTP, the command line and a browser; and the rules of the source tree.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test says what is wrong by panicking")]

#[path = "../common/mod.rs"]
mod common;
mod support;

mod api;
mod degrade;
mod example;
mod faults;
mod house;
mod stream;
mod viewer;
