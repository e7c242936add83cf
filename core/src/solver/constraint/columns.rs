//! The columns in which groups lie: one for each kind of constraint, today contacts of one point and contacts of two.
//!
//! Everywhere else a column is a number below [`COLUMNS`]: batches, colors, layout and threads know no kind from another.
//! So a new kind of constraint is one more field of each struct here, and a line where these are listed; what its rows are
//! and what a pass does to them is told in `group.rs`, `rows.rs` and `kernels.rs`, as for contacts.

use super::group::{Group, PointRows, Sides, Totals};
use super::kernels::{Pass, Table};
use crate::model::contact::Contact;
use crate::parallel::ahead::fetch_whole;
use crate::parallel::lanes::{WIDE, Wide};
use crate::parallel::shared::Shared;
use std::ops::Range;

/// How many there are.
pub(crate) const COLUMNS: usize = 2;

/// Something for each column.
pub(crate) type Each<T> = [T; COLUMNS];

/// The contacts of a group, lane by lane, in canonical order, or [`NO_CONTACT`].
pub(crate) type Members = [u32; WIDE];

/// Marks a lane without a contact.
pub(crate) const NO_CONTACT: u32 = u32::MAX;

/// The column in which a contact lies.
#[inline(always)]
pub(crate) fn column_of(contact: &Contact) -> usize {
    contact.point_count() - 1
}

/// How many groups there are in some ranges.
pub(crate) fn lengths(groups: &Each<Range<usize>>) -> Each<usize> {
    groups.each_ref().map(|range| range.len())
}

/// The groups of a tile.
#[derive(Default, Debug)]
pub(crate) struct Columns {
    single: Vec<Group<1>>,
    double: Vec<Group<2>>,
}

impl Columns {
    /// Makes room for so many groups; what was in them stays.
    pub(crate) fn resize(&mut self, groups: Each<usize>) {
        self.single.resize(groups[0], Group::EMPTY);
        self.double.resize(groups[1], Group::EMPTY);
    }

    /// The rows of a group.
    pub(crate) fn rows(&self, column: usize, group: usize) -> (&Sides, &[PointRows]) {
        match column {
            0 => (&self.single[group].sides, &self.single[group].points),
            _ => (&self.double[group].sides, &self.double[group].points),
        }
    }

    /// The rows of a group, to change its points.
    pub(crate) fn rows_mut(&mut self, column: usize, group: usize) -> (&Sides, &mut [PointRows]) {
        fn both<const N: usize>(group: &mut Group<N>) -> (&Sides, &mut [PointRows]) {
            (&group.sides, &mut group.points)
        }
        match column {
            0 => both(&mut self.single[group]),
            _ => both(&mut self.double[group]),
        }
    }

    /// The rows of a group, and its impulses of the step, to change these.
    pub(crate) fn totals_mut(&mut self, column: usize, group: usize) -> (&Sides, &mut [PointRows], &mut [Totals]) {
        fn all<const N: usize>(group: &mut Group<N>) -> (&Sides, &mut [PointRows], &mut [Totals]) {
            (&group.sides, &mut group.points, &mut group.totals)
        }
        match column {
            0 => all(&mut self.single[group]),
            _ => all(&mut self.double[group]),
        }
    }

    /// The impulses of a point of a group in the step.
    pub(crate) fn totals(&self, column: usize, group: usize, point: usize) -> &Totals {
        match column {
            0 => &self.single[group].totals[point],
            _ => &self.double[group].totals[point],
        }
    }

    /// Shows the points of some groups with their members.
    pub(crate) fn each(
        &self,
        [single, double]: &Each<Range<usize>>,
        members: Each<&[Members]>,
        mut show: impl FnMut(&[PointRows], &Members),
    ) {
        let (single, double) = (&self.single[single.clone()], &self.double[double.clone()]);
        single.iter().zip(members[0]).for_each(|(group, members)| show(&group.points, members));
        double.iter().zip(members[1]).for_each(|(group, members)| show(&group.points, members));
    }

    /// All groups.
    pub(crate) fn slices(&mut self) -> Slices<'_> {
        Slices { single: &mut self.single, double: &mut self.double }
    }
}

/// Groups of every column that lie together.
pub(crate) struct Slices<'a> {
    single: &'a mut [Group<1>],
    double: &'a mut [Group<2>],
}

/// What is written into a group of any column.
pub(crate) trait Visitor {
    fn group<const N: usize>(&mut self, group: &mut Group<N>, members: &Members);
}

