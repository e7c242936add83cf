//! Compares two recordings, step by step and body by body.
//!
//! At most one record of each is in memory. Bodies are the same if every bit of their recorded state is; how far those that
//! are not have come apart is measured as well. What no record holds, the hashes of the last states tell.

mod deviation;
mod plot;
#[cfg(test)]
mod tests;
mod text;

pub use deviation::{Bodies, Deviation, StepDeviation};
pub use plot::svg;

use crate::config;
use crate::folder::Ended;
use crate::folder::recording::{Recording, RecordingError, Row};
use glam::DVec2;
use serde::{Serialize, Serializer};
use std::path::{Path, PathBuf};

/// How two recordings compare. The fields are the keys of the JSON file, in its order.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Comparison {
    /// Whether they are the same: within the tolerance, if there is one, else bit for bit. Never where steps were left out.
    pub same: bool,
    /// Whether they are the same bit for bit; the last states as well, if both runs have ended. Never where steps were left
    /// out.
    pub identical: bool,
    /// Deviations up to this count as none.
    pub tolerance: Option<f64>,
    /// The first recording.
    pub a: Side,
    /// The second.
    pub b: Side,
    /// Keys of the configurations with different values, of those that a result depends on.
    pub configuration: Vec<Key>,
    /// Where they are first not the same: within the tolerance, if there is one, else bit for bit.
    pub first_difference: Option<Difference>,
    /// Steps that only the first recorded.
    pub only_in_a: Vec<u64>,
    /// Steps that only the second recorded.
    pub only_in_b: Vec<u64>,
    /// Each step that both recorded.
    pub steps: Vec<StepDeviation>,
}

/// One of two recordings.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Side {
    /// Its folder.
    #[serde(serialize_with = "in_letters")]
    pub folder: PathBuf,
    /// Version of the program that recorded it.
    pub version: String,
    /// Records.
    pub records: usize,
    /// Steps after the last record that not all ranks had written when the run was killed. They are left out.
    pub incomplete: usize,
    /// What its summary says, once it has ended.
    pub ended: Option<Ended>,
}

/// A key of the configurations.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Key {
    /// Its full path.
    pub key: String,
    /// Its value in the first run.
    pub a: String,
    /// Its value in the second run.
    pub b: String,
}

/// The lowest body that is not the same at the first step at which any is not.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Difference {
    /// The step.
    pub step: u64,
    /// The body.
    pub id: u64,
    /// How often each recording has it. Once is right.
    pub times: [usize; 2],
    /// The columns in which `a` and `b` differ, if both have the body once; of those of a quantity that deviates by more than the tolerance, if
    /// there is one.
    pub columns: Vec<&'static str>,
    /// The body in the first recording, if it is there; any of them, if it is there more than once.
    pub a: Option<State>,
    /// The body in the second recording, if it is there; any of them, if it is there more than once.
    pub b: Option<State>,
}

/// A body as it was recorded.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct State {
    /// The tile in which its position lies. In that step another may have owned it still: bodies change their owner when the
    /// next one begins. None for a position that is not finite.
    pub tile: Option<u32>,
    /// In m.
    pub x: f64,
    /// In m.
    pub y: f64,
    /// In rad.
    pub angle: f32,
    /// In m/s.
    pub vx: f32,
    /// In m/s.
    pub vy: f32,
    /// In rad/s.
    pub omega: f32,
    /// Row of the table of kinds, if its recording says.
    pub kind: Option<u32>,
}

/// Compares the recordings in two folders. `compared` is told of how many steps are done, and of how many.
///
/// # Errors
/// If a recording cannot be read.
pub fn compare(
    a: &Path,
    b: &Path,
    tolerance: Option<f64>,
    mut compared: impl FnMut(usize, usize),
) -> Result<Comparison, RecordingError> {
    let (a, b) = (Recording::open(a)?, Recording::open(b)?);
    let only = |one: &Recording, other: &Recording| {
        one.steps().iter().copied().filter(|step| other.steps().binary_search(step).is_err()).collect::<Vec<_>>()
    };
    let (only_in_a, only_in_b) = (only(&a, &b), only(&b, &a));
    let common = || a.steps().iter().copied().filter(|step| b.steps().binary_search(step).is_ok());
    let count = common().count();
    let (mut of_a, mut of_b) = (Vec::new(), Vec::new());
    let kinds = a.stage().is_some() && b.stage().is_some();
    let (mut steps, mut first_difference) = (Vec::with_capacity(count), None);
    for step in common() {
        let (read_a, read_b) = rayon::join(|| read_sorted(&a, step, &mut of_a), || read_sorted(&b, step, &mut of_b));
        read_a.and(read_b)?;
        if !kinds {
            // Where one does not say, there is nothing to compare.
            of_a.iter_mut().chain(&mut of_b).for_each(|row| row.kind = 0);
        }
        let (deviation, first) = deviation::measure(step, &of_a, &of_b, tolerance);
        steps.push(deviation);
        if first_difference.is_none() {
            first_difference = first.map(|rows| Difference::new(step, rows, [&a, &b], tolerance));
        }
        compared(steps.len(), count);
    }
    let sides = [Side::new(&a), Side::new(&b)];
    let made = sides.each_ref().map(|side| side.ended.as_ref().map(|ended| ended.steps));
    let alike = only_in_a.is_empty()
        && only_in_b.is_empty()
        && sides.iter().all(|side| side.incomplete == 0)
        && (made[0] == made[1] || made.contains(&None));
    let identical = alike && steps.iter().all(StepDeviation::is_none) && unlike_ends(sides.each_ref()).is_empty();
    let same = if tolerance.is_some() { alike && steps.iter().all(|step| step.is_same(tolerance)) } else { identical };
    let keys = config::differences(&a.facts().canonical, &b.facts().canonical).into_iter();
    let configuration = keys.map(|one| Key { key: one.key, a: one.ours, b: one.theirs }).collect();
    let [a, b] = sides;
    Ok(Comparison { same, identical, tolerance, a, b, configuration, first_difference, only_in_a, only_in_b, steps })
}

