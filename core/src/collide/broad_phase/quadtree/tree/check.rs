//! What tests look at in a tree.

use super::{Aabb, CAPACITY, LANES, MAX_DEPTH, NONE, Tree};

impl Tree {
    /// Nodes and blocks that there is memory for.
    pub(in crate::collide::broad_phase::quadtree) fn room(&self) -> [usize; 2] {
        [self.nodes.len(), self.blocks.len()]
    }

    /// Nodes and blocks in use.
    pub(in crate::collide::broad_phase::quadtree) fn used(&self) -> [usize; 2] {
        [self.nodes.len() - 4 * self.free_nodes.len(), self.blocks.len() - self.free_blocks.len()]
    }

    /// Refuses a tree in which a box is not where it belongs, anything is counted wrong, or something is lost.
    pub(in crate::collide::broad_phase::quadtree) fn check(&self) {
        let (mut boxes, mut blocks, mut nodes) = (0, 0, 0);
        let mut waiting = vec![0];
        while let Some(at) = waiting.pop() {
            let node = &self.nodes[at as usize];
            nodes += 1;
            if node.children != NONE {
                for quarter in node.children..node.children + 4 {
                    assert_eq!(
                        (self.nodes[quarter as usize].parent, self.nodes[quarter as usize].depth),
                        (at, node.depth + 1)
                    );
                    waiting.push(quarter);
                }
            } else {
                assert!(node.fitting <= CAPACITY || node.depth == MAX_DEPTH, "leaf {at} is too full");
            }
            let (mut here, mut fitting, mut next) = (0, 0, node.first_block);
            while next != NONE {
                let block = &self.blocks[next as usize];
                blocks += 1;
                assert_eq!(block.node, at);
                for lane in 0..LANES {
                    let aabb = block.get(lane);
                    if aabb == Aabb::EMPTY {
                        assert!(next == node.first_block && lane > 0, "a gap in the boxes of {at}");
                        continue;
                    }
                    assert_eq!(self.places[block.owner[lane] as usize], next * LANES as u32 + lane as u32);
                    assert_eq!(self.smallest_around(&aabb), at, "{aabb:?} does not belong here");
                    here += 1;
                    fitting += u32::from(node.quarter_of(&aabb).is_some());
                }
                next = block.next;
            }
            assert_eq!((here, fitting), (node.boxes, node.fitting), "in node {at}");
            boxes += here as usize;
        }
        assert_eq!(boxes, self.places.len(), "a box is lost");
        assert_eq!([nodes, blocks], self.used(), "nodes or blocks are lost");
    }
}
