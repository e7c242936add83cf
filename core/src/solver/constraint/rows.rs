//! The rows of a contact: how an impulse moves its bodies, and how their motion shows in it.

use super::columns::{Color, Each, Members, NO_CONTACT, Slices, Visitor, lengths};
use super::group::{Group, Totals};
use super::groups::Groups;
use crate::collide::narrow_phase::Contacts;
use crate::model::contact::{Contact, ContactPoint};
use crate::parallel::lanes::{Kernel, Lanes, Quad, WIDE, Wide, WideRow};
use crate::parallel::team::Team;
use crate::parallel::vectors::Vectors;
use crate::solver::batches::{Batch, Batches};
use crate::solver::bodies::SolverBodies;
use crate::solver::index::SolverIndex;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use std::marker::PhantomData;
use std::mem::offset_of;

/// What rows are made of.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) tile: &'a Tile,
    pub(crate) contacts: &'a Contacts,
    pub(crate) bodies: &'a SolverBodies,
    pub(crate) setup: &'a Setup,
}

/// Groups of one slice of one color, to be written by one thread.
struct Unit<'a> {
    groups: Slices<'a>,
    members: Each<&'a [Members]>,
    local: Local,
    /// Where among the slices of its color it is, from 0 to 1023.
    order: u32,
}

/// Writes the rows of a unit.
struct Write<'a> {
    unit: Unit<'a>,
    source: Source<'a>,
}

impl Kernel for Write<'_> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Unit { groups, members, local, .. } = self.unit;
        let inputs = Inputs::nothing(local);
        groups.visit(members, &mut WriteRows::<V::Wide> { source: self.source, local, inputs, lanes: PhantomData });
    }
}

/// Writes the rows of a group.
struct WriteRows<'a, V> {
    source: Source<'a>,
    local: Local,
    /// Of the group before, and then of this.
    inputs: Inputs,
    lanes: PhantomData<V>,
}

impl<V: Wide> Visitor for WriteRows<'_, V> {
    #[inline(always)]
    fn group<const N: usize>(&mut self, group: &mut Group<N>, members: &Members) {
        self.inputs.collect(members, self.source, self.local);
        write::<V, N>(group, &self.inputs);
        if self.source.setup.bouncy {
            group.totals = [Totals::NONE; N];
        }
    }
}

/// How a place among the solver's bodies becomes one in a batch.
#[derive(Clone, Copy)]
struct Local {
    base: u32,
    slice: u32,
}

impl Local {
    #[inline(always)]
    fn place(self, place: SolverIndex) -> u32 {
        place.within(self.base, self.slice)
    }
}

/// What the rows of sixteen contacts follow from; in a lane without one all zero, between its slice's static and itself.
struct Inputs {
    a: [u32; WIDE],
    b: [u32; WIDE],
    /// The contacts, four numbers at a time; see [`Numbers`].
    contact: [[Quad; WIDE]; QUADS],
    separation: [WideRow; 2],
    /// Roots of the masses of both bodies, as the solver has them.
    weight_a: [Quad; WIDE],
    weight_b: [Quad; WIDE],
    friction_a: WideRow,
    friction_b: WideRow,
    /// One for a shape that changes as it turns, zero for a round one.
    not_round_a: WideRow,
    not_round_b: WideRow,
}

/// A contact in fours.
const QUADS: usize = size_of::<Contact>() / size_of::<Quad>();

/// The numbers of sixteen contacts, by where they lie in a [`Contact`].
struct Numbers<V>([[V; 4]; QUADS]);

impl<V: Wide> Numbers<V> {
    #[inline(always)]
    fn load(contacts: &[[Quad; WIDE]; QUADS]) -> Self {
        let [a, b, c, d, e] = contacts;
        Self([V::load_quads(a), V::load_quads(b), V::load_quads(c), V::load_quads(d), V::load_quads(e)])
    }

    /// The number at an offset in bytes.
    #[inline(always)]
    fn at(&self, offset: usize) -> V {
        let number = offset / size_of::<f32>();
        self.0[number / 4][number % 4]
    }

