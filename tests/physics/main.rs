//! Techniques, the device and the study in this process: truth first, then distributions, then small pictures.
//!
//! They are one program, so that its tests share one engine ([`common::engine::House::shared`]) and its compiled kernels.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test says what is wrong by panicking")]

#[path = "../common/mod.rs"]
mod common;

mod backprojection;
mod device;
mod emission_absorption;
mod fbp;
mod histogram;
mod isosurface;
mod levels;
mod photon_transport;
mod pictures;
mod project;
mod projection;
mod scales;
mod single_scatter;
mod slice;
mod study;
mod tomography;
mod variants;
mod views;
mod volume_path;
mod volumes;
