//! Bodies that go further within a step than the halo is wide.
//!
//! The box around the way of such a body reaches over tiles, and each of these has it as a ghost like any other. But its own tile
//! knows neither the bodies nor the statics there. So in a step in which there is such a body (every rank hears of it with the
//! first sync point, see [`Verdict::far`](crate::Verdict)), a second one follows: whoever has it as a ghost sends its tile what
//! lies on its way. Halos stay as narrow as the slow bodies need them.
//!
//! Contacts are made where bodies come on their free way. Who is hit by then goes elsewhere, and could pass through what stands
//! there; so whoever has gone far is held back, after the step, where it met a static.
//!
//! Not seen: two such bodies from tiles apart that meet over a tile where nobody is.

use crate::collide::manifold::nearest;
use crate::exchange::mail::{Mail, Mailbag};
use crate::exchange::overlap::Outline;
use crate::exchange::record::{GhostRecord, Unseen};
use crate::model::body::Body;
use crate::model::contact::SlotKind;
use crate::model::id::TileId;
use crate::model::kind::KindRow;
use crate::model::math::{Rot, dot, max, min};
use crate::solver::SolverBodies;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::{DVec2, Vec2};
use std::ops::Range;

/// Whether some bodies' velocities take one of them far. Without a branch, as hardly ever does one.
fn any(velocities: &[Vec2], setup: &Setup) -> bool {
    velocities.iter().fold(false, |any, &velocity| any | setup.goes_far(velocity))
}

/// Some rows of a tile's bodies: those that go far in this step.
fn far_rows(tile: &Tile, rows: Range<usize>, setup: &Setup) -> impl Iterator<Item = usize> {
    let rows = if any(&tile.bodies.velocity[rows.clone()], setup) { rows } else { 0..0 };
    rows.filter(|&row| setup.goes_far(tile.bodies.velocity[row]))
}

/// Sends the tiles of ghosts that go far the bodies on their way, as far as they do not have them anyway.
pub(crate) fn send(tile: &Tile, bag: &mut Mailbag, setup: &Setup) {
    let mut sends: Vec<(TileId, usize)> = Vec::new();
    for ghost in far_rows(tile, tile.owned..tile.owned + tile.ghosts(), setup) {
        let (owner, way) = (tile.ghost_owners[ghost - tile.owned], Outline::of(tile, ghost, setup));
        if way.is_within_halo_of(owner, setup) {
            continue;
        }
        for row in 0..tile.owned + tile.ghosts() {
            let body = Outline::of(tile, row, setup);
            let is_there =
                || setup.partition.locate(tile.bodies.position[row]) == owner || body.is_ghost_of(owner, setup);
            if row != ghost && way.meets(&body) && !is_there() {
                sends.push((owner, row));
            }
        }
    }
    sends.sort_unstable();
    sends.dedup();
    for (owner, row) in sends {
        bag.address(tile.id, owner);
        bag.ghosts.push(GhostRecord { body: tile.bodies.get(row), unseen: Unseen::default(), padding: 0 });
    }
}

/// Takes in what lies on the way of the tile's own bodies, and the statics that its bodies and ghosts may come to.
pub(crate) fn receive(tile: &mut Tile, mail: Mail<'_>, setup: &Setup, step: u64) {
    let mut ghosts: Vec<(TileId, Body, Unseen)> = Vec::new();
    for message in mail.messages() {
        ghosts.extend(
            message.ghosts.iter().map(|ghost| (setup.partition.locate(ghost.body.position), ghost.body, ghost.unseen)),
        );
    }
    let owned = tile.owned;
    if !ghosts.is_empty() {
        let known = tile.ghost_owners.iter().zip(&tile.unseen).zip(owned..);
        ghosts.extend(known.map(|((&owner, &unseen), row)| (owner, tile.bodies.get(row), unseen)));
        ghosts.sort_unstable_by_key(|(owner, body, _)| (*owner, body.id));
        // Several tiles may have sent the same.
        ghosts.dedup_by_key(|(_, body, _)| body.id);
        tile.bodies.truncate(owned);
        tile.ghost_owners.clear();
        tile.unseen.clear();
        for (owner, body, unseen) in ghosts {
            tile.bodies.push(body);
            tile.ghost_owners.push(owner);
            tile.unseen.push(unseen);
        }
        tile.push_statics(setup, step);
    }
    let dynamic = owned + tile.ghosts();
    let Some(speed) =
        far_rows(tile, 0..dynamic, setup).map(|row| tile.bodies.velocity[row].abs().max_element()).reduce(max)
    else {
        return;
    };
    // Whoever is hit may go twice as far as who hits, whichever way.
    let reach = DVec2::splat(2.0 * f64::from(speed * setup.params.dt) + setup.halo_width);
    let corners = |(low, high): (DVec2, DVec2), place: &DVec2| (low.min(*place), high.max(*place));
    let (low, high) = tile.bodies.position[..dynamic].iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), corners);
    let (low, high) = (low - reach, high + reach);
    for (row, fixed) in (0..).zip(setup.statics_at(step)) {
        let half = setup.kind(fixed.kind).half_extents(fixed.rotation).as_dvec2();
        let is_met = (fixed.position - half).cmple(high).all() && (fixed.position + half).cmpge(low).all();
        if is_met && tile.statics.binary_search(&row).is_err() {
            tile.bodies.push(fixed);
        }
    }
}