    /// Anchor, separation there, impulse along the normal, impulse along the tangent of a point.
    #[inline(always)]
    fn point(&self, point: usize) -> (Vectors<V>, V, V, V) {
        let first = offset_of!(Contact, points) + point * size_of::<ContactPoint>();
        let anchor = Vectors {
            x: self.at(first + offset_of!(ContactPoint, anchor.x)),
            y: self.at(first + offset_of!(ContactPoint, anchor.y)),
        };
        let separation = self.at(first + offset_of!(ContactPoint, separation));
        let normal_impulse = self.at(first + offset_of!(ContactPoint, normal_impulse));
        let tangent_impulse = self.at(first + offset_of!(ContactPoint, tangent_impulse));
        (anchor, separation, normal_impulse, tangent_impulse)
    }
}

impl Inputs {
    /// Sixteen lanes without a contact.
    fn nothing(local: Local) -> Self {
        const NONE: [Quad; WIDE] = [[0.0; 4]; WIDE];
        const ZERO: WideRow = [0.0; WIDE];
        Self {
            a: [local.slice; WIDE],
            b: [local.slice; WIDE],
            contact: [NONE; QUADS],
            separation: [ZERO; 2],
            weight_a: NONE,
            weight_b: NONE,
            friction_a: ZERO,
            friction_b: ZERO,
            not_round_a: ZERO,
            not_round_b: ZERO,
        }
    }

    /// Takes in the contacts of a group.
    #[inline(always)]
    fn collect(&mut self, members: &Members, source: Source<'_>, local: Local) {
        // Groups that are not full are the last of their colors.
        if members.contains(&NO_CONTACT) {
            *self = Self::nothing(local);
        }
        let Source { tile, contacts, bodies, setup } = source;
        let carried = bodies.have_carriers();
        for (lane, &contact) in members.iter().enumerate().filter(|&(_, &contact)| contact != NO_CONTACT) {
            let contact = contact as usize;
            let quads: &[Quad; QUADS] = bytemuck::cast_ref(&tile.contacts.contacts[contact]);
            for (lanes, &quad) in self.contact.iter_mut().zip(quads) {
                lanes[lane] = quad;
            }
            let separation = contacts.separation[contact];
            (self.separation[0][lane], self.separation[1][lane]) = (separation[0], separation[1]);
            let [a, b] = contacts.bodies[contact];
            let (mut place_a, mut place_b) = (bodies.place_of(a), bodies.place_of(b));
            if carried {
                [place_a, place_b] = bodies.carried_in(contact as u32, [place_a, place_b]);
            }
            (self.a[lane], self.b[lane]) = (local.place(place_a), local.place(place_b));
            self.weight_a[lane] = bodies.weight[place_a.get()];
            self.weight_b[lane] = bodies.weight[place_b.get()];
            let kind_a = setup.kind(tile.bodies.kind[a as usize]);
            let kind_b = setup.kind(tile.bodies.kind[b as usize]);
            self.friction_a[lane] = kind_a.material.friction;
            self.friction_b[lane] = kind_b.material.friction;
            self.not_round_a[lane] = kind_a.not_round;
            self.not_round_b[lane] = kind_b.not_round;
        }
    }
}

