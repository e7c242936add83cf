//! `atoll run`: a scene from start to end.

use crate::args::RunArgs;
use crate::backend;
use crate::config::Config;
#[cfg(any(feature = "iceoryx2", feature = "mpi"))]
use crate::config::TransportKind;
use crate::drive::Observer;
use crate::error::{Exit, RunError};
use crate::interrupt::StopFlag;
use crate::output::{self, WholeFile};
use crate::plan::Plan;
use crate::progress::Show;
use crate::summary::Summary;
use crate::telemetry::complain;
use crate::timings;
use std::path::Path;

/// Does it, with everything that can be refused refused before anything heavy starts.
///
/// # Errors
/// Whatever ended it without a summary, or with one that fails a check or cannot be written.
pub fn run(args: &RunArgs) -> Result<Exit, RunError> {
    #[cfg(feature = "iceoryx2")]
    if let Some(rank) = backend::iceoryx2::RankProcess::of_this() {
        return Ok(rank.run(load(args), observer(args)));
    }
    let config = load(args);
    #[cfg(feature = "mpi")]
    if is_for_mpi(args, &config) {
        return over_mpi(args, config);
    }
    let config = config?;
    let outputs = Outputs::check(args)?;
    let plan = Plan::new(&config)?;
    tell(&plan);
    #[cfg(feature = "iceoryx2")]
    if plan.transport == TransportKind::Iceoryx2 {
        return conclude(&backend::iceoryx2::run(&plan, config_path(args))?, &outputs);
    }
    let stop = StopFlag::on_signals(true, || std::process::exit(Exit::Interrupted as i32));
    let summary = backend::run(&plan, &Observer { stop, ..observer(args) })?;
    conclude(&summary, &outputs)
}

fn load(args: &RunArgs) -> Result<Config, RunError> {
    Ok(Config::load(config_path(args), &args.overrides()?)?)
}

fn config_path(args: &RunArgs) -> &Path {
    args.config.as_deref().or(args.resume.as_deref()).unwrap_or(Path::new(""))
}

fn observer(args: &RunArgs) -> Observer {
    let show = if args.quiet { Show::Nothing } else { Show::OnStderr };
    Observer { show, panic_at: args.panic_at, ..Observer::default() }
}

/// What the user may want to know before the run starts.
fn tell(plan: &Plan) {
    for note in plan.notes() {
        complain(&note);
    }
}

/// Whether ranks are to be joined by MPI. Where the configuration cannot be read, the command line says so, or that a
/// launcher started this process among others: then the ranks meet to complain once.
#[cfg(feature = "mpi")]
fn is_for_mpi(args: &RunArgs, config: &Result<Config, RunError>) -> bool {
    match config {
        Ok(config) => config.transport() == TransportKind::Mpi,
        Err(_) => args.transport.as_deref() == Some(TransportKind::Mpi.name()) || backend::mpi::Job::is_launched(),
    }
}

/// Runs this process as a rank of an MPI job.
#[cfg(feature = "mpi")]
fn over_mpi(args: &RunArgs, config: Result<Config, RunError>) -> Result<Exit, RunError> {
    let mut job = backend::mpi::Job::join()?;
    let speaks = job.speaks();
    let prepared = config.and_then(|config| {
        let plan = Plan::new(&job.adapt(config)?)?;
        // Only the rank that speaks writes.
        let outputs = if speaks { Outputs::check(args)? } else { Outputs::default() };
        Ok((plan, outputs))
    });
    let (plan, outputs) = job.agree(prepared, |(plan, _)| plan)?;
    if speaks {
        tell(&plan);
    }
    // Silently: the launcher sends signals of its own when it ends a job.
    let stop = StopFlag::on_signals(false, || backend::mpi::Job::quit());
    let concluded = match job.run(&plan, &Observer { stop, ..observer(args) })? {
        Some(summary) => conclude(&summary, &outputs),
        None => Ok(Exit::Done),
    };
    job.close();
    concluded
}

/// Shows and writes what became of a run, and says with which exit code to end.
fn conclude(summary: &Summary, outputs: &Outputs) -> Result<Exit, RunError> {
    // All are tried before any is complained about: the one may save what another lost.
    let json = outputs.json.as_ref().map_or(Ok(()), |file| file.write(&summary.to_json()));
    let timings =
        outputs.timings.as_ref().map_or(Ok(()), |file| file.write(timings::to_csv(&summary.timings).as_bytes()));
    let shown = output::show(summary);
    json.and(timings).and(shown)?;

    if summary.bodies_lost != 0 {
        let found = summary.bodies.wrapping_add_signed(-summary.bodies_lost);
        return Err(RunError::BodiesLost { expected: summary.bodies, found });
    }
    Ok(if summary.interrupted { Exit::Interrupted } else { Exit::Done })
}

/// The files to write when the run is over.
#[derive(Default)]
struct Outputs {
    json: Option<WholeFile>,
    timings: Option<WholeFile>,
}

impl Outputs {
    /// Where the summary and the timings are to go, checked.
    fn check(args: &RunArgs) -> Result<Self, RunError> {
        let check = |option, path: Option<&Path>| path.map(|path| WholeFile::check(option, path)).transpose();
        let (json, timings) = (args.json.as_deref(), args.timings.as_deref());
        if let Some(path) = timings.filter(|_| json == timings) {
            let reason = "--json writes to the same file".to_owned();
            return Err(RunError::BadOutput { option: "--timings", path: path.to_owned(), reason });
        }
        Ok(Self { json: check("--json", json)?, timings: check("--timings", timings)? })
    }
}
