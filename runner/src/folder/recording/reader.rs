//! Reads the segments of all ranks as one sequence of records.

use super::facts::RunFacts;
use super::record::Row;
use super::segment::Segment;
use super::stage::{Stage, StageText};
use super::{RecordingError, rank_folder, rank_of_folder, steps_of_segment};
use crate::config::Config;
use crate::folder::ended::Ended;
use crate::folder::run_folder::{CONFIGURATION, TILINGS};
use crate::folder::tilings::Tilings;
use atoll_core::{Partition, SetupError};
use std::fs;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A recording. Its files are opened as they are needed, never all at once.
#[derive(Clone, Debug)]
pub struct Recording {
    folder: PathBuf,
    facts: RunFacts,
    /// None in the first format.
    stage: Option<Stage>,
    files: Vec<PathBuf>,
    /// By step and rank.
    parts: Vec<Part>,
    steps: Vec<u64>,
    incomplete: usize,
    ended: Option<Ended>,
    /// Empty where tiles stay as they are.
    tilings: Tilings,
}

/// What one rank recorded of one step.
#[derive(Clone, Copy, Debug)]
struct Part {
    step: u64,
    rank: u32,
    ranks: u32,
    rows: u64,
    file: usize,
}

/// What a file says of the run it is of, with which others are compared.
#[derive(Debug)]
pub(crate) struct OfRun {
    /// The file.
    pub path: PathBuf,
    /// What it says.
    pub facts: RunFacts,
    /// And of kinds and statics.
    pub stage: Option<StageText>,
}

impl OfRun {
    /// In what a segment differs from that, if both cannot be of one run.
    fn other_run(&self, segment: &Segment) -> Option<String> {
        let format = |stage: &Option<StageText>| if stage.is_some() { 2 } else { 1 };
        let (ours, theirs) = (format(&self.stage), format(&segment.stage));
        if ours != theirs {
            return Some(format!("format is {ours} in the one and {theirs} in the other"));
        }
        let facts = self.facts.other_run(&segment.facts);
        let is_same = match (&self.stage, &segment.stage) {
            (Some(ours), Some(theirs)) => ours.includes(theirs) || theirs.includes(ours),
            _ => true,
        };
        facts.or_else(|| (!is_same).then(|| "their kinds or statics are not the same".to_owned()))
    }

    /// Knows all kinds from here on that a segment tells of.
    fn learn(&mut self, segment: &Segment) {
        if let (Some(ours), Some(theirs)) = (&self.stage, &segment.stage)
            && ours != theirs
            && theirs.includes(ours)
        {
            self.stage = Some(theirs.clone());
        }
    }
}

impl Recording {
    /// Reads what all segments say about themselves, and no rows. Kinds and statics are the same in all, but that there
    /// may be more kinds in later ones; of these only one is read.
    ///
    /// # Errors
    /// If there are no records, a file cannot be read, files do not go together, or one is missing. What is missing after
    /// the last complete record is what a killed run lost, and no error, unless the run's summary says that it came further. A
    /// summary that cannot be read counts as missing.
    pub fn open(folder: &Path) -> Result<Self, RecordingError> {
        let nothing = || RecordingError::Nothing { path: folder.to_owned() };
        let (mut recording, stage) = Self::index(folder, None, u64::MAX)?.ok_or_else(nothing)?;
        let stage = stage.map(|stage| stage.read()).transpose();
        let bad = |reason| RecordingError::BadSegment { path: recording.files[0].clone(), reason };
        recording.stage = stage.map_err(bad)?;
        recording.ended = Ended::read(folder).ok().flatten();
        let RunFacts { domain, tiles, .. } = recording.facts;
        // What cannot be read is complained about by who needs it.
        let config = Config::load_begun(&folder.join(CONFIGURATION));
        let follow = config.is_ok_and(|config| config.run.retiling.is_some());
        recording.tilings = Tilings::read(&folder.join(TILINGS), domain, tiles, follow);
        if let Some(count) = recording.ended.as_ref().and_then(|ended| ended.tile_count).filter(|_| follow) {
            recording.tilings.check_last(&folder.join(TILINGS), count);
        }
        (recording.steps, recording.incomplete) =
            recording.find_complete(recording.ended.as_ref().map(|ended| ended.steps))?;
        if recording.steps.is_empty() { Err(nothing()) } else { Ok(recording) }
    }

    /// Whether everything is there that a run has recorded until a step, by what all files say about themselves. `run` tells
    /// which run that is, and which file says so.
    ///
    /// # Errors
    /// If something is missing, damaged, or of another run.
    pub(crate) fn check_until(folder: &Path, run: OfRun, step: u64) -> Result<(), RecordingError> {
        let missing = || RecordingError::Missing { folder: folder.to_owned(), step: 0 };
        let (recording, _) = Self::index(folder, Some(run), step)?.ok_or_else(missing)?;
        recording.find_complete(Some(step)).map(drop)
    }

