//! Parts of a test in processes of their own: PoCL compiles one kernel at a time in each, and a machine has more cores.

use std::process::{Command, Stdio};

const PART: &str = "CLOUDCHAMBER_TEST_PART";

/// Does `work` for every part of the test of this name, all at once.
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
