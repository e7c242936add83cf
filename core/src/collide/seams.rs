//! Statics side by side are one surface. Contacts are made where bodies come on their free way, each as if it were alone; but where one
//! stops a body, that does not go on into the side of the next, behind the surface that it came to.
//!
//! So what of several statics is touched behind the plane of the first one is looked for again, on the way that this one leaves. Sources for
//! what goes wrong where each is seen alone: G. van den Bergen, "Collision Detection in Interactive 3D Environments", 2003; E. Catto,
//! "Ghost Collisions", 2020, who needs the edges of a mesh, which boxes set side by side do not have.

use crate::collide::broad_phase::Pair;
use crate::collide::narrow_phase::Contacts;
use crate::collide::touch::Stopped;
use crate::model::contact::{Contact, PairKey, SlotKind};
use crate::model::kind::Form;
use crate::model::math::{dot, min};
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::{DVec2, Vec2};
use std::ops::Range;

/// What stands out of a plane by less is not before it, in m, and as part of the radius of what there is room for in the body.
const LEVEL: f32 = 0.0005;
const LEVEL_BY_SIZE: f32 = 0.02;

/// Normals count as one whose angle has a greater cosine.
const ONE_NORMAL: f32 = 0.999_99;

/// Looks again for those contacts of a tile that are behind others.
pub(crate) fn mend(tile: &mut Tile, contacts: &mut Contacts, setup: &Setup) {
    let (mut gone, mut faces) = (Vec::new(), Vec::new());
    let mut first = 0;
    while let Some(run) = next_of_several(tile, first) {
        first = run.end;
        let normal = |number: usize| tile.contacts.contacts[number].normal;
        // A long body may lie on many.
        if run.clone().all(|number| normal(number) == normal(run.start)) {
            continue;
        }
        faces.clear();
        faces.extend(run.clone().map(|i| Face::new(tile, (&tile.contacts.contacts[i], contacts.bodies[i]), setup)));
        if faces.iter().any(|one| faces.iter().any(|two| two.is_behind(one))) {
            mend_of_one(tile, contacts, (run, &faces), setup, &mut gone);
        }
    }
    if !gone.is_empty() {
        contacts.remove(&gone, &mut tile.contacts);
    }
}

/// The next contacts, from one on, that a body has with several statics, or pieces of them: these are its last.
fn next_of_several(tile: &Tile, from: usize) -> Option<Range<usize>> {
    let keys = &tile.contacts.keys[from..];
    let is_static = |key: &PairKey| matches!(key.high().kind(), SlotKind::Static(_));
    let first = keys.windows(2).position(|two| two[0].low() == two[1].low() && is_static(&two[0]))?;
    let count = keys[first..].iter().take_while(|key| key.low() == keys[first].low()).count();
    Some(from + first..from + first + count)
}

/// Where a body touches a static.
struct Face {
    of: DVec2,
    /// Out of the static.
    normal: Vec2,
    /// On its surface, from its center.
    points: [Vec2; 2],
    count: usize,
    /// What stands out of a plane by less than this is not before it.
    level: f32,
    /// Whether it pressed already, at a body that does not roll.
    is_stood_on: bool,
}

impl Face {
    fn new(tile: &Tile, (contact, [a, b]): (&Contact, Pair), setup: &Setup) -> Self {
        let is_first = a as usize >= tile.owned + tile.ghosts();
        let (body, of, way, center) = if is_first { (b, a, 1.0, Vec2::ZERO) } else { (a, b, -1.0, contact.offset) };
        let normal = contact.normal * way;
        let points = contact.points.map(|point| point.anchor - normal * (0.5 * point.separation) - center);
        let kind = setup.kind(tile.bodies.kind[body as usize]);
        let presses = contact.points().iter().any(|point| point.normal_impulse > 0.0);
        Self {
            of: tile.bodies.position[of as usize],
            normal,
            points,
            count: contact.point_count(),
            level: min(LEVEL, LEVEL_BY_SIZE * kind.inner_radius),
            is_stood_on: presses && kind.form != Form::Round,
        }
    }

    /// Whether it is of another direction than a first one, and not before the plane of that. Round bodies roll from one to the other;
    /// what else pressed already stands on both.
    fn is_behind(&self, first: &Self) -> bool {
        if dot(first.normal, self.normal) > ONE_NORMAL || self.is_stood_on {
            return false;
        }
        let between = (self.of - first.of).as_vec2() - first.points[0];
        self.points[..self.count].iter().all(|&point| dot(point + between, first.normal) < self.level)
    }
}

/// Looks again for those contacts of a body that are behind others, each on the way that the first of these leaves.
fn mend_of_one(
    tile: &mut Tile,
    contacts: &mut Contacts,
    (run, faces): (Range<usize>, &[Face]),
    setup: &Setup,
    gone: &mut Vec<usize>,
) {
    let contact = |number: usize| (contacts.bodies[number], &tile.contacts.contacts[number]);
    let all = run.clone().map(|number| Stopped::new(tile, contact(number), setup));
    let Some(all) = all.collect::<Option<Vec<_>>>() else { return };
    let stopped = |number: usize| &all[number - run.start];
    let is_behind = |first: usize, other: usize| faces[other - run.start].is_behind(&faces[first - run.start]);
    let again = run.clone().filter_map(|other| {
        let before = |&first: &usize| stopped(first).order() < stopped(other).order() && is_behind(first, other);
        let sooner = |one, two| if stopped(two).order() < stopped(one).order() { two } else { one };
        let first = run.clone().filter(before).reduce(sooner)?;
        Some((first, other, stopped(first).touch(tile, contact(other), setup)))
    });
    let again: Vec<_> = again.collect();
    let mut write = |number: usize, found| (tile.contacts.contacts[number], contacts.separation[number]) = found;
    // What is relied upon must be there just so, unless it is itself behind another.
    for (first, found) in again.iter().filter_map(|&(first, _, _)| Some((first, stopped(first).by()?))) {
        write(first, found);
    }
    for (_, other, found) in again {
        match found {
            Some(found) => write(other, found),
            None => gone.push(other),
        }
    }
}
