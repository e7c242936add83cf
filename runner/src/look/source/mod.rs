//! Where frames come from: what a run has recorded, or a configuration that is run only to be looked at.

mod live;
mod parts;
mod recorded;
#[cfg(test)]
mod tests;

pub(crate) use live::Live;
pub(crate) use recorded::{records, show_recorded, what_is_recorded};

use super::frame::Frame;
use crate::error::RunError;

/// The steps after which there is something to show: some from one to the next.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Shown {
    /// The first of them.
    pub first: u64,
    /// Steps from one to the next, at least 1.
    pub every: u64,
    /// No step after this one; it is at least the first.
    pub last: u64,
}

impl Shown {
    /// A single step.
    pub(crate) fn only(step: u64) -> Self {
        Self { first: step, every: 1, last: step }
    }

    /// Each of them, ascending.
    pub(crate) fn steps(self) -> impl ExactSizeIterator<Item = u64> {
        (0..self.count()).map(move |i| self.first + i as u64 * self.every)
    }

    /// How many there are.
    pub(crate) fn count(self) -> usize {
        ((self.last - self.first) / self.every + 1) as usize
    }

    fn has(self, step: u64) -> bool {
        (self.first..=self.last).contains(&step) && (step - self.first).is_multiple_of(self.every)
    }
}

/// What becomes of a frame: it is drawn, or written.
pub(crate) type Show<'a> = dyn FnMut(&Frame) -> Result<(), RunError> + 'a;

/// How it ended that nothing went wrong.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum End {
    /// Every frame was shown.
    Complete,
    /// Somebody asked to stop.
    Interrupted,
}
