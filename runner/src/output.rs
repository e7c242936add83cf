//! What is written when all is done: to standard output, and to files, each whole or not at all.

use crate::error::RunError;
use std::ffi::{OsStr, OsString};
use std::fmt::Display;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Writes this to standard output. That a reader has seen enough, as in `atoll run ... | head`, is not a failure.
///
/// # Errors
/// If it cannot be written.
pub fn show(text: &dyn Display) -> Result<(), RunError> {
    match write!(io::stdout(), "{text}") {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(RunError::Output { path: PathBuf::from("standard output"), reason: error.to_string() })
        }
        _ => Ok(()),
    }
}

/// A path that is to be written to when the run is over.
#[derive(Debug)]
pub struct WholeFile {
    path: PathBuf,
}

impl WholeFile {
    /// Makes sure, before anything heavy starts, that the path can be written. Leaves nothing behind. `option` is what it
    /// was given with.
    ///
    /// # Errors
    /// If it cannot.
    pub fn check(option: &'static str, path: &Path) -> Result<Self, RunError> {
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
    pub fn check_two(options: [(&'static str, Option<&Path>); 2]) -> Result<[Option<Self>; 2], RunError> {
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
    pub fn unchecked(path: &Path) -> Self {
        Self { path: path.to_owned() }
    }

    /// Writes this and nothing else.
    ///
    /// # Errors
    /// If the path can no longer be written.
    pub fn write(&self, content: &[u8]) -> Result<(), RunError> {
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

/// Writes a file whole and durably, or not at all: under another name first.
///
/// # Errors
/// What the system says. What was begun is removed then.
pub fn write_durably(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    let temporary = temporary(path);
    let written = File::create(&temporary).and_then(|mut file| {
        write(&mut file)?;
        file.sync_all()
    });
    let renamed = written.and_then(|()| fs::rename(&temporary, path)).and_then(|()| sync_folder_of(path));
    renamed.inspect_err(|_| drop(fs::remove_file(&temporary)))
}

/// Makes a folder, and those above it that are not there, and makes all of them durable.
///
/// # Errors
/// What the system says.
pub fn create_folder_durably(path: &Path) -> io::Result<()> {
    let is_missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
    let missing: Vec<&Path> = path.ancestors().take_while(is_missing).collect();
    fs::create_dir_all(path)?;
    missing.into_iter().try_for_each(sync_folder_of)
}

/// Makes it durable that there is something of that name, where folders can be made durable.
///
/// # Errors
/// If the system says that it is not.
pub fn sync_folder_of(path: &Path) -> io::Result<()> {
    sync_folder(path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new(".")))
}

/// Makes the names in a folder durable, where folders can be made durable.
///
/// # Errors
/// If the system says that they are not.
pub fn sync_folder(folder: &Path) -> io::Result<()> {
    match File::open(folder).map(|folder| folder.sync_all()) {
        Ok(Err(error)) if error.kind() != io::ErrorKind::InvalidInput => Err(error),
        _ => Ok(()),
    }
}

/// Whether a file of that name is what somebody who was killed left who would have written `path`.
pub fn is_temporary(name: &OsStr, path: &Path) -> bool {
    let parts = name.to_str().zip(path.file_name().and_then(OsStr::to_str));
    parts.is_some_and(|(name, of)| name.starts_with(&format!(".{of}.")) && name.ends_with(".tmp"))
}

/// Beside the file, so that renaming never crosses file systems.
fn temporary(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}.tmp", std::process::id()));
    path.with_file_name(name)
}
