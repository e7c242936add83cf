//! The default tile grid: a function of the scene and the physics alone, so that any number of ranks and threads
//! computes the same world.

use crate::config::{Config, MOST_TILES, Retile, Retiling};
use crate::error::RunError;
use crate::scene::Scene;
use atoll_core::{Adaptive, Census, Kind, Partition, SetupError, TileId, World};
use bytemuck::AnyBitPattern;
use glam::DVec2;
use rayon::prelude::*;

/// Bodies in a tile of the default grid, on the average. So many stay in a core's L2 cache for a whole step; half as many
/// cost a tenth more for their ghosts, and more leave fewer tiles to share among ranks.
const BODIES_PER_TILE: f64 = 8000.0;

/// A tile of the default grid is at least this many halo widths wide; below, most of a tile's work would be ghosts.
const HALOS_PER_TILE: f64 = 4.0;

/// A world of fewer tiles is not cut through its large bodies: that costs more than it is worth.
const TILES_THROUGH_LARGE: f64 = 4.0;

/// Tiles that follow the bodies are cut from squares of which each is so many tiles wide where bodies are spread evenly: then four
/// and sixteen of them can be joined where few are.
const CUT_IN: u32 = 4;

/// Columns and rows of tiles, or of the squares that adaptive ones are cut from: those given, else the default for the scene.
pub(crate) fn tile_counts(config: &Config, scene: &Scene) -> [u32; 2] {
    config.run.tiles.unwrap_or_else(|| {
        let (low, high) = scene.domain();
        let tiles = scene.bodies() as f64 / BODIES_PER_TILE;
        let large_radius = if tiles < TILES_THROUGH_LARGE { f32::INFINITY } else { config.params.large_radius };
        let halo_width = halo_width(&scene.kinds(), large_radius, config.params.margin_cap);
        match config.run.retiling.map(|retiling| retiling.how) {
            None => default_counts(tiles, high - low, halo_width),
            // Cut from these as often as is usual, evenly spread bodies with some contacts fill tiles by half.
            Some(Retile::Adaptive { max_bodies }) => {
                let tiles = scene.bodies() as f64 / (0.25 * max_bodies as f64);
                default_counts(tiles, high - low, halo_width).map(|count| ((count + CUT_IN / 2) / CUT_IN).max(1))
            }
            Some(Retile::Bisected) => [tiles.round().clamp(1.0, MOST_TILES.into()) as u32, 1],
        }
    })
}

/// By which rule tiles follow the bodies.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Rule {
    /// They are cut and joined.
    Adaptive(Adaptive),
    /// Their borders move, every so many steps.
    Bisected { halo_width: f64, every: u64 },
}

/// All ranks, as one of them speaks to them to find out how tiles follow the bodies.
pub(crate) trait Council {
    /// Why that may fail.
    type Error: From<Unfollowed>;

    /// Tells all ranks something, and gives what each of them told, or nothing if tiles are not to follow now.
    ///
    /// # Errors
    /// If a rank is lost.
    fn tell_all(&mut self, own: Vec<u8>) -> Result<Option<Vec<Vec<u8>>>, Self::Error>;

    /// Tells the holders of some tiles something, and gives what each rank told this one, one after the other.
    ///
    /// # Errors
    /// If a rank is lost.
    fn tell_holders(&mut self, own: Vec<(TileId, Vec<u32>)>) -> Result<Vec<Vec<u8>>, Self::Error>;

    /// Hears that this rank is done with what only concerns its own tiles, and all are about to do the same.
    fn has_counted(&mut self) {}
}

