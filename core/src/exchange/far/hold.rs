//! Who was thrown elsewhere within a step than where it went by itself is held back, after it, where that leads into a static.

use super::bounds::StaticsByPlace;
use crate::collide::passage::Passage;
use crate::model::math::{Rot, dot, min};
use crate::solver::SolverBodies;
use crate::tiling::blueprint::Setup;
use crate::tiling::terrain::ascend;
use crate::tiling::tile::Tile;
use glam::{DVec2, Vec2};

/// A body that may come to the other side of something in this step, and how it begins it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way {
    row: usize,
    start: DVec2,
    rotation: Rot,
}

/// Before the bodies that a tile owns are moved: those of whom contacts have made something else than their free way, and that goes or
/// turns so far that what is thin could be passed.
pub(crate) fn ways(tile: &Tile, solved: &SolverBodies, setup: &Setup) -> Vec<Way> {
    let bodies = &tile.bodies;
    if setup.statics.is_empty() || !are_swift(tile, setup) {
        return Vec::new();
    }
    let may = |&row: &usize| {
        let kind = setup.kind(bodies.kind[row]);
        let passes = |(moved, turned): (Vec2, f32)| {
            let swept = kind.not_round * kind.bounding_radius * turned;
            dot(moved, moved).sqrt() + swept > 0.5 * (kind.inner_radius + setup.thinnest)
        };
        setup.goes_far(bodies.velocity[row]) || solved.moved(row).is_some_and(passes)
    };
    let way = |row| Way { row, start: bodies.position[row], rotation: bodies.rotation[row] };
    (0..tile.owned).filter(may).map(way).collect()
}

/// Whether any body is so fast that what is thin could be passed by it, or by whom it throws: by one much lighter at twice its speed.
/// Without a branch, as mostly none is.
fn are_swift(tile: &Tile, setup: &Setup) -> bool {
    let (bodies, dynamic) = (&tile.bodies, tile.owned + tile.ghosts());
    let (least, sweep) = (0.25 * setup.least_passage / setup.params.dt, setup.longest_arm);
    let both = bodies.velocity[..dynamic].iter().zip(&bodies.angular_velocity[..dynamic]);
    both.fold(false, |any, (v, w)| any | (v.x.abs() + v.y.abs() + sweep * w.abs() > least))
}

/// Takes bodies back to where they come to lie too deep in a static: of what they are thrown against they had no contact. Velocities
/// stay: the next step has the contact, and goes on from there.
///
/// Source: continuous collision against statics after the solver, as in Box2D v3 (E. Catto), which a body pays for with time.
pub(crate) fn hold(tile: &mut Tile, ways: &[Way], setup: &Setup, step: u64) {
    if ways.is_empty() {
        return;
    }
    let (statics, mut met) = (StaticsByPlace::new(setup, step), Vec::new());
    for &Way { row, start, rotation } in ways {
        let body = tile.bodies.get(row);
        let (kind, whole) = (setup.kind(body.kind), body.position - start);
        let passage = Passage::new(kind, [rotation, body.rotation], whole.as_vec2());
        let (half, middle) = (DVec2::splat(kind.bounding_radius.into()) + 0.5 * whole.abs(), start + 0.5 * whole);
        let mut part = 1.0_f32;
        statics.meeting(middle - half, middle + half, &mut met);
        ascend(&mut met);
        for fixed in met.drain(..) {
            let [now, then] = [step, step + 1].map(|step| setup.static_at(fixed, step));
            let other = setup.kind(now.kind);
            if kind.touches(other) {
                let way = (then.position - now.position).as_vec2();
                let other = Passage::new(other, [now.rotation, then.rotation], way);
                part = min(part, passage.free_part(&other, (now.position - start).as_vec2()));
            }
        }
        if part < 1.0 {
            tile.rim.is_known = false;
            tile.bodies.position[row] = start + whole * f64::from(part);
            tile.bodies.rotation[row] = passage.rotation_at(part);
        }
    }
}
