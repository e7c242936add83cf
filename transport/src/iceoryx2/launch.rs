//! Starts one process per rank, watches over them and cleans up after them.

use std::io::{self, Read, Write};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread::{self, sleep};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process_group};
use thiserror::Error;

use super::board::Board;
use super::environment::Environment;
use super::limits::Machine;
use super::notices::Notice;
use super::record::Record;
use super::run_folder::{OwnedRunFolder, RunFolder, common_folder};
use crate::origin::{LEFT_EARLY, Origin};
use crate::{Rank, TransportError};

/// Between two looks at the ranks.
const POLL: Duration = Duration::from_millis(10);

/// How long the output of a rank that has ended is read on. It is at its end, unless a process started by the rank
/// keeps it open.
const OUTPUT_TIMEOUT: Duration = Duration::from_secs(5);

/// How ranks are launched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LaunchOptions {
    /// How long a rank waits in one exchange for the others before it gives up, more than zero. Default 30 s.
    ///
    /// It must exceed the longest time by which one rank may lag behind another. Raising it lengthens the wait for a
    /// rank that hangs; ranks that end in whatever way are noticed at once.
    pub peer_timeout: Duration,
    /// How long the others may take to end by themselves when a rank was lost, before they are killed. Default 5 s.
    pub grace: Duration,
}

impl Default for LaunchOptions {
    fn default() -> LaunchOptions {
        LaunchOptions { peer_timeout: Duration::from_secs(30), grace: Duration::from_secs(5) }
    }
}

/// What the ranks are to do, as the caller of [`launch`] sees it; asked for a hundred times a second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Control {
    /// Go on.
    #[default]
    Run,
    /// Stop at the next opportunity: [`stop_requested`](super::stop_requested) becomes true in every rank.
    Stop,
    /// End now: the ranks are killed.
    Quit,
}

/// How the process of one rank ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RankExit {
    /// The rank.
    pub rank: Rank,
    /// Its exit code or the signal that ended it.
    pub status: ExitStatus,
    /// Whether it was the launcher that killed it: told to quit, or because another rank was lost and this one did not
    /// end within the [grace](LaunchOptions::grace).
    pub killed: bool,
    /// Whether it was killed as somebody had stopped it, as by SIGSTOP or a debugger, for the
    /// [peer timeout](LaunchOptions::peer_timeout), while all others had ended.
    pub stalled: bool,
    /// What it wrote to its standard output.
    pub stdout: Vec<u8>,
}

/// Why a run was not started.
#[derive(Debug, Error)]
pub enum LaunchError {
    /// This machine, or this backend, has not enough of something; the text says of what.
    #[error("{0}")]
    Limits(String),

    /// The folder of the run could not be made.
    #[error("cannot make the folder of the run in {}: {source}; check that it is yours to write", .folder.display())]
    Folder {
        /// Where.
        folder: PathBuf,
        /// Why not.
        source: io::Error,
    },

    /// A process did not start. Those that had are killed.
    #[error("cannot start rank {rank} as {program}: {source}")]
    Start {
        /// The rank.
        rank: Rank,
        /// The program that was to be it.
        program: String,
        /// Why not.
        source: io::Error,
    },
}

/// Whether so many ranks can be launched on this machine, as far as that can be told beforehand.
///
/// # Errors
/// What keeps them from it.
pub fn check(size: usize) -> Result<(), LaunchError> {
    make_room(size).map(drop)
}

/// A folder for a run, after the dead have made room, on a machine that can hold it.
fn make_room(size: usize) -> Result<OwnedRunFolder, LaunchError> {
    let folder = common_folder();
    let run = OwnedRunFolder::create(&folder).map_err(|source| LaunchError::Folder { folder, source })?;
    Machine::ours().check(size).map_err(LaunchError::Limits)?;
    Ok(run)
}

