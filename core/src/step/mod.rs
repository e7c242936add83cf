//! The step, whole, from top to bottom.

mod hold;
pub(crate) mod phase;
pub(crate) mod stage;
pub(crate) mod standstill;

use crate::collide::broad_phase::Field;
use crate::collide::proxies::amid;
use crate::collide::{hollows, seams};
use crate::exchange::halo::{Carry, Halo, NotCarried, through};
use crate::exchange::verdict::Verdict;
use crate::exchange::{far, migrate};
use crate::model::error::StepError;
use crate::model::id::GlobalId;
use crate::model::params::Exchange;
use crate::solver;
use crate::state::facts::TileFacts;
use crate::tiling::tile::Fault;
use crate::world::World;
use phase::Phase;
use stage::{Bench, Detection};
use std::ops::Range;

/// What one step of one rank was like. Counts are of this rank's tiles.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct StepReport {
    /// The step, counted from 0.
    pub step: u64,
    /// Somebody asked the run to stop; every rank sees this in the same step.
    pub stopped: bool,
    /// Somebody asked all ranks to meet; every rank sees this in the same step.
    pub meeting: bool,
    /// Contacts solved, each counted by one tile.
    pub contacts: u64,
    /// Those of them between bodies of two tiles.
    pub border_contacts: u64,
    /// Ghosts that this rank's tiles sent.
    pub ghosts: u64,
    /// Bodies that came from other tiles.
    pub migrations: u64,
    /// Islands, each tile's counted apart.
    pub islands: u64,
    /// Bodies in the largest.
    pub largest_island: u64,
    /// Bodies whose islands sleep.
    pub asleep: u64,
    /// Colors of the contacts of one tile, at most.
    pub colors: u64,
}

/// Makes one step of this rank's part of the world.
///
/// Every rank of a run calls it equally often, with the same blueprint behind its world. The result depends on the tile
/// grid and not on how its tiles are spread over ranks and threads. The threads are those of the rayon pool it is called
/// in, or of the global one.
///
/// # Errors
/// What the halo failed with; or, on all ranks alike, that a body's state is no longer finite. A world whose step failed is left halfway,
/// and refuses to go on until each of its tiles is [restored](World::restore) and [`World::resume_at`] says from where.
pub fn step<H: Halo>(world: &mut World, halo: &mut H) -> Result<StepReport, StepError<H::Error>> {
    through(halo, |carry| world.unless_halfway(|world| make_step(world, carry)))
}

fn make_step(world: &mut World, halo: &mut Carry<'_>) -> Result<StepReport, StepError<NotCarried>> {
    let _span = tracing::trace_span!("step", step = world.step).entered();
    world.push();
    world.begin_step();
    let Verdict { stop: stopped, meet, .. } = migrate(world, halo)?;
    world.aim();
    // Whoever asked to meet alone knows of it where another asked to stop.
    let meeting = meet && !stopped;
    let may_be_last = stopped || meeting && world.ends_in_meetings;
    world.measures |= may_be_last;
    world.takes_figures |= may_be_last;
    match world.setup.params.exchange {
        // No word from outside until the step's end: each tile goes through all stages while it is in the cache.
        Exchange::Step => {
            world.each_tile(|bench| {
                if begin(bench) {
                    collide(bench);
                    prepare(bench);
                    solve(bench, 0..bench.setup.params.integrations());
                    finalize(bench);
                }
            });
        }
        // Between two sync points each tile goes through all that there is to do, while it is in the cache.
        Exchange::Substep => {
            let last = world.setup.params.integrations() - 1;
            world.each_tile_apart(|bench| {
                if begin(bench) {
                    collide(bench);
                    bench.stage(Phase::Border, |b| b.work.border.find(b.tile, &b.work.contacts, b.setup));
                    prepare(bench);
                    make_substep(bench, 0);
                }
            });
            for substep in 1..=last {
                world.exchange(halo)?;
                world.each_tile_under_way(|bench| {
                    bench.stage(Phase::Border, refresh);
                    make_substep(bench, substep);
                });
            }
            // After the last substep only a bounce still looks at a ghost's velocity: that which both tiles agree on.
            let rounds = if world.setup.bouncy { world.setup.params.bounce_rounds() } else { 0 };
            for round in 0..rounds {
                world.exchange(halo)?;
                world.each_tile_under_way(|bench| {
                    bench.stage(Phase::Border, |b| average(b, round > 0));
                    bench.stage(Phase::Border, send_refresh);
                });
                world.exchange(halo)?;
                world.each_tile_under_way(|bench| {
                    bench.stage(Phase::Border, refresh);
                    bench.stage(Phase::Finalize, |b| b.work.solver.apply_restitution());
                    bench.stage(Phase::Border, |b| b.work.border.add_bounces(b.tile, &b.work.solver));
                    bench.stage(Phase::Border, send_impulses);
                });
            }
            world.exchange(halo)?;
            world.each_tile_under_way(|bench| {
                bench.stage(Phase::Border, agree);
                finalize(bench);
            });
        }
    }
    report(world, StepReport { step: world.step, stopped, meeting, ..StepReport::default() })
}

