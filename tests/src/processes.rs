//! The processes of a run: which of them is which rank, and what they must not leave behind.

use crate::program::{Ended, LIMIT, Running};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// How the names begin of what the program and its libraries have in shared memory: the program itself, iceoryx2, Open MPI
/// and MPICH.
const OURS: [&str; 4] = ["atoll-", "iox2_", "vader_segment.", "mpich_"];

/// What launchers tell each rank in its environment.
const RANK_VARIABLES: [&str; 3] = ["ATOLL_RANK", "OMPI_COMM_WORLD_RANK", "PMI_RANK"];

/// A rank in a process of its own.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct RankProcess {
    /// The rank.
    pub rank: usize,
    /// Its process.
    pub pid: u32,
}

impl RankProcess {
    /// Sends a signal, `KILL` for one.
    ///
    /// # Panics
    /// If that cannot be done.
    pub fn signal(&self, signal: &str) {
        send_signal(self.pid, signal);
    }

    /// Whether it is there and no mere entry in the table of processes.
    pub fn lives(&self) -> bool {
        is_alive(self.pid)
    }
}

/// Sends a signal, `INT` for one, to a process.
///
/// # Panics
/// If that cannot be done.
pub fn send_signal(pid: u32, signal: &str) {
    // Every shell knows how; a `kill` of its own is not on every system.
    let sent = Command::new("sh").args(["-c", &format!("kill -{signal} {pid}")]).status();
    assert!(sent.expect("a shell starts").success(), "SIG{signal} could not be sent to process {pid}");
}

/// Whether there is such a process that is no mere entry in the table of processes, left because nobody asks for its end.
pub fn is_alive(pid: u32) -> bool {
    state(pid).is_some_and(|(state, _)| state != 'Z' && state != 'X')
}

/// Kills a program and all it has started, at once.
pub fn kill_all(program: &Running) {
    // So that it starts no more of them meanwhile.
    program.signal("STOP");
    let mut pids = descendants(program.id());
    pids.push(program.id());
    // Those that have ended meanwhile are no trouble.
    pids.iter()
        .for_each(|pid| drop(Command::new("kill").args(["-KILL", &pid.to_string()]).stderr(Stdio::null()).status()));
    let deadline = Instant::now() + LIMIT;
    while pids.iter().any(|&pid| pid != program.id() && is_alive(pid)) {
        assert!(Instant::now() < deadline, "killed processes live on");
        sleep(Duration::from_millis(2));
    }
}

/// The ranks that a program started, directly or through others, in rank order, once all are there.
///
/// # Panics
/// If they are not within [`LIMIT`].
pub fn ranks_of(program: &Running, ranks: usize) -> Vec<RankProcess> {
    let deadline = Instant::now() + LIMIT;
    loop {
        let found = descendants(program.id()).into_iter().filter_map(|pid| Some((rank_of(pid)?, pid)));
        let found: BTreeMap<usize, u32> = found.collect();
        if found.len() == ranks {
            return found.into_iter().map(|(rank, pid)| RankProcess { rank, pid }).collect();
        }
        assert!(Instant::now() < deadline, "{} of {ranks} ranks are there", found.len());
        sleep(Duration::from_millis(2));
    }
}

/// Whether an MPI job says whom it lost. The launcher of Open MPI names the rank. That of MPICH says that a process was
/// killed and names one of the job, but not always that one; its last line takes the signals of all that ended in one OR,
/// so that SIGKILL and the SIGABRT of a rank whose UCX missed the lost one amount to "Terminated (signal 15)".
#[cfg(feature = "mpi")]
pub fn job_names(ended: &Ended, lost: &RankProcess) -> bool {
    let said = format!("{}{}", ended.stdout, ended.stderr);
    if atoll_transport::mpi::Mpi::library().contains("MPICH") {
        let missed = |line: &str| line.contains(&format!("(pid={} ", lost.pid)) && line.contains("No such process");
        said.lines().any(|line| line.ends_with("EXIT CODE: 9") || missed(line))
    } else {
        said.contains(&format!("process rank {} with PID", lost.rank))
    }
}

/// Nobody launches MPI jobs.
#[cfg(not(feature = "mpi"))]
pub fn job_names(_: &Ended, _: &RankProcess) -> bool {
    false
}

/// What runs have in shared memory, by name, and the folders of runs in theirs. Other programs may come and go as they like.
pub fn shared_memory() -> BTreeSet<String> {
    let names = |folder: &str| {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect::<Vec<_>>()
    };
    let mut all = BTreeSet::new();
    for name in names("/dev/shm").into_iter().filter(|name| OURS.iter().any(|start| name.starts_with(start))) {
        let within = names(&format!("/dev/shm/{name}"));
        // A lock, without any run, is one that is just being taken.
        all.extend(within.iter().filter(|run| *run != "lock").map(|run| format!("{name}/{run}")));
        if within.is_empty() {
            all.insert(name);
        }
    }
    all
}

/// What is in shared memory that was not there before and that no process uses; other runs on this machine come and go,
/// so only what stays is counted.
pub fn left_in_shared_memory(before: &BTreeSet<String>) -> BTreeSet<String> {
    let unused = || -> BTreeSet<String> {
        let added: BTreeSet<String> = shared_memory().difference(before).cloned().collect();
        let maps: Vec<String> =
            processes().into_iter().filter_map(|pid| fs::read_to_string(format!("/proc/{pid}/maps")).ok()).collect();
        let used = |name: &str| maps.iter().any(|map| map.contains(&format!("/dev/shm/{name}")));
        // Those of a run whose launcher lives are its own business: atoll-USER-LAUNCHER-... and atoll-USER/LAUNCHER-...
        let launched = |name: &str| {
            let launcher = name.strip_prefix("atoll-").and_then(|rest| rest.split(['-', '/']).nth(1)?.parse().ok());
            launcher.is_some_and(|pid| state(pid).is_some())
        };
        added.into_iter().filter(|name| !used(name) && !launched(name)).collect()
    };
    let mut left = unused();
    for _ in 0..10 {
        if left.is_empty() {
            break;
        }
        sleep(Duration::from_millis(200));
        left = left.intersection(&unused()).cloned().collect();
    }
    left
}

/// The rank that a process is told to be.
fn rank_of(pid: u32) -> Option<usize> {
    let environment = fs::read(format!("/proc/{pid}/environ")).ok()?;
    let is_program = fs::read_to_string(format!("/proc/{pid}/comm")).ok()?.trim() == "atoll";
    let variables =
        environment.split(|&byte| byte == 0).filter_map(|line| std::str::from_utf8(line).ok()?.split_once('='));
    let rank = variables.into_iter().find(|(name, _)| RANK_VARIABLES.contains(name))?.1.parse().ok()?;
    is_program.then_some(rank)
}

/// State and parent of a process.
fn state(pid: u32) -> Option<(char, u32)> {
    let text = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The name stands in parentheses and may contain anything.
    let mut fields = text.rsplit_once(") ")?.1.split(' ');
    Some((fields.next()?.chars().next()?, fields.next()?.parse().ok()?))
}

fn processes() -> Vec<u32> {
    let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
    entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).collect()
}

fn descendants(root: u32) -> Vec<u32> {
    let parents: BTreeMap<u32, u32> = processes().into_iter().filter_map(|pid| Some((pid, state(pid)?.1))).collect();
    let descends = |mut pid: u32| {
        while let Some(&parent) = parents.get(&pid) {
            if parent == root {
                return true;
            }
            pid = parent;
        }
        false
    };
    parents.keys().copied().filter(|&pid| descends(pid)).collect()
}