/// Runs `size` processes, each started by what `command` returns for its rank, and returns how each ended, in rank
/// order, when all have.
///
/// The command's standard input and output are replaced by pipes, the former for the launcher's notices; its standard
/// error is left as it is. Each process leads a process group of its own, so that Ctrl-C on a terminal reaches the
/// caller alone, who says by `control` what to do about it.
///
/// However the run ends, nothing of it remains: no rank, no shared memory, no file. What runs have left whose launcher
/// was killed is removed at the start of the next one of the same user. The limit on open files of this process is
/// raised as far as it goes.
///
/// # Errors
/// If the run could not be started. A rank that fails is no error but a [`RankExit`].
pub fn launch(
    size: usize,
    options: LaunchOptions,
    control: &dyn Fn() -> Control,
    mut command: impl FnMut(Rank) -> Command,
) -> Result<Vec<RankExit>, LaunchError> {
    if options.peer_timeout.is_zero() {
        return Err(LaunchError::Limits(
            "the peer timeout is zero, so every wait would fail; give it some seconds".into(),
        ));
    }
    let run = make_room(size)?;
    let folder = run.folder();
    let cannot = |source| LaunchError::Folder { folder: common_folder(), source };
    Board::create(&folder.board(), size).map_err(cannot)?;
    // Dropped before the folder is: the processes end first.
    let mut ranks = Ranks { record: Record::new(folder.path(), "launcher"), ranks: Vec::new() };
    for rank in Rank::all(size) {
        let mut command = command(rank);
        let environment = environment(folder, rank, size, options.peer_timeout);
        let started = RunningRank::start(&mut command, &environment).map_err(|source| {
            let program = Path::new(command.get_program()).display().to_string();
            LaunchError::Start { rank, program, source }
        })?;
        ranks.ranks.push(started);
    }
    ranks.watch(options, control);
    Ok(ranks.exits())
}

fn environment(folder: &RunFolder, rank: Rank, size: usize, peer_timeout: Duration) -> Environment {
    Environment { folder: folder.clone(), rank, size, peer_timeout }
}

/// One process and what is known of it.
struct RunningRank {
    rank: Rank,
    child: Child,
    output: Receiver<Vec<u8>>,
    ended: Option<ExitStatus>,
    killed: bool,
    stalled: bool,
}

impl RunningRank {
    fn start(command: &mut Command, environment: &Environment) -> io::Result<RunningRank> {
        environment.set(command);
        command.process_group(0).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn()?;
        let (sender, output) = channel();
        let stdout = child.stdout.take();
        let running = RunningRank { rank: environment.rank, child, output, ended: None, killed: false, stalled: false };
        // A pipe holds little; whoever writes more would wait for a reader.
        let reader = move || {
            let mut stdout = stdout;
            let mut piece = vec![0; 1 << 16];
            while let Some(count @ 1..) = stdout.as_mut().and_then(|stdout| stdout.read(&mut piece).ok()) {
                if sender.send(piece[..count].to_vec()).is_err() {
                    return;
                }
            }
        };
        let named = thread::Builder::new().name(format!("output of rank {}", running.rank));
        match named.spawn(reader) {
            Ok(_) => Ok(running),
            Err(error) => {
                // It is no part of the run yet, so nobody else would end it.
                Ranks { record: Record::new(Path::new(""), ""), ranks: vec![running] }.end_all();
                Err(error)
            }
        }
    }

    /// Whether somebody has stopped the process, who may never let it go on.
    fn is_stopped(&self) -> bool {
        // After the name, which may hold anything, in parentheses.
        let state = std::fs::read_to_string(format!("/proc/{}/stat", self.child.id()));
        state.is_ok_and(|text| text.rsplit(')').next().is_some_and(|rest| rest.trim_start().starts_with(['T', 't'])))
    }

    /// Kills the process and those it started, unless it is known to have ended: then its number may be another's.
    fn kill(&mut self) {
        if self.ended.is_none() {
            self.killed = true;
            // It fails only for a process that has just ended by itself.
            let _ = kill_process_group(Pid::from_child(&self.child), Signal::KILL);
        }
    }

    /// Tells the process something, if it still listens.
    fn tell(&mut self, notice: &Notice) {
        if let Some(stdin) = self.child.stdin.as_mut().filter(|_| self.ended.is_none()) {
            let _ = stdin.write_all(notice.to_line().as_bytes());
        }
    }

