//! Files that a command puts into its request.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::client::Client;
use super::read_json;
use crate::error::{Error, Result};
use crate::request::{self, schema_of};
use crate::service::Service;
use crate::technique;
use crate::tomography::{SinogramMeta, SinogramParts};

/// The files of a command.
#[derive(clap::Args)]
pub(super) struct Inputs {
    /// Volume file to look at, in place of the request's volume
    #[arg(long)]
    volume: Option<PathBuf>,
    /// Sinogram file to reconstruct, by the request's field or else by fbp
    #[arg(long, conflicts_with = "volume")]
    sinogram: Option<PathBuf>,
    /// What is said of the sinogram: JSON of geometry, quantity, photons_per_ray. A NRRD may say it itself
    #[arg(long, requires = "sinogram")]
    meta: Option<PathBuf>,
    /// Readings of the open beam, for a sinogram of counts or intensities
    #[arg(long, requires = "meta")]
    flat: Option<PathBuf>,
    /// Readings without light
    #[arg(long, requires = "flat")]
    dark: Option<PathBuf>,
}

/// A file's bytes and name.
fn file(path: &Path) -> Result<(Vec<u8>, String)> {
    let bytes = std::fs::read(path).map_err(|e| Error::Malformed(format!("{}: {e}", path.display())))?;
    Ok((bytes, file_name(path)))
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// Puts a sinogram into the request's field; without one, into `fbp`.
fn place(request: &mut Value, id: &str) {
    let sinogram = json!({"id": id});
    match technique::fields().find(|field| request["volume"].get(field.name).is_some()) {
        Some(field) => request["volume"][field.name]["sinogram"] = sinogram,
        None => request["volume"] = json!({"fbp": {"sinogram": sinogram}}),
    }
}

impl Inputs {
    /// The parts of the sinogram's form that are files, with their names.
    fn sinogram_files(&self) -> impl Iterator<Item = (&'static str, &PathBuf)> {
        let files = [("data", &self.sinogram), ("flat", &self.flat), ("dark", &self.dark)];
        files.into_iter().filter_map(|(part, path)| Some((part, path.as_ref()?)))
    }

    /// Uploads the files to a server, and puts their ids into the request.
    ///
    /// # Errors
    /// Those of the files, and the server's refusals in its words.
    pub async fn send(&self, client: &Client, request: &mut Value) -> Result<()> {
        if let Some(path) = &self.volume {
            request["volume"] = json!({"id": client.upload("/v1/volumes", file(path)?.0).await?});
        }
        if self.sinogram.is_some() {
            let mut form = reqwest::multipart::Form::new();
            if let Some(meta) = &self.meta {
                form = form.text("meta", read_json(meta)?.to_string());
            }
            for (part, path) in self.sinogram_files() {
                let (bytes, name) = file(path)?;
                form = form.part(part, reqwest::multipart::Part::bytes(bytes).file_name(name));
            }
            place(request, &client.upload_form("/v1/sinograms", form).await?);
        }
        Ok(())
    }

    /// Stores the files here, and puts their ids into the request.
    ///
    /// # Errors
    /// Those of the files.
    pub fn insert(&self, service: &Service, request: &mut Value) -> Result<()> {
        if let Some(path) = &self.volume {
            let (bytes, name) = file(path)?;
            request["volume"] = json!({"id": service.assets().volumes().insert(bytes, &name, None)?.1});
        }
        if let Some(path) = &self.sinogram {
            let said = self.meta.as_deref().map(read_json).transpose()?;
            let said = said.map(|said| request::parse::<SinogramMeta>(&said, schema_of::<SinogramMeta>(), "/meta"));
            let mut files: [Vec<u8>; 3] = Default::default();
            for (bytes, (_, path)) in files.iter_mut().zip(self.sinogram_files()) {
                *bytes = file(path)?.0;
            }
            let (bytes, parts) = SinogramParts::join(said.transpose()?, files.each_ref().map(Vec::as_slice));
            let name = file_name(path);
            place(request, &service.assets().sinograms().insert(bytes, &name, Some(parts))?.1);
        }
        Ok(())
    }
}
