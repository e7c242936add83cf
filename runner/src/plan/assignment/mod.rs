//! Which rank holds which tiles: at first contiguous runs along a Hilbert curve, of about equal weight.
//!
//! A run of the curve is compact, so a rank's tiles mostly border each other and few bytes leave the rank. Only integers
//! are compared, so every rank computes the same assignment from the same weights. The assignment decides how a world
//! is computed and never what comes out.

mod curve;
mod refine;

use atoll_core::{Change, Partition, TileId};
use curve::hilbert_order;

/// A rank for every tile.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Assignment {
    /// By tile.
    rank_of: Vec<u32>,
    ranks: usize,
}

impl Assignment {
    /// Cuts the tiles into `ranks` runs. `weights` gives the cost of each tile, by tile id: the bodies it starts with.
    ///
    /// Every rank gets at least one tile while there are as many tiles as ranks; with fewer tiles, the last ranks get
    /// none.
    ///
    /// # Panics
    /// If there is not one weight per tile, or if there are no ranks.
    pub fn balanced(partition: &Partition, weights: &[u64], ranks: usize) -> Self {
        assert_eq!(weights.len(), partition.tiles(), "one weight per tile");
        assert!(ranks > 0, "a run has ranks");
        let curve = hilbert_order(partition);
        // An empty tile costs a little too, and so the total is never zero.
        let weight = |tile: usize| u128::from(weights[tile]) + 1;
        let total: u128 = (0..weights.len()).map(weight).sum();
        let busy = ranks.min(curve.len());

        let mut rank_of = vec![0; curve.len()];
        let (mut next, mut assigned) = (0, 0_u128);
        for rank in 0..busy {
            let goal = total * (rank as u128 + 1) / busy as u128;
            let last = curve.len() - (busy - rank - 1);
            let first = next;
            // The next tile is taken while that brings the sum nearer to the goal.
            while next < last && (next == first || 2 * assigned + weight(curve[next]) <= 2 * goal) {
                assigned += weight(curve[next]);
                rank_of[curve[next]] = rank as u32;
                next += 1;
            }
        }
        Self { rank_of, ranks }
    }

    /// One by which about half of all tiles are held by the next rank, others after every step: to test that nothing depends on
    /// who holds a tile.
    pub fn shuffled(&self, step: u64) -> Self {
        let goes = |tile: u64| ((tile << 32 | step & 0xffff_ffff).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) & 1;
        let next = |(tile, &rank): (u64, &u32)| (rank + goes(tile) as u32) % self.ranks as u32;
        Self { rank_of: (0..).zip(&self.rank_of).map(next).collect(), ranks: self.ranks }
    }

    /// The ranks that tiles of another partition go to, which take up the same places: each to that of the first of the old ones.
    pub fn followed(&self, changes: &[Change]) -> Self {
        let next = changes.iter().flat_map(|change| {
            let rank = self.rank_of[change.old.start as usize];
            change.new.clone().map(move |_| rank)
        });
        Self { rank_of: next.collect(), ranks: self.ranks }
    }

    /// One by which tiles that are about to be joined are held by one rank, that of the first.
    pub fn joined(&self, changes: &[Change]) -> Self {
        let next = changes.iter().flat_map(|change| {
            // Either there is one old tile, or they become one.
            let rank = self.rank_of[change.old.start as usize];
            change.old.clone().map(move |_| rank)
        });
        Self { rank_of: next.collect(), ranks: self.ranks }
    }

    /// The rank that holds a tile.
    pub fn rank_of(&self, tile: TileId) -> usize {
        self.rank_of[tile.0 as usize] as usize
    }

    /// For every tile the rank that holds it.
    pub(crate) fn ranks_of_tiles(&self) -> &[u32] {
        &self.rank_of
    }

    /// The tiles of a rank, ascending. None for an idle rank.
    pub fn tiles_of(&self, rank: usize) -> Vec<TileId> {
        let of_rank = |&(_, &holder): &(u32, &u32)| holder as usize == rank;
        (0..).zip(&self.rank_of).filter(of_rank).map(|(tile, _)| TileId(tile)).collect()
    }

    /// How many ranks there are.
    pub fn ranks(&self) -> usize {
        self.ranks
    }

    /// Ranks without a tile.
    pub fn idle_ranks(&self) -> usize {
        self.ranks.saturating_sub(self.rank_of.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    fn grid(columns: u32, rows: u32) -> Partition {
        Partition::uniform(DVec2::ZERO, DVec2::new(f64::from(columns), f64::from(rows)), columns, rows).unwrap()
    }

    fn loads(assignment: &Assignment, weights: &[u64]) -> Vec<u64> {
        let load = |rank| assignment.tiles_of(rank).iter().map(|tile| weights[tile.0 as usize]).sum();
        (0..assignment.ranks()).map(load).collect()
    }

    #[test]
    fn every_tile_has_one_rank_and_every_rank_a_run_of_the_curve() {
        for (columns, rows) in [(1, 1), (3, 2), (8, 8), (17, 17), (1, 40)] {
            let grid = grid(columns, rows);
            let weights: Vec<u64> = (0..grid.tiles() as u64).map(|tile| tile * 7919 % 1000).collect();
            for ranks in [1, 2, 3, 4, 7, 64] {
                let assignment = Assignment::balanced(&grid, &weights, ranks);
                assert_eq!(assignment, Assignment::balanced(&grid, &weights, ranks));
                let along: Vec<usize> =
                    hilbert_order(&grid).into_iter().map(|tile| assignment.rank_of(TileId(tile as u32))).collect();
                assert!(along.windows(2).all(|pair| pair[1] == pair[0] || pair[1] == pair[0] + 1));
                assert_eq!(along.first(), Some(&0));
                assert_eq!(along.last(), Some(&(ranks.min(grid.tiles()) - 1)));
                let listed: usize = (0..ranks).map(|rank| assignment.tiles_of(rank).len()).sum();
                assert_eq!(listed, grid.tiles());
                assert_eq!(assignment.idle_ranks(), ranks.saturating_sub(grid.tiles()));
            }
        }
    }

    #[test]
    fn loads_differ_by_no_more_than_a_tile() {
        let grid = grid(17, 17);
        let even = vec![2422; grid.tiles()];
        for ranks in [2, 4, 7, 16] {
            let loads = loads(&Assignment::balanced(&grid, &even, ranks), &even);
            let (least, most) = (loads.iter().min().unwrap(), loads.iter().max().unwrap());
            assert!(most - least <= 2422, "{loads:?}");
        }
        // A corner ten times as dense: an equal number of tiles each would load one rank with most of it.
        let skewed: Vec<u64> =
            (0..grid.tiles()).map(|tile| if tile % 17 < 8 && tile / 17 < 8 { 5000 } else { 500 }).collect();
        let loads = loads(&Assignment::balanced(&grid, &skewed, 4), &skewed);
        let mean = skewed.iter().sum::<u64>() / 4;
        assert!(loads.iter().all(|&load| load.abs_diff(mean) <= 5000), "{loads:?}");
    }

    #[test]
    fn worlds_without_bodies_are_cut_as_well() {
        let grid = grid(4, 4);
        let assignment = Assignment::balanced(&grid, &[0; 16], 5);
        assert!((0..5).all(|rank| !assignment.tiles_of(rank).is_empty()));
    }
}