impl<'a> Slices<'a> {
    /// Takes so many groups out, the first of every column.
    pub(crate) fn split_off(&mut self, groups: Each<usize>) -> Self {
        const IN_ORDER: &str = "groups lie in order";
        Self {
            single: self.single.split_off_mut(..groups[0]).expect(IN_ORDER),
            double: self.double.split_off_mut(..groups[1]).expect(IN_ORDER),
        }
    }

    /// Shows each group to a visitor, with its members.
    #[inline(always)]
    pub(crate) fn visit(self, members: Each<&[Members]>, visitor: &mut impl Visitor) {
        for (group, members) in self.single.iter_mut().zip(members[0]) {
            visitor.group(group, members);
        }
        for (group, members) in self.double.iter_mut().zip(members[1]) {
            visitor.group(group, members);
        }
    }

    /// One pass over all of them.
    #[inline(always)]
    fn pass<V: Wide>(self, pass: impl Pass, bodies: Table<'_>) {
        for group in self.single {
            fetch_rows_behind(group);
            pass.group::<V, 1>(group, bodies);
        }
        for group in self.double {
            fetch_rows_behind(group);
            pass.group::<V, 2>(group, bodies);
        }
    }

    /// One pass over some of their contacts, one by one. Not inlined: it is the same with any instructions.
    #[inline(never)]
    fn pass_each(self, contacts: &[At], pass: impl Pass, bodies: Table<'_>) {
        let (mut single, mut double) = (Group::EMPTY, Group::EMPTY);
        for &At { column, lane, group } in contacts {
            let (lane, group) = (usize::from(lane), group as usize);
            match column {
                0 => self.single[group].pass_lane(lane, &mut single, pass, bodies),
                _ => self.double[group].pass_lane(lane, &mut double, pass, bodies),
            }
        }
    }

    /// One pass over the groups of a color.
    #[inline(always)]
    pub(crate) fn pass_color<V: Wide>(self, color: &Color, pass: impl Pass, bodies: Table<'_>) {
        match &color.one_by_one[..] {
            [] => self.pass::<V>(pass, bodies),
            contacts => self.pass_each(contacts, pass, bodies),
        }
    }

    /// For several threads.
    pub(crate) fn share(self) -> SharedColumns<'a> {
        SharedColumns { single: Shared::new(self.single), double: Shared::new(self.double) }
    }
}

/// Asks for the rows that a pass comes to next. The processor foresees where they lie, but too late.
#[inline(always)]
fn fetch_rows_behind<const N: usize>(group: &Group<N>) {
    let next = std::ptr::from_ref(group).wrapping_add(1);
    fetch_whole(next.cast::<(Sides, [PointRows; N])>());
}

/// Groups that several threads work on at once, each on some of its own.
pub(crate) struct SharedColumns<'a> {
    single: Shared<'a, Group<1>>,
    double: Shared<'a, Group<2>>,
}

impl SharedColumns<'_> {
    /// Some groups for this thread alone.
    ///
    /// # Safety
    /// As [`Shared::range`]: as long as they are borrowed, nobody else may use any of them.
    #[inline(always)]
    pub(crate) unsafe fn range(&self, groups: Each<Range<usize>>) -> Slices<'_> {
        let [single, double] = groups;
        // SAFETY: the caller sees to it that nobody else uses these.
        unsafe { Slices { single: self.single.range(single), double: self.double.range(double) } }
    }
}

/// A contact among the groups of a color.
#[derive(Clone, Copy, Debug)]
pub(super) struct At {
    column: u8,
    lane: u8,
    group: u32,
}

impl At {
    /// That of such a number in a column, counted by lanes.
    pub(super) fn new(column: usize, number: usize) -> Self {
        Self { column: column as u8, lane: (number % WIDE) as u8, group: (number / WIDE) as u32 }
    }
}

/// The groups of one color of a batch, or of several that have few contacts each.
#[derive(Clone, Debug)]
pub(crate) struct Color {
    /// Within the batch's groups.
    pub(super) groups: Each<Range<usize>>,
    /// Into how many pieces the groups are cut.
    pub(crate) slices: u32,
    /// Where these are several colors of few contacts, in which order these are solved, one after the other: empty where they are one
    /// color.
    pub(super) one_by_one: Vec<At>,
}

impl Color {
    /// The groups of one piece.
    #[inline(always)]
    pub(crate) fn slice(&self, slice: u32) -> Each<Range<usize>> {
        let mut groups = self.groups.clone();
        for range in &mut groups {
            let (start, length) = (range.start, range.len());
            let at = |slice: u32| start + length * slice as usize / self.slices as usize;
            *range = at(slice)..at(slice + 1);
        }
        groups
    }
}
