//! Phantoms: sums of shapes, whose projections are known exactly.

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

use super::{Ray, Shape, ShapeRequest, shepp_logan};
use crate::error::{Error, Result};

/// A phantom in a request: `shapes`, or `name` with its table.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhantomRequest {
    /// Shapes, whose values add where they overlap.
    #[schemars(length(min = 1, max = 256))]
    shapes: Option<Vec<ShapeRequest>>,
    /// A phantom by name.
    name: Option<Name>,
    /// The named phantom's dimensions: in two it goes on for ever along z. Default 2.
    #[schemars(range(min = 2, max = 3))]
    dimensions: Option<u32>,
    /// The named phantom's greys. Default `modified`.
    greys: Option<Greys>,
    /// The named phantom's radius, mm. Default 100.
    #[schemars(range(min = 1e-6, max = 1e6))]
    radius_mm: Option<f64>,
}

/// Phantoms with a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Name {
    /// The head of Shepp and Logan.
    SheppLogan,
}

/// Tables of greys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Greys {
    /// Toft's, with ten times the small contrasts: 1, −0.8, −0.2, …
    #[default]
    Modified,
    /// Those of Shepp and Logan: 2, −0.98, −0.02, …
    Original,
}

/// A valid phantom.
#[derive(Debug, Clone, PartialEq)]
pub struct Phantom {
    shapes: Vec<Shape>,
}

impl PhantomRequest {
    /// Checks the phantom.
    ///
    /// # Errors
    /// [`Error::Invalid`] with a pointer under `at`.
    pub fn resolve(&self, at: &str) -> Result<Phantom> {
        let shapes = match (&self.shapes, self.name) {
            (Some(shapes), None) => {
                let of_named = [
                    ("dimensions", self.dimensions.is_some()),
                    ("greys", self.greys.is_some()),
                    ("radius_mm", self.radius_mm.is_some()),
                ];
                if let Some((name, _)) = of_named.into_iter().find(|(_, is_given)| *is_given) {
                    return Err(Error::invalid(format!("{at}/{name}"), "only for a phantom by name", "leave it out"));
                }
                shapes
                    .iter()
                    .enumerate()
                    .map(|(i, shape)| shape.resolve(&format!("{at}/shapes/{i}")))
                    .collect::<Result<_>>()?
            }
            (None, Some(Name::SheppLogan)) => {
                let is_original = self.greys.unwrap_or_default() == Greys::Original;
                shepp_logan::shapes(self.dimensions.unwrap_or(2), is_original, self.radius_mm.unwrap_or(100.0))
            }
            _ => return Err(Error::invalid(at, "a phantom has either shapes or a name", "shapes, or name")),
        };
        Ok(Phantom { shapes })
    }
}

impl Phantom {
    /// The head of Shepp and Logan in two dimensions, with modified greys and a radius of 100 mm.
    pub fn shepp_logan() -> Self {
        Self { shapes: shepp_logan::shapes(2, false, 100.0) }
    }

    /// The number of its shapes.
    pub fn shapes(&self) -> usize {
        self.shapes.len()
    }

    /// The integral along a ray, value · mm.
    pub fn integral(&self, ray: &Ray) -> f64 {
        self.shapes.iter().map(|shape| shape.integral(ray)).sum()
    }

