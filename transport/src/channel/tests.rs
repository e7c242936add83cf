//! What can only be tested with the ranks' threads in hand: orders of events, buffers, and how runs end.

use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use super::*;
use crate::{Collective, RankFailure};

const OPTIONS: ChannelOptions = ChannelOptions { peer_timeout: Duration::from_secs(60) };

fn endpoints<const N: usize>() -> [Channel; N] {
    let builders = connect(N, OPTIONS).unwrap();
    let endpoints: Vec<Channel> = builders.into_iter().map(Builder::build).collect();
    endpoints.try_into().unwrap()
}

/// Drops `endpoint` as a panic does.
fn panic_with(endpoint: Channel) {
    let panicking = thread::spawn(move || {
        let _endpoint = endpoint;
        std::panic::resume_unwind(Box::new("silently"));
    });
    assert!(panicking.join().is_err());
}

#[track_caller]
fn assert_lost(result: Result<(), TransportError>, expected: Rank, word: &str) {
    match result {
        Err(TransportError::PeerLost { rank, reason }) => {
            assert_eq!(rank, expected, "{reason}");
            assert!(reason.contains(word), "{reason}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_panic_is_named_through_ranks_that_gave_up() {
    let [mut a, mut b, c] = endpoints();
    panic_with(c);
    assert_lost(b.barrier(), Rank(2), "panicked");
    // Rank 1 fails of what it heard, by panicking in its turn; rank 0 comes last and finds both gone.
    panic_with(b);
    assert_lost(a.barrier(), Rank(2), "panicked");
}

#[test]
fn a_rank_that_left_for_good_is_not_blamed_for_a_later_panic() {
    let [mut a, b, c] = endpoints();
    drop(b);
    panic_with(c);
    assert_lost(a.barrier(), Rank(2), "panicked");
}

#[test]
fn a_rank_that_left_is_named_through_ranks_that_gave_up() {
    let [mut a, mut b, c] = endpoints();
    drop(c);
    assert_lost(b.barrier(), Rank(2), "left");
    drop(b);
    assert_lost(a.barrier(), Rank(2), "left");
}

#[test]
fn a_failed_endpoint_releases_its_peers_while_it_is_kept() {
    let [mut a, mut b, c] = endpoints();
    drop(c);
    assert_lost(b.barrier(), Rank(2), "left");
    assert_lost(a.barrier(), Rank(2), "left");
    assert_lost(b.barrier(), Rank(2), "left");
}

#[test]
fn what_was_sent_before_leaving_arrives() {
    let [mut a, b] = endpoints();
    let (left, has_left) = mpsc::channel();
    let peer = thread::spawn(move || {
        let mut b = b;
        let gathered = b.all_gather(b"b").unwrap();
        drop(b);
        left.send(()).unwrap();
        gathered
    });
    // The two halves of an exchange, so that the answer is taken only when the other rank has left.
    a.prepare(&[1, 1]).unwrap().iter_mut().for_each(|(_, frame)| frame.copy_from_slice(b"a"));
    let mut incoming = Incoming::default();
    let word = a.buffers.begin_exchange(&mut incoming).unwrap();
    a.links.send((&mut a.buffers, word), &mut incoming, Instant::now()).unwrap();
    has_left.recv().unwrap();
    a.links.receive(&mut incoming, Instant::now()).unwrap();
    assert_eq!(incoming.from(Rank(1)), b"b");
    assert_eq!(peer.join().unwrap(), [b"a", b"b"]);
    assert_lost(a.barrier(), Rank(1), "left");
}

#[test]
fn a_death_is_noticed_while_waiting_for_a_slow_rank() {
    // Rank 1 stays silent to the end, so only looking past it finds the death of rank 2.
    let [mut a, _silent, c] = endpoints();
    let started = Instant::now();
    let waiting = thread::spawn(move || a.barrier());
    thread::sleep(Duration::from_millis(50));
    panic_with(c);
    assert_lost(waiting.join().unwrap(), Rank(2), "panicked");
    assert!(started.elapsed() < OPTIONS.peer_timeout, "noticed only by the timeout");
}

#[test]
fn an_end_that_is_never_built_is_named() {
    let mut builders = connect(3, OPTIONS).unwrap();
    drop(builders.remove(1));
    let mut a = builders.remove(0).build();
    assert_lost(a.barrier(), Rank(1), "never started");
}

#[test]
fn a_late_rank_learns_who_gave_it_up() {
    let builders = connect(2, ChannelOptions { peer_timeout: Duration::from_millis(30) }).unwrap();
    let [mut a, mut late]: [Channel; 2] =
        builders.into_iter().map(Builder::build).collect::<Vec<_>>().try_into().unwrap();
    let error = a.barrier().unwrap_err();
    assert!(matches!(error, TransportError::Timeout { rank: Rank(1), waited } if waited >= Duration::from_millis(30)));
    assert_lost(late.barrier(), Rank(0), "gave up");
}

#[test]
fn run_reports_every_rank_and_names_its_thread() {
    let borrowed = [10, 20, 30];
    let results = run(3, OPTIONS, |endpoint| {
        assert_eq!(thread::current().name(), Some(format!("rank {}", endpoint.rank()).as_str()));
        if endpoint.rank() == Rank(1) {
            std::panic::resume_unwind(Box::new("on purpose".to_owned()));
        }
        borrowed[endpoint.rank().index()]
    });
    let failure = RankFailure::Panicked { rank: Rank(1), message: "on purpose".into() };
    assert_eq!(results, [Ok(10), Err(failure), Ok(30)]);
}

#[test]
fn unusable_options_are_refused() {
    let zero = ChannelOptions { peer_timeout: Duration::ZERO };
    assert!(connect(0, OPTIONS).unwrap_err().to_string().contains("cannot join 0 ranks"));
    assert!(connect(2, zero).unwrap_err().to_string().contains("timeout is zero"));
    assert_eq!(run(0, OPTIONS, |_| ()), []);
    let results = run(2, zero, |_| ());
    assert!(results.iter().all(|result| matches!(result, Err(RankFailure::NotStarted { .. }))));
}
