//! What the search for pairs, and the manifolds after it, know of each body.

use super::broad_phase::Pair;
use crate::exchange::overlap::Outline;
use crate::model::body::Bodies;
use crate::model::math::{self, dot};
use crate::parallel::lanes::LaneSet;
use crate::parallel::team::Team;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::{DVec2, Vec2};
use std::ops::Range;

/// Bodies in a piece of work, at least.
const GRAIN: usize = 8192;

/// What the broad phase knows of every body of a tile, a column for each number.
#[derive(Default, Debug)]
pub(crate) struct Proxies {
    /// Center, in meters from the tile's corner.
    pub(crate) x: Vec<f32>,
    pub(crate) y: Vec<f32>,
    /// Half extents of the AABB, grown by the body's margin.
    pub(crate) half_x: Vec<f32>,
    pub(crate) half_y: Vec<f32>,
    pub(crate) velocity_x: Vec<f32>,
    pub(crate) velocity_y: Vec<f32>,
    /// How near a surface at rest may come to the center without touching: bounding radius, what turning may bring
    /// nearer in the step, half the speculative distance.
    pub(crate) reach: Vec<f32>,
    /// One for a shape that changes as it turns, zero for a round one.
    pub(crate) not_round: Vec<f32>,
    /// Local coordinates are rounded; comparing them needs this much more room for the body, in meters.
    pub(crate) slack: Vec<f32>,
    /// Pairs are wanted of bodies for whom this comes to two: two for an owned one, one for a static and for a ghost near enough
    /// (see `exchange/overlap.rs`), nothing for other ghosts.
    weight: Vec<u8>,
    /// Pairs of two bodies from here on are not wanted: of ghosts and statics, or of statics.
    pub(crate) pairing: usize,
    pub(crate) owned: usize,
    /// Owned bodies and ghosts; statics come after them.
    pub(crate) dynamic: usize,
    /// Width and height of the tile, in meters.
    pub(crate) size: [f32; 2],
    /// Length of a step, in seconds.
    pub(crate) dt: f32,
    pub(crate) lanes: LaneSet,
}

impl Proxies {
    pub(crate) fn len(&self) -> usize {
        self.x.len()
    }

    /// Fills in the proxies of a tile's bodies, of which so many are owned and so many more ghosts. Local coordinates
    /// count from its `corner`.
    pub(crate) fn load(
        &mut self,
        bodies: &Bodies,
        [owned, ghosts]: [usize; 2],
        corner: DVec2,
        setup: &Setup,
        team: Team,
    ) {
        let (total, dynamic) = (bodies.len(), owned + ghosts);
        let columns = [
            &mut self.x,
            &mut self.y,
            &mut self.half_x,
            &mut self.half_y,
            &mut self.velocity_x,
            &mut self.velocity_y,
            &mut self.reach,
            &mut self.not_round,
            &mut self.slack,
        ];
        let mut rest = columns.map(|column| {
            column.resize(total, 0.0);
            &mut column[..total]
        });
        let parts = team.ranges(total, GRAIN).map(|range| {
            let part = rest.each_mut().map(|column| column.split_off_mut(..range.len()).expect("as many are left"));
            (range, part)
        });
        team.for_each(parts.collect(), |(range, part)| load(bodies, dynamic, corner, setup, range, part));
        (self.owned, self.dynamic, self.pairing) = (owned, dynamic, owned);
        self.weight.clear();
        self.weight.resize(owned, 2);
        self.weight.resize(dynamic, 0);
        self.weight.resize(total, 1);
        self.size = setup.grid.tile_size().as_vec2().to_array();
        (self.dt, self.lanes) = (setup.params.dt, setup.lanes);
    }

    /// Lets ghosts of the tile whose proxies these are be paired with each other, and with statics, where they are near.
    pub(crate) fn pair_ghosts(&mut self, tile: &Tile, setup: &Setup) {
        if setup.overlap.is_some() {
            self.pairing = self.dynamic;
            for ghost in self.owned..self.dynamic {
                self.weight[ghost] = u8::from(Outline::of(tile, ghost, setup).is_near(tile.id, setup));
            }
        }
    }

