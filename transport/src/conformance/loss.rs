//! Cases in which one rank is lost.

use std::thread::sleep;
use std::time::{Duration, Instant};

use super::rounds::round;
use super::{LONG, victim};
use crate::patience::Patience;
use crate::{Incoming, Transport, TransportError};

/// What the victim says when it panics or aborts, as a panic text or a reason.
pub(super) const DELIBERATE: &str = "lost on purpose";

/// The peer timeout of the case that reaches it.
pub(super) const SILENT_PEER_TIMEOUT: Duration = Duration::from_secs(2);

/// How long the silent rank is silent. The others have by far the most of it to notice, also where they take a second
/// more to ask each other.
const SILENCE: Duration = Duration::from_secs(5);

/// Rounds that all ranks complete before the loss.
const GOOD_ROUNDS: u64 = 3;

/// Completes the good rounds and returns whether this rank is the victim.
fn good_rounds(transport: &mut dyn Transport) -> bool {
    let mut incoming = Incoming::default();
    for number in 0..GOOD_ROUNDS {
        round(transport, &mut incoming, number, |from, to| from.index() + to.index()).unwrap();
    }
    // With an odd number of ranks the victim goes while the others wait for it, otherwise possibly before they do.
    let is_victim = transport.rank() == victim(transport.size());
    if is_victim && transport.size() % 2 == 1 {
        sleep(Duration::from_millis(30));
    }
    is_victim
}

/// Exchanges until an error comes, checks that the endpoint then repeats it, and returns it.
fn survive(transport: &mut dyn Transport) -> TransportError {
    let size = transport.size();
    let started = Instant::now();
    // One rank comes late, when the others have noticed and given up: it has to name the victim and not one of them.
    if transport.rank().index() == (victim(size).index() + 1) % size {
        sleep(Duration::from_millis(60));
    }
    let mut incoming = Incoming::default();
    let error = (GOOD_ROUNDS..GOOD_ROUNDS + 3)
        .find_map(|number| round(transport, &mut incoming, number, |_, _| 8).err())
        .expect("no three rounds succeed without the lost rank");
    assert!(started.elapsed() < LONG, "the loss was noticed only by waiting for the peer timeout");
    assert_eq!(transport.prepare(&vec![0; size]).map(drop), Err(error.clone()));
    assert_eq!(transport.exchange(&mut incoming), Err(error.clone()));
    error
}

/// Asserts that `error` is the loss of the victim, and returns the reason.
fn assert_victim_lost(error: TransportError, size: usize) -> String {
    match error {
        TransportError::PeerLost { rank, reason } if rank == victim(size) => reason,
        error => panic!("rank {} is lost, but the error is: {error}", victim(size)),
    }
}

pub(super) fn peer_leaves(transport: &mut dyn Transport) {
    if !good_rounds(transport) {
        assert_victim_lost(survive(transport), transport.size());
    }
}

pub(super) fn peer_panics(transport: &mut dyn Transport) {
    if good_rounds(transport) {
        panic!("{DELIBERATE}");
    }
    assert_victim_lost(survive(transport), transport.size());
}

pub(super) fn peer_aborts(transport: &mut dyn Transport) {
    if good_rounds(transport) {
        transport.abort(DELIBERATE);
    }
    let reason = assert_victim_lost(survive(transport), transport.size());
    assert!(reason.contains(DELIBERATE), "the reason that was given arrives: {reason}");
}

pub(super) fn silent_peer(transport: &mut dyn Transport) {
    if good_rounds(transport) {
        // By the clock of those who wait for it: a machine that stops stops both.
        let mut patience = Patience::new();
        while patience.waited() < SILENCE {
            sleep(Duration::from_millis(10));
        }
        let error = round(transport, &mut Incoming::default(), GOOD_ROUNDS, |_, _| 8).expect_err("the others gave up");
        assert_ne!(error.blamed(), Some(transport.rank()), "a rank is not lost to itself: {error}");
    } else {
        assert_eq!(survive(transport).blamed(), Some(victim(transport.size())), "the silent rank is named");
    }
}
