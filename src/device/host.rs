//! The process around OpenCL: its end, its priority, and PoCL's cache folder.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Ends the process without running destructors. PoCL's and LLVM's would destroy objects that the device's thread may still be compiling with, and
/// the process would crash.
pub fn leave(code: i32) -> ! {
    use std::io::Write;
    // A pipe without a reader cannot be flushed; the process ends all the same.
    let _ = std::io::stdout().flush();
    // SAFETY: the call takes a number and does not return; files are written through, and no lock matters to a process that ends.
    unsafe { libc::_exit(code) }
}

/// Lowers this process's priority: a process that compiles ahead must not delay one that renders.
pub fn give_way() {
    // SAFETY: the call takes numbers only; a failure changes nothing but the order of work.
    unsafe { libc::setpriority(libc::PRIO_PROCESS, 0, 5) };
}

/// Runs a file that was written just now. A process that another thread starts meanwhile holds it open for writing until its own program begins, as
/// in tests; until then nobody may run it.
fn run_when_free(file: &Path) -> std::io::Result<std::process::ExitStatus> {
    const TRIES: usize = 100;
    let is_busy = |e: &std::io::Error| e.kind() == std::io::ErrorKind::ExecutableFileBusy;
    for _ in 1..TRIES {
        match std::process::Command::new(file).status() {
            Err(e) if is_busy(&e) => std::thread::sleep(std::time::Duration::from_millis(5)),
            other => return other,
        }
    }
    std::process::Command::new(file).status()
}

/// Sets the folder of PoCL's compiled kernels to `cache`, unless the environment names one already, and checks that code in it can be run: PoCL
/// itself would crash later. Call it before any thread is started and before OpenCL is first used.
///
/// # Errors
/// [`Error::Internal`] if the folder cannot be made, or is on a file system mounted `noexec`.
pub fn keep_compiled_kernels_in(cache: &Path) -> Result<()> {
    let cache = std::env::var_os("POCL_CACHE_DIR").map_or_else(|| cache.to_owned(), PathBuf::from);
    let said = |e: std::io::Error| Error::internal(format!("kernel cache {}: {e}", cache.display()));
    std::fs::create_dir_all(&cache).map_err(said)?;
    let probe = cache.join(format!("probe-{}", std::process::id()));
    std::fs::write(&probe, "#!/bin/sh\nexit 0\n").map_err(said)?;
    let runs = std::fs::set_permissions(&probe, std::os::unix::fs::PermissionsExt::from_mode(0o700))
        .and_then(|()| run_when_free(&probe));
    std::fs::remove_file(&probe).map_err(said)?;
    if let Err(cause) = runs {
        return Err(Error::internal(format!(
            "kernel cache {}: nothing can be run from there ({cause})",
            cache.display()
        )));
    }
    // SAFETY: main calls this before any other thread exists, so nobody reads the environment at the same time.
    unsafe { std::env::set_var("POCL_CACHE_DIR", cache) };
    Ok(())
}
