//! Disjoint sets, joined by all threads at once and without locks (the report's future work).
//!
//! Every node has a parent, itself if it is a root. To join two nodes a thread walks up from both until it comes to one
//! parent, or to a root with a greater number than the parent on the other side; it puts that root under this parent with
//! a compare-and-swap, which fails if another thread has put it under something meanwhile; then it walks on. Walks halve
//! their paths with compare-and-swaps that may fail (plain stores were measured to be no faster). Sources: R. Anderson and
//! H. Woll, "Wait-free parallel algorithms for the union-find problem", 1991; S. Jayanti and R. Tarjan, "A randomized
//! concurrent algorithm for disjoint set union", 2016. They link at random or by rank, for the sake of the worst case;
//! here the index decides, for the sake of the result.
//!
//! # Why the result does not depend on who comes first
//!
//! A node's parent only ever gets lower: a root's goes from itself to a lesser node, any other's to a parent of its
//! parent. So there are no cycles, and a tree's only root is its lowest node. It remains that the trees at the end are the
//! islands. A tree holds no two islands, since only linked nodes are joined and halving stays within a tree.
//!
//! For the other half, *everything that was ever the parent of `i` ends up in the tree of `i`*, by induction on `i`: the
//! parents of `i` are, one after the other, `i` itself and some p, q, ..., z. Each of them after p came from halving, so
//! it was once the parent of the one before it, which is less than `i`; hence they all end up in one tree. That of z is
//! that of `i`, since z stays. A thread is done with a link when it has walked from both its ends to one node, or has put
//! what it came to from one end under what it came to from the other; it saw only parents, each once the parent of the one
//! before, and so both ends end up in one tree.
//!
//! # Why `Relaxed` is enough
//!
//! The argument looks at the sequence of values of each parent by itself and never at the order of stores to two of
//! them, so it holds for old values too. It needs three things: that stores to one parent have one order and that a
//! thread never sees it run backwards, which every atomic has; and that a root is put under another only if it still is
//! a root, which a compare-and-swap decides on the last value in that order. One that fails has seen a later value, so
//! that the thread's next walk gets further: links end. No other memory is handed over while links are joined. Between
//! the passes (fresh parents, joining, roots, sizes) stands the end of a rayon call, which makes everything done before it
//! visible to what comes after.

use super::IslandSizes;
use crate::parallel::team::Team;
use rayon::prelude::*;
use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;

/// Links or nodes that are worth waking another thread for: some ten microseconds of work.
pub(super) const GRAIN: usize = 4096;

/// Whether there is work for a second thread.
pub(super) fn pays(nodes: usize, links: &[[u32; 2]], team: Team) -> bool {
    team.pieces(nodes.max(links.len()), GRAIN) > 1
}

/// Buffers of the search.
#[derive(Default, Debug)]
pub(super) struct ParallelUnionFind {
    parents: Vec<AtomicU32>,
    /// For each root how many nodes of its own range it has.
    near: Vec<u32>,
    /// For each root how many nodes of other ranges.
    far: Vec<AtomicU32>,
}

impl ParallelUnionFind {
    /// Writes each node's lowest one of its island to `roots`. Work is cut no finer than `grain`.
    pub(super) fn find(
        &mut self,
        nodes: usize,
        links: &[[u32; 2]],
        team: Team,
        grain: usize,
        roots: &mut Vec<u32>,
    ) -> IslandSizes {
        for buffer in [&mut self.parents, &mut self.far] {
            // Never shorter: what is left over from a larger graph is not looked at.
            if buffer.len() < nodes {
                buffer.resize_with(nodes, AtomicU32::default);
            }
        }
        let (parents, far) = (&self.parents[..nodes], &self.far[..nodes]);
        self.near.resize(nodes, 0);
        roots.resize(nodes, 0);

        team.map(nodes, grain, |range| {
            for node in range {
                parents[node].store(node as u32, Relaxed);
                far[node].store(0, Relaxed);
            }
        });
        team.map(links.len(), grain, |range| links[range].iter().for_each(|&[a, b]| join(parents, a, b)));

        let length = nodes.div_ceil(team.pieces(nodes, grain)).max(1);
        let islands = AtomicU32::new(0);
        let pieces = roots.par_chunks_mut(length).zip(self.near.par_chunks_mut(length)).enumerate().with_max_len(1);
        pieces.for_each(|(piece, (roots, near))| {
            islands.fetch_add(flatten(parents, far, piece * length, roots, near), Relaxed);
        });

        let largest = AtomicU32::new(0);
        let near = &self.near;
        team.map(nodes, grain, |range| {
            let sizes = near[range.clone()].iter().zip(&far[range]);
            largest.fetch_max(sizes.map(|(near, far)| near + far.load(Relaxed)).max().unwrap_or(0), Relaxed);
        });
        IslandSizes { islands: islands.into_inner().into(), largest: largest.into_inner().into() }
    }
}

/// Joins the sets of two nodes. It walks up from both, always on the side whose parent is greater, and so meets where
/// the paths do, often below the root.
#[inline]
fn join(parents: &[AtomicU32], mut a: u32, mut b: u32) {
    let [mut above_a, mut above_b] = [a, b].map(|node| parents[node as usize].load(Relaxed));
    while above_a != above_b {
        if above_a < above_b {
            (a, above_a, b, above_b) = (b, above_b, a, above_a);
        }
        if a == above_a {
            match parents[a as usize].compare_exchange(a, above_b, Relaxed, Relaxed) {
                Ok(_) => return,
                Err(now) => above_a = now,
            }
        } else {
            (a, above_a) = halve(parents, a, above_a);
        }
    }
}

/// One step up from `node`, on whose parent it puts the parent's parent. Returns the parent, and the parent's parent.
#[inline]
fn halve(parents: &[AtomicU32], node: u32, parent: u32) -> (u32, u32) {
    let above = parents[parent as usize].load(Relaxed);
    if above != parent {
        // If it fails, another thread has made the path shorter.
        let _ = parents[node as usize].compare_exchange_weak(parent, above, Relaxed, Relaxed);
    }
    (parent, above)
}

/// The root above `node`, once all links are joined.
fn root_of(parents: &[AtomicU32], mut node: u32) -> u32 {
    let mut parent = parents[node as usize].load(Relaxed);
    while parent != node {
        (node, parent) = halve(parents, node, parent);
    }
    node
}

/// The roots of a range of nodes that starts at `start`, once all links are joined, and how many nodes of the range each
/// has: in `near` for roots within the range, added to `far` for others. Returns how many roots are within.
fn flatten(parents: &[AtomicU32], far: &[AtomicU32], start: usize, roots: &mut [u32], near: &mut [u32]) -> u32 {
    let mut islands = 0;
    // Neighbouring nodes are often of one island: theirs are added at once.
    let (mut last, mut count) = (0, 0);
    for i in 0..roots.len() {
        let node = (start + i) as u32;
        let parent = parents[start + i].load(Relaxed);
        near[i] = 0;
        let root = if parent == node {
            islands += 1;
            node
        } else if parent as usize >= start {
            // Lower, and so known by now.
            roots[parent as usize - start]
        } else {
            root_of(parents, parent)
        };
        roots[i] = root;
        if root as usize >= start {
            near[root as usize - start] += 1;
        } else if root == last {
            count += 1;
        } else {
            far[last as usize].fetch_add(count, Relaxed);
            (last, count) = (root, 1);
        }
    }
    if count > 0 {
        far[last as usize].fetch_add(count, Relaxed);
    }
    islands
}
