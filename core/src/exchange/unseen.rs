//! What ghosts feel of contacts that are not solved where they are ghosts, in the first substep; of later ones owners tell with each refresh.
//!
//! Which contacts a tile solves follows from where bodies are now, and of bodies that are not its own a tile knows where they were a step
//! before: whoever sends a ghost does not know all that its receiver will solve. With `exchange = "substep"` both copies of a contact have
//! pressed alike, and what is solved for others begins as its owner has it. So all that a body's contacts did goes with its ghost, and the
//! receiver leaves out what it solves. With `"step"` copies differ; there the sender leaves out what it takes the receiver to solve.

use crate::collide::broad_phase::Pair;
use crate::model::params::Exchange;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// Whether ghosts come with what all their contacts did, and what is solved is [left out](leave_out) where they are ghosts.
pub(crate) fn is_left_out_later(setup: &Setup) -> bool {
    setup.params.exchange == Exchange::Substep
}

/// Leaves out what ghosts felt of contacts that the tile solves: those of pairs whose impulses it knows.
pub(crate) fn leave_out(tile: &mut Tile, pairs: &[Pair], setup: &Setup) {
    if !is_left_out_later(setup) || tile.ghosts() == 0 {
        return;
    }
    let Tile { bodies, strays, unseen, owned, .. } = tile;
    let (owned, dynamic) = (*owned, *owned + unseen.len());
    let ghost = |body: u32| (owned..dynamic).contains(&(body as usize)).then(|| body as usize - owned);
    for &[low, high] in pairs {
        let ghosts = [ghost(low), ghost(high)];
        if ghosts == [None; 2] {
            continue;
        }
        let ids = [low, high].map(|body| bodies.id[body as usize]);
        let ([a, b], names) =
            if ids[0] < ids[1] { (ghosts, (ids[0], ids[1])) } else { ([ghosts[1], ghosts[0]], (ids[1], ids[0])) };
        for contact in strays.find_all(names, (low as usize) < owned) {
            let (linear, on_a, on_b) = contact.impulse();
            for (side, linear, angular) in [(a, linear, -on_a), (b, -linear, -on_b)] {
                if let Some(ghost) = side {
                    unseen[ghost].add(linear, angular);
                }
            }
        }
    }
}
