//! Greedy coloring of the constraint graph: contacts of one color share no body that moves.

use super::batches::Batches;
use super::index::SolverIndex;
use crate::collide::narrow_phase::Contacts;
use crate::parallel::team::Team;
use std::collections::BTreeSet;

/// Colors that are told apart by a bit of a mask. The contacts beyond, of a body with more contacts than this, are the
/// overflow: each is a color of its own, in their order.
pub(crate) const COLORS: usize = 64;

/// The color of each contact, `COLORS` for the overflow. An island's colors are a function of its contacts, their
/// canonical order and the turns that bodies take alone, whatever batch it is in.
#[derive(Default, Debug)]
pub(crate) struct Coloring {
    /// In the order of [`Batches::contacts`].
    pub(crate) color: Vec<u8>,
    /// For each solver body the colors its contacts have.
    taken: Vec<u64>,
}

impl Coloring {
    /// Gives each contact, in canonical order, the lowest color that neither of its bodies has yet. `place` gives for
    /// each body of the tile its place among the solver's.
    pub(crate) fn color(&mut self, batches: &Batches, contacts: &Contacts, place: &[SolverIndex], team: Team) {
        let Contacts { bodies, turns, .. } = contacts;
        self.taken.clear();
        self.taken.resize(batches.all.last().map_or(0, |batch| batch.bodies.end), 0);
        self.color.clear();
        self.color.resize(batches.contacts.len(), 0);
        let (mut color, mut taken) = (&mut self.color[..], &mut self.taken[..]);
        let mut each = batches.all.iter().map(|batch| {
            let own = &batches.contacts[batch.contacts.clone()];
            let color = color.split_off_mut(..batch.contacts.len()).expect("batches lie in order");
            let taken = taken.split_off_mut(..batch.bodies.len()).expect("batches lie in order");
            (own, color, taken, batch.bodies.start as u32)
        });
        let color_batch = |(own, color, taken, base): (&[u32], &mut [u8], &mut [u64], u32)| {
            // The first body of a batch stands for all statics: it never moves, so it is never taken.
            const STATICS: u32 = 0;
            let local = |body: u32| place[body as usize].within(base, STATICS) as usize;
            for (&contact, color) in own.iter().zip(color) {
                let [a, b] = bodies[contact as usize].map(local);
                let free = (taken[a] | taken[b]).trailing_ones();
                if free < COLORS as u32 {
                    taken[a] |= 1 << free;
                    taken[b] |= 1 << free;
                    taken[STATICS as usize] = 0;
                }
                *color = free as u8;
            }
        };
        if team.is_alone() {
            each.for_each(color_batch);
        } else {
            team.for_each(each.by_ref().collect(), color_batch);
        }
        self.take_turns(batches, turns);
    }

    /// Deals the colors of some contacts of one body with statics to these in turn: in a mirror image the order of statics is another,
    /// and that in which a body comes to them is not. What overflows stays in its order.
    fn take_turns(&mut self, batches: &Batches, turns: &[Vec<u32>]) {
        if turns.is_empty() {
            return;
        }
        // Those that sleep are in no batch.
        let mut places = vec![u32::MAX; batches.contacts.iter().max().map_or(0, |&most| most as usize + 1)];
        (0..).zip(&batches.contacts).for_each(|(place, &contact)| places[contact as usize] = place);
        for turn in turns {
            let places =
                turn.iter().filter_map(|&contact| places.get(contact as usize)).filter(|&&place| place != u32::MAX);
            debug_assert!(turn.iter().collect::<BTreeSet<_>>().len() == turn.len(), "each has one color");
            let mut colors: Vec<u8> = places.clone().map(|&place| self.color[place as usize]).collect();
            colors.sort_unstable();
            places.zip(colors).for_each(|(&place, color)| self.color[place as usize] = color);
        }
    }
}
