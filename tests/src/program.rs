//! The program `atoll` as a test needs it: built, found, started and watched.
//!
//! A watched program that does not end is killed and the test fails with what it had said until then. Time limits are
//! there to turn a hang into a failure and never to measure: they are many times what a slow machine needs.

use crate::processes::send_signal;
use serde_json::Value;
use std::fmt;
use std::io::{BufRead, BufReader, Read};
use std::panic;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

/// What no run of a test comes near to.
pub const LIMIT: Duration = Duration::from_secs(120);

/// How long a program is left alone between two looks at whether it has ended.
const POLL: Duration = Duration::from_millis(5);

/// How the program is compiled.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Profile {
    /// With assertions, and slower.
    Dev,
    /// As it is meant to be used.
    Release,
}

impl Profile {
    /// That of the test which asks.
    pub const CURRENT: Self = if cfg!(debug_assertions) { Self::Dev } else { Self::Release };

    /// The one that it is not.
    pub const OTHER: Self = if cfg!(debug_assertions) { Self::Release } else { Self::Dev };
}

/// The root of the repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("this package lies in the root of the repository")
}

/// The program, built on the first call for each profile; cargo sees to it that it is up to date.
///
/// # Panics
/// If it cannot be built.
pub fn atoll(profile: Profile) -> &'static Path {
    static DEV: OnceLock<PathBuf> = OnceLock::new();
    static RELEASE: OnceLock<PathBuf> = OnceLock::new();
    let built = match profile {
        Profile::Dev => &DEV,
        Profile::Release => &RELEASE,
    };
    built.get_or_init(|| build(profile))
}

fn build(profile: Profile) -> PathBuf {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    // Of the workspace, as tests are: so what they are made of is compiled already.
    command.current_dir(root()).args(["build", "--workspace", "--bin", "atoll"]);
    // Cargo itself tells where the program is, whatever configuration or environment say about that.
    command.args(["--quiet", "--message-format", "json-render-diagnostics"]);
    if profile == Profile::Release {
        command.arg("--release");
    }
    for (feature, wanted) in [("iceoryx2", cfg!(feature = "iceoryx2")), ("mpi", cfg!(feature = "mpi"))] {
        // The other profile is there to be compared with, in one process.
        if wanted && profile == Profile::CURRENT {
            command.args(["--features", &format!("atoll-tests/{feature}")]);
        }
    }
    if let Some(folder) = target_folder() {
        command.arg("--target-dir").arg(folder);
    }
    let output = command.stderr(Stdio::inherit()).output().expect("cargo starts");
    assert!(output.status.success(), "{command:?} failed");
    let messages = String::from_utf8(output.stdout).expect("cargo writes UTF-8");
    let executable = |line: &str| {
        let message: Value = serde_json::from_str(line).ok()?;
        let wanted = message["reason"] == "compiler-artifact" && message["target"]["name"] == "atoll";
        message["executable"].as_str().filter(|_| wanted).map(PathBuf::from)
    };
    messages.lines().find_map(executable).unwrap_or_else(|| panic!("{command:?} names no program"))
}

/// Where cargo put this test, so that nothing is compiled twice. A relative `CARGO_TARGET_DIR` would not tell: it is
/// meant from where cargo was started. Cargo marks the folder with a file that tells backups to leave it out.
fn target_folder() -> Option<PathBuf> {
    let test = std::env::current_exe().ok()?;
    test.ancestors().find(|folder| folder.join("CACHEDIR.TAG").is_file()).map(Path::to_owned)
}

/// The program, ready to start: with this test's profile, in the root of the repository, and without what the
/// environment may say about logging.
pub fn command() -> Command {
    command_of(Profile::CURRENT)
}

/// As [`command`], with a profile of choice.
pub fn command_of(profile: Profile) -> Command {
    let mut command = Command::new(atoll(profile));
    at_home(&mut command);
    command
}

/// Lets a command run in the root of the repository, without what the environment may say about logging, and with
/// nothing to read.
pub fn at_home(command: &mut Command) -> &mut Command {
    command.current_dir(root()).env_remove("RUST_LOG").stdin(Stdio::null())
}

/// What a program has left.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Ended {
    /// Exit code; none if a signal ended it.
    pub code: Option<i32>,
    /// Everything it wrote to its standard output.
    pub stdout: String,
    /// Everything it wrote to its standard error.
    pub stderr: String,
}

impl Ended {
    /// The lines of its standard error that are not empty.
    pub fn complaints(&self) -> Vec<&str> {
        self.stderr.lines().filter(|line| !line.trim().is_empty()).collect()
    }
}

impl fmt::Display for Ended {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let code = self.code.map_or("no exit code".to_owned(), |code| format!("exit code {code}"));
        write!(f, "{code}\n--- stdout\n{}\n--- stderr\n{}", self.stdout, self.stderr)
    }
}

/// Runs a program to its end.
///
/// # Panics
/// If that takes longer than [`LIMIT`].
pub fn run(command: &mut Command) -> Ended {
    Running::start(command).end()
}

/// Compares two recorded runs with `atoll diff`.
///
/// # Panics
/// As [`run`].
pub fn diff(a: &Path, b: &Path, options: &[&str]) -> Ended {
    run(command().arg("diff").args([a, b]).args(options))
}