/// A body that may go far, and where it begins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way {
    row: usize,
    start: DVec2,
}

/// Before the bodies that a tile owns are moved: those that may go far, by themselves or as they were hit.
pub(crate) fn ways(tile: &Tile, solved: &SolverBodies, setup: &Setup) -> Vec<Way> {
    let bodies = &tile.bodies;
    if !any(&bodies.velocity[..tile.owned + tile.ghosts()], setup) {
        return Vec::new();
    }
    // Of others there are contacts. Who was hit may go as far as who hits.
    if bodies.len() == tile.owned + tile.ghosts() {
        return Vec::new();
    }
    let may = |&row: &usize| {
        let much = 0.5 * setup.kind(bodies.kind[row]).inner_radius;
        let moved = |moved: Vec2| moved.abs().max_element() > much;
        setup.goes_far(bodies.velocity[row]) || solved.displacement(row).is_some_and(moved)
    };
    (0..tile.owned).filter(may).map(|row| Way { row, start: bodies.position[row] }).collect()
}

/// Takes bodies back to where they met a static: who is hit on the way turns to where no contact was made. Velocities stay: the
/// next step has the contact, and goes on from there.
///
/// Source: continuous collision against statics after the solver, as in Box2D v3 (E. Catto), which a body pays for with time.
pub(crate) fn hold(tile: &mut Tile, ways: &[Way], setup: &Setup) {
    if ways.is_empty() {
        return;
    }
    tile.rim.is_known = false;
    let bounds = Bounds::new(tile, setup);
    for &Way { row, start } in ways {
        let whole = tile.bodies.position[row] - start;
        let body = tile.bodies.get(row);
        let (kind, way) = (setup.kind(body.kind), whole.as_vec2());
        let (half, middle) = (kind.half_extents(body.rotation).as_dvec2() + 0.5 * whole.abs(), start + 0.5 * whole);
        let mut part = 1.0_f32;
        for fixed in bounds.meeting(middle - half, middle + half) {
            let fixed = tile.bodies.get(fixed);
            let (other, offset) = (setup.kind(fixed.kind), (fixed.position - start).as_vec2());
            part = min(part, free_part((kind, body.rotation), (other, fixed.rotation), offset, way));
        }
        tile.bodies.position[row] = start + whole * f64::from(part);
    }
}

/// The statics of a tile, with the low and high corners of upright rectangles around them: from left to right by the low ones.
struct Bounds {
    all: Vec<(usize, DVec2, DVec2)>,
    /// How far to the right any comes of those up to each.
    right: Vec<f64>,
}

impl Bounds {
    fn new(tile: &Tile, setup: &Setup) -> Self {
        let bound = |row: usize| {
            let fixed = tile.bodies.get(row);
            let half = setup.kind(fixed.kind).half_extents(fixed.rotation).as_dvec2();
            (row, fixed.position - half, fixed.position + half)
        };
        let mut all: Vec<_> = (tile.owned + tile.ghosts()..tile.bodies.len()).map(bound).collect();
        all.sort_unstable_by(|(_, a, _), (_, b, _)| a.x.total_cmp(&b.x));
        let mut right = f64::NEG_INFINITY;
        let furthest = |(_, _, high): &(usize, DVec2, DVec2)| {
            right = right.max(high.x);
            right
        };
        let right = all.iter().map(furthest).collect();
        Self { all, right }
    }

    /// Those that meet a rectangle.
    fn meeting(&self, low: DVec2, high: DVec2) -> impl Iterator<Item = usize> + '_ {
        let first = self.right.partition_point(|&right| right < low.x);
        let near = self.all[first..].iter().take_while(move |(_, own, _)| own.x <= high.x);
        near.filter(move |(_, own_low, own_high)| own_low.cmple(high).all() && own_high.cmpge(low).all())
            .map(|(row, ..)| *row)
    }
}

/// The part of its way that a body can go before it is some way within another that rests. By conservative advancement.
fn free_part(
    (kind, rotation): (&KindRow, Rot),
    (other, other_rotation): (&KindRow, Rot),
    offset: Vec2,
    way: Vec2,
) -> f32 {
    const MOST_ROUNDS: usize = 32;
    let reach = dot(way, way).sqrt() + dot(offset, offset).sqrt();
    let depth = 0.25 * kind.inner_radius;
    let mut part = 0.0;
    for round in 0..MOST_ROUNDS {
        let manifold = nearest(kind, rotation, other, other_rotation, offset - way * part, reach);
        let Some(nearest) = manifold.nearest() else { return 1.0 };
        let (apart, closing) = (nearest.separation + depth, dot(way, manifold.normal));
        if apart <= 1e-3 * depth {
            // Who begins there has a contact that pushes it out, and is only kept from going much deeper.
            return if round == 0 && closing < depth { 1.0 } else { part };
        }
        if closing * (1.0 - part) <= apart {
            return 1.0;
        }
        part += apart / closing;
    }
    part
}

/// After a step, forgets contacts with statics that only lay on somebody's way: they have no slot in the next.
pub(crate) fn forget(tile: &mut Tile) {
    if tile.bodies.len() == tile.owned + tile.ghosts() + tile.statics.len() {
        return;
    }
    let statics = tile.statics.len();
    tile.contacts.retain(|key| !matches!(key.high().kind(), SlotKind::Static(i) if i >= statics));
}
