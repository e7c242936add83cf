//! What is written when all is done: to standard output, and to files, each whole or not at all.

use crate::error::RunError;
use crate::folder::RunFolder;
use crate::folder::durable::{temporary, write_durably};
use std::fmt::Display;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Writes this to standard output. That a reader has seen enough, as in `atoll run ... | head`, is not a failure.
///
/// # Errors
/// If it cannot be written.
pub(super) fn show(text: &dyn Display) -> Result<(), RunError> {
    match write!(io::stdout(), "{text}") {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(RunError::Output { path: PathBuf::from("standard output"), reason: error.to_string() })
        }
        _ => Ok(()),
    }
}

/// What must not be written over by what is written when all is done.
#[derive(Default, Debug)]
pub(super) struct Kept<'a> {
    /// Folders that are, or are to be, those of runs, whatever is there now.
    pub runs: Vec<&'a Path>,
    /// The file that says what to run.
    pub configuration: Option<&'a Path>,
    /// The files of its scene, if it has some.
    pub scene: Vec<PathBuf>,
    /// The file of its commands, if it has one.
    pub commands: Option<&'a Path>,
}

impl Kept<'_> {
    /// Refuses paths at which there is, or will be, what is to be kept; of that, too, what any run has left anywhere.
    /// Nothing is written or created.
    ///
    /// # Errors
    /// Naming the first such path, and what is there.
    pub(super) fn check<'a>(
        &self,
        options: impl IntoIterator<Item = (&'static str, Option<&'a Path>)>,
    ) -> Result<(), RunError> {
        for (option, path) in options {
            if let Some((path, what)) = path.and_then(|path| Some((path, self.at(path)?))) {
                return Err(RunError::TakenOutput { option, path: path.to_owned(), what });
            }
        }
        Ok(())
    }

    /// What is to be kept at a path, if anything is. Where the path's folder is not there, nothing is.
    fn at(&self, path: &Path) -> Option<String> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        // The name itself, and what it leads to.
        let named = folder.canonicalize().ok().zip(path.file_name()).map(|(folder, name)| folder.join(name));
        let places: Vec<PathBuf> = named.into_iter().chain(path.canonicalize()).collect();
        let configuration = self.configuration.and_then(|file| file.canonicalize().ok());
        if configuration.is_some_and(|file| places.contains(&file)) {
            return Some("the configuration of this run".to_owned());
        }
        if self.commands.and_then(|file| file.canonicalize().ok()).is_some_and(|file| places.contains(&file)) {
            return Some("the file of this run's commands".to_owned());
        }
        let scene: Vec<PathBuf> = self.scene.iter().filter_map(|file| file.canonicalize().ok()).collect();
        if places.iter().any(|place| scene.contains(place)) {
            return Some("a file of the scene of this run".to_owned());
        }
        let runs: Vec<PathBuf> = self.runs.iter().filter_map(|run| run.canonicalize().ok()).collect();
        let is_run = |folder: &RunFolder| runs.iter().any(|run| run == folder.path()) || folder.holds_run();
        let keeps = |folder: &Path, place: &Path| {
            let name = place.strip_prefix(folder).ok().and_then(|within| within.iter().next());
            let folder = RunFolder::new("", folder);
            name.is_some_and(|name| folder.owns(name)) && is_run(&folder)
        };
        let owner = |place: &PathBuf| place.ancestors().find(|folder| keeps(folder, place)).map(Path::to_owned);
        places.iter().find_map(owner).map(|run| format!("a file of the run in {}", run.display()))
    }
}

/// A path that is to be written to when the run is over.
#[derive(Debug)]
pub(super) struct WholeFile {
    path: PathBuf,
}

impl WholeFile {
    /// Makes sure, before anything heavy starts, that the path can be written. Leaves nothing behind. `option` is what it
    /// was given with.
    ///
    /// # Errors
    /// If it cannot.
    pub(super) fn check(option: &'static str, path: &Path) -> Result<Self, RunError> {
        let file = Self { path: path.to_owned() };
        match file.probe() {
            Ok(()) => Ok(file),
            Err(error) => Err(RunError::BadOutput { option, path: path.to_owned(), reason: error.to_string() }),
        }
    }

    /// As [`check`](Self::check), for some options, if given, which must name files of their own.
    ///
    /// # Errors
    /// If a path cannot be written, or two are the same.
    pub(super) fn check_all<const N: usize>(
        options: [(&'static str, Option<&Path>); N],
    ) -> Result<[Option<Self>; N], RunError> {
        for (i, (option, path)) in options.iter().enumerate() {
            let before = options[..i].iter().find(|(_, other)| path.is_some() && other == path);
            if let (Some((first, _)), Some(path)) = (before, path) {
                let reason = format!("{first} writes to the same file");
                return Err(RunError::BadOutput { option, path: path.to_path_buf(), reason });
            }
        }
        let mut files = [const { None }; N];
        for (file, (option, path)) in files.iter_mut().zip(options) {
            *file = path.map(|path| Self::check(option, path)).transpose()?;
        }
        Ok(files)
    }

    /// A path that is sure to be writable when it is needed, or else to fail then.
    pub(super) fn unchecked(path: &Path) -> Self {
        Self { path: path.to_owned() }
    }

    /// Writes this and nothing else.
    ///
    /// # Errors
    /// If the path can no longer be written.
    pub(super) fn write(&self, content: &[u8]) -> Result<(), RunError> {
        let write = || {
            if self.is_special() {
                return File::create(&self.path)?.write_all(content);
            }
            write_durably(&self.path, |file| file.write_all(content))
        };
        write().map_err(|error| RunError::Output { path: self.path.clone(), reason: error.to_string() })
    }

    fn probe(&self) -> io::Result<()> {
        if self.path.is_dir() {
            return Err(io::Error::other("it is a directory"));
        }
        if self.path.file_name().is_none() {
            return Err(io::Error::other("it names no file"));
        }
        if self.path.exists() {
            File::options().append(true).open(&self.path)?;
        }
        if !self.is_special() {
            let temporary = temporary(&self.path);
            File::create(&temporary)?;
            fs::remove_file(temporary)?;
        }
        Ok(())
    }

    /// A device or a pipe: written to as it is, never replaced.
    fn is_special(&self) -> bool {
        fs::metadata(&self.path).is_ok_and(|data| !data.is_file())
    }
}
