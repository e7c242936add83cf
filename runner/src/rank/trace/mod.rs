//! What every thread of a rank does, and when, in the steps that somebody wants to see: the spans of core and runner, kept by
//! the thread that makes them until the run is over.
//!
//! Where nobody asks for a trace nothing listens to spans, and one costs as much as finding that out. Where somebody does,
//! [`Spans`] keeps those of the threads that were told to: all of a rank's, from the first of the steps to the last.

mod clock;
mod spans;
mod store;

pub(crate) use spans::Spans;

use atoll_transport::{Collective, Rank, Transport, TransportError};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::ops::Range;
use std::str::FromStr;

/// Slices of all ranks together, at most: what viewers can open.
const MOST: usize = 1_000_000;

/// Steps that are traced where nobody says which.
const USUAL: u64 = 10;

/// Which steps to trace.
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub enum TraceSteps {
    /// The first that the run makes.
    #[default]
    First,
    /// Those of these numbers, counted from 0.
    Range(Range<u64>),
}

impl TraceSteps {
    /// Their numbers in a run whose first step is `from`.
    fn range(&self, from: u64) -> Range<u64> {
        match self {
            Self::First => from..from.saturating_add(USUAL),
            Self::Range(range) => range.clone(),
        }
    }
}

impl FromStr for TraceSteps {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let bounds = text.split_once("..").and_then(|(a, b)| Some(a.parse().ok()?..b.parse().ok()?));
        let steps = bounds.filter(|steps: &Range<u64>| !steps.is_empty());
        steps.map(Self::Range).ok_or("write A..B, such as 100..110, which is ten steps")
    }
}

/// What one thread did for a while.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub(crate) struct Slice {
    /// The thread's number within its rank.
    pub thread: u32,
    /// What it did, by number: one of [`RankTrace::names`].
    pub name: u16,
    /// To what, or in which step: also a name, and a number.
    pub of: Option<(u16, u64)>,
    /// When it began, in nanoseconds of the clock that all ranks have in common.
    pub start: i64,
    /// How long it took, in nanoseconds.
    pub nanos: u64,
}

/// What the threads of one rank did.
#[derive(Clone, PartialEq, Eq, Default, Debug, Serialize, Deserialize)]
pub(crate) struct RankTrace {
    /// How many slices there was no room for.
    pub left_out: u64,
    /// By how much this rank's clock may differ from that of rank 0, in nanoseconds.
    pub doubt: u64,
    /// The words for what was done.
    pub names: Vec<String>,
    /// Those of one thread after those of another, each before what lies within it.
    pub slices: Vec<Slice>,
}

/// Lets the threads of one rank keep their spans.
#[derive(Debug)]
pub(super) struct Tracer {
    steps: Range<u64>,
    wanted: bool,
    on: bool,
    /// Slices that one thread may keep.
    room: usize,
}

impl Tracer {
    /// One for a run of so many threads on all ranks whose first step is `from`.
    pub(super) fn new(wish: Option<&TraceSteps>, from: u64, threads: usize) -> Self {
        let steps = wish.map_or(0..0, |wish| wish.range(from));
        Self { steps, wanted: wish.is_some(), on: false, room: MOST / threads.max(1) }
    }

    /// To be called before each step, by the thread that makes it, and before the end.
    pub(super) fn before(&mut self, step: Option<u64>) {
        let on = step.is_some_and(|step| self.steps.contains(&step));
        if on != self.on {
            self.on = on;
            rayon::broadcast(|_| store::turn(on, self.room));
        }
    }

    /// Brings everything to rank 0, if any rank wants it.
    pub(super) fn gather(&self, transport: &mut impl Transport) -> Result<Option<Vec<RankTrace>>, TransportError> {
        if transport.all_max_u64(self.wanted.into())? == 0 {
            return Ok(None);
        }
        let clock = clock::align(transport)?;
        let own = self.take(clock);
        let bytes = serde_json::to_vec(&own).expect("numbers and words");
        let Some(all) = transport.gather(Rank(0), &bytes)? else { return Ok(None) };
        let read = |(rank, bytes): (usize, &Vec<u8>)| {
            serde_json::from_slice(bytes).map_err(|_| super::unreadable(Rank::from_index(rank)))
        };
        all.iter().enumerate().map(read).collect::<Result<_, _>>().map(Some)
    }

    /// What the threads of this rank have kept.
    fn take(&self, clock: clock::Offset) -> RankTrace {
        let mut trace = RankTrace { doubt: clock.doubt, ..RankTrace::default() };
        let mut numbers = HashMap::<&'static str, u16>::new();
        for (thread, mut kept) in (0..).zip(rayon::broadcast(|_| store::take())) {
            trace.left_out += kept.left_out;
            // What ended later holds what began with it.
            kept.slices.reverse();
            kept.slices.sort_by_key(|slice| slice.start);
            for slice in kept.slices {
                let mut number = |name: &'static str| {
                    *numbers.entry(name).or_insert_with(|| {
                        trace.names.push(name.to_owned());
                        trace.names.len() as u16 - 1
                    })
                };
                let (name, of) = (number(slice.name), slice.of.map(|(key, value)| (number(key), value)));
                let start = slice.start as i64 + clock.nanos;
                trace.slices.push(Slice { thread, name, of, start, nanos: slice.end - slice.start });
            }
        }
        trace
    }
}

/// A run that fails leaves no thread behind that keeps what nobody will ask for.
impl Drop for Tracer {
    fn drop(&mut self) {
        self.before(None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_a_range_or_the_first() {
        assert_eq!("5..7".parse(), Ok(TraceSteps::Range(5..7)));
        for text in ["", "5", "5..", "..7", "7..5", "5..5", "a..b", "-1..3", "5...7"] {
            assert!(text.parse::<TraceSteps>().is_err(), "{text}");
        }
        assert_eq!(TraceSteps::First.range(100), 100..110);
        assert_eq!(TraceSteps::First.range(u64::MAX).end, u64::MAX);
        assert_eq!(TraceSteps::Range(3..4).range(100), 3..4);
    }
}
