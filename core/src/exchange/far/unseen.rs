//! What the tiles of large bodies do not see of those that they come to.

use super::Reached;
use crate::exchange::record::Unseen;
use crate::model::contact::{Contact, Slot, SlotKind};
use crate::model::id::{GlobalId, TileId};
use crate::tiling::tile::Tile;

/// The owned bodies that large ones come to, and what of each is unseen by whom it is sent to.
struct Sums<'a> {
    reached: &'a [Reached],
    unseen: Vec<Unseen>,
    /// Of each that is sent its name, and its place among these, ascending by names.
    by_name: Vec<(GlobalId, usize)>,
}

/// Adds up the impulses of the last step for bodies that are sent to the tiles of large ones, and to no others: those of all their
/// contacts but with bodies of that tile. Between the sync points contacts are known by slots where both bodies stayed, and by name.
pub(super) fn unseen_of(tile: &Tile, reached: &[Reached]) -> Vec<Unseen> {
    let unseen = vec![Unseen::default(); reached.len()];
    let lasting = reached.iter().enumerate().filter(|(_, body)| !body.in_passing);
    let mut by_name: Vec<_> = lasting.map(|(place, body)| (tile.bodies.id[body.row], place)).collect();
    if by_name.is_empty() {
        return unseen;
    }
    by_name.sort_unstable();
    let ghosts = tile.owned..tile.owned + tile.ghosts();
    let mut owners: Vec<_> = tile.bodies.id[ghosts].iter().copied().zip(tile.ghost_owners.iter().copied()).collect();
    owners.sort_unstable();
    let owner_of = |name: GlobalId| owners.binary_search_by_key(&name, |(id, _)| *id).ok().map(|place| owners[place].1);
    let mut is_lasting = vec![false; tile.owned];
    by_name.iter().for_each(|&(_, place)| is_lasting[reached[place].row] = true);
    let (mut sums, stays) = (Sums { reached, unseen, by_name }, tile.who_stays());
    let lasts = |slot: Slot| matches!(slot.kind(), SlotKind::Owned(index) if is_lasting[index]);
    for (key, contact) in tile.contacts.iter().filter(|(key, _)| stays(key.low()) && stays(key.high())) {
        if lasts(key.low()) || lasts(key.high()) {
            sums.add(tile.pair_of(key), contact, [None; 2]);
        }
    }
    for (pair, contact) in tile.strays.own() {
        sums.add(pair, contact, [owner_of(pair.0), owner_of(pair.1)]);
    }
    sums.unseen
}

impl Sums<'_> {
    /// Adds what a contact did to either body, of which other tiles own some.
    fn add(&mut self, (a, b): (GlobalId, GlobalId), contact: &Contact, [owner_of_a, owner_of_b]: [Option<TileId>; 2]) {
        let (linear, on_a, on_b) = contact.impulse();
        for (name, partner, linear, angular) in [(a, owner_of_b, -linear, on_a), (b, owner_of_a, linear, on_b)] {
            let first = self.by_name.partition_point(|&(id, _)| id < name);
            for &(_, place) in self.by_name[first..].iter().take_while(|&&(id, _)| id == name) {
                if partner != Some(self.reached[place].to) {
                    self.unseen[place].add(linear, angular);
                }
            }
        }
    }
}
