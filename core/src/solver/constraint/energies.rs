//! No more energy than there was: what bodies may have that bounce off each other at once.
//!
//! One contact alone gives back no more than it takes. Of several at once that can be more, where what pressed at one of them was a blow
//! from another within the step: as the step began its bodies moved apart, and by `energy = impulse * (speed apart before + after) / 2` it
//! gives what nobody had. In columns that fall and bounce that came to many times the energy of the fall. So bodies in contacts that
//! bounce, one next to the other, go from where the solver left them only as far towards what bounces make of them as they keep to the energy of
//! motion that they came with. Impulses do so too, and momentum is what it was. A static that moves gives them what it does to them: impulse
//! times the speed of its surface. Where a force or a ghost gives energy nothing is known.

use super::columns::Columns;
use super::groups::{Bounce, Lane};
use super::restitution::join_all;
use super::rows::Source;
use crate::islands::union_find::root_of;
use crate::model::contact::Contact;
use crate::model::math::{dot, right_perp};
use crate::parallel::lanes::Quad;
use crate::solver::batches::Batch;
use crate::solver::bodies::SolverBodies;
use glam::Vec2;
use std::ops::Range;

/// How far rounding may be beyond, as a part.
const ROUNDING: f64 = 1e-6;

/// Bodies of contacts that bounce, and what they may have.
#[derive(Default, Debug)]
pub(super) struct Energies {
    /// Of batches that keep their rows, and of those that are solved at once, batch by batch.
    kept: Vec<Cluster>,
    at_once: Vec<Cluster>,
    /// Of the clusters, one after the other: bodies, and contacts.
    bodies: Vec<Body>,
    contacts: Vec<u32>,
    /// For each contact how its static moves, if it does, at each point.
    driven: Vec<Option<[Drive; 2]>>,
    /// What the solver left: velocities of the bodies, and what each contact pressed.
    solved: Vec<Quad>,
    pressed: Vec<[Pressed; 2]>,
    /// Buffers: bounces, each with where its batch and its cluster begin; and bodies of a cluster.
    sorted: Vec<(u32, u32, u32)>,
    moving: Vec<u32>,
}

/// A body of a cluster.
#[derive(Debug)]
struct Body {
    /// Its place among the solver's bodies.
    place: u32,
    /// Its weight by the root of its mass.
    weight: [f32; 2],
    /// Twice its energy of motion as the step begins, in J.
    twice_energy: f64,
}

/// The impulses of a point along normal and tangent: over the step, and those that the next one is to start with.
#[derive(Clone, Copy, Default, Debug)]
struct Pressed {
    totals: [f32; 2],
    last: [f32; 2],
}

/// How the surface of a static moves at a point, as what its impulses along normal and tangent are multiplied with to get what it gives.
#[derive(Clone, Copy, Default, Debug)]
struct Drive {
    /// Along normal and tangent, in m/s.
    speeds: [f64; 2],
    /// By how much it becomes faster within the step, in m/s.
    faster: f64,
}

impl Drive {
    /// What the static gives by these impulses, in J.
    fn given(&self, impulses: [f64; 2]) -> f64 {
        impulses.iter().zip(self.speeds).map(|(impulse, speed)| impulse * speed + impulse.abs() * self.faster).sum()
    }
}

/// Two contacts or more, each of which shares a body with another.
#[derive(Debug)]
struct Cluster {
    /// Where the bodies of its batch begin.
    base: u32,
    bodies: Range<usize>,
    contacts: Range<usize>,
}

/// Twice the energy of motion of a body whose velocity is mass-weighted.
fn twice_energy([x, y, w, _]: Quad) -> f64 {
    product([x, y, w, 0.0], [x, y, w, 0.0])
}

fn product(a: Quad, b: Quad) -> f64 {
    (0..3).map(|k| f64::from(a[k]) * f64::from(b[k])).sum()
}

impl Energies {
    pub(super) fn clear(&mut self) {
        self.kept.clear();
        self.at_once.clear();
    }

