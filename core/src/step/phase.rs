//! The stages of a step by name, and the time each takes. Times never enter a result.

use std::time::{Duration, Instant};

/// A stage of the step.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(usize)]
pub enum Phase {
    /// Finding what other tiles must hear, and taking in what they say.
    Migrate,
    /// Waiting for, and carrying, messages.
    Exchange,
    /// What the broad phase knows of the bodies brought up to date; with a quadtree, those that left their fat AABBs put
    /// in anew. The grid's cells are filled in the next phase.
    Flush,
    /// Pairs of bodies that may touch.
    BroadPhase,
    /// Manifolds, matched with last step's impulses.
    NarrowPhase,
    /// Bodies connected through contacts.
    Islands,
    /// Contacts of one color share no body.
    Coloring,
    /// Constraint rows.
    Prepare,
    /// Substeps: velocities, warm start, solve, positions, relax.
    Substeps,
    /// Ghost refreshes and border impulses of `exchange = "substep"`.
    Border,
    /// Restitution, impulses and bodies written back.
    Finalize,
}

impl Phase {
    /// All of them, in the order of the step.
    pub const ALL: [Self; 11] = [
        Self::Migrate,
        Self::Exchange,
        Self::Flush,
        Self::BroadPhase,
        Self::NarrowPhase,
        Self::Islands,
        Self::Coloring,
        Self::Prepare,
        Self::Substeps,
        Self::Border,
        Self::Finalize,
    ];

    /// As reports call it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Migrate => "migrate",
            Self::Exchange => "exchange",
            Self::Flush => "flush",
            Self::BroadPhase => "broad_phase",
            Self::NarrowPhase => "narrow_phase",
            Self::Islands => "islands",
            Self::Coloring => "coloring",
            Self::Prepare => "prepare",
            Self::Substeps => "substeps",
            Self::Border => "border",
            Self::Finalize => "finalize",
        }
    }
}

/// Time spent in each phase.
#[derive(Clone, Copy, Default, Debug)]
pub struct Timings([Duration; Phase::ALL.len()]);

impl Timings {
    /// Time spent in a phase. Of a world: its share of the wall clock, so that the phases add up to the steps' time.
    pub fn total(&self, phase: Phase) -> Duration {
        self.0[phase as usize]
    }

    pub(crate) fn add(&mut self, phase: Phase, time: Duration) {
        self.0[phase as usize] += time;
    }

    /// Adds another's times, divided among so many threads.
    pub(crate) fn add_share(&mut self, other: &Self, threads: u32) {
        for (mine, other) in self.0.iter_mut().zip(other.0) {
            *mine += other / threads;
        }
    }
}

/// Times one phase after another.
#[derive(Clone, Copy)]
pub(crate) struct Stopwatch(Instant);

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self(Instant::now())
    }

    /// Books the time since the last lap.
    pub(crate) fn lap(&mut self, phase: Phase, timings: &mut Timings) {
        let now = Instant::now();
        timings.add(phase, now - self.0);
        self.0 = now;
    }
}
