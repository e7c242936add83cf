//! All constraints of a tile, and how to find that of a contact.

use super::bounce::Answer;
use super::columns::{Color, Columns, Each, Members, Slices, lengths};
use super::energies::Energies;
use super::group::{PointRows, Sides, Totals};
use super::late::Late;
use crate::model::contact::Contact;
use crate::model::math::{clamp, max};
use crate::parallel::lanes::Quad;
use crate::parallel::team::Team;
use crate::solver::batches::Batch;
use crate::solver::bodies::SolverBodies;

/// Contacts in a piece of work, at least.
const GRAIN: usize = 2048;

/// All constraints of a tile, batch by batch and color by color.
#[derive(Default, Debug)]
pub(crate) struct Groups {
    /// Of all batches that keep theirs.
    pub(super) kept: Columns,
    /// Of those that are solved at once, one after another.
    pub(super) at_once: Columns,
    /// For each group of each column, batch by batch.
    pub(super) members: Each<Vec<Members>>,
    pub(super) colors: Vec<Color>,
    /// For each contact, in canonical order.
    pub(super) lanes: Vec<Lane>,
    /// Contacts that may bounce, of batches that keep their rows.
    pub(super) bounces: Vec<Bounce>,
    /// These contacts, ascending, each with the speed of the blow that it gives back or passes on, in m/s, and whether it could pass on
    /// a faster one.
    pub(super) bouncing: Vec<(u32, f32, bool)>,
    /// The same of batches that are solved at once: batch by batch.
    pub(super) bounces_at_once: Vec<Bounce>,
    /// What bounces may have.
    pub(super) energies: Energies,
    /// What they lose of the step.
    pub(super) late: Late,
    /// While contacts bounce.
    pub(super) times: Times,
    /// For each body whether something held it as the step began, where that was asked.
    pub(super) held: Vec<Option<bool>>,
    /// For each body a lower one that a blow may go on to, or come from, or itself.
    pub(super) on: Vec<u32>,
    /// For each body whether a blow comes to it or goes on from it; and of those that it goes on to, and that know of this one as the
    /// lowest, the speed of the fastest, in m/s, or zero.
    pub(super) struck: Vec<(bool, f32)>,
}

/// When what happened last while contacts bounce, each with a time of its own.
#[derive(Default, Debug)]
pub(super) struct Times {
    /// For each of the solver's bodies: something moved it.
    pub(super) moved: Vec<u32>,
    /// For each contact that bounces: it was looked at.
    pub(super) looked: Vec<u32>,
}

/// A contact that may bounce.
#[derive(Debug)]
pub(crate) struct Bounce {
    pub(super) contact: u32,
    /// Those of its bodies that are no statics, as bodies of the tile.
    pub(super) moving: [Option<u32>; 2],
    /// Speed at which the faster of its points comes in, in m/s.
    pub(super) closing: f32,
    /// Speed of the fastest blow that it gives back or passes on, in m/s; zero if it only holds.
    pub(super) blow: f32,
    /// How long its bodies go on from there in this step, in s, where that is known: see [`Late`].
    pub(super) left: f32,
    /// How much further they part by then than by what they do in the end, in m.
    pub(super) rise: f32,
    /// Whether one of the two never moves.
    pub(super) off_static: bool,
    /// Of each point.
    pub(super) answers: [Answer; 2],
}

/// How the surfaces of a contact move at each of its points, B seen from A, along normal and tangent, in m/s; and the impulses there, in
/// N s.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct ContactMotion {
    speeds: [[f32; 2]; 2],
    impulses: [[f32; 2]; 2],
}

/// Where a contact's constraint lies.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Lane {
    column: u8,
    lane: u8,
    group: u32,
    /// The first body of its batch.
    pub(super) base: u32,
}

impl Lane {
    /// Of a contact that is not solved: its island sleeps.
    pub(super) const NONE: Self = Self { column: 0, lane: 0, group: u32::MAX, base: 0 };

    pub(super) fn new(column: usize, group: usize, lane: usize, base: usize) -> Self {
        Self { column: column as u8, lane: lane as u8, group: group as u32, base: base as u32 }
    }

    /// Whether it lies in that column.
    pub(super) fn is_of(self, column: usize) -> bool {
        usize::from(self.column) == column
    }

