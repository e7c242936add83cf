//! Tiles that are cut and joined as bodies come and go. Every so many steps all ranks tell each other how many bodies their tiles
//! have, and all come to the same new partition: it is part of the result, so times have no say in it.

use super::super::halo::RankHalo;
use super::super::recorder::Recorder;
use super::super::{RankError, unreadable};
use super::handover::{self, Move};
use crate::error::RunError;
use crate::folder::TilingsFile;
use crate::plan::{Plan, tiles};
use atoll_core::{Adaptive, Census, World};
use atoll_transport::{Collective, Counting, Rank, Stats, Transport};
use std::io;
use std::time::{Duration, Instant};
use tracing::info;

/// Sees to it that tiles follow the bodies.
pub(crate) struct Retiler {
    rule: Adaptive,
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
        let rule = tiles::rule(&plan.config, &plan.blueprint.kinds)?;
        let every = plan.config.run.adaptive?.retile_every;
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
        if self.retile(world, halo)?
            && let (Some(file), Some(recorder)) = (&mut self.file, recorder)
        {
            let written = file.append(world.step_count(), world.partition());
            written.unwrap_or_else(|error| fail(recorder, &error));
        }
        self.time += begun.elapsed();
        self.sent += halo.transport().stats().since(&sent);
        Ok(())
    }

    /// Says whether any tile changed.
    fn retile<T: Transport>(&self, world: &mut World, halo: &mut RankHalo<Counting<T>>) -> Result<bool, RankError> {
        // Where a rank has failed, its state is not fit to be moved; with the next step all ranks hear of it.
        let mut own = vec![u8::from(world.has_failed())];
        own.extend_from_slice(bytemuck::cast_slice(&world.census(&self.rule)));
        let told = halo.transport().all_gather(&own).map_err(RankError::Transport)?;
        let (mut census, mut failed) = (Vec::<Census>::new(), false);
        for (rank, told) in told.iter().enumerate() {
            let parts =
                told.split_first().map(|(has_failed, parts)| (has_failed, parts.chunks_exact(size_of::<Census>())));
            let (has_failed, parts) = parts
                .filter(|(_, parts)| parts.remainder().is_empty())
                .ok_or_else(|| RankError::Transport(unreadable(Rank::from_index(rank))))?;
            failed |= *has_failed != 0;
            census.extend(parts.map(bytemuck::pod_read_unaligned::<Census>));
        }
        if failed {
            return Ok(false);
        }
        census.sort_by_key(|part| part.tile);
        let old = world.partition();
        let Some(new) = old.adapted(&self.rule, &census).map_err(RankError::Setup)? else { return Ok(false) };
        let changes = old.changes(&new).expect("one follows from the other");
        let joined = halo.assignment().joined(&changes);
        let moves: Vec<Move> = halo.assignment().moves(&joined).collect();
        if !moves.is_empty() {
            handover::hand_over(&moves, world, halo.transport(), handover::ROUND)?;
        }
        world.retile(&new).map_err(RankError::Setup)?;
        halo.assign(joined.followed(&changes));
        info!(
            step = world.step_count(),
            changed = changes.iter().filter(|change| !change.is_none()).count(),
            to = new.tiles(),
            "tiles cut and joined"
        );
        Ok(true)
    }
}

/// Lets nothing more be written, as the tiles could not be.
fn fail(recorder: &Recorder<'_>, error: &io::Error) {
    recorder.fail(RunError::Output { path: recorder.output().folder.tilings(), reason: error.to_string() });
}
