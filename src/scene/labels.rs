//! The looks of label volumes: a colour and an opacity for a whole number.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::presets::hue;
use super::transfer_request::Label;
use crate::error::{Error, Result};

/// Linear colour and opacity per world unit.
pub type Look = ([f64; 3], f64);

/// The looks of whole numbers. Others are empty, as is 0 if it is not listed.
#[derive(Debug, Clone, PartialEq)]
pub enum Labels {
    /// A colour of its own for each number from 1, and this opacity per world unit.
    Each(f64),
    /// The looks of these numbers.
    Listed(BTreeMap<u32, Look>),
    /// The looks of these numbers by their places in the list.
    Indexed(Box<Self>, Arc<[f64]>),
}

impl Labels {
    /// The labels of a request; `at` is their JSON pointer.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the label that is given twice.
    pub fn from_request(labels: &[Label], at: &str) -> Result<Self> {
        let mut looks = BTreeMap::new();
        for (i, label) in labels.iter().enumerate() {
            let color = label.color.unwrap_or_else(|| color(label.label));
            if looks.insert(label.label, (color, label.opacity_per_unit)).is_some() {
                return Err(Error::invalid(format!("{at}/{i}/label"), "given twice", "each label once"));
            }
        }
        Ok(Self::Listed(looks))
    }

    /// The look of a value.
    pub fn look(&self, value: f64) -> Look {
        let label = value.round().max(0.0) as u32;
        match self {
            Self::Each(_) if label == 0 => Look::default(),
            Self::Each(opacity_per_unit) => (color(label), *opacity_per_unit),
            Self::Listed(looks) => looks.get(&label).copied().unwrap_or_default(),
            Self::Indexed(looks, values) => {
                values.get(label as usize).map_or(Look::default(), |value| looks.look(*value))
            }
        }
    }
}

/// The default colour of a label. The hues are a golden section of the colour circle apart, so that neighbours differ.
fn color(label: u32) -> [f64; 3] {
    let pure = hue((f64::from(label) * 0.618_033_988_749_895).fract());
    pure.map(|c| 0.08 + 0.82 * c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_label_has_a_look_of_its_own_however_large_it_is() {
        let each = Labels::Each(2.0);
        assert_eq!([each.look(0.0), each.look(-3.0)], [Look::default(); 2]);
        let far = [1.0, 4095.0, 4096.0, 312_782_592.0, 4_294_967_295.0].map(|value| each.look(value));
        for (i, a) in far.iter().enumerate() {
            assert_eq!(a.1, 2.0);
            assert!(far[..i].iter().all(|b| b.0 != a.0), "{far:?}");
        }
        let indexed = Labels::Indexed(Box::new(each.clone()), Arc::from([0.0, 997.0, 312_782_592.0]));
        assert_eq!(
            [0.0, 1.0, 2.0, 3.0].map(|i| indexed.look(i)),
            [0.0, 997.0, 312_782_592.0, 0.0].map(|v| each.look(v))
        );
    }

    #[test]
    fn a_label_given_twice_is_named() {
        let label = |label| Label { label, color: None, opacity_per_unit: 1.0 };
        let wrong = Labels::from_request(&[label(7), label(70_000), label(7)], "/l");
        assert!(matches!(wrong, Err(Error::Invalid(v)) if v[0].pointer == "/l/2/label"));
    }
}
