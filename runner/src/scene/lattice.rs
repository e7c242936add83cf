//! A square lattice that a number of bodies fill column by column.

/// As many places along x as along y.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    /// Places along a side.
    pub(super) side: u64,
}

impl Lattice {
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
