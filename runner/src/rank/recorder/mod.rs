//! What a rank writes while it runs: records of the trajectory and snapshots, by a thread of its own.
//!
//! The rank only copies its state into a buffer; encoding and writing go on beside the next steps. There are two buffers for
//! records and one for snapshots: where the disk cannot keep up, the rank waits, and memory stays bounded.
//!
//! Every rank writes its part of a snapshot by itself. Once it has made the step after a snapshot, and nobody has asked to
//! stop, all ranks have at least begun to write theirs, as they meet in each step's exchange, and so have written the one
//! before, as each has one buffer, and who could not write asks to stop. Only then are older ones removed, so at any moment
//! there is a whole one.

mod buffers;
mod writer;

use crate::command::State;
use crate::error::RunError;
use crate::folder::Claim;
use crate::folder::recording::{Record, StageText};
use crate::plan::{Output, Plan};
use atoll_core::{StaticBody, World};
use atoll_transport::Rank;
use buffers::Buffers;
use std::fs::File;
use std::path::PathBuf;
use std::sync::mpsc::{self, Sender};
use std::sync::{Arc, OnceLock};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use tracing::trace_span;
use writer::{Job, Saved, Writer};

/// Between two looks at whether everything is written.
const POLL: Duration = Duration::from_millis(1);

/// What a rank writes.
pub(super) struct Recorder<'a> {
    output: &'a Output,
    /// None once no more will come.
    jobs: Option<Sender<Job>>,
    /// How many kinds the next record may speak of.
    kinds: usize,
    statics: &'a [StaticBody],
    names: &'a [Option<String>],
    records: Buffers<Record>,
    saves: Buffers<Saved>,
    /// Steps of the last snapshot and of the one before.
    last_snapshot: Option<u64>,
    snapshot_before: Option<u64>,
    /// Whether this rank removes old snapshots.
    removes: bool,
    failure: Arc<OnceLock<RunError>>,
    thread: Option<JoinHandle<()>>,
    time: Duration,
    _claim: Claim,
}

impl<'a> Recorder<'a> {
    /// Starts to write for a rank that begins, or goes on from the snapshot of the step `resumed`.
    ///
    /// # Errors
    /// If the folder cannot be written to.
    pub(super) fn start(
        plan: &'a Plan,
        output: &'a Output,
        claim: Claim,
        rank: Rank,
        resumed: Option<u64>,
    ) -> Result<Self, RunError> {
        // One is written while the next is filled.
        let (records, record_back) = Buffers::new(2);
        let (saves, save_back) = Buffers::new(1);
        let (jobs, todo) = mpsc::channel();
        let failure = Arc::new(OnceLock::new());
        let writer = Writer::new(plan, output, rank, Arc::clone(&failure))?;
        let thread = thread::Builder::new()
            .name(format!("rank {rank}, writer"))
            .spawn(move || writer.work(&todo, &record_back, &save_back))
            .map_err(|error| RunError::Threads { rank, threads: 1, reason: error.to_string() })?;
        Ok(Self {
            output,
            jobs: Some(jobs),
            kinds: plan.blueprint.kinds.len(),
            statics: &plan.blueprint.statics,
            names: plan.kind_names(),
            records,
            saves,
            last_snapshot: resumed,
            snapshot_before: None,
            removes: rank == Rank(0),
            failure,
            thread: Some(thread),
            time: Duration::ZERO,
            _claim: claim,
        })
    }

    /// Writes what is due after the steps that were made. Waits where the disk is behind. `commands` is what these add up to,
    /// `stopped` says that somebody asked to stop.
    pub(super) fn write_due(&mut self, world: &World, commands: Option<&State>, stopped: bool) {
        let start = Instant::now();
        let step = world.step_count();
        let _span = trace_span!("output", step).entered();
        let due = |every: Option<u64>| every.is_some_and(|every| step.is_multiple_of(every));
        if !stopped
            && self.last_snapshot.is_some_and(|last| last < step)
            && let Some(kept) = self.snapshot_before.take()
            && self.removes
        {
            self.ask(Job::RemoveBefore(kept));
        }
        if due(self.output.every.record_every)
            && let Some(mut record) = self.records.take()
        {
            if world.kinds().len() != std::mem::replace(&mut self.kinds, world.kinds().len()) {
                let kinds: Vec<_> = world.kinds().collect();
                self.ask(Job::Kinds(StageText::named(&kinds, self.names, self.statics)));
            }
            record.fill(step, world.bodies());
            self.ask(Job::Record(record));
        }
        if step > 0 && due(self.output.every.checkpoint_every) {
            self.snapshot(world, commands);
        }
        self.time += start.elapsed();
    }

    /// Waits until a snapshot can be taken without waiting for the disk, but no longer than `patience`, and says whether it
    /// can.
    pub(super) fn has_room(&mut self, patience: Duration) -> bool {
        let start = Instant::now();
        let room = self.saves.wait(patience);
        self.time += start.elapsed();
        room
    }

    /// Takes a snapshot unless the last one is of this step.
    pub(super) fn snapshot(&mut self, world: &World, commands: Option<&State>) {
        let step = world.step_count();
        if self.last_snapshot == Some(step) {
            return;
        }
        if let Some(mut saved) = self.saves.take() {
            saved.fill(world, commands);
            self.ask(Job::Snapshot(saved));
            self.snapshot_before = self.last_snapshot.replace(step);
        }
    }

    /// The step of the snapshot before the last, until those before that are removed.
    pub(super) fn snapshot_before(&self) -> Option<u64> {
        self.snapshot_before
    }

    /// What is written, and where to.
    pub(super) fn output(&self) -> &'a Output {
        self.output
    }

    /// Lets these files be made durable before each snapshot from now on, and at the end.
    pub(super) fn sync_with_snapshots(&self, files: Vec<(PathBuf, File)>) {
        self.ask(Job::Sync(files));
    }

    /// Nothing is written any more, as something else could not be that belongs to it.
    pub(super) fn fail(&self, error: RunError) {
        // The first is told.
        let _ = self.failure.set(error);
    }

    /// Why nothing is written any more, if something could not be.
    pub(super) fn failure(&self) -> Option<&RunError> {
        self.failure.get()
    }

    /// Lets nothing more be written than was asked for, and waits until that is done, but no longer than `patience`. Says
    /// whether it is.
    pub(super) fn close(&mut self, patience: Duration) -> bool {
        let start = Instant::now();
        self.jobs = None;
        let done = |thread: &Option<JoinHandle<()>>| thread.as_ref().is_none_or(JoinHandle::is_finished);
        while !done(&self.thread) && start.elapsed() < patience {
            thread::sleep(POLL);
        }
        self.time += start.elapsed();
        done(&self.thread)
    }

    /// How long the rank copied its state, or waited for the disk.
    pub(super) fn time(&self) -> Duration {
        self.time
    }

    fn ask(&self, job: Job) {
        // It goes on until it is told that no more will come.
        let _ = self.jobs.as_ref().expect("there until it is closed").send(job);
    }
}

/// Also where the run fails: what was recorded before is whole.
impl Drop for Recorder<'_> {
    fn drop(&mut self) {
        self.jobs = None;
        // It catches its panics.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}
