//! Ranks as processes that share memory: the conformance suite, and what happens when processes are killed.

use atoll_tests::processes::{is_alive, send_signal};
use atoll_tests::program::{self, LIMIT};
use atoll_transport::Rank;
use atoll_transport::conformance::process::recorded;
use atoll_transport::conformance::{CASES, Case, Harness, Outcome, check};
use atoll_transport::iceoryx2::{Control, LaunchError, LaunchOptions, MAX_RANKS, RankExit, launch};
use std::fs;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::thread::{self, sleep};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Between two looks at something that another process does.
const POLL: Duration = Duration::from_millis(10);

fn rank_program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_ipc_rank"))
}

/// With a grace that no slow machine makes ranks miss which end by themselves.
fn options() -> LaunchOptions {
    LaunchOptions { grace: LIMIT / 2, ..LaunchOptions::default() }
}

/// Runs `test` on a thread and fails if it does not end. (Its processes end with this one.)
fn watched<R: Send + 'static>(test: impl FnOnce() -> R + Send + 'static) -> R {
    program::watched("processes that share memory", test)
}

/// Launches ranks without end conditions of the launcher's own.
fn run(size: usize, options: LaunchOptions, arguments: &[&str]) -> Vec<RankExit> {
    let command = |_| {
        let mut command = rank_program();
        command.args(arguments);
        command
    };
    launch(size, options, &|| Control::Run, command).expect("the run starts")
}

