//! Who a body of the tile is to the solver: a node of the graph of contacts first, one of the solver's bodies then. Two
//! types, so that neither is taken for the other.

/// What a body of the tile is in the graph of contacts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(transparent)]
pub(crate) struct GraphNode(u32);

impl GraphNode {
    /// A body without contacts.
    pub(crate) const NO_CONTACT: Self = Self(u32::MAX);

    /// A static with contacts. It connects nothing, and so is no node.
    pub(crate) const STATIC: Self = Self(0);

    /// The node of a number, counted from zero.
    pub(crate) fn new(number: u32) -> Self {
        Self(number + 1)
    }

    /// The number of a body that moves and has contacts.
    #[inline(always)]
    pub(crate) fn number(self) -> Option<u32> {
        (self != Self::NO_CONTACT && self != Self::STATIC).then(|| self.0 - 1)
    }

    /// The solver's body that `place` makes of a node. Written so that it is nothing to do where numbers stay as they
    /// are.
    #[inline(always)]
    pub(crate) fn placed(self, place: impl FnOnce(u32) -> SolverIndex) -> SolverIndex {
        match self {
            Self::NO_CONTACT => SolverIndex::NOT_SOLVED,
            Self::STATIC => SolverIndex::STATIC,
            Self(number) => place(number - 1),
        }
    }
}

/// Which of the solver's bodies a body of the tile is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
#[repr(transparent)]
pub(crate) struct SolverIndex(u32);

impl SolverIndex {
    /// A body that is not solved: it has no contact, or sleeps.
    pub(crate) const NOT_SOLVED: Self = Self(u32::MAX);

    /// Every static. No body that moves comes first in a batch.
    pub(crate) const STATIC: Self = Self(0);

    pub(crate) fn new(index: u32) -> Self {
        Self(index)
    }

    /// Among all bodies of the solver, of one that is solved or static.
    #[inline(always)]
    pub(crate) fn get(self) -> usize {
        self.0 as usize
    }

    /// Itself, or a static in the place of one that is not solved.
    #[inline(always)]
    pub(crate) fn solved_or_static(self) -> Self {
        if self == Self::NOT_SOLVED { Self::STATIC } else { self }
    }

    /// Within its batch, of which `base` comes first; a static is where the batch has `statics`.
    #[inline(always)]
    pub(crate) fn within(self, base: u32, statics: u32) -> u32 {
        if self == Self::STATIC { statics } else { self.0 - base }
    }
}

/// Makes solver bodies of nodes. The library collects them in the memory of the nodes, which tests see to.
pub(crate) fn place_all(nodes: Vec<GraphNode>, place: impl FnMut(GraphNode) -> SolverIndex) -> Vec<SolverIndex> {
    nodes.into_iter().map(place).collect()
}

/// As many bodies without contacts, in the memory of those of the last step.
pub(crate) fn forget(places: Vec<SolverIndex>, bodies: usize) -> Vec<GraphNode> {
    let mut nodes: Vec<_> = places.into_iter().map(|_| GraphNode::NO_CONTACT).collect();
    nodes.resize(bodies, GraphNode::NO_CONTACT);
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_memory_goes_round() {
        let places = forget(Vec::new(), 100);
        let (start, room) = (places.as_ptr().cast::<u32>(), places.capacity());
        let mut nodes = place_all(places, |node| node.placed(SolverIndex::new));
        nodes[7] = SolverIndex::new(3);
        let nodes = forget(nodes, 90);
        assert_eq!(
            (nodes.as_ptr().cast(), nodes.capacity()),
            (start, room),
            "every step allocates anew: reuse the memory"
        );
        assert!(nodes.len() == 90 && nodes.iter().all(|&node| node == GraphNode::NO_CONTACT));
    }

    #[test]
    fn neither_statics_nor_bodies_without_contacts_are_nodes() {
        let place = |node: GraphNode| node.placed(|number| SolverIndex::new(number + 32));
        assert_eq!(GraphNode::new(5).number(), Some(5));
        assert_eq!(GraphNode::STATIC.number().or(GraphNode::NO_CONTACT.number()), None);
        assert_eq!(place(GraphNode::new(5)), SolverIndex::new(37));
        assert_eq!(
            [GraphNode::STATIC, GraphNode::NO_CONTACT].map(place),
            [SolverIndex::STATIC, SolverIndex::NOT_SOLVED]
        );
    }
}
