//! Constraints in groups of eight lanes.

use super::bodies::SolverBodies;
use super::coloring::{COLORS, Coloring};
use super::lanes::{LANES, Row};
use crate::halo::BorderPoint;
use crate::math::{cross, dot, max, right_perp, turn};
use crate::narrow_phase::Contacts;
use crate::setup::Setup;
use crate::shape::{KindRow, Shape};
use crate::tile::Tile;
use glam::Vec2;
use std::ops::Range;

/// Marks a lane without a contact.
const NO_CONTACT: u32 = u32::MAX;

/// Eight contacts of `N` points each that share no moving body. All rows are mass-weighted.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(crate) struct Group<const N: usize> {
    /// Solver bodies; 0 in a lane without a contact.
    pub(super) a: [u32; LANES],
    pub(super) b: [u32; LANES],
    /// The contact's place in canonical order.
    pub(super) contact: [u32; LANES],
    /// The normal, times the root of the inverse mass of A and of B.
    pub(super) normal_ax: Row,
    pub(super) normal_ay: Row,
    pub(super) normal_bx: Row,
    pub(super) normal_by: Row,
    pub(super) friction: Row,
    /// One for a contact with a static, else zero.
    pub(super) fixed: Row,
    pub(super) points: [PointRows; N],
}

/// One point of eight contacts.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(crate) struct PointRows {
    /// Moment arms of the normal and the tangent about A and B, times the root of the inverse inertia.
    pub(super) normal_a: Row,
    pub(super) normal_b: Row,
    pub(super) tangent_a: Row,
    pub(super) tangent_b: Row,
    /// The anchor's length along the normal, from A and from B: what turning further shortens. Zero for a circle.
    pub(super) depth_a: Row,
    pub(super) depth_b: Row,
    /// Effective masses.
    pub(super) normal_mass: Row,
    pub(super) tangent_mass: Row,
    /// Separation at the beginning of the step, and now.
    pub(super) first_separation: Row,
    pub(super) separation: Row,
    /// Accumulated impulses of the substep.
    pub(super) normal_impulse: Row,
    pub(super) tangent_impulse: Row,
    /// Their sums over the step's substeps, kept only where somebody asks.
    pub(super) total_normal: Row,
    pub(super) total_tangent: Row,
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
    const EMPTY: Self = Self {
        a: [0; LANES],
        b: [0; LANES],
        contact: [NO_CONTACT; LANES],
        normal_ax: ZERO,
        normal_ay: ZERO,
        normal_bx: ZERO,
        normal_by: ZERO,
        friction: ZERO,
        fixed: ZERO,
        points: [PointRows::EMPTY; N],
    };
}

/// The groups of one color.
#[derive(Clone, Debug)]
pub(crate) struct Color {
    pub(super) singles: Range<usize>,
    pub(super) doubles: Range<usize>,
}

/// Where a contact's constraint lies.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Place {
    pub(crate) double: bool,
    pub(crate) group: u32,
    pub(crate) lane: u32,
}

/// All constraints of a tile, color by color.
#[derive(Default, Debug)]
pub(crate) struct Groups {
    pub(super) singles: Vec<Group<1>>,
    pub(super) doubles: Vec<Group<2>>,
    pub(super) colors: Vec<Color>,
    /// For each contact, in canonical order.
    pub(super) places: Vec<Place>,
    /// Points that may bounce: contact, point, restitution times approach speed.
    bounces: Vec<Bounce>,
}

#[derive(Debug)]
struct Bounce {
    contact: u32,
    point: u32,
    speed: f32,
}

impl Groups {
    /// Lays the contacts out by color and number of points, and writes their rows.
    pub(super) fn prepare(
        &mut self,
        tile: &Tile,
        contacts: &Contacts,
        bodies: &SolverBodies,
        coloring: &Coloring,
        setup: &Setup,
    ) {
        self.lay_out(contacts, coloring);
        self.bounces.clear();
        for (i, contact) in contacts.cache.contacts.iter().enumerate() {
            let constraint = Constraint::new(tile, contacts, i, bodies, setup);
            let place = self.places[i];
            let (group, lane) = (place.group as usize, place.lane as usize);
            if place.double {
                constraint.write(&mut self.doubles[group], lane);
            } else {
                constraint.write(&mut self.singles[group], lane);
            }
            let restitution = max(constraint.kinds[0].material.restitution, constraint.kinds[1].material.restitution);
            if restitution > 0.0 {
                for point in 0..contact.point_count() {
                    let closing = constraint.closing_speed(tile, point);
                    if closing > setup.params.restitution_threshold {
                        self.bounces.push(Bounce {
                            contact: i as u32,
                            point: point as u32,
                            speed: restitution * closing,
                        });
                    }
                }
            }
        }
    }

