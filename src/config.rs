//! The command line and the environment (`CLOUDCHAMBER_…`) as one [`Config`]. Every limit of the service is here.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use crate::asset::AssetLimits;
use crate::device::DeviceConfig;
use crate::volume::VolumeLimits;

/// The largest volume, bytes: kernels address voxels by 32-bit byte offsets.
const LARGEST_VOLUME: u64 = (1 << 31) - 16;

/// Where things are kept and which device is used: shared by `serve`, `render` and `device`.
#[derive(Debug, Clone, Args)]
pub struct DeviceArgs {
    /// OpenCL device: `pocl` (the CPU), `gpu`, or part of a platform's or device's name
    #[arg(long, env = "CLOUDCHAMBER_DEVICE", default_value = "pocl")]
    pub device: String,
    /// Rays or photons per work-item: 1, 4, 8 or 16 (default: what the device likes)
    #[arg(long, env = "CLOUDCHAMBER_LANES", value_parser = parse_lanes)]
    pub lanes: Option<u32>,
    /// Whether views read volumes as 3D images (default: on a GPU)
    #[arg(long, env = "CLOUDCHAMBER_VOLUME_IMAGES")]
    pub volume_images: Option<bool>,
    /// Folder for volumes and compiled kernels (default: $XDG_DATA_HOME/cloudchamber or ~/.local/share/cloudchamber)
    #[arg(long, env = "CLOUDCHAMBER_DATA_DIR")]
    pub data_dir: Option<PathBuf>,
    /// Read kernels from this folder instead of the binary (development)
    #[arg(long, env = "CLOUDCHAMBER_KERNELS")]
    pub kernels: Option<PathBuf>,
    /// This program, where it may start processes of itself that compile kernels ahead.
    #[arg(skip)]
    pub compiler: Option<PathBuf>,
}

fn parse_lanes(text: &str) -> Result<u32, String> {
    match text {
        "1" | "4" | "8" | "16" => text.parse().map_err(|_| String::from("not a number")),
        _ => Err(String::from("permitted: 1, 4, 8, 16")),
    }
}

impl DeviceArgs {
    /// The data folder: the one given, else the user's, else one under the temporary folder.
    pub fn data_dir(&self) -> PathBuf {
        let home = || std::env::var_os("HOME").map(|h| PathBuf::from(h).join(".local/share"));
        let base =
            || std::env::var_os("XDG_DATA_HOME").map(PathBuf::from).or_else(home).unwrap_or_else(std::env::temp_dir);
        self.data_dir.clone().unwrap_or_else(|| base().join("cloudchamber"))
    }

    /// The configuration for `device/`.
    pub fn device_config(&self) -> DeviceConfig {
        DeviceConfig {
            target: self.device.clone(),
            lanes: self.lanes,
            kernels: self.kernels.clone(),
            images: self.volume_images,
            compiler: self.compiler.clone(),
            ..DeviceConfig::pocl()
        }
    }
}

