//! Paths: where a body is that moves whatever it meets, as a function of time alone.
//!
//! Every tile and every rank computes the same numbers of the number of a step, so nobody need tell anybody.

use crate::model::math::Rot;
use glam::{DVec2, Vec2};
use std::f64::consts::TAU;

/// How a kinematic body moves. Time counts from the beginning of the run; where the body is given to be is the beginning of a line and
/// the middle of any other way.
#[derive(Clone, Copy, PartialEq, Default, Debug)]
pub struct Path {
    /// How its center moves.
    pub travel: Travel,
    /// How fast it turns, in rad/s, counter-clockwise.
    pub turning: f64,
}

/// How the center of a kinematic body moves.
#[derive(Clone, Copy, PartialEq, Default, Debug)]
pub enum Travel {
    /// It stays where it is.
    #[default]
    Rest,
    /// Along a line, for ever.
    Line {
        /// In m/s.
        velocity: DVec2,
    },
    /// To and fro along a line.
    Sine {
        /// From the middle to an end, in m.
        amplitude: DVec2,
        /// To an end, to the other, and back to the middle takes so long, in s.
        period: f64,
        /// At time 0, as a part of a whole turn: from a quarter on it is at an end.
        phase: f64,
    },
    /// On a circle.
    Circle {
        /// In m.
        radius: f64,
        /// Once round takes so long, in s; negative: clockwise.
        period: f64,
        /// At time 0, as a part of a whole turn: 0 is to the right of the middle.
        phase: f64,
    },
}

/// Where a body is, how it is turned, and how it gets on from there within a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Course {
    pub(crate) position: DVec2,
    pub(crate) rotation: Rot,
    pub(crate) velocity: Vec2,
    pub(crate) angular_velocity: f32,
}

impl Path {
    /// No static, and no surface of one, is faster than this, in m/s or rad/s.
    pub const FASTEST: f64 = 1e9;

    /// Whether its numbers are finite, periods not zero, and it nowhere faster than [`FASTEST`](Self::FASTEST).
    pub fn is_valid(&self) -> bool {
        let turns = |period: f64, phase: f64| period != 0.0 && phase.is_finite();
        let speed = match self.travel {
            Travel::Rest => 0.0,
            Travel::Line { velocity } => velocity.length(),
            Travel::Sine { amplitude, period, phase } if turns(period, phase) => {
                amplitude.length() * (TAU / period).abs()
            }
            Travel::Circle { radius, period, phase } if turns(period, phase) => (radius * TAU / period).abs(),
            Travel::Sine { .. } | Travel::Circle { .. } => f64::NAN,
        };
        speed <= Self::FASTEST && self.turning.abs() <= Self::FASTEST
    }

    /// How far its center has come at a time, in m.
    fn travelled(&self, time: f64) -> DVec2 {
        // Whole turns go first, so that a late step is as exact as an early one.
        let part = |period: f64, phase: f64| (time / period + phase).fract() * TAU;
        match self.travel {
            Travel::Rest => DVec2::ZERO,
            Travel::Line { velocity } => velocity * time,
            Travel::Sine { amplitude, period, phase } => amplitude * libm::sin(part(period, phase)),
            Travel::Circle { radius, period, phase } => {
                let angle = part(period, phase);
                DVec2::new(libm::cos(angle), libm::sin(angle)) * radius
            }
        }
    }

    /// Where its body is as a step begins, and the velocities that bring it to where it is as the next begins.
    pub(crate) fn course(&self, position: DVec2, rotation: Rot, step: u64, dt: f32) -> Course {
        let dt = f64::from(dt);
        let [now, then] = [step, step + 1].map(|step| step as f64 * dt);
        let [here, there] = [now, then].map(|time| self.travelled(time));
        let angle = (self.turning * now / TAU).fract() * TAU;
        let turned = Rot { c: libm::cos(angle) as f32, s: libm::sin(angle) as f32 };
        Course {
            position: position + here,
            rotation: turned.after(rotation).normalized(),
            velocity: ((there - here) / dt).as_vec2(),
            angular_velocity: self.turning as f32,
        }
    }

