//! `atoll export`: what a run has recorded, as files for other programs.

use super::args::ExportArgs;
use super::console::complain;
use super::interrupt::stop_on_signals;
use super::output::{self, Kept};
use super::progress::{Progress, Show};
use crate::error::{Exit, RunError};
use crate::look::recorded::Recorded;
use crate::look::source::records;
use crate::look::vtk;
use crate::wording::{between, plural};
use std::io::{self, IsTerminal};

/// Does it.
///
/// # Errors
/// If there is no recording to read, or it cannot be written.
pub(super) fn run(args: &ExportArgs) -> Result<Exit, RunError> {
    let recorded = Recorded::open(&args.run)?;
    recorded.recording().damage().iter().for_each(|damage| complain(damage));
    let shown = records(&recorded, args.every)?;
    Kept { runs: vec![&args.run], ..Kept::default() }.check([("--vtk", Some(args.vtk.as_path()))])?;
    // On a terminal only: a log has no use for that.
    let show = if io::stderr().is_terminal() { Show::OnStderr } else { Show::Nothing };
    let mut progress = None;
    // However often it is interrupted, the record that is being written is the last.
    let stop = stop_on_signals(false, || {});
    let exported = vtk::export(&recorded, &args.vtk, shown, |done, of| {
        progress.get_or_insert_with(|| Progress::new(show, 0, of as u64)).made(done as u64);
        !stop.is_requested()
    });
    if let Some(progress) = progress {
        progress.finish();
    }
    let Some(vtk::Written { collection, steps, bodies: [fewest, most], bytes }) = exported? else {
        complain(&format!("interrupted: {} is not written", args.vtk.display()));
        return Ok(Exit::Interrupted);
    };
    let (first, last) = (steps.first().copied().unwrap_or(0), steps.last().copied().unwrap_or(0));
    output::show(&format!(
        "{} of {}, steps {first} to {last}, and {}, {:.2} MB: open {} in ParaView\n",
        plural(steps.len() as u64, "record"),
        between(fewest as u64, most as u64, "body"),
        plural(recorded.setting().statics.len() as u64, "static"),
        bytes as f64 * 1e-6,
        collection.display()
    ))?;
    Ok(Exit::Done)
}
