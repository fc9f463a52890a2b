//! `export` and `project`: make a file of a volume, a field or a phantom, here or on a server.

use std::path::PathBuf;

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::Value;

use super::client::Client;
use super::inputs::Inputs;
use super::{Worker, read_json};
use crate::error::{Error, Result};
use crate::job::State;
use crate::render::{at_projection, export_of_projection};

/// What `export` and `project` are told.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The request, or - for standard input
    request: PathBuf,
    /// Where the file goes. Default: out with the extension of its kind
    #[arg(short, long)]
    output: Option<PathBuf>,
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    pub by: Worker,
}

/// Makes a file and writes it.
///
/// # Errors
/// Those of the request, of its file, and of the server if one is named.
pub(super) async fn export(args: &Arguments) -> Result<()> {
    make(args, read_json(&args.request)?).await
}

/// Makes a sinogram and writes it.
///
/// # Errors
/// As [`export`].
pub(super) async fn project(args: &Arguments) -> Result<()> {
    let request = export_of_projection(&read_json(&args.request)?, &args.by.limits)?;
    make(args, request).await.map_err(at_projection)
}

async fn make(args: &Arguments, request: Value) -> Result<()> {
    let style = ProgressStyle::with_template("{bar:30} {percent}%  {msg}  {elapsed}");
    let bar = ProgressBar::new(0).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let (bytes, resource) = match &args.by.server {
        Some(server) => export_there(args, server, request, &bar).await?,
        None => export_here(args, request, &bar).await?,
    };
    bar.finish();
    let extension = resource["file"]["extension"].as_str().unwrap_or("bin");
    let output = args.output.clone().unwrap_or_else(|| PathBuf::from("out").with_extension(extension));
    std::fs::write(&output, &bytes).map_err(|e| Error::internal(format!("{}: {e}", output.display())))?;
    let ms = resource["timings"]["elapsed_ms"].as_f64().unwrap_or(0.0);
    println!("{}: {} bytes, {ms:.0} ms, {}", output.display(), bytes.len(), resource["result"]);
    Ok(())
}

fn show(bar: &ProgressBar, progress: &Value) {
    bar.set_length(progress["total"].as_u64().unwrap_or(0));
    bar.set_position(progress["done"].as_u64().unwrap_or(0));
    bar.set_message(progress["of"].as_str().unwrap_or_default().to_owned());
}

async fn export_there(
    args: &Arguments,
    server: &str,
    mut request: Value,
    bar: &ProgressBar,
) -> Result<(Vec<u8>, Value)> {
    let client = Client::new(server, args.by.token.clone())?;
    args.inputs.send(&client, &mut request).await?;
    client.run("/v1/exports", &request, "file", |event| show(bar, &event["progress"])).await
}

/// Runs the same code as the server, without the server.
async fn export_here(args: &Arguments, mut request: Value, bar: &ProgressBar) -> Result<(Vec<u8>, Value)> {
    let service = args.by.service()?;
    args.inputs.insert(&service, &mut request)?;
    service.engine().ready().await?;
    let job = service.queue(service.prepare_export(request).await?);
    let mut updates = job.watch();
    loop {
        let state = updates.borrow_and_update().state;
        show(bar, &job.resource()["progress"]);
        match (state, job.file()) {
            (State::Done, Some(file)) => return Ok((file.bytes.to_vec(), job.resource())),
            (State::Failed | State::Cancelled, _) => {
                return Err(job.failure().unwrap_or_else(|| Error::internal("the export was cancelled")));
            }
            _ => updates.changed().await.map_err(Error::internal)?,
        }
    }
}
