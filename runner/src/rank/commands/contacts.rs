//! Contacts that begin and end, of which each rank tells for its bodies.

use super::super::{RankError, records};
use atoll_core::World;
use atoll_transport::{Collective, Rank, Transport};

/// A contact by the names of its bodies, the lower first.
pub(super) type Pair = [u64; 2];

/// The contacts of this rank, ascending.
#[derive(Default)]
pub(super) struct Contacts(Vec<Pair>);

impl Contacts {
    /// Those that there are.
    pub(super) fn of(world: &World) -> Self {
        let contacts = world.views().flat_map(|tile| tile.contacts());
        // Of one between two tiles the owner of body A tells.
        let own = contacts.filter(|contact| !contact.is_border || contact.owned[0].is_some());
        let mut pairs: Vec<Pair> = own.map(|contact| contact.bodies.map(|id| id.0)).collect();
        pairs.sort_unstable();
        Self(pairs)
    }

    /// Goes on to those that there are now, and tells rank 0 which began and which ended since then, of all ranks.
    ///
    /// # Errors
    /// If a rank is lost.
    pub(super) fn follow(
        &mut self,
        world: &World,
        transport: &mut impl Transport,
    ) -> Result<Option<[Vec<Pair>; 2]>, RankError> {
        let before = std::mem::replace(self, Self::of(world));
        let began = gather(transport, &not_in(&self.0, &before.0))?;
        let ended = gather(transport, &not_in(&before.0, &self.0))?;
        // Of a contact that another rank tells of from now on both are said.
        Ok(began.zip(ended).map(|(began, ended)| [not_in(&began, &ended), not_in(&ended, &began)]))
    }
}

fn not_in(all: &[Pair], others: &[Pair]) -> Vec<Pair> {
    all.iter().filter(|pair| others.binary_search(pair).is_err()).copied().collect()
}

/// What all ranks have to say, ascending, on rank 0.
fn gather(transport: &mut impl Transport, pairs: &[Pair]) -> Result<Option<Vec<Pair>>, RankError> {
    let parts = transport.gather(Rank(0), bytemuck::cast_slice(pairs)).map_err(RankError::Transport)?;
    let Some(parts) = parts else { return Ok(None) };
    let mut pairs: Vec<Pair> = records(&parts).map_err(RankError::Transport)?;
    pairs.sort_unstable();
    Ok(Some(pairs))
}
