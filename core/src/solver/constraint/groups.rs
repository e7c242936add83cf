//! Constraints in groups of eight lanes, by batch, color and number of points.

use crate::exchange::record::BorderPoint;
use crate::model::contact::Contact;
use crate::model::math::max;
use crate::parallel::lanes::{LANES, Quad, Row};
use crate::solver::batches::{Batch, Batches};
use crate::solver::bodies::SolverBodies;
use crate::solver::coloring::{COLORS, Coloring};
use std::ops::Range;

/// Marks a lane without a contact.
pub(crate) const NO_CONTACT: u32 = u32::MAX;

/// Eight contacts of `N` points each that share no moving body. All rows are mass-weighted.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(crate) struct Group<const N: usize> {
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
    pub(crate) points: [PointRows; N],
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
    /// The anchor's length along the normal, from A and from B: what turning further shortens. Zero for a circle.
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
    pub(crate) const EMPTY: Self = Self {
        a: [0; LANES],
        b: [0; LANES],
        normal_ax: ZERO,
        normal_ay: ZERO,
        normal_bx: ZERO,
        normal_by: ZERO,
        friction: ZERO,
        fixed: ZERO,
        points: [PointRows::EMPTY; N],
    };
}

/// The groups of one color of a batch.
#[derive(Clone, Debug)]
pub(crate) struct Color {
    /// Within the batch's groups.
    pub(crate) singles: Range<usize>,
    pub(crate) doubles: Range<usize>,
    /// Into how many pieces the groups are cut.
    pub(crate) slices: u32,
}

impl Color {
    /// The groups of one piece.
    #[inline(always)]
    pub(crate) fn slice(&self, slice: u32) -> (Range<usize>, Range<usize>) {
        let cut = |range: &Range<usize>| {
            let at = |slice: u32| range.start + range.len() * slice as usize / self.slices as usize;
            at(slice)..at(slice + 1)
        };
        (cut(&self.singles), cut(&self.doubles))
    }
}

/// Where a contact's constraint lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    double: bool,
    group: u32,
    lane: u32,
    /// The first body of its batch.
    base: u32,
}

impl Place {
    /// Of a contact that is not solved: its island sleeps.
    const NONE: Self = Self { double: false, group: u32::MAX, lane: 0, base: 0 };
}

/// All constraints of a tile, batch by batch and color by color.
#[derive(Default, Debug)]
pub(crate) struct Groups {
    pub(crate) singles: Vec<Group<1>>,
    pub(crate) doubles: Vec<Group<2>>,
    /// For each group and lane the contact, in canonical order, or [`NO_CONTACT`].
    pub(crate) in_singles: Vec<[u32; LANES]>,
    pub(crate) in_doubles: Vec<[u32; LANES]>,
    pub(crate) colors: Vec<Color>,
    /// For each contact, in canonical order.
    places: Vec<Place>,
    /// Points that may bounce.
    pub(crate) bounces: Vec<Bounce>,
}

/// A point that may bounce.
#[derive(Debug)]
pub(crate) struct Bounce {
    pub(crate) contact: u32,
    pub(crate) point: u32,
    /// Restitution times approach speed, in m/s.
    pub(crate) speed: f32,
}

/// A place among the lanes of single and of double points.
#[derive(Clone, Copy, Default)]
struct Cursor {
    single: usize,
    double: usize,
}

impl Cursor {
    fn of(&mut self, double: bool) -> &mut usize {
        if double { &mut self.double } else { &mut self.single }
    }
}

impl Groups {
    /// Decides in which group and lane each contact goes. Returns the most colors of a batch.
    pub(crate) fn lay_out(&mut self, contacts: &[Contact], batches: &mut Batches, coloring: &Coloring) -> usize {
        self.colors.clear();
        self.in_singles.clear();
        self.in_doubles.clear();
        self.places.clear();
        self.places.resize(contacts.len(), Place::NONE);
        let mut most_colors = 0;
        for batch in &mut batches.all {
            let first = self.colors.len();
            let range = batch.contacts.clone();
            self.lay_out_batch(contacts, &batches.contacts[range.clone()], &coloring.color[range], batch);
            batch.colors = first..self.colors.len();
            // All that overflows counts as one color.
            most_colors = most_colors.max(batch.colors.len().min(COLORS + 1));
        }
        self.singles.resize(self.in_singles.len(), Group::EMPTY);
        self.doubles.resize(self.in_doubles.len(), Group::EMPTY);
        most_colors
    }

