//! Groups: eight contacts side by side, one in each lane.

use crate::model::math::max;
use crate::parallel::lanes::{LANES, Quad, Row};

/// Eight contacts of `N` points each that share no moving body. All rows are mass-weighted.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(crate) struct Group<const N: usize> {
    pub(crate) sides: Sides,
    pub(crate) points: [PointRows; N],
}

/// What the points of a contact have in common, of eight contacts.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(crate) struct Sides {
    /// Bodies, as places in their batch; that of its slice's static in a lane without a contact.
    pub(crate) a: [u32; LANES],
    pub(crate) b: [u32; LANES],
    /// The normal, times the root of the inverse mass of A and of B.
    pub(crate) normal_ax: Row,
    pub(crate) normal_ay: Row,
    pub(crate) normal_bx: Row,
    pub(crate) normal_by: Row,
    pub(crate) friction: Row,
    /// One for a contact with a static, else zero.
    pub(crate) fixed: Row,
}

/// One point of eight contacts.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(crate) struct PointRows {
    /// Moment arms of the normal and the tangent about A and B, times the root of the inverse inertia.
    pub(crate) normal_a: Row,
    pub(crate) normal_b: Row,
    pub(crate) tangent_a: Row,
    pub(crate) tangent_b: Row,
    /// The anchor's length along the normal, from A and from B: what turning further shortens. Zero for a round body.
    pub(crate) depth_a: Row,
    pub(crate) depth_b: Row,
    /// Effective masses.
    pub(crate) normal_mass: Row,
    pub(crate) tangent_mass: Row,
    /// Separation at the beginning of the step, and now.
    pub(crate) first_separation: Row,
    pub(crate) separation: Row,
    /// Accumulated impulses of the substep.
    pub(crate) normal_impulse: Row,
    pub(crate) tangent_impulse: Row,
    /// Their sums over the step's substeps, kept only where somebody asks.
    pub(crate) total_normal: Row,
    pub(crate) total_tangent: Row,
}

const ZERO: Row = [0.0; LANES];

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
        total_normal: ZERO,
        total_tangent: ZERO,
    };
}

impl<const N: usize> Group<N> {
    pub(crate) const EMPTY: Self = Self { sides: Sides::EMPTY, points: [PointRows::EMPTY; N] };
}

/// The speed of a body along a row.
fn along(row: [f32; 3], v: Quad) -> f32 {
    row[0] * v[0] + row[1] * v[1] + row[2] * v[2]
}

/// One lane alone. Bodies are given as those of the batch.
impl Sides {
    const EMPTY: Self = Self {
        a: [0; LANES],
        b: [0; LANES],
        normal_ax: ZERO,
        normal_ay: ZERO,
        normal_bx: ZERO,
        normal_by: ZERO,
        friction: ZERO,
        fixed: ZERO,
    };

    /// How bodies A and B move along the normal at a point.
    fn normal_rows(&self, point: &PointRows, lane: usize) -> [[f32; 3]; 2] {
        let row_a = [self.normal_ax[lane], self.normal_ay[lane], point.normal_a[lane]];
        let row_b = [self.normal_bx[lane], self.normal_by[lane], point.normal_b[lane]];
        [row_a, row_b]
    }

    /// Speed at which a point's surfaces move apart, in m/s.
    pub(crate) fn normal_speed(&self, point: &PointRows, lane: usize, velocity: &[Quad]) -> f32 {
        let [row_a, row_b] = self.normal_rows(point, lane);
        along(row_b, velocity[self.b[lane] as usize]) - along(row_a, velocity[self.a[lane] as usize])
    }

    /// Gives a point back the speed it came in with, if it pressed at all.
    pub(crate) fn bounce(&self, point: &mut PointRows, lane: usize, speed: f32, velocity: &mut [Quad]) {
        if point.total_normal[lane] <= 0.0 {
            return;
        }
        let wanted = -point.normal_mass[lane] * (self.normal_speed(point, lane, velocity) - speed);
        let impulse = max(wanted, -point.normal_impulse[lane]);
        point.total_normal[lane] += impulse;
        let ([row_a, row_b], a, b) = (self.normal_rows(point, lane), self.a[lane] as usize, self.b[lane] as usize);
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
