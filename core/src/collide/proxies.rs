//! What the search for pairs, and the manifolds after it, know of each body.

use super::broad_phase::Pair;
use crate::exchange::overlap::Outline;
use crate::model::body::Bodies;
use crate::model::math;
use crate::parallel::ahead::fetch;
use crate::parallel::lanes::{Kernel, LANES, LaneSet, Lanes, Quad, Row};
use crate::parallel::team::Team;
use crate::parallel::vectors::{Vectors, absolute};
use crate::tiling::blueprint::Setup;
use crate::tiling::partition::Region;
use crate::tiling::tile::{Fastest, Tile};
use glam::{DVec2, Vec2};
use std::ops::Range;

/// Bodies are asked for so many before they are read.
const AHEAD: usize = 128;

/// Bodies in a piece of work, at least.
const GRAIN: usize = 8192;

/// The mean velocity of a tile is that of one body of so many; in large tiles, of about so many bodies.
const SAMPLED: usize = 13;
const SAMPLES: usize = 128;

/// The extent of a sensor, which touches nobody.
pub(super) const NO_PAIRS: f32 = f32::INFINITY;

/// What the broad phase knows of every body of a tile, a column for each number.
#[derive(Default, Debug)]
pub(crate) struct Proxies {
    /// Center, in meters from a place that all share.
    pub(crate) x: Vec<f32>,
    pub(crate) y: Vec<f32>,
    /// The greater half extent of the AABB grown by the body's margin, with room for the rounding of local coordinates; or [`NO_PAIRS`].
    pub(crate) extent: Vec<f32>,
    /// Two bodies that are further apart than these radii together, with room for rounding, do not touch in the step: `reach`, and
    /// as far as the body goes, seen from who goes as most do.
    pub(crate) radius: Vec<f32>,
    outline: Vec<Quad>,
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
    pub(crate) lanes: LaneSet,
}

impl Proxies {
    pub(crate) fn len(&self) -> usize {
        self.x.len()
    }

    /// Fills in the proxies of a tile's bodies, of which so many are owned and so many more ghosts. Local coordinates
    /// count from `origin`, which had best be near most of them, as they are rounded. Returns how fast any is.
    pub(crate) fn load(
        &mut self,
        bodies: &Bodies,
        [owned, ghosts]: [usize; 2],
        rectangle: &Region,
        origin: DVec2,
        setup: &Setup,
        team: Team,
    ) -> Fastest {
        let (total, dynamic) = (bodies.len(), owned + ghosts);
        let mean = mean(&bodies.velocity[..dynamic]);
        let load = Load { bodies, dynamic, origin, mean, setup };
        self.outline.resize(total, [0.0; 4]);
        let mut rest = [&mut self.x, &mut self.y, &mut self.extent, &mut self.radius].map(|column| {
            column.resize(total, 0.0);
            &mut column[..]
        });
        let mut outlines = &mut self.outline[..];
        const ENOUGH: &str = "as many are left";
        let parts = team.ranges(total, GRAIN).map(|range| Part {
            columns: rest.each_mut().map(|column| column.split_off_mut(..range.len()).expect(ENOUGH)),
            outline: outlines.split_off_mut(..range.len()).expect(ENOUGH),
            load,
            range,
        });
        let fastest = team.for_each(parts.collect(), |part| setup.lanes.run(part));
        if setup.any_drives() {
            self.sweep(bodies, dynamic, setup);
        }
        if setup.sensors {
            let all = self.extent.iter_mut().zip(&bodies.kind);
            all.filter(|(_, kind)| setup.kind(**kind).sensor).for_each(|(extent, _)| *extent = NO_PAIRS);
        }
        (self.owned, self.dynamic, self.pairing) = (owned, dynamic, owned);
        self.weight.clear();
        self.weight.resize(owned, 2);
        self.weight.resize(dynamic, 0);
        self.weight.resize(total, 1);
        self.size = rectangle.size().as_vec2().to_array();
        self.lanes = setup.lanes;
        fastest.into_iter().fold(Fastest::default(), |all, part| Fastest {
            spin: math::max(all.spin, part.spin),
            way: math::max(all.way, part.way),
        })
    }