#[inline(always)]
fn write<V: Wide, const N: usize>(group: &mut Group<N>, inputs: &Inputs) {
    let (zero, half, one) = (V::splat(0.0), V::splat(0.5), V::splat(1.0));
    let contact = Numbers::<V>::load(&inputs.contact);
    let [_, _, root_a, root_mass_a] = V::load_quads(&inputs.weight_a);
    let [_, _, root_b, root_mass_b] = V::load_quads(&inputs.weight_b);
    let (not_round_a, not_round_b) = (V::load(&inputs.not_round_a), V::load(&inputs.not_round_b));
    let normal = Vectors { x: contact.at(offset_of!(Contact, normal.x)), y: contact.at(offset_of!(Contact, normal.y)) };
    let tangent = Vectors { x: normal.y, y: normal.x.mul(V::splat(-1.0)) };
    let offset = Vectors { x: contact.at(offset_of!(Contact, offset.x)), y: contact.at(offset_of!(Contact, offset.y)) };
    let (on_a, on_b) = (normal.scaled(root_mass_a), normal.scaled(root_mass_b));
    let sides = &mut group.sides;
    sides.a = inputs.a;
    sides.b = inputs.b;
    normal.x.store(&mut sides.normal_x);
    normal.y.store(&mut sides.normal_y);
    V::load(&inputs.friction_a).mul(V::load(&inputs.friction_b)).sqrt().store(&mut sides.friction);
    let linear = on_a.dot(on_a).add(on_b.dot(on_b));
    // Where there is no contact nothing may come of it, not even the inverse of zero.
    let inverse = |sum: V| sum.if_positive(one.div(sum), zero);
    let points = [contact.point(0), contact.point(1)];
    for (k, rows) in group.points.iter_mut().enumerate() {
        let (arm_a, separation, normal_impulse, tangent_impulse) = points[k];
        let arm_b = arm_a.minus(offset);
        // A round body's anchor lies on the line of its center and the normal; rounding must not spin it.
        let normal_a = not_round_a.if_positive(root_a.mul(arm_a.cross(normal)), zero);
        let normal_b = not_round_b.if_positive(root_b.mul(arm_b.cross(normal)), zero);
        // Friction acts once surfaces touch: at each one's own, half the gap nearer to its body than the anchor.
        let gap = separation.max(zero).mul(half);
        let tangent_a = root_a.mul(arm_a.cross(tangent).add(gap));
        let tangent_b = root_b.mul(arm_b.cross(tangent).sub(gap));
        normal_a.store(&mut rows.normal_a);
        normal_b.store(&mut rows.normal_b);
        tangent_a.store(&mut rows.tangent_a);
        tangent_b.store(&mut rows.tangent_b);
        let normal_mass = inverse(linear.add(normal_a.mul(normal_a)).add(normal_b.mul(normal_b)));
        normal_mass.store(&mut rows.normal_mass);
        // Of the tangent alone; or, where one point is pushed at once, while the normal keeps its speed.
        let coupling = normal_a.mul(tangent_a).add(normal_b.mul(tangent_b));
        let held = if N == 1 { coupling.mul(coupling).mul(normal_mass) } else { zero };
        let tangent_mass = inverse(linear.add(tangent_a.mul(tangent_a)).add(tangent_b.mul(tangent_b)).sub(held));
        tangent_mass.store(&mut rows.tangent_mass);
        rows.first_separation = inputs.separation[k];
        rows.separation = inputs.separation[k];
        normal_impulse.store(&mut rows.normal_impulse);
        tangent_impulse.store(&mut rows.tangent_impulse);
    }
}

impl Groups {
    /// Writes the rows of the contacts of all batches that keep them, where [`Groups::lay_out`] has put them.
    pub(crate) fn write_kept(&mut self, batches: &Batches, source: Source<'_>, team: Team) {
        let Self { kept, members, colors, .. } = self;
        let mut groups = kept.slices();
        let mut units = Vec::new();
        let write = |unit| source.setup.lanes.run(Write { unit, source });
        for batch in batches.all.iter().filter(|batch| !batch.at_once) {
            let groups = groups.split_off(lengths(&batch.groups));
            each_unit(
                batch,
                groups,
                members,
                colors,
                |unit| if team.is_alone() { write(unit) } else { units.push(unit) },
            );
        }
        // Who begins with the first slices of each color writes the rows of these as well.
        units.sort_by_key(|unit| unit.order);
        let mut units = units.into_iter();
        let runs = team.ranges(units.len(), 1).map(|range| units.by_ref().take(range.len()).collect());
        team.for_each(runs.collect(), |run: Vec<_>| run.into_iter().for_each(write));
    }

    /// Writes the rows of the contacts of a batch that is solved at once.
    pub(crate) fn write_at_once(&mut self, batch: &Batch, source: Source<'_>) {
        let Self { at_once, members, colors, .. } = self;
        each_unit(batch, at_once.slices(), members, colors, |unit| source.setup.lanes.run(Write { unit, source }));
    }
}

/// Shows the groups of a batch, the first of those, in pieces that threads may write side by side.
fn each_unit<'a>(
    batch: &Batch,
    mut groups: Slices<'a>,
    members: &'a Each<Vec<Members>>,
    colors: &[Color],
    mut show: impl FnMut(Unit<'a>),
) {
    let mut members = batch.members_of(members);
    for color in &colors[batch.colors.clone()] {
        for slice in 0..color.slices {
            let counts = lengths(&color.slice(slice));
            let own = |column: usize| members[column].split_off(..counts[column]).expect("as many as groups");
            let (groups, members) = (groups.split_off(counts), std::array::from_fn(own));
            let (local, order) = (Local { base: batch.bodies.start as u32, slice }, 1024 * slice / color.slices);
            show(Unit { groups, members, local, order });
        }
    }
}
