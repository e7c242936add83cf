//! Solver `pgs`: sequential impulses, which is projected Gauss-Seidel on velocities.
//!
//! Source: E. Catto, "Iterative dynamics with temporal coherence", GDC 2005, and Box2D v2. Once a step: velocities are
//! integrated, last step's impulses applied (warm starting), and then every contact in turn sets its relative velocity
//! right, several times over, with the accumulated impulse clamped rather than each part of it; then positions are
//! integrated. Friction first, as the normal impulse matters more and has the last word.
//!
//! # Position correction
//!
//! Baumgarte's: of an overlap d, the part d - `linear_slop` is pushed out at `baumgarte / dt` of it per second, but no
//! faster than `push_out_speed`. The push goes through the velocities, so it adds energy; `soft-step` does not have that
//! fault. Contacts still apart may close their gap within the step, no more.

use super::constraint::group::Group;
use super::constraint::kernels::{Normals, Pass, Table, WarmStart, accumulate};
use super::job::Job;
use super::motion::Motion;
use crate::parallel::crew::Member;
use crate::parallel::lanes::Lanes;
use crate::tiling::blueprint::Setup;

/// The whole step of a batch.
#[inline(always)]
pub(crate) fn step<'a, V: Lanes>(job: &Job<'a>, member: &Member<'a>, setup: &Setup) {
    job.integrate_velocities::<V>(member, &Motion::new(setup), true);
    job.each_color::<V>(member, WarmStart);
    for _ in 0..setup.params.iterations {
        job.each_color::<V>(member, Iterate::new(setup));
    }
    job.integrate_positions::<V>(member, setup.h);
}

/// One iteration over all contacts.
#[derive(Clone, Copy)]
struct Iterate {
    inv_h: f32,
    rate: f32,
    slop: f32,
    push_out_speed: f32,
}

impl Iterate {
    fn new(setup: &Setup) -> Self {
        let (params, inv_h) = (&setup.params, 1.0 / setup.h);
        let rate = params.baumgarte * inv_h;
        Self { inv_h, rate, slop: params.linear_slop, push_out_speed: params.push_out_speed }
    }
}

impl Pass for Iterate {
    #[inline(always)]
    fn group<V: Lanes, const N: usize>(&self, group: &mut Group<N>, bodies: Table<'_>) {
        let mut a = V::gather(bodies.velocity, &group.sides.a);
        let mut b = V::gather(bodies.velocity, &group.sides.b);
        let normals = Normals::<V>::load(&group.sides);
        let zero = V::splat(0.0);
        normals.apply_friction(&mut group.points, V::load(&group.sides.friction), &mut a, &mut b);
        for rows in &mut group.points {
            let axis = normals.normal(rows);
            let separation = V::load(&rows.separation);
            let deep = separation.add(V::splat(self.slop)).min(zero);
            let push = deep.mul(V::splat(self.rate)).max(V::splat(-self.push_out_speed));
            let bias = separation.if_positive(separation.mul(V::splat(self.inv_h)), push);
            let old = V::load(&rows.normal_impulse);
            let wanted = V::load(&rows.normal_mass).mul(axis.speed(&a, &b).add(bias));
            let new = old.sub(wanted).max(zero);
            axis.apply_impulse(accumulate(&mut rows.normal_impulse, old, new), &mut a, &mut b);
            // The step is the only substep: what it did in all is what it does now.
            new.store(&mut rows.total_normal);
            V::load(&rows.tangent_impulse).store(&mut rows.total_tangent);
        }
        V::scatter(a, bodies.velocity, &group.sides.a);
        V::scatter(b, bodies.velocity, &group.sides.b);
    }
}
