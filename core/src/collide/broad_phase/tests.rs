//! The grid, and the quadtree, against trying every pair.

use super::grid::Grid;
use super::quadtree::Quadtree;
use super::{Field, Pair};
use crate::collide::proxies::Proxies;
use crate::exchange::record::Unseen;
use crate::model::body::{Body, StaticBody};
use crate::model::id::{GlobalId, KindId, TileId};
use crate::model::kind::Kind;
use crate::model::math::{Rot, dot, max};
use crate::model::params::{Instructions, Params};
use crate::model::shape::Shape;
use crate::parallel::lanes::LaneSet;
use crate::parallel::team::Team;
use crate::testing::{any_kind, any_rotation, cases, circle, distance, rectangle};
use crate::tiling::blueprint::{Blueprint, Setup};
use crate::tiling::partition::Partition;
use crate::tiling::tile::Tile;
use glam::{DVec2, Vec2};
use proptest::prelude::*;
use std::collections::BTreeSet;
use std::sync::OnceLock;

/// A tile, stuffed by hand, and its setup.
pub(in crate::collide) struct Stuffed {
    pub(in crate::collide) setup: Setup,
    pub(in crate::collide) tile: Tile,
    pub(in crate::collide) proxies: Proxies,
}

impl Stuffed {
    /// Of the given bodies the first `owned` part is owned, the others are ghosts. They are named in this order.
    pub(super) fn new(
        size: Vec2,
        kinds: Vec<Kind>,
        mut bodies: Vec<Body>,
        owned: f64,
        statics: Vec<StaticBody>,
    ) -> Self {
        (1_000..).zip(&mut bodies).for_each(|(id, body)| body.id = GlobalId(id));
        let owned = (owned * bodies.len() as f64) as usize;
        Self::named(size, kinds, &bodies, owned, statics)
    }

    /// Of the given bodies so many are owned, the others are ghosts. Nothing asks where they are: a tile may hold any
    /// body anywhere.
    pub(super) fn named(size: Vec2, kinds: Vec<Kind>, bodies: &[Body], owned: usize, statics: Vec<StaticBody>) -> Self {
        let partition = Partition::uniform(DVec2::ZERO, 3.0 * size.as_dvec2(), 3, 3).unwrap();
        let blueprint = Blueprint { params: Params::default(), partition, kinds, statics };
        let setup = Setup::new(&blueprint).unwrap();
        let mut tile = Tile::new(TileId(4), &setup);
        tile.owned = owned;
        for &body in bodies {
            tile.bodies.push(Body { position: body.position + tile.rectangle.min, ..body });
        }
        tile.unseen.resize(bodies.len() - tile.owned, Unseen::default());
        tile.ghost_owners.resize(bodies.len() - tile.owned, TileId(5));
        for body in &setup.statics {
            tile.bodies.push(*body);
        }
        let mut proxies = Proxies::default();
        let counts = [tile.owned, tile.ghosts()];
        proxies.load(&tile.bodies, counts, &tile.rectangle, tile.rectangle.min, &setup, Team::ALONE);
        Self { setup, tile, proxies }
    }

    pub(in crate::collide) fn offset(&self, [a, b]: Pair) -> Vec2 {
        (self.tile.bodies.position[b as usize] - self.tile.bodies.position[a as usize]).as_vec2()
    }

    /// The definition of a pair, in plain numbers: that of `cull.rs`, but for who passes by.
    pub(in crate::collide) fn is_pair(&self, [a, b]: Pair) -> bool {
        let (bodies, offset) = (&self.tile.bodies, self.offset([a, b]));
        let (a, b) = (a as usize, b as usize);
        let between = bodies.velocity[b] - bodies.velocity[a];
        let [half_x_a, half_y_a, reach_a, bound_a] = self.proxies.outline(a);
        let [half_x_b, half_y_b, reach_b, bound_b] = self.proxies.outline(b);
        let overlap = offset.x.abs() <= half_x_a + half_x_b && offset.y.abs() <= half_y_a + half_y_b;
        let square = dot(offset, offset);
        let (distance, speed) = (square.sqrt(), dot(between, between).sqrt());
        let any_way = if bound_a > 0.0 || bound_b > 0.0 { speed * distance } else { 0.0 };
        let closing = max(max(any_way, -dot(between, offset)), 0.0);
        let within = (reach_a + reach_b) * distance + self.setup.params.dt * closing;
        overlap && square <= within * 1.0001
    }

