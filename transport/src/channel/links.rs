//! One rank's ends of the channels, and the record of the first failure.

use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, SendTimeoutError, Sender, TryRecvError, bounded};

use crate::origin::{Origin, left_early};
use crate::patience::Patience;
use crate::{Buffers, Incoming, Rank, TransportError};

/// Messages that a channel holds. Lockstep leaves at most two unread, so a send never waits. (With none, a
/// rank would wait in its first send for a peer that waits in its own.)
const CAPACITY: usize = 2;

/// How long to wait for one peer before looking whether another one, also still needed, is gone.
const SLICE: Duration = Duration::from_millis(20);

/// A rank's place in the run.
#[derive(Debug, PartialEq)]
enum State {
    /// Not yet on its thread.
    Built,
    Running,
    /// The run is over for this rank; its channels are closed.
    Failed(TransportError),
}

/// A message with its sender's flag word.
type Frame = (Vec<u8>, u128);

/// One rank's ends of the channels to all others.
///
/// Whatever closes the channels records its cause in `origin` *first*: a peer that finds a channel closed then finds
/// the cause as well, and where there is none, the rank has left of its own accord.
#[derive(Debug)]
pub(super) struct Links {
    rank: Rank,
    peer_timeout: Duration,
    /// By destination; none to oneself.
    senders: Vec<Option<Sender<Frame>>>,
    /// By source; none from oneself.
    receivers: Vec<Option<Receiver<Frame>>>,
    /// By source: whether the message of the present round still has to come.
    awaited: Vec<bool>,
    state: State,
    origin: Arc<OnceLock<Origin>>,
}

/// Joins every rank with every other.
pub(super) fn join(size: usize, peer_timeout: Duration) -> Vec<Links> {
    let origin = Arc::new(OnceLock::new());
    let mut links: Vec<Links> = Rank::all(size)
        .map(|rank| Links {
            rank,
            peer_timeout,
            senders: vec![None; size],
            receivers: vec![None; size],
            awaited: vec![false; size],
            state: State::Built,
            origin: Arc::clone(&origin),
        })
        .collect();
    for from in 0..size {
        for to in (0..size).filter(|&to| to != from) {
            let (sender, receiver) = bounded(CAPACITY);
            links[from].senders[to] = Some(sender);
            links[to].receivers[from] = Some(receiver);
        }
    }
    links
}

impl Links {
    pub(super) fn rank(&self) -> Rank {
        self.rank
    }

    pub(super) fn size(&self) -> usize {
        self.awaited.len()
    }

    /// From here on a drop is a departure and no failure to start.
    pub(super) fn join_run(&mut self) {
        self.state = State::Running;
    }

    /// The error that ended the run for this rank, if one did.
    pub(super) fn check(&self) -> Result<(), TransportError> {
        match &self.state {
            State::Failed(error) => Err(error.clone()),
            State::Built | State::Running => Ok(()),
        }
    }

    /// Sends a frame to every rank and receives one from each. An error ends the run for this rank.
    pub(super) fn exchange(
        &mut self,
        outgoing: (&mut Buffers, u128),
        incoming: &mut Incoming,
    ) -> Result<(), TransportError> {
        let started = Instant::now();
        self.send(outgoing, incoming, started)
            .and_then(|()| {
                let sent = Instant::now();
                self.receive(incoming, started)?;
                incoming.end(sent.elapsed());
                Ok(())
            })
            .map_err(|error| self.fail(error))
    }

    /// Records `reason` and closes the channels.
    pub(super) fn abort(&mut self, reason: &str) {
        self.fail(TransportError::PeerLost { rank: self.rank, reason: format!("it aborted: {reason}") });
    }

    /// Sends every frame; the frames of the round before, given back by `incoming`, become the memory of the next.
    pub(super) fn send(
        &mut self,
        (outgoing, word): (&mut Buffers, u128),
        incoming: &mut Incoming,
        started: Instant,
    ) -> Result<(), TransportError> {
        for (to, sender) in Rank::all(self.size()).zip(&self.senders) {
            let message = outgoing.take(to, incoming);
            let Some(sender) = sender else {
                incoming.accept(to, message, word);
                continue;
            };
            let left = self.peer_timeout.saturating_sub(started.elapsed());
            sender.send_timeout((message, word), left).map_err(|error| match error {
                SendTimeoutError::Disconnected(_) => left_early(to),
                SendTimeoutError::Timeout(_) => TransportError::Timeout { rank: to, waited: started.elapsed() },
            })?;
        }
        Ok(())
    }

    /// Receives one frame from every other rank.
    pub(super) fn receive(&mut self, incoming: &mut Incoming, started: Instant) -> Result<(), TransportError> {
        for (awaited, receiver) in self.awaited.iter_mut().zip(&self.receivers) {
            *awaited = receiver.is_some();
        }
        let mut patience = Patience::new();
        for from in Rank::all(self.size()) {
            while self.awaited[from.index()] {
                let left = self.peer_timeout.saturating_sub(patience.waited());
                match self.receiver(from).recv_timeout(left.min(SLICE)) {
                    Ok(frame) => self.accept(from, frame, incoming),
                    Err(RecvTimeoutError::Disconnected) => return Err(left_early(from)),
                    Err(RecvTimeoutError::Timeout) => {
                        self.sweep(incoming)?;
                        if self.awaited[from.index()] && patience.waited() >= self.peer_timeout {
                            return Err(TransportError::Timeout { rank: from, waited: started.elapsed() });
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Takes what has arrived out of order. One frame per rank at most, so the next round is left alone.
    ///
    /// Without this a rank would notice the death of one peer only after a slow other one had answered.
    fn sweep(&mut self, incoming: &mut Incoming) -> Result<(), TransportError> {
        for from in Rank::all(self.size()) {
            if self.awaited[from.index()] {
                match self.receiver(from).try_recv() {
                    Ok(frame) => self.accept(from, frame, incoming),
                    Err(TryRecvError::Disconnected) => return Err(left_early(from)),
                    Err(TryRecvError::Empty) => {}
                }
            }
        }
        Ok(())
    }

    fn receiver(&self, from: Rank) -> &Receiver<Frame> {
        self.receivers[from.index()].as_ref().expect("every other rank has a channel to this one")
    }

    fn accept(&mut self, from: Rank, (message, word): Frame, incoming: &mut Incoming) {
        incoming.accept(from, message, word);
        self.awaited[from.index()] = false;
    }

    /// Records `error` as the origin unless there is one, closes the channels, and returns what this rank reports.
    fn fail(&mut self, error: TransportError) -> TransportError {
        let rank = self.rank;
        let origin = self.origin.get_or_init(|| Origin { error, reporter: rank });
        let report = origin.as_seen_by(rank);
        self.state = State::Failed(report.clone());
        // At once, not on drop: the caller may keep a failed endpoint for long, and the others must not wait for it.
        self.senders.iter_mut().for_each(|sender| *sender = None);
        self.receivers.iter_mut().for_each(|receiver| *receiver = None);
        report
    }
}

impl Drop for Links {
    fn drop(&mut self) {
        let reason = match self.state {
            // A consequence of what is already on record.
            State::Failed(_) => return,
            _ if std::thread::panicking() => "it panicked",
            State::Built => "it never started",
            State::Running => return,
        };
        self.fail(TransportError::PeerLost { rank: self.rank, reason: reason.to_owned() });
    }
}
