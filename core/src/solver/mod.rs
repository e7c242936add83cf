//! From contacts to new velocities and positions.
//!
//! # Mass-weighted velocities
//!
//! With `u = sqrt(m) v` and `sqrt(I) w`, an impulse changes both bodies by the very row that measures their relative
//! velocity, so a row needs no masses: `vn = J u`, `u += J^T l`, effective mass `1 / (J J^T)`. Displacements are weighted
//! alike, so the same row also updates the separation.
//!
//! # Order
//!
//! Contacts are colored greedily in canonical order; contacts of one color share no body and fill groups of sixteen lanes.
//! Who comes to many segments of a hollow has their colors in the order in which it does (see [`Contacts::turns`]).
//! An island's colors follow from its contacts alone, and islands share nothing. So the order in which any body meets
//! its contacts does not depend on how islands are put into batches, on lanes, or on threads: `serial`, `islands`,
//! `coloring` and `auto` give the same bits.

mod batches;
mod bodies;
mod coloring;
mod constraint;
pub(crate) mod index;
#[allow(unsafe_code)]
mod job;
mod motion;
mod pgs;
mod run;
mod soft_step;
mod write_back;

pub(crate) use bodies::SolverBodies;
pub(crate) use write_back::write_back;

use crate::collide::broad_phase::Pair;
use crate::collide::narrow_phase::Contacts;
use crate::islands::{IslandSizes, Islands};
use crate::model::contact::ContactCache;
use crate::model::params::{Exchange, Parallel};
use crate::parallel::crew::Member;
use crate::parallel::team::Team;
use crate::state::violation::Violation;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use batches::{Batches, Graph};
use coloring::Coloring;
use constraint::columns::lengths;
pub(crate) use constraint::groups::ContactMotion;
use constraint::groups::Groups;
use constraint::rows::Source;
use job::Job;
use run::Run;
use std::ops::Range;

/// Buffers of the solver, shared by all tiles of a thread.
#[derive(Default, Debug)]
pub(crate) struct Solver {
    pub(crate) bodies: SolverBodies,
    islands: Islands,
    /// The roots of all nodes, those of carriers last, where there are carriers.
    carried_roots: Vec<u32>,
    batches: Batches,
    coloring: Coloring,
    pub(crate) groups: Groups,
    /// What the batches are of, but the contacts.
    arranged: Option<Arranged>,
    /// How many colors the contacts have.
    colors: u64,
}

/// What batches follow from, but contacts; and their islands.
#[derive(PartialEq, Debug)]
struct Arranged {
    /// How many bodies are owned, how many ghosts, and how many there are.
    counts: [usize; 3],
    /// Bodies that others hear of within the step.
    sent: Vec<u32>,
    keeps_rows: bool,
    /// Whether there is nobody to share a batch with.
    alone: bool,
    islands: IslandSizes,
}

impl Solver {
    /// Finds the islands of a tile's contacts, and puts those that do not sleep into batches; where contacts are between the same
    /// bodies as before, those of before serve. Whoever finds contacts for this solver anew arranges them once. `sent` are the
    /// bodies that others hear of within the step; `keeps_rows` tells that somebody asks for rows when all is solved.
    pub(crate) fn arrange(
        &mut self,
        tile: &mut Tile,
        contacts: &Contacts,
        sent: &[u32],
        keeps_rows: bool,
        setup: &Setup,
        team: Team,
    ) -> IslandSizes {
        let (counts, alone) = ([tile.owned, tile.ghosts(), tile.bodies.len()], team.is_alone());
        let is_same = |arranged: &Arranged| {
            (arranged.counts, arranged.keeps_rows, arranged.alone) == (counts, keeps_rows, alone)
                && arranged.sent == sent
        };
        // Who sleeps may change though contacts do not.
        match self.arranged.as_ref().filter(|_| !setup.params.sleep && contacts.are_between_the_same()) {
            Some(arranged) if is_same(arranged) && self.bodies.has_carriers_of(tile, &contacts.bodies, setup) => {
                arranged.islands
            }
            _ => {
                let islands = self.arrange_anew(tile, &contacts.bodies, sent, keeps_rows, setup, team);
                self.colors = 0;
                self.arranged = Some(Arranged { counts, sent: sent.to_vec(), keeps_rows, alone, islands });
                islands
            }
        }
    }

