//! The default tile grid: a function of the scene and the physics alone, so that any number of ranks and threads
//! computes the same world.

use crate::config::{Config, MOST_TILES};
use crate::error::RunError;
use crate::scene::Scene;
use atoll_core::{Adaptive, Kind, Params, Partition};
use glam::DVec2;

/// Bodies in a tile of the default grid, on the average. So many stay in a core's L2 cache for a whole step; half as many
/// cost a tenth more for their ghosts, and more leave fewer tiles to share among ranks.
const BODIES_PER_TILE: f64 = 8000.0;

/// A tile of the default grid is at least this many halo widths wide; below, most of a tile's work would be ghosts.
const HALOS_PER_TILE: f64 = 4.0;

/// Tiles that follow the bodies are cut from squares of which each is so many tiles wide where bodies are spread evenly: then four
/// and sixteen of them can be joined where few are.
const CUT_IN: u32 = 4;

/// Columns and rows of tiles, or of the squares that adaptive ones are cut from: those given, else the default for the scene.
pub(crate) fn tile_counts(config: &Config, scene: &Scene) -> [u32; 2] {
    config.run.tiles.unwrap_or_else(|| {
        if config.params.sleep {
            return [1, 1]; // islands sleep within one tile only
        }
        let (low, high) = scene.domain();
        let halo_width = halo_width(&scene.kinds(), &config.params);
        match config.run.adaptive {
            None => default_counts(scene.bodies() as f64 / BODIES_PER_TILE, high - low, halo_width),
            // Cut from these as often as is usual, evenly spread bodies with some contacts fill tiles by half.
            Some(adaptive) => {
                let tiles = scene.bodies() as f64 / (0.25 * adaptive.max_bodies as f64);
                default_counts(tiles, high - low, halo_width).map(|count| ((count + CUT_IN / 2) / CUT_IN).max(1))
            }
        }
    })
}

/// By which rule tiles follow the bodies of such kinds, if they do.
pub(crate) fn rule(config: &Config, kinds: &[Kind]) -> Option<Adaptive> {
    let halo_width = atoll_core::halo_width(kinds, &config.params);
    config.run.adaptive.map(|adaptive| Adaptive::new(adaptive.max_bodies, halo_width))
}

/// The tiles that a run begins with. Where they follow the bodies, these are counted by a sample: what that misses is put right
/// before the first step.
///
/// # Errors
/// If there are no such tiles.
pub(crate) fn first_partition(
    config: &Config,
    scene: &Scene,
    [columns, rows]: [u32; 2],
) -> Result<Partition, RunError> {
    let (low, high) = scene.domain();
    let Some(rule) = rule(config, &scene.kinds()) else { return Ok(Partition::uniform(low, high, columns, rows)?) };
    let mut failed = None;
    let places = scene.sample().map_while(|sample| match sample {
        Ok((bodies, place)) => Some((place, bodies)),
        Err(error) => {
            failed = Some(error);
            None
        }
    });
    let partition = Partition::adaptive(low, high, [columns, rows], &rule, places);
    match failed {
        Some(error) => Err(error.into()),
        None => Ok(partition?),
    }
}

/// How the domain is cut.
pub(crate) fn in_words([columns, rows]: [u32; 2], max_bodies: Option<u64>) -> String {
    match max_bodies {
        None => format!("{columns} x {rows} tiles"),
        Some(most) => format!("tiles of {most} bodies at most, cut from {columns} x {rows} squares"),
    }
}

/// The width of the halo in meters that the default is made with, which no change may bend: without what
/// [`atoll_core::halo_width`] adds for rounding.
fn halo_width(kinds: &[Kind], params: &Params) -> f64 {
    let radii = kinds.iter().map(|kind| f64::from(kind.shape.bounding_radius()));
    radii.fold(0.0, f64::max) + f64::from(params.margin_cap)
}

/// About so many tiles.
fn default_counts(tiles: f64, size: DVec2, halo_width: f64) -> [u32; 2] {
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
        assert_eq!(default_counts(87.5, DVec2::splat(1210.0), 0.7), [9, 9]);
        assert_eq!(default_counts(2.5, DVec2::splat(204.5), 0.7), [2, 2]);
        assert_eq!(default_counts(12.5, DVec2::new(225.0, 112.5), 0.7), [5, 3]);
    }

    #[test]
    fn few_bodies_or_little_space_make_few_tiles() {
        assert_eq!(default_counts(1e-4, DVec2::new(1.0, 1.5), 0.7), [1, 1]);
        assert_eq!(default_counts(125.0, DVec2::new(28.0, 5.0), 0.7), [10, 1]);
    }

    #[test]
    fn ranks_and_threads_do_not_matter() {
        let text = "[scene]\nkind = \"rooms\"\nbodies = 50000\n";
        let counts = |overrides: &[(&str, &str)]| {
            let config = Config::from_toml_str("test", text, overrides).unwrap();
            tile_counts(&config, &Scene::open(&config.scene).unwrap())
        };
        assert_eq!(counts(&[]), counts(&[("ranks", "7"), ("threads", "3")]));
        assert_eq!(counts(&[("tiles", "8x3")]), [8, 3]);
    }
}
