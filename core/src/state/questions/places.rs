//! Who is where: bodies and statics by place, found as they are asked for.

use super::RayHit;
use super::outline::Outline;
use super::tree::{Bounds, Tree};
use crate::model::body::Body;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use crate::world::World;
use glam::DVec2;
use rayon::prelude::*;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// What is known of where all are, until they are elsewhere.
#[derive(Default, Debug)]
pub(crate) struct Places {
    /// One for each tile, as soon as anybody asked.
    tiles: OnceLock<Box<[TilePlaces]>>,
    /// The tiles, by where their bodies are.
    around: OnceLock<Tree>,
    /// Rows of statics that move.
    going: OnceLock<Tree>,
    /// Rows of statics that stay where they are.
    staying: OnceLock<Tree>,
}

/// Where the bodies of a tile are.
#[derive(Default, Debug)]
struct TilePlaces {
    /// Around all of them.
    bounds: OnceLock<Bounds>,
    /// How many questions came near.
    asked: AtomicU32,
    /// Them, by their places in the tile, once there were too many questions to look at all of them for each.
    bodies: OnceLock<Tree>,
}

/// Sorting the bodies of a tile takes as long as looking at all of them for about so many questions.
const FEW: u32 = 6;

impl Places {
    /// All may be elsewhere, and of other tiles.
    pub(crate) fn forget(&mut self) {
        *self = Self { staying: std::mem::take(&mut self.staying), ..Self::default() };
    }

    /// Bodies of one tile came, left or are of other kinds; those of others are where they were.
    pub(crate) fn forget_tile(&mut self, tile: usize) {
        if let Some(tiles) = self.tiles.get_mut() {
            tiles[tile] = TilePlaces::default();
            self.around.take();
        }
    }
}

/// A rectangle around a body, a little larger than it need be, so that rounding leaves nothing out.
pub(super) fn bounds(body: &Body, setup: &Setup) -> Bounds {
    let half = setup.kind(body.kind).half_extents(body.rotation).as_dvec2();
    let half = half * (1.0 + 1e-6) + body.position.abs() * 1e-14;
    Bounds { low: body.position - half, high: body.position + half }
}

impl World {
    /// Visits the bodies whose rectangles meet another, and maybe a few more.
    pub(super) fn visit_bodies(&self, bounds: Bounds, mut visitor: impl FnMut(&Body)) {
        self.around().visit(bounds, |number| {
            let tile = &self.tile_states()[number as usize];
            match self.sorted(number) {
                Some(bodies) => bodies.visit(bounds, |at| visitor(&tile.at(at))),
                None => {
                    let is_near = |body: &Body| self::bounds(body, &self.setup).meets(bounds);
                    tile.present().filter(|(_, body)| is_near(body)).for_each(|(_, body)| visitor(&body));
                }
            }
        });
    }

    /// The same of statics.
    pub(super) fn visit_statics(&self, bounds: Bounds, mut visitor: impl FnMut(&Body)) {
        for rows in self.statics() {
            rows.visit(bounds, |row| visitor(&self.setup.static_at(row, self.step)));
        }
    }

    /// What a ray meets first of those that count.
    pub(super) fn first_hit(&self, ray: (DVec2, DVec2), counts: impl Fn(&Body) -> bool) -> Option<RayHit> {
        let mut best = None;
        let ask = |body: &Body, best: &mut Option<RayHit>| {
            let hit = self.outline(body).cast_ray(ray.0, ray.1);
            if let Some(hit) = hit.filter(|_| counts(body)) {
                *best = Some(best.map_or(hit, |best| best.nearer(hit)));
            }
        };
        for rows in self.statics() {
            rows.cast_ray(ray, &mut best, |row, best| ask(&self.setup.static_at(row, self.step), best));
        }
        let is_near = self.near_ray(ray);
        self.around().cast_ray(ray, &mut best, |number, best| {
            let tile = &self.tile_states()[number as usize];
            match self.sorted(number) {
                Some(bodies) => bodies.cast_ray(ray, best, |at, best| ask(&tile.at(at), best)),
                None => tile.present().filter(|(_, body)| is_near(body)).for_each(|(_, body)| ask(&body, best)),
            }
        });
        best
    }

    /// Tells of a body whether its bounding circle comes to a ray, and maybe of a few more.
    fn near_ray(&self, (from, to): (DVec2, DVec2)) -> impl Fn(&Body) -> bool {
        let way = to - from;
        let per_length = 1.0 / way.length_squared().max(f64::MIN_POSITIVE);
        move |body| {
            let nearest = from + way * ((body.position - from).dot(way) * per_length).clamp(0.0, 1.0);
            let radius = f64::from(self.setup.kind(body.kind).bounding_radius) * (1.0 + 1e-6);
            let radius = radius + 1e-14 * body.position.abs().max_element();
            let square = (nearest - body.position).length_squared();
            // Where numbers overflow everybody is.
            square <= radius * radius || square.is_nan()
        }
    }

    pub(super) fn outline(&self, body: &Body) -> Outline<'_> {
        Outline::new(body, self.setup.kind(body.kind))
    }

    /// The tiles, by where their bodies are.
    fn around(&self) -> &Tree {
        if let Some(around) = self.places.around.get() {
            return around;
        }
        let around = |tile: &Tile| {
            let each = tile.present().map(|(_, body)| bounds(&body, &self.setup));
            each.fold(Bounds::NONE, Bounds::join)
        };
        // By all threads, and not while others may wait for what comes of it: one that asks itself would wait for itself.
        let known = self.tile_places().par_iter().zip(self.tile_states()).zip(0..self.tile_states().len() as u32);
        let all = known.map(|((places, tile), number)| (number, *places.bounds.get_or_init(|| around(tile))));
        let used: Vec<(u32, Bounds)> = all.filter(|(_, bounds)| bounds.low.x <= bounds.high.x).collect();
        self.places.around.get_or_init(|| Tree::new(&used))
    }

    /// The bodies of a tile, by their places in it, if there are many questions.
    fn sorted(&self, number: u32) -> Option<&Tree> {
        let places = &self.tile_places()[number as usize];
        let sort = || {
            let tile = &self.tile_states()[number as usize];
            let mut all = Vec::with_capacity(tile.count());
            tile.present().for_each(|(at, body)| all.push((at, bounds(&body, &self.setup))));
            Tree::new(&all)
        };
        (places.asked.fetch_add(1, Relaxed) >= FEW).then(|| places.bodies.get_or_init(sort))
    }

    fn tile_places(&self) -> &[TilePlaces] {
        self.places.tiles.get_or_init(|| self.tile_states().iter().map(|_| TilePlaces::default()).collect())
    }

    /// Those that stay where they are, and those that move.
    fn statics(&self) -> [&Tree; 2] {
        let (setup, places) = (&self.setup, &self.places);
        let row = |row| (row, bounds(&setup.static_at(row, self.step), setup));
        let staying = || Tree::new(&setup.rows_that_stay().map(row).collect::<Vec<_>>());
        let going = || Tree::new(&setup.rows_that_go().map(row).collect::<Vec<_>>());
        [places.staying.get_or_init(staying), places.going.get_or_init(going)]
    }
}
