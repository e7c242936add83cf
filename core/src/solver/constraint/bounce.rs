//! The bounce of one contact: what becomes of its points once the solver has stopped them.

use super::group::{PointRows, Sides, Totals};
use crate::model::math::{clamp, max, min};
use crate::parallel::lanes::Quad;
use crate::tiling::blueprint::Setup;

/// What becomes of a point that pressed in the step.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Answer {
    /// No more than the solver did, and less if it would part: what throws one of its bodies back is not to pull at the other.
    Hold,
    /// It came in fast, and parts.
    Part(Parting),
    /// Its surfaces came no nearer, or slowly, and no load pressed there. Where what pressed takes more than a speed it was a blow within the step, which
    /// is passed on in the next one, as one between bodies that come in fast.
    NotYet(Passing),
}

/// How a blow is passed on; speeds in m/s.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Passing {
    /// At which its surfaces come nearer.
    pub(super) closing: f32,
    /// How deep its bodies lie in each other, by the part that restitution does not give back, in m.
    pub(super) lost: f32,
    /// What takes no more is no blow.
    pub(super) least: f32,
    /// No blow makes bodies come nearer faster: what takes more pressed from two sides. Until it is known how fast blows are, the speed at
    /// which the two moved apart.
    pub(super) most: f32,
    /// Whether something held one of the two as the step began: then it stays that.
    pub(super) held: bool,
}

/// What lies deeper in each other than a blow takes bodies in this part of a step, and parts by less than that part of its speed, is stuck.
const STUCK_BY_WAY: f32 = 0.015;
const STUCK_BY_SPEED: f32 = 0.05;

impl Passing {
    /// Whether a blow of such a speed, in m/s, is not to be passed on here. In a crowd that is pressed together there is one somewhere in every
    /// step, and who passes it on holds nobody: bodies of restitution 0.01 went halfway into each other. Elastic ones lose nothing by
    /// what they pass on, and part in the end.
    pub(super) fn is_stuck(&self, blow: f32, setup: &Setup) -> bool {
        self.lost > STUCK_BY_WAY * setup.params.dt * blow && self.closing > -STUCK_BY_SPEED * blow
    }
}

/// How a point that bounces came, and how it is to part; speeds in m/s, those along the normal as seen from a static as it is in the last substep.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Parting {
    /// At which its surfaces came nearer.
    pub(super) closing: f32,
    /// At which they slid along each other.
    pub(super) slip: f32,
    /// At which they are to part.
    pub(super) speed: f32,
    /// At which they slide in the last substep where they did not as they touched.
    pub(super) slides: f32,
}

impl Sides {
    /// Gives the points of a contact that pressed what they are to have, and friction what it may have of that. Nothing happens where
    /// that would change the speed at a point by less than `least`, in m/s. Whether something did.
    pub(crate) fn bounce(
        &self,
        points: &mut [PointRows],
        totals: &mut [Totals],
        lane: usize,
        answers: [Answer; 2],
        least: f32,
        velocity: &mut [Quad],
    ) -> bool {
        let pressed = [0, 1].map(|k| totals.get(k).is_some_and(|totals| totals.normal[lane] > 0.0));
        let mut acted = self.bounce_along_normals(points, totals, lane, answers, least, velocity);
        for (k, (point, totals)) in points.iter().zip(totals).enumerate() {
            match answers[k] {
                Answer::Part(parting) if pressed[k] => {
                    acted |= self.rub(point, totals, lane, Some(parting), least, velocity);
                }
                // What was not to bounce yet, and keeps its impulse, keeps its friction.
                Answer::NotYet(_) if pressed[k] && totals.normal[lane] == 0.0 => {
                    acted |= self.rub(point, totals, lane, None, least, velocity);
                }
                _ => {}
            }
        }
        acted
    }

