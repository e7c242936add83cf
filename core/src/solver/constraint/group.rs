//! Groups: sixteen contacts side by side, one in each lane.

use super::groups::Answer;
use crate::model::math::max;
use crate::parallel::lanes::{Quad, WIDE, WideRow};

/// Sixteen contacts of `N` points each that share no moving body. All rows are mass-weighted.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Group<const N: usize> {
    pub(crate) sides: Sides,
    pub(crate) points: [PointRows; N],
    /// The sum of each point's normal impulses over the step's substeps, kept only where something bounces.
    pub(crate) pressed: [WideRow; N],
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

const ZERO: WideRow = [0.0; WIDE];

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
    pub(crate) const EMPTY: Self = Self { sides: Sides::EMPTY, points: [PointRows::EMPTY; N], pressed: [ZERO; N] };
}

/// The speed of a body along a row.
fn along(row: [f32; 3], v: Quad) -> f32 {
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

    /// Gives the points of a contact that pressed what they are to have. Two that part do so at once: one after the other, the first
    /// would turn a box that falls flat, and the second not turn it back.
    pub(crate) fn bounce(
        &self,
        points: &[PointRows],
        pressed: &mut [WideRow],
        lane: usize,
        answers: [Answer; 2],
        velocity: &mut [Quad],
    ) {
        if let ([one, two], [pressed_one, pressed_two], [Answer::Part(first), Answer::Part(second)]) =
            (points, &mut *pressed, answers)
        {
            let pressed = [&mut pressed_one[lane], &mut pressed_two[lane]];
            if *pressed[0] > 0.0
                && *pressed[1] > 0.0
                && self.bounce_together([one, two], pressed, lane, [first, second], velocity)
            {
                return;
            }
        }
        for ((point, pressed), answer) in points.iter().zip(pressed).zip(answers) {
            let pressed = &mut pressed[lane];
            let wanted = match answer {
                Answer::Part(speed) if *pressed > 0.0 => {
                    point.normal_mass[lane] * (speed - self.normal_speed(point, lane, velocity))
                }
                Answer::NotYet(most) if *pressed > most * point.normal_mass[lane] => -*pressed,
                _ => continue,
            };
            self.add_normal_impulse(point, pressed, lane, max(wanted, -*pressed), velocity);
        }
    }

    /// Two points at once, if that takes no pull from either.
    fn bounce_together(
        &self,
        points: [&PointRows; 2],
        pressed: [&mut f32; 2],
        lane: usize,
        speeds: [f32; 2],
        velocity: &mut [Quad],
    ) -> bool {
        let [one, two] = points;
        let ([one_a, one_b], [two_a, two_b]) = (self.normal_rows(one, lane), self.normal_rows(two, lane));
        let product = |u: [f32; 3], v: [f32; 3]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
        // How much speed an impulse at one of them gives each.
        let own = [product(one_a, one_a) + product(one_b, one_b), product(two_a, two_a) + product(two_b, two_b)];
        let other = product(one_a, two_a) + product(one_b, two_b);
        let determinant = own[0] * own[1] - other * other;
        let lacks = [0, 1].map(|k| speeds[k] - self.normal_speed(points[k], lane, velocity));
        let impulses = [
            (own[1] * lacks[0] - other * lacks[1]) / determinant,
            (own[0] * lacks[1] - other * lacks[0]) / determinant,
        ];
        let pulls = |k: usize| impulses[k] < -*pressed[k];
        // Points that are nearly one leave nothing to tell them apart by.
        let is_regular = determinant > 1e-3 * own[0] * own[1];
        if !is_regular || pulls(0) || pulls(1) {
            return false;
        }
        for ((point, pressed), impulse) in points.into_iter().zip(pressed).zip(impulses) {
            self.add_normal_impulse(point, pressed, lane, impulse, velocity);
        }
        true
    }

    /// Gives both bodies some more impulse along the normal of a point.
    fn add_normal_impulse(
        &self,
        point: &PointRows,
        pressed: &mut f32,
        lane: usize,
        impulse: f32,
        velocity: &mut [Quad],
    ) {
        *pressed += impulse;
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
