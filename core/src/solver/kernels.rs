//! The passes over all contacts, eight lanes at a time.

use super::bodies::SolverBodies;
use super::groups::{Color, Group, PointRows};
use super::lanes::{Kernel, Lanes, Row};
use crate::setup::Setup;
use crate::solver::softness::Softness;

/// What is done to one group of contacts.
pub(super) trait Pass: Copy {
    fn group<V: Lanes, const N: usize>(&self, group: &mut Group<N>, bodies: &mut SolverBodies);
}

/// One pass over all groups in the order of their colors.
pub(super) struct EachColor<'a, P> {
    pub(super) pass: P,
    pub(super) singles: &'a mut [Group<1>],
    pub(super) doubles: &'a mut [Group<2>],
    pub(super) colors: &'a [Color],
    pub(super) bodies: &'a mut SolverBodies,
}

impl<P: Pass> Kernel for EachColor<'_, P> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lanes>(self) {
        for color in self.colors {
            for group in &mut self.singles[color.singles.clone()] {
                self.pass.group::<V, 1>(group, self.bodies);
            }
            for group in &mut self.doubles[color.doubles.clone()] {
                self.pass.group::<V, 2>(group, self.bodies);
            }
        }
    }
}

/// A direction at one point of eight contacts: how an impulse along it moves both bodies, and how their motion shows in
/// it.
struct Axis<V> {
    ax: V,
    ay: V,
    aw: V,
    bx: V,
    by: V,
    bw: V,
}

impl<V: Lanes> Axis<V> {
    #[inline(always)]
    fn speed(&self, a: &[V; 4], b: &[V; 4]) -> V {
        let on_b = self.bx.mul(b[0]).add(self.by.mul(b[1])).add(self.bw.mul(b[2]));
        let on_a = self.ax.mul(a[0]).add(self.ay.mul(a[1])).add(self.aw.mul(a[2]));
        on_b.sub(on_a)
    }

    #[inline(always)]
    fn push(&self, impulse: V, a: &mut [V; 4], b: &mut [V; 4]) {
        a[0] = a[0].sub(self.ax.mul(impulse));
        a[1] = a[1].sub(self.ay.mul(impulse));
        a[2] = a[2].sub(self.aw.mul(impulse));
        b[0] = b[0].add(self.bx.mul(impulse));
        b[1] = b[1].add(self.by.mul(impulse));
        b[2] = b[2].add(self.bw.mul(impulse));
    }
}

/// The normals of a group, loaded once for all its points.
struct Normals<V> {
    ax: V,
    ay: V,
    bx: V,
    by: V,
}

impl<V: Lanes> Normals<V> {
    #[inline(always)]
    fn load<const N: usize>(group: &Group<N>) -> Self {
        Self {
            ax: V::load(&group.normal_ax),
            ay: V::load(&group.normal_ay),
            bx: V::load(&group.normal_bx),
            by: V::load(&group.normal_by),
        }
    }

    #[inline(always)]
    fn normal(&self, rows: &PointRows) -> Axis<V> {
        let (aw, bw) = (V::load(&rows.normal_a), V::load(&rows.normal_b));
        Axis { ax: self.ax, ay: self.ay, aw, bx: self.bx, by: self.by, bw }
    }

    /// A quarter turn clockwise from the normal.
    #[inline(always)]
    fn tangent(&self, rows: &PointRows) -> Axis<V> {
        let zero = V::splat(0.0);
        let (aw, bw) = (V::load(&rows.tangent_a), V::load(&rows.tangent_b));
        Axis { ax: self.ay, ay: zero.sub(self.ax), aw, bx: self.by, by: zero.sub(self.bx), bw }
    }
}

impl<V: Lanes> Normals<V> {
    /// Friction at all points, within the cone that the normal impulses of this moment allow. In solve and in relax: with
    /// friction in relax alone, piles over a tile border jitter a hundred times more.
    #[inline(always)]
    fn rub<const N: usize>(&self, points: &mut [PointRows; N], friction: V, a: &mut [V; 4], b: &mut [V; 4]) {
        for rows in points {
            let axis = self.tangent(rows);
            let most = friction.mul(V::load(&rows.normal_impulse));
            let old = V::load(&rows.tangent_impulse);
            let wanted = V::load(&rows.tangent_mass).mul(axis.speed(a, b));
            let new = old.sub(wanted).min(most).max(V::splat(0.0).sub(most));
            axis.push(accumulate(&mut rows.tangent_impulse, old, new), a, b);
        }
    }
}

/// Adds to an accumulated impulse and returns what was added.
#[inline(always)]
fn accumulate<V: Lanes>(row: &mut Row, old: V, new: V) -> V {
    new.store(row);
    new.sub(old)
}

/// Gives both bodies the impulses of the last substep.
#[derive(Clone, Copy)]
pub(super) struct WarmStart;

impl Pass for WarmStart {
    #[inline(always)]
    fn group<V: Lanes, const N: usize>(&self, group: &mut Group<N>, bodies: &mut SolverBodies) {
        let mut a = V::gather(&bodies.velocity, &group.a);
        let mut b = V::gather(&bodies.velocity, &group.b);
        let normals = Normals::<V>::load(group);
        for rows in &group.points {
            normals.normal(rows).push(V::load(&rows.normal_impulse), &mut a, &mut b);
            normals.tangent(rows).push(V::load(&rows.tangent_impulse), &mut a, &mut b);
        }
        V::scatter(a, &mut bodies.velocity, &group.a);
        V::scatter(b, &mut bodies.velocity, &group.b);
    }
}

