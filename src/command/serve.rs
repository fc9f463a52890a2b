//! `serve`: the HTTP API and the viewer, until a signal stops them.

use crate::config::Config;
use crate::error::{Error, Result};
use crate::http::Server;

/// Serves until SIGTERM or Ctrl-C, then drains.
///
/// # Errors
/// Those of the server.
pub(super) async fn serve(mut config: Config) -> Result<()> {
    config.device.compiler = std::env::current_exe().ok();
    // The handlers come before the device, since the LLVM inside PoCL handles SIGTERM too. LLVM passes the signal on to handlers that it finds. A
    // later handler would call LLVM's first, which ends the process.
    let stop = stop_signal()?;
    let server = Server::bind(&config).await?;
    println!("Cloudchamber listens on http://{}", server.address()?);
    let engine = server.engine().clone();
    tokio::spawn(async move {
        match engine.ready().await {
            Ok(info) => {
                println!("ready on {} / {}, {} lanes, {}", info.platform, info.device, info.lanes, info.level)
            }
            Err(error) => eprintln!("cloudchamber: {error}"),
        }
    });
    server.run(stop).await
}

/// SIGTERM or Ctrl-C. The handlers are in place when this returns.
fn stop_signal() -> Result<impl Future<Output = ()> + Send + 'static> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut interrupt = signal(SignalKind::interrupt()).map_err(Error::internal)?;
    let mut terminate = signal(SignalKind::terminate()).map_err(Error::internal)?;
    Ok(async move {
        tokio::select! { _ = interrupt.recv() => {}, _ = terminate.recv() => {} }
    })
}
