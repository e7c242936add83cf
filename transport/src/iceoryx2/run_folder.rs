//! The folder of one run, and what dead runs have left.
//!
//! All runs of a user have folders in one common folder, which nobody else may enter: `/dev/shm/atoll-<user>`, beside the
//! shared memory that they have, so that no run misses what another one left. Every process of a run holds a shared lock
//! on a file in that run's folder: where the lock can be had alone, all of them are gone. Runs are made and dead ones
//! removed under a lock on the common folder, so a run that is just starting is not mistaken for a dead one. Whoever
//! removes the last run removes the common folder as well.

use std::fs::{self, DirBuilder, File, OpenOptions, TryLockError};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rustix::process::geteuid;

use super::limits::SHARED_MEMORY;

/// The name of every lock file.
const LOCK: &str = "lock";

/// How long the lock on the common folder is waited for. It is held for some milliseconds.
const LOCK_TIMEOUT: Duration = Duration::from_secs(20);

/// Between two tries to get it.
const LOCK_POLL: Duration = Duration::from_millis(5);

/// The folder of one run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct RunFolder {
    path: PathBuf,
    /// Begins every name that the run has in shared memory.
    prefix: String,
}

impl RunFolder {
    /// The folder at `path`, as named by a launcher.
    pub(super) fn at(path: PathBuf) -> RunFolder {
        let run = path.file_name().unwrap_or_default().to_string_lossy();
        // The trailing mark keeps one run's prefix from being the beginning of another's.
        let prefix = format!("atoll-{}-{run}-", geteuid().as_raw());
        RunFolder { path, prefix }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn prefix(&self) -> &str {
        &self.prefix
    }

    /// Where iceoryx2 has its files.
    pub(super) fn node_files(&self) -> PathBuf {
        self.path.join("iceoryx2")
    }

    /// Where the board of the run is.
    pub(super) fn board(&self) -> PathBuf {
        Path::new(SHARED_MEMORY).join(format!("{}board", self.prefix))
    }

    /// Joins the processes that keep the run alive, as long as the returned file is open.
    pub(super) fn lock(&self) -> io::Result<File> {
        let file = File::open(self.path.join(LOCK))?;
        file.lock_shared()?;
        Ok(file)
    }

    /// Removes what is left of the run. Whatever is already gone is fine; everything else is tried before the first
    /// failure is told.
    pub(super) fn remove(&self) -> io::Result<()> {
        let mut result = Ok(());
        for entry in fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten() {
            if entry.file_name().to_string_lossy().starts_with(&self.prefix) {
                result = result.and(unless_absent(fs::remove_file(entry.path())));
            }
        }
        result.and(unless_absent(fs::remove_dir_all(&self.path)))
    }
}

/// The folder of a run that this process has started. Removed on drop.
#[derive(Debug)]
pub(super) struct OwnedRunFolder {
    folder: RunFolder,
    _lock: File,
}

impl OwnedRunFolder {
    /// Removes what dead runs have left in `common` and makes the folder of a new one.
    pub(super) fn create(common: &Path) -> io::Result<OwnedRunFolder> {
        let _alone = enter(common)?;
        remove_dead_runs(common);
        let folder = RunFolder::at(new_folder(common)?);
        File::create_new(folder.path.join(LOCK))?;
        let lock = folder.lock()?;
        Ok(OwnedRunFolder { folder, _lock: lock })
    }

    pub(super) fn folder(&self) -> &RunFolder {
        &self.folder
    }
}

impl Drop for OwnedRunFolder {
    fn drop(&mut self) {
        // What resists is tried again by the next launch.
        let _ = self.folder.remove();
        if let Some(common) = self.folder.path.parent() {
            remove_if_empty(common);
        }
    }
}

/// Removes the common folder if it holds no run.
fn remove_if_empty(common: &Path) {
    let Ok(_alone) = enter(common) else { return };
    let is_run = |entry: io::Result<fs::DirEntry>| entry.is_ok_and(|entry| entry.file_name() != LOCK);
    if fs::read_dir(common).is_ok_and(|mut entries| !entries.any(is_run)) {
        // Whoever waits for the lock that goes with it finds that out, and makes another.
        let _ = fs::remove_file(common.join(LOCK));
        let _ = fs::remove_dir(common);
    }
}

/// Names another common folder.
const COMMON_FOLDER: &str = "ATOLL_RUN_FOLDERS";

/// The folder of all runs of this user.
pub(super) fn common_folder() -> PathBuf {
    let usual = || Path::new(SHARED_MEMORY).join(format!("atoll-{}", geteuid().as_raw()));
    std::env::var_os(COMMON_FOLDER).map_or_else(usual, PathBuf::from)
}

/// Makes the common folder if need be, checks that it is this user's alone, and locks it.
fn enter(common: &Path) -> io::Result<File> {
    let started = Instant::now();
    loop {
        match try_enter(common) {
            Ok(Some(lock)) => return Ok(lock),
            Ok(None) if started.elapsed() < LOCK_TIMEOUT => sleep(LOCK_POLL),
            Ok(None) => return Err(io::Error::other("another process keeps it locked")),
            // It was removed meanwhile, with the last run in it.
            Err(error) if error.kind() == io::ErrorKind::NotFound && started.elapsed() < LOCK_TIMEOUT => {}
            Err(error) => return Err(error),
        }
    }
}

/// As [`enter`], if nobody else has it locked.
fn try_enter(common: &Path) -> io::Result<Option<File>> {
    match DirBuilder::new().mode(0o700).create(common) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
        _ => {}
    }
    // Of the link itself, if it is one: in a folder that all users share, anybody may have made it.
    let metadata = fs::symlink_metadata(common)?;
    if !metadata.is_dir() || metadata.uid() != geteuid().as_raw() || metadata.mode() & 0o077 != 0 {
        return Err(io::Error::other("it is not a folder that belongs to this user alone (mode 0700)"));
    }
    let path = common.join(LOCK);
    let lock = OpenOptions::new().write(true).create(true).truncate(false).mode(0o600).open(&path)?;
    match lock.try_lock() {
        // One that was removed while it was waited for locks nothing.
        Ok(()) if fs::metadata(&path)?.ino() == lock.metadata()?.ino() => Ok(Some(lock)),
        Ok(()) | Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(error)) => Err(error),
    }
}