impl Rule {
    /// How tiles follow the bodies before the next step; nothing if all stay as they are. Every rank must ask for this at the same
    /// step.
    ///
    /// # Errors
    /// Those of the council, and if what was told cannot be read or does not go together.
    pub(crate) fn follow<C: Council>(&self, world: &World, council: &mut C) -> Result<Option<Partition>, C::Error> {
        let old = world.partition();
        match *self {
            Self::Adaptive(ref rule) => {
                let Some(told) = council.tell_all(bytemuck::cast_slice(&world.census(rule)).to_vec())? else {
                    return Ok(None);
                };
                let mut census: Vec<Census> = records(&told)?;
                census.sort_by_key(|part| part.tile);
                Ok(old.adapted(rule, &census).map_err(Unfollowed::Torn)?)
            }
            Self::Bisected { halo_width, every } => {
                let Some(told) = council.tell_all(bytemuck::cast_slice(&world.loads()).to_vec())? else {
                    return Ok(None);
                };
                let Some(mut bisecting) = old.bisect(&records(&told)?, halo_width).map_err(Unfollowed::Torn)? else {
                    return Ok(None);
                };
                // Until they are next looked at, bodies are there on the average.
                let mut tallies = world.tallies(every / 2);
                while !bisecting.is_done() {
                    if bisecting.is_clear() {
                        bisecting.cut(&[], &mut tallies).map_err(Unfollowed::Torn)?;
                        continue;
                    }
                    let counts = tallies.par_iter().flat_map(|tally| bisecting.counts(tally)).collect();
                    let counts: Vec<u32> = records(&council.tell_holders(counts)?)?;
                    let own = bisecting.decide(&counts).map_err(Unfollowed::Torn)?;
                    let Some(told) = council.tell_all(bytemuck::cast_slice(&own).to_vec())? else { return Ok(None) };
                    bisecting.cut(&records(&told)?, &mut tallies).map_err(Unfollowed::Torn)?;
                }
                drop(tallies);
                council.has_counted();
                Ok(bisecting.partition().map_err(Unfollowed::Torn)?)
            }
        }
    }
}

/// Why nobody knows how tiles follow the bodies.
#[derive(Debug)]
pub(crate) enum Unfollowed {
    /// What the rank of this number told cannot be read.
    Unreadable(usize),
    /// It does not go together.
    Torn(SetupError),
}

/// What ranks told, as records.
fn records<T: AnyBitPattern>(told: &[Vec<u8>]) -> Result<Vec<T>, Unfollowed> {
    let mut all = Vec::new();
    for (rank, told) in told.iter().enumerate() {
        let records = told.chunks_exact(size_of::<T>());
        if !records.remainder().is_empty() {
            return Err(Unfollowed::Unreadable(rank));
        }
        all.extend(records.map(bytemuck::pod_read_unaligned::<T>));
    }
    Ok(all)
}

/// By which rule tiles follow the bodies of such kinds, and every how many steps, if they do.
pub(crate) fn rule(config: &Config, kinds: &[Kind]) -> Option<(Rule, u64)> {
    let Retiling { how, every } = config.run.retiling?;
    let halo_width = atoll_core::halo_width(kinds, &config.params);
    let rule = match how {
        Retile::Adaptive { max_bodies } => Rule::Adaptive(Adaptive::new(max_bodies, halo_width)),
        Retile::Bisected => Rule::Bisected { halo_width, every },
    };
    Some((rule, every))
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
    let Some((rule, _)) = rule(config, &scene.kinds()) else {
        return Ok(Partition::uniform(low, high, columns, rows)?);
    };
    let mut failed = None;
    let places = scene.sample().map_while(|sample| match sample {
        Ok((bodies, place)) => Some((place, bodies)),
        Err(error) => {
            failed = Some(error);
            None
        }
    });
    let partition = match rule {
        Rule::Adaptive(rule) => Partition::adaptive(low, high, [columns, rows], &rule, places),
        Rule::Bisected { halo_width, .. } => Partition::bisected(low, high, columns * rows, halo_width, places),
    };
    match failed {
        Some(error) => Err(error.into()),
        None => Ok(partition?),
    }
}

/// How the domain is cut.
pub(crate) fn in_words([columns, rows]: [u32; 2], how: Option<Retile>) -> String {
    match how {
        None => format!("{columns} x {rows} tiles"),
        Some(Retile::Adaptive { max_bodies }) => {
            format!("tiles of {max_bodies} bodies at most, cut from {columns} x {rows} squares")
        }
        Some(Retile::Bisected) => format!("{} tiles with borders that follow the bodies", columns * rows),
    }
}

/// The width of the halo in meters that the default is made with, which no change may bend: without what
/// [`atoll_core::halo_width`] adds for rounding.
fn halo_width(kinds: &[Kind], large_radius: f32, margin_cap: f32) -> f64 {
    let radii = kinds.iter().map(|kind| kind.shape.bounding_radius()).filter(|&radius| radius <= large_radius);
    radii.map(f64::from).fold(0.0, f64::max) + f64::from(margin_cap)
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
