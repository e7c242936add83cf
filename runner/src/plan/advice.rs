//! What a user may want to know of a plan before it is run.

use super::Plan;
use crate::config::{OutputConfig, TransportKind};
use crate::folder::Ended;
use atoll_core::{Blueprint, Exchange, Ghosts, Kind, Shape, TileId};
use glam::Vec2;
use std::path::Path;
use std::thread;

/// From this restitution on, what exchange "step" gets wrong at borders is more than a bounce loses.
const BOUNCY: f32 = 0.9;
/// The same beside ghosts that nothing moves.
const BOUNCY_BESIDE_FROZEN: f32 = 0.3;
/// Longer steps, in s, are mentioned.
const LONG_STEP: f32 = 1.0;
/// Bodies whose masses are further apart are mentioned.
const MASS_RATIO: f32 = 1e4;

impl Plan {
    /// What the user may want to know before it starts, a sentence each.
    pub fn notes(&self) -> Vec<String> {
        let mut notes: Vec<String> = self.found.unusable.iter().map(|error| error.to_string()).collect();
        let (idle, tiles) = (self.assignment.idle_ranks(), self.blueprint.partition.tiles());
        if idle > 0 {
            let ranks = self.assignment.ranks();
            let tiles = if tiles == 1 { "is only one tile".to_owned() } else { format!("are only {tiles} tiles") };
            notes.push(format!("{idle} of {ranks} ranks stay idle: there {tiles}; use fewer ranks or more tiles"));
        }
        let (threads, cores) = (self.threads, thread::available_parallelism().map_or(usize::MAX, usize::from));
        if self.transport == TransportKind::Mpi && threads > cores {
            // Launchers do this unless told otherwise.
            let cores = if cores == 1 { "one core".to_owned() } else { format!("{cores} cores") };
            notes.push(format!(
                "rank 0 is bound to {cores} and has {threads} threads: let the launcher give each rank as many cores, such \
                 as with `mpirun --map-by slot:PE={threads} --bind-to core`"
            ));
        }
        let halo = atoll_core::halo_width(&self.blueprint.kinds, &self.blueprint.params);
        // Tiles that are cut by need are never so small.
        let side = self.blueprint.partition.rectangle(TileId(0)).size().min_element();
        if tiles > 1 && side < halo {
            notes.push(format!(
                "tiles are only {side:.3} m wide and the halo around each is {halo:.3} m: steps will be slow; use fewer tiles"
            ));
        }
        notes.extend(physical(&self.blueprint));
        let unlogged = OutputConfig { log_every: OutputConfig::default().log_every, ..self.config.output };
        if self.output.is_none() && unlogged != OutputConfig::default() {
            notes.push("[output] says what to write, and there is no --out: none of it is written".to_owned());
        }
        let goes_on = self.output.as_ref().filter(|output| !output.begins);
        let unreadable = goes_on.and_then(|output| Ended::read(output.folder.path()).err());
        notes.extend(unreadable.map(|error| error.counts_as_missing()));
        notes.extend(goes_on.map(|output| {
            let folder = output.folder.path().display();
            match self.found.snapshots.first() {
                Some(snapshot) => format!("going on with {folder} after step {}", snapshot.step()),
                None => format!("{folder} holds no complete snapshot yet: beginning anew"),
            }
        }));
        let partition = &self.blueprint.partition;
        let follow = partition.levels().is_some() || partition.cuts().is_some();
        if let Some((output, snapshot)) = goes_on.zip(self.found.snapshots.first()) {
            let tilings = follow.then(|| (output.folder.tilings(), "its tiles begin"));
            let answers = self.commands.answers.clone().filter(|path| path != Path::new("-"));
            let answers = answers.map(|path| (path, "its answers begin"));
            for (path, what) in [(output.folder.log(), "its rows begin")].into_iter().chain(tilings).chain(answers) {
                let is = match path.metadata() {
                    Err(_) => "is not there",
                    Ok(metadata) if metadata.is_file() && metadata.len() == 0 => "is empty",
                    Ok(_) => continue,
                };
                notes.push(format!("{} {is}: {what} after step {}", path.display(), snapshot.step()));
            }
        }
        notes
    }
}

