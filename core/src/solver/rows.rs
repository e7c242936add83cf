//! The rows of a contact: how an impulse moves its bodies, and how their motion shows in it.

use super::batches::{Batch, Batches};
use super::bodies::{STATIC, SolverBodies};
use super::groups::{Bounce, Group, Groups, NO_CONTACT};
use super::lanes::LANES;
use crate::contact::Contact;
use crate::math::{cross, dot, max, right_perp, turn};
use crate::narrow_phase::Contacts;
use crate::setup::Setup;
use crate::shape::{KindRow, Shape};
use crate::team::Team;
use crate::tile::Tile;
use glam::Vec2;

/// What rows are made of.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) tile: &'a Tile,
    pub(super) contacts: &'a Contacts,
    pub(super) bodies: &'a SolverBodies,
    pub(super) setup: &'a Setup,
}

/// Groups of one slice of one color, to be written by one thread.
struct Unit<'a> {
    singles: &'a mut [Group<1>],
    doubles: &'a mut [Group<2>],
    in_singles: &'a [[u32; LANES]],
    in_doubles: &'a [[u32; LANES]],
    /// The first body of the batch, and which of its statics this slice uses.
    base: u32,
    slice: u32,
}

impl Unit<'_> {
    fn write(self, source: Source<'_>) {
        write_groups(self.singles, self.in_singles, source, self.base, self.slice);
        write_groups(self.doubles, self.in_doubles, source, self.base, self.slice);
    }
}

fn write_groups<const N: usize>(
    groups: &mut [Group<N>],
    members: &[[u32; LANES]],
    source: Source<'_>,
    base: u32,
    slice: u32,
) {
    for (group, members) in groups.iter_mut().zip(members) {
        *group = Group::EMPTY;
        for (lane, &contact) in members.iter().enumerate().filter(|&(_, &contact)| contact != NO_CONTACT) {
            let local = |place: u32| if place == STATIC { slice } else { place - base };
            Constraint::new(source, contact as usize).write(group, lane, local);
        }
    }
}

impl Groups {
    /// Writes the rows of all contacts where [`Groups::lay_out`] has put them.
    pub(super) fn write(&mut self, batches: &Batches, source: Source<'_>, team: Team) {
        let Self { singles, doubles, in_singles, in_doubles, colors, .. } = self;
        let (mut singles, mut doubles) = (&mut singles[..], &mut doubles[..]);
        let (mut in_singles, mut in_doubles) = (&in_singles[..], &in_doubles[..]);
        let mut next = |batch: &Batch, color: usize, slice: u32| {
            let (single, double) = colors[color].slice(slice);
            Unit {
                singles: singles.split_off_mut(..single.len()).expect("groups lie in order"),
                doubles: doubles.split_off_mut(..double.len()).expect("groups lie in order"),
                in_singles: in_singles.split_off(..single.len()).expect("as many as groups"),
                in_doubles: in_doubles.split_off(..double.len()).expect("as many as groups"),
                base: batch.bodies.start as u32,
                slice,
            }
        };
        let each = batches.all.iter().flat_map(|batch| {
            let colors = &*colors;
            batch
                .colors
                .clone()
                .flat_map(move |color| (0..colors[color].slices).map(move |slice| (batch, color, slice)))
        });
        if team.is_alone() {
            each.for_each(|(batch, color, slice)| next(batch, color, slice).write(source));
        } else {
            let units = each.map(|(batch, color, slice)| next(batch, color, slice)).collect();
            team.for_each(units, |unit: Unit<'_>| unit.write(source));
        }
    }

    /// Finds the points that may bounce, in canonical order.
    pub(super) fn find_bounces(&mut self, source: Source<'_>) {
        self.bounces.clear();
        for (i, contact) in source.contacts.cache.contacts.iter().enumerate() {
            let constraint = Constraint::new(source, i);
            let [a, b] = constraint.kinds;
            let restitution = max(a.material.restitution, b.material.restitution);
            if restitution > 0.0 && self.is_solved(i as u32) {
                for point in 0..contact.point_count() {
                    let closing = constraint.closing_speed(source.tile, point);
                    if closing > source.setup.params.restitution_threshold {
                        let (contact, point) = (i as u32, point as u32);
                        self.bounces.push(Bounce { contact, point, speed: restitution * closing });
                    }
                }
            }
        }
    }
}

/// Everything about one contact that its lane needs.
struct Constraint<'a> {
    contact: &'a Contact,
    separation: [f32; 2],
    bodies: [usize; 2],
    /// Places among the solver's bodies.
    places: [u32; 2],
    kinds: [&'a KindRow; 2],
    /// What the roots of their inverse masses are multiplied by: one, but for frozen ghosts.
    scale: [f32; 2],
}

impl<'a> Constraint<'a> {
    #[inline(always)]
    fn new(source: Source<'a>, contact: usize) -> Self {
        let Source { tile, contacts, bodies, setup } = source;
        let [a, b] = contacts.bodies[contact];
        Self {
            contact: &contacts.cache.contacts[contact],
            separation: contacts.separation[contact],
            bodies: [a as usize, b as usize],
            places: [bodies.place_of(a), bodies.place_of(b)],
            kinds: [a, b].map(|body| setup.kind(tile.bodies.kind[body as usize])),
            scale: [a, b].map(|body| 1.0 / bodies.weight_scale(tile, body)),
        }
    }

    #[inline(always)]
    fn write<const N: usize>(&self, group: &mut Group<N>, lane: usize, local: impl Fn(u32) -> u32) {
        let [a, b] = self.kinds;
        let normal = self.contact.normal;
        let tangent = right_perp(normal);
        group.a[lane] = local(self.places[0]);
        group.b[lane] = local(self.places[1]);
        let (on_a, on_b) = (normal * (a.root_inv_mass * self.scale[0]), normal * (b.root_inv_mass * self.scale[1]));
        (group.normal_ax[lane], group.normal_ay[lane]) = (on_a.x, on_a.y);
        (group.normal_bx[lane], group.normal_by[lane]) = (on_b.x, on_b.y);
        group.friction[lane] = (a.material.friction * b.material.friction).sqrt();
        group.fixed[lane] = if a.inv_mass == 0.0 || b.inv_mass == 0.0 { 1.0 } else { 0.0 };
        let linear = dot(on_a, on_a) + dot(on_b, on_b);
        for (k, rows) in group.points.iter_mut().enumerate() {
            let point = &self.contact.points[k];
            let (arm_a, arm_b) = (point.anchor, point.anchor - self.contact.offset);
            let root_a = a.root_inv_inertia * self.scale[0];
            let root_b = b.root_inv_inertia * self.scale[1];
            // A circle's anchor lies on the line of its center and the normal; rounding must not spin it.
            let is_circle = |kind: &KindRow| matches!(kind.shape, Shape::Circle { .. });
            let flat = |kind: &KindRow, value: f32| if is_circle(kind) { 0.0 } else { value };
            let (normal_a, normal_b) = (flat(a, root_a * cross(arm_a, normal)), flat(b, root_b * cross(arm_b, normal)));
            let (tangent_a, tangent_b) = (root_a * cross(arm_a, tangent), root_b * cross(arm_b, tangent));
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
