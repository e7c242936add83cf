//! Who may write to the folder of a run: all processes of one run, and nobody else.

use super::durable::{create_folder_durably, remove_if_there, sync_folder, write_durably};
use super::{FolderError, RunFolder, recording, snapshot};
use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::path::Path;
use std::process;
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Ranks of a run whose launcher was killed end by themselves, and file systems of a network free the locks of a lost
/// host after a while; so long they are given.
const LINGERING: Duration = Duration::from_secs(100);

/// Between two looks at whether they have.
const POLL: Duration = Duration::from_millis(20);

/// The right to write to the folder of a run, as long as this lives. Processes of one run share it.
#[derive(Debug)]
pub struct Claim {
    _lock: Option<File>,
}

impl RunFolder {
    /// Keeps other runs from writing here, if there is such a folder. Where it is given whom to tell it waits a while for the
    /// end of one that still does: so does whatever comes with `--resume`, whether it is to go on or to begin; a run that only
    /// begins, with `--out`, is refused at once.
    ///
    /// # Errors
    /// If another run writes here, or nobody can.
    pub fn hold(&self, waiting: Option<&dyn Fn(&str)>) -> Result<Option<Claim>, FolderError> {
        // What is no run, and cannot become one, is left as it is. Asked in this order, as one may begin meanwhile.
        if !self.path().is_dir() || self.check_free(false).is_err() && !self.was_run() {
            return Ok(None);
        }
        self.check_made(&self.lock(), false)?;
        let lock = self.open_lock().map_err(|error| self.not_writable(&error))?;
        let deadline = Instant::now() + if waiting.is_some() { LINGERING } else { Duration::ZERO };
        let mut told = false;
        loop {
            match lock.try_lock() {
                Ok(()) => break,
                Err(TryLockError::WouldBlock) if Instant::now() < deadline => {
                    if let Some(tell) = waiting.filter(|_| !std::mem::replace(&mut told, true)) {
                        tell(&format!("{}: waiting for the run that still writes there", self.path().display()));
                    }
                    sleep(POLL);
                }
                Err(TryLockError::WouldBlock) => {
                    return Err(self.refusal("another run is writing there; wait for its end, or stop it"));
                }
                // A file system without locks; then nobody can tell.
                Err(TryLockError::Error(_)) => {
                    self.check_contents()?;
                    return Ok(Some(Claim { _lock: None }));
                }
            }
        }
        self.check_contents()?;
        // From now on it is shared with the other processes of the run.
        let shared = lock.lock_shared().is_ok();
        Ok(Some(Claim { _lock: Some(lock).filter(|_| shared) }))
    }

    /// Makes the folder if it is not there, and keeps other runs from it, as [`hold`](Self::hold) does. Another run may have
    /// begun there before it was held.
    ///
    /// # Errors
    /// If it cannot be written to, another run writes there, or it holds something else.
    pub fn make_and_hold(&self, waiting: Option<&dyn Fn(&str)>) -> Result<Claim, FolderError> {
        create_folder_durably(self.path()).map_err(|error| self.not_writable(&error))?;
        self.hold(waiting)?.ok_or_else(|| match self.check_free(false) {
            Err(error) => error,
            Ok(()) => self.refusal("it was removed while the run began; try again"),
        })
    }

    /// Makes the folder that of a run about to begin or to go on. `begins` are the commands and the configuration of one that
    /// begins: what an overwritten run left is gone, these are there, and wherever it is killed, no configuration is there without
    /// its own commands. What was done in the folder of one that goes on stays until [`go_on`](Self::go_on). `held` is what
    /// [`hold`](Self::hold) gave before the folder was looked at.
    ///
    /// # Errors
    /// If it cannot be written to, or another run has begun there meanwhile.
    pub fn claim(&self, held: Option<Claim>, begins: Option<(&str, &str)>) -> Result<Claim, FolderError> {
        let failed = |error: io::Error| self.not_writable(&error);
        let claim = match held {
            Some(claim) => claim,
            None => {
                let claim = self.make_and_hold(None)?;
                self.check_free(false)?;
                claim
            }
        };
        if let Some((commands, configuration)) = begins {
            let begun = self.remove_after(None).and_then(|()| self.begin(commands));
            begun.and_then(|()| self.write_configuration(configuration)).map_err(failed)?;
        }
        // Nobody else has ever written this.
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
        fs::write(self.lock(), format!("{} {now}\n", process::id())).map_err(failed)?;
        Ok(claim)
    }

    /// Makes the commands those of a run that begins, when nothing else is left of an older one than its configuration.
    fn begin(&self, commands: &str) -> io::Result<()> {
        remove_if_there(&self.configuration())?;
        sync_folder(self.path())?;
        self.write_commands(commands)
    }

    /// Makes the folder that of a run of this configuration that goes on after `step`, once it is known that it can: what an earlier
    /// attempt left after that is gone.
    ///
    /// # Errors
    /// What the system says.
    pub fn go_on(&self, step: Option<u64>, configuration: &str) -> io::Result<()> {
        self.write_configuration(configuration)?;
        self.remove_after(step)
    }

