//! The command line: `serve`, `render`, `export`, `project`, `study`, `device`, `healthcheck`, each in its own file.

mod client;
mod devices;
mod export;
mod inputs;
mod render;
mod serve;
mod study;

use std::net::SocketAddr;
use std::path::Path;

use clap::{Parser, Subcommand};
use serde_json::Value;

use crate::config::{Config, DeviceArgs, Limits};
use crate::device;
use crate::error::{Error, Result};
use crate::run::compile_kernels;
use crate::service::Service;

/// Volume renders as a service: each frame says how accurate it is and what it cost.
#[derive(Parser)]
#[command(version)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Serve the HTTP API and the viewer
    Serve(Box<Config>),
    /// Render a scene (the JSON of POST /v1/renders) to a PNG
    Render(Box<render::Arguments>),
    /// Turn a volume or a field into a file (the JSON of POST /v1/exports)
    Export(Box<export::Arguments>),
    /// Measure a volume, a field or a phantom: a sinogram as NRRD (the JSON of POST /v1/projections)
    Project(Box<export::Arguments>),
    /// Measure speed against accuracy: every technique against truths that it had no part in
    Study(Box<study::Arguments>),
    /// Show the OpenCL devices here and the one that would be used
    Device(Box<devices::Arguments>),
    /// Compile kernels for a server (which starts this itself): a label a line in, what came of it a line out
    #[command(hide = true)]
    Compile(Box<DeviceArgs>),
    /// Exit 0 if the server at the address answers
    Healthcheck {
        /// Address of the server
        #[arg(long, env = "CLOUDCHAMBER_LISTEN", default_value = "127.0.0.1:8080")]
        listen: SocketAddr,
    },
}

/// Who does the work of a command: a server, or this process with its device.
#[derive(clap::Args)]
struct Worker {
    /// Let the server at this URL do it
    #[arg(long, env = "CLOUDCHAMBER_SERVER")]
    server: Option<String>,
    /// Bearer token for that server
    #[arg(long, env = "CLOUDCHAMBER_TOKEN", hide_env_values = true)]
    token: Option<String>,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    limits: Limits,
}

impl Worker {
    /// A service in this process.
    ///
    /// # Errors
    /// Those of [`Service::start`].
    fn service(&self) -> Result<Service> {
        Service::start(self.device.device_config(), &self.device.data_dir(), self.limits.clone())
    }
}

/// The JSON of a file, or of standard input for `-`.
fn read_json(path: &Path) -> Result<Value> {
    let text =
        if path == Path::new("-") { std::io::read_to_string(std::io::stdin()) } else { std::fs::read_to_string(path) };
    let text = text.map_err(|e| Error::Malformed(format!("{}: {e}", path.display())))?;
    serde_json::from_str(&text).map_err(|e| Error::Malformed(format!("{}: {e}", path.display())))
}

/// Runs the command. It must be called before any other thread is started.
///
/// # Errors
/// Those of the command, in words for the user.
pub fn run(arguments: Arguments) -> Result<()> {
    let Arguments { command } = arguments;
    // PoCL reads its cache folder from the environment, so this comes before any other thread is there.
    let device = match &command {
        Command::Serve(config) => Some(&config.device),
        Command::Render(args) => Some(&args.by.device),
        Command::Export(args) | Command::Project(args) => Some(&args.by.device),
        Command::Study(args) => Some(&args.device),
        Command::Device(args) => Some(&args.device),
        Command::Compile(device) => Some(&**device),
        Command::Healthcheck { .. } => None,
    };
    if let Some(device) = device {
        device::keep_compiled_kernels_in(&device.data_dir().join("kernels"))?;
    }
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().map_err(Error::internal)?;
    let result = runtime.block_on(async {
        match command {
            Command::Serve(config) => serve::serve(*config).await,
            Command::Render(args) => render::render(&args).await,
            Command::Export(args) => export::export(&args).await,
            Command::Project(args) => export::project(&args).await,
            Command::Study(args) => {
                tokio::task::spawn_blocking(move || study::study(&args)).await.map_err(Error::internal)?
            }
            Command::Device(args) if args.variants => devices::show_variants(&args.device),
            Command::Device(args) => devices::show_devices(&args.device),
            Command::Compile(device) => compile_kernels(&device.device_config()),
            Command::Healthcheck { listen } => client::healthcheck(&format!("http://{listen}")).await,
        }
    });
    // A blocking task that still encodes a frame for nobody must not delay the exit.
    runtime.shutdown_background();
    result
}
