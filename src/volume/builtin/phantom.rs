//! The Shepp–Logan head phantom in three dimensions.
//!
//! "Shepp–Logan" means several things. This one has the geometry of Kak & Slaney, *Principles of Computerized
//! Tomographic Imaging* (1988), table 3.1, p. 102, with the grey levels of Yu, Ye & Wang, "Katsevich-type algorithms
//! for variable radius spiral cone-beam CT" (Proc. SPIE 5535, 2004): Toft's modification (1, −0.8, −0.2, …) carried
//! over to this table, ten times the small contrasts of the original (2, −0.98, −0.02, …) with their signs kept.

/// An ellipsoid of the phantom; where several overlap, their greys add.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipsoid {
    /// The grey that it adds to the points within.
    pub grey: f64,
    /// The semi-axes along its own x, y, z.
    pub semi_axes: [f64; 3],
    /// The centre.
    pub centre: [f64; 3],
    /// The rotation about z in degrees, from the world's x axis to its own.
    pub angle_deg: f64,
}

const fn ellipsoid(grey: f64, semi_axes: [f64; 3], centre: [f64; 3], angle_deg: f64) -> Ellipsoid {
    Ellipsoid { grey, semi_axes, centre, angle_deg }
}

/// Kak & Slaney's table with the modified greys.
pub const ELLIPSOIDS: [Ellipsoid; 10] = [
    ellipsoid(1.0, [0.69, 0.92, 0.9], [0.0, 0.0, 0.0], 0.0),
    ellipsoid(-0.8, [0.6624, 0.874, 0.88], [0.0, 0.0, 0.0], 0.0),
    ellipsoid(-0.2, [0.41, 0.16, 0.21], [-0.22, 0.0, -0.25], 108.0),
    ellipsoid(-0.2, [0.31, 0.11, 0.22], [0.22, 0.0, -0.25], 72.0),
    ellipsoid(0.2, [0.21, 0.25, 0.5], [0.0, 0.35, -0.25], 0.0),
    ellipsoid(0.2, [0.046, 0.046, 0.046], [0.0, 0.1, -0.25], 0.0),
    ellipsoid(0.1, [0.046, 0.023, 0.02], [-0.08, -0.65, -0.25], 0.0),
    ellipsoid(0.1, [0.046, 0.023, 0.02], [0.06, -0.65, -0.25], 90.0),
    ellipsoid(0.2, [0.056, 0.04, 0.1], [0.06, -0.105, 0.625], 90.0),
    ellipsoid(-0.2, [0.056, 0.056, 0.1], [0.0, 0.1, 0.625], 0.0),
];

impl Ellipsoid {
    /// True if the point is inside or on the surface.
    pub fn contains(&self, x: f64, y: f64, z: f64) -> bool {
        let [x, y, z] = [x - self.centre[0], y - self.centre[1], z - self.centre[2]];
        // Most points are outside of most ellipsoids, and a test of the sphere around one is cheaper than sine and cosine.
        let reach = self.semi_axes[0].max(self.semi_axes[1]).max(self.semi_axes[2]);
        if x * x + y * y + z * z > reach * reach {
            return false;
        }
        let (sin, cos) = self.angle_deg.to_radians().sin_cos();
        let own = [x * cos + y * sin, y * cos - x * sin, z];
        own.iter().zip(self.semi_axes).map(|(along, semi_axis)| (along / semi_axis).powi(2)).sum::<f64>() <= 1.0
    }
}

/// The phantom at a point of [−1, 1]³: 0 outside of the head, 1 in the skull, about 0.2 within.
pub fn shepp_logan_value(x: f64, y: f64, z: f64) -> f64 {
    let sum: f64 = ELLIPSOIDS.iter().filter(|part| part.contains(x, y, z)).map(|part| part.grey).sum();
    // 1 − 0.8 − 0.2 leaves a rounding error of −5e-17, which would make the ventricles negative.
    sum.max(0.0)
}
