//! The thread that writes what a rank recorded and saved, in the order in which it did.

use crate::command::State;
use crate::error::RunError;
use crate::folder::durable::is_gone;
use crate::folder::in_letters;
use crate::folder::recording::{Record, RecordingWriter, RunFacts, StageText};
use crate::folder::snapshot::{self, SnapshotWriter};
use crate::plan::{Output, Plan};
use atoll_core::{SavedTile, World};
use atoll_transport::Rank;
use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender};
use std::sync::{Arc, OnceLock};
use tracing::{debug, warn};

/// What there is to write.
pub(super) enum Job {
    /// The next record.
    Record(Record),
    /// A snapshot.
    Snapshot(Saved),
    /// From the next record on there are more kinds.
    Kinds(StageText),
    /// Files to be made durable with what is written.
    Sync(Vec<(PathBuf, File)>),
    /// Snapshots from before this step are no longer needed.
    RemoveBefore(u64),
}

/// The tiles of a rank as they were after a step.
#[derive(Default)]
pub(super) struct Saved {
    step: u64,
    levels: Option<String>,
    commands: Option<State>,
    tiles: Vec<SavedTile>,
    blocks: Vec<u8>,
}

impl Saved {
    pub(super) fn fill(&mut self, world: &World, commands: Option<&State>) {
        self.commands = commands.cloned();
        self.step = world.step_count();
        self.levels = in_letters(world.partition());
        self.tiles = world.save(&mut self.blocks);
    }
}

pub(super) struct Writer {
    recording: Option<RecordingWriter>,
    snapshot: SnapshotWriter,
    snapshots: PathBuf,
    /// What others write beside.
    beside: Vec<(PathBuf, File)>,
    /// The file of the last one.
    saved: Option<PathBuf>,
    /// After the first failure nothing is written any more, so that what is there is of one piece.
    failure: Arc<OnceLock<RunError>>,
}

impl Writer {
    pub(super) fn new(
        plan: &Plan,
        output: &Output,
        rank: Rank,
        failure: Arc<OnceLock<RunError>>,
    ) -> Result<Self, RunError> {
        let (ranks, identity) = (plan.config.run.ranks as u32, plan.config.identity(plan.tiles));
        let recording = |every| {
            let facts = RunFacts::new(&plan.config, plan.scene.domain(), plan.tiles, every);
            let stage = StageText::named(&plan.blueprint.kinds, plan.kind_names(), &plan.blueprint.statics);
            RecordingWriter::new(output.folder.rank(rank.0), rank.0, ranks, &facts, &stage)
        };
        let recording = output.every.record_every.map(recording).transpose()?;
        let snapshot = SnapshotWriter::new(rank.0, ranks, plan.tiles, identity);
        Ok(Self { recording, snapshot, snapshots: output.folder.snapshots(), beside: Vec::new(), saved: None, failure })
    }

    /// Does what it is asked for until nobody can ask any more, and gives the buffers back.
    pub(super) fn work(mut self, jobs: &Receiver<Job>, records: &Sender<Record>, saves: &Sender<Saved>) {
        for job in jobs {
            // Whoever asked may have ended, and need no buffer. One that comes back was written, or there is a failure.
            match job {
                Job::Record(record) => {
                    self.attempt(|writer| writer.record(&record));
                    let _ = records.send(record);
                }
                Job::Snapshot(saved) => {
                    self.attempt(|writer| writer.save(&saved));
                    let _ = saves.send(saved);
                }
                Job::Kinds(stage) => self.attempt(|writer| match &mut writer.recording {
                    Some(recording) => Ok(recording.set_stage(&stage)?),
                    None => Ok(()),
                }),
                Job::Sync(files) => self.beside.extend(files),
                // After a failure nobody can tell which snapshots are whole.
                Job::RemoveBefore(_) if self.failure.get().is_some() => {}
                Job::RemoveBefore(step) => {
                    if let Err(error) = snapshot::remove_before(&self.snapshots, step) {
                        warn!("old snapshots stay in {}: {error}", self.snapshots.display());
                    }
                }
            }
        }
        self.attempt(Self::close);
        self.attempt(|writer| writer.check_there());
    }

    fn attempt(&mut self, write: impl FnOnce(&mut Self) -> Result<(), RunError>) {
        if self.failure.get().is_some() {
            return;
        }
        let written = catch_unwind(AssertUnwindSafe(|| write(self))).unwrap_or_else(|_| {
            let reason = "the code that writes panicked; please report this".to_owned();
            Err(RunError::Output { path: self.snapshots.with_file_name(""), reason })
        });
        if let Err(error) = written {
            // That something was removed explains the rest.
            let error = self.check_there().err().unwrap_or(error);
            let _ = self.failure.set(error);
        }
    }

    fn record(&mut self, record: &Record) -> Result<(), RunError> {
        let recording = self.recording.as_mut().expect("records come where there is a recording");
        Ok(recording.write(record)?)
    }

    /// Whoever goes on from a snapshot finds everything that was recorded before it, and in segments of its own.
    fn save(&mut self, saved: &Saved) -> Result<(), RunError> {
        self.close()?;
        let beside = (saved.levels.as_deref(), saved.commands.as_ref());
        let written = self.snapshot.write(&self.snapshots, saved.step, beside, &saved.tiles, &saved.blocks);
        let path = written.map_err(|(path, error)| RunError::Output { path, reason: error.to_string() })?;
        debug!(step = saved.step, bytes = saved.blocks.len(), "saved to {}", path.display());
        self.saved = Some(path);
        Ok(())
    }

    /// Whether everything is there still that was written and not removed by the run itself.
    fn check_there(&self) -> Result<(), RunError> {
        let saved = self.saved.clone().filter(|path| is_gone(path));
        // What lies elsewhere is the user's own.
        let in_folder = |path: &&PathBuf| path.parent() == self.snapshots.parent();
        let beside = self.beside.iter().map(|(path, _)| path).filter(in_folder).find(|path| is_gone(path));
        let gone = self.recording.as_ref().and_then(RecordingWriter::gone).or(saved).or(beside.cloned());
        gone.map_or(Ok(()), |path| Err(RunError::Gone { path }))
    }

    /// Completes what was recorded so far.
    fn close(&mut self) -> Result<(), RunError> {
        if let Some(recording) = &mut self.recording {
            recording.close_segment()?;
            recording.sync()?;
        }
        self.beside.iter().try_for_each(|(path, file)| {
            file.sync_all().map_err(|error| RunError::Output { path: path.clone(), reason: error.to_string() })
        })
    }
}
