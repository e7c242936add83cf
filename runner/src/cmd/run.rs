//! `atoll run`: a scene from start to end.

use crate::args::RunArgs;
use crate::backend;
use crate::config::Config;
use crate::drive::Observer;
use crate::error::{Exit, RunError};
use crate::interrupt::StopFlag;
use crate::output::WholeFile;
use crate::plan::Plan;
use crate::progress::Show;
use crate::timings;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use tracing::warn;

/// Does it, with everything that can be refused refused before anything heavy starts.
///
/// # Errors
/// Whatever ended it without a summary, or with one that fails a check or cannot be written.
pub fn run(args: &RunArgs) -> Result<Exit, RunError> {
    let config = Config::load(&args.config, &args.overrides()?)?;
    let [json, timings] = output_files(args)?;
    let stop = StopFlag::on_signals().unwrap_or_else(|error| {
        warn!("interrupts will end the run without a summary: {error}");
        StopFlag::default()
    });
    let plan = Plan::new(&config)?;
    for note in plan.notes() {
        eprintln!("atoll: {note}");
    }

    let show = if args.quiet { Show::Nothing } else { Show::OnStderr };
    let summary = backend::run(&plan, &Observer { show, stop })?;
    // All are tried before any is complained about: the one may save what another lost.
    let json = json.map_or(Ok(()), |file| file.write(&summary.to_json()));
    let timings = timings.map_or(Ok(()), |file| file.write(timings::to_csv(&summary.timings).as_bytes()));
    let shown = match write!(io::stdout(), "{summary}") {
        // A reader that has seen enough, as in `atoll run ... | head`, is not a failure.
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(RunError::Output { path: PathBuf::from("standard output"), reason: error.to_string() })
        }
        _ => Ok(()),
    };
    json.and(timings).and(shown)?;

    if summary.bodies_lost != 0 {
        let found = summary.bodies.wrapping_add_signed(-summary.bodies_lost);
        return Err(RunError::BodiesLost { expected: summary.bodies, found });
    }
    Ok(if summary.interrupted { Exit::Interrupted } else { Exit::Done })
}

/// Where the summary and the timings are to go, checked.
fn output_files(args: &RunArgs) -> Result<[Option<WholeFile>; 2], RunError> {
    let check = |option, path: Option<&Path>| path.map(|path| WholeFile::check(option, path)).transpose();
    let (json, timings) = (args.json.as_deref(), args.timings.as_deref());
    if let Some(path) = timings.filter(|_| json == timings) {
        let reason = "--json writes to the same file".to_owned();
        return Err(RunError::BadOutput { option: "--timings", path: path.to_owned(), reason });
    }
    Ok([check("--json", json)?, check("--timings", timings)?])
}
