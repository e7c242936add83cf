//! `atoll run`: a scene from start to end, or from where an earlier run came to.

use super::args::RunArgs;
use super::console::{Console, complain};
use super::drive::{self, Driver};
use super::interrupt::stop_on_signals;
use super::output::{self, Kept, WholeFile};
use super::progress::Show;
use super::view::Window;
use crate::command::Script;
use crate::config::Config;
#[cfg(any(feature = "iceoryx2", feature = "mpi"))]
use crate::config::TransportKind;
use crate::error::{Exit, RunError};
use crate::folder::{Claim, RunFolder};
use crate::launch;
use crate::plan::{Commands, Plan};
#[cfg(feature = "iceoryx2")]
use crate::rank::StopFlag;
use crate::rank::{Host, Observer, TraceSteps, check_commands, check_logs};
use crate::summary::{Summary, timings, trace};
use crate::wording::plural;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::{fs, io};

/// Does it, with everything that can be refused refused before anything heavy starts.
///
/// # Errors
/// Whatever ended it without a summary, or with one that fails a check or cannot be written.
pub(super) fn run(args: &RunArgs) -> Result<Exit, RunError> {
    #[cfg(feature = "iceoryx2")]
    if let Some(rank) = launch::iceoryx2::RankProcess::of_this() {
        let goes_on = rank.goes_on();
        let plan = load(args, goes_on).and_then(|config| plan(args, &config, goes_on || is_begun(args)));
        let opened = Caller::open(args, rank.speaks());
        let (plan, window) = match plan.and_then(|plan| opened.map(|window| (plan, window))) {
            Ok((plan, window)) => (Ok(plan), window),
            Err(error) => (Err(error), None),
        };
        let host = plan.as_ref().ok().and_then(|plan| window.as_ref().map(|window| window.host(plan)));
        // Whoever signals all processes at once means what the launcher is about to say.
        let stop = stop_on_signals(false, || {});
        return Ok(rank.run(plan, Observer { stop, host, ..observer(args, goes_on) }));
    }
    let config = load(args, false);
    #[cfg(feature = "mpi")]
    if is_for_mpi(args, &config) {
        return over_mpi(args, config);
    }
    let config = config?;
    launch::check_alone(&config)?;
    check_kept(args, &config)?;
    // First of all: what is in a folder may change while another run writes there.
    let held = hold(args)?;
    let outputs = Outputs::check(args)?;
    let begun = held.is_some() && is_begun(args);
    let first = checked(plan(args, &config, begun)).map_err(|error| outputs.of_complete(args, error))?;
    #[cfg(feature = "iceoryx2")]
    if first.transport == TransportKind::Iceoryx2 {
        launch::iceoryx2::check(&first, &configuration(args, false))?;
    }
    let held = hold_new(args, &first, held)?;
    let first = if !begun && is_begun(args) {
        checked(plan(args, &config, true)).map_err(|error| outputs.of_complete(args, error))?
    } else {
        first
    };
    tell(&first);
    #[cfg(feature = "iceoryx2")]
    if first.transport == TransportKind::Iceoryx2 {
        let _claim = first.claim(held)?;
        let quit = StopFlag::default();
        let second = quit.clone();
        let stop = stop_on_signals(true, move || {
            second.request();
        });
        let wishes = launch::iceoryx2::Wishes { stop, quit };
        let run = |plan: &Plan, goes_on| launch::iceoryx2::run(plan, &wishes, goes_on);
        return conclude(&supervise(args, &config, first, run, || wishes.stop.is_requested())?, &outputs);
    }
    let window = Caller::open(args, true)?;
    let _claim = first.claim(held)?;
    let stop = stop_on_signals(true, || std::process::exit(Exit::Interrupted as i32));
    let run = |plan: &Plan, goes_on| {
        let host = window.as_ref().map(|window| window.host(plan));
        launch::run(plan, &Observer { stop: stop.clone(), host, ..observer(args, goes_on) })
    };
    conclude(&supervise(args, &config, first, run, || stop.is_requested())?, &outputs)
}

/// Runs a plan, and where a rank is lost goes on from the last snapshot, as often as the user allows. `run` is told whether
/// it goes on with what was begun before.
fn supervise(
    args: &RunArgs,
    config: &Config,
    first: Plan,
    run: impl Fn(&Plan, bool) -> Result<Summary, RunError>,
    stop_asked: impl Fn() -> bool,
) -> Result<Summary, RunError> {
    let (mut current, mut restarts) = (first, 0);
    loop {
        match run(&current, restarts > 0) {
            Err(error) if error.exit() == Exit::PeerLost && restarts < args.restarts && !stop_asked() => {
                restarts += 1;
                complain(&format!("{error}; starting again ({restarts} of {} times)", args.restarts));
            }
            ended => return ended,
        }
        current = checked(plan(args, config, true))?;
        tell(&current);
    }
}