/// Limits, each checked before anything is allocated for the request that meets it.
#[derive(Debug, Clone, Args)]
pub struct Limits {
    /// Largest image side in pixels
    #[arg(long, env = "CLOUDCHAMBER_MAX_IMAGE_SIDE", default_value_t = 4096, value_parser = clap::value_parser!(u32).range(1..=16_384))]
    pub max_image_side: u32,
    /// Most samples per pixel
    #[arg(long, env = "CLOUDCHAMBER_MAX_SAMPLES", default_value_t = 65_536)]
    pub max_samples: u32,
    /// Longest render in milliseconds of time budget
    #[arg(long, env = "CLOUDCHAMBER_MAX_TIME_MS", default_value_t = 3_600_000)]
    pub max_time_ms: u64,
    /// Most photons in one simulation
    #[arg(long, env = "CLOUDCHAMBER_MAX_PHOTONS", default_value_t = 1_000_000_000)]
    pub max_photons: u64,
    /// Largest volume in bytes of voxels, after unpacking
    #[arg(long, env = "CLOUDCHAMBER_MAX_VOLUME_BYTES", default_value_t = 1 << 30, value_parser = clap::value_parser!(u64).range(1..=LARGEST_VOLUME))]
    pub max_volume_bytes: u64,
    /// Most bytes of uploaded files kept on disk
    #[arg(long, env = "CLOUDCHAMBER_MAX_STORE_BYTES", default_value_t = 20 << 30)]
    pub max_store_bytes: u64,
    /// Most bytes of decoded volumes kept in memory when no render uses them
    #[arg(long, env = "CLOUDCHAMBER_MAX_RESIDENT_BYTES", default_value_t = 2 << 30)]
    pub max_resident_bytes: u64,
    /// Largest uploaded body in bytes
    #[arg(long, env = "CLOUDCHAMBER_MAX_BODY_BYTES", default_value_t = 1 << 30)]
    pub max_body_bytes: usize,
    /// Largest JSON body in bytes
    #[arg(long, env = "CLOUDCHAMBER_MAX_JSON_BYTES", default_value_t = 1 << 20)]
    pub max_json_bytes: usize,
    /// Most unfinished renders: past this many, a new one is answered 429
    #[arg(long, env = "CLOUDCHAMBER_QUEUE", default_value_t = 64)]
    pub queue: usize,
    /// Renders that take turns on the device at the same time; the others wait in order
    #[arg(long, env = "CLOUDCHAMBER_LIVE_RENDERS", default_value_t = 8)]
    pub live_renders: usize,
    /// Most open streams (frames, events and waiting requests)
    #[arg(long, env = "CLOUDCHAMBER_MAX_STREAMS", default_value_t = 1024)]
    pub max_streams: usize,
    /// Finished renders that stay readable
    #[arg(long, env = "CLOUDCHAMBER_KEEP_RENDERS", default_value_t = 128)]
    pub keep_renders: usize,
    /// Most bytes of films of ended renders that stay on the device for EXR and differences; past this the oldest keep their PNG only
    #[arg(long, env = "CLOUDCHAMBER_KEEP_FILM_BYTES", default_value_t = 48 << 20)]
    pub keep_film_bytes: usize,
    /// Most bytes of finished pictures kept in memory
    #[arg(long, env = "CLOUDCHAMBER_KEEP_BYTES", default_value_t = 128 << 20)]
    pub keep_bytes: usize,
}

impl Limits {
    /// The limits for the readers of volume files.
    pub fn volume(&self) -> VolumeLimits {
        VolumeLimits { max_volume_bytes: self.max_volume_bytes, max_side: 4096 }
    }

    /// The limits for the stores.
    pub fn assets(&self) -> AssetLimits {
        AssetLimits {
            volume: self.volume(),
            max_store_bytes: self.max_store_bytes,
            max_resident_bytes: self.max_resident_bytes,
        }
    }
}

/// Everything `serve` can be told.
#[derive(Debug, Clone, Args)]
pub struct Config {
    /// Address to listen on; loopback unless told otherwise
    #[arg(long, env = "CLOUDCHAMBER_LISTEN", default_value = "127.0.0.1:8080")]
    pub listen: SocketAddr,
    /// Device and folders.
    #[command(flatten)]
    pub device: DeviceArgs,
    /// Limits.
    #[command(flatten)]
    pub limits: Limits,
    /// Serve the viewer from this folder instead of the binary (development)
    #[arg(long = "static", env = "CLOUDCHAMBER_STATIC")]
    pub static_dir: Option<PathBuf>,
    /// Ask for this bearer token on everything but /healthz
    #[arg(long, env = "CLOUDCHAMBER_TOKEN", hide_env_values = true)]
    pub token: Option<String>,
    /// Ask for one of the bearer tokens in this file, one a line
    #[arg(long, env = "CLOUDCHAMBER_TOKEN_FILE")]
    pub token_file: Option<PathBuf>,
    /// Origins that browsers may call from (CORS); none unless named
    #[arg(long, env = "CLOUDCHAMBER_CORS_ORIGIN", value_delimiter = ',')]
    pub cors_origin: Vec<String>,
    /// Measure the device for the planner at the start, once for a data folder, rather than at the first plan
    #[arg(long, env = "CLOUDCHAMBER_CALIBRATE", default_value_t = true, action = clap::ArgAction::Set)]
    pub calibrate: bool,
    /// Milliseconds that running renders get after SIGTERM
    #[arg(long, env = "CLOUDCHAMBER_DRAIN_MS", default_value_t = 10_000)]
    pub drain_ms: u64,
    /// Milliseconds that a request's body may take to arrive without a byte
    #[arg(long, env = "CLOUDCHAMBER_REQUEST_TIMEOUT_MS", default_value_t = 30_000)]
    pub request_timeout_ms: u64,
}

impl Config {
    /// The time that running renders get after SIGTERM.
    pub fn drain(&self) -> Duration {
        Duration::from_millis(self.drain_ms)
    }
}
