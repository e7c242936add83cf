//! What the folder of a run keeps of what is done while it runs, and of what is to come; written by one rank.

use super::not_written;
use crate::error::RunError;
use crate::folder::RunFolder;
use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io::Write;

/// What is to be said where the folder of a run that goes on has `known` lines for steps that are made, and others were `done` then.
pub(super) fn disagreement(folder: &RunFolder, known: u64, done: u64) -> Option<String> {
    let what = match known.cmp(&done) {
        Ordering::Equal => return None,
        Ordering::Less => format!(
            "has {known} of the {done} lines that were done; what it said of later steps is lost with the others, unless you \
             bring back a good copy of it"
        ),
        Ordering::Greater => {
            format!("has {known} lines for steps that are made, of which {done} were done; the others never are")
        }
    };
    Some(format!("{} {what}", folder.commands().display()))
}

/// See the head of this file.
pub(super) struct Kept {
    folder: RunFolder,
    /// Lines before the first that was to come.
    before: usize,
    /// Opened when there is something to add.
    file: Option<File>,
}

impl Kept {
    pub(super) fn new(folder: RunFolder, before: usize) -> Self {
        Self { folder, before, file: None }
    }

    /// Adds a line that was done.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(super) fn add(&mut self, text: &str) -> Result<(), RunError> {
        let path = self.folder.commands();
        let file = match &mut self.file {
            Some(file) => Ok(file),
            none => OpenOptions::new().create(true).append(true).open(&path).map(|file| none.insert(file)),
        };
        let written = file.and_then(|file| file.write_all(format!("{text}\n").as_bytes()));
        written.map_err(|error| not_written(&path, &error))
    }

    /// Keeps those lines no longer that are at some places, counted from the first that was to come.
    ///
    /// # Errors
    /// If that cannot be written.
    pub(super) fn leave_out(&mut self, places: &BTreeSet<usize>) -> Result<(), RunError> {
        let stays = |place: usize| place.checked_sub(self.before).is_none_or(|place| !places.contains(&place));
        let written = fs::read_to_string(self.folder.commands()).and_then(|text| {
            let lines = text.split_inclusive('\n').enumerate().filter(|&(place, _)| stays(place));
            self.folder.write_commands(&lines.map(|(_, line)| line).collect::<String>())
        });
        // What was open is no longer there.
        self.file = None;
        written.map_err(|error| not_written(&self.folder.commands(), &error))
    }
}
