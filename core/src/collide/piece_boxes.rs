//! Two rectangles around each convex piece of bodies, one upright and one along the diagonals, by which most pairs of pieces are seen to
//! be apart: discrete oriented polytopes of eight faces (J. T. Klosowski et al., "Efficient collision detection using bounding volume
//! hierarchies of k-DOPs", 1998).

use crate::collide::broad_phase::Pair;
use crate::model::id::KindId;
use crate::model::math::Rot;
use crate::model::piece::Piece;
use crate::parallel::team::Team;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::{Vec2, Vec4};

/// Bodies in a piece of work, at least.
const GRAIN: usize = 512;

/// Of more pieces some have a rectangle around all of them, too.
const FEW: usize = 8;

/// What figures along the diagonals may be wrong by as they are rounded, as part of the greatest that goes into them.
const ROUNDING: f32 = 1e-6;

/// An eighth of a turn.
const EIGHTH: Rot = Rot { c: std::f32::consts::FRAC_1_SQRT_2, s: std::f32::consts::FRAC_1_SQRT_2 };

/// Of how far something goes to the right and up, how far that is along those and along both diagonals.
#[inline(always)]
fn along_all(upright: Vec2, slanted: Vec2) -> Vec4 {
    Vec4::new(upright.x, upright.y, slanted.x, slanted.y)
}

/// Where a piece begins and ends along four directions, from the center of the body, in meters: to the right, up, and these turned by an
/// eighth of a turn.
#[derive(Clone, Copy, Debug)]
pub(super) struct PieceBox {
    low: Vec4,
    high: Vec4,
}

impl PieceBox {
    #[inline(always)]
    fn new(piece: &Piece, rotation: Rot) -> Self {
        let (upright, slanted) = (piece.outline.bounds(rotation), piece.outline.bounds(EIGHTH.after(rotation)));
        let [low, high] = [0, 1].map(|end| along_all(upright[end], slanted[end]));
        let wider = ROUNDING * high.max(-low).max_element();
        let margin = piece.radius + Vec4::new(0.0, 0.0, wider, wider);
        Self { low: low - margin, high: high + margin }
    }

    /// Around all of some.
    fn around(all: &[Self]) -> Self {
        let nothing = Self { low: Vec4::INFINITY, high: Vec4::NEG_INFINITY };
        all.iter().fold(nothing, |one, two| Self { low: one.low.min(two.low), high: one.high.max(two.high) })
    }

    /// Whether another, of a body at `offset` from this one's, is further than so far along one of the four directions. Who is apart from one
    /// that holds others is apart from these, rounded as all is.
    #[inline(always)]
    fn is_apart(&self, other: &Self, offset: Vec4, far: Vec4) -> bool {
        let gap = (offset + other.low - self.high).max(self.low - (offset + other.high));
        gap.cmpgt(far).any()
    }
}

/// Those of the bodies of a tile that are made of several pieces.
#[derive(Default, Debug)]
pub(super) struct PieceBoxes {
    /// For each body of the tile where its own begin; and their end. Where there are more than a few, those around groups of them follow.
    start: Vec<u32>,
    boxes: Vec<PieceBox>,
    /// For each body whether it is near another.
    is_near: Vec<bool>,
}

/// How many pieces make a group, of so many: about as many as there are groups.
fn group(pieces: usize) -> usize {
    if pieces <= FEW { pieces } else { pieces.isqrt() }
}

/// Those of a body: of each of its pieces, and of its groups, if it has any.
#[derive(Clone, Copy)]
struct OfBody<'a> {
    pieces: &'a [PieceBox],
    groups: &'a [PieceBox],
}

impl OfBody<'_> {
    fn around(&self) -> PieceBox {
        PieceBox::around(if self.groups.is_empty() { self.pieces } else { self.groups })
    }

    /// Tells the numbers of those that are not apart from something, ascending.
    #[inline(always)]
    fn each_near(&self, is_apart: impl Fn(&PieceBox) -> bool, mut near: impl FnMut(usize)) {
        let size = group(self.pieces.len());
        for (number, pieces) in self.pieces.chunks(size).enumerate() {
            if self.groups.get(number).is_some_and(&is_apart) {
                continue;
            }
            for (piece, number) in pieces.iter().zip(number * size..) {
                if !is_apart(piece) {
                    near(number);
                }
            }
        }
    }
}

