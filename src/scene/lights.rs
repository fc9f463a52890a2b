//! Lights of views that scatter light.

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

use super::medium::Spectrum;
use crate::error::{Error, Result};

/// The number of floats of a light in the kernel's table: `LIGHT_NUMBERS` of `kernels/shared/light.h`.
pub const LIGHT_NUMBERS: usize = 16;
/// The most lights of a scene.
const MOST_LIGHTS: usize = 8;
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
    direction: Option<[f64; 3]>,
    /// `sun`: on a face that is turned to it. Default 3.
    irradiance: Option<Spectrum>,
    /// `sun`: its width in the sky; 0 (default) is a point, which only next-event estimation finds.
    #[schemars(range(min = 0, max = 180))]
    angular_diameter_deg: Option<f64>,
    /// `sky`, `sphere`, `quad`. Default 1.
    radiance: Option<Spectrum>,
    /// `sky`: straight above.
    zenith: Option<Spectrum>,
    /// `sky`: at the horizon. Default: the zenith's.
    horizon: Option<Spectrum>,
    /// `sky`: straight below. Default: the horizon's.
    ground: Option<Spectrum>,
    /// `sky`: which way is up. Default: z for a scan, y for a built-in.
    up: Option<[f64; 3]>,
    /// `sky`: whether the eye sees it behind the volume, or only its light in the volume. Default true.
    visible: Option<bool>,
    /// `point`, `sphere`: where it is, in the world.
    position: Option<[f64; 3]>,
    /// `point`: power per steradian. Default 1.
    intensity: Option<Spectrum>,
    /// `sphere`.
    #[schemars(range(min = 1e-9, max = 1e9))]
    radius: Option<f64>,
    /// `quad`: a corner, in the world.
    corner: Option<[f64; 3]>,
    /// `quad`: an edge from that corner.
    edge_u: Option<[f64; 3]>,
    /// `quad`: the other edge.
    edge_v: Option<[f64; 3]>,
}

/// The sky's radiances, its up direction and its visibility.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sky {
    /// The radiance at the zenith, the horizon and straight below.
    pub radiance: [[f64; 3]; 3],
    /// The up direction, if the request gives one.
    pub up: Option<DVec3>,
    /// True if the eye sees the sky.
    pub visible: bool,
}

/// A scene's lights.
#[derive(Debug, Clone, PartialEq)]
pub struct Lights(Vec<LightSource>);

fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

impl Default for Lights {
    /// A sun in a blue sky, high on the left.
    fn default() -> Self {
        let sun = LightSource { kind: "sun".into(), ..LightSource::default() };
        let sky = LightSource {
            kind: "sky".into(),
            zenith: Some(Spectrum::Rgb([0.05, 0.11, 0.26])),
            horizon: Some(Spectrum::Rgb([0.26, 0.34, 0.42])),
            ground: Some(Spectrum::Rgb([0.1, 0.09, 0.08])),
            ..LightSource::default()
        };
        Self(vec![sun, sky])
    }
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

