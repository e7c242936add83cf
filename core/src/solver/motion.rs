//! How bodies move within a substep: gravity, damping, speed limits, and positions by velocities.

use crate::model::math::min;
use crate::parallel::lanes::{LANES, Lanes, Quad};
use crate::parallel::vectors::{Vectors, tangent};
use crate::tiling::blueprint::Setup;
use glam::Vec2;

/// The turning of a body is followed in so many parts of a step, at least; further than an eighth of a turn, in rad, it turns in
/// none: what turns faster cannot be followed.
const PARTS: u32 = 4;
const MOST_TURN: f32 = std::f32::consts::FRAC_PI_4;

/// In so many parts the length of a rotation may grow: to a few hundred at most.
const MOST_PARTS: u32 = 24;

/// What moves a body in a substep, but contacts.
#[derive(Clone, Copy)]
pub(crate) struct Motion {
    pub(crate) h: f32,
    /// In so many parts turning is followed in a substep.
    parts: u32,
    /// Whether there are so many parts in a step that the length of what is turned must be seen to.
    grows_long: bool,
    /// Velocity gained.
    gravity: Vec2,
    linear_damping: f32,
    angular_damping: f32,
    max_linear_speed: f32,
    max_angular_speed: f32,
}

/// What moves some bodies in a substep: velocity gained, and what velocities are multiplied by.
#[derive(Clone, Copy)]
pub(crate) struct Outer<V> {
    gravity: [V; 2],
    linear_damping: V,
    angular_damping: V,
}

impl<V: Lanes> Outer<V> {
    /// Velocity that gravity gives.
    #[inline(always)]
    pub(crate) fn gained(&self) -> Vectors<V> {
        Vectors::new(self.gravity[0], self.gravity[1])
    }

    /// Positive where damping takes nothing.
    #[inline(always)]
    pub(crate) fn is_undamped(&self) -> V {
        self.linear_damping.sub(V::splat(1.0 - f32::EPSILON))
    }

    /// Positive where damping takes less than half of the speed.
    #[inline(always)]
    pub(crate) fn is_slight(&self) -> V {
        self.linear_damping.sub(V::splat(0.5))
    }
}

impl Motion {
    pub(crate) fn new(setup: &Setup) -> Self {
        let (h, params) = (setup.h, &setup.params);
        let parts = PARTS.div_ceil(params.integrations());
        Self {
            h,
            parts,
            grows_long: parts * params.integrations() > MOST_PARTS,
            gravity: params.gravity * h,
            linear_damping: 1.0 / (1.0 + h * params.linear_damping),
            angular_damping: 1.0 / (1.0 + h * params.angular_damping),
            max_linear_speed: params.max_linear_speed,
            max_angular_speed: min(params.max_angular_speed, MOST_TURN * parts as f32 / h),
        }
    }

    /// Whether there is gravity.
    #[inline(always)]
    pub(crate) fn falls(&self) -> bool {
        self.gravity != Vec2::ZERO
    }

    /// Whether the velocity of who flies changes, but for bodies that move in ways of their own.
    #[inline(always)]
    pub(crate) fn accelerates(&self) -> bool {
        self.falls() || self.linear_damping < 1.0 || self.max_linear_speed < f32::INFINITY
    }

    /// What moves bodies that move as most do.
    #[inline(always)]
    pub(crate) fn outer<V: Lanes>(&self) -> Outer<V> {
        Outer {
            gravity: [V::splat(self.gravity.x), V::splat(self.gravity.y)],
            linear_damping: V::splat(self.linear_damping),
            angular_damping: V::splat(self.angular_damping),
        }
    }

    /// What moves bodies each of which moves in a way of its own.
    #[inline(always)]
    pub(crate) fn outer_of<V: Lanes>(&self, factors: &[Quad; LANES]) -> Outer<V> {
        let [gravity, linear_damping, angular_damping, _] = V::load_quads(factors);
        let gravity = [self.gravity.x, self.gravity.y].map(|part| V::splat(part).mul(gravity));
        Outer { gravity, linear_damping, angular_damping }
    }

    /// The velocities after the substep's outer forces. The roots of mass and inertia weigh them; ones do not.
    #[inline(always)]
    pub(crate) fn accelerate<V: Lanes>(
        &self,
        outer: Outer<V>,
        [vx, vy, w]: [V; 3],
        root_mass: V,
        root_inertia: V,
    ) -> [V; 3] {
        let Outer { gravity: [gx, gy], linear_damping: damping, angular_damping } = outer;
        let vx = vx.add(root_mass.mul(gx)).mul(damping);
        let vy = vy.add(root_mass.mul(gy)).mul(damping);
        self.limit([vx, vy, w.mul(angular_damping)], root_mass, root_inertia)
    }

    /// Velocities within the limits of speed, weighed as there.
    #[inline(always)]
    pub(crate) fn limit<V: Lanes>(&self, [mut vx, mut vy, w]: [V; 3], root_mass: V, root_inertia: V) -> [V; 3] {
        if self.max_linear_speed < f32::INFINITY {
            let speed = vx.mul(vx).add(vy.mul(vy)).sqrt();
            let limit = V::splat(self.max_linear_speed).mul(root_mass);
            let scale = speed.sub(limit).if_positive(limit.div(speed), V::splat(1.0));
            (vx, vy) = (vx.mul(scale), vy.mul(scale));
        }
        let limit = V::splat(self.max_angular_speed).mul(root_inertia);
        [vx, vy, w.min(limit).max(V::splat(0.0).sub(limit))]
    }

    /// Velocities of centers within the limit of speed.
    #[inline(always)]
    pub(crate) fn limited<V: Lanes>(&self, velocity: Vectors<V>) -> Vectors<V> {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let [vx, vy, _] = self.limit([velocity.x, velocity.y, zero], one, one);
        Vectors::new(vx, vy)
    }

    /// A rotation turned on for a substep, at length one again: by no more than the limit of speed lets it, whatever a blow in between gave.
    #[inline(always)]
    pub(crate) fn turn<V: Lanes>(&self, mut rotation: Vectors<V>, speed: V) -> Vectors<V> {
        let limit = V::splat(self.max_angular_speed);
        let speed = speed.min(limit).max(V::splat(0.0).sub(limit));
        for _ in 0..self.parts {
            rotation = at_length_one(self.turn_part(rotation, speed));
        }
        rotation
    }

    /// As [`turn`](Self::turn), but at any length within reason: for who asks for length one in the end.
    #[inline(always)]
    pub(crate) fn turn_on<V: Lanes>(&self, mut rotation: Vectors<V>, speed: V) -> Vectors<V> {
        if self.grows_long {
            return self.turn(rotation, speed);
        }
        for _ in 0..self.parts {
            rotation = self.turn_part(rotation, speed);
        }
        rotation
    }

    /// Turned along a tangent: longer than before, by half at most.
    #[inline(always)]
    fn turn_part<V: Lanes>(&self, rotation: Vectors<V>, speed: V) -> Vectors<V> {
        let (way, Vectors { x: c, y: s }) = (tangent(V::splat(self.h / self.parts as f32).mul(speed)), rotation);
        Vectors::new(c.sub(way.mul(s)), s.add(way.mul(c)))
    }
}

#[inline(always)]
fn at_length_one<V: Lanes>(rotation: Vectors<V>) -> Vectors<V> {
    rotation.scaled(V::splat(1.0).div(rotation.dot(rotation).sqrt()))
}
