//! Bodies that reach further within a step than the halo is wide: they go so far, or are so large.
//!
//! The box around the way of such a body reaches over tiles, and each of these has it as a ghost like any other. But its own tile
//! knows neither the bodies nor the statics there. So in a step in which there is such a body (every rank hears of it with the
//! first sync point, see [`Verdict::far`](crate::Verdict)), a second one follows: whoever has it as a ghost sends its tile what
//! lies on its way. Halos stay as narrow as the slow and small bodies need them.
//!
//! Large bodies ([`Params::large_radius`](crate::Params)) lie where they are for many steps, with small ones that rest on them and on
//! others. So a small one is sent by its owner alone, with its unseen impulse. Of each other, of statics and of what goes far, large
//! bodies and their tiles know by a halo that is as wide as the largest needs it.
//!
//! Not seen: two that go far, from tiles apart, that meet over a tile where nobody is; and it may be that one of their tiles knows
//! of it alone.

mod bounds;
mod unseen;

pub(crate) use bounds::each_swept;

use crate::exchange::mail::{Mail, Mailbag};
use crate::exchange::overlap::Outline;
use crate::exchange::record::GhostRecord;
use crate::model::contact::SlotKind;
use crate::model::id::TileId;
use crate::tiling::blueprint::Setup;
use crate::tiling::partition::Region;
use crate::tiling::statics::surroundings;
use crate::tiling::terrain::ascend;
use crate::tiling::tile::Tile;
use bounds::Bounds;
use glam::{DVec2, Vec2};
use std::ops::Range;
use unseen::unseen_of;

/// Whether some bodies' velocities take one of them far. Without a branch, as hardly ever does one.
fn any(velocities: &[Vec2], setup: &Setup) -> bool {
    velocities.iter().fold(false, |any, &velocity| any | setup.goes_far(velocity))
}

/// Some rows of a tile's bodies: those that go far in this step.
fn far_rows(tile: &Tile, rows: Range<usize>, setup: &Setup) -> impl Iterator<Item = usize> {
    let rows = if any(&tile.bodies.velocity[rows.clone()], setup) { rows } else { 0..0 };
    rows.filter(|&row| setup.goes_far(tile.bodies.velocity[row]))
}

/// Rounding of a distance between two bodies' boxes as a tile computes it, at most, as part of how far off they are.
const ROUNDING: f64 = 16.0 * f32::EPSILON as f64;

/// A ghost that reaches far, and its tile.
struct Far {
    ghost: usize,
    owner: TileId,
    /// Low and high corner of all that it may come to.
    way: (DVec2, DVec2),
    /// Whether it is no large one, but goes far.
    passes: bool,
}

/// A body that is sent to the tile of one that reaches far.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Reached {
    to: TileId,
    /// Among the sender's bodies.
    row: usize,
    /// Whether what comes to it is no large one, but goes far.
    in_passing: bool,
}

/// The ghosts of a tile that reach further than their own tile's halo.
fn far_ghosts(tile: &Tile, setup: &Setup) -> Vec<Far> {
    let ghosts = tile.owned..tile.owned + tile.ghosts();
    let passing = far_rows(tile, ghosts.clone(), setup).map(|ghost| (ghost, true));
    let lasting = if setup.has_large() { ghosts } else { 0..0 };
    let is_large = |ghost: &usize| setup.is_large(tile.bodies.kind[*ghost]);
    let lasting = lasting.filter(is_large).map(|ghost| (ghost, false));
    let far = passing.chain(lasting).filter_map(|(ghost, passes)| {
        let (owner, way) = (tile.ghost_owners[ghost - tile.owned], Outline::of(tile, ghost, setup));
        let room = room(way.corners(), owner, setup);
        (!way.is_within_halo_of(owner, setup)).then_some(Far { ghost, owner, way: room, passes })
    });
    far.collect()
}

/// A box with room for the rounding of what a tile compares it with, in coordinates of its own.
fn room((low, high): (DVec2, DVec2), tile: TileId, setup: &Setup) -> (DVec2, DVec2) {
    let corner = setup.partition.rectangle(tile).min;
    let furthest = (low - corner).abs().max((high - corner).abs()).max_element();
    let room = DVec2::splat(ROUNDING * furthest);
    (low - room, high + room)
}

/// Whether a ghost's owner may not know that it meets an owned body: both go far, and neither is known to the other's tile but by
/// what others told. Each tile then solves what it knows.
pub(crate) fn may_be_unknown(tile: &Tile, body: usize, ghost: usize, setup: &Setup) -> bool {
    let (owner, ghost) = (tile.ghost_owners[ghost], tile.owned + ghost);
    let go_far = [body, ghost].iter().all(|&body| setup.goes_far(tile.bodies.velocity[body]));
    let is_ghost_of = |body, tile_of: TileId| Outline::of(tile, body, setup).is_ghost_of(tile_of, setup);
    go_far && !is_ghost_of(body, owner) && !is_ghost_of(ghost, tile.id)
}

