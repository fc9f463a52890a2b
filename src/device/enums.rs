//! Choices are numbered once: [`device_enum!`](crate::device_enum) makes the Rust enum, and the `#define`s by which kernels name its variants. Each
//! enum has a prefix of its own, so that a name has one meaning in all kernels.

use std::fmt::Debug;

/// An enum whose variants kernels know by name.
pub trait DeviceEnum: Copy + Debug + 'static {
    /// The prefix of its variants' names in OpenCL C.
    const PREFIX: &'static str;
    /// The variants in order.
    const ALL: &'static [Self];
    /// The number of variants.
    const LENGTH: usize = Self::ALL.len();

    /// The number of a variant.
    fn number(self) -> i32;

    /// A `#define` for each variant, such as `#define TRACKING_EXACT 0`, and one for the number of variants, such as `TRACKING_LENGTH`.
    fn opencl_text() -> String {
        let line = |name: &str, number: i32| format!("#define {}_{name} {number}\n", Self::PREFIX);
        let variants = Self::ALL.iter().map(|v| line(&upper_snake(&format!("{v:?}")), v.number()));
        variants.chain([line("LENGTH", Self::LENGTH as i32)]).collect()
    }
}

/// `BSpline` as `B_SPLINE`: a word begins at a capital after a small letter, and at a capital before a small letter.
fn upper_snake(name: &str) -> String {
    let letters: Vec<char> = name.chars().collect();
    let begins = |i: usize| {
        let small = |k: usize| letters.get(k).is_some_and(char::is_ascii_lowercase);
        i > 0 && letters[i].is_ascii_uppercase() && (small(i - 1) || small(i + 1))
    };
    let word = |i: usize| [begins(i).then_some('_'), Some(letters[i].to_ascii_uppercase())];
    (0..letters.len()).flat_map(word).flatten().collect()
}

/// Declares an enum for host and device: `device_enum! { /// words pub enum Name: "PREFIX" { /// words First, … } }`.
#[macro_export]
macro_rules! device_enum {
    ($(#[$meta:meta])* pub enum $name:ident: $prefix:literal { $($(#[$variant_meta:meta])* $variant:ident,)* }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[repr(i32)]
        pub enum $name { $($(#[$variant_meta])* $variant,)* }

        impl $name {
            /// Its number on the device.
            pub const fn code(self) -> i32 {
                self as i32
            }
        }

        impl $crate::device::enums::DeviceEnum for $name {
            const PREFIX: &'static str = $prefix;
            const ALL: &'static [Self] = &[$(Self::$variant),*];
            fn number(self) -> i32 {
                self.code()
            }
        }
    };
}

device_enum! {
    /// Words of the buffer in which view kernels count events that a reply must report.
    pub enum Count: "COUNT" {
        /// Samples that are not finite.
        NonFinite,
        /// Samples that bring more light than all samples of their pixel before.
        Fireflies,
        /// Samples that were brighter than `clamp_luminance`.
        Clamped,
        /// Collisions at which the majorant was below the extinction.
        Broken,
        /// Luminance that clamping removed, in units of 2⁻¹⁶ of `clamp_luminance`: the low word of a 64-bit sum, so its number is even.
        ClampedEnergyLow,
        /// The high word of that sum.
        ClampedEnergyHigh,
        /// Paths that were cut after the most collisions.
        Cut,
    }
}

device_enum! {
    /// Kinds of phase function (`kernels/shared/phase.h`).
    pub enum PhaseKind: "PHASE" {
        /// One or two Henyey-Greenstein lobes; isotropic is a lobe of mean cosine 0.
        Lobes,
        /// Rayleigh's.
        Rayleigh,
        /// Tabulated over the cosine.
        Table,
    }
}

device_enum! {
    /// Kinds of light besides the sky (`kernels/shared/light.h`).
    pub enum LightKind: "LIGHT" {
        /// Parallel, or from a disk in the sky.
        Sun,
        /// A point.
        Point,
        /// A sphere.
        Sphere,
        /// A parallelogram.
        Quad,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_the_variants_in_capitals() {
        for (name, upper) in [
            ("Exact", "EXACT"),
            ("BSpline", "B_SPLINE"),
            ("ExitMinusX", "EXIT_MINUS_X"),
            ("U8", "U8"),
            ("NonFinite", "NON_FINITE"),
        ] {
            assert_eq!(upper_snake(name), upper);
        }
    }

    #[test]
    fn variants_are_numbered_in_order_and_counted() {
        let text = "#define PHASE_LOBES 0\n#define PHASE_RAYLEIGH 1\n#define PHASE_TABLE 2\n#define PHASE_LENGTH 3\n";
        assert_eq!((PhaseKind::opencl_text().as_str(), PhaseKind::LENGTH), (text, 3));
        assert_eq!(Count::ClampedEnergyLow.code() % 2, 0, "a 64-bit word begins there");
    }
}