    /// Whether the grid must name a pair, in plain numbers: not if it is far from one of the two as seen from who does not turn.
    pub(in crate::collide) fn must_be_named(&self, [a, b]: Pair) -> bool {
        let (bodies, offset) = (&self.tile.bodies, self.offset([a, b]));
        let is_pair = self.is_pair([a, b]);
        let (a, b) = (a as usize, b as usize);
        let goes = self.setup.params.dt * (bodies.velocity[b] - bodies.velocity[a]).length();
        let [reach_a, reach_b] = [a, b].map(|body| self.proxies.outline(body)[2]);
        let is_clear = |of: usize, offset: Vec2| {
            let kind = self.setup.kind(bodies.kind[of]);
            let seen = bodies.rotation[of].unrotate(offset).abs() - kind.extent - kind.radius;
            seen.max_element() > reach_a + reach_b - kind.bounding_radius + goes
        };
        is_pair && !is_clear(a, offset) && !is_clear(b, -offset)
    }

    /// Every two bodies of which one is owned, the lower first.
    fn twos(&self) -> impl Iterator<Item = Pair> {
        let bodies = self.tile.bodies.len() as u32;
        (0..self.tile.owned as u32).flat_map(move |a| (a + 1..bodies).map(move |b| [a, b]))
    }

    pub(super) fn brute_force(&self) -> BTreeSet<Pair> {
        self.twos().filter(|&pair| self.must_be_named(pair)).collect()
    }

    fn field(&self) -> Field<'_> {
        Field { proxies: &self.proxies, bodies: &self.tile.bodies, setup: &self.setup, team: Team::ALONE }
    }

    /// What the grid finds, whatever it found before.
    fn by_grid(&self, grid: &mut Grid) -> BTreeSet<Pair> {
        let mut found = Vec::new();
        grid.find_pairs(self.field(), &mut found);
        self.pairs_among(found)
    }

    /// What a quadtree finds, whatever bodies it held before.
    pub(super) fn by_quadtree(&self, quadtree: &mut Quadtree) -> BTreeSet<Pair> {
        quadtree.flush(&self.proxies, &self.tile.bodies.id);
        quadtree.check();
        let mut found = Vec::new();
        quadtree.find_pairs(&self.proxies, Team::ALONE, &mut found);
        let mut shared = Vec::new();
        threads().install(|| quadtree.find_pairs(&self.proxies, Team::of_pool(), &mut shared));
        assert_eq!(shared, found, "three threads found something else");
        self.pairs_among(found)
    }

    pub(super) fn new_quadtree(&self) -> Quadtree {
        Quadtree::new(self.proxies.size)
    }

    /// What was found, less the pairs that are none; refuses one found twice.
    fn pairs_among(&self, found: Vec<Pair>) -> BTreeSet<Pair> {
        let all: BTreeSet<Pair> = found.iter().copied().collect();
        assert_eq!(all.len(), found.len(), "a pair was found twice");
        for &[low, high] in &all {
            assert!(low < high && (low as usize) < self.tile.owned, "{low}, {high} is no pair of an owned body");
        }
        all.into_iter().filter(|&pair| self.must_be_named(pair)).collect()
    }

    /// What everybody finds; refuses if they disagree.
    fn by_each(&self) -> BTreeSet<Pair> {
        let pairs = self.by_grid(&mut Grid::default());
        assert_eq!(self.by_quadtree(&mut self.new_quadtree()), pairs, "the quadtree disagrees with the grid");
        pairs
    }
}

/// Three threads.
fn threads() -> &'static rayon::ThreadPool {
    static POOL: OnceLock<rayon::ThreadPool> = OnceLock::new();
    POOL.get_or_init(|| rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap())
}

pub(super) fn body(kind: usize, position: DVec2) -> Body {
    Body {
        id: GlobalId(0),
        position,
        rotation: Rot::IDENTITY,
        velocity: Vec2::ZERO,
        angular_velocity: 0.0,
        kind: KindId(kind as u32),
    }
}

