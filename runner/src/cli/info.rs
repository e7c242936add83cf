//! `atoll info`: what the folder of a run, a snapshot or a segment of a recording holds.

use super::args::InfoArgs;
use super::console::complain;
use super::output;
use crate::command::{Script, ScriptError};
use crate::error::{Exit, RunError};
use crate::folder::recording::{Recording, RecordingError, Segment, Stage};
use crate::folder::snapshot::{self, Snapshot, SnapshotError, SnapshotFile};
use crate::folder::{Ended, LogError, Rows, RunFolder};
use crate::plan::tiles;
use crate::scene::SceneKind;
use crate::wording::{OneLine, plural};
use std::ffi::OsStr;
use std::fmt::{Display, Write as _};
use std::path::Path;
use std::{fs, iter};

/// Reads all of it, and tells what it found.
///
/// # Errors
/// If it is none of these, or cannot be read, or is damaged.
pub(super) fn run(args: &InfoArgs) -> Result<Exit, RunError> {
    let path = &args.path;
    let folder = RunFolder::new("info", path);
    let mut trouble = Vec::new();
    let text = match path.extension().and_then(OsStr::to_str) {
        _ if folder.holds_run() => of_run(&folder, &mut trouble)?,
        Some("atoll") => of_snapshot_file(path)?,
        Some("parquet") => of_segment(path)?,
        _ if path.is_dir() => {
            folder.damaged().map_or(Ok(()), Err)?;
            let nothing = || folder.refusal("holds no run and no complete snapshot; name one, or a file of one");
            of_snapshot(&Snapshot::open(path)?.ok_or_else(nothing)?)?
        }
        _ => {
            let what = if path.exists() { "is no run, snapshot or recording" } else { "there is nothing of that name" };
            return Err(folder.refusal(format!("{what}; name a folder, a .atoll or a .parquet file")).into());
        }
    };
    output::show(&text)?;
    let Some(first) = trouble.first() else { return Ok(Exit::Done) };
    let rest = match trouble.len() - 1 {
        0 => String::new(),
        more => format!("; the list tells of {more} more"),
    };
    Err(folder.refusal(format!("{first}{rest}")).into())
}

/// `trouble` is what is wrong with files that are damaged, of which the text tells as well.
fn of_run(folder: &RunFolder, trouble: &mut Vec<String>) -> Result<String, RunError> {
    let config = folder.begun()?;
    let tiles = config.run.tiles.unwrap_or_default();
    let (title, bodies, seed) = (config.scene.kind.title(), config.scene.bodies, config.scene.seed);
    let tiling = tiles::in_words(tiles, config.run.retiling.map(|retiling| retiling.how));
    let seed = if matches!(config.scene.kind, SceneKind::File(_)) { String::new() } else { format!(", seed {seed}") };
    let mut text = format!("{}: {}{seed}, {tiling}\n", OneLine(&title), plural(bodies, "body"));
    row(&mut text, "config hash", &config.hash(tiles));
    row(&mut text, "state", &state(folder, config.run.steps));
    let mut told = |what: Result<String, String>| {
        what.unwrap_or_else(|damage| {
            trouble.push(damage.clone());
            damage
        })
    };
    row(&mut text, "recording", &told(recording(folder.path(), config.output.record_every)));
    row(&mut text, "log", &told(log(folder)));
    if let Some(commands) = commands(folder) {
        row(&mut text, "commands", &told(commands));
    }
    let found = match snapshot::find_all(&folder.snapshots(), &config.identity(tiles), tiles) {
        Ok(found) => found,
        Err(error) => {
            row(&mut text, "snapshots", &told(Err(of_snapshot_error(&error))));
            return Ok(text);
        }
    };
    if found.snapshots.is_empty() && found.unusable.is_empty() {
        row(&mut text, "snapshots", "none");
    }
    for snapshot in &found.snapshots {
        let size = snapshot.files.iter().map(|file| file.path.as_path());
        let whole = || format!("{}, state hash {:032x}", megabytes(size), snapshot.hashes().state);
        let what = told(snapshot.check().map(|()| whole()).map_err(|error| of_snapshot_error(&error)));
        row(&mut text, "snapshot", &format!("after step {}: {what}", snapshot.step()));
    }
    for step in found.incomplete {
        row(&mut text, "snapshot", &format!("after step {step}: not complete, and passed over"));
    }
    for error in found.unusable {
        row(&mut text, "snapshot", &told(Err(of_snapshot_error(&error))));
    }
    Ok(text)
}

/// What is wrong with a file, and how to mend it, where it does not say so itself.
fn mended(damage: &dyn Display) -> String {
    format!("{damage}; remove it, or bring back a good copy of it")
}

fn of_snapshot_error(error: &SnapshotError) -> String {
    if error.is_damage() { mended(error) } else { error.to_string() }
}

/// How far a run came.
fn state(folder: &RunFolder, steps: u64) -> String {
    let ended = match Ended::read(folder.path()) {
        Ok(Some(ended)) => ended,
        Ok(None) => {
            let how = match folder.is_claimed() {
                Some(true) => "under way",
                Some(false) => "stopped before they were made",
                None => "under way, or stopped before they were made",
            };
            return format!("to make {steps} steps; {how}");
        }
        Err(error) => {
            complain(&error.counts_as_missing());
            return format!("to make {steps} steps; its summary cannot be read");
        }
    };
    let how = if !ended.interrupted && ended.steps == steps { "complete," } else { "ended after" };
    let hash = ended.state_hash.unwrap_or_default();
    format!("{how} {} of {steps} steps: state hash {}", ended.steps, OneLine(&hash))
}

