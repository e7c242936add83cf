//! Eight pairs that had a contact in the last step at once: how far they move within this one, and the contacts of what rolls.
//!
//! In a pile, of most pairs nothing more is asked.

use crate::collide::broad_phase::Pair;
use crate::model::contact::Contact;
use crate::parallel::lanes::{LANES, Lanes, Quad, Row};
use crate::parallel::vectors::Vectors;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::Vec2;

/// Surfaces nearer than this touch, in m.
pub(super) const TOUCHING: f32 = 0.002;

/// Who rolls comes no nearer than this in half a step, and goes no further away, in m.
const ROLLING: f32 = 0.0005;

/// Eight pairs of bodies A and B.
#[derive(Default, Debug)]
pub(super) struct EightPairs {
    /// Velocity and rotation.
    a: [Quad; LANES],
    b: [Quad; LANES],
    /// From the center of A to that of B, in m; angular velocities of both, in rad/s.
    between: [Quad; LANES],
    /// Half extents, radius, bounding radius (see `KindRow`).
    kind_a: [Quad; LANES],
    kind_b: [Quad; LANES],
}

/// What can be said of them.
#[derive(Default, Debug)]
pub(super) struct Outlook {
    /// How far surfaces can move against each other within the step, in m.
    far: Row,
    /// Positive if they may be rolling on each other; then `frames`, `rotations` and `points` hold.
    rolls: Row,
    /// Normal and offset, both rotations, anchor and separation, of a [`Contact`].
    frames: [Quad; LANES],
    rotations: [Quad; LANES],
    points: [Quad; LANES],
}

impl EightPairs {
    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, tile: &Tile, [a, b]: Pair, setup: &Setup) {
        let (bodies, a, b) = (&tile.bodies, a as usize, b as usize);
        let moves = |i: usize| bytemuck::cast([bodies.velocity[i].to_array(), bytemuck::cast(bodies.rotation[i])]);
        let offset = (bodies.position[b] - bodies.position[a]).as_vec2();
        self.a[lane] = moves(a);
        self.b[lane] = moves(b);
        self.between[lane] = [offset.x, offset.y, bodies.angular_velocity[a], bodies.angular_velocity[b]];
        self.kind_a[lane] = setup.kind(bodies.kind[a]).outline();
        self.kind_b[lane] = setup.kind(bodies.kind[b]).outline();
    }

    /// Tells of all lanes, also of those that were not set.
    #[inline(always)]
    pub(super) fn look<V: Lanes>(&self, setup: &Setup, outlook: &mut Outlook) {
        let [half_x_a, half_y_a, radius_a, bound_a] = V::load_quads(&self.kind_a);
        let [half_x_b, half_y_b, radius_b, bound_b] = V::load_quads(&self.kind_b);
        let [vx_a, vy_a, c_a, s_a] = V::load_quads(&self.a);
        let [vx_b, vy_b, c_b, s_b] = V::load_quads(&self.b);
        let [offset_x, offset_y, w_a, w_b] = V::load_quads(&self.between);
        let eight = Eight {
            offset: Vectors::new(offset_x, offset_y),
            between: Vectors::new(vx_b.sub(vx_a), vy_b.sub(vy_a)),
            half: [Vectors::new(half_x_a, half_y_a), Vectors::new(half_x_b, half_y_b)],
            radius: [radius_a, radius_b],
            bound: [bound_a, bound_b],
            rotation: [Vectors::new(c_a, s_a), Vectors::new(c_b, s_b)],
            spin: [w_a, w_b],
            dt: V::splat(setup.params.dt),
        };
        eight.far().store(&mut outlook.far);
        eight.roll(outlook);
    }
}

/// The bodies A and B of eight pairs, and how they are to each other.
struct Eight<V> {
    offset: Vectors<V>,
    between: Vectors<V>,
    half: [Vectors<V>; 2],
    radius: [V; 2],
    bound: [V; 2],
    rotation: [Vectors<V>; 2],
    spin: [V; 2],
    dt: V,
}

impl<V: Lanes> Eight<V> {
    /// The greatest speed that turning gives a point that it brings nearer to the other: of a round body, none.
    #[inline(always)]
    fn sweep(&self, side: usize) -> V {
        let speed = self.bound[side].mul(absolute(self.spin[side]));
        self.half[side].x.if_positive(speed, V::splat(0.0))
    }

    #[inline(always)]
    fn far(&self) -> V {
        let speed = self.between.dot(self.between).sqrt();
        self.dt.mul(speed.add(self.sweep(0)).add(self.sweep(1)))
    }

    /// How a body turns in half a step.
    #[inline(always)]
    fn turning(&self, side: usize) -> Vectors<V> {
        let one = V::splat(1.0);
        // The tangent of half the angle, near enough.
        let t = V::splat(0.25).mul(self.dt).mul(self.spin[side]);
        let t = self.half[side].x.if_positive(t, V::splat(0.0));
        let scale = one.div(one.add(t.mul(t)));
        Vectors::new(one.sub(t.mul(t)), t.add(t)).scaled(scale)
    }

    /// That of the one that has a core, or of B.
    #[inline(always)]
    fn core_of(&self, of: [Vectors<V>; 2]) -> Vectors<V> {
        Vectors::pick(self.half[0].x, of[0], of[1])
    }