    /// Finds the clusters among contacts that bounce; `on` is a buffer.
    pub(super) fn find(&mut self, bounces: [&[Bounce]; 2], lanes: &[Lane], on: &mut Vec<u32>, source: Source<'_>) {
        self.clear();
        self.bodies.clear();
        self.contacts.clear();
        self.driven.clear();
        join_all(on, source, bounces.into_iter().flatten());
        for (bounces, at_once) in bounces.into_iter().zip([false, true]) {
            self.sorted.clear();
            for (i, bounce) in (0..).zip(bounces) {
                let body = bounce.moving().next().expect("one of a contact's bodies moves");
                self.sorted.push((lanes[bounce.contact as usize].base, root_of(on, body), i));
            }
            self.sorted.sort_unstable();
            let clusters = if at_once { &mut self.at_once } else { &mut self.kept };
            for cluster in self.sorted.chunk_by(|one, other| (one.0, one.1) == (other.0, other.1)) {
                let among = || cluster.iter().map(|(.., i)| &bounces[*i as usize]);
                if cluster.len() == 1 || among().any(|bounce| source.has_strangers(bounce.contact as usize)) {
                    continue;
                }
                let (first_body, first_contact) = (self.bodies.len(), self.contacts.len());
                self.contacts.extend(among().map(|bounce| bounce.contact));
                self.driven.extend(among().map(|bounce| source.drives_of(bounce.contact as usize)));
                self.moving.clear();
                self.moving.extend(among().flat_map(Bounce::moving));
                self.moving.sort_unstable();
                self.moving.dedup();
                self.bodies.extend(self.moving.iter().map(|&body| source.body(body as usize)));
                let (bodies, contacts) = (first_body..self.bodies.len(), first_contact..self.contacts.len());
                clusters.push(Cluster { base: cluster[0].0, bodies, contacts });
            }
        }
    }

    /// Has all batches that keep their rows, or one that is solved at once, bounce, within what its bodies may have.
    pub(super) fn keep(
        &mut self,
        at_once: Option<&Batch>,
        lanes: &[Lane],
        columns: &mut Columns,
        solver: &mut SolverBodies,
        bounce: impl FnOnce(&mut Columns, &mut [Quad]),
    ) {
        let Self { kept, at_once: others, bodies, contacts, driven, solved, pressed, .. } = self;
        let clusters = match at_once {
            None => &kept[..],
            Some(batch) => {
                let before = |place: usize| others.partition_point(|cluster| (cluster.base as usize) < place);
                &others[before(batch.bodies.start)..before(batch.bodies.end)]
            }
        };
        solved.clear();
        pressed.clear();
        for cluster in clusters {
            solved.extend(bodies[cluster.bodies.clone()].iter().map(|body| solver.velocity[body.place as usize]));
            pressed.extend(contacts[cluster.contacts.clone()].iter().map(|&contact| {
                let (_, points, totals, lane) = lanes[contact as usize].totals_mut(columns);
                let mut pressed = [Pressed::default(); 2];
                for ((point, totals), pressed) in points.iter().zip(totals).zip(&mut pressed) {
                    let last = [point.normal_impulse[lane], point.tangent_impulse[lane]];
                    *pressed = Pressed { totals: totals.of(lane), last };
                }
                pressed
            }));
        }
        bounce(columns, &mut solver.velocity);
        let (mut solved, mut pressed) = (&solved[..], &pressed[..]);
        for cluster in clusters {
            let (bodies, contacts) = (&bodies[cluster.bodies.clone()], &contacts[cluster.contacts.clone()]);
            let (solved, pressed) = (
                solved.split_off(..bodies.len()).expect("one for each body"),
                pressed.split_off(..contacts.len()).expect("one for each contact"),
            );
            let mut given = [0.0; 2];
            for ((&contact, from), drives) in contacts.iter().zip(pressed).zip(&driven[cluster.contacts.clone()]) {
                let Some(drives) = drives else { continue };
                let (_, _, totals, lane) = lanes[contact as usize].totals_mut(columns);
                for ((totals, from), drive) in totals.iter().zip(from).zip(drives) {
                    let (from, to) = (from.totals.map(f64::from), totals.of(lane).map(f64::from));
                    given[0] += drive.given(from);
                    given[1] += drive.given([to[0] - from[0], to[1] - from[1]]);
                }
            }
            let Some(part) = part(bodies, solved, solver, given) else { continue };
            // What bounced beyond all bounds did not.
            let blend = |from: f32, to: f32| if part > 0.0 { from + part * (to - from) } else { from };
            for (body, from) in bodies.iter().zip(solved) {
                let to = &mut solver.velocity[body.place as usize];
                (0..3).for_each(|k| to[k] = blend(from[k], to[k]));
            }
            for (&contact, from) in contacts.iter().zip(pressed) {
                let (_, points, totals, lane) = lanes[contact as usize].totals_mut(columns);
                for ((point, totals), &Pressed { totals: [normal, tangent], last }) in
                    points.iter_mut().zip(totals).zip(from)
                {
                    totals.normal[lane] = blend(normal, totals.normal[lane]);
                    totals.tangent[lane] = blend(tangent, totals.tangent[lane]);
                    // Not all of it was given back.
                    if totals.normal[lane] > 0.0 {
                        [point.normal_impulse[lane], point.tangent_impulse[lane]] = last;
                    }
                }
            }
        }
    }
}

