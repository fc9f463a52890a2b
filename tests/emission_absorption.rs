//! `emission_absorption` against closed forms, a double-precision host reference, and its own error estimate.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test says what is wrong by panicking")]

mod common;

#[path = "emission_absorption/accuracy.rs"]
mod accuracy;
#[path = "emission_absorption/agreement.rs"]
mod agreement;
#[path = "emission_absorption/cameras.rs"]
mod cameras;
#[path = "emission_absorption/closed_form.rs"]
mod closed_form;
#[path = "emission_absorption/oracle.rs"]
mod oracle;
#[path = "emission_absorption/reference.rs"]
mod reference;
#[path = "emission_absorption/scenes.rs"]
mod scenes;
#[path = "emission_absorption/styles.rs"]
mod styles;
#[path = "emission_absorption/words.rs"]
mod words;
