//! Groups: sixteen contacts side by side, one in each lane.

use super::groups::{Answer, Parting};
use crate::model::math::{clamp, max};
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

    /// How bodies A and B move along the tangent at a point.
    fn tangent_rows(&self, point: &PointRows, lane: usize) -> [[f32; 3]; 2] {
        let row_a = [self.normal_ay[lane], -self.normal_ax[lane], point.tangent_a[lane]];
        let row_b = [self.normal_by[lane], -self.normal_bx[lane], point.tangent_b[lane]];
        [row_a, row_b]
    }

    /// Gives the points of a contact that pressed what they are to have, and friction what it may have of that.
    pub(crate) fn bounce(
        &self,
        points: &[PointRows],
        totals: &mut [Totals],
        lane: usize,
        answers: [Answer; 2],
        velocity: &mut [Quad],
    ) {
        let pressed = [0, 1].map(|k| totals.get(k).is_some_and(|totals| totals.normal[lane] > 0.0));
        self.bounce_along_normals(points, totals, lane, answers, velocity);
        for (k, (point, totals)) in points.iter().zip(totals).enumerate() {
            match answers[k] {
                Answer::Part(parting) if pressed[k] => self.rub(point, totals, lane, Some(parting), velocity),
                // What was not to bounce yet, and keeps its impulse, keeps its friction.
                Answer::NotYet(_) if pressed[k] && totals.normal[lane] == 0.0 => {
                    self.rub(point, totals, lane, None, velocity);
                }
                _ => {}
            }
        }
    }

    /// Two points that part do so at once: one after the other, the first would turn a box that falls flat, and the second not turn
    /// it back.
    fn bounce_along_normals(
        &self,
        points: &[PointRows],
        totals: &mut [Totals],
        lane: usize,
        answers: [Answer; 2],
        velocity: &mut [Quad],
    ) {
        if let ([one, two], [total_one, total_two], [Answer::Part(first), Answer::Part(second)]) =
            (points, &mut *totals, answers)
        {
            let totals = [&mut total_one.normal[lane], &mut total_two.normal[lane]];
            if *totals[0] > 0.0
                && *totals[1] > 0.0
                && self.bounce_together([one, two], totals, lane, [first.speed, second.speed], velocity)
            {
                return;
            }
        }
        for ((point, totals), answer) in points.iter().zip(totals).zip(answers) {
            let pressed = &mut totals.normal[lane];
            let wanted = match answer {
                Answer::Part(parting) if *pressed > 0.0 => {
                    point.normal_mass[lane] * (parting.speed - self.normal_speed(point, lane, velocity))
                }
                Answer::NotYet(most) if *pressed > most * point.normal_mass[lane] => -*pressed,
                _ => continue,
            };
            self.add_impulse(self.normal_rows(point, lane), pressed, lane, max(wanted, -*pressed), velocity);
        }
    }

    /// Lets friction of the whole step be what the point's normal impulses of the whole step allow, as far as it slides yet.
    ///
    /// Newton's restitution and Coulomb's friction can be at odds: where what throws a corner back turns its slip round, holding it then
    /// would add energy (T. Kane, "A dynamics puzzle", 1984). An impulse gives half of itself times the sum of the speeds along it before
    /// and after, so friction may give no more than the normal takes.
    fn rub(
        &self,
        point: &PointRows,
        totals: &mut Totals,
        lane: usize,
        parting: Option<Parting>,
        velocity: &mut [Quad],
    ) {
        let rows = self.tangent_rows(point, lane);
        let slip = along(rows[1], velocity[self.b[lane] as usize]) - along(rows[0], velocity[self.a[lane] as usize]);
        let most = self.friction[lane] * totals.normal[lane];
        let (rubbed, mass) = (&mut totals.tangent[lane], point.tangent_mass[lane]);
        let mut wanted = clamp(*rubbed - mass * slip, -most, most);
        if let Some(parting) = parting {
            let taken = totals.normal[lane] * (parting.closing - self.normal_speed(point, lane, velocity));
            // Impulses t with t * (slip before + slip after) <= taken.
            let half = 0.5 * (mass * (parting.slip + slip) - *rubbed);
            let root = (half * half + mass * max(taken, 0.0)).sqrt();
            wanted = clamp(wanted, -half - root, root - half);
        }
        self.add_impulse(rows, rubbed, lane, wanted - *rubbed, velocity);
    }

    /// Two points at once: both part as fast as they should; or one pulls for that, so it gives back what it pressed, and parts faster.
    fn bounce_together(
        &self,
        points: [&PointRows; 2],
        pressed: [&mut f32; 2],
        lane: usize,
        speeds: [f32; 2],
        velocity: &mut [Quad],
    ) -> bool {
        let rows = points.map(|point| self.normal_rows(point, lane));
        let [[one_a, one_b], [two_a, two_b]] = rows;
        let product = |u: [f32; 3], v: [f32; 3]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
        // How much speed an impulse at one of them gives each.
        let own = [product(one_a, one_a) + product(one_b, one_b), product(two_a, two_a) + product(two_b, two_b)];
        let other = product(one_a, two_a) + product(one_b, two_b);
        let determinant = own[0] * own[1] - other * other;
        let lacks = [0, 1].map(|k| speeds[k] - self.normal_speed(points[k], lane, velocity));
        let back = [-*pressed[0], -*pressed[1]];
        let both = [
            (own[1] * lacks[0] - other * lacks[1]) / determinant,
            (own[0] * lacks[1] - other * lacks[0]) / determinant,
        ];
        let first = [(lacks[0] - other * back[1]) / own[0], back[1]];
        let second = [back[0], (lacks[1] - other * back[0]) / own[1]];
        let pushes = |impulses: [f32; 2]| impulses[0] >= back[0] && impulses[1] >= back[1];
        let parts = |k: usize, impulses: [f32; 2]| own[k] * impulses[k] + other * impulses[1 - k] >= lacks[k];
        // Points that are nearly one leave nothing to tell them apart by.
        let impulses = if determinant > 1e-3 * own[0] * own[1] && pushes(both) {
            both
        } else if pushes(first) && parts(1, first) {
            first
        } else if pushes(second) && parts(0, second) {
            second
        } else {
            return false;
        };
        for ((rows, pressed), impulse) in rows.into_iter().zip(pressed).zip(impulses) {
            self.add_impulse(rows, pressed, lane, impulse, velocity);
        }
        true
    }

    /// Gives both bodies some more impulse along rows, and adds it to the sum.
    fn add_impulse(&self, rows: [[f32; 3]; 2], sum: &mut f32, lane: usize, impulse: f32, velocity: &mut [Quad]) {
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
