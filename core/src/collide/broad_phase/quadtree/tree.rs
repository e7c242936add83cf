//! The tree itself: squares cut in four, and the boxes in each.
//!
//! Nodes, and blocks of eight boxes, lie in flat vectors and name each other by number; freed ones are used again. The
//! blocks of a node form a chain of which only the first may have empty lanes.

#[cfg(test)]
mod check;

use glam::Vec4;

/// No node, no block, no place.
pub(super) const NONE: u32 = u32::MAX;

/// A leaf with more boxes than this that would fit into quarters of it is cut in four. Measured on the scene `rooms`:
/// anything from 4 to 32 takes the same time within a tenth.
const CAPACITY: u32 = 16;

/// Four leaves that hold no more boxes than this together become one again. Less than [`CAPACITY`], so that a box that
/// goes to and fro does not cut and join at each step.
const JOINED: u32 = 8;

/// Squares are cut no more often than this: a tile of 100 km down to 10 cm.
const MAX_DEPTH: u32 = 20;

/// Boxes in a block: as many as are compared at once.
const LANES: usize = 8;

/// An axis-aligned box.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Aabb {
    pub(super) low: [f32; 2],
    pub(super) high: [f32; 2],
}

impl Aabb {
    /// What overlaps nothing.
    const EMPTY: Self = Self { low: [f32::INFINITY; 2], high: [f32::NEG_INFINITY; 2] };

    /// Whether the other lies within; never where a coordinate is not a number.
    pub(super) fn contains(&self, other: &Self) -> bool {
        (0..2).all(|axis| self.low[axis] <= other.low[axis] && other.high[axis] <= self.high[axis])
    }
}

/// A square. Which boxes belong to it is decided by the centers of the squares around it alone, so the outermost ones
/// reach to infinity and no box is outside the tree.
#[derive(Clone, Debug)]
struct Node {
    center: [f32; 2],
    /// The first of four in a row, or [`NONE`].
    children: u32,
    parent: u32,
    depth: u32,
    /// Of its chain of blocks, or [`NONE`].
    first_block: u32,
    /// Boxes in the chain, and those of them that would fit into a quarter.
    boxes: u32,
    fitting: u32,
}

impl Node {
    fn new(center: [f32; 2], parent: u32, depth: u32) -> Self {
        Self { center, children: NONE, parent, depth, first_block: NONE, boxes: 0, fitting: 0 }
    }

    /// Which quarter the box lies in wholly, if one.
    #[inline(always)]
    fn quarter_of(&self, aabb: &Aabb) -> Option<u32> {
        let side = |axis: usize| (aabb.high[axis] < self.center[axis], aabb.low[axis] > self.center[axis]);
        let (x, y) = (side(0), side(1));
        let whole = (x.0 | x.1) & (y.0 | y.1);
        whole.then_some(u32::from(x.1) + 2 * u32::from(y.1))
    }
}

/// Up to eight boxes of one node. Empty lanes hold [`Aabb::EMPTY`].
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Block {
    low: [[Vec4; 2]; 2],
    high: [[Vec4; 2]; 2],
    owner: [u32; LANES],
    node: u32,
    next: u32,
}

impl Block {
    fn new(node: u32, next: u32) -> Self {
        let (low, high) = ([[Vec4::INFINITY; 2]; 2], [[Vec4::NEG_INFINITY; 2]; 2]);
        Self { low, high, owner: [NONE; LANES], node, next }
    }

    fn get(&self, lane: usize) -> Aabb {
        let (four, lane) = (lane / 4, lane % 4);
        let side = |column: &[[Vec4; 2]; 2]| [column[0][four][lane], column[1][four][lane]];
        Aabb { low: side(&self.low), high: side(&self.high) }
    }

    fn set(&mut self, lane: usize, aabb: &Aabb) {
        let (four, lane) = (lane / 4, lane % 4);
        for axis in 0..2 {
            self.low[axis][four][lane] = aabb.low[axis];
            self.high[axis][four][lane] = aabb.high[axis];
        }
    }

    /// A bit for each lane whose box overlaps a box given as four vectors: its lower x and y, its upper x and y.
    #[inline(always)]
    fn overlaps(&self, query: &[Vec4; 4]) -> u32 {
        let four = |four: usize| {
            let x = self.low[0][four].cmple(query[2]) & self.high[0][four].cmpge(query[0]);
            let y = self.low[1][four].cmple(query[3]) & self.high[1][four].cmpge(query[1]);
            (x & y).bitmask()
        };
        four(0) | four(1) << 4
    }
}