/// The figures of a world between two steps: energies, contacts, overlaps, of each tile that owns bodies
/// ([`Facts::total`](crate::Facts::total) adds them up). The world stays as it is. Every rank must call it at the same step: it is an exchange, and costs a
/// part of a step, and a copy of the bodies while it lasts.
///
/// # Errors
/// As [`step`]; a failure of the last step is reported here.
pub fn measure<H: Halo>(world: &World, halo: &mut H) -> Result<Vec<TileFacts>, StepError<H::Error>> {
    finish(world.copy_bodies(), halo)
}

/// The closing exchange of a run, and a look at where everything came to rest: as [`measure`], without a copy.
///
/// # Errors
/// As [`step`]; a failure of the last step is reported here.
pub fn finish<H: Halo>(mut world: World, halo: &mut H) -> Result<Vec<TileFacts>, StepError<H::Error>> {
    through(halo, |carry| world.unless_halfway(|world| close(world, carry)))
}

fn close(world: &mut World, halo: &mut Carry<'_>) -> Result<Vec<TileFacts>, StepError<NotCarried>> {
    world.begin_step();
    migrate(world, halo)?;
    Ok(world.each_tile(|bench| {
        // Manifolds as they are, not as they were kept.
        bench.tile.contacts.clear();
        bench.tile.strays.clear();
        collide(bench);
        TileFacts::measure(bench.tile, &bench.work.contacts, bench.setup)
    }))
}

/// The first sync point: migrants, then ghosts; and another where bodies go far. What all ranks together have to say comes back.
fn migrate(world: &mut World, halo: &mut Carry<'_>) -> Result<Verdict, StepError<NotCarried>> {
    if !world.has_failed() {
        world.each_tile(|bench| {
            bench.stage(Phase::Migrate, |b| migrate::send(b.tile, b.outgoing, b.migrate, b.setup));
        });
        world.tell_of_far_bodies();
    }
    let verdict = world.exchange(halo)?;
    if let Some((step, id)) = verdict.failure {
        world.hear_of(&verdict);
        return Err(StepError::NonFinite { step, id });
    }
    world.welcome_heirs();
    world.each_tile(|bench| {
        let receive = |b: &mut Bench<'_>| migrate::receive(b.tile, b.mail, b.migrate, b.setup, b.step);
        bench.stage(Phase::Migrate, receive);
    });
    if verdict.is_far() {
        world.each_tile(|bench| bench.stage(Phase::Migrate, |b| far::send(b.tile, b.outgoing, b.setup)));
        world.exchange(halo)?;
        world.each_tile(|bench| bench.stage(Phase::Migrate, |b| far::receive(b.tile, b.mail, b.setup, b.step)));
    }
    world.dismiss_idle();
    Ok(verdict)
}

