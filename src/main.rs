//! The command line: `serve`, `render`, `study`, `device`, `healthcheck`.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use clap::{Parser, Subcommand};
use cloudchamber::client::{self, Client};
use cloudchamber::config::{Config, DeviceArgs, Limits};
use cloudchamber::device;
use cloudchamber::error::{Error, Result};
use cloudchamber::http::Server;
use cloudchamber::job::{self, Engine, State};
use cloudchamber::plan::{Calibrations, Planner};
use cloudchamber::scene::Scene;
use cloudchamber::study;
use cloudchamber::study::shelf::{PLANNER, STABILITY, Shelf};
use cloudchamber::technique;
use cloudchamber::volume::Store;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};

/// Volume renders as a service: each frame says how accurate it is and what it cost.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Serve the HTTP API and the viewer
    Serve(Box<Config>),
    /// Render a scene (the JSON of POST /v1/renders) to a PNG
    Render(Box<RenderArgs>),
    /// Measure speed against accuracy: every technique against truths that it had no part in
    Study(Box<StudyArgs>),
    /// Show the OpenCL devices here and the one that would be used
    Device(Box<ShowArgs>),
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

#[derive(clap::Args)]
struct RenderArgs {
    /// The scene, or - for standard input
    scene: PathBuf,
    /// Where the PNG goes; a name that ends in .exr gets OpenEXR in linear floats
    #[arg(short, long, default_value = "out.png")]
    output: PathBuf,
    /// Volume file to look at, in place of the scene's volume
    #[arg(long)]
    volume: Option<PathBuf>,
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

#[derive(clap::Args)]
struct ShowArgs {
    #[command(flatten)]
    device: DeviceArgs,
    /// List the kernels' variants instead: what each is built with, and which are built at the start
    #[arg(long)]
    variants: bool,
}

#[derive(clap::Args)]
struct StudyArgs {
    /// Only this case
    #[arg(long)]
    case: Option<String>,
    /// Fewer settings and seeds: seconds a case
    #[arg(long)]
    quick: bool,
    /// Which of the planner's random scenes, as 20..40 (default: 110 of them, or 10; the last ten are of voxels finer than the pixels)
    #[arg(long, value_parser = study::planner::scenes)]
    scenes: Option<std::ops::Range<u64>>,
    /// Where the results go, a JSON a case (default: studies in the data folder)
    #[arg(short, long)]
    output: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    limits: Limits,
}

impl RenderArgs {
    fn wants_exr(&self) -> bool {
        self.output.extension().is_some_and(|e| e == "exr")
    }
}

fn main() -> ! {
    let cli = Cli::parse();
    let filter = tracing_subscriber::EnvFilter::try_from_env("CLOUDCHAMBER_LOG")
        .unwrap_or_else(|_| "info,tower_http=warn".into());
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    let ended = run(cli.command);
    if let Err(error) = &ended {
        eprintln!("cloudchamber: {error}");
    }
    device::leave(i32::from(ended.is_err()))
}

fn run(command: Command) -> Result<()> {
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
            Command::Serve(config) => serve(*config).await,
            Command::Render(args) => render(&args).await,
            Command::Study(args) => {
                tokio::task::spawn_blocking(move || run_studies(&args)).await.map_err(Error::internal)?
            }
            Command::Device(args) if args.variants => show_variants(&args.device),
            Command::Device(args) => show_devices(&args.device),
            Command::Compile(device) => job::compile_kernels(&device.device_config()),
            Command::Healthcheck { listen } => client::healthcheck(&format!("http://{listen}")).await,
        }
    });
    // A blocking task that still encodes a frame for nobody must not hold the exit up.
    runtime.shutdown_background();
    result
}

