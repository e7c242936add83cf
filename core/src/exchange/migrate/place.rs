//! Bodies by place, so that neighbours in space are neighbours in memory.

use crate::model::contact::{PairKey, Slot, SlotKind};
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// Sorts the owned bodies by (cell, GlobalId).
pub(super) fn sort(tile: &mut Tile, setup: &Setup) {
    let (per_meter, corner) = (1.0 / setup.halo_width, tile.rectangle.min);
    // What lies before the first cell or after the last counts as in there.
    let cell = |v: f64, corner: f64| u64::from(((v - corner) * per_meter) as u16);
    let bodies = tile.bodies.position.iter().zip(0_u64..);
    // Cell and index in one number: half as much to move as with the names, which few need.
    let mut order: Vec<u64> = bodies
        .map(|(position, index)| cell(position.y, corner.y) << 48 | cell(position.x, corner.x) << 32 | index)
        .collect();
    let name = |number: &u64| tile.bodies.id[*number as u32 as usize];
    if order.is_sorted_by_key(|number| (number >> 32, name(number))) {
        return;
    }
    order.sort_unstable();
    order.chunk_by_mut(|one, other| one >> 32 == other >> 32).for_each(|cell| cell.sort_unstable_by_key(name));
    let order: Vec<u32> = order.into_iter().map(|number| number as u32).collect();
    tile.bodies.permute(&order);
    tile.sleep.permute(&order);
    (tile.standstill, tile.is_rearranged) = (None, true);
    let mut new_place = vec![0; order.len()];
    for (to, &from) in (0..).zip(&order) {
        new_place[from as usize] = to;
    }
    rename_contacts(tile, &new_place);
    for newcomer in &mut tile.newcomers {
        *newcomer = new_place[*newcomer as usize];
    }
}

/// Renames the bodies of the contacts that serve on, and forgets the others.
fn rename_contacts(tile: &mut Tile, new_place: &[u32]) {
    let stays = tile.who_stays();
    tile.contacts.retain(|key: PairKey| stays(key.low()) && stays(key.high()));
    tile.contacts.rename(|slot| match slot.kind() {
        SlotKind::Owned(index) => Slot::from_index(new_place[index] as usize, usize::MAX, 0),
        _ => slot,
    });
}
