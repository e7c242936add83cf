//! The contract of [`Transport`] as tests that every backend runs.
//!
//! A backend's test implements [`Harness`], which starts ranks and reports how each ended, and calls [`check_all`]:
//!
//! ```
//! use atoll_transport::conformance::{Case, Harness, Outcome, check_all};
//! use atoll_transport::local::Local;
//!
//! struct Alone;
//!
//! impl Harness for Alone {
//!     fn supports(&self, size: usize) -> bool {
//!         size == 1
//!     }
//!
//!     fn run(&self, _size: usize, case: &'static Case) -> Vec<Outcome> {
//!         (case.body)(&mut Local::new());
//!         vec![Outcome::Finished]
//!     }
//! }
//!
//! let runs = check_all(&Alone).expect("the backend keeps the contract");
//! assert!(runs > 0);
//! ```
//!
//! Where ranks are processes, the harness passes [`Case::name`] to the program it launches, and that program looks the
//! case up with [`case`] and runs it with [`process::record`], which leaves a file from which the harness learns how it
//! ended. Cases that lose no rank may run one after another on one endpoint. A body checks what it sees and panics where the contract is broken; it asserts no time
//! that a slow machine could miss. The one clock it compares between ranks is the system clock, in `barrier_separates`,
//! so the ranks have to share one.
//!
//! A run that hangs is for the harness's caller to end: put [`check_all`] under a watchdog.

mod loss;
pub mod process;
mod rounds;
mod shared;

use std::time::Duration;

use crate::{Rank, RankFailure, Transport};

/// One thing that every backend does right, as the code of one rank.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// A unique name, in words joined by underscores.
    pub name: &'static str,
    /// What holds if the case passes.
    pub claim: &'static str,
    /// The numbers of ranks to run it on.
    pub sizes: &'static [usize],
    /// The peer timeout to give the backend. Only one case is about reaching it.
    pub peer_timeout: Duration,
    /// Whether the others lose the [`victim`] in it.
    pub loses_victim: bool,
    /// How the [`victim`] ends; all other ranks finish.
    pub victim_ends: Ending,
    /// What every rank runs.
    pub body: fn(&mut dyn Transport),
}

/// How a rank is meant to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// It returns.
    Finishes,
    /// It panics on purpose.
    Panics,
    /// It calls [`Transport::abort`].
    Aborts,
}

/// How a rank did end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It returned.
    Finished,
    /// It panicked, on purpose or because a check failed; with the text of the panic.
    Panicked(String),
    /// It called [`Transport::abort`]; with the reason.
    Aborted(String),
}

impl From<Result<(), RankFailure>> for Outcome {
    fn from(result: Result<(), RankFailure>) -> Outcome {
        match result {
            Ok(()) => Outcome::Finished,
            Err(RankFailure::Aborted { reason, .. }) => Outcome::Aborted(reason),
            Err(failure) => Outcome::Panicked(failure.to_string()),
        }
    }
}

/// Runs cases on the ranks of one backend.
pub trait Harness {
    /// Whether the backend can run on `size` ranks. By default on any number.
    fn supports(&self, size: usize) -> bool {
        let _ = size;
        true
    }

    /// Whether the loss of one rank ends all others before they can say anything, as where the only abort there is ends
    /// the whole job. Then it is enough that none of the runs with a loss hangs. By default every survivor has to see
    /// the error.
    fn loss_ends_every_rank(&self) -> bool {
        false
    }

    /// Starts `size` ranks afresh with [`Case::peer_timeout`], runs [`Case::body`] on each, waits for all of them, and
    /// returns how they ended, in rank order.
    fn run(&self, size: usize, case: &'static Case) -> Vec<Outcome>;
}

/// The rank that comes to grief in the cases about lost ranks. It is in the middle, so that it has peers on both sides.
pub fn victim(size: usize) -> Rank {
    Rank::from_index(size / 2)
}

/// The case of that name.
pub fn case(name: &str) -> Option<&'static Case> {
    CASES.iter().find(|case| case.name == name)
}

/// Runs one case on one number of ranks.
///
/// # Errors
/// Every rank that did not end as it should, as text.
pub fn check(harness: &dyn Harness, case: &'static Case, size: usize) -> Result<(), String> {
    let outcomes = harness.run(size, case);
    let at = format!("{} on {size} ranks", case.name);
    if outcomes.len() != size {
        return Err(format!("{at}: the harness reported {} outcomes", outcomes.len()));
    }
    let wrong: Vec<String> = Rank::all(size)
        .zip(&outcomes)
        .filter(|&(rank, outcome)| {
            let expected = if rank == victim(size) { case.victim_ends } else { Ending::Finishes };
            let as_meant = match (expected, outcome) {
                (Ending::Finishes, Outcome::Finished) => true,
                (Ending::Panics, Outcome::Panicked(text)) => text.contains(loss::DELIBERATE),
                (Ending::Aborts, Outcome::Aborted(reason)) => reason == loss::DELIBERATE,
                _ => false,
            };
            let dragged_along = case.loses_victim && harness.loss_ends_every_rank();
            !as_meant && !dragged_along
        })
        .map(|(rank, outcome)| format!("{at}: rank {rank}: {outcome:?}"))
        .collect();
    if wrong.is_empty() { Ok(()) } else { Err(wrong.join("\n")) }
}

