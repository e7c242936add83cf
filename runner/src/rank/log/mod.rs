//! Figures over time: a row after each of some steps, to which every rank brings a part of fixed size, and which rank 0 writes.
//!
//! Rows are written after every so many steps, after the last that is made, and after each with a snapshot, so that whoever goes
//! on from there finds everything that was counted until then; but not after one that a refused command follows, as no figures were
//! taken in that. They are durable before rank 0's part of that snapshot is there.

mod row;

use super::halo::RankHalo;
use super::recorder::Recorder;
use super::trouble::all_well;
use super::{Observer, RankError, RankFacts, records, unreadable};
use crate::error::RunError;
use crate::folder::snapshot::Snapshot;
use crate::folder::{LogFile, Rows};
use crate::plan::Plan;
use atoll_core::{Figures, Phase, StepReport, World};
use atoll_transport::{Collective, Counting, Rank, Stats, Transport};
use row::Part;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The files to write, and what of them there is already; known to rank 0 alone.
pub(super) struct Found(Vec<(PathBuf, Option<Rows>)>);

/// Whether a run can go on with its logs, before anything is done to it. For one process of a run to ask.
///
/// # Errors
/// If one is damaged, or no log.
pub(crate) fn check_logs(plan: &Plan) -> Result<(), RunError> {
    let newest = plan.found.snapshots.iter().map(Snapshot::step).max();
    look(plan.logs(), newest).map(drop)
}

/// Looks at the files that the run writes to, if any. Nothing is changed.
pub(super) fn find(
    plan: &Plan,
    resumed: Option<u64>,
    transport: &mut impl Transport,
) -> Result<Option<Found>, RankError> {
    let paths = plan.logs();
    if paths.is_empty() {
        return Ok(None);
    }
    let found = if transport.rank() == Rank(0) { look(paths, resumed) } else { Ok(Found(Vec::new())) };
    all_well(transport, found.as_ref().err())?;
    Ok(found.ok())
}

/// What there is of each file until the step from which a run goes on.
fn look(paths: Vec<PathBuf>, resumed: Option<u64>) -> Result<Found, RunError> {
    let columns = row::columns();
    let rows = |path: &Path| match resumed {
        Some(_) if !LogFile::is_special(path) => Rows::find(path, Some(&columns), resumed),
        _ => Ok(None),
    };
    let found = paths.into_iter().map(|path| rows(&path).map(|rows| (path, rows)));
    found.collect::<Result<_, _>>().map(Found).map_err(RunError::Log)
}

/// What a rank does about the log.
pub(super) struct Log {
    every: u64,
    checkpoint_every: Option<u64>,
    /// The last step there is to make.
    steps: u64,
    hertz: f64,
    /// Of rank 0.
    files: Vec<LogFile>,
    failure: Option<RunError>,
    /// As it was at the last row, in figures that only grow.
    last: RankFacts,
    begun: Instant,
    /// What ranks sent each other for rows, and how long each waited for the others.
    sent: Stats,
    waited: Duration,
    /// How long rows were made and written.
    time: Duration,
}

