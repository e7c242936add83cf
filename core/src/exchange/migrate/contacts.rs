//! Contacts of the last step that concern other tiles.

use super::MigrateWork;
use crate::exchange::overlap::Outline;
use crate::exchange::record::ContactRecord;
use crate::model::contact::{Slot, SlotKind};
use crate::model::strays::{Authority, Stray};
use crate::parallel::ahead::fetch;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// Contacts, and the names of their bodies, are asked for so many before they are read.
const AHEAD: usize = 8;

/// Sums unseen impulses, finds the contacts of departing bodies, and copies those that cannot be found by slot any more to the
/// strays. Has other tiles be told of those that they are to solve for others, unless they did so in the last step as well.
pub(super) fn sort_out(tile: &mut Tile, work: &mut MigrateWork, setup: &Setup, borders_moved: bool) {
    tile.strays.clear();
    tile.sleep.forget_leaning();
    find_concerned(tile, work);
    let MigrateWork { mark, border, sends, concerned, contacts, .. } = work;
    let border_of = |mark: u32| border.get((mark as usize).checked_sub(1)?);
    for (place, &i) in concerned.iter().enumerate() {
        if let Some(&next) = concerned.get(place + AHEAD) {
            let key = tile.contacts.keys[next as usize];
            fetch(&tile.contacts.contacts, next as usize);
            fetch(&tile.bodies.id, tile.index(key.low()));
            fetch(&tile.bodies.id, tile.index(key.high()));
        }
        let (key, contact) = (tile.contacts.keys[i as usize], &tile.contacts.contacts[i as usize]);
        let (low, high, pair) = (key.low(), key.high(), tile.pair_of(key));
        let SlotKind::Owned(low_index) = low.kind() else {
            // Of others; they tell each other. Here it serves those who solve it with them.
            tile.strays.push(Stray { pair, authority: Authority::Overlap, contact: *contact });
            continue;
        };
        if high.is_ghost() && tile.rests(low_index, setup) {
            let (id, ghost) = (tile.bodies.id[low_index], tile.bodies.id[tile.index(high)]);
            tile.sleep.lean((id, low_index), ghost);
        }
        let high_mark = if let SlotKind::Owned(index) = high.kind() { mark[index] } else { 0 };
        // From now on.
        let owner_of = |slot: Slot| match slot.kind() {
            SlotKind::Owned(index) => Some(border_of(mark[index]).map_or(tile.id, |border| border.owner)),
            SlotKind::Ghost(ghost) => {
                let (position, owner) = (tile.bodies.position[tile.index(slot)], tile.ghost_owners[ghost]);
                let stays = setup.partition.region(owner).contains(position);
                Some(if stays { owner } else { setup.partition.locate(position) })
            }
            SlotKind::Static(_) => None,
        };
        let is_near = |slot: Slot, target| match slot.kind() {
            // Whoever is no ghost of any tile is near to none.
            SlotKind::Owned(index) => border_of(mark[index]).is_some_and(|border| {
                Outline::of_rim(&tile.rim.bodies[border.rim as usize], setup).is_near(target, setup)
            }),
            // Judged by where it was: what comes of it is put right with the first refresh.
            SlotKind::Ghost(_) => Outline::of(tile, tile.index(slot), setup).is_near(target, setup),
            SlotKind::Static(_) => true,
        };
        let was_near = |slot: Slot, target| match slot.kind() {
            SlotKind::Static(_) => true,
            _ => Outline::was_near(&tile.bodies.get(tile.index(slot)), target, setup),
        };
        // A tile that shows nothing of itself may have owned nothing, and so solved nothing.
        let is_shown = |target| tile.ghost_owners.binary_search(&target).is_ok();
        let was_solved = |target| !borders_moved && is_shown(target) && was_near(low, target) && was_near(high, target);
        let with_ghost = high.is_ghost();
        let low_is_a = tile.bodies.id[low_index] == pair.0;
        let record = |standing| ContactRecord { low: pair.0, high: pair.1, standing, contact: *contact };
        let tells = low_is_a || !with_ghost;
        let standing = if tells { ContactRecord::OF_OWNER_OF_LOW } else { ContactRecord::OF_OWNER_OF_HIGH };
        let (mut stray, mut heir, mut impulse) = (with_ghost, tile.id, None);
        let owner_of_high = owner_of(high);
        let sides = [(mark[low_index], low_is_a, owner_of_high, high), (high_mark, !low_is_a, owner_of(low), low)];
        for (mark, is_a, owner, partner) in sides {
            let Some(border) = border_of(mark) else { continue };
            for send in &mut sends[border.first_send as usize..border.end_send as usize] {
                if owner != Some(send.target) && !(send.near && is_near(partner, send.target)) {
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
        if let Some(border) = border_of(mark[low_index]).filter(|_| tells) {
            let others = sends[border.first_send as usize..border.end_send as usize].iter().filter(|send| {
                send.near && send.target != tile.id && owner_of_high != Some(send.target) && is_near(high, send.target)
            });
            let new = others.map(|send| send.target).filter(|&target| !was_solved(target));
            contacts.extend(new.map(|target| (target, record(ContactRecord::LENT))));
        }
        if stray {
            tile.strays.push(Stray { pair, authority: Authority::Own, contact: *contact });
        }
    }
}

/// Lists the contacts that have a ghost, or a body near the border. Every one is written down, and counted or not.
fn find_concerned(tile: &Tile, MigrateWork { mark, concerned, .. }: &mut MigrateWork) {
    let mark_of = |slot: Slot| mark[slot.index(tile.owned, 0).min(tile.owned)];
    let is_concerned = |low: Slot, high: Slot| low.is_ghost() | high.is_ghost() | (mark_of(low) | mark_of(high) != 0);
    concerned.clear();
    concerned.resize(tile.contacts.len(), 0);
    let mut count = 0;
    for (i, key) in (0..).zip(&tile.contacts.keys) {
        concerned[count] = i;
        count += usize::from(is_concerned(key.low(), key.high()));
    }
    concerned.truncate(count);
}