    /// Reads what the segments that begin until a step say about themselves. `first` is what they are compared with, or else
    /// the first of them. None if there are none, and else also the kinds and statics of all, which are not read yet.
    fn index(
        folder: &Path,
        mut first: Option<OfRun>,
        until: u64,
    ) -> Result<Option<(Self, Option<StageText>)>, RecordingError> {
        let (mut files, mut parts) = (Vec::new(), Vec::new());
        // Of the last step, which is what the run came to be.
        let mut last = None;
        for (rank, path) in segments(folder, until)? {
            let segment = Segment::open(&path)?;
            if segment.rank != rank {
                let reason = format!("it is of rank {}", segment.rank);
                return Err(RecordingError::BadSegment { path, reason });
            }
            let first = first.get_or_insert_with(|| OfRun {
                path: path.clone(),
                facts: segment.facts.clone(),
                stage: segment.stage.clone(),
            });
            if let Some(what) = first.other_run(&segment) {
                return Err(RecordingError::OtherRun { paths: [first.path.clone(), path], what });
            }
            first.learn(&segment);
            let (ranks, file) = (segment.ranks, files.len());
            parts.extend(segment.records.iter().map(|record| {
                let (step, rows) = (record.step, record.rows);
                Part { step, rank, ranks, rows, file }
            }));
            let step = parts.last().map(|part| part.step);
            if last.as_ref().is_none_or(|(latest, _)| *latest < step) {
                last = Some((step, segment.facts));
            }
            files.push(path);
        }
        parts.sort_by_key(|part| (part.step, part.rank));
        let (folder, stage) = (folder.to_owned(), first.and_then(|first| first.stage));
        Ok(last.map(|(_, facts)| {
            let steps = Vec::new();
            (
                Self {
                    folder,
                    facts,
                    stage: None,
                    files,
                    parts,
                    steps,
                    incomplete: 0,
                    ended: None,
                    tilings: Tilings::default(),
                },
                stage,
            )
        }))
    }

    /// Reads all records, as nothing but that shows whether they are whole.
    ///
    /// # Errors
    /// If a file is damaged.
    pub(crate) fn check(&self) -> Result<(), RecordingError> {
        let mut rows = Vec::new();
        self.steps.iter().try_for_each(|&step| self.read(step, &mut rows))
    }

    /// What is wrong with the file that tells of tiles, if anything is: then they are not known.
    pub(crate) fn damage(&self) -> Option<&str> {
        self.tilings.damage()
    }

    /// The tiles with which a step was made, if they follow the bodies.
    pub(crate) fn tiling(&self, step: u64) -> Option<&Arc<Partition>> {
        self.tilings.at(step)
    }

    /// The tiles with which a step was made.
    ///
    /// # Errors
    /// If there are none, as with a domain that comes from no run.
    pub(crate) fn partition(&self, step: u64) -> Result<Partition, SetupError> {
        let RunFacts { domain: [low, high], tiles: [columns, rows], .. } = self.facts;
        let equal = || Partition::uniform(low, high, columns, rows);
        self.tiling(step).map_or_else(equal, |partition| Ok((**partition).clone()))
    }

    /// The folder it is in.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The run it is of; of one that was taken up again, as it was in the end.
    pub fn facts(&self) -> &RunFacts {
        &self.facts
    }

    /// The kinds of its bodies, and what never moves. None in recordings of format 1: there they are those of the
    /// configuration's scene.
    pub fn stage(&self) -> Option<&Stage> {
        self.stage.as_ref()
    }

    /// Its segments.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// The steps of the records, ascending.
    pub fn steps(&self) -> &[u64] {
        &self.steps
    }

    /// How many bodies there are in a record, by what its files say about themselves.
    pub(crate) fn rows(&self, step: u64) -> u64 {
        self.parts[self.parts_of(step)].iter().fold(0, |sum, part| sum.saturating_add(part.rows))
    }

    /// Steps after the last record that only some ranks hold: the run was killed before all had written them.
    pub fn incomplete(&self) -> usize {
        self.incomplete
    }

    /// What the run's summary says, once it has ended, if it can be read.
    pub fn ended(&self) -> Option<&Ended> {
        self.ended.as_ref()
    }

    /// Replaces `rows` with the bodies of one record: those of each rank in turn, in the order of its tiles.
    ///
    /// # Errors
    /// If there is no such record, or its files are damaged.
    pub fn read(&self, step: u64, rows: &mut Vec<Row>) -> Result<(), RecordingError> {
        self.read_ranks(step, rows, |_, _| {})
    }

