//! Meetings: between two steps all ranks answer what rank 0 asks, as often as it likes; meanwhile time stands still.
//!
//! Rank 0 lets the ranks know by the word that every step carries anyway ([`World::request_meeting`]), so that nothing is sent
//! while nobody has a question.

use super::commands::Commander;
use super::halo::RankHalo;
use super::{Observer, RankError};
use crate::plan::{Assignment, Plan};
use atoll_core::{StepReport, World};
use atoll_transport::{Collective, Counting, Rank, Stats, Transport, TransportError};
use std::fmt::Debug;
use std::time::{Duration, Instant};

/// What rank 0 does next in a meeting.
#[derive(Clone, PartialEq, Debug)]
pub enum Next {
    /// It asks all ranks this.
    Ask(Vec<u8>),
    /// It has no question yet; the others are to wait.
    Wait,
    /// As [`Next::Wait`], and whoever drives the run is told that it waits for him.
    Announce,
    /// It has this done by all ranks, lines of commands as a file has them, each after its number and a tab.
    Do(Vec<u8>),
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
    /// Who holds which tile.
    pub assignment: &'a Assignment,
    /// What the last step was like; that of no step before the first.
    pub last: &'a StepReport,
    /// How long it has waited for other ranks in all steps.
    pub waited: Duration,
}

/// Who asks. Every process of a run has one; only that of rank 0 has questions.
pub trait Host: Debug + Send + Sync {
    /// On rank 0, before a step: whether ranks are to meet once so many steps are made.
    fn calls(&self, steps: u64) -> bool;
    /// On rank 0, in a meeting after so many steps: what is next, in no longer than `patience`.
    fn next(&self, steps: u64, patience: Duration) -> Next;
    /// On every rank: what it answers.
    fn answer(&self, question: &[u8], held: &Held<'_>) -> Vec<u8>;
    /// On rank 0: the answers to its last question, by rank.
    fn hear(&self, answers: Vec<Vec<u8>>);
    /// On rank 0, in the end: how many lines it never had done, and the first step that one was for.
    fn undone(&self) -> Option<(usize, u64)> {
        None
    }
    /// What whoever looks may want to know, a sentence, such as that a command is refused.
    fn note(&self, _text: &str) {}
    /// Why the run failed.
    fn fail(&self, _why: &str) {}
    /// On every rank alike: whether to meet before the first step as well, and when all are made, then until the run is asked to
    /// stop.
    fn lingers(&self) -> bool;
}

/// The first byte of what rank 0 tells the others.
const ASK: u8 = 1;
/// See [`ASK`].
const WAIT: u8 = 2;
/// See [`ASK`].
const DO: u8 = 3;
/// See [`ASK`].
const ANNOUNCE: u8 = 4;
/// What other ranks say: nothing, or that they are to stop.
const STOP: u8 = 1;

/// The meetings of one rank, and what they have cost. Where there is no host, there are none.
#[derive(Debug)]
pub(super) struct Meetings<'a> {
    observer: &'a Observer,
    /// Whether somebody drives the run, who ends it where he stops it.
    is_driven: bool,
    /// The longest that rank 0 is silent.
    patience: Duration,
    /// How long time stood still because somebody wished so.
    pub(super) stood: Duration,
    /// How long ranks asked and answered.
    pub(super) spent: Duration,
    /// What they sent each other for that.
    pub(super) sent: Stats,
}

impl<'a> Meetings<'a> {
    /// None yet. Whoever is silent for the plan's `peer_timeout` is given up.
    pub(super) fn new(observer: &'a Observer, plan: &Plan) -> Self {
        let patience = (plan.config.run.peer_timeout / 4).min(Duration::from_millis(250));
        let (stood, spent, sent) = Default::default();
        Self { observer, is_driven: plan.commands.drives, patience, stood, spent, sent }
    }

