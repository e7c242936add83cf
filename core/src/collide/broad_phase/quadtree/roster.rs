//! Who was where: the bodies of this step found again among those of the last.

use super::tree::NONE;
use crate::model::id::GlobalId;

/// How many departures in a row are followed without a search.
const AHEAD: usize = 16;

/// The names of a tile's bodies in the last step, and where each body of this step stood then.
///
/// Bodies leave, arrive, change places; most keep their order. So both lists are walked side by side, and only what is
/// out of order is sorted by name.
#[derive(Default, Debug)]
pub(super) struct Roster {
    names: Vec<GlobalId>,
    /// Where the parts of `names` end: owned, ghosts, statics.
    ends: [usize; 3],
    /// For each body of this step its index in the last, or [`NONE`].
    pub(super) from: Vec<u32>,
    /// Indices in the last step of the bodies that are here no more.
    pub(super) gone: Vec<u32>,
    /// Bodies not yet found again, and those of the last step that were passed over.
    missed: Vec<(GlobalId, u32)>,
    passed: Vec<(GlobalId, u32)>,
}

impl Roster {
    /// Follows the bodies to their new indices. Says whether anything changed; only then `from` and `gone` tell what.
    pub(super) fn follow(&mut self, names: &[GlobalId], ends: [usize; 3]) -> bool {
        let ends_before = std::mem::replace(&mut self.ends, ends);
        if self.names == names {
            return false;
        }
        self.from.clear();
        self.missed.clear();
        self.passed.clear();
        let (mut first, mut first_before) = (0, 0);
        for (end, end_before) in ends.into_iter().zip(ends_before) {
            self.walk(names, first..end, first_before..end_before);
            (first, first_before) = (end, end_before);
        }
        self.search();
        self.names.clear();
        self.names.extend_from_slice(names);
        true
    }

    /// Walks one part of both lists.
    fn walk(&mut self, names: &[GlobalId], now: std::ops::Range<usize>, before: std::ops::Range<usize>) {
        let mut next = before.start;
        for body in now {
            let ahead = &self.names[next..before.end.min(next + AHEAD)];
            match ahead.iter().position(|&name| name == names[body]) {
                Some(skipped) => {
                    self.passed.extend((next..next + skipped).map(|i| (self.names[i], i as u32)));
                    next += skipped;
                    self.from.push(next as u32);
                    next += 1;
                }
                None => {
                    self.missed.push((names[body], body as u32));
                    self.from.push(NONE);
                }
            }
        }
        self.passed.extend((next..before.end).map(|i| (self.names[i], i as u32)));
    }

    /// Looks among those passed over for those missed. What is passed over still is gone.
    fn search(&mut self) {
        self.missed.sort_unstable();
        self.passed.sort_unstable();
        self.gone.clear();
        let mut missed = self.missed.iter().peekable();
        for &(name, index) in &self.passed {
            while missed.next_if(|missed| missed.0 < name).is_some() {}
            match missed.next_if(|missed| missed.0 == name) {
                Some(&(_, body)) => self.from[body as usize] = index,
                None => self.gone.push(index),
            }
        }
    }
}