/// Bodies in a tile of the unit square, to be stretched later: evenly, in a heap, or far outside.
pub(super) fn any_body() -> impl Strategy<Value = (prop::sample::Index, DVec2, Rot, Vec2, f32)> {
    let even = (-0.2..1.2, -0.2..1.2);
    let heap = (0.30..0.34, 0.70..0.74);
    let far = (-300.0..300.0, -300.0..300.0);
    let place = prop_oneof![8 => even, 6 => heap, 1 => far].prop_map(|(x, y)| DVec2::new(x, y));
    let velocity = (-40.0_f32..40.0, -40.0_f32..40.0).prop_map(|(x, y)| Vec2::new(x, y));
    (any::<prop::sample::Index>(), place, any_rotation(), velocity, -47.0_f32..47.0)
}

pub(in crate::collide) fn any_tile(bodies: usize, statics: usize) -> impl Strategy<Value = Stuffed> {
    let kinds = prop::collection::vec(any_kind(0.01, 100.0), 1..8);
    let size = (0.0_f32..2.0, 0.0_f32..2.0).prop_map(|(x, y)| Vec2::new(10.0_f32.powf(x), 10.0_f32.powf(y)));
    let bodies = prop::collection::vec(any_body(), 0..=bodies);
    let fixed = prop::collection::vec((any_kind(0.01, 1000.0), -0.5..1.5, -0.5..1.5, any_rotation()), 0..=statics);
    (size, kinds, bodies, 0.0..=1.0, fixed).prop_map(|(size, kinds, bodies, owned, fixed)| {
        let bodies = bodies
            .into_iter()
            .map(|(kind, place, rotation, velocity, angular_velocity)| Body {
                rotation,
                velocity,
                angular_velocity,
                ..body(kind.index(kinds.len()), place * size.as_dvec2())
            })
            .collect();
        let place = |x: f64, y: f64| DVec2::new(1.0 + x, 1.0 + y) * size.as_dvec2();
        let fixed = (0..).zip(fixed).map(|(id, (kind, x, y, rotation))| StaticBody {
            id: GlobalId(id),
            position: place(x, y),
            rotation,
            kind,
            path: None,
        });
        let fixed = fixed.collect();
        Stuffed::new(size, kinds, bodies, owned, fixed)
    })
}

impl std::fmt::Debug for Stuffed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(
            f,
            "a tile of {} from {}, {} bodies owned:",
            self.tile.rectangle.size(),
            self.tile.rectangle.min,
            self.tile.owned
        )?;
        let kinds = self.tile.bodies.kind.iter().map(|&kind| &self.setup.kind(kind).shape);
        self.tile.bodies.iter().zip(kinds).try_for_each(|(body, shape)| writeln!(f, "{body:?} {shape:?}"))
    }
}

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn grid_and_quadtree_find_what_brute_force_finds(tile in any_tile(400, 6)) {
        prop_assert_eq!(tile.by_each(), tile.brute_force());
    }

    #[test]
    fn many_statics_are_no_different(tile in any_tile(60, 120)) {
        prop_assert_eq!(tile.by_each(), tile.brute_force());
    }

    #[test]
    fn the_search_finds_the_same_at_any_width(mut tile in any_tile(200, 4)) {
        let wide = tile.by_grid(&mut Grid::default());
        tile.proxies.lanes = LaneSet::of(Instructions::Portable).unwrap();
        prop_assert_eq!(tile.by_grid(&mut Grid::default()), wide);
    }

    /// What is told apart as no pair does not touch in this step, whatever the definition of a pair makes of it. (Not
    /// asked of bodies faster than the cap on the margin, and of none that turn.)
    #[test]
    fn no_two_bodies_touch_that_are_no_pair(tile in any_tile(40, 3)) {
        let (bodies, params) = (&tile.tile.bodies, &tile.setup.params);
        for pair in tile.twos().filter(|&pair| !tile.must_be_named(pair)) {
            let [a, b] = pair.map(|index| index as usize);
            let slow = |body: usize| bodies.velocity[body].length() * params.dt < params.margin_cap;
            if !(slow(a) && slow(b)) {
                continue;
            }
            let [shape_a, shape_b] = [a, b].map(|body| &tile.setup.kind(bodies.kind[body]).shape);
            for part in (0..=16).map(|k| k as f32 / 16.0) {
                let offset = tile.offset(pair) + (bodies.velocity[b] - bodies.velocity[a]) * (part * params.dt);
                let apart = distance(shape_a, bodies.rotation[a], shape_b, bodies.rotation[b], offset);
                prop_assert!(apart > 0.0, "bodies {} and {} touch after {} of the step", a, b, part);
            }
        }
    }
}