    fn arrange_anew(
        &mut self,
        tile: &mut Tile,
        contacts: &[Pair],
        sent: &[u32],
        keeps_rows: bool,
        setup: &Setup,
        team: Team,
    ) -> IslandSizes {
        let Self { bodies, islands, batches, carried_roots, .. } = self;
        bodies.number(tile, contacts, setup);
        let (nodes, links) = bodies.graph();
        let sizes = islands.find(setup.params.island_search, nodes, links, team);
        let roots = islands.roots();
        // Whoever is moved does not rest.
        bodies.carried().for_each(|node| tile.sleep.wake(bodies.body_of(node) as usize));
        // Not those of ghosts alone.
        let own = (0..bodies.first_ghost as u32).zip(roots).filter(|(node, root)| node == *root).count() as u64;
        debug_assert!(own == sizes.islands || setup.overlap.is_some());
        tile.fall_asleep(bodies.nodes(), roots, setup);
        let sleeps = setup.params.sleep.then(|| tile.sleep.islands());
        let heard_of = setup.params.exchange == Exchange::Substep;
        let ghosts = if heard_of { bodies.first_ghost..nodes } else { 0..0 };
        carried_roots.clear();
        let roots = if bodies.carried().next().is_none() {
            roots
        } else {
            carried_roots.extend(roots.iter().copied().chain(bodies.carried().map(|node| roots[node as usize])));
            carried_roots
        };
        let graph = Graph { contacts, roots, largest: sizes.largest, ghosts, sent, sleeps, keeps_rows };
        bodies.arrange(batches, graph, setup.params.parallel, team);
        IslandSizes { islands: own, ..sizes }
    }

    /// Takes in the bodies of the batches.
    pub(crate) fn load(&mut self, tile: &Tile, contacts: &Contacts, setup: &Setup, step: u64) {
        self.bodies.load(tile, contacts, &self.batches, setup, step);
    }

    /// Colors the contacts and gives each its place, as long as they do not have both. Returns how many colors there are.
    pub(crate) fn color(&mut self, tile: &Tile, contacts: &Contacts, team: Team) -> u64 {
        if self.colors == 0 {
            self.coloring.color(&self.batches, contacts, self.bodies.places(), team);
        }
        let known = &tile.contacts.contacts;
        if self.colors == 0 || !self.groups.fit(known) {
            self.colors = self.groups.lay_out(known, &mut self.batches, &self.coloring) as u64;
        }
        self.colors
    }

    /// Writes the rows of all contacts but those of batches that are solved at once.
    pub(crate) fn prepare(&mut self, tile: &Tile, contacts: &Contacts, setup: &Setup, team: Team) {
        let source = Source { tile, contacts, bodies: &self.bodies, setup };
        self.groups.write_kept(&self.batches, source, team);
        if setup.bouncy {
            self.groups.find_bounces(&self.batches, source, &[]);
        }
    }

    /// Finds anew what bounces, with blows that come to contacts from other tiles, each with its speed in m/s: whatever they would go on
    /// to here is to wait for them.
    pub(crate) fn pass_on(&mut self, tile: &Tile, contacts: &Contacts, heard: &[(u32, f32)], setup: &Setup) {
        let source = Source { tile, contacts, bodies: &self.bodies, setup };
        self.groups.find_bounces(&self.batches, source, heard);
    }

    /// How many batches there are.
    pub(crate) fn batches(&self) -> usize {
        self.batches.all.len()
    }

    /// Whether a batch goes from contacts to impulses before the next one begins: [`write_rows`](Self::write_rows),
    /// [`solve_at_once`](Self::solve_at_once), [`store_impulses_of`](Self::store_impulses_of).
    pub(crate) fn is_at_once(&self, batch: usize) -> bool {
        self.batches.all[batch].at_once
    }

    /// Writes the rows of one batch that is solved at once.
    pub(crate) fn write_rows(&mut self, batch: usize, tile: &Tile, contacts: &Contacts, setup: &Setup) {
        let Self { bodies, groups, batches, .. } = self;
        groups.write_at_once(&batches.all[batch], Source { tile, contacts, bodies, setup });
    }

    /// Makes all substeps of such a batch.
    pub(crate) fn solve_at_once(&mut self, batch: usize, setup: &Setup) {
        let Self { bodies, groups, batches, .. } = self;
        let batch = &batches.all[batch];
        let (groups, colors) = groups.at_once(batch);
        let job = &Job::new(batch, bodies.parts().split_off(batch), groups, colors);
        let substeps = 0..setup.params.integrations();
        setup.lanes.run(Run { job, member: Member::alone(), substeps, setup });
    }

    /// Bounces of such a batch: see [`apply_restitution`](Self::apply_restitution).
    pub(crate) fn bounce_at_once(&mut self, batch: usize) {
        self.groups.apply_restitution_at_once(&self.batches.all[batch], &mut self.bodies);
    }

    /// Copies the impulses of the last substep of such a batch back to its contacts.
    pub(crate) fn store_impulses_of(&self, batch: usize, contacts: &mut ContactCache) {
        self.groups.store_impulses(&self.batches.all[batch], &mut contacts.contacts);
    }

