//! A better assignment than the one there is: few tiles move from ranks with most to do to ranks with less, or change places with
//! smaller ones.
//!
//! Runs of a curve end between two tiles, so with few tiles for each rank they are uneven by half a tile; moving and swapping
//! single tiles (as in local search for the makespan of parallel machines: Finn and Horowitz, "A linear time approximation
//! algorithm for multiprocessor scheduling", BIT 19, 1979) comes near the mean. All is in integers and in a fixed order: every rank
//! finds the same from the same costs.

use super::Assignment;
use atoll_core::{Partition, TileId};

/// With more tiles for each rank than this, runs of the curve are even enough, and more compact than what moves leave behind.
const TILES_OF_A_RUN: usize = 32;

/// Who has less than a hundredth more than the mean is left alone.
const ENOUGH: u64 = 100;

/// A tile that goes where none of its neighbours are costs a rank so much of the mean: more ranks have to talk to each other.
const STRANGER: u64 = 200;

/// So many ranks with least to do are looked at for each that has most.
const RECEIVERS: usize = 24;

impl Assignment {
    /// One by which ranks have about as much to do, if there is a better one. `costs` gives what each tile takes, by tile, in
    /// any unit. Takes time for each tile, and for each tile that moves some more.
    ///
    /// # Panics
    /// If there is not one cost per tile.
    pub fn refined(&self, partition: &Partition, costs: &[u64]) -> Option<Self> {
        assert_eq!(costs.len(), partition.tiles(), "one cost per tile");
        let mut loads = Loads::new(self.clone(), partition, costs);
        let before = loads.most();
        if costs.len() > TILES_OF_A_RUN * self.ranks && !loads.are_even(before) {
            loads = Loads::new(Self::balanced(partition, costs, self.ranks), partition, costs);
        }
        for _ in 0..4 * self.ranks + 64 {
            if !loads.improve() {
                break;
            }
        }
        // A gain that is too small to be measured is none.
        let gains = 2 * ENOUGH * (before - loads.most().min(before)) > before;
        gains.then_some(loads.assignment)
    }

    /// The tiles that another assignment gives to another rank: tile, from, to.
    pub fn moves<'a>(&'a self, new: &'a Self) -> impl Iterator<Item = (TileId, usize, usize)> + 'a {
        let ranks = self.rank_of.iter().zip(&new.rank_of).enumerate();
        ranks
            .filter(|(_, (from, to))| from != to)
            .map(|(tile, (&from, &to))| (TileId(tile as u32), from as usize, to as usize))
    }
}

/// What each rank has to do.
struct Loads<'a> {
    assignment: Assignment,
    partition: &'a Partition,
    costs: &'a [u64],
    /// By rank.
    sums: Vec<u64>,
    /// By rank, in no order in particular, but the same everywhere.
    tiles: Vec<Vec<u32>>,
    mean: u64,
}

/// A tile given away, perhaps for a smaller one.
#[derive(Clone, Copy)]
struct Action {
    to: usize,
    /// Place among the giver's tiles.
    gives: usize,
    /// Place among the receiver's.
    gets: Option<usize>,
}

impl<'a> Loads<'a> {
    fn new(assignment: Assignment, partition: &'a Partition, costs: &'a [u64]) -> Self {
        let mut sums = vec![0; assignment.ranks];
        let mut tiles = vec![Vec::new(); assignment.ranks];
        for (tile, (&rank, cost)) in (0..).zip(assignment.rank_of.iter().zip(costs)) {
            sums[rank as usize] += cost;
            tiles[rank as usize].push(tile);
        }
        let mean = sums.iter().sum::<u64>() / assignment.ranks as u64;
        Self { assignment, partition, costs, sums, tiles, mean }
    }

    fn most(&self) -> u64 {
        self.sums.iter().copied().max().unwrap_or(0)
    }