    fn lay_out_batch(&mut self, contacts: &[Contact], own: &[u32], colors: &[u8], batch: &mut Batch) {
        let (first_single, first_double) = (self.in_singles.len(), self.in_doubles.len());
        let is_double = |contact: u32| contacts[contact as usize].point_count() == 2;
        let mut counts = [Cursor::default(); COLORS + 1];
        for (&contact, &color) in own.iter().zip(colors) {
            *counts[color as usize].of(is_double(contact)) += 1;
        }
        // Where the next contact of each color goes, in lanes of the batch.
        let mut next = [Cursor::default(); COLORS];
        let mut end = Cursor::default();
        let mut color = |groups: Cursor, end: &mut Cursor| {
            let begin = *end;
            *end = Cursor { single: begin.single + groups.single, double: begin.double + groups.double };
            let slices = batch.slices(groups.single + groups.double);
            self.colors.push(Color { singles: begin.single..end.single, doubles: begin.double..end.double, slices });
        };
        for (next, count) in next.iter_mut().zip(&counts).filter(|(_, count)| count.single + count.double > 0) {
            *next = Cursor { single: end.single * LANES, double: end.double * LANES };
            let groups = Cursor { single: count.single.div_ceil(LANES), double: count.double.div_ceil(LANES) };
            color(groups, &mut end);
        }
        // What overflows: a group, and a color, for each.
        let mut overflow = Cursor { single: end.single * LANES, double: end.double * LANES };
        if counts[COLORS].single + counts[COLORS].double > 0 {
            for (&contact, _) in own.iter().zip(colors).filter(|&(_, &color)| color as usize == COLORS) {
                let mut groups = Cursor::default();
                *groups.of(is_double(contact)) = 1;
                color(groups, &mut end);
            }
        }
        self.in_singles.resize(first_single + end.single, [NO_CONTACT; LANES]);
        self.in_doubles.resize(first_double + end.double, [NO_CONTACT; LANES]);
        batch.singles = first_single..self.in_singles.len();
        batch.doubles = first_double..self.in_doubles.len();
        for (&contact, &color) in own.iter().zip(colors) {
            let double = is_double(contact);
            let (next, step) = match next.get_mut(color as usize) {
                Some(next) => (next.of(double), 1),
                None => (overflow.of(double), LANES),
            };
            let (lane, in_batch) = (*next % LANES, *next / LANES);
            *next += step;
            let (members, first) =
                if double { (&mut self.in_doubles, first_double) } else { (&mut self.in_singles, first_single) };
            let group = first + in_batch;
            members[group][lane] = contact;
            let base = batch.bodies.start as u32;
            self.places[contact as usize] = Place { double, group: group as u32, lane: lane as u32, base };
        }
    }

    fn rows(&self, contact: u32, point: usize) -> (&PointRows, usize) {
        let Place { double, group, lane, .. } = self.places[contact as usize];
        let group = group as usize;
        let rows = if double { &self.doubles[group].points[point] } else { &self.singles[group].points[point] };
        (rows, lane as usize)
    }

    /// Whether a contact has a constraint: not while its island sleeps.
    pub(crate) fn is_solved(&self, contact: u32) -> bool {
        self.places[contact as usize].group != Place::NONE.group
    }

    /// What one point of a contact did: its impulses now, and their sums over the step.
    pub(crate) fn point(&self, contact: u32, point: usize) -> BorderPoint {
        let (rows, lane) = self.rows(contact, point);
        BorderPoint {
            total_normal: rows.total_normal[lane],
            total_tangent: rows.total_tangent[lane],
            normal: rows.normal_impulse[lane],
            tangent: rows.tangent_impulse[lane],
            ..BorderPoint::NONE
        }
    }

    /// Overwrites the accumulated impulses of one point.
    pub(crate) fn set_impulses(&mut self, contact: u32, point: usize, normal: f32, tangent: f32) {
        let Place { double, group, lane, .. } = self.places[contact as usize];
        let (group, lane) = (group as usize, lane as usize);
        let rows = if double { &mut self.doubles[group].points[point] } else { &mut self.singles[group].points[point] };
        rows.normal_impulse[lane] = normal;
        rows.tangent_impulse[lane] = tangent;
    }

    /// One pass of restitution, in canonical order.
    pub(crate) fn restitute(&mut self, bodies: &mut SolverBodies) {
        for bounce in &self.bounces {
            let Place { double, group, lane, base } = self.places[bounce.contact as usize];
            let (group, lane, point) = (group as usize, lane as usize, bounce.point as usize);
            let velocity = &mut bodies.velocity[base as usize..];
            if double {
                self.doubles[group].bounce(lane, point, bounce.speed, velocity);
            } else {
                self.singles[group].bounce(lane, point, bounce.speed, velocity);
            }
        }
    }

    /// Brings a contact's separations up to date after its bodies were placed anew.
    pub(crate) fn refresh_separation(&mut self, contact: u32, bodies: &SolverBodies) {
        let Place { double, group, lane, base } = self.places[contact as usize];
        let (group, lane, pose) = (group as usize, lane as usize, &bodies.pose[base as usize..]);
        if double {
            self.doubles[group].refresh_separation(lane, pose);
        } else {
            self.singles[group].refresh_separation(lane, pose);
        }
    }

