//! What goes to stderr: complaints, how far a run has come, and log lines as `RUST_LOG` asks for.

use super::progress::{Progress, Show};
use crate::config::OneLine;
use crate::error::RunError;
use crate::rank::Listener;
use std::env::{self, VarError};
use std::fmt::Display;
use std::io::{IsTerminal, Write};
use std::sync::{Mutex, PoisonError};
use tracing_subscriber::EnvFilter;

/// Starts logging: warnings and errors, or what `RUST_LOG` says.
///
/// # Errors
/// If `RUST_LOG` cannot be understood.
pub(super) fn init() -> Result<(), RunError> {
    let value = match env::var(EnvFilter::DEFAULT_ENV) {
        Ok(value) => value,
        Err(VarError::NotPresent) => "warn".to_owned(),
        Err(VarError::NotUnicode(value)) => {
            let reason = "not valid Unicode".to_owned();
            return Err(RunError::LogFilter { value: value.to_string_lossy().into_owned(), reason });
        }
    };
    let filter =
        EnvFilter::try_new(&value).map_err(|error| RunError::LogFilter { value, reason: error.to_string() })?;
    let stderr = std::io::stderr;
    let colored = stderr().is_terminal();
    // Fails only where a subscriber is already in place, which then serves as well.
    let _ = tracing_subscriber::fmt().with_env_filter(filter).with_ansi(colored).with_writer(stderr).try_init();
    Ok(())
}

/// Tells the user something on one line, whatever names and values the user has given.
pub(super) fn complain(error: &dyn Display) {
    // In one piece, so that nothing that others say comes between, and whether or not anybody listens.
    let line = format!("atoll: {}\n", OneLine(&error.to_string()));
    let _ = std::io::stderr().write_all(line.as_bytes());
}

/// Tells the user how a run goes.
#[derive(Debug)]
pub(super) struct Console {
    show: Show,
    progress: Mutex<Option<Progress>>,
}

impl Console {
    /// One that shows progress, or only complains.
    pub(super) fn new(show: Show) -> Self {
        Self { show, progress: Mutex::new(None) }
    }

    fn with<T>(&self, change: impl FnOnce(&mut Option<Progress>) -> T) -> T {
        change(&mut self.progress.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Listener for Console {
    fn begins(&self, from: u64, steps: u64) {
        self.with(|progress| *progress = Some(Progress::new(self.show, from, steps)));
    }

    fn made(&self, steps: u64) {
        self.with(|progress| progress.as_mut().map(|progress| progress.made(steps)));
    }

    fn ends(&self) {
        if let Some(progress) = self.with(Option::take) {
            progress.finish();
        }
    }

    fn note(&self, text: &str) {
        complain(&text);
    }
}
