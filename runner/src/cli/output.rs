//! What is written when all is done: to standard output, and to files, each whole or not at all.

use crate::config::Config;
use crate::error::RunError;
use crate::folder::RunFolder;
use crate::folder::durable::{follow, is_stream, temporary, write_durably};
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
        let given: Vec<_> = options.into_iter().filter_map(|(option, path)| Some((option, path?))).collect();
        let scenes = if given.is_empty() { Vec::new() } else { self.scenes() };
        for (option, path) in given {
            if let Some(what) = self.at(path, &scenes) {
                return Err(RunError::TakenOutput { option, path: path.to_owned(), what });
            }
        }
        Ok(())
    }

    /// Where the files of scenes are, also of those of runs that are there.
    fn scenes(&self) -> Vec<PathBuf> {
        let begun =
            self.runs.iter().filter_map(|run| Config::load_begun(&RunFolder::new("", run).configuration()).ok());
        let of_runs = begun.flat_map(|config| config.scene_files());
        self.scene.iter().cloned().chain(of_runs).filter_map(|file| file.canonicalize().ok()).collect()
    }

    /// What is to be kept at a path, if anything is. Where the path's folder is not there, nothing is.
    fn at(&self, path: &Path, scenes: &[PathBuf]) -> Option<String> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        // The name itself, and what it leads to.
        let named = folder.canonicalize().ok().zip(path.file_name()).map(|(folder, name)| folder.join(name));
        let places: Vec<PathBuf> = named.into_iter().chain(follow(path)).collect();
        let configuration = self.configuration.and_then(|file| file.canonicalize().ok());
        if configuration.is_some_and(|file| places.contains(&file)) {
            return Some("the configuration of this run".to_owned());
        }
        if self.commands.and_then(|file| file.canonicalize().ok()).is_some_and(|file| places.contains(&file)) {
            return Some("the file of this run's commands".to_owned());
        }
        if places.iter().any(|place| scenes.contains(place)) {
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
        let named = options.map(|(_, path)| path.map(|path| path.canonicalize().or_else(|_| follow(path))));
        for (i, (option, path)) in options.iter().enumerate() {
            let is_same = |other: &usize| matches!((&named[*other], &named[i]), (Some(Ok(a)), Some(Ok(b))) if a == b);
            if let (Some(first), Some(path)) = ((0..i).find(is_same), path) {
                let reason = format!("{} writes to the same file", options[first].0);
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
        let write = || match follow(&self.path)? {
            end if is_stream(&end) => write_to_stream(&end, content),
            end => write_durably(&end, |file| file.write_all(content)),
        };
        write().map_err(|error| RunError::Output { path: self.path.clone(), reason: error.to_string() })
    }

    fn probe(&self) -> io::Result<()> {
        if self.path == Path::new("-") {
            return Err(io::Error::other("for standard output name /dev/stdout, and ./- for a file of that name"));
        }
        if self.path.is_dir() {
            return Err(io::Error::other("it is a directory"));
        }
        let end = follow(&self.path)?;
        if is_stream(&end) {
            // Whoever reads a pipe would take it for the end that it is opened and closed.
            return fs::metadata(end).map(drop);
        }
        if end.exists() {
            File::options().append(true).open(&end)?;
        }
        let temporary = temporary(&end);
        File::create(&temporary)?;
        fs::remove_file(temporary)
    }
}

/// Writes to what is never replaced.
fn write_to_stream(end: &Path, content: &[u8]) -> io::Result<()> {
    let leads_to = |name: &str| follow(Path::new(name)).is_ok_and(|standard| standard == end);
    // Opened again, a file would be written over by what else this process says there.
    if leads_to("/dev/stdout") {
        let mut stdout = io::stdout().lock();
        return stdout.write_all(content).and_then(|()| stdout.flush());
    }
    if leads_to("/dev/stderr") {
        return io::stderr().write_all(content);
    }
    File::options().append(true).open(end)?.write_all(content)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn whoever_reads_a_pipe_gets_all_that_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let (pipe, link) = (folder.path().join("pipe"), folder.path().join("link"));
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo starts").success());
        std::os::unix::fs::symlink("pipe", &link).unwrap();
        let reader = std::thread::spawn(move || fs::read_to_string(pipe).unwrap());
        let file = WholeFile::check("--json", &link).unwrap();
        file.write(b"all of it").unwrap();
        assert_eq!(reader.join().unwrap(), "all of it");
    }
}
