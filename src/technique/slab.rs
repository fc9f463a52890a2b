//! A slab that scatters isotropically, of one optical depth and without sides: Chandrasekhar's problem, by integral equation. The part of the
//! reflected light that was scattered more than n times tells if a technique that stops after n scatterings is enough.

/// The most terms of Neumann's series.
const MOST_TERMS: u32 = 10_000;
/// [`missing`]'s number of cells, its relative change at the end, and the optical depth that stands for deeper slabs.
const COARSE_CELLS: usize = 64;
const COARSE_CHANGE: f64 = 1e-5;
const DEEPEST: f64 = 12.0;
/// The depth below which [`missing`] is 0: the missing part does not matter there, and differences of E₃ lose their digits.
const THINNEST: f64 = 1e-6;

/// The exponential integral E₂(x) = ∫₁^∞ e^(−xt)/t² dt, x ≥ 0: Gauss-Legendre over u = 1/t of e^(−x/u), in pieces towards 0.
fn e2(x: f64) -> f64 {
    let (points, mut sum, mut high) = ([-0.774_596_669_241_483_4, 0.0, 0.774_596_669_241_483_4], 0.0, 1.0);
    let weights = [5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0];
    for _ in 0..200 {
        let low = 0.8 * high;
        for (point, weight) in points.iter().zip(weights) {
            let u = 0.5 * (low + high) + 0.5 * (high - low) * point;
            sum += 0.5 * (high - low) * weight * (-x / u).exp();
        }
        high = low;
    }
    sum
}

/// E₃(x) = (e^(−x) − x E₂(x)) / 2.
fn e3(x: f64) -> f64 {
    0.5 * ((-x).exp() - x * e2(x))
}

/// The reflection of a slab under a beam of irradiance 1 at right angles.
#[derive(Debug, Clone, Copy)]
pub struct Reflected {
    /// The part of the irradiance, over all directions.
    pub reflectance: f64,
    /// Radiance back along the beam, per irradiance.
    pub radiance: f64,
}

/// The reflection of a slab of optical depth `depth` and albedo ω by light that was scattered at most `scatterings` times.
///
/// Solves S(τ) = ω/4π e^(−τ) + ω/2 ∫ S(t) E₁(|τ − t|) dt in `cells` cells, where ∫ E₁ over a cell is a difference of E₂, by Neumann's
/// series (a term is a scattering); then R = 2π ∫ S E₂ dτ and L = ∫ S e^(−τ) dτ.
pub fn reflected(depth: f64, albedo: f64, scatterings: Option<u32>, cells: usize) -> Reflected {
    solve(depth, albedo, scatterings, cells, 1e-9)
}

/// The same with the relative change at which the series ends.
fn solve(depth: f64, albedo: f64, scatterings: Option<u32>, cells: usize, change_at_end: f64) -> Reflected {
    let h = depth / cells as f64;
    let thirds: Vec<f64> = (0..=cells).map(|i| e3(i as f64 * h)).collect();
    // The mean over a cell of the integral of E₁ over the cell that is k away.
    let kernel: Vec<f64> = (0..cells)
        .map(|k| match k {
            0 => 2.0 * (h - (thirds[0] - thirds[1])) / h,
            _ => (thirds[k - 1] - 2.0 * thirds[k] + thirds[k + 1]) / h,
        })
        .collect();
    let beam = |i: usize| (-(i as f64) * h).exp() * -(-h).exp_m1() / h;
    let first: Vec<f64> = (0..cells).map(|i| albedo / (4.0 * std::f64::consts::PI) * beam(i)).collect();
    let mut source = first.clone();
    for _ in 1..scatterings.unwrap_or(MOST_TERMS).min(MOST_TERMS) {
        let lit = |i: usize| source.iter().enumerate().map(|(j, s)| s * kernel[i.abs_diff(j)]).sum::<f64>();
        let next: Vec<f64> = (0..cells).map(|i| first[i] + 0.5 * albedo * lit(i)).collect();
        let change = next.iter().zip(&source).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        source = next;
        if change < change_at_end * source[0] {
            break;
        }
    }
    let cells = || source.iter().enumerate();
    Reflected {
        // ∫ E₂ over cell i is E₃(i h) − E₃((i + 1) h).
        reflectance: std::f64::consts::TAU * cells().map(|(i, s)| s * (thirds[i] - thirds[i + 1])).sum::<f64>(),
        radiance: cells().map(|(i, s)| s * beam(i) * h).sum(),
    }
}

/// The part of a slab's reflectance that was scattered more than `scatterings` times, to within a few thousandths.
pub fn missing(depth: f64, albedo: f64, scatterings: u32) -> f64 {
    if depth < THINNEST || albedo <= 0.0 {
        return 0.0;
    }
    // Deeper slabs hardly differ, since reflected light does not come from so deep.
    let depth = depth.min(DEEPEST);
    let of = |scatterings| solve(depth, albedo.min(1.0), scatterings, COARSE_CELLS, COARSE_CHANGE).reflectance;
    (1.0 - of(Some(scatterings)) / of(None)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_scattering_is_wrong_by_what_the_table_says() {
        // The table of discrete ordinates in VALIDATION.md, in percent.
        for (albedo, depth, percent, within) in [
            (0.1, 0.1, -1.6, 0.06),
            (0.1, 1.0, -5.6, 0.06),
            (0.5, 0.01, -1.4, 0.06),
            (0.5, 0.1, -8.1, 0.06),
            (0.5, 1.0, -28.0, 0.6),
            (0.9, 0.01, -2.5, 0.06),
            (0.9, 0.1, -14.6, 0.06),
            (0.9, 1.0, -52.0, 0.6),
            (1.0, 0.01, -2.8, 0.06),
            (1.0, 0.1, -16.0, 0.6),
            (1.0, 1.0, -58.0, 0.6),
        ] {
            let of = |scatterings| reflected(depth, albedo, scatterings, 400).reflectance;
            let error = 100.0 * (of(Some(1)) / of(None) - 1.0);
            assert!((error - percent).abs() <= within, "albedo {albedo}, depth {depth}: {error} for {percent}");
            assert!((100.0 * missing(depth, albedo, 1) + percent).abs() < within + 0.3, "coarsely");
        }
    }

    #[test]
    fn a_deep_slab_is_chandrasekhars_half_space() {
        for (albedo, truth) in [(0.5, 0.115_226), (0.8, 0.285_255), (0.9, 0.414_947)] {
            let found = reflected(20.0, albedo, None, 400).reflectance;
            assert!((found / truth - 1.0).abs() < 1e-3, "albedo {albedo}: {found} for {truth}");
        }
        let single = reflected(20.0, 0.9, Some(1), 400).reflectance;
        assert!((single / 0.138_084 - 1.0).abs() < 1e-3, "P14: {single}");
    }
}
