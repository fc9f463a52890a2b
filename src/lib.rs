//! Cloudchamber: a server that renders volumes and shows the accuracy and the cost of each picture.
//!
//! ```text
//! HTTP body ─► request ─► render ─► job ─► run ─► device ─► film | field ─► frame ─► HTTP stream
//!            (wire JSON) (valid) (record) (slices) (OpenCL)  (sums)        (PNG)
//! ```
//!
//! The data goes one way, and modules use each other the other way: `command` → `http` → `study` → `service` → `plan` and `run` → `job` → `render`
//! → `technique` → `scene` → `request` → `config` → `device` → `film` → `frame` → `asset` → `tomography` → `volume` → `error`, never back and never in a circle
//! (`tests/service/house.rs`). `docs/architecture.md` walks one request and one field through the files.
//!
//! | module | contents |
//! |---|---|
//! | [`command`] | the command line: a file a command, and its side of the HTTP contract |
//! | [`http`] | routes, content negotiation, problem details, streams, OpenAPI; no physics |
//! | [`study`] | measurements of speed against accuracy, by cases with a truth |
//! | [`service`] | the service in one object: engine, volumes, limits, planner; one way to submit a render |
//! | [`plan`] | the planner: the cheapest setting that is accurate enough, or the best in a time, with reasons |
//! | [`run`] | the device thread: stages of a run, fair slices, passes, kernels compiled beside it |
//! | [`chart`] | charts as SVG |
//! | [`job`] | the record of a render: queue, states, events, replies, the latest frame; the executor that works on it |
//! | [`render`] | the validated request: scene, subject, budget |
//! | [`technique`] | the list of techniques; a file (and folder) each, which describes itself: parameters, kernel, settings, work |
//! | [`scene`] | the parts of a scene: camera, transfer function, medium, lights, window, clip |
//! | [`request`] | wire types and the schemas they are checked against |
//! | [`config`] | flags and environment: address, folders, limits |
//! | [`device`] | the only home of OpenCL and of `unsafe`: context, programs, buffers, bounded launches |
//! | [`film`] | sums on the host: picture and error |
//! | [`frame`] | picture to PNG or EXR, with its metadata |
//! | [`asset`] | stored things, by the hash of their content: volumes, sinograms |
//! | [`tomography`] | geometry of measurements, sinograms and their readers, phantoms with exact line integrals, filters, a check of data |
//! | [`volume`] | grids: readers, built-ins |
//! | [`power_law`] | lines on logarithmic axes |
//! | [`split_mix`] | random numbers of the host |
//! | [`error`] | one error enum; the one place that chooses a status code |
//!
//! Kernels: `kernels/<technique>.cl` and `kernels/shared/`. The viewer: `static/`. Tests: `tests/physics/<technique>.rs` in this process,
//! `tests/service/{api,stream,faults,viewer,…}.rs` against the real binary. `docs/add-a-technique.md` explains how to add a technique.

pub mod asset;
pub mod chart;
pub mod command;
pub mod config;
pub mod device;
pub mod error;
pub mod film;
pub mod frame;
pub mod http;
pub mod job;
pub mod plan;
pub mod power_law;
pub mod render;
pub mod request;
pub mod run;
pub mod scene;
pub mod service;
pub mod split_mix;
pub mod study;
pub mod technique;
pub mod tomography;
pub mod volume;