    /// Makes some substeps of all batches that keep their rows. Those away from borders have no word to wait for, and make all of them
    /// with the first, while they are in the cache.
    pub(crate) fn solve(&mut self, substeps: Range<u32>, setup: &Setup, team: Team) {
        let substeps = |job: &Job<'_>| match substeps.start {
            _ if job.at_border => substeps.clone(),
            0 => 0..setup.params.integrations(),
            _ => 0..0,
        };
        let alone = |job: Job<'_>| {
            let substeps = substeps(&job);
            setup.lanes.run(Run { job: &job, member: Member::alone(), substeps, setup });
        };
        // Nothing to share: no list of jobs.
        if team.is_alone() || setup.params.parallel == Parallel::Serial {
            return self.jobs().for_each(alone);
        }
        let to_do = self.jobs().filter(|job| !substeps(job).is_empty());
        let (large, small): (Vec<_>, Vec<_>) = to_do.partition(|job| job.large);
        for job in &large {
            team.together(|member| setup.lanes.run(Run { job, member, substeps: substeps(job), setup }));
        }
        team.for_each(small, alone);
    }

    /// The batches that keep their rows, each with its part of the buffers.
    fn jobs(&mut self) -> impl Iterator<Item = Job<'_>> {
        let Self { bodies, groups, batches, .. } = self;
        let (mut groups, colors) = groups.kept();
        let mut bodies = bodies.parts();
        batches.all.iter().filter(|batch| !batch.at_once).map(move |batch| {
            Job::new(batch, bodies.split_off(batch), groups.split_off(lengths(&batch.groups)), colors)
        })
    }

    /// Bounces: contacts that pressed and came in fast get their approach speed back, in part.
    pub(crate) fn apply_restitution(&mut self) {
        self.groups.apply_restitution(&mut self.bodies);
    }

    /// Copies the impulses of the last substep back to the contacts, but of batches that were solved at once.
    pub(crate) fn store_impulses(&self, contacts: &mut ContactCache, team: Team) {
        if !team.is_alone() {
            return self.groups.store_all_impulses(&mut contacts.contacts, team);
        }
        let batches = self.batches.all.iter().filter(|batch| !batch.at_once);
        batches.for_each(|batch| self.groups.store_impulses(batch, &mut contacts.contacts));
    }

    /// Brings a contact's separations up to date after its bodies were placed anew.
    pub(crate) fn refresh_separation(&mut self, contact: u32) {
        self.groups.refresh_separation(contact, &self.bodies);
    }

    /// Gives one of a contact's bodies some more impulse at one of its points.
    pub(crate) fn apply_impulse(&mut self, contact: u32, point: usize, upon_a: bool, normal: f32, tangent: f32) {
        self.groups.apply_impulse(contact, point, upon_a, [normal, tangent], &mut self.bodies);
    }

    /// How fast, in m/s, the surfaces of each solved point still come nearer than they may.
    pub(crate) fn violation(&self, contacts: &ContactCache, setup: &Setup) -> Violation {
        let mut violation = Violation::default();
        let own = &contacts.contacts[..contacts.own()];
        for (i, contact) in (0..).zip(own).filter(|&(i, _)| self.groups.is_solved(i)) {
            for point in 0..contact.point_count() {
                let speed = f64::from(self.groups.violation(i, point, &self.bodies, setup.h));
                violation.add(speed);
            }
        }
        violation
    }
}

#[cfg(test)]
mod tests {
    use crate::model::id::KindId;
    use crate::testing::{circle, rectangle};
    use crate::{
        Blueprint, Body, Exchange, GlobalId, Loopback, Parallel, Params, Partition, StaticBody, TileId, World, step,
    };
    use glam::{DVec2, Vec2};

    /// Two towers, one of them on the border of two tiles, and a box that falls onto the other.
    fn towers(restitution: f32) -> World {
        let params = Params { exchange: Exchange::Substep, gravity: Vec2::new(0.0, -10.0), ..Params::default() };
        let partition = Partition::uniform(DVec2::ZERO, DVec2::new(20.0, 10.0), 2, 1).unwrap();
        let floor = StaticBody::new(GlobalId(0), rectangle(20.0, 1.0), DVec2::new(10.0, 0.0));
        let mut kind = rectangle(1.0, 1.0);
        kind.material.restitution = restitution;
        let blueprint = Blueprint { params, partition, kinds: vec![kind], statics: vec![floor] };
        let mut world = World::new(&blueprint, &[TileId(0), TileId(1)]).unwrap();
        for i in 0..5 {
            for (tower, x) in [(0, 4.0), (1, 10.0)] {
                let place = DVec2::new(x + 0.01 * i as f64, 1.0 + i as f64);
                world.add(Body::at_rest(GlobalId(1 + 2 * i + tower), KindId(0), place)).unwrap();
            }
        }
        world.add(Body::at_rest(GlobalId(50), KindId(0), DVec2::new(4.2, 8.0))).unwrap();
        world
    }

