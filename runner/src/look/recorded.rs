//! What there is to see of a run that recorded itself.

use super::frame::{Frame, Setting};
use crate::config::Config;
use crate::folder::recording::{Recording, RecordingError, Row, Stage};
use crate::scene::{Scene, SceneKind};
use atoll_core::GlobalId;
use std::path::Path;

/// A recording, to be read frame by frame.
#[derive(Debug)]
pub(crate) struct Recorded {
    recording: Recording,
    setting: Setting,
    /// The start of a run in format 1, whose bodies do not say of what kind they are.
    scene: Option<Scene>,
}

impl Recorded {
    /// Looks at what all segments of a run say. Recordings of format 1 get kinds and statics from their configuration.
    ///
    /// # Errors
    /// If the recording cannot be read, or says what cannot be.
    pub(crate) fn open(folder: &Path) -> Result<Self, RecordingError> {
        let recording = Recording::open(folder)?;
        let bad = |reason| RecordingError::BadSegment { path: recording.files()[0].clone(), reason };
        let facts = recording.facts();
        let partition = recording.partition(0).map_err(|error| bad(error.to_string()))?;
        let hertz = facts.hertz().ok_or_else(|| bad("atoll.canonical has no physics.hertz".to_owned()))?;
        let (stage, scene) = match recording.stage() {
            Some(stage) => (stage.clone(), None),
            None => {
                let scene = scene_of(&recording)?;
                (Stage { kinds: scene.kinds(), names: Vec::new(), statics: scene.statics().to_vec() }, Some(scene))
            }
        };
        let Stage { kinds, names, statics } = stage;
        Ok(Self { recording, setting: Setting { partition, kinds, names, statics, hertz }, scene })
    }

    /// The recording itself.
    pub(crate) fn recording(&self) -> &Recording {
        &self.recording
    }

    /// What stays as it is.
    pub(crate) fn setting(&self) -> &Setting {
        &self.setting
    }

    /// Replaces a frame with what was recorded of a step. Beside that nothing is kept in memory.
    ///
    /// # Errors
    /// If there is no such record, or its files are damaged.
    pub(crate) fn read(&self, step: u64, frame: &mut Frame) -> Result<(), RecordingError> {
        let Frame { step: of, bodies, tiling, ranks, live } = frame;
        (*of, *live, *tiling) = (step, None, self.recording.tiling(step).cloned());
        ranks.clear();
        self.recording.read_ranks(step, bodies, |rank, end| ranks.push((rank, end)))?;
        let Some(scene) = &self.scene else { return Ok(()) };
        bodies.iter_mut().try_for_each(|row| {
            row.kind = kind_in(scene, row).ok_or_else(|| {
                no_scene(&self.recording, format!("step {step} has body {}, which its scene has not", row.id))
            })?;
            Ok(())
        })
    }
}

/// The scene of a recording's configuration.
fn scene_of(recording: &Recording) -> Result<Scene, RecordingError> {
    let config = Config::from_begun_str("atoll.config", &recording.facts().config);
    let spec = config.map_err(|error| no_scene(recording, error.to_string()))?.scene;
    if let SceneKind::File(_) = spec.kind {
        return Err(no_scene(recording, "and its scene is in a file".to_owned()));
    }
    // The scene takes memory by how many it says, and files only by how many they hold.
    let (told, held) = (spec.bodies, recording.rows(0));
    if told != held {
        return Err(no_scene(recording, format!("its scene has {told} bodies, and its first record {held}")));
    }
    Scene::open(&spec).map_err(|error| no_scene(recording, error.to_string()))
}

/// Of what kind a scene's body is.
fn kind_in(scene: &Scene, row: &Row) -> Option<u32> {
    scene.find(GlobalId(row.id)).ok().flatten().map(|body| body.kind.0)
}