    /// Whether a pair is one that the tile solves.
    #[inline(always)]
    pub(crate) fn is_wanted(&self, [a, b]: Pair) -> bool {
        self.weight[a as usize] + self.weight[b as usize] >= 2
    }

    /// Whether the grown AABBs of two bodies overlap in local coordinates, with room for their rounding.
    #[inline(always)]
    pub(crate) fn overlap(&self, [a, b]: Pair) -> bool {
        let (a, b) = (a as usize, b as usize);
        let apart_x = (self.x[a] - self.x[b]).abs() - (self.half_x[a] + self.half_x[b]);
        let apart_y = (self.y[a] - self.y[b]).abs() - (self.half_y[a] + self.half_y[b]);
        let slack = self.slack[a] + self.slack[b];
        (apart_x <= slack) & (apart_y <= slack)
    }

    /// The greater half extent of a body's AABB, with room for rounding.
    #[inline(always)]
    pub(crate) fn extent(&self, body: u32) -> f32 {
        let i = body as usize;
        math::max(self.half_x[i], self.half_y[i]) + self.slack[i]
    }

    /// The definition of a pair: the grown AABBs of two bodies overlap, and their bounding circles may touch within the
    /// step. `offset` leads from the center of the first to that of the second.
    ///
    /// Circles touch if distance < reach + closing speed x dt, the contact rule with the greatest closing speed there
    /// can be. Of two round bodies that is known, of others only that it is no more than their relative speed. All is
    /// multiplied by the distance, which saves a division.
    #[inline(always)]
    pub(crate) fn is_pair(&self, offset: Vec2, [a, b]: Pair) -> bool {
        let (a, b, apart) = (a as usize, b as usize, offset.abs());
        let overlap = (apart.x <= self.half_x[a] + self.half_x[b]) & (apart.y <= self.half_y[a] + self.half_y[b]);
        let between = Vec2::new(self.velocity_x[b] - self.velocity_x[a], self.velocity_y[b] - self.velocity_y[a]);
        let square = dot(offset, offset);
        let (distance, speed) = (square.sqrt(), dot(between, between).sqrt());
        // Zero of two round ones; a branch here would be a coin toss.
        let any = math::min(self.not_round[a] + self.not_round[b], 1.0);
        let closing = math::max(math::max(any * (speed * distance), -dot(between, offset)), 0.0);
        let within = (self.reach[a] + self.reach[b]) * distance + self.dt * closing;
        overlap & (square <= within * 1.0001)
    }
}

/// Fills in the proxies of some bodies: the columns of [`Proxies`], in their order.
fn load(bodies: &Bodies, dynamic: usize, corner: DVec2, setup: &Setup, range: Range<usize>, columns: [&mut [f32]; 9]) {
    let (count, dynamic) = (range.len(), dynamic.saturating_sub(range.start));
    // One length for all columns: each index is checked once, not once per column.
    let [x, y, half_x, half_y, velocity_x, velocity_y, reach, not_round, slack] =
        columns.map(|column| &mut column[..count]);
    let (position, velocity, rotation) =
        (&bodies.position[range.clone()], &bodies.velocity[range.clone()], &bodies.rotation[range.clone()]);
    let (angular_velocity, kinds) = (&bodies.angular_velocity[range.clone()], &bodies.kind[range]);
    for i in 0..count {
        let kind = setup.kind(kinds[i]);
        let local = (position[i] - corner).as_vec2();
        (x[i], y[i]) = (local.x, local.y);
        slack[i] = 4.0 * f32::EPSILON * math::max(local.x.abs(), local.y.abs());
        let mut half = kind.half_extents(rotation[i]);
        if i < dynamic {
            half += setup.margin(velocity[i]);
        }
        (half_x[i], half_y[i]) = (half.x, half.y);
        (velocity_x[i], velocity_y[i]) = (velocity[i].x, velocity[i].y);
        // Turning brings no point of a round body nearer.
        let sweep = kind.not_round * (kind.bounding_radius * angular_velocity[i].abs()) * setup.params.dt;
        reach[i] = kind.bounding_radius + sweep + 0.5 * setup.params.speculative_distance;
        not_round[i] = kind.not_round;
    }
}