    #[test]
    fn who_carries_is_asked_in_every_tile() {
        let params = Params { gravity: Vec2::new(0.0, -10.0), ..Params::default() };
        let partition = Partition::uniform(DVec2::ZERO, DVec2::new(40.0, 10.0), 4, 1).unwrap();
        let floor = |tile: u32| {
            let mut kind = rectangle(8.0, 1.0);
            kind.material.surface_speed = [0.0, 1.0, 0.0, -2.0][tile as usize];
            StaticBody::new(GlobalId(u64::from(tile)), kind, DVec2::new(f64::from(10 * tile + 5), 1.0))
        };
        let statics = (0..4).map(floor).collect();
        let blueprint = Blueprint { params, partition, kinds: vec![rectangle(1.0, 1.0)], statics };
        let mut world = World::whole(&blueprint).unwrap();
        for tile in 0..4_u32 {
            let place = DVec2::new(f64::from(10 * tile + 5), 2.0);
            world.add(Body::at_rest(GlobalId(u64::from(tile) + 4), KindId(0), place)).unwrap();
        }
        // All four have a box on a floor: the same contacts of as many bodies, but two of the floors are belts.
        (0..60).for_each(|_| assert_eq!(step(&mut world, &mut Loopback).unwrap().contacts, 4));
        let mut speeds: Vec<(GlobalId, f32)> = world.bodies().map(|body| (body.id, body.velocity.x)).collect();
        speeds.sort_by_key(|(id, _)| *id);
        for ((id, speed), expected) in speeds.into_iter().zip([0.0, 1.0, 0.0, -2.0]) {
            assert!((speed - expected).abs() < 0.01, "{id:?}: {speed} and not {expected}");
        }
    }

    #[test]
    fn what_is_kept_while_contacts_stay_the_same_shows_in_no_bit() {
        let (mut counts, mut states) = (Vec::new(), Vec::new());
        for restitution in [0.5, 0.0] {
            // One more where batches keep their rows, which a measure asks for, in some steps.
            let [mut keeps, mut forgets, mut measures] = [(); 3].map(|()| towers(restitution));
            counts.clear();
            for at in 0..150 {
                forgets.forget_works();
                measures.measures = at % 3 > 0;
                let [kept, forgotten, measured] =
                    [&mut keeps, &mut forgets, &mut measures].map(|world| step(world, &mut Loopback).unwrap());
                assert_eq!((kept, kept), (forgotten, measured), "step {at}");
                assert!(keeps.hashes() == forgets.hashes(), "step {at}: the batches of other contacts were taken");
                assert!(keeps.hashes() == measures.hashes(), "step {at}: who keeps rows solves otherwise");
                counts.push(kept.contacts);
            }
            states.push(keeps.hashes().state);
        }
        assert!(states[0] != states[1], "nothing has bounced");
        assert!(counts[0] < counts[149] && counts[140..].iter().all(|&count| count == counts[149]), "{counts:?}");
    }

    /// Discs that fall and bounce, with blows that go on from tile to tile; some alone, in batches that are solved at once or keep their rows.
    #[test]
    fn who_bounces_beside_blows_from_other_tiles_does_so_once_in_any_batch() {
        let [mut serial, mut islands] = [Parallel::Serial, Parallel::Islands].map(|parallel| {
            let gravity = Vec2::new(0.0, -10.0);
            let params = Params { exchange: Exchange::Substep, gravity, parallel, ..Params::default() };
            let partition = Partition::uniform(DVec2::ZERO, DVec2::splat(24.0), 6, 6).unwrap();
            let floor = StaticBody::new(GlobalId(0), rectangle(60.0, 1.0), DVec2::new(12.0, 0.0));
            let mut kind = circle(0.25);
            kind.material.restitution = 1.0;
            let blueprint = Blueprint { params, partition, kinds: vec![kind], statics: vec![floor] };
            let mut world = World::whole(&blueprint).unwrap();
            for k in 0..1600_u32 {
                let place = DVec2::new(0.4 + 0.58 * f64::from(k % 40), 1.0 + 0.56 * f64::from(k / 40));
                let velocity = Vec2::new((k * 37 % 101) as f32 - 50.0, (k * 53 % 103) as f32 - 51.0) * 0.1;
                let body = Body::at_rest(GlobalId(u64::from(k) + 1), KindId(0), place);
                world.add(Body { velocity, ..body }).unwrap();
            }
            world
        });
        for at in 0..80 {
            let [one, other] = [&mut serial, &mut islands].map(|world| step(world, &mut Loopback).unwrap());
            assert_eq!((one, serial.hashes()), (other, islands.hashes()), "step {at}");
        }
    }
}
