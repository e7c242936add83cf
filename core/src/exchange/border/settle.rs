//! What the mean of both owners' impulses leaves behind, settled.
//!
//! Each owner of a border contact has solved it together with its other contacts; moved to the mean, its body comes off what it
//! rests on. Where contacts press hard that is a kick in every step: discs at the borders of a pile at rest kept 2 rad/s that never
//! turned them, and no pile over borders fell asleep. So the contacts beside take it up before the step ends, with all border
//! contacts as agreed: their surfaces come most of the way back to how they moved, as far as contacts may press and rub, in sweeps
//! of sequential impulses. Both bodies of such a contact are the tile's own, or one is a static, so momentum is kept. The impulses that
//! the next step starts with stay those of the last substep.

use super::Border;
use crate::collide::narrow_phase::Contacts;
use crate::exchange::mail::Mail;
use crate::model::params::Solver as How;
use crate::solver::{ContactMotion, Solver};
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// Over all contacts beside. More of them gain nothing.
const SWEEPS: usize = 4;

/// How much of what a contact lacks it takes up in a sweep. If all, what one tile takes up may come back from the other ever greater: discs of
/// piles fluttered, at up to 8 rad/s.
const PART: f32 = 0.3;

/// The contacts beside those at the border: with one of the bodies that these move, and with none of another tile.
#[derive(Default, Debug)]
pub(super) struct Beside {
    contacts: Vec<u32>,
    /// How each of them moved before.
    before: Vec<ContactMotion>,
}

impl Border {
    /// Finds them, once it is known who hears of whom.
    pub(super) fn find_beside(&mut self, tile: &Tile, contacts: &Contacts) {
        let Self { beside: Beside { contacts: beside, .. }, contacts: border, sends_of, outer, .. } = self;
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
        beside.extend(outer.iter().copied().filter(|&contact| {
            let (key, bodies) = (tile.contacts.keys[contact as usize], contacts.bodies[contact as usize]);
            !key.high().is_ghost() && bodies.iter().any(is_moved)
        }));
    }

    /// Moves both copies of every border contact to their mean (see [`average`](Self::average)), and has the contacts beside take up
    /// what that does to their bodies.
    pub(crate) fn agree(&mut self, tile: &mut Tile, solver: &mut Solver, mail: Mail<'_>, setup: &Setup) {
        let settles = setup.params.solver == How::SoftStep;
        let mut beside = std::mem::take(&mut self.beside);
        if settles {
            beside.contacts.retain(|&contact| solver.groups.is_solved(contact));
            beside.before.clear();
            beside.before.extend(beside.contacts.iter().map(|&contact| solver.groups.motion(contact, &solver.bodies)));
        }
        self.average(tile, solver, mail, setup.bouncy);
        if settles {
            for _ in 0..SWEEPS {
                for (&contact, before) in beside.contacts.iter().zip(&mut beside.before) {
                    solver.groups.restore(contact, before, PART, &mut solver.bodies);
                }
            }
        }
        self.beside = beside;
    }
}
