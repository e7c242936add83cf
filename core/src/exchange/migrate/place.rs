//! Bodies by place, so that neighbours in space are neighbours in memory.

use crate::model::contact::{PairKey, Slot, SlotKind};
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// Sorts the owned bodies by (cell, GlobalId).
pub(super) fn sort(tile: &mut Tile, setup: &Setup) {
    let (per_meter, corner) = (1.0 / setup.halo_width, tile.rectangle.min);
    // What lies before the first cell or after the last counts as in there.
    let cell = |v: f64, corner: f64| u128::from(((v - corner) * per_meter) as u16);
    let bodies = tile.bodies.position.iter().zip(&tile.bodies.id).zip(0_u128..);
    let mut order: Vec<u128> = bodies
        .map(|((position, id), index)| {
            let (row, column) = (cell(position.y, corner.y), cell(position.x, corner.x));
            row << 112 | column << 96 | u128::from(id.0) << 32 | index
        })
        .collect();
    if order.is_sorted() {
        return;
    }
    order.sort_unstable();
    let order: Vec<u32> = order.into_iter().map(|number| number as u32).collect();
    tile.bodies.permute(&order);
    tile.sleep.permute(&order);
    tile.standstill = None;
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
