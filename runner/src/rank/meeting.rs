//! Meetings: between two steps all ranks answer what rank 0 asks, as often as it likes; meanwhile time stands still.
//!
//! Rank 0 lets the ranks know by the word that every step carries anyway ([`World::request_meeting`]), so that nothing is sent
//! while nobody has a question.

use super::{Observer, RankError};
use atoll_core::{StepReport, World};
use atoll_transport::{Collective, Rank, Transport};
use std::fmt::Debug;
use std::time::Duration;

/// What rank 0 does next in a meeting.
#[derive(Clone, PartialEq, Debug)]
pub enum Next {
    /// It asks all ranks this.
    Ask(Vec<u8>),
    /// It has no question yet; the others are to wait.
    Wait,
    /// It lets time go on.
    GoOn,
}

/// What a rank holds, when it is asked.
#[derive(Clone, Copy, Debug)]
pub struct Held<'a> {
    /// The rank.
    pub rank: Rank,
    /// Its world.
    pub world: &'a World,
    /// What the last step was like; that of no step before the first.
    pub last: &'a StepReport,
    /// How long it has waited for other ranks in all steps.
    pub waited: Duration,
}

/// Who asks. Every process of a run has one; only that of rank 0 has questions.
pub trait Host: Debug + Send + Sync {
    /// On rank 0, before a step: whether ranks are to meet after it. It may wait here, which slows the run down.
    fn calls(&self, steps: u64) -> bool;
    /// On rank 0, in a meeting after so many steps: what is next, in no longer than `patience`.
    fn next(&self, steps: u64, patience: Duration) -> Next;
    /// On every rank: what it answers.
    fn answer(&self, question: &[u8], held: &Held<'_>) -> Vec<u8>;
    /// On rank 0: the answers to its last question, by rank.
    fn hear(&self, answers: Vec<Vec<u8>>);
    /// On every rank: whether to meet once more when all steps are made, until rank 0 goes on or the run is asked to stop.
    fn stays(&self) -> bool;
}

/// The first byte of what rank 0 tells the others.
const ASK: u8 = 1;
/// See [`ASK`].
const WAIT: u8 = 2;
/// What other ranks say: nothing, or that they are to stop.
const STOP: u8 = 1;

/// Meets, until rank 0 lets time go on, or somebody asks the run to stop.
///
/// # Errors
/// If a rank is lost.
pub(super) fn hold(
    host: &dyn Host,
    held: &Held<'_>,
    observer: &Observer,
    peer_timeout: Duration,
    transport: &mut impl Transport,
) -> Result<(), RankError> {
    // Whoever is silent for too long is given up.
    let patience = (peer_timeout / 4).min(Duration::from_millis(250));
    loop {
        let mut word = if observer.stop.is_requested() { vec![STOP] } else { Vec::new() };
        if held.rank == Rank(0) && word.is_empty() {
            word = match host.next(held.world.step_count(), patience) {
                Next::Ask(question) => [&[0, ASK][..], &question].concat(),
                Next::Wait => vec![0, WAIT],
                Next::GoOn => vec![0],
            };
        }
        let words = transport.all_gather(&word).map_err(RankError::Transport)?;
        if words.iter().any(|word| word.first() == Some(&STOP)) {
            return Ok(());
        }
        match words[0].get(1) {
            Some(&ASK) => {
                let answer = host.answer(&words[0][2..], held);
                if let Some(answers) = transport.gather(Rank(0), &answer).map_err(RankError::Transport)? {
                    host.hear(answers);
                }
            }
            Some(_) => {}
            None => return Ok(()),
        }
    }
}
