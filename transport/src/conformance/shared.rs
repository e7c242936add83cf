//! Cases about what is built on rounds: collectives and counters.

use std::thread::sleep;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use super::rounds::{assert_usage, round};
use crate::{Collective, Counting, Incoming, Rank, Stats, Transport};

/// Nanoseconds on the system clock, the only one that processes of one machine can compare.
fn now() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).expect("the clock is set").as_nanos() as u64
}

pub(super) fn barrier_separates(transport: &mut dyn Transport) {
    let size = transport.size() as u64;
    for number in 0..2 * size {
        // Another rank is the last one each time.
        sleep(Duration::from_millis((u64::from(transport.rank().0) + number) % size * 2));
        let entered = now();
        transport.barrier().unwrap();
        let left = now();
        let last_in = transport.all_max_u64(entered).unwrap();
        let first_out = transport.all_min_u64(left).unwrap();
        assert!(last_in <= first_out, "a rank left {} ns before the last one entered", last_in - first_out);
    }
}

/// The bytes that a rank contributes: as many as its number times three, so rank 0 gives none.
fn contribution(rank: Rank) -> Vec<u8> {
    (0..rank.0 * 3).map(|index| (rank.0 * 50 + index) as u8).collect()
}

pub(super) fn gathers(transport: &mut dyn Transport) {
    let (own, size) = (transport.rank(), transport.size());
    let expected: Vec<Vec<u8>> = Rank::all(size).map(contribution).collect();
    for root in Rank::all(size) {
        let gathered = transport.gather(root, &contribution(own)).unwrap();
        assert_eq!(gathered, (own == root).then(|| expected.clone()));
    }
    assert_eq!(transport.all_gather(&contribution(own)).unwrap(), expected);
    assert_usage(transport.gather(Rank::from_index(size), &[1]));
    transport.barrier().unwrap();
}

pub(super) fn reductions(transport: &mut dyn Transport) {
    // Values whose sum depends on the order in which they are added.
    let values = |rank: Rank| {
        let step = f64::from(rank.0);
        [[1e16, 1.0, -1e16, 3.0][rank.index() % 4], 0.1 + step / 7.0, if rank.0 == 0 { -0.0 } else { 0.0 }]
    };
    let (own, size) = (transport.rank(), transport.size());
    let mut expected = values(Rank(0));
    for rank in Rank::all(size).skip(1) {
        expected.iter_mut().zip(values(rank)).for_each(|(sum, value)| *sum += value);
    }
    let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    let folded = transport.all_reduce_f64_in_rank_order(&values(own), |sum, value| sum + value).unwrap();
    assert_eq!(bits(&folded), bits(&expected));
    // An operation that is neither commutative nor associative tells any other order apart.
    let nested = transport.all_reduce_f64_in_rank_order(&[f64::from(own.0)], |left, right| 2.0 * left - right).unwrap();
    let expected = Rank::all(size).map(|rank| f64::from(rank.0)).reduce(|left, right| 2.0 * left - right);
    assert_eq!(nested.first().copied(), expected);
    assert_eq!(transport.all_reduce_f64_in_rank_order(&[], f64::max).unwrap(), []);

    let (count, number) = (size as u64, u64::from(own.0));
    assert_eq!(transport.all_sum_u64(number + 1).unwrap(), count * (count + 1) / 2);
    assert_eq!(transport.all_max_u64(number * 5).unwrap(), (count - 1) * 5);
    assert_eq!(transport.all_min_u64(number + 9).unwrap(), 9);
    assert_eq!(transport.all_sum_u64(1 << 63).unwrap(), if count % 2 == 0 { 0 } else { 1 << 63 });
}

pub(super) fn mismatched_reduction(transport: &mut dyn Transport) {
    let last = transport.rank().index() + 1 == transport.size();
    let values = if last { vec![1.0, 2.0] } else { vec![1.0] };
    assert_usage(transport.all_reduce_f64_in_rank_order(&values, |sum, value| sum + value));
    assert_eq!(transport.all_sum_u64(1).unwrap(), transport.size() as u64);
}

pub(super) fn counted_traffic(transport: &mut dyn Transport) {
    let peers = transport.size() as u64 - 1;
    let mut counting = Counting::new(transport);
    let mut incoming = Incoming::default();
    for number in 0..3 {
        round(&mut counting, &mut incoming, number, |from, to| if from == to { 1000 } else { 10 }).unwrap();
    }
    let full = counting.stats();
    let expected = Stats {
        exchanges: 3,
        messages_sent: 3 * peers,
        messages_received: 3 * peers,
        bytes_sent: 30 * peers,
        bytes_received: 30 * peers,
    };
    assert_eq!(full, expected);
    counting.barrier().unwrap();
    assert_eq!(counting.stats().since(&full), Stats { exchanges: 1, ..Stats::default() });
}
