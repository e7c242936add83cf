//! Stopping a run early, so that all ranks end after the same step.

use crate::error::Exit;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A request to stop, shared by whoever may make it and every rank of this process.
#[derive(Clone, Default, Debug)]
pub struct StopFlag(Arc<AtomicBool>);

impl StopFlag {
    /// Asks the run to end after the step under way.
    pub fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether somebody asked.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// A flag that Ctrl-C, SIGTERM and SIGHUP raise. The second time, the process ends at once.
    ///
    /// # Errors
    /// If the process already handles these signals.
    pub fn on_signals() -> Result<Self, ctrlc::Error> {
        let flag = Self::default();
        let raised = flag.clone();
        ctrlc::set_handler(move || {
            if raised.0.swap(true, Ordering::Relaxed) {
                std::process::exit(Exit::Interrupted as i32);
            }
            eprintln!("atoll: stopping after this step; interrupt again to quit at once");
        })?;
        Ok(flag)
    }
}
