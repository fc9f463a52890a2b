//! Sinograms as files: NRRD with the geometry in its keys, NumPy's `.npy`, and pictures.

use rayon::prelude::*;

use super::Sinogram;
use crate::error::{Error, Result};

/// A picture of grey bytes, rows from the top.
pub struct Grey {
    /// Pixels across and down.
    pub size: [usize; 2],
    /// One byte a pixel.
    pub bytes: Vec<u8>,
}

impl Sinogram {
    /// NRRD, with sizes u, v, views; `geometry`, `quantity` and `photons_per_ray` are keys. An upload of it is this sinogram again.
    ///
    /// # Errors
    /// [`Error::Internal`] if the geometry cannot be written.
    pub fn nrrd(&self) -> Result<Vec<u8>> {
        let (values, meta) = self.handed_out();
        let ([u, v], views) = (self.geometry().count(), self.geometry().views());
        let mut header = format!(
            "NRRD0005\ntype: float\ndimension: 3\nsizes: {u} {v} {views}\nkinds: domain domain list\nendian: little\nencoding: raw\n\
             geometry:={}\nquantity:={}\n",
            serde_json::to_string(&meta.geometry).map_err(Error::internal)?,
            serde_json::to_string(&meta.quantity).map_err(Error::internal)?,
        );
        if let Some(photons) = meta.photons_per_ray {
            header += &format!("photons_per_ray:={photons}\n");
        }
        Ok([(header + "\n").as_bytes(), bytemuck::cast_slice(values)].concat())
    }

    /// NumPy's format of version 1.0, of the shape (views, v, u).
    pub fn npy(&self) -> Vec<u8> {
        let (values, _) = self.handed_out();
        let ([u, v], views) = (self.geometry().count(), self.geometry().views());
        let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({views}, {v}, {u}), }}");
        // Magic, version, length and header take a multiple of 64 bytes.
        header += &" ".repeat(63 - (10 + header.len()) % 64);
        header.push('\n');
        let length = (header.len() as u16).to_le_bytes();
        [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), bytemuck::cast_slice(values)].concat()
    }

    /// The line integrals of a view: u to the right, v upwards. Without a view, those of the middle row of all views: u to the right, views downwards.
    /// The least is black and the greatest is white.
    ///
    /// # Errors
    /// [`Error::Invalid`] at `query:view` for a view that there is not.
    pub fn preview(&self, view: Option<usize>) -> Result<Grey> {
        let ([u, v], views) = (self.geometry().count(), self.geometry().views());
        let rows: Vec<&[f32]> = match view {
            Some(view) if view >= views => {
                return Err(Error::invalid(
                    "query:view",
                    format!("there is no view {view}"),
                    format!("0 to {}", views - 1),
                ));
            }
            Some(view) => (0..v).rev().map(|row| self.row(view, row)).collect(),
            None => (0..views).map(|view| self.row(view, v / 2)).collect(),
        };
        let all = || rows.par_iter().flat_map_iter(|row| row.iter().copied());
        let low = all().reduce(|| f32::INFINITY, f32::min);
        let high = all().reduce(|| f32::NEG_INFINITY, f32::max);
        let scale = if high > low { 255.0 / (high - low) } else { 0.0 };
        let bytes = all().map(|value| ((value - low) * scale).round() as u8).collect();
        Ok(Grey { size: [u, rows.len()], bytes })
    }
}
