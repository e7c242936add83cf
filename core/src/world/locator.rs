//! Where a body is, by its name: a hash table that is made when somebody first asks, and kept from then on.

use crate::model::id::GlobalId;
use crate::tiling::tile::Tile;
use rustc_hash::FxHashMap;

/// A body's tile, by its place among the world's, and where in there it was last seen.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Place {
    pub(super) tile: u32,
    /// As [`Tile::present`] counts.
    pub(super) at: u32,
}

/// For each body of a world its tile for certain; where in there it is only as long as the tile keeps its order, which is looked at
/// again. Of bodies that left for another world it may still tell where they were.
#[derive(Debug)]
pub(super) struct Locator {
    places: FxHashMap<GlobalId, Place>,
}

impl Locator {
    /// Of all bodies of some tiles. Takes time for each.
    pub(super) fn new(tiles: &[Tile]) -> Self {
        let count = tiles.iter().map(Tile::count).sum();
        let mut locator = Self { places: FxHashMap::with_capacity_and_hasher(count, rustc_hash::FxBuildHasher) };
        for (number, tile) in (0..).zip(tiles) {
            locator.write_down(number, tile);
        }
        locator
    }

    fn write_down(&mut self, number: u32, tile: &Tile) {
        for (at, body) in tile.present() {
            self.places.insert(body.id, Place { tile: number, at });
        }
    }

    /// Where a body is, if it is one of these tiles'.
    pub(super) fn find(&self, id: GlobalId, tiles: &[Tile]) -> Option<Place> {
        Self::confirm(id, *self.places.get(&id)?, tiles)
    }

    /// Where a body is that was last seen there.
    fn confirm(id: GlobalId, known: Place, tiles: &[Tile]) -> Option<Place> {
        Some(Place { at: tiles[known.tile as usize].find(id, known.at)?, ..known })
    }

    /// As [`find`](Self::find), and remembers it.
    pub(super) fn look_up(&mut self, id: GlobalId, tiles: &[Tile]) -> Option<Place> {
        let known = *self.places.get(&id)?;
        let found = Self::confirm(id, known, tiles);
        match found {
            Some(place) if place == known => {}
            Some(place) => drop(self.places.insert(id, place)),
            None => drop(self.places.remove(&id)),
        }
        found
    }

    pub(super) fn insert(&mut self, id: GlobalId, place: Place) {
        self.places.insert(id, place);
    }

    /// Forgets a body, and says where it was last seen. If it may have left for another world, that is looked at; else it is there.
    pub(super) fn remove(&mut self, id: GlobalId, may_have_left: bool, tiles: &[Tile]) -> Option<Place> {
        let known = self.places.remove(&id)?;
        if may_have_left { Self::confirm(id, known, tiles) } else { Some(known) }
    }

    /// After a step: the bodies of a tile that are new there, or in another place.
    pub(super) fn follow(&mut self, number: u32, tile: &mut Tile) {
        let ids = &tile.bodies.id[..tile.owned];
        if std::mem::take(&mut tile.is_rearranged) {
            return self.places.extend(ids.iter().zip(0..).map(|(&id, at)| (id, Place { tile: number, at })));
        }
        for &at in &tile.newcomers {
            self.places.insert(ids[at as usize], Place { tile: number, at });
        }
    }

    /// Whether it remembers many more bodies than there are.
    pub(super) fn is_stale(&self, bodies: usize) -> bool {
        self.places.len() > 2 * bodies + 4096
    }
}
