//! The Hilbert curve through a grid of tiles.

/// All tiles (row * columns + column) in the order in which the Hilbert curve over the smallest power-of-two square
/// around the grid visits them.
pub(super) fn hilbert_order(columns: usize, rows: usize) -> Vec<usize> {
    let side = columns.max(rows).next_power_of_two();
    let mut tiles: Vec<usize> = (0..columns * rows).collect();
    tiles.sort_by_cached_key(|tile| hilbert_index(side, tile % columns, tile / columns));
    tiles
}

/// Distance along the Hilbert curve through a square of `side` (a power of two) cells a side, at cell (x, y).
fn hilbert_index(side: usize, mut x: usize, mut y: usize) -> u64 {
    let mut index = 0;
    let mut half = side / 2;
    while half > 0 {
        let (right, upper) = (x & half != 0, y & half != 0);
        let quadrant: u64 = match (right, upper) {
            (false, false) => 0,
            (false, true) => 1,
            (true, true) => 2,
            (true, false) => 3,
        };
        index += quadrant * (half as u64) * (half as u64);
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

    #[test]
    fn the_curve_visits_every_cell_of_a_square_in_unit_steps() {
        for side in [1_usize, 2, 4, 8, 32] {
            let order = hilbert_order(side, side);
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
}
