//! Statics side by side are one surface, and so are the pieces of a body. Contacts are made where bodies come on their free way, each as if
//! it were alone; but where one stops a body, that does not go on into the side of the next, behind the surface that it came to.
//!
//! So what of several statics or pieces is touched behind the plane of the first one is looked for again, on the way that this one leaves.
//! Sources for what goes wrong where each is seen alone: G. van den Bergen, "Collision Detection in Interactive 3D Environments", 2003;
//! E. Catto, "Ghost Collisions", 2020, who needs the edges of a mesh, which boxes set side by side do not have.

use crate::collide::manifold::scale_of;
use crate::collide::narrow_phase::Contacts;
use crate::collide::touch::{self, Stopped, TOUCHING};
use crate::model::contact::{Contact, ContactPoint, PairKey};
use crate::model::kind::{Form, KindRow};
use crate::model::math::{dot, max, min};
use crate::model::piece::Piece;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::Vec2;
use std::cmp::Ordering;
use std::ops::Range;

/// What stands out of a plane by less is not before it, in m, and as part of the radius of what there is room for in the body.
const LEVEL: f32 = 0.0005;
const LEVEL_BY_SIZE: f32 = 0.02;

/// Normals count as one whose angle has a greater cosine.
const ONE_NORMAL: f32 = 0.999_99;

