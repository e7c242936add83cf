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
        // How many tiles of that size a body's grown AABB and the halo around it meet, along an axis.
        let met = |tiles: u64, side: f64| (1.0 + 2.0 * reach / side).min(tiles as f64);
        let copies = |tile: TileId| {
            let (size, (_, [columns, rows])) = (partition.rectangle(tile).size(), partition.cell(tile));
            met(columns, size.x) * met(rows, size.y) - 1.0
        };
        // Equal tiles are all like the first.
        let looked_at = if partition.is_uniform() { 1 } else { partition.tiles() as u32 };
        let copies = (0..looked_at).map(|tile| copies(TileId(tile))).sum::<f64>() / f64::from(looked_at);
        let ghosts = (bodies as f64 * copies * PER_GHOST) as u64;
        let tiles = partition.tiles() as u64 * (size_of::<Tile>() as u64 + 64);
        bodies.saturating_mul(PER_BODY).saturating_add(ghosts).saturating_add(tiles)
    }
}
