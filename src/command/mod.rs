//! The command line: `serve`, `render`, `study`, `device`, `healthcheck`, each in its own file.

mod client;
mod devices;
mod render;
mod serve;
mod study;

use std::net::SocketAddr;

use clap::{Parser, Subcommand};

use crate::config::{Config, DeviceArgs};
use crate::device;
use crate::error::{Error, Result};
use crate::run::compile_kernels;

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

/// Runs what the command line asks for. Must be called before any other thread is started.
///
/// # Errors
/// Those of the command, in words for whoever typed it.
pub fn run(arguments: Arguments) -> Result<()> {
    let Arguments { command } = arguments;
    // Before any other thread is there: PoCL reads its cache folder from the environment.
    let device = match &command {
        Command::Serve(config) => Some(&config.device),
        Command::Render(args) => Some(&args.device),
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
            Command::Study(args) => {
                tokio::task::spawn_blocking(move || study::study(&args)).await.map_err(Error::internal)?
            }
            Command::Device(args) if args.variants => devices::show_variants(&args.device),
            Command::Device(args) => devices::show_devices(&args.device),
            Command::Compile(device) => compile_kernels(&device.device_config()),
            Command::Healthcheck { listen } => client::healthcheck(&format!("http://{listen}")).await,
        }
    });
    // A blocking task that still encodes a frame for nobody must not hold the exit up.
    runtime.shutdown_background();
    result
}
