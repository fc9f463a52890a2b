//! The text header of a NRRD file: <https://teem.sourceforge.net/nrrd/format.html>.

use super::samples::RawType;
use crate::error::{Error, Result};
use std::collections::HashMap;

/// The most bytes of a header. Headers are text that people write; a larger one is damage.
const MAX_HEADER: usize = 1 << 20;

/// The fields of a header.
pub(super) struct Header {
    fields: HashMap<String, String>,
    /// The sender's own annotations.
    keys: HashMap<String, String>,
    /// The offset of the data.
    pub data_at: usize,
}

impl Header {
    /// Parses the lines up to the first blank one.
    pub fn parse(bytes: &[u8]) -> Result<Self> {
        let (mut fields, mut keys) = (HashMap::new(), HashMap::new());
        let mut at = 0;
        let magic = next_line(bytes, &mut at).unwrap_or_default();
        if !matches!(magic.as_str(), "NRRD0001" | "NRRD0002" | "NRRD0003" | "NRRD0004" | "NRRD0005") {
            return Err(Error::invalid("header:magic", "is of an unknown version", "NRRD0001 to NRRD0005"));
        }
        while let Some(line) = next_line(bytes, &mut at) {
            if line.is_empty() {
                return Ok(Self { fields, keys, data_at: at });
            }
            if line.starts_with('#') {
                continue;
            }
            let Some((field, value)) = line.split_once(':') else {
                let start: String = line.chars().take(40).collect();
                return Err(Error::invalid("header:", format!("the line '{start}' is no field"), "field: value"));
            };
            // `key:=value` is the sender's own annotation.
            if let Some(value) = value.strip_prefix('=') {
                keys.insert(field.to_owned(), value.trim().to_owned());
                continue;
            }
            let field = canonical(field);
            if field == "datafile" {
                let detail = "names another file, and only data in the same file are read: no file that a client names is opened";
                return Err(Error::invalid("header:data file", detail, "a NRRD file with its data attached"));
            }
            if fields.insert(field.clone(), value.trim().to_owned()).is_some() {
                return Err(Error::invalid(format!("header:{field}"), "is given twice", "once"));
            }
        }
        Err(Error::invalid("header:", "no blank line ends the header", "a blank line within the first MiB"))
    }

    /// A field's text; `name` may hold spaces, as in the format's definition.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.fields.get(&canonical(name)).map(String::as_str)
    }

    /// The pairs `key:=value`.
    pub fn into_keys(self) -> HashMap<String, String> {
        self.keys
    }

    /// A field that must be there.
    pub fn required(&self, name: &str) -> Result<&str> {
        self.get(name).ok_or_else(|| Error::invalid(format!("header:{name}"), "is missing", "required"))
    }

    /// A field that holds one integer, or `default`.
    pub fn integer(&self, name: &str, default: i64) -> Result<i64> {
        let Some(text) = self.get(name) else { return Ok(default) };
        text.parse().map_err(|_| Error::invalid(format!("header:{name}"), "is not an integer", "an integer"))
    }

    /// A field that holds one value an axis, separated by spaces.
    pub fn per_axis(&self, name: &str, axes: usize) -> Result<Option<Vec<&str>>> {
        self.get(name).map(|text| exactly(name, text.split_whitespace().collect(), axes)).transpose()
    }

    /// A field that holds one vector of three numbers, or `none`, an axis.
    pub fn vectors(&self, name: &str, axes: usize) -> Result<Option<Vec<Option<[f64; 3]>>>> {
        let Some(mut rest) = self.get(name) else { return Ok(None) };
        let mut vectors = Vec::new();
        while !rest.is_empty() {
            let end = match rest.starts_with('(') {
                true => rest.find(')').map_or(rest.len(), |at| at + 1),
                false => rest.find(char::is_whitespace).unwrap_or(rest.len()),
            };
            let (item, after) = rest.split_at(end);
            vectors.push(if item.eq_ignore_ascii_case("none") { None } else { Some(vector(name, item)?) });
            rest = after.trim_start();
        }
        exactly(name, vectors, axes).map(Some)
    }

    /// The scalar type, under any of its names.
    pub fn raw_type(&self) -> Result<RawType> {
        let text = self.required("type")?.to_ascii_lowercase();
        let words: Vec<_> = text.split_whitespace().collect();
        Ok(match words.join(" ").as_str() {
            "signed char" | "int8" | "int8_t" => RawType::I8,
            "uchar" | "unsigned char" | "uint8" | "uint8_t" => RawType::U8,
            "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => RawType::I16,
            "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => RawType::U16,
            "int" | "signed int" | "int32" | "int32_t" => RawType::I32,
            "uint" | "unsigned int" | "uint32" | "uint32_t" => RawType::U32,
            "longlong"
            | "long long"
            | "long long int"
            | "signed long long"
            | "signed long long int"
            | "int64"
            | "int64_t" => RawType::I64,
            "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => RawType::U64,
            "float" => RawType::F32,
            "double" => RawType::F64,
            other => {
                let shown: String = other.chars().take(40).collect();
                let permitted =
                    "int8, uint8, int16, uint16, int32, uint32, int64, uint64, float, double and their C names";
                return Err(Error::invalid("header:type", format!("'{shown}' is not a scalar type"), permitted));
            }
        })
    }
}

/// Identifiers are case-insensitive, and some are known with and without their space (`byte skip`, `byteskip`).
fn canonical(field: &str) -> String {
    field.chars().filter(|c| !c.is_whitespace()).map(|c| c.to_ascii_lowercase()).collect()
}

/// The line at `at`, without its end (`\n` or `\r\n`) and trailing blanks; `at` moves behind it.
fn next_line(bytes: &[u8], at: &mut usize) -> Option<String> {
    let rest = bytes.get(*at..bytes.len().min(MAX_HEADER))?;
    let end = rest.iter().position(|&byte| byte == b'\n')?;
    *at += end + 1;
    Some(String::from_utf8_lossy(&rest[..end]).trim_end().to_owned())
}

fn exactly<T>(name: &str, values: Vec<T>, axes: usize) -> Result<Vec<T>> {
    if values.len() == axes {
        return Ok(values);
    }
    let detail = format!("has {} values", values.len());
    Err(Error::invalid(format!("header:{name}"), detail, format!("{axes}, as dimension says")))
}

/// Parses a vector such as `(1, 0, 0)`.
pub(super) fn vector(name: &str, text: &str) -> Result<[f64; 3]> {
    let inner = text.trim().strip_prefix('(').and_then(|text| text.strip_suffix(')')).unwrap_or_default();
    let numbers: Option<Vec<f64>> = inner.split(',').map(|part| part.trim().parse().ok()).collect();
    let vector = numbers.and_then(|numbers| <[f64; 3]>::try_from(numbers).ok());
    vector.filter(|vector| vector.iter().all(|number| number.is_finite())).ok_or_else(|| {
        let shown: String = text.chars().take(60).collect();
        Error::invalid(format!("header:{name}"), format!("'{shown}' is not a vector"), "(x,y,z), three finite numbers")
    })
}
