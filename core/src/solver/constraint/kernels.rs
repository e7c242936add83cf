//! What the passes of both solvers do to a group of contacts, sixteen lanes at a time.

use super::group::{Group, PointRows, Sides};
use crate::parallel::lanes::{Quad, Wide, WideRow};
use crate::parallel::vectors::absolute;
use std::cell::Cell;

/// The bodies of a batch, as the contacts of one color see them: each lane reads and writes bodies of its own.
#[derive(Clone, Copy)]
pub(crate) struct Table<'a> {
    pub(crate) velocity: &'a [Cell<Quad>],
    pub(crate) pose: &'a [Cell<Quad>],
}

/// What is done to one group of contacts.
pub(crate) trait Pass: Copy {
    fn group<V: Wide, const N: usize>(&self, group: &mut Group<N>, bodies: Table<'_>);
}

/// A direction at one point of sixteen contacts: how an impulse along it moves both bodies, and how their motion shows in
/// it.
pub(crate) struct Axis<V> {
    ax: V,
    ay: V,
    aw: V,
    bx: V,
    by: V,
    bw: V,
}

impl<V: Wide> Axis<V> {
    #[inline(always)]
    pub(crate) fn speed(&self, a: &[V; 4], b: &[V; 4]) -> V {
        let on_b = self.bx.mul(b[0]).add(self.by.mul(b[1])).add(self.bw.mul(b[2]));
        let on_a = self.ax.mul(a[0]).add(self.ay.mul(a[1])).add(self.aw.mul(a[2]));
        on_b.sub(on_a)
    }

