//! When a round body on a straight way meets a box or a polygon that does not turn: as a ray meets one with rounded corners (C. Ericson,
//! "Real-Time Collision Detection", 2005, section 5.5.7). Of boxes, for one pair as for sixteen.
//!
//! A search step by step ends a little before the touch. At a corner the normal is not yet that of the touch there, and who glides fast
//! would be thrown up by a corner that it hardly comes to.

use super::{Approach, NEAR};
use crate::model::convex::Convex;
use crate::model::math::{clamp, dot, max, min};
use crate::parallel::lanes::Arithmetic;
use crate::parallel::vectors::{Vectors, absolute, less};
use glam::Vec2;

/// The way of a center, seen from a box.
#[derive(Clone, Copy)]
pub(in crate::collide) struct Course<V> {
    pub(in crate::collide) center: Vectors<V>,
    pub(in crate::collide) velocity: Vectors<V>,
    /// Half extents of the box.
    pub(in crate::collide) half: Vectors<V>,
    /// So near to the box the center is when they touch.
    pub(in crate::collide) radius: V,
}

impl<V: Arithmetic> Course<V> {
    /// The moment in which the two, apart now, touch, and one, if that is within so many seconds; or else about that in which they are
    /// nearest, and zero.
    #[inline(always)]
    pub(in crate::collide) fn first_touch(&self, dt: V) -> (V, V) {
        let Self { center, velocity, half, radius } = *self;
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        // First it must come into the box that has grown by the radius,
        let (in_x, out_x) = within(center.x, velocity.x, half.x.add(radius));
        let (in_y, out_y) = within(center.y, velocity.y, half.y.add(radius));
        let (enters, leaves) = (in_x.max(in_y), out_x.min(out_y));
        let misses = less(leaves, enters.max(zero)).max(less(dt, enters));
        let meets_grown = misses.if_positive(zero, one);
        let entry = enters.max(zero).min(dt);
        // and there, or it passes by, a face; or else a corner.
        let place = center.plus(velocity.scaled(entry));
        let beyond = absolute(place.x).sub(half.x).min(absolute(place.y).sub(half.y));
        let corner = Vectors::new(signed(half.x, place.x), signed(half.y, place.y));
        let (time, meets_corner, nearest) = point(center.minus(corner), velocity, radius, dt);
        let touches = meets_grown.mul(beyond.if_positive(meets_corner, one));
        let touch = beyond.if_positive(time, entry);
        (touches.if_positive(touch, nearest), touches)
    }
}

impl Approach<'_> {
    /// Whether one of them is round, and the other hardly turns in so many seconds: then the moment in which they touch is known exactly.
    #[inline(always)]
    pub(super) fn is_straight(&self, dt: f32) -> bool {
        let is_one_round = match self.pieces {
            None => self.a.is_round() || self.b.is_round(),
            Some(pieces) => self.is_solid() && pieces.iter().any(|piece| piece.outline.count() == 1),
        };
        is_one_round && (self.a.sweep() + self.b.sweep()) * dt < self.scale() * NEAR
    }

    /// The moment in which these two, apart now, touch, and whether that is within so many seconds; if not, about that in which they are
    /// nearest.
    pub(super) fn first_touch_straight(&self, dt: f32) -> (f32, bool) {
        let is_b_round = match self.pieces {
            None => self.b.is_round(),
            Some([_, b]) => b.outline.count() == 1,
        };
        let (core, way) = if is_b_round { (&self.a, 1.0) } else { (&self.b, -1.0) };
        let seen = |v: Vec2| core.rotation.unrotate(v * way);
        let velocity = seen(self.between);
        let Some([a, b]) = self.pieces else {
            let [center, velocity, half] =
                [seen(self.offset), velocity, core.kind.extent].map(|v| Vectors::new(v.x, v.y));
            let radius = self.a.kind.radius + self.b.kind.radius;
            let (time, touches) = Course { center, velocity, half, radius }.first_touch(dt);
            return (time, touches > 0.0);
        };
        let (outline, disc, round) = if is_b_round { (a, b, &self.b) } else { (b, a, &self.a) };
        let center = seen(self.offset) + core.rotation.unrotate(round.rotation.rotate(disc.outline.corner(0)));
        first_touch_of(&outline.outline, center, velocity, a.radius + b.radius, dt)
    }
}

