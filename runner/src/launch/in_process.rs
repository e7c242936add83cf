//! Ranks as threads of this process.

use super::Ends;
use crate::plan::Plan;
use crate::rank::{self, Observer, RankEnd};
use atoll_transport::channel::{self, ChannelOptions};
use atoll_transport::local::Local;
use atoll_transport::{Rank, RankFailure, Transport};
use std::thread;

pub(super) fn channel(plan: &Plan, observer: &Observer) -> Ends {
    let options = ChannelOptions { peer_timeout: plan.config.run.peer_timeout };
    channel::run(plan.config.run.ranks, options, |endpoint| {
        // The ranks share one process, and the first reports its memory.
        let leads_process = endpoint.rank() == Rank(0);
        rank::drive(endpoint, plan, observer, leads_process)
    })
}

/// One rank, which is all there is.
pub(super) fn local(plan: &Plan, observer: &Observer) -> Ends {
    vec![on_own_thread(Rank(0), || rank::drive(Local::new(), plan, observer, true))]
}

/// Runs a rank on a thread of its own, also where it is the only one of its process: the thread becomes the first of the
/// rank's thread pool, and the caller's could not leave that again; and its stack is as large as it needs, whatever limit
/// the process was started with.
pub(super) fn on_own_thread(rank: Rank, body: impl FnOnce() -> RankEnd + Send) -> Result<RankEnd, RankFailure> {
    thread::scope(|scope| match thread::Builder::new().name(format!("rank {rank}")).spawn_scoped(scope, body) {
        Ok(thread) => thread.join().map_err(|payload| RankFailure::from_panic(rank, payload)),
        Err(error) => Err(RankFailure::NotStarted { rank, reason: error.to_string() }),
    })
}
