//! One rank's file of a snapshot.
//!
//! ```text
//! magic       8 bytes
//! lengths     of the facts in bytes, and of the index in blocks: two u64
//! facts       JSON
//! index       a [`Block`] for each tile, ascending
//! checksum    of all of the above: xxh3-128
//! blocks      as `atoll_core::World::save` makes them, one after the other, and nothing else
//! ```
//!
//! Everything is little-endian. Each block has a checksum of its own, so every byte is covered.

use super::SnapshotError;
use crate::command::State;
use crate::folder::durable::{sync_folder_of, write_durably};
use atoll_core::{Hashes, SNAPSHOT_FORMAT, SavedTile, TileId};
use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_128;

const MAGIC: [u8; 8] = *b"atollsnp";
const CHECKSUM: usize = size_of::<u128>();
const START: usize = MAGIC.len() + 2 * size_of::<u64>();

/// What a file says of itself.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Facts {
    /// Version of the program that wrote it.
    pub version: String,
    /// [`SNAPSHOT_FORMAT`] of its blocks.
    pub format: u32,
    /// Steps made.
    pub step: u64,
    /// Who wrote it.
    pub rank: u32,
    /// Of so many.
    pub ranks: u32,
    /// Columns and rows of tiles of the whole world, or of the squares that they are cut from.
    pub tiles: [u32; 2],
    /// Of tiles that follow the bodies: how often each was cut from its square, a letter for each.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub levels: Option<String>,
    /// What commands add up to beside the tiles, if there were any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) commands: Option<State>,
    /// Of its run, as [`Config::identity`](crate::Config::identity).
    pub identity: String,
}

/// Where a tile lies and what it holds.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Block {
    /// The tile.
    pub tile: u64,
    /// Bytes of its block.
    pub length: u64,
    /// Bodies it owns.
    pub bodies: u64,
    /// Contacts it holds.
    pub contacts: u64,
    /// Its fingerprints, as [`Hashes::to_words`].
    pub hashes: [u64; 4],
}

impl Block {
    fn new(saved: &SavedTile) -> Self {
        Self {
            tile: u64::from(saved.tile.0),
            length: saved.length as u64,
            bodies: saved.bodies,
            contacts: saved.contacts,
            hashes: saved.hashes.to_words(),
        }
    }
}

/// Writes the files of one rank.
#[derive(Debug)]
pub(crate) struct SnapshotWriter {
    facts: Facts,
}

impl SnapshotWriter {
    /// Writes what a rank of so many has to save; `tiles` and `identity` are those of the whole run.
    pub(crate) fn new(rank: u32, ranks: u32, tiles: [u32; 2], identity: String) -> Self {
        let version = env!("CARGO_PKG_VERSION").to_owned();
        Self {
            facts: Facts {
                version,
                format: SNAPSHOT_FORMAT,
                step: 0,
                rank,
                ranks,
                tiles,
                levels: None,
                commands: None,
                identity,
            },
        }
    }

    /// Writes the tiles that were saved after `step` to `blocks`, one after the other, to a file that is whole and durable
    /// when it has its name. Returns that name. `levels` are those of all tiles, if these follow the bodies, `commands` is what these
    /// add up to, if there were any.
    ///
    /// # Errors
    /// What the system says, with the file.
    pub(crate) fn write(
        &mut self,
        snapshots: &Path,
        step: u64,
        (levels, commands): (Option<&str>, Option<&State>),
        tiles: &[SavedTile],
        blocks: &[u8],
    ) -> Result<PathBuf, (PathBuf, io::Error)> {
        self.facts.step = step;
        (self.facts.levels, self.facts.commands) = (levels.map(str::to_owned), commands.cloned());
        let folder = snapshots.join(super::store::folder_name(step));
        let path = folder.join(super::store::file_name(self.facts.rank, self.facts.ranks));
        let head = head(&self.facts, tiles);
        let written = std::fs::create_dir_all(&folder).and_then(|()| {
            write_durably(&path, |file| {
                file.write_all(&head)?;
                file.write_all(blocks)
            })?;
            // The folders that it lies in have names as well.
            sync_folder_of(&folder)?;
            sync_folder_of(snapshots)
        });
        match written {
            Ok(()) => Ok(path),
            Err(error) => Err((path, error)),
        }
    }
}

/// Everything before the blocks.
fn head(facts: &Facts, tiles: &[SavedTile]) -> Vec<u8> {
    let index: Vec<Block> = tiles.iter().map(Block::new).collect();
    let facts = serde_json::to_vec(facts).expect("numbers and words, under names");
    let mut head = Vec::with_capacity(START + facts.len() + size_of_val(&index[..]) + CHECKSUM);
    head.extend(MAGIC);
    head.extend((facts.len() as u64).to_le_bytes());
    head.extend((index.len() as u64).to_le_bytes());
    head.extend(&facts);
    head.extend(bytemuck::cast_slice::<Block, u8>(&index));
    head.extend(xxh3_128(&head).to_le_bytes());
    head
}

/// A file whose facts and index were read and found whole; its blocks are read when asked for.
#[derive(Debug)]
pub struct SnapshotFile {
    /// Where it lies.
    pub path: PathBuf,
    /// What it says of itself.
    pub facts: Facts,
    /// Its tiles, ascending.
    pub blocks: Vec<Block>,
    /// Where each block begins.
    offsets: Vec<u64>,
}

