//! A quadtree of fat AABBs that lives from step to step: the report's broad phase.
//!
//! A body's box is stored in the smallest square that wholly contains it, grown so that the body stays within for some
//! steps. A step begins with the flush: bodies that left their fat AABBs are put into the tree anew, one after another.
//! Then every owned body asks the tree who is near; the tree is only read, so many threads may ask at once.
//!
//! Boxes that straddle the cut of a large square stay near the top, and all queries on the way down are tested against
//! them. Their number grows with the length of the cut: cost per body grows as the square root of the bodies in a tile.
//! The [grid](super::grid) has no such growth.
//!
//! The structure is the region quadtree: R. A. Finkel, J. L. Bentley, "Quad trees: a data structure for retrieval on
//! composite keys" (1974), in the form for boxes that G. Kedem named quad-CIF tree (1982).

mod roster;
#[cfg(test)]
mod tests;
mod tree;

use super::Pair;
use crate::collide::proxies::Proxies;
use crate::model::id::GlobalId;
use crate::parallel::team::Team;
use roster::Roster;
use tree::{Aabb, Tree};

/// By how much a fat AABB is larger than the body's own on each side, in meters. More saves work in the flush and makes
/// it in the queries. Measured on the scene `rooms`, where most bodies go further than this in a step: queries take a
/// sixth longer with twice as much, and the flush is hardly faster.
const FAT: f32 = 0.1;

/// Room for the rounding of a box's sides, as part of its half extents. What follows from the coordinates is covered by
/// [`Proxies::slack`].
const ROUNDING: f32 = 1.0 + 1e-5;

/// Queries that one thread makes in a row, at least.
const GRAIN: usize = 256;

/// The quadtree of one tile.
#[derive(Debug)]
pub(crate) struct Quadtree {
    /// Owners are indices of bodies.
    tree: Tree,
    roster: Roster,
}

impl Quadtree {
    /// An empty tree for a tile of the given width and height in meters. Bodies outside are counted as if in the
    /// outermost squares.
    pub(crate) fn new(size: [f32; 2]) -> Self {
        Self { tree: Tree::new(size), roster: Roster::default() }
    }

    /// Brings the tree up to date with a tile's bodies, `names` being theirs.
    pub(crate) fn flush(&mut self, proxies: &Proxies, names: &[GlobalId]) {
        if self.roster.follow(names, [proxies.owned, proxies.dynamic, names.len()]) {
            self.tree.rename(&self.roster.from, &self.roster.gone);
        }
        for body in 0..proxies.len() as u32 {
            let aabb = grown(proxies, body, 0.0);
            if !self.tree.get(body).is_some_and(|fat| fat.contains(&aabb)) {
                let more = if (body as usize) < proxies.dynamic { FAT } else { 0.0 };
                self.tree.put(body, &grown(proxies, body, more));
            }
        }
    }

    /// Appends every pair, and some that are none (see the contract in [`super`]). The tree must be up to date.
    pub(crate) fn find_pairs(&self, proxies: &Proxies, team: Team, pairs: &mut Vec<Pair>) {
        team.append(pairs, proxies.pairing, GRAIN, |bodies, pairs| self.query(proxies, bodies, pairs));
    }

    /// Pairs of some bodies with those that come after them.
    fn query(&self, proxies: &Proxies, bodies: std::ops::Range<usize>, pairs: &mut Vec<Pair>) {
        for body in bodies.start as u32..bodies.end as u32 {
            self.tree.query(&grown(proxies, body, 0.0), |other| {
                if other > body && proxies.overlap([body, other]) {
                    pairs.push([body, other]);
                }
            });
        }
    }

    /// Refuses a tree that is not as it should be.
    #[cfg(test)]
    pub(super) fn check(&self) {
        self.tree.check();
    }
}

/// A body's AABB with room for rounding and `more` on each side, in meters.
#[inline(always)]
fn grown(proxies: &Proxies, body: u32, more: f32) -> Aabb {
    let i = body as usize;
    let room = proxies.slack(i) + more;
    let [x, y] = proxies.half(i).map(|half| half * ROUNDING + room);
    Aabb { low: [proxies.x[i] - x, proxies.y[i] - y], high: [proxies.x[i] + x, proxies.y[i] + y] }
}
