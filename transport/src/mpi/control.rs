//! Waiting that does not last for ever: deadlines, signs of life, and who is to blame.

use std::ffi::c_int;
use std::thread;
use std::time::{Duration, Instant};

use super::notice::Notice;
use super::pause::{awake, pause};
use super::raw::{Communicator, Pending};
use crate::origin::{Origin, left_early};
use crate::patience::Patience;
use crate::{Rank, TransportError};

/// The only tag of notices.
const TAG: c_int = 0;

/// How often to look for notices while waiting.
const LOOK: Duration = Duration::from_millis(1);

/// How long ranks have to answer before one of them is blamed.
const ANSWER: Duration = Duration::from_secs(1);

/// How much longer a rank waits for the verdict of a lower one that lives, so that one of them speaks for all.
const DEFERENCE: Duration = Duration::from_secs(2);

/// Ranks that end within so short a time do not tell each other.
const TELL_AFTER: Duration = Duration::from_millis(20);

/// How long a rank that gives up stays to tell the others.
const FAREWELL: Duration = Duration::from_millis(100);

/// What a rank is doing, as far as other ranks matter to it.
#[derive(Debug, PartialEq)]
enum Stage {
    /// It needs something from every other rank in each round.
    Rounds,
    /// It has completed its last round and waits for the others to do so.
    Leaving { since: Instant, told: bool },
}

/// What one look at the operations under way brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Found {
    /// Everything is complete.
    All,
    /// Something has begun to move.
    Something,
    /// Nothing that would be known.
    Nothing,
}

impl Found {
    pub(super) fn all_if(complete: bool) -> Found {
        if complete { Found::All } else { Found::Nothing }
    }
}

/// One rank's watch over the others.
///
/// An operation of the library cannot fail because one peer is gone; it just never ends. So a rank that waits looks at
/// notices, on a communicator of their own, now and then; and one that has waited for the whole peer timeout asks all
/// others for a sign of life, which every rank gives that is waiting itself.
pub(super) struct Watch {
    communicator: Communicator,
    pub(super) peer_timeout: Duration,
    /// Completed by this rank.
    rounds: u64,
    stage: Stage,
    /// How many rounds each rank had completed that has left.
    left: Vec<Option<u64>>,
    /// The number of the inquiry under way, and by rank the completed rounds of those who answered.
    inquiry: u64,
    answers: Vec<Option<u64>>,
    /// Whether another rank has told everybody that the run is over.
    told_by_other: bool,
    sends: Vec<Pending<Vec<u8>>>,
    receives: Vec<(Rank, Pending<Vec<u8>>)>,
}

impl Watch {
    pub(super) fn new(communicator: Communicator, peer_timeout: Duration) -> Watch {
        let size = communicator.size();
        Watch {
            communicator,
            peer_timeout,
            rounds: 0,
            stage: Stage::Rounds,
            left: vec![None; size],
            inquiry: 0,
            answers: vec![None; size],
            told_by_other: false,
            sends: Vec::new(),
            receives: Vec::new(),
        }
    }

    /// The rounds that this rank has completed.
    pub(super) fn rounds(&self) -> u64 {
        self.rounds
    }

    /// Whether it was another rank that told this one why the run is over.
    pub(super) fn told_by_other(&self) -> bool {
        self.told_by_other
    }

    /// A round is over.
    pub(super) fn count_round(&mut self) {
        self.rounds += 1;
    }

    /// Looks again and again, and returns how long it took until everything was found. Meanwhile so many `bytes` may be on
    /// their way, from the start or from when something is found.
    ///
    /// # Errors
    /// If a rank that is needed has left, if another one has given up, or if the peer timeout has passed since
    /// `started`.
    pub(super) fn wait(
        &mut self,
        started: Instant,
        bytes: usize,
        mut find: impl FnMut() -> Found,
    ) -> Result<Duration, TransportError> {
        let awake = awake(bytes);
        let began = Instant::now();
        let (mut looked, mut quiet_since) = (began, began);
        loop {
            let found = find();
            let now = Instant::now();
            match found {
                Found::All => break,
                Found::Something => quiet_since = now,
                Found::Nothing => {}
            }
            if now - looked >= LOOK {
                looked = now;
                self.look()?;
                if now - started >= self.peer_timeout {
                    self.inquire(started, &mut find)?;
                    break;
                }
            }
            pause((now - quiet_since).saturating_sub(awake));
        }
        Ok(began.elapsed())
    }

    /// Waits until every rank has come here, so that the library can be finalized.
    pub(super) fn leave(&mut self) -> Result<(), TransportError> {
        let since = Instant::now();
        self.stage = Stage::Leaving { since, told: false };
        let mut barrier = self.communicator.barrier();
        self.wait(since, 0, || Found::all_if(barrier.test()))?;
        barrier.finish();
        self.flush();
        // Those that came early may have said so to some that never had to look.
        drop(self.receive());
        Ok(())
    }

    /// Gives the communicator back, after [`leave`](Watch::leave).
    pub(super) fn free(self) {
        self.communicator.free();
    }

    /// Tells all others that this rank gives up, unless they know.
    pub(super) fn give_up(&mut self, error: &TransportError) {
        if !self.told_by_other {
            self.tell_all(&Notice::Failed(error.clone()));
            self.flush();
        }
    }