    /// Those of some bodies that its batch has.
    pub(super) fn bodies(self, all: &[Quad]) -> &[Quad] {
        &all[self.base as usize..]
    }

    pub(super) fn bodies_mut(self, all: &mut [Quad]) -> &mut [Quad] {
        &mut all[self.base as usize..]
    }

    pub(super) fn rows(self, columns: &Columns) -> (&Sides, &[PointRows], usize) {
        let (sides, points) = columns.rows(self.column.into(), self.group as usize);
        (sides, points, self.lane.into())
    }

    pub(super) fn totals_mut(self, columns: &mut Columns) -> (&Sides, &mut [PointRows], &mut [Totals], usize) {
        let (sides, points, totals) = columns.totals_mut(self.column.into(), self.group as usize);
        (sides, points, totals, self.lane.into())
    }

    pub(super) fn rows_mut(self, columns: &mut Columns) -> (&Sides, &mut [PointRows], usize) {
        let (sides, points) = columns.rows_mut(self.column.into(), self.group as usize);
        (sides, points, self.lane.into())
    }
}

/// Copies the impulses of one lane back to its contact.
#[inline(always)]
fn store_impulses(contact: &mut Contact, rows: &[PointRows], lane: usize) {
    for (point, rows) in contact.points.iter_mut().zip(rows) {
        point.normal_impulse = rows.normal_impulse[lane];
        point.tangent_impulse = rows.tangent_impulse[lane];
    }
}

impl Groups {
    /// The groups of all batches that keep theirs, and the colors of all batches.
    pub(crate) fn kept(&mut self) -> (Slices<'_>, &[Color]) {
        (self.kept.slices(), &self.colors)
    }

    /// The groups of a batch that is solved at once, and the colors of all batches.
    pub(crate) fn at_once(&mut self, batch: &Batch) -> (Slices<'_>, &[Color]) {
        (self.at_once.slices().split_off(lengths(&batch.groups)), &self.colors)
    }

    /// Copies the impulses of the last substep back to the contacts of a batch.
    pub(crate) fn store_impulses(&self, batch: &Batch, contacts: &mut [Contact]) {
        let columns = if batch.at_once { &self.at_once } else { &self.kept };
        columns.each(&batch.groups, batch.members_of(&self.members), |rows, members| {
            for (lane, &contact) in members.iter().enumerate() {
                let Some(contact) = contacts.get_mut(contact as usize) else { continue };
                store_impulses(contact, rows, lane);
            }
        });
    }

    /// Copies the impulses of the last substep back to all contacts, whose batches keep their rows, with the help of others.
    pub(crate) fn store_all_impulses(&self, contacts: &mut [Contact], team: Team) {
        let (count, mut contacts) = (contacts.len(), contacts);
        let parts = team.ranges(count, GRAIN).map(|range| {
            let contacts = contacts.split_off_mut(..range.len()).expect("as many are left");
            (contacts, &self.lanes[range])
        });
        team.for_each(parts.collect(), |(contacts, lanes)| {
            for (contact, lane) in contacts.iter_mut().zip(lanes).filter(|(_, lane)| **lane != Lane::NONE) {
                let (_, rows, lane) = lane.rows(&self.kept);
                store_impulses(contact, rows, lane);
            }
        });
    }

    /// Whether a contact has a constraint: not while its island sleeps.
    pub(crate) fn is_solved(&self, contact: u32) -> bool {
        self.lanes[contact as usize] != Lane::NONE
    }

    /// The impulses now at one point of a contact, along the normal and the tangent. Here and below it is one whose batch keeps its rows.
    pub(crate) fn impulses(&self, contact: u32, point: usize) -> [f32; 2] {
        let (_, points, lane) = self.lanes[contact as usize].rows(&self.kept);
        [points[point].normal_impulse[lane], points[point].tangent_impulse[lane]]
    }

    /// The impulses of one point of a contact that may bounce, over the step and its bounce, along the normal and the tangent.
    pub(crate) fn totals(&self, contact: u32, point: usize) -> [f32; 2] {
        let Lane { column, lane, group, .. } = self.lanes[contact as usize];
        self.kept.totals(column.into(), group as usize, point).of(lane.into())
    }

