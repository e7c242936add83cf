//! Ranks as processes of this machine that share memory: the launcher, and what each of them does.

use super::in_process::on_own_thread;
use super::outcome::{Ends, outcome, told};
use super::rank_report;
use crate::error::{Exit, RunError};
use crate::plan::Plan;
use crate::project::{Network, measured};
use crate::rank::handshake::agree;
use crate::rank::trouble::Refusal;
use crate::rank::{self, Observer, RankEnd, RankError, StopFlag};
use crate::summary::Summary;
use atoll_transport::iceoryx2::{self, Control, LaunchError, LaunchOptions, RankExit};
use atoll_transport::{Rank, RankFailure, Transport};
use std::fmt::Display;
use std::io::Write;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::Ordering;
use std::time::Duration;
use std::{env, io};

/// Tells the ranks what they must find in the configuration that they read for themselves.
const CONFIG_HASH: &str = "ATOLL_CONFIG_HASH";

/// Tells the ranks to go on with what others, who were lost, began.
const GOES_ON: &str = "ATOLL_GOES_ON";

/// What a user asks of a launcher.
#[derive(Clone, Default, Debug)]
pub(crate) struct Wishes {
    /// That the ranks stop.
    pub stop: StopFlag,
    /// That they are ended.
    pub quit: StopFlag,
}

/// Whether the ranks can be started, before anything is changed for them.
///
/// # Errors
/// If not.
pub(crate) fn check(plan: &Plan, config: &Path) -> Result<(), RunError> {
    if !config.is_file() {
        // What can be read but once would leave nothing for the ranks.
        let config = config.display();
        return Err(RunError::Ranks(format!(
            "{config}: each rank reads the configuration itself, so with transport iceoryx2 it must be a regular file"
        )));
    }
    iceoryx2::check(plan.config.run.ranks).map_err(|error| RunError::Ranks(error.to_string()))
}

/// Starts this program once more for each rank, with the arguments it was started with, and waits for all. `goes_on` says
/// that they are not the first to do this.
///
/// # Errors
/// The one that ended the run, whichever and however many ranks it ended.
pub(crate) fn run(plan: &Plan, wishes: &Wishes, goes_on: bool) -> Result<Summary, RunError> {
    let program = program()?;
    let control = || match (wishes.quit.is_requested(), wishes.stop.is_requested()) {
        (true, _) => Control::Quit,
        (false, true) => Control::Stop,
        (false, false) => Control::Run,
    };
    let run = &plan.config.run;
    let options = LaunchOptions { peer_timeout: run.peer_timeout, ..LaunchOptions::default() };
    let command = |_: Rank| {
        let mut command = Command::new(&program);
        command.args(env::args_os().skip(1)).env(CONFIG_HASH, plan.config.hash(plan.tiles));
        if goes_on {
            command.env(GOES_ON, "1");
        }
        command
    };
    let exits = iceoryx2::launch(run.ranks, options, &control, command)
        .map_err(|error: LaunchError| RunError::Ranks(error.to_string()))?;
    if wishes.quit.is_requested() {
        return Err(RunError::ToldElsewhere { exit: Exit::Interrupted });
    }
    let (ends, before): (Ends, Vec<u64>) = exits.iter().map(end).unzip();
    outcome(plan, ends, before.into_iter().max().unwrap_or(0))
}

/// Starts this program once more for each of so many ranks, with the arguments it was started with, so that they measure what is
/// between them.
///
/// # Errors
/// If they cannot be started, or one is lost.
pub(crate) fn fit(ranks: usize, peer_timeout: Duration) -> Result<Network, RunError> {
    iceoryx2::check(ranks).map_err(|error| RunError::Ranks(error.to_string()))?;
    let program = program()?;
    let command = |_: Rank| {
        let mut command = Command::new(&program);
        command.args(env::args_os().skip(1));
        command
    };
    let options = LaunchOptions { peer_timeout, ..LaunchOptions::default() };
    let exits = iceoryx2::launch(ranks, options, &|| Control::Run, command)
        .map_err(|error: LaunchError| RunError::Ranks(error.to_string()))?;
    let told = exits.iter().find(|exit| exit.rank == Rank(0)).and_then(|exit| Network::of_bits(&exit.stdout));
    told.ok_or_else(|| {
        let failed = exits.iter().find(|exit| !exit.status.success()).unwrap_or(&exits[0]);
        RunError::Ranks(format!("--fit: rank {} did not measure what is between ranks, {}", failed.rank, failed.status))
    })
}

/// This program's own file.
fn program() -> Result<PathBuf, RunError> {
    env::current_exe().map_err(|error| RunError::Ranks(format!("this program's own file cannot be found: {error}")))
}

