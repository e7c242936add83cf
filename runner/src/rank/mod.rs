//! One rank of a run, from an empty world to the last figure.

pub(crate) mod balance;
mod begin;
mod commands;
mod end;
mod facts;
mod halo;
// Threads are started alike as it is.
#[cfg(any(test, feature = "iceoryx2", feature = "mpi"))]
pub(crate) mod handshake;
mod log;
mod meeting;
mod names;
mod observer;
mod recorder;
pub(crate) mod trace;
pub(crate) mod trouble;

pub(crate) use begin::not_crowded;
pub use begin::scene as part_of_scene;
pub(crate) use commands::check_commands;
pub(crate) use facts::{Gathered, RankFacts};
pub(crate) use halo::{ExchangeError, RankHalo};
pub(crate) use log::check_logs;
pub use meeting::{Held, Host, Next};
pub use observer::{Listener, Observer, PanicAt, StopFlag, Watcher};
pub(crate) use trace::TraceSteps;
use trouble::Refusal;

use crate::error::{Exit, RunError};
use crate::plan::Plan;
use atoll_core::{Phase, SetupError, StepError, StepReport, TileFacts, World};
use atoll_transport::{Collective, Counting, Rank, Transport, TransportError};
use balance::{Balancer, Retiler};
use begin::Beginning;
use bytemuck::Pod;
use commands::Commander;
use log::Log;
use meeting::Meetings;
use rayon::ThreadPoolBuilder;
use recorder::Recorder;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use trace::{RankTrace, Tracer};
use tracing::{debug, info_span};

/// Why a rank ended early.
#[derive(Debug)]
pub(crate) enum RankError {
    /// Its world could not be built.
    Setup(SetupError),
    /// Its threads could not be started.
    Threads {
        /// Itself.
        rank: Rank,
        /// How many it wanted.
        threads: usize,
        /// What the system said.
        reason: String,
    },
    /// A step failed.
    Step(StepError<ExchangeError>),
    /// Outside of a step, the transport failed.
    Transport(TransportError),
    /// What all ranks know alike: they ended together.
    Agreed {
        /// In words.
        text: String,
        /// The exit code they go with.
        exit: Exit,
    },
    /// It said so itself, in a process of its own.
    #[cfg(feature = "iceoryx2")]
    Told {
        /// Its words.
        text: String,
        /// The exit code they go with.
        exit: Exit,
    },
}

impl From<Refusal> for RankError {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Transport(error) => Self::Transport(error),
            Refusal::Known(error) => Self::Agreed { text: error.to_string(), exit: error.exit() },
        }
    }
}

impl RankError {
    /// What the transport said, if it was the transport.
    pub(crate) fn transport(&self) -> Option<&TransportError> {
        match self {
            Self::Transport(error) | Self::Step(StepError::Halo(ExchangeError::Transport(error))) => Some(error),
            _ => None,
        }
    }
}

/// How a rank ended.
#[derive(Debug)]
pub(crate) struct RankEnd {
    /// Steps it completed.
    pub complete: u64,
    /// What all ranks have to say, of rank 0.
    pub result: Result<Option<Gathered>, RankError>,
}

/// Runs one rank, with a pool of threads of its own that this thread becomes part of. `leads_process` is true for one
/// rank of each process.
pub(crate) fn drive<T: Transport>(transport: T, plan: &Plan, observer: &Observer, leads_process: bool) -> RankEnd {
    let (rank, threads) = (transport.rank(), plan.threads);
    let _span = info_span!("rank", rank = rank.0).entered();
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(move |thread| format!("rank {rank}, thread {thread}"))
        // So that a transport bound to its thread can be used inside the pool, and one thread really is one.
        .use_current_thread()
        .build();
    // From here to its drop, everything parallel on this thread runs in the pool.
    let _pool = match pool {
        Ok(pool) => pool,
        Err(error) => {
            let error = RankError::Threads { rank, threads, reason: error.to_string() };
            return RankEnd { complete: 0, result: Err(error) };
        }
    };
    let mut complete = 0;
    let result = run(transport, plan, observer, leads_process, &mut complete);
    RankEnd { complete, result }
}