impl PieceBoxes {
    /// Places them around those bodies of several pieces, as they are now, that are in pairs.
    pub(super) fn place(&mut self, tile: &Tile, pairs: &[Pair], setup: &Setup, team: Team) {
        self.start.clear();
        self.boxes.clear();
        if !setup.compounds {
            return;
        }
        self.is_near.clear();
        self.is_near.resize(tile.bodies.len(), false);
        pairs.as_flattened().iter().for_each(|&body| self.is_near[body as usize] = true);
        let (kinds, rotations, is_near) = (&tile.bodies.kind[..], &tile.bodies.rotation[..], &self.is_near[..]);
        let several = |kind: KindId, is_near: bool| match &setup.kind(kind).pieces[..] {
            all @ [_, _, ..] if is_near => all,
            _ => &[],
        };
        let mut count = 0;
        for (&kind, &is_near) in kinds.iter().zip(is_near) {
            self.start.push(count as u32);
            let pieces = several(kind, is_near).len();
            count += pieces + if pieces > FEW { pieces.div_ceil(group(pieces)) } else { 0 };
        }
        self.start.push(count as u32);
        team.append(&mut self.boxes, kinds.len(), GRAIN, |range, boxes| {
            let of_each = kinds[range.clone()].iter().zip(&rotations[range.clone()]).zip(&is_near[range]);
            for ((&kind, &rotation), &is_near) in of_each {
                let (pieces, first) = (several(kind, is_near), boxes.len());
                boxes.extend(pieces.iter().map(|piece| PieceBox::new(piece, rotation)));
                if pieces.len() > FEW {
                    for begin in (0..pieces.len()).step_by(group(pieces.len())) {
                        let end = pieces.len().min(begin + group(pieces.len()));
                        boxes.push(PieceBox::around(&boxes[first + begin..first + end]));
                    }
                }
            }
        });
    }

    /// Tells which two pieces of two bodies, of which B is at `offset` from A, are not apart by so far: in the order of their numbers.
    #[inline(always)]
    pub(super) fn each_near(
        &self,
        bodies: [u32; 2],
        tile: &Tile,
        setup: &Setup,
        (offset, far): (Vec2, f32),
        mut near: impl FnMut(usize, usize),
    ) {
        let mut only = [None; 2];
        let [only_a, only_b] = &mut only;
        let (a, b) = (self.of(bodies[0], tile, setup, only_a), self.of(bodies[1], tile, setup, only_b));
        let wider = far + ROUNDING * offset.abs().max_element();
        let (offset, far) = (along_all(offset, EIGHTH.rotate(offset)), Vec4::new(far, far, wider, wider));
        let whole = if a.groups.is_empty() { None } else { Some(b.around()) };
        let beyond = |box_a: &PieceBox| whole.is_some_and(|whole| box_a.is_apart(&whole, offset, far));
        a.each_near(beyond, |number_a| {
            let box_a = &a.pieces[number_a];
            b.each_near(|box_b| box_a.is_apart(box_b, offset, far), |number_b| near(number_a, number_b));
        });
    }

    /// Those of a body; `only` is room for that of one that has a single piece.
    #[inline(always)]
    fn of<'a>(&'a self, body: u32, tile: &Tile, setup: &Setup, only: &'a mut Option<PieceBox>) -> OfBody<'a> {
        let body = body as usize;
        match &setup.kind(tile.bodies.kind[body]).pieces[..] {
            [piece] => {
                let only = only.insert(PieceBox::new(piece, tile.bodies.rotation[body]));
                OfBody { pieces: std::slice::from_ref(only), groups: &[] }
            }
            pieces => {
                let all = &self.boxes[self.start[body] as usize..self.start[body + 1] as usize];
                let (pieces, groups) = all.split_at(pieces.len());
                OfBody { pieces, groups }
            }
        }
    }
}