    /// Statics have no margin. Those that move get room for all that they sweep in the step.
    fn sweep(&mut self, bodies: &Bodies, dynamic: usize, setup: &Setup) {
        for i in dynamic..bodies.len() {
            let swept = setup.swept(bodies.kind[i], bodies.velocity[i], bodies.angular_velocity[i]);
            self.extent[i] += swept;
            self.outline[i][0] += swept;
            self.outline[i][1] += swept;
        }
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

    /// Half extents of a body's AABB, grown by its margin, in meters.
    #[inline(always)]
    pub(crate) fn half(&self, body: usize) -> [f32; 2] {
        let [x, y, ..] = self.outline[body];
        [x, y]
    }

    /// A body's local coordinates are rounded; comparing them needs this much more room for it, in meters.
    #[inline(always)]
    pub(crate) fn slack(&self, body: usize) -> f32 {
        SLACK * math::max(self.x[body].abs(), self.y[body].abs())
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
        let (half_a, half_b) = (self.half(a), self.half(b));
        let apart_x = (self.x[a] - self.x[b]).abs() - (half_a[0] + half_b[0]);
        let apart_y = (self.y[a] - self.y[b]).abs() - (half_a[1] + half_b[1]);
        let slack = self.slack(a) + self.slack(b);
        (apart_x <= slack) & (apart_y <= slack)
    }

    /// Half extents of a body's AABB, grown by its margin; how near a surface at rest may come to the center without touching:
    /// bounding radius, what turning may bring nearer in the step, half the speculative distance; and the bounding radius, less than
    /// zero if it is round. In meters.
    #[inline(always)]
    pub(super) fn outline(&self, body: usize) -> Quad {
        self.outline[body]
    }
}

/// Rounding of a local coordinate, as part of it.
const SLACK: f32 = 4.0 * f32::EPSILON;

/// A place amid some bodies: the median of a few of them, on each axis.
pub(crate) fn amid(positions: &[DVec2]) -> DVec2 {
    const MOST: usize = 15;
    let count = positions.len().min(MOST);
    if count == 0 {
        return DVec2::ZERO;
    }
    let median = |axis: usize| {
        let mut sample = [0.0; MOST];
        let sample = &mut sample[..count];
        sample.iter_mut().enumerate().for_each(|(i, place)| *place = positions[i * positions.len() / count][axis]);
        *sample.select_nth_unstable_by(count / 2, f64::total_cmp).1
    };
    DVec2::new(median(0), median(1))
}

/// About the mean of some velocities. Any vector would do, and what is not finite would not.
fn mean(velocities: &[Vec2]) -> Vec2 {
    let (mut sum, mut count) = (Vec2::ZERO, 0.0_f32);
    for &velocity in velocities.iter().step_by(SAMPLED.max(velocities.len() / SAMPLES)) {
        (sum, count) = (sum + velocity, count + 1.0);
    }
    let mean = sum / math::max(count, 1.0);
    if mean.is_finite() { mean } else { Vec2::ZERO }
}

/// Bodies whose proxies are to be filled in, and what that takes.
#[derive(Clone, Copy)]
struct Load<'a> {
    bodies: &'a Bodies,
    dynamic: usize,
    origin: DVec2,
    mean: Vec2,
    setup: &'a Setup,
}

/// Some of them, with their rows of x, y, extent and radius, and their outlines.
struct Part<'a> {
    load: Load<'a>,
    range: Range<usize>,
    columns: [&'a mut [f32]; 4],
    outline: &'a mut [Quad],
}

impl Kernel for Part<'_> {
    type Output = Fastest;

    #[inline(always)]
    fn run<V: Lanes>(self) -> Fastest {
        let Self { load, range, columns: [x, y, extent, radius], outline } = self;
        let (x, x_rest) = x.as_chunks_mut::<LANES>();
        let (y, y_rest) = y.as_chunks_mut::<LANES>();
        let (extent, extent_rest) = extent.as_chunks_mut::<LANES>();
        let (radius, radius_rest) = radius.as_chunks_mut::<LANES>();
        let (outline, outline_rest) = outline.as_chunks_mut::<LANES>();
        let (mut first, mut fastest) = (range.start, [V::splat(0.0); 2]);
        for ((((x, y), extent), radius), outline) in x.iter_mut().zip(y).zip(extent).zip(radius).zip(outline) {
            fastest = faster(load.load::<V>(first, LANES, [x, y, extent, radius], outline), fastest);
            first += LANES;
        }
        let (mut rows, mut quads) = ([[0.0; LANES]; 4], [[0.0; 4]; LANES]);
        fastest = faster(load.load::<V>(first, range.end - first, rows.each_mut(), &mut quads), fastest);
        for (rest, row) in [x_rest, y_rest, extent_rest, radius_rest].into_iter().zip(&rows) {
            rest.copy_from_slice(&row[..rest.len()]);
        }
        outline_rest.copy_from_slice(&quads[..outline_rest.len()]);
        let [spin, way] = fastest.map(|fastest| {
            let mut row = [0.0; LANES];
            fastest.store(&mut row);
            row.into_iter().fold(0.0, math::max)
        });
        Fastest { spin, way }
    }
}

