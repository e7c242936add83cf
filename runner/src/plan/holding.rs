//! Where the tiles of a rank are.

use atoll_core::{TileGrid, TileId};
use glam::DVec2;

/// The tiles that one rank holds, to be asked which rectangles meet any of them.
#[derive(Debug)]
pub(crate) struct Holding<'a> {
    grid: &'a TileGrid,
    /// For each column and row, how many of the tiles in earlier columns and rows are held, row by row.
    sums: Vec<u32>,
}

impl<'a> Holding<'a> {
    /// Of these tiles. Takes time and four bytes for each tile of the grid.
    pub(crate) fn new(grid: &'a TileGrid, tiles: &[TileId]) -> Self {
        let (columns, rows) = (grid.columns(), grid.rows());
        let mut is_held = vec![0_u32; grid.tiles()];
        tiles.iter().for_each(|tile| is_held[tile.0 as usize] = 1);
        let mut sums = vec![0; (columns + 1) * (rows + 1)];
        for row in 0..rows {
            let mut sum = 0;
            for column in 0..columns {
                sum += is_held[row * columns + column];
                sums[(row + 1) * (columns + 1) + column + 1] = sums[row * (columns + 1) + column + 1] + sum;
            }
        }
        Self { grid, sums }
    }

    /// Whether a point of a rectangle, borders included, is in one of the tiles.
    pub(crate) fn meets(&self, low: DVec2, high: DVec2) -> bool {
        let columns = self.grid.columns();
        let place = |point: DVec2| {
            let tile = self.grid.locate(point).0 as usize;
            (tile % columns, tile / columns)
        };
        let ((left, bottom), (right, top)) = (place(low), place(high));
        let sum = |column: usize, row: usize| self.sums[row * (columns + 1) + column];
        sum(right + 1, top + 1) + sum(left, bottom) > sum(left, top + 1) + sum(right + 1, bottom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rectangle_meets_the_tiles_that_its_points_are_in() {
        let grid = TileGrid::new(DVec2::ZERO, DVec2::new(7.0, 5.0), 7, 5).unwrap();
        let held = [3, 8, 9, 20, 34].map(TileId);
        let holding = Holding::new(&grid, &held);
        let none = Holding::new(&grid, &[]);
        for corner in 0..9 * 7 * 9 * 7 {
            let at = |k: i32| DVec2::new(f64::from(k % 9) - 0.5, f64::from(k / 9) - 0.5);
            let (low, high) = (at(corner % 63), at(corner / 63));
            if low.cmpgt(high).any() {
                continue;
            }
            let mut points = (0..81)
                .map(|k| low.lerp(high, 0.0) + (high - low) * DVec2::new(f64::from(k % 9), f64::from(k / 9)) / 8.0);
            assert_eq!(
                holding.meets(low, high),
                points.any(|point| held.contains(&grid.locate(point))),
                "{low} {high}"
            );
            assert!(!none.meets(low, high));
        }
    }
}