/// The folder that the run writes to, if there is one.
fn folder(args: &RunArgs) -> Option<RunFolder> {
    let out = args.out.as_ref().map(|path| RunFolder::new("--out", path));
    out.or_else(|| args.resume.as_ref().map(|path| RunFolder::new("--resume", path)))
}

/// The file that says what to run: the user's, or the one in the folder of the run that is to go on. One that was begun
/// here has the latter, whatever became of the former.
fn configuration(args: &RunArgs, goes_on: bool) -> PathBuf {
    let own = folder(args).map(|folder| folder.configuration());
    let file = if goes_on { own } else { args.config.clone().or(own) };
    file.expect("either is required on the command line")
}

fn load(args: &RunArgs, goes_on: bool) -> Result<Config, RunError> {
    if let (None, Some(folder)) = (&args.config, folder(args)) {
        folder.begun()?;
    }
    Ok(Config::load(&configuration(args, goes_on), &args.overrides()?)?)
}

/// Whether there is a run to go on with. Only who holds the folder can rely on it.
fn is_begun(args: &RunArgs) -> bool {
    args.resume.is_some() && folder(args).is_some_and(|folder| folder.holds_run())
}

/// Works out what the arguments ask for; `goes_on` says that the run was begun before.
fn plan(args: &RunArgs, config: &Config, goes_on: bool) -> Result<Plan, RunError> {
    check_trace(args, config.run.steps)?;
    match folder(args) {
        Some(folder) if goes_on => Plan::going_on(config, folder),
        Some(folder) => Plan::beginning(config, folder),
        None => Plan::new(config),
    }
    .and_then(|plan| Ok(Plan { log: args.log.clone(), commands: commands(args, goes_on)?, ..plan }))
}

/// Refuses to trace steps of which the run makes none.
fn check_trace(args: &RunArgs, steps: u64) -> Result<(), RunError> {
    match &args.trace_steps {
        Some(TraceSteps::Range(range)) if range.start >= steps => {
            let reason = format!("the last step that is to be made is {}, counted from 0; choose others", steps - 1);
            Err(RunError::Unsuitable { option: format!("--trace-steps {}..{}", range.start, range.end), reason })
        }
        _ => Ok(()),
    }
}

/// What the run is told to do, and was.
fn commands(args: &RunArgs, goes_on: bool) -> Result<Commands, RunError> {
    let drives = args.commands.as_deref().is_some_and(is_standard);
    if drives && args.view {
        let reason = "a page has a hand of its own; give a file of commands, or leave out --view".to_owned();
        return Err(RunError::Unsuitable { option: "--commands -".to_owned(), reason });
    }
    let given = args.commands.as_deref().filter(|path| !is_standard(path)).map(Script::load).transpose()?;
    let recorded = folder(args).filter(|_| goes_on).map(|folder| folder.commands()).filter(|path| path.is_file());
    let recorded = recorded.map(|path| Script::load_recorded(&path)).transpose()?;
    let standard = args.answers.as_deref().filter(|path| is_standard(path)).and_then(|_| drive::standard(1));
    let answers = standard.or_else(|| args.answers.clone());
    Ok(Commands { given, recorded, drives, answers, skips: args.skip_refused })
}

/// Who has ranks meet while it runs, if anybody has. Only one process `speaks`.
enum Caller {
    Page(Window),
    Program(Arc<Driver>),
}

impl Caller {
    fn open(args: &RunArgs, speaks: bool) -> Result<Option<Self>, RunError> {
        if args.commands.as_deref().is_some_and(is_standard) {
            if args.restarts > 0 {
                let reason = "who drives the run by --commands - cannot be heard twice; start again with --resume";
                let (option, reason) = (format!("--restarts {}", args.restarts), reason.to_owned());
                return Err(RunError::Unsuitable { option, reason });
            }
            return Ok(Some(Self::Program(if speaks { Driver::listen()? } else { Arc::default() })));
        }
        Ok(Window::open(args, speaks)?.map(Self::Page))
    }

    fn host(&self, plan: &Plan) -> Arc<dyn Host> {
        match self {
            Self::Page(window) => window.host(plan),
            Self::Program(driver) => Arc::clone(driver) as Arc<dyn Host>,
        }
    }
}

fn is_standard(path: &Path) -> bool {
    path == Path::new("-")
}

/// A plan whose run can go on with what is recorded, and with its log; or does not begin in vain over another.
fn checked(plan: Result<Plan, RunError>) -> Result<Plan, RunError> {
    let plan = plan?;
    plan.check_recording()?;
    check_logs(&plan)?;
    plan.check_overwriting()?;
    check_commands(&plan)?;
    Ok(plan)
}

