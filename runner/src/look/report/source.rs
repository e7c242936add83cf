//! What there is to tell of a run, read from its folder. Much of it may be missing: the run was killed, is under way, or was not
//! asked to write it.

use super::columns::Columns;
use crate::command::Script;
use crate::config::Config;
use crate::error::RunError;
use crate::folder::recording::{Recording, RecordingError};
use crate::folder::{Ended, Rows, RunFolder};
use serde_json::Value;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// One run.
#[derive(Debug)]
pub(super) struct Source {
    /// The folder, as the user gave it.
    pub name: String,
    pub folder: PathBuf,
    pub config: Config,
    /// The text of the configuration.
    pub text: String,
    /// The closing figures, once the run has ended.
    pub summary: Option<Value>,
    /// What is wrong with them, if they cannot be read.
    pub damaged: Option<String>,
    /// Figures over time.
    pub log: Option<Columns>,
    /// Time of each phase of each rank.
    pub timings: Option<Columns>,
    pub recording: Option<Recording>,
    /// How many lines there are of commands that were done or are to come, if there is such a file and it can be read.
    pub commands: Option<u64>,
    /// Bytes on disk: of the recording, of snapshots.
    pub size: [u64; 2],
}

impl Source {
    /// Reads all but the records themselves.
    ///
    /// # Errors
    /// If there is no run, or what is there cannot be read.
    pub(super) fn read(path: &Path) -> Result<Self, RunError> {
        let folder = RunFolder::new("report", path);
        let config = folder.begun()?;
        let refusal = |reason: String| folder.refusal(format!("{reason}; remove it, or bring back a good copy of it"));
        let unreadable =
            |name: &str, error: &dyn std::fmt::Display| RunError::from(refusal(format!("{name}: {error}")));
        Rows::find(&folder.log(), None, None).map_err(|error| refusal(error.to_string()))?;
        let text = fs::read_to_string(folder.configuration()).map_err(|error| unreadable("run.toml", &error))?;
        let table = |name: &str| match fs::read_to_string(path.join(name)) {
            Ok(text) => Columns::parse(&text).map(Some).map_err(|error| unreadable(name, &error)),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(error) => Err(unreadable(name, &error)),
        };
        let (summary, damaged) = match Ended::read(path) {
            Ok(None) => (None, None),
            Ok(Some(_)) => (fs::read(folder.summary()).ok().and_then(|text| serde_json::from_slice(&text).ok()), None),
            Err(error) => (None, Some(error.counts_as_missing())),
        };
        let recording = match Recording::open(path) {
            Ok(recording) => Some(recording),
            Err(RecordingError::Nothing { .. }) => None,
            Err(error) => return Err(error.into()),
        };
        let commands = Script::load_recorded(&folder.commands()).ok().map(|script| script.lines.len() as u64);
        let bytes = |files: &[PathBuf]| files.iter().map(|file| fs::metadata(file).map_or(0, |data| data.len())).sum();
        let recorded = recording.as_ref().map_or(0, |recording| bytes(recording.files()));
        let size = [recorded, size_within(&folder.snapshots()).unwrap_or(0)];
        Ok(Self {
            name: path.display().to_string(),
            folder: path.to_owned(),
            config,
            text,
            summary,
            damaged,
            log: table("log.csv")?,
            timings: table("timings.csv")?,
            recording,
            commands,
            size,
        })
    }

    /// A number of the summary.
    pub(super) fn number(&self, key: &str) -> Option<f64> {
        self.summary.as_ref()?.get(key)?.as_f64()
    }

    /// A text of the summary.
    pub(super) fn word(&self, key: &str) -> Option<&str> {
        self.summary.as_ref()?.get(key)?.as_str()
    }

    /// Columns and rows of tiles.
    pub(super) fn tiles(&self) -> [u32; 2] {
        self.config.run.tiles.unwrap_or_default()
    }

    /// Seconds of the simulated world after so many steps.
    pub(super) fn time(&self, step: f64) -> f64 {
        step * f64::from(self.config.params.dt)
    }

    /// Steps made, as far as anything tells.
    pub(super) fn steps(&self) -> Option<u64> {
        let logged = || self.log.as_ref()?.get("step")?.last().copied();
        let recorded = || self.recording.as_ref()?.steps().last().map(|step| *step as f64);
        self.number("steps").or_else(logged).or_else(recorded).map(|steps| steps as u64)
    }
}

/// Bytes of the files in a folder and the folders in it.
fn size_within(folder: &Path) -> io::Result<u64> {
    let mut all = 0;
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let data = entry.metadata()?;
        all += if data.is_dir() { size_within(&entry.path())? } else { data.len() };
    }
    Ok(all)
}
