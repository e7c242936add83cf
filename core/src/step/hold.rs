//! Contacts are made where bodies come on their free way. Who is hit by then goes elsewhere, and could pass through what stands there, or
//! come into it where two statics meet; so whoever has gone so far, or turned so, that it could, is held back, after the step, where it
//! met a static.

use crate::collide::passage::Passage;
use crate::exchange::far::each_swept;
use crate::model::body::Body;
use crate::model::contact::SlotKind;
use crate::model::kind::KindRow;
use crate::model::math::{Rot, dot};
use crate::solver::SolverBodies;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::{Fastest, Tile};
use glam::DVec2;

/// A body that may come to the other side of something in this step, and how it begins it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way {
    row: usize,
    start: DVec2,
    rotation: Rot,
}

/// Who is not round and turns further than this in a step, in rad, may meet something that the search for contacts did not see.
const FAR_TURN: f32 = 2.5;

/// Before the bodies that a tile owns are moved: those that go or turn so far that something thin could be passed; and those that a
/// static has turned aside, as in a corner, and that could come with their middle into another.
pub(crate) fn ways(tile: &Tile, solved: &SolverBodies, setup: &Setup) -> Vec<Way> {
    if setup.statics.is_empty() {
        return Vec::new();
    }
    let (bodies, slimness) = (&tile.bodies, &setup.slimness);
    let turns_far = |spin: f32| spin.abs() * setup.params.dt > FAR_TURN;
    let Fastest { spin, way } = tile.counts.fastest;
    let any_turns_far = turns_far(spin);
    let any_goes_far = any_turns_far || way > setup.params.margin_cap;
    // Looser than what is asked of each below, so that nothing depends on who shares a tile.
    let furthest = solved.furthest(slimness.longest_arm, setup.lanes);
    let any_moves = |far: f32| furthest > 0.49 * far;
    let goes = |row: usize, far: f32| {
        let kind = setup.kind(bodies.kind[row]);
        solved.moved(row).is_some_and(|(moved, turned)| {
            let swept = kind.not_round * kind.bounding_radius * turned;
            dot(moved, moved).sqrt() + swept > 0.5 * (kind.inner_radius + far)
        })
    };
    let mut rows = Vec::new();
    if any_goes_far || any_moves(slimness.of_bodies) {
        let thrown = tile.contacts.keys[..tile.contacts.own()].iter().filter_map(|key| {
            match (key.low().kind(), key.high().kind()) {
                (SlotKind::Owned(row), SlotKind::Static(_)) => Some(row),
                _ => None,
            }
        });
        rows.extend(thrown.filter(|&row| goes(row, 0.0)));
    }
    if any_moves(slimness.of_both) {
        let met = solved.owned().iter().map(|&row| row as usize);
        rows.extend(met.filter(|&row| goes(row, slimness.of_statics)));
    }
    if any_goes_far {
        let may = |&row: &usize| {
            let is_round = || setup.kind(bodies.kind[row]).not_round == 0.0;
            let turns_far = any_turns_far && turns_far(bodies.angular_velocity[row]) && !is_round();
            turns_far || setup.goes_far(bodies.velocity[row])
        };
        rows.extend((0..tile.owned).filter(may));
    }
    rows.sort_unstable();
    rows.dedup();
    let way = |row| Way { row, start: bodies.position[row], rotation: bodies.rotation[row] };
    rows.into_iter().map(way).collect()
}

/// Takes bodies back to where they come to lie too deep in a static: of what they are thrown against they had no contact. Velocities
/// stay: the next step has the contact, and goes on from there.
///
/// Source: continuous collision against statics after the solver, as in Box2D v3 (E. Catto), which a body pays for with time.
pub(crate) fn hold(tile: &mut Tile, ways: &[Way], setup: &Setup, step: u64) {
    if ways.is_empty() {
        return;
    }
    let around = |way: &Way| {
        let whole = tile.bodies.position[way.row] - way.start;
        let radius = setup.kind(tile.bodies.kind[way.row]).bounding_radius;
        let (half, middle) = (DVec2::splat(radius.into()) + 0.5 * whole.abs(), way.start + 0.5 * whole);
        (middle - half, middle + half)
    };
    let around: Vec<_> = ways.iter().map(around).collect();
    each_swept(&around, setup, step, |way, met| {
        let Way { row, start, rotation } = ways[way];
        let body = tile.bodies.get(row);
        let (kind, whole) = (setup.kind(body.kind), body.position - start);
        let passage = Passage::new(kind, [rotation, body.rotation], whole.as_vec2());
        let mut held: Option<(f32, [Body; 2])> = None;
        for &(_, fixed) in met {
            let course = [step, step + 1].map(|step| setup.static_at(fixed, step));
            let other = setup.kind(course[0].kind);
            if kind.touches(other) {
                let part = passage.free_part(&passage_of(other, &course), (course[0].position - start).as_vec2());
                if part < held.map_or(1.0, |(least, _)| least) {
                    held = Some((part, course));
                }
            }
        }
        if let Some((part, course)) = held {
            tile.rim.is_known = false;
            tile.bodies.position[row] = carried(start + whole * f64::from(part), part, &course, setup);
            tile.bodies.rotation[row] = passage.rotation_at(part);
        }
    });
}

/// The passage of a static, given where it is as the step begins and as it ends.
fn passage_of<'a>(kind: &'a KindRow, [now, then]: &[Body; 2]) -> Passage<'a> {
    Passage::new(kind, [now.rotation, then.rotation], (then.position - now.position).as_vec2())
}

/// Where a body ends that met a static after a part of the step, and goes with it from then on.
fn carried(place: DVec2, part: f32, course: &[Body; 2], setup: &Setup) -> DVec2 {
    let [now, then] = course;
    if now.position == then.position && now.rotation == then.rotation {
        return place;
    }
    let met = now.position + (then.position - now.position) * f64::from(part);
    let turning = passage_of(setup.kind(now.kind), course).rotation_at(part).to(then.rotation);
    then.position + turning.rotate((place - met).as_vec2()).as_dvec2()
}