/// What the process of a rank has to say, or what is to be said of it, and as in [`rank_report::read`].
fn end(exit: &RankExit) -> (Result<RankEnd, RankFailure>, u64) {
    rank_report::read(exit.rank, &exit.stdout).unwrap_or_else(|| {
        let died = |how| RankFailure::Died { rank: exit.rank, how };
        let failure = match exit.status.signal() {
            _ if exit.stalled => died("was stopped, and given up when all others had ended".to_owned()),
            _ if exit.killed => RankFailure::Outlived { rank: exit.rank },
            Some(signal) => died(format!("was killed by signal {signal}")),
            None => died(format!("ended without a report, {}", exit.status)),
        };
        (Err(failure), 0)
    })
}

/// This process as a rank that the launcher started.
#[derive(Debug)]
pub(crate) struct RankProcess(());

impl RankProcess {
    /// If it is one.
    pub(crate) fn of_this() -> Option<Self> {
        iceoryx2::is_rank_process().then_some(Self(()))
    }

    /// Whether it goes on with what others, who were lost, began.
    pub(crate) fn goes_on(&self) -> bool {
        env::var_os(GOES_ON).is_some()
    }

    /// Whether it is the one that speaks for all.
    pub(crate) fn speaks(&self) -> bool {
        iceoryx2::process_rank() == Some(Rank(0))
    }

    /// Measures what is between the ranks, tells the launcher, and says with which exit code to end. What goes wrong is said with
    /// `complain`.
    pub(crate) fn measure(self, complain: fn(&dyn Display)) -> Exit {
        let told = iceoryx2::join().and_then(measured).map_err(|error| error.to_string());
        let told = told.and_then(|network| {
            let mut out = io::stdout();
            out.write_all(&network.to_bits()).and_then(|()| out.flush()).map_err(|error| error.to_string())
        });
        match told {
            Ok(()) => Exit::Done,
            Err(error) => {
                complain(&error);
                Exit::PeerLost
            }
        }
    }

    /// Does the rank's work, reports to the launcher, which tells the user, and says with which exit code to end. The plan
    /// is given, as ranks wait for each other no longer than the peer timeout once they have joined.
    pub(crate) fn run(self, plan: Result<Plan, RunError>, observer: Observer) -> Exit {
        let rank = iceoryx2::process_rank().unwrap_or_default();
        let observer = Observer { stop: observer.stop.asking(iceoryx2::stop_requested), ..observer };
        // The endpoint is dropped while a panic unwinds, which tells the other ranks.
        let end = on_own_thread(rank, || take_part(plan, &observer));
        let exit = match &end {
            Ok(RankEnd { result: Ok(_), .. }) => Exit::Done,
            Ok(RankEnd { result: Err(RankError::Told { exit, text }), .. }) => {
                observer.fail(text);
                *exit
            }
            Ok(RankEnd { result: Err(error), .. }) => {
                if let Some(error) = error.transport() {
                    observer.fail(error);
                }
                Exit::PeerLost
            }
            Err(failure) => {
                observer.fail(failure);
                Exit::PeerLost
            }
        };
        let line = rank_report::write(&end, observer.complete.load(Ordering::Relaxed));
        let written = io::stdout().write_all(line.as_bytes()).and_then(|()| io::stdout().flush());
        match written {
            Ok(()) => exit,
            // The launcher is gone, and with it whoever could be told.
            Err(_) => Exit::PeerLost,
        }
    }
}

/// One rank from start to end.
fn take_part(plan: Result<Plan, RunError>, observer: &Observer) -> RankEnd {
    let ended = |complete, error| RankEnd { complete, result: Err(error) };
    let mut endpoint = match iceoryx2::join() {
        Ok(endpoint) => endpoint,
        Err(error) => return ended(0, RankError::Transport(error)),
    };
    let is_meant = |plan: &Plan| {
        let hash = env::var(CONFIG_HASH);
        hash.is_ok_and(|hash| hash == plan.config.hash(plan.tiles)) && plan.config.run.ranks == endpoint.size()
    };
    let prepared = plan.and_then(|plan| {
        let changed = || RunError::Ranks("the configuration was changed while the ranks were started".to_owned());
        if is_meant(&plan) { Ok(plan) } else { Err(changed()) }
    });
    let plan = match agree(&mut endpoint, prepared, |plan| plan) {
        Ok(plan) => plan,
        Err(Refusal::Transport(error)) => return ended(0, RankError::Transport(error)),
        Err(Refusal::Known(error)) => {
            return ended(0, RankError::Told { text: error.to_string(), exit: error.exit() });
        }
    };
    let end = rank::drive(endpoint, &plan, observer, true);
    let result = end.result.map_err(|error| match error {
        error if error.transport().is_some() => error,
        error => {
            let error = told(error, end.complete, plan.config.run.steps);
            RankError::Told { text: error.to_string(), exit: error.exit() }
        }
    });
    RankEnd { complete: end.complete, result }
}