/// The first step that two runs have both recorded, and after which any body is not the same, bit for bit; None if there is no
/// such step. Nothing if somebody asked to stop before that was known.
///
/// # Errors
/// If a recording cannot be read.
pub(crate) fn first_step_apart(
    a: &Path,
    b: &Path,
    stop: impl Fn() -> bool,
) -> Result<Option<Option<u64>>, RecordingError> {
    let (a, b) = (Recording::open(a)?, Recording::open(b)?);
    let (mut of_a, mut of_b) = (Vec::new(), Vec::new());
    for &step in a.steps().iter().filter(|step| b.steps().binary_search(step).is_ok()) {
        if stop() {
            return Ok(None);
        }
        read_sorted(&a, step, &mut of_a).and(read_sorted(&b, step, &mut of_b))?;
        if deviation::measure(step, &of_a, &of_b, None).1.is_some() {
            return Ok(Some(Some(step)));
        }
    }
    Ok(Some(None))
}

/// The rows of a record by the names of their bodies.
fn read_sorted(recording: &Recording, step: u64, rows: &mut Vec<Row>) -> Result<(), RecordingError> {
    recording.read(step, rows)?;
    rows.sort_unstable_by_key(|row| row.id);
    Ok(())
}

impl Comparison {
    /// As JSON, where what is infinite or no number is null.
    pub fn to_json(&self) -> Vec<u8> {
        let mut text = serde_json::to_vec_pretty(self).expect("figures and words, under names");
        text.push(b'\n');
        text
    }
}

impl Side {
    fn new(recording: &Recording) -> Self {
        Self {
            folder: recording.folder().to_owned(),
            version: recording.facts().version.clone(),
            records: recording.steps().len(),
            incomplete: recording.incomplete(),
            ended: recording.ended().cloned(),
        }
    }
}

/// What the summaries of two runs say of their ends that is not the same, with both values: steps, or else hashes of the last
/// states. Those cover what no record does: steps after the last one, the rotation in full, contacts and their impulses.
fn unlike_ends([a, b]: [&Side; 2]) -> Vec<(&'static str, [String; 2])> {
    let Some((a, b)) = a.ended.as_ref().zip(b.ended.as_ref()) else { return Vec::new() };
    if a.steps != b.steps {
        return vec![("steps", [a, b].map(|ended| ended.steps.to_string()))];
    }
    let hashes = [("state_hash", &a.state_hash, &b.state_hash), ("contact_hash", &a.contact_hash, &b.contact_hash)];
    let known = hashes.into_iter().filter_map(|(what, a, b)| Some((what, [a.clone()?, b.clone()?])));
    known.filter(|(_, [a, b])| a != b).collect()
}

/// A path as it is shown: JSON has no place for bytes that are no letters.
fn in_letters<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}

impl Difference {
    fn new(step: u64, rows: [&[Row]; 2], sides: [&Recording; 2], tolerance: Option<f64>) -> Self {
        let [a, b] = [0, 1].map(|i| rows[i].first().map(|row| State::new(step, row, sides[i])));
        let id = rows.iter().find_map(|rows| rows.first()).map_or(0, |row| row.id);
        let times = rows.map(<[Row]>::len);
        let columns = match rows {
            [[a], [b]] => columns_that_differ(a, b, tolerance),
            _ => Vec::new(),
        };
        Self { step, id, times, columns, a, b }
    }
}

impl State {
    fn new(step: u64, row: &Row, recording: &Recording) -> Self {
        let position = DVec2::new(row.x, row.y);
        let tile = recording
            .partition(step)
            .ok()
            .filter(|_| position.is_finite())
            .map(|partition| partition.locate(position).0);
        let &Row { id: _, x, y, angle, vx, vy, omega, kind, padding: _ } = row;
        let kind = recording.stage().map(|_| kind);
        Self { tile, x, y, angle, vx, vy, omega, kind }
    }
}

/// The columns in which a body's rows differ, of the quantities that deviate by more than the tolerance.
fn columns_that_differ(a: &Row, b: &Row, tolerance: Option<f64>) -> Vec<&'static str> {
    let [position, angle, velocity, spin] =
        deviation::apart(a, b).map(|value| tolerance.is_none_or(|most| value > most));
    let columns = |row: &Row| {
        [
            ("x", position, row.x.to_bits()),
            ("y", position, row.y.to_bits()),
            ("angle", angle, row.angle.to_bits().into()),
            ("vx", velocity, row.vx.to_bits().into()),
            ("vy", velocity, row.vy.to_bits().into()),
            ("omega", spin, row.omega.to_bits().into()),
            ("kind", true, row.kind.into()),
        ]
    };
    let pairs = columns(a).into_iter().zip(columns(b));
    pairs.filter(|(ours, theirs)| ours.1 && ours.2 != theirs.2).map(|(ours, _)| ours.0).collect()
}
