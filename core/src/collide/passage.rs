//! How far a body can go on its way through a step before it is too deep in another.

use crate::collide::manifold::convex::collide;
use crate::collide::manifold::scale_of;
use crate::model::kind::KindRow;
use crate::model::math::{Rot, dot, max, min};
use crate::model::piece::Piece;
use glam::Vec2;

/// Each step of the search goes on by such a part of the way at least, and may by so much come too deep; but by no more than a body may
/// come deeper anyway: who is fast and thin would step over what is as thin.
const LEAST: f32 = 1.0 / 128.0;

/// And so many are made, at most: of what is swept faster than by so many depths at a time, no more is known to be free.
const MOST_LOOKS: usize = 1024;

/// A body comes deeper into another within a step by this part of its inner radius, and no more; and how exactly that is found.
const DEPTH: f32 = 0.25;
const EXACT: f32 = 0.05;

/// A body's way through a step, taken as straight, and its turning as even: it need not be more exact, as both its ends are known.
#[derive(Clone, Copy)]
pub(crate) struct Passage<'a> {
    kind: &'a KindRow,
    rotation: Rot,
    /// Half of what it turns by: at most a quarter turn.
    half: Rot,
    /// In m.
    way: Vec2,
}

impl<'a> Passage<'a> {
    pub(crate) fn new(kind: &'a KindRow, [from, to]: [Rot; 2], way: Vec2) -> Self {
        let turn = from.to(to);
        let half = if turn.c > -0.999 {
            Rot { c: 1.0 + turn.c, s: turn.s }.normalized()
        } else {
            Rot { c: 0.0, s: if turn.s < 0.0 { -1.0 } else { 1.0 } }
        };
        Self { kind, rotation: from, half, way }
    }

    /// Its rotation when it has gone a part of its way.
    pub(crate) fn rotation_at(&self, part: f32) -> Rot {
        let Self { rotation, half, .. } = *self;
        let (before, rest) = if part < 0.5 { (rotation, 2.0 * part) } else { (half.after(rotation), 2.0 * part - 1.0) };
        let turn = Rot { c: 1.0 + rest * (half.c - 1.0), s: rest * half.s }.normalized();
        turn.after(before).normalized()
    }

    /// How far turning would take a point of its surface if it went on as it does where it is fastest, in m.
    fn sweep(&self) -> f32 {
        self.kind.not_round * self.kind.bounding_radius * (4.0 * self.half.s.abs() / (1.0 + self.half.c))
    }

    /// The part of its way that it can go before it is too deep in another, that goes its own way, at `offset` from it. By conservative
    /// advancement (B. Mirtich, 1996).
    pub(crate) fn free_part(&self, other: &Self, offset: Vec2) -> f32 {
        let between = self.way - other.way;
        let sweep = self.sweep() + other.sweep();
        let far = dot(between, between).sqrt() + sweep;
        let bounds = |piece: &Piece, rotation: Rot| {
            let [low, high] = piece.outline.bounds(rotation);
            [low - piece.radius, high + piece.radius]
        };
        let mut part = 1.0;
        for other_piece in &other.kind.pieces[..] {
            let [other_low, other_high] = bounds(other_piece, other.rotation).map(|corner| corner + offset);
            for piece in &self.kind.pieces[..] {
                let [low, high] = bounds(piece, self.rotation);
                let gap = (other_low - high).max(low - other_high);
                if max(gap.x, gap.y) < far {
                    let bound = |normal: Vec2| dot(between, normal) + sweep;
                    part = min(part, self.free_part_of([piece, other_piece], other, offset, bound));
                }
            }
        }
        part
    }

    /// As [`free_part`](Self::free_part), of a piece of each. `bound` tells how much nearer they can come along a normal on the whole way.
    fn free_part_of(&self, pieces: [&Piece; 2], other: &Self, offset: Vec2, bound: impl Fn(Vec2) -> f32) -> f32 {
        let depth = DEPTH * self.kind.inner_radius;
        let scale = scale_of([self.kind, other.kind].map(|kind| kind.bounding_radius));
        let (mut part, mut deepest) = (0.0, depth);
        for _ in 0..MOST_LOOKS {
            let rotations = [self.rotation_at(part), other.rotation_at(part)];
            let manifold =
                collide(pieces, rotations, offset + (other.way - self.way) * part, (f32::INFINITY, scale), None);
            let Some(nearest) = manifold.nearest() else { return 1.0 };
            if part == 0.0 {
                deepest = depth + max(-nearest.separation, 0.0);
            }
            let (left, bound) = (nearest.separation + deepest, bound(manifold.normal));
            if bound * (1.0 - part) <= left {
                return 1.0;
            }
            if left <= EXACT * depth {
                return part;
            }
            part += max(left / bound, min(LEAST, depth / bound));
            if part >= 1.0 {
                return 1.0;
            }
        }
        part
    }
}
