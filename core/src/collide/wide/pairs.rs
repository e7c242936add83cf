//! The bodies of sixteen pairs, whatever their shapes; and the contacts of those of which at least one is round: of what rolls, as most
//! does in a pile, and of what touches within the step (`wide/touches.rs`).

use super::moments::Search;
use super::touches::Touches;
use crate::collide::broad_phase::Pair;
use crate::collide::manifold::scale_of;
use crate::collide::touch::{ROLLING, TOUCHING, pressed};
use crate::model::contact::{Contact, ContactPoint};
use crate::model::math::Rot;
use crate::parallel::lanes::{Quad, WIDE, Wide, WideRow};
use crate::parallel::vectors::{Vectors, absolute};
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::Vec2;

/// Sixteen pairs of bodies A and B.
#[derive(Default, Debug)]
pub(in crate::collide) struct WidePairs {
    /// One where they pressed at each other in the last step, else zero.
    pressed: WideRow,
    /// One where one of them is a static, else zero.
    fixed: WideRow,
    /// Velocity and rotation.
    a: [Quad; WIDE],
    b: [Quad; WIDE],
    /// From the center of A to that of B, in m; angular velocities of both, in rad/s.
    between: [Quad; WIDE],
    /// Half extents, radius, bounding radius (see `KindRow`).
    kind_a: [Quad; WIDE],
    kind_b: [Quad; WIDE],
}

/// What can be said of sixteen pairs of some kind.
pub(in crate::collide) trait Outlook: Default {
    /// Whether it takes longer than one pair after another where lanes are no registers.
    const NEEDS_REGISTERS: bool = false;

    /// Puts a pair into a lane, and the contact that they had in the last step.
    fn set(&mut self, lane: usize, tile: &Tile, bodies: Pair, known: Option<&Contact>, setup: &Setup);

    /// Tells of all lanes, also of those that were not set.
    fn look<V: Wide>(&mut self, search: Search, setup: &Setup);

    /// Whether it cannot be told here if a pair makes a contact.
    fn is_unsure(&self, lane: usize) -> bool;

    /// Whether it can be told only after a search that was put off.
    fn is_postponed(&self, lane: usize) -> bool;

    /// Whether a pair makes a contact.
    fn meets(&self, lane: usize) -> bool;

    /// The contact of a pair, if it makes one, with the impulses of the last one, and the separation of its points now.
    fn contact(&self, lane: usize, known: Option<&Contact>) -> (Contact, [f32; 2]);
}

/// What can be said of pairs with a round body.
#[derive(Default, Debug)]
pub(in crate::collide) struct RoundOutlook {
    pairs: WidePairs,
    /// Positive if they make a contact, of which the others tell.
    meets: WideRow,
    /// Positive if that cannot be told here.
    unsure: WideRow,
    /// Normal and offset, both rotations, of a [`Contact`]; anchor, separation there and now.
    frames: [Quad; WIDE],
    rotations: [Quad; WIDE],
    points: [Quad; WIDE],
}

impl WidePairs {
    #[inline(always)]
    pub(in crate::collide) fn set(
        &mut self,
        lane: usize,
        tile: &Tile,
        pair: Pair,
        known: Option<&Contact>,
        setup: &Setup,
    ) {
        let (bodies, [a, b]) = (&tile.bodies, pair.map(|body| body as usize));
        let moves = |i: usize| bytemuck::cast([bodies.velocity[i].to_array(), bytemuck::cast(bodies.rotation[i])]);
        let offset = (bodies.position[b] - bodies.position[a]).as_vec2();
        self.a[lane] = moves(a);
        self.b[lane] = moves(b);
        self.between[lane] = [offset.x, offset.y, bodies.angular_velocity[a], bodies.angular_velocity[b]];
        let (kind_a, kind_b) = (setup.kind(bodies.kind[a]), setup.kind(bodies.kind[b]));
        (self.kind_a[lane], self.kind_b[lane]) = (kind_a.outline(), kind_b.outline());
        self.pressed[lane] = if pressed(tile, pair, known, setup) { 1.0 } else { 0.0 };
        self.fixed[lane] = if kind_a.inv_mass * kind_b.inv_mass == 0.0 { 1.0 } else { 0.0 };
    }

