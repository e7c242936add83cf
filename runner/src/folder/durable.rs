//! Files and folders that are there whole, whatever becomes of the machine, or not at all.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// Writes a file whole and durably, or not at all: under another name first.
///
/// # Errors
/// What the system says. What was begun is removed then.
pub(crate) fn write_durably(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
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
pub(crate) fn create_folder_durably(path: &Path) -> io::Result<()> {
    let is_missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
    let missing: Vec<&Path> = path.ancestors().take_while(is_missing).collect();
    fs::create_dir_all(path)?;
    missing.into_iter().try_for_each(sync_folder_of)
}

/// Makes it durable that there is something of that name, where folders can be made durable.
///
/// # Errors
/// If the system says that it is not.
pub(crate) fn sync_folder_of(path: &Path) -> io::Result<()> {
    sync_folder(path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new(".")))
}

/// Makes the names in a folder durable, where folders can be made durable.
///
/// # Errors
/// If the system says that they are not.
pub(crate) fn sync_folder(folder: &Path) -> io::Result<()> {
    match File::open(folder).map(|folder| folder.sync_all()) {
        Ok(Err(error)) if error.kind() != io::ErrorKind::InvalidInput => Err(error),
        _ => Ok(()),
    }
}

/// Removes a file, if there is one.
///
/// # Errors
/// What the system says.
pub(crate) fn remove_if_there(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Whether a file that was there is not any more. Where the system does not say, it is.
pub(crate) fn is_gone(path: &Path) -> bool {
    fs::symlink_metadata(path).is_err_and(|error| error.kind() == io::ErrorKind::NotFound)
}

/// Whether a file of that name is what somebody who was killed left who would have written `path`.
pub(crate) fn is_temporary(name: &OsStr, path: &Path) -> bool {
    let parts = name.to_str().zip(path.file_name().and_then(OsStr::to_str));
    parts.is_some_and(|(name, of)| name.starts_with(&format!(".{of}.")) && name.ends_with(".tmp"))
}

/// Under which name a file is begun: beside it, so that renaming never crosses file systems.
pub(crate) fn temporary(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}.tmp", std::process::id()));
    path.with_file_name(name)
}
