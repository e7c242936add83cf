//! Groups: sixteen contacts side by side, one in each lane.

use super::kernels::{Pass, Table};
use crate::parallel::lanes::{Quad, WIDE, WideRow};

/// Sixteen contacts of `N` points each that share no moving body, or are solved one by one. All rows are mass-weighted.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Group<const N: usize> {
    pub(crate) sides: Sides,
    pub(crate) points: [PointRows; N],
    /// Of each point, kept only where something bounces.
    pub(crate) totals: [Totals; N],
}

/// What the points of a contact have in common, of sixteen contacts.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Sides {
    /// Bodies, as places in their batch; that of its slice's static in a lane without a contact.
    pub(crate) a: [u32; WIDE],
    pub(crate) b: [u32; WIDE],
    /// From A to B, of length one.
    pub(crate) normal_x: WideRow,
    pub(crate) normal_y: WideRow,
    pub(crate) friction: WideRow,
}

/// One point of sixteen contacts.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct PointRows {
    /// Moment arms of the normal and the tangent about A and B, times the root of the inverse inertia.
    pub(crate) normal_a: WideRow,
    pub(crate) normal_b: WideRow,
    pub(crate) tangent_a: WideRow,
    pub(crate) tangent_b: WideRow,
    /// Effective masses.
    pub(crate) normal_mass: WideRow,
    pub(crate) tangent_mass: WideRow,
    /// Separation at the beginning of the step, and now.
    pub(crate) first_separation: WideRow,
    pub(crate) separation: WideRow,
    /// Accumulated impulses of the substep.
    pub(crate) normal_impulse: WideRow,
    pub(crate) tangent_impulse: WideRow,
}

/// The impulses of a point over all substeps of the step, and of its bounce.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Totals {
    pub(crate) normal: WideRow,
    pub(crate) tangent: WideRow,
}

const ZERO: WideRow = [0.0; WIDE];

impl Totals {
    pub(crate) const NONE: Self = Self { normal: ZERO, tangent: ZERO };

    /// Of one lane, along the normal and the tangent.
    pub(crate) fn of(&self, lane: usize) -> [f32; 2] {
        [self.normal[lane], self.tangent[lane]]
    }
}

impl PointRows {
    const EMPTY: Self = Self {
        normal_a: ZERO,
        normal_b: ZERO,
        tangent_a: ZERO,
        tangent_b: ZERO,
        normal_mass: ZERO,
        tangent_mass: ZERO,
        first_separation: ZERO,
        separation: ZERO,
        normal_impulse: ZERO,
        tangent_impulse: ZERO,
    };
}

impl<const N: usize> Group<N> {
    pub(crate) const EMPTY: Self =
        Self { sides: Sides::EMPTY, points: [PointRows::EMPTY; N], totals: [Totals::NONE; N] };

    /// A pass over the contact in a lane alone, which for that goes to the first lane of another group.
    #[inline(always)]
    pub(super) fn pass_lane(&mut self, lane: usize, alone: &mut Self, pass: impl Pass, bodies: Table<'_>) {
        let (own, sides) = (&self.sides, &mut alone.sides);
        (sides.a[0], sides.b[0]) = (own.a[lane], own.b[lane]);
        (sides.normal_x[0], sides.normal_y[0]) = (own.normal_x[lane], own.normal_y[lane]);
        sides.friction[0] = own.friction[lane];
        for (own, alone) in self.points.iter().zip(&mut alone.points) {
            (alone.normal_a[0], alone.normal_b[0]) = (own.normal_a[lane], own.normal_b[lane]);
            (alone.tangent_a[0], alone.tangent_b[0]) = (own.tangent_a[lane], own.tangent_b[lane]);
            (alone.normal_mass[0], alone.tangent_mass[0]) = (own.normal_mass[lane], own.tangent_mass[lane]);
            (alone.first_separation[0], alone.separation[0]) = (own.first_separation[lane], own.separation[lane]);
            (alone.normal_impulse[0], alone.tangent_impulse[0]) = (own.normal_impulse[lane], own.tangent_impulse[lane]);
        }
        for (own, alone) in self.totals.iter().zip(&mut alone.totals) {
            (alone.normal[0], alone.tangent[0]) = (own.normal[lane], own.tangent[lane]);
        }
        pass.group::<f32, N>(alone, bodies);
        // All that passes change.
        for (own, alone) in self.points.iter_mut().zip(&alone.points) {
            own.separation[lane] = alone.separation[0];
            (own.normal_impulse[lane], own.tangent_impulse[lane]) = (alone.normal_impulse[0], alone.tangent_impulse[0]);
        }
        for (own, alone) in self.totals.iter_mut().zip(&alone.totals) {
            (own.normal[lane], own.tangent[lane]) = (alone.normal[0], alone.tangent[0]);
        }
    }
}

/// The speed of a body along a row.
fn along(row: [f32; 3], v: Quad) -> f32 {
    row[0] * v[0] + row[1] * v[1] + row[2] * v[2]
}

