//! Upright rectangles around the convex pieces of bodies, by which most pairs of pieces are seen to be apart.

use crate::model::id::KindId;
use crate::model::math::{Rot, max};
use crate::model::piece::Piece;
use crate::parallel::team::Team;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::Vec2;

/// Bodies in a piece of work, at least.
const GRAIN: usize = 512;

/// Low and high corner of a rectangle, from the center of the body, in meters.
#[derive(Clone, Copy, Debug)]
pub(super) struct PieceBox {
    low: Vec2,
    high: Vec2,
}

impl PieceBox {
    #[inline(always)]
    fn new(piece: &Piece, rotation: Rot) -> Self {
        let [low, high] = piece.outline.bounds(rotation);
        Self { low: low - piece.radius, high: high + piece.radius }
    }

    /// Whether another, of a body at `offset` from this one's, is further than so far along an axis.
    #[inline(always)]
    pub(super) fn is_apart(&self, other: &Self, offset: Vec2, far: f32) -> bool {
        let gap = (offset + other.low - self.high).max(self.low - (offset + other.high));
        max(gap.x, gap.y) > far
    }
}

/// Those of the bodies of a tile that are made of several pieces.
#[derive(Default, Debug)]
pub(super) struct PieceBoxes {
    /// For each body of the tile where its own begin; and their end.
    start: Vec<u32>,
    boxes: Vec<PieceBox>,
}

impl PieceBoxes {
    /// Places them around the bodies of several pieces as they are now, if there are any.
    pub(super) fn place(&mut self, tile: &Tile, setup: &Setup, team: Team) {
        self.start.clear();
        self.boxes.clear();
        if !setup.compounds {
            return;
        }
        let several = |kind: KindId| match &setup.kind(kind).pieces[..] {
            all @ [_, _, ..] => all,
            _ => &[],
        };
        let (kinds, rotations) = (&tile.bodies.kind[..], &tile.bodies.rotation[..]);
        let mut count = 0;
        for &kind in kinds {
            self.start.push(count as u32);
            count += several(kind).len();
        }
        self.start.push(count as u32);
        team.append(&mut self.boxes, kinds.len(), GRAIN, |range, boxes| {
            for (&kind, &rotation) in kinds[range.clone()].iter().zip(&rotations[range]) {
                boxes.extend(several(kind).iter().map(|piece| PieceBox::new(piece, rotation)));
            }
        });
    }

    /// Those of a body, in the order of its pieces; `only` is room for that of a body that has one.
    #[inline(always)]
    pub(super) fn of<'a>(
        &'a self,
        body: u32,
        tile: &Tile,
        setup: &Setup,
        only: &'a mut Option<PieceBox>,
    ) -> &'a [PieceBox] {
        let body = body as usize;
        match &setup.kind(tile.bodies.kind[body]).pieces[..] {
            [piece] => std::slice::from_ref(only.insert(PieceBox::new(piece, tile.bodies.rotation[body]))),
            _ => &self.boxes[self.start[body] as usize..self.start[body + 1] as usize],
        }
    }
}
