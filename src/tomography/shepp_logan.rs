//! The Shepp–Logan head by its tables.
//!
//! Two dimensions: the geometry of Shepp & Logan, "The Fourier Reconstruction of a Head Section" (IEEE Trans. Nucl. Sci. 21, 1974), as in Toft's thesis, "The
//! Radon Transform: Theory and Implementation" (1996), with the ellipse IX at y = −0.605 or −0.606: this is −0.605. Three dimensions: Kak & Slaney's table
//! (`src/volume/builtin/phantom.rs`). Modified greys have ten times the small contrasts.

use super::Shape;
use crate::volume::builtin::phantom::ELLIPSOIDS;

/// Modified grey, half sizes, centre, turn in degrees.
const ELLIPSES: [(f64, [f64; 2], [f64; 2], f64); 10] = [
    (1.0, [0.69, 0.92], [0.0, 0.0], 0.0),
    (-0.8, [0.6624, 0.874], [0.0, -0.0184], 0.0),
    (-0.2, [0.11, 0.31], [0.22, 0.0], -18.0),
    (-0.2, [0.16, 0.41], [-0.22, 0.0], 18.0),
    (0.1, [0.21, 0.25], [0.0, 0.35], 0.0),
    (0.1, [0.046, 0.046], [0.0, 0.1], 0.0),
    (0.1, [0.046, 0.046], [0.0, -0.1], 0.0),
    (0.1, [0.046, 0.023], [-0.08, -0.605], 0.0),
    (0.1, [0.023, 0.023], [0.0, -0.605], 0.0),
    (0.1, [0.023, 0.046], [0.06, -0.605], 0.0),
];

/// The original grey of a modified one: skull 2 and brain −0.98, and a tenth of the small contrasts.
fn original(modified: f64) -> f64 {
    match modified {
        1.0 => 2.0,
        -0.8 => -0.98,
        small => 0.1 * small,
    }
}

/// The phantom's shapes, for a head of this radius, mm.
pub(super) fn shapes(dimensions: u32, is_original: bool, radius_mm: f64) -> Vec<Shape> {
    let grey = |modified: f64| if is_original { original(modified) } else { modified };
    let scaled = |of: [f64; 3]| of.map(|v| radius_mm * v);
    if dimensions == 2 {
        let shape = |&(value, [a, b], [x, y], angle): &(f64, [f64; 2], [f64; 2], f64)| {
            Shape::ellipsoid(grey(value), scaled([x, y, 0.0]), scaled([a, b, f64::INFINITY]), angle)
        };
        return ELLIPSES.iter().map(shape).collect();
    }
    let shape = |e: &crate::volume::builtin::phantom::Ellipsoid| {
        Shape::ellipsoid(grey(e.grey), scaled(e.centre), scaled(e.semi_axes), e.angle_deg)
    };
    ELLIPSOIDS.iter().map(shape).collect()
}
