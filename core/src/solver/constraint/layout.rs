//! In which group and lane each contact goes: by batch, color and column.

use super::columns::{At, COLUMNS, Color, Each, NO_CONTACT, column_of, lengths};
use super::groups::{Groups, Lane};
use crate::model::contact::Contact;
use crate::parallel::lanes::WIDE;
use crate::solver::batches::{Batch, Batches};
use crate::solver::coloring::{COLORS, Coloring};
use std::{array, mem};

/// So few contacts of a color are solved one by one sooner than side by side. A body with more contacts than others has many colors with
/// hardly any beside its own.
const FEW: usize = 2;

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
            let (own, colors) = (&batches.contacts[range.clone()], &coloring.color[range]);
            most_colors = most_colors.max(self.lay_out_batch(contacts, own, colors, batch, first_group));
            end.iter_mut().zip(&batch.groups).for_each(|(end, groups)| *end = groups.end.max(*end));
            batch.colors = first..self.colors.len();
        }
        self.kept.resize(kept);
        self.at_once.resize(at_once);
        most_colors
    }

    /// Returns the number of colors, of which all that overflows is one.
    fn lay_out_batch(
        &mut self,
        contacts: &[Contact],
        own: &[u32],
        colors: &[u8],
        batch: &mut Batch,
        first: Each<usize>,
    ) -> usize {
        batch.members = self.members.each_ref().map(Vec::len);
        let first_member = batch.members;
        let column_of = |contact: u32| column_of(&contacts[contact as usize]);
        let mut counts = [[0; COLUMNS]; COLORS + 1];
        for (&contact, &color) in own.iter().zip(colors) {
            counts[color as usize][column_of(contact)] += 1;
        }
        // Where the next contact of each color goes, in lanes of the batch's columns.
        let mut next = [[0; COLUMNS]; COLORS + 1];
        let mut end = [0; COLUMNS];
        let mut put = |contacts: Each<usize>, one_by_one: Vec<At>, end: &mut Each<usize>| {
            let begin = *end;
            end.iter_mut().zip(contacts).for_each(|(end, contacts)| *end += contacts.div_ceil(WIDE));
            let groups = array::from_fn(|column| begin[column]..end[column]);
            let slices = if one_by_one.is_empty() { batch.slices(lengths(&groups).iter().sum()) } else { 1 };
            self.colors.push(Color { groups, slices, one_by_one });
        };
        // Those of colors that follow each other and have few contacts, and of what overflows, where each is a color.
        let (mut few, mut few_in) = (Vec::new(), [0; COLUMNS]);
        for (color, count) in counts.iter().enumerate().filter(|(_, count)| any(count)) {
            let overflows = color == COLORS;
            if !overflows && count.iter().sum::<usize>() > FEW {
                if !few.is_empty() {
                    put(mem::take(&mut few_in), mem::take(&mut few), &mut end);
                }
                next[color] = end.map(|groups| groups * WIDE);
                put(*count, Vec::new(), &mut end);
                continue;
            }
            next[color] = array::from_fn(|column| WIDE * end[column] + few_in[column]);
            let mut add = |column: usize| {
                few.push(At::new(column, few_in[column]));
                few_in[column] += 1;
            };
            if overflows {
                let overflow = own.iter().zip(colors).filter(|&(_, &color)| usize::from(color) == COLORS);
                overflow.for_each(|(&contact, _)| add(column_of(contact)));
            } else {
                (0..COLUMNS).for_each(|column| (0..count[column]).for_each(|_| add(column)));
            }
        }
        if !few.is_empty() {
            put(few_in, few, &mut end);
        }
        for (column, members) in self.members.iter_mut().enumerate() {
            members.resize(first_member[column] + end[column], [NO_CONTACT; WIDE]);
            batch.groups[column] = first[column]..first[column] + end[column];
        }
        for (&contact, &color) in own.iter().zip(colors) {
            let column = column_of(contact);
            let next = &mut next[usize::from(color)][column];
            let (lane, group) = (*next % WIDE, *next / WIDE);
            *next += 1;
            self.members[column][first_member[column] + group][lane] = contact;
            self.lanes[contact as usize] = Lane::new(column, first[column] + group, lane, batch.bodies.start);
        }
        counts.iter().filter(|count| any(count)).count()
    }
}