    fn host(&self) -> Option<&'a dyn Host> {
        self.observer.host.as_deref()
    }

    /// Before a step: lets all ranks know if they are to meet after it.
    pub(super) fn prepare(&self, rank: Rank, world: &mut World) {
        if rank == Rank(0) && self.host().is_some_and(|host| host.calls(world.step_count() + 1)) {
            world.request_meeting();
        }
    }

    /// Meets before the first step, or after the last, if that is wanted. Returns whether the run ends here.
    ///
    /// # Errors
    /// If a rank is lost, or what is to be done cannot be.
    pub(super) fn linger<T: Transport>(
        &mut self,
        world: &mut World,
        last: &StepReport,
        halo: &mut RankHalo<Counting<T>>,
        commander: &mut Commander,
    ) -> Result<bool, RankError> {
        if !self.host().is_some_and(Host::lingers) {
            return Ok(false);
        }
        // Before the first step there is something to see as well.
        world.settle();
        self.hold(world, last, halo, commander)
    }

    /// Meets, until rank 0 lets time go on, or somebody asks the run to stop. Returns whether the run ends here, on all ranks alike:
    /// whoever drives it allowed no further step.
    ///
    /// # Errors
    /// If a rank is lost, or what is to be done cannot be.
    pub(super) fn hold<T: Transport>(
        &mut self,
        world: &mut World,
        last: &StepReport,
        halo: &mut RankHalo<Counting<T>>,
        commander: &mut Commander,
    ) -> Result<bool, RankError> {
        let Some(host) = self.host() else { return Ok(false) };
        let (waited, rank) = (halo.waited(), halo.transport().rank());
        let (assignment, transport) = halo.parts();
        let (before, mut stopped) = (transport.stats(), false);
        while !(commander.is_over() || stopped) {
            let held = Held { rank, world, assignment, last, waited };
            match self.go_round(host, &held, transport).map_err(RankError::Transport)? {
                Round::Over => break,
                Round::Stopped => stopped = true,
                Round::Answered | Round::Waits => {}
                Round::Announced => commander.wait(world.step_count()),
                Round::Told(words) => commander.hear(&words, world, transport, self.observer)?,
            }
        }
        self.sent += transport.stats().since(&before);
        Ok(stopped && self.is_driven)
    }

    /// One word of rank 0 and what follows from it.
    fn go_round(
        &mut self,
        host: &dyn Host,
        held: &Held<'_>,
        transport: &mut impl Transport,
    ) -> Result<Round, TransportError> {
        let start = Instant::now();
        let mut word = if self.observer.stop.is_requested() { vec![STOP] } else { Vec::new() };
        if held.rank == Rank(0) && word.is_empty() {
            word = match host.next(held.world.step_count(), self.patience) {
                Next::Ask(question) => [&[0, ASK][..], &question].concat(),
                Next::Wait => vec![0, WAIT],
                Next::Announce => vec![0, ANNOUNCE],
                Next::Do(words) => [&[0, DO][..], &words].concat(),
                Next::GoOn => vec![0],
            };
        }
        let mut words = transport.all_gather(&word)?;
        self.stood += start.elapsed();
        if words.iter().any(|word| word.first() == Some(&STOP)) {
            return Ok(Round::Stopped);
        }
        let word = words.swap_remove(0);
        Ok(match word.get(1) {
            Some(&ASK) => {
                let start = Instant::now();
                let answer = host.answer(&word[2..], held);
                if let Some(answers) = transport.gather(Rank(0), &answer)? {
                    host.hear(answers);
                }
                self.spent += start.elapsed();
                Round::Answered
            }
            Some(&DO) => Round::Told(word[2..].to_vec()),
            Some(&ANNOUNCE) => Round::Announced,
            Some(_) => Round::Waits,
            None => Round::Over,
        })
    }
}

/// What came of a word of rank 0.
enum Round {
    /// The meeting is over.
    Over,
    /// Somebody asked the run to stop.
    Stopped,
    /// A question was answered.
    Answered,
    /// It had nothing to say.
    Waits,
    /// It waits for whoever drives the run.
    Announced,
    /// It has something done.
    Told(Vec<u8>),
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::launch;
    use crate::plan::Plan;
    use crate::rank::StopFlag;
    use crate::summary::Summary;
    use std::sync::{Arc, Mutex};

    /// Asks twice after every third step, waits once between, and once all steps are made.
    #[derive(Debug, Default)]
    struct Curious {
        lingers: bool,
        asked: Mutex<Vec<u64>>,
        heard: Mutex<Vec<Vec<Vec<u8>>>>,
        stop: StopFlag,
    }

    impl Host for Curious {
        fn calls(&self, steps: u64) -> bool {
            steps.is_multiple_of(3)
        }

        fn next(&self, steps: u64, patience: Duration) -> Next {
            assert!(patience > Duration::ZERO);
            let mut asked = self.asked.lock().unwrap();
            asked.push(steps);
            match asked.iter().filter(|asked| **asked == steps).count() {
                1 | 3 => Next::Ask(steps.to_le_bytes().to_vec()),
                2 => Next::Wait,
                _ if steps == 10 => {
                    self.stop.request();
                    Next::Wait
                }
                _ => Next::GoOn,
            }
        }

        fn answer(&self, question: &[u8], held: &Held<'_>) -> Vec<u8> {
            assert_eq!(question, held.world.step_count().to_le_bytes());
            vec![held.rank.0 as u8; held.rank.index() + 1]
        }

        fn hear(&self, answers: Vec<Vec<u8>>) {
            self.heard.lock().unwrap().push(answers);
        }

        fn lingers(&self) -> bool {
            self.lingers
        }
    }

    fn run(host: Option<Arc<Curious>>) -> Summary {
        let text = "[scene]\nkind = \"rooms\"\nbodies = 300\n[run]\nsteps = 10\nranks = 3\ntiles = [3, 3]\n";
        let plan = Plan::new(&Config::from_toml_str("test", text, &[]).unwrap()).unwrap();
        let stop = host.as_ref().map(|host| host.stop.clone()).unwrap_or_default();
        let host = host.map(|host| host as Arc<dyn Host>);
        launch::run(&plan, &Observer { host, stop, ..Observer::default() }).unwrap()
    }

    #[test]
    fn ranks_meet_when_rank_0_calls_and_that_changes_nothing() {
        let alone = run(None);
        for (lingers, meetings) in [(false, vec![3, 6, 9]), (true, vec![0, 3, 6, 9, 10])] {
            let host = Arc::new(Curious { lingers, ..Curious::default() });
            let met = run(Some(Arc::clone(&host)));
            assert_eq!((&met.state_hash, &met.contact_hash), (&alone.state_hash, &alone.contact_hash));
            assert_eq!((met.steps, met.bytes_sent, met.interrupted), (10, alone.bytes_sent, false));
            let mut asked = host.asked.lock().unwrap().clone();
            asked.dedup();
            assert_eq!(asked, meetings);
            let heard = host.heard.lock().unwrap();
            assert_eq!(heard.len(), 2 * meetings.len());
            assert!(heard.iter().all(|answers| *answers == [vec![0], vec![1; 2], vec![2; 3]]));
        }
    }
}
