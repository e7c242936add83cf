//! What is written when all is done: to standard output, and to files, each whole or not at all.

use crate::error::RunError;
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

    /// As [`check`](Self::check), for two options, if given, which must not name one file.
    ///
    /// # Errors
    /// If a path cannot be written, or both are the same.
    pub(super) fn check_two(options: [(&'static str, Option<&Path>); 2]) -> Result<[Option<Self>; 2], RunError> {
        let [(first, path), (option, other)] = options;
        if let Some(path) = other.filter(|_| other == path) {
            let reason = format!("{first} writes to the same file");
            return Err(RunError::BadOutput { option, path: path.to_owned(), reason });
        }
        let check = |(option, path): (_, Option<&Path>)| path.map(|path| Self::check(option, path)).transpose();
        let [first, second] = options.map(check);
        Ok([first?, second?])
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
