//! Snapshots: a tile as a block of bytes, and a block of bytes as a tile. Files are somebody else's business.
//!
//! A block is all that the future of a tile depends on:
//!
//! ```text
//! header     64 bytes: format, tile, checksum of all that follows it, counts, the tile's hashes
//! bodies     six columns: names, positions, rotations, velocities, angular velocities, kinds; ghosts after owned ones
//! rest       where bodies may sleep, how long each has rested
//! owners     of the ghosts
//! contacts   two columns: keys, and the contacts themselves
//! ```
//!
//! Everything lies there as it does in memory, little-endian and with nothing between, so that saving is copying.
//! Bodies and ghosts are in the order of the tile: contacts know them by their slots, and the order of constraints
//! follows from that of bodies. The next step makes ghosts anew, and asks whom a contact was with and who was near. Statics
//! are in the setup. All else is derived in each step; who sleeps follows from who has
//! rested.

use crate::exchange::record::Unseen;
use crate::islands::sleep::Sleep;
use crate::model::body::{Bodies, Body};
use crate::model::contact::{Contact, ContactCache, PairKey, Slot, SlotKind};
use crate::model::id::TileId;
use crate::state::hash::Hashes;
use crate::state::layout::layout;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use crate::world::World;
use bytemuck::{Pod, Zeroable, cast_slice};
use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

mod error;
#[cfg(test)]
mod tests;

pub use error::RestoreError;

/// The version of a saved tile; grows with every change of what is saved.
pub const SNAPSHOT_FORMAT: u32 = 2;

/// What was saved of one tile.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SavedTile {
    /// Which.
    pub tile: TileId,
    /// Bytes of its block.
    pub length: usize,
    /// Bodies it owns.
    pub bodies: u64,
    /// Contacts it holds.
    pub contacts: u64,
    /// Their fingerprints; [`Hashes::merge`] those of all tiles for those of the world.
    pub hashes: Hashes,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Header {
    format: u32,
    tile: TileId,
    checksum: u64,
    bodies: u32,
    /// Bodies of which it is known how long they have rested.
    rested: u32,
    ghosts: u32,
    contacts: u32,
    state: u128,
    contact: u128,
}

layout!(Header {
    format: 0, tile: 4, checksum: 8, bodies: 16, rested: 20, ghosts: 24, contacts: 28, state: 32, contact: 48
} 64);

const HEADER: usize = size_of::<Header>();
/// What comes before the bytes that the checksum is of.
const UNCHECKED: usize = 16;

impl Header {
    fn of(tile: &Tile, hashes: Hashes) -> Self {
        Self {
            format: SNAPSHOT_FORMAT,
            tile: tile.id,
            checksum: 0,
            bodies: tile.owned as u32,
            rested: tile.sleep.still().len() as u32,
            ghosts: tile.ghosts() as u32,
            contacts: tile.contacts.len() as u32,
            state: hashes.state,
            contact: hashes.contact,
        }
    }

    /// The header of a block that was saved of this tile and is as long as it says and unchanged.
    fn read(tile: TileId, block: &[u8]) -> Result<Self, RestoreError> {
        let wrong_length = |announced| RestoreError::Length { tile, length: block.len(), announced };
        let header = block.get(..HEADER).ok_or(wrong_length(HEADER as u64))?;
        let header: Self = bytemuck::pod_read_unaligned(header);
        if header.format != SNAPSHOT_FORMAT {
            return Err(RestoreError::Version { tile, found: header.format, expected: SNAPSHOT_FORMAT });
        }
        if header.tile != tile {
            return Err(RestoreError::OtherTile { tile, found: header.tile });
        }
        if header.length() != block.len() as u64 {
            return Err(wrong_length(header.length()));
        }
        if header.checksum != checksum(block) {
            return Err(RestoreError::Damaged { tile });
        }
        Ok(header)
    }

    fn saved(&self, tile: TileId) -> SavedTile {
        SavedTile {
            tile,
            length: self.length() as usize,
            bodies: u64::from(self.bodies),
            contacts: u64::from(self.contacts),
            hashes: self.hashes(),
        }
    }

    fn hashes(&self) -> Hashes {
        Hashes { state: self.state, contact: self.contact }
    }

    /// Bytes of the whole block.
    fn length(&self) -> u64 {
        let arrays = [
            (self.bodies, size_of::<Body>()),
            (self.rested, size_of::<f32>()),
            (self.ghosts, size_of::<Body>() + size_of::<TileId>()),
            (self.contacts, size_of::<PairKey>() + size_of::<Contact>()),
        ];
        arrays.iter().fold(HEADER as u64, |sum, &(count, size)| sum + u64::from(count) * size as u64)
    }
}

