//! Cases about plain rounds, and the round that all cases use.

use std::thread::sleep;
use std::time::Duration;

use crate::{Incoming, Rank, Transport, TransportError};

/// A number that differs between any two messages of a case.
fn key(round: u64, from: Rank, to: Rank) -> u64 {
    ((round << 20) | u64::from(from.0 << 10) | u64::from(to.0)).wrapping_mul(0x9E37_79B9_7F4A_7C15)
}

/// The byte at `index` of a message.
fn content(key: u64, index: usize) -> u8 {
    key.to_le_bytes()[index % 8] ^ (index / 8) as u8
}

/// Exchanges one round of messages, each as long as `length(from, to)`, and checks every byte of what arrives.
pub(super) fn round(
    transport: &mut dyn Transport,
    incoming: &mut Incoming,
    number: u64,
    length: impl Fn(Rank, Rank) -> usize,
) -> Result<(), TransportError> {
    let (own, size) = (transport.rank(), transport.size());
    let lengths: Vec<usize> = Rank::all(size).map(|to| length(own, to)).collect();
    let outgoing = transport.prepare(&lengths)?;
    assert_eq!(outgoing.size(), size);
    for (to, frame) in outgoing.iter_mut() {
        assert_eq!(frame.len(), lengths[to.index()], "buffer from rank {own} to rank {to} in round {number}");
        let key = key(number, own, to);
        frame.iter_mut().enumerate().for_each(|(index, byte)| *byte = content(key, index));
    }
    transport.exchange(incoming)?;
    check_incoming(own, size, incoming, number, length);
    Ok(())
}

/// Checks that `incoming` holds exactly the messages of one round.
fn check_incoming(own: Rank, size: usize, incoming: &Incoming, number: u64, length: impl Fn(Rank, Rank) -> usize) {
    assert_eq!(incoming.size(), size);
    assert!(incoming.iter().map(|(from, _)| from).eq(Rank::all(size)), "sources are in rank order");
    for (from, frame) in incoming.iter() {
        let key = key(number, from, own);
        assert_eq!(frame.len(), length(from, own), "length from rank {from} to rank {own} in round {number}");
        let wrong = frame.iter().enumerate().find(|&(index, &byte)| byte != content(key, index));
        assert_eq!(wrong, None, "content from rank {from} to rank {own} in round {number}");
        assert_eq!(incoming.from(from), frame);
    }
}

/// A length that differs between the two directions of every pair, and from round to round.
fn varied(number: u64) -> impl Fn(Rank, Rank) -> usize {
    move |from, to| (from.index() * 37 + to.index() * 11 + number as usize * 13) % 300
}

fn distinct(from: Rank, to: Rank) -> usize {
    1 + from.index() * 64 + to.index()
}

fn nothing(_: Rank, _: Rank) -> usize {
    0
}

pub(super) fn identity(transport: &mut dyn Transport) {
    let (rank, size) = (transport.rank(), transport.size());
    assert!(rank.index() < size, "rank {rank} of {size}");
    let mut incoming = Incoming::default();
    for _ in 0..3 {
        transport.prepare(&vec![4; size]).unwrap().iter_mut().for_each(|(_, frame)| {
            frame.copy_from_slice(&rank.0.to_le_bytes());
        });
        transport.exchange(&mut incoming).unwrap();
        for (from, frame) in incoming.iter() {
            assert_eq!(frame, from.0.to_le_bytes(), "each source is who it says it is");
        }
        assert_eq!((transport.rank(), transport.size()), (rank, size));
    }
}

pub(super) fn all_to_all(transport: &mut dyn Transport) {
    let mut incoming = Incoming::default();
    for number in 0..4 {
        round(transport, &mut incoming, number, distinct).unwrap();
    }
}

pub(super) fn empty_messages(transport: &mut dyn Transport) {
    let mut incoming = Incoming::default();
    for number in 0..20 {
        match number % 4 {
            0 => round(transport, &mut incoming, number, nothing),
            1 => round(transport, &mut incoming, number, |from, to| if from < to { 5 } else { 0 }),
            2 => round(transport, &mut incoming, number, |from, to| if from == Rank(0) { to.index() } else { 0 }),
            _ => round(transport, &mut incoming, number, distinct),
        }
        .unwrap();
    }
}

pub(super) fn flag_words(transport: &mut dyn Transport) {
    let (own, size) = (transport.rank().index() as u64, transport.size() as u64);
    let mut incoming = Incoming::default();
    // Differ from rank to rank and round to round, in the upper half of the word or only in the lower one.
    let word = |rank: u64, number: u64| match (rank + number) % size {
        place if number.is_multiple_of(2) => u128::from(place + number) << 64 | u128::from(u64::MAX - place),
        place => u128::from(place + number),
    };
    for number in 0..4 * size {
        let lengths = if number % 3 == 0 { vec![8; size as usize] } else { vec![0; size as usize] };
        let outgoing = transport.prepare(&lengths).unwrap();
        outgoing.set_flag_word(word(own, number));
        transport.exchange(&mut incoming).unwrap();
        let least = (0..size).map(|rank| word(rank, number)).min();
        assert_eq!(Some(incoming.flag_word()), least, "round {number}");

        // One rank alone says something; then nobody does.
        let speaks = own == number % size;
        let outgoing = transport.prepare(&lengths).unwrap();
        if speaks {
            outgoing.set_flag_word(u128::MAX - 1);
        }
        transport.exchange(&mut incoming).unwrap();
        assert_eq!(incoming.flag_word(), u128::MAX - 1, "said by rank {}", number % size);
        transport.prepare(&lengths).unwrap();
        transport.exchange(&mut incoming).unwrap();
        assert_eq!(incoming.flag_word(), u128::MAX, "a word is for one round");
    }
}

