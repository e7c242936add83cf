//! Groups: sixteen contacts side by side, one in each lane.

use crate::parallel::lanes::{Quad, WIDE, WideRow};

/// Sixteen contacts of `N` points each that share no moving body. All rows are mass-weighted.
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
    /// The normal, times the root of the inverse mass of A and of B.
    pub(crate) normal_ax: WideRow,
    pub(crate) normal_ay: WideRow,
    pub(crate) normal_bx: WideRow,
    pub(crate) normal_by: WideRow,
    pub(crate) friction: WideRow,
    /// One for a contact with a static, else zero.
    pub(crate) fixed: WideRow,
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
    /// The anchor's length along the normal, from A and from B: what turning further shortens. Zero for a round body.
    pub(crate) depth_a: WideRow,
    pub(crate) depth_b: WideRow,
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
        depth_a: ZERO,
        depth_b: ZERO,
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
}

/// The speed of a body along a row.
pub(super) fn along(row: [f32; 3], v: Quad) -> f32 {
    row[0] * v[0] + row[1] * v[1] + row[2] * v[2]
}

/// One lane alone. Bodies are given as those of the batch.
impl Sides {
    const EMPTY: Self = Self {
        a: [0; WIDE],
        b: [0; WIDE],
        normal_ax: ZERO,
        normal_ay: ZERO,
        normal_bx: ZERO,
        normal_by: ZERO,
        friction: ZERO,
        fixed: ZERO,
    };

    /// How bodies A and B move along the normal at a point.
    pub(super) fn normal_rows(&self, point: &PointRows, lane: usize) -> [[f32; 3]; 2] {
        let row_a = [self.normal_ax[lane], self.normal_ay[lane], point.normal_a[lane]];
        let row_b = [self.normal_bx[lane], self.normal_by[lane], point.normal_b[lane]];
        [row_a, row_b]
    }

    /// Speed at which a point's surfaces move apart, in m/s.
    pub(crate) fn normal_speed(&self, point: &PointRows, lane: usize, velocity: &[Quad]) -> f32 {
        let [row_a, row_b] = self.normal_rows(point, lane);
        along(row_b, velocity[self.b[lane] as usize]) - along(row_a, velocity[self.a[lane] as usize])
    }

    /// How bodies A and B move along the tangent at a point.
    pub(super) fn tangent_rows(&self, point: &PointRows, lane: usize) -> [[f32; 3]; 2] {
        let row_a = [self.normal_ay[lane], -self.normal_ax[lane], point.tangent_a[lane]];
        let row_b = [self.normal_by[lane], -self.normal_bx[lane], point.tangent_b[lane]];
        [row_a, row_b]
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
        let (body, sign, x, y, normal, tangent) = if upon_a {
            let (normal, tangent) = (point.normal_a[lane], point.tangent_a[lane]);
            (self.a[lane], -1.0, self.normal_ax[lane], self.normal_ay[lane], normal, tangent)
        } else {
            let (normal, tangent) = (point.normal_b[lane], point.tangent_b[lane]);
            (self.b[lane], 1.0, self.normal_bx[lane], self.normal_by[lane], normal, tangent)
        };
        let velocity = &mut velocity[body as usize];
        let [along, across] = impulse.map(|impulse| sign * impulse);
        velocity[0] += x * along + y * across;
        velocity[1] += y * along - x * across;
        velocity[2] += normal * along + tangent * across;
    }

    /// Separation at a point by the bodies' poses now, in meters.
    pub(crate) fn separation(&self, point: &PointRows, lane: usize, pose: &[Quad]) -> f32 {
        let (pose_a, pose_b) = (pose[self.a[lane] as usize], pose[self.b[lane] as usize]);
        let moved_a = self.normal_ax[lane] * pose_a[0]
            + self.normal_ay[lane] * pose_a[1]
            + point.normal_a[lane] * pose_a[3]
            + point.depth_a[lane] * pose_a[2];
        let moved_b = self.normal_bx[lane] * pose_b[0]
            + self.normal_by[lane] * pose_b[1]
            + point.normal_b[lane] * pose_b[3]
            + point.depth_b[lane] * pose_b[2];
        point.first_separation[lane] + (moved_b - moved_a)
    }
}