/// Whether a tile has anything to do in this step: not if it stands still.
fn begin(bench: &mut Bench<'_>) -> bool {
    bench.stage(Phase::Flush, |b| {
        let asked = b.measures || b.figures.is_some();
        b.work.outlook = standstill::look(b.tile, asked, b.setup);
        !b.work.outlook.stands_still()
    })
}

/// Broad phase, narrow phase.
fn collide(bench: &mut Bench<'_>) {
    bench.stage(Phase::Flush, |b| {
        let (tile, proxies, counts) = (&b.tile, &mut b.detection.proxies, [b.tile.owned, b.tile.ghosts()]);
        // A quadtree stays from step to step, and so does what it counts from.
        let origin = match tile.quadtree {
            Some(_) => tile.rectangle.min,
            None => amid(&tile.bodies.position[..counts[0] + counts[1]]),
        };
        let fastest = proxies.load(&tile.bodies, counts, &tile.rectangle, origin, b.setup, b.team);
        proxies.pair_ghosts(tile, b.setup);
        b.tile.counts.fastest = fastest;
        if let Some(quadtree) = &mut b.tile.quadtree {
            quadtree.flush(proxies, &b.tile.bodies.id);
        }
    });
    bench.stage(Phase::BroadPhase, |b| {
        let Detection { grid, proxies, pairs, .. } = &mut *b.detection;
        pairs.clear();
        match &b.tile.quadtree {
            None => {
                let field = Field { proxies, bodies: &b.tile.bodies, setup: b.setup, team: b.team };
                grid.find_pairs(field, pairs);
            }
            Some(quadtree) => quadtree.find_pairs(proxies, b.team, pairs),
        }
    });
    bench.stage(Phase::NarrowPhase, |b| {
        let Detection { narrow_phase, proxies, pairs, .. } = &mut *b.detection;
        narrow_phase.find(b.tile, proxies, pairs, b.setup, b.team, &mut b.work.contacts);
        seams::mend(b.tile, &mut b.work.contacts, b.setup);
        hollows::follow(b.tile, &mut b.work.contacts, b.setup);
    });
}

/// Islands, and who sleeps; constraints.
fn prepare(bench: &mut Bench<'_>) {
    bench.stage(Phase::Islands, |b| {
        let (solver, contacts) = (&mut b.work.solver, &b.work.contacts);
        let sent = if b.setup.params.exchange == Exchange::Substep { b.work.border.sent() } else { &[] };
        let islands = solver.arrange(b.tile, contacts, sent, b.measures, b.setup, b.team);
        solver.load(b.tile, contacts, b.setup, b.step);
        let (found, counts) = (contacts.count(b.tile), &mut b.tile.counts);
        (counts.islands, counts.largest_island) = (islands.islands, islands.largest);
        (counts.contacts, counts.border_contacts) = found;
    });
    bench.stage(Phase::Coloring, |b| b.tile.counts.colors = b.work.solver.color(b.tile, &b.work.contacts, b.team));
    bench.stage(Phase::Prepare, |b| b.work.solver.prepare(b.tile, &b.work.contacts, b.setup, b.team));
}

fn solve(bench: &mut Bench<'_>, substeps: Range<u32>) {
    if substeps.start == 0 {
        for batch in 0..bench.work.solver.batches() {
            if bench.work.solver.is_at_once(batch) {
                solve_at_once(bench, batch);
            }
        }
    }
    bench.stage(Phase::Substeps, |b| b.work.solver.solve(substeps, b.setup, b.team));
}

/// One substep, and what others must hear of it before they go on: the state of their ghosts, or at the end of the last one what the
/// contacts at the border did.
fn make_substep(bench: &mut Bench<'_>, substep: u32) {
    solve(bench, substep..substep + 1);
    bench.stage(Phase::Border, |b| b.work.border.add_impulses(b.tile, &b.work.solver));
    let is_last = substep + 1 == bench.setup.params.integrations();
    let tell = if is_last { send_impulses } else { send_refresh };
    bench.stage(Phase::Border, tell);
}

