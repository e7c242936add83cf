//! Tiles that follow the bodies. Every so many steps all ranks tell each other how much their tiles have to do, and all come to the same new partition: it is part of the result, so times have no say in it.

use super::super::halo::RankHalo;
use super::super::recorder::Recorder;
use super::super::{RankError, unreadable};
use super::handover::{self, Move};
use crate::error::RunError;
use crate::folder::TilingsFile;
use crate::plan::tiles::{self, Council, Rule, Unfollowed};
use crate::plan::{Assignment, Plan};
use atoll_core::{Partition, TileId, World};
use atoll_transport::{Collective, Counting, Rank, Stats, Transport};
use std::io;
use std::time::{Duration, Instant};
use tracing::info;

/// Sees to it that tiles follow the bodies.
pub(crate) struct Retiler {
    rule: Rule,
    every: u64,
    /// How long that took this rank.
    time: Duration,
    /// What ranks sent each other for it.
    pub(crate) sent: Stats,
    /// Where the tiles are written down, by one rank.
    file: Option<TilingsFile>,
}

impl Retiler {
    /// Where the configuration wants that, for a rank that begins, or goes on from the snapshot of the step `resumed`.
    pub(crate) fn start(
        plan: &Plan,
        resumed: Option<u64>,
        world: &World,
        rank: Rank,
        recorder: Option<&Recorder<'_>>,
    ) -> Option<Self> {
        let (rule, every) = tiles::rule(&plan.config, &plan.blueprint.kinds)?;
        let file = recorder.filter(|_| rank == Rank(0)).and_then(|recorder| {
            let started = TilingsFile::start(recorder.output().folder.tilings(), world.partition(), resumed);
            let shared = started.and_then(|file| Ok((file.shared()?, file)));
            let (shared, file) = shared.map_err(|error| fail(recorder, &error)).ok()?;
            recorder.sync_with_snapshots(vec![shared]);
            Some(file)
        });
        Some(Self { rule, every, time: Duration::ZERO, sent: Stats::default(), file })
    }

    /// How long it has taken this rank so far.
    pub(crate) fn time(&self) -> Duration {
        self.time
    }

    /// When it is time to, lets tiles be cut and joined.
    ///
    /// # Errors
    /// If a rank is lost, or sends what cannot be read.
    pub(crate) fn before_step<T: Transport>(
        &mut self,
        world: &mut World,
        halo: &mut RankHalo<Counting<T>>,
        recorder: Option<&Recorder<'_>>,
    ) -> Result<(), RankError> {
        if !world.step_count().is_multiple_of(self.every) {
            return Ok(());
        }
        let (begun, sent) = (Instant::now(), halo.transport().stats());
        if let Some(new) = self.retile(world, halo)?
            && let (Some(file), Some(recorder)) = (&mut self.file, recorder)
        {
            let written = file.append(world.step_count(), &new);
            written.unwrap_or_else(|error| fail(recorder, &error));
        }
        self.time += begun.elapsed();
        self.sent += halo.transport().stats().since(&sent);
        Ok(())
    }

    /// The new tiles, if any changed.
    fn retile<T: Transport>(
        &self,
        world: &mut World,
        halo: &mut RankHalo<Counting<T>>,
    ) -> Result<Option<Partition>, RankError> {
        let (assignment, transport) = halo.parts();
        let new = self.rule.follow(world, &mut Ranks { transport, assignment, has_failed: world.has_failed() })?;
        let Some(new) = new else { return Ok(None) };
        let old = world.partition();
        let changes = old.changes(&new).expect("one follows from the other");
        let joined = halo.assignment().joined(&changes);
        let moves: Vec<Move> = halo.assignment().moves(&joined).collect();
        if !moves.is_empty() {
            handover::hand_over(&moves, world, halo.transport(), handover::ROUND)?;
        }
        world.retile(&new).map_err(RankError::Setup)?;
        halo.assign(joined.followed(&changes));
        let changed = changes.iter().filter(|change| !change.is_none()).count();
        info!(step = world.step_count(), changed, to = new.tiles(), "tiles follow the bodies");
        Ok(Some(new))
    }
}

/// All ranks, over a transport.
struct Ranks<'a, T> {
    transport: &'a mut T,
    assignment: &'a Assignment,
    /// Whether this one has failed: its state is not fit to be moved, and with the next step all ranks hear of it.
    has_failed: bool,
}

impl<T: Transport> Council for Ranks<'_, T> {
    type Error = RankError;

    fn tell_all(&mut self, mut own: Vec<u8>) -> Result<Option<Vec<Vec<u8>>>, RankError> {
        own.push(u8::from(self.has_failed));
        let mut told = self.transport.all_gather(&own).map_err(RankError::Transport)?;
        let mut failed = false;
        for (rank, told) in told.iter_mut().enumerate() {
            failed |= told.pop().ok_or(Unfollowed::Unreadable(rank))? != 0;
        }
        Ok((!failed).then_some(told))
    }

    fn tell_holders(&mut self, own: Vec<(TileId, Vec<u32>)>) -> Result<Vec<Vec<u8>>, RankError> {
        let mut parcels = vec![Vec::new(); self.transport.size()];
        for (tile, words) in own {
            parcels[self.assignment.rank_of(tile)].extend_from_slice(bytemuck::cast_slice(&words));
        }
        let incoming = handover::send(&parcels, false, self.transport).map_err(RankError::Transport)?;
        Ok(incoming.iter().map(|(_, bytes)| bytes.to_vec()).collect())
    }
}

impl From<Unfollowed> for RankError {
    fn from(unfollowed: Unfollowed) -> Self {
        match unfollowed {
            Unfollowed::Unreadable(rank) => Self::Transport(unreadable(Rank::from_index(rank))),
            Unfollowed::Torn(error) => Self::Setup(error),
        }
    }
}

/// Lets nothing more be written, as the tiles could not be.
fn fail(recorder: &Recorder<'_>, error: &io::Error) {
    recorder.fail(RunError::Output { path: recorder.output().folder.tilings(), reason: error.to_string() });
}