/// How the ranks ended in each of some cases, by the name of the case.
type Outcomes = Vec<(&'static str, Vec<Outcome>)>;

/// Runs each case that loses a rank in a launch of its own and all others in one; for one number of ranks.
#[derive(Default)]
struct Processes {
    healthy: OnceLock<Outcomes>,
}

impl Processes {
    fn outcomes(size: usize, cases: &[&'static Case]) -> Outcomes {
        let folder = TempDir::new().expect("a temporary folder");
        let path = folder.path().to_str().expect("a UTF-8 path").to_owned();
        let names = cases.iter().map(|case| case.name);
        let arguments: Vec<&str> = ["cases", &path].into_iter().chain(names).collect();
        let options = LaunchOptions { peer_timeout: cases[0].peer_timeout, ..options() };
        // What deliberate panics say goes to standard error; the outcomes have it as well.
        let exits = run(size, options, &arguments);
        let outcome = |case: &Case, exit: &RankExit| {
            let silent = || Outcome::Panicked(format!("it told nothing and ended as {}", exit.status));
            recorded(folder.path(), case, exit.rank).unwrap_or_else(silent)
        };
        cases.iter().map(|case| (case.name, exits.iter().map(|exit| outcome(case, exit)).collect())).collect()
    }
}

impl Harness for Processes {
    fn run(&self, size: usize, case: &'static Case) -> Vec<Outcome> {
        if case.loses_victim {
            return Processes::outcomes(size, &[case]).remove(0).1;
        }
        let outcomes = self.healthy.get_or_init(|| {
            let cases: Vec<_> = CASES.iter().filter(|case| !case.loses_victim && case.sizes.contains(&size)).collect();
            Processes::outcomes(size, &cases)
        });
        outcomes.iter().find(|(name, _)| *name == case.name).expect("every case of this size was run").1.clone()
    }
}

fn conforms(size: usize) {
    let failures: Vec<String> = watched(move || {
        let harness = Processes::default();
        let cases = CASES.iter().filter(|case| case.sizes.contains(&size));
        let failures = cases.filter_map(|case| check(&harness, case, size).err());
        failures.collect()
    });
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn one_process_conforms() {
    conforms(1);
}

#[test]
fn two_processes_conform() {
    conforms(2);
}

#[test]
fn three_processes_conform() {
    conforms(3);
}

#[test]
fn four_processes_conform() {
    conforms(4);
}

#[test]
fn eight_processes_conform() {
    conforms(8);
}

/// What ranks in `rounds` have told about themselves.
struct Told {
    run_folder: PathBuf,
    processes: Vec<u32>,
}

impl Told {
    /// Waits until all ranks have told.
    fn by(folder: &Path, size: usize) -> Told {
        let started = Instant::now();
        let text = |name: &str, rank: usize| loop {
            match fs::read_to_string(folder.join(format!("{name}.{rank}"))) {
                Ok(text) => return text,
                Err(_) if started.elapsed() < LIMIT => sleep(POLL),
                Err(error) => panic!("rank {rank} does not join: {error}"),
            }
        };
        let processes = (0..size).map(|rank| text("process", rank).parse().expect("a process id")).collect();
        Told { run_folder: PathBuf::from(text("run", 0)), processes }
    }

    fn shared_memory(&self) -> Vec<String> {
        let run = self.run_folder.file_name().expect("a run has a name").to_str().expect("in UTF-8");
        let names = fs::read_dir("/dev/shm").expect("there is shared memory").map(|entry| entry.expect("an entry"));
        names.map(|entry| entry.file_name().to_string_lossy().into_owned()).filter(|name| name.contains(run)).collect()
    }

    fn assert_nothing_left(&self) {
        assert!(!self.run_folder.exists(), "{} is left", self.run_folder.display());
        assert_eq!(self.shared_memory(), [""; 0], "left in shared memory");
    }

    fn alive(&self) -> usize {
        self.processes.iter().filter(|&&process| is_alive(process)).count()
    }
}

/// Launches `rounds` on a thread; ranks tell about themselves in the folder.
fn start_rounds(size: usize, count: u64) -> (TempDir, thread::JoinHandle<Vec<RankExit>>) {
    let folder = TempDir::new().expect("a temporary folder");
    let path = folder.path().to_str().expect("a UTF-8 path").to_owned();
    let arguments = ["rounds".to_owned(), path, count.to_string()];
    let thread = thread::spawn(move || {
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        run(size, options(), &arguments)
    });
    (folder, thread)
}

#[test]
fn a_killed_rank_is_blamed_by_all_and_nothing_is_left() {
    const SIZE: usize = 4;
    watched(|| {
        for victim in [0, 2, 3] {
            // Another moment in every run of this test.
            let delay = RandomState::new().build_hasher().finish() % 150;
            let (folder, running) = start_rounds(SIZE, u64::MAX);
            let told = Told::by(folder.path(), SIZE);
            assert!(!told.shared_memory().is_empty(), "this test looks for the wrong names");
            sleep(Duration::from_millis(delay));
            send_signal(told.processes[victim], "KILL");
            let exits = running.join().expect("the launcher does not panic");
            for (rank, exit) in exits.iter().enumerate() {
                assert!(!exit.killed, "rank {rank} had to be killed, after {delay} ms");
                if rank == victim {
                    assert_eq!(exit.status.signal(), Some(9));
                } else {
                    let text = String::from_utf8_lossy(&exit.stdout);
                    let blame = format!("lost rank {victim}: it was killed by signal 9;");
                    assert!(text.starts_with(&blame), "rank {rank}, after {delay} ms: {text}");
                    assert_eq!(exit.status.code(), Some(3), "rank {rank}, after {delay} ms");
                }
            }
            told.assert_nothing_left();
        }
    });
}

#[test]
fn a_rank_that_does_not_join_is_blamed_by_all() {
    let ends = [
        ("kill -9 $$", "it was killed by signal 9"),
        ("exit 7", "it ended with exit code 7"),
        ("exit 0", "it left while other ranks still needed it"),
    ];
    watched(move || {
        for (script, reason) in ends {
            let folder = TempDir::new().expect("a temporary folder");
            let command = |rank: Rank| {
                let mut command = if rank == Rank(1) { Command::new("sh") } else { rank_program() };
                match rank {
                    Rank(1) => command.args(["-c", script]),
                    _ => command.arg("rounds").arg(folder.path()).arg("1"),
                };
                command
            };
            let exits = launch(3, options(), &|| Control::Run, command).expect("the run starts");
            for exit in exits.iter().filter(|exit| exit.rank != Rank(1)) {
                let text = String::from_utf8_lossy(&exit.stdout);
                assert!(text.starts_with(&format!("lost rank 1: {reason};")), "rank {}: {text}", exit.rank);
            }
        }
    });
}

#[test]
fn without_a_launcher_the_ranks_end_and_the_next_launch_cleans_up() {
    const SIZE: usize = 3;
    watched(|| {
        let folder = TempDir::new().expect("a temporary folder");
        let launcher = |ranks: usize, rounds: u64| {
            let mut launcher = rank_program();
            launcher.arg("launch").arg(ranks.to_string()).arg("rounds").arg(folder.path()).arg(rounds.to_string());
            // Runs of their own, or another test's launch would clean up. What ranks say there is that they end.
            launcher.env("ATOLL_RUN_FOLDERS", folder.path().join("runs")).stdout(Stdio::piped()).stderr(Stdio::null());
            launcher.spawn().expect("the launcher starts")
        };
        let mut killed = launcher(SIZE, u64::MAX);
        let told = Told::by(folder.path(), SIZE);
        killed.kill().expect("the launcher is killed");
        killed.wait().expect("the launcher has ended");
        // The limit is the watchdog's: no rank waits for anything.
        while told.alive() > 0 {
            sleep(POLL);
        }
        assert!(told.run_folder.exists(), "nobody was there to remove it");
        let next = launcher(1, 1).wait_with_output().expect("the next launcher ends");
        assert_eq!(String::from_utf8_lossy(&next.stdout), "rank 0, exit status: 0: 1 rounds\n");
        told.assert_nothing_left();
    });
}

#[test]
fn runs_at_the_same_time_do_not_meet() {
    watched(|| {
        let runs: Vec<_> = (0..3).map(|index| start_rounds(2 + index % 2, 300)).collect();
        for (folder, running) in runs {
            let exits = running.join().expect("the launcher does not panic");
            for exit in &exits {
                let (status, text) = (exit.status, String::from_utf8_lossy(&exit.stdout));
                assert!(status.success() && text == "300 rounds\n", "{status}: {text}");
            }
            Told::by(folder.path(), exits.len()).assert_nothing_left();
        }
    });
}

#[test]
fn ranks_that_are_told_to_stop_agree_where() {
    const SIZE: usize = 3;
    watched(|| {
        let folder = TempDir::new().expect("a temporary folder");
        let path = folder.path().to_owned();
        let joined = || (0..SIZE).all(|rank| path.join(format!("process.{rank}")).exists());
        let control = || if joined() { Control::Stop } else { Control::Run };
        let command = |_| {
            let mut command = rank_program();
            command.arg("rounds").arg(&path).arg(u64::MAX.to_string());
            command
        };
        let exits = launch(SIZE, options(), &control, command).expect("the run starts");
        for exit in &exits {
            assert!(exit.status.success(), "{exit:?}");
            assert_eq!(exit.stdout, exits[0].stdout, "ranks stopped in different rounds");
        }
    });
}

#[test]
fn what_does_not_fit_this_machine_is_refused() {
    let refused = launch(MAX_RANKS + 1, options(), &|| Control::Run, |_| rank_program());
    let error = refused.expect_err("too many ranks");
    assert!(matches!(error, LaunchError::Limits(_)));
    assert!(error.to_string().starts_with("65 ranks asked for"), "{error}");
}

#[test]
fn messages_that_do_not_fit_this_machine_end_the_run() {
    watched(|| {
        let exits = run(3, options(), &["grow", &(1_u64 << 50).to_string(), &u64::MAX.to_string()]);
        for exit in &exits {
            let text = String::from_utf8_lossy(&exit.stdout);
            assert!(
                text.starts_with("lost rank 1: it is out of shared memory: /dev/shm has "),
                "rank {}: {text}",
                exit.rank
            );
            assert_eq!((exit.status.code(), exit.killed), (Some(3), false));
        }
    });
}

#[test]
fn messages_grow_many_times() {
    watched(|| {
        let grow = |to: &str, rounds: &str| {
            for exit in run(4, options(), &["grow", "1250", to]) {
                assert_eq!(String::from_utf8_lossy(&exit.stdout), rounds, "rank {}: {}", exit.rank, exit.status);
            }
        };
        grow("10000000", "13 rounds\n");
        // The last message makes its segment grow, and its sender leaves at once: by turns before and after the
        // receivers have looked.
        (0..10).for_each(|_| grow("10000", "3 rounds\n"));
    });
}
