//! Contacts that begin and end, and bodies that enter and leave sensors, of which each rank tells for its bodies.

use super::super::{RankError, records};
use crate::command::{Event, Since};
use atoll_core::{Body, World, pairs_not_in};
use atoll_transport::{Collective, Rank, Transport};

/// A contact by the names of its bodies, the lower first; or a sensor and who is inside.
pub(super) type Pair = [u64; 2];

/// The pairs of this rank, ascending, as they were after the last step, of those that are followed.
#[derive(Default)]
pub(super) struct Followed {
    contacts: Option<Vec<Pair>>,
    insides: Option<Vec<Pair>>,
}

impl Followed {
    /// Follows some events from now on, or no more.
    ///
    /// # Errors
    /// If a rank is lost.
    pub(super) fn set(
        &mut self,
        event: Event,
        is_told: bool,
        world: &World,
        transport: &mut impl Transport,
    ) -> Result<(), RankError> {
        let pairs = if is_told { Some(now(event, world, transport)?) } else { None };
        *self.of(event) = pairs;
        Ok(())
    }

    /// Where those are not the pairs that there are now, as commands were done since the last step: what came and went, of all ranks.
    ///
    /// # Errors
    /// If a rank is lost.
    pub(super) fn since(
        &mut self,
        event: Event,
        world: &World,
        transport: &mut impl Transport,
    ) -> Result<Since, RankError> {
        let Some(before) = self.of(event).as_deref() else { return Ok(Since::default()) };
        let pairs = now(event, world, transport)?;
        let came = gather_all(transport, &pairs_not_in(&pairs, before))?;
        let went = gather_all(transport, &pairs_not_in(before, &pairs))?;
        // Of a pair that another rank tells of from now on both are said.
        Ok(Since { came: pairs_not_in(&came, &went), went: pairs_not_in(&went, &came) })
    }

    /// Goes back to the pairs after the last step, from those that there are now: who went is told of by one rank.
    pub(super) fn go_back(&mut self, event: Event, Since { came, went }: &Since, rank: Rank) {
        let Some(pairs) = self.of(event) else { return };
        *pairs = pairs_not_in(pairs, came);
        if rank == Rank(0) {
            pairs.extend(went);
            pairs.sort_unstable();
            pairs.dedup();
        }
    }

    fn of(&mut self, event: Event) -> &mut Option<Vec<Pair>> {
        match event {
            Event::Contacts => &mut self.contacts,
            Event::Sensors => &mut self.insides,
        }
    }

    /// Goes on to the pairs that there are now, and tells rank 0 which began and which ended since then, of all ranks; nothing where
    /// nobody follows them.
    ///
    /// # Errors
    /// If a rank is lost.
    pub(super) fn follow(
        &mut self,
        event: Event,
        world: &World,
        transport: &mut impl Transport,
    ) -> Result<Option<[Vec<Pair>; 2]>, RankError> {
        let Some(before) = self.of(event).take() else { return Ok(None) };
        let pairs = now(event, world, transport)?;
        let began = gather(transport, &pairs_not_in(&pairs, &before))?;
        let ended = gather(transport, &pairs_not_in(&before, &pairs))?;
        *self.of(event) = Some(pairs);
        // Of a pair that another rank tells of from now on both are said.
        Ok(began.zip(ended).map(|(began, ended)| [pairs_not_in(&began, &ended), pairs_not_in(&ended, &began)]))
    }
}

/// The pairs that there are.
fn now(event: Event, world: &World, transport: &mut impl Transport) -> Result<Vec<Pair>, RankError> {
    let pairs = match event {
        Event::Contacts => world.contact_pairs(),
        Event::Sensors => world.inside_sensors(&sensors(world, transport)?),
    };
    Ok(pairs.into_iter().map(|(a, b)| [a.0, b.0]).collect())
}

/// The sensors among the bodies of all ranks.
pub(super) fn sensors(world: &World, transport: &mut impl Transport) -> Result<Vec<Body>, RankError> {
    let own = world.sensors();
    if transport.size() == 1 {
        return Ok(own);
    }
    let told = transport.all_gather(bytemuck::cast_slice(&own)).map_err(RankError::Transport)?;
    records(&told).map_err(RankError::Transport)
}

/// What all ranks have to say, ascending.
fn gather_all(transport: &mut impl Transport, pairs: &[Pair]) -> Result<Vec<Pair>, RankError> {
    joined(&transport.all_gather(bytemuck::cast_slice(pairs)).map_err(RankError::Transport)?)
}

/// The same on rank 0.
fn gather(transport: &mut impl Transport, pairs: &[Pair]) -> Result<Option<Vec<Pair>>, RankError> {
    let parts = transport.gather(Rank(0), bytemuck::cast_slice(pairs)).map_err(RankError::Transport)?;
    parts.map(|parts| joined(&parts)).transpose()
}

fn joined(parts: &[Vec<u8>]) -> Result<Vec<Pair>, RankError> {
    let mut pairs: Vec<Pair> = records(parts).map_err(RankError::Transport)?;
    pairs.sort_unstable();
    Ok(pairs)
}
