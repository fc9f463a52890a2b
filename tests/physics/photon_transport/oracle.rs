//! The same physics written anew: analogue photons in double precision, other random numbers, and walls that are found by marching voxels.

/// SplitMix64 (Steele, Lea, Flood, OOPSLA 2014). It has nothing in common with the kernel's generator.
pub struct Random(pub u64);

impl Random {
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64 + 1e-17
    }

    fn direction(&mut self) -> [f64; 3] {
        let (cosine, phi) = (2.0 * self.unit() - 1.0, std::f64::consts::TAU * self.unit());
        let sine = (1.0 - cosine * cosine).sqrt();
        [sine * phi.cos(), cosine, sine * phi.sin()]
    }
}

/// The outcome of one photon's weight: six faces (−x, +x, −y, …), absorbed.
pub fn photon(
    random: &mut Random,
    density: &dyn Fn([usize; 3]) -> f64,
    n: usize,
    albedo: f64,
    source: [f64; 3],
) -> [f64; 7] {
    let mut tally = [0.0; 7];
    let (mut p, mut d) = (source.map(|s| s * n as f64), random.direction());
    let mut cell = p.map(|v| v as usize);
    let mut weight = 1.0;
    let mut depth = -random.unit().ln();
    loop {
        let sigma = density(cell) / n as f64;
        let walls: Vec<f64> = (0..3).map(|a| ((cell[a] + usize::from(d[a] > 0.0)) as f64 - p[a]) / d[a]).collect();
        let axis = if walls[0] <= walls[1] && walls[0] <= walls[2] {
            0
        } else if walls[1] <= walls[2] {
            1
        } else {
            2
        };
        let reach = walls[axis].max(0.0);
        if depth < sigma * reach {
            let s = depth / sigma;
            (0..3).for_each(|a| p[a] += s * d[a]);
            tally[6] += weight * (1.0 - albedo);
            weight *= albedo;
            if weight < 1e-9 {
                return tally;
            }
            d = random.direction();
            depth = -random.unit().ln();
            continue;
        }
        depth -= sigma * reach;
        (0..3).for_each(|a| p[a] += reach * d[a]);
        let up = d[axis] > 0.0;
        let next = cell[axis] as i64 + if up { 1 } else { -1 };
        if next < 0 || next >= n as i64 {
            tally[2 * axis + usize::from(up)] += weight;
            return tally;
        }
        cell[axis] = next as usize;
        p[axis] = (cell[axis] + usize::from(!up)) as f64;
    }
}