fn run<T: Transport>(
    transport: T,
    plan: &Plan,
    observer: &Observer,
    leads_process: bool,
    complete: &mut u64,
) -> Result<Option<Gathered>, RankError> {
    let start = Instant::now();
    let rank = transport.rank();
    // Before the halo: where this rank fails, the others hear of it before the last of what it writes is written.
    let mut recorder;
    let mut halo = RankHalo::new(Counting::new(transport), plan.assignment.clone());
    let Beginning { mut world, assignment, resumed, commands } = begin::build(plan, rank, observer, halo.transport())?;
    halo.assign(assignment);
    begin::check_crowding(&world, halo.transport())?;
    // From here on the clock measures steps, not how long another rank takes to build.
    halo.transport().barrier().map_err(RankError::Transport)?;
    let logs = log::find(plan, resumed, halo.transport())?;
    let mut commander = Commander::start(plan, rank, (resumed, commands), &world, halo.transport())?;
    recorder = end::start(plan, rank, resumed, halo.transport())?;
    commander.open(plan, world.step_count(), observer, halo.transport())?;
    let start_log = |logs| Log::start(plan, logs, resumed, (&world, &mut halo), (recorder.as_ref(), observer));
    let mut log = logs.map(start_log).transpose()?;
    *complete = world.step_count();
    observer.complete.store(*complete, Ordering::Relaxed);
    let built = Instant::now();

    let steps = plan.config.run.steps;
    let told = observer.steps(rank == Rank(0), world.step_count(), steps);
    let before = halo.transport().stats();
    let mut last = StepReport::default();
    let (mut migrations, mut log_failure) = (0, None);
    let threads = plan.threads * plan.config.run.ranks;
    let mut tracer = Tracer::new(observer.trace.as_ref(), world.step_count(), threads);
    if let Some(recorder) = recorder.as_mut().filter(|_| resumed.is_none()) {
        recorder.write_due(&world, commander.state(), false);
    }
    let mut balancer = Balancer::start(plan, &mut world);
    let mut retiler = Retiler::start(plan, resumed, &world, rank, recorder.as_ref());
    commander.take_turn(&mut world, &mut halo, observer)?;
    observer.show(rank, &world);
    let mut meetings = Meetings::new(observer, plan);
    if plan.commands.drives {
        world.end_in_meetings();
    }
    last.stopped = meetings.linger(&mut world, &last, &mut halo, &mut commander)?;
    while world.step_count() < steps && !last.stopped && !commander.is_over() {
        let unwritten = log_failure.is_some()
            || commander.failure().is_some()
            || recorder.as_ref().is_some_and(|recorder| recorder.failure().is_some());
        if observer.stop.is_requested() || unwritten {
            world.request_stop();
        }
        if let Some(retiler) = &mut retiler {
            retiler.before_step(&mut world, &mut halo, recorder.as_ref())?;
        }
        if observer.panic_at == Some(PanicAt { rank: rank.0, step: world.step_count() }) {
            panic!("as --panic-at asks");
        }
        if world.step_count() + 1 == steps {
            world.measure_next_step();
        }
        if let Some(log) = &log {
            log.prepare(&mut world);
        }
        meetings.prepare(rank, &mut world);
        tracer.before(Some(world.step_count()));
        last = atoll_core::step(&mut world, &mut halo).map_err(RankError::Step)?;
        migrations += last.migrations;
        *complete = world.step_count();
        observer.complete.store(*complete, Ordering::Relaxed);
        let sides = (recorder.as_ref(), balancer.as_ref(), retiler.as_ref());
        if let Some(log) = &mut log {
            let failure = write_row(log, (&world, &last, migrations), sides, &mut halo)?;
            log_failure = log_failure.or(failure);
        }
        commander.after_step(&world, &mut halo)?;
        if let Some(recorder) = &mut recorder {
            recorder.write_due(&world, commander.state(), last.stopped);
        }
        // Of the last step all is answered, whoever asks the run to stop meanwhile.
        if !last.stopped || *complete == steps {
            commander.take_turn(&mut world, &mut halo, observer)?;
        }
        observer.show(rank, &world);
        told.made(*complete);
        if last.meeting {
            last.stopped = meetings.hold(&mut world, &last, &mut halo, &mut commander)?;
            let sides = (recorder.as_ref(), balancer.as_ref(), retiler.as_ref());
            // For who goes on from here it is the last.
            if let Some(log) = log.as_mut().filter(|log| last.stopped && !log.is_due(*complete)) {
                let failure = write_row(log, (&world, &last, migrations), sides, &mut halo)?;
                log_failure = log_failure.or(failure);
            }
        }
        if let Some(balancer) = &mut balancer {
            let is_last = last.stopped || *complete == steps;
            balancer.after_step(&last, is_last, &mut world, &mut halo)?;
        }
        debug!(step = last.step, contacts = last.contacts, ghosts = last.ghosts, "stepped");
    }
    tracer.before(None);
    // Whoever asks while the last step is made gets all of them.
    let interrupted = (last.stopped || commander.is_over() && *complete > 0) && *complete < steps;
    let mut output_time = match recorder {
        Some(recorder) => {
            commander.pause(&world, halo.transport())?;
            end::finish(recorder, (&world, commander.state()), interrupted, plan, observer, halo.transport())?
        }
        None => end::finish_log(log.as_ref(), log_failure, *complete, plan, halo.transport())?,
    };
    commander.close(halo.transport(), observer)?;
    if let Some(refusal) = commander.refusal() {
        return Err(refusal);
    }
    drop(told);
    let finished = Instant::now();

    let mut sent = halo.transport().stats().since(&before).since(&meetings.sent);
    output_time += meetings.spent;
    let mut waited = halo.waited();
    let mut facts = RankFacts::new(&world, &last, &plan.scene);
    facts.expected = plan.scene.bodies().wrapping_add_signed(commander.added());
    output_time += commander.time;
    sent = sent.since(&commander.sent);
    if let Some(log) = &log {
        output_time += log.time();
        waited += log.waited();
        // Waiting for others is part of an exchange, whatever is exchanged.
        facts.phase_nanos[Phase::Exchange as usize] += log.waited().as_nanos() as u64;
        sent = sent.since(&log.sent());
    }
    if let Some(balancer) = &balancer {
        sent = sent.since(&balancer.sent);
        balancer.tell_of(&mut facts);
    }
    if let Some(retiler) = &retiler {
        sent = sent.since(&retiler.sent);
        facts.balance_nanos += retiler.time().as_nanos() as u64;
    }
    facts.interrupted = interrupted.into();
    facts.migrations = migrations;
    facts.resumed_at = resumed.unwrap_or(0);
    (facts.bytes_sent, facts.messages_sent) = (sent.bytes_sent, sent.messages_sent);
    facts.build_nanos = (built - start).as_nanos() as u64;
    facts.wall_nanos = (finished - built).saturating_sub(meetings.stood).as_nanos() as u64;
    facts.wait_nanos = waited.as_nanos() as u64;
    facts.output_nanos = output_time.as_nanos() as u64;
    if !last.stopped {
        meetings.linger(&mut world, &last, &mut halo, &mut commander)?;
    }
    commander.leave(observer);
    let tiles = atoll_core::finish(world, &mut halo).map_err(RankError::Step)?;
    if leads_process {
        facts.peak_rss_bytes = peak_rss_bytes();
    }
    gather(halo.transport(), &facts, &tiles, &tracer).map_err(RankError::Transport)
}

