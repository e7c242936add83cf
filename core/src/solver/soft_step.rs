//! Solver `soft-step`: substepped soft constraints with relax.
//!
//! Source: E. Catto, "Solver2D" and Box2D v3. Each substep integrates velocities, applies last substep's impulses
//! (warm starting), solves with soft contacts that push overlap out, integrates positions, and solves once more without
//! the push ("relax"), so that the push adds no energy.

use super::bodies::LIGHTEST;
use super::constraint::group::Group;
use super::constraint::kernels::{Normals, Pass, Press, Table, WarmStart};
use super::job::Job;
use super::motion::Motion;
use crate::model::softness::Softness;
use crate::parallel::crew::Member;
use crate::parallel::lanes::{Lanes, Wide};
use crate::parallel::vectors::absolute;
use crate::tiling::blueprint::Setup;

/// One substep of a batch.
#[inline(always)]
pub(crate) fn substep<'a, V: Lanes>(job: &Job<'a>, member: &Member<'a>, substep: u32, setup: &Setup) {
    let motion = Motion::new(setup);
    job.integrate_velocities::<V>(member, &motion, substep);
    if substep == 0 {
        job.each_color::<V>(member, WarmStart);
    }
    job.each_color::<V>(member, Solve::new(setup));
    job.integrate_positions::<V>(member, &motion);
    if setup.bouncy {
        job.each_color::<V>(member, Relax::<true>::new(setup));
    } else {
        job.each_color::<V>(member, Relax::<false>::new(setup));
    }
}

/// Friction and normal impulses, with the soft push out of overlap.
#[derive(Clone, Copy)]
struct Solve {
    softness: Softness,
    static_softness: Softness,
    push_out_speed: f32,
    inv_h: f32,
}

impl Solve {
    fn new(setup: &Setup) -> Self {
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
    fn group<V: Wide, const N: usize>(&self, group: &mut Group<N>, bodies: Table<'_>) {
        let mut a = V::gather(bodies.velocity, &group.sides.a);
        let mut b = V::gather(bodies.velocity, &group.sides.b);
        let normals = Normals::<V>::load(&group.sides, &a, &b);
        // The roots of a static's inverse masses are zero, or next to it.
        let both_move = absolute(a[3]).min(absolute(b[3])).sub(V::splat(LIGHTEST));
        let either = |of: fn(&Softness) -> f32| {
            both_move.if_positive(V::splat(of(&self.softness)), V::splat(of(&self.static_softness)))
        };
        let (rate, mass_scale, impulse_scale) =
            (either(|s| s.bias_rate), either(|s| s.mass_scale), either(|s| s.impulse_scale));
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let friction = V::load(&group.sides.friction);
        normals.push::<N, true>(
            &mut group.points,
            friction,
            &mut a,
            &mut b,
            #[inline(always)]
            |rows| {
                let separation = V::load(&rows.separation);
                let old = V::load(&rows.normal_impulse);
                // Apart: may close the gap within the substep, no more. Overlapping: pushed out softly.
                let push = rate.mul(separation).max(V::splat(-self.push_out_speed));
                let bias = separation.if_positive(separation.mul(V::splat(self.inv_h)), push);
                let mass_scale = separation.if_positive(one, mass_scale);
                let impulse_scale = separation.if_positive(zero, impulse_scale);
                let mass = V::load(&rows.normal_mass);
                let at_rest = old.sub(impulse_scale.mul(old)).sub(mass.mul(bias));
                Press { at_rest, mass: mass.mul(mass_scale) }
            },
        );
        V::scatter(a, bodies.velocity, &group.sides.a);
        V::scatter(b, bodies.velocity, &group.sides.b);
    }
}

/// Friction and normal impulses without the push, at the poses after the substep. Keeps the separations, which hold
/// until bodies move again: in the next substep's solve. With `BOUNCY`, sums impulses over the step.
#[derive(Clone, Copy)]
struct Relax<const BOUNCY: bool> {
    inv_h: f32,
}

impl<const BOUNCY: bool> Relax<BOUNCY> {
    fn new(setup: &Setup) -> Self {
        Self { inv_h: 1.0 / setup.h }
    }
}

impl<const BOUNCY: bool> Pass for Relax<BOUNCY> {
    #[inline(always)]
    fn group<V: Wide, const N: usize>(&self, group: &mut Group<N>, bodies: Table<'_>) {
        let mut a = V::gather(bodies.velocity, &group.sides.a);
        let mut b = V::gather(bodies.velocity, &group.sides.b);
        let normals = Normals::<V>::load(&group.sides, &a, &b);
        let zero = V::splat(0.0);
        normals.part(group, bodies, &a, &b);
        let friction = V::load(&group.sides.friction);
        normals.push_until_settled(
            &mut group.points,
            friction,
            &mut a,
            &mut b,
            #[inline(always)]
            |rows| {
                let mass = V::load(&rows.normal_mass);
                let bias = V::load(&rows.separation).max(zero).mul(V::splat(self.inv_h));
                Press { at_rest: V::load(&rows.normal_impulse).sub(mass.mul(bias)), mass }
            },
        );
        if BOUNCY {
            group.add_to_totals::<V>();
        }
        V::scatter(a, bodies.velocity, &group.sides.a);
        V::scatter(b, bodies.velocity, &group.sides.b);
    }
}
