//! One light of a request.

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

use super::medium::Spectrum;
use crate::device::enums::LightKind;
use crate::error::{Error, Result};

/// The greatest permitted radiance, irradiance or intensity.
const BRIGHTEST: f64 = 1e9;

/// A light. Which of the fields count is said by `type`. Lights do not hide anything.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LightSource {
    /// `sun`: parallel light of `irradiance` from `direction`. `sky`: from everywhere, of one `radiance` or between `zenith`, `horizon` and
    /// `ground`. `point`: a point of `intensity` at `position`. `sphere`: of `radiance`, `radius` and `position`. `quad`: a parallelogram
    /// of `radiance` on both sides.
    #[serde(rename = "type")]
    #[schemars(extend("enum" = ["sun", "sky", "point", "sphere", "quad"]))]
    pub kind: String,
    /// `sun`: towards it, in the world, of any length. Default: from high on the left of where a volume is looked at from by default.
    pub(super) direction: Option<[f64; 3]>,
    /// `sun`: on a face that is turned to it. Default 3.
    pub(super) irradiance: Option<Spectrum>,
    /// `sun`: its width in the sky; 0 (default) is a point, which only next-event estimation finds.
    #[schemars(range(min = 0, max = 180))]
    pub(super) angular_diameter_deg: Option<f64>,
    /// `sky`, `sphere`, `quad`. Default 1.
    pub(super) radiance: Option<Spectrum>,
    /// `sky`: straight above.
    pub(super) zenith: Option<Spectrum>,
    /// `sky`: at the horizon. Default: the zenith's.
    pub(super) horizon: Option<Spectrum>,
    /// `sky`: straight below. Default: the horizon's.
    pub(super) ground: Option<Spectrum>,
    /// `sky`: which way is up. Default: z for a scan, y for a built-in.
    pub(super) up: Option<[f64; 3]>,
    /// `sky`: whether the eye sees it behind the volume, or only its light in the volume. Default true.
    pub(super) visible: Option<bool>,
    /// `point`, `sphere`: where it is, in the world.
    pub(super) position: Option<[f64; 3]>,
    /// `point`: power per steradian. Default 1.
    pub(super) intensity: Option<Spectrum>,
    /// `sphere`.
    #[schemars(range(min = 1e-12, max = 1e13))]
    pub(super) radius: Option<f64>,
    /// `quad`: a corner, in the world.
    pub(super) corner: Option<[f64; 3]>,
    /// `quad`: an edge from that corner.
    pub(super) edge_u: Option<[f64; 3]>,
    /// `quad`: the other edge.
    pub(super) edge_v: Option<[f64; 3]>,
}

pub(super) fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

impl LightSource {
    fn given(&self) -> [(&'static str, bool); 15] {
        [
            ("direction", self.direction.is_some()),
            ("irradiance", self.irradiance.is_some()),
            ("angular_diameter_deg", self.angular_diameter_deg.is_some()),
            ("radiance", self.radiance.is_some()),
            ("zenith", self.zenith.is_some()),
            ("horizon", self.horizon.is_some()),
            ("ground", self.ground.is_some()),
            ("up", self.up.is_some()),
            ("visible", self.visible.is_some()),
            ("position", self.position.is_some()),
            ("intensity", self.intensity.is_some()),
            ("radius", self.radius.is_some()),
            ("corner", self.corner.is_some()),
            ("edge_u", self.edge_u.is_some()),
            ("edge_v", self.edge_v.is_some()),
        ]
    }

    /// The fields that a light of its type must have, and the fields that it may have.
    fn fields(&self) -> [&'static [&'static str]; 2] {
        match self.kind.as_str() {
            "sun" => [&[], &["direction", "irradiance", "angular_diameter_deg"]],
            "sky" => [&[], &["radiance", "zenith", "horizon", "ground", "up", "visible"]],
            "point" => [&["position"], &["intensity"]],
            "sphere" => [&["position", "radius"], &["radiance"]],
            _ => [&["corner", "edge_u", "edge_v"], &["radiance"]],
        }
    }

    /// Its kind on the device, which the sky has none of.
    pub(super) fn on_device(&self) -> LightKind {
        match self.kind.as_str() {
            "point" => LightKind::Point,
            "sphere" => LightKind::Sphere,
            "quad" => LightKind::Quad,
            _ => LightKind::Sun,
        }
    }

