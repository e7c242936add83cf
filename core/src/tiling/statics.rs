//! The statics that a tile knows in a step: of all that reach its region those that its bodies may come to, where they are many. So a
//! wide landscape costs what is near its bodies.

use super::blueprint::Setup;
use super::terrain::ascend;
use super::tile::Tile;
use crate::model::body::Bodies;
use crate::model::contact::{PairKey, Slot, SlotKind};
use glam::DVec2;
use rustc_hash::FxHashSet;
use std::borrow::Cow;

/// So few are all taken.
const FEW: usize = 64;

/// So many squares and statics are looked at for each static that there is, before all are taken: that takes less time than one that
/// nobody is near.
const LOOKS: usize = 2;

/// After so many steps it is tried again.
const PAUSE: u32 = 64;

/// What local coordinates are rounded by, at most, as part of them, on both sides of a pair.
const ROUNDING: f64 = 2e-6;

/// Where a tile's bodies are and have been. Never shows in a result: who is near nobody touches nobody.
#[derive(Default, Debug)]
pub(crate) struct Near {
    /// The squares of the terrain whose statics the tile knows.
    squares: FxHashSet<[i32; 2]>,
    /// How many these were when they were found anew; none before that.
    first: usize,
    /// So many steps it is not tried again.
    pause: u32,
}

/// What came of a look at where bodies are.
enum Found {
    /// The rows of all statics that they may come to.
    All,
    /// Those that the tile may not know yet.
    More,
    /// It is not worth while.
    Nothing,
}

/// The low and the high corner of all that one of some bodies may come to in this step, in a tile with this low corner.
pub(crate) fn surroundings(bodies: &Bodies, row: usize, corner: DVec2, setup: &Setup) -> (DVec2, DVec2) {
    let place = bodies.position[row];
    let bound = f64::from(setup.kind(bodies.kind[row]).bounding_radius + setup.params.speculative_distance);
    let rounding = ROUNDING * (place - corner).abs().max_element();
    let reach = setup.margin(bodies.velocity[row]).as_dvec2() + DVec2::splat(bound + rounding);
    (place - reach, place + reach)
}

impl Near {
    /// Adds the statics that some bodies may come to, of so many that reach their tile, whose low corner this is.
    fn find(&mut self, bodies: &Bodies, reached: usize, corner: DVec2, setup: &Setup, rows: &mut Vec<u32>) -> Found {
        if self.pause > 0 {
            self.pause -= 1;
            return Found::Nothing;
        }
        let is_anew = self.first == 0 || self.squares.len() > 2 * self.first + FEW;
        if is_anew {
            self.squares.clear();
        }
        let mut looks = LOOKS * reached;
        for row in 0..bodies.len() {
            let (low, high) = surroundings(bodies, row, corner, setup);
            let Some(squares) = setup.terrain.squares(low, high, looks) else {
                return self.give_up();
            };
            for square in squares {
                looks = looks.saturating_sub(1);
                if self.squares.insert(square) {
                    for those in setup.terrain.rows_of(square) {
                        rows.extend(those);
                        looks = looks.saturating_sub(those.len());
                    }
                }
            }
        }
        if !is_anew {
            return Found::More;
        }
        self.first = self.squares.len();
        rows.extend(setup.terrain.at_large());
        Found::All
    }

    fn give_up(&mut self) -> Found {
        *self = Self { pause: PAUSE, ..Self::default() };
        Found::Nothing
    }
}

impl Tile {
    /// Takes in the statics that its bodies and ghosts may come to in this step, and those of `others` that reach its region: before they
    /// are put behind the bodies. Contacts go on with all that reach its region.
    pub(crate) fn meet_statics(&mut self, others: Vec<u32>, setup: &Setup) {
        let Self { near, bodies, rectangle, reached, .. } = self;
        let mut rows = others;
        let found = if reached.len() > FEW.max(bodies.len()) {
            near.find(bodies, reached.len(), rectangle.min, setup, &mut rows)
        } else {
            *near = Near::default();
            Found::Nothing
        };
        match found {
            Found::More if rows.is_empty() => return,
            Found::Nothing if self.statics == self.reached => return,
            Found::Nothing => return self.change_statics(self.reached.clone()),
            // What contacts did may still have to be told.
            Found::All => rows.extend(self.contacts.keys.iter().filter_map(|key| match key.high().kind() {
                SlotKind::Static(known) => Some(self.statics[known]),
                _ => None,
            })),
            Found::More => {}
        }
        ascend(&mut rows);
        rows.retain(|&row| setup.static_reaches(row, self.id));
        if let Found::More = found {
            rows.extend(&self.statics);
            ascend(&mut rows);
        }
        self.change_statics(rows);
    }