    /// How its velocity changes in the middle of a step, in m/s^2; zero where it turns back within so few steps that a step is no small part of
    /// its way.
    pub(crate) fn acceleration(&self, step: u64, dt: f32) -> Vec2 {
        const FEW: f64 = 4.0;
        let time = (step as f64 + 0.5) * f64::from(dt);
        let along = |period: f64| -(TAU / period) * (TAU / period);
        let acceleration = match self.travel {
            Travel::Rest | Travel::Line { .. } => DVec2::ZERO,
            Travel::Sine { period, .. } | Travel::Circle { period, .. } if period.abs() < FEW * f64::from(dt) => {
                DVec2::ZERO
            }
            Travel::Sine { period, .. } | Travel::Circle { period, .. } => self.travelled(time) * along(period),
        };
        acceleration.as_vec2()
    }

    /// Where a body on this path is as a step begins, that stands at a place and is turned so where it is given to be: its center in
    /// meters, and its rotation. `dt` is the length of a step in seconds.
    pub fn pose(&self, position: DVec2, rotation: Rot, step: u64, dt: f32) -> (DVec2, Rot) {
        let Course { position, rotation, .. } = self.course(position, rotation, step, dt);
        (position, rotation)
    }

    /// The path of a body that begins where this one's is when so many steps were made: where a line starts, and how it is turned, is the
    /// body's own. `dt` is the length of a step in seconds.
    pub(crate) fn begun_at(&self, step: u64, dt: f32) -> Self {
        let part = |period: f64, phase: f64| (step as f64 * f64::from(dt) / period + phase).fract();
        let travel = match self.travel {
            Travel::Rest | Travel::Line { .. } => self.travel,
            Travel::Sine { amplitude, period, phase } => Travel::Sine { amplitude, period, phase: part(period, phase) },
            Travel::Circle { radius, period, phase } => Travel::Circle { radius, period, phase: part(period, phase) },
        };
        Self { travel, turning: self.turning }
    }

