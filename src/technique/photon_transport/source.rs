//! The sources of photons.

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

use super::PhotonTransport;
use super::device::SourceKind;
use crate::error::{Error, Result};

/// The light. `position_mm` counts from the box's corner. What starts outside the box flies to it and enters there.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LightSource {
    /// `pencil`: one ray. `isotropic`: a point that shines everywhere, inside the box. `planar`: parallel rays from the parallelogram
    /// of `edge_u_mm` and `edge_v_mm` at `position_mm`. `disk`: parallel rays from a disk of `radius_mm`. `cone`: a point that shines
    /// evenly into a cone. `diffuse`: a Lambertian disk of `radius_mm`. Default: `pencil`, in the chamber `isotropic`.
    #[serde(rename = "type")]
    #[schemars(extend("enum" = ["pencil", "isotropic", "planar", "disk", "cone", "diffuse", null]))]
    kind: Option<String>,
    /// Where it stands. Default: the middle of the face at z = 0; in the chamber, above the hole in the lid.
    position_mm: Option<[f64; 3]>,
    /// Where it shines. Default: +z; in the chamber -y.
    direction: Option<[f64; 3]>,
    /// Half the opening of a cone. Default 20.
    #[schemars(range(min = 0.01, max = 180))]
    half_angle_deg: Option<f64>,
    /// Radius of `disk` and `diffuse`. Default: 0 for `diffuse`, a quarter of the box's smaller side for `disk`.
    #[schemars(range(min = 0, max = 1e6))]
    radius_mm: Option<f64>,
    /// Energy of gamma photons, for media whose phase is `klein_nishina`. Default 140.
    #[schemars(range(min = 10, max = 2000))]
    pub energy_kev: Option<f64>,
    /// An edge of `planar`. Default: the box's side along x.
    edge_u_mm: Option<[f64; 3]>,
    /// The other. Default: the box's side along y.
    edge_v_mm: Option<[f64; 3]>,
}

/// A source in numbers.
#[derive(Debug, Clone)]
pub struct Source {
    /// Its kind.
    pub kind: SourceKind,
    /// Its position from the box's corner.
    pub position_mm: DVec3,
    /// Its direction, of unit length.
    pub axis: DVec3,
    u_mm: DVec3,
    v_mm: DVec3,
    cos_from: f64,
}

impl SourceKind {
    /// The kind of a name in requests; a pencil for an unknown name.
    fn named(name: &str) -> Self {
        match name {
            "isotropic" => Self::Isotropic,
            "planar" => Self::Planar,
            "disk" => Self::Disk,
            "cone" => Self::Cone,
            "diffuse" => Self::Diffuse,
            _ => Self::Pencil,
        }
    }
}

impl LightSource {
    /// Energy of its gamma photons.
    pub fn energy_kev(&self) -> f64 {
        self.energy_kev.unwrap_or(140.0)
    }

    /// The source in a box of a size.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a direction of no length, a point outside the box, or a beam that misses it.
    pub fn resolve(&self, size_mm: [f64; 3], chamber: bool, at: &str) -> Result<Source> {
        let size = DVec3::from(size_mm);
        let name = self.kind.as_deref().unwrap_or(if chamber { "isotropic" } else { "pencil" });
        let (place, way) = if chamber {
            (DVec3::new(0.5, 0.9, 0.5) * size, DVec3::NEG_Y)
        } else {
            (DVec3::new(0.5, 0.5, 0.0) * size, DVec3::Z)
        };
        let planar = name == "planar";
        let u = self.edge_u_mm.map_or(DVec3::new(size.x, 0.0, 0.0), DVec3::from);
        let v = self.edge_v_mm.map_or(DVec3::new(0.0, size.y, 0.0), DVec3::from);
        let position_mm = self.position_mm.map_or(if planar { place - 0.5 * (u + v) } else { place }, DVec3::from);
        let Some(axis) = self.direction.map_or(way, DVec3::from).try_normalize() else {
            let permitted = "a direction of any length";
            return Err(Error::invalid(format!("{at}/direction"), "the direction is zero", permitted));
        };
        if let Some(a) = (0..3).find(|&a| !position_mm[a].is_finite() || position_mm[a].abs() > 1e7) {
            return Err(Error::invalid(format!("{at}/position_mm/{a}"), "too far away", "-10000000 to 10000000"));
        }
        let inside = position_mm.cmpge(DVec3::ZERO) & position_mm.cmple(size);
        if let (true, Some(a)) = (name == "isotropic", (0..3).find(|&a| !inside.test(a))) {
            let permitted = format!("0 to {}", size[a]);
            return Err(Error::invalid(format!("{at}/position_mm/{a}"), "outside the box", permitted));
        }
        let radius = self.radius_mm.unwrap_or(if name == "disk" { 0.25 * size.x.min(size.y) } else { 0.0 });
        let (b1, b2) = axis.any_orthonormal_pair();
        let (u_mm, v_mm) = if planar { (u, v) } else { (radius * b1, radius * b2) };
        let half_angle = if name == "cone" { self.half_angle_deg.unwrap_or(20.0) } else { 180.0 };
        let source = Source {
            kind: SourceKind::named(name),
            position_mm,
            axis,
            u_mm,
            v_mm,
            cos_from: half_angle.to_radians().cos(),
        };
        if ["pencil", "planar", "disk"].contains(&name) && !source.meets(size) {
            return Err(Error::invalid(at, "the beam misses the box", "a position and direction that meet it"));
        }
        Ok(source)
    }
}

impl Source {
    /// True if any of its parallel rays meets the box.
    fn meets(&self, size: DVec3) -> bool {
        let planar = self.kind == SourceKind::Planar;
        let places = (-8..=8).flat_map(|i| (-8..=8).map(move |k| (f64::from(i) / 8.0, f64::from(k) / 8.0)));
        places.filter(|(a, b)| planar || a.hypot(*b) <= 1.0).any(|(a, b)| {
            let (a, b) = if planar { (0.5 * a + 0.5, 0.5 * b + 0.5) } else { (a, b) };
            let origin = self.position_mm + a * self.u_mm + b * self.v_mm;
            let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
            for axis in 0..3 {
                let (o, d) = (origin[axis], self.axis[axis]);
                if d.abs() > 1e-15 {
                    let (a, b) = (-o / d, (size[axis] - o) / d);
                    (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
                } else if !(0.0..=size[axis]).contains(&o) {
                    return false;
                }
            }
            // A ray that starts on a face and shines away from the box meets it in one point.
            near < far && far > 0.0
        })
    }

    /// Writes the source into the kernel's parameters.
    pub fn apply(&self, device: &mut PhotonTransport) {
        let floats = |v: DVec3| v.as_vec3().to_array();
        device.source_type = self.kind.code();
        (device.source, device.source_axis) = (floats(self.position_mm), floats(self.axis));
        (device.source_u, device.source_v) = (floats(self.u_mm), floats(self.v_mm));
        device.source_cos_from = self.cos_from as f32;
    }
}
