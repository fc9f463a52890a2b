//! Shapes of one value, and smooth bodies, with their integrals along rays in closed form.

use glam::{DAffine3, DMat3, DVec3};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::error::{Error, Result};

/// A ray through a phantom: a point and a unit vector, mm.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    /// A point of it.
    pub origin: DVec3,
    /// Its direction, of length 1.
    pub direction: DVec3,
}

/// A shape in a request. Shapes add where they overlap.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShapeRequest {
    /// What it is.
    #[serde(rename = "type")]
    kind: Kind,
    /// Its value, per mm; a Gaussian's value at its centre.
    #[serde(default = "default_value")]
    #[schemars(range(min = -1e30, max = 1e30))]
    value: f64,
    /// Its centre, mm.
    #[serde(default)]
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    center_mm: [f64; 3],
    /// Its half sizes along x, y and z, mm; a Gaussian's standard deviations. Without z it goes on for ever along z.
    #[schemars(length(min = 2, max = 3), inner(range(min = 1e-6, max = 1e6)))]
    axes_mm: Option<Vec<f64>>,
    /// Its turn about z, counter-clockwise, degrees.
    #[serde(default)]
    #[schemars(range(min = -36_000, max = 36_000))]
    angle_deg: f64,
    /// The degree of a Zernike polynomial.
    #[schemars(range(min = 0, max = 20))]
    n: Option<u32>,
    /// The azimuthal order of a Zernike polynomial: at most n, and as even as n.
    #[schemars(range(min = 0, max = 20))]
    m: Option<u32>,
    /// The radius of a Zernike polynomial's disc, mm.
    #[schemars(range(min = 1e-6, max = 1e6))]
    radius_mm: Option<f64>,
}

fn default_value() -> f64 {
    1.0
}

/// The kinds of shapes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Kind {
    /// An ellipsoid.
    Ellipsoid,
    /// An ellipse that goes on for ever along z.
    Ellipse,
    /// A box.
    Box,
    /// An elliptic cylinder along z.
    Cylinder,
    /// A Gaussian.
    Gaussian,
    /// A Zernike polynomial on a disc, which goes on for ever along z.
    Zernike,
}

/// A valid shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    form: Form,
    value: f64,
    /// Its own coordinates, in half sizes, from the world's, mm. A shape that goes on for ever along z has 0 there.
    own_from_world: DAffine3,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    Ball,
    Box,
    Cylinder,
    Gaussian,
    Zernike { n: u32, m: u32 },
}

impl ShapeRequest {
    /// Checks the shape.
    ///
    /// # Errors
    /// [`Error::Invalid`] with a pointer under `at`.
    pub fn resolve(&self, at: &str) -> Result<Shape> {
        let is_zernike = self.kind == Kind::Zernike;
        for (name, is_given, is_wanted) in [
            ("axes_mm", self.axes_mm.is_some(), !is_zernike),
            ("radius_mm", self.radius_mm.is_some(), is_zernike),
            ("n", self.n.is_some(), is_zernike),
            ("m", self.m.is_some(), is_zernike),
        ] {
            if is_given != is_wanted {
                let (detail, permitted) = if is_wanted {
                    ("this shape needs it", "a value")
                } else {
                    ("this shape has none", "leave it out")
                };
                return Err(Error::invalid(format!("{at}/{name}"), detail, permitted));
            }
        }
        let (n, m) = (self.n.unwrap_or(0), self.m.unwrap_or(0));
        if m > n || (n - m) % 2 == 1 {
            let detail = format!("there is no Zernike polynomial of n {n} and m {m}");
            return Err(Error::invalid(format!("{at}/m"), detail, "0 to n, and as even as n"));
        }
        let axes = self.axes_mm.clone().unwrap_or_else(|| vec![self.radius_mm.unwrap_or(1.0); 2]);
        let wanted = match self.kind {
            Kind::Ellipsoid => Some(3),
            Kind::Ellipse => Some(2),
            _ => None,
        };
        if !(2..=3).contains(&axes.len()) || wanted.is_some_and(|wanted| axes.len() != wanted) {
            let permitted = wanted.map_or("2 or 3 half sizes".into(), |wanted| format!("{wanted} half sizes"));
            return Err(Error::invalid(format!("{at}/axes_mm"), format!("it has {}", axes.len()), permitted));
        }
        let form = match self.kind {
            Kind::Ellipsoid | Kind::Ellipse => Form::Ball,
            Kind::Box => Form::Box,
            Kind::Cylinder => Form::Cylinder,
            Kind::Gaussian => Form::Gaussian,
            Kind::Zernike => Form::Zernike { n, m },
        };
        let axes = [axes[0], axes[1], axes.get(2).copied().unwrap_or(f64::INFINITY)];
        Ok(Shape::new(form, self.value, self.center_mm, axes, self.angle_deg))
    }
}

impl Shape {
    fn new(form: Form, value: f64, center_mm: [f64; 3], axes_mm: [f64; 3], angle_deg: f64) -> Self {
        let turned = DMat3::from_rotation_z(-angle_deg.to_radians());
        let scaled = DMat3::from_diagonal(DVec3::from(axes_mm.map(f64::recip))) * turned;
        let own_from_world = DAffine3::from_mat3(scaled) * DAffine3::from_translation(-DVec3::from(center_mm));
        Self { form, value, own_from_world }
    }