/// The greater ones of each.
#[inline(always)]
fn faster<V: Lanes>(a: [V; 2], b: [V; 2]) -> [V; 2] {
    [a[0].max(b[0]), a[1].max(b[1])]
}

impl Load<'_> {
    /// Fills in the proxies of up to eight bodies. Returns their spins, and how far they go along an axis.
    #[inline(always)]
    fn load<V: Lanes>(
        &self,
        first: usize,
        count: usize,
        columns: [&mut Row; 4],
        outline: &mut [Quad; LANES],
    ) -> [V; 2] {
        let (mut spin, mut grows): (Row, Row) = Default::default();
        let (mut places, mut kinds) = ([[0.0; 2]; LANES], [[0.0; 4]; LANES]);
        let (mut velocities, mut rotations) = ([[0.0; 2]; LANES], [[0.0; 2]; LANES]);
        let Bodies { position, rotation, velocity, angular_velocity, kind, .. } = self.bodies;
        let (position, rotation) = (&position[first..][..count], &rotation[first..][..count]);
        let (velocity, angular_velocity) = (&velocity[first..][..count], &angular_velocity[first..][..count]);
        let kind = &kind[first..][..count];
        // A step begins here to read its bodies.
        fetch(position, AHEAD);
        fetch(position, AHEAD + LANES / 2);
        fetch(velocity, AHEAD);
        fetch(rotation, AHEAD);
        fetch(angular_velocity, AHEAD);
        fetch(kind, AHEAD);
        fetch(&self.bodies.id[first..], AHEAD);
        for lane in 0..count {
            places[lane] = position[lane].to_array();
            velocities[lane] = velocity[lane].to_array();
            rotations[lane] = bytemuck::cast(rotation[lane]);
            kinds[lane] = self.setup.kind(kind[lane]).outline();
            spin[lane] = angular_velocity[lane];
            grows[lane] = if first + lane < self.dynamic { 1.0 } else { 0.0 };
        }
        let [x, y, extent, radius] = columns;
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let ([local_x, local_y], params) = (V::seen_from(self.origin.to_array(), &places), &self.setup.params);
        let ([vx, vy], [c, s]) = (V::load_pairs(&velocities), V::load_pairs(&rotations));
        let [width, height, rounding, bound] = V::load_quads(&kinds);
        let velocity = Vectors::new(vx, vy);
        let (dt, grows, not_round) = (V::splat(params.dt), V::load(&grows), width.if_positive(one, zero));
        // As `Setup::grown_half_extents`.
        let (c, s) = (absolute(c), absolute(s));
        let speed = velocity.dot(velocity).sqrt();
        let any_way = speed.mul(dt).max(V::splat(params.margin_floor)).min(V::splat(params.margin_cap));
        let (way_x, way_y) = (absolute(vx).mul(dt), absolute(vy).mul(dt));
        let margin_x = way_x.max(any_way).mul(grows);
        let margin_y = way_y.max(any_way).mul(grows);
        // Turning brings no point of a round body nearer.
        let spin = absolute(V::load(&spin));
        let sweep = not_round.mul(bound.mul(spin)).mul(dt);
        let swept = rounding.add(sweep.mul(grows));
        let half_x = c.mul(width).add(s.mul(height)).add(swept).min(bound).add(margin_x);
        let half_y = s.mul(width).add(c.mul(height)).add(swept).min(bound).add(margin_y);
        let reach = bound.add(sweep).add(V::splat(0.5 * params.speculative_distance));
        let slack = V::splat(SLACK).mul(absolute(local_x).max(absolute(local_y)));
        let way = velocity.minus(Vectors::new(V::splat(self.mean.x), V::splat(self.mean.y)));
        let far = dt.mul(way.dot(way).sqrt());
        local_x.store(x);
        local_y.store(y);
        half_x.max(half_y).add(slack).store(extent);
        // Distances there come from local coordinates.
        reach.add(slack.add(slack)).add(far).store(radius);
        let bound = width.if_positive(bound, zero.sub(bound));
        V::store_quads([half_x, half_y, reach, bound], outline);
        [spin, way_x.max(way_y)]
    }
}