impl SavedTile {
    /// What a block tells of itself, once it is seen to be what was saved of a tile, whole and unchanged.
    ///
    /// # Errors
    /// If it is not.
    pub fn read(tile: TileId, block: &[u8]) -> Result<Self, RestoreError> {
        Ok(Header::read(tile, block)?.saved(tile))
    }
}

impl World {
    /// Replaces `bytes` with a block for each tile, ascending, and tells what is in them. For a world between two steps:
    /// one that failed has left its tiles halfway. A state that is no longer finite, as only the next step would tell,
    /// can be saved and not restored.
    pub fn save(&self, bytes: &mut Vec<u8>) -> Vec<SavedTile> {
        let tiles: Vec<_> = self.tile_states().iter().map(|tile| tile.settled(&self.setup)).collect();
        let total = tiles.iter().map(|tile| length(tile)).sum::<usize>();
        if bytes.capacity() < total {
            // Given back before there is more; with some to spare, as contacts grow from one snapshot to the next. New memory
            // comes zeroed from the system: the threads are the first to touch it.
            *bytes = Vec::new();
            *bytes = vec![0; total + total / 16];
        }
        bytes.resize(total, 0);
        let mut rest = &mut bytes[..];
        let blocks = tiles.iter().map(|tile| rest.split_off_mut(..length(tile)).expect("room was made for every tile"));
        let blocks: Vec<_> = blocks.collect();
        tiles.par_iter().zip(blocks).with_max_len(1).map(|(tile, block)| save(tile, tile.hashes(), block)).collect()
    }

    /// Makes a tile what it was when `block` was saved; what it held before is forgotten. On an error it is left as it
    /// was. The blueprint must be the one of the world that was saved, with gravity and kinds as they had become
    /// by commands, given before this; and all tiles are to be restored to one moment: a body that has gone
    /// from one to another meanwhile would be in both, or in none.
    ///
    /// # Errors
    /// If this world does not hold the tile, or the block is not one that this version saved of it, whole and
    /// unchanged. Never panics, and allocates in proportion to the bytes given.
    pub fn restore(&mut self, tile: TileId, block: &[u8]) -> Result<(), RestoreError> {
        let place = self.place_of(tile).ok_or(RestoreError::NotHere { tile })?;
        let (restored, saved) = read(tile, self.tile_states()[place].reached.clone(), block, &self.setup)?;
        let hashes = restored.hashes();
        if hashes != saved {
            return Err(RestoreError::Hashes { tile, saved, restored: hashes });
        }
        self.replace_tile(place, restored);
        Ok(())
    }

    /// Counts steps on from `step`, the [`step_count`](Self::step_count) of the world that was saved: some of what a step
    /// does depends on its number. Every rank must be told the same, once all of its tiles are restored, to blocks of its partition; what is
    /// not restored stays as a step that failed has left it. That failure, whatever was asked of the next step, and forces, which are no part of
    /// tiles, are forgotten: begin them again after this.
    pub fn resume_at(&mut self, step: u64) {
        self.step = step;
        self.begin_anew();
    }
}

/// The columns of a block, in their order, with these keys of the contacts.
fn columns<'a>(tile: &'a Tile, keys: &'a [PairKey]) -> [&'a [u8]; 10] {
    let Tile { bodies, owned, ghost_owners, contacts, sleep, .. } = tile;
    let dynamic = *owned + tile.ghosts();
    [
        cast_slice(&bodies.id[..dynamic]),
        cast_slice(&bodies.position[..dynamic]),
        cast_slice(&bodies.rotation[..dynamic]),
        cast_slice(&bodies.velocity[..dynamic]),
        cast_slice(&bodies.angular_velocity[..dynamic]),
        cast_slice(&bodies.kind[..dynamic]),
        cast_slice(sleep.still()),
        cast_slice(ghost_owners),
        cast_slice(keys),
        cast_slice(&contacts.contacts),
    ]
}

/// Bytes of a tile's block.
fn length(tile: &Tile) -> usize {
    HEADER + columns(tile, &tile.contacts.keys).iter().map(|column| column.len()).sum::<usize>()
}

fn save(tile: &Tile, hashes: Hashes, block: &mut [u8]) -> SavedTile {
    let mut header = Header::of(tile, hashes);
    let mut at = HEADER;
    for column in columns(tile, &tile.keys_of_reached()) {
        block[at..at + column.len()].copy_from_slice(column);
        at += column.len();
    }
    block[..HEADER].copy_from_slice(bytemuck::bytes_of(&header));
    header.checksum = checksum(block);
    block[..HEADER].copy_from_slice(bytemuck::bytes_of(&header));
    header.saved(tile.id)
}