    /// Reads what other ranks have told.
    fn look(&mut self) -> Result<(), TransportError> {
        self.retire_sends();
        for (from, bytes) in self.receive() {
            self.hear(from, &bytes)?;
        }
        match self.stage {
            Stage::Rounds => self.check_left(),
            Stage::Leaving { since, told: false } if since.elapsed() >= TELL_AFTER => {
                self.stage = Stage::Leaving { since, told: true };
                self.tell_all(&Notice::Left { rounds: self.rounds });
                Ok(())
            }
            Stage::Leaving { .. } => Ok(()),
        }
    }

    /// What has arrived since the last time.
    fn receive(&mut self) -> Vec<(Rank, Vec<u8>)> {
        while let Some(message) = self.communicator.arrived(TAG) {
            self.receives.push((message.from, message.receive()));
        }
        let complete = self.receives.extract_if(.., |(_, receive)| receive.test());
        complete.map(|(from, receive)| (from, receive.finish())).collect()
    }

    fn hear(&mut self, from: Rank, bytes: &[u8]) -> Result<(), TransportError> {
        match Notice::from_bytes(bytes) {
            Some(Notice::Ping { number }) => self.tell(from, &Notice::Pong { number, rounds: self.rounds }),
            Some(Notice::Pong { number, rounds }) if number == self.inquiry => {
                self.answers[from.index()] = Some(rounds);
            }
            // It comes late, to an inquiry that is over.
            Some(Notice::Pong { .. }) => {}
            Some(Notice::Left { rounds }) => self.left[from.index()] = Some(rounds),
            Some(Notice::Failed(error)) => {
                self.told_by_other = true;
                return Err(Origin { error, reporter: from }.as_seen_by(self.communicator.rank()));
            }
            None => {
                let reason = "it sent a notice that means nothing here, as if it ran another version".to_owned();
                return Err(TransportError::PeerLost { rank: from, reason });
            }
        }
        Ok(())
    }

    /// Fails if the present round cannot be completed because a rank has left before it: the one that left first.
    fn check_left(&self) -> Result<(), TransportError> {
        let gone = Rank::all(self.left.len()).zip(&self.left).filter_map(|(rank, left)| Some(((*left)?, rank)));
        match gone.min() {
            Some((rounds, rank)) if rounds <= self.rounds => Err(left_early(rank)),
            _ => Ok(()),
        }
    }

    /// Asks all others for a sign of life and blames one, unless everything is found after all.
    fn inquire(&mut self, started: Instant, find: &mut impl FnMut() -> Found) -> Result<(), TransportError> {
        self.inquiry += 1;
        self.answers.fill(None);
        self.answers[self.communicator.rank().index()] = Some(self.rounds);
        self.tell_all(&Notice::Ping { number: self.inquiry });
        let own = self.communicator.rank();
        let mut patience = Patience::new();
        loop {
            let waited = patience.waited();
            if find() == Found::All {
                return Ok(());
            }
            self.look()?;
            let lower_lives = self.answers[..own.index()].iter().any(Option::is_some);
            // Judged by what was found since: an answer or a verdict may have come while this rank was stopped.
            if waited >= if lower_lives { ANSWER + DEFERENCE } else { ANSWER } {
                return Err(blame(own, &self.answers, self.rounds, started.elapsed()));
            }
            thread::sleep(LOOK);
        }
    }

    fn tell(&mut self, rank: Rank, notice: &Notice) {
        self.sends.push(self.communicator.send(rank, TAG, notice.to_bytes()));
    }

    fn tell_all(&mut self, notice: &Notice) {
        let own = self.communicator.rank();
        Rank::all(self.communicator.size()).filter(|&rank| rank != own).for_each(|rank| self.tell(rank, notice));
    }

    fn retire_sends(&mut self) {
        self.sends.extract_if(.., Pending::test).for_each(|send| drop(send.finish()));
    }

    /// Sees notices off. They are short, so it takes long only where nobody will ever receive them.
    fn flush(&mut self) {
        let started = Instant::now();
        self.retire_sends();
        while !self.sends.is_empty() && started.elapsed() < FAREWELL {
            pause(started.elapsed());
            self.retire_sends();
        }
    }
}

/// Whom rank `own`, which has completed so many rounds, is to blame for a wait: the lowest rank that did not answer. If
/// all have answered, each of them waits as well, and something between ranks is slow or lost: then that one of the
/// others that is farthest behind.
fn blame(own: Rank, answers: &[Option<u64>], rounds: u64, waited: Duration) -> TransportError {
    let others = || Rank::all(answers.len()).zip(answers).filter(|&(rank, _)| rank != own);
    if let Some((rank, _)) = others().find(|(_, answer)| answer.is_none()) {
        return TransportError::Timeout { rank, waited };
    }
    let behind = others().min_by_key(|&(_, answer)| answer).map_or(own, |(rank, _)| rank);
    let reason = format!(
        "it answers, as every rank does, but round {} did not end within {waited:.1?} and it is the farthest behind; \
         raise the peer timeout if there was more to send than that allows",
        rounds + 1
    );
    TransportError::PeerLost { rank: behind, reason }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAITED: Duration = Duration::from_secs(30);

    #[test]
    fn the_lowest_rank_that_does_not_answer_is_blamed() {
        let error = blame(Rank(0), &[Some(4), Some(3), None, None], 4, WAITED);
        assert_eq!(error, TransportError::Timeout { rank: Rank(2), waited: WAITED });
    }

    #[test]
    fn if_all_answer_the_farthest_behind_is_blamed_and_the_reason_says_so() {
        let error = blame(Rank(0), &[Some(2), Some(5), Some(4), Some(4)], 5, WAITED);
        assert_eq!(error.blamed(), Some(Rank(2)));
        assert!(error.to_string().contains("it answers") && error.to_string().contains("round 6"), "{error}");
    }
}
