//! Ranks as threads of this process.

use super::Ends;
use crate::plan::Plan;
use crate::rank::{self, Observer};
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

/// A thread of its own all the same: it becomes the first of the rank's thread pool, and the caller's thread could not
/// leave that again.
pub(super) fn local(plan: &Plan, observer: &Observer) -> Ends {
    let end = thread::scope(|scope| {
        let thread = thread::Builder::new()
            .name("rank 0".to_owned())
            .spawn_scoped(scope, || rank::drive(Local::new(), plan, observer, true));
        match thread {
            Ok(thread) => thread.join().map_err(|payload| RankFailure::from_panic(Rank(0), payload)),
            Err(error) => Err(RankFailure::NotStarted { rank: Rank(0), reason: error.to_string() }),
        }
    });
    vec![end]
}