    fn exit(self) -> Option<RankExit> {
        let mut stdout = Vec::new();
        let started = Instant::now();
        while let Ok(piece) = self.output.recv_timeout(OUTPUT_TIMEOUT.saturating_sub(started.elapsed())) {
            stdout.extend(piece);
        }
        Some(RankExit { rank: self.rank, status: self.ended?, killed: self.killed, stalled: self.stalled, stdout })
    }
}

/// The processes of a run. On drop, those that are left are killed.
struct Ranks {
    record: Record,
    ranks: Vec<RunningRank>,
}

impl Ranks {
    /// Returns when all have ended.
    fn watch(&mut self, LaunchOptions { peer_timeout, grace }: LaunchOptions, control: &dyn Fn() -> Control) {
        let mut lost_since: Option<Instant> = None;
        let mut stopped_since: Option<Instant> = None;
        let mut told_to_stop = false;
        loop {
            if self.notice_ends() {
                lost_since.get_or_insert_with(Instant::now);
            }
            if self.ranks.iter().all(|rank| rank.ended.is_some()) {
                return;
            }
            match control() {
                Control::Run => {}
                Control::Stop if told_to_stop => {}
                Control::Stop => {
                    told_to_stop = true;
                    self.ranks.iter_mut().for_each(|rank| rank.tell(&Notice::Stop));
                }
                Control::Quit => return self.end_all(),
            }
            if lost_since.is_some_and(|since| since.elapsed() >= grace) {
                return self.end_all();
            }
            match self.last().filter(|last| last.is_stopped()) {
                None => stopped_since = None,
                Some(last) if stopped_since.get_or_insert_with(Instant::now).elapsed() >= peer_timeout => {
                    last.stalled = true;
                    return self.end_all();
                }
                Some(_) => {}
            }
            sleep(POLL);
        }
    }

    /// The only one that has not ended, if there were others, who would find out that it hangs.
    fn last(&mut self) -> Option<&mut RunningRank> {
        let are_others = self.ranks.len() > 1;
        let mut left = self.ranks.iter_mut().filter(|rank| rank.ended.is_none());
        let last = left.next()?;
        (are_others && left.next().is_none()).then_some(last)
    }

    /// Looks which have ended since and tells the others. Returns whether one of them ended badly.
    fn notice_ends(&mut self) -> bool {
        let mut lost = false;
        for index in 0..self.ranks.len() {
            let ended = &mut self.ranks[index];
            if ended.ended.is_some() {
                continue;
            }
            let Ok(Some(status)) = ended.child.try_wait() else { continue };
            ended.ended = Some(status);
            let rank = ended.rank;
            let how = how_it_ended(status);
            lost |= !status.success();
            if status.signal().is_some() {
                // It had no time to record anything itself.
                let error = TransportError::PeerLost { rank, reason: how.clone() };
                self.record.settle(Origin { error, reporter: rank });
            }
            let notice = Notice::Ended { rank, how };
            self.ranks.iter_mut().for_each(|rank| rank.tell(&notice));
        }
        lost
    }

    /// Kills what still runs and waits for it.
    fn end_all(&mut self) {
        self.ranks.iter_mut().for_each(RunningRank::kill);
        for rank in &mut self.ranks {
            if rank.ended.is_none() {
                rank.ended = rank.child.wait().ok();
            }
        }
    }

    fn exits(mut self) -> Vec<RankExit> {
        std::mem::take(&mut self.ranks).into_iter().filter_map(RunningRank::exit).collect()
    }
}

impl Drop for Ranks {
    fn drop(&mut self) {
        self.end_all();
    }
}

