//! Which statics stand somewhere, found in a time that does not grow with how many there are elsewhere: by squares of one size, of which
//! only those with something in them are kept (a spatial hash: M. Teschner et al., "Optimized Spatial Hashing for Collision
//! Detection of Deformable Objects", 2003).

use glam::DVec2;
use rustc_hash::{FxHashMap, FxHashSet};
use std::ops::Range;

/// What meets more squares than this is in none of them.
const MOST_SQUARES: f64 = 64.0;

/// Boxes around all that each static ever comes to, by place.
#[derive(Clone, Default, Debug)]
pub(crate) struct Terrain {
    /// Squares in a meter.
    per_meter: f64,
    /// For each square with anything in it where its parts of `rows` are: of those that stand still, and of those that go.
    squares: FxHashMap<[i32; 2], [Range<u32>; 2]>,
    rows: Vec<u32>,
    /// Low and high corner of each static's box, by row.
    bounds: Vec<[DVec2; 2]>,
    /// The rows of those that are in no square, ascending: those that meet very many.
    at_large: Vec<u32>,
}

/// The squares that a rectangle meets.
#[derive(Clone, Copy)]
struct Span {
    low: [i32; 2],
    high: [i32; 2],
}

impl Span {
    /// How many.
    fn count(&self) -> f64 {
        let along = |axis: usize| f64::from(self.high[axis]) - f64::from(self.low[axis]) + 1.0;
        along(0) * along(1)
    }

    fn squares(self) -> impl Iterator<Item = [i32; 2]> {
        (self.low[1]..=self.high[1]).flat_map(move |y| (self.low[0]..=self.high[0]).map(move |x| [x, y]))
    }
}

impl Terrain {
    /// Of the boxes of all statics, by row, each of two corners, and whether it goes. Squares are as wide as half of these, and no less than
    /// `least_side`, in meters. Takes time n log n.
    pub(crate) fn new(bounds: Vec<[DVec2; 2]>, goes: impl Fn(u32) -> bool, least_side: f64) -> Self {
        let mut sides: Vec<f64> = bounds.iter().map(|[low, high]| (*high - *low).max_element()).collect();
        sides.retain(|side| side.is_finite());
        let middle = sides.len() / 2;
        let usual = if sides.is_empty() { 0.0 } else { *sides.select_nth_unstable_by(middle, f64::total_cmp).1 };
        let mut terrain = Self { per_meter: 1.0 / usual.max(least_side), bounds, ..Self::default() };
        let mut places: Vec<([i32; 2], bool, u32)> = Vec::with_capacity(2 * terrain.bounds.len());
        for (row, &[low, high]) in (0..).zip(&terrain.bounds) {
            let span = terrain.span(low, high);
            if span.count() <= MOST_SQUARES {
                places.extend(span.squares().map(|square| (square, goes(row), row)));
            } else {
                terrain.at_large.push(row);
            }
        }
        places.sort_unstable();
        for same in places.chunk_by(|a, b| a.0 == b.0) {
            let first = terrain.rows.len() as u32;
            terrain.rows.extend(same.iter().map(|(.., row)| row));
            let (middle, end) = (first + same.partition_point(|place| !place.1) as u32, terrain.rows.len() as u32);
            terrain.squares.insert(same[0].0, [first..middle, middle..end]);
        }
        terrain
    }

    fn span(&self, low: DVec2, high: DVec2) -> Span {
        // What lies beyond all numbers of squares counts as in the last.
        let square = |corner: DVec2| (corner * self.per_meter).floor().to_array().map(|at| at as i32);
        Span { low: square(low), high: square(high) }
    }

    /// The squares that a rectangle meets, if they are no more than so many.
    pub(crate) fn squares(
        &self,
        low: DVec2,
        high: DVec2,
        most: usize,
    ) -> Option<impl Iterator<Item = [i32; 2]> + use<>> {
        let span = self.span(low, high);
        (span.count() <= most as f64).then(|| span.squares())
    }

