//! Questions to a world between two steps: what a ray meets first, what is in a rectangle or at a point, what touches a body.
//!
//! Each rank answers for its own bodies, and for all statics: answers of all ranks are joined, and are those of one rank that holds
//! everything, to the last bit.

mod outline;
mod pieces;
mod sensors;
#[cfg(test)]
mod tests;
mod tree;

use crate::model::body::Body;
use crate::model::id::GlobalId;
use crate::state::view::{ContactView, TileView};
use crate::tiling::blueprint::Setup;
use crate::world::World;
use glam::DVec2;
use outline::Outline;
use tree::{Bounds, Tree};

/// What a ray meets.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RayHit {
    /// The body, or the static.
    pub id: GlobalId,
    /// How much of the way it is until there, 0 to 1.
    pub fraction: f64,
    /// Where, in m.
    pub point: DVec2,
    /// Of the surface, outward, of length one; zero where the ray begins inside.
    pub normal: DVec2,
}

impl RayHit {
    /// Which of two hits of one ray comes first; of two at one place, that of the lower name.
    #[must_use]
    pub fn nearer(self, other: Self) -> Self {
        let key = |hit: &Self| (hit.fraction, hit.id);
        if key(&other) < key(&self) { other } else { self }
    }
}

/// Bodies and statics by place, as they are now.
#[derive(Debug)]
pub(crate) struct Index {
    bodies: Tree,
    statics: Tree,
}

impl Index {
    fn new(bodies: impl Iterator<Item = Body>, setup: &Setup, step: u64) -> Self {
        let outline = |body: Body| Outline::new(&body, setup.kind(body.kind));
        let statics = setup.statics_at(step).map(outline).collect();
        Self { bodies: Tree::new(bodies.map(outline).collect()), statics: Tree::new(statics) }
    }

    fn found(&self, bounds: Bounds, is_meant: impl Fn(&Outline) -> bool) -> Vec<GlobalId> {
        let mut found = Vec::new();
        for tree in [&self.bodies, &self.statics] {
            tree.visit(bounds, |outline| {
                if is_meant(outline) {
                    found.push(outline.id);
                }
            });
        }
        found.sort_unstable();
        found
    }
}

impl World {
    /// The first body or static on the straight way from one point to another, in m. One around the first point is met at once.
    ///
    /// The first question after a step, or after something changed, sorts all bodies by place; each one after it takes time that
    /// grows with the logarithm of their number, and with how much lies near the way.
    pub fn cast_ray(&self, from: DVec2, to: DVec2) -> Option<RayHit> {
        let index = self.index();
        let mut best = None;
        index.statics.cast_ray(from, to, &mut best);
        index.bodies.cast_ray(from, to, &mut best);
        best
    }

    /// The bodies and statics that have a point in common with a rectangle between two corners, in m: their names, ascending.
    pub fn in_rectangle(&self, low: DVec2, high: DVec2) -> Vec<GlobalId> {
        self.index().found(Bounds { low, high }, |outline| outline.meets_rectangle(low, high))
    }

    /// The bodies and statics that a point in m is in, or on: their names, ascending.
    pub fn at_point(&self, point: DVec2) -> Vec<GlobalId> {
        self.index().found(Bounds { low: point, high: point }, |outline| outline.holds(point))
    }

    /// The contacts that the last step solved of a body of this world, or of a static with this world's bodies, by the name of the
    /// other. Two touch as long as their surfaces are nearer than
    /// [`speculative_distance`](crate::Params::speculative_distance), or may come so near within the step.
    pub fn touching(&self, id: GlobalId) -> Vec<ContactView> {
        let is_of = |contact: &ContactView| contact.bodies.contains(&id);
        let mut found: Vec<ContactView> = match self.tile_of(id) {
            Some(tile) => TileView::new(tile).contacts().filter(is_of).collect(),
            None if self.is_static(id) => self.views().flat_map(|tile| tile.contacts().filter(is_of)).collect(),
            None => Vec::new(),
        };
        // Contacts of one pair stay in their order.
        found.sort_by_key(|contact| contact.bodies);
        found
    }

    fn index(&self) -> &Index {
        self.questions(|| Index::new(self.bodies(), &self.setup, self.step))
    }
}
