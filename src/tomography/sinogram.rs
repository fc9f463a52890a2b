//! Sinograms that were measured elsewhere: their readers, and what is known of them.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::meta::{Quantity, SinogramMeta};
use super::transmission::OpenBeam;
use super::{DataCheck, Geometry, GeometryRequest, Moments};
use crate::error::{Error, Result};
use crate::volume::Array;

/// The bytes of an upload, one part after the other: the data, then the flat and dark frames, of which a length of 0 is none.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
pub struct SinogramParts {
    /// What is said of them. `None` if the data's own header says it.
    pub meta: Option<SinogramMeta>,
    /// The length of the data, of the flat and of the dark frames.
    pub lengths: [usize; 3],
}

/// A sinogram: line integrals along the rays of a geometry.
#[derive(Debug, Clone, PartialEq)]
pub struct Sinogram {
    geometry: Geometry,
    /// What was said of it, with the numbers of views and bins.
    meta: SinogramMeta,
    name: String,
    format: &'static str,
    values: Vec<f32>,
    /// The photons, if it is of counts without frames.
    counts: Option<Vec<f32>>,
    notes: Vec<String>,
}

/// A sinogram in words and numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SinogramInfo {
    /// The id, which goes under `sinogram` of a reconstruction: `{"id": …}`.
    pub id: String,
    /// A name for people.
    pub name: String,
    /// `nrrd`, `npy` or `raw`.
    pub format: String,
    /// Where each bin of each view looks.
    pub geometry: Value,
    /// The number of views.
    pub views: usize,
    /// Bins along u and v.
    pub bins: [usize; 2],
    /// What the uploaded numbers are.
    pub quantity: Quantity,
    /// Counts in a bin without an object.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub photons_per_ray: Option<f64>,
    /// The least and the greatest line integral.
    pub range: [f64; 2],
    /// What Helgason's and Ludwig's conditions say. Left out of lists.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub data_check: Option<DataCheck>,
    /// What is wrong by them, in words. Left out of lists.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// What was lost or assumed while reading.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

impl Sinogram {
    /// Reads the parts of an upload of at most `most` numbers.
    ///
    /// # Errors
    /// [`Error::Invalid`] with a pointer under `/meta`, `/data`, `/flat` or `/dark`; [`Error::UnsupportedMediaType`]; [`Error::TooLarge`].
    pub fn read(bytes: &[u8], name: &str, parts: &SinogramParts, most: usize) -> Result<Self> {
        let [data, flat, dark] = parts.split(bytes)?;
        let raw = parts.meta.as_ref().and_then(|meta| meta.raw).map(|raw| (raw.kind, raw.endian));
        let data = Array::read(data, raw, most, "/data")?;
        let mut meta = match &parts.meta {
            Some(meta) => meta.clone(),
            None => of_header(&data)?,
        };
        meta.check(!flat.is_empty(), !dark.is_empty())?;
        let shape = match data.format {
            "raw" => None,
            _ => Some(shape_of(&data.shape)?),
        };
        if let Some([views, v, u]) = shape {
            meta.geometry = meta.geometry.of_data(views, [u, v]);
        } else if let Some([u, v]) = meta.geometry.bins() {
            meta.geometry = meta.geometry.of_data(data.values.len() / (u * v).max(1), [u, v]);
        }
        let geometry = meta.geometry.resolve("/meta/geometry")?;
        check_shape(shape, data.values.len(), &geometry)?;
        check_values(&data.values, meta.quantity, &geometry)?;
        let frame = |bytes: &[u8], at: &str| -> Result<Option<(Vec<f32>, Vec<String>)>> {
            if bytes.is_empty() { Ok(None) } else { frame(bytes, raw, &geometry, most, at).map(Some) }
        };
        let (flat, flat_notes) = frame(flat, "/flat")?.unzip();
        let (dark, dark_notes) = frame(dark, "/dark")?.unzip();
        let mut notes = data.notes;
        notes.extend([flat_notes, dark_notes].into_iter().flatten().flatten());
        let has_frames = flat.is_some() || dark.is_some();
        let (values, counts) = if meta.quantity == Quantity::LineIntegral {
            (data.values, None)
        } else {
            let bins = geometry.count().iter().product();
            let are_counts = meta.quantity == Quantity::Counts;
            let found = OpenBeam::new(bins, flat, dark, meta.photons_per_ray)?.line_integrals(&data.values, are_counts);
            notes.extend(found.note);
            (found.values, (are_counts && !has_frames).then_some(data.values))
        };
        Ok(Self { geometry, meta, name: name.to_owned(), format: data.format, values, counts, notes })
    }

