//! The contacts of a tile, as a step finds them.

use crate::collide::broad_phase::Pair;
use crate::model::contact::ContactCache;
use crate::parallel::team::Team;
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

    /// Puts together what was found in several parts, one after another.
    pub(super) fn gather(&mut self, parts: &[Found], cache: &mut ContactCache, team: Team) {
        let count = parts.iter().map(|part| part.cache.len()).sum();
        cache.resize(count);
        self.separation.resize(count, [0.0; 2]);
        self.bodies.resize(count, [0, 0]);
        let (mut keys, mut contacts) = (&mut cache.keys[..], &mut cache.contacts[..]);
        let (mut separation, mut bodies) = (&mut self.separation[..], &mut self.bodies[..]);
        let copies = parts.iter().map(|part| {
            let count = part.cache.len();
            let keys = keys.split_off_mut(..count).zip(contacts.split_off_mut(..count));
            let beside = separation.split_off_mut(..count).zip(bodies.split_off_mut(..count));
            (part, keys.zip(beside).expect("there is room for all"))
        });
        team.for_each(copies.collect(), |(part, ((keys, contacts), (separation, bodies)))| {
            keys.copy_from_slice(&part.cache.keys);
            contacts.copy_from_slice(&part.cache.contacts);
            separation.copy_from_slice(&part.separation);
            bodies.copy_from_slice(&part.bodies);
        });
    }

    /// Takes out those at some places, ascending, of these and of a cache.
    pub(in crate::collide) fn remove(&mut self, places: &[usize], cache: &mut ContactCache) {
        fn without<T>(column: &mut Vec<T>, places: &[usize]) {
            let (mut place, mut places) = (0.., places.iter().copied().peekable());
            column.retain(|_| places.next_if_eq(&place.next().expect("it has no end")).is_none());
        }
        without(&mut cache.keys, places);
        without(&mut cache.contacts, places);
        without(&mut self.separation, places);
        without(&mut self.bodies, places);
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
}