    /// The value at a point, mm.
    pub fn at(&self, point: DVec3) -> f64 {
        self.shapes.iter().map(|shape| shape.at(point)).sum()
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    fn phantom(request: Value) -> Phantom {
        serde_json::from_value::<PhantomRequest>(request).expect("a phantom").resolve("").expect("a valid phantom")
    }

    /// The ray x cosθ + y sinθ = s in the plane z = 0.
    fn ray(theta_deg: f64, s: f64) -> Ray {
        let (sin, cos) = theta_deg.to_radians().sin_cos();
        Ray { origin: DVec3::new(s * cos, s * sin, 0.0), direction: DVec3::new(-sin, cos, 0.0) }
    }

    fn is(found: f64, truth: f64) {
        assert!((found - truth).abs() < 2e-9 * truth.abs().max(1.0), "{found} for {truth}");
    }

    #[test]
    fn shepp_logan_projects_as_its_tables_say() {
        let modified = phantom(json!({"name": "shepp_logan", "radius_mm": 1}));
        for (theta, p) in [(0.0, 0.5146), (90.0, 0.20767596), (45.0, 0.24274703)] {
            assert!(
                (modified.integral(&ray(theta, 0.0)) - p).abs() < 1e-8,
                "{theta}: {}",
                modified.integral(&ray(theta, 0.0))
            );
        }
        let original = phantom(json!({"name": "shepp_logan", "radius_mm": 1, "greys": "original"}));
        assert!((original.integral(&ray(0.0, 0.0)) - 1.97426).abs() < 1e-8);
        // Mass and centroid of every projection, by the midpoint rule.
        let steps = 40_000;
        let moments = |of: &Phantom, theta: f64| {
            (0..steps).fold([0.0; 2], |[mass, first], i| {
                let s = 2.0 * (f64::from(i) + 0.5) / f64::from(steps) - 1.0;
                let p = of.integral(&ray(theta, s)) * 2.0 / f64::from(steps);
                [mass + p, first + s * p]
            })
        };
        for theta in [0.0, 33.0, 90.0, 151.0] {
            let [mass, first] = moments(&modified, theta);
            let (sin, cos) = f64::to_radians(theta).sin_cos();
            assert!((mass - 0.4952646).abs() < 1e-6, "{theta}: {mass}");
            assert!((first / mass - 0.0087783374 * cos - 0.0646977035 * sin).abs() < 1e-6, "{theta}: {}", first / mass);
            assert!((moments(&original, theta)[0] - 2.20175669).abs() < 1e-5);
        }
        // A radius of 100 mm makes integrals 100 times as long.
        let large = phantom(json!({"name": "shepp_logan"}));
        is(large.integral(&ray(45.0, 0.0)), 100.0 * modified.integral(&ray(45.0, 0.0)));
    }

    #[test]
    fn zernike_polynomials_project_to_chebyshev_ones() {
        for (n, m, theta, s, p) in [
            (2, 0, 0.0, 0.3, -0.4070140593),
            (4, 2, 20.0, 0.3, 0.0144982749),
            (3, 1, 33.0, 0.2, -0.3023951612),
            (5, 3, 75.0, 0.7, 0.2352780670),
        ] {
            let one = phantom(json!({"shapes": [{"type": "zernike", "n": n, "m": m, "radius_mm": 1}]}));
            assert!((one.integral(&ray(theta, s)) - p).abs() < 1e-9, "{n} {m}: {}", one.integral(&ray(theta, s)));
            let quadrature = integral_by_steps(&one, &ray(theta, s), 1.0);
            assert!((quadrature - p).abs() < 1e-4, "{n} {m}: {quadrature}");
        }
    }

    #[test]
    fn gaussians_project_to_gaussians() {
        let one = phantom(json!({"shapes": [{"type": "gaussian", "axes_mm": [0.15, 0.15]}]}));
        is(one.integral(&ray(37.0, 0.1)), 0.3010726522);
        let turned = json!({"type": "gaussian", "value": 2, "axes_mm": [0.2, 0.08], "center_mm": [0.1, -0.2, 0], "angle_deg": 25});
        is(phantom(json!({"shapes": [turned]})).integral(&ray(60.0, -0.05)), 0.4297777813);
    }

    fn integral_by_steps(of: &Phantom, ray: &Ray, reach: f64) -> f64 {
        let steps = 200_000;
        let at =
            |i: i32| of.at(ray.origin + ray.direction * (2.0 * (f64::from(i) + 0.5) / f64::from(steps) - 1.0) * reach);
        (0..steps).map(at).sum::<f64>() * 2.0 * reach / f64::from(steps)
    }

    #[test]
    fn every_shape_projects_to_the_integral_of_its_values() {
        let oblique = Ray { origin: DVec3::new(0.3, -0.2, 0.15), direction: DVec3::new(0.5, 0.7, -0.4).normalize() };
        let along_z = Ray { origin: DVec3::new(0.3, -0.2, 0.15), direction: DVec3::Z };
        for kind in ["ellipsoid", "box", "cylinder", "gaussian"] {
            let shape = json!({"type": kind, "value": 1.5, "axes_mm": [0.9, 0.5, 0.7], "center_mm": [0.1, 0, -0.1], "angle_deg": 20});
            let one = phantom(json!({"shapes": [shape]}));
            for ray in [oblique, along_z, ray(70.0, 0.2)] {
                let (found, steps) = (one.integral(&ray), integral_by_steps(&one, &ray, 8.0));
                assert!((found - steps).abs() < 4e-4 && found > 0.3, "{kind}: {found}, {steps}");
            }
        }
        // What goes on for ever along z has the same integral at any height, and more of it on a steeper ray.
        let long = phantom(json!({"shapes": [{"type": "ellipse", "axes_mm": [0.9, 0.5]}]}));
        let flat = Ray { direction: oblique.direction.with_z(0.0).normalize(), ..oblique };
        is(long.integral(&oblique), long.integral(&flat) / oblique.direction.truncate().length());
    }

    #[test]
    fn wrong_phantoms_are_refused_at_their_field() {
        for (request, pointer) in [
            (json!({}), "/p"),
            (json!({"name": "shepp_logan", "shapes": [{"type": "box", "axes_mm": [1, 1]}]}), "/p"),
            (json!({"shapes": [{"type": "box"}]}), "/p/shapes/0/axes_mm"),
            (json!({"shapes": [{"type": "ellipsoid", "axes_mm": [1, 1]}]}), "/p/shapes/0/axes_mm"),
            (json!({"shapes": [{"type": "zernike", "n": 3, "m": 2, "radius_mm": 1}]}), "/p/shapes/0/m"),
            (json!({"shapes": [{"type": "box", "axes_mm": [1, 1], "n": 2}]}), "/p/shapes/0/n"),
            (json!({"shapes": [{"type": "box", "axes_mm": [1, 1]}], "greys": "original"}), "/p/greys"),
        ] {
            let request: PhantomRequest = serde_json::from_value(request).expect("well formed");
            let refused = request.resolve("/p");
            assert!(matches!(&refused, Err(Error::Invalid(all)) if all[0].pointer == pointer), "{refused:?}");
        }
    }
}
