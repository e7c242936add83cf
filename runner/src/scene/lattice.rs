//! A square lattice that a number of bodies fill column by column.

/// As many places along x as along y.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    /// Places along a side.
    pub(super) side: u64,
}

impl Lattice {
    /// The bodies that stand in the corners of the least block of columns and rows that holds some others. There need not be any
    /// such bodies.
    pub(super) fn corners(self, first: u64, last: u64) -> [u64; 2] {
        let [columns, rows] = block(first, last, self.side);
        [0, 1].map(|end| columns[end] * self.side + rows[end])
    }

    /// The smallest with a place for every body.
    pub(super) fn of(bodies: u64) -> Self {
        let root = bodies.isqrt();
        Self { side: if root * root < bodies { root + 1 } else { root } }
    }

    /// Where a body is along x, the slow index, and along y, the fast one: each in (0, 1).
    pub(super) fn relative(self, body: u64) -> [f64; 2] {
        [body / self.side, body % self.side].map(|i| (i as f64 + 0.5) / self.side as f64)
    }
}

/// The least rows and the least columns that hold some of the bodies that fill rows of some `length`: of both the first and the
/// last.
pub(super) fn block(first: u64, last: u64, length: u64) -> [[u64; 2]; 2] {
    let rows = [first, last].map(|body| body / length);
    let columns = if rows[0] == rows[1] { [first, last].map(|body| body % length) } else { [0, length - 1] };
    [rows, columns]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_just_large_enough() {
        for (bodies, side) in [(1, 1), (4, 2), (5, 3), (700_000, 837)] {
            assert_eq!(Lattice::of(bodies).side, side);
        }
        assert_eq!(Lattice::of(4).relative(1), [0.25, 0.75]);
        assert_eq!(Lattice::of(4).relative(2), [0.75, 0.25]);
    }
}
