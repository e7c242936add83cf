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
    let (mut summary, mut errors) = (None, Vec::new());
    for end in ends {
        match end.map(|end| end.result) {
            Ok(Ok(None)) => {}
            Ok(Ok(Some(gathered))) => summary = Some(Summary::new(plan, gathered)),
            Ok(Err(error)) => errors.push((Nearness::of_error(&error), told(error, complete, steps))),
            Err(RankFailure::NotStarted { rank, reason }) => {
                errors.push((Nearness::Cause, RunError::Threads { rank, threads: 1, reason }));
            }
            Err(failure) => {
                let (rank, reason) = (failure.rank(), failure.to_string());
                let error = RunError::PeerLost { rank, complete, steps, reason };
                errors.push((Nearness::of_failure(&failure), error));
            }
        }
    }
    // Among equals, the lowest rank's.
    match (errors.into_iter().min_by_key(|(nearness, _)| *nearness), summary) {
        (Some((_, error)), _) => Err(error),
        (None, Some(summary)) => Ok(summary),
        (None, None) => unreachable!("a run without errors has a summary from rank 0"),
    }
}

/// How near to the cause of a run's end is what one rank says of it; the nearest is told.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Nearness {
    /// It names the cause, or what all ranks have agreed on.
    Cause,
    /// Of a rank that is lost it says how that ended, or what it sent.
    Witness,
    /// It merely misses another rank.
    Misses,
    /// It had to be killed: it may be the lost one itself, or not, and the others know better.
    Killed,
}

impl Nearness {
    fn of_error(error: &RankError) -> Self {
        match error {
            RankError::Step(StepError::Halo(ExchangeError::Frame { .. } | ExchangeError::Tile { .. })) => Self::Witness,
            error => match error.transport() {
                Some(TransportError::PeerLost { .. } | TransportError::Timeout { .. }) => Self::Misses,
                // It could not take part itself.
                Some(TransportError::Usage { .. }) | None => Self::Cause,
            },
        }
    }

    fn of_failure(failure: &RankFailure) -> Self {
        if matches!(failure, RankFailure::Outlived { .. }) { Self::Killed } else { Self::Witness }
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
        RankError::Agreed { text, exit } => RunError::Relayed { text, exit },
        #[cfg(feature = "iceoryx2")]
        RankError::Told { text, exit } => RunError::Relayed { text, exit },
        RankError::Step(StepError::NonFinite { step, id }) => RunError::NonFinite { step, id },
        RankError::Step(StepError::Protocol { step, tile }) => RunError::Protocol { step, tile },
        RankError::Step(StepError::FloatMode { step }) => RunError::FloatMode { step },
        RankError::Step(StepError::Halfway { .. }) => unreachable!("a run ends with the step that failed"),
        RankError::Step(StepError::Halo(ExchangeError::Transport(error))) => transport(error),
        RankError::Step(StepError::Halo(
            error @ (ExchangeError::Frame { from, .. } | ExchangeError::Tile { from, .. }),
        )) => RunError::PeerLost { rank: from, complete, steps, reason: error.to_string() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::error::Exit;
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
    fn a_rank_without_a_thread_is_no_lost_one() {
        let not_started = RankFailure::NotStarted { rank: Rank(2), reason: "no more".to_owned() };
        let error = outcome(&plan(), vec![failed(0, lost(2)), failed(0, lost(2)), Err(not_started)], 0).unwrap_err();
        assert_eq!(error.to_string(), "rank 2 cannot start a thread: no more; use fewer threads or ranks");
        assert_eq!(error.exit(), Exit::Usage);
    }

    #[test]
    fn the_nearest_to_the_cause_is_told_and_of_equals_the_lowest_rank() {
        let aborted = |rank| Err(RankFailure::Aborted { rank: Rank(rank), reason: "no more".to_owned() });
        let killed = |rank| Err(RankFailure::Outlived { rank: Rank(rank) });
        let agreed = || failed(2, RankError::Agreed { text: "the disk is full".to_owned(), exit: Exit::Output });
        let died = |rank| Err(RankFailure::Died { rank: Rank(rank), how: "was killed by signal 9".to_owned() });
        let misses = || {
            let error = TransportError::PeerLost { rank: Rank(1), reason: "rank 1 may be slow".to_owned() };
            failed(2, RankError::Transport(error))
        };
        let usage = TransportError::Usage { message: "rank 1 was asked twice".to_owned() };
        let refused = || failed(2, RankError::Transport(usage.clone()));
        for (ends, expected) in [
            (
                vec![killed(0), failed(2, lost(1)), aborted(1)],
                "rank 1 was lost after 2 of 9 steps: rank 1 aborted: no more",
            ),
            (vec![killed(0), failed(2, lost(1)), killed(2)], "rank 1 was lost after 2 of 9 steps: it panicked"),
            (vec![killed(0), killed(1)], "rank 0 was lost after 2 of 9 steps: rank 0 was killed, as it did not"),
            (vec![aborted(0), aborted(1), agreed()], "the disk is full"),
            // As it is, not as it reads: this one only misses another.
            (vec![misses(), died(1)], "rank 1 was lost after 2 of 9 steps: rank 1 was killed by signal 9"),
            // Who could not take part itself knows why; the others only miss it.
            (vec![failed(2, lost(2)), refused()], "the transport refused after 2 of 9 steps: rank 1 was asked twice"),
        ] {
            let told = outcome(&plan(), ends, 2).unwrap_err().to_string();
            assert!(told.starts_with(expected), "{told}");
        }
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
        // Four rounds before the first step, then one a step.
        let ends = channel::run(3, ChannelOptions::default(), |inner| {
            rank::drive(Dying { inner, rounds_left: 8 }, &plan, &Observer::default(), false)
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
