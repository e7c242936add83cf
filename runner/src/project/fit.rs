//! What a transport puts between ranks, found by sending: what an empty round takes gives the latency, and what messages to
//! another rank take beyond messages to oneself gives the bandwidth.

use super::network::Network;
use atoll_transport::{Collective, Incoming, Rank, Transport, TransportError};
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Lengths of messages, about those of halos.
const LENGTHS: [usize; 4] = [8 << 10, 32 << 10, 64 << 10, 128 << 10];

/// Every round is made in so many batches, of which the fastest counts: it was disturbed least.
const BATCHES: usize = 15;

/// A batch takes about so long.
const BATCH: Duration = Duration::from_millis(5);

/// Rounds by which it is found how many make a batch.
const TRIAL: u64 = 8;

/// Faster than this, what a byte takes cannot be told from nothing.
const FASTEST: f64 = 1e12;

/// Measures what is between ranks: all of them do so together, and each half of them sends to the other half, so that who shares a
/// way has its part of it. What rank 0 found holds.
///
/// # Errors
/// If a rank is lost.
pub(crate) fn measured<T: Transport>(transport: T) -> Result<Network, TransportError> {
    let mut rounds = Rounds { transport, incoming: Incoming::default(), memory: vec![[1; LENGTHS[3]]; 2] };
    let (rank, size) = (rounds.transport.rank(), rounds.transport.size());
    let across = Rank((rank.0 + size as u32 / 2) % size as u32);
    let empty = rounds.seconds(across, 0)?;
    let mut more = [(0.0, 0.0); LENGTHS.len()];
    for (more, length) in more.iter_mut().zip(LENGTHS) {
        *more = (length as f64, rounds.seconds(across, length)? - rounds.seconds(rank, length)?);
    }
    Ok(fitted(size, empty, &more))
}

/// The network on which a round without messages takes so long, and messages of so many bytes to other ranks so much longer than to
/// oneself.
fn fitted(ranks: usize, empty: f64, more: &[(f64, f64)]) -> Network {
    let (bytes, seconds) = more.iter().fold((0.0, 0.0), |sums, &(length, more)| (sums.0 + length, sums.1 + more));
    let mean = [bytes, seconds].map(|sum| sum / more.len() as f64);
    let (mut spread, mut slope) = (0.0, 0.0);
    for &(length, more) in more {
        spread += (length - mean[0]).powi(2);
        slope += (length - mean[0]) * (more - mean[1]);
    }
    let latency = Network::latency_of(ranks, empty);
    Network { latency, bandwidth: (slope / spread).max(1.0 / FASTEST).recip() }
}

/// Rounds in which each rank sends to one.
struct Rounds<T> {
    transport: T,
    incoming: Incoming,
    /// What is sent, and a place for what is received.
    memory: Vec<[u8; LENGTHS[3]]>,
}

impl<T: Transport> Rounds<T> {
    /// What a round takes in which this rank sends so many bytes to that one.
    fn seconds(&mut self, to: Rank, length: usize) -> Result<f64, TransportError> {
        let trial = self.batch(to, length, TRIAL)?.as_nanos() as u64;
        // All must make as many.
        let slowest = self.transport.all_max_u64(trial)?.max(1);
        let rounds = (BATCH.as_nanos() as u64 * TRIAL / slowest).clamp(TRIAL, 1 << 14);
        let mut least = Duration::MAX;
        for _ in 0..BATCHES {
            least = least.min(self.batch(to, length, rounds)?);
        }
        Ok(least.as_secs_f64() / rounds as f64)
    }

    fn batch(&mut self, to: Rank, length: usize, rounds: u64) -> Result<Duration, TransportError> {
        let begun = Instant::now();
        let mut lengths = vec![0; self.transport.size()];
        lengths[to.index()] = length;
        for _ in 0..rounds {
            let outgoing = self.transport.prepare(&lengths)?;
            for (_, buffer) in outgoing.iter_mut() {
                buffer.copy_from_slice(&self.memory[0][..buffer.len()]);
            }
            self.transport.exchange(&mut self.incoming)?;
            for (_, message) in self.incoming.iter() {
                self.memory[1][..message.len()].copy_from_slice(message);
            }
            black_box(&self.memory[1]);
        }
        Ok(begun.elapsed())
    }
}

#[cfg(test)]
mod tests {
    use super::super::network::PRESETS;
    use super::*;

    #[test]
    fn a_network_is_found_by_what_rounds_take_on_it() {
        for (name, network) in PRESETS {
            for ranks in [2, 3, 144] {
                let more = LENGTHS.map(|length| (length as f64, 3e-6 + length as f64 / network.bandwidth));
                let found = fitted(ranks, network.sync(ranks), &more);
                let is_near = |a: f64, b: f64| (a - b).abs() < 1e-6 * b;
                assert!(is_near(found.latency, network.latency), "{name}, {ranks}: {found:?}");
                assert!(is_near(found.bandwidth, network.bandwidth), "{name}, {ranks}: {found:?}");
            }
        }
    }

    #[test]
    fn what_takes_no_time_is_no_nonsense() {
        let found = fitted(2, 1e-9, &LENGTHS.map(|length| (length as f64, -1e-12 * length as f64)));
        assert_eq!(found, Network { latency: 0.0, bandwidth: FASTEST });
    }
}
