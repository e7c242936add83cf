//! Solver `pgs`: sequential impulses, which is projected Gauss-Seidel on velocities.
//!
//! Source: E. Catto, "Iterative dynamics with temporal coherence", GDC 2005, and Box2D v2. In each half of a step: velocities are
//! integrated, the impulses of the half before applied (warm starting), and then every contact in turn sets its relative velocity
//! right, several times over, with the accumulated impulse clamped rather than each part of it; then positions are integrated. In
//! halves, as what touches late in a step is stopped in part by this one and in part by the next, by when corners have turned on:
//! bodies that fly about would lose a tenth of their spin.
//!
//! # Position correction
//!
//! Baumgarte's: of an overlap d, the part d - `linear_slop` is pushed out at `baumgarte / dt` of it per second, but no
//! faster than `push_out_speed`. The push goes through the velocities, so it adds energy; `soft-step` does not have that
//! fault. Contacts still apart may close their gap within the step, no more.

use super::constraint::group::Group;
use super::constraint::kernels::{Normals, Pass, Press, Table, WarmStart};
use super::job::Job;
use super::motion::Motion;
use crate::parallel::crew::Member;
use crate::parallel::lanes::{Lanes, Wide};
use crate::tiling::blueprint::Setup;

/// One half of the step of a batch, with half of the iterations.
#[inline(always)]
pub(crate) fn substep<'a, V: Lanes>(job: &Job<'a>, member: &Member<'a>, substep: u32, setup: &Setup) {
    let motion = Motion::new(setup);
    job.integrate_velocities::<V>(member, &motion, substep);
    if substep == 0 {
        job.each_color::<V>(member, WarmStart);
    }
    let iterations = setup.params.iterations.div_ceil(setup.params.integrations());
    for k in 0..iterations {
        job.each_color::<V>(member, Iterate::new(setup, substep > 0 && k == 0, setup.bouncy && k + 1 == iterations));
    }
    job.integrate_positions::<V>(member, &motion);
}

/// One iteration over all contacts.
#[derive(Clone, Copy)]
struct Iterate {
    /// Whether bodies have moved since the iteration before.
    moved: bool,
    /// Whether it is the last of a half in which something bounces.
    ends_bouncy: bool,
    inv_h: f32,
    rate: f32,
    slop: f32,
    push_out_speed: f32,
}

impl Iterate {
    fn new(setup: &Setup, moved: bool, ends_bouncy: bool) -> Self {
        let params = &setup.params;
        let (inv_h, rate) = (1.0 / setup.h, params.baumgarte / params.dt);
        Self { moved, ends_bouncy, inv_h, rate, slop: params.linear_slop, push_out_speed: params.push_out_speed }
    }
}

impl Pass for Iterate {
    #[inline(always)]
    fn group<V: Wide, const N: usize>(&self, group: &mut Group<N>, bodies: Table<'_>) {
        let mut a = V::gather(bodies.velocity, &group.sides.a);
        let mut b = V::gather(bodies.velocity, &group.sides.b);
        let normals = Normals::<V>::load(&group.sides, &a, &b);
        let zero = V::splat(0.0);
        if self.moved {
            normals.part(group, bodies, &a, &b);
        }
        let friction = V::load(&group.sides.friction);
        normals.push::<N, false>(
            &mut group.points,
            friction,
            &mut a,
            &mut b,
            #[inline(always)]
            |rows| {
                let (separation, mass) = (V::load(&rows.separation), V::load(&rows.normal_mass));
                let deep = separation.add(V::splat(self.slop)).min(zero);
                let push = deep.mul(V::splat(self.rate)).max(V::splat(-self.push_out_speed));
                let bias = separation.if_positive(separation.mul(V::splat(self.inv_h)), push);
                Press { at_rest: V::load(&rows.normal_impulse).sub(mass.mul(bias)), mass }
            },
        );
        if self.ends_bouncy {
            group.add_to_totals::<V>();
        }
        V::scatter(a, bodies.velocity, &group.sides.a);
        V::scatter(b, bodies.velocity, &group.sides.b);
    }
}
