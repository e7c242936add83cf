//! What the passes of both solvers do to a group of contacts, eight lanes at a time.

use super::group::{Group, PointRows, Sides};
use crate::parallel::lanes::{Lanes, Quad, Row};
use std::cell::Cell;

/// The bodies of a batch, as the contacts of one color see them: each lane reads and writes bodies of its own.
#[derive(Clone, Copy)]
pub(crate) struct Table<'a> {
    pub(crate) velocity: &'a [Cell<Quad>],
    pub(crate) pose: &'a [Cell<Quad>],
}

/// What is done to one group of contacts.
pub(crate) trait Pass: Copy {
    fn group<V: Lanes, const N: usize>(&self, group: &mut Group<N>, bodies: Table<'_>);
}

/// A direction at one point of eight contacts: how an impulse along it moves both bodies, and how their motion shows in
/// it.
pub(crate) struct Axis<V> {
    ax: V,
    ay: V,
    aw: V,
    bx: V,
    by: V,
    bw: V,
}

impl<V: Lanes> Axis<V> {
    #[inline(always)]
    pub(crate) fn speed(&self, a: &[V; 4], b: &[V; 4]) -> V {
        let on_b = self.bx.mul(b[0]).add(self.by.mul(b[1])).add(self.bw.mul(b[2]));
        let on_a = self.ax.mul(a[0]).add(self.ay.mul(a[1])).add(self.aw.mul(a[2]));
        on_b.sub(on_a)
    }

    /// How far the surfaces have moved apart since the step began, in m.
    #[inline(always)]
    pub(crate) fn moved_apart(&self, rows: &PointRows, a: &[V; 4], b: &[V; 4]) -> V {
        let moved_a = self.ax.mul(a[0]).add(self.ay.mul(a[1])).add(self.aw.mul(a[3]));
        let moved_a = moved_a.add(V::load(&rows.depth_a).mul(a[2]));
        let moved_b = self.bx.mul(b[0]).add(self.by.mul(b[1])).add(self.bw.mul(b[3]));
        let moved_b = moved_b.add(V::load(&rows.depth_b).mul(b[2]));
        moved_b.sub(moved_a)
    }

    #[inline(always)]
    pub(crate) fn apply_impulse(&self, impulse: V, a: &mut [V; 4], b: &mut [V; 4]) {
        a[0] = a[0].sub(self.ax.mul(impulse));
        a[1] = a[1].sub(self.ay.mul(impulse));
        a[2] = a[2].sub(self.aw.mul(impulse));
        b[0] = b[0].add(self.bx.mul(impulse));
        b[1] = b[1].add(self.by.mul(impulse));
        b[2] = b[2].add(self.bw.mul(impulse));
    }
}

/// The normals of a group, loaded once for all its points.
pub(crate) struct Normals<V> {
    ax: V,
    ay: V,
    bx: V,
    by: V,
}

impl<V: Lanes> Normals<V> {
    #[inline(always)]
    pub(crate) fn load(sides: &Sides) -> Self {
        Self {
            ax: V::load(&sides.normal_ax),
            ay: V::load(&sides.normal_ay),
            bx: V::load(&sides.normal_bx),
            by: V::load(&sides.normal_by),
        }
    }

    #[inline(always)]
    pub(crate) fn normal(&self, rows: &PointRows) -> Axis<V> {
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
    pub(crate) fn apply_friction<const N: usize>(
        &self,
        points: &mut [PointRows; N],
        friction: V,
        a: &mut [V; 4],
        b: &mut [V; 4],
    ) {
        for rows in points {
            let axis = self.tangent(rows);
            let most = friction.mul(V::load(&rows.normal_impulse));
            let old = V::load(&rows.tangent_impulse);
            let wanted = V::load(&rows.tangent_mass).mul(axis.speed(a, b));
            let new = old.sub(wanted).min(most).max(V::splat(0.0).sub(most));
            axis.apply_impulse(accumulate(&mut rows.tangent_impulse, old, new), a, b);
        }
    }
}

/// Adds to an accumulated impulse and returns what was added.
#[inline(always)]
pub(crate) fn accumulate<V: Lanes>(row: &mut Row, old: V, new: V) -> V {
    new.store(row);
    new.sub(old)
}

/// Gives both bodies the impulses of the last substep.
#[derive(Clone, Copy)]
pub(crate) struct WarmStart;

impl Pass for WarmStart {
    #[inline(always)]
    fn group<V: Lanes, const N: usize>(&self, group: &mut Group<N>, bodies: Table<'_>) {
        let mut a = V::gather(bodies.velocity, &group.sides.a);
        let mut b = V::gather(bodies.velocity, &group.sides.b);
        let normals = Normals::<V>::load(&group.sides);
        for rows in &group.points {
            normals.normal(rows).apply_impulse(V::load(&rows.normal_impulse), &mut a, &mut b);
            normals.tangent(rows).apply_impulse(V::load(&rows.tangent_impulse), &mut a, &mut b);
        }
        V::scatter(a, bodies.velocity, &group.sides.a);
        V::scatter(b, bodies.velocity, &group.sides.b);
    }
}
