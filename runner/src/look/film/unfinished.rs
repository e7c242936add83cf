//! What is being written under another name.

use crate::folder::durable::{follow, is_stream, sync_folder_of, temporary};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// A file or folder that is not complete: removed, unless it gets its name.
#[derive(Debug)]
pub(super) struct Unfinished {
    path: PathBuf,
    temporary: PathBuf,
    is_complete: bool,
}

impl Unfinished {
    /// An empty file, to become that of the given name.
    ///
    /// # Errors
    /// If there is a folder of that name, or what the system says.
    pub(super) fn file(path: &Path) -> io::Result<(Self, File)> {
        if path.is_dir() {
            return Err(io::Error::other("it is a directory"));
        }
        if follow(path).is_ok_and(|end| is_stream(&end)) {
            return Err(io::Error::other("it is a device or a pipe, and no file"));
        }
        let unfinished = Self::new(path)?;
        let file = File::create(&unfinished.temporary)?;
        Ok((unfinished, file))
    }

    /// An empty folder, to become that of the given name, at which there is nothing, or an empty folder.
    ///
    /// # Errors
    /// If there is anything else, or what the system says.
    pub(super) fn folder(path: &Path) -> io::Result<Self> {
        match fs::read_dir(path).map(|entries| entries.take(1).count()) {
            Ok(1..) => return Err(io::Error::other("it is a folder that is not empty")),
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let unfinished = Self::new(path)?;
        fs::create_dir(&unfinished.temporary)?;
        Ok(unfinished)
    }

    fn new(path: &Path) -> io::Result<Self> {
        let path = follow(path)?;
        Ok(Self { temporary: temporary(&path), path, is_complete: false })
    }

    /// Where it is until it is complete.
    pub(super) fn at(&self) -> &Path {
        &self.temporary
    }

    /// Gives it its name. It must be durable already.
    ///
    /// # Errors
    /// What the system says.
    pub(super) fn complete(mut self) -> io::Result<()> {
        if self.temporary.is_dir() && self.path.exists() {
            fs::remove_dir(&self.path)?;
        }
        fs::rename(&self.temporary, &self.path)?;
        self.is_complete = true;
        sync_folder_of(&self.path)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if !self.is_complete {
            remove(&self.temporary);
        }
    }
}

/// Removes what this process has begun to write that was to become a path, if anything.
pub(crate) fn remove_unfinished(path: &Path) {
    if let Ok(path) = follow(path) {
        remove(&temporary(&path));
    }
}

fn remove(temporary: &Path) {
    let _ = match temporary.is_dir() {
        true => fs::remove_dir_all(temporary),
        false => fs::remove_file(temporary),
    };
}

/// That a film was finished before it had begun.
pub(super) fn nothing_added() -> io::Error {
    io::Error::other("there is no picture to write")
}
