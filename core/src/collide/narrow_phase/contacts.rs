//! The contacts of a tile, as a step finds them.

use crate::collide::broad_phase::Pair;
use crate::model::contact::{Contact, ContactCache, PairKey};
use crate::parallel::team::Team;
use crate::tiling::tile::Tile;
use bytemuck::Zeroable;

/// What a step knows of each of a tile's contacts beside what outlives it, in their canonical order: ascending by their bodies' slots,
/// whatever order the pairs came in.
#[derive(Default, Debug)]
pub(crate) struct Contacts {
    /// The separation of its points now.
    pub(crate) separation: Vec<[f32; 2]>,
    /// The indices of body A, the one with the lower GlobalId, and body B.
    pub(crate) bodies: Vec<Pair>,
    /// The places of those that a body has with statics, where it comes to them in another order than theirs: in this one they are solved.
    pub(crate) turns: Vec<Vec<u32>>,
    /// The bodies of those that were found before, and whether any of these had another order.
    before: Vec<Pair>,
    had_turns: bool,
}

impl Contacts {
    /// Before others are found.
    pub(super) fn begin(&mut self) {
        std::mem::swap(&mut self.bodies, &mut self.before);
        self.had_turns = !self.turns.is_empty();
        self.turns.clear();
    }

    /// Whether they are between the same bodies as those that were found before, and solved in the same order, as what rests has them.
    pub(crate) fn are_between_the_same(&self) -> bool {
        self.bodies == self.before && self.turns.is_empty() && !self.had_turns
    }