    /// Gives one of a contact's bodies some more impulse, along the normal and the tangent, at one of its points.
    pub(crate) fn push(&self, contact: u32, point: usize, upon_a: bool, impulse: [f32; 2], bodies: &mut SolverBodies) {
        let Place { double, group, lane, base } = self.places[contact as usize];
        let (group, lane, velocity) = (group as usize, lane as usize, &mut bodies.velocity[base as usize..]);
        if double {
            self.doubles[group].push(lane, point, upon_a, impulse, velocity);
        } else {
            self.singles[group].push(lane, point, upon_a, impulse, velocity);
        }
    }

    /// How fast the surfaces of a contact's point come nearer than they may, in m/s; negative or zero: they do not.
    pub(crate) fn violation(&self, contact: u32, point: usize, bodies: &SolverBodies, h: f32) -> f32 {
        let Place { double, group, lane, base } = self.places[contact as usize];
        let (group, lane, velocity) = (group as usize, lane as usize, &bodies.velocity[base as usize..]);
        let speed = if double {
            self.doubles[group].normal_speed(lane, point, velocity)
        } else {
            self.singles[group].normal_speed(lane, point, velocity)
        };
        let (rows, lane) = self.rows(contact, point);
        -speed - max(rows.separation[lane], 0.0) / h
    }
}

/// The speed of a body along a row.
fn along(row: [f32; 3], v: Quad) -> f32 {
    row[0] * v[0] + row[1] * v[1] + row[2] * v[2]
}

impl<const N: usize> Group<N> {
    /// Speed at which one point's surfaces move apart, in m/s.
    fn normal_speed(&self, lane: usize, point: usize, velocity: &[Quad]) -> f32 {
        let rows = &self.points[point];
        let row_a = [self.normal_ax[lane], self.normal_ay[lane], rows.normal_a[lane]];
        let row_b = [self.normal_bx[lane], self.normal_by[lane], rows.normal_b[lane]];
        along(row_b, velocity[self.b[lane] as usize]) - along(row_a, velocity[self.a[lane] as usize])
    }

    /// Gives one point back the speed it came in with, if it pressed at all.
    fn bounce(&mut self, lane: usize, point: usize, speed: f32, velocity: &mut [Quad]) {
        let approach = self.normal_speed(lane, point, velocity);
        let (a, b) = (self.a[lane] as usize, self.b[lane] as usize);
        let rows = &mut self.points[point];
        if rows.total_normal[lane] <= 0.0 {
            return;
        }
        let row_a = [self.normal_ax[lane], self.normal_ay[lane], rows.normal_a[lane]];
        let row_b = [self.normal_bx[lane], self.normal_by[lane], rows.normal_b[lane]];
        let wanted = -rows.normal_mass[lane] * (approach - speed);
        let impulse = max(wanted, -rows.normal_impulse[lane]);
        rows.total_normal[lane] += impulse;
        for k in 0..3 {
            velocity[a][k] -= row_a[k] * impulse;
            velocity[b][k] += row_b[k] * impulse;
        }
    }

    /// Gives one body of one lane an impulse along the normal and the tangent of one point.
    pub(crate) fn push(&self, lane: usize, point: usize, upon_a: bool, impulse: [f32; 2], velocity: &mut [Quad]) {
        let rows = &self.points[point];
        let (body, sign, x, y, normal, tangent) = if upon_a {
            (self.a[lane], -1.0, self.normal_ax[lane], self.normal_ay[lane], rows.normal_a[lane], rows.tangent_a[lane])
        } else {
            (self.b[lane], 1.0, self.normal_bx[lane], self.normal_by[lane], rows.normal_b[lane], rows.tangent_b[lane])
        };
        let velocity = &mut velocity[body as usize];
        let [along, across] = impulse.map(|impulse| sign * impulse);
        velocity[0] += x * along + y * across;
        velocity[1] += y * along - x * across;
        velocity[2] += normal * along + tangent * across;
    }

    /// Separation of one lane's point by the bodies' poses now.
    pub(crate) fn refresh_separation(&mut self, lane: usize, pose: &[Quad]) {
        let (pose_a, pose_b) = (pose[self.a[lane] as usize], pose[self.b[lane] as usize]);
        for rows in &mut self.points {
            let moved_a = self.normal_ax[lane] * pose_a[0]
                + self.normal_ay[lane] * pose_a[1]
                + rows.normal_a[lane] * pose_a[3]
                + rows.depth_a[lane] * pose_a[2];
            let moved_b = self.normal_bx[lane] * pose_b[0]
                + self.normal_by[lane] * pose_b[1]
                + rows.normal_b[lane] * pose_b[3]
                + rows.depth_b[lane] * pose_b[2];
            rows.separation[lane] = rows.first_separation[lane] + (moved_b - moved_a);
        }
    }
}