impl Log {
    /// Begins the files, or goes on with those there are, on all ranks or none. The first row tells of the state before any
    /// step.
    pub(super) fn start<T: Transport>(
        plan: &Plan,
        found: Found,
        resumed: Option<u64>,
        (world, halo): (&World, &mut RankHalo<Counting<T>>),
        (recorder, observer): (Option<&Recorder<'_>>, &Observer),
    ) -> Result<Self, RankError> {
        let every = &plan.config.output;
        let mut log = Self {
            every: every.log_every,
            checkpoint_every: every.checkpoint_every.filter(|_| recorder.is_some()),
            steps: plan.config.run.steps,
            hertz: plan.config.hertz(),
            files: Vec::new(),
            failure: None,
            last: RankFacts { steps: world.step_count(), resumed_at: world.step_count(), ..RankFacts::default() },
            begun: Instant::now(),
            sent: Stats::default(),
            waited: Duration::ZERO,
            time: Duration::ZERO,
        };
        let start = log.text(&StepReport::default(), world.figures_of_bodies(), log.last, halo)?;
        let opened = match &start {
            Some(start) => log.open(found, resumed, start, recorder, observer),
            None => Ok(()),
        };
        all_well(halo.transport(), opened.as_ref().err())?;
        // From here on times are those of steps.
        (log.begun, log.sent) = (Instant::now(), Stats::default());
        (log.waited, log.time) = (Duration::ZERO, Duration::ZERO);
        Ok(log)
    }

    /// Opens the files, those that are new with a first row where the run begins.
    fn open(
        &mut self,
        found: Found,
        resumed: Option<u64>,
        start: &str,
        recorder: Option<&Recorder<'_>>,
        observer: &Observer,
    ) -> Result<(), RunError> {
        let columns = row::columns();
        let mut to_sync = Vec::new();
        for (path, rows) in found.0 {
            let open = || match &rows {
                Some(rows) => LogFile::go_on(&path, rows),
                None => LogFile::begin(&path, &columns),
            };
            let mut file = open().map_err(|error| not_written(&path, &error))?;
            let last = rows.and_then(|rows| rows.steps).map(|(_, last)| last);
            match (last, resumed) {
                (None, None) => file.add(start).map_err(|error| not_written(&path, &error))?,
                // A row tells of the step before it as well, of which nothing is known any more.
                (None, Some(_)) => {}
                // Of a step after which a refused command ended the run there is none.
                (Some(last), Some(from)) if last < from - from % self.every => {
                    observer.note(&format!("{}: no rows from step {last} to {from}", path.display()));
                }
                (Some(_), _) => {}
            }
            if let Some(handle) = file.to_sync().map_err(|error| not_written(&path, &error))? {
                to_sync.push((path, handle));
            }
            self.files.push(file);
        }
        if let Some(recorder) = recorder {
            recorder.sync_with_snapshots(to_sync);
        }
        Ok(())
    }

    /// Lets the next step take figures, if a row is due after it.
    pub(super) fn prepare(&self, world: &mut World) {
        if self.is_due(world.step_count() + 1) {
            world.take_figures_of_next_step();
        }
    }

    /// Whether a row is written after that step in any case.
    pub(super) fn is_due(&self, step: u64) -> bool {
        let due = |every: u64| step.is_multiple_of(every);
        due(self.every) || self.checkpoint_every.is_some_and(due) || step == self.steps
    }

    /// Writes the row that is due after a step, if one is. `migrations` are those of all steps so far, `written` is how long
    /// this rank spent on other output, `balanced` on balancing.
    pub(super) fn write_due<T: Transport>(
        &mut self,
        world: &World,
        step: &StepReport,
        (migrations, written, balanced): (u64, Duration, Duration),
        halo: &mut RankHalo<Counting<T>>,
    ) -> Result<(), RankError> {
        let Some(&figures) = world.figures().filter(|_| step.stopped || self.is_due(world.step_count())) else {
            return Ok(());
        };
        let mut now = RankFacts {
            steps: world.step_count(),
            migrations,
            wall_nanos: self.begun.elapsed().as_nanos() as u64,
            wait_nanos: (halo.waited() + self.waited).as_nanos() as u64,
            output_nanos: (written + self.time).as_nanos() as u64,
            balance_nanos: balanced.as_nanos() as u64,
            phase_nanos: Phase::ALL.map(|phase| world.timings().total(phase).as_nanos() as u64),
            ..RankFacts::default()
        };
        // Waiting for others is part of an exchange, whatever is exchanged.
        now.phase_nanos[Phase::Exchange as usize] += self.waited.as_nanos() as u64;
        let row = self.text(step, figures, now, halo)?;
        let start = Instant::now();
        if let Some(row) = row
            && self.failure.is_none()
        {
            let add = |file: &mut LogFile| file.add(&row).map_err(|error| not_written(file.path(), &error));
            self.failure = self.files.iter_mut().try_for_each(add).err();
        }
        self.time += start.elapsed();
        Ok(())
    }

    /// What all ranks have to say, of rank 0, when what only grows has grown to `now`.
    fn text<T: Transport>(
        &mut self,
        step: &StepReport,
        figures: Figures,
        now: RankFacts,
        halo: &mut RankHalo<Counting<T>>,
    ) -> Result<Option<String>, RankError> {
        let before = std::mem::replace(&mut self.last, now);
        let since = |figure: fn(&RankFacts) -> u64| figure(&now) - figure(&before);
        let facts = RankFacts {
            resumed_at: before.steps,
            ghosts: step.ghosts,
            islands: step.islands,
            largest_island: step.largest_island,
            asleep: step.asleep,
            migrations: since(|facts| facts.migrations),
            wall_nanos: since(|facts| facts.wall_nanos),
            wait_nanos: since(|facts| facts.wait_nanos),
            output_nanos: since(|facts| facts.output_nanos),
            balance_nanos: since(|facts| facts.balance_nanos),
            phase_nanos: std::array::from_fn(|phase| now.phase_nanos[phase] - before.phase_nanos[phase]),
            ..now
        };
        let transport = halo.transport();
        let (start, sent) = (Instant::now(), transport.stats());
        let part = Part { facts, figures };
        let parts = transport.gather(Rank(0), bytemuck::bytes_of(&part)).map_err(RankError::Transport)?;
        self.sent += transport.stats().since(&sent);
        self.waited += start.elapsed();
        let Some(parts) = parts else { return Ok(None) };
        let start = Instant::now();
        let all = records::<Part>(&parts).map_err(RankError::Transport)?;
        if all.len() != parts.len() {
            return Err(RankError::Transport(unreadable(Rank(0))));
        }
        let text = row::text(self.hertz, &all);
        self.time += start.elapsed();
        Ok(Some(text))
    }

    /// Why nothing is written any more, if something could not be. It is told once.
    pub(super) fn take_failure(&mut self) -> Option<RunError> {
        self.failure.take().inspect(|_| self.files.clear())
    }

    /// What ranks sent each other for rows.
    pub(super) fn sent(&self) -> Stats {
        self.sent
    }

    /// How long this rank waited for others to bring their parts.
    pub(super) fn waited(&self) -> Duration {
        self.waited
    }

    /// How long rows were made and written.
    pub(super) fn time(&self) -> Duration {
        self.time
    }

    /// Makes durable what was written, where nobody else does.
    pub(super) fn sync(&self) -> Result<(), RunError> {
        self.files.iter().try_for_each(|log| {
            let sync = || log.to_sync()?.map_or(Ok(()), |file| file.sync_all());
            sync().map_err(|error| not_written(log.path(), &error))
        })
    }
}

fn not_written(path: &Path, error: &io::Error) -> RunError {
    RunError::Output { path: path.to_owned(), reason: error.to_string() }
}
