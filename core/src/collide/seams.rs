//! Statics side by side are one surface, and so are the pieces of a body. Contacts are made where bodies come on their free way, each as if
//! it were alone; but where one stops a body, that does not go on into the side of the next, behind the surface that it came to.
//!
//! So what of several statics or pieces is touched behind the plane of the first one is looked for again, on the way that this one leaves.
//! Sources for what goes wrong where each is seen alone: G. van den Bergen, "Collision Detection in Interactive 3D Environments", 2003;
//! E. Catto, "Ghost Collisions", 2020, who needs the edges of a mesh, which boxes set side by side do not have.

use crate::collide::narrow_phase::Contacts;
use crate::collide::touch::{self, Stopped};
use crate::collide::wide_pairs::TOUCHING;
use crate::model::contact::{Contact, PairKey, SlotKind};
use crate::model::kind::{Form, KindRow};
use crate::model::math::{dot, min};
use crate::model::piece::Piece;
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
        let (key, bodies) = (tile.contacts.keys[run.start], contacts.bodies[run.start]);
        let kinds = bodies.map(|body| setup.kind(tile.bodies.kind[body as usize]));
        // Who goes no further passes over corners that lie no deeper in it.
        let may_catch = || is_with_static(key) || touch::far(tile, bodies, setup) >= TOUCHING;
        if !may_be_behind(&tile.contacts.contacts[run.clone()], key, kinds) || !may_catch() {
            continue;
        }
        faces.clear();
        for &surface in surfaces(key, kinds) {
            faces.extend(run.clone().map(|number| Face::new(tile, contacts, number, surface, setup)));
        }
        let is_behind = |first: usize, other: usize| {
            faces.chunks(run.len()).any(|faces| faces[other - run.start].is_behind(&faces[first - run.start]))
        };
        let pairs = run.clone().flat_map(|other| run.clone().map(move |first| (first, other)));
        let behind: Vec<(usize, usize)> = pairs.filter(|&(first, other)| is_behind(first, other)).collect();
        if !behind.is_empty() {
            mend_of_one(tile, contacts, &behind, setup, &mut gone);
        }
    }
    if !gone.is_empty() {
        contacts.remove(&gone, &mut tile.contacts);
    }
}

/// The next contacts, from one on, that a body has with several statics, or pieces of them, or two that move have with each other: the
/// former are a body's last.
fn next_of_several(tile: &Tile, from: usize) -> Option<Range<usize>> {
    let keys = &tile.contacts.keys[from..];
    let are_of_one = |one: &PairKey, two: &PairKey| one.low() == two.low() && (one == two || is_with_static(*one));
    let first = keys.windows(2).position(|two| are_of_one(&two[0], &two[1]))?;
    let count = keys[first..].iter().take_while(|key| are_of_one(&keys[first], key)).count();
    Some(from + first..from + first + count)
}

/// Whether one of the bodies is a static.
fn is_with_static(key: PairKey) -> bool {
    matches!(key.high().kind(), SlotKind::Static(_))
}

/// Whose surface it is that is touched.
#[derive(Clone, Copy)]
enum Surface {
    /// That of the one which never moves but by its path.
    Static,
    A,
    B,
}

/// On whose surfaces a run of contacts is looked at, from the names and the kinds of the first two.
fn surfaces(key: PairKey, kinds: [&KindRow; 2]) -> &'static [Surface] {
    match (is_with_static(key), kinds.map(KindRow::is_compound)) {
        (true, _) => &[Surface::Static],
        (_, [true, true]) => &[Surface::A, Surface::B],
        (_, [true, false]) => &[Surface::A],
        (_, [false, true]) => &[Surface::B],
        (_, [false, false]) => &[],
    }
}

/// Whether one of the contacts of a run may be behind another, seen from the kinds of the first two: of several directions, and not all
/// stood on. A long body may lie on many.
fn may_be_behind(run: &[Contact], key: PairKey, kinds: [&KindRow; 2]) -> bool {
    let rolls = kinds.iter().any(|kind| kind.form == Form::Round);
    let are_stood_on = || run.iter().all(|contact| presses(contact, key));
    run.iter().any(|contact| contact.normal != run[0].normal) && (rolls || !are_stood_on())
}

/// Whether it pressed in the last step. Of bodies of two tiles nothing is said: each of these knows its own impulses, and both are to find one
/// geometry.
fn presses(contact: &Contact, key: PairKey) -> bool {
    !key.is_border() && contact.points().iter().any(|point| point.normal_impulse > 0.0)
}

