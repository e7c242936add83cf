//! Contacts that are found by the names of their bodies.

use super::contact::Contact;
use super::id::GlobalId;

/// Where a contact found by name comes from; where a pair has several entries, the greatest decides.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Authority {
    /// Another tile, of a contact that this one is to solve for others: good for nothing else.
    Lent,
    /// Another tile, which did not own the lower GlobalId.
    Foreign,
    /// This tile's own cache.
    Own,
    /// Another tile, which owned the lower GlobalId.
    ForeignOwner,
}

impl Authority {
    /// Whether it serves a contact of which one is owned.
    pub(crate) fn is_own(self) -> bool {
        self > Self::Lent
    }
}

/// A contact known by the names of its bodies, because one of them is a ghost, has left or has arrived.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stray {
    pub(crate) pair: (GlobalId, GlobalId),
    pub(crate) authority: Authority,
    pub(crate) contact: Contact,
}

/// The names of a contact's bodies, the lower first.
type Names = (GlobalId, GlobalId);

/// Contacts by the names of their bodies and of their pieces, one for each two pieces: a hash table with open addressing, from the
/// names to the first contact of a pair, and from each to the next one.
#[derive(Clone, Default, Debug)]
pub(crate) struct Strays {
    all: Vec<Stray>,
    /// Of each, one more than the place of the next of its pair, ascending by their pieces; zero after the last.
    next: Vec<u32>,
    /// One more than the place of the first of a pair, or zero; half of it at most is taken. Its length is a power of two.
    table: Vec<u32>,
}

impl Strays {
    pub(crate) fn clear(&mut self) {
        self.all.clear();
        self.next.clear();
        self.table.clear();
    }

    pub(crate) fn push(&mut self, stray: Stray) {
        self.all.push(stray);
    }

    /// Puts in order all that have been pushed, so that they can be found. Of several of one pair and the same pieces the one of the
    /// highest authority is kept.
    pub(crate) fn settle(&mut self) {
        let count = self.all.len();
        self.next.clear();
        self.next.resize(count, 0);
        self.table.clear();
        if count == 0 {
            return;
        }
        self.table.resize((2 * count).next_power_of_two(), 0);
        for place in 0..count {
            let slot = self.slot(self.all[place].pair);
            self.insert(slot, place);
        }
    }

    /// Adds one to those of its pair, whose first is told in a slot of the table.
    fn insert(&mut self, slot: usize, place: usize) {
        let pieces = self.all[place].contact.pieces();
        let (mut before, mut at) = (None, self.table[slot]);
        while let Some(other) = place_of(at) {
            let (known, its_pieces) = (self.all[other].authority, self.all[other].contact.pieces());
            if its_pieces == pieces {
                if known < self.all[place].authority {
                    self.all[other] = self.all[place];
                }
                return;
            }
            if its_pieces > pieces {
                break;
            }
            (before, at) = (Some(other), self.next[other]);
        }
        self.next[place] = at;
        let link = before.map_or(&mut self.table[slot], |before| &mut self.next[before]);
        *link = place as u32 + 1;
    }

    /// The slot of the table that tells of a pair, or would.
    #[inline]
    fn slot(&self, names: Names) -> usize {
        let mask = self.table.len() - 1;
        // Fibonacci hashing: D. E. Knuth, "The Art of Computer Programming", volume 3, section 6.4.
        let mixed = (names.0.0.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ names.1.0).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut slot = (mixed >> 32) as usize & mask;
        while place_of(self.table[slot]).is_some_and(|place| self.all[place].pair != names) {
            slot = (slot + 1) & mask;
        }
        slot
    }

    /// The place of the first of a pair.
    #[inline]
    fn first(&self, names: Names) -> Option<usize> {
        if self.table.is_empty() { None } else { place_of(self.table[self.slot(names)]) }
    }

    /// All of which one is owned, once they are in order.
    pub(crate) fn own(&self) -> impl Iterator<Item = (Names, &Contact)> {
        self.known().filter(|stray| stray.authority.is_own()).map(|stray| (stray.pair, &stray.contact))
    }