    /// The contact of a round body with what it has touched and still touches, slowly: that of the middle of the step.
    ///
    /// As bodies roll on each other, where they touch moves, and so the arm of what holds them. With the arms of the step's
    /// beginning that force is late, and what rocks is driven: its energy grows by 3/8 (w dt)^2 each step, w being how fast it
    /// rocks, as position is integrated in four parts of a step in which force does not change. With those of the middle it
    /// falls by 1/8 (w dt)^2.
    #[inline(always)]
    fn roll(&self, outlook: &mut Outlook) {
        let (zero, half, one) = (V::splat(0.0), V::splat(0.5), V::splat(1.0));
        let time = half.mul(self.dt);
        let offset = self.offset.plus(self.between.scaled(time));
        let turning = [self.turning(0), self.turning(1)];
        let rotation = [turning[0].rotate(self.rotation[0]), turning[1].rotate(self.rotation[1])];
        // Seen from the one that has a core, or from B: its point nearest to the center of the other (see `manifold/round.rs`).
        let has_core = self.half[0].x;
        let core = self.core_of(self.half);
        let (core_rotation, core_turning) = (self.core_of(rotation), self.core_of(turning));
        let way = has_core.if_positive(one, zero.sub(one));
        let center = core_rotation.back().rotate(offset.scaled(way));
        let inside = core.hold(center);
        let away = center.minus(inside);
        let distance = away.dot(away).sqrt();
        let outward = core_rotation.rotate(away.scaled(one.div(distance)));
        let separation = distance.sub(self.radius[0].add(self.radius[1]));
        let out = has_core.if_positive(self.radius[0], self.radius[1]).add(half.mul(separation));
        let arm = core_rotation.rotate(inside).plus(outward.scaled(out));
        let normal = outward.scaled(way);
        // How far turning brings the surface of the core to the other, at that point.
        let swing = core_turning.x.sub(one).mul(arm.dot(outward)).add(core_turning.y.mul(arm.cross(outward)));
        let nearer = self.between.dot(normal).mul(time).sub(swing);
        let now = separation.sub(nearer);
        // As if they had come so near at once, along the normal.
        let from = offset.scaled(has_core.if_positive(zero, one));
        let anchor = from.plus(arm).minus(normal.scaled(half.mul(nearer)));
        let offset = offset.minus(normal.scaled(nearer));
        V::store_quads([normal.x, normal.y, offset.x, offset.y], &mut outlook.frames);
        V::store_quads([rotation[0].x, rotation[0].y, rotation[1].x, rotation[1].y], &mut outlook.rotations);
        V::store_quads([anchor.x, anchor.y, now, zero], &mut outlook.points);
        // They touch, slowly, the center of the round one lies in no core, and one of them is round.
        let slow = V::splat(ROLLING).sub(absolute(nearer));
        let rolls = slow.min(V::splat(TOUCHING).sub(now)).min(distance);
        has_core.if_positive(self.half[1].x.if_positive(zero, rolls), rolls).store(&mut outlook.rolls);
    }
}

#[inline(always)]
fn absolute<V: Lanes>(x: V) -> V {
    x.max(V::splat(0.0).sub(x))
}

impl Outlook {
    /// Whether surfaces move by less than the speculative distance.
    #[inline(always)]
    pub(super) fn is_slow(&self, lane: usize, setup: &Setup) -> bool {
        self.far[lane] < setup.params.speculative_distance
    }

    /// Whether a pair that has touched, and is slow, rolls on.
    #[inline(always)]
    pub(super) fn rolls(&self, lane: usize) -> bool {
        self.rolls[lane] > 0.0
    }

    /// Gives the contact of a pair that rolls the geometry of the middle of the step, and tells the separation of its points now.
    #[inline(always)]
    pub(super) fn roll(&self, lane: usize, contact: &mut Contact) -> [f32; 2] {
        let quads: &mut [Quad; size_of::<Contact>() / size_of::<Quad>()] = bytemuck::cast_mut(contact);
        (quads[0], quads[1]) = (self.frames[lane], self.rotations[lane]);
        let [anchor_x, anchor_y, separation, _] = self.points[lane];
        contact.points[0].anchor = Vec2::new(anchor_x, anchor_y);
        contact.points[0].separation = separation;
        [separation, 0.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collide::touch::is_slow;
    use crate::model::body::Body;
    use crate::model::id::{GlobalId, KindId, TileId};
    use crate::model::params::Params;
    use crate::parallel::lanes::Portable;
    use crate::testing::{any_rotation, cases, circle, rectangle};
    use crate::tiling::blueprint::Blueprint;
    use crate::tiling::partition::TileGrid;
    use glam::DVec2;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(cases(256))]

        /// Which way the narrow phase asks is decided by counts, and must not show.
        #[test]
        fn slow_at_once_is_slow_one_by_one(
            speed in -1.0_f32..1.0, spins in any_rotation(), rotation in any_rotation(), round in any::<[bool; 2]>(),
        ) {
            let grid = TileGrid::new(DVec2::ZERO, DVec2::splat(10.0), 1, 1).unwrap();
            let kinds = round.map(|round| if round { circle(0.3) } else { rectangle(0.4, 0.8) }).to_vec();
            let blueprint = Blueprint { params: Params::default(), grid, kinds, statics: Vec::new() };
            let setup = Setup::new(&blueprint).unwrap();
            let mut tile = Tile::new(TileId(0), &setup);
            let body = |k: u32, spin: f32| Body {
                id: GlobalId(k.into()),
                kind: KindId(k),
                position: DVec2::splat(5.0 + 0.3 * f64::from(k)),
                rotation,
                velocity: Vec2::new(0.2, speed * k as f32),
                angular_velocity: spin,
            };
            tile.bodies.push(body(0, spins.c));
            tile.bodies.push(body(1, 2.0 * spins.s));
            let (mut eight, mut outlook) = (EightPairs::default(), Outlook::default());
            eight.set(3, &tile, [0, 1], &setup);
            eight.look::<Portable>(&setup, &mut outlook);
            prop_assert_eq!(outlook.is_slow(3, &setup), is_slow(&tile, [0, 1], &setup));
        }
    }
}