fn checksum(block: &[u8]) -> u64 {
    xxh3_64(&block[UNCHECKED..])
}

/// The unread rest of a block whose length is known to be right.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn column<T: Pod>(&mut self, count: usize) -> Vec<T> {
        let (bytes, rest) = self.0.split_at(count * size_of::<T>());
        self.0 = rest;
        let mut column = vec![T::zeroed(); count];
        bytemuck::cast_slice_mut(&mut column).copy_from_slice(bytes);
        column
    }
}

/// The block of one tile, without its hashes: for who reads it at once, and has the checksum.
pub(crate) fn block(tile: &Tile) -> Vec<u8> {
    let mut block = vec![0; length(tile)];
    save(tile, Hashes::default(), &mut block);
    block
}

/// The tile that was saved in `block`, which these rows of the statics reach, and the hashes that were saved with it.
pub(crate) fn read(
    tile: TileId,
    statics: Vec<u32>,
    block: &[u8],
    setup: &Setup,
) -> Result<(Tile, Hashes), RestoreError> {
    let header = Header::read(tile, block)?;
    let mut reader = Reader(&block[HEADER..]);
    let (owned, dynamic) = (header.bodies as usize, header.bodies as usize + header.ghosts as usize);
    let mut bodies = Bodies {
        id: reader.column(dynamic),
        position: reader.column(dynamic),
        rotation: reader.column(dynamic),
        velocity: reader.column(dynamic),
        angular_velocity: reader.column(dynamic),
        kind: reader.column(dynamic),
    };
    let sleep = Sleep::of(reader.column(header.rested as usize));
    let ghost_owners = reader.column(header.ghosts as usize);
    let contacts = header.contacts as usize;
    let contacts = ContactCache { keys: reader.column(contacts), contacts: reader.column(contacts) };
    statics.iter().for_each(|&row| bodies.push(setup.statics[row as usize]));
    let unseen = vec![Unseen::default(); dynamic - owned];
    let empty = Tile::within(tile, statics, setup);
    let restored = Tile { bodies, owned, unseen, ghost_owners, contacts, sleep, ..empty };
    check(&restored, setup)?;
    Ok((restored, header.hashes()))
}

/// Whether a tile that somebody else wrote down can be stepped.
fn check(tile: &Tile, setup: &Setup) -> Result<(), RestoreError> {
    let id = tile.id;
    let mut owned = (0..tile.owned).map(|i| tile.bodies.get(i));
    if let Some(body) = owned.find(|body| !(body.is_finite() && setup.knows(body))) {
        return Err(RestoreError::BadBody { tile: id, id: body.id });
    }
    let still = tile.sleep.still();
    let may_rest = if setup.params.sleep { tile.owned } else { 0 };
    if still.len() > may_rest || still.iter().any(|&still| !(still.is_finite() && still >= 0.0)) {
        return Err(RestoreError::BadRest { tile: id });
    }
    let mut last = None;
    let ghosts = (tile.owned..).map(|i| tile.bodies.get(i));
    let bad_ghost = tile.ghost_owners.iter().zip(ghosts).find(|(owner, ghost)| {
        let ascends = last.replace((**owner, ghost.id)) <= Some((**owner, ghost.id));
        let elsewhere = **owner != id && (owner.0 as usize) < setup.partition.tiles();
        !(ascends && elsewhere && ghost.is_finite() && setup.knows(ghost))
    });
    if let Some((_, ghost)) = bad_ghost {
        return Err(RestoreError::BadGhost { tile: id, id: ghost.id });
    }
    let mut last = None;
    let bad_contact = tile.contacts.iter().position(|(key, contact)| {
        let exists = |slot: Slot| match slot.kind() {
            SlotKind::Owned(i) => i < tile.owned,
            SlotKind::Ghost(i) => i < tile.ghosts(),
            SlotKind::Static(i) => i < tile.statics.len(),
        };
        let moves = !matches!(key.low().kind(), SlotKind::Static(_)) && (key.is_own() || setup.overlap.is_some());
        let slots = moves && exists(key.low()) && exists(key.high()) && key.low() < key.high();
        let name = (key, contact.pieces());
        let ascends = last.replace(name) < Some(name);
        !(slots && ascends && contact.is_finite())
    });
    match bad_contact {
        Some(contact) => Err(RestoreError::BadContact { tile: id, contact }),
        None => Ok(()),
    }
}
