//! One rank's end of a run: its rounds, how it fails and how it leaves.

use std::fs::File;
use std::io::{BufReader, stdin};
use std::sync::Arc;
use std::thread::{self, available_parallelism, sleep};
use std::time::{Duration, Instant};

use super::board::Board;
use super::environment::Environment;
use super::notices::{Heard, listen};
use super::ports::{Ports, SendFailure};
use super::record::Record;
use crate::error::Aborted;
use crate::frame::{Header, LoanedFrame, Message};
use crate::origin::{LEFT_EARLY, Origin};
use crate::patience::Patience;
use crate::{Incoming, Outgoing, Rank, Transport, TransportError};

/// How long a rank sleeps before it looks for itself whether all is well. It is woken for everything it should know.
const SLICE: Duration = Duration::from_millis(100);

/// The least time that the ranks have to find each other. Starting many processes on few processors takes some.
const JOIN_TIMEOUT: Duration = Duration::from_secs(60);

/// Between two looks, on leaving, at whether the others have received everything.
const LINGER_POLL: Duration = Duration::from_micros(200);

/// The most that leaving takes after a failure.
const FAILED_LINGER: Duration = Duration::from_millis(500);

/// The endpoint of one rank among processes of one machine. [`join`](super::join) makes it.
#[derive(Debug)]
pub struct Iceoryx2 {
    outgoing: Outgoing,
    /// By source: the message of the next round, where it came before the present one was complete.
    early: Vec<Option<Message>>,
    /// By source: whether the message of the present round still has to come.
    awaited: Vec<bool>,
    /// The round in progress, which is the number of those completed.
    round: u64,
    ports: Ports,
    standing: Standing,
}

/// A rank's place in the run, and how the run is for it.
#[derive(Debug)]
struct Standing {
    rank: Rank,
    size: usize,
    /// How long one round may take.
    timeout: Duration,
    /// Whether waiting awake takes no processor from another rank.
    spin: bool,
    /// The error that ended the run for this rank.
    failed: Option<TransportError>,
    record: Record,
    heard: Arc<Heard>,
    board: Arc<Board>,
    /// As long as it is open, the run is alive.
    _lock: File,
}

impl Standing {
    fn check(&self) -> Result<(), TransportError> {
        self.failed.clone().map_or(Ok(()), Err)
    }

    fn others(&self) -> impl Iterator<Item = Rank> + use<> {
        let own = self.rank;
        Rank::all(self.size).filter(move |&rank| rank != own)
    }

    /// What is wrong with this rank itself, as an error.
    fn own_fault(&self, reason: String) -> TransportError {
        TransportError::PeerLost { rank: self.rank, reason }
    }

    /// How `rank` came to send no more, if it did.
    fn how_it_went(&self, rank: Rank) -> Option<String> {
        let ended = || self.heard.how_it_ended(rank);
        if self.board.is_gone(rank) { Some(LEFT_EARLY.to_owned()) } else { ended() }
    }

    /// That nobody watches over the run any more, if so.
    fn check_launcher(&self) -> Result<(), TransportError> {
        if self.heard.is_launcher_gone() {
            return Err(self.own_fault("the launcher that watched over it is gone".to_owned()));
        }
        Ok(())
    }

    /// Records `error` as the origin unless there is one, tells the others, and returns what this rank reports.
    fn fail(&mut self, error: TransportError) -> TransportError {
        if let Some(error) = &self.failed {
            return error.clone();
        }
        let origin = self.record.settle(Origin { error, reporter: self.rank });
        let report = origin.as_seen_by(self.rank);
        self.failed = Some(report.clone());
        self.board.leave(self.rank);
        report
    }
}