    /// Two points that part do so at once: one after the other, the first would turn a box that falls flat, and the second not turn
    /// it back.
    fn bounce_along_normals(
        &self,
        points: &mut [PointRows],
        totals: &mut [Totals],
        lane: usize,
        answers: [Answer; 2],
        least: f32,
        velocity: &mut [Quad],
    ) -> bool {
        if let ([one, two], [total_one, total_two], [Answer::Part(first), Answer::Part(second)]) =
            (&*points, &mut *totals, answers)
        {
            let totals = [&mut total_one.normal[lane], &mut total_two.normal[lane]];
            let speeds = [first.speed, second.speed];
            if *totals[0] > 0.0
                && *totals[1] > 0.0
                && let Some(acted) = self.bounce_together([one, two], totals, lane, speeds, least, velocity)
            {
                return acted;
            }
        }
        let (mut acted, is_blow) = (false, self.is_blow(points, totals, lane, answers, velocity));
        for ((point, totals), answer) in points.iter_mut().zip(totals).zip(answers) {
            let (pressed, rows) = (&mut totals.normal[lane], self.normal_rows(point, lane, velocity));
            let wanted = match answer {
                Answer::Part(parting) if *pressed > 0.0 => {
                    point.normal_mass[lane] * (parting.speed - self.speed(rows, lane, velocity))
                }
                Answer::NotYet(Passing { most, .. }) if is_blow => {
                    min(0.0, -point.normal_mass[lane] * (most + self.speed(rows, lane, velocity)))
                }
                Answer::Hold if *pressed > 0.0 => min(0.0, -point.normal_mass[lane] * self.speed(rows, lane, velocity)),
                _ => continue,
            };
            let impulse = max(wanted, -*pressed);
            if impulse.abs() > least * point.normal_mass[lane] {
                self.add_impulse(rows, pressed, lane, impulse, velocity);
                acted = true;
            }
            // What was given back is not there to begin the next step with, nor to tell of somebody who is held.
            if *pressed == 0.0 {
                (point.normal_impulse[lane], point.tangent_impulse[lane]) = (0.0, 0.0);
            }
        }
        acted
    }

    /// Whether what pressed at the points of a contact was a blow within the step: at one of them, all of it.
    fn is_blow(
        &self,
        points: &[PointRows],
        totals: &[Totals],
        lane: usize,
        answers: [Answer; 2],
        velocity: &[Quad],
    ) -> bool {
        let rows = |point: &PointRows| self.normal_rows(point, lane, velocity);
        points.iter().zip(answers).any(|(point, answer)| {
            let Answer::NotYet(Passing { least, .. }) = answer else { return false };
            let own = rows(point);
            let all = points.iter().zip(totals);
            let taken: f32 = all.map(|(point, totals)| speed_given(own, rows(point)) * totals.normal[lane]).sum();
            taken > least
        })
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
        least: f32,
        velocity: &mut [Quad],
    ) -> bool {
        let rows = self.tangent_rows(point, lane, velocity);
        let slip = self.speed(rows, lane, velocity) - parting.map_or(0.0, |parting| parting.slides);
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
        let impulse = wanted - *rubbed;
        let acts = impulse.abs() > least * mass;
        if acts {
            self.add_impulse(rows, rubbed, lane, impulse, velocity);
        }
        acts
    }

    /// Two points at once: both part as fast as they should; or one pulls for that, so it gives back what it pressed, and parts faster.
    /// Whether that changes something, if the two can be told apart.
    fn bounce_together(
        &self,
        points: [&PointRows; 2],
        pressed: [&mut f32; 2],
        lane: usize,
        speeds: [f32; 2],
        least: f32,
        velocity: &mut [Quad],
    ) -> Option<bool> {
        let rows = points.map(|point| self.normal_rows(point, lane, velocity));
        let own = rows.map(|rows| speed_given(rows, rows));
        let other = speed_given(rows[0], rows[1]);
        let determinant = own[0] * own[1] - other * other;
        let lacks = [0, 1].map(|k| speeds[k] - self.speed(rows[k], lane, velocity));
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
            return None;
        };
        if impulses.iter().zip(own).all(|(impulse, own)| impulse.abs() * own <= least) {
            return Some(false);
        }
        for ((rows, pressed), impulse) in rows.into_iter().zip(pressed).zip(impulses) {
            self.add_impulse(rows, pressed, lane, impulse, velocity);
        }
        Some(true)
    }
}

/// How much speed an impulse along some rows gives along others.
fn speed_given([one_a, one_b]: [[f32; 3]; 2], [two_a, two_b]: [[f32; 3]; 2]) -> f32 {
    let product = |u: [f32; 3], v: [f32; 3]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    product(one_a, two_a) + product(one_b, two_b)
}