    /// The least and the greatest displacement along each axis, whatever the time.
    pub(crate) fn extent(&self) -> [DVec2; 2] {
        match self.travel {
            Travel::Rest => [DVec2::ZERO; 2],
            Travel::Line { velocity } => {
                let far = |part: f64, sign: f64| if part * sign > 0.0 { sign * f64::INFINITY } else { 0.0 };
                [-1.0, 1.0].map(|sign| DVec2::new(far(velocity.x, sign), far(velocity.y, sign)))
            }
            Travel::Sine { amplitude, .. } => [-amplitude.abs(), amplitude.abs()],
            Travel::Circle { radius, .. } => [DVec2::splat(-radius.abs()), DVec2::splat(radius.abs())],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::body::StaticBody;
    use crate::model::id::GlobalId;
    use crate::model::kind::{Kind, Material};
    use crate::model::shape::Shape;

    fn course(path: Path, step: u64) -> Course {
        path.course(DVec2::new(3.0, 4.0), Rot::IDENTITY, step, 1.0 / 64.0)
    }

    #[test]
    fn a_path_is_where_its_time_has_it() {
        let line = Path { travel: Travel::Line { velocity: DVec2::new(2.0, -1.0) }, turning: 0.5 };
        let at = course(line, 128);
        assert_eq!((at.position, at.velocity), (DVec2::new(7.0, 2.0), Vec2::new(2.0, -1.0)));
        assert!((at.rotation.angle() - 1.0).abs() < 1e-6 && at.angular_velocity == 0.5);
        let sine = Travel::Sine { amplitude: DVec2::new(0.0, 2.0), period: 4.0, phase: 0.0 };
        let at = [64, 128, 192].map(|step| course(Path { travel: sine, turning: 0.0 }, step).position.y);
        assert!((at[0] - 6.0).abs() < 1e-9 && (at[1] - 4.0).abs() < 1e-9 && (at[2] - 2.0).abs() < 1e-9, "{at:?}");
        let circle = Travel::Circle { radius: 2.0, period: -4.0, phase: 0.0 };
        let at = [0, 64].map(|step| course(Path { travel: circle, turning: 0.0 }, step).position);
        assert!((at[0] - DVec2::new(5.0, 4.0)).length() < 1e-9 && (at[1] - DVec2::new(3.0, 2.0)).length() < 1e-9);
    }

    #[test]
    fn a_path_can_begin_at_any_step() {
        for travel in [
            Travel::Rest,
            Travel::Line { velocity: DVec2::new(0.3, 7.0) },
            Travel::Sine { amplitude: DVec2::new(5.0, 1.0), period: 0.7, phase: 0.3 },
            Travel::Circle { radius: 4.0, period: -1.3, phase: 0.9 },
        ] {
            let wheel = Kind::new(Shape::circle(1.0), Material::default());
            let path = Some(Path { travel, turning: -2.0 });
            let fixed = StaticBody { path, ..StaticBody::new(GlobalId(0), wheel, DVec2::new(3.0, 4.0)) };
            let (later, dt) = (fixed.begun_at(77, 1.0 / 64.0), 1.0 / 64.0);
            for step in [0, 1, 500] {
                let ((at, turned), (expected, rotation)) = (later.pose(step, dt), fixed.pose(77 + step, dt));
                assert!((at - expected).length() < 1e-9, "{travel:?}, {step}: {at}, not {expected}");
                assert!((turned.c - rotation.c).abs() + (turned.s - rotation.s).abs() < 1e-6, "{travel:?}, {step}");
            }
        }
    }

    /// A body that goes on by its velocity for a step is where the next step finds it.
    #[test]
    fn velocities_lead_from_step_to_step() {
        for travel in [
            Travel::Line { velocity: DVec2::new(0.3, 7.0) },
            Travel::Sine { amplitude: DVec2::new(5.0, 1.0), period: 0.7, phase: 0.3 },
            Travel::Circle { radius: 4.0, period: 1.3, phase: 0.9 },
        ] {
            let path = Path { travel, turning: -2.0 };
            let [low, high] = path.extent();
            for step in [0, 1, 77, 1_000_000_000] {
                let (at, next) = (course(path, step), course(path, step + 1));
                let led = at.position + at.velocity.as_dvec2() / 64.0;
                assert!((led - next.position).length() < 1e-6 * (1.0 + next.position.length()), "{path:?}, {step}");
                let faster = (next.velocity - at.velocity) * 64.0;
                let half_way = 0.5 * (path.acceleration(step, 1.0 / 64.0) + path.acceleration(step + 1, 1.0 / 64.0));
                assert!((faster - half_way).length() < 0.01 * (1.0 + faster.length()), "{path:?}, {step}");
                let gone = at.position - DVec2::new(3.0, 4.0);
                assert!(gone.cmpge(low - 1e-9).all() && gone.cmple(high + 1e-9).all());
            }
        }
    }

    #[test]
    fn what_is_no_path_is_refused() {
        for travel in [
            Travel::Line { velocity: DVec2::new(f64::NAN, 0.0) },
            Travel::Line { velocity: DVec2::new(1e30, 0.0) },
            Travel::Sine { amplitude: DVec2::ONE, period: 1e-9, phase: 0.0 },
            Travel::Sine { amplitude: DVec2::ONE, period: 0.0, phase: 0.0 },
            Travel::Circle { radius: f64::INFINITY, period: 1.0, phase: 0.0 },
        ] {
            assert!(!Path { travel, turning: 0.0 }.is_valid());
        }
        assert!(!Path { travel: Travel::Rest, turning: f64::NAN }.is_valid());
    }
}
