//! The stored results of studies: a folder of results with their charts, over those that this program was built with.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use include_dir::{Dir, include_dir};
use serde::de::DeserializeOwned;

use super::honesty::Honesty;
use super::planner::Planned;
use super::record::Record;
use super::stability::Stability;
use super::{draw, page};
use crate::error::{Error, Result};

/// The results of the repository, measured on the machine that they name.
static BUILT_IN: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/docs/charts");

/// The name of the experiments' study.
pub const STABILITY: &str = "stability";

/// The name of the planner's study.
pub const PLANNER: &str = "planner";

/// The name of the study of stated errors.
pub const HONESTY: &str = "honesty";

/// The prefix of the names of records that compare with another program; `./dev bench equal_error` makes them.
pub const PEERS: &str = "vtk_";

/// A folder of stored results.
#[derive(Debug, Clone)]
pub struct Results {
    folder: PathBuf,
}

impl Results {
    /// The results of this folder, which need not exist.
    pub fn new(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// The folder of the results.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The bytes of a file, `{name}.json` or `{name}.svg`, from the folder or else from those built in.
    pub fn read(&self, file: &str) -> Option<Vec<u8>> {
        let plain = file.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_' || b == b'.');
        if !plain || file.starts_with('.') {
            return None;
        }
        let own = std::fs::read(self.folder.join(file)).ok();
        own.or_else(|| BUILT_IN.get_file(file).map(|f| f.contents().to_vec()))
    }

    /// A study's numbers.
    pub fn record<R: DeserializeOwned>(&self, name: &str) -> Option<R> {
        serde_json::from_slice(&self.read(&format!("{name}.json"))?).ok()
    }

    /// The names of all studies.
    pub fn names(&self) -> BTreeSet<String> {
        let own = std::fs::read_dir(&self.folder).into_iter().flatten().filter_map(|e| Some(e.ok()?.path()));
        let built_in = BUILT_IN.files().map(|f| f.path().to_owned());
        let json = own.chain(built_in).filter(|p| p.extension().is_some_and(|e| e == "json"));
        json.filter_map(|p| Some(p.file_stem()?.to_str()?.to_owned())).collect()
    }

    /// Puts a case's numbers and its chart in the folder, and makes the page anew.
    ///
    /// # Errors
    /// [`Error::Internal`] when a file cannot be written or the chart not be drawn.
    pub fn put(&self, record: &Record) -> Result<()> {
        self.write(&format!("{}.json", record.name), &json(record)?)?;
        self.write(&format!("{}.svg", record.name), &draw::study(record)?)?;
        let names = self.names();
        let records: Vec<Record> =
            super::CASES.iter().filter(|c| names.contains(c.name)).filter_map(|c| self.record(c.name)).collect();
        self.write("README.md", &page::page(&records))
    }

    /// Puts the experiments' numbers, charts and page in the folder. Experiments that were not run this time stay as they were.
    ///
    /// # Errors
    /// As [`Results::put`].
    pub fn put_stability(&self, mut found: Stability) -> Result<()> {
        if let Some(old) = self.record::<Stability>(STABILITY) {
            let order = |name: &str| super::experiments::EXPERIMENTS.iter().position(|e| e.name == name);
            let again = |o: &super::stability::Outcome| found.experiments.iter().any(|new| new.name == o.name);
            let kept: Vec<_> = old.experiments.into_iter().filter(|o| !again(o) && order(&o.name).is_some()).collect();
            found.experiments.extend(kept);
            found.experiments.sort_by_key(|o| order(&o.name));
        }
        self.write("stability.json", &json(&found)?)?;
        self.write("stability.md", &found.page())?;
        for outcome in &found.experiments {
            let chart = draw::sweep(outcome.title.split(':').next().unwrap_or_default(), &outcome.findings)?;
            self.write(&format!("stability_{}.svg", outcome.name), &chart)?;
            if let Some(map) = &outcome.findings.heat_map {
                self.write(&format!("stability_{}_map.svg", outcome.name), &draw::heat_map(map)?)?;
            }
        }
        Ok(())
    }

    /// Puts the planner's figures and their page in the folder, beside those of other scenes from the same program on the same machine.
    /// Returns all of them.
    ///
    /// # Errors
    /// As [`Results::put`].
    pub fn put_planned(&self, mut found: Planned) -> Result<Planned> {
        if let Some(old) = self.record::<Planned>(PLANNER).filter(|old| old.machine.is_same(&found.machine)) {
            join(&mut found.scenes, old.scenes, |outcome| outcome.scene);
        }
        self.write("planner.json", &json(&found)?)?;
        self.write("planner.md", &found.page())?;
        Ok(found)
    }

    /// Puts the outcomes of the study of stated errors, their chart and their page in the folder, beside those of other scenes from the same program.
    ///
    /// # Errors
    /// As [`Results::put`].
    pub fn put_honesty(&self, mut found: Honesty) -> Result<()> {
        if let Some(old) = self.record::<Honesty>(HONESTY) {
            found.keep(old);
        }
        self.write("honesty.json", &found.lines()?)?;
        self.write("honesty.svg", &draw::honesty(&found)?)?;
        self.write("honesty.md", &found.page())
    }

    fn write(&self, file: &str, text: &str) -> Result<()> {
        let path = self.folder.join(file);
        let failed = |e: std::io::Error| Error::internal(format!("{}: {e}", path.display()));
        std::fs::create_dir_all(&self.folder).map_err(failed)?;
        std::fs::write(&path, text).map_err(failed)
    }
}

/// Adds the old outcomes of scenes that were not run again, in the order of the scenes.
fn join<O>(found: &mut Vec<O>, old: Vec<O>, scene: impl Fn(&O) -> u64) {
    let kept: Vec<O> = old.into_iter().filter(|o| !found.iter().any(|new| scene(new) == scene(o))).collect();
    found.extend(kept);
    found.sort_by_key(scene);
}

fn json<R: serde::Serialize>(record: &R) -> Result<String> {
    Ok(serde_json::to_string_pretty(record).map_err(Error::internal)? + "\n")
}
