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
use crate::model::id::{GlobalId, KindId};
use crate::state::view::{ContactView, TileView};
use crate::world::World;
use glam::DVec2;
use outline::Outline;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};
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

/// What questions to a world are answered by.
#[derive(Default, Debug)]
pub(crate) struct Questions {
    /// How many there were since the bodies were otherwise.
    asked: AtomicU32,
    /// Bodies and statics that move, as they are now, once there were too many questions to look at all of them for each.
    moving: OnceLock<Tree>,
    /// Statics that stay where they are.
    fixed: OnceLock<Tree>,
}

/// Sorting bodies by place takes as long as looking at all of them for about so many questions.
const FEW: u32 = 16;

impl Questions {
    /// Bodies are otherwise than they were.
    pub(crate) fn forget(&mut self) {
        self.moving.take();
        self.asked = AtomicU32::new(0);
    }
}

impl World {
    /// The first body or static on the straight way from one point to another, in m; none if one of these is not finite. One around the
    /// first point is met at once.
    ///
    /// The first questions after a step, or after something changed, look at each body. Where there are more, these are sorted by
    /// place; each one after that takes time that grows with the logarithm of their number, and with how much lies near the way.
    pub fn cast_ray(&self, from: DVec2, to: DVec2) -> Option<RayHit> {
        let mut best = None;
        if !(from.is_finite() && (to - from).is_finite()) {
            return best;
        }
        self.fixed().cast_ray(from, to, &mut best);
        match self.sorted() {
            Some(tree) => tree.cast_ray(from, to, &mut best),
            None => {
                let way = to - from;
                let per_length = 1.0 / way.length_squared().max(f64::MIN_POSITIVE);
                let nearest = |place: DVec2| from + way * ((place - from).dot(way) * per_length).clamp(0.0, 1.0);
                let hits = self.near(nearest).filter_map(|outline| outline.cast_ray(from, to));
                best = hits.chain(best).reduce(RayHit::nearer);
            }
        }
        best
    }

    /// The bodies and statics that have a point in common with a rectangle between two corners, in m: their names, ascending.
    pub fn in_rectangle(&self, low: DVec2, high: DVec2) -> Vec<GlobalId> {
        self.found(Bounds { low, high }, |outline| outline.meets_rectangle(low, high))
    }

    /// The bodies and statics that a point in m is in, or on: their names, ascending.
    pub fn at_point(&self, point: DVec2) -> Vec<GlobalId> {
        self.found(Bounds { low: point, high: point }, |outline| outline.holds(point))
    }

    fn found(&self, bounds: Bounds, is_meant: impl Fn(&Outline) -> bool) -> Vec<GlobalId> {
        let mut found = Vec::new();
        let mut look = |outline: &Outline| {
            if is_meant(outline) {
                found.push(outline.id);
            }
        };
        self.fixed().visit(bounds, &mut look);
        self.visit_moving(bounds, look);
        found.sort_unstable();
        found
    }

    /// The contacts that the last step solved of a body of this world, or of a static with this world's bodies, by the name of the
    /// other. Two touch as long as their surfaces are nearer than
    /// [`speculative_distance`](crate::Params::speculative_distance), or may come so near within the step.
    pub fn touching(&self, id: GlobalId) -> Vec<ContactView> {
        let mut found: Vec<ContactView> = match self.owned(id) {
            Some((tile, place)) => TileView::new(tile).contacts_of(|other| other == place).collect(),
            None if self.is_static(id) => {
                let is_of = |contact: &ContactView| contact.bodies.contains(&id);
                self.views().flat_map(|tile| tile.contacts().filter(is_of)).collect()
            }
            None => Vec::new(),
        };
        // Contacts of one pair stay in their order.
        found.sort_by_key(|contact| contact.bodies);
        found
    }

    /// Statics that stay where they are, by place.
    fn fixed(&self) -> &Tree {
        self.questions.fixed.get_or_init(|| {
            let fixed = self.setup.statics_that_stay();
            Tree::new(fixed.map(|body| self.outline(body)).collect())
        })
    }

    /// Bodies, and statics that move.
    fn moving(&self) -> impl Iterator<Item = Body> + '_ {
        self.bodies().chain(self.setup.statics_that_go(self.step))
    }

    /// Visits those of them whose rectangles meet another, and maybe a few more.
    fn visit_moving(&self, bounds: Bounds, mut visitor: impl FnMut(&Outline)) {
        match self.sorted() {
            Some(tree) => tree.visit(bounds, visitor),
            None => self.near(|place| place.max(bounds.low).min(bounds.high)).for_each(|outline| visitor(&outline)),
        }
    }

    /// These by place, if there are many questions.
    fn sorted(&self) -> Option<&Tree> {
        let Questions { asked, moving, .. } = &self.questions;
        let sort = || moving.get_or_init(|| Tree::new(self.moving().map(|body| self.outline(body)).collect()));
        (asked.fetch_add(1, Relaxed) >= FEW).then(sort)
    }

    /// Those of them whose bounding circle comes to the point that is `nearest` to its center, and maybe a few more.
    fn near(&self, nearest: impl Fn(DVec2) -> DVec2) -> impl Iterator<Item = Outline> {
        let is_near = move |place: DVec2, kind: KindId| {
            let radius =
                f64::from(self.setup.kind(kind).bounding_radius) * (1.0 + 1e-6) + 1e-14 * place.abs().max_element();
            let square = (nearest(place) - place).length_squared();
            // Where numbers overflow everybody is.
            square <= radius * radius || square.is_nan()
        };
        let moving = self.moving().filter(move |body| is_near(body.position, body.kind));
        moving.map(|body| self.outline(body))
    }

    fn outline(&self, body: Body) -> Outline {
        Outline::new(&body, self.setup.kind(body.kind))
    }
}
