//! How a rank begins: with its part of the scene, or of a snapshot.

use super::RankError;
use crate::error::RunError;
use crate::handshake::{self, Refusal};
use crate::plan::Plan;
use crate::snapshot::{NO_OLDER, Snapshot, SnapshotError};
use crate::telemetry::complain;
use atoll_core::World;
use atoll_transport::{Rank, Transport};
use tracing::info;

/// A world about to be stepped.
pub(super) struct Beginning {
    pub(super) world: World,
    /// The step after which it was saved, if it was.
    pub(super) resumed: Option<u64>,
}

/// This rank's part of the newest snapshot of which every rank can read its part, or else of the scene.
pub(super) fn build(plan: &Plan, rank: Rank, transport: &mut impl Transport) -> Result<Beginning, RankError> {
    let mut snapshots = plan.found.snapshots.iter().peekable();
    while let Some(snapshot) = snapshots.next() {
        let restored = restore(plan, rank, snapshot)?;
        // What cannot be read just now is no reason to give it up.
        let (unreadable, restored) = match restored {
            Err(error) if !error.is_damage() => (Some(RunError::Snapshot(error)), None),
            restored => (None, Some(restored.map_err(RunError::Snapshot))),
        };
        handshake::all_well(transport, unreadable.as_ref())?;
        let Some(restored) = restored else { unreachable!("all can read it") };
        match (handshake::all_well(transport, restored.as_ref().err()), restored) {
            (Ok(()), Ok(world)) => return Ok(Beginning { world, resumed: Some(snapshot.step()) }),
            (Err(Refusal::Known(error)), _) if snapshots.peek().is_some() => {
                if rank == Rank(0) {
                    let step = snapshots.peek().map_or(0, |snapshot| snapshot.step());
                    complain(&format!("{error}; going on after step {step} instead"));
                }
            }
            (Err(Refusal::Known(error)), _) => {
                return Err(RankError::Agreed { text: format!("{error}; {NO_OLDER}"), exit: error.exit() });
            }
            (Err(refusal), _) => return Err(refusal.into()),
            (Ok(()), Err(_)) => unreachable!("all are well"),
        }
    }
    Ok(Beginning { world: scene(plan, rank)?, resumed: None })
}

/// This rank's tiles of a snapshot. That they cannot be read is for all ranks to hear.
fn restore(plan: &Plan, rank: Rank, snapshot: &Snapshot) -> Result<Result<World, SnapshotError>, RankError> {
    let mut world = World::new(&plan.blueprint, &plan.assignment.tiles_of(rank.index())).map_err(RankError::Setup)?;
    let restored = snapshot.restore(&mut world);
    if restored.is_ok() {
        info!(step = snapshot.step(), bodies = world.bodies().count(), "restored");
    }
    Ok(restored.map(|()| world))
}

/// This rank's part of the scene.
fn scene(plan: &Plan, rank: Rank) -> Result<World, RankError> {
    let tiles = plan.assignment.tiles_of(rank.index());
    let mut world = World::new(&plan.blueprint, &tiles).map_err(RankError::Setup)?;
    let mut bodies = 0_u64;
    if !tiles.is_empty() {
        for body in plan.scene.iter() {
            bodies += u64::from(world.add(body).map_err(RankError::Setup)?);
        }
    }
    info!(tiles = tiles.len(), bodies, "built");
    Ok(world)
}