    fn lay_out(&mut self, contacts: &Contacts, coloring: &Coloring) {
        let mut counts = [[0_usize; 2]; COLORS + 1];
        let is_double = |i: usize| contacts.cache.contacts[i].point_count() == 2;
        for (i, &color) in coloring.color.iter().enumerate() {
            counts[color as usize][usize::from(is_double(i))] += 1;
        }
        self.colors.clear();
        let (mut singles, mut doubles) = (0, 0);
        // Where the next contact of each color and number of points goes, in lanes.
        let mut next = [[0_usize; 2]; COLORS];
        for (color, &[single, double]) in counts[..COLORS].iter().enumerate() {
            next[color] = [singles * LANES, doubles * LANES];
            let (end_single, end_double) = (singles + single.div_ceil(LANES), doubles + double.div_ceil(LANES));
            if end_single > singles || end_double > doubles {
                self.colors.push(Color { singles: singles..end_single, doubles: doubles..end_double });
            }
            (singles, doubles) = (end_single, end_double);
        }
        self.places.clear();
        for (i, &color) in coloring.color.iter().enumerate() {
            let double = is_double(i);
            let lane = if (color as usize) < COLORS {
                let next = &mut next[color as usize][usize::from(double)];
                *next += 1;
                *next - 1
            } else {
                // Overflow: a group, and a color, of its own.
                let count = if double { &mut doubles } else { &mut singles };
                *count += 1;
                let group = *count - 1;
                let range = group..group + 1;
                self.colors.push(if double {
                    Color { singles: 0..0, doubles: range }
                } else {
                    Color { singles: range, doubles: 0..0 }
                });
                group * LANES
            };
            self.places.push(Place { double, group: (lane / LANES) as u32, lane: (lane % LANES) as u32 });
        }
        self.singles.clear();
        self.singles.resize(singles, Group::EMPTY);
        self.doubles.clear();
        self.doubles.resize(doubles, Group::EMPTY);
    }

    fn rows(&self, contact: u32, point: usize) -> (&PointRows, usize) {
        let Place { double, group, lane } = self.places[contact as usize];
        let group = group as usize;
        let rows = if double { &self.doubles[group].points[point] } else { &self.singles[group].points[point] };
        (rows, lane as usize)
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
        let Place { double, group, lane } = self.places[contact as usize];
        let (group, lane) = (group as usize, lane as usize);
        let rows = if double { &mut self.doubles[group].points[point] } else { &mut self.singles[group].points[point] };
        rows.normal_impulse[lane] = normal;
        rows.tangent_impulse[lane] = tangent;
    }

    /// One pass of restitution, in canonical order.
    pub(super) fn restitute(&mut self, bodies: &mut SolverBodies) {
        for bounce in &self.bounces {
            let Place { double, group, lane } = self.places[bounce.contact as usize];
            let (group, lane, point) = (group as usize, lane as usize, bounce.point as usize);
            if double {
                self.doubles[group].bounce(lane, point, bounce.speed, bodies);
            } else {
                self.singles[group].bounce(lane, point, bounce.speed, bodies);
            }
        }
    }
}

/// Everything about one contact that its lane needs.
struct Constraint<'a> {
    contact: &'a crate::Contact,
    index: usize,
    separation: [f32; 2],
    bodies: [usize; 2],
    solver: [u32; 2],
    kinds: [&'a KindRow; 2],
}

impl<'a> Constraint<'a> {
    #[inline(always)]
    fn new(tile: &Tile, contacts: &'a Contacts, index: usize, bodies: &SolverBodies, setup: &'a Setup) -> Self {
        let [a, b] = contacts.bodies[index];
        Self {
            contact: &contacts.cache.contacts[index],
            index,
            separation: contacts.separation[index],
            bodies: [a as usize, b as usize],
            solver: [bodies.index_of(a), bodies.index_of(b)],
            kinds: [a, b].map(|body| setup.kind(tile.bodies.kind[body as usize])),
        }
    }

