//! Contacts of the last step that concern other tiles.

use super::{Border, MigrateWork};
use crate::exchange::overlap::Outline;
use crate::exchange::record::ContactRecord;
use crate::exchange::unseen;
use crate::model::contact::{Slot, SlotKind};
use crate::model::id::TileId;
use crate::model::strays::{Authority, Stray};
use crate::parallel::ahead::fetch;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// Contacts, and the names of their bodies, are asked for so many before they are read.
const AHEAD: usize = 8;

/// Sums unseen impulses, finds the contacts of departing bodies, and copies those that cannot be found by slot any more to the
/// strays. Has other tiles be told of those that press and that they are to solve for others.
pub(super) fn sort_out(tile: &mut Tile, work: &mut MigrateWork, setup: &Setup) {
    tile.strays.clear();
    tile.sleep.forget_leaning();
    find_concerned(tile, work);
    let MigrateWork { mark, border, sends, concerned, contacts, .. } = work;
    for (place, &i) in concerned.iter().enumerate() {
        if let Some(&next) = concerned.get(place + AHEAD) {
            let key = tile.contacts.keys[next as usize];
            fetch(&tile.contacts.contacts, next as usize);
            fetch(&tile.bodies.id, tile.index(key.low()));
            fetch(&tile.bodies.id, tile.index(key.high()));
        }
        let (key, contact) = (tile.contacts.keys[i as usize], &tile.contacts.contacts[i as usize]);
        let (low, high, pair) = (key.low(), key.high(), tile.pair_of(key));
        let SlotKind::Owned(low_index) = low.kind() else { unreachable!("its own contacts have a body of its own") };
        if high.is_ghost() && tile.rests(low_index, setup) {
            let (id, ghost) = (tile.bodies.id[low_index], tile.bodies.id[tile.index(high)]);
            tile.sleep.lean((id, low_index), ghost);
        }
        let around = Around { tile, mark, border, setup };
        let with_ghost = high.is_ghost();
        let low_is_a = tile.bodies.id[low_index] == pair.0;
        let record = |standing| ContactRecord { low: pair.0, high: pair.1, standing, contact: *contact };
        let tells = low_is_a || !with_ghost;
        let standing = if tells { ContactRecord::OF_OWNER_OF_LOW } else { ContactRecord::OF_OWNER_OF_HIGH };
        let (mut stray, mut heir, mut impulse) = (with_ghost, tile.id, None);
        let owners = [low, high].map(|slot| around.owner_of(slot));
        let sides = [(low, low_is_a, owners[1], high), (high, !low_is_a, owners[0], low)];
        for (slot, is_a, owner, partner) in sides {
            let Some(border) = around.border_of(slot) else { continue };
            for send in &mut sends[border.first_send as usize..border.end_send as usize] {
                let solves = || owner == Some(send.target) || send.near && around.is_near(partner, send.target);
                if unseen::is_left_out_later(setup) || !solves() {
                    let (linear, on_a, on_b) = *impulse.get_or_insert_with(|| contact.impulse());
                    if is_a {
                        send.unseen.add(-linear, on_a);
                    } else {
                        send.unseen.add(linear, on_b);
                    }
                }
            }
            // Both bodies may leave for one tile: one record is enough.
            if border.owner != tile.id && border.owner != heir {
                heir = border.owner;
                contacts.push((heir, record(standing)));
            }
            stray |= border.owner != tile.id;
        }
        if let Some(border) = around.border_of(low).filter(|_| tells && contact.presses()) {
            let others = sends[border.first_send as usize..border.end_send as usize].iter().filter(|send| {
                let is_its_own = match high.kind() {
                    SlotKind::Ghost(ghost) => tile.ghost_owners[ghost] == send.target,
                    _ => owners[1] == Some(send.target),
                };
                // Where a ghost has gone is not known here: too much that is told does no harm.
                let may_be_near = || with_ghost || around.is_near(high, send.target);
                send.near && send.target != tile.id && !is_its_own && may_be_near()
            });
            contacts.extend(others.map(|send| (send.target, record(ContactRecord::LENT))));
        }
        if stray {
            tile.strays.push(Stray { pair, authority: Authority::Own, contact: *contact });
        }
    }
}

/// The bodies of contacts, as those see them that are around the tile.
struct Around<'a> {
    tile: &'a Tile,
    mark: &'a [u32],
    border: &'a [Border],
    setup: &'a Setup,
}

impl<'a> Around<'a> {
    /// What is known of an owned body that may concern other tiles.
    fn border_of(&self, slot: Slot) -> Option<&'a Border> {
        let SlotKind::Owned(index) = slot.kind() else { return None };
        self.border.get((self.mark[index] as usize).checked_sub(1)?)
    }

    /// Who owns a body from now on.
    fn owner_of(&self, slot: Slot) -> Option<TileId> {
        let Self { tile, setup, .. } = self;
        match slot.kind() {
            SlotKind::Owned(_) => Some(self.border_of(slot).map_or(tile.id, |border| border.owner)),
            // As far as is known here; borders of tiles may have moved.
            SlotKind::Ghost(ghost) => {
                let (position, owner) = (tile.bodies.position[tile.index(slot)], tile.ghost_owners[ghost]);
                let stays = setup.partition.region(owner).contains(position);
                Some(if stays { owner } else { setup.partition.locate(position) })
            }
            SlotKind::Static(_) => None,
        }
    }

    /// Whether a body is so near a tile that its contacts with others that are, and with statics, are solved there.
    fn is_near(&self, slot: Slot, target: TileId) -> bool {
        match slot.kind() {
            // Whoever is no ghost of any tile is near to none.
            SlotKind::Owned(_) => self.border_of(slot).is_some_and(|border| {
                Outline::of_rim(&self.tile.rim.bodies[border.rim as usize], self.setup).is_near(target, self.setup)
            }),
            // Judged by where it was: no more is known here.
            SlotKind::Ghost(_) => Outline::of(self.tile, self.tile.index(slot), self.setup).is_near(target, self.setup),
            SlotKind::Static(_) => true,
        }
    }
}

/// Lists the tile's own contacts that have a ghost, or a body near the border. Every one is written down, and counted or not.
fn find_concerned(tile: &Tile, MigrateWork { mark, concerned, .. }: &mut MigrateWork) {
    let mark_of = |slot: Slot| mark[slot.index(tile.owned, 0).min(tile.owned)];
    let is_concerned = |low: Slot, high: Slot| low.is_ghost() | high.is_ghost() | (mark_of(low) | mark_of(high) != 0);
    concerned.clear();
    let own = &tile.contacts.keys[..tile.contacts.own()];
    concerned.resize(own.len(), 0);
    let mut count = 0;
    for (i, key) in (0..).zip(own) {
        concerned[count] = i;
        count += usize::from(is_concerned(key.low(), key.high()));
    }
    concerned.truncate(count);
}
