//! `projection` against closed forms and a double-precision host reference of the interpolants along a ray.

mod agreement;
mod closed_form;
pub(crate) mod grid;
mod integrals;
mod peaks;
mod shown;
