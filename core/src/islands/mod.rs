//! Islands: bodies connected through contacts. Statics connect nothing.
//!
//! Three searches, each with its own costs and one result: an island is known by its lowest body, which is a function of
//! the contacts alone, whatever their order and however many threads look.
//!
//! | search | how | file |
//! |---|---|---|
//! | union-find | disjoint sets, joined contact by contact | `union_find.rs` |
//! | depth-first | a walk over each body's contacts | `depth_first.rs`, `adjacency.rs` |
//! | parallel union-find | disjoint sets, joined by all threads at once | `parallel.rs` |

mod adjacency;
mod depth_first;
mod parallel;
pub(crate) mod sleep;
#[cfg(test)]
mod tests;
pub(crate) mod union_find;

use crate::model::params::IslandSearch;
use crate::parallel::team::Team;
use depth_first::DepthFirst;
use parallel::ParallelUnionFind;
use union_find::UnionFind;

/// How many islands there are, and how many bodies the largest holds.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct IslandSizes {
    /// Sets of nodes connected through links; a node without links is one by itself.
    pub islands: u64,
    /// Nodes in the largest.
    pub largest: u64,
}

/// Buffers to find islands with; afterwards, who is in which. Used again, they allocate nothing that grows with the
/// graph.
#[derive(Default, Debug)]
pub struct Islands {
    roots: Vec<u32>,
    union_find: UnionFind,
    depth_first: DepthFirst,
    parallel: ParallelUnionFind,
}

impl Islands {
    /// Finds the islands among the nodes `0..nodes`, at most 2^31 of them, joined by links between two nodes each. Every
    /// node counts, also one without links; links may be doubled or lead back to where they start.
    ///
    /// # Panics
    /// If a link leads to no node.
    pub(crate) fn find(&mut self, search: IslandSearch, nodes: usize, links: &[[u32; 2]], team: Team) -> IslandSizes {
        let roots = &mut self.roots;
        match search {
            IslandSearch::Dfs => self.depth_first.find(nodes, links, roots),
            // Where there is work for one thread only, atomics would buy nothing.
            IslandSearch::ParallelUnionFind if parallel::pays(nodes, links, team) => {
                self.parallel.find(nodes, links, team, parallel::GRAIN, roots)
            }
            IslandSearch::UnionFind | IslandSearch::ParallelUnionFind => self.union_find.find(nodes, links, roots),
        }
    }

    /// As a step does: finds the islands among the nodes `0..nodes`, at most 2^31 of them, joined by links between two
    /// nodes each. [`IslandSearch::ParallelUnionFind`] may use all threads of the rayon pool it is called in.
    ///
    /// # Panics
    /// If a link leads to no node.
    pub fn find_in_pool(&mut self, search: IslandSearch, nodes: usize, links: &[[u32; 2]]) -> IslandSizes {
        self.find(search, nodes, links, Team::of_pool())
    }

    /// For each node of the last search, the lowest node of its island.
    pub fn roots(&self) -> &[u32] {
        &self.roots
    }
}