    pub(super) fn check(&self, at: &str) -> Result<()> {
        if self.kind.is_empty() {
            return Err(Error::invalid(format!("{at}/type"), "missing", "sun, sky, point, sphere, quad"));
        }
        let [needed, permitted] = self.fields();
        for (name, given) in self.given() {
            let at = format!("{at}/{name}");
            if given && !needed.contains(&name) && !permitted.contains(&name) {
                let all: Vec<&str> = needed.iter().chain(permitted).copied().collect();
                return Err(Error::invalid(at, format!("not of a {}", self.kind), all.join(", ")));
            }
            if !given && needed.contains(&name) {
                return Err(Error::invalid(at, format!("a {} needs it", self.kind), "three numbers, or a length"));
            }
        }
        let brightness = [
            ("irradiance", self.irradiance),
            ("radiance", self.radiance),
            ("zenith", self.zenith),
            ("horizon", self.horizon),
            ("ground", self.ground),
            ("intensity", self.intensity),
        ];
        for (name, value) in brightness {
            if let Some(value) = value {
                value.check(&format!("{at}/{name}"), 0.0, BRIGHTEST)?;
            }
        }
        for (name, way) in [("direction", self.direction), ("up", self.up)] {
            if way.is_some_and(|w| DVec3::from(w).try_normalize().is_none()) {
                return Err(Error::invalid(format!("{at}/{name}"), "the direction is zero", "of any length above 0"));
            }
        }
        for (name, place) in
            [("position", self.position), ("corner", self.corner), ("edge_u", self.edge_u), ("edge_v", self.edge_v)]
        {
            if place.is_some_and(|p| p.iter().any(|v| v.abs() > 1e13)) {
                return Err(Error::invalid(format!("{at}/{name}"), "too far away", "-1e13 to 1e13"));
            }
        }
        if let (Some(u), Some(v)) = (self.edge_u, self.edge_v)
            && DVec3::from(u).cross(DVec3::from(v)).length() < 1e-18
        {
            return Err(Error::invalid(format!("{at}/edge_v"), "the edges span no area", "not along edge_u"));
        }
        if self.radiance.is_some() && (self.zenith.is_some() || self.horizon.is_some() || self.ground.is_some()) {
            let permitted = "one of radiance and zenith";
            return Err(Error::invalid(format!("{at}/radiance"), "zenith or horizon is given too", permitted));
        }
        Ok(())
    }

    pub(super) fn color(&self) -> [f64; 3] {
        let (given, otherwise) = match self.kind.as_str() {
            "sun" => (self.irradiance, 3.0),
            "point" => (self.intensity, 1.0),
            _ => (self.radiance, 1.0),
        };
        given.map_or([otherwise; 3], Spectrum::rgb)
    }

    /// The light's position, or for a sun the direction towards it.
    pub(super) fn place(&self, up: DVec3) -> DVec3 {
        let otherwise = if up == DVec3::Z { DVec3::new(0.6, 0.6, 0.8) } else { DVec3::new(0.7, 0.9, -0.4) };
        match self.kind.as_str() {
            "sun" => self.direction.map_or(otherwise, DVec3::from).normalize_or_zero(),
            "quad" => DVec3::from(self.corner.unwrap_or_default()),
            _ => DVec3::from(self.position.unwrap_or_default()),
        }
    }

    fn middle(&self) -> DVec3 {
        let of = |v: Option<[f64; 3]>| DVec3::from(v.unwrap_or_default());
        of(self.position) + of(self.corner) + 0.5 * (of(self.edge_u) + of(self.edge_v))
    }

    /// The approximate irradiance from this light on a face in the middle of a volume of that radius.
    pub(super) fn irradiance_at_middle(&self, radius: f64) -> f64 {
        let squared = self.middle().length_squared().max(0.25 * radius * radius);
        let brightness = luminance(self.color());
        match self.kind.as_str() {
            "sun" => brightness,
            "point" => brightness / squared,
            "sphere" => brightness * std::f64::consts::PI * self.radius.unwrap_or(0.0).powi(2) / squared,
            _ => {
                let (u, v) = (self.edge_u.unwrap_or_default(), self.edge_v.unwrap_or_default());
                brightness * DVec3::from(u).cross(DVec3::from(v)).length() / squared
            }
        }
    }

    /// The size: for a sun 1 − the cosine of its angular radius, else a sphere's radius.
    pub(super) fn size(&self) -> f64 {
        match self.kind.as_str() {
            "sun" => {
                let sine = (0.25 * self.angular_diameter_deg.unwrap_or(0.0).to_radians()).sin();
                2.0 * sine * sine
            }
            _ => self.radius.unwrap_or(0.0),
        }
    }
}