    /// All that can be found, in an order that follows from what was pushed alone.
    pub(crate) fn known(&self) -> impl Iterator<Item = &Stray> {
        let all_of = |first| std::iter::successors(first, |&place| place_of(self.next[place]));
        self.table.iter().flat_map(move |&first| all_of(place_of(first))).map(|place| &self.all[place])
    }

    /// What is remembered of a pair: of which one is owned, or neither. Of circles and boxes there is one contact at most.
    #[inline]
    pub(crate) fn find(&self, names: Names, is_own: bool) -> Option<&Contact> {
        let found = &self.all[self.first(names)?];
        (!is_own || found.authority.is_own()).then_some(&found.contact)
    }

    /// All that is remembered of a pair, ascending by their pieces.
    pub(crate) fn find_all(&self, names: Names, is_own: bool) -> impl Iterator<Item = &Contact> {
        let of_pair = std::iter::successors(self.first(names), |&place| place_of(self.next[place]));
        let known = of_pair.map(|place| &self.all[place]);
        known.filter(move |stray| !is_own || stray.authority.is_own()).map(|stray| &stray.contact)
    }
}

/// The place that a number is one more than.
#[inline]
fn place_of(number: u32) -> Option<usize> {
    (number as usize).checked_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::cases;
    use bytemuck::Zeroable;
    use proptest::prelude::*;

    const AUTHORITIES: [Authority; 4] = [Authority::Lent, Authority::Foreign, Authority::Own, Authority::ForeignOwner];

    proptest! {
        #![proptest_config(cases(64))]

        /// As one looks through all of them: each is known by an impulse of its own.
        #[test]
        fn strays_are_found_by_name_and_the_highest_authority_decides(
            pushed in prop::collection::btree_map((0..8_u64, 0..8_u64, 0..3_u32, 0..4_usize), any::<()>(), 0..120)
        ) {
            let mut pushed: Vec<_> = pushed.into_keys().zip(1..).collect();
            // In any order, but the same in every run.
            pushed.sort_by_key(|&(_, number)| (number * 7919) % 127);
            let mut strays = Strays::default();
            // What was there before is forgotten.
            strays.push(Stray { pair: (GlobalId(0), GlobalId(0)), authority: Authority::Own, contact: Contact::zeroed() });
            strays.settle();
            strays.clear();
            for &((low, high, piece, authority), number) in &pushed {
                let mut contact = Contact::zeroed();
                contact.points[0].feature = Contact::features_of(piece, 0);
                contact.points[0].normal_impulse = number as f32;
                strays.push(Stray { pair: (GlobalId(low), GlobalId(high)), authority: AUTHORITIES[authority], contact });
            }
            strays.settle();
            for (low, high) in (0..9_u64).flat_map(|low| (0..9_u64).map(move |high| (low, high))) {
                for is_own in [false, true] {
                    let best = |piece: u32| {
                        let of_pieces = pushed.iter().filter(|((a, b, p, _), _)| (*a, *b, *p) == (low, high, piece));
                        let best = of_pieces.max_by_key(|((.., authority), _)| *authority)?;
                        (!is_own || best.0.3 > 0).then_some(best.1 as f32)
                    };
                    let expected: Vec<f32> = (0..3).filter_map(best).collect();
                    let names = (GlobalId(low), GlobalId(high));
                    let found = strays.find_all(names, is_own).map(|contact| contact.points[0].normal_impulse);
                    prop_assert_eq!(found.collect::<Vec<_>>(), expected);
                    let first = pushed.iter().filter(|((a, b, ..), _)| (*a, *b) == (low, high)).map(|((_, _, p, _), _)| *p).min();
                    let found = strays.find(names, is_own).map(|contact| contact.points[0].normal_impulse);
                    prop_assert_eq!(found, first.and_then(best));
                }
            }
        }
    }
}