/// What there is of a recording, or what is wrong with it.
fn recording(folder: &Path, every: Option<u64>) -> Result<String, String> {
    let Some(every) = every else { return Ok("none".to_owned()) };
    let recording = match Recording::open(folder) {
        Err(RecordingError::Nothing { .. }) => return Ok(format!("every {every} steps, none complete")),
        recording => recording.map_err(|error| error.to_string())?,
    };
    recording.damage().iter().for_each(|damage| complain(damage));
    let (steps, files) = (recording.steps(), recording.files());
    recording.check().map_err(|error| error.to_string())?;
    let last = steps.last().copied().unwrap_or_default();
    let (count, size) = (steps.len(), megabytes(files.iter().map(|file| file.as_path())));
    let shapes = recording.stage().map_or("no shapes".to_owned(), shapes);
    let records = plural(count as u64, "record");
    Ok(format!(
        "{records}, steps 0 to {last}, every {every}; {shapes}; {size} in {}",
        plural(files.len() as u64, "file")
    ))
}

fn shapes(stage: &Stage) -> String {
    format!("{}, {}", plural(stage.kinds.len() as u64, "kind"), plural(stage.statics.len() as u64, "static"))
}

/// What there is of figures over time, or what is wrong with them.
fn log(folder: &RunFolder) -> Result<String, String> {
    let rows = Rows::find(&folder.log(), None, None).map_err(|error: LogError| match error {
        LogError::Read { .. } => error.to_string(),
        LogError::Header { .. } | LogError::Row { .. } => mended(&error),
    })?;
    let steps = rows.and_then(|rows| Some((rows.count, rows.steps?)));
    Ok(steps.map_or("none".to_owned(), |(count, (first, last))| format!("{count} rows, steps {first} to {last}")))
}

/// How many commands there were and are to come, if any, or what is wrong with them.
fn commands(folder: &RunFolder) -> Option<Result<String, String>> {
    let path = folder.commands();
    let damage = |error: ScriptError| match error {
        ScriptError::Read { .. } => error.to_string(),
        ScriptError::Line { .. } => mended(&error),
    };
    let told = |script: Script| plural(script.lines.len() as u64, "line");
    path.exists().then(|| Script::load_recorded(&path).map(told).map_err(damage))
}

fn of_snapshot(snapshot: &Snapshot) -> Result<String, SnapshotError> {
    snapshot.check()?;
    let (files, facts) = (&snapshot.files, &snapshot.files[0].facts);
    let mut text = format!(
        "snapshot after step {}, written by {} of atoll {}\n",
        facts.step,
        plural(facts.ranks.into(), "rank"),
        facts.version
    );
    blocks(&mut text, files.iter());
    Ok(text)
}

fn of_snapshot_file(path: &Path) -> Result<String, SnapshotError> {
    let file = SnapshotFile::open(path)?;
    file.check()?;
    let facts = &file.facts;
    let (step, rank, ranks, version) = (facts.step, facts.rank, facts.ranks, &facts.version);
    let mut text = format!("snapshot after step {step}: the part of rank {rank} of {ranks} of atoll {version}\n");
    blocks(&mut text, iter::once(&file));
    Ok(text)
}

/// What there is in files of a snapshot.
fn blocks<'a>(text: &mut String, files: impl Iterator<Item = &'a SnapshotFile> + Clone) {
    let all = || files.clone().flat_map(|file| &file.blocks);
    let hashes = files.clone().map(SnapshotFile::hashes).fold(Default::default(), atoll_core::Hashes::merge);
    let [bodies, contacts] = [all().map(|block| block.bodies).sum::<u64>(), all().map(|block| block.contacts).sum()];
    row(
        text,
        "tiles",
        &format!("{} with {} and {}", all().count(), plural(bodies, "body"), plural(contacts, "contact")),
    );
    row(text, "size", &megabytes(files.map(|file| file.path.as_path())));
    row(text, "state hash", &format!("{:032x}", hashes.state));
    row(text, "contact hash", &format!("{:032x}", hashes.contact));
}

fn of_segment(path: &Path) -> Result<String, RecordingError> {
    let segment = Segment::open(path)?;
    let stage = segment.stage()?;
    segment.check_records(stage.as_ref().map_or(0, |stage| stage.kinds.len()))?;
    let (facts, records) = (&segment.facts, &segment.records);
    let mut text = format!(
        "recording of {}, seed {}: the part of rank {} of {}\n",
        OneLine(&facts.scene),
        facts.seed,
        segment.rank,
        segment.ranks
    );
    let steps: Vec<String> = records.iter().map(|record| record.step.to_string()).collect();
    row(&mut text, "steps", &steps.join(" "));
    row(&mut text, "rows", &records.iter().map(|record| record.rows).sum::<u64>().to_string());
    row(&mut text, "shapes", &stage.as_ref().map_or("none: format 1".to_owned(), shapes));
    row(&mut text, "size", &megabytes(iter::once(path)));
    Ok(text)
}

fn row(text: &mut String, name: &str, value: &str) {
    writeln!(text, "{name:<14}{value}").expect("a string takes any text");
}

fn megabytes<'a>(files: impl Iterator<Item = &'a Path>) -> String {
    let bytes: u64 = files.map(|file| fs::metadata(file).map_or(0, |data| data.len())).sum();
    format!("{:.2} MB", bytes as f64 * 1e-6)
}
