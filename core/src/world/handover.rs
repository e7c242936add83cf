//! Tiles that move from one world to another, between two steps, as blocks of [`World::save`]'s kind.

use super::World;
use crate::model::id::TileId;
use crate::state::snapshot::{self, RestoreError};
use crate::tiling::tile::Tile;

impl World {
    /// Gives up some tiles, ascending and each one of its own: their blocks, in the same order. A world that
    /// [has failed](Self::has_failed) has none to give.
    ///
    /// # Panics
    /// If a tile is not of this world.
    pub fn give_up(&mut self, tiles: &[TileId]) -> Vec<Vec<u8>> {
        let places = tiles.iter().map(|&tile| self.place_of(tile).expect("only who holds a tile can give it up"));
        let places: Vec<usize> = places.collect();
        let blocks = places.iter().map(|&place| snapshot::block(&self.tiles[place])).collect();
        let mut leaving = places.into_iter().peekable();
        let mut place = 0;
        let mut stays = || {
            place += 1;
            leaving.next_if_eq(&(place - 1)).is_none()
        };
        let stays: Vec<bool> = self.tiles.iter().map(|_| stays()).collect();
        let (mut of_tiles, mut of_works) = (stays.iter(), stays.iter());
        self.tiles.retain(|_| *of_tiles.next().expect("one for each tile"));
        self.works.retain(|_| *of_works.next().expect("one for each tile"));
        self.find_places();
        blocks
    }

    /// Takes over tiles that another world gave up at the same step. On an error it is left as it was.
    ///
    /// # Errors
    /// If it holds one of the tiles already, or a block is not what was saved of its tile, whole and unchanged, or holds a
    /// body that is not fit to be stepped.
    pub fn take_over(&mut self, blocks: &[(TileId, &[u8])]) -> Result<(), RestoreError> {
        let mut taken = Vec::with_capacity(blocks.len());
        for &(tile, block) in blocks {
            let known = (tile.0 as usize) < self.setup.grid.tiles() && self.place_of(tile).is_none();
            if !known || taken.iter().any(|taken: &Tile| taken.id == tile) {
                return Err(RestoreError::NotToBeTaken { tile });
            }
            taken.push(snapshot::restore(tile, self.setup.statics_of(tile), block, &self.setup)?);
        }
        let mut kept: Vec<_> =
            std::mem::take(&mut self.tiles).into_iter().zip(std::mem::take(&mut self.works)).collect();
        kept.extend(taken.into_iter().map(|tile| (tile, None)));
        kept.sort_by_key(|(tile, _)| tile.id);
        (self.tiles, self.works) = kept.into_iter().unzip();
        self.find_places();
        Ok(())
    }

    fn place_of(&self, tile: TileId) -> Option<usize> {
        self.tiles.binary_search_by_key(&tile, |tile| tile.id).ok()
    }

    /// After tiles came or went: where each of them is, and which have something to do.
    fn find_places(&mut self) {
        self.inbox.hold(self.tiles.iter().map(|tile| tile.id));
        self.dismissed.clear();
        self.changed = true;
    }
}
