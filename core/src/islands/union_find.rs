//! Disjoint sets, joined link by link.
//!
//! Union by index with path halving: of two roots the greater goes under the lesser, so the root of a set is its lowest
//! number. Source: R. Tarjan and J. van Leeuwen, "Worst-case analysis of set union algorithms", 1984.

use super::IslandSizes;

/// Buffers of the search.
#[derive(Default, Debug)]
pub(super) struct UnionFind {
    size: Vec<u32>,
}

impl UnionFind {
    /// Writes each node's lowest one of its island to `roots`.
    pub(super) fn find(&mut self, nodes: usize, links: &[[u32; 2]], roots: &mut Vec<u32>) -> IslandSizes {
        // As long as sets are joined, these are the parents.
        roots.clear();
        roots.extend(0..nodes as u32);
        links.iter().for_each(|&link| join(roots, link));

        self.size.clear();
        self.size.resize(nodes, 0);
        let mut sizes = IslandSizes::default();
        for node in 0..nodes {
            // A parent is lower than its child, and so knows its root by now.
            let root = roots[roots[node] as usize];
            roots[node] = root;
            sizes.islands += u64::from(root == node as u32);
            let size = &mut self.size[root as usize];
            *size += 1;
            sizes.largest = sizes.largest.max(u64::from(*size));
        }
        sizes
    }
}

/// Joins the sets of two numbers.
#[inline]
pub(crate) fn join(parents: &mut [u32], link: [u32; 2]) {
    let [a, b] = link.map(|number| root_of(parents, number));
    parents[a.max(b) as usize] = a.min(b);
}

/// The lowest number in the set of `i`.
#[inline]
pub(crate) fn root_of(parents: &mut [u32], mut i: u32) -> u32 {
    loop {
        let parent = parents[i as usize];
        if parent == i {
            return i;
        }
        let above = parents[parent as usize];
        parents[i as usize] = above;
        i = above;
    }
}
