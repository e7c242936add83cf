//! Who has gone far is held back, after the step, where it met a static.

use super::any;
use super::bounds::StaticsByPlace;
use crate::collide::manifold::nearest;
use crate::model::kind::KindRow;
use crate::model::math::{Rot, dot, min};
use crate::solver::SolverBodies;
use crate::tiling::blueprint::Setup;
use crate::tiling::terrain::ascend;
use crate::tiling::tile::Tile;
use glam::{DVec2, Vec2};

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
    if setup.statics.is_empty() {
        return Vec::new();
    }
    // Of others there are contacts. Who was hit may go as far as who hits.
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
pub(crate) fn hold(tile: &mut Tile, ways: &[Way], setup: &Setup, step: u64) {
    if ways.is_empty() {
        return;
    }
    tile.rim.is_known = false;
    let (statics, mut met) = (StaticsByPlace::new(setup, step), Vec::new());
    for &Way { row, start } in ways {
        let whole = tile.bodies.position[row] - start;
        let body = tile.bodies.get(row);
        let (kind, way) = (setup.kind(body.kind), whole.as_vec2());
        let (half, middle) = (kind.half_extents(body.rotation).as_dvec2() + 0.5 * whole.abs(), start + 0.5 * whole);
        let mut part = 1.0_f32;
        statics.meeting(middle - half, middle + half, &mut met);
        ascend(&mut met);
        for fixed in met.drain(..) {
            let fixed = setup.static_at(fixed, step);
            let (other, offset) = (setup.kind(fixed.kind), (fixed.position - start).as_vec2());
            if kind.touches(other) {
                part = min(part, free_part((kind, body.rotation), (other, fixed.rotation), offset, way));
            }
        }
        tile.bodies.position[row] = start + whole * f64::from(part);
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
