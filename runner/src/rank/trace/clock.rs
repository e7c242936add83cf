//! One clock for all ranks. Those of one process have one anyway; others may be on other machines, so they learn by a few
//! rounds how far their clock is from that of rank 0.

use atoll_transport::{Collective, Rank, Transport, TransportError};
use std::hash::{BuildHasher, RandomState};
use std::sync::OnceLock;
use std::time::Instant;

/// The more rounds, the nearer the best of them.
const ROUNDS: usize = 64;

/// What to add to this rank's clock for that of rank 0.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(super) struct Offset {
    /// In nanoseconds.
    pub nanos: i64,
    /// How wrong that may be, in nanoseconds.
    pub doubt: u64,
}

/// When a rank entered a round, and when it left.
type Round = [i64; 2];

/// A clock that never goes back, and by what it is told from that of another process.
fn clock() -> &'static (Instant, u64) {
    static CLOCK: OnceLock<(Instant, u64)> = OnceLock::new();
    CLOCK.get_or_init(|| (Instant::now(), RandomState::new().hash_one(0)))
}

/// Nanoseconds since this process first asked.
pub(super) fn now() -> u64 {
    clock().0.elapsed().as_nanos() as u64
}

/// Compares this rank's clock with that of rank 0. All ranks do it together.
pub(super) fn align(transport: &mut impl Transport) -> Result<Offset, TransportError> {
    let clocks = transport.all_gather(&clock().1.to_ne_bytes())?;
    let mut rounds = Vec::with_capacity(ROUNDS);
    for _ in 0..ROUNDS {
        let entered = now() as i64;
        transport.barrier()?;
        rounds.push([entered, now() as i64]);
    }
    let all = transport.all_gather(bytemuck::cast_slice(&rounds))?;
    let first: Vec<Round> = all[0].chunks_exact(size_of::<Round>()).map(bytemuck::pod_read_unaligned).collect();
    match first.len() {
        _ if clocks[0] == clock().1.to_ne_bytes() => Ok(Offset::default()),
        ROUNDS => Ok(offset(&first, &rounds)),
        _ => Err(super::super::unreadable(Rank(0))),
    }
}

/// Nobody leaves a round before all have entered it, which bounds the offset from both sides.
fn offset(first: &[Round], own: &[Round]) -> Offset {
    let pairs = || first.iter().zip(own);
    let least = pairs().map(|(first, own)| first[0].saturating_sub(own[1])).max().unwrap_or(0);
    let most = pairs().map(|(first, own)| first[1].saturating_sub(own[0])).min().unwrap_or(0);
    Offset { nanos: least / 2 + most / 2, doubt: most.abs_diff(least) / 2 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use atoll_transport::channel::{self, ChannelOptions};

    #[test]
    fn an_offset_is_found_within_what_is_in_doubt() {
        // This rank's clock is 1000 behind; each waits for the other in turn.
        let first = [[0, 110], [200, 260], [300, 390]];
        let own = [[-900, -895], [-850, -745], [-620, -605]].map(|[a, b]: Round| [a, b]);
        let found = offset(&first, &own);
        assert!(found.nanos.abs_diff(1000) <= found.doubt && found.doubt <= 33, "{found:?}");
    }

    #[test]
    fn threads_of_one_process_have_one_clock() {
        let ends = channel::run(2, ChannelOptions::default(), |mut endpoint| align(&mut endpoint));
        assert!(ends.into_iter().all(|end| end.unwrap() == Ok(Offset::default())));
    }
}
