//! Rectangles by place: a tree of rectangles, each around eight of the level below, over those that are asked for, in the order of a
//! curve. Built in one go (as in "packed" R-trees: N. Roussopoulos, D. Leifker, 1985; in the order of a curve: I. Kamel, C. Faloutsos,
//! 1993).

use super::RayHit;
use crate::parallel::ahead::fetch;
use glam::DVec2;

/// A rectangle between two corners, borders included.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) low: DVec2,
    pub(super) high: DVec2,
}

impl Bounds {
    pub(super) const NONE: Self = Self { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY };

    pub(super) fn join(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Whether the two have a point in common.
    pub(super) fn meets(self, other: Self) -> bool {
        (self.low.cmple(other.high) & other.low.cmple(self.high)).all()
    }

    fn center(self) -> DVec2 {
        (self.low + self.high) * 0.5
    }
}

/// How many children a rectangle has.
const FAN: usize = 8;

#[derive(Debug)]
pub(super) struct Tree {
    /// Who the rectangles belong to, along the curve.
    order: Vec<u32>,
    /// Coordinates of nodes count from here.
    origin: DVec2,
    /// Around each eight of these, around each eight of those, and so on, until there is one.
    levels: Vec<Vec<Node>>,
}

/// The rectangles of up to eight children, coordinate by coordinate, so that all are looked at side by side. Rounded outward to half
/// of the digits: what is far from a memory is read sooner, and nothing is left out.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: [[f32; FAN]; 2],
    high: [[f32; FAN]; 2],
}

impl Node {
    const EMPTY: Self = Self { low: [[f32::INFINITY; FAN]; 2], high: [[f32::NEG_INFINITY; FAN]; 2] };

    fn around_bounds<'a>(few: impl Iterator<Item = &'a Bounds>, origin: DVec2) -> Self {
        let mut node = Self::EMPTY;
        for (place, bounds) in few.enumerate() {
            let (low, high) = (bounds.low - origin, bounds.high - origin);
            for axis in 0..2 {
                node.low[axis][place] = (low[axis] as f32).next_down();
                node.high[axis][place] = (high[axis] as f32).next_up();
            }
        }
        node
    }

    fn around(nodes: &[Self]) -> Self {
        let mut node = Self::EMPTY;
        for (place, child) in nodes.iter().enumerate() {
            for axis in 0..2 {
                node.low[axis][place] = child.low[axis].iter().copied().fold(f32::INFINITY, f32::min);
                node.high[axis][place] = child.high[axis].iter().copied().fold(f32::NEG_INFINITY, f32::max);
            }
        }
        node
    }

    fn meets(&self, child: usize, low: [f32; 2], high: [f32; 2]) -> bool {
        (0..2).all(|axis| self.low[axis][child] <= high[axis] && low[axis] <= self.high[axis][child])
    }
}

/// Cells along an axis, as a power of two.
const ORDER: u32 = 16;

/// The place of a cell on a curve through all of them, on which neighbours are mostly near each other: the bits of its two coordinates
/// in turn (G. Morton, 1966).
fn along_curve(x: u32, y: u32) -> u32 {
    let spread = |bits: u32| {
        let bits = (bits | bits << 8) & 0x00ff_00ff;
        let bits = (bits | bits << 4) & 0x0f0f_0f0f;
        let bits = (bits | bits << 2) & 0x3333_3333;
        (bits | bits << 1) & 0x5555_5555
    };
    spread(x) | spread(y) << 1
}

impl Tree {
    /// Of somebody's number and rectangle each. Takes time n log n for n of them.
    pub(super) fn new(all: &[(u32, Bounds)]) -> Self {
        let centers = all.iter().map(|(_, bounds)| bounds.center());
        let around = centers.clone().fold(Bounds::NONE, |around, at| around.join(Bounds { low: at, high: at }));
        let extent = (around.high - around.low).max(DVec2::splat(f64::MIN_POSITIVE));
        let scale = DVec2::splat(f64::from((1 << ORDER) - 1)) / extent;
        let key = |center: DVec2| {
            let cell = (center - around.low) * scale;
            along_curve(cell.x as u32, cell.y as u32)
        };
        // Place on the curve and in the list in one number: half as much to move.
        let mut keys: Vec<u64> = centers.zip(0..).map(|(center, at)| u64::from(key(center)) << 32 | at).collect();
        keys.sort_unstable();
        let at = |key: &u64| &all[*key as u32 as usize];
        let origin = if all.is_empty() { DVec2::ZERO } else { around.center() };
        let first = keys.chunks(FAN).map(|few| Node::around_bounds(few.iter().map(|key| &at(key).1), origin));
        let mut levels: Vec<Vec<Node>> = vec![first.collect()];
        while let Some(level) = levels.last().filter(|level| level.len() > 1) {
            let next = level.chunks(FAN).map(Node::around).collect();
            levels.push(next);
        }
        Self { order: keys.iter().map(|key| at(key).0).collect(), origin, levels }
    }

    /// How many children a node has, and the first of them.
    fn children(&self, level: usize, number: usize) -> (usize, usize) {
        let (all, first) = (if level == 0 { self.order.len() } else { self.levels[level - 1].len() }, number * FAN);
        (FAN.min(all - first), first)
    }