    fn are_even(&self, most: u64) -> bool {
        most <= self.mean + self.mean / ENOUGH
    }

    /// Lets the rank with most to do give something away. Says whether that was any use.
    fn improve(&mut self) -> bool {
        let most = self.most();
        let Some(from) = self.sums.iter().position(|&sum| sum == most).filter(|_| !self.are_even(most)) else {
            return false;
        };
        let mut receivers: Vec<usize> = (0..self.sums.len()).filter(|&rank| rank != from).collect();
        let least = |&rank: &usize| (self.sums[rank], rank);
        if receivers.len() > RECEIVERS {
            receivers.select_nth_unstable_by_key(RECEIVERS, least);
            receivers.truncate(RECEIVERS);
        }
        receivers.sort_unstable_by_key(least);
        receivers.extend(self.neighbours_of_rank(from));
        let mut best = (most, None);
        for to in receivers {
            for gives in 0..self.tiles[from].len() {
                self.consider(Action { to, gives, gets: None }, from, &mut best);
                // Where there are many, one of them is of the right size.
                if self.tiles[to].len().max(self.tiles[from].len()) <= TILES_OF_A_RUN {
                    for gets in 0..self.tiles[to].len() {
                        self.consider(Action { to, gives, gets: Some(gets) }, from, &mut best);
                    }
                }
            }
        }
        let (_, Some(Action { to, gives, gets })) = best else { return false };
        let tile = self.tiles[from].swap_remove(gives);
        let back = gets.map(|gets| self.tiles[to].swap_remove(gets));
        for (tile, from, to) in [(Some(tile), from, to), (back, to, from)] {
            let Some(tile) = tile else { continue };
            self.sums[from] -= self.costs[tile as usize];
            self.sums[to] += self.costs[tile as usize];
            self.tiles[to].push(tile);
            self.assignment.rank_of[tile as usize] = to as u32;
        }
        true
    }

    /// Keeps an action if it leaves the two ranks with less at most than the best so far.
    fn consider(&self, action: Action, from: usize, best: &mut (u64, Option<Action>)) {
        let Action { to, gives, gets } = action;
        let tile = self.tiles[from][gives];
        let back = gets.map(|gets| self.tiles[to][gets]);
        let (given, got) = (self.costs[tile as usize], back.map_or(0, |back| self.costs[back as usize]));
        if given <= got || self.sums[to] + given - got >= best.0 {
            return;
        }
        let strangers = u64::from(!self.has_neighbour(tile, to))
            + back.map_or(0, |back| u64::from(!self.has_neighbour(back, from)));
        let pair = (self.sums[from] + got - given).max(self.sums[to] + given - got) + strangers * self.mean / STRANGER;
        if pair < best.0 {
            *best = (pair, Some(action));
        }
    }

    fn has_neighbour(&self, tile: u32, rank: usize) -> bool {
        neighbours(self.partition, tile).any(|tile| self.assignment.rank_of[tile as usize] as usize == rank)
    }

    /// The ranks that hold neighbours of a rank's tiles, ascending.
    fn neighbours_of_rank(&self, rank: usize) -> Vec<usize> {
        let tiles = self.tiles[rank].iter().flat_map(|&tile| neighbours(self.partition, tile));
        let mut ranks: Vec<usize> = tiles.map(|tile| self.assignment.rank_of[tile as usize] as usize).collect();
        ranks.sort_unstable();
        ranks.dedup();
        ranks.retain(|&other| other != rank);
        ranks
    }
}

