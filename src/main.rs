//! The command line of Cloudchamber: see [`cloudchamber::command`].

use clap::Parser;
use cloudchamber::{command, device};

fn main() -> ! {
    let arguments = command::Arguments::parse();
    let filter = tracing_subscriber::EnvFilter::try_from_env("CLOUDCHAMBER_LOG")
        .unwrap_or_else(|_| "info,tower_http=warn".into());
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    let ended = command::run(arguments);
    if let Err(error) = &ended {
        eprintln!("cloudchamber: {error}");
    }
    device::leave(i32::from(ended.is_err()))
}
