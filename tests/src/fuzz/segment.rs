//! Segments of recordings, as `Recording` reads them.

use super::Outcome;
use atoll::internals::{Record, RecordingWriter, StageText, rank_folder};
use atoll::recording::{Recording, RecordingError, Row, RunFacts};
use atoll_core::{Body, GlobalId, Kind, KindId, Material, Rot, Shape, StaticBody};
use glam::{DVec2, Vec2};
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;
use xxhash_rust::xxh3::xxh3_64;

/// How the only record of [`segment_file`] is told of in its metadata: step 0 with six bodies, and a checksum.
const RECORD: &[u8] = b"0:6:";
const BODIES: u64 = 6;

/// A run of one rank with one segment of one record.
struct Run {
    folder: TempDir,
    segment: PathBuf,
    genuine: Vec<u8>,
}

thread_local! {
    /// Made once, and its segment written over each time: a target is called very often.
    static RUN: Run = Run::new();
}

impl Run {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a place for temporary files");
        let facts = RunFacts {
            version: "1.2.3".to_owned(),
            scene: "rooms".to_owned(),
            seed: 7,
            record_every: 5,
            domain: [DVec2::ZERO, DVec2::splat(8.0)],
            tiles: [2, 2],
            config: "[scene]\n".to_owned(),
            canonical: "scene.seed = 7\n".to_owned(),
        };
        let mut record = Record::default();
        record.fill(0, (0..BODIES).map(body));
        let rank = rank_folder(folder.path(), 0);
        let mut writer = RecordingWriter::new(rank.clone(), 0, 1, &facts, &stage()).expect("a new folder");
        writer.write(&record).and_then(|()| writer.close_segment()).expect("room for a small file");
        let segment = fs::read_dir(rank).expect("the folder just made").next().expect("its only file");
        let segment = segment.expect("a name").path();
        let genuine = fs::read(&segment).expect("what was just written");
        Self { folder, segment, genuine }
    }

    fn read(&self, bytes: &[u8]) -> Result<Vec<Row>, RecordingError> {
        // A file that is written over goes to the disk at once on some systems, which takes a hundred times as long.
        fs::remove_file(&self.segment).and_then(|()| fs::write(&self.segment, bytes)).expect("room for a small file");
        let mut rows = Vec::new();
        Recording::open(self.folder.path())?.read(0, &mut rows)?;
        Ok(rows)
    }
}

/// Two kinds of bodies, and two statics, one of them turned.
fn stage() -> StageText {
    let kind = |shape| Kind::new(shape, Material::default());
    let wall = |id, x| StaticBody::new(GlobalId(id), kind(Shape::rectangle(1.0, 9.0)), DVec2::new(x, 4.0));
    let turned = StaticBody { rotation: Rot::from_angle(0.25), ..wall(7, 8.5) };
    StageText::new(&[kind(Shape::rectangle(0.5, 1.0)), kind(Shape::circle(0.25))], &[wall(6, -0.5), turned])
}

fn body(id: u64) -> Body {
    let part = (id * 7 + 3) as f32;
    Body {
        id: GlobalId(id),
        position: DVec2::new(f64::from(part) / 16.0, 0.5),
        rotation: Rot::from_angle(part / 32.0),
        velocity: Vec2::new(part, -part),
        angular_velocity: part / 3.0,
        kind: KindId((id % 2) as u32),
    }
}

/// A segment as it should be.
pub fn segment_file() -> Vec<u8> {
    RUN.with(|run| run.genuine.clone())
}

/// Where the footer of a Parquet file begins, after its last eight bytes.
pub fn footer(bytes: &[u8]) -> Option<usize> {
    let end = bytes.len().checked_sub(8)?;
    let length = u32::from_le_bytes(*bytes[end..].first_chunk()?);
    end.checked_sub(length as usize)
}

/// Writes the checksum of the record as whoever writes it would have, if the bytes still have a place for it.
fn seal(bytes: &mut [u8]) {
    let Some(footer) = footer(bytes).filter(|footer| *footer >= 4) else { return };
    let checksum = format!("{:016x}", xxh3_64(&bytes[4..footer]));
    let place = bytes[footer..].windows(RECORD.len()).position(|part| part == RECORD);
    let place = place.map(|at| footer + at + RECORD.len());
    if let Some(text) = place.and_then(|at| bytes.get_mut(at..at + checksum.len())) {
        text.copy_from_slice(checksum.as_bytes());
    }
}

/// A segment is refused in one line, or its bodies are those that were written; with a new checksum it is refused in one
/// line, or read without a panic, whatever it then says.
pub fn segment(bytes: &[u8]) -> Outcome<RecordingError> {
    RUN.with(|run| {
        let result = run.read(bytes);
        if let Ok(rows) = &result {
            let ids = rows.iter().map(|row| row.id);
            assert!(ids.eq(0..BODIES), "other rows were read: {rows:?}");
        }
        let Outcome { mut refusals, .. } = Outcome::of(result);
        let mut sealed = bytes.to_vec();
        seal(&mut sealed);
        let outcome = Outcome::of(run.read(&sealed));
        refusals.extend(outcome.refusals);
        Outcome { refusals, ..outcome }
    })
}
