//! The plan of `photon_transport`: its kernels, parameters and tables.

use std::f64::consts::PI;

use super::attenuation::{LEAST_KEV, ROWS};
use super::device::{BoundaryKind, LedgerEntry, Media, Tally};
use super::geometry::{Geometry, Where};
use super::parameters::Parameters;
use super::tracking::{Tracking, majorants};
use super::{PhotonTransport, Simulation, TECHNIQUE, gammas, medium};
use crate::device::enums::DeviceEnum;
use crate::device::program::{Variant, listed};
use crate::error::Result;

/// The speed of light in a vacuum, mm per ns.
const LIGHT_MM_PER_NS: f64 = 299.792_458;
/// A length that stands for infinity.
const ENDLESS_MM: f32 = 1e30;

type Features = [(&'static str, i32); 3];

/// Every kind of media with every tracker; the first is the chamber's, the second the homogeneous box.
pub(super) static FEATURES: [Features; 20] = {
    use Media::{Density, Labels, Layers, Uniform};
    use Tracking::{Delta, Exact, March, Weighted};
    const fn of(media: Media, tracking: Tracking) -> Features {
        [("MEDIA", media.code()), ("TRACKING", tracking.code()), ("GAMMA", 0)]
    }
    const fn gamma(media: Media) -> Features {
        [("MEDIA", media.code()), ("TRACKING", Exact.code()), ("GAMMA", 1)]
    }
    [
        of(Density, Exact),
        of(Uniform, Exact),
        of(Layers, Exact),
        of(Labels, Exact),
        of(Uniform, March),
        of(Layers, March),
        of(Labels, March),
        of(Density, March),
        of(Uniform, Delta),
        of(Layers, Delta),
        of(Labels, Delta),
        of(Density, Delta),
        of(Uniform, Weighted),
        of(Layers, Weighted),
        of(Labels, Weighted),
        of(Density, Weighted),
        gamma(Uniform),
        gamma(Layers),
        gamma(Labels),
        gamma(Density),
    ]
};

/// The variant, parameters and tables of the kernel: data, made without a device.
pub(super) struct DevicePlan {
    /// The kernel variant.
    pub variant: Variant,
    /// The kernel's own parameters, as the bytes of its device struct; a launch has a `FieldPass` beside it.
    pub parameters: Vec<u8>,
    /// Read-only data, such as the extinction of every voxel.
    pub table: Vec<f32>,
    /// Cells of the grid of 64-bit sums.
    pub cells: usize,
    /// 64-bit sums beside the grid: the energy ledger.
    pub ledger: usize,
}

fn permitted(wanted: Features) -> Result<&'static Features> {
    listed(TECHNIQUE.name, &FEATURES, wanted)
}

fn features(geometry: &Geometry, tracking: Tracking) -> Result<&'static Features> {
    let media = match geometry.place {
        Where::Box => Media::Uniform,
        Where::Layers(_) => Media::Layers,
        Where::Labels { .. } => Media::Labels,
        Where::Density(_) => Media::Density,
    };
    permitted([("MEDIA", media.code()), ("TRACKING", tracking.code()), ("GAMMA", geometry.is_gamma().into())])
}

/// Appends to the table and returns the index of the appended part.
fn append(table: &mut Vec<f32>, more: impl IntoIterator<Item = f32>) -> i32 {
    let at = table.len() as i32;
    table.extend(more);
    at
}

impl Simulation {
    pub(super) fn spacing_mm(&self) -> [f64; 3] {
        std::array::from_fn(|a| self.geometry.size_mm[a] / self.geometry.dims[a] as f64)
    }

    /// The scale of deposits, which keeps them within the range of the fixed point; the result is divided by it.
    pub(super) fn deposit_scale(&self) -> f64 {
        if self.is_absorbed() && !self.track { 1.0 } else { 1.0 / self.spacing_mm()[0] }
    }

    /// The unit of mean paths.
    pub(super) fn path_unit_mm(&self) -> f64 {
        self.geometry.size_mm.iter().map(|s| s * s).sum::<f64>().sqrt() / 1_048_576.0
    }

    pub(super) fn is_absorbed(&self) -> bool {
        self.parameters.tally == "absorbed"
    }

    fn tally(&self) -> Tally {
        match (self.parameters.tally.as_str(), self.track) {
            ("absorbed", false) => Tally::Absorbed,
            ("fluence", false) => Tally::Fluence,
            ("fluence", true) => Tally::FluenceTrack,
            ("radiance_gather", _) => Tally::Gather,
            _ => Tally::AbsorbedTrack,
        }
    }