    /// The rows of those that meet a square: that stand still, and that go.
    pub(crate) fn rows_of(&self, square: [i32; 2]) -> [&[u32]; 2] {
        let rows = |part: &Range<u32>| &self.rows[part.start as usize..part.end as usize];
        self.squares.get(&square).map_or([&[]; 2], |parts| parts.each_ref().map(rows))
    }

    /// The rows of those that are in no square, ascending: they may be anywhere.
    pub(crate) fn at_large(&self) -> &[u32] {
        &self.at_large
    }

    /// Of the others, those which stand still and whose box meets one of some rectangles, with the number of that, in any order, and maybe
    /// more than once; and all that go and may come there, ascending: each of them is looked at once, however many rectangles there are.
    pub(crate) fn meeting(&self, rectangles: &[(DVec2, DVec2)]) -> (Vec<(usize, u32)>, Vec<u32>) {
        let (mut still, mut going, mut squares) = (Vec::new(), Vec::new(), FxHashSet::default());
        for (number, &(low, high)) in rectangles.iter().enumerate() {
            let meets = |[own_low, own_high]: [DVec2; 2]| (own_low.cmple(high) & own_high.cmpge(low)).all();
            let mut look_at = |square: [i32; 2]| {
                let [standing, on_paths] = self.rows_of(square);
                let met = standing.iter().filter(|row| meets(self.bounds[**row as usize]));
                still.extend(met.map(|&row| (number, row)));
                if !on_paths.is_empty() && squares.insert(square) {
                    going.extend(on_paths);
                }
            };
            match self.squares(low, high, self.squares.len()) {
                Some(squares) => squares.for_each(look_at),
                None => self.squares.keys().copied().for_each(&mut look_at),
            }
        }
        ascend(&mut going);
        (still, going)
    }
}

/// Brings rows in order, each once.
pub(crate) fn ascend(rows: &mut Vec<u32>) {
    // Mostly a few lists that ascend, one after the other, which this sort finds.
    rows.sort();
    rows.dedup();
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_meets_a_rectangle_is_found(
            boxes in prop::collection::vec((-40.0..40.0, -40.0..40.0, 0.0..3.0, -3.0..6.0), 0..80),
            endless in 0..4_usize,
            asked in prop::collection::vec((-50.0..50.0, -50.0..50.0, 0.0..5.0, -3.0..7.0), 1..20),
        ) {
            // Some are very thin, and some very long.
            let around = |(x, y, width, height): (f64, f64, f64, f64)| {
                let half = DVec2::new(width, height.exp());
                [DVec2::new(x, y) - half, DVec2::new(x, y) + half]
            };
            let mut boxes: Vec<[DVec2; 2]> = boxes.into_iter().map(around).collect();
            boxes.iter_mut().rev().take(endless).for_each(|[_, high]| high.x = f64::INFINITY);
            let goes = |row: u32| row.is_multiple_of(3);
            let terrain = Terrain::new(boxes.clone(), goes, 0.5);
            prop_assert!(terrain.at_large.is_sorted());
            prop_assert!((0..boxes.len() as u32).rev().take(endless).all(|row| terrain.at_large.contains(&row)));
            let asked: Vec<_> = asked.into_iter().map(around).map(|[low, high]| (low, high)).collect();
            let (mut still, going) = terrain.meeting(&asked);
            still.sort_unstable();
            still.dedup();
            let meets = |(low, high): (DVec2, DVec2), row: u32| {
                let [own_low, own_high] = boxes[row as usize];
                !terrain.at_large.contains(&row) && own_low.cmple(high).all() && own_high.cmpge(low).all()
            };
            let rows = 0..boxes.len() as u32;
            let pairs: Vec<_> = (0..asked.len()).flat_map(|number| rows.clone().map(move |row| (number, row))).collect();
            let (moving, standing): (Vec<_>, Vec<_>) =
                pairs.into_iter().filter(|&(number, row)| meets(asked[number], row)).partition(|pair| goes(pair.1));
            prop_assert_eq!(still, standing);
            prop_assert!(going.is_sorted() && going.iter().all(|&row| goes(row)));
            prop_assert!(moving.iter().all(|(_, row)| going.contains(row)));
        }
    }
}
