//! Ranks as processes that an MPI launcher started, this one among them.

use super::TIME_TO_SPEAK;
use super::outcome::told;
use crate::config::{Config, MpiExchange};
use crate::error::{Exit, RunError};
use crate::plan::Plan;
use crate::project::{Network, measured};
use crate::rank::handshake::agree;
use crate::rank::trouble::{Refusal, all_well};
use crate::rank::{self, Observer, RankError};
use crate::summary::Summary;
use atoll_core::StepError;
use atoll_transport::mpi::{Method, Mpi, MpiOptions};
use atoll_transport::{Collective, Rank, RankFailure, Transport, launched};
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::Ordering;
use std::thread;
use std::time::Duration;

/// How long ranks wait for each other until they have agreed on a configuration, which says how long.
/// Longer than rank 0 may wait for an earlier run to let go of its folder.
const AGREEMENT_TIMEOUT: Duration = Duration::from_secs(150);

/// This process as a rank of an MPI job.
///
/// What goes wrong on every rank alike is told by rank 0 and ends all of them orderly; what goes wrong on this one alone
/// is told here and ends the whole job, as MPI has no other way to reach the ranks that wait.
#[derive(Debug)]
pub(crate) struct Job {
    endpoint: Mpi,
    complain: fn(&dyn Display),
}

impl Job {
    /// Joins the job. What this process has to say before it ends, it says with `complain`.
    ///
    /// # Errors
    /// If MPI cannot be used as it must be, or the launcher is that of another MPI.
    pub(crate) fn join(complain: fn(&dyn Display)) -> Result<Self, RunError> {
        let options = MpiOptions { peer_timeout: AGREEMENT_TIMEOUT, ..MpiOptions::default() };
        let endpoint = Mpi::init(options).map_err(|error| RunError::Ranks(error.to_string()))?;
        match launched() {
            Some(launched) if launched.size > 1 && endpoint.size() == 1 => {
                // Each of them is alone and believes itself the first; one is enough to say so. It is given time, as a
                // launcher ends all others when one has ended.
                if launched.rank != Rank(0) {
                    thread::sleep(TIME_TO_SPEAK);
                    return Err(RunError::ToldElsewhere { exit: Exit::Usage });
                }
                Err(RunError::Ranks(format!(
                    "the launcher started {} processes, but each finds itself alone: it is not that of the MPI this \
                     program was built with, {}; use that one's mpirun, or the --mpi of srun that suits it",
                    launched.size,
                    Mpi::library()
                )))
            }
            _ => Ok(Self { endpoint, complain }),
        }
    }

    /// Whether this is the rank that speaks for all.
    pub(crate) fn speaks(&self) -> bool {
        self.endpoint.rank() == Rank(0)
    }

    /// The configuration with the number of ranks that the launcher started.
    ///
    /// # Errors
    /// If the command line asks for another number.
    pub(crate) fn adapt(&mut self, mut config: Config) -> Result<Config, RunError> {
        if config.run.peer_timeout > AGREEMENT_TIMEOUT {
            // The world may be so large that working out the plan takes longer.
            self.set_peer_timeout(config.run.peer_timeout);
        }
        let (asked, found) = (config.run.ranks, self.endpoint.size());
        if config.run.ranks_asked_for && asked != found {
            return Err(RunError::Ranks(format!(
                "--ranks {asked}, but the launcher started {found}: leave --ranks out, or start as many with `mpirun -n \
                 {asked}` of the MPI this program was built with, {}",
                Mpi::library()
            )));
        }
        config.run.ranks = found;
        Ok(config)
    }

    /// Goes on where every rank is ready for the same run.
    ///
    /// # Errors
    /// What keeps them from it, told by rank 0.
    pub(crate) fn agree<T>(
        &mut self,
        prepared: Result<T, RunError>,
        plan_of: impl FnOnce(&T) -> &Plan,
    ) -> Result<T, RunError> {
        match agree(&mut self.endpoint, prepared, plan_of) {
            Ok(prepared) => Ok(prepared),
            Err(Refusal::Known(error)) => Err(self.common(&error)),
            Err(Refusal::Transport(error)) => self.fail(&RunError::Ranks(error.to_string()), Exit::PeerLost),
        }
    }

