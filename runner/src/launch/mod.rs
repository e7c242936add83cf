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

use crate::config::TransportKind;
use crate::error::RunError;
use crate::plan::Plan;
use crate::rank::Observer;
use crate::summary::Summary;
pub(crate) use fit::fit;
#[cfg(feature = "mpi")]
pub(crate) use fit::fit_job;
use outcome::{Ends, outcome};
use std::sync::atomic::Ordering;

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
