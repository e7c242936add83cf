//! Where the tiles of a rank are.

use atoll_core::{Partition, TileId};
use glam::DVec2;

/// The tiles that one rank holds, to be asked which rectangles meet any of them.
#[derive(Debug)]
pub(crate) struct Holding<'a> {
    partition: &'a Partition,
    held: Held,
}

#[derive(Debug)]
enum Held {
    /// Of equal tiles: for each column and row, how many are held in earlier columns and rows, row by row.
    Sums(Vec<u32>),
    /// By tile.
    Tiles(Vec<bool>),
}

impl<'a> Holding<'a> {
    /// Of these tiles. Takes time and four bytes for each tile of the partition.
    pub(crate) fn new(partition: &'a Partition, tiles: &[TileId]) -> Self {
        let mut is_held = vec![false; partition.tiles()];
        tiles.iter().for_each(|tile| is_held[tile.0 as usize] = true);
        if !partition.is_uniform() {
            return Self { partition, held: Held::Tiles(is_held) };
        }
        let [columns, rows] = partition.roots().map(|count| count as usize);
        let mut sums = vec![0; (columns + 1) * (rows + 1)];
        for row in 0..rows {
            let mut sum = 0;
            for column in 0..columns {
                sum += u32::from(is_held[row * columns + column]);
                sums[(row + 1) * (columns + 1) + column + 1] = sums[row * (columns + 1) + column + 1] + sum;
            }
        }
        Self { partition, held: Held::Sums(sums) }
    }

    /// Whether a point of a rectangle, borders included, is in one of the tiles.
    pub(crate) fn meets(&self, low: DVec2, high: DVec2) -> bool {
        let sums = match &self.held {
            Held::Sums(sums) => sums,
            Held::Tiles(is_held) => return self.partition.met(low, high).any(|tile| is_held[tile.0 as usize]),
        };
        let columns = self.partition.roots()[0] as usize;
        let place = |point: DVec2| {
            let tile = self.partition.locate(point).0 as usize;
            (tile % columns, tile / columns)
        };
        let ((left, bottom), (right, top)) = (place(low), place(high));
        let sum = |column: usize, row: usize| sums[row * (columns + 1) + column];
        sum(right + 1, top + 1) + sum(left, bottom) > sum(left, top + 1) + sum(right + 1, bottom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rectangle_meets_the_tiles_that_its_points_are_in() {
        let (low, high) = (DVec2::ZERO, DVec2::new(7.0, 5.0));
        let uniform = Partition::uniform(low, high, 7, 5).unwrap();
        let levels: Vec<u8> =
            (0..35).flat_map(|root| vec![u8::from(root % 3 == 0); if root % 3 == 0 { 4 } else { 1 }]).collect();
        let forest = Partition::forest(low, high, 7, 5, &levels).unwrap();
        for partition in [uniform, forest] {
            let held = [3, 8, 9, 20, 34].map(TileId);
            let holding = Holding::new(&partition, &held);
            let none = Holding::new(&partition, &[]);
            for corner in 0..9 * 7 * 9 * 7 {
                let at = |k: i32| DVec2::new(f64::from(k % 9) - 0.5, f64::from(k / 9) - 0.5);
                let (low, high) = (at(corner % 63), at(corner / 63));
                if low.cmpgt(high).any() {
                    continue;
                }
                let part = |k: i32| DVec2::new(f64::from(k % 17), f64::from(k / 17)) / 16.0;
                let mut points = (0..289).map(|k| low + (high - low) * part(k));
                let expected = points.any(|point| held.contains(&partition.locate(point)));
                assert_eq!(holding.meets(low, high), expected, "{low} {high}");
                assert!(!none.meets(low, high));
            }
        }
    }
}