fn no_scene(recording: &Recording, reason: String) -> RecordingError {
    RecordingError::NoScene { path: recording.files()[0].clone(), reason }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::folder::recording::testing::{bodies, facts, record, stage};
    use crate::folder::recording::{RunFacts, rank_folder};
    use atoll_core::Partition;
    use std::fs;

    fn format_1() -> std::path::PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/recording-format-1")
    }

    #[test]
    fn a_recording_can_be_drawn_without_its_configuration() {
        let folder = tempfile::tempdir().unwrap();
        let strange = RunFacts { config: "of another age".to_owned(), ..facts(5) };
        record(folder.path(), &strange, 3, 0..1, bodies);
        let recorded = Recorded::open(folder.path()).unwrap();
        let (kinds, statics) = stage();
        let partition = Partition::uniform(facts(5).domain[0], facts(5).domain[1], 4, 2).unwrap();
        assert_eq!(
            recorded.setting(),
            &Setting { partition, names: vec![None; kinds.len()], kinds, statics, hertz: 50.0 }
        );
        let mut frame = Frame { ranks: vec![(9, 9)], ..Frame::default() };
        recorded.read(0, &mut frame).unwrap();
        assert_eq!((frame.step, frame.bodies.len(), frame.ranks), (0, 20, vec![(0, 7), (1, 14), (2, 20)]));
        assert!(frame.bodies.iter().all(|row| u64::from(row.kind) == row.id % 2));
    }

    #[test]
    fn recordings_of_format_1_get_the_shapes_of_their_scene() {
        let recorded = Recorded::open(&format_1()).unwrap();
        let config = Config::load_begun(&format_1().join("run.toml")).unwrap();
        let scene = Scene::open(&config.scene).unwrap();
        assert_eq!(
            (&recorded.setting().kinds[..], &recorded.setting().statics[..]),
            (&scene.kinds()[..], scene.statics())
        );
        assert_eq!((recorded.setting().hertz, recorded.recording().steps().len()), (60.0, 3));
        let mut frame = Frame::default();
        recorded.read(10, &mut frame).unwrap();
        assert_eq!((frame.step, frame.ranks.len(), frame.bodies.len()), (10, 2, 12));
        for row in &frame.bodies {
            assert_eq!(row.kind, scene.find(GlobalId(row.id)).unwrap().unwrap().kind.0);
        }
        assert!(frame.bodies.iter().any(|row| row.kind == 0) && frame.bodies.iter().any(|row| row.kind == 1));
    }

    /// In each file, something of its configuration is replaced by as many letters.
    #[test]
    fn a_scene_that_cannot_be_had_is_named_in_one_line() {
        for (from, to, expected) in [
            ("kind = \"pile\"", "kind = \"pole\"", "atoll.config: scene.kind = \"pole\": must be"),
            ("bodies = 12", "bodies = 99", "its scene has 99 bodies, and its first record 12"),
            (
                "kind = \"pile\"\nbodies = 12\nseed = 1\njitter",
                "kind = \"slope\"\nbodies = 12\nseed = 1\nangle",
                "step 0 has body 14, which its scene has not",
            ),
        ] {
            let folder = tempfile::tempdir().unwrap();
            for rank in 0..2 {
                let name = "steps-0000000000-0000000020.parquet";
                let mut bytes = fs::read(rank_folder(&format_1(), rank).join(name)).unwrap();
                assert_eq!(from.len(), to.len());
                let at = bytes.windows(from.len()).position(|part| part == from.as_bytes()).unwrap();
                bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
                fs::create_dir(rank_folder(folder.path(), rank)).unwrap();
                fs::write(rank_folder(folder.path(), rank).join(name), bytes).unwrap();
            }
            let read = Recorded::open(folder.path()).and_then(|recorded| recorded.read(0, &mut Frame::default()));
            let error = read.unwrap_err().to_string();
            let file = "rank-00000/steps-0000000000-0000000020.parquet: recordings of format 1 have no shapes";
            assert!(error.contains(file) && error.contains(expected) && !error.contains('\n'), "{error}");
        }
    }
}