    /// Where a search begins: at the node around all, if there is any.
    fn root(&self) -> Option<usize> {
        (!self.order.is_empty()).then_some(self.levels.len() - 1)
    }

    /// Visits those whose rectangles meet another, and maybe a few more.
    pub(super) fn visit(&self, bounds: Bounds, mut visitor: impl FnMut(u32)) {
        let (low, high) = (bounds.low - self.origin, bounds.high - self.origin);
        let low = [low.x, low.y].map(|x| (x as f32).next_down());
        let high = [high.x, high.y].map(|x| (x as f32).next_up());
        let mut open: Vec<(usize, usize)> = self.root().map(|level| (level, 0)).into_iter().collect();
        while let Some((level, number)) = open.pop() {
            let (node, (count, first)) = (&self.levels[level][number], self.children(level, number));
            for child in (0..count).filter(|&child| node.meets(child, low, high)) {
                if level == 0 {
                    visitor(self.order[first + child]);
                } else {
                    open.push((level - 1, first + child));
                }
            }
        }
    }

    /// Finds what a ray meets before the `best` that is known already, by asking those whose rectangles it comes to.
    pub(super) fn cast_ray(
        &self,
        (from, to): (DVec2, DVec2),
        best: &mut Option<RayHit>,
        mut ask: impl FnMut(u32, &mut Option<RayHit>),
    ) {
        let Some(root) = self.root() else { return };
        let line = Line::new(from - self.origin, to - self.origin);
        // What is open, by how soon the ray comes to it, how many levels are below, and its number. Each level leaves seven at most
        // behind, and twelve hold more than can be counted in 32 bits.
        let mut open = [(0.0_f32, 0_u32, 0_u32); 7 * 12 + 1];
        open[0] = (0.0, root as u32 + 1, 0);
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (enters, height, number) = open[depth];
            let limit = best.map_or(1.0, |best| (best.fraction as f32).next_up());
            if enters > limit {
                continue;
            }
            let number = number as usize;
            let Some(level) = (height as usize).checked_sub(1) else {
                ask(self.order[number], best);
                continue;
            };
            let (count, first) = self.children(level, number);
            let enters = line.enters(&self.levels[level][number], limit);
            let bottom = depth;
            for (child, &enters) in enters[..count].iter().enumerate().filter(|(_, enters)| **enters <= limit) {
                // The nearest comes last, to be looked at first, which leaves least of the others.
                let mut place = depth;
                while place > bottom && open[place - 1].0 < enters {
                    open[place] = open[place - 1];
                    place -= 1;
                }
                open[place] = (enters, height - 1, (first + child) as u32);
                if level > 0 {
                    fetch(&self.levels[level - 1], first + child);
                }
                depth += 1;
            }
        }
    }
}

/// A ray made ready to be held against rectangles, which may be off by what rounding to half of the digits comes to.
struct Line {
    /// The first point, moved on as far as it may be off for low sides, and back for high ones.
    from: [[f32; 2]; 2],
    /// Of each coordinate of the way; where that is nothing, more than anything that it is multiplied with here.
    inverse: [f32; 2],
}

/// Of what is multiplied and rounded, what may be missing, as a part.
const SLACK: f32 = 1e-6;

impl Line {
    fn new(from: DVec2, to: DVec2) -> Self {
        let inverse = |way: f64| if way.abs() < 1e-25 { 1e25 } else { (1.0 / way) as f32 };
        let (way, off) = (to - from, (from.abs() + to.abs()) * f64::from(f32::EPSILON));
        let point = |point: DVec2| [point.x as f32, point.y as f32];
        Self { from: [point(from + off), point(from - off)], inverse: [inverse(way.x), inverse(way.y)] }
    }

    /// Which part of the way leads into each rectangle, or a little less; more than any where it passes by.
    #[inline(always)]
    fn enters(&self, node: &Node, limit: f32) -> [f32; FAN] {
        let (mut enters, mut leaves) = ([0.0_f32; FAN], [limit; FAN]);
        for axis in 0..2 {
            let ([for_low, for_high], inverse) = (self.from.map(|from| from[axis]), self.inverse[axis]);
            for child in 0..FAN {
                let (a, b) =
                    ((node.low[axis][child] - for_low) * inverse, (node.high[axis][child] - for_high) * inverse);
                let (first, last) = (if a < b { a } else { b }, if a > b { a } else { b });
                enters[child] = if first > enters[child] { first } else { enters[child] };
                leaves[child] = if last < leaves[child] { last } else { leaves[child] };
            }
        }
        for child in 0..FAN {
            let enter = enters[child] * (1.0 - SLACK);
            enters[child] = if enter <= leaves[child] * (1.0 + SLACK) { enter } else { f32::INFINITY };
        }
        enters
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_goes_through_each_square_before_the_next() {
        let mut cells: Vec<(u32, [u32; 2])> =
            (0..32 * 32).map(|k| (along_curve(k % 32, k / 32), [k % 32, k / 32])).collect();
        cells.sort_unstable();
        for side in [2, 4, 8, 16] {
            for square in cells.chunks((side * side) as usize) {
                let of = |(_, [x, y]): &(u32, [u32; 2])| [x / side, y / side];
                assert!(square.iter().all(|cell| of(cell) == of(&square[0])), "{square:?}");
            }
        }
        assert_eq!(along_curve(0xffff, 0), 0x5555_5555);
    }
}
