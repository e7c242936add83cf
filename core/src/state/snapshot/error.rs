//! Why a saved tile cannot be restored.

use crate::model::id::{GlobalId, TileId};
use crate::state::hash::Hashes;
use thiserror::Error;

/// Why a saved tile cannot be restored.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
pub enum RestoreError {
    /// The world has no such tile.
    #[error("saved tile {tile}: this rank does not hold it")]
    NotHere {
        /// The tile asked for.
        tile: TileId,
    },
    /// The world has the tile already, or it is none of its grid.
    #[error("saved tile {tile}: this rank cannot take it over")]
    NotToBeTaken {
        /// The tile.
        tile: TileId,
    },
    /// Saved by another version of the program.
    #[error("saved tile {tile}: of format {found} where {expected} is read: resume with the version that saved it")]
    Version {
        /// The tile.
        tile: TileId,
        /// In the block.
        found: u32,
        /// Ours.
        expected: u32,
    },
    /// The block of another tile.
    #[error("saved tile {tile}: its block is that of tile {found}: use another snapshot")]
    OtherTile {
        /// The tile asked for.
        tile: TileId,
        /// In the block.
        found: TileId,
    },
    /// Lengths that do not add up.
    #[error("saved tile {tile}: a block of {length} bytes announces {announced}: use another snapshot")]
    Length {
        /// The tile.
        tile: TileId,
        /// Bytes given.
        length: usize,
        /// Bytes its header speaks of.
        announced: u64,
    },
    /// The checksum is another one.
    #[error("saved tile {tile}: its bytes have changed since: use another snapshot")]
    Damaged {
        /// The tile.
        tile: TileId,
    },
    /// A body that cannot be one of this world.
    #[error(
        "saved tile {tile}: the state of body {id} is not finite, its kind no row of the table, or its name a static's: \
         resume with the configuration that was saved, or from an earlier snapshot"
    )]
    BadBody {
        /// The tile.
        tile: TileId,
        /// The body's name.
        id: GlobalId,
    },
    /// Times of rest that cannot be.
    #[error(
        "saved tile {tile}: bodies have rested where none may sleep, or for no time: resume with the configuration \
         that was saved"
    )]
    BadRest {
        /// The tile.
        tile: TileId,
    },
    /// A ghost that cannot be one of this tile.
    #[error(
        "saved tile {tile}: body {id} of another tile is not in order, its owner no other tile of the grid, or its name \
         a static's: resume with the configuration that was saved"
    )]
    BadGhost {
        /// The tile.
        tile: TileId,
        /// The body's name.
        id: GlobalId,
    },
    /// A contact that cannot be one of this tile.
    #[error(
        "saved tile {tile}: contact {contact} is not in order, not finite, or between bodies that are not there: resume \
         with the configuration that was saved"
    )]
    BadContact {
        /// The tile.
        tile: TileId,
        /// Its place, from 0.
        contact: usize,
    },
    /// All of it is possible, and it is not what was saved.
    #[error(
        "saved tile {tile}: its hashes are {restored} where they were {saved}: resume with the configuration that was \
         saved"
    )]
    Hashes {
        /// The tile.
        tile: TileId,
        /// In the block.
        saved: Hashes,
        /// Of the bodies and contacts in the block.
        restored: Hashes,
    },
}
