//! Measures what the transport of a configuration puts between ranks.

#[cfg(feature = "iceoryx2")]
use super::iceoryx2;
#[cfg(feature = "mpi")]
use super::mpi::Job;
use crate::config::{Config, TransportKind};
use crate::error::RunError;
use crate::project::{Measured, Network, measured};
use atoll_transport::channel::{self, ChannelOptions};
#[cfg(feature = "mpi")]
use std::fmt::Display;
use std::thread;

/// What is between ranks, and where that was measured.
pub(crate) type Fit = (Network, Measured);

/// Fewer ranks have nobody to send to.
const LEAST: usize = 2;

/// Measures what is between ranks that are threads, or processes of this machine: as many as the configuration has and there are
/// cores for, or two.
///
/// # Errors
/// If they cannot be started, or one is lost.
pub(crate) fn fit(config: &Config) -> Result<Fit, RunError> {
    // What more than that wait for is a core.
    let most = thread::available_parallelism().map_or(LEAST, usize::from).max(LEAST);
    let (ranks, peer_timeout) = (config.run.ranks.clamp(LEAST, most), config.run.peer_timeout);
    #[cfg(feature = "iceoryx2")]
    if config.transport() == TransportKind::Iceoryx2 {
        let transport = TransportKind::Iceoryx2.name();
        return Ok((iceoryx2::fit(ranks, peer_timeout)?, Measured { transport, ranks }));
    }
    let found = channel::run(ranks, ChannelOptions { peer_timeout }, measured).swap_remove(0);
    let found = found.map_err(|failure| failure.to_string());
    let network = found.and_then(|found| found.map_err(|error| error.to_string())).map_err(RunError::Ranks)?;
    Ok((network, Measured { transport: TransportKind::Channel.name(), ranks }))
}

/// Measures what is between the ranks of an MPI job, this process one of them. Nothing where another process is to go on. What
/// this one has to say before the job ends, it says with `complain`.
///
/// # Errors
/// If the configuration cannot be read, or the job cannot be joined or has one rank only.
#[cfg(feature = "mpi")]
pub(crate) fn fit_job(
    config: Result<Config, RunError>,
    complain: fn(&dyn Display),
) -> Result<Option<(Config, Fit)>, RunError> {
    let mut job = Job::join(complain)?;
    let config = config.and_then(|config| {
        let config = job.adapt(config)?;
        if config.run.ranks < LEAST {
            return Err(RunError::Ranks(
                "--fit: one rank has nobody to send to; start more, with mpirun -n 2".to_owned(),
            ));
        }
        Ok(config)
    });
    let config = job.all_well(config)?;
    let network = job.measured(&config);
    let (speaks, ranks) = (job.speaks(), config.run.ranks);
    job.close();
    Ok(speaks.then_some((config, (network, Measured { transport: TransportKind::Mpi.name(), ranks }))))
}