    /// The cells of the DDA: voxels, layers, blocks, or the box alone.
    fn cells(&self, device: &mut PhotonTransport, table: &mut Vec<f32>) {
        let g = &self.geometry;
        device.cells = [1; 3];
        match (&g.place, self.tracking) {
            (Where::Labels { .. } | Where::Density(_), Tracking::Exact) => {
                device.cells = g.dims.map(|n| n as i32);
                device.cell_mm = self.spacing_mm().map(|s| s as f32);
            }
            (Where::Layers(ends), Tracking::Exact) => device.cells[2] = ends.len() as i32,
            (_, Tracking::Delta | Tracking::Weighted) => {
                let m = majorants(&self.parameters, g);
                device.cells = m.blocks.map(|n| n as i32);
                let spacing = self.spacing_mm();
                device.cell_mm = std::array::from_fn(|a| (m.voxels[a] as f64 * spacing[a]) as f32);
                device.at_blocks = append(table, m.per_mm);
            }
            _ => {}
        }
        device.cells_per_mm = std::array::from_fn(|a| if device.cells[a] > 1 { 1.0 / device.cell_mm[a] } else { 0.0 });
    }

    /// The clearance of each voxel, if photons may cross several at once. Otherwise tracks are scored voxel by voxel.
    pub(super) fn clearance(&self) -> Option<&[u8]> {
        if self.tracking == Tracking::Exact && !self.track { self.geometry.clearance() } else { None }
    }

    fn bounds(&self, device: &mut PhotonTransport) {
        let p = &self.parameters;
        device.high_mm = self.geometry.size_mm.map(|s| s as f32);
        device.size_mm = device.high_mm;
        let layered = matches!(self.geometry.place, Where::Layers(_));
        for (a, kind) in [&p.boundary.x, &p.boundary.y, &p.boundary.z].into_iter().enumerate() {
            let boundary = match kind.as_deref() {
                Some("cyclic") => BoundaryKind::Cyclic,
                Some("mirror") => BoundaryKind::Mirror,
                _ => BoundaryKind::Absorbing,
            };
            device.boundary[a] = boundary.code();
            // Layers are infinite along x and y unless the request gives a boundary there.
            if layered && a < 2 && kind.is_none() {
                (device.low_mm[a], device.high_mm[a], device.endless) = (-ENDLESS_MM, ENDLESS_MM, 1);
            }
        }
        if let Where::Layers(ends) = &self.geometry.place
            && ends.last().is_some_and(|e| e.is_infinite())
        {
            (device.high_mm[2], device.endless) = (ENDLESS_MM, 1);
        }
    }