    /// An ellipsoid; an ellipse that goes on for ever along z if its last half size is infinite.
    pub fn ellipsoid(value: f64, center_mm: [f64; 3], axes_mm: [f64; 3], angle_deg: f64) -> Self {
        Self::new(Form::Ball, value, center_mm, axes_mm, angle_deg)
    }

    /// The integral along a ray, value · mm.
    pub fn integral(&self, ray: &Ray) -> f64 {
        let o = self.own_from_world.transform_point3(ray.origin);
        let d = self.own_from_world.transform_vector3(ray.direction);
        self.value * self.form.integral(o, d)
    }

    /// The value at a point, mm. A point of the surface is inside.
    pub fn at(&self, point: DVec3) -> f64 {
        let p = self.own_from_world.transform_point3(point);
        let inside = |is: bool| if is { 1.0 } else { 0.0 };
        self.value
            * match self.form {
                Form::Ball => inside(p.length_squared() <= 1.0),
                Form::Box => inside(p.abs().max_element() <= 1.0),
                Form::Cylinder => inside(p.truncate().length_squared() <= 1.0 && p.z.abs() <= 1.0),
                Form::Gaussian => (-0.5 * p.length_squared()).exp(),
                Form::Zernike { n, m } => zernike(n, m, p),
            }
    }
}

impl Form {
    /// The integral of the form, of half sizes of 1, along o + t d over all t.
    fn integral(self, o: DVec3, d: DVec3) -> f64 {
        match self {
            Self::Ball => length(quadric(o, d)),
            Self::Box => length(slabs(o, d)),
            Self::Cylinder => {
                // The ends are those of a box.
                let ends = slabs(o * DVec3::Z, d * DVec3::Z);
                length(meet(quadric(o.with_z(0.0), d.with_z(0.0)), ends))
            }
            Self::Gaussian => {
                // ∫ exp(−½ |o + t d|²) dt = √(2π / a) exp(−½ (c − b² / a)), with a = d·d, b = o·d, c = o·o.
                let (a, b, c) = (d.length_squared(), o.dot(d), o.length_squared());
                if a > 0.0 {
                    (std::f64::consts::TAU / a).sqrt() * (-0.5 * (c - b * b / a)).exp()
                } else {
                    f64::INFINITY
                }
            }
            Self::Zernike { n, m } => {
                // The ray's part in the plane: s = x cosθ + y sinθ, with (−sinθ, cosθ) along the ray.
                let (o, d) = (o.truncate(), d.truncate());
                let speed = d.length();
                let along = d / speed;
                let normal = glam::DVec2::new(along.y, -along.x);
                let s = o.dot(normal);
                if s.abs() >= 1.0 || speed == 0.0 {
                    return 0.0;
                }
                // Deans, "The Radon Transform and Some of Its Applications", 1983: 2 / (n + 1) √(1 − s²) U_n(s) cos mθ, U_n(cos t) = sin((n + 1) t) / sin t.
                let t = s.acos();
                let theta = normal.y.atan2(normal.x);
                2.0 / f64::from(n + 1) * (f64::from(n + 1) * t).sin() * (f64::from(m) * theta).cos() / speed
            }
        }
    }
}

/// R_n^m(r) cos mφ on the unit disc, else 0. R = Σ_k (−1)^k (n − k)! / (k! ((n + m)/2 − k)! ((n − m)/2 − k)!) r^(n − 2k).
fn zernike(n: u32, m: u32, p: DVec3) -> f64 {
    let r = p.truncate().length();
    if r > 1.0 {
        return 0.0;
    }
    let factorial = |k: u32| (1..=k).map(f64::from).product::<f64>();
    let term = |k: u32| {
        let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let below = factorial(k) * factorial(n.midpoint(m) - k) * factorial((n - m) / 2 - k);
        sign * factorial(n - k) / below * r.powi((n - 2 * k) as i32)
    };
    (0..=(n - m) / 2).map(term).sum::<f64>() * (f64::from(m) * p.y.atan2(p.x)).cos()
}

/// The part of a ray, by its parameter, that is inside of the unit ball. If the ray does not move in it, that is all or nothing.
fn quadric(o: DVec3, d: DVec3) -> [f64; 2] {
    let (a, b, c) = (d.length_squared(), o.dot(d), o.length_squared() - 1.0);
    let root = b * b - a * c;
    if a == 0.0 {
        return if c <= 0.0 { [f64::NEG_INFINITY, f64::INFINITY] } else { [0.0; 2] };
    }
    if root <= 0.0 { [0.0; 2] } else { [(-b - root.sqrt()) / a, (-b + root.sqrt()) / a] }
}

/// The part of a ray that is inside of the box [−1, 1]³.
fn slabs(o: DVec3, d: DVec3) -> [f64; 2] {
    let side = |i: usize| match (o[i], d[i]) {
        (o, 0.0) if o.abs() <= 1.0 => [f64::NEG_INFINITY, f64::INFINITY],
        (_, 0.0) => [0.0; 2],
        (o, d) => [((-1.0 - o) / d).min((1.0 - o) / d), ((-1.0 - o) / d).max((1.0 - o) / d)],
    };
    (0..3).map(side).fold([f64::NEG_INFINITY, f64::INFINITY], meet)
}

fn meet([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    [a.max(c), b.min(d)]
}

fn length([from, to]: [f64; 2]) -> f64 {
    (to - from).max(0.0)
}
