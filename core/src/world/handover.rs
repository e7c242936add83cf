//! Tiles that move from one world to another, between two steps, as blocks of [`World::save`]'s kind.

use super::World;
use crate::model::id::TileId;
use crate::state::snapshot::{self, RestoreError};
use crate::tiling::tile::Tile;

impl World {
    /// Gives up some tiles, ascending and each one of its own: their blocks, in the same order. A world that
    /// [has failed](Self::has_failed) has none to give.
    ///
    /// # Panics
    /// If a tile is not of this world, or they do not ascend; the world is left as it was.
    pub fn give_up(&mut self, tiles: &[TileId]) -> Vec<Vec<u8>> {
        let are_here = tiles.is_sorted_by(|a, b| a < b) && tiles.iter().all(|&tile| self.place_of(tile).is_some());
        assert!(are_here, "only who holds a tile can give it up, each once, in ascending order");
        self.settle();
        let mut leaving = tiles.iter().peekable();
        let mut blocks = Vec::with_capacity(tiles.len());
        let all = std::mem::take(&mut self.tiles).into_iter().zip(std::mem::take(&mut self.works));
        let stays = |(tile, _): &(Tile, _)| {
            let leaves = leaving.next_if(|name| **name == tile.id).is_some();
            if leaves {
                blocks.push(snapshot::block(tile));
            }
            !leaves
        };
        (self.tiles, self.works) = all.filter(stays).unzip();
        self.find_places();
        blocks
    }

    /// Takes over tiles that another world gave up at the same step. On an error it is left as it was.
    ///
    /// # Errors
    /// If it holds one of the tiles already, or a block is not what was saved of its tile, whole and unchanged, or holds a
    /// body that is not fit to be stepped.
    pub fn take_over(&mut self, blocks: &[(TileId, &[u8])]) -> Result<(), RestoreError> {
        self.settle();
        let mut taken = Vec::with_capacity(blocks.len());
        for &(tile, block) in blocks {
            let known = (tile.0 as usize) < self.setup.partition.tiles() && self.place_of(tile).is_none();
            if !known || taken.iter().any(|taken: &Tile| taken.id == tile) {
                return Err(RestoreError::NotToBeTaken { tile });
            }
            taken.push(snapshot::read(tile, self.setup.statics_of(tile), block, &self.setup)?.0);
        }
        let mut kept: Vec<_> =
            std::mem::take(&mut self.tiles).into_iter().zip(std::mem::take(&mut self.works)).collect();
        kept.extend(taken.into_iter().map(|tile| (tile, None)));
        kept.sort_by_key(|(tile, _)| tile.id);
        (self.tiles, self.works) = kept.into_iter().unzip();
        self.find_places();
        Ok(())
    }

