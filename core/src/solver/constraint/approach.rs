//! How two surfaces come nearer each other, and how they meet.

use crate::model::math::{max, min};
use crate::tiling::blueprint::Setup;

/// How two surfaces come nearer along the normal.
pub(super) struct Approach {
    /// In m, at least 0.
    pub(super) separation: f32,
    /// At which speed, in m/s, and what of it is gained, in m/s^2.
    pub(super) closing: f32,
    pub(super) pull: f32,
}

impl Approach {
    /// The speed at which they touch, in m/s. Each bounce would lose a step's fall without what gravity adds over the gap.
    pub(super) fn touching(&self) -> f32 {
        max(self.closing * self.closing + 2.0 * self.pull * self.separation, 0.0).sqrt()
    }

    /// When they touch, in s.
    pub(super) fn time(&self) -> f32 {
        let Self { separation, closing, pull } = *self;
        if closing > 0.0 {
            2.0 * separation / (closing + self.touching())
        } else if pull > 0.0 {
            (self.touching() - closing) / pull
        } else {
            f32::INFINITY
        }
    }

    /// How surfaces meet of which one belongs to a static that gains so much along normal and tangent in each substep, in m/s, towards the
    /// other; its velocity here is the mean of the step.
    pub(super) fn of_oscillating(self, gain: [f32; 2], slip: f32, setup: &Setup) -> Meeting {
        let (dt, h) = (setup.params.dt, setup.params.substep());
        let [comes, slides] = gain.map(|gain| gain / h);
        let begins =
            Self { closing: self.closing - comes * (0.5 * dt), pull: self.pull + comes, separation: self.separation };
        let time = begins.time();
        let touches = begins.closing > 0.0 || time <= dt;
        let (closing, time) = if touches { (begins.touching(), min(time, dt)) } else { (begins.closing, dt) };
        // In the last substep it is on the average as fast as in the middle of that.
        let lead = [comes, slides].map(|gains| gains * (0.5 * h - (dt - time)));
        Meeting { closing, slip: slip - slides * (time - 0.5 * dt), lead, push: max(comes, 0.0) * dt }
    }
}

/// How the surfaces at a point of a contact meet; speeds in m/s.
pub(super) struct Meeting {
    /// At which they come nearer as they touch.
    pub(super) closing: f32,
    /// At which they slide along each other.
    pub(super) slip: f32,
    /// How much faster they part, and slide, as seen from the last substep than as they touch, by what a static gains until then.
    pub(super) lead: [f32; 2],
    /// What a static that comes nearer and nearer gives the other in the step, though it is no blow.
    pub(super) push: f32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::params::Params;
    use crate::tiling::blueprint::Blueprint;
    use crate::tiling::partition::Partition;
    use glam::DVec2;

    /// What goes away from a static as the step begins may meet it within the step, if that comes nearer and nearer.
    #[test]
    fn an_oscillating_static_may_catch_up() {
        let partition = Partition::uniform(DVec2::ZERO, DVec2::ONE, 1, 1).unwrap();
        let blueprint = Blueprint { params: Params::default(), partition, kinds: Vec::new(), statics: Vec::new() };
        let setup = Setup::new(&blueprint).unwrap();
        let (dt, gains) = (setup.params.dt, 60.0);
        for (closing, touches) in [(-0.2, false), (0.1, true), (0.9, true)] {
            let separation = 0.001;
            // The gap closes by the speed at the beginning of the step, and what is gained.
            let gap = |time: f32| separation - (closing - 0.5 * gains * dt) * time - 0.5 * gains * time * time;
            let hit = (0..1000).map(|i| 0.001 * i as f32 * dt).find(|&time| gap(time) <= 0.0);
            assert_eq!(hit.is_some(), touches);
            let approach = Approach { separation, closing, pull: 0.0 };
            let Meeting { closing: found, lead, .. } = approach.of_oscillating([gains * setup.h, 0.0], 0.0, &setup);
            let expected = closing + gains * (hit.unwrap_or(0.0) - 0.5 * dt);
            assert!((found - expected).abs() < 2e-3, "{found} m/s and not {expected}");
            let later = dt - hit.unwrap_or(dt);
            assert!((lead[0] - gains * (0.5 * setup.h - later)).abs() < 2e-3, "{} m/s", lead[0]);
        }
    }
}