    /// Goes on where all is well on every rank.
    ///
    /// # Errors
    /// What is not, told by rank 0.
    pub(crate) fn all_well<T>(&mut self, result: Result<T, RunError>) -> Result<T, RunError> {
        match all_well(&mut self.endpoint, result.as_ref().err()) {
            Ok(()) => result,
            Err(Refusal::Known(error)) => Err(self.common(&error)),
            Err(Refusal::Transport(error)) => self.fail(&RunError::Ranks(error.to_string()), Exit::PeerLost),
        }
    }

    /// What the rank that speaks for all says. Where ranks cannot talk, the job ends.
    pub(crate) fn told(&mut self, says: bool) -> bool {
        match self.endpoint.all_gather(&[u8::from(says)]) {
            Ok(all) => all.first().is_some_and(|first| first == &[1]),
            Err(error) => self.fail(&RunError::Ranks(error.to_string()), Exit::PeerLost),
        }
    }

    /// Runs this rank's part of the plan that all agreed on. Rank 0 gets the summary.
    ///
    /// # Errors
    /// What ended the run on every rank alike, told by rank 0. Anything else ends the job.
    pub(crate) fn run(&mut self, plan: &Plan, observer: &Observer) -> Result<Option<Summary>, RunError> {
        let run = &plan.config.run;
        self.set_exchange(&plan.config);
        // Not given away: while a panic unwinds, the endpoint stays and can end the job.
        let endpoint = &mut self.endpoint;
        let end = catch_unwind(AssertUnwindSafe(|| rank::drive(endpoint, plan, observer, true)));
        let end = end.unwrap_or_else(|payload| {
            let rank = self.endpoint.rank();
            let (complete, steps) = (observer.complete.load(Ordering::Relaxed), run.steps);
            let reason = RankFailure::from_panic(rank, payload).to_string();
            let error = RunError::PeerLost { rank, complete, steps, reason };
            observer.fail(&error);
            self.fail(&error, Exit::PeerLost)
        });
        match end.result {
            Ok(gathered) => Ok(gathered.map(|gathered| Summary::new(plan, gathered))),
            Err(error @ (RankError::Step(StepError::NonFinite { .. }) | RankError::Agreed { .. })) => {
                let error = told(error, end.complete, run.steps);
                observer.fail(&error);
                Err(self.common(&error))
            }
            Err(error) => {
                let error = told(error, end.complete, run.steps);
                observer.fail(&error);
                self.fail(&error, error.exit())
            }
        }
    }

    /// What is between the ranks, measured by all of them together. Where ranks cannot talk, the job ends.
    pub(crate) fn measured(&mut self, config: &Config) -> Network {
        self.set_exchange(config);
        measured(&mut self.endpoint)
            .unwrap_or_else(|error| self.fail(&RunError::Ranks(error.to_string()), Exit::PeerLost))
    }

    /// Has ranks exchange as the configuration says.
    fn set_exchange(&mut self, config: &Config) {
        self.set_peer_timeout(config.run.peer_timeout);
        self.endpoint.set_method(match config.run.mpi_exchange {
            MpiExchange::Alltoallv => Method::Alltoallv,
            MpiExchange::Sparse => Method::Sparse,
        });
    }

    fn set_peer_timeout(&mut self, timeout: Duration) {
        self.endpoint.set_peer_timeout(timeout).expect("the configuration has none of zero");
    }

    /// An error that every rank has: told once, while the job is still there. Ranks leave it together, and where the first
    /// exit code arrives that is not 0 a launcher ends whatever is left.
    fn common(&self, error: &RunError) -> RunError {
        if self.speaks() {
            (self.complain)(error);
        }
        RunError::ToldElsewhere { exit: error.exit() }
    }

    /// Leaves the job, together with all other ranks.
    pub(crate) fn close(mut self) {
        if let Err(error) = self.endpoint.close() {
            self.fail(&RunError::Ranks(error.to_string()), Exit::PeerLost);
        }
    }

    /// Tells what went wrong on this rank, unless another one does, and ends the job.
    fn fail(&mut self, error: &dyn Display, exit: Exit) -> ! {
        if !self.endpoint.told_by_other() {
            (self.complain)(error);
        }
        self.endpoint.abort_with(exit as i32)
    }

    /// Ends this process at once, which makes the launcher end the others.
    pub(crate) fn quit() -> ! {
        Mpi::exit_at_once(Exit::Interrupted as i32)
    }
}