/// Normal impulses, with the soft push out of overlap, then friction.
#[derive(Clone, Copy)]
pub(super) struct Solve {
    softness: Softness,
    static_softness: Softness,
    push_out_speed: f32,
    inv_h: f32,
}

impl Solve {
    pub(super) fn new(setup: &Setup) -> Self {
        Self {
            softness: setup.softness,
            static_softness: setup.static_softness,
            push_out_speed: setup.params.push_out_speed,
            inv_h: 1.0 / setup.h,
        }
    }
}

impl Pass for Solve {
    #[inline(always)]
    fn group<V: Lanes, const N: usize>(&self, group: &mut Group<N>, bodies: &mut SolverBodies) {
        let mut a = V::gather(&bodies.velocity, &group.a);
        let mut b = V::gather(&bodies.velocity, &group.b);
        let normals = Normals::<V>::load(group);
        let fixed = V::load(&group.fixed);
        let either = |of: fn(&Softness) -> f32| {
            fixed.if_positive(V::splat(of(&self.static_softness)), V::splat(of(&self.softness)))
        };
        let (rate, mass_scale, impulse_scale) =
            (either(|s| s.bias_rate), either(|s| s.mass_scale), either(|s| s.impulse_scale));
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        for rows in &mut group.points {
            let axis = normals.normal(rows);
            let separation = V::load(&rows.separation);
            let old = V::load(&rows.normal_impulse);
            // Apart: may close the gap within the substep, no more. Overlapping: pushed out softly.
            let push = rate.mul(separation).max(V::splat(-self.push_out_speed));
            let bias = separation.if_positive(separation.mul(V::splat(self.inv_h)), push);
            let mass_scale = separation.if_positive(one, mass_scale);
            let impulse_scale = separation.if_positive(zero, impulse_scale);
            let speed = axis.speed(&a, &b);
            let wanted = V::load(&rows.normal_mass).mul(mass_scale.mul(speed).add(bias));
            let new = old.sub(wanted).sub(impulse_scale.mul(old)).max(zero);
            axis.push(accumulate(&mut rows.normal_impulse, old, new), &mut a, &mut b);
        }
        normals.rub(&mut group.points, V::load(&group.friction), &mut a, &mut b);
        V::scatter(a, &mut bodies.velocity, &group.a);
        V::scatter(b, &mut bodies.velocity, &group.b);
    }
}

/// Normal impulses without the push, then friction, at the poses after the substep. Keeps the separations, which hold
/// until bodies move again: in the next substep's solve. With `TOTALS`, sums impulses over the step.
#[derive(Clone, Copy)]
pub(super) struct Relax<const TOTALS: bool> {
    inv_h: f32,
}

impl<const TOTALS: bool> Relax<TOTALS> {
    pub(super) fn new(setup: &Setup) -> Self {
        Self { inv_h: 1.0 / setup.h }
    }
}

impl<const TOTALS: bool> Pass for Relax<TOTALS> {
    #[inline(always)]
    fn group<V: Lanes, const N: usize>(&self, group: &mut Group<N>, bodies: &mut SolverBodies) {
        let mut a = V::gather(&bodies.velocity, &group.a);
        let mut b = V::gather(&bodies.velocity, &group.b);
        let pose_a = V::gather(&bodies.pose, &group.a);
        let pose_b = V::gather(&bodies.pose, &group.b);
        let normals = Normals::<V>::load(group);
        let zero = V::splat(0.0);
        for rows in &mut group.points {
            let axis = normals.normal(rows);
            let moved_a = axis.ax.mul(pose_a[0]).add(axis.ay.mul(pose_a[1])).add(axis.aw.mul(pose_a[3]));
            let moved_a = moved_a.add(V::load(&rows.depth_a).mul(pose_a[2]));
            let moved_b = axis.bx.mul(pose_b[0]).add(axis.by.mul(pose_b[1])).add(axis.bw.mul(pose_b[3]));
            let moved_b = moved_b.add(V::load(&rows.depth_b).mul(pose_b[2]));
            let separation = V::load(&rows.first_separation).add(moved_b.sub(moved_a));
            separation.store(&mut rows.separation);
            let bias = separation.max(zero).mul(V::splat(self.inv_h));
            let old = V::load(&rows.normal_impulse);
            let wanted = V::load(&rows.normal_mass).mul(axis.speed(&a, &b).add(bias));
            let new = old.sub(wanted).max(zero);
            axis.push(accumulate(&mut rows.normal_impulse, old, new), &mut a, &mut b);
            if TOTALS {
                V::load(&rows.total_normal).add(new).store(&mut rows.total_normal);
            }
        }
        normals.rub(&mut group.points, V::load(&group.friction), &mut a, &mut b);
        if TOTALS {
            for rows in &mut group.points {
                V::load(&rows.total_tangent).add(V::load(&rows.tangent_impulse)).store(&mut rows.total_tangent);
            }
        }
        V::scatter(a, &mut bodies.velocity, &group.a);
        V::scatter(b, &mut bodies.velocity, &group.b);
    }
}
