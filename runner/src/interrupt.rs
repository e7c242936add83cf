//! Stopping a run early, so that all ranks end after the same step.

use crate::telemetry::complain;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tracing::warn;

/// A request to stop, shared by whoever may make it and every rank of this process.
#[derive(Clone, Default, Debug)]
pub struct StopFlag {
    raised: Arc<AtomicBool>,
    /// Somebody else who may know of one.
    elsewhere: Option<fn() -> bool>,
}

impl StopFlag {
    /// Asks the run to end after the step under way.
    pub fn request(&self) {
        self.raised.store(true, Ordering::Relaxed);
    }

    /// Whether somebody asked.
    pub fn is_requested(&self) -> bool {
        self.raised.load(Ordering::Relaxed) || self.elsewhere.is_some_and(|requested| requested())
    }

    /// This flag, raised as well when `elsewhere` says so.
    pub fn asking(self, elsewhere: fn() -> bool) -> Self {
        Self { elsewhere: Some(elsewhere), ..self }
    }

    /// A flag that Ctrl-C, SIGTERM and SIGHUP raise. The second time, `quit` is called. Where these signals are handled
    /// already, the flag is one that nobody raises, and a warning says so. `announce` tells whether to say what happens.
    pub fn on_signals(announce: bool, quit: impl Fn() + Send + 'static) -> Self {
        let flag = Self::default();
        let raised = flag.clone();
        let handled = ctrlc::set_handler(move || {
            if raised.raised.swap(true, Ordering::Relaxed) {
                quit();
            } else if announce {
                complain(&"stopping after this step; interrupt again to quit at once");
            }
        });
        if let Err(error) = handled {
            warn!("interrupts will end the run without a summary: {error}");
        }
        flag
    }
}
