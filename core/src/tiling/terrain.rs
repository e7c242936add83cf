//! Which statics stand somewhere, found in a time that does not grow with how many there are elsewhere: by squares of one size, of which
//! only those with something in them are kept (a spatial hash: M. Teschner et al., "Optimized Spatial Hashing for Collision
//! Detection of Deformable Objects", 2003).

use glam::DVec2;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// What meets more squares than this is in none of them.
const MOST_SQUARES: f64 = 64.0;

/// Boxes around all that each static ever comes to, by place.
#[derive(Clone, Default, Debug)]
pub(crate) struct Terrain {
    /// Squares in a meter.
    per_meter: f64,
    /// For each square with anything in it where its part of `rows` is.
    squares: FxHashMap<[i32; 2], Range<u32>>,
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
    /// Of the boxes of all statics, by row, each of two corners. Squares are as wide as half of these, and no less than `least_side`, in
    /// meters. Takes time n log n.
    pub(crate) fn new(bounds: Vec<[DVec2; 2]>, least_side: f64) -> Self {
        let mut sides: Vec<f64> = bounds.iter().map(|[low, high]| (*high - *low).max_element()).collect();
        sides.retain(|side| side.is_finite());
        let middle = sides.len() / 2;
        let usual = if sides.is_empty() { 0.0 } else { *sides.select_nth_unstable_by(middle, f64::total_cmp).1 };
        let mut terrain = Self { per_meter: 1.0 / usual.max(least_side), bounds, ..Self::default() };
        let mut places: Vec<([i32; 2], u32)> = Vec::with_capacity(2 * terrain.bounds.len());
        for (row, &[low, high]) in (0..).zip(&terrain.bounds) {
            let span = terrain.span(low, high);
            if span.count() <= MOST_SQUARES {
                places.extend(span.squares().map(|square| (square, row)));
            } else {
                terrain.at_large.push(row);
            }
        }
        places.sort_unstable();
        for same in places.chunk_by(|a, b| a.0 == b.0) {
            let first = terrain.rows.len() as u32;
            terrain.rows.extend(same.iter().map(|(_, row)| row));
            terrain.squares.insert(same[0].0, first..terrain.rows.len() as u32);
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

    /// The rows of those that meet a square.
    pub(crate) fn rows_of(&self, square: [i32; 2]) -> &[u32] {
        self.squares.get(&square).map_or(&[], |Range { start, end }| &self.rows[*start as usize..*end as usize])
    }

    /// The rows of those that are in no square, ascending: they may be anywhere.
    pub(crate) fn at_large(&self) -> &[u32] {
        &self.at_large
    }

    /// Hands over each of the others whose box meets a rectangle, in any order, and maybe more than once.
    pub(crate) fn meeting(&self, low: DVec2, high: DVec2, mut found: impl FnMut(u32)) {
        let mut look_at = |row: u32| {
            let [own_low, own_high] = self.bounds[row as usize];
            if (own_low.cmple(high) & own_high.cmpge(low)).all() {
                found(row);
            }
        };
        match self.squares(low, high, self.squares.len()) {
            Some(squares) => squares.for_each(|square| self.rows_of(square).iter().copied().for_each(&mut look_at)),
            None => self.rows.iter().copied().for_each(look_at),
        }
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
            let terrain = Terrain::new(boxes.clone(), 0.5);
            prop_assert!(terrain.at_large.is_sorted());
            prop_assert!((0..boxes.len() as u32).rev().take(endless).all(|row| terrain.at_large.contains(&row)));
            for [low, high] in asked.into_iter().map(around) {
                let mut found = Vec::new();
                terrain.meeting(low, high, |row| found.push(row));
                ascend(&mut found);
                let meets = |row: &u32| {
                    let [own_low, own_high] = boxes[*row as usize];
                    !terrain.at_large.contains(row) && own_low.cmple(high).all() && own_high.cmpge(low).all()
                };
                prop_assert_eq!(found, (0..boxes.len() as u32).filter(meets).collect::<Vec<_>>());
            }
        }
    }
}