    fn write_configuration(&self, configuration: &str) -> io::Result<()> {
        write_durably(&self.configuration(), |file| file.write_all(configuration.as_bytes()))
    }

    /// Keeps these commands, and no others; no file if there are none.
    ///
    /// # Errors
    /// What the system says.
    pub fn write_commands(&self, commands: &str) -> io::Result<()> {
        match commands {
            "" => remove_if_there(&self.commands()),
            _ => write_durably(&self.commands(), |file| file.write_all(commands.as_bytes())),
        }
    }

    /// What tells the folder from any other, once a run has claimed it.
    ///
    /// # Errors
    /// What the system says.
    pub fn token(&self) -> io::Result<Vec<u8>> {
        fs::read(self.lock())
    }

    /// Takes part in a claim that another process of this run made, which told the token. Waits for that to be seen here, but
    /// no longer than `patience`.
    ///
    /// # Errors
    /// If the folder here is another one: hosts of a cluster must see the same files.
    pub fn share(&self, token: &[u8], patience: Duration) -> Result<Claim, FolderError> {
        const SAME: &str = "every process of a run must see the same folder";
        let deadline = Instant::now() + patience;
        let reason = loop {
            let reason = match self.token() {
                Ok(found) if found == token && !token.is_empty() => {
                    let lock = self.open_lock().ok().filter(|lock| lock.lock_shared().is_ok());
                    return Ok(Claim { _lock: lock });
                }
                Ok(_) => format!("it is not the folder that rank 0 writes to; {SAME}"),
                Err(error) if error.kind() == ErrorKind::NotFound => format!("{error}; {SAME}"),
                Err(error) => format!("its file lock cannot be read: {error}"),
            };
            if Instant::now() > deadline {
                break reason;
            }
            sleep(POLL);
        };
        Err(self.refusal(reason))
    }

    /// Refuses a folder in which something that a run writes to, or removes, is a link to what is elsewhere, or a folder in the place of a
    /// file, or what else it may be: then nothing is touched. For who holds it.
    fn check_contents(&self) -> Result<(), FolderError> {
        for name in self.names_in(self.path())?.iter().filter(|name| self.owns(name)) {
            let path = self.path().join(name);
            let is_rank_folder = name.to_str().is_some_and(recording::is_rank_folder);
            let is_snapshots = path == self.snapshots();
            self.check_made(&path, is_rank_folder || is_snapshots)?;
            let is_own = |name: &&OsString| {
                name.to_str().is_some_and(if is_snapshots { snapshot::is_folder } else { recording::is_segment })
            };
            if is_rank_folder || is_snapshots {
                let names = self.names_in(&path)?;
                names.iter().filter(is_own).try_for_each(|name| self.check_made(&path.join(name), is_snapshots))?;
            }
        }
        Ok(())
    }

    /// What is in a folder.
    fn names_in(&self, folder: &Path) -> Result<Vec<OsString>, FolderError> {
        let names = fs::read_dir(folder).and_then(|all| all.map(|entry| Ok(entry?.file_name())).collect());
        names.map_err(|error| self.refusal(format!("{}: {error}; make it one that can be read", folder.display())))
    }

    /// Whether what a run has made is a folder, or a file, as it was, if it is there.
    fn check_made(&self, path: &Path, is_folder: bool) -> Result<(), FolderError> {
        let Ok(kind) = fs::symlink_metadata(path).map(|data| data.file_type()) else { return Ok(()) };
        let name = path.strip_prefix(self.path()).unwrap_or(path).display();
        if kind.is_symlink() {
            return Err(self.refusal(format!(
                "its {name} is a link: a run writes to its own folder alone; put there what the link leads to"
            )));
        }
        let (is_as_made, made) = if is_folder { (kind.is_dir(), "folder") } else { (kind.is_file(), "file") };
        if is_as_made {
            Ok(())
        } else {
            Err(self.refusal(format!("its {name} is no {made}, as a run makes it; move it away")))
        }
    }

    /// Whether a run writes here now; none where nobody can tell.
    pub fn is_claimed(&self) -> Option<bool> {
        let lock = match File::open(self.lock()) {
            Ok(lock) => lock,
            Err(error) => return (error.kind() == ErrorKind::NotFound).then_some(false),
        };
        match lock.try_lock() {
            Ok(()) => Some(false),
            Err(TryLockError::WouldBlock) => Some(true),
            Err(TryLockError::Error(_)) => None,
        }
    }

