//! Random parameters: each view draws its own, so that the study of stated errors sees all of its options.

use serde_json::{Map, Value, json};

/// The choices of a scene at random, for a volume.
pub struct Draw<'a> {
    /// Gives a number between 0 and 1.
    unit: &'a mut dyn FnMut() -> f64,
    /// The least and the greatest value of the volume.
    range: [f64; 2],
    /// The mean side of its box, world units.
    side: f64,
}

impl<'a> Draw<'a> {
    /// Choices for a volume of this range of values and this mean side. `unit` gives a number between 0 and 1.
    pub fn new(unit: &'a mut dyn FnMut() -> f64, range: [f64; 2], side: f64) -> Self {
        Self { unit, range, side }
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        (self.unit)() < probability
    }

    /// A number between two.
    pub fn between(&mut self, least: f64, most: f64) -> f64 {
        least + (most - least) * (self.unit)()
    }

    /// A number between two, evenly by its logarithm.
    pub fn logarithmic(&mut self, least: f64, most: f64) -> f64 {
        least * (most / least).powf((self.unit)())
    }

    /// One of several.
    pub fn one_of<T: Clone>(&mut self, all: &[T]) -> T {
        let at = ((self.unit)() * all.len() as f64) as usize;
        all[at.min(all.len() - 1)].clone()
    }

    /// A value of the volume between two parts of its range.
    pub fn value(&mut self, least: f64, most: f64) -> f64 {
        self.range[0] + (self.range[1] - self.range[0]) * self.between(least, most)
    }

    /// A difference of values between two parts of the volume's range, evenly by its logarithm.
    pub fn difference(&mut self, least: f64, most: f64) -> f64 {
        (self.range[1] - self.range[0]) * self.logarithmic(least, most)
    }

    /// An extinction that is an optical depth between these over the volume's mean side, per world unit.
    pub fn extinction(&mut self, least: f64, most: f64) -> f64 {
        self.logarithmic(least, most) / self.side
    }

    /// A length between two parts of the volume's mean side, world units.
    pub fn length(&mut self, least: f64, most: f64) -> f64 {
        self.side * self.between(least, most)
    }

    /// A direction of any length.
    pub fn direction(&mut self) -> [f64; 3] {
        std::array::from_fn(|_| self.between(-1.0, 1.0))
    }

    /// A linear colour.
    pub fn color(&mut self) -> [f64; 3] {
        std::array::from_fn(|_| self.between(0.0, 1.0))
    }

    /// Sets a parameter with this probability.
    pub fn maybe(&mut self, own: &mut Value, name: &str, probability: f64, value: impl FnOnce(&mut Self) -> Value) {
        if self.chance(probability) {
            own[name] = value(self);
        }
    }

    /// One of the interpolations, or none.
    pub fn interpolation(&mut self, own: &mut Value) {
        self.maybe(own, "interpolation", 0.5, |draw| {
            json!(draw.one_of(&["nearest", "trilinear", "b_spline", "catmull_rom"]))
        });
    }

    /// A window and colours, or none.
    pub fn window(&mut self, own: &mut Value) {
        self.maybe(own, "window", 0.4, |draw| json!({"low": draw.value(0.0, 0.3), "high": draw.value(0.5, 1.0)}));
        self.maybe(own, "invert", 0.15, |_| json!(true));
    }
}

/// Sets parameters of a request.
pub(super) fn set(own: &mut Map<String, Value>, parameters: &[(&str, Value)]) {
    own.extend(parameters.iter().map(|(name, value)| ((*name).to_owned(), value.clone())));
}