/// When a center on such a way from a point comes so near to it, one if that is within so many seconds, else zero; and when it is nearest.
#[inline(always)]
fn point<V: Arithmetic>(away: Vectors<V>, velocity: Vectors<V>, radius: V, dt: V) -> (V, V, V) {
    let (zero, one) = (V::splat(0.0), V::splat(1.0));
    let square = velocity.dot(velocity);
    let closing = zero.sub(away.dot(velocity));
    let rest = away.dot(away).sub(radius.mul(radius));
    let root = closing.mul(closing).sub(square.mul(rest));
    let time = rest.div(closing.add(root.max(zero).sqrt())).max(zero);
    let meets = less(zero, closing).mul(less(root, zero).if_positive(zero, less(dt, time).if_positive(zero, one)));
    let nearest = closing.div(square.max(V::splat(f32::MIN_POSITIVE))).max(zero).min(dt);
    (time, meets, nearest)
}

/// As [`Course::first_touch`], of a center and its way seen from any outline.
fn first_touch_of(outline: &Convex, center: Vec2, velocity: Vec2, radius: f32, dt: f32) -> (f32, bool) {
    let of_corner = |corner: Vec2| {
        let ([x, y], [vx, vy]) = ((center - corner).to_array(), velocity.to_array());
        point(Vectors::new(x, y), Vectors::new(vx, vy), radius, dt)
    };
    let mut first = f32::INFINITY;
    for (face, normal) in outline.normals().enumerate() {
        let [from, to] = outline.edge(face);
        let (time, meets, _) = of_corner(from);
        if meets > 0.0 {
            first = min(time, first);
        }
        let (away, edge) = (center - from, to - from);
        let (height, speed) = (dot(away, normal), dot(velocity, normal));
        let time = max((height - radius) / -speed, 0.0);
        let (along, length) = (dot(away + velocity * time, edge), dot(edge, edge));
        // The ends of a line are faces without length: there its corners alone are met.
        let is_over = length > 0.0 && along == clamp(along, 0.0, length);
        if height > 0.0 && speed < 0.0 && time <= dt && is_over {
            first = min(time, first);
        }
    }
    if first <= dt {
        return (first, true);
    }
    let gap = |time: f32| outline.nearest(center + velocity * time).1;
    let moments = outline.corners().map(|corner| of_corner(corner).2).chain([dt]);
    let nearest =
        moments.fold((gap(0.0), 0.0), |least, time| if gap(time) < least.0 { (gap(time), time) } else { least });
    (nearest.1, false)
}

/// When what goes along an axis comes within so far of the middle, and when it leaves.
#[inline(always)]
fn within<V: Arithmetic>(place: V, speed: V, half: V) -> (V, V) {
    let along = speed.if_positive(place, V::splat(0.0).sub(place));
    let speed = absolute(speed).max(V::splat(f32::MIN_POSITIVE));
    (V::splat(0.0).sub(along.add(half)).div(speed), half.sub(along).div(speed))
}

/// A number with the sign of another.
#[inline(always)]
fn signed<V: Arithmetic>(number: V, sign: V) -> V {
    sign.if_positive(number, V::splat(0.0).sub(number))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::piece::pieces;
    use crate::model::shape::Shape;
    use crate::testing::{any_convex, cases};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(cases(2048))]

        /// As seen in many moments, one after the other: of a box both ways, of other shapes by their outlines.
        #[test]
        fn nobody_touches_before_the_moment_that_is_told(
            kind in any_convex(0.1, 2.0),
            center in [-3.0..3.0_f32, -3.0..3.0_f32],
            velocity in [-300.0..300.0_f32, -300.0..300.0_f32],
            upright in 0..4_u8,
            radius in 0.05..1.0_f32,
        ) {
            let (center, velocity) = (Vec2::from(center), match upright {
                0 => Vec2::new(0.0, velocity[1]),
                1 => Vec2::new(velocity[0], 0.0),
                _ => Vec2::from(velocity),
            });
            let piece = pieces(&kind.shape)[0];
            let (reach, dt) = (radius + piece.radius, 1.0 / 60.0);
            let gap = |time: f32| piece.outline.nearest(center + velocity * time).1 - reach;
            prop_assume!(gap(0.0) > 1e-3);
            let mut told = vec![first_touch_of(&piece.outline, center, velocity, reach, dt)];
            if let Shape::Box { half } = kind.shape {
                let [center, velocity, half] = [center, velocity, half].map(|v| Vectors::new(v.x, v.y));
                let (time, touches) = Course { center, velocity, half, radius: reach }.first_touch(dt);
                told.push((time, touches > 0.0));
            }
            for (time, touches) in told {
                prop_assert!((0.0..=dt).contains(&time));
                if touches {
                    prop_assert!(gap(time).abs() < 4e-5, "{} at {time}", gap(time));
                }
                let until = if touches { time } else { dt };
                let least = (0..=400).map(|k| gap(until * k as f32 / 400.0)).fold(f32::INFINITY, f32::min);
                prop_assert!(least > -4e-5, "{least} before {until}");
            }
        }
    }
}