/// A clause that begins with "it".
fn how_it_ended(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(0), _) => LEFT_EARLY.to_owned(),
        (Some(code), _) => format!("it ended with exit code {code}"),
        // What an access to shared memory does for which there is no page left.
        (None, Some(signal)) if signal == Signal::BUS.as_raw() => {
            format!("it was killed by signal {signal}, as when /dev/shm is full")
        }
        (None, signal) => format!("it was killed by signal {}", signal.unwrap_or_default()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    fn shell(script: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        command
    }

    #[test]
    fn ranks_are_told_who_they_are_and_heard() {
        let script = "echo rank $ATOLL_RANK of $ATOLL_RANKS; head -c 300000 /dev/zero; exit $ATOLL_RANK";
        let exits = launch(3, LaunchOptions::default(), &|| Control::Run, |_| shell(script)).unwrap();
        assert_eq!(exits.len(), 3);
        for (index, exit) in exits.iter().enumerate() {
            assert_eq!(
                (exit.rank, exit.status.code(), exit.killed),
                (Rank::from_index(index), Some(index as i32), false)
            );
            let first = format!("rank {index} of 3\n");
            assert!(exit.stdout.starts_with(first.as_bytes()), "{}", String::from_utf8_lossy(&exit.stdout[..40]));
            assert_eq!(exit.stdout.len(), first.len() + 300_000, "a full pipe");
        }
    }

    #[test]
    fn the_others_hear_of_an_end_and_are_killed_after_the_grace() {
        let exits = |grace, other: &str| {
            let options = LaunchOptions { grace, ..LaunchOptions::default() };
            let script = |rank: Rank| if rank == Rank(1) { "kill -9 $$" } else { other };
            let exits = launch(2, options, &|| Control::Run, |rank| shell(script(rank))).unwrap();
            assert_eq!((exits[1].status.signal(), exits[1].killed), (Some(9), false));
            exits
        };
        let heard = exits(Duration::from_secs(60), "read line; echo $line");
        assert_eq!((heard[0].status.code(), heard[0].killed), (Some(0), false));
        assert_eq!(heard[0].stdout, b"ended 1 it was killed by signal 9\n");
        let killed = exits(Duration::from_millis(200), "sleep 1000");
        assert_eq!((killed[0].status.signal(), killed[0].killed), (Some(9), true));
    }

    #[test]
    fn the_last_one_is_given_up_where_it_is_stopped() {
        let options = LaunchOptions { peer_timeout: Duration::from_millis(200), ..LaunchOptions::default() };
        let script = |rank: Rank| if rank == Rank(0) { "kill -STOP $$" } else { "true" };
        let exits = launch(2, options, &|| Control::Run, |rank| shell(script(rank))).unwrap();
        assert_eq!((exits[0].status.signal(), exits[0].killed, exits[0].stalled), (Some(9), true, true));
        assert!(exits[1].status.success() && !exits[1].killed && !exits[1].stalled);
        // Who works on, however long, is waited for.
        let script = |rank: Rank| if rank == Rank(0) { "sleep 1" } else { "true" };
        let exits = launch(2, options, &|| Control::Run, |rank| shell(script(rank))).unwrap();
        assert!(exits.iter().all(|exit| exit.status.success()), "{exits:?}");
    }

    #[test]
    fn stop_is_told_once_and_quit_kills() {
        let looks = Cell::new(0);
        let control = || {
            looks.set(looks.get() + 1);
            if looks.get() > 5 { Control::Stop } else { Control::Run }
        };
        // It listens on for much longer than the launcher takes to look again.
        let script = "read line; echo $line; timeout 0.5 cat";
        let exits = launch(1, LaunchOptions::default(), &control, |_| shell(script)).unwrap();
        assert_eq!(exits[0].stdout, b"stop\n", "{exits:?}");

        let exits = launch(2, LaunchOptions::default(), &|| Control::Quit, |_| shell("sleep 1000")).unwrap();
        assert!(exits.iter().all(|exit| exit.killed && exit.status.signal() == Some(9)), "{exits:?}");
    }

    #[test]
    fn what_cannot_start_is_told() {
        let error = launch(2, LaunchOptions::default(), &|| Control::Run, |_| Command::new("/no/such/program"));
        let text = error.unwrap_err().to_string();
        assert!(text.starts_with("cannot start rank 0 as /no/such/program: "), "{text}");
        let zero = LaunchOptions { peer_timeout: Duration::ZERO, ..LaunchOptions::default() };
        let error = launch(2, zero, &|| Control::Run, |_| shell("true")).unwrap_err();
        assert!(matches!(error, LaunchError::Limits(_)), "{error}");
    }
}