    fn check(&self, at: &str) -> Result<()> {
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
            if place.is_some_and(|p| p.iter().any(|v| v.abs() > 1e9)) {
                return Err(Error::invalid(format!("{at}/{name}"), "too far away", "-1e9 to 1e9"));
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

    fn color(&self) -> [f64; 3] {
        let (given, otherwise) = match self.kind.as_str() {
            "sun" => (self.irradiance, 3.0),
            "point" => (self.intensity, 1.0),
            _ => (self.radiance, 1.0),
        };
        given.map_or([otherwise; 3], Spectrum::rgb)
    }

    /// The light's position, or for a sun the direction towards it.
    fn place(&self, up: DVec3) -> DVec3 {
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
    fn irradiance_at_middle(&self, radius: f64) -> f64 {
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
    fn size(&self) -> f64 {
        match self.kind.as_str() {
            "sun" => {
                let sine = (0.25 * self.angular_diameter_deg.unwrap_or(0.0).to_radians()).sin();
                2.0 * sine * sine
            }
            _ => self.radius.unwrap_or(0.0),
        }
    }
}

impl Lights {
    /// The lights of a request, or the default ones.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field under `at`.
    pub fn from_request(request: Option<&[LightSource]>, at: &str) -> Result<Self> {
        let Some(lights) = request else { return Ok(Self::default()) };
        if lights.len() > MOST_LIGHTS {
            return Err(Error::invalid(at, format!("{} lights", lights.len()), format!("0 to {MOST_LIGHTS}")));
        }
        for (i, light) in lights.iter().enumerate() {
            light.check(&format!("{at}/{i}"))?;
        }
        let skies: Vec<usize> = (0..lights.len()).filter(|&i| lights[i].kind == "sky").collect();
        if let Some(second) = skies.get(1) {
            return Err(Error::invalid(format!("{at}/{second}"), "there is another sky", "one sky"));
        }
        Ok(Self(lights.to_vec()))
    }

    fn aimed_at(&self) -> impl Iterator<Item = &LightSource> {
        self.0.iter().filter(|l| l.kind != "sky")
    }

    /// The number of lights besides the sky.
    pub fn count(&self) -> usize {
        self.aimed_at().count()
    }

    /// True if a ray may meet a light, since one of them has a size.
    pub fn any_with_size(&self) -> bool {
        self.aimed_at().any(|l| l.kind != "point" && (l.kind != "sun" || l.size() > 0.0))
    }

    /// The index of the first light that no ray meets by chance.
    pub fn first_without_size(&self) -> Option<usize> {
        self.0.iter().position(|l| l.kind == "point" || (l.kind == "sun" && l.size() == 0.0))
    }

    /// The sky.
    pub fn sky(&self) -> Option<Sky> {
        let sky = self.0.iter().find(|l| l.kind == "sky")?;
        let rgb = |s: Option<Spectrum>, otherwise: [f64; 3]| s.map_or(otherwise, Spectrum::rgb);
        let zenith = rgb(sky.zenith, sky.color());
        let horizon = rgb(sky.horizon, zenith);
        let ground = rgb(sky.ground, horizon);
        Some(Sky {
            radiance: [zenith, horizon, ground],
            up: sky.up.map(|u| DVec3::from(u).normalize_or_zero()),
            visible: sky.visible.unwrap_or(true),
        })
    }

    /// The share of each light in the irradiance on a face in the middle of a volume of that radius, in the order of the request. A sky has
    /// no share, since its light comes from everywhere.
    pub fn shares(&self, radius: f64) -> Vec<Option<f64>> {
        let sky = self.sky().map_or(0.0, |s| s.radiance.into_iter().map(luminance).sum::<f64>() / 3.0);
        let falls = |l: &LightSource| (l.kind != "sky").then(|| l.irradiance_at_middle(radius));
        let all: Vec<Option<f64>> = self.0.iter().map(falls).collect();
        let total = all.iter().flatten().sum::<f64>() + std::f64::consts::PI * sky;
        all.into_iter().map(|share| share.map(|s| if total > 0.0 { s / total } else { 0.0 })).collect()
    }

    /// The kernel's table of all lights but the sky. A light's probability of being chosen follows its irradiance in the middle of a volume
    /// of that radius; a fifth of the probability is spread evenly over the lights.
    pub fn table(&self, radius: f64, up: DVec3) -> Vec<f32> {
        let shares: Vec<f64> = self.aimed_at().map(|l| l.irradiance_at_middle(radius)).collect();
        let (total, n) = (shares.iter().sum::<f64>(), shares.len() as f64);
        let mut table = Vec::with_capacity(shares.len() * LIGHT_NUMBERS);
        for (light, share) in self.aimed_at().zip(&shares) {
            let kind = ["sun", "point", "sphere", "quad"].iter().position(|k| *k == light.kind).unwrap_or(0);
            let chance = if total > 0.0 { 0.8 * share / total + 0.2 / n } else { 1.0 / n };
            let mut numbers = [0.0; LIGHT_NUMBERS];
            (numbers[0], numbers[1]) = (kind as f64, if shares.len() == 1 { 1.0 } else { chance });
            numbers[2..5].copy_from_slice(&light.color());
            numbers[5..8].copy_from_slice(&light.place(up).to_array());
            numbers[8] = light.size();
            numbers[9..12].copy_from_slice(&light.edge_u.unwrap_or_default());
            numbers[12..15].copy_from_slice(&light.edge_v.unwrap_or_default());
            table.extend(numbers.map(|v| v as f32));
        }
        table
    }
}
