//! How well contacts were solved.

/// The speeds at which the surfaces of contact points still come nearer than they may, summed over points.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Violation {
    pub(crate) points: u64,
    /// Sum and maximum of the speeds, in m/s.
    pub(crate) sum: f64,
    pub(crate) max: f64,
}

impl Violation {
    /// Counts a point. Not above zero: its surfaces come no nearer.
    pub(crate) fn add(&mut self, speed: f64) {
        self.points += 1;
        if speed > 0.0 {
            self.sum += speed;
            self.max = if speed > self.max { speed } else { self.max };
        }
    }
}