async fn serve(mut config: Config) -> Result<()> {
    config.device.compiler = std::env::current_exe().ok();
    // Before the device: the LLVM inside PoCL handles SIGTERM too. Handlers that it finds it passes the signal on to; one that
    // comes after it calls LLVM's first, which ends the process.
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

fn read_scene(path: &Path) -> Result<Value> {
    let text =
        if path == Path::new("-") { std::io::read_to_string(std::io::stdin()) } else { std::fs::read_to_string(path) };
    let text = text.map_err(|e| Error::Malformed(format!("{}: {e}", path.display())))?;
    serde_json::from_str(&text).map_err(|e| Error::Malformed(format!("{}: {e}", path.display())))
}

fn bar(scene: &Value) -> ProgressBar {
    let samples = scene.pointer("/budget/samples").and_then(Value::as_u64).unwrap_or(16);
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} samples  {msg}  {elapsed}");
    ProgressBar::new(samples).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

async fn render(args: &RenderArgs) -> Result<()> {
    let mut scene = read_scene(&args.scene)?;
    let (bytes, report) = match &args.server {
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

async fn render_there(args: &RenderArgs, server: &str, scene: &mut Value) -> Result<(Vec<u8>, Value)> {
    let client = Client::new(server, args.token.clone())?;
    if let Some(path) = &args.volume {
        scene["volume"] = json!({"id": client.upload(path).await?});
    }
    let bar = bar(scene);
    let done = client
        .render(scene, args.wants_exr(), |p| {
            bar.set_position(p.samples);
            bar.set_message(p.error.map_or(String::new(), |e| format!("error {:.3} %", 100.0 * e)));
        })
        .await;
    bar.finish();
    done
}

/// The same code as the server's, without the server.
async fn render_here(args: &RenderArgs, scene: &mut Value) -> Result<(Vec<u8>, Value)> {
    let store = Store::open(&args.device.data_dir().join("volumes"), args.limits.store())?;
    if let Some(path) = &args.volume {
        let bytes = std::fs::read(path).map_err(|e| Error::Malformed(format!("{}: {e}", path.display())))?;
        let name = path.file_name().map_or_else(|| "volume".into(), |n| n.to_string_lossy().into_owned());
        scene["volume"] = json!({"id": store.insert(bytes, &name, None)?.1});
    }
    let engine = Engine::start(args.device.device_config(), args.limits.clone())?;
    engine.ready().await?;
    let calibrations = Calibrations::kept_in(&args.device.data_dir());
    let planner = Planner { engine: &engine, store: &store, limits: &args.limits, calibrations: &calibrations };
    let (request, planned) = planner.resolve(scene.take()).await?;
    let valid = Scene::from_json(&request, &store, &args.limits)?;
    *scene = request;
    let job = engine.submit_planned(engine.reserve()?, scene.clone(), valid, planned);
    let bar = bar(scene);
    let mut updates = job.watch();
    loop {
        let update = updates.borrow_and_update().clone();
        if let Some(frame) = &update.frame {
            bar.set_position(u64::from(frame.samples));
            bar.set_message(format!("error {:.3} %", 100.0 * frame.error.total));
        }
        match (update.state, update.frame) {
            (State::Done, Some(last)) => {
                bar.finish();
                let exr = args.wants_exr();
                let bytes = if exr { engine.film(&job).await?.exr()? } else { last.png.to_vec() };
                return Ok((bytes, job.resource()));
            }
            (State::Failed | State::Cancelled, _) => {
                return Err(job.failure().unwrap_or_else(|| Error::internal("the render was cancelled")));
            }
            _ => updates.changed().await.map_err(Error::internal)?,
        }
    }
}

/// Runs the cases asked for and puts what each came to on the shelf.
fn run_studies(args: &StudyArgs) -> Result<()> {
    let asked = |name: &str| args.case.as_deref().is_none_or(|case| case == name);
    let all_experiments = asked(STABILITY);
    let experiment = |e: &study::experiments::Experiment| all_experiments || asked(e.name);
    let cases: Vec<&study::Case> = study::CASES.iter().filter(|c| asked(c.name)).collect();
    let experiments = study::experiments::EXPERIMENTS;
    if cases.is_empty() && !experiments.iter().any(experiment) && !asked(PLANNER) {
        let names: Vec<&str> = study::CASES
            .iter()
            .map(|c| c.name)
            .chain([STABILITY, PLANNER])
            .chain(experiments.iter().map(|e| e.name))
            .collect();
        return Err(Error::internal(format!("there is no such case; there are: {}", names.join(", "))));
    }
    let shelf = Shelf::new(args.output.clone().unwrap_or_else(|| args.device.data_dir().join("studies")));
    let bench = study::bench::Bench::new(&args.device, args.limits.clone())?;
    let scale = if args.quick { study::Scale::Quick } else { study::Scale::Full };
    let mut told = |line: &str| eprintln!("{line}");
    for case in cases {
        match study::study(&bench, case, scale, &mut told)? {
            Ok(record) => {
                shelf.put(&record)?;
                print!("{}", study::table(&record));
            }
            Err(why) => println!("{}: left out: {why}", case.name),
        }
    }
    if experiments.iter().any(experiment) {
        let found = study::stability::stability(&bench, scale, &experiment, &mut told)?;
        print!("{}", found.page());
        if let Some(silent) = found.experiments.iter().find(|e| !e.verdict.is_told()) {
            return Err(Error::internal(format!("{}: a method is wrong and silent", silent.name)));
        }
        shelf.put_stability(found)?;
    }
    if asked(PLANNER) {
        let scenes = args.scenes.clone().unwrap_or(0..scale.pick(10, 110));
        for scene in scenes {
            // Each is written at once: all of them take long.
            let all = shelf.put_planned(study::planner::planner(&bench, scene..scene + 1, &mut told)?)?;
            let ([met, timed, cheap], n) = (all.figures(), all.scenes.len());
            told(&format!("of {n} plans {met} meet the error, {timed} the time, {cheap} the cost"));
        }
    }
    println!("written to {}", shelf.folder().display());
    Ok(())
}

fn show_devices(args: &DeviceArgs) -> Result<()> {
    let all: Vec<_> = device::list(args.lanes)?.into_iter().map(|(_, info)| info).collect();
    let (_, chosen) = device::select(&args.device, args.lanes)?;
    // An opened one knows more of itself; one that cannot be opened is shown all the same.
    let used = device::Device::open(&args.device_config()).map_or(chosen, |device| device.info().clone());
    let text = serde_json::to_string_pretty(&json!({"devices": all, "would_use": used})).map_err(Error::internal)?;
    println!("{text}");
    Ok(())
}

/// Every variant of every kernel: a render builds those that its plan needs, and those that are common are built at the start.
fn show_variants(args: &DeviceArgs) -> Result<()> {
    let (_, used) = device::select(&args.device, args.lanes)?;
    let mut variants = Vec::new();
    for technique in technique::ALL {
        let source = (technique.source)();
        for (i, variant) in (source.variants)().iter().enumerate() {
            let features: serde_json::Map<String, Value> =
                variant.features.iter().map(|(name, value)| ((*name).into(), json!(value))).collect();
            variants.push(
                json!({"kernel": variant.kernel, "voxel": variant.voxel.map(|v| format!("{v:?}").to_lowercase()),
                "features": features, "at_start": i < source.common, "options": variant.options(used.lanes, false, false)}),
            );
        }
    }
    let text =
        serde_json::to_string_pretty(&json!({"count": variants.len(), "lanes": used.lanes, "variants": variants}));
    println!("{}", text.map_err(Error::internal)?);
    Ok(())
}
