//! The transfer function's table as a few polynomials. Most functions are smooth except for some kinks.
//!
//! The values of 16 lanes in eight steps usually differ little, so that they lie on one piece or two. Then a cubic for the opacity and a line for
//! each colour, with coefficients that all lanes share, replace 128 look-ups in the table. A function that needs more than [`PIECES`] has no pieces
//! and is looked up. The choice depends on the function alone, and the piece on the value alone, so that a picture does not depend on the set of
//! samples that share a register.

use crate::scene::transfer::TABLE_SIZE;

/// The most pieces: the lanes of a register. `PIECES` of the kernel.
pub const PIECES: usize = 16;
/// The permitted relative error of an opacity. A picture has no greater error.
const OPACITY_SLACK: f32 = 1.0 / 2048.0;
/// The permitted absolute error of an opacity besides: the lesser of the first number, and of the second times the greatest opacity.
const LEAST_SLACK: [f32; 2] = [1.0 / 262_144.0, 1.0 / 16_384.0];
/// The permitted error of a colour: an eighth of a level of 255.
const COLOUR_SLACK: f32 = 1.0 / 2048.0;

#[derive(Clone, Copy)]
struct Entry {
    color: [f32; 3],
    opacity: f32,
}

/// Polynomials in the entry's index relative to the first entry, the constant first.
#[derive(Clone, Copy, Default)]
struct Piece {
    first: usize,
    /// The last entry of the empty part; before the first entry if there is none.
    empty: f32,
    opacity: [f32; 4],
    color: [[f32; 2]; 3],
}

impl Piece {
    /// A piece through the values at the Chebyshev points of `first..=last`. It is close to the best polynomial.
    fn through(entries: &[Entry], first: usize, last: usize) -> Self {
        let half = (last - first) as f64 / 2.0;
        let place =
            |i: usize, of: usize| half - half * (std::f64::consts::PI * (2 * i + 1) as f64 / (2 * of) as f64).cos();
        let value = |x: f64, part: &dyn Fn(&Entry) -> f32| {
            let i = (x as usize).min(last - first - 1);
            let [a, b] = [i, i + 1].map(|i| f64::from(part(&entries[first + i])));
            a + (b - a) * (x - i as f64)
        };
        let opacity = |i| [place(i, 4), value(place(i, 4), &|e| e.opacity)];
        let channel = |c: usize| {
            let [base, slope] = polynomial(std::array::from_fn(|i| [place(i, 2), value(place(i, 2), &|e| e.color[c])]));
            // The line must not be below black at either end.
            [base - base.min(base + slope * (last - first) as f32).min(0.0), slope]
        };
        let mut piece = Self {
            first,
            empty: first as f32 - 1.0,
            opacity: polynomial(std::array::from_fn(opacity)),
            color: [channel(0), channel(1), channel(2)],
        };
        if entries[first].opacity == 0.0 {
            (piece.empty, piece.opacity[0]) = (first as f32, 0.0);
        }
        piece
    }

    /// True if every entry of `first..=last` is within its permitted error; `least` is the permitted absolute error of an opacity.
    fn holds(&self, entries: &[Entry], last: usize, least: f32) -> bool {
        (self.first..=last).all(|i| {
            let (Entry { color, opacity }, x) = (entries[i], (i - self.first) as f32);
            let [c0, c1, c2, c3] = self.opacity;
            let off = (((c3 * x + c2) * x + c1) * x + c0 - opacity).abs();
            let close = |c: usize| (self.color[c][1] * x + self.color[c][0] - color[c]).abs() <= COLOUR_SLACK;
            off <= opacity * OPACITY_SLACK + least && (opacity == 0.0 || (0..3).all(close))
        })
    }

    /// The longest piece that starts at `first`, and its last entry. Entries without opacity are a piece of their own.
    fn longest(entries: &[Entry], first: usize, least: f32) -> (Self, usize) {
        let end = entries.len() - 1;
        let empty = entries[first..].iter().take_while(|e| e.opacity == 0.0).count();
        if empty > 1 {
            let last = first + empty - 1;
            return (Self { first, empty: last as f32, ..Self::default() }, last);
        }
        let fits = |last: usize| Some(Self::through(entries, first, last)).filter(|p| p.holds(entries, last, least));
        // A line fits two entries exactly.
        let (mut best, mut good) = (Self::through(entries, first, first + 1), first + 1);
        let (mut bad, mut length) = (end + 1, 2);
        while good < end && bad - good > 1 {
            let last = (first + length).min(end).min(if bad > end { end } else { (good + bad) / 2 });
            match fits(last) {
                Some(piece) => (best, good) = (piece, last),
                None => bad = last,
            }
            length *= 2;
        }
        (best, good)
    }
}

/// The coefficients, the constant first, of the polynomial through `points` of place and value (Newton's divided differences).
fn polynomial<const N: usize>(points: [[f64; 2]; N]) -> [f32; N] {
    let mut divided = points.map(|p| p[1]);
    for order in 1..N {
        for i in (order..N).rev() {
            divided[i] = (divided[i] - divided[i - 1]) / (points[i][0] - points[i - order][0]);
        }
    }
    let mut sum = [0.0; N];
    for i in (0..N).rev() {
        for power in (0..N).rev() {
            let lower = if power > 0 { sum[power - 1] } else { divided[i] };
            sum[power] = lower - points[i][0] * sum[power];
        }
    }
    sum.map(|c| c as f32)
}

