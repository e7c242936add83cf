//! What there is to do along an axis of a block, and where to cut it.

/// What there is to do in a block is told in so many bins along either axis.
pub(super) const BINS: usize = 256;

/// What a cut severs is told by what lies within this part of a bin at least: a pile that it is beside now may reach it soon.
const NEAR: f64 = 0.7;

/// All that is in each bin.
pub(super) type Sums = [[u64; 3]; BINS];

/// What came of the ghosts of a block's inner cuts, and of all others.
#[derive(Clone, Copy, Default, Debug)]
pub(super) struct Inner {
    pub(super) inner: f64,
    pub(super) outer: f64,
}

impl Inner {
    /// What is to do with them, where so much is without: with what they enclose, inner cuts grow as its circumference.
    fn with(self, outer: f64) -> f64 {
        if self.outer > 0.0 { outer + self.inner * (outer / self.outer).sqrt() } else { outer }
    }
}

/// All that there is to do in a block, up to the end of each bin along one axis, in the columns of [`Counts`].
#[derive(Clone, Debug)]
pub(super) struct Profile {
    min: f64,
    bin: f64,
    sums: [[f64; BINS + 1]; 3],
}

impl Profile {
    pub(super) fn new(min: u64, max: u64, bins: &Sums) -> Self {
        let mut sums = [[0.0; BINS + 1]; 3];
        for (column, sums) in sums.iter_mut().enumerate() {
            let mut sum = 0;
            for (bin, sums) in bins.iter().zip(&mut sums[1..]) {
                sum += bin[column];
                *sums = sum as f64;
            }
        }
        Self { min: min as f64, bin: (max - min) as f64 / BINS as f64, sums }
    }

    /// What of a column lies before a place, if each bin is filled evenly.
    fn before(&self, column: usize, at: f64) -> f64 {
        let place = ((at - self.min) / self.bin).clamp(0.0, BINS as f64);
        let bin = (place as usize).min(BINS - 1);
        let [low, high] = [self.sums[column][bin], self.sums[column][bin + 1]];
        low + (high - low) * (place - bin as f64)
    }

    /// What is to do on either side of a cut: what lies there and, as ghosts, what lies beyond but within a halo, and what comes of the
    /// ghosts of its inner cuts.
    pub(super) fn sides(&self, at: f64, halo: f64, inner: [Inner; 2]) -> [f64; 2] {
        let own = self.before(0, at);
        let [before, here, behind] = [at - halo, at, at + halo].map(|at| self.before(1, at));
        let ghosts = [self.before(2, at + halo), self.sums[2][BINS] - self.before(2, at - halo)];
        let low = own + (behind - here) + ghosts[0];
        let high = self.sums[0][BINS] - own + (here - before) + ghosts[1];
        [inner[0].with(low), inner[1].with(high)]
    }

    /// What lies within a halo of a cut, as ghosts, if what is near is spread evenly.
    pub(super) fn severed(&self, at: f64, halo: f64) -> f64 {
        let near = halo.max(NEAR * self.bin);
        (self.before(1, at + near) - self.before(1, at - near)) * (halo / near)
    }

    /// Where to cut, so that the first part has a share of what both have to do.
    pub(super) fn place(&self, share: f64, halo: f64, inner: [Inner; 2]) -> f64 {
        let off = |at: f64| {
            let [low, high] = self.sides(at, halo, inner);
            (1.0 - share) * low - share * high
        };
        let edge = |bin: usize| self.min + self.bin * bin as f64;
        let best = (1..BINS).map(|bin| (bin, off(edge(bin)))).min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let (best, off_best) = best.expect("there are some");
        // From there a straight line leads to where it would be exact.
        let next = if off_best < 0.0 { best + 1 } else { best - 1 };
        let off_next = off(edge(next));
        let part = if (off_best < 0.0) == (off_next < 0.0) { 0.0 } else { off_best / (off_best - off_next) };
        edge(best) + (edge(next) - edge(best)) * part
    }

    /// All that bodies of the block itself bring to do.
    pub(super) fn total(&self) -> f64 {
        self.sums[0][BINS]
    }
}