    /// Overwrites the same.
    pub(crate) fn set_totals(&mut self, contact: u32, point: usize, [normal, tangent]: [f32; 2]) {
        let at = self.lanes[contact as usize];
        let (_, _, totals, lane) = at.totals_mut(&mut self.kept);
        (totals[point].normal[lane], totals[point].tangent[lane]) = (normal, tangent);
    }

    /// How a contact's surfaces move, and what it has pressed in the last substep.
    pub(crate) fn motion(&self, contact: u32, bodies: &SolverBodies) -> ContactMotion {
        let at = self.lanes[contact as usize];
        let (sides, points, lane) = at.rows(&self.kept);
        let velocity = at.bodies(&bodies.velocity);
        let mut motion = ContactMotion::default();
        for ((rows, impulses), speeds) in points.iter().zip(&mut motion.impulses).zip(&mut motion.speeds) {
            *impulses = [rows.normal_impulse[lane], rows.tangent_impulse[lane]];
            let (along, across) = (sides.normal_rows(rows, lane, velocity), sides.tangent_rows(rows, lane, velocity));
            *speeds = [along, across].map(|rows| sides.speed(rows, lane, velocity));
        }
        motion
    }

    /// Has a contact's surfaces come that part of the way to how they moved, point by point, as far as it may press and rub: sequential impulses. What it presses
    /// then is noted there, and nowhere else.
    pub(crate) fn restore(
        &self,
        contact: u32,
        ContactMotion { speeds, impulses }: &mut ContactMotion,
        part: f32,
        bodies: &mut SolverBodies,
    ) {
        let at = self.lanes[contact as usize];
        let (sides, points, lane) = at.rows(&self.kept);
        let velocity = at.bodies_mut(&mut bodies.velocity);
        for ((rows, speeds), [normal, tangent]) in points.iter().zip(speeds).zip(impulses) {
            let along = sides.normal_rows(rows, lane, velocity);
            let wanted = *normal - part * rows.normal_mass[lane] * (sides.speed(along, lane, velocity) - speeds[0]);
            sides.add_impulse(along, normal, lane, max(wanted, 0.0) - *normal, velocity);
            let across = sides.tangent_rows(rows, lane, velocity);
            let most = sides.friction[lane] * *normal;
            let wanted = *tangent - part * rows.tangent_mass[lane] * (sides.speed(across, lane, velocity) - speeds[1]);
            sides.add_impulse(across, tangent, lane, clamp(wanted, -most, most) - *tangent, velocity);
        }
    }

    /// Overwrites the accumulated impulses of one point.
    pub(crate) fn set_impulses(&mut self, contact: u32, point: usize, [normal, tangent]: [f32; 2]) {
        let (_, points, lane) = self.lanes[contact as usize].rows_mut(&mut self.kept);
        points[point].normal_impulse[lane] = normal;
        points[point].tangent_impulse[lane] = tangent;
    }

    /// Brings a contact's separations up to date after its bodies were placed anew.
    pub(crate) fn refresh_separation(&mut self, contact: u32, bodies: &SolverBodies) {
        let at = self.lanes[contact as usize];
        let (sides, points, lane) = at.rows_mut(&mut self.kept);
        for point in points {
            point.separation[lane] =
                sides.separation(point, lane, at.bodies(&bodies.velocity), at.bodies(&bodies.pose));
        }
    }

    /// Gives one of a contact's bodies some more impulse, along the normal and the tangent, at one of its points.
    pub(crate) fn apply_impulse(
        &self,
        contact: u32,
        point: usize,
        upon_a: bool,
        impulse: [f32; 2],
        bodies: &mut SolverBodies,
    ) {
        let at = self.lanes[contact as usize];
        let (sides, points, lane) = at.rows(&self.kept);
        sides.apply_impulse(&points[point], lane, upon_a, impulse, at.bodies_mut(&mut bodies.velocity));
    }

    /// How fast the surfaces of a contact's point come nearer than they may, in m/s; negative or zero: they do not.
    pub(crate) fn violation(&self, contact: u32, point: usize, bodies: &SolverBodies, h: f32) -> f32 {
        let at = self.lanes[contact as usize];
        let (sides, points, lane) = at.rows(&self.kept);
        let speed = sides.normal_speed(&points[point], lane, at.bodies(&bodies.velocity));
        -speed - max(points[point].separation[lane], 0.0) / h
    }
}
