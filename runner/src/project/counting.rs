//! What it takes ranks to agree on tiles that follow the bodies: one rank does so here, alone, and what it counts, works out and tells
//! is booked for those that would share it.

use super::network::Network;
use crate::plan::tiles::{Council, Unfollowed};
use crate::rank::balance::thread_time;
use atoll_core::TileId;
use std::collections::BTreeMap;
use std::time::Duration;

/// What all ranks together counted, worked out and told until they agreed. Times are in seconds.
#[derive(Clone, Default, Debug)]
pub(super) struct Counting {
    /// What each rank does for its tiles.
    shared: f64,
    /// What every rank does.
    by_all: f64,
    /// What the holders of some tiles do while all others wait, and how many there are.
    by_some: Vec<(f64, usize)>,
    /// What all were told, in bytes.
    told_all: Vec<f64>,
    /// What the holder of one tile was told, in bytes and messages.
    told_one: Vec<(f64, f64)>,
}

impl Counting {
    /// How long it takes so many ranks.
    pub(super) fn seconds(&self, ranks: usize, network: &Network) -> f64 {
        let by_some = self.by_some.iter().map(|&(seconds, some)| seconds / some.clamp(1, ranks) as f64);
        let told_all = self.told_all.iter().map(|&bytes| network.all_gather(bytes, ranks));
        let told_one = self.told_one.iter().map(|&(bytes, messages)| network.gather(bytes, messages, ranks));
        self.shared / ranks as f64 + self.by_all + by_some.chain(told_all).chain(told_one).sum::<f64>()
    }

    /// Of two alike, what took less time.
    pub(super) fn take_least(&mut self, other: &Self) {
        self.shared = self.shared.min(other.shared);
        self.by_all = self.by_all.min(other.by_all);
        self.by_some.iter_mut().zip(&other.by_some).for_each(|(one, other)| one.0 = one.0.min(other.0));
    }
}

/// A rank that is all there are.
pub(super) struct Alone {
    counting: Counting,
    /// How long this thread had worked when it was last heard.
    before: Duration,
    /// How many are to decide on what they were told last, if some are.
    deciding: Option<usize>,
}

impl Alone {
    pub(super) fn begin() -> Self {
        Self { counting: Counting::default(), before: thread_time(), deciding: None }
    }

    /// All know the new tiles now, and change their own.
    pub(super) fn has_agreed(&mut self) {
        self.counting.by_all += self.lap();
    }

    /// What all of it came to.
    pub(super) fn end(mut self) -> Counting {
        self.counting.shared += self.lap();
        self.counting
    }

    /// How long it took since it was last heard.
    fn lap(&mut self) -> f64 {
        let now = thread_time();
        now.saturating_sub(std::mem::replace(&mut self.before, now)).as_secs_f64()
    }
}

impl Council for Alone {
    type Error = Unfollowed;

    fn tell_all(&mut self, own: Vec<u8>) -> Result<Option<Vec<Vec<u8>>>, Unfollowed> {
        let took = self.lap();
        match self.deciding.take() {
            Some(some) => self.counting.by_some.push((took, some)),
            None => self.counting.shared += took,
        }
        self.counting.told_all.push(own.len() as f64);
        Ok(Some(vec![own]))
    }

    fn tell_holders(&mut self, own: Vec<(TileId, Vec<u32>)>) -> Result<Vec<Vec<u8>>, Unfollowed> {
        self.counting.shared += self.lap();
        let mut told = BTreeMap::<TileId, (f64, f64)>::new();
        for (tile, words) in &own {
            let (bytes, messages) = told.entry(*tile).or_default();
            *bytes += size_of_val(&words[..]) as f64;
            *messages += 1.0;
        }
        self.deciding = Some(told.len());
        let most = told.into_values().max_by(|a, b| a.0.total_cmp(&b.0));
        self.counting.told_one.push(most.unwrap_or_default());
        let all: Vec<u32> = own.into_iter().flat_map(|(_, words)| words).collect();
        // What is booked begins with what was heard.
        self.lap();
        Ok(vec![bytemuck::cast_slice(&all).to_vec()])
    }

    fn has_counted(&mut self) {
        self.counting.shared += self.lap();
    }
}