    /// Line integrals that were computed here.
    pub fn computed(asked: GeometryRequest, geometry: Geometry, values: Vec<f32>, name: &str) -> Self {
        let meta = SinogramMeta { geometry: asked, ..SinogramMeta::default() };
        Self { geometry, meta, name: name.to_owned(), format: "computed", values, counts: None, notes: Vec::new() }
    }

    /// Where each bin of each view looks.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The line integrals: u fastest, then v, then the view.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The line integrals of a row of bins.
    pub fn row(&self, view: usize, v: usize) -> &[f32] {
        let [bins, rows] = self.geometry.count();
        &self.values[(view * rows + v) * bins..][..bins]
    }

    /// The numbers to hand out, and what they are: counts if that is what there is, else line integrals.
    pub fn handed_out(&self) -> (&[f32], SinogramMeta) {
        let counts = self.counts.as_deref();
        let quantity = if counts.is_some() { Quantity::Counts } else { Quantity::LineIntegral };
        let photons_per_ray = self.meta.photons_per_ray.filter(|_| counts.is_some());
        let geometry = self.meta.geometry.clone();
        (counts.unwrap_or(&self.values), SinogramMeta { geometry, quantity, photons_per_ray, raw: None })
    }

    /// `nrrd`, `npy`, `raw` or `computed`.
    pub fn format(&self) -> &'static str {
        self.format
    }

    /// What was lost or assumed while reading.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> u64 {
        (size_of::<f32>() * (self.values.len() + self.counts.as_ref().map_or(0, Vec::len))) as u64
    }

    /// The description under an id, with a check of the data if `checked`.
    pub fn info(&self, id: &str, checked: bool) -> SinogramInfo {
        let check = if checked { DataCheck::of(self.geometry.angles(), &self.moments()) } else { None };
        let said = check.iter().flat_map(|check| check.warnings(self.geometry.spacing_mm()[0]));
        let extreme =
            |better: fn(f32, f32) -> f32| f64::from(self.values.par_iter().copied().reduce(|| self.values[0], better));
        SinogramInfo {
            id: id.to_owned(),
            name: self.name.clone(),
            format: self.format.to_owned(),
            geometry: serde_json::to_value(&self.meta.geometry).unwrap_or_default(),
            views: self.geometry.views(),
            bins: self.geometry.count(),
            quantity: self.meta.quantity,
            photons_per_ray: self.meta.photons_per_ray,
            range: [extreme(f32::min), extreme(f32::max)],
            warnings: said.map(|(code, words)| format!("{code}: {words}")).collect(),
            data_check: check,
            notes: self.notes.clone(),
        }
    }

    /// The moments of each view.
    fn moments(&self) -> Vec<Moments> {
        let rows = self.geometry.count()[1];
        let of_view = |view: usize| {
            let mut all = Moments::default();
            for v in 0..rows {
                let row: Vec<f64> = self.row(view, v).iter().map(|p| f64::from(*p)).collect();
                all.add(&Moments::of_row(&self.geometry, &row));
            }
            all
        };
        (0..self.geometry.views()).into_par_iter().map(of_view).collect()
    }
}

impl SinogramParts {
    /// The bytes of data, flat and dark frames in one, and what is said of them.
    pub fn join(meta: Option<SinogramMeta>, files: [&[u8]; 3]) -> (Vec<u8>, Self) {
        (files.concat(), Self { meta, lengths: files.map(<[u8]>::len) })
    }

    fn split<'a>(&self, bytes: &'a [u8]) -> Result<[&'a [u8]; 3]> {
        let [data, flat, dark] = self.lengths;
        let whole = data.checked_add(flat).and_then(|both| both.checked_add(dark)) == Some(bytes.len());
        if !whole {
            return Err(Error::internal("the parts of a sinogram are not as long as its bytes"));
        }
        let (data, frames) = bytes.split_at(data);
        let (flat, dark) = frames.split_at(flat);
        Ok([data, flat, dark])
    }
}

