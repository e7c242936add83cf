//! Solver `soft-step`: substepped soft constraints with relax.
//!
//! Source: E. Catto, "Solver2D" and Box2D v3. Each substep integrates velocities, applies last substep's impulses
//! (warm starting), solves with soft contacts that push overlap out, integrates positions, and solves once more without
//! the push ("relax"), so that the push adds no energy.
//!
//! # Mass-weighted velocities
//!
//! With `u = sqrt(m) v` and `sqrt(I) w`, an impulse changes both bodies by the very row that measures their relative
//! velocity, so a row needs no masses: `vn = J u`, `u += J^T l`, effective mass `1 / (J J^T)`. Displacements are weighted
//! alike, so the same row also updates the separation.
//!
//! # Order
//!
//! Contacts are colored greedily in canonical order; contacts of one color share no body and fill groups of eight lanes.
//! Colors follow from the contacts alone, so the order of all arithmetic does, whatever the machine.

mod bodies;
mod coloring;
mod groups;
mod kernels;
#[allow(unsafe_code)]
pub(crate) mod lanes;
pub(crate) mod softness;

pub(crate) use bodies::{SolverBodies, fly, store};

use crate::broad_phase::Pair;
use crate::narrow_phase::Contacts;
use crate::setup::Setup;
use crate::tile::Tile;
use coloring::Coloring;
use groups::{Group, Groups};

/// Buffers of the solver, shared by all tiles of a thread.
#[derive(Default, Debug)]
pub(crate) struct Solver {
    pub(crate) bodies: SolverBodies,
    coloring: Coloring,
    pub(crate) groups: Groups,
}

impl Solver {
    /// Picks the bodies that take part.
    pub(crate) fn gather(&mut self, tile: &Tile, contacts: &[Pair], setup: &Setup) {
        self.bodies.gather(tile, contacts, setup);
    }

    /// Contacts between bodies that move, as indices of solver bodies less one (the first stands for all statics).
    pub(crate) fn links<'a>(&'a self, contacts: &'a [Pair]) -> impl Iterator<Item = (u32, u32)> + 'a {
        let index = |body: u32| self.bodies.index_of(body);
        contacts
            .iter()
            .map(move |&[a, b]| (index(a), index(b)))
            .filter(|&(a, b)| a != 0 && b != 0)
            .map(|(a, b)| (a - 1, b - 1))
    }

    /// Colors the contacts and writes their constraints.
    pub(crate) fn prepare(&mut self, tile: &Tile, contacts: &Contacts, setup: &Setup) {
        self.coloring.color(contacts, &self.bodies);
        self.groups.prepare(tile, contacts, &self.bodies, &self.coloring, setup);
    }

    /// Gravity, damping, speed limits, what ghosts are given; then the impulses of the last substep once more.
    pub(crate) fn integrate_velocities(&mut self, substep: u32, setup: &Setup) {
        self.bodies.integrate_velocities(substep, setup);
        if substep == 0 {
            self.for_each_color(kernels::WarmStart);
        }
    }

    /// One pass over all contacts with the push.
    pub(crate) fn solve(&mut self, setup: &Setup) {
        self.for_each_color(kernels::Solve::new(setup));
    }

    /// Moves the bodies by their velocities.
    pub(crate) fn integrate_positions(&mut self, setup: &Setup) {
        self.bodies.integrate_positions(setup);
    }

    /// One pass over all contacts without the push, with friction. Leaves the separations for the next substep.
    pub(crate) fn relax(&mut self, setup: &Setup) {
        if setup.totals {
            self.for_each_color(kernels::Relax::<true>::new(setup));
        } else {
            self.for_each_color(kernels::Relax::<false>::new(setup));
        }
    }

    /// Bounces: contacts that pressed and came in fast get their approach speed back, in part.
    pub(crate) fn restitute(&mut self, setup: &Setup) {
        if setup.bouncy {
            self.groups.restitute(&mut self.bodies);
        }
    }

    fn for_each_color(&mut self, pass: impl kernels::Pass) {
        let Groups { singles, doubles, colors, .. } = &mut self.groups;
        lanes::dispatch(kernels::EachColor { pass, singles, doubles, colors, bodies: &mut self.bodies });
    }

    /// Copies the impulses of the last substep back to the contacts.
    pub(crate) fn store_impulses(&self, contacts: &mut Contacts) {
        fn copy<const N: usize>(groups: &[Group<N>], contacts: &mut Contacts) {
            for group in groups {
                for (lane, &contact) in group.contact.iter().enumerate() {
                    let Some(contact) = contacts.cache.contacts.get_mut(contact as usize) else { continue };
                    for (point, rows) in contact.points.iter_mut().zip(&group.points) {
                        point.normal_impulse = rows.normal_impulse[lane];
                        point.tangent_impulse = rows.tangent_impulse[lane];
                    }
                }
            }
        }
        copy(&self.groups.singles, contacts);
        copy(&self.groups.doubles, contacts);
    }

    /// Brings a contact's separations up to date after its bodies were placed anew.
    pub(crate) fn refresh_separation(&mut self, contact: u32) {
        let Groups { singles, doubles, places, .. } = &mut self.groups;
        let place = places[contact as usize];
        let lane = place.lane as usize;
        if place.double {
            doubles[place.group as usize].refresh_separation(lane, &self.bodies);
        } else {
            singles[place.group as usize].refresh_separation(lane, &self.bodies);
        }
    }

    /// Gives one of a contact's bodies some more impulse at one of its points.
    pub(crate) fn push(&mut self, contact: u32, point: usize, upon_a: bool, normal: f32, tangent: f32) {
        let Groups { singles, doubles, places, .. } = &mut self.groups;
        let place = places[contact as usize];
        let (group, lane) = (place.group as usize, place.lane as usize);
        if place.double {
            doubles[group].push(lane, point, upon_a, [normal, tangent], &mut self.bodies);
        } else {
            singles[group].push(lane, point, upon_a, [normal, tangent], &mut self.bodies);
        }
    }
}
