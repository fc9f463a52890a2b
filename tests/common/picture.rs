//! A picture as a film and as a PNG file, and the bound on the difference of pictures of other numbers of lanes.

use std::fmt;

use exr::prelude::{ReadChannels, ReadLayers};

/// A picture as a film of linear floats and as bytes.
#[derive(Clone)]
pub struct Picture {
    pub size: [usize; 2],
    /// The red, green, blue and alpha of each pixel.
    pub values: Vec<[f32; 4]>,
    pub bytes: Vec<u8>,
}

/// The difference of two pictures: the greatest difference of a value, of a byte, and of the means of a channel.
#[derive(Debug)]
pub struct Difference {
    pub value: f32,
    pub byte: u8,
    pub mean: f64,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "values differ by up to {:.2e}, bytes by {}, the mean by {:.1e}", self.value, self.byte, self.mean)
    }
}

impl Picture {
    /// Reads an EXR and a PNG file.
    pub fn read(exr: &[u8], png: &[u8]) -> Self {
        let read = exr::prelude::read().no_deep_data().largest_resolution_level();
        let read = read.rgba_channels(
            |size, _| (size.width(), vec![[0.0; 4]; size.area()]),
            |(width, pixels), at, (r, g, b, a): (f32, f32, f32, f32)| pixels[at.y() * *width + at.x()] = [r, g, b, a],
        );
        let image = read.first_valid_layer().all_attributes().from_buffered(std::io::Cursor::new(exr)).unwrap();
        let size = [image.layer_data.size.width(), image.layer_data.size.height()];
        let bytes = image::load_from_memory(png).unwrap().to_rgba8().into_raw();
        Self { size, values: image.layer_data.channel_data.pixels.1, bytes }
    }

    /// True if two of its pixels differ.
    pub fn shows_something(&self) -> bool {
        self.bytes.chunks(4).any(|pixel| pixel != &self.bytes[..4])
    }

    /// The difference from the `reference`.
    ///
    /// # Errors
    /// The reason that makes them other pictures altogether: a size, or a value that is a number in one of them only.
    pub fn difference(&self, reference: &Self) -> Result<Difference, String> {
        let [ours, theirs] = [self, reference].map(|p| (p.size, p.values.len(), p.bytes.len()));
        if ours != theirs {
            return Err(format!("a size of {ours:?} for {theirs:?}"));
        }
        let pairs = || self.values.as_flattened().iter().zip(reference.values.as_flattened());
        if pairs().any(|(a, b)| a.is_finite() != b.is_finite()) {
            return Err("values that are no numbers".into());
        }
        let mean = |p: &Self, c: usize| p.values.iter().map(|v| f64::from(v[c])).sum::<f64>() / p.values.len() as f64;
        Ok(Difference {
            value: pairs().map(|(a, b)| (a - b).abs()).fold(0.0, f32::max),
            byte: self.bytes.iter().zip(&reference.bytes).map(|(a, b)| a.abs_diff(*b)).max().unwrap(),
            mean: (0..4).map(|c| (mean(self, c) - mean(reference, c)).abs()).fold(0.0, f64::max),
        })
    }

    /// The difference from the `reference` in words, if it is another picture.
    pub fn other_than(&self, reference: &Self) -> Option<String> {
        match self.difference(reference) {
            Ok(d) if d.value < 1.0 / 255.0 && d.byte <= 1 && d.mean < 1e-4 => None,
            Ok(difference) => Some(difference.to_string()),
            Err(other) => Some(other),
        }
    }
}

/// A test of the comparison itself: it must see these differences.
pub fn check_comparison() {
    let picture = Picture { size: [2, 2], values: vec![[0.5; 4]; 4], bytes: vec![188; 16] };
    let changed = |change: &dyn Fn(&mut Picture)| {
        let mut other = picture.clone();
        change(&mut other);
        other.other_than(&picture).is_some()
    };
    assert!(!changed(&|_| {}) && !changed(&|p| (p.values[1][2], p.bytes[6]) = (0.5003, 189)));
    assert!(changed(&|p| p.values[3][0] = 0.505), "a pixel is brighter");
    assert!(changed(&|p| p.bytes[5] = 186), "a byte is darker");
    assert!(changed(&|p| p.values.iter_mut().for_each(|v| v[1] += 2e-4)), "all of it is greener");
    assert!(changed(&|p| p.values[0][0] = f32::NAN), "a value is no number");
    assert!(changed(&|p| p.size = [4, 1]), "it has another form");
    assert!(changed(&|p| p.values.truncate(3)), "it has fewer pixels");
}
