//! How much memory a world takes, before it is built.

use super::blueprint::{Blueprint, halo_width, largest_radius};
use super::tile::Tile;
use crate::model::id::TileId;

/// Bytes of a body with its contacts, its share of what a step derives, and some to spare.
const PER_BODY: u64 = 200;
/// Bytes of a ghost: on its way in two buffers, in the lists of who sends and receives it, and where it is held.
const PER_GHOST: f64 = 300.0;

impl Blueprint {
    /// About how many bytes a world of every tile takes, with so many bodies spread evenly over the domain. Measured on
    /// the scene `rooms`, with 5000 bodies in a tile and with 450 tiles for a body.
    pub fn memory(&self, bodies: u64) -> u64 {
        let reach = halo_width(&self.kinds, &self.params)
            + f64::from(largest_radius(&self.kinds, self.params.large_radius))
            + 0.5 * f64::from(self.params.margin_floor + self.params.margin_cap);
        let partition = &self.partition;
        let (domain, tiles) = (partition.max() - partition.min(), partition.tiles() as f64);
        // How many tiles of that size a body's grown AABB and the halo around it meet, but for its own; there are no more.
        let copies = |tile: TileId| {
            let size = partition.rectangle(tile).size();
            let met = (1.0 + 2.0 * reach / size).min(domain / size);
            (met.x * met.y).min(tiles) - 1.0
        };
        // Equal tiles are all like the first.
        let looked_at = if partition.is_uniform() { 1 } else { partition.tiles() as u32 };
        let copies = (0..looked_at).map(|tile| copies(TileId(tile))).sum::<f64>() / f64::from(looked_at);
        let ghosts = (bodies as f64 * copies * PER_GHOST) as u64;
        let tiles = partition.tiles() as u64 * (size_of::<Tile>() as u64 + 64);
        bodies.saturating_mul(PER_BODY).saturating_add(ghosts).saturating_add(tiles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::params::Params;
    use crate::testing::circle;
    use crate::tiling::partition::{Bisector, Partition};
    use glam::DVec2;

    #[test]
    fn a_body_has_no_more_copies_than_there_are_other_tiles() {
        let (low, high) = (DVec2::ZERO, DVec2::splat(20.0));
        // Borders so near to each other that a halo is very many times as wide.
        let slivers = [2, 1, 3].map(|at| Bisector { axis: 0, at });
        for partition in [
            Partition::uniform(low, high, 2, 2),
            Partition::forest(low, high, 1, 1, &[1; 4]),
            Partition::bisection(low, high, &slivers),
        ] {
            let (partition, kinds) = (partition.unwrap(), vec![circle(0.5)]);
            let blueprint = Blueprint { params: Params::default(), partition, kinds, statics: Vec::new() };
            let per_body = (blueprint.memory(100) - blueprint.memory(0)) / 100;
            assert!((PER_BODY..=PER_BODY + 3 * PER_GHOST as u64).contains(&per_body), "{per_body} bytes");
        }
    }
}
