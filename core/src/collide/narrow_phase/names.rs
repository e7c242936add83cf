//! Pairs under the names of their contacts, and what is known of these.

use super::BLOCK;
use crate::collide::broad_phase::Pair;
use crate::model::contact::{Contact, PairKey, Slot};
use crate::parallel::ahead::fetch;
use crate::tiling::tile::Tile;

/// A pair as its contact names it.
#[derive(Clone, Copy)]
pub(super) struct Named<'a> {
    pub(super) key: PairKey,
    /// Bodies A and B.
    pub(super) bodies: Pair,
    pub(super) known: Option<&'a Contact>,
    /// The place of the first of its contacts of the last step, if it has any but by name.
    pub(super) old: u32,
}

/// Names pairs that ascend: one pass over the contacts of the last step serves them all.
pub(super) struct Names<'a> {
    tile: &'a Tile,
    by_name: &'a [bool],
    ghosts: usize,
    /// The first contact of the last step that is not before the pairs so far.
    old: usize,
}

impl<'a> Names<'a> {
    pub(super) fn new(tile: &'a Tile, by_name: &'a [bool], sorted: &[Pair]) -> Self {
        let mut names = Self { tile, by_name, ghosts: tile.ghosts(), old: 0 };
        if let Some(&first) = sorted.first() {
            let first = names.key(first);
            names.old = tile.contacts.keys.partition_point(|&key| key < first);
        }
        names
    }

    #[inline(always)]
    fn key(&self, [low, high]: Pair) -> PairKey {
        let slot = |index: u32| Slot::from_index(index as usize, self.tile.owned, self.ghosts);
        PairKey::new(slot(low), slot(high))
    }

    /// Names up to a block of pairs.
    #[inline(always)]
    pub(super) fn name(&mut self, pairs: &[Pair], named: &mut [Named<'a>; BLOCK]) {
        let (tile, mut known) = (self.tile, [NOT_KNOWN; BLOCK]);
        for (named, &pair) in named.iter_mut().zip(pairs) {
            named.key = self.key(pair);
            // Nobody has asked for names since the last step.
        }
        // Two ascending lists are merged; which of them goes on is not for a branch to foresee.
        let (keys, mut pair, mut old) = (&tile.contacts.keys[..], 0, self.old);
        while pair < pairs.len().min(BLOCK) && old < keys.len() {
            let (key, other) = (named[pair].key, keys[old]);
            known[pair] = if key == other { old } else { NOT_KNOWN };
            fetch(&tile.contacts.contacts, old);
            pair += usize::from(key <= other);
            old += usize::from(key >= other);
        }
        self.old = old;
        for ((named, &[low, high]), &old) in named.iter_mut().zip(pairs).zip(&known) {
            let ids = (tile.bodies.id[low as usize], tile.bodies.id[high as usize]);
            let (bodies, pair) = if ids.0 < ids.1 { ([low, high], ids) } else { ([high, low], (ids.1, ids.0)) };
            let by_name = self.by_name[low as usize] | self.by_name[high as usize];
            let known =
                if by_name { tile.strays.find(pair, named.key.is_own()) } else { tile.contacts.contacts.get(old) };
            (named.bodies, named.known, named.old) = (bodies, known, old as u32);
        }
    }
}

/// The place of a contact that there was not.
const NOT_KNOWN: usize = usize::MAX;
