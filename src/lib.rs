//! Cloudchamber: a server that renders volumes and shows how accurate each picture is and what it cost.
//!
//! ```text
//! HTTP body ─► request ─► render ─► plan ─► job ─► device ─► film | field ─► frame ─► HTTP stream
//!            (wire JSON) (valid)  (data)  (queue) (OpenCL)  (sums)         (PNG)
//! ```
//!
//! The data goes one way. Who uses whom: `http` and `command` → `study` → `service` → `plan` and `run` → `job` → `render` → `technique` → `scene` → `request` → `device` → `film` →
//! `frame` → `volume` → `power_law` → `error`; never back (`tests/house.rs` sees to it). A job holds its scene and lets it be planned where it
//! runs, since a field's plan changes while it fills.
//!
//! | module | what it is |
//! |---|---|
//! | [`config`] | flags and environment: address, folders, limits |
//! | [`error`] | one error enum; the one place where a status code is chosen |
//! | [`http`] | routes, content negotiation, problem details, streams, OpenAPI; no physics |
//! | [`command`] | the command line: a file a command, and its side of the HTTP contract |
//! | [`request`] | wire types and the schemas they are checked against |
//! | [`render`] | the validated request: scene, subject, budget |
//! | [`scene`] | its parts: camera, transfer function, medium, lights, window, clip |
//! | [`technique`] | the list of techniques; one file each, which makes plans as data |
//! | [`volume`] | grids: readers, built-ins, the store |
//! | [`run`] | the device thread: stages of a run, fair slices, passes, kernels compiled beside it |
//! | [`job`] | the record of a render: queue, states, events, replies, the latest frame; the executor that works on it |
//! | [`service`] | the service in one object: engine, volumes, limits, planner; one way to submit a render |
//! | [`plan`] | the planner: the cheapest setting that is accurate enough, or the best in a time, with reasons |
//! | [`study`] | speed against accuracy: cases with a truth, measured |
//! | [`device`] | the only home of OpenCL and of `unsafe`: context, programs, buffers |
//! | [`chart`] | charts as SVG |
//! | [`film`] | sums on the host: picture and error |
//! | [`frame`] | picture to PNG or EXR, with its metadata |
//! | [`power_law`] | lines on logarithmic axes |
//!
//! Kernels: `kernels/<technique>.cl` and `kernels/shared/`. The viewer: `static/`. Tests: `tests/<technique>.rs` and
//! `tests/{api,stream,faults,viewer,…}.rs`.

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
pub mod study;
pub mod technique;
pub mod volume;
