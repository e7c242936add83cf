//! A partition that changes between two steps, where tiles are cut and joined as bodies come and go.

use super::World;
use crate::exchange::mail::Inbox;
use crate::model::error::SetupError;
use crate::model::id::TileId;
use crate::tiling::partition::{Adaptive, CONTACT, Census, Load, Partition, Tally};
use crate::tiling::regroup::{Renaming, regroup};
use crate::tiling::tile::Tile;
use glam::DVec2;
use rayon::prelude::*;
use std::sync::Arc;

impl World {
    /// Counts what there is to do in each tile, ascending, or in the parts that a rule wants it to be cut into. Those of all ranks
    /// together, ascending by tile, are what [`Partition::adapted`] asks for. Nothing for tiles that are never cut.
    pub fn census(&self, rule: &Adaptive) -> Vec<Census> {
        let Some(levels) = self.setup.partition.levels() else { return Vec::new() };
        let mut census = Vec::with_capacity(self.tiles.len());
        for tile in &self.tiles {
            let tile = tile.settled(&self.setup);
            let (level, own) = (levels[tile.id.0 as usize], tile.contacts.own());
            let load = tile.owned as u64 + CONTACT * own as u64;
            if load <= rule.max_bodies {
                census.push(Census { tile: tile.id, level: u32::from(level), load });
                continue;
            }
            let mut bodies: Vec<(DVec2, u64)> =
                tile.bodies.position[..tile.owned].iter().map(|&place| (place, 1)).collect();
            for key in &tile.contacts.keys[..own] {
                bodies[tile.index(key.low())].1 += CONTACT;
            }
            rule.count(tile.id, level, tile.rectangle, &mut bodies, &mut census);
        }
        census
    }

    /// What there is to do in each tile, which [`Partition::bisect`] asks for from all ranks.
    pub fn loads(&self) -> Vec<Load> {
        let load = |tile: &Tile| {
            let tile = tile.settled(&self.setup);
            let (tiles, own) = (self.setup.partition.tiles(), tile.contacts.own());
            Load::new(tiles, tile.id, [tile.owned, own, tile.contacts.len() - own], &tile.ghost_owners)
        };
        self.tiles.iter().map(load).collect()
    }

    /// The bodies of each tile that has any, where they will be so many steps later if nothing stops them, with their contacts:
    /// what each rank brings to [`Bisecting`](crate::Bisecting).
    pub fn tallies(&self, later: u64) -> Vec<Tally> {
        let later = later as f32 * self.setup.params.dt;
        let tally = |tile: &Tile| {
            let tile = tile.settled(&self.setup);
            let mut contacts = vec![0; tile.owned];
            for key in &tile.contacts.keys[..tile.contacts.own()] {
                if let Some(count) = contacts.get_mut(tile.index(key.low())) {
                    *count += 1;
                }
            }
            let place = |body: usize| tile.bodies.position[body] + (later * tile.bodies.velocity[body]).as_dvec2();
            Tally::new(&self.setup.partition, (0..tile.owned).map(place).zip(contacts))
        };
        self.tiles.par_iter().filter(|tile| !tile.is_bare() || tile.changes.is_some()).map(tally).collect()
    }

    /// Moves the borders that are to be moved. Takes time for each tile. Says whether there were any.
    pub(super) fn follow_borders(&mut self) -> bool {
        let Some(partition) = self.next_partition.take() else { return false };
        let setup = Arc::new(self.setup.with_partition(&partition));
        self.tiles.par_iter_mut().for_each(|tile| tile.move_borders(&setup));
        self.forget_works();
        self.setup = setup;
        true
    }