    /// After tiles came or went: where each of them is, and which have something to do.
    fn find_places(&mut self) {
        self.inbox.hold(self.tiles.iter().map(|tile| tile.id));
        self.dismissed.clear();
        self.changed = true;
        self.forget_places();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Loopback;
    use crate::model::body::{Body, StaticBody};
    use crate::model::id::{GlobalId, KindId};
    use crate::model::params::Params;
    use crate::step::step;
    use crate::testing::{circle, rectangle};
    use crate::tiling::blueprint::Blueprint;
    use crate::tiling::partition::Partition;
    use glam::{DVec2, Vec2};

    /// A heap of discs and boxes over the borders of four tiles.
    fn world() -> World {
        let params = Params { gravity: Vec2::new(0.0, -10.0), ..Params::default() };
        let partition = Partition::uniform(DVec2::new(-4.0, 0.0), DVec2::new(4.0, 4.0), 4, 1).unwrap();
        let statics = vec![StaticBody::new(GlobalId(0), rectangle(20.0, 2.0), DVec2::new(0.0, -1.0))];
        let blueprint = Blueprint { params, partition, kinds: vec![circle(0.25), rectangle(0.5, 0.5)], statics };
        let mut world = World::whole(&blueprint).unwrap();
        for k in 0..60_u32 {
            let place = DVec2::new(0.51 * f64::from(k % 12) - 3.0, 0.25 + 0.51 * f64::from(k / 12));
            world.add(Body::at_rest(GlobalId(u64::from(k) + 1), KindId(u32::from(k % 3 > 0)), place)).unwrap();
        }
        world
    }

    #[test]
    fn tiles_that_went_and_came_back_show_nowhere() {
        let (mut stays, mut goes) = (world(), world());
        for number in 0..40 {
            step(&mut stays, &mut Loopback).unwrap();
            step(&mut goes, &mut Loopback).unwrap();
            let all = [0, 1, 2, 3].map(TileId);
            let leaving: Vec<TileId> = all.into_iter().filter(|tile| (number + tile.0 * tile.0) % 3 != 0).collect();
            let blocks = goes.give_up(&leaving);
            assert!(goes.tiles().eq(all.into_iter().filter(|tile| !leaving.contains(tile))));
            // In another order, and each by itself.
            for (tile, block) in leaving.iter().zip(&blocks).rev() {
                goes.take_over(&[(*tile, block)]).unwrap();
            }
            assert!(goes.tiles().eq(all));
            assert_eq!(goes.hashes(), stays.hashes(), "after step {number}");
        }
        assert!(stays.tile_states().iter().all(|tile| tile.contacts.keys.iter().any(|key| key.is_border())));
    }

    #[test]
    fn what_cannot_be_taken_over_changes_nothing() {
        let mut world = world();
        step(&mut world, &mut Loopback).unwrap();
        let before = world.hashes();
        let block = snapshot::block(&world.tiles[1]);
        let refused = |world: &mut World, blocks: &[(TileId, &[u8])]| world.take_over(blocks).unwrap_err();
        assert_eq!(refused(&mut world, &[(TileId(1), &block)]), RestoreError::NotToBeTaken { tile: TileId(1) });
        assert_eq!(refused(&mut world, &[(TileId(7), &block)]), RestoreError::NotToBeTaken { tile: TileId(7) });
        assert_eq!(world.hashes(), before);
        let blocks = world.give_up(&[TileId(1), TileId(3)]);
        let left = world.hashes();
        let twice = [(TileId(1), &blocks[0][..]), (TileId(1), &blocks[0])];
        assert_eq!(refused(&mut world, &twice), RestoreError::NotToBeTaken { tile: TileId(1) });
        let wrong = [(TileId(1), &blocks[0][..]), (TileId(3), &blocks[0])];
        assert_eq!(refused(&mut world, &wrong), RestoreError::OtherTile { tile: TileId(3), found: TileId(1) });
        let mut damaged = blocks[1].clone();
        damaged[100] ^= 1;
        let damaged = [(TileId(1), &blocks[0][..]), (TileId(3), &damaged)];
        assert_eq!(refused(&mut world, &damaged), RestoreError::Damaged { tile: TileId(3) });
        assert_eq!(world.hashes(), left);
        world.take_over(&[(TileId(1), &blocks[0]), (TileId(3), &blocks[1])]).unwrap();
        assert_eq!(world.hashes(), before);
    }

    #[test]
    fn tiles_in_no_order_are_not_given_up() {
        let mut world = world();
        let before = world.hashes();
        for tiles in [&[2, 1][..], &[1, 1], &[1, 7]] {
            let tiles: Vec<TileId> = tiles.iter().copied().map(TileId).collect();
            let attempt = std::panic::AssertUnwindSafe(|| world.give_up(&tiles));
            assert!(std::panic::catch_unwind(attempt).is_err(), "{tiles:?}");
            assert_eq!(world.hashes(), before);
        }
    }

    #[test]
    fn the_time_of_each_tile_is_booked() {
        use std::sync::atomic::{AtomicU64, Ordering};
        use std::time::Duration;
        static CLOCK: AtomicU64 = AtomicU64::new(0);
        let mut world = world();
        step(&mut world, &mut Loopback).unwrap();
        assert!(world.booked_time().is_zero());
        world.book_time(|| Duration::from_nanos(CLOCK.fetch_add(1, Ordering::Relaxed)));
        step(&mut world, &mut Loopback).unwrap();
        let booked: Vec<(TileId, Duration)> = world.take_booked_times().collect();
        assert!(booked.iter().all(|(_, time)| !time.is_zero()), "{booked:?}");
        assert_eq!(booked.iter().map(|(_, time)| *time).sum::<Duration>(), world.booked_time());
        assert!(world.take_booked_times().all(|(_, time)| time.is_zero()));
    }
}
