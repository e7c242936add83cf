//! What ghosts feel of contacts that are not solved where they are ghosts, in the first substep; of later ones owners tell with each refresh.
//!
//! Which contacts a tile solves follows from where bodies are now, and of bodies that are not its own a tile knows where they were a step
//! before: whoever sends a ghost does not know all that its receiver will solve. With `exchange = "substep"` both copies of a contact have
//! pressed alike, and what is solved for others begins as its owner has it. So all that a body's contacts did goes with its ghost, and the
//! receiver leaves out what it solves, before any come that are sent on behalf of [far](super::far) bodies. With `"step"` copies differ; there
//! the sender leaves out what it takes the receiver to solve.

use crate::exchange::overlap::Outline;
use crate::model::id::GlobalId;
use crate::model::params::Exchange;
use crate::model::strays::Stray;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// Whether ghosts come with what all their contacts did, and what is solved is [left out](leave_out) where they are ghosts.
pub(crate) fn is_left_out_later(setup: &Setup) -> bool {
    setup.params.exchange == Exchange::Substep
}

/// Names of ghosts, ascending, each with its place.
pub(crate) type GhostNames = Vec<(GlobalId, u32)>;

/// Leaves out what ghosts felt of contacts that the tile solves, or would if they still touched: of those it knows what they did.
pub(crate) fn leave_out(tile: &mut Tile, ghosts: &mut GhostNames, setup: &Setup) {
    if !is_left_out_later(setup) || tile.ghosts() == 0 {
        return;
    }
    let (owned, dynamic) = (tile.owned, tile.owned + tile.ghosts());
    ghosts.clear();
    ghosts.extend(tile.bodies.id[owned..dynamic].iter().copied().zip(0..));
    ghosts.sort_unstable();
    let mut unseen = std::mem::take(&mut tile.unseen);
    let is_near = |ghost: usize| Outline::of(tile, owned + ghost, setup).is_near(tile.id, setup);
    let ghost_of = |name: GlobalId| {
        let place = ghosts.binary_search_by_key(&name, |(id, _)| *id).ok()?;
        Some(ghosts[place].1 as usize)
    };
    for Stray { pair, authority, contact } in tile.strays.known().filter(|stray| stray.contact.presses()) {
        let [a, b] = [ghost_of(pair.0), ghost_of(pair.1)];
        let is_solved = match (a, b) {
            (None, None) => continue,
            (Some(a), Some(b)) => is_near(a) && is_near(b),
            (Some(ghost), None) | (None, Some(ghost)) => {
                let other = if a.is_some() { pair.1 } else { pair.0 };
                if setup.is_static(other) { is_near(ghost) } else { authority.is_own() }
            }
        };
        if is_solved {
            let (linear, on_a, on_b) = contact.impulse();
            for (ghost, linear, angular) in [(a, linear, -on_a), (b, -linear, -on_b)] {
                if let Some(ghost) = ghost {
                    unseen[ghost].add(linear, angular);
                }
            }
        }
    }
    tile.unseen = unseen;
}
