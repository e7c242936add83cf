//! The Hilbert curve through all tiles.

use atoll_core::{Partition, TileId};

/// All tiles in the order in which the Hilbert curve over the smallest power-of-two square around them visits their low
/// corners.
pub(super) fn hilbert_order(partition: &Partition) -> Vec<usize> {
    let mut tiles: Vec<usize> = (0..partition.tiles()).collect();
    tiles.sort_by_cached_key(|&tile| {
        let ([column, row], [columns, rows]) = partition.cell(TileId(tile as u32));
        hilbert_index(columns.max(rows).next_power_of_two(), column, row)
    });
    tiles
}

/// Distance along the Hilbert curve through a square of `side` (a power of two) cells a side, at cell (x, y).
fn hilbert_index(side: u64, mut x: u64, mut y: u64) -> u128 {
    let mut index = 0;
    let mut half = side / 2;
    while half > 0 {
        let (right, upper) = (x & half != 0, y & half != 0);
        let quadrant: u128 = match (right, upper) {
            (false, false) => 0,
            (false, true) => 1,
            (true, true) => 2,
            (true, false) => 3,
        };
        index += quadrant * u128::from(half) * u128::from(half);
        x &= half - 1;
        y &= half - 1;
        // The curve enters the lower quadrants turned by a quarter and mirrored.
        if !upper {
            if right {
                (x, y) = (half - 1 - x, half - 1 - y);
            }
            (x, y) = (y, x);
        }
        half /= 2;
    }
    index
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn the_curve_visits_every_cell_of_a_square_in_unit_steps() {
        for side in [1_usize, 2, 4, 8, 32] {
            let tiles = side as u32;
            let order = hilbert_order(&Partition::uniform(DVec2::ZERO, DVec2::ONE, tiles, tiles).unwrap());
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert!(sorted.into_iter().eq(0..side * side));
            assert_eq!(order[0], 0);
            for pair in order.windows(2) {
                let (dx, dy) = ((pair[0] % side).abs_diff(pair[1] % side), (pair[0] / side).abs_diff(pair[1] / side));
                assert_eq!(dx + dy, 1, "side {side}: {pair:?}");
            }
        }
    }

    #[test]
    fn tiles_of_any_sizes_follow_each_other_along_the_curve() {
        let levels = [1, 2, 2, 2, 2, 1, 2, 2, 3, 3, 3, 3, 2];
        let forest = Partition::forest(DVec2::ZERO, DVec2::ONE, 1, 1, &levels).unwrap();
        let order = hilbert_order(&forest);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..levels.len()));
        for pair in order.windows(2) {
            let [from, to] = [pair[0], pair[1]].map(|tile| TileId(tile as u32));
            assert!(forest.around(from).any(|tile| tile == to), "{pair:?} of {order:?}");
        }
    }
}
