//! `emission_absorption` against closed forms, a double-precision host reference, and its own error estimate.

mod accuracy;
mod agreement;
mod cameras;
mod closed_form;
mod functions;
pub(crate) mod oracle;
mod programs;
mod reference;
mod scenes;
mod styles;
mod words;
