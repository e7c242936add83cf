//! The words that a configuration may say, one table each, for reading and for writing.

use super::sections::{Balance, MpiExchange, TransportKind};
use atoll_core::{BroadPhase, Exchange, Ghosts, Instructions, IslandSearch, Parallel, Solver};

/// Words and what they mean.
pub(super) type Words<T> = &'static [(&'static str, T)];

/// `run.transport`
pub(super) const TRANSPORT: Words<TransportKind> = &[
    (TransportKind::Local.name(), TransportKind::Local),
    (TransportKind::Channel.name(), TransportKind::Channel),
    (TransportKind::Iceoryx2.name(), TransportKind::Iceoryx2),
    (TransportKind::Mpi.name(), TransportKind::Mpi),
];

/// `run.mpi_exchange`
pub(super) const MPI_EXCHANGE: Words<MpiExchange> =
    &[("alltoallv", MpiExchange::Alltoallv), ("sparse", MpiExchange::Sparse)];

/// `run.balance`
pub(super) const BALANCE: Words<Balance> = &[
    (Balance::Measured.name(), Balance::Measured),
    (Balance::Bodies.name(), Balance::Bodies),
    (Balance::Off.name(), Balance::Off),
    (Balance::Shuffled.name(), Balance::Shuffled),
];

/// `run.instructions`
pub(super) const INSTRUCTIONS: Words<Instructions> = &[
    (Instructions::Auto.name(), Instructions::Auto),
    (Instructions::Portable.name(), Instructions::Portable),
    (Instructions::Avx2.name(), Instructions::Avx2),
    (Instructions::Avx512.name(), Instructions::Avx512),
];

/// `physics.broad_phase`
pub(super) const BROAD_PHASE: Words<BroadPhase> = &[("grid", BroadPhase::Grid), ("quadtree", BroadPhase::Quadtree)];

/// `physics.solver`
pub(super) const SOLVER: Words<Solver> = &[("soft-step", Solver::SoftStep), ("pgs", Solver::Pgs)];

/// `physics.islands`
pub(super) const ISLANDS: Words<IslandSearch> = &[
    ("union-find", IslandSearch::UnionFind),
    ("dfs", IslandSearch::Dfs),
    ("parallel-union-find", IslandSearch::ParallelUnionFind),
];

/// `physics.parallel`
pub(super) const PARALLEL: Words<Parallel> = &[
    ("serial", Parallel::Serial),
    ("islands", Parallel::Islands),
    ("coloring", Parallel::Coloring),
    ("auto", Parallel::Auto),
];

/// `physics.exchange`
pub(super) const EXCHANGE: Words<Exchange> = &[("step", Exchange::Step), ("substep", Exchange::Substep)];

/// `physics.ghosts`
pub(super) const GHOSTS: Words<Ghosts> = &[("dynamic", Ghosts::Dynamic), ("frozen", Ghosts::Frozen)];

/// The word for a value.
pub(super) fn word_for<T: PartialEq>(words: Words<T>, value: T) -> &'static str {
    words.iter().find(|(_, meant)| *meant == value).expect("every value has a word").0
}