/// Runs every case on every number of ranks that the harness supports, and returns how many runs that were.
///
/// # Errors
/// What [`check`] found wrong, one entry per failed run.
pub fn check_all(harness: &dyn Harness) -> Result<usize, Vec<String>> {
    let mut runs = 0;
    let mut failures = Vec::new();
    for case in CASES {
        for &size in case.sizes.iter().filter(|&&size| harness.supports(size)) {
            runs += 1;
            failures.extend(check(harness, case, size).err());
        }
    }
    if failures.is_empty() { Ok(runs) } else { Err(failures) }
}

const ALL_SIZES: &[usize] = &[1, 2, 3, 4, 5, 6, 7, 8];
const WITH_PEERS: &[usize] = &[2, 3, 4, 5, 6, 7, 8];
const FEW: &[usize] = &[1, 2, 3];

/// The peer timeout of all cases that are not meant to reach it; a loss has to be noticed sooner.
const LONG: Duration = Duration::from_secs(60);

const fn healthy(
    name: &'static str,
    claim: &'static str,
    sizes: &'static [usize],
    body: fn(&mut dyn Transport),
) -> Case {
    Case { name, claim, sizes, peer_timeout: LONG, loses_victim: false, victim_ends: Ending::Finishes, body }
}

const fn lost(name: &'static str, claim: &'static str, victim_ends: Ending, body: fn(&mut dyn Transport)) -> Case {
    Case { name, claim, sizes: WITH_PEERS, peer_timeout: LONG, loses_victim: true, victim_ends, body }
}

/// Every case.
pub static CASES: &[Case] = &[
    healthy("identity", "ranks are 0 .. size and do not change", ALL_SIZES, rounds::identity),
    healthy("all_to_all", "messages of distinct lengths and contents reach their ranks", ALL_SIZES, rounds::all_to_all),
    healthy("empty_messages", "empty messages are messages", ALL_SIZES, rounds::empty_messages),
    healthy("flag_words", "every rank gets the least flag word of a round", ALL_SIZES, rounds::flag_words),
    healthy("large_messages", "16 MB arrive whole, and small messages after them", FEW, rounds::large_messages),
    healthy("thousand_rounds", "rounds do not mix over a thousand of them", ALL_SIZES, rounds::thousand_rounds),
    healthy("to_oneself", "a rank can send to itself alone", ALL_SIZES, rounds::to_oneself),
    healthy("prepared_anew", "a second prepare replaces the first", ALL_SIZES, rounds::prepared_anew),
    healthy(
        "incoming_outlives_round",
        "received messages stay until their memory is given back",
        ALL_SIZES,
        rounds::incoming_outlives_round,
    ),
    healthy(
        "wrong_number_of_lengths",
        "a wrong number of lengths is refused and harms nothing",
        ALL_SIZES,
        rounds::wrong_number_of_lengths,
    ),
    healthy(
        "exchange_without_prepare",
        "an exchange without a prepare is refused and harms nothing",
        ALL_SIZES,
        rounds::exchange_without_prepare,
    ),
    healthy(
        "fast_beside_slow",
        "a fast rank next to slow ones loses and mixes nothing",
        ALL_SIZES,
        rounds::fast_beside_slow,
    ),
    healthy(
        "barrier_separates",
        "no rank leaves a barrier before the last one has entered it",
        ALL_SIZES,
        shared::barrier_separates,
    ),
    healthy("gathers", "gathers bring all bytes, in rank order", ALL_SIZES, shared::gathers),
    healthy("reductions", "reductions fold in rank order to the same bits everywhere", ALL_SIZES, shared::reductions),
    healthy(
        "mismatched_reduction",
        "a reduction of unequal counts is refused on every rank",
        WITH_PEERS,
        shared::mismatched_reduction,
    ),
    healthy("counted_traffic", "counters see what passes between different ranks", WITH_PEERS, shared::counted_traffic),
    lost(
        "peer_leaves",
        "every rank that still needs one that left learns which one that was",
        Ending::Finishes,
        loss::peer_leaves,
    ),
    lost("peer_panics", "every rank learns which one panicked", Ending::Panics, loss::peer_panics),
    lost("peer_aborts", "every rank learns which one aborted, and why", Ending::Aborts, loss::peer_aborts),
    Case {
        name: "peer_silent",
        claim: "a rank that does not answer within the peer timeout is named",
        sizes: &[2, 4],
        peer_timeout: loss::SILENT_PEER_TIMEOUT,
        loses_victim: true,
        victim_ends: Ending::Finishes,
        body: loss::silent_peer,
    },
];
