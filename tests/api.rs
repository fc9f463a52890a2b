//! The service as its users meet it: every call of the contract against the real binary.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod common;

#[path = "api/budgets.rs"]
mod budgets;
#[path = "api/cameras.rs"]
mod cameras;
#[path = "api/commands.rs"]
mod commands;
#[path = "api/info.rs"]
mod info;
#[path = "api/openapi.rs"]
mod openapi;
#[path = "api/plans.rs"]
mod plans;
#[path = "api/renders.rs"]
mod renders;
#[path = "api/scattering.rs"]
mod scattering;
#[path = "api/studies.rs"]
mod studies;
#[path = "api/support.rs"]
mod support;
#[path = "api/uploads.rs"]
mod uploads;