pub(super) fn large_messages(transport: &mut dyn Transport) {
    const LARGE: usize = 16 << 20;
    let mut incoming = Incoming::default();
    round(transport, &mut incoming, 0, distinct).unwrap();
    round(transport, &mut incoming, 1, |from, to| LARGE + distinct(from, to)).unwrap();
    round(transport, &mut incoming, 2, |from, to| if from <= to { LARGE } else { 1 }).unwrap();
    for number in 3..10 {
        round(transport, &mut incoming, number, distinct).unwrap();
    }
}

pub(super) fn thousand_rounds(transport: &mut dyn Transport) {
    let mut incoming = Incoming::default();
    for number in 0..1000 {
        round(transport, &mut incoming, number, varied(number)).unwrap();
    }
}

pub(super) fn to_oneself(transport: &mut dyn Transport) {
    let mut incoming = Incoming::default();
    for number in 0..10 {
        round(transport, &mut incoming, number, |from, to| if from == to { 1000 - number as usize } else { 0 })
            .unwrap();
    }
}

pub(super) fn prepared_anew(transport: &mut dyn Transport) {
    let size = transport.size();
    let mut incoming = Incoming::default();
    for number in 0..5 {
        for (_, frame) in transport.prepare(&vec![500; size]).unwrap().iter_mut() {
            frame.fill(0xEE);
        }
        round(transport, &mut incoming, number, varied(number)).unwrap();
    }
}

pub(super) fn incoming_outlives_round(transport: &mut dyn Transport) {
    let (own, size) = (transport.rank(), transport.size());
    let mut kept = Incoming::default();
    let mut other = Incoming::default();
    round(transport, &mut kept, 0, distinct).unwrap();
    round(transport, &mut other, 1, distinct).unwrap();
    transport.prepare(&vec![100; size]).unwrap().iter_mut().for_each(|(_, frame)| frame.fill(0));
    check_incoming(own, size, &kept, 0, distinct);
    check_incoming(own, size, &other, 1, distinct);
    for number in 2..6 {
        // By turns, then a new one every time: whoever gives memory back, and whether at all, changes no message.
        std::mem::swap(&mut kept, &mut other);
        round(transport, &mut kept, number, varied(number)).unwrap();
        round(transport, &mut Incoming::default(), number + 100, distinct).unwrap();
    }
}

/// Asserts that `result` is a usage error with a text.
pub(super) fn assert_usage<T>(result: Result<T, TransportError>) {
    match result {
        Err(TransportError::Usage { message }) => assert!(!message.is_empty() && !message.contains('\n'), "{message}"),
        Err(error) => panic!("not a usage error: {error}"),
        Ok(_) => panic!("misuse was accepted"),
    }
}

pub(super) fn wrong_number_of_lengths(transport: &mut dyn Transport) {
    let size = transport.size();
    let mut incoming = Incoming::default();
    assert_usage(transport.prepare(&vec![1; size - 1]));
    round(transport, &mut incoming, 0, distinct).unwrap();
    // Only one rank errs, before and after a good prepare; the others must not notice.
    if transport.rank() == Rank(0) {
        assert_usage(transport.prepare(&vec![1; size + 1]));
        transport.prepare(&vec![1; size]).unwrap();
        assert_usage(transport.prepare(&[]));
        assert_usage(transport.exchange(&mut incoming));
    }
    for number in 1..4 {
        round(transport, &mut incoming, number, varied(number)).unwrap();
    }
}

pub(super) fn exchange_without_prepare(transport: &mut dyn Transport) {
    let mut incoming = Incoming::default();
    assert_usage(transport.exchange(&mut incoming));
    for number in 0..4 {
        round(transport, &mut incoming, number, distinct).unwrap();
        if transport.rank() == Rank(0) {
            assert_usage(transport.exchange(&mut incoming));
        }
    }
}

pub(super) fn fast_beside_slow(transport: &mut dyn Transport) {
    let own = transport.rank().index() as u64;
    let mut incoming = Incoming::default();
    for number in 0..60 {
        // Rank 0 never waits; another rank is the slowest one in each round.
        if own > 0 {
            sleep(Duration::from_micros((own * 7 + number * 3) % 8 * 300));
        }
        round(transport, &mut incoming, number, varied(number)).unwrap();
    }
}