/// Where a body is touched.
struct Face<'a> {
    of: DVec2,
    /// Which of its pieces is, if it moves.
    piece: Option<&'a Piece>,
    /// Out of it; in the frame of the body if it moves.
    normal: Vec2,
    /// On its surface, from its center.
    points: [Vec2; 2],
    count: usize,
    /// What stands out of a plane by less than this is not before it.
    level: f32,
    /// Whether it is not to be looked for again: what touches it pressed already, and does not roll; or is deep in it, where it moves.
    is_stood_on: bool,
}

impl<'a> Face<'a> {
    /// Of the contact of that number.
    fn new(tile: &Tile, contacts: &Contacts, number: usize, surface: Surface, setup: &'a Setup) -> Self {
        let (contact, key) = (&tile.contacts.contacts[number], tile.contacts.keys[number]);
        let [a, b] = contacts.bodies[number];
        let is_of_a = match surface {
            Surface::Static => a as usize >= tile.owned + tile.ghosts(),
            Surface::A => true,
            Surface::B => false,
        };
        let (body, of, way, center) = if is_of_a { (b, a, 1.0, Vec2::ZERO) } else { (a, b, -1.0, contact.offset) };
        let normal = contact.normal * way;
        let points = contact.points.map(|point| point.anchor - normal * (0.5 * point.separation) - center);
        let kind = setup.kind(tile.bodies.kind[body as usize]);
        let face = Self {
            of: tile.bodies.position[of as usize],
            piece: None,
            normal,
            points,
            count: contact.point_count(),
            level: min(LEVEL, LEVEL_BY_SIZE * kind.inner_radius),
            is_stood_on: presses(contact, key) && kind.form != Form::Round,
        };
        let (piece, rotation) = match surface {
            Surface::Static => return face,
            Surface::A => (contact.piece_numbers()[0], contact.rotation_a),
            Surface::B => (contact.piece_numbers()[1], contact.rotation_b),
        };
        let piece = &setup.kind(tile.bodies.kind[of as usize]).pieces[piece];
        let points = points.map(|point| rotation.unrotate(point));
        // In a crowd who overlaps is not let go.
        let overlaps = contacts.separation[number][..face.count].iter().any(|&separation| separation < -TOUCHING);
        let is_stood_on = face.is_stood_on || overlaps;
        Self { piece: Some(piece), normal: rotation.unrotate(normal), points, is_stood_on, ..face }
    }

    /// Whether it is of another direction than a first one, and not before the plane of that; and if they are of two pieces of a body, where
    /// these meet. Round bodies roll from one to the other; what else pressed already, or is deep in a part, is held by both.
    fn is_behind(&self, first: &Self) -> bool {
        if dot(first.normal, self.normal) > ONE_NORMAL || self.is_stood_on {
            return false;
        }
        let between = (self.of - first.of).as_vec2() - first.points[0];
        let points = &self.points[..self.count];
        points.iter().all(|&point| dot(point + between, first.normal) < self.level) && self.is_at_seam(first)
    }

    /// Whether they are of two pieces of a body that meet there, or of statics.
    fn is_at_seam(&self, first: &Self) -> bool {
        let (Some(piece), Some(first)) = (self.piece, first.piece) else { return true };
        let is_there = |&point: &Vec2| first.outline.nearest(point).1 < first.radius + self.level;
        !std::ptr::eq(piece, first) && self.points[..self.count].iter().all(is_there)
    }
}

/// Looks again for those contacts of a run that are behind others, each on the way that the first of these leaves. Given are, one after
/// another, those that are, each with all that it is behind: first these, then that one.
fn mend_of_one(
    tile: &mut Tile,
    contacts: &mut Contacts,
    behind: &[(usize, usize)],
    setup: &Setup,
    gone: &mut Vec<usize>,
) {
    let contact = |number: usize| (contacts.bodies[number], &tile.contacts.contacts[number]);
    let mut numbers: Vec<usize> = behind.iter().flat_map(|&(first, other)| [first, other]).collect();
    numbers.sort_unstable();
    numbers.dedup();
    let all = numbers.iter().map(|&number| Stopped::new(tile, contact(number), setup));
    let Some(all) = all.collect::<Option<Vec<_>>>() else { return };
    let stopped = |number: usize| &all[numbers.partition_point(|&other| other < number)];
    let again = behind.chunk_by(|one, two| one.1 == two.1).filter_map(|of_one| {
        let other = of_one[0].1;
        let before =
            of_one.iter().map(|&(first, _)| first).filter(|&first| stopped(first).order() < stopped(other).order());
        let first = before.reduce(|one, two| if stopped(two).order() < stopped(one).order() { two } else { one })?;
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
