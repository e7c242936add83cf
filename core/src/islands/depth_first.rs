//! Depth-first search over each body's neighbours (the report's).
//!
//! Walks start at the nodes in ascending order, so the first node of an island is its lowest. A node is marked when it
//! is put on the stack, not when it is taken off: the walk then reaches the same nodes in a slightly other order, and
//! the stack never holds one twice. Source of the search: J. Hopcroft and R. Tarjan, "Algorithm 447: efficient
//! algorithms for graph manipulation", 1973.

use super::IslandSizes;
use super::adjacency::Adjacency;

/// The root of a node that no walk has come to.
const UNSEEN: u32 = u32::MAX;

/// Buffers of the search.
#[derive(Default, Debug)]
pub(super) struct DepthFirst {
    adjacency: Adjacency,
    stack: Vec<u32>,
}

impl DepthFirst {
    /// Writes each node's lowest one of its island to `roots`.
    pub(super) fn find(&mut self, nodes: usize, links: &[[u32; 2]], roots: &mut Vec<u32>) -> IslandSizes {
        let Self { adjacency, stack } = self;
        adjacency.build(nodes, links);
        stack.clear();
        roots.clear();
        roots.resize(nodes, UNSEEN);
        let mut sizes = IslandSizes::default();
        for start in 0..nodes as u32 {
            if roots[start as usize] != UNSEEN {
                continue;
            }
            roots[start as usize] = start;
            stack.push(start);
            let mut size = 0;
            while let Some(node) = stack.pop() {
                size += 1;
                for &neighbour in adjacency.of(node) {
                    let root = &mut roots[neighbour as usize];
                    if *root == UNSEEN {
                        *root = start;
                        stack.push(neighbour);
                    }
                }
            }
            sizes.islands += 1;
            sizes.largest = sizes.largest.max(size);
        }
        sizes
    }
}
