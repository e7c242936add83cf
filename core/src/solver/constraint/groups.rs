//! All constraints of a tile, and how to find that of a contact.

use super::columns::{Color, Columns, Each, Members, Slices};
use super::group::{PointRows, Sides};
use crate::exchange::record::BorderPoint;
use crate::model::math::max;
use crate::parallel::lanes::Quad;
use crate::solver::bodies::SolverBodies;

/// All constraints of a tile, batch by batch and color by color.
#[derive(Default, Debug)]
pub(crate) struct Groups {
    pub(super) columns: Columns,
    /// For each group of each column.
    pub(super) members: Each<Vec<Members>>,
    pub(super) colors: Vec<Color>,
    /// For each contact, in canonical order.
    pub(super) lanes: Vec<Lane>,
    /// Contacts that may bounce.
    pub(super) bounces: Vec<Bounce>,
}

/// A contact that may bounce.
#[derive(Debug)]
pub(crate) struct Bounce {
    pub(super) contact: u32,
    /// Of each point.
    pub(super) answers: [Answer; 2],
}

/// What becomes of a point that pressed in the step.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Answer {
    /// No more than the solver did.
    Rest,
    /// It came in fast, and parts at this speed, in m/s.
    Part(f32),
    /// It came apart, and only a blow within the step had it press: if that gave it more than this speed, in m/s, the blow is
    /// passed on in the next step, as one between bodies that come in fast.
    NotYet(f32),
}

/// Where a contact's constraint lies.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Lane {
    column: u8,
    lane: u8,
    group: u32,
    /// The first body of its batch.
    base: u32,
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
    fn bodies(self, all: &[Quad]) -> &[Quad] {
        &all[self.base as usize..]
    }

    pub(super) fn bodies_mut(self, all: &mut [Quad]) -> &mut [Quad] {
        &mut all[self.base as usize..]
    }

    pub(super) fn rows(self, columns: &Columns) -> (&Sides, &[PointRows], usize) {
        let (sides, points) = columns.rows(self.column.into(), self.group as usize);
        (sides, points, self.lane.into())
    }

    pub(super) fn rows_mut(self, columns: &mut Columns) -> (&Sides, &mut [PointRows], usize) {
        let (sides, points) = columns.rows_mut(self.column.into(), self.group as usize);
        (sides, points, self.lane.into())
    }
}

impl Groups {
    /// All groups, and the colors of all batches.
    pub(crate) fn parts(&mut self) -> (Slices<'_>, &[Color]) {
        (self.columns.slices(), &self.colors)
    }

    /// Shows the points of each group with the group's members.
    pub(crate) fn each(&self, show: impl FnMut(&[PointRows], &Members)) {
        self.columns.each(&self.members, show);
    }

    /// Whether a contact has a constraint: not while its island sleeps.
    pub(crate) fn is_solved(&self, contact: u32) -> bool {
        self.lanes[contact as usize] != Lane::NONE
    }

    /// What one point of a contact did: its impulses now, and their sums over the step.
    pub(crate) fn point(&self, contact: u32, point: usize) -> BorderPoint {
        let (_, points, lane) = self.lanes[contact as usize].rows(&self.columns);
        let point = &points[point];
        BorderPoint {
            total_normal: point.total_normal[lane],
            total_tangent: point.total_tangent[lane],
            normal: point.normal_impulse[lane],
            tangent: point.tangent_impulse[lane],
            ..BorderPoint::NONE
        }
    }

    /// Overwrites the accumulated impulses of one point.
    pub(crate) fn set_impulses(&mut self, contact: u32, point: usize, normal: f32, tangent: f32) {
        let (_, points, lane) = self.lanes[contact as usize].rows_mut(&mut self.columns);
        points[point].normal_impulse[lane] = normal;
        points[point].tangent_impulse[lane] = tangent;
    }

    /// Brings a contact's separations up to date after its bodies were placed anew.
    pub(crate) fn refresh_separation(&mut self, contact: u32, bodies: &SolverBodies) {
        let at = self.lanes[contact as usize];
        let (sides, points, lane) = at.rows_mut(&mut self.columns);
        for point in points {
            point.separation[lane] = sides.separation(point, lane, at.bodies(&bodies.pose));
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
        let (sides, points, lane) = at.rows(&self.columns);
        sides.apply_impulse(&points[point], lane, upon_a, impulse, at.bodies_mut(&mut bodies.velocity));
    }

    /// How fast the surfaces of a contact's point come nearer than they may, in m/s; negative or zero: they do not.
    pub(crate) fn violation(&self, contact: u32, point: usize, bodies: &SolverBodies, h: f32) -> f32 {
        let at = self.lanes[contact as usize];
        let (sides, points, lane) = at.rows(&self.columns);
        let speed = sides.normal_speed(&points[point], lane, at.bodies(&bodies.velocity));
        -speed - max(points[point].separation[lane], 0.0) / h
    }
}
