//! The moment of a render at which its stated error is judged.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::Result;
use crate::study::bench::{Bench, Reads};

/// A moment of a render.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Moment {
    /// Its end.
    End,
    /// Its first picture, as it is watched: a preview of few pixels, or one of few samples.
    First,
    /// Its first picture after its end with another camera, to which it has moved.
    Moved(Value),
}

/// A picture at a moment, with what it states.
pub struct Seen {
    /// The linear luminance of every pixel.
    pub luminance: Vec<f64>,
    /// The samples of a pixel.
    pub samples: u64,
    /// The reason for which the render stopped, if it is its end.
    pub stopped_by: Option<String>,
    /// The stated error; `None` if it is not known.
    pub stated: Option<f64>,
    /// Its parts.
    pub parts: Value,
    /// The codes of warnings.
    pub warnings: Vec<String>,
}

impl Moment {
    /// The name in tables.
    pub fn name(&self) -> &'static str {
        match self {
            Self::End => "end",
            Self::First => "first",
            Self::Moved(_) => "moved",
        }
    }

    /// The picture of a request at this moment.
    ///
    /// # Errors
    /// Those of the request.
    pub fn of(&self, bench: &Bench, request: &Value) -> Result<Seen> {
        let moved = match self {
            Self::End => return at_the_end(bench, request),
            Self::First => None,
            Self::Moved(camera) => Some(camera),
        };
        let film = bench.glimpse(request, moved)?;
        let error = film.error();
        Ok(Seen {
            luminance: film.shown_luminance(),
            samples: film.main.count.into(),
            stopped_by: None,
            stated: error.total,
            parts: serde_json::to_value(error).map_err(crate::error::Error::internal)?,
            warnings: film.lowered.words(),
        })
    }
}

fn at_the_end(bench: &Bench, request: &Value) -> Result<Seen> {
    let run = bench.run(request, Reads::Luminance)?;
    Ok(Seen {
        samples: run.samples,
        stopped_by: run.reply["stopped_by"].as_str().map(str::to_owned),
        stated: run.reply["error"].as_f64(),
        parts: run.reply["error_parts"].clone(),
        warnings: run.codes(),
        luminance: run.values,
    })
}
