//! `volume_path` against closed forms, published tables, itself by other means, and `single_scatter`.

mod agreement;
mod extremes;
mod gather;
mod stopping;
mod truth;