    /// As vectors.
    #[inline(always)]
    pub(super) fn load<V: Wide>(&self, setup: &Setup) -> Pairs<V> {
        let [half_x_a, half_y_a, radius_a, bound_a] = V::load_quads(&self.kind_a);
        let [half_x_b, half_y_b, radius_b, bound_b] = V::load_quads(&self.kind_b);
        let [vx_a, vy_a, c_a, s_a] = V::load_quads(&self.a);
        let [vx_b, vy_b, c_b, s_b] = V::load_quads(&self.b);
        let [offset_x, offset_y, w_a, w_b] = V::load_quads(&self.between);
        Pairs {
            offset: Vectors::new(offset_x, offset_y),
            between: Vectors::new(vx_b.sub(vx_a), vy_b.sub(vy_a)),
            half: [Vectors::new(half_x_a, half_y_a), Vectors::new(half_x_b, half_y_b)],
            radius: [radius_a, radius_b],
            bound: [bound_a, bound_b],
            rotation: [Vectors::new(c_a, s_a), Vectors::new(c_b, s_b)],
            spin: [w_a, w_b],
            fixed: V::load(&self.fixed),
            pressed: V::load(&self.pressed),
            dt: V::splat(setup.params.dt),
        }
    }
}

/// The bodies A and B of sixteen pairs, and how they are to each other.
pub(super) struct Pairs<V> {
    pub(super) offset: Vectors<V>,
    pub(super) between: Vectors<V>,
    pub(super) half: [Vectors<V>; 2],
    pub(super) radius: [V; 2],
    pub(super) bound: [V; 2],
    pub(super) rotation: [Vectors<V>; 2],
    pub(super) spin: [V; 2],
    /// One where one of them is a static, else zero.
    pub(super) fixed: V,
    /// One where they pressed at each other in the last step, else zero.
    pub(super) pressed: V,
    pub(super) dt: V,
}

impl<V: Wide> Pairs<V> {
    /// The greatest speed that turning gives a point that it brings nearer to the other: of a round body, none.
    #[inline(always)]
    pub(super) fn sweep(&self, side: usize) -> V {
        let speed = self.bound[side].mul(absolute(self.spin[side]));
        self.half[side].x.if_positive(speed, V::splat(0.0))
    }

    /// See [`scale_of`].
    #[inline(always)]
    pub(super) fn scale(&self) -> V {
        scale_of(self.bound)
    }

    #[inline(always)]
    pub(super) fn far(&self) -> V {
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
    pub(super) fn core_of(&self, of: [Vectors<V>; 2]) -> Vectors<V> {
        Vectors::pick(self.half[0].x, of[0], of[1])
    }

    /// The contact of a round body with what it has touched and still touches, slowly: that of the middle of the step.
    ///
    /// As bodies roll on each other, where they touch moves, and so the arm of what holds them. With the arms of the step's
    /// beginning that force is late, and what rocks is driven: its energy grows by 3/8 (w dt)^2 each step, w being how fast it
    /// rocks, as position is integrated in four parts of a step in which force does not change. With those of the middle it
    /// falls by 1/8 (w dt)^2.
    #[inline(always)]
    fn roll(&self) -> Touches<V> {
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
        // They touch, slowly, and the center of the round one lies in no core.
        let scale = self.scale();
        let slow = scale.mul(V::splat(ROLLING)).sub(absolute(nearer));
        let rolls = slow.min(scale.mul(V::splat(TOUCHING)).sub(now)).min(distance);
        Touches { meets: rolls, unsure: zero, normal, offset, rotation, anchor, separation: now, now }
    }
}

impl Outlook for RoundOutlook {
    #[inline(always)]
    fn set(&mut self, lane: usize, tile: &Tile, bodies: Pair, known: Option<&Contact>, setup: &Setup) {
        self.pairs.set(lane, tile, bodies, known, setup);
    }

