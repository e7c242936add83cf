//! `atoll diff`: whether two runs recorded the same.

use super::args::DiffArgs;
use super::console::complain;
use super::output::{self, Kept, WholeFile};
use super::progress::{Progress, Show};
use crate::error::{Exit, RunError};
use crate::folder::Ended;
use crate::look::compare;
use std::io::{self, IsTerminal};

/// Does it.
///
/// # Errors
/// Whatever keeps it from an answer, or the answer from being written.
pub(super) fn run(args: &DiffArgs) -> Result<Exit, RunError> {
    let options = [("--json", args.json.as_deref()), ("--plot", args.plot.as_deref())];
    Kept { runs: vec![&args.a, &args.b], ..Kept::default() }.check(options)?;
    let [json, plot] = WholeFile::check_all(options)?;

    for run in [&args.a, &args.b] {
        if let Err(error) = Ended::read(run) {
            complain(&error.counts_as_missing());
        }
    }
    // On a terminal only: it takes seconds, and a log has no use for that.
    let show = if io::stderr().is_terminal() { Show::OnStderr } else { Show::Nothing };
    let mut progress = None;
    let compared = compare::compare(&args.a, &args.b, args.tolerance, |done, of| {
        progress.get_or_insert_with(|| Progress::new(show, 0, of as u64)).made(done as u64);
    });
    if let Some(progress) = progress {
        progress.finish();
    }
    let comparison = compared?;

    // All are tried before any is complained about.
    let json = json.map_or(Ok(()), |file| file.write(&comparison.to_json()));
    let plot = plot.map_or(Ok(()), |file| file.write(compare::svg(&comparison).as_bytes()));
    let shown = output::show(&comparison);
    json.and(plot).and(shown)?;
    Ok(if comparison.same { Exit::Done } else { Exit::Differs })
}