    fn open_lock(&self) -> io::Result<File> {
        // Some file systems share only what can be read.
        File::options().create(true).truncate(false).read(true).write(true).open(self.lock())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;
    use tempfile::tempdir;

    fn configuration() -> String {
        Config::from_toml_str("test", "[scene]\nkind = \"rooms\"\n", &[]).unwrap().to_toml([2, 2])
    }

    #[test]
    fn one_run_at_a_time_and_all_its_processes() {
        let folder = tempdir().unwrap();
        let run = RunFolder::new("--out", &folder.path().join("new"));
        assert!(run.hold(None).unwrap().is_none());
        assert_eq!(run.is_claimed(), Some(false));
        let claim = run.claim(None, Some(("", &configuration()))).unwrap();
        let token = run.token().unwrap();
        let shared = run.share(&token, Duration::ZERO).unwrap();
        // A folder of the same name on another host has another, and a broken one none.
        for other in [&b"7 7\n"[..], b""] {
            let told = run.share(other, Duration::ZERO).unwrap_err().to_string();
            assert!(
                told.contains("it is not the folder that rank 0 writes to; every process of a run must see"),
                "{told}"
            );
        }
        let other = RunFolder::new("--out", &folder.path().join("other"));
        fs::create_dir_all(other.lock()).unwrap();
        let told = other.share(&token, Duration::ZERO).unwrap_err().to_string();
        assert!(told.contains("other: its file lock cannot be read: ") && !told.contains("same folder"), "{told}");
        let told = run.hold(None).unwrap_err().to_string();
        assert!(told.contains("another run is writing there"), "{told}");
        drop(claim);
        assert!(run.hold(None).is_err());
        assert_eq!(run.is_claimed(), Some(true));
        drop(shared);
        assert_eq!(run.is_claimed(), Some(false));
        let held = run.hold(None).unwrap();
        assert!(held.is_some());
        // Who comes later finds what was begun meanwhile.
        drop(held);
        let told = run.claim(None, Some(("", ""))).unwrap_err().to_string();
        assert!(told.contains("it holds a run"), "{told}");
    }

    #[test]
    fn what_is_not_as_a_run_makes_it_is_left_as_is_all_else() {
        let folder = tempdir().unwrap();
        let run = RunFolder::new("--out", folder.path());
        drop(run.claim(None, Some(("", &configuration()))).unwrap());
        fs::create_dir(run.rank(0)).unwrap();
        fs::create_dir(folder.path().join("snapshots")).unwrap();
        for (name, is_folder) in [
            ("summary.json", true),
            ("log.csv", true),
            ("snapshots/step-0000000010", false),
            ("rank-00001", false),
            ("rank-00000/steps-0000000000-0000000009.parquet", true),
        ] {
            let path = folder.path().join(name);
            if is_folder { fs::create_dir(&path) } else { fs::write(&path, "") }.unwrap();
            let (told, made) = (run.hold(None).unwrap_err().to_string(), if is_folder { "file" } else { "folder" });
            assert!(told.ends_with(&format!(": its {name} is no {made}, as a run makes it; move it away")), "{told}");
            if is_folder { fs::remove_dir(&path) } else { fs::remove_file(&path) }.unwrap();
        }
        drop(run.hold(None).unwrap().unwrap());
        // Without its configuration it can be replaced, as long as there is nothing but what a run makes.
        fs::remove_file(run.configuration()).unwrap();
        let told = run.check_free(false).unwrap_err().to_string();
        assert!(told.contains("its run.toml is missing; bring back a good copy of it"), "{told}");
        run.check_free(true).unwrap();
        drop(run.claim(run.hold(None).unwrap(), Some(("", &configuration()))).unwrap());
        fs::remove_file(run.configuration()).unwrap();
        fs::create_dir_all(run.rank(0)).unwrap();
        fs::write(folder.path().join("thesis.tex"), "").unwrap();
        let told = run.check_free(true).unwrap_err().to_string();
        assert!(told.ends_with(": it holds thesis.tex as well, which is no run's; move it away"), "{told}");
        fs::remove_file(folder.path().join("thesis.tex")).unwrap();
        // What somebody wrote stays.
        fs::write(run.configuration(), "[scene]\n").unwrap();
        let told = run.check_free(true).unwrap_err().to_string();
        assert!(told.contains("run.toml is damaged") && !told.contains("--overwrite"), "{told}");
    }

    #[test]
    fn no_configuration_is_there_without_its_commands() {
        let folder = tempdir().unwrap();
        let run = RunFolder::new("--out", folder.path());
        let commands = || fs::read_to_string(run.commands()).ok();
        drop(run.claim(None, Some(("one\n", &configuration()))).unwrap());
        assert_eq!(commands().as_deref(), Some("one\n"));
        // Who goes on does not know yet from which step, or whether it can.
        let mut longer = configuration();
        longer.push_str("# longer\n");
        let claim = run.claim(run.hold(None).unwrap(), None).unwrap();
        assert_eq!(fs::read_to_string(run.configuration()).unwrap(), configuration());
        run.go_on(None, &longer).unwrap();
        drop(claim);
        assert_eq!(fs::read_to_string(run.configuration()).unwrap(), longer);
        assert_eq!(commands().as_deref(), Some("one\n"));
        // Killed before its configuration is there, a run leaves what another can begin over.
        run.begin("two\n").unwrap();
        assert!(!run.holds_run() && run.check_free(false).is_ok());
        drop(run.claim(run.hold(None).unwrap(), Some(("", &configuration()))).unwrap());
        assert_eq!(commands(), None);
    }
}
