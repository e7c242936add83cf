//! The folder that files are written to.

use crate::error::RunError;
use crate::folder::FolderError;
use crate::folder::durable::write_durably;
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// A folder of nothing but what is written here. Dropped before it is finished, it removes all of that.
pub(super) struct Target {
    folder: PathBuf,
    /// Whether it was not there before.
    made: bool,
    /// Files and folders, in the order in which they were made.
    written: Vec<PathBuf>,
    bytes: u64,
    finished: bool,
}

impl Target {
    /// Makes the folder, if it is not there.
    ///
    /// # Errors
    /// If there is something in it, or it cannot be had.
    pub(super) fn new(folder: &Path) -> Result<Self, RunError> {
        let refuse = |reason| FolderError::Unusable { option: "--vtk", path: folder.to_owned(), reason };
        let made = match fs::read_dir(folder).map(|mut entries| entries.next().is_none()) {
            Ok(true) => false,
            Ok(false) => return Err(refuse("it is not empty; name a new folder".to_owned()).into()),
            Err(error) if error.kind() == ErrorKind::NotFound => true,
            Err(error) => return Err(refuse(format!("{error}; name a new folder")).into()),
        };
        fs::create_dir_all(folder).map_err(|error| FolderError::not_writable("--vtk", folder, &error))?;
        Ok(Self { folder: folder.to_owned(), made, written: Vec::new(), bytes: 0, finished: false })
    }

    /// Makes a folder in it.
    ///
    /// # Errors
    /// What the system says.
    pub(super) fn folder(&mut self, name: &str) -> Result<(), RunError> {
        let path = self.folder.join(name);
        fs::create_dir(&path).map_err(|error| failed(&path, &error))?;
        self.written.push(path);
        Ok(())
    }

    /// Writes a file, whole or not at all.
    ///
    /// # Errors
    /// What the system says.
    pub(super) fn write(
        &mut self,
        name: &str,
        write: impl FnOnce(&mut File) -> io::Result<()>,
    ) -> Result<(), RunError> {
        let path = self.folder.join(name);
        write_durably(&path, write).map_err(|error| failed(&path, &error))?;
        self.bytes += fs::metadata(&path).map_or(0, |data| data.len());
        self.written.push(path);
        Ok(())
    }

    /// Keeps what was written, and says how many bytes that is.
    pub(super) fn finish(mut self) -> u64 {
        self.finished = true;
        self.bytes
    }
}

impl Drop for Target {
    fn drop(&mut self) {
        if self.finished {
            return;
        }
        // What somebody else has put there meanwhile stays.
        for path in self.written.iter().rev() {
            let _ = fs::remove_file(path).or_else(|_| fs::remove_dir(path));
        }
        if self.made {
            let _ = fs::remove_dir(&self.folder);
        }
    }
}

fn failed(path: &Path, error: &io::Error) -> RunError {
    RunError::Output { path: path.to_owned(), reason: error.to_string() }
}