impl Iceoryx2 {
    pub(super) fn join(environment: Environment) -> Result<Iceoryx2, TransportError> {
        let Environment { folder, rank, size, peer_timeout } = environment;
        let unusable = |what: &str, error: std::io::Error| {
            TransportError::usage(format!(
                "rank {rank} cannot join its run: {what}: {error}; its launcher may have ended, start the run again"
            ))
        };
        let lock = folder.lock().map_err(|error| unusable("the run folder", error))?;
        let board = Board::open(&folder.board(), size).map_err(|error| unusable("the board", error))?;
        let board = Arc::new(board);
        let heard = listen(BufReader::new(stdin()), rank, Arc::clone(&board));
        let mut standing = Standing {
            rank,
            size,
            timeout: peer_timeout.max(JOIN_TIMEOUT),
            spin: available_parallelism().is_ok_and(|cores| size <= cores.get()),
            failed: None,
            record: Record::new(folder.path(), &rank.to_string()),
            heard: heard.map_err(|error| unusable("the thread that hears the launcher", error))?,
            board,
            _lock: lock,
        };
        let ports = open_ports(&standing, &folder).map_err(|error| standing.fail(error))?;
        let mut endpoint = Iceoryx2 {
            outgoing: Outgoing::loaned(rank, size),
            early: (0..size).map(|_| None).collect(),
            awaited: vec![false; size],
            round: 0,
            ports,
            standing,
        };
        // A first round that brings nothing: after it every rank is connected to every other, both ways.
        endpoint.prepare(&vec![0; size])?;
        endpoint.exchange(&mut Incoming::default())?;
        endpoint.standing.timeout = peer_timeout;
        Ok(endpoint)
    }

    /// Sends every message.
    fn send(&mut self, incoming: &mut Incoming) -> Result<(), TransportError> {
        let word = self.outgoing.flag_word();
        incoming.hear(word);
        let header = Header {
            round: self.round,
            flag_word: [(word >> 64) as u64, word as u64],
            source: self.standing.rank.0,
            unused: 0,
        };
        let outgoing = self.outgoing.as_loaned();
        if let LoanedFrame::Own(bytes) = outgoing.frame(self.standing.rank) {
            // Moved, and the one of the last round is the next to be filled.
            std::mem::swap(bytes, incoming.as_loaned().own_mut());
        }
        for to in self.standing.others() {
            self.ports.send(to, outgoing, header).map_err(|failure| match failure {
                SendFailure::Other(reason) => self.standing.own_fault(reason),
                SendFailure::NoReceiver => {
                    let reason = self.standing.how_it_went(to).unwrap_or_else(|| "it does not receive".to_owned());
                    TransportError::PeerLost { rank: to, reason }
                }
            })?;
            self.standing.board.ring(to);
        }
        Ok(())
    }

    /// Receives one message from every other rank.
    fn receive(&mut self, incoming: &mut Incoming, started: Instant) -> Result<(), TransportError> {
        let rank = self.standing.rank;
        let mut patience = Patience::new();
        let mut missing = self.standing.size as u32 - 1;
        for from in self.standing.others() {
            self.awaited[from.index()] = true;
            if let Some(message) = self.early[from.index()].take() {
                self.accept(from, message, incoming, &mut missing);
            }
        }
        loop {
            let rung = self.standing.board.rung(rank);
            self.take_arrived(incoming, &mut missing)?;
            if missing == 0 {
                return Ok(());
            }
            for from in self.standing.others() {
                let needed = self.awaited[from.index()];
                if let Some(reason) = needed.then(|| self.standing.how_it_went(from)).flatten() {
                    // It sends no more, but what it had sent may have come after the look above.
                    self.take_arrived(incoming, &mut missing)?;
                    if self.awaited[from.index()] {
                        return Err(TransportError::PeerLost { rank: from, reason });
                    }
                }
            }
            if missing == 0 {
                return Ok(());
            }
            self.standing.check_launcher()?;
            let (waited, timeout) = (patience.waited(), self.standing.timeout);
            if waited >= timeout {
                let silent = self.awaited.iter().position(|&awaited| awaited).unwrap_or_default();
                return Err(TransportError::Timeout { rank: Rank::from_index(silent), waited: started.elapsed() });
            }
            self.standing.board.wait(rank, rung, missing, SLICE.min(timeout - waited), self.standing.spin);
        }
    }

    /// Takes what has arrived, until the round is complete.
    fn take_arrived(&mut self, incoming: &mut Incoming, missing: &mut u32) -> Result<(), TransportError> {
        while *missing > 0 {
            let message = self.ports.receive().map_err(|reason| self.standing.own_fault(reason))?;
            let Some(message) = message else { return Ok(()) };
            let Header { round, source, .. } = *message.user_header();
            let from = Rank(source);
            let (present, next) = (self.round, self.round + 1);
            if round == present && self.awaited.get(from.index()) == Some(&true) {
                self.accept(from, message, incoming, missing);
            } else if round == next && self.early.get(from.index()).is_some_and(Option::is_none) {
                self.early[from.index()] = Some(message);
            } else {
                let reason = format!("it sent a message of round {round} in round {present}");
                return Err(TransportError::PeerLost { rank: from, reason });
            }
        }
        Ok(())
    }

