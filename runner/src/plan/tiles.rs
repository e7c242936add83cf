//! The default tile grid: a function of the scene and the physics alone, so that any number of ranks and threads
//! computes the same world.

use crate::config::{Config, MOST_TILES};
use crate::scene::Scene;
use atoll_core::{Kind, Params};
use glam::DVec2;

/// Bodies in a tile of the default grid, on the average. So many stay in a core's L2 cache for a whole step; half as many
/// cost a tenth more for their ghosts, and more leave fewer tiles to share among ranks.
const BODIES_PER_TILE: f64 = 8000.0;

/// A tile of the default grid is at least this many halo widths wide; below, most of a tile's work would be ghosts.
const HALOS_PER_TILE: f64 = 4.0;

/// Columns and rows of tiles: those given, else the default for the scene.
pub(crate) fn tile_counts(config: &Config, scene: &Scene) -> [u32; 2] {
    config.run.tiles.unwrap_or_else(|| {
        if config.params.sleep {
            return [1, 1]; // islands sleep within one tile only
        }
        let (low, high) = scene.domain();
        default_counts(scene.bodies(), high - low, halo_width(&scene.kinds(), &config.params))
    })
}

/// The width of the halo in meters that the default is made with, which no change may bend: without what
/// [`atoll_core::halo_width`] adds for rounding.
fn halo_width(kinds: &[Kind], params: &Params) -> f64 {
    let radii = kinds.iter().map(|kind| f64::from(kind.shape.bounding_radius()));
    radii.fold(0.0, f64::max) + f64::from(params.margin_cap)
}

fn default_counts(bodies: u64, size: DVec2, halo_width: f64) -> [u32; 2] {
    let tiles = bodies as f64 / BODIES_PER_TILE;
    let count = |along: f64, across: f64| {
        let square = (tiles * (along / across)).sqrt().round();
        let most = (along / (HALOS_PER_TILE * halo_width)).floor().clamp(1.0, MOST_TILES.into());
        square.clamp(1.0, most) as u32
    };
    [count(size.x, size.y), count(size.y, size.x)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reported_sizes() {
        assert_eq!(default_counts(700_000, DVec2::splat(1210.0), 0.7), [9, 9]);
        assert_eq!(default_counts(20_000, DVec2::splat(204.5), 0.7), [2, 2]);
        assert_eq!(default_counts(100_000, DVec2::new(225.0, 112.5), 0.7), [5, 3]);
    }

    #[test]
    fn few_bodies_or_little_space_make_few_tiles() {
        assert_eq!(default_counts(1, DVec2::new(1.0, 1.5), 0.7), [1, 1]);
        assert_eq!(default_counts(1_000_000, DVec2::new(28.0, 5.0), 0.7), [10, 1]);
    }

    #[test]
    fn ranks_and_threads_do_not_matter() {
        let text = "[scene]\nkind = \"rooms\"\nbodies = 50000\n";
        let counts = |overrides: &[(&str, &str)]| {
            let config = Config::from_toml_str("test", text, overrides).unwrap();
            tile_counts(&config, &Scene::new(&config.scene))
        };
        assert_eq!(counts(&[]), counts(&[("ranks", "7"), ("threads", "3")]));
        assert_eq!(counts(&[("tiles", "8x3")]), [8, 3]);
    }
}