/// Removes the runs of which no process lives. Call this with the common folder locked.
fn remove_dead_runs(common: &Path) {
    for entry in fs::read_dir(common).into_iter().flatten().flatten() {
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            let dead = match File::open(entry.path().join(LOCK)) {
                Ok(lock) => lock.try_lock().is_ok(),
                // Its launcher died while it made the folder.
                Err(error) => error.kind() == io::ErrorKind::NotFound,
            };
            if dead {
                // What resists, another user's perhaps, is no reason not to start.
                let _ = RunFolder::at(entry.path()).remove();
            }
        }
    }
}

/// Makes a folder with a name that no run has had.
fn new_folder(common: &Path) -> io::Result<PathBuf> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    let path = common.join(format!("{}-{:x}-{count}", std::process::id(), since.as_nanos()));
    DirBuilder::new().mode(0o700).create(&path)?;
    Ok(path)
}

fn unless_absent(result: io::Result<()>) -> io::Result<()> {
    result.or_else(|error| if error.kind() == io::ErrorKind::NotFound { Ok(()) } else { Err(error) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;
    use std::thread;

    fn in_shared_memory(prefix: &str) -> usize {
        let names = fs::read_dir(SHARED_MEMORY).unwrap().map(|entry| entry.unwrap().file_name());
        names.filter(|name| name.to_string_lossy().starts_with(prefix)).count()
    }

    #[test]
    fn a_run_leaves_nothing() {
        let temporary = tempfile::tempdir().unwrap();
        let common = temporary.path().join("runs");
        let run = OwnedRunFolder::create(&common).unwrap();
        let folder = run.folder().clone();
        assert_eq!(fs::metadata(folder.path()).unwrap().mode() & 0o777, 0o700);
        fs::create_dir_all(folder.node_files().join("nodes")).unwrap();
        fs::write(folder.board(), "x").unwrap();
        assert_eq!(RunFolder::at(folder.path().to_owned()), folder, "ranks find what the launcher made");
        drop(run);
        assert!(!common.exists());
        assert_eq!(in_shared_memory(folder.prefix()), 0);
    }

    #[test]
    fn the_next_run_removes_dead_ones_and_leaves_the_living() {
        let temporary = tempfile::tempdir().unwrap();
        let common = temporary.path().join("runs");
        let living = OwnedRunFolder::create(&common).unwrap();
        // One whose launcher was killed when it had made the folder, and one that was killed later.
        let name = |what: &str| common.join(format!("{}-{what}", std::process::id()));
        let half_made = name("half");
        fs::create_dir(&half_made).unwrap();
        let dead = RunFolder::at(name("dead"));
        fs::create_dir(dead.path()).unwrap();
        File::create(dead.path().join(LOCK)).unwrap();
        fs::write(dead.board(), "x").unwrap();
        // One whose launcher is dead and one rank is not.
        let orphaned = RunFolder::at(name("orphaned"));
        fs::create_dir(orphaned.path()).unwrap();
        File::create(orphaned.path().join(LOCK)).unwrap();
        let rank = orphaned.lock().unwrap();

        let run = OwnedRunFolder::create(&common).unwrap();
        assert!(!half_made.exists() && !dead.path().exists());
        assert_eq!(in_shared_memory(dead.prefix()), 0);
        assert!(living.folder().path().exists() && orphaned.path().exists() && run.folder().path().exists());
        drop(rank);
        // A process that another test is just starting has a copy of the lock until it is the program it is to be.
        let deadline = Instant::now() + LOCK_TIMEOUT;
        while orphaned.path().exists() {
            assert!(Instant::now() < deadline, "a run without processes is left");
            drop(OwnedRunFolder::create(&common).unwrap());
            sleep(LOCK_POLL);
        }
        assert!(living.folder().path().exists());
    }

    #[test]
    fn runs_that_start_at_once_do_not_remove_each_other() {
        let temporary = tempfile::tempdir().unwrap();
        let common = temporary.path().join("runs");
        thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    for _ in 0..20 {
                        let run = OwnedRunFolder::create(&common).unwrap();
                        fs::write(run.folder().board(), "x").unwrap();
                        thread::yield_now();
                        assert!(run.folder().path().join(LOCK).exists(), "removed while it was alive");
                        assert!(run.folder().board().exists(), "its shared memory was removed while it was alive");
                    }
                });
            }
        });
        assert!(!common.exists(), "the last run takes the common folder with it");
    }

    #[test]
    fn a_common_folder_that_others_can_write_is_refused() {
        let temporary = tempfile::tempdir().unwrap();
        let open = temporary.path().join("open");
        fs::create_dir(&open).unwrap();
        fs::set_permissions(&open, std::os::unix::fs::PermissionsExt::from_mode(0o777)).unwrap();
        assert!(OwnedRunFolder::create(&open).unwrap_err().to_string().contains("this user alone"));
        let private = temporary.path().join("private");
        DirBuilder::new().mode(0o700).create(&private).unwrap();
        let link = temporary.path().join("link");
        symlink(&private, &link).unwrap();
        assert!(OwnedRunFolder::create(&link).unwrap_err().to_string().contains("this user alone"));
    }
}
