//! The contacts of a tile, as a step finds them.

use crate::collide::broad_phase::Pair;
use crate::model::contact::ContactCache;
use crate::tiling::tile::Tile;

/// What a step knows of each of a tile's contacts beside what outlives it, in their canonical order: ascending by their bodies' slots,
/// whatever order the pairs came in.
#[derive(Default, Debug)]
pub(crate) struct Contacts {
    /// The separation of its points now.
    pub(crate) separation: Vec<[f32; 2]>,
    /// The indices of body A, the one with the lower GlobalId, and body B.
    pub(crate) bodies: Vec<Pair>,
    /// The same of those that were found before.
    pub(super) before: Vec<Pair>,
}

impl Contacts {
    /// Whether they are between the same bodies as those that were found before, as what rests has them.
    pub(crate) fn are_between_the_same(&self) -> bool {
        self.bodies == self.before
    }

    /// Contacts of a tile, and border contacts, of which body A is owned: so that each is counted by one tile.
    pub(crate) fn count(&self, tile: &Tile) -> (u64, u64) {
        let (mut all, mut border) = (0, 0);
        for (&[a, _], &key) in self.bodies.iter().zip(&tile.contacts.keys[..tile.contacts.own()]) {
            let is_border = key.is_border();
            let counts = !is_border || (a as usize) < tile.owned;
            all += u64::from(counts);
            border += u64::from(counts && is_border);
        }
        (all, border)
    }
}

/// All that is found of contacts, a column for each.
#[derive(Default, Debug)]
pub(super) struct Found {
    pub(super) cache: ContactCache,
    /// As in [`Contacts`].
    pub(super) separation: Vec<[f32; 2]>,
    pub(super) bodies: Vec<Pair>,
}

impl Found {
    pub(super) fn clear(&mut self) {
        self.cache.clear();
        self.separation.clear();
        self.bodies.clear();
    }

    pub(super) fn append(&mut self, other: &mut Self) {
        self.cache.append(&mut other.cache);
        self.separation.append(&mut other.separation);
        self.bodies.append(&mut other.bodies);
    }
}
