//! What a run has recorded. While one frame is shown, the next is read.

use super::{End, Show, Shown, hertz};
use crate::config::Config;
use crate::error::{RecordingError, RunError};
use crate::folder::recording::{Recording, Row, Stage};
use crate::look::frame::{Frame, Setting};
use crate::rank::StopFlag;
use crate::scene::Scene;
use atoll_core::{GlobalId, TileGrid};
use atoll_transport::Rank;
use std::path::Path;
use std::sync::mpsc;
use std::thread;

/// A recording to be looked at.
#[derive(Debug)]
pub(crate) struct Recorded {
    recording: Recording,
    setting: Setting,
    /// For each body from the first id on, where the recording does not tell: it is of format 1.
    kinds: Option<(GlobalId, Vec<u32>)>,
}

impl Recorded {
    /// The recording in the folder of a run.
    ///
    /// # Errors
    /// If there is none, or it is damaged.
    pub(crate) fn open(folder: &Path) -> Result<Self, RunError> {
        let recording = Recording::open(folder)?;
        let facts = recording.facts();
        let bad = |reason: String| RecordingError::BadSegment { path: recording.files()[0].clone(), reason };
        let ([low, high], [columns, rows]) = (facts.domain, facts.tiles);
        let grid = TileGrid::new(low, high, columns, rows).map_err(|error| bad(error.to_string()))?;
        let hertz = hertz(&facts.config).ok_or_else(|| bad("atoll.config has no physics.hertz".to_owned()))?;
        let (Stage { kinds, statics }, of_bodies) = match recording.stage() {
            Some(stage) => (stage.clone(), None),
            None => {
                let config = Config::of_begun("atoll.config", &facts.config).map_err(|error| bad(error.to_string()))?;
                let scene = Scene::new(&config.scene);
                let of_bodies = scene.iter().map(|body| body.kind.0).collect();
                let stage = Stage { kinds: scene.kinds(), statics: scene.statics().to_vec() };
                (stage, Some((scene.first_id(), of_bodies)))
            }
        };
        Ok(Self { setting: Setting { grid, kinds, statics, hertz }, kinds: of_bodies, recording })
    }

    /// What stays as it is.
    pub(crate) fn setting(&self) -> &Setting {
        &self.setting
    }

    /// Steps from one record to the next.
    pub(crate) fn every(&self) -> u64 {
        self.recording.facts().record_every
    }

    /// The step of the last record. There is at least one.
    pub(crate) fn last(&self) -> u64 {
        self.recording.steps().last().copied().unwrap_or_default()
    }

    /// Whether a dynamic body has that name.
    ///
    /// # Errors
    /// If the first record cannot be read.
    pub(crate) fn has(&self, body: GlobalId) -> Result<bool, RunError> {
        let mut rows = Vec::new();
        self.recording.read(0, &mut rows)?;
        Ok(rows.iter().any(|row| row.id == body.0))
    }

    /// Lets `show` see these records, all of which must be there, until somebody asks to `stop`.
    ///
    /// # Errors
    /// What `show` returns, or if a record cannot be read.
    pub(crate) fn show(&self, shown: Shown, stop: &StopFlag, show: &mut Show<'_>) -> Result<End, RunError> {
        // Two frames go round: memory for no more.
        let (fill, empty) = mpsc::channel();
        let (take, full) = mpsc::channel();
        for _ in 0..shown.count().min(2) {
            fill.send(Frame::default()).expect("its receiver is here");
        }
        // Whatever ends it, both channels close then, and so the reader ends.
        thread::scope(move |scope| {
            let read = move || {
                for step in shown.steps() {
                    let Ok(mut frame) = empty.recv() else { return };
                    let read = self.read(step, &mut frame).map(|()| frame);
                    let failed = read.is_err();
                    if take.send(read).is_err() || failed {
                        return;
                    }
                }
            };
            let reader = thread::Builder::new().name("reader".to_owned()).spawn_scoped(scope, read);
            reader.map_err(|error| RunError::Threads { rank: Rank(0), threads: 1, reason: error.to_string() })?;
            for frame in full {
                if stop.is_requested() {
                    return Ok(End::Interrupted);
                }
                let frame = frame?;
                show(&frame)?;
                // The last ones need not come back.
                let _ = fill.send(frame);
            }
            Ok(End::Complete)
        })
    }

    fn read(&self, step: u64, frame: &mut Frame) -> Result<(), RecordingError> {
        let Frame { bodies, ranks, .. } = frame;
        ranks.clear();
        self.recording.read_ranks(step, bodies, |rank, end| ranks.push((rank, end)))?;
        frame.step = step;
        if let Some((first, kinds)) = &self.kinds {
            let kind = |row: &Row| kinds.get(row.id.checked_sub(first.0)? as usize).copied();
            frame.bodies.iter_mut().for_each(|row| row.kind = kind(row).unwrap_or_default());
        }
        Ok(())
    }
}
