//! One stage of a step of one tile: what it works with, and its time booked.

use super::phase::{Phase, Stopwatch, Timings};
use crate::collide::broad_phase::Pair;
use crate::collide::broad_phase::grid::Grid;
use crate::collide::narrow_phase::{Contacts, NarrowPhase};
use crate::collide::proxies::Proxies;
use crate::exchange::border::Border;
use crate::exchange::message::Mailbag;
use crate::exchange::migrate::MigrateWork;
use crate::islands::Islands;
use crate::parallel::team::Team;
use crate::solver::Solver;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// Everything a step needs beyond a tile's own state. With one sync point a step, a tile is stepped in one go and a
/// thread's tiles share one of these, so that little more than the bodies streams through memory; with several, every
/// tile keeps its own between them.
#[derive(Default, Debug)]
pub(crate) struct Work {
    pub(crate) migrate: MigrateWork,
    pub(crate) proxies: Proxies,
    pub(crate) grid: Grid,
    pub(crate) pairs: Vec<Pair>,
    pub(crate) narrow_phase: NarrowPhase,
    pub(crate) contacts: Contacts,
    pub(crate) islands: Islands,
    pub(crate) solver: Solver,
    pub(crate) border: Border,
    pub(crate) timings: Timings,
}

/// One tile with all it needs for a stage.
pub(crate) struct Bench<'a> {
    pub(crate) tile: &'a mut Tile,
    pub(crate) work: &'a mut Work,
    pub(crate) outgoing: &'a mut Mailbag,
    pub(crate) incoming: &'a Mailbag,
    pub(crate) setup: &'a Setup,
    pub(crate) step: u64,
    /// Who works on this tile.
    pub(crate) team: Team,
    /// Whether this step measures how well its contacts are solved.
    pub(crate) measures: bool,
}

impl Bench<'_> {
    /// Runs one stage and books its time.
    pub(crate) fn stage(&mut self, phase: Phase, stage: impl FnOnce(&mut Self)) {
        let _span = tracing::trace_span!("stage", name = phase.name(), tile = self.tile.id.0).entered();
        let mut watch = Stopwatch::start();
        stage(self);
        watch.lap(phase, &mut self.work.timings);
    }
}