/// How far bodies may go from where the solver left them to where they bounced to; none if all of the way. They have what they had as the step
/// began, what gravity has done since, and what statics gave: in J, before they bounced, and as much more as they go of the way.
fn part(bodies: &[Body], solved: &[Quad], solver: &SolverBodies, given: [f64; 2]) -> Option<f32> {
    let (mut most, mut before, mut after, mut along, mut change) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (body, &from) in bodies.iter().zip(solved) {
        let (to, moved) = (solver.velocity[body.place as usize], solver.pose[body.place as usize]);
        let way = [to[0] - from[0], to[1] - from[1], to[2] - from[2], 0.0];
        let [x, y] = body.weight;
        most += body.twice_energy + 2.0 * product([x, y, 0.0, 0.0], moved);
        before += twice_energy(from);
        after += twice_energy(to);
        along += product(from, way);
        change += twice_energy(way);
    }
    let [given, more] = given.map(|energy| 2.0 * energy);
    let most = f64::max(most + given, before) * (1.0 + ROUNDING);
    if after <= most + more || change == 0.0 {
        return None;
    }
    if !after.is_finite() {
        return Some(0.0);
    }
    // Of a square whose ends are below and above what may be.
    let along = along - 0.5 * more;
    let root = (along * along + change * (most - before)).max(0.0).sqrt();
    Some(((root - along) / change).clamp(0.0, 1.0) as f32)
}

impl Source<'_> {
    /// Whether something may give a contact's bodies energy of which nothing is known here: a force, or what a ghost meets elsewhere.
    fn has_strangers(self, contact: usize) -> bool {
        let tile = self.tile;
        let ghosts = tile.owned..tile.owned + tile.ghosts();
        let mut bodies = self.contacts.bodies[contact].into_iter().map(|body| body as usize);
        bodies.any(|body| ghosts.contains(&body) || tile.gain(body).is_some())
    }

    /// How the static of a contact moves, if there is one that does.
    fn drives_of(self, contact: usize) -> Option<[Drive; 2]> {
        let tile = self.tile;
        let [a, b] = self.contacts.bodies[contact].map(|body| body as usize);
        // Impulses are those upon B.
        let (body, sign) = if self.drives(a) { (a, 1.0) } else { (b, -1.0) };
        if !self.drives(body) {
            return None;
        }
        let Contact { normal, offset, points, .. } = &tile.contacts.contacts[contact];
        let (tangent, center) = (right_perp(*normal), if body == a { Vec2::ZERO } else { *offset });
        let substeps = self.setup.params.integrations() as f32;
        let faster = f64::from(self.bodies.static_gain_in(contact as u32).length() * substeps);
        Some(points.map(|point| {
            let velocity = self.surface_velocity(body, point.anchor - center, tangent * sign);
            Drive { speeds: [*normal, tangent].map(|axis| f64::from(sign * dot(velocity, axis))), faster }
        }))
    }

    /// Whether something gives a contact's bodies energy from outside: a static that moves, a force, or what a ghost meets elsewhere.
    pub(super) fn is_driven(self, contact: usize) -> bool {
        let mut bodies = self.contacts.bodies[contact].into_iter();
        self.has_strangers(contact) || bodies.any(|body| self.drives(body as usize))
    }

    fn drives(self, body: usize) -> bool {
        body >= self.tile.owned + self.tile.ghosts() && self.setup.drives(self.tile.bodies.kind[body])
    }

    fn body(self, body: usize) -> Body {
        let (tile, setup) = (self.tile, self.setup);
        let kind = setup.kind(tile.bodies.kind[body]);
        let weight = setup.params.gravity * (kind.dynamics.gravity_scale * kind.root_mass);
        let velocity = tile.bodies.velocity[body] * kind.root_mass;
        let spin = tile.bodies.angular_velocity[body] * kind.root_inertia;
        Body {
            place: self.bodies.places()[body].get() as u32,
            weight: weight.to_array(),
            twice_energy: twice_energy([velocity.x, velocity.y, spin, 0.0]),
        }
    }
}
