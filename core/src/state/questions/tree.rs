//! Outlines by place: a tree of rectangles, each around eight of the level below, over outlines in the order of a Hilbert curve. Built in
//! one go for many questions (as in "packed" R-trees: N. Roussopoulos, D. Leifker, 1985; in the order of a curve: I. Kamel,
//! C. Faloutsos, 1993).

use super::RayHit;
use super::outline::Outline;
use crate::parallel::ahead::fetch;
use glam::DVec2;
use rayon::prelude::*;

/// A rectangle between two corners, borders included.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) low: DVec2,
    pub(super) high: DVec2,
}

impl Bounds {
    const NONE: Self = Self { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY };

    fn join(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }
}

/// How many children a rectangle has.
const FAN: usize = 8;

#[derive(Debug)]
pub(super) struct Tree {
    outlines: Vec<Outline>,
    /// Coordinates of nodes count from here.
    origin: DVec2,
    /// Around each eight outlines, around each eight of these, and so on, until there is one.
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

    fn around_outlines(outlines: &[Outline], origin: DVec2) -> Self {
        let mut node = Self::EMPTY;
        for (place, outline) in outlines.iter().enumerate() {
            let Bounds { low, high } = outline.bounds();
            let (low, high) = (low - origin, high - origin);
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
const ORDER: u32 = 24;

/// The place of a cell on a curve through all of them, on which neighbours are near each other (D. Hilbert, 1891). By what each pair
/// of bits makes of the next: the quarter, and how it is turned.
fn along_curve(x: u32, y: u32) -> u64 {
    /// By how a quarter is turned, and which quarter of it: which one that is on the curve, and how that is turned.
    const NEXT: [[(u64, u8); 4]; 4] = [
        [(0, 1), (1, 0), (3, 3), (2, 0)],
        [(0, 0), (3, 2), (1, 1), (2, 1)],
        [(2, 2), (3, 1), (1, 2), (0, 3)],
        [(2, 3), (1, 3), (3, 0), (0, 2)],
    ];
    let (mut place, mut turned) = (0, 0);
    for bit in (0..ORDER).rev() {
        let quarter = (x >> bit & 1) << 1 | (y >> bit & 1);
        let (next, then) = NEXT[usize::from(turned)][quarter as usize];
        place = place << 2 | next;
        turned = then;
    }
    place
}

impl Tree {
    /// Takes time n log n for n outlines.
    pub(super) fn new(outlines: Vec<Outline>) -> Self {
        let around = |outlines: &[Outline]| {
            let centers = outlines.iter().map(|outline| Bounds { low: outline.center, high: outline.center });
            centers.fold(Bounds::NONE, Bounds::join)
        };
        let all = outlines.par_chunks(4096).map(around).reduce(|| Bounds::NONE, Bounds::join);
        let scale =
            DVec2::splat(f64::from((1 << ORDER) - 1)) / (all.high - all.low).max(DVec2::splat(f64::MIN_POSITIVE));
        let key = |outline: &Outline| {
            let cell = (outline.center - all.low) * scale;
            along_curve(cell.x as u32, cell.y as u32)
        };
        let mut order: Vec<(u64, u32)> =
            outlines.par_iter().zip(0..outlines.len() as u32).map(|(outline, i)| (key(outline), i)).collect();
        order.par_sort_unstable();
        let outlines: Vec<Outline> = order.par_iter().map(|&(_, i)| outlines[i as usize].clone()).collect();
        let origin = if outlines.is_empty() { DVec2::ZERO } else { (all.low + all.high) * 0.5 };
        let mut levels: Vec<Vec<Node>> =
            vec![outlines.par_chunks(FAN).map(|few| Node::around_outlines(few, origin)).collect()];
        while let Some(level) = levels.last().filter(|level| level.len() > 1) {
            let next = level.par_chunks(FAN).map(Node::around).collect();
            levels.push(next);
        }
        Self { outlines, origin, levels }
    }

    /// How many children a node has, and the first of them.
    fn children(&self, level: usize, number: usize) -> (usize, usize) {
        let (all, first) = (if level == 0 { self.outlines.len() } else { self.levels[level - 1].len() }, number * FAN);
        (FAN.min(all - first), first)
    }

    /// Where a search begins: at the node around all, if there is any.
    fn root(&self) -> Option<usize> {
        (!self.outlines.is_empty()).then_some(self.levels.len() - 1)
    }

    /// Visits the outlines whose rectangles meet another.
    pub(super) fn visit(&self, bounds: Bounds, mut visitor: impl FnMut(&Outline)) {
        let (low, high) = (bounds.low - self.origin, bounds.high - self.origin);
        let low = [low.x, low.y].map(|x| (x as f32).next_down());
        let high = [high.x, high.y].map(|x| (x as f32).next_up());
        let mut open: Vec<(usize, usize)> = self.root().map(|level| (level, 0)).into_iter().collect();
        while let Some((level, number)) = open.pop() {
            let (node, (count, first)) = (&self.levels[level][number], self.children(level, number));
            for child in (0..count).filter(|&child| node.meets(child, low, high)) {
                if level == 0 {
                    visitor(&self.outlines[first + child]);
                } else {
                    open.push((level - 1, first + child));
                }
            }
        }
    }

    /// Finds what a ray meets before the `best` that is known already.
    pub(super) fn cast_ray(&self, from: DVec2, to: DVec2, best: &mut Option<RayHit>) {
        let Some(root) = self.root() else { return };
        let line = Line::new(from - self.origin, to - self.origin);
        // Each level leaves seven at most behind, and twelve levels hold more than can be counted in 32 bits.
        let mut open = [(0.0_f32, 0_u32, 0_u32); 7 * 12 + 1];
        open[0] = (0.0, root as u32, 0);
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (enters, level, number) = open[depth];
            let limit = best.map_or(1.0, |best| (best.fraction as f32).next_up());
            if enters > limit {
                continue;
            }
            let (level, number) = (level as usize, number as usize);
            let (count, first) = self.children(level, number);
            let enters = line.enters(&self.levels[level][number], limit);
            let bottom = depth;
            let met = || enters[..count].iter().enumerate().filter(|(_, enters)| **enters <= limit);
            if level > 0 {
                for (child, &enters) in met() {
                    // The nearest comes last, to be looked at first, which leaves least of the others.
                    let mut place = depth;
                    while place > bottom && open[place - 1].0 < enters {
                        open[place] = open[place - 1];
                        place -= 1;
                    }
                    open[place] = (enters, level as u32 - 1, (first + child) as u32);
                    fetch(&self.levels[level - 1], first + child);
                    depth += 1;
                }
                continue;
            }
            met().for_each(|(child, _)| fetch(&self.outlines, first + child));
            for (child, _) in met() {
                if let Some(hit) = self.outlines[first + child].cast_ray(from, to) {
                    *best = Some(best.map_or(hit, |best| best.nearer(hit)));
                }
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
    fn the_curve_goes_from_neighbour_to_neighbour_through_all_cells() {
        let mut cells: Vec<(u64, [i64; 2])> =
            (0..32 * 32).map(|k| (along_curve(k % 32, k / 32), [i64::from(k % 32), i64::from(k / 32)])).collect();
        cells.sort_unstable();
        for two in cells.windows(2) {
            let [(before, [x0, y0]), (after, [x1, y1])] = [two[0], two[1]];
            assert_eq!((after - before, (x1 - x0).abs() + (y1 - y0).abs()), (1, 1), "{two:?}");
        }
    }
}
