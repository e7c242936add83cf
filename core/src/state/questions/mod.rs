//! Questions to a world between two steps: what a ray meets first, what is in a rectangle or at a point, what touches what.
//!
//! Each rank answers for its own bodies, and for all statics: answers of all ranks are joined, and are those of one rank that holds
//! everything, to the last bit.

mod outline;
mod pairs;
mod pieces;
mod places;
mod sensors;
#[cfg(test)]
mod tests;
mod tree;

use crate::model::body::Body;
use crate::model::id::GlobalId;
use crate::state::view::{ContactView, TileView};
use crate::world::World;
use glam::DVec2;
use outline::Outline;
pub use pairs::pairs_not_in;
pub(crate) use places::Places;
use tree::Bounds;

/// Nobody is so far out, in m, and the square of it is still a number.
const FAR: f64 = 1e150;

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

impl World {
    /// The first body or static on the straight way from one point to another, in m; none if one of these, or how far it is between them,
    /// is not finite. One around the first point is met at once.
    ///
    /// The first question after a step takes the time of looking at where each body is, and the first few that come near a tile that of
    /// looking at each of its bodies. Where there are more, these are sorted by place; each one after that takes time that grows with the
    /// logarithm of their number, and with how much lies near the way. After bodies came or went it is so again, of the tiles where they
    /// did, and the tiles are looked at as well: do first what is to be done, and ask then.
    pub fn cast_ray(&self, from: DVec2, to: DVec2) -> Option<RayHit> {
        self.cast_ray_among(from, to, |_| true)
    }

    /// The same among those bodies and statics of which `counts` says so: to look past whom the ray belongs to, or past sensors, which are
    /// met as all others are. It is asked of those that the ray meets, and of whom else it is does not matter.
    pub fn cast_ray_among(&self, from: DVec2, to: DVec2, counts: impl Fn(&Body) -> bool) -> Option<RayHit> {
        let way = to - from;
        if !(from.is_finite() && way.is_finite()) {
            return None;
        }
        let length = way.abs().max_element();
        if length <= FAR {
            return self.first_hit((from, to), counts);
        }
        let part = FAR / length;
        let hit = self.first_hit((from, from + way * part), counts)?;
        Some(RayHit { fraction: hit.fraction * part, ..hit })
    }

    /// The bodies and statics that have a point in common with a rectangle between its lower left and its upper right corner, in m, which
    /// may be infinite: their names, ascending; none where these are not such corners. Sensors count.
    pub fn in_rectangle(&self, low: DVec2, high: DVec2) -> Vec<GlobalId> {
        if !low.cmple(high).all() {
            return Vec::new();
        }
        let [low, high] = [low, high].map(|corner| corner.clamp(DVec2::splat(-FAR), DVec2::splat(FAR)));
        self.found(Bounds { low, high }, |outline| outline.meets_rectangle(low, high))
    }

    /// The bodies and statics that a point in m is in, or on: their names, ascending. Sensors count.
    pub fn at_point(&self, point: DVec2) -> Vec<GlobalId> {
        self.found(Bounds { low: point, high: point }, |outline| outline.holds(point))
    }

    fn found(&self, bounds: Bounds, is_meant: impl Fn(&Outline) -> bool) -> Vec<GlobalId> {
        let mut found = Vec::new();
        let mut look = |body: &Body| {
            if is_meant(&self.outline(body)) {
                found.push(body.id);
            }
        };
        self.visit_statics(bounds, &mut look);
        self.visit_bodies(bounds, look);
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
                let tiles = self.tile_states().iter();
                let places = tiles.filter_map(|tile| Some((tile, tile.place_of_static(id)?)));
                places.flat_map(|(tile, place)| TileView::new(tile).contacts_of(move |other| other == place)).collect()
            }
            None => Vec::new(),
        };
        // Who was removed since then touches nobody, though he is in the tiles until that is settled, or longer where he is a ghost.
        found.retain(|contact| !contact.bodies.iter().any(|&body| self.was_removed(body)));
        // Contacts of one pair stay in their order.
        found.sort_by_key(|contact| contact.bodies);
        found
    }
}