/// One lane alone. Bodies are given as those of the batch.
impl Sides {
    const EMPTY: Self = Self { a: [0; WIDE], b: [0; WIDE], normal_x: ZERO, normal_y: ZERO, friction: ZERO };

    /// Bodies A and B, as places in their batch.
    pub(super) fn places(&self, lane: usize) -> [usize; 2] {
        [self.a[lane] as usize, self.b[lane] as usize]
    }

    /// The normal times the roots of the inverse masses of A and B, which bodies tell with their velocities.
    fn normals(&self, lane: usize, velocity: &[Quad]) -> [[f32; 2]; 2] {
        [&self.a, &self.b].map(|bodies| {
            let root = velocity[bodies[lane] as usize][3].abs();
            [self.normal_x[lane] * root, self.normal_y[lane] * root]
        })
    }

    /// How bodies A and B move along the normal at a point.
    pub(super) fn normal_rows(&self, point: &PointRows, lane: usize, velocity: &[Quad]) -> [[f32; 3]; 2] {
        let [[ax, ay], [bx, by]] = self.normals(lane, velocity);
        [[ax, ay, point.normal_a[lane]], [bx, by, point.normal_b[lane]]]
    }

    /// Speed at which a point's surfaces move apart, in m/s.
    pub(crate) fn normal_speed(&self, point: &PointRows, lane: usize, velocity: &[Quad]) -> f32 {
        self.speed(self.normal_rows(point, lane, velocity), lane, velocity)
    }

    /// Speed at which B moves along rows, seen from A.
    pub(super) fn speed(&self, [row_a, row_b]: [[f32; 3]; 2], lane: usize, velocity: &[Quad]) -> f32 {
        along(row_b, velocity[self.b[lane] as usize]) - along(row_a, velocity[self.a[lane] as usize])
    }

    /// How bodies A and B move along the tangent at a point.
    pub(super) fn tangent_rows(&self, point: &PointRows, lane: usize, velocity: &[Quad]) -> [[f32; 3]; 2] {
        let [[ax, ay], [bx, by]] = self.normals(lane, velocity);
        [[ay, -ax, point.tangent_a[lane]], [by, -bx, point.tangent_b[lane]]]
    }

    /// Gives both bodies some more impulse along rows, and adds it to the sum.
    pub(super) fn add_impulse(
        &self,
        rows: [[f32; 3]; 2],
        sum: &mut f32,
        lane: usize,
        impulse: f32,
        velocity: &mut [Quad],
    ) {
        *sum += impulse;
        let ([row_a, row_b], a, b) = (rows, self.a[lane] as usize, self.b[lane] as usize);
        for k in 0..3 {
            velocity[a][k] -= row_a[k] * impulse;
            velocity[b][k] += row_b[k] * impulse;
        }
    }

    /// Gives one of the bodies an impulse along the normal and the tangent of a point.
    pub(crate) fn apply_impulse(
        &self,
        point: &PointRows,
        lane: usize,
        upon_a: bool,
        impulse: [f32; 2],
        velocity: &mut [Quad],
    ) {
        let [normal_a, normal_b] = self.normals(lane, velocity);
        let (body, sign, [x, y], normal, tangent) = if upon_a {
            (self.a[lane], -1.0, normal_a, point.normal_a[lane], point.tangent_a[lane])
        } else {
            (self.b[lane], 1.0, normal_b, point.normal_b[lane], point.tangent_b[lane])
        };
        let velocity = &mut velocity[body as usize];
        let [along, across] = impulse.map(|impulse| sign * impulse);
        velocity[0] += x * along + y * across;
        velocity[1] += y * along - x * across;
        velocity[2] += normal * along + tangent * across;
    }

    /// Moves both bodies apart along the normal, by so many meters in all, without turning them.
    pub(super) fn move_apart(&self, lane: usize, way: f32, velocity: &[Quad], pose: &mut [Quad]) {
        let [a, b] = self.normals(lane, velocity);
        let share = way / (a[0] * a[0] + a[1] * a[1] + b[0] * b[0] + b[1] * b[1]);
        for (body, [x, y], share) in [(self.a[lane], a, -share), (self.b[lane], b, share)] {
            let pose = &mut pose[body as usize];
            (pose[0], pose[1]) = (pose[0] + x * share, pose[1] + y * share);
        }
    }

    /// Separation at a point by the bodies' poses now, in meters.
    pub(crate) fn separation(&self, point: &PointRows, lane: usize, velocity: &[Quad], pose: &[Quad]) -> f32 {
        let rows = self.normal_rows(point, lane, velocity);
        let moved = |body: u32, [x, y, normal]: [f32; 3], tangent: f32| {
            let (pose, is_round) = (pose[body as usize], velocity[body as usize][3] < 0.0);
            let lost = if is_round { 0.0 } else { pose[2] };
            x * pose[0] + y * pose[1] + normal * pose[3] + tangent * lost
        };
        let moved_a = moved(self.a[lane], rows[0], point.tangent_a[lane]);
        let moved_b = moved(self.b[lane], rows[1], point.tangent_b[lane]);
        point.first_separation[lane] + (moved_b - moved_a)
    }
}
