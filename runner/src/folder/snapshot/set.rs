//! A whole snapshot: the files of all ranks that wrote it.

use super::{SnapshotError, SnapshotFile, store};
use crate::command::State;
use crate::config::other_run;
use crate::folder::tilings::{of_letters, tiles_in_letters};
use atoll_core::{Hashes, Partition, SetupError, TileId, World};
use std::path::{Path, PathBuf};

/// A snapshot of which all files are there, with every tile in one of them.
#[derive(Debug)]
pub struct Snapshot {
    /// Where its files lie.
    pub folder: PathBuf,
    /// Its files, by rank.
    pub files: Vec<SnapshotFile>,
    /// For each tile its file and its place in there.
    places: Vec<(u32, u32)>,
}

impl Snapshot {
    /// Reads what the files in a folder say of themselves. `None` if some are not there: a run that was killed while it
    /// wrote leaves such a folder.
    ///
    /// # Errors
    /// If they cannot be read, do not belong together, or are of another version.
    pub fn open(folder: &Path) -> Result<Option<Self>, SnapshotError> {
        let Some(paths) = store::complete_set(folder)? else { return Ok(None) };
        let files: Vec<_> = paths.iter().map(|path| SnapshotFile::open(path)).collect::<Result<_, _>>()?;
        let (first, ranks) = (&files[0].facts, files.len() as u32);
        let tiles: usize = files.iter().map(|file| file.blocks.len()).sum();
        let [columns, rows] = first.tiles.map(u64::from);
        if first.levels.as_deref().map_or(columns * rows, |text| tiles_in_letters(text) as u64) != tiles as u64 {
            return Err(SnapshotError::damaged(folder, format!("its files have {tiles} tiles, not those of its grid")));
        }
        let mut places = vec![None; tiles];
        for ((number, file), path) in (0..).zip(&files).zip(&paths) {
            let facts = &file.facts;
            let alike = (facts.rank, facts.ranks) == (number, ranks)
                && (facts.step, facts.tiles, &facts.levels) == (first.step, first.tiles, &first.levels)
                && facts.commands == first.commands
                && facts.identity == first.identity;
            if !alike {
                return Err(SnapshotError::damaged(path, "it belongs to another snapshot"));
            }
            for (place, block) in (0..).zip(&file.blocks) {
                let slot = usize::try_from(block.tile).ok().and_then(|tile| places.get_mut(tile));
                match slot {
                    Some(slot @ None) => *slot = Some((number, place)),
                    _ => return Err(SnapshotError::damaged(path, format!("it has tile {} too much", block.tile))),
                }
            }
        }
        // As many tiles as places, and none twice: each has its own.
        let places = places.into_iter().flatten().collect();
        Ok(Some(Self { folder: folder.to_owned(), files, places }))
    }

    /// Refuses a snapshot of a run that is configured otherwise than one of this identity.
    ///
    /// # Errors
    /// Naming the first key that differs.
    pub fn check_identity(&self, identity: &str) -> Result<(), SnapshotError> {
        let file = &self.files[0];
        other_run(identity, &file.facts.identity).map_or(Ok(()), |difference| {
            Err(SnapshotError::OtherConfiguration {
                path: file.path.clone(),
                key: difference.key,
                found: difference.theirs,
                expected: difference.ours,
            })
        })
    }

    /// Steps made.
    pub fn step(&self) -> u64 {
        self.files[0].facts.step
    }

    /// The tiles that it was saved with, in a run that began with these.
    ///
    /// # Errors
    /// If there are no such tiles.
    pub fn partition(&self, first: &Partition) -> Result<Partition, SnapshotError> {
        let facts = &self.files[0].facts;
        let damaged = || SnapshotError::damaged(&self.folder, "its tiles are not those of its run");
        if facts.levels.is_none() != first.is_uniform() {
            return Err(damaged());
        }
        let Some(levels) = &facts.levels else { return Ok(first.clone()) };
        of_letters(levels, [first.min(), first.max()], first.roots()).ok_or_else(damaged)
    }

    /// What commands had added up to, if there were any.
    pub(crate) fn commands(&self) -> Option<&State> {
        self.files[0].facts.commands.as_ref()
    }

    /// Columns and rows of tiles, or of the squares that they are cut from.
    pub fn tiles(&self) -> [u32; 2] {
        self.files[0].facts.tiles
    }

    /// Bodies of each tile.
    pub fn weights(&self) -> Vec<u64> {
        self.places.iter().map(|&(file, place)| self.files[file as usize].blocks[place as usize].bodies).collect()
    }

    /// Of the whole world.
    pub fn hashes(&self) -> Hashes {
        self.files.iter().map(SnapshotFile::hashes).fold(Hashes::default(), Hashes::merge)
    }

    /// Reads all of it and checks that it is what was written.
    ///
    /// # Errors
    /// If something is not.
    pub fn check(&self) -> Result<(), SnapshotError> {
        self.files.iter().try_for_each(SnapshotFile::check)
    }

    /// Makes the tiles of a world, which has no bodies yet, what they were.
    ///
    /// # Errors
    /// If any of them is not what was written.
    pub fn restore(&self, world: &mut World) -> Result<(), SnapshotError> {
        let refused = |error: SetupError| SnapshotError::damaged(&self.folder, error);
        self.commands().map_or(Ok(()), |state| state.prepare(world)).map_err(refused)?;
        let mut bytes = Vec::new();
        for tile in world.tiles().collect::<Vec<TileId>>() {
            let (file, place) = self.places[tile.0 as usize];
            let file = &self.files[file as usize];
            file.read(place as usize, &mut bytes)?;
            world.restore(tile, &bytes).map_err(|error| SnapshotError::damaged(&file.path, error))?;
        }
        world.resume_at(self.step());
        self.commands().map_or(Ok(()), |state| state.resume(world)).map_err(refused)
    }
}