    /// Takes in other statics: both lists ascend, so contacts stay in order.
    fn change_statics(&mut self, statics: Vec<u32>) {
        if statics == self.statics {
            return;
        }
        let known = std::mem::replace(&mut self.statics, statics);
        let mut left = (0..).zip(&self.statics).peekable();
        let place_of = |row: &u32| {
            while left.next_if(|(_, next)| *next < row).is_some() {}
            left.next_if(|(_, next)| *next == row).map(|(place, _)| place)
        };
        let places: Vec<Option<usize>> = known.iter().map(place_of).collect();
        let number = |slot: Slot| match slot.kind() {
            SlotKind::Static(before) => places[before].map(|place| Slot::from_index(place, 0, 0)),
            _ => Some(slot),
        };
        self.contacts.retain(|key| number(key.high()).is_some());
        self.contacts.renumber(|slot| number(slot).unwrap_or(slot));
    }

    /// The keys of its contacts, as if it knew all statics that reach its region.
    pub(crate) fn keys_of_reached(&self) -> Cow<'_, [PairKey]> {
        if self.statics == self.reached {
            return Cow::Borrowed(&self.contacts.keys);
        }
        let number = |slot: Slot| match slot.kind() {
            SlotKind::Static(known) => {
                let place = self.reached.binary_search(&self.statics[known]);
                Slot::from_index(place.expect("it reaches the region"), 0, 0)
            }
            _ => slot,
        };
        self.contacts.keys.iter().map(|key| PairKey::new(key.low(), number(key.high()))).collect()
    }

    /// Puts the statics behind owned bodies and ghosts, as they are at the beginning of a step.
    pub(crate) fn push_statics(&mut self, setup: &Setup, step: u64) {
        for &row in &self.statics {
            self.bodies.push(setup.static_at(row, step));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::body::{Body, StaticBody};
    use crate::model::id::{GlobalId, KindId};
    use crate::model::params::{Exchange, Params};
    use crate::model::path::{Path, Travel};
    use crate::testing::{circle, rectangle};
    use crate::tiling::partition::{Bisector, Partition};
    use crate::{Blueprint, Command, Loopback, World, step};
    use glam::Vec2;

    const SIDE: f64 = 60.0;

    /// Shelves one above the other, a ground below all of them, and some that move; and bodies that fall from shelf to shelf, of which
    /// every so many go far in a step, and some are large.
    fn landscape(exchange: Exchange, far: u32, partition: Partition) -> World {
        let params = Params { gravity: Vec2::new(0.0, -10.0), exchange, large_radius: 1.0, ..Params::default() };
        let shelf = |k: u32| {
            let (column, row) = (k % 20, k / 20);
            let place = DVec2::new(3.0 * f64::from(column) + f64::from(row % 3), 2.0 + 2.5 * f64::from(row));
            let mut kind = rectangle(1.6, 0.3);
            kind.material.surface_speed = if k.is_multiple_of(5) { 1.0 } else { 0.0 };
            let travel = Travel::Sine { amplitude: DVec2::new(2.0, 0.5), period: 1.5, phase: 0.0 };
            let path = (k % 61 == 3).then_some(Path { travel, ..Path::default() });
            StaticBody { path, ..StaticBody::new(GlobalId(u64::from(k)), kind, place) }
        };
        let ground = StaticBody::new(GlobalId(440), rectangle(80.0, 1.0), DVec2::new(0.5 * SIDE, 0.0));
        let statics: Vec<StaticBody> = (0..440).map(shelf).chain([ground]).collect();
        let kinds = vec![circle(0.2), rectangle(0.5, 0.4), circle(2.5)];
        let blueprint = Blueprint { params, partition, kinds, statics };
        let mut world = World::whole(&blueprint).unwrap();
        for k in 0..90_u32 {
            let place = DVec2::new(0.65 * f64::from(k) + 0.7, 3.1 + 2.5 * f64::from(k * 7 % 20));
            let speed = if far > 0 && k % far == 1 { 60.0 } else { 4.0 };
            let velocity = speed * Vec2::new(if k.is_multiple_of(2) { 1.0 } else { -1.0 }, 0.3);
            let kind = KindId(if k % 45 == 22 { 2 } else { k % 2 });
            let body = Body { velocity, ..Body::at_rest(GlobalId(u64::from(k) + 441), kind, place) };
            assert!(world.add(body).unwrap());
        }
        world
    }

    fn each_tile(world: &mut World, change: impl Fn(&mut Near)) {
        world.tile_states_mut().iter_mut().for_each(|tile| change(&mut tile.near));
    }

    #[test]
    fn which_statics_a_tile_takes_in_shows_in_no_bit() {
        let uniform = |columns, rows| Partition::uniform(DVec2::ZERO, DVec2::splat(SIDE), columns, rows).unwrap();
        let cut = |part: f64| [Bisector { axis: 0, at: (part * 2_f64.powi(32)) as u32 }];
        let halves = |part| Partition::bisection(DVec2::ZERO, DVec2::splat(SIDE), &cut(part)).unwrap();
        for (exchange, far) in
            [(Exchange::Step, 0), (Exchange::Step, 30), (Exchange::Substep, 0), (Exchange::Substep, 30)]
        {
            for partition in [uniform(1, 1), uniform(2, 2), halves(0.5)] {
                let new = || landscape(exchange, far, partition.clone());
                // As ever; with all statics; with those of each step found anew.
                let [mut ever, mut all, mut anew] = [(); 3].map(|()| new());
                let (mut most, mut touching) = (0, 0);
                for at in 0..150 {
                    if partition.cuts().is_some() && at % 20 == 10 {
                        let moved = halves(0.4 + 0.002 * f64::from(at));
                        [&mut ever, &mut all, &mut anew].into_iter().for_each(|world| world.retile(&moved).unwrap());
                    }
                    // Who is brought to rest is still told to large ones with what he did to what he is no longer near.
                    let halted = GlobalId(441 + at as u64 * 31 % 90);
                    let halt = Command::SetVelocity { id: halted, velocity: Vec2::ZERO, angular_velocity: 0.0 };
                    [&mut ever, &mut all, &mut anew].into_iter().for_each(|world| {
                        world.command(&halt).unwrap();
                    });
                    each_tile(&mut all, |near| near.pause = PAUSE);
                    each_tile(&mut anew, |near| *near = Near::default());
                    let [report, by_all, by_anew] =
                        [&mut ever, &mut all, &mut anew].map(|world| step(world, &mut Loopback).unwrap());
                    assert_eq!((report, report), (by_all, by_anew), "step {at}, {exchange:?}, {far}");
                    assert_eq!(
                        (ever.hashes(), ever.hashes()),
                        (all.hashes(), anew.hashes()),
                        "step {at}, {exchange:?}, {far}"
                    );
                    let known =
                        |world: &World| world.tile_states().iter().map(|tile| tile.statics.len()).sum::<usize>();
                    assert!(known(&all) >= 441 || at % 20 == 10, "step {at}");
                    if far == 0 {
                        most = most.max(known(&ever));
                    }
                    touching = touching.max(report.contacts);
                    if at % 50 == 49 {
                        // What is saved names all statics, and goes on alike.
                        let [mut bytes, mut of_all] = [(); 2].map(|()| Vec::new());
                        let (saved, saved_of_all) = (ever.save(&mut bytes), all.save(&mut of_all));
                        assert!(saved == saved_of_all && bytes == of_all, "step {at}");
                        let mut again = landscape(exchange, far, ever.partition().clone());
                        let mut rest = &bytes[..];
                        for saved in saved {
                            again.restore(saved.tile, rest.split_off(..saved.length).unwrap()).unwrap();
                        }
                        again.resume_at(ever.step_count());
                        ever = again;
                    }
                }
                assert!(touching > 40, "{touching} contacts");
                assert!(most < 330, "{most} of 441 statics where nobody goes far");
            }
        }
    }

    #[test]
    fn contacts_stay_with_statics_that_nobody_is_near_any_more() {
        let partition = Partition::uniform(DVec2::ZERO, DVec2::splat(SIDE), 1, 1).unwrap();
        let mut world = landscape(Exchange::Step, 0, partition);
        for _ in 0..60 {
            step(&mut world, &mut Loopback).unwrap();
        }
        let setup = world.setup.clone();
        let tile = &mut world.tile_states_mut()[0];
        let pairs = |tile: &Tile| -> Vec<_> { tile.contacts.keys.iter().map(|&key| tile.pair_of(key)).collect() };
        let (before, known) = (pairs(tile), tile.statics.len());
        tile.bodies.truncate(tile.owned);
        tile.bodies.position.fill(DVec2::splat(1.0));
        tile.near = Near::default();
        tile.meet_statics(Vec::new(), &setup);
        tile.push_statics(&setup, 60);
        assert!(before.len() > 40 && tile.statics.len() < known, "{} of {known} statics", tile.statics.len());
        assert_eq!(pairs(tile), before);
    }
}