impl SnapshotFile {
    /// Reads facts and index.
    ///
    /// # Errors
    /// If it cannot be read, or anything before the blocks, or the file's length, is not what was written; and if another
    /// version wrote it.
    pub fn open(path: &Path) -> Result<Self, SnapshotError> {
        let failed = |error: io::Error| match error.kind() {
            io::ErrorKind::UnexpectedEof => SnapshotError::damaged(path, "it is cut off"),
            _ => SnapshotError::read(path, &error),
        };
        let damaged = |reason: &str| SnapshotError::damaged(path, reason);
        let file = File::open(path).map_err(failed)?;
        let length = file.metadata().map_err(failed)?.len();
        let mut reader = BufReader::new(file);
        let mut head = vec![0; START];
        reader.read_exact(&mut head).map_err(failed)?;
        if head[..MAGIC.len()] != MAGIC {
            return Err(damaged("it does not begin as snapshots do"));
        }
        let number = |at: usize| u64::from_le_bytes(head[at..at + 8].try_into().expect("eight bytes"));
        let (facts, index) = (number(MAGIC.len()), number(MAGIC.len() + 8));
        let rest = index.checked_mul(size_of::<Block>() as u64).and_then(|index| index.checked_add(facts));
        // So that nothing is allocated that the file cannot fill.
        let rest =
            rest.filter(|rest| *rest < length).ok_or_else(|| damaged("its index does not fit into it"))? as usize;
        head.resize(START + rest + CHECKSUM, 0);
        reader.read_exact(&mut head[START..]).map_err(failed)?;
        let (head, checksum) = head.split_at(START + rest);
        if checksum != xxh3_128(head).to_le_bytes() {
            return Err(damaged("its index has another checksum than when it was written"));
        }
        let (facts, index) = head[START..].split_at(facts as usize);
        let facts = Self::facts(path, facts)?;
        let blocks: Vec<Block> = index.chunks_exact(size_of::<Block>()).map(bytemuck::pod_read_unaligned).collect();
        let mut end = (head.len() + CHECKSUM) as u64;
        let mut offsets = Vec::with_capacity(blocks.len());
        for block in &blocks {
            offsets.push(end);
            end = end.checked_add(block.length).ok_or_else(|| damaged("its blocks are longer than any file"))?;
        }
        if end != length {
            return Err(damaged(&format!("it has {length} bytes, and {end} were written")));
        }
        Ok(Self { path: path.to_owned(), facts, blocks, offsets })
    }

    /// Those of its tiles.
    pub fn hashes(&self) -> Hashes {
        self.blocks.iter().map(|block| Hashes::from_words(block.hashes)).fold(Hashes::default(), Hashes::merge)
    }

    /// Another version may have other facts as well, but none that tell the version otherwise.
    fn facts(path: &Path, text: &[u8]) -> Result<Facts, SnapshotError> {
        #[derive(Deserialize)]
        struct Versions {
            version: String,
            format: u32,
        }
        let unreadable = |error: serde_json::Error| SnapshotError::damaged(path, error);
        let found: Versions = serde_json::from_slice(text).map_err(unreadable)?;
        let other = |what, found, expected: String| {
            Err(SnapshotError::OtherVersion { path: path.to_owned(), what, found, expected })
        };
        if found.version != env!("CARGO_PKG_VERSION") {
            return other("program version", found.version, env!("CARGO_PKG_VERSION").to_owned());
        }
        if found.format != SNAPSHOT_FORMAT {
            return other("snapshot format", found.format.to_string(), SNAPSHOT_FORMAT.to_string());
        }
        serde_json::from_slice(text).map_err(unreadable)
    }

    /// Reads the block at a place of the index into `bytes`, which it replaces.
    ///
    /// # Errors
    /// If it cannot be read. Whether it is what was written, whoever makes a tile of it finds out.
    pub fn read(&self, place: usize, bytes: &mut Vec<u8>) -> Result<(), SnapshotError> {
        bytes.resize(self.blocks[place].length as usize, 0);
        let read = File::open(&self.path).and_then(|mut file| {
            file.seek(SeekFrom::Start(self.offsets[place]))?;
            file.read_exact(bytes)
        });
        read.map_err(|error| SnapshotError::read(&self.path, &error))
    }

    /// Reads every block and checks that it is what was written.
    ///
    /// # Errors
    /// If one of them is not.
    pub fn check(&self) -> Result<(), SnapshotError> {
        let mut bytes = Vec::new();
        for (place, block) in self.blocks.iter().enumerate() {
            self.read(place, &mut bytes)?;
            let read = u32::try_from(block.tile).map(|tile| SavedTile::read(TileId(tile), &bytes));
            let saved = read.map_err(|error| SnapshotError::damaged(&self.path, error))?;
            let saved = saved.map_err(|error| SnapshotError::damaged(&self.path, error))?;
            if Block::new(&saved) != *block {
                let reason = format!("its index and tile {} tell differently", block.tile);
                return Err(SnapshotError::damaged(&self.path, reason));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Writes a file with other facts and the checksum that goes with them.
    pub(in crate::folder::snapshot) fn rewrite_facts(path: &Path, bytes: &[u8], change: impl Fn(&str) -> String) {
        let number = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
        let (end, rest) = (START + number(8), START + number(8) + number(16) * size_of::<Block>());
        let facts = change(std::str::from_utf8(&bytes[START..end]).unwrap());
        let mut head = [&MAGIC[..], &(facts.len() as u64).to_le_bytes(), &bytes[16..START]].concat();
        head.extend(facts.as_bytes());
        head.extend(&bytes[end..rest]);
        head.extend(xxh3_128(&head).to_le_bytes());
        head.extend(&bytes[rest + CHECKSUM..]);
        std::fs::write(path, head).unwrap();
    }
}
