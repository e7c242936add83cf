//! What goes to stderr: complaints, how far a run has come, and log lines as `RUST_LOG` asks for.

use super::progress::{Progress, Show};
use crate::error::RunError;
use crate::rank::Listener;
use crate::rank::trace::Spans;
use crate::wording::OneLine;
use std::env::{self, VarError};
use std::fmt::Display;
use std::io::{IsTerminal, Write};
use std::sync::{Mutex, PoisonError};
use tracing_subscriber::filter::{LevelFilter, ParseError, Targets};
use tracing_subscriber::prelude::*;

/// What says which log lines are written: `warn`, `atoll=debug`, `off,atoll::rank=trace`.
const FILTER: &str = "RUST_LOG";

/// Starts logging: warnings and errors, or what `RUST_LOG` says. With `traces`, spans can be traced as well, whatever it says.
///
/// # Errors
/// If `RUST_LOG` cannot be understood.
pub(super) fn init(traces: bool) -> Result<(), RunError> {
    let filter = match env::var(FILTER) {
        Ok(value) => {
            value.parse().map_err(|error: ParseError| RunError::LogFilter { value, reason: format!("{error}") })?
        }
        Err(VarError::NotPresent) => Targets::new().with_default(LevelFilter::WARN),
        Err(VarError::NotUnicode(value)) => {
            let reason = "not valid Unicode".to_owned();
            return Err(RunError::LogFilter { value: value.to_string_lossy().into_owned(), reason });
        }
    };
    let stderr = std::io::stderr;
    let lines = tracing_subscriber::fmt::layer().with_ansi(stderr().is_terminal()).with_writer(stderr);
    // Fails only where a subscriber is already in place, which then serves as well.
    let _ = if traces {
        tracing_subscriber::registry().with(lines.with_filter(filter)).with(Spans::layer()).try_init()
    } else {
        tracing_subscriber::registry().with(lines).with(filter).try_init()
    };
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
