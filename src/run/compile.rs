//! Processes of this program that compile kernels into PoCL's cache: their start, their protocol and their work.
//!
//! The server writes a variant's label on a line, and the process answers on a line: `null`, or the compiler's message. A process that dies has met
//! something that LLVM cannot compile; the next variant gets a new process.

use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdout, Command, Stdio};

use super::sources;
use super::warm::warm;
use crate::device::program::Variant;
use crate::device::{self, Device, DeviceConfig};
use crate::error::{Error, Result};

/// The command that starts such a process: this program, with the flags that make its kernels those of the server.
#[derive(Debug, Clone)]
pub(super) struct Compiler {
    program: PathBuf,
    flags: Vec<String>,
}

/// A process at work.
pub(super) struct Process {
    child: Child,
    lines: std::io::Lines<BufReader<ChildStdout>>,
}

impl Drop for Process {
    fn drop(&mut self) {
        // The process may have ended by itself, which is no fault.
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

impl Compiler {
    /// The compiler for a device that was opened with `config` and this number of lanes; `None` if the configuration names no program.
    pub fn of(config: &DeviceConfig, lanes: u32) -> Option<Self> {
        let program = config.compiler.clone()?;
        let mut flags = vec![format!("--device={}", config.target), format!("--lanes={lanes}")];
        flags.extend(config.images.map(|images| format!("--volume-images={images}")));
        flags.extend(config.kernels.as_ref().map(|folder| format!("--kernels={}", folder.display())));
        Some(Self { program, flags })
    }

    fn start(&self) -> std::io::Result<Process> {
        let mut command = Command::new(&self.program);
        command.arg("compile").args(&self.flags).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn()?;
        let lines = child.stdout.take().ok_or_else(|| std::io::Error::other("no output"))?;
        Ok(Process { child, lines: BufReader::new(lines).lines() })
    }

    /// Compiles a variant in `process`, and starts the process if there is none. If no process can be started, the variant is not at fault: it is
    /// then built where it is used.
    pub fn compile(&self, process: &mut Option<Process>, variant: &Variant) -> std::result::Result<(), String> {
        if process.is_none() {
            match self.start() {
                Ok(started) => *process = Some(started),
                Err(cause) => {
                    tracing::warn!(%cause, "no process can be started; kernels are compiled by the server itself");
                    return Ok(());
                }
            }
        }
        let Some(Process { child, lines }) = process else { return Ok(()) };
        let asked = child.stdin.as_mut().map(|input| writeln!(input, "{}", variant.label()));
        let answer = match asked {
            Some(Ok(())) => lines.next().and_then(std::result::Result::ok),
            _ => None,
        };
        match answer.as_deref().map(serde_json::from_str::<Option<String>>) {
            Some(Ok(None)) => Ok(()),
            Some(Ok(Some(words))) => Err(words),
            _ => {
                *process = None;
                Err("the compiler crashed".into())
            }
        }
    }
}

/// The work of such a process: it reads labels, one a line, and compiles their variants, until there are no more.
///
/// # Errors
/// [`Error::Internal`] when the device cannot be opened or the pipe breaks.
pub fn compile_kernels(config: &DeviceConfig) -> Result<()> {
    device::give_way();
    let mut device = Device::open(config)?;
    let all: Vec<Variant> = sources::sources().flat_map(|s| (s.variants)()).collect();
    for line in std::io::stdin().lines() {
        let label = line.map_err(Error::internal)?;
        let outcome = match all.iter().find(|v| v.label() == label) {
            Some(variant) => warm(&mut device, variant),
            None => Err(Error::internal("there is no such kernel")),
        };
        let said = serde_json::to_string(&outcome.err().map(|e| e.to_string())).map_err(Error::internal)?;
        // The server may have gone, which is no failure.
        if writeln!(std::io::stdout(), "{said}").is_err() {
            break;
        }
    }
    Ok(())
}