/// What the solver cannot do well of what is asked.
fn physical(blueprint: &Blueprint) -> Vec<String> {
    let params = &blueprint.params;
    let kinds = || blueprint.kinds.iter().chain(blueprint.statics.iter().map(|fixed| &fixed.kind));
    let mut notes = Vec::new();
    if params.dt > LONG_STEP {
        notes.push(format!(
            "a step is {:.4} s, in which bodies may go far and meet many: physics.hertz is the number of steps in a \
             second; set it higher",
            params.dt
        ));
    }
    let restitution = kinds().map(|kind| kind.material.restitution).fold(0.0, f32::max);
    let is_frozen = params.ghosts == Ghosts::Frozen;
    let bouncy = if is_frozen { BOUNCY_BESIDE_FROZEN } else { BOUNCY };
    if restitution > bouncy && blueprint.partition.tiles() > 1 && params.exchange == Exchange::Step {
        let (by, mend) = if is_frozen {
            ("ghosts = \"frozen\"", "ghosts=dynamic and exchange=substep")
        } else {
            ("exchange = \"step\"", "exchange=substep")
        };
        notes.push(format!(
            "restitution is {restitution}, and with {by} bounces over borders of tiles may gain energy: set {mend}, or use one tile"
        ));
    }
    if is_frozen && params.gravity != Vec2::ZERO && blueprint.partition.tiles() > 1 {
        notes.push(
            "with ghosts = \"frozen\" tiles push each other's bodies without being pushed: what lies over their borders may be thrown up, all the \
             more where it is heavy or as large as a tile; set ghosts=dynamic, or use one tile"
                .to_owned(),
        );
    }
    let masses = || blueprint.kinds.iter().map(|kind| kind.material.density * kind.shape.area());
    let (lightest, heaviest) = (masses().fold(f32::INFINITY, f32::min), masses().fold(0.0, f32::max));
    if heaviest > MASS_RATIO * lightest {
        notes.push(format!(
            "the heaviest body has {:.0} times the mass of the lightest: what lies under much heavier bodies is thrown about; keep \
             within {MASS_RATIO} times",
            heaviest / lightest
        ));
    }
    let width = |kind: &Kind| kind.shape.width();
    let narrowest =
        kinds().filter(|kind| !matches!(kind.shape, Shape::Segment(_))).map(width).fold(f32::INFINITY, f32::min);
    if narrowest < params.speculative_distance {
        notes.push(format!(
            "the narrowest body is {narrowest} m wide, and contacts are made from {} m on: scale lengths up, or \
             speculative_distance, recycle_distance, linear_slop and margins down",
            params.speculative_distance
        ));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;

    fn plan(overrides: &[(&str, &str)]) -> Plan {
        let text = "[scene]\nkind = \"rooms\"\nbodies = 2000\n";
        Plan::new(&Config::from_toml_str("test", text, overrides).unwrap()).unwrap()
    }

    #[test]
    fn idle_ranks_and_narrow_tiles_are_mentioned() {
        assert!(plan(&[]).notes().is_empty());
        let notes = plan(&[("ranks", "7"), ("tiles", "2x2")]).notes();
        assert_eq!(notes, ["3 of 7 ranks stay idle: there are only 4 tiles; use fewer ranks or more tiles"]);
        let notes = plan(&[("tiles", "200x200")]).notes();
        assert!(notes.len() == 1 && notes[0].starts_with("tiles are only 0.323 m wide"), "{notes:?}");
        let bouncing = |restitution: f32, overrides: &[(&str, &str)]| {
            let mut plan = plan(overrides);
            plan.blueprint.kinds[1].material.restitution = restitution;
            plan.notes()
        };
        let notes = bouncing(1.0, &[("tiles", "2x2")]);
        assert!(notes.len() == 1 && notes[0].starts_with("restitution is 1, and with exchange"), "{notes:?}");
        for quiet in [bouncing(0.8, &[("tiles", "2x2")]), bouncing(1.0, &[("exchange", "substep"), ("tiles", "2x2")])] {
            assert!(quiet.is_empty(), "{quiet:?}");
        }
        assert!(bouncing(1.0, &[("tiles", "1x1")]).is_empty());
        let notes = bouncing(0.5, &[("ghosts", "frozen"), ("tiles", "2x2")]);
        assert!(notes.len() == 1 && notes[0].starts_with("restitution is 0.5, and with ghosts"), "{notes:?}");
        let notes = plan(&[("ghosts", "frozen"), ("tiles", "2x2"), ("gravity", "[0, -10]")]).notes();
        assert!(notes.len() == 1 && notes[0].starts_with("with ghosts = \"frozen\" tiles push"), "{notes:?}");
        let mut heavy = plan(&[]);
        heavy.blueprint.kinds[1].material.density *= 1e6;
        let notes = heavy.notes();
        assert!(notes.len() == 1 && notes[0].starts_with("the heaviest body has "), "{notes:?}");
        let notes = plan(&[("hertz", "0.016")]).notes();
        assert!(notes.len() == 1 && notes[0].starts_with("a step is 62.5000 s, in which"), "{notes:?}");
        let notes = plan(&[("speculative_distance", "0.5")]).notes();
        assert!(notes.len() == 1 && notes[0].starts_with("the narrowest body is 0.2 m wide"), "{notes:?}");
    }
}
