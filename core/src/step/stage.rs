//! One stage of a step of one tile: what it works with, and its time booked.

use super::phase::{Phase, Stopwatch, Timings};
use super::standstill::Outlook;
use crate::collide::broad_phase::Pair;
use crate::collide::broad_phase::grid::Grid;
use crate::collide::narrow_phase::{Contacts, NarrowPhase};
use crate::collide::proxies::Proxies;
use crate::exchange::border::Border;
use crate::exchange::mail::{Mail, Mailbag};
use crate::exchange::migrate::MigrateWork;
use crate::parallel::team::Team;
use crate::solver::Solver;
use crate::state::figures::Figures;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use std::time::Duration;

/// What finding a tile's contacts takes. A thread's tiles share one of these.
#[derive(Default, Debug)]
pub(crate) struct Detection {
    pub(crate) proxies: Proxies,
    pub(crate) grid: Grid,
    pub(crate) pairs: Vec<Pair>,
    pub(crate) narrow_phase: NarrowPhase,
}

/// A tile's contacts, and all that is derived of them in a step. With one sync point a step, a tile is stepped in one go and a
/// thread's tiles share one of these, so that little more than the bodies streams through memory; with several, every
/// tile that owns bodies keeps its own between them.
#[derive(Default, Debug)]
pub(crate) struct Work {
    pub(crate) contacts: Contacts,
    pub(crate) solver: Solver,
    pub(crate) border: Border,
    /// What is known of the step under way.
    pub(crate) outlook: Outlook,
}

/// What a thread has for all tiles it works on.
#[derive(Default, Debug)]
pub(crate) struct Hand {
    pub(crate) migrate: MigrateWork,
    pub(crate) timings: Timings,
    /// Time booked in this step.
    pub(crate) booked: Duration,
    /// When its last tile in this stage was done, by the clock that time is booked by.
    pub(crate) booked_until: Option<Duration>,
    /// What its tiles have to tell at the next sync point.
    pub(crate) outgoing: Mailbag,
    /// Of its tiles, in a step that takes them.
    pub(crate) figures: Figures,
    detection: Detection,
    /// For tiles that are stepped in one go.
    work: Work,
}

/// One tile with all it needs for a stage.
pub(crate) struct Bench<'a> {
    pub(crate) tile: &'a mut Tile,
    pub(crate) detection: &'a mut Detection,
    pub(crate) work: &'a mut Work,
    pub(crate) migrate: &'a mut MigrateWork,
    pub(crate) outgoing: &'a mut Mailbag,
    pub(crate) mail: Mail<'a>,
    pub(crate) setup: &'a Setup,
    pub(crate) step: u64,
    /// Who works on this tile.
    pub(crate) team: Team,
    /// Whether this step measures how well its contacts are solved.
    pub(crate) measures: bool,
    /// Where this step adds its figures, if it takes them.
    pub(crate) figures: Option<&'a mut Figures>,
    timings: &'a mut Timings,
    watch: Stopwatch,
}

/// What is the same for all tiles in one stage.
#[derive(Clone, Copy)]
pub(crate) struct Shop<'a> {
    pub(crate) setup: &'a Setup,
    pub(crate) step: u64,
    pub(crate) measures: bool,
    /// Whether this step takes figures.
    pub(crate) takes_figures: bool,
}

impl<'a> Bench<'a> {
    pub(crate) fn new(shop: Shop<'a>, team: Team, tile: &'a mut Tile, mail: Mail<'a>, hand: &'a mut Hand) -> Self {
        let Hand { migrate, timings, outgoing, figures, detection, work, .. } = hand;
        let Shop { setup, step, measures, takes_figures } = shop;
        let figures = takes_figures.then_some(figures);
        let watch = Stopwatch::start();
        Self { tile, detection, work, migrate, outgoing, mail, setup, step, team, measures, figures, timings, watch }
    }

    /// The same with work of the tile's own.
    pub(crate) fn with_work<'b>(&'b mut self, work: &'b mut Work) -> Bench<'b> {
        let &mut Self { mail, setup, step, team, measures, watch, .. } = self;
        let Self { tile, detection, migrate, outgoing, figures, timings, .. } = self;
        let figures = figures.as_deref_mut();
        Bench { tile, detection, work, migrate, outgoing, mail, setup, step, team, measures, figures, timings, watch }
    }

    /// Runs one stage and books the time since the one before.
    pub(crate) fn stage<R>(&mut self, phase: Phase, stage: impl FnOnce(&mut Self) -> R) -> R {
        let _span = tracing::trace_span!("stage", name = phase.name(), tile = self.tile.id.0).entered();
        let result = stage(self);
        self.watch.lap(phase, self.timings);
        result
    }
}