    #[inline(always)]
    fn look<V: Wide>(&mut self, _: Search, setup: &Setup) {
        let pairs = &self.pairs;
        let (both, zero) = (pairs.load::<V>(setup), V::splat(0.0));
        let is_slow = V::splat(setup.params.speculative_distance).sub(both.far());
        let pressed = is_slow.if_positive(both.pressed, zero);
        // No closures here: they might be compiled without the lanes' instructions.
        let (one, mut others) = (V::splat(1.0), V::splat(1.0));
        let mut touches = Touches::none();
        if pressed.any_positive() {
            touches = both.roll();
            others = pressed.if_positive(touches.meets, zero).if_positive(zero, one);
        }
        if others.any_positive() {
            touches = Touches::pick(others, &both.touch(setup), &touches);
        }
        touches.meets.store(&mut self.meets);
        touches.unsure.store(&mut self.unsure);
        let Touches { normal, offset, rotation: [a, b], anchor, separation, now, .. } = touches;
        V::store_quads([normal.x, normal.y, offset.x, offset.y], &mut self.frames);
        V::store_quads([a.x, a.y, b.x, b.y], &mut self.rotations);
        V::store_quads([anchor.x, anchor.y, separation, now], &mut self.points);
    }

    #[inline(always)]
    fn is_unsure(&self, lane: usize) -> bool {
        self.unsure[lane] > 0.0
    }

    #[inline(always)]
    fn is_postponed(&self, _: usize) -> bool {
        false
    }

    #[inline(always)]
    fn meets(&self, lane: usize) -> bool {
        self.meets[lane] > 0.0
    }

