//! Each body's neighbours: the graph of contacts as the report's narrow phase builds it, a list per body.
//!
//! The report keeps a growing list in every body; here all lists stand in one buffer, body by body (compressed sparse
//! rows), so that nothing is allocated in a warm step.

/// Every node's neighbours.
#[derive(Default, Debug)]
pub(super) struct Adjacency {
    /// Where in `neighbours` each node's begin, and behind the last where they end.
    starts: Vec<u32>,
    neighbours: Vec<u32>,
}

impl Adjacency {
    /// Builds the lists, each in the order of the links, by counting: one pass over the links finds how long each list
    /// is, a second one fills them. Less than 2^31 links.
    pub(super) fn build(&mut self, nodes: usize, links: &[[u32; 2]]) {
        assert!(links.len() < 1 << 31, "{} links are more than 32 bits can number", links.len());
        let starts = &mut self.starts;
        starts.clear();
        starts.resize(nodes, 0);
        for &node in links.as_flattened() {
            starts[node as usize] += 1;
        }
        // First each list's end; the second pass fills the lists from behind and so moves the ends to the starts.
        let mut end = 0;
        for start in starts.iter_mut() {
            end += *start;
            *start = end;
        }
        starts.push(end);
        self.neighbours.resize(2 * links.len(), 0);
        for &[a, b] in links.iter().rev() {
            for [node, neighbour] in [[b, a], [a, b]] {
                let place = &mut starts[node as usize];
                *place -= 1;
                self.neighbours[*place as usize] = neighbour;
            }
        }
    }

    /// The neighbours of a node; one that is linked to it twice stands here twice, the node itself where it is linked to
    /// itself.
    #[inline]
    pub(super) fn of(&self, node: u32) -> &[u32] {
        let node = node as usize;
        &self.neighbours[self.starts[node] as usize..self.starts[node + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_keep_the_order_of_the_links() {
        let mut adjacency = Adjacency::default();
        // The larger graph first: what it leaves behind must not show.
        adjacency.build(9, &[[8, 0]; 20]);
        adjacency.build(5, &[[3, 1], [1, 0], [4, 4], [3, 1]]);
        let lists: Vec<_> = (0..5).map(|node| adjacency.of(node)).collect();
        assert_eq!(lists, [&[1][..], &[3, 0, 3], &[], &[1, 1], &[4, 4]]);
        adjacency.build(0, &[]);
        adjacency.build(1, &[]);
        assert!(adjacency.of(0).is_empty());
    }

    #[test]
    #[should_panic(expected = "out of bounds")]
    fn a_link_to_no_node() {
        Adjacency::default().build(2, &[[2, 2]]);
    }
}