#[test]
fn nothing_and_little_have_no_pairs() {
    let kinds = || vec![circle(0.5), rectangle(1.0, 2.0)];
    for bodies in [vec![], vec![body(0, DVec2::ONE)]] {
        let tile = Stuffed::new(Vec2::splat(10.0), kinds(), bodies, 1.0, vec![]);
        assert!(tile.by_each().is_empty());
    }
    // Two ghosts upon one another are nobody's business here.
    let tile = Stuffed::new(Vec2::splat(10.0), kinds(), vec![body(0, DVec2::ONE); 2], 0.0, vec![]);
    assert!(tile.by_each().is_empty());
}

#[test]
fn a_heap_upon_one_spot_pairs_everybody() {
    let tile = Stuffed::new(Vec2::splat(10.0), vec![circle(0.5)], vec![body(0, DVec2::ONE); 300], 0.5, vec![]);
    let (mut grid, mut quadtree) = (Grid::default(), tile.new_quadtree());
    assert_eq!(tile.by_grid(&mut grid).len(), 150 * 149 / 2 + 150 * 150);
    assert_eq!(tile.by_quadtree(&mut quadtree).len(), 150 * 149 / 2 + 150 * 150);
    // Buffers of a larger search leave no traces in a smaller one.
    let tile = Stuffed::new(Vec2::splat(10.0), vec![circle(0.5)], vec![body(0, DVec2::ONE); 30], 1.0, vec![]);
    assert_eq!(tile.by_grid(&mut grid).len(), 30 * 29 / 2);
    assert_eq!(tile.by_quadtree(&mut quadtree).len(), 30 * 29 / 2);
}

/// Bodies side by side in ten squares far apart, one of which is of larger ones.
#[test]
fn what_bodies_cost_does_not_grow_with_their_distance() {
    let cost = |far: f64| {
        let square = |i: u32| (i / 400, DVec2::new(f64::from(i % 20), f64::from(i % 400 / 20)));
        let bodies = (0..4_000).map(square).map(|(square, place)| {
            let corner = DVec2::new(f64::from(square % 3), -f64::from(square)) * far;
            body((square == 3) as usize, corner + 0.1 * place)
        });
        let tile = Stuffed::new(Vec2::splat(10.0), vec![circle(0.05), circle(0.3)], bodies.collect(), 1.0, vec![]);
        let mut grid = Grid::default();
        let pairs = tile.by_grid(&mut grid);
        assert_eq!(pairs, tile.brute_force());
        (pairs.len(), grid.looks.into_inner())
    };
    let (pairs, looks) = cost(3.0);
    for far in [30.0, 300.0, 3_000.0] {
        let (as_many, looks_there) = cost(far);
        assert_eq!(as_many, pairs);
        assert!(looks_there < 2 * looks, "{far} m apart {looks_there} bodies are looked at, 3 m apart {looks}");
    }
}

/// Small bodies in a corner of a tile that has room for many times as many, some large ones among them.
#[test]
fn what_is_crowded_is_not_taken_for_what_the_tile_has_room_for() {
    let looks = |size: f32| {
        let place = |i: u32| DVec2::new(f64::from(i % 60), f64::from(i / 60)) * 0.1;
        let bodies = (0..3_600).map(|i| body((i % 180 == 77) as usize, place(i)));
        let kinds = vec![circle(0.05), circle(1.0)];
        let tile = Stuffed::new(Vec2::splat(size), kinds, bodies.collect(), 1.0, vec![]);
        let mut grid = Grid::default();
        assert_eq!(tile.by_grid(&mut grid), tile.brute_force());
        grid.looks.into_inner()
    };
    let (close, wide) = (looks(6.0), looks(10_000.0));
    assert!(wide < 2 * close, "{wide} bodies are looked at in a wide tile, {close} where there is no more room");
}