    /// Cuts and joins tiles as another partition has it, which every rank must be given at the same step. No bit of a body changes,
    /// and contacts go on with the impulses they have. This world goes on to hold what becomes of its tiles. Takes time for each
    /// tile, and for each body and contact of those that change, or border such.
    ///
    /// The borders of a [bisection](Partition::bisection) move as the next step begins, in which bodies change their owners as if they
    /// had moved; until then nothing shows of it.
    ///
    /// # Errors
    /// If the two partitions are not [forests](Partition::forest) over the same squares, or bisections of one domain into equally many
    /// tiles, or this world holds some of the tiles that are to be joined and not the others: it is left as it was.
    pub fn retile(&mut self, partition: &Partition) -> Result<(), SetupError> {
        let old = Arc::clone(&self.setup);
        let torn = |tile: u32| SetupError::TornApart { tile: TileId(tile) };
        let changes = old.partition.changes(partition).ok_or(torn(0))?;
        if partition.cuts().is_some() {
            self.next_partition = Some(partition.clone());
            return Ok(());
        }
        let held = |tile: u32| self.place_of(TileId(tile)).is_some();
        if let Some(change) =
            changes.iter().find(|change| change.old.clone().any(|tile| held(tile) != held(change.old.start)))
        {
            return Err(torn(change.old.start));
        }
        self.settle();
        self.forget_places();
        let setup = old.with_partition(partition);
        let renaming = Renaming::new(&old.partition, partition, &changes);
        let mut rest = std::mem::take(&mut self.tiles).into_iter().zip(std::mem::take(&mut self.works)).peekable();
        for change in &changes {
            let mut sources = Vec::with_capacity(change.old.len());
            while let Some(source) = rest.next_if(|(tile, _)| change.old.contains(&tile.id.0)) {
                sources.push(source);
            }
            if let [(tile, work)] = &mut sources[..]
                && renaming.rename(tile)
            {
                self.works.push(work.take());
                self.tiles.extend(sources.into_iter().map(|(tile, _)| tile));
            } else if !sources.is_empty() {
                let sources: Vec<_> = sources.into_iter().map(|(tile, _)| tile).collect();
                self.tiles.extend(regroup(&sources, change.new.clone(), &renaming, &setup));
                self.works.resize_with(self.tiles.len(), || None);
            }
        }
        let names = self.tiles.iter().map(|tile| tile.id);
        self.inbox = Inbox::new(names, partition.tiles(), setup.dynamic_kinds);
        self.setup = Arc::new(setup);
        self.dismissed.clear();
        self.changed = true;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Loopback;
    use crate::model::body::{Body, StaticBody};
    use crate::model::contact::Contact;
    use crate::model::id::{GlobalId, KindId};
    use crate::model::params::{Exchange, Params};
    use crate::step::step;
    use crate::testing::{circle, rectangle};
    use crate::tiling::blueprint::Blueprint;
    use crate::tiling::partition::Bisector;
    use glam::Vec2;

    /// A heap of discs and boxes in the corner of two squares.
    fn heap(exchange: Exchange, levels: &[u8]) -> Blueprint {
        let params = Params { gravity: Vec2::new(-3.0, -10.0), exchange, ..Params::default() };
        let partition = Partition::forest(DVec2::ZERO, DVec2::new(16.0, 8.0), 2, 1, levels).unwrap();
        let statics = vec![
            StaticBody::new(GlobalId(0), rectangle(40.0, 2.0), DVec2::new(8.0, -1.0)),
            StaticBody::new(GlobalId(1), rectangle(2.0, 40.0), DVec2::new(-1.0, 8.0)),
        ];
        Blueprint { params, partition, kinds: vec![circle(0.25), rectangle(0.5, 0.5)], statics }
    }

    fn bodies_of_heap() -> impl Iterator<Item = Body> {
        (0..240_u32).map(|k| {
            let place = DVec2::new(0.3 + 0.53 * f64::from(k % 20), 0.3 + 0.52 * f64::from(k / 20));
            let body = Body::at_rest(GlobalId(u64::from(k) + 2), KindId(u32::from(k % 3 > 0)), place);
            Body { velocity: Vec2::new((k % 7) as f32 - 3.0, 0.0), ..body }
        })
    }

    fn world(exchange: Exchange, levels: &[u8]) -> World {
        let mut world = World::whole(&heap(exchange, levels)).unwrap();
        bodies_of_heap().for_each(|body| assert!(world.add(body).unwrap()));
        world
    }

    fn of(world: &World, levels: &[u8]) -> Partition {
        let (low, high) = (world.partition().min(), world.partition().max());
        Partition::forest(low, high, 2, 1, levels).unwrap()
    }

    /// What owners remember of each contact: of one between two tiles that of body A's, and that its other owner has one as well.
    fn contacts(world: &World) -> Vec<((GlobalId, GlobalId), Contact)> {
        let mut contacts = Vec::new();
        for tile in world.tile_states() {
            for (key, contact) in tile.contacts.iter().filter(|(key, _)| key.is_own()) {
                let pair = tile.pair_of(key);
                let owns_a = tile.bodies.id[..tile.owned].contains(&pair.0) || !key.is_border();
                if owns_a {
                    contacts.push((pair, *contact));
                } else {
                    let others = world.tile_states().iter().filter(|other| other.id != tile.id);
                    let knows =
                        |other: &Tile| other.contacts.iter().any(|(key, _)| key.is_own() && other.pair_of(key) == pair);
                    assert_eq!(others.filter(|other| knows(other)).count(), 1, "{pair:?}");
                }
            }
        }
        contacts.sort_unstable_by_key(|(pair, _)| *pair);
        assert!(contacts.windows(2).all(|two| two[0].0 < two[1].0), "each contact has one owner of body A");
        contacts
    }

    fn bodies(world: &World) -> Vec<Body> {
        let mut bodies: Vec<Body> = world.bodies().collect();
        bodies.sort_unstable_by_key(|body| body.id);
        bodies
    }

    const TILINGS: [&[u8]; 5] = [
        &[0, 0],
        &[1, 1, 1, 1, 0],
        &[2, 2, 2, 2, 1, 1, 1, 1, 2, 2, 2, 2, 1, 1],
        &[2, 2, 2, 2, 2, 2, 2, 2, 1, 1, 0],
        &[0, 1, 1, 1, 1],
    ];

    #[test]
    fn bodies_and_contacts_live_on_through_a_change() {
        for exchange in [Exchange::Step, Exchange::Substep] {
            let mut world = world(exchange, TILINGS[2]);
            for number in 0..60 {
                step(&mut world, &mut Loopback).unwrap();
                let before = (bodies(&world), contacts(&world), world.hashes().state);
                assert!(number < 5 || before.1.len() > 200, "{} contacts", before.1.len());
                let partition = of(&world, TILINGS[number % TILINGS.len()]);
                world.retile(&partition).unwrap();
                assert!((bodies(&world), contacts(&world), world.hashes().state) == before, "after step {number}");
                // And all of it can be saved, and goes on alike.
                let mut bytes = Vec::new();
                let saved = world.save(&mut bytes);
                let mut again = World::whole(&Blueprint { partition, ..heap(exchange, &[0, 0]) }).unwrap();
                let mut rest = &bytes[..];
                for saved in saved {
                    again.restore(saved.tile, rest.split_off(..saved.length).unwrap()).unwrap();
                }
                again.resume_at(world.step_count());
                if number % 7 == 0 {
                    step(&mut world, &mut Loopback).unwrap();
                    step(&mut again, &mut Loopback).unwrap();
                }
                assert_eq!(again.hashes(), world.hashes(), "after step {number}");
            }
        }
    }

    #[test]
    fn tiles_are_cut_and_joined_as_the_census_says() {
        let rule = Adaptive { max_bodies: 300, least_side: 1.0 };
        let mut world = world(Exchange::Substep, &[0, 0]);
        let mut tilings = Vec::new();
        for _ in 0..90 {
            if let Some(partition) = world.partition().adapted(&rule, &world.census(&rule)).unwrap() {
                world.retile(&partition).unwrap();
            }
            tilings.push(world.partition().levels().unwrap().to_vec());
            let load = |tile: &Tile| tile.owned + CONTACT as usize * tile.contacts.own();
            assert!(world.tile_states().iter().all(|tile| load(tile) <= 300 || tile.rectangle.size().x < 2.0));
            step(&mut world, &mut Loopback).unwrap();
        }
        tilings.dedup();
        assert!(tilings.len() > 1, "{tilings:?}");
    }

    #[test]
    fn borders_that_move_change_no_body_and_what_is_saved_goes_on_alike() {
        let cut = |axis: u32, part: f64| Bisector { axis, at: (part * 2_f64.powi(32)) as u32 };
        let bisection = |number: usize| {
            let [a, b, c] = [0.3, 0.5, 0.7].map(|part| part + 0.07 * (number % 5) as f64 - 0.14);
            let turned = u32::from(number % 7 == 3);
            Partition::bisection(DVec2::ZERO, DVec2::new(16.0, 8.0), &[cut(turned, b), cut(1 - turned, a), cut(1, c)])
                .unwrap()
        };
        for exchange in [Exchange::Step, Exchange::Substep] {
            let blueprint = |number| Blueprint { partition: bisection(number), ..heap(exchange, &[0, 0]) };
            let mut world = World::whole(&blueprint(0)).unwrap();
            bodies_of_heap().for_each(|body| assert!(world.add(body).unwrap()));
            for number in 1..70 {
                step(&mut world, &mut Loopback).unwrap();
                let before = (bodies(&world), contacts(&world), world.hashes());
                assert!(number < 5 || before.1.len() > 200, "{} contacts", before.1.len());
                // Nothing shows before the next step, and all of it can be saved, and goes on alike.
                world.retile(&bisection(number)).unwrap();
                assert!((bodies(&world), contacts(&world), world.hashes()) == before, "after step {number}");
                let mut bytes = Vec::new();
                let saved = world.save(&mut bytes);
                let mut again =
                    World::whole(&Blueprint { partition: world.partition().clone(), ..blueprint(0) }).unwrap();
                let mut rest = &bytes[..];
                for saved in saved {
                    again.restore(saved.tile, rest.split_off(..saved.length).unwrap()).unwrap();
                }
                again.resume_at(world.step_count());
                again.retile(&bisection(number)).unwrap();
                step(&mut world, &mut Loopback).unwrap();
                step(&mut again, &mut Loopback).unwrap();
                assert_eq!(again.hashes(), world.hashes(), "after step {number}");
                assert_eq!(*world.partition(), bisection(number));
                let is_home = |tile: &Tile| {
                    // Where it was at the beginning of the step; a step leads no further than this.
                    let grown = tile.region.shrunk(-0.5);
                    tile.bodies.position[..tile.owned].iter().all(|&place| grown.contains(place))
                };
                assert!(world.tile_states().iter().all(is_home), "after step {number}");
                contacts(&world);
            }
        }
    }

    #[test]
    fn what_cannot_follow_changes_nothing() {
        let blueprint = heap(Exchange::Step, &[1, 1, 1, 1, 0]);
        let mut world = World::new(&blueprint, &[0, 1, 4].map(TileId)).unwrap();
        for body in bodies_of_heap() {
            world.add(body).unwrap();
        }
        let before = world.hashes();
        let joined = of(&world, &[0, 0]);
        assert_eq!(world.retile(&joined), Err(SetupError::TornApart { tile: TileId(0) }));
        let other = Partition::uniform(DVec2::ZERO, DVec2::new(16.0, 8.0), 2, 1).unwrap();
        assert!(world.retile(&other).is_err());
        assert_eq!(world.hashes(), before);
        // Where none of the tiles is here, none is torn apart.
        let cut = of(&world, &[1, 1, 1, 2, 2, 2, 2, 1, 1, 1, 1]);
        world.retile(&cut).unwrap();
        assert!(world.tiles().eq([0, 1, 7, 8, 9, 10].map(TileId)));
        assert_eq!(world.hashes(), before);
    }
}
