//! Statics side by side are one surface, and so are the pieces of a body. Contacts are made where bodies come on their free way, each as if
//! it were alone; but where one stops a body, that does not go on into the side of the next, behind the surface that it came to.
//!
//! So what of several statics or pieces is touched behind the plane of the first one is looked for again, on the way that this one leaves.
//! Sources for what goes wrong where each is seen alone: G. van den Bergen, "Collision Detection in Interactive 3D Environments", 2003;
//! E. Catto, "Ghost Collisions", 2020, who needs the edges of a mesh, which boxes set side by side do not have.

use crate::collide::broad_phase::Pair;
use crate::collide::narrow_phase::Contacts;
use crate::collide::touch::Stopped;
use crate::model::contact::{Contact, PairKey, SlotKind};
use crate::model::kind::Form;
use crate::model::math::{Rot, dot, min};
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
        for &side in sides(tile, &run) {
            let contact = |number| (&tile.contacts.contacts[number], contacts.bodies[number]);
            faces.extend(run.clone().map(|number| Face::new(tile, contact(number), side, setup)));
        }
        let is_behind = |first: usize, other: usize| {
            faces.chunks(run.len()).any(|faces| faces[other - run.start].is_behind(&faces[first - run.start]))
        };
        if run.clone().any(|first| run.clone().any(|other| is_behind(first, other))) {
            mend_of_one(tile, contacts, &run, is_behind, setup, &mut gone);
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
    let is_static = |key: &PairKey| matches!(key.high().kind(), SlotKind::Static(_));
    let are_of_one = |one: &PairKey, two: &PairKey| one.low() == two.low() && (one == two || is_static(one));
    let first = keys.windows(2).position(|two| are_of_one(&two[0], &two[1]))?;
    let count = keys[first..].iter().take_while(|key| are_of_one(&keys[first], key)).count();
    Some(from + first..from + first + count)
}

/// Whose surface it is that is touched.
#[derive(Clone, Copy)]
enum Side {
    /// The one of the two that never moves but by its path.
    Static,
    A,
    B,
}

/// On whose surfaces a run of contacts is looked at.
fn sides(tile: &Tile, run: &Range<usize>) -> &'static [Side] {
    match tile.contacts.keys[run.start].high().kind() {
        SlotKind::Static(_) => &[Side::Static],
        _ => &[Side::A, Side::B],
    }
}

/// Where a body is touched.
struct Face {
    of: DVec2,
    /// Which of its pieces is, if it moves.
    piece: Option<usize>,
    /// Out of it; in the frame of the body if it moves.
    normal: Vec2,
    /// On its surface, from its center.
    points: [Vec2; 2],
    count: usize,
    /// What stands out of a plane by less than this is not before it.
    level: f32,
    /// Whether what touches it pressed already, and does not roll.
    is_stood_on: bool,
}

impl Face {
    fn new(tile: &Tile, (contact, [a, b]): (&Contact, Pair), side: Side, setup: &Setup) -> Self {
        let is_of_a = match side {
            Side::Static => a as usize >= tile.owned + tile.ghosts(),
            Side::A => true,
            Side::B => false,
        };
        let (body, of, way, center) = if is_of_a { (b, a, 1.0, Vec2::ZERO) } else { (a, b, -1.0, contact.offset) };
        let normal = contact.normal * way;
        let points = contact.points.map(|point| point.anchor - normal * (0.5 * point.separation) - center);
        let kind = setup.kind(tile.bodies.kind[body as usize]);
        let presses = contact.points().iter().any(|point| point.normal_impulse > 0.0);
        let face = Self {
            of: tile.bodies.position[of as usize],
            piece: None,
            normal,
            points,
            count: contact.point_count(),
            level: min(LEVEL, LEVEL_BY_SIZE * kind.inner_radius),
            is_stood_on: presses && kind.form != Form::Round,
        };
        let [piece_a, piece_b] = contact.piece_numbers();
        match side {
            Side::Static => face,
            Side::A => face.on_piece(piece_a, contact.rotation_a),
            Side::B => face.on_piece(piece_b, contact.rotation_b),
        }
    }

    /// In the frame of a body that has turned so.
    fn on_piece(self, piece: usize, rotation: Rot) -> Self {
        let points = self.points.map(|point| rotation.unrotate(point));
        Self { piece: Some(piece), normal: rotation.unrotate(self.normal), points, ..self }
    }

    /// Whether it is of another direction than a first one, and not before the plane of that. Round bodies roll from one to the other;
    /// what else pressed already stands on both.
    fn is_behind(&self, first: &Self) -> bool {
        let is_one_piece = self.piece.is_some() && self.piece == first.piece;
        if is_one_piece || dot(first.normal, self.normal) > ONE_NORMAL || self.is_stood_on {
            return false;
        }
        let between = (self.of - first.of).as_vec2() - first.points[0];
        self.points[..self.count].iter().all(|&point| dot(point + between, first.normal) < self.level)
    }
}

/// Looks again for those contacts of a run that are behind others, each on the way that the first of these leaves.
fn mend_of_one(
    tile: &mut Tile,
    contacts: &mut Contacts,
    run: &Range<usize>,
    is_behind: impl Fn(usize, usize) -> bool,
    setup: &Setup,
    gone: &mut Vec<usize>,
) {
    let contact = |number: usize| (contacts.bodies[number], &tile.contacts.contacts[number]);
    let all = run.clone().map(|number| Stopped::new(tile, contact(number), setup));
    let Some(all) = all.collect::<Option<Vec<_>>>() else { return };
    let stopped = |number: usize| &all[number - run.start];
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
