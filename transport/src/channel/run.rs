//! Starts one thread per rank and waits for all of them.

use std::thread;

use super::{Channel, ChannelOptions, connect};
use crate::{Rank, RankFailure};

/// Runs `body` on `size` threads, named "rank 0" and so on, each with its endpoint, and returns what became of each
/// rank, in rank order. For `size` 0 that is nothing at all.
///
/// `body` may borrow from the caller. It owns its endpoint, so that a panic reaches the other ranks as one.
///
/// A rank that panics or aborts is a [`RankFailure`] in its own place; the others get a
/// [`PeerLost`](crate::TransportError::PeerLost) from their next exchange and go on as they see fit. If the options
/// are not usable, every rank is [`NotStarted`](RankFailure::NotStarted).
///
/// ```
/// use atoll_transport::channel::{self, ChannelOptions};
/// use atoll_transport::{Collective, Rank, RankFailure, Transport, TransportError};
///
/// let results = channel::run(2, ChannelOptions::default(), |mut endpoint| {
///     if endpoint.rank() == Rank(1) {
///         endpoint.abort("the disk is full");
///     }
///     endpoint.barrier()
/// });
/// assert_eq!(results[1], Err(RankFailure::Aborted { rank: Rank(1), reason: "the disk is full".into() }));
/// let lost = results[0].clone().expect("rank 0 returns").unwrap_err();
/// assert_eq!(lost.blamed(), Some(Rank(1)));
/// ```
pub fn run<R: Send>(
    size: usize,
    options: ChannelOptions,
    body: impl Fn(Channel) -> R + Sync,
) -> Vec<Result<R, RankFailure>> {
    let not_started = |rank, reason: String| RankFailure::NotStarted { rank, reason };
    let builders = match connect(size, options) {
        Ok(builders) => builders,
        Err(error) => return Rank::all(size).map(|rank| Err(not_started(rank, error.to_string()))).collect(),
    };
    let body = &body;
    thread::scope(|scope| {
        // All start before the first is joined. An end whose thread does not start is dropped, which tells the rest.
        let threads: Vec<_> = builders
            .into_iter()
            .map(|builder| {
                let rank = builder.rank();
                let named = thread::Builder::new().name(format!("rank {rank}"));
                (rank, named.spawn_scoped(scope, move || body(builder.build())))
            })
            .collect();
        threads
            .into_iter()
            .map(|(rank, thread)| match thread {
                Ok(thread) => thread.join().map_err(|payload| RankFailure::from_panic(rank, payload)),
                Err(error) => Err(not_started(rank, error.to_string())),
            })
            .collect()
    })
}
