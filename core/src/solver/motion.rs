//! How bodies move within a substep: gravity, damping, speed limits, and positions by velocities.

use crate::parallel::lanes::Lanes;
use crate::tiling::blueprint::Setup;
use glam::Vec2;

/// What moves a body in a substep, but contacts.
#[derive(Clone, Copy)]
pub(crate) struct Motion {
    pub(crate) h: f32,
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
        Self {
            h,
            gravity: params.gravity * h,
            linear_damping: 1.0 / (1.0 + h * params.linear_damping),
            angular_damping: 1.0 / (1.0 + h * params.angular_damping),
            max_linear_speed: params.max_linear_speed,
            max_angular_speed: params.max_angular_speed,
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
        let mut w = w.mul(V::splat(self.angular_damping));
        if self.max_angular_speed < f32::INFINITY {
            let limit = V::splat(self.max_angular_speed).mul(root_inertia);
            w = w.min(limit).max(V::splat(0.0).sub(limit));
        }
        [vx, vy, w]
    }
}

/// A rotation turned on by a small angle, at length one again.
#[inline(always)]
pub(crate) fn integrate_rotation<V: Lanes>(c: V, s: V, angle: V) -> (V, V) {
    let turned_c = c.sub(angle.mul(s));
    let turned_s = s.add(angle.mul(c));
    let scale = V::splat(1.0).div(turned_c.mul(turned_c).add(turned_s.mul(turned_s)).sqrt());
    (turned_c.mul(scale), turned_s.mul(scale))
}
