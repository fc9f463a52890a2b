//! The views of a reconstruction: exact integrals of a phantom, or measured ones.

use std::sync::Arc;

use crate::tomography::{Geometry, Phantom, Sinogram};

/// Where views come from.
#[derive(Debug, Clone)]
pub enum Data {
    /// A phantom, of which each ray is integrated.
    Exact(Phantom),
    /// An upload.
    Measured(Arc<Sinogram>),
}

impl Data {
    /// The line integrals of a row of bins.
    pub fn row(&self, geometry: &Geometry, view: usize, v: usize) -> Vec<f64> {
        match self {
            Self::Exact(phantom) => {
                (0..geometry.count()[0]).map(|u| phantom.integral(&geometry.ray(view, [u, v]))).collect()
            }
            Self::Measured(sinogram) => sinogram.row(view, v).iter().map(|p| f64::from(*p)).collect(),
        }
    }

    /// The work of a ray, in shapes.
    pub fn work(&self) -> usize {
        match self {
            Self::Exact(phantom) => phantom.shapes(),
            Self::Measured(_) => 1,
        }
    }

    /// What was lost or assumed when they were read.
    pub fn notes(&self) -> &[String] {
        match self {
            Self::Exact(_) => &[],
            Self::Measured(sinogram) => sinogram.notes(),
        }
    }
}
