//! Files and folders that are there whole, whatever becomes of the machine, or not at all.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What this process has begun under other names and not finished.
static BEGUN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// More of them in a row lead nowhere.
const MOST_LINKS: usize = 40;

/// Writes a file whole and durably, or not at all: under another name first. Links to it stay.
///
/// # Errors
/// What the system says. What was begun is removed then.
pub(crate) fn write_durably(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    let path = &follow(path)?;
    let temporary = temporary(path);
    let begin = || {
        let mut begun = begun();
        begun.push(temporary.clone());
        File::create(&temporary)
    };
    let written = begin().and_then(|mut file| {
        write(&mut file)?;
        file.sync_all()
    });
    let mut begun = begun();
    let renamed = written.and_then(|()| fs::rename(&temporary, path));
    if renamed.is_err() {
        drop(fs::remove_file(&temporary));
    }
    begun.retain(|path| *path != temporary);
    drop(begun);
    renamed.and_then(|()| sync_folder_of(path))
}

fn begun() -> MutexGuard<'static, Vec<PathBuf>> {
    BEGUN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes what was begun and not finished, for whoever is about to end this process; from then on nothing is begun or finished.
pub(crate) fn give_up_begun() {
    let begun = begun();
    begun.iter().for_each(|path| drop(fs::remove_file(path)));
    // Never unlocked again.
    std::mem::forget(begun);
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
    sync_folder(folder_of(path))
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Where the links of a path end, whether anything is there or not. What this process has open, which is where `/dev/stdout`
/// leads, is an end.
///
/// # Errors
/// If a folder on the way is not there, or links lead in a circle.
pub(crate) fn follow(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        let name = path.file_name().ok_or_else(|| io::Error::other("it names no file"))?;
        let end = folder_of(&path).canonicalize()?.join(name);
        path = match fs::read_link(&end) {
            Ok(link) if !is_open(&end) => end.with_file_name(link),
            _ => return Ok(end),
        };
    }
    Err(io::Error::other("its links lead in a circle"))
}

/// Whether what [`follow`] came to is a stream: a device, a pipe, or what a process has open. Such are written to as they are.
pub(crate) fn is_stream(end: &Path) -> bool {
    is_open(end) || fs::metadata(end).is_ok_and(|data| !data.is_file())
}

fn is_open(end: &Path) -> bool {
    end.starts_with("/proc") || end.starts_with("/dev/fd")
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(unix)]
    fn links_stay_and_what_they_name_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("below")).unwrap();
        for (link, to) in [("link", "below/other"), ("below/other", "../file"), ("round", "round")] {
            std::os::unix::fs::symlink(to, at(link)).unwrap();
        }
        for text in ["one", "two"] {
            write_durably(&at("link"), |file| io::Write::write_all(file, text.as_bytes())).unwrap();
            assert_eq!(fs::read_to_string(at("file")).unwrap(), text);
        }
        assert!(at("link").is_symlink() && at("below/other").is_symlink() && !at("file").is_symlink());
        assert!(follow(&at("round")).unwrap_err().to_string().contains("in a circle"));
        assert_eq!(follow(&at("below/../link")).unwrap(), at("file").canonicalize().unwrap());
        let open = follow(Path::new("/dev/stdout")).unwrap();
        assert!(is_stream(&open) && is_stream(Path::new("/dev/null")) && !is_stream(&at("file")));
    }
}
