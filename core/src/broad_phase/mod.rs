//! Broad phase: which pairs of bodies may touch within this step.
//!
//! The contract, whichever structure finds them: exactly the pairs of proxies with at least one owned body whose grown
//! AABBs overlap, by [`Proxies::overlap`], in any order. That test reads the bodies' own bits, not the tile's local
//! coordinates, so two tiles that both see a pair agree on it.

pub(crate) mod grid;
mod search;

use crate::setup::Setup;
use crate::tile::Tile;
use glam::{DVec2, Vec2};

/// A pair of indices into owned, ghosts and statics; the lower first.
pub(crate) type Pair = [u32; 2];

/// What the broad phase knows of every body of a tile: its grown AABB in coordinates local to the tile.
#[derive(Default, Debug)]
pub(crate) struct Proxies {
    pub(crate) x: Vec<f32>,
    pub(crate) y: Vec<f32>,
    /// Half extents of the AABB, grown by the body's margin.
    pub(crate) half_x: Vec<f32>,
    pub(crate) half_y: Vec<f32>,
    pub(crate) owned: usize,
    /// Width and height of the tile, in meters.
    pub(crate) size: [f32; 2],
    /// Local coordinates are rounded; comparing them needs this much more room, in meters.
    pub(crate) slack: f32,
}

impl Proxies {
    pub(crate) fn len(&self) -> usize {
        self.x.len()
    }

    /// Fills in the proxies of a tile's bodies.
    #[inline(never)]
    pub(crate) fn load(&mut self, tile: &Tile, setup: &Setup) {
        let bodies = &tile.bodies;
        let dynamic = tile.owned + tile.ghosts();
        self.owned = tile.owned;
        let total = bodies.len();
        for column in [&mut self.x, &mut self.y, &mut self.half_x, &mut self.half_y] {
            column.clear();
            column.resize(total, 0.0);
        }
        let mut farthest = 0.0;
        let DVec2 { x: corner_x, y: corner_y } = tile.corner;
        for (i, position) in bodies.position.iter().enumerate() {
            let (x, y) = ((position.x - corner_x) as f32, (position.y - corner_y) as f32);
            (self.x[i], self.y[i]) = (x, y);
            farthest = crate::math::max(crate::math::max(x.abs(), y.abs()), farthest);
        }
        let columns = bodies.kind.iter().zip(&bodies.rotation).zip(&bodies.velocity);
        let halves = self.half_x.iter_mut().zip(&mut self.half_y);
        for (i, (((&kind, &rotation), &velocity), (half_x, half_y))) in columns.zip(halves).enumerate() {
            let half = if i < dynamic {
                setup.grown_half_extents(kind, rotation, velocity)
            } else {
                setup.kind(kind).half_extents(rotation)
            };
            (*half_x, *half_y) = (half.x, half.y);
        }
        self.size = setup.grid.tile_size().as_vec2().to_array();
        self.slack = 4.0 * f32::EPSILON * farthest;
    }

    /// Whether the grown AABBs of two bodies overlap: the definition of a pair.
    #[inline(always)]
    pub(crate) fn overlap(&self, offset: Vec2, [a, b]: Pair) -> bool {
        let (a, b, d) = (a as usize, b as usize, offset.abs());
        (d.x <= self.half_x[a] + self.half_x[b]) & (d.y <= self.half_y[a] + self.half_y[b])
    }
}