/// A batch that nobody waits for, while it is in the cache.
fn solve_at_once(bench: &mut Bench<'_>, batch: usize) {
    bench.stage(Phase::Prepare, |b| b.work.solver.write_rows(batch, b.tile, &b.work.contacts, b.setup));
    bench.stage(Phase::Substeps, |b| b.work.solver.solve_at_once(batch, b.setup));
    bench.stage(Phase::Finalize, |b| {
        if b.setup.bouncy {
            // As often as those that keep their rows: how islands are put into batches changes no bit.
            (0..b.setup.params.bounce_rounds()).for_each(|_| b.work.solver.bounce_at_once(batch));
        }
        b.work.solver.store_impulses_of(batch, &mut b.tile.contacts);
    });
}

/// Restitution where it has not been, and everything written back.
fn finalize(bench: &mut Bench<'_>) {
    bench.stage(Phase::Finalize, |b| {
        let solver = &mut b.work.solver;
        if b.setup.bouncy && b.setup.params.exchange == Exchange::Step {
            solver.apply_restitution();
        }
        if b.measures {
            b.tile.violation = solver.violation(&b.tile.contacts, b.setup);
        }
        solver.store_impulses(&mut b.tile.contacts, b.team);
        let ways = hold::ways(b.tile, &solver.bodies, b.setup);
        solver::write_back(b.tile, &solver.bodies, b.setup, b.team);
        hold::hold(b.tile, &ways, b.setup, b.step);
        b.tile.count_rest(b.setup);
        if let Some(figures) = &mut b.figures {
            figures.add_bodies(b.tile, b.setup, b.team);
            figures.add_contacts(b.tile, &b.work.contacts, b.setup, b.team);
        }
        far::forget(b.tile);
        standstill::note(b.tile, &b.work.outlook);
    });
}

fn send_refresh(bench: &mut Bench<'_>) {
    let work = &*bench.work;
    work.border.send_refresh(bench.tile, &work.solver, bench.outgoing);
}

fn refresh(bench: &mut Bench<'_>) {
    let work = &mut *bench.work;
    work.border.refresh(bench.tile, &mut work.solver, bench.mail, bench.setup);
}

fn send_impulses(bench: &mut Bench<'_>) {
    let work = &*bench.work;
    work.border.send_impulses(bench.tile, &work.solver, bench.outgoing);
}

fn agree(bench: &mut Bench<'_>) {
    let work = &mut *bench.work;
    work.border.agree(bench.tile, &mut work.solver, bench.mail, bench.setup);
}

fn average(bench: &mut Bench<'_>, bounced: bool) {
    let work = &mut *bench.work;
    if work.border.average(bench.tile, &mut work.solver, bench.mail, bounced) {
        work.solver.pass_on(bench.tile, &work.contacts, work.border.heard(), bench.setup);
    }
}

/// Completes the report of a step, and the step.
fn report(world: &mut World, mut report: StepReport) -> Result<StepReport, StepError<NotCarried>> {
    let (mut leaps, mut not_finite): (u64, Option<GlobalId>) = (0, None);
    for tile in world.tiles_of_step() {
        let counts = &tile.counts;
        match counts.fault {
            Some(Fault::Protocol) => return Err(StepError::Protocol { step: world.step, tile: tile.id }),
            Some(Fault::FloatMode) => return Err(StepError::FloatMode { step: world.step }),
            None => {}
        }
        report.contacts += counts.contacts;
        report.border_contacts += counts.border_contacts;
        report.ghosts += counts.ghosts;
        report.migrations += counts.migrations;
        report.islands += counts.islands;
        report.largest_island = report.largest_island.max(counts.largest_island);
        report.asleep += counts.asleep;
        report.colors = report.colors.max(counts.colors);
        leaps += counts.leaps;
        not_finite = not_finite.into_iter().chain(counts.not_finite).min();
    }
    world.end_step(leaps, not_finite);
    Ok(report)
}
