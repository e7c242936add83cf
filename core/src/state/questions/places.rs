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
    /// Them, by their places in the tile, once a question came near.
    bodies: OnceLock<Tree>,
}

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
        self.around().visit(bounds, |tile| {
            self.places_in(tile).visit(bounds, |at| visitor(&self.tile_states()[tile as usize].at(at)));
        });
    }

    /// The same of statics.
    pub(super) fn visit_statics(&self, bounds: Bounds, mut visitor: impl FnMut(&Body)) {
        for rows in self.statics() {
            rows.visit(bounds, |row| visitor(&self.setup.static_at(row, self.step)));
        }
    }

    /// What a ray meets first.
    pub(super) fn first_hit(&self, ray: (DVec2, DVec2)) -> Option<RayHit> {
        let mut best = None;
        let ask = |body: &Body, best: &mut Option<RayHit>| {
            if let Some(hit) = self.outline(body).cast_ray(ray.0, ray.1) {
                *best = Some(best.map_or(hit, |best| best.nearer(hit)));
            }
        };
        for rows in self.statics() {
            rows.cast_ray(ray, &mut best, |row, best| ask(&self.setup.static_at(row, self.step), best));
        }
        self.around().cast_ray(ray, &mut best, |tile, best| {
            self.places_in(tile).cast_ray(ray, best, |at, best| ask(&self.tile_states()[tile as usize].at(at), best));
        });
        best
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

    /// The bodies of a tile, by their places in it.
    fn places_in(&self, tile: u32) -> &Tree {
        self.tile_places()[tile as usize].bodies.get_or_init(|| {
            let tile = &self.tile_states()[tile as usize];
            let mut all = Vec::with_capacity(tile.count());
            tile.present().for_each(|(at, body)| all.push((at, bounds(&body, &self.setup))));
            Tree::new(&all)
        })
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
