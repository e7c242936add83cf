//! What the ranks of a run have to say about its end, made one.

use crate::error::RunError;
use crate::plan::Plan;
use crate::rank::{ExchangeError, RankEnd, RankError};
use crate::summary::Summary;
use atoll_core::StepError;
use atoll_transport::{RankFailure, TransportError};

/// How every rank ended, in rank order.
pub(super) type Ends = Vec<Result<RankEnd, RankFailure>>;

/// What all ranks together have to say. Most errors reach several ranks; the one nearest to the cause is told. If no rank
/// says how far it came, it is as far as `before`.
pub(super) fn outcome(plan: &Plan, ends: Ends, before: u64) -> Result<Summary, RunError> {
    let steps = plan.config.run.steps;
    let complete = ends.iter().flatten().map(|end| end.complete).min().unwrap_or(before);
    let (mut summary, mut errors, mut outlived) = (None, Vec::new(), Vec::new());
    for end in ends {
        match end.map(|end| end.result) {
            Ok(Ok(None)) => {}
            Ok(Ok(Some(gathered))) => summary = Some(Summary::new(plan, gathered)),
            Ok(Err(error)) => errors.push(told(error, complete, steps)),
            Err(failure) => {
                let (rank, reason) = (failure.rank(), failure.to_string());
                // One that had to be killed may be the lost one itself, or not: the others know better.
                let errors = if matches!(failure, RankFailure::Outlived { .. }) { &mut outlived } else { &mut errors };
                errors.push(RunError::PeerLost { rank, complete, steps, reason });
            }
        }
    }
    // Stable: among equals, the lowest rank's.
    errors.sort_by_key(|error| match error {
        RunError::NonFinite { .. }
        | RunError::Protocol { .. }
        | RunError::FloatMode { .. }
        | RunError::Setup(_)
        | RunError::Threads { .. }
        | RunError::Relayed { .. } => 0,
        // A rank that says itself how it ended, before those that merely miss it.
        RunError::PeerLost { rank, reason, .. } if reason.starts_with(&format!("rank {rank} ")) => 1,
        _ => 2,
    });
    match (errors.into_iter().chain(outlived).next(), summary) {
        (Some(error), _) => Err(error),
        (None, Some(summary)) => Ok(summary),
        (None, None) => unreachable!("a run without errors has a summary from rank 0"),
    }
}

/// A rank's error as the program tells it.
pub(super) fn told(error: RankError, complete: u64, steps: u64) -> RunError {
    let transport = |error: TransportError| match error {
        TransportError::PeerLost { rank, reason } => RunError::PeerLost { rank, complete, steps, reason },
        TransportError::Timeout { rank, waited } => {
            let reason = format!("no answer for {waited:.1?}; if it is only slow, raise run.peer_timeout");
            RunError::PeerLost { rank, complete, steps, reason }
        }
        TransportError::Usage { message } => RunError::Transport { complete, steps, reason: message },
    };
    match error {
        RankError::Setup(error) => RunError::Setup(error),
        RankError::Threads { rank, threads, reason } => RunError::Threads { rank, threads, reason },
        RankError::Transport(error) => transport(error),
        RankError::Agreed { text, exit } | RankError::Told { text, exit } => RunError::Relayed { text, exit },
        RankError::Step(StepError::NonFinite { step, id }) => RunError::NonFinite { step, id },
        RankError::Step(StepError::Protocol { step, tile }) => RunError::Protocol { step, tile },
        RankError::Step(StepError::FloatMode { step }) => RunError::FloatMode { step },
        RankError::Step(StepError::Halo(ExchangeError::Transport(error))) => transport(error),
        RankError::Step(StepError::Halo(error @ ExchangeError::Frame { from, .. })) => {
            RunError::PeerLost { rank: from, complete, steps, reason: error.to_string() }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::rank::{self, Observer};
    use atoll_core::GlobalId;
    use atoll_transport::channel::{self, ChannelOptions};
    use atoll_transport::{Incoming, Outgoing, Rank, Transport};

    fn plan() -> Plan {
        let text = "[scene]\nkind = \"rooms\"\nbodies = 100\n[run]\nranks = 3\nsteps = 9\n";
        Plan::new(&Config::from_toml_str("test", text, &[]).unwrap()).unwrap()
    }

    fn failed(complete: u64, error: RankError) -> Result<RankEnd, RankFailure> {
        Ok(RankEnd { complete, result: Err(error) })
    }

    fn lost(rank: u32) -> RankError {
        let error = TransportError::PeerLost { rank: Rank(rank), reason: "it panicked".to_owned() };
        RankError::Step(StepError::Halo(ExchangeError::Transport(error)))
    }

    #[test]
    fn a_lost_rank_is_named_with_its_own_words_and_the_last_complete_step() {
        let panicked = RankFailure::Panicked { rank: Rank(1), message: "boom".to_owned() };
        let error = outcome(&plan(), vec![failed(4, lost(1)), Err(panicked), failed(3, lost(1))], 9).unwrap_err();
        assert_eq!(error.to_string(), "rank 1 was lost after 3 of 9 steps: rank 1 panicked: boom");
        assert_eq!(error.exit() as u8, 3);
    }

    #[test]
    fn a_state_that_is_not_finite_is_told_once() {
        let error = || RankError::Step(StepError::NonFinite { step: 5, id: GlobalId(77) });
        let told = outcome(&plan(), vec![failed(6, error()), failed(6, error()), failed(5, lost(0))], 0).unwrap_err();
        assert!(told.to_string().starts_with("step 5: the state of body 77 is no longer finite"), "{told}");
        assert_eq!(told.exit() as u8, 4);
    }

    /// Panics in a given round on one rank.
    struct Dying<T> {
        inner: T,
        rounds_left: u32,
    }

    impl<T: Transport> Transport for Dying<T> {
        fn rank(&self) -> Rank {
            self.inner.rank()
        }

        fn size(&self) -> usize {
            self.inner.size()
        }

        fn prepare(&mut self, lengths: &[usize]) -> Result<&mut Outgoing, TransportError> {
            self.inner.prepare(lengths)
        }

        fn exchange(&mut self, incoming: &mut Incoming) -> Result<(), TransportError> {
            if self.rank() == Rank(1) {
                if self.rounds_left == 0 {
                    std::panic::resume_unwind(Box::new("on purpose"));
                }
                self.rounds_left -= 1;
            }
            self.inner.exchange(incoming)
        }

        fn abort(&mut self, reason: &str) -> ! {
            self.inner.abort(reason)
        }
    }

    #[test]
    fn a_rank_that_dies_in_the_middle_ends_the_run_on_all() {
        let plan = plan();
        // One round before the first step, then one a step.
        let ends = channel::run(3, ChannelOptions::default(), |inner| {
            rank::drive(Dying { inner, rounds_left: 5 }, &plan, &Observer::default(), false)
        });
        let error = outcome(&plan, ends, 0).unwrap_err();
        assert_eq!(error.to_string(), "rank 1 was lost after 4 of 9 steps: rank 1 panicked: on purpose");
    }

    #[test]
    fn a_raised_flag_ends_all_ranks_after_the_same_step() {
        let observer = Observer::default();
        observer.stop.request();
        let summary = super::super::run(&plan(), &observer).unwrap();
        assert_eq!((summary.steps, summary.interrupted, summary.bodies_lost), (1, true, 0));
    }
}