    #[inline(always)]
    fn contact(&self, lane: usize, known: Option<&Contact>) -> (Contact, [f32; 2]) {
        let ([nx, ny, x, y], [ca, sa, cb, sb]) = (self.frames[lane], self.rotations[lane]);
        let [anchor_x, anchor_y, separation, now] = self.points[lane];
        let (normal_impulse, tangent_impulse) =
            known.map_or((0.0, 0.0), |known| (known.points[0].normal_impulse, known.points[0].tangent_impulse));
        let anchor = Vec2::new(anchor_x, anchor_y);
        let contact = Contact {
            normal: Vec2::new(nx, ny),
            offset: Vec2::new(x, y),
            rotation_a: Rot { c: ca, s: sa },
            rotation_b: Rot { c: cb, s: sb },
            points: [
                ContactPoint { anchor, separation, normal_impulse, tangent_impulse, feature: 0 },
                ContactPoint::NONE,
            ],
        };
        (contact, [now, 0.0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collide::touch::touch;
    use crate::collide::wide::boxes::WideBoxes;
    use crate::collide::wide::discs::WideDiscs;
    use crate::collide::wide::moments::PointOutlook;
    use crate::collide::wide::polygons::WidePolygons;
    use crate::model::body::Body;
    use crate::model::id::{GlobalId, KindId, TileId};
    use crate::model::kind::Form;
    use crate::model::params::{Instructions, Params};
    use crate::parallel::lanes::{Kernel, LaneSet, Lanes};
    use crate::testing::{any_convex, any_gap, any_rotation, at_gap, cases};
    use crate::tiling::blueprint::Blueprint;
    use crate::tiling::partition::Partition;
    use bytemuck::Zeroable;
    use glam::DVec2;
    use proptest::prelude::*;

    /// The lane that is looked at.
    const LANE: usize = 5;

    /// Of a pair, in each of sixteen lanes, its contact; none where that cannot be told.
    struct Look<'a>(&'a Tile, Option<&'a Contact>, &'a Setup);

    impl Kernel for Look<'_> {
        type Output = Option<Option<(Contact, [f32; 2])>>;
        fn run<V: Lanes>(self) -> Self::Output {
            let Self(tile, known, setup) = self;
            let mut forms = [0, 1].map(|body| setup.kind(tile.bodies.kind[body]).form);
            forms.sort_by_key(|&form| form as usize);
            match forms {
                // Who pressed rolls, on what is round or a box, and does not touch anew.
                [Form::Round, Form::Round | Form::Box] => told::<V::Wide, RoundOutlook>(tile, None, setup),
                [Form::Round, Form::Polygon] => told::<V::Wide, PointOutlook<WideDiscs>>(tile, known, setup),
                [Form::Box, Form::Box] => told::<V::Wide, PointOutlook<WideBoxes>>(tile, known, setup),
                [Form::Box | Form::Polygon, Form::Polygon] => {
                    told::<V::Wide, PointOutlook<WidePolygons>>(tile, known, setup)
                }
                _ => None,
            }
        }
    }

    fn told<V: Wide, O: Outlook>(
        tile: &Tile,
        known: Option<&Contact>,
        setup: &Setup,
    ) -> Option<Option<(Contact, [f32; 2])>> {
        let mut outlook = O::default();
        (0..WIDE).for_each(|lane| outlook.set(lane, tile, [0, 1], known, setup));
        outlook.look::<V>(Search::WhereManyNeedIt, setup);
        assert!(!outlook.is_postponed(LANE), "all sixteen need it, or none");
        (!outlook.is_unsure(LANE)).then(|| outlook.meets(LANE).then(|| outlook.contact(LANE, known)))
    }

    /// None at all as often as any other.
    fn any_spin() -> impl Strategy<Value = f32> {
        prop_oneof![Just(0.0_f32), -40.0_f32..40.0]
    }

    proptest! {
        #![proptest_config(cases(8192))]

        /// One moment, and every bit of one contact, whoever looks for it.
        #[test]
        fn sixteen_touch_as_one_does(
            kinds in [any_convex(0.05, 2.0), any_convex(0.05, 2.0)], (x, y) in (-3.0_f64..3.0, -3.0_f64..3.0),
            (vx, vy) in (-200.0_f32..200.0, -200.0_f32..200.0), slowness in 0_u32..4,
            spins in [any_spin(), any_spin()], rotations in [any_rotation(), any_rotation()], gap in any_gap(),
            fixed: bool, presses: bool,
        ) {
            let partition = Partition::uniform(DVec2::ZERO, DVec2::splat(20.0), 1, 1).unwrap();
            let (dynamic, statics) = (kinds.to_vec(), Vec::new());
            let mut setup = Setup::new(&Blueprint { params: Params::default(), partition, kinds: dynamic, statics }).unwrap();
            if fixed {
                setup.kinds[1].inv_mass = 0.0;
            }
            let mut tile = Tile::new(TileId(0), &setup);
            let velocities = [Vec2::ZERO, Vec2::new(vx, vy) * 0.1_f32.powi(slowness as i32)];
            let offset = at_gap(gap, [&setup.kinds[0], &setup.kinds[1]], rotations, DVec2::new(x, y));
            let positions = [DVec2::splat(10.0), DVec2::splat(10.0) + offset];
            for k in 0..2 {
                let (id, kind) = (GlobalId(k as u64), KindId(k as u32));
                let (position, rotation, velocity, angular_velocity) = (positions[k], rotations[k], velocities[k], spins[k]);
                tile.bodies.push(Body { id, kind, position, rotation, velocity, angular_velocity });
            }
            // Whoever pressed did so at another point.
            let point = ContactPoint { normal_impulse: 1.0, feature: ContactPoint::ABSENT - 1, ..ContactPoint::NONE };
            let known = Contact { points: [point, ContactPoint::NONE], ..Contact::zeroed() };
            let has = |form: Form| setup.kinds.iter().any(|kind| kind.form == form);
            let known = (presses && (has(Form::Polygon) || !has(Form::Round))).then_some(&known);
            let expected = touch(&tile, [0, 1], known, &setup);
            for instructions in [Instructions::Auto, Instructions::Portable] {
                let Some(found) = LaneSet::of(instructions).unwrap().run(Look(&tile, known, &setup)) else { continue };
                prop_assert_eq!(found.is_some(), expected.is_some());
                if let (Some((contact, separation)), Some((expected, now))) = (found, expected) {
                    prop_assert_eq!(bytemuck::bytes_of(&contact), bytemuck::bytes_of(&expected));
                    for point in 0..expected.point_count() {
                        prop_assert_eq!(separation[point].to_bits(), now[point].to_bits());
                    }
                }
            }
        }
    }
}
