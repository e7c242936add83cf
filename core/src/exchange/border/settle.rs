//! What the mean of both owners' impulses leaves behind, settled.
//!
//! Each owner of a border contact has solved it together with its other contacts; moved to the mean, its body comes off what it
//! rests on. Where contacts press hard that is a kick in every step: discs at the borders of a pile at rest kept 2 rad/s that never
//! turned them, and no pile over borders fell asleep. So the contacts beside take it up before the step ends, with all border
//! contacts as agreed: two sweeps of relax (see `solver/soft_step.rs`), one contact after the other. Both bodies of such a
//! contact are the tile's own, or one is a static, so momentum is kept. The impulses that the next step starts with
//! stay those of the last substep.

use super::Border;
use crate::collide::narrow_phase::Contacts;
use crate::model::params::Solver as How;
use crate::solver::Solver;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// Over all contacts beside; more of them gain nothing.
const SWEEPS: usize = 2;

/// The contacts beside those at the border: with one of the bodies that these move, and with none of another tile.
#[derive(Default, Debug)]
pub(super) struct Beside {
    contacts: Vec<u32>,
    /// For each and each of its points the impulses of the last substep, and of the sweeps.
    impulses: Vec<[[f32; 2]; 2]>,
}

impl Border {
    /// Finds them, once it is known who hears of whom.
    pub(super) fn find_beside(&mut self, tile: &Tile, contacts: &Contacts) {
        let Self { beside: Beside { contacts: beside, .. }, contacts: border, sends_of, scratch, .. } = self;
        beside.clear();
        if border.is_empty() {
            return;
        }
        let own = |contact: u32| tile.index(tile.contacts.keys[contact as usize].low()) as u32;
        let mut moved: Vec<u32> = border.iter().map(|border| own(border.contact)).collect();
        moved.sort_unstable();
        moved.dedup();
        // Whoever is in a border contact is sent.
        let is_sent = |body: u32| sends_of.get(body as usize).is_some_and(|(first, end)| first < end);
        let is_moved = |body: &u32| is_sent(*body) && moved.binary_search(body).is_ok();
        let all = (0..scratch.start).zip(&contacts.bodies).zip(&tile.contacts.keys);
        let near = all.filter(|((_, bodies), key)| !key.high().is_ghost() && bodies.iter().any(is_moved));
        beside.extend(near.map(|((contact, _), _)| contact));
    }

    /// Has the contacts beside take up what the mean has done to their bodies. Those of bodies that bounce are left alone.
    pub(crate) fn settle(&mut self, tile: &Tile, contacts: &Contacts, solver: &mut Solver, setup: &Setup) {
        if setup.params.solver != How::SoftStep || self.contacts.is_empty() {
            return;
        }
        let Self { beside: Beside { contacts: beside, impulses }, .. } = self;
        let Solver { groups, bodies, .. } = solver;
        let bouncing = groups.bouncing().iter().flat_map(|&contact| contacts.bodies[contact as usize]);
        let mut bouncing: Vec<u32> = bouncing.filter(|&body| (body as usize) < tile.owned).collect();
        bouncing.sort_unstable();
        let bounces = |body: &u32| bouncing.binary_search(body).is_ok();
        beside.retain(|&contact| groups.is_solved(contact) && !contacts.bodies[contact as usize].iter().any(bounces));
        impulses.clear();
        impulses.extend(beside.iter().map(|&contact| groups.all_impulses(contact)));
        for _ in 0..SWEEPS {
            for (&contact, impulses) in beside.iter().zip(&mut *impulses) {
                groups.settle(contact, impulses, bodies, setup.h);
            }
        }
    }
}
