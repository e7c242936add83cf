//! The names that are taken.

use crate::model::id::GlobalId;
use rustc_hash::FxHashSet;
use std::collections::HashSet;
use std::sync::OnceLock;

/// A set of names: runs of those that came in ascending order, as a scene tells them; of others a bit for each up to some
/// multiple of how many there are, which is all of them where bodies are numbered through, and a hash table for the rest.
#[derive(Default, Debug)]
pub(crate) struct Names {
    /// First and last of each run, ascending.
    runs: Vec<[GlobalId; 2]>,
    bits: Vec<u64>,
    sparse: HashSet<GlobalId>,
    count: u64,
}

/// Bits that may be spent on each name: no more than a name itself takes.
const BITS_EACH: u64 = 64;

impl Names {
    /// Takes a name; says no if it is taken.
    pub(crate) fn insert(&mut self, name: GlobalId) -> bool {
        let greatest = self.runs.last_mut().map(|[_, last]| last);
        if greatest.as_ref().is_none_or(|greatest| name > **greatest) {
            match greatest {
                Some(greatest) if name.0 == greatest.0 + 1 => *greatest = name,
                _ => self.runs.push([name; 2]),
            }
            return true;
        }
        let run = self.runs.partition_point(|[_, last]| *last < name);
        if self.runs[run][0] <= name {
            return false;
        }
        let (word, bit) = ((name.0 / 64) as usize, 1 << (name.0 % 64));
        if self.bits.get(word).is_some_and(|bits| bits & bit != 0) || self.sparse.contains(&name) {
            return false;
        }
        self.count += 1;
        // The first thousands need not be spread.
        if name.0 < BITS_EACH * self.count + 65_536 {
            if word >= self.bits.len() {
                self.bits.resize((word + 1).next_power_of_two(), 0);
            }
            self.bits[word] |= bit;
        } else {
            self.sparse.insert(name);
        }
        true
    }
}

/// Names that are noted for the case that somebody asks: only then they are hashed.
#[derive(Default, Debug)]
pub(crate) struct Noted {
    /// Until then.
    unasked: Vec<GlobalId>,
    hashed: OnceLock<FxHashSet<GlobalId>>,
}

impl Noted {
    pub(crate) fn push(&mut self, name: GlobalId) {
        match self.hashed.get_mut() {
            Some(hashed) => _ = hashed.insert(name),
            None => self.unasked.push(name),
        }
    }

    pub(crate) fn contains(&self, name: GlobalId) -> bool {
        self.hashed.get_or_init(|| self.unasked.iter().copied().collect()).contains(&name)
    }

    pub(crate) fn clear(&mut self) {
        self.unasked.clear();
        self.hashed.take();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_name_is_taken_once(names in prop::collection::vec(
            prop_oneof![0..300_u64, 0..200_000_u64, any::<u64>(), Just(u64::MAX)], 0..600)) {
            let mut taken = Names::default();
            let mut known = HashSet::new();
            for name in names {
                prop_assert_eq!(taken.insert(GlobalId(name)), known.insert(name), "{}", name);
            }
        }
    }

    #[test]
    fn numbered_names_take_little() {
        let mut taken = Names::default();
        (0..1_000_000).for_each(|name| assert!(taken.insert(GlobalId(name))));
        assert!(taken.runs.len() == 1 && taken.bits.is_empty() && taken.sparse.is_empty());
        // In any order a bit each.
        let mut taken = Names::default();
        (0..1_000_000).rev().for_each(|name| assert!(taken.insert(GlobalId(name))));
        assert!(taken.sparse.len() < 1_000_000 / 64 + 70_000 && taken.bits.len() <= 1 << 15, "{}", taken.sparse.len());
    }
}
