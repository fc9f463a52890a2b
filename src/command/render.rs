//! `render`: makes a picture of a scene, here or on a server.

use std::path::PathBuf;

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::Value;

use super::client::Client;
use super::inputs::Inputs;
use super::{Worker, read_json};
use crate::error::{Error, Result};
use crate::job::State;

/// What `render` is told.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The scene, or - for standard input
    scene: PathBuf,
    /// Where the PNG goes; a name that ends in .exr gets OpenEXR in linear floats
    #[arg(short, long, default_value = "out.png")]
    output: PathBuf,
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    pub by: Worker,
}

impl Arguments {
    fn wants_exr(&self) -> bool {
        self.output.extension().is_some_and(|e| e == "exr")
    }
}

fn bar(scene: &Value) -> ProgressBar {
    let samples = scene.pointer("/budget/samples").and_then(Value::as_u64).unwrap_or(16);
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} samples  {msg}  {elapsed}");
    ProgressBar::new(samples).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// Renders a scene and writes its picture.
///
/// # Errors
/// Those of the scene, of its file, and of the server if one is named.
pub(super) async fn render(args: &Arguments) -> Result<()> {
    let mut scene = read_json(&args.scene)?;
    let (bytes, report) = match &args.by.server {
        Some(server) => render_there(args, server, &mut scene).await?,
        None => render_here(args, &mut scene).await?,
    };
    std::fs::write(&args.output, bytes).map_err(|e| Error::internal(format!("{}: {e}", args.output.display())))?;
    let percent = |v: &Value| v.as_f64().map_or("unknown".into(), |e| format!("{:.3} %", 100.0 * e));
    let (time, stop) = (&report["timings"]["elapsed_ms"], report["stopped_by"].as_str().unwrap_or("?"));
    println!(
        "{}: {} samples, error {}, {time:.0} ms, stopped by {stop}",
        args.output.display(),
        report["samples"],
        percent(&report["error"])
    );
    Ok(())
}

async fn render_there(args: &Arguments, server: &str, scene: &mut Value) -> Result<(Vec<u8>, Value)> {
    let client = Client::new(server, args.by.token.clone())?;
    args.inputs.send(&client, scene).await?;
    let bar = bar(scene);
    let link = if args.wants_exr() { "exr" } else { "png" };
    let done = client
        .run("/v1/renders", scene, link, |event| {
            bar.set_position(event["samples"].as_u64().unwrap_or(0));
            bar.set_message(event["error"].as_f64().map_or(String::new(), |e| format!("error {:.3} %", 100.0 * e)));
        })
        .await;
    bar.finish();
    done
}

/// Runs the same code as the server, without the server.
async fn render_here(args: &Arguments, scene: &mut Value) -> Result<(Vec<u8>, Value)> {
    let service = args.by.service()?;
    args.inputs.insert(&service, scene)?;
    service.engine().ready().await?;
    let job = service.submit(scene.take()).await?;
    let bar = bar(job.request());
    let mut updates = job.watch();
    loop {
        let update = updates.borrow_and_update().clone();
        if let Some(frame) = &update.frame {
            bar.set_position(u64::from(frame.samples));
            let error = frame.error.total.map_or("not known yet".into(), |error| format!("{:.3} %", 100.0 * error));
            bar.set_message(format!("error {error}"));
        }
        match (update.state, update.frame) {
            (State::Done, Some(last)) => {
                bar.finish();
                let exr = args.wants_exr();
                let bytes = if exr { service.engine().film(&job).await?.exr()? } else { last.png.to_vec() };
                return Ok((bytes, job.resource()));
            }
            (State::Failed | State::Cancelled, _) => {
                return Err(job.failure().unwrap_or_else(|| Error::internal("the render was cancelled")));
            }
            _ => updates.changed().await.map_err(Error::internal)?,
        }
    }
}
