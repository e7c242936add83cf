//! The tiles around one, at hand for whoever asks of many places there which tiles they meet.

use super::{Partition, Region};
use crate::model::id::TileId;
use glam::DVec2;

/// Of more tiles than these a partition finds those that meet a box sooner.
const FEW: usize = 16;

/// A rectangle, and the tiles that meet it, ascending.
#[derive(Clone, Default, Debug)]
pub(crate) struct Surroundings {
    /// Nothing where the partition is to be asked.
    rectangle: Option<Region>,
    tiles: Vec<(TileId, Region)>,
}

impl Surroundings {
    /// Looks at the region of a tile and so much around it, in meters. Equal tiles are found by their numbers.
    pub(crate) fn look_around(&mut self, partition: &Partition, tile: TileId, reach: f64) {
        self.rectangle = None;
        if partition.is_uniform() {
            return;
        }
        let rectangle = partition.region(tile).shrunk(-reach);
        let met = partition.met(rectangle.min, rectangle.max).take(FEW + 1);
        self.tiles.clear();
        self.tiles.extend(met.map(|tile| (tile, partition.region(tile))));
        self.rectangle = (self.tiles.len() <= FEW).then_some(rectangle);
    }

    /// The tiles that meet a box, as [`Partition::met`] has them.
    #[inline]
    pub(crate) fn met<'a>(
        &'a self,
        partition: &'a Partition,
        low: DVec2,
        high: DVec2,
    ) -> impl Iterator<Item = TileId> + 'a {
        let is_around = |around: &Region| (low.cmpge(around.min) & high.cmple(around.max)).all();
        let is_known = self.rectangle.as_ref().is_some_and(is_around);
        let known = if is_known { &self.tiles[..] } else { &[] };
        let others = (!is_known).then(|| partition.met(low, high));
        let meets = move |&&(_, region): &&(TileId, Region)| region.meets(low, high);
        known.iter().filter(meets).map(|&(tile, _)| tile).chain(others.into_iter().flatten())
    }
}
