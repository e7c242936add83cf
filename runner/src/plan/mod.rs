//! What every rank of a run must know alike, worked out once before any of them starts.

mod advice;
mod assignment;
mod commands;
mod holding;
mod memory;
mod threads;
pub(crate) mod tiles;

pub(crate) use assignment::Assignment;
pub(crate) use commands::Commands;
pub(crate) use holding::Holding;
pub(crate) use memory::{check_held, check_list};

use crate::config::{Config, OutputConfig, TransportKind};
use crate::error::RunError;
use crate::folder::recording::{OfRun, Recording, RunFacts, StageText};
use crate::folder::snapshot::{self, Found, Snapshot};
use crate::folder::{Claim, Ended, RunFolder};
use crate::scene::{Scene, SceneError, SceneFile};
use atoll_core::Blueprint;
use std::path::PathBuf;

/// A configuration, checked and resolved.
#[derive(Debug)]
pub struct Plan {
    /// The configuration itself.
    pub config: Config,
    /// The start.
    pub scene: Scene,
    /// Everything about the world but its bodies.
    pub blueprint: Blueprint,
    /// Columns and rows of tiles, or of the squares that adaptive ones are cut from.
    pub tiles: [u32; 2],
    /// Which rank holds which tiles.
    pub assignment: Assignment,
    /// Threads of each rank of this process.
    pub threads: usize,
    /// What carries the bytes.
    pub transport: TransportKind,
    /// What is written while it runs, if anything is.
    pub output: Option<Output>,
    /// Where figures over time are written to, beside the folder.
    pub log: Option<PathBuf>,
    /// What it is told to do while it runs.
    pub(crate) commands: Commands,
    /// Where it can go on from; nothing if it begins.
    pub found: Found,
}

/// What a run writes to its folder.
#[derive(Clone, Debug)]
pub struct Output {
    /// Where to.
    pub folder: RunFolder,
    /// The folder's configuration, every value resolved.
    pub configuration: String,
    /// How often.
    pub every: OutputConfig,
    /// Whether the run begins there, or goes on.
    pub begins: bool,
}

/// A configuration with what it takes from its scene, the scene, and its tiles.
fn open(config: &Config) -> Result<(Config, Scene, [u32; 2]), SceneError> {
    let (scene, mut config) = (Scene::open(&config.scene)?, config.clone());
    config.params.large_radius = scene.large_radius(config.params.margin_cap);
    let tiles = tiles::tile_counts(&config, &scene);
    Ok((config, scene, tiles))
}

impl Plan {
    /// Works it all out. Takes a look at every body where the tiles are to be shared among ranks. Nothing is written.
    ///
    /// # Errors
    /// If no world can be made of it.
    pub fn new(config: &Config) -> Result<Self, RunError> {
        Self::begin(config, None)
    }

