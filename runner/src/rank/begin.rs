//! How a rank begins: with its part of the scene, or of a snapshot.

use super::trouble::{Refusal, all_well};
use super::{Observer, RankError, names, records};
use crate::command::State;
use crate::error::RunError;
use crate::folder::snapshot::{NO_OTHER, Snapshot, SnapshotError};
use crate::plan::{Assignment, Holding, Plan};
use crate::scene::MOST_AT_A_PLACE;
use atoll_core::{Blueprint, Body, World};
use atoll_transport::{Collective, Rank, Transport};
use tracing::info;

/// A world about to be stepped.
pub(super) struct Beginning {
    pub(super) world: World,
    /// Which rank holds which of its tiles.
    pub(super) assignment: Assignment,
    /// The step after which it was saved, if it was.
    pub(super) resumed: Option<u64>,
    /// What commands had added up to by then, if there were any.
    pub(super) commands: Option<State>,
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
                let commands = snapshot.commands().cloned();
                return Ok(Beginning { world, assignment, resumed: Some(snapshot.step()), commands });
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
    let world = if plan.scene.file().is_some() { from_files(plan, rank, transport)? } else { made(plan, rank)? };
    Ok(Beginning { world, assignment: plan.assignment.clone(), resumed: None, commands: None })
}

/// So many pairs of bodies may be nearer than they are wide in any world: as many as files may have at one place.
const PAIRS: u64 = (MOST_AT_A_PLACE * MOST_AT_A_PLACE / 2) as u64;

/// And so many for each body: more than memory has room for, and no world that is meant.
const PAIRS_OF_A_BODY: u64 = 100;

/// Refuses a world in which far too many bodies are too near to each other, of all ranks, before contacts are looked for.
pub(super) fn check_crowding(world: &World, transport: &mut impl Transport) -> Result<(), RankError> {
    let own = [world.crowding(), world.body_count() as u64];
    let told = transport.all_gather(bytemuck::bytes_of(&own)).map_err(RankError::Transport)?;
    let told: Vec<[u64; 2]> = records(&told).map_err(RankError::Transport)?;
    let [pairs, bodies] = [0, 1].map(|which| told.iter().map(|counts| counts[which]).sum::<u64>());
    let refused = |error: RunError| RankError::Agreed { text: error.to_string(), exit: error.exit() };
    not_crowded(pairs, bodies).map_err(refused)
}

/// Refuses so many pairs of bodies that are nearer to each other than they are wide, as [`World::crowding`] counts them.
pub(crate) fn not_crowded(pairs: u64, bodies: u64) -> Result<(), RunError> {
    let is_crowded = pairs > PAIRS + PAIRS_OF_A_BODY * bodies;
    if is_crowded { Err(RunError::Crowded { pairs, bodies }) } else { Ok(()) }
}

/// This rank's part of a scene that is made, with which nothing can be wrong on one rank alone.
fn made(plan: &Plan, rank: Rank) -> Result<World, RankError> {
    scene(plan, rank).map_err(|error| match error {
        RunError::Setup(error) => RankError::Setup(error),
        error => RankError::Agreed { text: error.to_string(), exit: error.exit() },
    })
}

/// This rank's part of a scene in files, once all ranks have read theirs, and all of its bodies with names of their own are
/// somewhere.
fn from_files(plan: &Plan, rank: Rank, transport: &mut impl Transport) -> Result<World, RankError> {
    let read = scene(plan, rank);
    all_well(transport, read.as_ref().err())?;
    let world = read.map_err(|error| RankError::Agreed { text: error.to_string(), exit: error.exit() })?;
    let found = transport.all_sum_u64(world.bodies().count() as u64).map_err(RankError::Transport)?;
    all_well(transport, plan.scene.lost(found).map(RunError::Scene).as_ref())?;
    let doubled = names::doubled(transport, &world).map_err(RankError::Transport)?;
    let doubled = doubled.and_then(|id| plan.scene.doubled(id)).map(RunError::Scene);
    all_well(transport, doubled.as_ref())?;
    Ok(world)
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
/// If it makes no world, or its files cannot be read.
pub fn scene(plan: &Plan, rank: Rank) -> Result<World, RunError> {
    let tiles = plan.assignment.tiles_of(rank.index());
    let mut world = World::new(&plan.blueprint, &tiles)?;
    let mut bodies = 0_u64;
    let held = Holding::new(&plan.blueprint.partition, &tiles);
    let near = plan.scene.near(|low, high| held.meets(low, high));
    if plan.scene.file().is_none() {
        for body in near {
            bodies += u64::from(world.add(body?)?);
        }
    } else {
        // Whatever order they stand in, it is to make no difference.
        let mut found = near.collect::<Result<Vec<Body>, _>>()?;
        found.sort_unstable_by_key(|body| body.id);
        let doubled =
            found.windows(2).find(|pair| pair[0].id == pair[1].id).and_then(|pair| plan.scene.doubled(pair[0].id));
        if let Some(error) = doubled.or_else(|| plan.scene.crowd(&found)) {
            return Err(error.into());
        }
        for body in found {
            bodies += u64::from(world.add(body)?);
        }
    }
    info!(tiles = tiles.len(), bodies, "built");
    Ok(world)
}