    fn accept(&mut self, from: Rank, message: Message, incoming: &mut Incoming, missing: &mut u32) {
        let [upper, lower] = message.user_header().flag_word;
        incoming.hear(u128::from(upper) << 64 | u128::from(lower));
        incoming.as_loaned().put(from, message);
        self.awaited[from.index()] = false;
        *missing -= 1;
    }

    /// Waits until every other rank has received what this one sent in complete rounds, or never will: memory that a
    /// receiver has not yet mapped is lost when its sender's ports are dropped. It takes moments, because a round that
    /// is complete here is one that all others are already in.
    fn linger(&self) {
        let Standing { board, heard, timeout, failed, .. } = &self.standing;
        // Where the run has failed, some will never come.
        let limit = if failed.is_some() { FAILED_LINGER.min(*timeout) } else { *timeout };
        let started = Instant::now();
        for peer in self.standing.others() {
            while board.completed(peer) < self.round
                && !board.is_gone(peer)
                && heard.how_it_ended(peer).is_none()
                && !heard.is_launcher_gone()
                && started.elapsed() < limit
            {
                sleep(LINGER_POLL);
            }
        }
    }
}

/// Makes the ports, looking now and then whether all is well.
fn open_ports(standing: &Standing, folder: &super::run_folder::RunFolder) -> Result<Ports, TransportError> {
    enum Stop {
        Error(TransportError),
        Reason(String),
    }
    impl From<String> for Stop {
        fn from(reason: String) -> Stop {
            Stop::Reason(reason)
        }
    }
    let started = Instant::now();
    let go_on = |awaited: Option<Rank>| {
        let lost = |(rank, reason)| Stop::Error(TransportError::PeerLost { rank, reason });
        standing.check_launcher().map_err(Stop::Error)?;
        let gone = standing.others().find_map(|rank| standing.how_it_went(rank).map(|reason| (rank, reason)));
        gone.map_or(Ok(()), |gone| Err(lost(gone)))?;
        let waited = started.elapsed();
        match awaited {
            _ if waited < standing.timeout => Ok(()),
            Some(rank) => Err(Stop::Error(TransportError::Timeout { rank, waited })),
            None => Err(Stop::Reason(format!("it took {waited:.1?} to make its ports"))),
        }
    };
    Ports::open(folder, standing.rank, standing.size, go_on).map_err(|stop| match stop {
        Stop::Error(error) => error,
        Stop::Reason(reason) => standing.own_fault(reason),
    })
}

impl Transport for Iceoryx2 {
    fn rank(&self) -> Rank {
        self.standing.rank
    }

    fn size(&self) -> usize {
        self.standing.size
    }

    fn prepare(&mut self, lengths: &[usize]) -> Result<&mut Outgoing, TransportError> {
        self.standing.check()?;
        self.outgoing.begin_prepare(self.standing.rank, lengths)?;
        if let Err(reason) = self.ports.loan(lengths, self.outgoing.as_loaned()) {
            let error = self.standing.own_fault(reason);
            return Err(self.standing.fail(error));
        }
        self.outgoing.end_prepare();
        Ok(&mut self.outgoing)
    }

    fn exchange(&mut self, incoming: &mut Incoming) -> Result<(), TransportError> {
        self.standing.check()?;
        self.outgoing.begin_exchange(self.standing.rank)?;
        let started = Instant::now();
        incoming.begin(self.standing.size);
        incoming.as_loaned().empty(self.standing.size);
        let result = self.send(incoming).and_then(|()| {
            let sent = Instant::now();
            self.receive(incoming, started)?;
            incoming.end(sent.elapsed());
            Ok(())
        });
        if let Err(error) = result {
            incoming.clear();
            return Err(self.standing.fail(error));
        }
        self.round += 1;
        self.standing.board.complete(self.standing.rank, self.round);
        Ok(())
    }

    fn abort(&mut self, reason: &str) -> ! {
        let error = self.standing.own_fault(format!("it aborted: {reason}"));
        self.standing.fail(error);
        Aborted::unwind(self.standing.rank, reason)
    }
}

impl Drop for Iceoryx2 {
    fn drop(&mut self) {
        if self.standing.failed.is_none() {
            if thread::panicking() {
                let error = self.standing.own_fault("it panicked".to_owned());
                self.standing.fail(error);
            } else {
                self.standing.board.leave(self.standing.rank);
            }
        }
        self.linger();
    }
}