/// Runs a program to its end, which must be a good one, and reads the summary it was told to write.
///
/// # Panics
/// If it fails, takes longer than [`LIMIT`], or leaves no summary.
pub fn run_to_summary(command: &mut Command, json: &Path) -> Value {
    let ended = run(command.arg("--json").arg(json));
    assert_eq!(ended.code, Some(0), "{command:?} ended with {ended}");
    summary(json)
}

/// The summary in a file.
///
/// # Panics
/// If there is none.
pub fn summary(json: &Path) -> Value {
    let text = std::fs::read_to_string(json).unwrap_or_else(|error| panic!("{}: {error}", json.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}\n{text}", json.display()))
}

/// The log of a run, row by row and column by column, but for the columns that tell of time.
///
/// # Panics
/// If there is none.
pub fn log(path: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let fields = |line: &str| -> Vec<String> { line.split(',').map(str::to_owned).collect() };
    let mut rows: Vec<_> = text.lines().map(fields).collect();
    let times = rows[0].iter().position(|name| name == "ms_per_step").expect("a column of that name");
    rows.iter_mut().for_each(|row| row.truncate(times));
    rows
}

/// A program under way. It is killed where a test lets go of it, as it does when it fails.
#[derive(Debug)]
pub struct Running {
    child: Child,
    name: String,
    stdout: Receiver<String>,
    stderr: Receiver<String>,
    /// Lines of standard error that were already looked at.
    seen: String,
}

impl Running {
    /// Starts a program.
    ///
    /// # Panics
    /// If it cannot be started.
    pub fn start(command: &mut Command) -> Self {
        let name = format!("{command:?}");
        let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let mut child = child.unwrap_or_else(|error| panic!("{name}: {error}"));
        let stdout = lines(child.stdout.take().expect("it is piped"));
        let stderr = lines(child.stderr.take().expect("it is piped"));
        Self { child, name, stdout, stderr, seen: String::new() }
    }

    /// Its process.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Waits for a line of standard error that starts so.
    ///
    /// # Panics
    /// If the program ends without one, or none comes within [`LIMIT`].
    pub fn wait_for_line(&mut self, start: &str) {
        self.line(start);
    }

    /// As [`wait_for_line`](Self::wait_for_line), and returns it.
    ///
    /// # Panics
    /// As that.
    pub fn line(&mut self, start: &str) -> String {
        let deadline = Instant::now() + LIMIT;
        loop {
            match self.stderr.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
                Ok(line) => {
                    let found = line.starts_with(start);
                    self.seen.push_str(&line);
                    if found {
                        return line;
                    }
                }
                Err(error) => panic!("{}: no line {start:?}, {error}, after\n{}", self.name, self.seen),
            }
        }
    }

    /// Sends a signal, `INT` for one.
    ///
    /// # Panics
    /// If that cannot be done.
    #[cfg(unix)]
    pub fn signal(&self, signal: &str) {
        send_signal(self.id(), signal);
    }

    /// Waits for the program to end.
    ///
    /// # Panics
    /// If that takes longer than [`LIMIT`].
    pub fn end(mut self) -> Ended {
        let deadline = Instant::now() + LIMIT;
        let status = loop {
            match self.child.try_wait().expect("a child can be waited for") {
                Some(status) => break Some(status),
                None if Instant::now() > deadline => break None,
                None => thread::sleep(POLL),
            }
        };
        if status.is_none() {
            self.kill();
        }
        // The pipes are closed now, so that these come to an end.
        let stdout: String = self.stdout.iter().collect();
        let stderr: String = std::mem::take(&mut self.seen) + &self.stderr.iter().collect::<String>();
        let ended = Ended { code: status.and_then(|status| status.code()), stdout, stderr };
        assert!(status.is_some(), "{} does not end: killed after {LIMIT:?}, {ended}", self.name);
        ended
    }

    fn kill(&mut self) {
        // Fails only for a program that has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.kill();
    }
}

/// Reads a pipe line by line on a thread of its own, so that a full pipe never holds up the program.
fn lines(pipe: impl Read + Send + 'static) -> Receiver<String> {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let mut reader = BufReader::new(pipe);
        let mut bytes = Vec::new();
        while reader.read_until(b'\n', &mut bytes).is_ok_and(|length| length > 0) {
            if sender.send(String::from_utf8_lossy(&bytes).into_owned()).is_err() {
                break;
            }
            bytes.clear();
        }
    });
    receiver
}

/// Does something that may hang, such as a run in this process, and fails if it takes longer than [`LIMIT`].
///
/// # Panics
/// If it does, and wherever `work` panics.
pub fn watched<T: Send + 'static>(what: &str, work: impl FnOnce() -> T + Send + 'static) -> T {
    let (sender, receiver) = mpsc::channel();
    let thread = thread::spawn(move || {
        // Nobody listens any more after the time limit.
        let _ = sender.send(work());
    });
    match receiver.recv_timeout(LIMIT) {
        Ok(result) => result,
        Err(RecvTimeoutError::Timeout) => panic!("{what}: still not done after {LIMIT:?}"),
        Err(RecvTimeoutError::Disconnected) => {
            let payload = thread.join().expect_err("it ended without a result");
            panic::resume_unwind(payload)
        }
    }
}
