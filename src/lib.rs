//! Cloudchamber: a server that renders volumes and shows how accurate each picture is and what it cost.
//!
//! ```text
//! HTTP body ─► request ─► scene ─► plan ─► job ─► device ─► film | field ─► frame ─► HTTP stream
//!            (wire JSON) (valid)  (data)  (queue) (OpenCL)  (sums)         (PNG)
//! ```
//!
//! The data goes one way. Who uses whom: `http` and the command line → `study` → `plan` → `job` → `scene` and `technique` → `device` → `film` →
//! `frame` → `volume` → `power_law` → `error`; never back (`tests/house.rs` sees to it). A job holds its scene and lets it be planned where it
//! runs, since a field's plan changes while it fills.
//!
//! | module | what it is |
//! |---|---|
//! | [`config`] | flags and environment: address, folders, limits |
//! | [`error`] | one error enum; the one place where a status code is chosen |
//! | [`http`] | routes, content negotiation, problem details, streams, OpenAPI; no physics |
//! | [`client`] | the command line's side of the HTTP contract |
//! | [`request`] | wire types and the schemas they are checked against |
//! | [`scene`] | the validated scene: camera, transfer function, medium, lights, budget |
//! | [`technique`] | the list of techniques; one file each, which makes plans as data |
//! | [`volume`] | grids: readers, built-ins, the store |
//! | [`job`] | queue, fair slices on the device thread, kernels compiled beside it, cancellation, the latest frame |
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
pub mod client;
pub mod config;
pub mod device;
pub mod error;
pub mod film;
pub mod frame;
pub mod http;
pub mod job;
pub mod plan;
pub mod power_law;
pub mod request;
pub mod scene;
pub mod study;
pub mod technique;
pub mod volume;