    /// Puts together what was found in several parts, one after another.
    pub(super) fn gather(&mut self, parts: &[Found], cache: &mut ContactCache, team: Team) {
        let count = parts.iter().map(|part| part.len).sum();
        cache.resize(count);
        self.separation.resize(count, [0.0; 2]);
        self.bodies.resize(count, [0, 0]);
        let (mut keys, mut contacts) = (&mut cache.keys[..], &mut cache.contacts[..]);
        let (mut separation, mut bodies) = (&mut self.separation[..], &mut self.bodies[..]);
        let copies = parts.iter().map(|part| {
            let count = part.len;
            let keys = keys.split_off_mut(..count).zip(contacts.split_off_mut(..count));
            let beside = separation.split_off_mut(..count).zip(bodies.split_off_mut(..count));
            (part, keys.zip(beside).expect("there is room for all"))
        });
        team.for_each(copies.collect(), |(part, ((keys, contacts), (separation, bodies)))| {
            keys.copy_from_slice(part.keys());
            contacts.copy_from_slice(part.contacts());
            separation.copy_from_slice(&part.separation[..part.len]);
            bodies.copy_from_slice(&part.bodies[..part.len]);
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

    /// Adds some, sorted by their keys, to these and to a cache.
    pub(in crate::collide) fn insert(&mut self, new: Vec<New>, cache: &mut ContactCache) {
        fn with<T: Copy>(column: &mut Vec<T>, new: &[New], places: &[usize], of: impl Fn(&New) -> T) {
            let mut end = column.len();
            column.extend(new.iter().map(&of));
            for (number, (new, &place)) in new.iter().zip(places).enumerate().rev() {
                column.copy_within(place..end, place + number + 1);
                column[place + number] = of(new);
                end = place;
            }
        }
        if new.is_empty() {
            return;
        }
        let places: Vec<usize> = new.iter().map(|new| cache.keys.partition_point(|&key| key < new.key)).collect();
        with(&mut cache.keys, &new, &places, |new| new.key);
        with(&mut cache.contacts, &new, &places, |new| new.found.0);
        with(&mut self.separation, &new, &places, |new| new.found.1);
        with(&mut self.bodies, &new, &places, |new| new.bodies);
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

/// A contact that is to be added.
pub(in crate::collide) struct New {
    pub(in crate::collide) key: PairKey,
    pub(in crate::collide) bodies: Pair,
    /// With the separation of its points now.
    pub(in crate::collide) found: (Contact, [f32; 2]),
}

/// All that is found of contacts, a column for each.
///
/// Columns may be longer than there are contacts: what an earlier step left there is written over, which saves filling it with zeros.
#[derive(Default, Debug)]
pub(super) struct Found {
    keys: Vec<PairKey>,
    contacts: Vec<Contact>,
    /// As in [`Contacts`].
    pub(super) separation: Vec<[f32; 2]>,
    pub(super) bodies: Vec<Pair>,
    len: usize,
}

/// Places for contacts, a column for each.
pub(super) struct Places<'a> {
    pub(super) keys: &'a mut [PairKey],
    pub(super) contacts: &'a mut [Contact],
    pub(super) separation: &'a mut [[f32; 2]],
    pub(super) bodies: &'a mut [Pair],
}

impl Found {
    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    pub(super) fn keys(&self) -> &[PairKey] {
        &self.keys[..self.len]
    }

    pub(super) fn contacts(&self) -> &[Contact] {
        &self.contacts[..self.len]
    }

    /// Places for so many more, of which those count that are [added](Self::add).
    #[inline(always)]
    pub(super) fn places(&mut self, more: usize) -> Places<'_> {
        let most = self.len + more;
        if self.keys.len() < most {
            self.keys.resize(most, PairKey::default());
            self.contacts.resize(most, Contact::zeroed());
        }
        if self.separation.len() < most {
            self.separation.resize(most, [0.0; 2]);
        }
        if self.bodies.len() < most {
            self.bodies.resize(most, [0, 0]);
        }
        let places = self.len..most;
        Places {
            keys: &mut self.keys[places.clone()],
            contacts: &mut self.contacts[places.clone()],
            separation: &mut self.separation[places.clone()],
            bodies: &mut self.bodies[places],
        }
    }

    /// Counts so many, which were written to the first of the [places](Self::places).
    pub(super) fn add(&mut self, count: usize) {
        self.len += count;
    }

    pub(super) fn push(&mut self, key: PairKey, contact: Contact, separation: [f32; 2], bodies: Pair) {
        let to = self.places(1);
        (to.keys[0], to.contacts[0], to.separation[0], to.bodies[0]) = (key, contact, separation, bodies);
        self.add(1);
    }

    /// Leaves nothing behind the last one, of what others take.
    pub(super) fn end(&mut self) {
        self.separation.truncate(self.len);
        self.bodies.truncate(self.len);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::contact::Slot;
    use proptest::prelude::*;

    /// The key of body 0 and another.
    fn key(other: u32) -> PairKey {
        PairKey::new(Slot::from_index(0, 1000, 0), Slot::from_index(other as usize, 1000, 0))
    }

    proptest! {
        /// As if all had been sorted.
        #[test]
        fn who_is_inserted_stands_where_its_key_does(others in proptest::collection::btree_set(1_u32..60, 0..40), new: [bool; 60]) {
            let (new, known): (Vec<u32>, Vec<u32>) = others.iter().partition(|&&other| new[other as usize]);
            let mut contacts = Contacts::default();
            let mut cache = ContactCache::default();
            for &other in &known {
                cache.keys.push(key(other));
                cache.contacts.push(Contact { offset: glam::Vec2::splat(other as f32), ..Contact::zeroed() });
                contacts.separation.push([other as f32; 2]);
                contacts.bodies.push([0, other]);
            }
            let found = |other: u32| (Contact { offset: glam::Vec2::splat(other as f32), ..Contact::zeroed() }, [other as f32; 2]);
            let new = new.iter().map(|&other| New { key: key(other), bodies: [0, other], found: found(other) });
            contacts.insert(new.collect(), &mut cache);
            let all: Vec<u32> = others.into_iter().collect();
            prop_assert_eq!(&cache.keys, &all.iter().map(|&other| key(other)).collect::<Vec<_>>());
            prop_assert_eq!(&contacts.bodies, &all.iter().map(|&other| [0, other]).collect::<Vec<_>>());
            prop_assert!(contacts.separation.iter().zip(&all).all(|(separation, &other)| separation[0] == other as f32));
            prop_assert!(cache.contacts.iter().zip(&all).all(|(contact, &other)| contact.offset.x == other as f32));
        }
    }
}
