//! Greedy coloring of the constraint graph: contacts of one color share no body that moves.

use super::bodies::SolverBodies;
use crate::narrow_phase::Contacts;

/// Colors that are told apart by a bit of a mask. The contacts beyond, of a body with more contacts than this, are the
/// overflow: each is a color of its own.
pub(super) const COLORS: usize = 64;

/// The color of each contact, `COLORS` for the overflow; a function of the contacts and their order alone.
#[derive(Default, Debug)]
pub(super) struct Coloring {
    pub(super) color: Vec<u8>,
    /// For each solver body the colors its contacts have.
    taken: Vec<u64>,
}

impl Coloring {
    /// Gives each contact, in canonical order, the lowest color that neither of its bodies has yet.
    pub(super) fn color(&mut self, contacts: &Contacts, bodies: &SolverBodies) {
        self.taken.clear();
        self.taken.resize(bodies.len(), 0);
        self.color.clear();
        for &[a, b] in &contacts.bodies {
            let (a, b) = (bodies.index_of(a) as usize, bodies.index_of(b) as usize);
            let taken = self.taken[a] | self.taken[b];
            let color = taken.trailing_ones();
            if color < COLORS as u32 {
                self.taken[a] |= 1 << color;
                self.taken[b] |= 1 << color;
                // The first solver body stands for all statics: it never moves, so it is never taken.
                self.taken[0] = 0;
            }
            self.color.push(color as u8);
        }
    }
}
