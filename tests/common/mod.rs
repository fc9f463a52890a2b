//! The common part of the tests: the real binary as a server on a free port, a client, and the real scans.

#![allow(dead_code, reason = "each test file uses its own part of this")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test says what is wrong by panicking")]

pub mod engine;
pub mod light;
pub mod picture;
pub mod pictures;
pub mod processes;
pub mod writers;

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// An object with more fields, or with other values in their place.
pub fn with(object: &serde_json::Value, more: &serde_json::Value) -> serde_json::Value {
    let mut all = object.clone();
    all.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    all
}

/// A `cloudchamber serve` with a data folder of its own. It is stopped when dropped.
pub struct Server {
    child: Child,
    url: String,
    pub data: tempfile::TempDir,
}

/// The cache of compiled kernels. All tests have one, since the kernels are the same for each.
pub fn kernel_cache() -> PathBuf {
    std::env::var_os("POCL_CACHE_DIR")
        .map_or_else(|| PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("kernels"), PathBuf::from)
}

/// The lock for opening a device of this process: OpenCL's loader and PoCL then start up, which they can do for one thread at a time. The first
/// caller has PoCL keep its compiled kernels in the tests' cache, for which it changes the environment.
pub fn opening() -> MutexGuard<'static, ()> {
    static KEPT: Mutex<bool> = Mutex::new(false);
    static OPENING: Mutex<()> = Mutex::new(());
    let held = OPENING.lock().unwrap_or_else(PoisonError::into_inner);
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if !std::mem::replace(&mut *kept, true) {
        cloudchamber::device::keep_compiled_kernels_in(&kernel_cache()).unwrap();
    }
    held
}

/// Reports the parts that a passing test has skipped. The macros that print would be silenced.
pub fn say(words: &str) {
    use std::io::Write;
    drop(writeln!(std::io::stderr(), "{words}"));
}

/// A folder of kernels in place of the binary's, such as those of an earlier commit.
pub fn kernels() -> Option<PathBuf> {
    std::env::var_os("CLOUDCHAMBER_KERNELS").map(PathBuf::from)
}

impl Server {
    /// A server with the default settings.
    pub fn start() -> Self {
        Self::start_with(&[])
    }

    /// A server with further flags, once it is ready.
    pub fn start_with(flags: &[&str]) -> Self {
        Self::start_env(flags, &[])
    }

    fn once_ready(self) -> Self {
        let started = Instant::now();
        while !self.is_ready() {
            assert!(started.elapsed() < Duration::from_secs(180), "the server is not ready after three minutes");
            std::thread::sleep(Duration::from_millis(50));
        }
        self
    }

    /// A server with further flags and environment variables, once it is ready.
    pub fn start_env(flags: &[&str], environment: &[(&str, &str)]) -> Self {
        Self::spawn_env(flags, environment).once_ready()
    }

    /// Waits until nothing is left to compile, so that times are the renders' own.
    pub fn once_compiled(self) -> Self {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let url = format!("{}/readyz", self.url);
        let is_compiled = || -> bool {
            let ready: serde_json::Value =
                runtime.block_on(async { reqwest::get(&url).await.unwrap().json().await.unwrap() });
            let kernels = &ready["kernels"];
            let failed = kernels["failed"].as_array().map_or(0, Vec::len) as u64;
            kernels["built"].as_u64().is_some_and(|built| Some(built + failed) == kernels["of"].as_u64())
        };
        while !is_compiled() {
            std::thread::sleep(Duration::from_millis(100));
        }
        self
    }

    /// A server that may not be ready yet.
    pub fn spawn(flags: &[&str]) -> Self {
        Self::spawn_env(flags, &[])
    }

    fn spawn_env(flags: &[&str], environment: &[(&str, &str)]) -> Self {
        Self::spawn_program(Path::new(env!("CARGO_BIN_EXE_cloudchamber")), flags, environment)
    }

    /// A server of another build, once it is ready.
    pub fn start_program(program: &Path, environment: &[(&str, &str)]) -> Self {
        Self::spawn_program(program, &[], environment).once_ready()
    }

    fn spawn_program(program: &Path, flags: &[&str], environment: &[(&str, &str)]) -> Self {
        let data = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(kernel_cache()).unwrap();
        let mut child = Command::new(program)
            .args(["serve", "--listen", "127.0.0.1:0", "--data-dir"])
            .arg(data.path())
            .args(flags)
            .env("POCL_CACHE_DIR", kernel_cache())
            .env("CLOUDCHAMBER_CALIBRATE", "false")
            .envs(environment.iter().copied())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let first = lines.next().unwrap().unwrap();
        let url = first.split_whitespace().last().unwrap().to_owned();
        assert!(url.starts_with("http://127.0.0.1:"), "the server said: {first}");
        // Everything else that it prints must be read, or it would block.
        std::thread::spawn(move || lines.map_while(Result::ok).for_each(|line| eprintln!("server: {line}")));
        Self { child, url, data }
    }

    /// The address of the server, such as `http://127.0.0.1:40000`.
    pub fn url(&self) -> String {
        self.url.clone()
    }

    /// The address as `host:port`.
    pub fn address(&self) -> String {
        self.url.trim_start_matches("http://").to_owned()
    }

    fn is_ready(&self) -> bool {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let url = format!("{}/readyz", self.url);
        std::thread::spawn(move || runtime.block_on(async { reqwest::get(url).await.is_ok_and(|r| r.status() == 200) }))
            .join()
            .unwrap()
    }

    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// The resident memory in bytes.
    pub fn resident_bytes(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.pid())).unwrap();
        let line = status.lines().find(|l| l.starts_with("VmRSS:")).unwrap();
        line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() * 1024
    }

    /// Sends SIGTERM.
    pub fn terminate(&self) {
        assert!(Command::new("kill").args(["-TERM", &self.pid().to_string()]).status().unwrap().success());
    }

    /// Waits for its end and returns the exit code.
    pub fn wait(&mut self) -> Option<i32> {
        self.child.wait().unwrap().code()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

/// The MRI head of Debian's `mricron-data`.
pub fn mri_head() -> Vec<u8> {
    let path =
        std::env::var("CLOUDCHAMBER_TEST_MRI").unwrap_or_else(|_| "/usr/share/mricron/templates/ch2.nii.gz".into());
    std::fs::read(&path).unwrap_or_else(|e| panic!("{path}: {e}; install mricron-data or set CLOUDCHAMBER_TEST_MRI"))
}

/// The CT head for trials, if it is there.
pub fn ct_head() -> Option<Vec<u8>> {
    std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/CT_AVM.nii.gz")).ok()
}
