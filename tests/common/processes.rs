//! Parts of a test in processes of their own. PoCL compiles one kernel at a time in each process, and a machine has more cores.

use std::process::{Command, Stdio};

const PART: &str = "CLOUDCHAMBER_TEST_PART";

/// The environment in which this program's OpenCL is oclgrind, which logs to `log`. oclgrind exits with 0 even if its log has errors, and without
/// the dylib's path PoCL would run in its place.
pub fn oclgrind_environment(log: &std::path::Path) -> Vec<(&'static str, std::ffi::OsString)> {
    vec![
        ("OPENCL_DYLIB_PATH", "/usr/lib/oclgrind/liboclgrind-rt.so".into()),
        ("OCLGRIND_LOG", log.into()),
        ("OCLGRIND_DATA_RACES", "1".into()),
        // Inlining leaves an intrinsic in the code that oclgrind 21.10 does not know.
        ("OCLGRIND_BUILD_OPTIONS", "-cl-opt-disable".into()),
    ]
}

/// Does `work`, which is the test with this name, in a process under oclgrind, and returns its log.
pub fn under_oclgrind(test: &str, work: impl FnOnce()) -> String {
    const INNER: &str = "CLOUDCHAMBER_TEST_OCLGRIND";
    if std::env::var_os(INNER).is_some() {
        work();
        return String::new();
    }
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log");
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args([test, "--exact", "--nocapture"]).env(INNER, "1").envs(oclgrind_environment(&log));
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && said.contains("1 passed"), "{said}{}", String::from_utf8_lossy(&output.stderr));
    std::fs::read_to_string(log).unwrap_or_default()
}

/// True in the process of a part.
pub fn is_part() -> bool {
    std::env::var_os(PART).is_some()
}

/// Does `work` for every part of the test with this name, all at once.
pub fn in_processes(test: &str, parts: &[&str], work: impl FnOnce(&str)) {
    if let Ok(part) = std::env::var(PART) {
        return work(&part);
    }
    let exe = std::env::current_exe().unwrap();
    let start = |part: &str| {
        let mut command = Command::new(&exe);
        command.args([test, "--exact", "--nocapture"]).env(PART, part);
        (part.to_owned(), command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap())
    };
    let running: Vec<_> = parts.iter().copied().map(start).collect();
    for (part, child) in running {
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{test}, {part}:\n{said}{}", String::from_utf8_lossy(&output.stderr));
        assert!(said.contains("1 passed"), "{test}, {part}: there is no such test:\n{said}");
    }
}
