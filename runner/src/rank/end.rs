//! The beginning and the end of what a rank writes, which ranks come to together.

use super::log::Log;
use super::recorder::Recorder;
use super::trouble::all_well;
use super::{Observer, RankError};
use crate::command::State;
use crate::error::RunError;
use crate::folder::durable::is_gone;
use crate::folder::{RunFolder, snapshot};
use crate::plan::{Output, Plan};
use atoll_core::World;
use atoll_transport::{Collective, Rank, Transport};
use std::time::{Duration, Instant};

/// Hosts of a cluster may see a new file a little later than the one that wrote it.
const UNSEEN: Duration = Duration::from_secs(10);

/// A user may wonder after so long.
const SILENCE: Duration = Duration::from_secs(10);

/// Starts to write, on all ranks or none. Where the run goes on, its folder is first made that of a run which goes on from there:
/// what an earlier attempt left after that step is removed.
pub(super) fn start<'a>(
    plan: &'a Plan,
    rank: Rank,
    resumed: Option<u64>,
    transport: &mut impl Transport,
) -> Result<Option<Recorder<'a>>, RankError> {
    let Some(output) = &plan.output else { return Ok(None) };
    let token = if rank == Rank(0) { output.folder.token().unwrap_or_default() } else { Vec::new() };
    let token = transport.all_gather(&token).map_err(RankError::Transport)?.swap_remove(0);
    // Others wait for the one that waits.
    let claim = output.folder.share(&token, UNSEEN.min(plan.config.run.peer_timeout / 2)).map_err(RunError::Folder);
    all_well(transport, claim.as_ref().err())?;
    let goes_on = match rank {
        Rank(0) if !output.begins => output.folder.go_on(resumed, &output.configuration),
        _ => Ok(()),
    };
    // Nobody writes before it is done.
    let trouble = goes_on.err().map(|error| RunError::Folder(output.folder.not_writable(&error)));
    all_well(transport, trouble.as_ref())?;
    let recorder = claim.and_then(|claim| Recorder::start(plan, output, claim, rank, resumed));
    all_well(transport, recorder.as_ref().err())?;
    Ok(recorder.ok())
}

/// Waits until everything is written, on all ranks, and says how long this one spent on writing. A run that was `stopped`
/// leaves a snapshot to go on from.
pub(super) fn finish(
    mut recorder: Recorder<'_>,
    (world, commands): (&World, Option<&State>),
    stopped: bool,
    plan: &Plan,
    observer: &Observer,
    transport: &mut impl Transport,
) -> Result<Duration, RankError> {
    let Output { folder, every, .. } = recorder.output();
    let patience = plan.config.run.peer_timeout / 4;
    together(transport, observer, folder, || recorder.has_room(patience))?;
    // Before the first step there is nothing that a run which begins anew would not come to.
    if world.step_count() > 0 && (stopped || every.checkpoint_every.is_some()) {
        recorder.snapshot(world, commands);
    }
    let kept = recorder.snapshot_before();
    together(transport, observer, folder, || recorder.close(patience))?;
    let time = recorder.time();
    let trouble = match recorder.failure() {
        // Whatever else went wrong follows from that.
        _ if is_gone(&folder.configuration()) => Some(RunError::Gone { path: folder.configuration() }),
        Some(RunError::Gone { path }) => Some(RunError::Gone { path: path.clone() }),
        why => why.map(|why| RunError::StoppedWriting {
            why: why.to_string(),
            complete: world.step_count(),
            steps: plan.config.run.steps,
            folder: folder.path().to_owned(),
        }),
    };
    all_well(transport, trouble.as_ref())?;
    if let (Rank(0), Some(kept)) = (transport.rank(), kept)
        && let Err(error) = snapshot::remove_before(&folder.snapshots(), kept)
    {
        observer.note(&format!("old snapshots stay in {}: {error}", folder.snapshots().display()));
    }
    Ok(time)
}

/// Makes the log of a run durable that writes nothing else, and says how long this rank spent on that. A `failure` to write it
/// ended the run.
pub(super) fn finish_log(
    log: Option<&Log>,
    failure: Option<RunError>,
    complete: u64,
    plan: &Plan,
    transport: &mut impl Transport,
) -> Result<Duration, RankError> {
    let Some(log) = log else { return Ok(Duration::ZERO) };
    let start = Instant::now();
    let stopped =
        |why: RunError| RunError::StoppedLogging { why: why.to_string(), complete, steps: plan.config.run.steps };
    let trouble = failure.or_else(|| log.sync().err()).map(stopped);
    let time = start.elapsed();
    all_well(transport, trouble.as_ref())?;
    Ok(time)
}

/// Waits until `done` says so on all ranks: however slow the disk of one is, the others hear of it.
fn together(
    transport: &mut impl Transport,
    observer: &Observer,
    folder: &RunFolder,
    mut done: impl FnMut() -> bool,
) -> Result<(), RankError> {
    let (start, mut told) = (Instant::now(), false);
    while !transport.all_gather(&[u8::from(done())]).map_err(RankError::Transport)?.iter().all(|rank| rank == &[1]) {
        if transport.rank() == Rank(0) && start.elapsed() > SILENCE && !std::mem::replace(&mut told, true) {
            observer.note(&format!("waiting for what is written to {}", folder.path().display()));
        }
    }
    Ok(())
}
