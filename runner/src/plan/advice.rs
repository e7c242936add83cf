//! What a user may want to know of a plan before it is run.

use super::Plan;
use crate::config::{OutputConfig, TransportKind};
use crate::folder::Ended;
use std::thread;

impl Plan {
    /// What the user may want to know before it starts, a sentence each.
    pub fn notes(&self) -> Vec<String> {
        let mut notes: Vec<String> = self.found.unusable.iter().map(|error| error.to_string()).collect();
        let (idle, tiles) = (self.assignment.idle_ranks(), self.blueprint.grid.tiles());
        if idle > 0 {
            let ranks = self.assignment.ranks();
            let tiles = if tiles == 1 { "is only one tile".to_owned() } else { format!("are only {tiles} tiles") };
            notes.push(format!("{idle} of {ranks} ranks stay idle: there {tiles}; use fewer ranks or more tiles"));
        }
        let (threads, cores) =
            (self.config.run.threads, thread::available_parallelism().map_or(usize::MAX, usize::from));
        if self.transport == TransportKind::Mpi && threads > cores {
            // Launchers do this unless told otherwise.
            let cores = if cores == 1 { "one core".to_owned() } else { format!("{cores} cores") };
            notes.push(format!(
                "rank 0 is bound to {cores} and has {threads} threads: let the launcher give each rank as many cores, such \
                 as with `mpirun --map-by slot:PE={threads} --bind-to core`"
            ));
        }
        let halo = atoll_core::halo_width(&self.blueprint.kinds, &self.blueprint.params);
        let side = self.blueprint.grid.tile_size().min_element();
        if tiles > 1 && side < halo {
            notes.push(format!(
                "tiles are only {side:.3} m wide and the halo around each is {halo:.3} m: steps will be slow; use fewer tiles"
            ));
        }
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
        notes
    }
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
    }
}
