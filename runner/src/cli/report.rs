//! `atoll report`: a page about one run, or two side by side.

use super::args::ReportArgs;
use super::console::complain;
use super::output::{Kept, WholeFile};
use super::progress::{Progress, Show};
use crate::error::{Exit, RunError};
use crate::look::report::Report;
use std::io::{self, IsTerminal};

/// Does it.
///
/// # Errors
/// If a folder holds no run, what is there cannot be read, or the page cannot be written.
pub(super) fn run(args: &ReportArgs) -> Result<Exit, RunError> {
    let options = [("--out", Some(args.out.as_path()))];
    Kept { runs: args.runs.iter().map(|run| run.as_path()).collect(), ..Kept::default() }.check(options)?;
    let [page] = WholeFile::check_all(options)?;
    // On a terminal only: comparing takes seconds, and a log has no use for that.
    let show = if io::stderr().is_terminal() { Show::OnStderr } else { Show::Nothing };
    let mut progress = None;
    let report = Report::read(&args.runs, |done, of| {
        progress.get_or_insert_with(|| Progress::new(show, 0, of as u64)).made(done as u64);
    });
    if let Some(progress) = progress {
        progress.finish();
    }
    let report = report?;
    report.notes().for_each(|note| complain(&note));
    page.map_or(Ok(()), |page| page.write(report.to_html().as_bytes()))?;
    Ok(Exit::Done)
}
