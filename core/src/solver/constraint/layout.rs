//! In which group and lane each contact goes: by batch, color and column.

use super::columns::{COLUMNS, Color, Each, NO_CONTACT, column_of};
use super::groups::{Groups, Lane};
use crate::model::contact::Contact;
use crate::parallel::lanes::WIDE;
use crate::solver::batches::{Batch, Batches};
use crate::solver::coloring::{COLORS, Coloring};

/// Whether there is anything at all.
fn any(counts: &Each<usize>) -> bool {
    counts.iter().any(|&count| count > 0)
}

impl Groups {
    /// Whether contacts of the same bodies as those that were laid out have as many points each.
    pub(crate) fn fit(&self, contacts: &[Contact]) -> bool {
        self.lanes.iter().zip(contacts).fold(true, |fit, (lane, contact)| fit & lane.is_of(column_of(contact)))
    }

    /// Decides in which group and lane each contact goes. Returns the most colors of a batch.
    pub(crate) fn lay_out(&mut self, contacts: &[Contact], batches: &mut Batches, coloring: &Coloring) -> usize {
        self.colors.clear();
        self.members.iter_mut().for_each(Vec::clear);
        self.lanes.clear();
        self.lanes.resize(contacts.len(), Lane::NONE);
        let (mut most_colors, mut at_once, mut kept) = (0, [0; COLUMNS], [0; COLUMNS]);
        for batch in &mut batches.all {
            let first = self.colors.len();
            let range = batch.contacts.clone();
            let (first_group, end) = if batch.at_once { ([0; COLUMNS], &mut at_once) } else { (kept, &mut kept) };
            self.lay_out_batch(contacts, &batches.contacts[range.clone()], &coloring.color[range], batch, first_group);
            end.iter_mut().zip(&batch.groups).for_each(|(end, groups)| *end = groups.end.max(*end));
            batch.colors = first..self.colors.len();
            // All that overflows counts as one color.
            most_colors = most_colors.max(batch.colors.len().min(COLORS + 1));
        }
        self.kept.resize(kept);
        self.at_once.resize(at_once);
        most_colors
    }

    fn lay_out_batch(
        &mut self,
        contacts: &[Contact],
        own: &[u32],
        colors: &[u8],
        batch: &mut Batch,
        first: Each<usize>,
    ) {
        batch.members = self.members.each_ref().map(Vec::len);
        let first_member = batch.members;
        let column_of = |contact: u32| column_of(&contacts[contact as usize]);
        let mut counts = [[0; COLUMNS]; COLORS + 1];
        for (&contact, &color) in own.iter().zip(colors) {
            counts[color as usize][column_of(contact)] += 1;
        }
        // Where the next contact of each color goes, in lanes of the batch's columns.
        let mut next = [[0; COLUMNS]; COLORS];
        let mut end = [0; COLUMNS];
        let mut color = |groups: Each<usize>, end: &mut Each<usize>| {
            let begin = *end;
            end.iter_mut().zip(groups).for_each(|(end, groups)| *end += groups);
            let slices = batch.slices(groups.iter().sum());
            self.colors.push(Color { groups: std::array::from_fn(|column| begin[column]..end[column]), slices });
        };
        for (next, count) in next.iter_mut().zip(&counts).filter(|(_, count)| any(count)) {
            *next = end.map(|groups| groups * WIDE);
            color(count.map(|contacts| contacts.div_ceil(WIDE)), &mut end);
        }
        // What overflows: a group, and a color, for each.
        let mut overflow = end.map(|groups| groups * WIDE);
        if any(&counts[COLORS]) {
            for (&contact, _) in own.iter().zip(colors).filter(|&(_, &color)| color as usize == COLORS) {
                let mut groups = [0; COLUMNS];
                groups[column_of(contact)] = 1;
                color(groups, &mut end);
            }
        }
        for (column, members) in self.members.iter_mut().enumerate() {
            members.resize(first_member[column] + end[column], [NO_CONTACT; WIDE]);
            batch.groups[column] = first[column]..first[column] + end[column];
        }
        for (&contact, &color) in own.iter().zip(colors) {
            let column = column_of(contact);
            let (next, step) = match next.get_mut(color as usize) {
                Some(next) => (&mut next[column], 1),
                None => (&mut overflow[column], WIDE),
            };
            let (lane, group) = (*next % WIDE, *next / WIDE);
            *next += step;
            self.members[column][first_member[column] + group][lane] = contact;
            self.lanes[contact as usize] = Lane::new(column, first[column] + group, lane, batch.bodies.start);
        }
    }
}
