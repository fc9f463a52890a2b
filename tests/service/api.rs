//! The service as its users meet it: every call of the contract against the real binary.

mod budgets;
mod cameras;
mod commands;
mod exports;
mod info;
mod openapi;
mod plans;
mod renders;
mod scattering;
mod sinograms;
mod studies;
mod uploads;