/// Boxes by place. Each has an owner, a number below that of owners; the tree knows for each owner where its box is.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    /// Half the side of the outermost square.
    half: f32,
    /// The outermost comes first.
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    /// First nodes of rows of four, and blocks, that nobody uses.
    free_nodes: Vec<u32>,
    free_blocks: Vec<u32>,
    /// For each owner its box's block and lane as one number, or [`NONE`].
    places: Vec<u32>,
    places_before: Vec<u32>,
}

impl Tree {
    /// An empty tree around the rectangle from the origin to `size`.
    pub(super) fn new(size: [f32; 2]) -> Self {
        let side = if size[0] > size[1] { size[0] } else { size[1] };
        Self {
            half: 0.5 * side,
            nodes: vec![Node::new(size.map(|side| 0.5 * side), NONE, 0)],
            blocks: Vec::new(),
            free_nodes: Vec::new(),
            free_blocks: Vec::new(),
            places: Vec::new(),
            places_before: Vec::new(),
        }
    }

    /// The box of an owner.
    #[inline(always)]
    pub(super) fn get(&self, owner: u32) -> Option<Aabb> {
        let place = self.places[owner as usize];
        (place != NONE).then(|| self.blocks[place as usize / LANES].get(place as usize % LANES))
    }

    /// Gives every box a new owner: the one of owner `from[i]` comes to `i`, where that is not [`NONE`]. Those of the
    /// owners in `gone` leave the tree. The two lists together name every owner once.
    pub(super) fn rename(&mut self, from: &[u32], gone: &[u32]) {
        std::mem::swap(&mut self.places, &mut self.places_before);
        self.places.clear();
        let before = |&owner: &u32| if owner == NONE { NONE } else { self.places_before[owner as usize] };
        self.places.extend(from.iter().chain(gone).map(before));
        for (owner, &place) in (0..).zip(&self.places) {
            if place != NONE {
                self.blocks[place as usize / LANES].owner[place as usize % LANES] = owner;
            }
        }
        for owner in from.len()..self.places.len() {
            self.remove(self.places[owner]);
        }
        self.places.truncate(from.len());
    }

    /// Puts the box of an owner where it belongs, for the first time or anew.
    pub(super) fn put(&mut self, owner: u32, aabb: &Aabb) {
        let node = self.smallest_around(aabb);
        let before = self.places[owner as usize];
        if before != NONE && self.blocks[before as usize / LANES].node == node {
            return self.replace(before, aabb);
        }
        self.push(node, owner, aabb);
        self.cut(node);
        if before != NONE {
            self.remove(before);
        }
    }

