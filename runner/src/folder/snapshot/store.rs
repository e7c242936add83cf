//! The folder of a run's snapshots: names, which of them are whole, and which are no longer needed.

use super::{Snapshot, SnapshotError};
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::{fs, io};

pub(super) fn folder_name(step: u64) -> String {
    format!("step-{step:010}")
}

pub(super) fn file_name(rank: u32, ranks: u32) -> String {
    format!("rank-{rank:05}-of-{ranks:05}.atoll")
}

/// The step that a folder is named after.
pub(super) fn step_of(folder: &Path) -> Option<u64> {
    let name = folder.file_name()?.to_str()?;
    name.strip_prefix("step-")?.parse().ok().filter(|&step| folder_name(step) == name)
}

/// Rank and number of ranks of the file that is so named.
fn ranks_of(name: &OsStr) -> Option<(u32, u32)> {
    let (rank, ranks) = name.to_str()?.strip_prefix("rank-")?.strip_suffix(".atoll")?.split_once("-of-")?;
    let (rank, ranks) = (rank.parse().ok()?, ranks.parse().ok()?);
    (name == file_name(rank, ranks).as_str()).then_some((rank, ranks))
}

/// The files of all ranks in a folder, by rank, if all are there. Where a run was resumed on other ranks, more than one
/// number of ranks may have written.
pub(super) fn complete_set(folder: &Path) -> Result<Option<Vec<PathBuf>>, SnapshotError> {
    let failed = |error: io::Error| SnapshotError::read(folder, &error);
    let mut sets = BTreeMap::<u32, BTreeMap<u32, PathBuf>>::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        if let Some((rank, ranks)) = ranks_of(&entry.file_name()) {
            sets.entry(ranks).or_default().insert(rank, entry.path());
        }
    }
    let complete = sets.into_iter().find(|(ranks, files)| *ranks > 0 && (0..*ranks).eq(files.keys().copied()));
    Ok(complete.map(|(_, files)| files.into_values().collect()))
}

/// Whether a folder of that name is that of a snapshot.
pub(crate) fn is_folder(name: &str) -> bool {
    step_of(Path::new(name)).is_some()
}

/// The folders of snapshots by step, ascending. None where there is no folder of snapshots at all.
fn folders(snapshots: &Path) -> io::Result<BTreeMap<u64, PathBuf>> {
    let mut folders = BTreeMap::new();
    let entries = match fs::read_dir(snapshots) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(folders),
        entries => entries?,
    };
    for entry in entries {
        let path = entry?.path();
        if let Some(step) = step_of(&path) {
            folders.insert(step, path);
        }
    }
    Ok(folders)
}

/// What a run can go on from.
#[derive(Default, Debug)]
pub struct Found {
    /// Snapshots whose index is whole, the newest first.
    pub snapshots: Vec<Snapshot>,
    /// What is wrong with others.
    pub unusable: Vec<SnapshotError>,
    /// The steps of those of which a part is missing, the newest first: of a run that was killed while it wrote them.
    pub incomplete: Vec<u64>,
}

/// Finds the snapshots of a run with this identity and these tiles. Those that were not complete when the run ended are passed
/// over.
///
/// # Errors
/// If there are some and all are damaged, or the newest that is not cannot be read, or is of another version or run.
pub(crate) fn find(snapshots: &Path, identity: &str, tiles: [u32; 2]) -> Result<Found, SnapshotError> {
    let mut found = Found::default();
    for (step, opened) in all(snapshots, identity, tiles)? {
        match opened {
            // Where there is a newer one, nobody may ever want this.
            Err(error) if !error.is_damage() && found.snapshots.is_empty() => return Err(error),
            opened => found.add(step, opened),
        }
    }
    if found.snapshots.is_empty() && !found.unusable.is_empty() {
        return Err(SnapshotError::NoneWhole { why: Box::new(found.unusable.swap_remove(0)) });
    }
    Ok(found)
}

/// As [`find`], for who only tells of them, whatever is wrong with any.
///
/// # Errors
/// If it cannot be known which there are.
pub(crate) fn find_all(snapshots: &Path, identity: &str, tiles: [u32; 2]) -> Result<Found, SnapshotError> {
    let mut found = Found::default();
    all(snapshots, identity, tiles)?.for_each(|(step, opened)| found.add(step, opened));
    Ok(found)
}

/// All snapshots, the newest first; nothing for one that is not complete.
fn all(
    snapshots: &Path,
    identity: &str,
    tiles: [u32; 2],
) -> Result<impl Iterator<Item = (u64, Result<Option<Snapshot>, SnapshotError>)>, SnapshotError> {
    let folders = folders(snapshots).map_err(|error| SnapshotError::read(snapshots, &error))?;
    let open = move |step: u64, folder: &Path| {
        let Some(snapshot) = Snapshot::open(folder)? else { return Ok(None) };
        snapshot.check_identity(identity)?;
        let reason = match (snapshot.step(), snapshot.tiles()) {
            (found, _) if found != step => format!("it is of step {found}"),
            (_, found) if found != tiles => format!("it is of {} x {} tiles", found[0], found[1]),
            _ => return Ok(Some(snapshot)),
        };
        Err(SnapshotError::damaged(folder, reason))
    };
    Ok(folders.into_iter().rev().map(move |(step, folder)| (step, open(step, &folder))))
}

impl Found {
    fn add(&mut self, step: u64, opened: Result<Option<Snapshot>, SnapshotError>) {
        match opened {
            Ok(Some(snapshot)) => self.snapshots.push(snapshot),
            Ok(None) => self.incomplete.push(step),
            Err(error) => self.unusable.push(error),
        }
    }
}

/// Removes snapshots from before `step`.
///
/// # Errors
/// What the system says.
pub(crate) fn remove_before(snapshots: &Path, step: u64) -> io::Result<()> {
    remove(snapshots, |found| found < step)
}

/// Removes snapshots from after `step`; all of them if there is none: what a run leaves that was killed later, or that
/// cannot be used.
///
/// # Errors
/// What the system says.
pub(crate) fn remove_after(snapshots: &Path, step: Option<u64>) -> io::Result<()> {
    remove(snapshots, |found| step.is_none_or(|step| found > step))
}

fn remove(snapshots: &Path, which: impl Fn(u64) -> bool) -> io::Result<()> {
    for (_, folder) in folders(snapshots)?.into_iter().filter(|&(step, _)| which(step)) {
        fs::remove_dir_all(folder)?;
    }
    Ok(())
}