/// The tiles that share an edge or a corner with one.
fn neighbours(partition: &Partition, tile: u32) -> impl Iterator<Item = u32> + '_ {
    partition.around(TileId(tile)).map(|tile| tile.0).filter(move |&other| other != tile)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    fn grid(columns: u32, rows: u32) -> Partition {
        Partition::uniform(DVec2::ZERO, DVec2::new(f64::from(columns), f64::from(rows)), columns, rows).unwrap()
    }

    /// The most a rank has to do, in means.
    fn imbalance(assignment: &Assignment, grid: &Partition, costs: &[u64]) -> f64 {
        let loads = Loads::new(assignment.clone(), grid, costs);
        loads.most() as f64 * loads.sums.len() as f64 / loads.sums.iter().sum::<u64>() as f64
    }

    /// A corner that is ever denser, as at the end of NORMAL.
    fn skewed(grid: &Partition) -> Vec<u64> {
        let cost = |tile: usize| {
            let (x, y) = (tile % grid.roots()[0] as usize, tile / grid.roots()[0] as usize);
            let near = 1.0 - (x + y) as f64 / (grid.roots()[0] as usize + grid.roots()[1] as usize) as f64;
            (1e5 * near.powi(3)) as u64 + 7 * tile as u64
        };
        (0..grid.tiles()).map(cost).collect()
    }

    #[test]
    fn few_tiles_are_spread_evenly_and_few_of_them_move() {
        for (side, ranks, moved) in [(9, 16, 81), (12, 4, 100), (9, 2, 40), (24, 7, 500)] {
            let grid = grid(side, side);
            let even = Assignment::balanced(&grid, &vec![100; grid.tiles()], ranks);
            let costs = skewed(&grid);
            let refined = even.refined(&grid, &costs).unwrap();
            let (before, after) = (imbalance(&even, &grid, &costs), imbalance(&refined, &grid, &costs));
            assert!(before > 1.3 && after < 1.05, "{side} x {side} over {ranks}: {before} to {after}");
            assert!(even.moves(&refined).count() <= moved, "{}", even.moves(&refined).count());
            assert_eq!(even.refined(&grid, &costs).unwrap(), refined);
            // What is even stays as it is.
            assert!(refined.refined(&grid, &costs).is_none_or(|again| imbalance(&again, &grid, &costs) < after));
        }
    }

    #[test]
    fn many_tiles_stay_in_runs() {
        let grid = grid(64, 64);
        let even = Assignment::balanced(&grid, &vec![100; grid.tiles()], 4);
        let costs = skewed(&grid);
        let refined = even.refined(&grid, &costs).unwrap();
        assert!(imbalance(&refined, &grid, &costs) < 1.02);
        let strangers = (0..grid.tiles() as u32).filter(|&tile| {
            let rank = refined.rank_of[tile as usize];
            neighbours(&grid, tile).all(|other| refined.rank_of[other as usize] != rank)
        });
        assert_eq!(strangers.count(), 0);
    }

    #[test]
    fn one_tile_that_takes_longer_than_all_others_is_left_with_one_rank() {
        let grid = grid(4, 4);
        let mut costs = vec![1; 16];
        costs[5] = 1000;
        let refined = Assignment::balanced(&grid, &[1; 16], 4)
            .refined(&grid, &costs)
            .unwrap_or_else(|| Assignment::balanced(&grid, &[1; 16], 4));
        assert!(imbalance(&refined, &grid, &costs) < 4.0);
        assert!(Assignment::balanced(&grid, &[0; 16], 4).refined(&grid, &[0; 16]).is_none());
        let lonely = Assignment::balanced(&grid, &[1; 16], 1);
        assert!(lonely.refined(&grid, &costs).is_none());
    }

    #[test]
    fn moves_lead_from_one_to_the_other() {
        let grid = grid(6, 5);
        let (old, new) = (Assignment::balanced(&grid, &[1; 30], 3), Assignment::balanced(&grid, &[1; 30], 5));
        let mut moved = old.clone();
        for (tile, from, to) in old.moves(&new) {
            assert_eq!(moved.rank_of(tile), from);
            moved.rank_of[tile.0 as usize] = to as u32;
        }
        assert_eq!(moved.rank_of, new.rank_of);
        assert_eq!(old.moves(&old).count(), 0);
    }
}