/// Writes the row of the log that is due after a step, if one is. What keeps it from that is for the recorder to tell, or comes back
/// where there is none.
fn write_row<T: Transport>(
    log: &mut Log,
    (world, last, migrations): (&World, &StepReport, u64),
    (recorder, balancer, retiler): (Option<&Recorder<'_>>, Option<&Balancer>, Option<&Retiler>),
    halo: &mut RankHalo<Counting<T>>,
) -> Result<Option<RunError>, RankError> {
    let written = recorder.map_or(Duration::ZERO, Recorder::time);
    let balanced = balancer.map_or(Duration::ZERO, Balancer::time) + retiler.map_or(Duration::ZERO, Retiler::time);
    log.write_due(world, last, (migrations, written, balanced), halo)?;
    Ok(match (log.take_failure(), recorder) {
        // Before a snapshot that would be gone on from without the rows until then.
        (Some(failure), Some(recorder)) => {
            recorder.fail(failure);
            None
        }
        (failure, _) => failure,
    })
}

/// Brings everything to rank 0.
fn gather(
    transport: &mut impl Transport,
    facts: &RankFacts,
    tiles: &[TileFacts],
    tracer: &Tracer,
) -> Result<Option<Gathered>, TransportError> {
    let ranks = transport.gather(Rank(0), bytemuck::bytes_of(facts))?;
    let tiles = transport.gather(Rank(0), bytemuck::cast_slice(tiles))?;
    let trace: Option<Vec<RankTrace>> = tracer.gather(transport)?;
    let Some((ranks, tiles)) = ranks.zip(tiles) else { return Ok(None) };
    let gathered = Gathered { ranks: records(&ranks)?, tiles: records(&tiles)?, trace };
    if gathered.ranks.len() == ranks.len() { Ok(Some(gathered)) } else { Err(unreadable(Rank(0))) }
}

/// What came from all ranks, in their order, as one list.
fn records<T: Pod>(parts: &[Vec<u8>]) -> Result<Vec<T>, TransportError> {
    let mut records = Vec::new();
    for (rank, bytes) in parts.iter().enumerate() {
        let part = bytes.chunks_exact(size_of::<T>());
        if !part.remainder().is_empty() {
            return Err(unreadable(Rank::from_index(rank)));
        }
        records.extend(part.map(bytemuck::pod_read_unaligned::<T>));
    }
    Ok(records)
}

fn unreadable(rank: Rank) -> TransportError {
    TransportError::PeerLost { rank, reason: "what it sent cannot be read; run one version on all ranks".to_owned() }
}

/// The most memory this process ever held, in bytes; zero where the system does not tell.
fn peak_rss_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kilobytes =
        status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.split_whitespace().next()?.parse().ok());
    kilobytes.unwrap_or(0_u64) * 1024
}
