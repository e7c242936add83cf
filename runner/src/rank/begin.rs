//! How a rank begins: with its part of the scene, or of a snapshot.

use super::trouble::{Refusal, all_well};
use super::{Observer, RankError};
use crate::error::RunError;
use crate::folder::snapshot::{NO_OTHER, Snapshot, SnapshotError};
use crate::plan::{Assignment, Holding, Plan};
use atoll_core::{Blueprint, SetupError, World};
use atoll_transport::{Rank, Transport};
use tracing::info;

/// A world about to be stepped.
pub(super) struct Beginning {
    pub(super) world: World,
    /// Which rank holds which of its tiles.
    pub(super) assignment: Assignment,
    /// The step after which it was saved, if it was.
    pub(super) resumed: Option<u64>,
}

/// This rank's part of the newest snapshot of which every rank can read its part, or else of the scene.
pub(super) fn build(
    plan: &Plan,
    rank: Rank,
    observer: &Observer,
    transport: &mut impl Transport,
) -> Result<Beginning, RankError> {
    let mut snapshots = plan.found.snapshots.iter().peekable();
    while let Some(snapshot) = snapshots.next() {
        let restored = restore(plan, rank, snapshot)?.map_err(RunError::Snapshot);
        let is_damage = |error: &&RunError| matches!(error, RunError::Snapshot(error) if error.is_damage());
        // What cannot be read just now is no reason to give it up.
        all_well(transport, restored.as_ref().err().filter(|error| !is_damage(error)))?;
        let error = match (all_well(transport, restored.as_ref().err()), restored) {
            (Ok(()), Ok((world, assignment))) => {
                return Ok(Beginning { world, assignment, resumed: Some(snapshot.step()) });
            }
            (Ok(()), Err(error)) | (Err(Refusal::Known(error)), _) => error,
            (Err(refusal), _) => return Err(refusal.into()),
        };
        let Some(next) = snapshots.peek().map(|next| next.step()) else {
            return Err(RankError::Agreed { text: format!("{error}; {NO_OTHER}"), exit: error.exit() });
        };
        if rank == Rank(0) {
            observer.note(&format!("{error}; going on after step {next} instead"));
        }
    }
    let world = scene(plan, rank).map_err(RankError::Setup)?;
    Ok(Beginning { world, assignment: plan.assignment.clone(), resumed: None })
}

/// This rank's tiles of a snapshot, and who holds which. That they cannot be read is for all ranks to hear.
fn restore(
    plan: &Plan,
    rank: Rank,
    snapshot: &Snapshot,
) -> Result<Result<(World, Assignment), SnapshotError>, RankError> {
    let partition = match snapshot.partition(&plan.blueprint.partition) {
        Ok(partition) => partition,
        Err(error) => return Ok(Err(error)),
    };
    // The plan is for the newest snapshot; another may have other tiles.
    let assignment = if partition == plan.blueprint.partition {
        plan.assignment.clone()
    } else {
        Assignment::balanced(&partition, &snapshot.weights(), plan.assignment.ranks())
    };
    let blueprint = Blueprint { partition, ..plan.blueprint.clone() };
    let mut world = World::new(&blueprint, &assignment.tiles_of(rank.index())).map_err(RankError::Setup)?;
    let restored = snapshot.restore(&mut world);
    if restored.is_ok() {
        info!(step = snapshot.step(), bodies = world.bodies().count(), "restored");
    }
    Ok(restored.map(|()| (world, assignment)))
}

/// This rank's part of the scene.
///
/// # Errors
/// If it makes no world.
pub fn scene(plan: &Plan, rank: Rank) -> Result<World, SetupError> {
    let tiles = plan.assignment.tiles_of(rank.index());
    let mut world = World::new(&plan.blueprint, &tiles)?;
    let mut bodies = 0_u64;
    let held = Holding::new(&plan.blueprint.partition, &tiles);
    for body in plan.scene.near(|low, high| held.meets(low, high)) {
        bodies += u64::from(world.add(body)?);
    }
    info!(tiles = tiles.len(), bodies, "built");
    Ok(world)
}