    /// Calls `hit` for the owner of every box that overlaps, and perhaps of some that do not.
    #[inline(always)]
    pub(super) fn query(&self, query: &Aabb, mut hit: impl FnMut(u32)) {
        let wide = [query.low[0], query.low[1], query.high[0], query.high[1]].map(Vec4::splat);
        // Each node on the way down leaves at most three siblings behind.
        let mut stack = [0; 3 * MAX_DEPTH as usize + 4];
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let node = &self.nodes[stack[waiting] as usize];
            let mut next = node.first_block;
            while next != NONE {
                let block = &self.blocks[next as usize];
                let mut hits = block.overlaps(&wide);
                while hits != 0 {
                    hit(block.owner[hits.trailing_zeros() as usize]);
                    hits &= hits - 1;
                }
                next = block.next;
            }
            if node.children == NONE {
                continue;
            }
            let [x, y] = [0, 1].map(|axis| [query.low[axis] < node.center[axis], query.high[axis] > node.center[axis]]);
            for quarter in 0..4 {
                if x[quarter & 1] & y[quarter >> 1] {
                    stack[waiting] = node.children + quarter as u32;
                    waiting += 1;
                }
            }
        }
    }

    /// The smallest square that there is around a box.
    fn smallest_around(&self, aabb: &Aabb) -> u32 {
        let mut at = 0;
        loop {
            let node = &self.nodes[at as usize];
            match node.quarter_of(aabb) {
                Some(quarter) if node.children != NONE => at = node.children + quarter,
                _ => return at,
            }
        }
    }

    /// Changes a box that stays in its node.
    fn replace(&mut self, place: u32, aabb: &Aabb) {
        let (block, lane) = (&mut self.blocks[place as usize / LANES], place as usize % LANES);
        let node = &mut self.nodes[block.node as usize];
        node.fitting -= u32::from(node.quarter_of(&block.get(lane)).is_some());
        node.fitting += u32::from(node.quarter_of(aabb).is_some());
        block.set(lane, aabb);
        let node = block.node;
        self.cut(node);
    }

    fn push(&mut self, at: u32, owner: u32, aabb: &Aabb) {
        let node = &mut self.nodes[at as usize];
        let lane = node.boxes as usize % LANES;
        if lane == 0 {
            let fresh = Block::new(at, node.first_block);
            node.first_block = match self.free_blocks.pop() {
                Some(free) => {
                    self.blocks[free as usize] = fresh;
                    free
                }
                None => {
                    self.blocks.push(fresh);
                    self.blocks.len() as u32 - 1
                }
            };
        }
        node.boxes += 1;
        node.fitting += u32::from(node.quarter_of(aabb).is_some());
        let block = &mut self.blocks[node.first_block as usize];
        block.set(lane, aabb);
        block.owner[lane] = owner;
        self.places[owner as usize] = node.first_block * LANES as u32 + lane as u32;
    }

    /// Takes a box out; the last one of its node comes to its place.
    fn remove(&mut self, place: u32) {
        let (block, lane) = (place as usize / LANES, place as usize % LANES);
        let at = self.blocks[block].node;
        let node = &mut self.nodes[at as usize];
        node.fitting -= u32::from(node.quarter_of(&self.blocks[block].get(lane)).is_some());
        node.boxes -= 1;
        let (last_block, last_lane) = (node.first_block as usize, node.boxes as usize % LANES);
        if (last_block, last_lane) != (block, lane) {
            let (aabb, owner) = (self.blocks[last_block].get(last_lane), self.blocks[last_block].owner[last_lane]);
            self.blocks[block].set(lane, &aabb);
            self.blocks[block].owner[lane] = owner;
            self.places[owner as usize] = place;
        }
        self.blocks[last_block].set(last_lane, &Aabb::EMPTY);
        if last_lane == 0 {
            node.first_block = self.blocks[last_block].next;
            self.free_blocks.push(last_block as u32);
        }
        self.join(at);
    }

    /// Cuts a leaf in four if it has become too full, and its quarters if they are.
    fn cut(&mut self, at: u32) {
        let node = &mut self.nodes[at as usize];
        if node.fitting <= CAPACITY || node.depth == MAX_DEPTH || node.children != NONE {
            return;
        }
        let (center, depth) = (node.center, node.depth + 1);
        let half = self.half / (1u32 << depth) as f32;
        let first = self.free_nodes.pop().unwrap_or(self.nodes.len() as u32);
        if first as usize == self.nodes.len() {
            self.nodes.resize(self.nodes.len() + 4, Node::new(center, at, depth));
        }
        for (quarter, [x, y]) in (first..).zip([[-half, -half], [half, -half], [-half, half], [half, half]]) {
            self.nodes[quarter as usize] = Node::new([center[0] + x, center[1] + y], at, depth);
        }
        self.nodes[at as usize].children = first;
        self.pour(at, |node, aabb| node.quarter_of(aabb).map_or(at, |quarter| first + quarter));
        (first..first + 4).for_each(|quarter| self.cut(quarter));
    }

    /// Makes one leaf of a node's four, or its parent's, if they have become too empty; and so on outwards.
    fn join(&mut self, at: u32) {
        let mut at = at;
        while at != NONE {
            let node = &self.nodes[at as usize];
            let (first, parent) = (node.children, node.parent);
            if first != NONE {
                let quarters = &self.nodes[first as usize..first as usize + 4];
                let leaves = quarters.iter().all(|quarter| quarter.children == NONE);
                if !leaves || quarters.iter().map(|quarter| quarter.boxes).sum::<u32>() > JOINED {
                    return;
                }
                self.nodes[at as usize].children = NONE;
                (first..first + 4).for_each(|quarter| self.pour(quarter, |_, _| at));
                self.free_nodes.push(first);
            } else if node.boxes > JOINED {
                return;
            }
            at = parent;
        }
    }

    /// Takes all boxes of a node out and puts each into the node that `into` says.
    fn pour(&mut self, at: u32, into: impl Fn(&Node, &Aabb) -> u32) {
        let node = &mut self.nodes[at as usize];
        let (mut next, mut left) = (node.first_block, node.boxes as usize);
        (node.first_block, node.boxes, node.fitting) = (NONE, 0, 0);
        while next != NONE {
            let block = self.blocks[next as usize].clone();
            let filled = if left.is_multiple_of(LANES) { LANES } else { left % LANES };
            left -= filled;
            self.free_blocks.push(next);
            for lane in 0..filled {
                let aabb = block.get(lane);
                let target = into(&self.nodes[at as usize], &aabb);
                self.push(target, block.owner[lane], &aabb);
            }
            next = block.next;
        }
    }
}