/// What a NRRD says of itself: the keys `geometry`, `quantity` and `photons_per_ray`.
fn of_header(array: &Array) -> Result<SinogramMeta> {
    let field =
        |key: &str| array.keys.get(key).map(|text| serde_json::from_str(text).unwrap_or_else(|_| text.as_str().into()));
    let fields =
        ["geometry", "quantity", "photons_per_ray"].into_iter().filter_map(|key| Some((key.to_owned(), field(key)?)));
    let fields: serde_json::Map<String, Value> = fields.collect();
    if !fields.contains_key("geometry") {
        let permitted = "a form with `meta` and `data`, or a NRRD with the key geometry:={…}";
        return Err(Error::invalid("/meta", "there is no geometry", permitted));
    }
    serde_json::from_value(Value::Object(fields)).map_err(|cause| {
        Error::invalid(
            "/data/header:geometry",
            cause.to_string(),
            "the keys geometry, quantity, photons_per_ray as in `meta`",
        )
    })
}

/// The views, rows and bins of an array: of two axes it has one row.
fn shape_of(shape: &[usize]) -> Result<[usize; 3]> {
    match *shape {
        [views, u] => Ok([views, 1, u]),
        [views, v, u] => Ok([views, v, u]),
        _ => {
            let detail = format!("has {} axes", shape.len());
            Err(Error::invalid("/data", detail, "(views, u) or (views, v, u); of a NRRD sizes u views, or u v views"))
        }
    }
}

fn check_shape(shape: Option<[usize; 3]>, count: usize, geometry: &Geometry) -> Result<()> {
    let ([u, v], views) = (geometry.count(), geometry.views());
    let is_right = shape.map_or(count == u * v * views, |shape| shape == [views, v, u]);
    if is_right {
        return Ok(());
    }
    let has =
        shape.map_or_else(|| format!("{count} numbers"), |[views, v, u]| format!("{views} views of {u} × {v} bins"));
    let is_turned = shape == Some([u, 1, views]) && v == 1;
    let hint = if is_turned { "; it has bins × views, as scikit-image's radon: transpose it" } else { "" };
    let detail = format!("has {has}, and the geometry {views} views of {u} × {v}{hint}");
    Err(Error::invalid("/data", detail, format!("{views} views of {u} × {v} bins, u fastest")))
}

fn check_values(values: &[f32], quantity: Quantity, geometry: &Geometry) -> Result<()> {
    let is_wrong = |value: &f32| !value.is_finite() || (quantity == Quantity::Counts && *value < 0.0);
    let Some(first) = values.par_iter().position_first(is_wrong) else { return Ok(()) };
    let count = values.par_iter().filter(|value| is_wrong(value)).count();
    let ([u, v], value) = (geometry.count(), values[first]);
    let [view, row, bin] = [first / (u * v), first / u % v, first % u];
    let detail =
        format!("{count} numbers are none that may be, the first is {value} at view {view}, row {row}, bin {bin}");
    let permitted = if quantity == Quantity::Counts { "finite numbers of at least 0" } else { "finite numbers" };
    Err(Error::invalid("/data", detail, permitted))
}

/// The mean of the frames in an upload: one view, or some.
fn frame(
    bytes: &[u8],
    raw: Option<(crate::volume::RawType, crate::volume::Endian)>,
    geometry: &Geometry,
    most: usize,
    at: &str,
) -> Result<(Vec<f32>, Vec<String>)> {
    let array = Array::read(bytes, raw, most, at)?;
    let [u, v] = geometry.count();
    let bins = u * v;
    let ends_right = array.format == "raw" || array.shape.ends_with(&[v, u]) || (v == 1 && array.shape.ends_with(&[u]));
    if array.values.is_empty() || !array.values.len().is_multiple_of(bins) || !ends_right {
        let detail = format!("has the shape {:?}, and a view has {u} × {v} bins", array.shape);
        return Err(Error::invalid(at, detail, "one view, or some of them, u fastest"));
    }
    if !array.values.iter().all(|value| value.is_finite()) {
        return Err(Error::invalid(at, "has values that are not finite", "finite numbers"));
    }
    let frames = array.values.len() / bins;
    let mean =
        |bin: usize| array.values.iter().skip(bin).step_by(bins).map(|v| f64::from(*v)).sum::<f64>() / frames as f64;
    Ok(((0..bins).into_par_iter().map(|bin| mean(bin) as f32).collect(), array.notes))
}