fn observer(args: &RunArgs, goes_on: bool) -> Observer {
    let show = if args.quiet { Show::Nothing } else { Show::OnStderr };
    // What has been tried once is not tried again.
    let panic_at = args.panic_at.filter(|_| !goes_on);
    let trace = args.trace.is_some().then(|| args.trace_steps.clone().unwrap_or_default());
    Observer { listener: Some(Arc::new(Console::new(show))), panic_at, trace, ..Observer::default() }
}

/// What the user may want to know before the run starts.
fn tell(plan: &Plan) {
    for note in plan.notes() {
        complain(&note);
    }
}

/// What is written to files of their own, with the options that say where.
fn files(args: &RunArgs) -> [(&'static str, Option<&Path>); 5] {
    let answers = ("--answers", args.answers.as_deref().filter(|path| !is_standard(path)));
    let files = [("--json", &args.json), ("--timings", &args.timings), ("--trace", &args.trace), ("--log", &args.log)];
    let [json, timings, trace, log] = files.map(|(option, path)| (option, path.as_deref()));
    [json, timings, trace, log, answers]
}

/// Refuses to write them over what this run reads or keeps, or what another has left.
fn check_kept(args: &RunArgs, config: &Config) -> Result<(), RunError> {
    let runs = args.out.iter().chain(&args.resume).map(PathBuf::as_path).collect();
    let commands = args.commands.as_deref().filter(|path| !is_standard(path));
    Kept { runs, configuration: args.config.as_deref(), scene: config.scene_files(), commands }.check(files(args))
}

/// Keeps other runs from the folder of this one, if it has one that is there.
fn hold(args: &RunArgs) -> Result<Option<Claim>, RunError> {
    let Some(folder) = folder(args) else { return Ok(None) };
    Ok(folder.hold(args.resume.is_some().then_some(&|text| complain(&text)))?)
}

/// What comes with `--resume` waits for whatever run writes there, also where the folder was not there a moment ago. Whoever
/// was first may have begun the run by then.
fn hold_new(args: &RunArgs, plan: &Plan, held: Option<Claim>) -> Result<Option<Claim>, RunError> {
    match &plan.output {
        Some(output) if held.is_none() && args.resume.is_some() => {
            Ok(Some(output.folder.make_and_hold(Some(&|text| complain(&text)))?))
        }
        _ => Ok(held),
    }
}

/// Whether ranks are to be joined by MPI. Where the configuration cannot be read, the command line says so, or that a
/// launcher started this process among others: then the ranks meet to complain once.
#[cfg(feature = "mpi")]
fn is_for_mpi(args: &RunArgs, config: &Result<Config, RunError>) -> bool {
    match config {
        Ok(config) => config.transport() == TransportKind::Mpi,
        Err(_) => args.values.transport.as_deref() == Some(TransportKind::Mpi.name()) || launch::is_launched(),
    }
}

/// Runs this process as a rank of an MPI job.
#[cfg(feature = "mpi")]
fn over_mpi(args: &RunArgs, config: Result<Config, RunError>) -> Result<Exit, RunError> {
    let mut job = launch::mpi::Job::join(complain)?;
    let speaks = job.speaks();
    let held = job.all_well(match &config {
        Ok(config) if speaks => check_kept(args, config).and_then(|()| hold(args)),
        _ => Ok(None),
    })?;
    // Only who holds the folder can tell.
    let begun = job.told(speaks && held.is_some() && is_begun(args));
    let prepare = |config: &Config, outputs: &Outputs, begun| {
        let plan = plan(args, config, begun);
        let plan = if speaks { checked(plan) } else { plan };
        plan.map_err(|error| outputs.of_complete(args, error))
    };
    let prepared = config.and_then(|config| {
        if args.restarts > 0 {
            let reason = "with transport mpi, start again with --resume, as configs/slurm/ does".to_owned();
            return Err(RunError::Ranks(format!("--restarts {}: {reason}", args.restarts)));
        }
        let config = job.adapt(config)?;
        // Only the rank that speaks writes these.
        let outputs = if speaks { Outputs::check(args)? } else { Outputs::default() };
        Ok((prepare(&config, &outputs, begun)?, outputs, Caller::open(args, speaks)?))
    });
    let (mut plan, outputs, window) = job.agree(prepared, |(plan, ..)| plan)?;
    let held = job.all_well(if speaks { hold_new(args, &plan, held) } else { Ok(None) })?;
    if job.told(speaks && !begun && is_begun(args)) {
        plan = job.agree(prepare(&plan.config, &outputs, true), |plan| plan)?;
    }
    let _claim = job.all_well(if speaks { plan.claim(held) } else { Ok(None) })?;
    if speaks {
        tell(&plan);
    }
    // Silently: the launcher sends signals of its own when it ends a job.
    let stop = stop_on_signals(false, || launch::mpi::Job::quit());
    let host = window.as_ref().map(|window| window.host(&plan));
    let concluded = match job.run(&plan, &Observer { stop, host, ..observer(args, false) })? {
        Some(summary) => conclude(&summary, &outputs),
        None => Ok(Exit::Done),
    };
    job.close();
    concluded
}

/// Shows and writes what became of a run, and says with which exit code to end.
fn conclude(summary: &Summary, outputs: &Outputs) -> Result<Exit, RunError> {
    // All are tried before any is complained about: the one may save what another lost.
    let write = |file: &Option<WholeFile>, bytes: &[u8]| file.as_ref().map_or(Ok(()), |file| file.write(bytes));
    let (json, timings) = (summary.to_json(), timings::to_csv(&summary.timings));
    // In a folder the summary comes last, and says that all is there.
    let folder = write(&outputs.folder_timings, timings.as_bytes()).and(write(&outputs.folder, &json));
    let (json, timings) = (write(&outputs.json, &json), write(&outputs.timings, timings.as_bytes()));
    let shown = if outputs.is_silent { Ok(()) } else { output::show(summary) };
    let trace = outputs.trace.as_ref().map_or(Ok(()), |file| write_trace(summary, file));
    folder.and(json).and(timings).and(trace).and(shown)?;
    if summary.escaped > 0 {
        let (escaped, bodies) = (summary.escaped, plural(summary.bodies, "body"));
        complain(&format!(
            "{escaped} of {bodies} escaped: they ended outside of the domain, or of their room, where nothing holds \
             them; a higher physics.hertz, or a limit such as physics.max_linear_speed, may help"
        ));
    }

    RunError::check_bodies(summary.bodies, summary.bodies_lost)?;
    Ok(if summary.interrupted { Exit::Interrupted } else { Exit::Done })
}

/// Writes what the threads did, and says where that is not all that was asked for.
fn write_trace(summary: &Summary, file: &WholeFile) -> Result<(), RunError> {
    let ranks = summary.trace.as_deref().unwrap_or_default();
    file.write(&trace::to_json(summary, ranks))?;
    if ranks.iter().all(|rank| rank.slices.is_empty()) {
        complain(&"--trace: none of the steps that were to be traced was made; choose others with --trace-steps");
    }
    match trace::left_out(ranks) {
        0 => {}
        some => complain(&format!("--trace: the file has no room for {some} slices more; choose fewer --trace-steps")),
    }
    Ok(())
}

/// The files to write when the run is over.
#[derive(Default)]
struct Outputs {
    json: Option<WholeFile>,
    timings: Option<WholeFile>,
    trace: Option<WholeFile>,
    /// The summary and the timings in the folder of the run.
    folder: Option<WholeFile>,
    folder_timings: Option<WholeFile>,
    /// Standard output is somebody else's.
    is_silent: bool,
}

impl Outputs {
    /// Where an error says that a run is complete, what that has left goes where this one's was to go. What is left to say then.
    fn of_complete(&self, args: &RunArgs, error: RunError) -> RunError {
        // Only the rank that speaks has a folder to write to.
        let (RunError::Complete { summary, .. }, Some(folder), Some(_)) = (&error, folder(args), &self.folder) else {
            return error;
        };
        for (from, to) in [(summary.clone(), &self.json), (folder.timings(), &self.timings)] {
            let Some(to) = to else { continue };
            let failed = |error: io::Error| RunError::Output { path: from.clone(), reason: error.to_string() };
            if let Err(error) = fs::read(&from).map_err(failed).and_then(|bytes| to.write(&bytes)) {
                return error;
            }
        }
        let unwritten: Vec<&str> = files(args)[2..].iter().filter_map(|(option, path)| path.map(|_| *option)).collect();
        if !unwritten.is_empty() {
            complain(&format!("{}: not written, as no step is made", unwritten.join(", ")));
        }
        error
    }

    /// Where everything is to go, checked.
    fn check(args: &RunArgs) -> Result<Self, RunError> {
        if let Some(folder) = folder(args)
            && let Err(error) = folder.check_free(args.overwrite)
            // In this order, as another run may begin there just now.
            && !is_begun(args)
        {
            return Err(error.into());
        }
        let unchecked = |file: fn(&RunFolder) -> PathBuf| folder(args).map(|run| WholeFile::unchecked(&file(&run)));
        // The log and answers are written by the run itself.
        let [json, timings, trace, ..] = WholeFile::check_all(files(args))?;
        let (folder, folder_timings) = (unchecked(RunFolder::summary), unchecked(RunFolder::timings));
        let is_silent = args.answers.as_deref().is_some_and(is_standard);
        Ok(Self { json, timings, trace, folder, folder_timings, is_silent })
    }
}
