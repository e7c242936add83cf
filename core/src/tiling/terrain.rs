//! Which statics stand somewhere, found in a time that does not grow with how many there are elsewhere: by squares of one size, of which
//! only those with something in them are kept (a spatial hash: M. Teschner et al., "Optimized Spatial Hashing for Collision
//! Detection of Deformable Objects", 2003).

use glam::DVec2;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// What meets more squares than this is in none of them.
const MOST_SQUARES: f64 = 64.0;

/// The bounding boxes of statics that stay where they are, by place.
#[derive(Clone, Default, Debug)]
pub(crate) struct Terrain {
    /// Squares in a meter.
    per_meter: f64,
    /// For each square with anything in it where its part of `rows` is.
    squares: FxHashMap<[i32; 2], Range<u32>>,
    rows: Vec<u32>,
    /// Low and high corner of each static that is in squares, by row; of others nothing that meets anything.
    bounds: Vec<[DVec2; 2]>,
    /// The rows of all others, ascending: those that move, and those that meet very many squares.
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
    const NOWHERE: [DVec2; 2] = [DVec2::INFINITY, DVec2::NEG_INFINITY];

    /// Of the bounding boxes of all statics, by row, each of two corners; none for those that move. Squares are as wide as most of
    /// these, and no less than `least_side`, in meters. Takes time n log n.
    pub(crate) fn new(boxes: impl Iterator<Item = Option<[DVec2; 2]>>, least_side: f64) -> Self {
        let boxes: Vec<_> = boxes.collect();
        let mut sides: Vec<f64> = boxes.iter().flatten().map(|[low, high]| (*high - *low).max_element()).collect();
        let middle = sides.len() / 2;
        let usual = if sides.is_empty() { 0.0 } else { *sides.select_nth_unstable_by(middle, f64::total_cmp).1 };
        let mut terrain = Self { per_meter: 1.0 / usual.max(least_side), ..Self::default() };
        let mut places: Vec<([i32; 2], u32)> = Vec::with_capacity(2 * boxes.len());
        for (row, bounds) in (0..).zip(boxes) {
            let span = bounds.map(|[low, high]| terrain.span(low, high)).filter(|span| span.count() <= MOST_SQUARES);
            match span {
                Some(span) => places.extend(span.squares().map(|square| (square, row))),
                None => terrain.at_large.push(row),
            }
            terrain.bounds.push(bounds.filter(|_| span.is_some()).unwrap_or(Self::NOWHERE));
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
            None => (0..self.bounds.len() as u32).for_each(look_at),
        }
    }
}

/// A set of rows.
#[derive(Default, Debug)]
pub(crate) struct Rows {
    /// A bit for each.
    words: Vec<u64>,
}

impl Rows {
    /// Adds one.
    #[inline]
    pub(crate) fn insert(&mut self, row: u32) {
        let word = (row / u64::BITS) as usize;
        if word >= self.words.len() {
            self.words.resize(word + 1, 0);
        }
        self.words[word] |= 1 << (row % u64::BITS);
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.words.iter().all(|&word| word == 0)
    }

    /// Takes all out, ascending.
    pub(crate) fn drain(&mut self) -> impl Iterator<Item = u32> + '_ {
        (0..).zip(&mut self.words).flat_map(|(place, word)| {
            let mut left = std::mem::take(word);
            std::iter::from_fn(move || {
                let bit = (left != 0).then(|| left.trailing_zeros())?;
                left &= left - 1;
                Some(place * u64::BITS + bit)
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn rows_come_out_once_and_in_order() {
        let mut rows = Rows::default();
        for round in 0..3 {
            [700, 3, 64, 3, 63, 0, 700, 127 + round].into_iter().for_each(|row| rows.insert(row));
            assert!(rows.drain().eq([0, 3, 63, 64, 127 + round, 700]));
        }
        assert_eq!(rows.drain().next(), None);
    }

    proptest! {
        #[test]
        fn what_meets_a_rectangle_is_found(
            boxes in prop::collection::vec(prop::option::weighted(0.9, (-40.0..40.0, -40.0..40.0, 0.0..3.0, -3.0..6.0)), 0..80),
            asked in prop::collection::vec((-50.0..50.0, -50.0..50.0, 0.0..5.0, -3.0..7.0), 1..20),
        ) {
            // Some are very thin, and some very long.
            let around = |(x, y, width, height): (f64, f64, f64, f64)| {
                let half = DVec2::new(width, height.exp());
                [DVec2::new(x, y) - half, DVec2::new(x, y) + half]
            };
            let boxes: Vec<Option<[DVec2; 2]>> = boxes.into_iter().map(|some| some.map(around)).collect();
            let terrain = Terrain::new(boxes.iter().copied(), 0.5);
            prop_assert!(terrain.at_large.is_sorted());
            let mut rows = Rows::default();
            for [low, high] in asked.into_iter().map(around) {
                terrain.meeting(low, high, |row| rows.insert(row));
                let found: Vec<u32> = rows.drain().collect();
                let meets = |row: &u32| match boxes[*row as usize] {
                    Some([own_low, own_high]) if terrain.at_large.binary_search(row).is_err() => {
                        own_low.cmple(high).all() && own_high.cmpge(low).all()
                    }
                    _ => false,
                };
                prop_assert_eq!(found, (0..boxes.len() as u32).filter(meets).collect::<Vec<_>>());
            }
            let moves = |row: usize| boxes[row].is_none();
            prop_assert!((0..boxes.len()).filter(|row| moves(*row)).all(|row| terrain.at_large.contains(&(row as u32))));
        }
    }
}
