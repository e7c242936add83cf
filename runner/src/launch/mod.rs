//! Starts the ranks on the transport that was chosen, waits for them, and makes one outcome of theirs.
//!
//! Where ranks are threads, [`run`] does all of it. Where they are processes, each of them is this program: see
//! [`crate::cli`].

mod fit;
#[cfg(feature = "iceoryx2")]
pub(crate) mod iceoryx2;
mod in_process;
#[cfg(feature = "mpi")]
pub(crate) mod mpi;
mod outcome;
#[cfg(feature = "iceoryx2")]
mod rank_report;

use crate::config::{Config, TransportKind};
use crate::error::RunError;
use crate::plan::Plan;
use crate::rank::Observer;
use crate::summary::Summary;
use atoll_transport::{Rank, launched};
pub(crate) use fit::fit;
#[cfg(feature = "mpi")]
pub(crate) use fit::fit_job;
use outcome::{Ends, outcome};
use std::sync::atomic::Ordering;
use std::thread;
use std::time::Duration;

/// What a process that may be one of many which have the same to say leaves to the first of them.
const TIME_TO_SPEAK: Duration = Duration::from_secs(5);

/// Whether a launcher of MPI started this process to join others.
#[cfg(feature = "mpi")]
pub(crate) fn is_launched() -> bool {
    launched().is_some_and(|launched| launched.is_joint)
}

/// Refuses a run that does not say on what, and would be made by each of the processes that a launcher of MPI started.
///
/// # Errors
/// If it is such a one.
pub(crate) fn check_alone(config: &Config) -> Result<(), RunError> {
    match launched() {
        Some(launched) if launched.is_joint && config.run.transport.is_none() => {
            // The launcher ends all when one has ended.
            if launched.rank != Rank(0) {
                thread::sleep(TIME_TO_SPEAK);
            }
            let build = if TransportKind::Mpi.is_built_in() { "" } else { "build with --features mpi and " };
            Err(RunError::Ranks(format!(
                "an MPI launcher started {} processes, and this one would make the whole run by itself: {build}add \
                 --transport mpi, or --transport {} if that is what you want",
                launched.size,
                config.transport().name()
            )))
        }
        _ => Ok(()),
    }
}

/// Runs a plan whose ranks are threads of this process.
///
/// # Errors
/// The one that ended the run, whichever and however many ranks it ended.
pub fn run(plan: &Plan, observer: &Observer) -> Result<Summary, RunError> {
    let ends = match plan.transport {
        TransportKind::Local => in_process::local(plan, observer),
        TransportKind::Channel => in_process::channel(plan, observer),
        TransportKind::Iceoryx2 | TransportKind::Mpi => {
            return Err(RunError::NeedsProcesses { transport: plan.transport.name() });
        }
    };
    outcome(plan, ends, observer.complete.load(Ordering::Relaxed)).inspect_err(|error| observer.fail(error))
}