    /// A run that begins in a folder and writes there.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn beginning(config: &Config, folder: RunFolder) -> Result<Self, RunError> {
        Self::begin(config, Some(folder))
    }

    fn begin(config: &Config, folder: Option<RunFolder>) -> Result<Self, RunError> {
        let (config, scene, tiles) = open(config)?;
        Self::from_found(config, scene, tiles, Found::default(), folder.map(|folder| (folder, true)))
    }

    /// A run that goes on in a folder, from the newest snapshot that is whole; from the start if none was complete when
    /// the run ended.
    ///
    /// # Errors
    /// As [`new`](Self::new), and if what the folder holds is another run, or cannot be gone on with.
    pub fn going_on(config: &Config, folder: RunFolder) -> Result<Self, RunError> {
        let (config, scene, tiles) = open(config)?;
        folder.check_same_run(&config, tiles)?;
        // One that cannot be read counts as missing, unless nothing else tells how far the run came.
        let (steps, ended) = (config.run.steps, Ended::read(folder.path()));
        let (ended, unreadable) = ended.map_or_else(|error| (None, Some(error)), |ended| (ended, None));
        if let Some(ended) = ended.as_ref().filter(|ended| !ended.interrupted && ended.steps == steps) {
            RunError::check_bodies(ended.bodies, ended.bodies_lost)?;
            let found = snapshot::find(&folder.snapshots(), &config.identity(tiles), tiles);
            // Of those that are damaged the next try tells.
            let goes_on = found.map_or(true, |found| !found.snapshots.is_empty());
            return Err(RunError::Complete { summary: folder.summary(), steps, goes_on });
        }
        // Before the first step there is nothing to go on from: it begins anew.
        let ended = ended.map(|ended| ended.steps).filter(|&steps| steps > 0);
        let mut found = snapshot::find(&folder.snapshots(), &config.identity(tiles), tiles)?;
        let newest = found.snapshots.first().map(Snapshot::step);
        if newest == Some(steps) {
            // So that there is a step to make, of which the summary tells. If the others are damaged, there is none.
            found.snapshots.rotate_left(1);
        }
        if let Some(made) = newest.max(ended).filter(|&made| made > steps) {
            let reason = format!("{made} steps are made there already, and {steps} asked for");
            return Err(folder.refusal(format!("{reason}; give --steps as many or more")).into());
        }
        if let (Some(error), None) = (unreadable, newest) {
            let reason = "there is no snapshot to go on from, so that without it the run begins anew";
            return Err(folder.refusal(format!("{error}; {reason}")).into());
        }
        if let (Some(made), None) = (ended, newest) {
            let reason = format!("{made} steps of this run are made, and there is no snapshot to go on from");
            return Err(folder.refusal(format!("{reason}; begin another run with --out")).into());
        }
        Self::from_found(config, scene, tiles, found, Some((folder, false)))
    }

    /// Makes the folder that of this run, if it has one. `held` is what [`RunFolder::hold`] gave before the plan was made.
    ///
    /// # Errors
    /// If it cannot be written to, or another run writes there.
    pub fn claim(&self, held: Option<Claim>) -> Result<Option<Claim>, RunError> {
        let Some(output) = &self.output else { return Ok(None) };
        let commands = output.begins.then(|| self.commands.record(0, 0));
        let begins = commands.as_deref().map(|commands| (commands, output.configuration.as_str()));
        Ok(Some(output.folder.claim(held, begins)?))
    }

    /// Everywhere figures over time are written to.
    pub(crate) fn logs(&self) -> Vec<PathBuf> {
        let folder = self.output.as_ref().map(|output| output.folder.log());
        folder.into_iter().chain(self.log.clone()).collect()
    }

    /// What the scene calls its kinds, where it does.
    pub(crate) fn kind_names(&self) -> &[Option<String>] {
        self.scene.file().map_or(&[], SceneFile::kind_names)
    }

    /// Whether all that was recorded before the snapshot from which the run goes on is there, and of this run, by what every
    /// file says about itself. For one process of a run to ask.
    ///
    /// # Errors
    /// If not: what is recorded from there on would be of no use.
    pub fn check_recording(&self) -> Result<(), RunError> {
        let newest = self.found.snapshots.iter().map(Snapshot::step).max();
        let Some((output, newest)) = self.output.as_ref().zip(newest) else { return Ok(()) };
        let Some(every) = output.every.record_every else { return Ok(()) };
        let facts = RunFacts::new(&self.config, self.scene.domain(), self.tiles, every);
        let stage = Some(StageText::named(&self.blueprint.kinds, self.kind_names(), &self.blueprint.statics));
        let run = OfRun { path: output.folder.configuration(), facts, stage };
        Recording::check_until(output.folder.path(), run, newest)
            .map_err(|error| output.folder.refusal(format!("{error}; or begin anew with --out and --overwrite")).into())
    }

    /// Where a run is about to be overwritten by a world in files, whether that is one: it is not to be lost to a fault in them.
    /// For one process of a run to ask.
    ///
    /// # Errors
    /// If not.
    pub fn check_overwriting(&self) -> Result<(), RunError> {
        let overwrites = self.output.as_ref().is_some_and(|output| output.begins && output.folder.was_run());
        Ok(self.scene.file().filter(|_| overwrites).map_or(Ok(()), SceneFile::check_bodies)?)
    }

    /// `folder` is written to, and says whether the run begins there.
    fn from_found(
        config: Config,
        scene: Scene,
        tiles: [u32; 2],
        found: Found,
        folder: Option<(RunFolder, bool)>,
    ) -> Result<Self, RunError> {
        let transport = config.transport();
        let first = tiles::first_partition(&config, &scene, tiles)?;
        let partition = match found.snapshots.first() {
            Some(snapshot) => snapshot.partition(&first)?,
            None => first,
        };
        let params = config.params.clone();
        let blueprint = Blueprint { params, partition, kinds: scene.kinds(), statics: scene.statics().to_vec() };
        blueprint.check()?;
        let threads = threads::of_each_rank(&config);
        memory::check(&blueprint, scene.bodies(), &config, threads, folder.is_some().then_some(&config.output))?;

        let ranks = config.run.ranks;
        let weights = match found.snapshots.first() {
            Some(snapshot) => snapshot.weights(),
            None => {
                let mut weights = vec![0; blueprint.partition.tiles()];
                if ranks > 1 {
                    for sample in scene.sample() {
                        let (bodies, place) = sample?;
                        weights[blueprint.partition.locate(place).0 as usize] += bodies;
                    }
                }
                weights
            }
        };
        let assignment = Assignment::balanced(&blueprint.partition, &weights, ranks);
        let output = folder.map(|(folder, begins)| Output {
            folder,
            configuration: config.to_toml(tiles),
            every: config.output,
            begins,
        });
        Ok(Self {
            config,
            scene,
            blueprint,
            tiles,
            assignment,
            threads,
            transport,
            output,
            log: None,
            commands: Commands::default(),
            found,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Exit;

    const ROOMS: &str = "[scene]\nkind = \"rooms\"\nbodies = 2000\n";

    fn plan(overrides: &[(&str, &str)]) -> Plan {
        Plan::new(&Config::from_toml_str("test", ROOMS, overrides).unwrap()).unwrap()
    }

    #[test]
    fn what_a_run_made_is_never_taken_for_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunFolder::new("--resume", folder.path());
        let config = |steps| Config::from_toml_str("test", ROOMS, &[("tiles", "2x2"), ("steps", steps)]).unwrap();
        std::fs::write(run.configuration(), config("60").to_toml([2, 2])).unwrap();
        let on = |steps, summary: &str| {
            std::fs::write(run.summary(), summary).unwrap();
            Plan::going_on(&config(steps), run.clone()).unwrap_err()
        };
        // It has left a snapshot, wherever that is now.
        let interrupted = r#"{"steps": 40, "interrupted": true}"#;
        let told = on("60", interrupted).to_string();
        assert!(told.contains("40 steps of this run are made, and there is no snapshot to go on from"), "{told}");
        let told = on("30", interrupted).to_string();
        assert!(told.contains("40 steps are made there already, and 30 asked for"), "{told}");
        let failed = on("60", r#"{"steps": 60, "interrupted": false, "bodies": 2000, "bodies_lost": 3}"#);
        assert_eq!(failed.exit(), Exit::Physics, "{failed}");
        assert!(failed.to_string().contains("1997 bodies at the end of a world of 2000"), "{failed}");
        let complete = on("60", r#"{"steps": 60, "interrupted": false, "bodies": 2000, "bodies_lost": 0}"#);
        assert_eq!(complete.exit(), Exit::Done, "{complete}");
        std::fs::remove_file(run.summary()).unwrap();
        Plan::going_on(&config("60"), run).unwrap();
    }

    #[test]
    fn the_hash_leaves_out_how_and_keeps_what() {
        let hash = |overrides: &[(&str, &str)]| {
            let plan = plan(overrides);
            plan.config.hash(plan.tiles)
        };
        let usual = hash(&[]);
        assert_eq!(usual.len(), 32);
        for how in [
            ("ranks", "3"),
            ("threads", "2"),
            ("transport", "channel"),
            ("peer_timeout", "5"),
            ("tiles", "1x1"),
            ("broad_phase", "quadtree"),
            ("islands", "dfs"),
            ("parallel", "coloring"),
        ] {
            assert_eq!(hash(&[how]), usual, "{how:?}");
        }
        for what in
            [("seed", "2"), ("steps", "9"), ("bodies", "2001"), ("tiles", "2x1"), ("power", "1.2"), ("hertz", "90")]
        {
            assert_ne!(hash(&[what]), usual, "{what:?}");
        }
    }
}
