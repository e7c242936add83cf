//! The other half of the first sync point: what other tiles sent comes in.

use super::{MigrateWork, place};
use crate::exchange::mail::Mail;
use crate::exchange::record::{ContactRecord, GhostRecord, MigrantRecord};
use crate::exchange::unseen;
use crate::model::contact::{Slot, SlotKind};
use crate::model::id::TileId;
use crate::model::strays::{Authority, Stray};
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// Ghosts as they come in, and in order.
#[derive(Default, Debug)]
pub(super) struct Ghosts {
    records: Vec<GhostRecord>,
    /// Each in one number that sorts by owner and name: these two, and its place among the records.
    order: Vec<u128>,
}

/// Takes in arrivals, ghosts, contacts. Sorts the bodies by place when it is time to. A tile that owns nothing solves nothing,
/// and keeps no ghosts.
pub(crate) fn receive(tile: &mut Tile, mail: Mail<'_>, work: &mut MigrateWork, setup: &Setup, step: u64) {
    let arrivals = &mut work.arrivals;
    arrivals.clear();
    for message in mail.messages() {
        let known = arrivals.len();
        arrivals.extend_from_slice(message.migrants);
        arrivals[known..].sort_unstable_by_key(|migrant| migrant.body.id);
    }
    tile.counts.migrations = arrivals.len() as u64;
    settle(tile, arrivals, setup);
    for message in mail.messages() {
        for record in message.contacts {
            let authority = match record.standing {
                ContactRecord::OF_OWNER_OF_LOW => Authority::ForeignOwner,
                ContactRecord::OF_OWNER_OF_HIGH => Authority::Foreign,
                _ => Authority::Lent,
            };
            tile.strays.push(Stray { pair: (record.low, record.high), authority, contact: record.contact });
        }
    }
    tile.strays.settle();
    if tile.is_idle() {
        return tile.lay_bare();
    }
    if step.is_multiple_of(u64::from(setup.params.sort_interval)) {
        place::sort(tile, setup);
    }
    if setup.has_large() {
        tile.find_interior(setup);
    }
    take_ghosts(tile, mail, &mut work.ghosts, setup);
    unseen::leave_out(tile, &mut work.ghost_names, setup);
    tile.meet_statics(Vec::new(), setup);
    tile.push_statics(setup, step);
}

/// Leaves a tile with its own bodies alone. Arrivals take the places of those that left; those that are left over come after the
/// last body, or the last bodies take the places that are left over.
fn settle(tile: &mut Tile, arrivals: &[MigrantRecord], setup: &Setup) {
    let mut gaps = std::mem::take(&mut tile.gaps);
    let (filled, left) = gaps.split_at(gaps.len().min(arrivals.len()));
    let owned = tile.owned - left.len();
    if !left.is_empty() {
        call_by_name(tile, owned);
    }
    tile.bodies.truncate(tile.owned);
    tile.unseen.clear();
    tile.ghost_owners.clear();
    tile.newcomers.clear();
    tile.sleep.clear_ghosts();
    if setup.params.sleep {
        tile.sleep.resize(tile.owned);
        let places = filled.iter().map(|&gap| gap as usize).chain(tile.owned..);
        places.zip(arrivals).for_each(|(place, migrant)| tile.sleep.set(place, migrant.rested));
    }
    for (&gap, migrant) in filled.iter().zip(arrivals) {
        tile.bodies.set(gap as usize, migrant.body);
    }
    tile.newcomers.extend_from_slice(filled);
    tile.bodies.reserve(arrivals.len() - filled.len());
    for migrant in &arrivals[filled.len()..] {
        tile.newcomers.push(tile.bodies.len() as u32);
        tile.bodies.push(migrant.body);
    }
    let (holes, gone) = left.split_at(left.partition_point(|&gap| (gap as usize) < owned));
    let last = (owned as u32..tile.owned as u32).filter(|index| gone.binary_search(index).is_err());
    for (&hole, index) in holes.iter().zip(last) {
        let (body, rested) = (tile.bodies.get(index as usize), tile.rested(index as usize));
        tile.bodies.set(hole as usize, body);
        if setup.params.sleep {
            tile.sleep.set(hole as usize, rested);
        }
    }
    tile.newcomers.extend_from_slice(holes);
    if !left.is_empty() {
        tile.bodies.truncate(owned);
    }
    tile.owned = tile.bodies.len();
    if setup.params.sleep {
        tile.sleep.resize(tile.owned);
    }
    gaps.clear();
    tile.gaps = gaps;
}

/// Copies the contacts of owned bodies from an index on to the strays: they change places.
fn call_by_name(tile: &mut Tile, first: usize) {
    let moves = |slot: Slot| matches!(slot.kind(), SlotKind::Owned(index) if index >= first);
    for (i, &key) in tile.contacts.keys.iter().enumerate() {
        if moves(key.low()) || moves(key.high()) {
            let contact = tile.contacts.contacts[i];
            tile.strays.push(Stray { pair: tile.pair_of(key), authority: Authority::Own, contact });
        }
    }
}

/// Puts the ghosts behind the owned bodies, sorted by owner and name.
fn take_ghosts(tile: &mut Tile, mail: Mail<'_>, Ghosts { records, order }: &mut Ghosts, setup: &Setup) {
    records.clear();
    order.clear();
    for message in mail.messages().filter(|message| !message.ghosts.is_empty()) {
        let home = setup.partition.region(message.from);
        let places = records.len() as u128..;
        records.extend_from_slice(message.ghosts);
        order.extend(places.zip(message.ghosts).map(|(place, GhostRecord { body, .. })| {
            // Most of them live where they came from.
            let is_home = home.contains(body.position);
            let owner = if is_home { message.from } else { setup.partition.locate(body.position) };
            u128::from(owner.0) << 96 | u128::from(body.id.0) << 32 | place
        }));
    }
    order.sort_unstable();
    tile.bodies.reserve(order.len() + tile.statics.len());
    for &number in &*order {
        tile.take_ghost(TileId((number >> 96) as u32), records[number as u32 as usize]);
    }
}