/// Sends the tiles of ghosts that reach far the bodies that these may come to, as far as they do not have them anyway.
pub(crate) fn send(tile: &Tile, bag: &mut Mailbag, setup: &Setup) {
    let far = far_ghosts(tile, setup);
    if far.is_empty() {
        return;
    }
    let untouched = far.iter().fold(tile.rectangle, |region, far| apart_from(region, far.way));
    let touched = (0..tile.owned + tile.ghosts()).filter_map(|row| {
        let (low, high) = Outline::of(tile, row, setup).corners();
        let is_touched = !(low.cmpgt(untouched.min) & high.cmplt(untouched.max)).all();
        is_touched.then_some((row, low, high))
    });
    let touched = Bounds::new(touched.collect());
    let mut reached: Vec<Reached> = Vec::new();
    for &Far { ghost, owner, way: (low, high), passes } in &far {
        for row in touched.meeting(low, high).filter(|&row| passes || row < tile.owned) {
            let is_there = || {
                let body = Outline::of(tile, row, setup);
                setup.partition.locate(tile.bodies.position[row]) == owner || body.is_ghost_of(owner, setup)
            };
            if row != ghost && !is_there() {
                reached.push(Reached { to: owner, row, in_passing: passes });
            }
        }
    }
    reached.sort_unstable();
    // Who is reached by both kinds counts as reached by a large one.
    reached.dedup_by_key(|body| (body.to, body.row));
    let unseen = unseen_of(tile, &reached);
    for (Reached { to, row, .. }, unseen) in reached.into_iter().zip(unseen) {
        bag.address(tile.id, to);
        bag.ghosts.push(GhostRecord { body: tile.bodies.get(row), unseen, rested: tile.rested(row) });
    }
}

/// What is left of a region without a box, cut off along the side where that takes least: most of a tile lies beyond all ways that
/// come from others.
fn apart_from(region: Region, (low, high): (DVec2, DVec2)) -> Region {
    let Region { min, max } = region;
    let cuts = [
        (high.x - min.x, Region { min: DVec2::new(high.x, min.y), max }),
        (high.y - min.y, Region { min: DVec2::new(min.x, high.y), max }),
        (max.x - low.x, Region { min, max: DVec2::new(low.x, max.y) }),
        (max.y - low.y, Region { min, max: DVec2::new(max.x, low.y) }),
    ];
    let least = cuts.into_iter().min_by(|(a, _), (b, _)| a.total_cmp(b)).expect("there are four");
    if least.0 > 0.0 { least.1 } else { region }
}

/// Takes in what lies on the way of the tile's own bodies, and the statics that its bodies and ghosts may come to.
pub(crate) fn receive(tile: &mut Tile, mail: Mail<'_>, setup: &Setup, step: u64) {
    let mut ghosts: Vec<(TileId, GhostRecord, bool)> = Vec::new();
    for message in mail.messages() {
        ghosts.extend(message.ghosts.iter().map(|ghost| {
            let owner = setup.partition.locate(ghost.body.position);
            (owner, *ghost, owner != message.from)
        }));
    }
    let (owned, has_more) = (tile.owned, !ghosts.is_empty());
    if has_more {
        let known = tile.ghost_owners.iter().zip(&tile.unseen).zip(owned..);
        ghosts.extend(known.map(|((&owner, &unseen), row)| {
            (owner, GhostRecord { body: tile.bodies.get(row), unseen, rested: tile.rested(row) }, false)
        }));
        ghosts.sort_unstable_by_key(|(owner, ghost, is_hearsay)| (*owner, ghost.body.id, *is_hearsay));
        // Several tiles may have sent the same. Its owner knows best.
        ghosts.dedup_by_key(|(_, ghost, _)| ghost.body.id);
        tile.bodies.truncate(owned);
        tile.ghost_owners.clear();
        tile.unseen.clear();
        tile.sleep.clear_ghosts();
        for (owner, ghost, _) in ghosts {
            tile.take_ghost(owner, ghost);
        }
    }
    let dynamic = owned + tile.ghosts();
    let go_far = any(&tile.bodies.velocity[..dynamic], setup);
    if !go_far && !has_more {
        return;
    }
    tile.bodies.truncate(dynamic);
    let on_the_way = if go_far { find_on_the_way(tile, setup, step) } else { Vec::new() };
    tile.meet_statics(on_the_way.clone(), setup);
    tile.push_statics(setup, step);
    for row in on_the_way {
        if tile.statics.binary_search(&row).is_err() {
            tile.bodies.push(setup.static_at(row, step));
        }
    }
}

/// The rows of the statics that those may come to who go far, or who are in nobody's usual halo here. The others stay near those that
/// reach the tile's region.
fn find_on_the_way(tile: &Tile, setup: &Setup, step: u64) -> Vec<u32> {
    // Rounding decides nothing here.
    let near = tile.region.shrunk(-0.999 * setup.reach_of_statics());
    let may = |&row: &usize| row >= tile.owned || setup.goes_far(tile.bodies.velocity[row]);
    let rows = (0..tile.bodies.len()).filter(may);
    let ways = rows.map(|row| surroundings(&tile.bodies, row, tile.rectangle.min, setup));
    let ways: Vec<_> = ways.filter(|(low, high)| !(low.cmpge(near.min) & high.cmple(near.max)).all()).collect();
    let mut met = Vec::new();
    each_swept(&ways, setup, step, |_, swept| met.extend(swept.iter().map(|(_, row)| row)));
    ascend(&mut met);
    met
}

/// After a step, forgets contacts with statics that only lay on somebody's way: they have no slot in the next.
pub(crate) fn forget(tile: &mut Tile) {
    if tile.bodies.len() == tile.owned + tile.ghosts() + tile.statics.len() {
        return;
    }
    let statics = tile.statics.len();
    tile.contacts.retain(|key| !matches!(key.high().kind(), SlotKind::Static(i) if i >= statics));
}