    /// Makes the kernel's variant, parameters and tables.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] for a combination of features that is not listed.
    pub(super) fn device_plan(&self) -> Result<DevicePlan> {
        let (p, g) = (&self.parameters, &self.geometry);
        let mut table = medium::table(&g.media);
        let spacing = self.spacing_mm();
        let mut device = PhotonTransport {
            grid: g.dims.map(|n| n as i32),
            voxel_mm: spacing.map(|s| s as f32),
            voxels_per_mm: spacing.map(|s| (1.0 / s) as f32),
            outside_index: p.boundary.outside_index as f32,
            fresnel: p.boundary.fresnel.into(),
            specular_entry: p.boundary.specular_entry.into(),
            media: medium::room(g.media.len()) as i32,
            index: g.media[0].index as f32,
            mismatch: g.bends().into(),
            gate_mm: p.time_gate_ns.map_or(ENDLESS_MM, |ns| (ns * LIGHT_MM_PER_NS) as f32),
            march_step_mm: self.march_step_mm() as f32,
            roulette_threshold: p.roulette.threshold as f32,
            roulette_survival: p.roulette.survival as f32,
            tally: self.tally().code(),
            deposit_scale: self.deposit_scale() as f32,
            paths_per_mm: (1.0 / self.path_unit_mm()) as f32,
            eye_mm: self.eye_mm().map(|v| v as f32),
            beam_mm: [self.source.position_mm.x as f32, self.source.position_mm.y as f32],
            ..PhotonTransport::default()
        };
        self.source.apply(&mut device);
        self.bounds(&mut device);
        self.cells(&mut device, &mut table);
        match &g.place {
            Where::Box => {}
            Where::Layers(ends) => {
                device.layers = ends.len() as i32;
                let ends = ends.iter().map(|e| if e.is_finite() { *e as f32 } else { ENDLESS_MM });
                device.at_layers = append(&mut table, std::iter::once(0.0).chain(ends));
            }
            Where::Labels { of_voxel, .. } => {
                // Labels are bytes if they fit, which need less cache. The table has a spare word at its end, since words are read from any byte on.
                let label_bytes = if g.media.len() <= 256 { 1 } else { 2 };
                let (with_clearance, clearance) = (self.tracking == Tracking::Exact, self.clearance());
                let mut bytes = Vec::with_capacity((label_bytes + usize::from(with_clearance)) * of_voxel.len() + 8);
                for (i, label) in of_voxel.iter().enumerate() {
                    bytes.extend(&label.to_le_bytes()[..label_bytes]);
                    bytes.extend(with_clearance.then(|| clearance.map_or(0, |r| r[i])));
                }
                bytes.resize(bytes.len().next_multiple_of(4) + 4, 0);
                let words = bytes.chunks_exact(4).map(|w| f32::from_le_bytes([w[0], w[1], w[2], w[3]]));
                device.at_voxels = append(&mut table, words);
                device.label_bytes = label_bytes as i32;
            }
            Where::Density(density) => device.at_voxels = append(&mut table, density.iter().copied()),
        }
        if g.is_gamma() {
            let source_kev = p.source.energy_kev();
            device.source_kev = source_kev as f32;
            device.gamma_least_kev = LEAST_KEV as f32;
            device.gamma_least_log2 = LEAST_KEV.log2() as f32;
            device.gamma_rows_per_log2 = ((ROWS - 1) as f64 / (source_kev / LEAST_KEV).log2().max(1e-6)) as f32;
            device.at_gamma = append(&mut table, gammas::rows(&g.media, source_kev));
        }
        device.most_steps = self.most_steps(device.cells);
        let mut bins = 0;
        if let Some(histogram) = &p.exit_histogram {
            device.radius_bins = histogram.radius_edges_mm.len() as i32 - 1;
            device.angle_bins = histogram.angle_edges_deg.len() as i32 - 1;
            device.at_radii = append(&mut table, histogram.radius_edges_mm.iter().map(|r| *r as f32));
            // In floating point the cosine of 90 degrees is not quite 0.
            let cosine = |deg: &f64| if *deg >= 90.0 { -1.0 } else { (deg * PI / 180.0).cos() as f32 };
            device.at_cosines = append(&mut table, histogram.angle_edges_deg.iter().map(cosine));
            bins = 2 * device.radius_bins as usize * device.angle_bins as usize;
        }
        Ok(DevicePlan {
            variant: self.variant()?,
            parameters: bytemuck::bytes_of(&device).to_vec(),
            table,
            cells: g.dims.iter().product(),
            ledger: LedgerEntry::LENGTH + bins,
        })
    }

    /// The kernel variant.
    pub(super) fn variant(&self) -> Result<Variant> {
        Ok(Variant::new(TECHNIQUE.name, None, features(&self.geometry, self.tracking)?))
    }

    /// The most steps of a photon. In a thin box only totally reflected light takes many steps; without absorption it would never end.
    fn most_steps(&self, cells: [i32; 3]) -> i32 {
        let across: f64 = self.geometry.size_mm.iter().sum();
        let thin = self.extinction_range_per_mm[1] * across < 0.1;
        if thin { 5_000 + 100 * cells.iter().sum::<i32>() } else { 1_000_000 }
    }

    /// The march's step: the request's, or a tenth of the shortest mean free path.
    pub(super) fn march_step_mm(&self) -> f64 {
        let shortest = 0.1 / self.extinction_range_per_mm[1].max(1e-30);
        self.parameters
            .march_step_mm
            .unwrap_or(shortest.min(self.geometry.size_mm.iter().copied().fold(f64::INFINITY, f64::min)))
    }

    /// The eye of the gather: the request's, or one far before the entry face.
    fn eye_mm(&self) -> [f64; 3] {
        let size = self.geometry.size_mm;
        self.parameters.eye_mm.unwrap_or([0.5 * size[0], 0.5 * size[1], -3.0 * size[2]])
    }
}

impl Parameters {
    /// The request's grid, or `otherwise`.
    pub(super) fn dims(&self, otherwise: [usize; 3]) -> [usize; 3] {
        self.grid.map_or(otherwise, |g| g.map(|n| n as usize))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_that_are_not_listed_are_an_error_that_names_them() {
        assert!(permitted([("MEDIA", 3), ("TRACKING", 0), ("GAMMA", 1)]).is_ok());
        let said = permitted([("MEDIA", 3), ("TRACKING", 2), ("GAMMA", 1)]).expect_err("not listed").to_string();
        assert!(said.contains("photon_transport MEDIA=3 TRACKING=2 GAMMA=1"), "{said}");
    }
}