    #[inline(always)]
    fn write<const N: usize>(&self, group: &mut Group<N>, lane: usize) {
        let [a, b] = self.kinds;
        let normal = self.contact.normal;
        let tangent = right_perp(normal);
        group.a[lane] = self.solver[0];
        group.b[lane] = self.solver[1];
        group.contact[lane] = self.index as u32;
        let (on_a, on_b) = (normal * a.root_inv_mass, normal * b.root_inv_mass);
        (group.normal_ax[lane], group.normal_ay[lane]) = (on_a.x, on_a.y);
        (group.normal_bx[lane], group.normal_by[lane]) = (on_b.x, on_b.y);
        group.friction[lane] = (a.material.friction * b.material.friction).sqrt();
        group.fixed[lane] = if a.inv_mass == 0.0 || b.inv_mass == 0.0 { 1.0 } else { 0.0 };
        let linear = dot(on_a, on_a) + dot(on_b, on_b);
        for (k, rows) in group.points.iter_mut().enumerate() {
            let point = &self.contact.points[k];
            let (arm_a, arm_b) = (point.anchor, point.anchor - self.contact.offset);
            let arm = |kind: &KindRow, arm: Vec2, axis: Vec2| {
                // A circle's anchor lies on the line of its center and the normal; rounding must not spin it.
                kind.root_inv_inertia * cross(arm, axis)
            };
            let is_circle = |kind: &KindRow| matches!(kind.shape, Shape::Circle { .. });
            let flat = |kind: &KindRow, value: f32| if is_circle(kind) { 0.0 } else { value };
            let (normal_a, normal_b) = (flat(a, arm(a, arm_a, normal)), flat(b, arm(b, arm_b, normal)));
            let (tangent_a, tangent_b) = (arm(a, arm_a, tangent), arm(b, arm_b, tangent));
            rows.normal_a[lane] = normal_a;
            rows.normal_b[lane] = normal_b;
            rows.tangent_a[lane] = tangent_a;
            rows.tangent_b[lane] = tangent_b;
            rows.depth_a[lane] = flat(a, dot(arm_a, normal));
            rows.depth_b[lane] = flat(b, dot(arm_b, normal));
            rows.normal_mass[lane] = 1.0 / (linear + normal_a * normal_a + normal_b * normal_b);
            rows.tangent_mass[lane] = 1.0 / (linear + tangent_a * tangent_a + tangent_b * tangent_b);
            rows.first_separation[lane] = self.separation[k];
            rows.separation[lane] = self.separation[k];
            rows.normal_impulse[lane] = point.normal_impulse;
            rows.tangent_impulse[lane] = point.tangent_impulse;
        }
    }

    /// Speed at which a point's surfaces come nearer, in m/s.
    fn closing_speed(&self, tile: &Tile, point: usize) -> f32 {
        let anchor = self.contact.points[point].anchor;
        let velocity = |side: usize, arm: Vec2| {
            let i = self.bodies[side];
            tile.bodies.velocity[i] + turn(tile.bodies.angular_velocity[i], arm)
        };
        -dot(velocity(1, anchor - self.contact.offset) - velocity(0, anchor), self.contact.normal)
    }
}

impl<const N: usize> Group<N> {
    /// Gives one point back the speed it came in with, if it pressed at all.
    fn bounce(&mut self, lane: usize, point: usize, speed: f32, bodies: &mut SolverBodies) {
        let (a, b) = (self.a[lane] as usize, self.b[lane] as usize);
        let rows = &mut self.points[point];
        if rows.total_normal[lane] <= 0.0 {
            return;
        }
        let row_a = [self.normal_ax[lane], self.normal_ay[lane], rows.normal_a[lane]];
        let row_b = [self.normal_bx[lane], self.normal_by[lane], rows.normal_b[lane]];
        let along = |row: [f32; 3], v: super::lanes::Quad| row[0] * v[0] + row[1] * v[1] + row[2] * v[2];
        let approach = along(row_b, bodies.velocity[b]) - along(row_a, bodies.velocity[a]);
        let wanted = -rows.normal_mass[lane] * (approach - speed);
        let impulse = max(wanted, -rows.normal_impulse[lane]);
        rows.total_normal[lane] += impulse;
        for k in 0..3 {
            bodies.velocity[a][k] -= row_a[k] * impulse;
            bodies.velocity[b][k] += row_b[k] * impulse;
        }
    }

    /// Gives one body of one lane an impulse along the normal and the tangent of one point.
    pub(super) fn push(&self, lane: usize, point: usize, upon_a: bool, impulse: [f32; 2], bodies: &mut SolverBodies) {
        let rows = &self.points[point];
        let (body, sign, x, y, normal, tangent) = if upon_a {
            (self.a[lane], -1.0, self.normal_ax[lane], self.normal_ay[lane], rows.normal_a[lane], rows.tangent_a[lane])
        } else {
            (self.b[lane], 1.0, self.normal_bx[lane], self.normal_by[lane], rows.normal_b[lane], rows.tangent_b[lane])
        };
        let velocity = &mut bodies.velocity[body as usize];
        let [along, across] = impulse.map(|impulse| sign * impulse);
        velocity[0] += x * along + y * across;
        velocity[1] += y * along - x * across;
        velocity[2] += normal * along + tangent * across;
    }

    /// Separation of one lane's point by the bodies' poses now.
    pub(super) fn refresh_separation(&mut self, lane: usize, bodies: &SolverBodies) {
        let (pose_a, pose_b) = (bodies.pose[self.a[lane] as usize], bodies.pose[self.b[lane] as usize]);
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