/// The words that follow the table, in columns of [`PIECES`]: the starts of the pieces, the ends of their empty parts, and their coefficients. Unused
/// pieces start past the table. If the function needs too many pieces, all are unused.
pub fn pieces(colours: &[([f64; 3], f64)]) -> Vec<u32> {
    let narrow = |v: f64| v.clamp(0.0, 1.0) as f32;
    let entry = |&(color, opacity): &([f64; 3], f64)| Entry { color: color.map(narrow), opacity: narrow(opacity) };
    let entries: Vec<Entry> = colours.iter().map(entry).collect();
    let greatest = entries.iter().map(|e| e.opacity).fold(0.0, f32::max);
    let least = LEAST_SLACK[0].min(LEAST_SLACK[1] * greatest);
    let (mut found, mut from) = (Vec::new(), 0);
    while from < entries.len() - 1 && found.len() <= PIECES {
        let (piece, last) = Piece::longest(&entries, from, least);
        found.push(piece);
        from = last;
    }
    if found.len() > PIECES {
        found.clear();
    }
    let column = |part: &dyn Fn(&Piece) -> f32, none: f32| -> Vec<u32> {
        (0..PIECES).map(|i| found.get(i).map_or(none, part).to_bits()).collect()
    };
    let beyond = TABLE_SIZE as f32;
    let mut words = column(&|p| p.first as f32, beyond);
    words.extend(column(&|p| p.empty, beyond));
    words.extend((0..4).flat_map(|i| column(&|p| p.opacity[i], 0.0)));
    words.extend((0..6).flat_map(|i| column(&|p| p.color[i / 2][i % 2], 0.0)));
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The entries of an opacity and a grey as functions of a place from 0 to 1.
    fn entries(of: impl Fn(f64) -> (f64, f64)) -> Vec<([f64; 3], f64)> {
        let entry = |i: usize| of(i as f64 / (TABLE_SIZE - 1) as f64);
        (0..TABLE_SIZE).map(entry).map(|(opacity, grey)| ([grey; 3], opacity)).collect()
    }

    /// The opacity and red that the device computes at an entry's index.
    fn seen(words: &[u32], x: f32) -> (f32, f32) {
        let column = |c: usize, i: usize| f32::from_bits(words[c * PIECES + i]);
        let i = (0..PIECES).rfind(|&i| x >= column(0, i)).expect("a piece");
        let t = x - column(0, i);
        let opacity = (2..6).rfold(0.0, |sum, c| sum * t + column(c, i));
        (opacity, column(7, i) * t + column(6, i))
    }

    fn count(words: &[u32]) -> usize {
        (0..PIECES).filter(|&i| f32::from_bits(words[i]) < TABLE_SIZE as f32).count()
    }

    #[test]
    fn pieces_are_the_function_at_every_entry() {
        let ramp = |x: f64| (1.0 - (-0.9 * x).exp(), 0.2 + 0.5 * x);
        let kinks = |x: f64| (if x < 0.31 { 0.0 } else { 0.4 * (x - 0.31) }, (x - 0.5).abs());
        let opaque = |x: f64| (1.0 - (-80.0 * (x - 0.7).max(0.0)).exp(), 1.0 - x);
        let fog = |x: f64| (1e-6 * x, 1.0);
        for (what, of, most) in [
            ("ramp", &ramp as &dyn Fn(f64) -> (f64, f64), 2),
            ("kinks", &kinks, 5),
            ("opaque", &opaque, 12),
            ("fog", &fog, 1),
        ] {
            let entries = entries(of);
            let words = pieces(&entries);
            assert!((1..=most).contains(&count(&words)), "{what}: {} pieces", count(&words));
            let greatest = entries.iter().map(|e| e.1).fold(0.0, f64::max);
            for (i, (color, opacity)) in entries.iter().enumerate() {
                let (alpha, red) = seen(&words, i as f32);
                let off = (f64::from(alpha) - opacity).abs();
                assert!(
                    off <= opacity / 2000.0 + (greatest / 16_000.0).min(4e-6),
                    "{what}: {alpha} for {opacity} at {i}"
                );
                assert!(
                    *opacity == 0.0 || (f64::from(red) - color[0]).abs() < 6e-4,
                    "{what}: {red} for {} at {i}",
                    color[0]
                );
                assert!(red >= 0.0, "{what}: {red} at {i}");
            }
        }
    }

    #[test]
    fn what_has_no_opacity_has_none_to_the_last_bit() {
        let words = pieces(&entries(|x| {
            (if (0.25..0.75).contains(&x) { 0.0 } else { (x - 0.25).abs().min((x - 0.75).abs()) }, 0.5)
        }));
        for i in (0..TABLE_SIZE).filter(|i| (0.25..0.75).contains(&(*i as f64 / (TABLE_SIZE - 1) as f64))) {
            assert_eq!(seen(&words, i as f32).0, 0.0, "at {i}");
        }
    }

    #[test]
    fn what_takes_too_many_pieces_has_none() {
        let comb = entries(|x| (0.5 + 0.5 * (200.0 * x).sin(), 0.5));
        assert_eq!(count(&pieces(&comb)), 0);
    }
}