/// Looks again for those contacts of a tile that are behind others. Time grows with the contacts of a body times the directions of these, where
/// those of one direction stand out alike.
pub(crate) fn mend(tile: &mut Tile, contacts: &mut Contacts, setup: &Setup) {
    let (mut gone, mut first) = (Vec::new(), 0);
    while let Some(run) = next_of_several(tile, first) {
        first = run.end;
        let (key, bodies) = (tile.contacts.keys[run.start], contacts.bodies[run.start]);
        let kinds = bodies.map(|body| setup.kind(tile.bodies.kind[body as usize]));
        // Who goes no further passes over corners that lie no deeper in it.
        let touching = || TOUCHING * scale_of(kinds.map(|kind| kind.bounding_radius));
        let may_catch = || key.is_with_static() || touch::far(tile, bodies, setup) >= touching();
        if may_be_behind(&tile.contacts.contacts[run.clone()], key, kinds) && may_catch() {
            mend_run(tile, contacts, (run, surfaces(key, kinds)), setup, &mut gone);
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
    let are_of_one = |one: &PairKey, two: &PairKey| one.low() == two.low() && (one == two || one.is_with_static());
    let first = keys.windows(2).position(|two| are_of_one(&two[0], &two[1]))?;
    let count = keys[first..].iter().take_while(|key| are_of_one(&keys[first], key)).count();
    Some(from + first..from + first + count)
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
    match (key.is_with_static(), kinds.map(KindRow::is_compound)) {
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

/// Where a surface is touched.
struct Face<'a> {
    /// Of the contact.
    number: usize,
    /// Which piece of a body is, if it moves.
    piece: Option<&'a Piece>,
    /// Out of it; in the frame of the body if it moves.
    normal: Vec2,
    /// On it, the one touched first, and then the other: `count` of them are touched together. From the center of the body if it moves, and
    /// else from that of the one which touches it.
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
        let kinds = [a, b].map(|body| setup.kind(tile.bodies.kind[body as usize]));
        let touching = TOUCHING * scale_of(kinds.map(|kind| kind.bounding_radius));
        let (touched, count) = touched_first(contact, touching);
        let points = touched.map(|point| point.anchor - normal * (0.5 * point.separation) - center);
        let kind = setup.kind(tile.bodies.kind[body as usize]);
        let face = Self {
            number,
            piece: None,
            normal,
            points,
            count,
            level: min(LEVEL, LEVEL_BY_SIZE * kind.inner_radius),
            is_stood_on: presses(contact, key) && kind.form != Form::Round,
        };
        let (piece, rotation) = match surface {
            Surface::Static => {
                let from = (tile.bodies.position[of as usize] - tile.bodies.position[body as usize]).as_vec2();
                return Self { points: points.map(|point| point + from), ..face };
            }
            Surface::A => (contact.piece_numbers()[0], contact.rotation_a),
            Surface::B => (contact.piece_numbers()[1], contact.rotation_b),
        };
        let piece = &setup.kind(tile.bodies.kind[of as usize]).pieces[piece];
        let points = points.map(|point| rotation.unrotate(point));
        // In a crowd who overlaps is not let go.
        let overlaps =
            contacts.separation[number][..contact.point_count()].iter().any(|&separation| separation < -touching);
        let is_stood_on = face.is_stood_on || overlaps;
        Self { piece: Some(piece), normal: rotation.unrotate(normal), points, is_stood_on, ..face }
    }

    /// Where its plane is, along its normal.
    fn height(&self) -> f32 {
        dot(self.points[0], self.normal)
    }

    /// What planes of that normal stand higher than if it is behind them; none, if it is of that direction itself. Round bodies roll from
    /// one to the other; what else pressed already, or is deep in a part, is held by both.
    fn is_behind_higher_than(&self, normal: Vec2) -> f32 {
        if self.is_stood_on || dot(normal, self.normal) > ONE_NORMAL {
            return f32::INFINITY;
        }
        let points = self.points[..self.count].iter().map(|&point| dot(point, normal));
        points.fold(f32::NEG_INFINITY, max) - self.level
    }

    /// Whether they are of two pieces of a body that meet there, or of statics.
    fn is_at_seam(&self, first: &Self) -> bool {
        let (Some(piece), Some(first)) = (self.piece, first.piece) else { return true };
        let is_there = |&point: &Vec2| first.outline.nearest(point).1 < first.radius + self.level;
        !std::ptr::eq(piece, first) && self.points[..self.count].iter().all(is_there)
    }
}

/// The points of a contact, the one touched first before the other, and how many are touched together, nearer to each other than what
/// touches: what of an edge is yet to come down may come down elsewhere.
fn touched_first(contact: &Contact, touching: f32) -> ([ContactPoint; 2], usize) {
    match contact.points {
        [one, _] if contact.point_count() == 1 => ([one; 2], 1),
        [one, two] => {
            let points = if two.separation < one.separation { [two, one] } else { [one, two] };
            (points, if points[1].separation < points[0].separation + touching { 2 } else { 1 })
        }
    }
}

/// What is touched of one surface.
struct Touched<'a> {
    /// One direction after another.
    faces: Vec<Face<'a>>,
    directions: Vec<Direction>,
}

/// Faces of one direction.
struct Direction {
    faces: Range<usize>,
    normal: Vec2,
    /// Where the plane of the highest is.
    highest: f32,
}

impl<'a> Touched<'a> {
    /// By the contacts of a run.
    fn by(tile: &Tile, contacts: &Contacts, run: Range<usize>, surface: Surface, setup: &'a Setup) -> Self {
        let mut faces: Vec<_> = run.map(|number| Face::new(tile, contacts, number, surface, setup)).collect();
        let name = |face: &Face<'_>| face.normal.to_array().map(f32::to_bits);
        faces.sort_by_key(name);
        let mut first = 0;
        let of_one = faces.chunk_by(|one, two| name(one) == name(two)).map(|faces| {
            let highest = faces.iter().map(Face::height).fold(f32::NEG_INFINITY, max);
            let direction = Direction { faces: first..first + faces.len(), normal: faces[0].normal, highest };
            first += faces.len();
            direction
        });
        let directions = of_one.collect();
        Self { faces, directions }
    }

    /// Sorts those of each direction.
    fn sort_by(&mut self, order: impl Fn(&Face<'_>, &Face<'_>) -> Ordering) {
        for Direction { faces, .. } in &self.directions {
            self.faces[faces.clone()].sort_by(&order);
        }
    }

    /// The first of each direction that a face is behind: of another direction than its own, and the face not before its plane; and where
    /// they are of two pieces of a body, these meet there.
    fn firsts(&self, face: &Face<'_>) -> impl Iterator<Item = &Face<'a>> {
        self.directions.iter().filter_map(move |direction| {
            let height = face.is_behind_higher_than(direction.normal);
            let hides = |first: &&Face<'_>| first.height() > height && face.is_at_seam(first);
            let may_hide = direction.highest > height;
            may_hide.then(|| self.faces[direction.faces.clone()].iter().find(hides)).flatten()
        })
    }
}

/// Looks again for those contacts of a run that are behind others, each on the way that the first of these leaves.
fn mend_run(
    tile: &mut Tile,
    contacts: &mut Contacts,
    (run, surfaces): (Range<usize>, &[Surface]),
    setup: &Setup,
    gone: &mut Vec<usize>,
) {
    let touched = |&surface| Touched::by(tile, contacts, run.clone(), surface, setup);
    let mut surfaces: Vec<Touched<'_>> = surfaces.iter().map(touched).collect();
    let mut all = surfaces.iter().flat_map(|surface| surface.faces.iter().map(move |face| (surface, face)));
    if !all.any(|(surface, face)| surface.firsts(face).next().is_some()) {
        return;
    }
    let stop = |number: usize| Stopped::new(tile, (contacts.bodies[number], &tile.contacts.contacts[number]), setup);
    let mut all: Vec<Option<Stopped>> = run.clone().map(stop).collect();
    let of_statics = tile.contacts.keys[run.start].is_with_static();
    if of_statics && hold_at_corners(tile, contacts, run.clone(), &mut all, setup) {
        surfaces = vec![Touched::by(tile, contacts, run.clone(), Surface::Static, setup)];
    }
    let contact = |number: usize| (contacts.bodies[number], &tile.contacts.contacts[number]);
    let stopped = |number: usize| all[number - run.start].as_ref();
    let order = |one: usize, two: usize| {
        let [one, two] = [one, two].map(|number| stopped(number).map_or([f32::INFINITY; 2], Stopped::order));
        touch::sooner(one, two)
    };
    let sooner = |one: &usize, two: &usize| order(*one, *two).then(one.cmp(two));
    let mut behind = Vec::new();
    for surface in &mut surfaces {
        surface.sort_by(|one, two| order(one.number, two.number));
        let of_one = surface.faces.iter().filter_map(|face| {
            stopped(face.number)?;
            let first = surface.firsts(face).map(|first| first.number).min_by(sooner)?;
            order(first, face.number).is_lt().then_some((face.number, first))
        });
        behind.extend(of_one);
    }
    behind.sort_by(|one, two| one.0.cmp(&two.0).then(sooner(&one.1, &two.1)));
    behind.dedup_by_key(|&mut (other, _)| other);
    let again = behind.iter().filter_map(|&(other, first)| {
        let stopped = stopped(first)?;
        Some((stopped, first, other, stopped.touch(tile, contact(other), setup)))
    });
    let again: Vec<_> = again.collect();
    let mut write = |number: usize, found| (tile.contacts.contacts[number], contacts.separation[number]) = found;
    // What is relied upon must be there just so, unless it is itself behind another.
    for (first, found) in again.iter().filter_map(|&(stopped, first, ..)| Some((first, stopped.by()?))) {
        write(first, found);
    }
    for (.., other, found) in again {
        match found {
            Some(found) => write(other, found),
            None => gone.push(other),
        }
    }
}

/// Holds those that would pass over the corner of a static into another of a run's, which goes on there. Whether there is any.
fn hold_at_corners(
    tile: &mut Tile,
    contacts: &mut Contacts,
    run: Range<usize>,
    all: &mut [Option<Stopped>],
    setup: &Setup,
) -> bool {
    let passes = |number: &usize| all[number - run.start].as_ref().is_some_and(Stopped::passes_over_corner);
    let into_another = |&number: &usize| {
        let face = Face::new(tile, contacts, number, Surface::Static, setup);
        let beyond = face.points[0] + face.normal * (2.0 * face.level);
        run.clone().any(|other| other != number && is_in_static(tile, contacts, other, (beyond, face.level), setup))
    };
    let held = run.clone().filter(passes).filter(into_another).filter_map(|number| {
        let of = (contacts.bodies[number], &tile.contacts.contacts[number]);
        let stopped = Stopped::at_corner(tile, of, setup)?;
        stopped.by().map(|by| (number, stopped, by))
    });
    let held: Vec<_> = held.collect();
    let is_any = !held.is_empty();
    for (number, stopped, by) in held {
        (tile.contacts.contacts[number], contacts.separation[number]) = by;
        all[number - run.start] = Some(stopped);
    }
    is_any
}

/// Whether a point, from the center of the body, is in the static of a contact, or nearer to it than so much.
fn is_in_static(tile: &Tile, contacts: &Contacts, number: usize, (point, near): (Vec2, f32), setup: &Setup) -> bool {
    let (pair, numbers) = (contacts.bodies[number], tile.contacts.contacts[number].piece_numbers());
    let side = usize::from(pair[1] as usize >= tile.owned + tile.ghosts());
    let [of, body] = [pair[side], pair[1 - side]].map(|row| row as usize);
    let piece = &setup.kind(tile.bodies.kind[of]).pieces[numbers[side]];
    let center = (tile.bodies.position[of] - tile.bodies.position[body]).as_vec2();
    let seen = tile.bodies.rotation[of].unrotate(point - center);
    piece.side.is_none() && piece.outline.nearest(seen).1 <= piece.radius + near
}