/// A slope is no more of a burden than a floor, though half of the world is in the rectangle around it.
#[test]
fn walls_that_lean_pair_only_with_what_is_near_them() {
    let looks = |angle: f32| {
        let place = |i: u32| DVec2::new(f64::from(i % 60), f64::from(i / 60)) * 0.2;
        let bodies = (0..3_600).map(|i| body(0, place(i)));
        let wall = |k: u32| StaticBody {
            id: GlobalId(u64::from(k)),
            kind: rectangle(12.0, 0.01),
            position: DVec2::splat(6.0 + f64::from(k)),
            rotation: Rot::from_angle(angle),
            path: None,
        };
        let (kinds, walls) = (vec![circle(0.05)], (0..8).map(wall).collect());
        let tile = Stuffed::new(Vec2::splat(12.0), kinds, bodies.collect(), 1.0, walls);
        let (mut grid, mut found) = (Grid::default(), Vec::new());
        grid.find_pairs(tile.field(), &mut found);
        assert_eq!(tile.by_each(), tile.brute_force());
        (grid.looks.into_inner(), found.len())
    };
    let (level, pairs) = looks(0.0);
    for angle in [0.7, 2.0, -0.3] {
        let (leaning, pairs_leaning) = looks(angle);
        assert!(leaning < 2 * level, "{leaning} bodies are looked at by walls at {angle} rad, {level} by floors");
        assert!(pairs_leaning < 3 * pairs, "{pairs_leaning} pairs with walls at {angle} rad, {pairs} with floors");
    }
}

#[test]
fn a_body_larger_than_the_tile_meets_all_within() {
    let kinds = vec![circle(0.05), circle(50.0)];
    let mut bodies: Vec<_> =
        (0..200).map(|i| body(0, DVec2::new(f64::from(i % 20), f64::from(i / 20)) * 0.5)).collect();
    bodies.push(body(1, DVec2::new(-30.0, 5.0)));
    let tile = Stuffed::new(Vec2::splat(10.0), kinds, bodies, 1.0, vec![]);
    let pairs = tile.by_each();
    assert_eq!(pairs, tile.brute_force());
    assert_eq!(pairs.iter().filter(|pair| pair[1] == 200).count(), 200);
}

#[test]
fn a_wall_pairs_only_with_what_is_near_it() {
    let wall = StaticBody {
        id: GlobalId(0),
        position: DVec2::new(15.0, 9.0),
        rotation: Rot::IDENTITY,
        kind: rectangle(1_000.0, 2.0),
        path: None,
    };
    let bodies = (0..400).map(|i| body(0, DVec2::new(f64::from(i % 20), f64::from(i / 20)) * 0.5)).collect();
    let tile = Stuffed::new(Vec2::splat(10.0), vec![circle(0.1)], bodies, 1.0, vec![wall]);
    let pairs = tile.by_each();
    assert_eq!(pairs, tile.brute_force());
    assert_eq!(pairs.iter().filter(|pair| pair[1] == 400).count(), 20, "the lowest row stands upon the wall");
}

#[test]
fn shapes_know_their_distance() {
    // The oracle's own oracle.
    let (square, disc) = (Shape::rectangle(2.0, 2.0), Shape::circle(1.0));
    let gap = |a: &Shape, b: &Shape, offset| distance(a, Rot::IDENTITY, b, Rot::IDENTITY, offset);
    assert_eq!(gap(&square, &square, Vec2::new(3.0, 0.5)), 1.0);
    assert_eq!(gap(&square, &square, Vec2::new(5.0, 6.0)), 5.0);
    assert_eq!(gap(&square, &square, Vec2::new(0.1, 0.1)), 0.0);
    assert_eq!(gap(&square, &disc, Vec2::new(4.0, 5.0)), 4.0);
    assert_eq!(gap(&disc, &disc, Vec2::new(0.0, 3.0)), 1.0);
    let turned =
        distance(&square, Rot::from_angle(std::f32::consts::FRAC_PI_4), &disc, Rot::IDENTITY, Vec2::new(3.0, 0.0));
    assert!((turned - (2.0 - 2.0_f64.sqrt())).abs() < 1e-6);
}
