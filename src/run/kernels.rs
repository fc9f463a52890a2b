//! The state of all kernel variants, and the processes that compile them while the device works.
//!
//! PoCL compiles one kernel at a time in a process, delays launches meanwhile, and takes the process with it if LLVM gives up. So processes of this
//! program (`compile.rs`) fill PoCL's cache, from which a variant is built in a moment. A request waits for the variant that it needs, which is
//! compiled before those that are only likely to be asked for.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use super::compile::Compiler;
use crate::device::program::Variant;
use crate::error::{Error, Result};
use crate::job::KernelProgress;

/// The number of processes that compile at the same time, on machines that have the cores.
const MOST_PROCESSES: usize = 4;

/// The state of a variant.
#[derive(Debug, Clone, PartialEq)]
enum Status {
    /// It is in the queue.
    Asked,
    /// A process compiles it.
    AtWork,
    /// It can be built in a moment, or is built.
    Compiled,
    Failed,
}

#[derive(Default)]
struct State {
    /// The variants that requests wait for, then those that are likely to be asked for.
    queue: VecDeque<Variant>,
    status: HashMap<Variant, Status>,
    closed: bool,
}

impl State {
    fn take(&mut self) -> Option<Variant> {
        let variant = self.queue.pop_front()?;
        self.status.insert(variant, Status::AtWork);
        Some(variant)
    }
}

/// The state with its lock. The threads that each have a compiling process share it.
#[derive(Clone, Default)]
pub(super) struct Kernels {
    shared: Arc<(Mutex<State>, Condvar)>,
}

impl Kernels {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.shared.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Lets processes of `compiler` compile the variants that are asked for. They call `wake` after each.
    ///
    /// # Errors
    /// [`Error::Internal`] when no thread can be started.
    pub fn start(&self, compiler: &Compiler, wake: impl Fn() + Send + Clone + 'static) -> Result<()> {
        let processes = std::thread::available_parallelism().map_or(1, usize::from).min(MOST_PROCESSES);
        for number in 0..processes {
            let (kernels, compiler, wake) = (self.clone(), compiler.clone(), wake.clone());
            let work = move || {
                let mut process = None;
                while let Some(variant) = kernels.next() {
                    let outcome = compiler.compile(&mut process, &variant);
                    if let Err(cause) = &outcome {
                        tracing::error!(kernel = variant.label(), cause, "a kernel does not build");
                    }
                    kernels.set(&variant, outcome.is_ok());
                    wake();
                    // An idle process would keep a compiler's memory for nothing.
                    if kernels.is_idle() {
                        process = None;
                    }
                }
            };
            std::thread::Builder::new().name(format!("compile-{number}")).spawn(work).map_err(Error::internal)?;
        }
        Ok(())
    }

    fn is_idle(&self) -> bool {
        self.lock().queue.is_empty()
    }

    /// The next variant to compile, if there is one.
    pub fn take(&self) -> Option<Variant> {
        self.lock().take()
    }

    /// The next variant to compile; `None` when the device is gone.
    fn next(&self) -> Option<Variant> {
        let mut state = self.lock();
        loop {
            if state.closed {
                return None;
            }
            if let Some(variant) = state.take() {
                return Some(variant);
            }
            state = self.shared.1.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Asks for a variant to be compiled. An urgent one comes first.
    pub fn ask(&self, variant: &Variant, urgent: bool) {
        let mut state = self.lock();
        match state.status.get(variant) {
            None => state.queue.push_back(*variant),
            Some(Status::Asked) => {}
            Some(_) => return,
        }
        state.status.insert(*variant, Status::Asked);
        if urgent {
            state.queue.retain(|other| other != variant);
            state.queue.push_front(*variant);
        }
        drop(state);
        self.shared.1.notify_one();
    }

    /// Notes that a variant is compiled, or that it does not compile.
    pub fn set(&self, variant: &Variant, compiled: bool) {
        let status = if compiled { Status::Compiled } else { Status::Failed };
        let mut state = self.lock();
        state.queue.retain(|other| other != variant);
        state.status.insert(*variant, status);
    }

    /// True if a variant is compiled, false if it does not compile; `None` while that is not known.
    pub fn is_compiled(&self, variant: &Variant) -> Option<bool> {
        match self.lock().status.get(variant) {
            Some(Status::Compiled) => Some(true),
            Some(Status::Failed) => Some(false),
            _ => None,
        }
    }

    /// The progress of the compilation.
    pub fn progress(&self) -> KernelProgress {
        let state = self.lock();
        let with = |wanted: Status| state.status.iter().filter(move |(_, s)| **s == wanted);
        let mut failed: Vec<String> = with(Status::Failed).map(|(v, _)| v.label()).collect();
        failed.sort();
        KernelProgress { built: with(Status::Compiled).count(), of: state.status.len(), failed }
    }

    /// Ends the processes.
    pub fn close(&self) {
        self.lock().closed = true;
        self.shared.1.notify_all();
    }
}