    /// How far the surfaces have moved apart along this normal since the step began, in m. By what a turn takes from the arm along the
    /// normal, which is the tangent's moment arm, both come away from where they were; but not those of round bodies.
    #[inline(always)]
    fn moved_apart(&self, rows: &PointRows, a: &[V; 4], b: &[V; 4]) -> V {
        let moved_a = self.ax.mul(a[0]).add(self.ay.mul(a[1])).add(self.aw.mul(a[3]));
        let moved_a = moved_a.add(V::load(&rows.tangent_a).mul(a[2]));
        let moved_b = self.bx.mul(b[0]).add(self.by.mul(b[1])).add(self.bw.mul(b[3]));
        let moved_b = moved_b.add(V::load(&rows.tangent_b).mul(b[2]));
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

/// The normals of a group, times the roots of both bodies' inverse masses: once for all its points.
pub(crate) struct Normals<V> {
    ax: V,
    ay: V,
    bx: V,
    by: V,
}

impl<V: Wide> Normals<V> {
    /// Of bodies of such velocities.
    #[inline(always)]
    pub(crate) fn load(sides: &Sides, a: &[V; 4], b: &[V; 4]) -> Self {
        let (x, y) = (V::load(&sides.normal_x), V::load(&sides.normal_y));
        let (root_a, root_b) = (absolute(a[3]), absolute(b[3]));
        Self { ax: x.mul(root_a), ay: y.mul(root_a), bx: x.mul(root_b), by: y.mul(root_b) }
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

impl<V: Wide> Normals<V> {
    /// Takes the separations that bodies of such velocities have moved to.
    #[inline(always)]
    pub(crate) fn part<const N: usize>(&self, group: &mut Group<N>, bodies: Table<'_>, a: &[V; 4], b: &[V; 4]) {
        let mut pose_a = V::gather(bodies.pose, &group.sides.a);
        let mut pose_b = V::gather(bodies.pose, &group.sides.b);
        let zero = V::splat(0.0);
        (pose_a[2], pose_b[2]) = (a[3].if_positive(pose_a[2], zero), b[3].if_positive(pose_b[2], zero));
        for rows in &mut group.points {
            let moved = self.normal(rows).moved_apart(rows, &pose_a, &pose_b);
            V::load(&rows.first_separation).add(moved).store(&mut rows.separation);
        }
    }

    /// Sets the relative velocities right: along the normals and along the tangents, within the cones that the normal impulses of this
    /// moment allow; at two points one after the other. `press` tells what the normal impulse at a point is to be.
    ///
    /// In solve friction goes first, in relax and in all passes of `pgs` last. With friction last in solve, too, pyramids of boxes sway for
    /// ever where contacts are as stiff as substeps allow (1,275 boxes at 30 Hz); with friction first in both, who lands flat and slides comes
    /// off the ground. With friction in relax alone, piles over a tile border jitter a hundred times more.
    ///
    /// Returns how fast, in m/s, friction that goes last at two points then has them part or meet, which the normals had stopped.
    #[inline(always)]
    pub(crate) fn push<const N: usize, const FRICTION_FIRST: bool>(
        &self,
        points: &mut [PointRows; N],
        friction: V,
        a: &mut [V; 4],
        b: &mut [V; 4],
        press: impl Fn(&PointRows) -> Press<V>,
    ) -> V {
        let zero = V::splat(0.0);
        if let [rows] = &mut points[..] {
            let press = press(rows);
            self.push_at_once(rows, friction, a, b, press);
            return zero;
        }
        if FRICTION_FIRST {
            self.rub(points, friction, a, b);
        }
        if let [one, two] = &mut points[..] {
            let presses = [press(one), press(two)];
            self.press_together([one, two], presses, a, b);
        }
        if FRICTION_FIRST {
            return zero;
        }
        let [turning_a, turning_b] = self.rub(points, friction, a, b);
        let mut turned = zero;
        for rows in points {
            let speed = V::load(&rows.normal_a).mul(turning_a).add(V::load(&rows.normal_b).mul(turning_b));
            turned = turned.max(speed).max(zero.sub(speed));
        }
        turned
    }

    /// Sets the relative velocities at some points right along the tangents, within the cones that the normal impulses of this moment
    /// allow, and returns how that turned both bodies.
    #[inline(always)]
    fn rub(&self, points: &mut [PointRows], friction: V, a: &mut [V; 4], b: &mut [V; 4]) -> [V; 2] {
        let zero = V::splat(0.0);
        let (mut turning_a, mut turning_b) = (zero, zero);
        for rows in points {
            let axis = self.tangent(rows);
            let old = V::load(&rows.tangent_impulse);
            let wanted = V::load(&rows.tangent_mass).mul(axis.speed(a, b));
            let new = within(old.sub(wanted), friction.mul(V::load(&rows.normal_impulse)));
            let more = accumulate(&mut rows.tangent_impulse, old, new);
            axis.apply_impulse(more, a, b);
            (turning_a, turning_b) = (turning_a.add(axis.aw.mul(more)), turning_b.add(axis.bw.mul(more)));
        }
        [turning_a, turning_b]
    }

    /// As [`push`](Self::push), and where friction turns what the normals have stopped, again, until it hardly does: who lands flat and
    /// slides would part otherwise. Each lane for itself. Bodies at rest need none of it.
    #[inline(always)]
    pub(crate) fn push_until_settled<const N: usize>(
        &self,
        points: &mut [PointRows; N],
        friction: V,
        a: &mut [V; 4],
        b: &mut [V; 4],
        press: impl Fn(&PointRows) -> Press<V> + Copy,
    ) {
        /// In m/s.
        const SLIGHT: f32 = 0.1;
        const TIMES: usize = 8;
        let mut turned = self.push::<N, false>(points, friction, a, b, press);
        if N == 1 {
            return;
        }
        for _ in 0..TIMES {
            let moves = turned.sub(V::splat(SLIGHT));
            if !moves.any_positive() {
                return;
            }
            let before = (points.clone(), *a, *b);
            turned = moves.if_positive(self.push::<N, false>(points, friction, a, b, press), V::splat(0.0));
            for (rows, before) in points.iter_mut().zip(&before.0) {
                pick(moves, &mut rows.normal_impulse, &before.normal_impulse);
                pick(moves, &mut rows.tangent_impulse, &before.tangent_impulse);
            }
            for k in 0..3 {
                a[k] = moves.if_positive(a[k], before.1[k]);
                b[k] = moves.if_positive(b[k], before.2[k]);
            }
        }
    }

    /// Sets the relative velocities at both points of a contact right at once: one after the other, the first would turn a box that
    /// lands flat, and the second not turn it back.
    ///
    /// What each is to press depends on what the other does: `n1 = max(0, q1 - c1 n2)`, `n2 = max(0, q2 - c2 n1)`, a linear
    /// complementarity problem of two unknowns (R. Cottle, J.-S. Pang, R. Stone, "The linear complementarity problem", 1992). With `n2`
    /// as it would be if the first could pull, the one and then the other are exact. Points that are nearly one leave nothing to tell
    /// them apart by: then that is a guess, which one after the other improves.
    #[inline(always)]
    fn press_together(
        &self,
        [one, two]: [&mut PointRows; 2],
        [first, second]: [Press<V>; 2],
        a: &mut [V; 4],
        b: &mut [V; 4],
    ) {
        const LEAST: f32 = 1e-3;
        let zero = V::splat(0.0);
        let (axis_one, axis_two) = (self.normal(one), self.normal(two));
        let (old_one, old_two) = (V::load(&one.normal_impulse), V::load(&two.normal_impulse));
        // How much speed an impulse at one of them gives the other.
        let shifts = self.ax.mul(self.ax).add(self.ay.mul(self.ay)).add(self.bx.mul(self.bx)).add(self.by.mul(self.by));
        let coupling = shifts.add(axis_one.aw.mul(axis_two.aw)).add(axis_one.bw.mul(axis_two.bw));
        let (upon_one, upon_two) = (first.mass.mul(coupling), second.mass.mul(coupling));
        let free_one = first.at_rest.sub(first.mass.mul(axis_one.speed(a, b))).add(upon_one.mul(old_two));
        let free_two = second.at_rest.sub(second.mass.mul(axis_two.speed(a, b))).add(upon_two.mul(old_one));
        let apart = V::splat(1.0).sub(upon_one.mul(upon_two)).max(V::splat(LEAST));
        let guess = zero.max(free_two.sub(upon_two.mul(free_one)).div(apart));
        let new_one = zero.max(free_one.sub(upon_one.mul(guess)));
        let new_two = zero.max(free_two.sub(upon_two.mul(new_one)));
        let more_one = accumulate(&mut one.normal_impulse, old_one, new_one);
        let more_two = accumulate(&mut two.normal_impulse, old_two, new_two);
        let both = more_one.add(more_two);
        a[0] = a[0].sub(self.ax.mul(both));
        a[1] = a[1].sub(self.ay.mul(both));
        a[2] = a[2].sub(axis_one.aw.mul(more_one)).sub(axis_two.aw.mul(more_two));
        b[0] = b[0].add(self.bx.mul(both));
        b[1] = b[1].add(self.by.mul(both));
        b[2] = b[2].add(axis_one.bw.mul(more_one)).add(axis_two.bw.mul(more_two));
    }

    /// As [`push`](Self::push), where there is one point. Where a push along the normal moves the surfaces along the tangent, as at
    /// the corner of a box, one after the other would take many passes; so both are what they must be together: while the point
    /// sticks, and where it slides, with friction at its most.
    #[inline(always)]
    fn push_at_once(&self, rows: &mut PointRows, friction: V, a: &mut [V; 4], b: &mut [V; 4], press: Press<V>) {
        /// Where friction presses nearly as much as it is pressed by, a point may jam and not slide.
        const LEAST: f32 = 0.25;
        let (normal, tangent) = (self.normal(rows), self.tangent(rows));
        let (old_normal, old_tangent) = (V::load(&rows.normal_impulse), V::load(&rows.tangent_impulse));
        let (apart, along) = (normal.speed(a, b), tangent.speed(a, b));
        let coupling = normal.aw.mul(tangent.aw).add(normal.bw.mul(tangent.bw));
        let along = along.add(coupling.mul(press.impulse(apart).sub(old_normal)));
        let sticking = old_tangent.sub(V::load(&rows.tangent_mass).mul(along));
        let pull = sticking.if_positive(friction, V::splat(0.0).sub(friction));
        let without = press.impulse(apart.sub(coupling.mul(old_tangent)));
        let least = V::splat(1.0).add(coupling.mul(press.mass).mul(pull)).max(V::splat(LEAST));
        let tangent_impulse = within(sticking, friction.mul(without.div(least)));
        let new_normal = press.impulse(apart.add(coupling.mul(tangent_impulse.sub(old_tangent))));
        let new_tangent = within(tangent_impulse, friction.mul(new_normal));
        normal.apply_impulse(accumulate(&mut rows.normal_impulse, old_normal, new_normal), a, b);
        tangent.apply_impulse(accumulate(&mut rows.tangent_impulse, old_tangent, new_tangent), a, b);
    }
}

/// What the normal impulse at a point is to be: so much where its surfaces keep their distance, and less the faster they part; but it
/// never pulls.
pub(crate) struct Press<V> {
    pub(crate) at_rest: V,
    pub(crate) mass: V,
}

impl<V: Wide> Press<V> {
    /// The impulse, given the speed at which the surfaces part. One that cannot be computed, as speeds overflow, stays so: the step
    /// then fails.
    #[inline(always)]
    fn impulse(&self, speed: V) -> V {
        V::splat(0.0).max(self.at_rest.sub(self.mass.mul(speed)))
    }
}

impl<const N: usize> Group<N> {
    /// Adds the impulses of a substep to those of the step.
    #[inline(always)]
    pub(crate) fn add_to_totals<V: Wide>(&mut self) {
        for (rows, totals) in self.points.iter().zip(&mut self.totals) {
            V::load(&totals.normal).add(V::load(&rows.normal_impulse)).store(&mut totals.normal);
            V::load(&totals.tangent).add(V::load(&rows.tangent_impulse)).store(&mut totals.tangent);
        }
    }
}

/// Takes a row back to what it was, but for some lanes.
#[inline(always)]
fn pick<V: Wide>(lanes: V, row: &mut WideRow, before: &WideRow) {
    lanes.if_positive(V::load(row), V::load(before)).store(row);
}

/// An impulse, but no more than this either way.
#[inline(always)]
fn within<V: Wide>(impulse: V, most: V) -> V {
    impulse.min(most).max(V::splat(0.0).sub(most))
}

/// Adds to an accumulated impulse and returns what was added.
#[inline(always)]
pub(crate) fn accumulate<V: Wide>(row: &mut WideRow, old: V, new: V) -> V {
    new.store(row);
    new.sub(old)
}

/// Gives both bodies the impulses of the last substep.
#[derive(Clone, Copy)]
pub(crate) struct WarmStart;

impl Pass for WarmStart {
    #[inline(always)]
    fn group<V: Wide, const N: usize>(&self, group: &mut Group<N>, bodies: Table<'_>) {
        let mut a = V::gather(bodies.velocity, &group.sides.a);
        let mut b = V::gather(bodies.velocity, &group.sides.b);
        let normals = Normals::<V>::load(&group.sides, &a, &b);
        for rows in &group.points {
            normals.normal(rows).apply_impulse(V::load(&rows.normal_impulse), &mut a, &mut b);
            normals.tangent(rows).apply_impulse(V::load(&rows.tangent_impulse), &mut a, &mut b);
        }
        V::scatter(a, bodies.velocity, &group.sides.a);
        V::scatter(b, bodies.velocity, &group.sides.b);
    }
}
