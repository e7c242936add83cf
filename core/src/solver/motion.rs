//! How bodies move within a substep: gravity, damping, speed limits, and positions by velocities.

use crate::model::math::min;
use crate::parallel::lanes::Lanes;
use crate::tiling::blueprint::Setup;
use glam::Vec2;

/// The turning of a body is followed in so many parts of a step, at least; further than an eighth of a turn, in rad, it turns in
/// none: what turns faster cannot be followed.
const PARTS: u32 = 4;
const MOST_TURN: f32 = std::f32::consts::FRAC_PI_4;

/// What moves a body in a substep, but contacts.
#[derive(Clone, Copy)]
pub(crate) struct Motion {
    pub(crate) h: f32,
    /// In so many parts turning is followed in a substep.
    parts: u32,
    /// Velocity gained.
    gravity: Vec2,
    linear_damping: f32,
    angular_damping: f32,
    max_linear_speed: f32,
    max_angular_speed: f32,
}

impl Motion {
    pub(crate) fn new(setup: &Setup) -> Self {
        let (h, params) = (setup.h, &setup.params);
        let parts = PARTS.div_ceil(params.integrations());
        Self {
            h,
            parts,
            gravity: params.gravity * h,
            linear_damping: 1.0 / (1.0 + h * params.linear_damping),
            angular_damping: 1.0 / (1.0 + h * params.angular_damping),
            max_linear_speed: params.max_linear_speed,
            max_angular_speed: min(params.max_angular_speed, MOST_TURN * parts as f32 / h),
        }
    }

    /// The velocities after the substep's outer forces. The roots of mass and inertia weigh them; ones do not.
    #[inline(always)]
    pub(crate) fn accelerate<V: Lanes>(&self, [vx, vy, w]: [V; 3], root_mass: V, root_inertia: V) -> [V; 3] {
        let one = V::splat(1.0);
        let damping = V::splat(self.linear_damping);
        let mut vx = vx.add(root_mass.mul(V::splat(self.gravity.x))).mul(damping);
        let mut vy = vy.add(root_mass.mul(V::splat(self.gravity.y))).mul(damping);
        if self.max_linear_speed < f32::INFINITY {
            let speed = vx.mul(vx).add(vy.mul(vy)).sqrt();
            let limit = V::splat(self.max_linear_speed).mul(root_mass);
            let scale = speed.sub(limit).if_positive(limit.div(speed), one);
            (vx, vy) = (vx.mul(scale), vy.mul(scale));
        }
        let limit = V::splat(self.max_angular_speed).mul(root_inertia);
        let w = w.mul(V::splat(self.angular_damping)).min(limit).max(V::splat(0.0).sub(limit));
        [vx, vy, w]
    }

    /// A rotation turned on for a substep, at length one again.
    #[inline(always)]
    pub(crate) fn turn<V: Lanes>(&self, mut c: V, mut s: V, speed: V) -> (V, V) {
        let angle = V::splat(self.h / self.parts as f32).mul(speed);
        for _ in 0..self.parts {
            let turned_c = c.sub(angle.mul(s));
            let turned_s = s.add(angle.mul(c));
            let scale = V::splat(1.0).div(turned_c.mul(turned_c).add(turned_s.mul(turned_s)).sqrt());
            (c, s) = (turned_c.mul(scale), turned_s.mul(scale));
        }
        (c, s)
    }
}