    /// As [`read`](Self::read); of each rank in turn it also tells where its bodies end.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub(crate) fn read_ranks(
        &self,
        step: u64,
        rows: &mut Vec<Row>,
        mut ends: impl FnMut(u32, usize),
    ) -> Result<(), RecordingError> {
        rows.clear();
        if self.steps.binary_search(&step).is_err() {
            let nearest = self.steps.iter().copied().min_by_key(|recorded| recorded.abs_diff(step));
            let nearest = nearest.expect("a recording holds a record");
            return Err(RecordingError::NoSuchStep { path: self.folder.clone(), step, nearest });
        }
        let parts = &self.parts[self.parts_of(step)];
        let count = parts.iter().try_fold(0_u64, |sum, part| sum.checked_add(part.rows));
        let fits = count.and_then(|count| rows.try_reserve_exact(usize::try_from(count).ok()?).ok());
        fits.ok_or_else(|| {
            let reason = format!("step {step} has more rows than this machine can hold");
            RecordingError::Read { path: self.folder.clone(), reason }
        })?;
        let kinds = self.stage.as_ref().map_or(0, |stage| stage.kinds.len());
        for part in parts {
            if part.rows > 0 {
                Segment::open(&self.files[part.file])?.read(step, kinds, rows)?;
            }
            ends(part.rank, rows.len());
        }
        Ok(())
    }

    fn parts_of(&self, step: u64) -> Range<usize> {
        let start = self.parts.partition_point(|part| part.step < step);
        start..start + self.parts[start..].partition_point(|part| part.step == step)
    }

    /// The steps that all ranks hold, none of which may be missing, and how many only some hold. The run is known to have
    /// `made` so many steps, or not known to have ended.
    fn find_complete(&self, made: Option<u64>) -> Result<(Vec<u64>, usize), RecordingError> {
        let (mut complete, mut incomplete) = (Vec::new(), 0);
        for parts in self.parts.chunk_by(|a, b| a.step == b.step) {
            self.check_together(parts)?;
            // They are of different ranks, and each of those is one of the run's.
            if parts.len() == parts[0].ranks as usize {
                complete.push(parts[0].step);
            } else {
                incomplete += 1;
            }
        }
        let every = self.facts.record_every;
        let told = made.map(|made| made - made % every);
        let last = complete.last().copied().max(told);
        let unbroken = complete.iter().zip(0..).take_while(|(step, count)| **step == count * every).count();
        let missing = unbroken as u64 * every;
        if last.is_some_and(|last| missing <= last) {
            return Err(RecordingError::Missing { folder: self.place_of_missing(missing), step: missing });
        }
        Ok((complete, incomplete))
    }

    /// Whether the parts of one step are those of different ranks of one run.
    fn check_together(&self, parts: &[Part]) -> Result<(), RecordingError> {
        for pair in parts.windows(2) {
            let (step, paths) = (pair[0].step, || [0, 1].map(|i| self.files[pair[i].file].clone()));
            let ranks = [pair[0].ranks, pair[1].ranks];
            if ranks[0] != ranks[1] {
                return Err(RecordingError::OtherRanks { paths: paths(), ranks, step });
            }
            if pair[0].rank == pair[1].rank {
                return Err(RecordingError::Twice { paths: paths(), step });
            }
        }
        Ok(())
    }

    /// The folder of the first rank that should hold a step; that of the run, if none does.
    fn place_of_missing(&self, step: u64) -> PathBuf {
        let parts = &self.parts[self.parts_of(step)];
        let held = parts.iter().zip(0..).take_while(|(part, rank)| part.rank == *rank).count();
        if parts.is_empty() { self.folder.clone() } else { rank_folder(&self.folder, held as u32) }
    }
}

/// The complete segments of a run that begin until a step, with the ranks in whose folders they are, in a fixed order.
fn segments(folder: &Path, until: u64) -> Result<Vec<(u32, PathBuf)>, RecordingError> {
    let mut segments = Vec::new();
    for name in names(folder)? {
        let Some(rank) = rank_of_folder(&name) else { continue };
        let of_rank = folder.join(name);
        let files = names(&of_rank)?;
        let files = files.iter().filter(|name| steps_of_segment(name).is_some_and(|(first, _)| first <= until));
        segments.extend(files.map(|name| (rank, of_rank.join(name))));
    }
    Ok(segments)
}

/// The names in a folder, in order. Whatever is not Unicode is not ours.
fn names(folder: &Path) -> Result<Vec<String>, RecordingError> {
    let read = || {
        let entries = fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name().into_string().ok()));
        let mut names: Vec<String> = entries.filter_map(io::Result::transpose).collect::<io::Result<_>>()?;
        names.sort();
        Ok(names)
    };
    read().map_err(|error: io::Error| RecordingError::Read { path: folder.to_owned(), reason: error.to_string() })
}
