//! Who is near which tiles.

use crate::exchange::overlap::Outline;
use crate::model::contact::{Slot, SlotKind};
use crate::model::id::TileId;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// The other tiles that bodies are near to, as in [`Outline::near`].
#[derive(Default, Debug)]
pub(super) struct Near {
    tiles: Vec<TileId>,
    /// Where those of each body begin that may be near to any, and where the last ones end.
    starts: Vec<u32>,
    /// Of each of a tile's bodies one more than its place among these; zero of those that are near to none.
    places: Vec<u32>,
}

impl Near {
    /// Finds those of all of a tile's bodies. Ghosts are always counted among them.
    pub(super) fn find(&mut self, tile: &Tile, setup: &Setup) {
        self.tiles.clear();
        self.starts.clear();
        self.places.clear();
        self.places.resize(tile.bodies.len(), 0);
        let positions = &tile.bodies.position[..tile.owned + tile.ghosts()];
        for (body, &position) in positions.iter().enumerate() {
            let is_ghost = body >= tile.owned;
            if !is_ghost && tile.interior.contains(position) {
                continue;
            }
            let first = self.tiles.len();
            self.tiles.extend(Outline::of(tile, body, setup).near(setup).filter(|&peer| peer != tile.id));
            if is_ghost || self.tiles.len() > first {
                self.starts.push(first as u32);
                self.places[body] = self.starts.len() as u32;
            }
        }
        self.starts.push(self.tiles.len() as u32);
    }

    /// Whether a body is a ghost, or near to others.
    #[inline]
    pub(super) fn knows(&self, body: u32) -> bool {
        self.places[body as usize] != 0
    }

    /// Those of a body.
    #[inline]
    pub(super) fn of(&self, body: usize) -> &[TileId] {
        match self.places[body] as usize {
            0 => &[],
            place => &self.tiles[self.starts[place - 1] as usize..self.starts[place] as usize],
        }
    }

    /// Whether a tile that a body is near solves its contact with this partner though it owns neither.
    #[inline]
    pub(super) fn solves(&self, peer: TileId, tile: &Tile, partner: Slot) -> bool {
        matches!(partner.kind(), SlotKind::Static(_)) || self.of(tile.index(partner)).contains(&peer)
    }
}
