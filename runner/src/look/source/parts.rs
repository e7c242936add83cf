//! What the ranks of a run show, until it is put together: each copies its part of a frame and goes on, and waits only where
//! the part before was not taken yet.

use super::Shown;
use crate::folder::recording::Row;
use crate::look::frame::{Frame, Live};
use crate::rank::Watcher;
use atoll_core::{Body, TileId, TileView, World};
use atoll_transport::Rank;
use glam::DVec2;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// A part of a frame from each rank. Together with the frame they are put into, this is memory for two.
#[derive(Debug)]
pub(super) struct Parts {
    shown: Shown,
    /// Whether to tell what is known only while a run is under way.
    live: bool,
    /// By rank. Each is locked by its rank while it is empty, and by who takes it while it is full.
    parts: Vec<Mutex<Part>>,
    state: Mutex<State>,
    changed: Condvar,
}

/// What one rank shows.
#[derive(Default, Debug)]
struct Part {
    frame: Frame,
    /// The tiles it holds.
    tiles: Vec<TileId>,
}

/// How far things are.
#[derive(Debug)]
struct State {
    /// By rank, whether there is a part to take.
    full: Vec<bool>,
    /// Nothing more is taken.
    closed: bool,
    /// Nothing more will come.
    ended: bool,
}

impl Parts {
    pub(super) fn new(shown: Shown, live: bool, ranks: usize) -> Self {
        Self {
            shown,
            live,
            parts: (0..ranks).map(|_| Mutex::default()).collect(),
            state: Mutex::new(State { full: vec![false; ranks], closed: false, ended: false }),
            changed: Condvar::new(),
        }
    }

    /// Puts the next frame together, once all ranks have shown their parts of it. False if none will come any more.
    pub(super) fn take(&self, frame: &mut Frame) -> bool {
        let waits = |state: &mut State| !state.ended && state.full.contains(&false);
        let state = self.changed.wait_while(self.state(), waits).unwrap_or_else(PoisonError::into_inner);
        if state.full.contains(&false) {
            return false;
        }
        drop(state);
        clear(frame, self.live);
        frame.bodies.reserve_exact(self.parts.iter().map(|part| lock(part).frame.bodies.len()).sum());
        for (rank, part) in (0..).zip(&self.parts) {
            let Part { frame: part, tiles } = &*lock(part);
            frame.step = part.step;
            frame.tiling.clone_from(&part.tiling);
            frame.bodies.extend_from_slice(&part.bodies);
            frame.ranks.push((rank, frame.bodies.len()));
            if let Some((to, from)) = frame.live.as_mut().zip(part.live.as_ref()) {
                append(to, from);
                // Tiles that were joined are there no more.
                to.rank_of_tile.truncate(frame.tiling.as_ref().map_or(usize::MAX, |tiling| tiling.tiles()));
                for tile in tiles {
                    let tile = tile.0 as usize;
                    to.rank_of_tile.resize(to.rank_of_tile.len().max(tile + 1), 0);
                    to.rank_of_tile[tile] = rank;
                }
            }
        }
        if let Some(live) = &mut frame.live {
            // In an order that tells nothing of ranks.
            live.ghosts.sort_unstable_by_key(|(row, tile)| (*tile, row.id));
            let place = |(point, impulse): &(DVec2, f32)| (point.x, point.y, *impulse);
            live.points.sort_unstable_by(|a, b| {
                let (a, b) = (place(a), place(b));
                a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.total_cmp(&b.2))
            });
        }
        self.state().full.fill(false);
        self.changed.notify_all();
        true
    }

    /// Takes nothing any more: no rank waits from here on.
    pub(super) fn close(&self) {
        self.state().closed = true;
        self.changed.notify_all();
    }

    /// Says that nothing more will come.
    pub(super) fn end(&self) {
        self.state().ended = true;
        self.changed.notify_all();
    }

    /// A rank that panics holds none of these locks for long, and leaves all of it whole.
    fn state(&self) -> MutexGuard<'_, State> {
        lock(&self.state)
    }
}

impl Watcher for Parts {
    fn wants(&self, step: u64) -> bool {
        self.shown.has(step)
    }

    fn see(&self, rank: Rank, world: &World) {
        let rank = rank.index();
        let waits = |state: &mut State| !state.closed && state.full[rank];
        let state = self.changed.wait_while(self.state(), waits).unwrap_or_else(PoisonError::into_inner);
        if state.closed {
            return;
        }
        drop(state);
        fill(&mut lock(&self.parts[rank]), world, self.live);
        self.state().full[rank] = true;
        self.changed.notify_all();
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Forgets what a frame holds, and keeps its memory.
fn clear(frame: &mut Frame, live: bool) {
    frame.bodies.clear();
    frame.ranks.clear();
    if !live {
        frame.live = None;
        return;
    }
    let live = frame.live.get_or_insert_default();
    live.contacts.clear();
    live.asleep.clear();
    live.ghosts.clear();
    live.points.clear();
}

fn append(to: &mut Live, from: &Live) {
    to.contacts.extend_from_slice(&from.contacts);
    to.asleep.extend_from_slice(&from.asleep);
    to.ghosts.extend_from_slice(&from.ghosts);
    to.points.extend_from_slice(&from.points);
}

/// What one rank has to show.
fn fill(Part { frame: part, tiles }: &mut Part, world: &World, live: bool) {
    clear(part, live);
    tiles.clear();
    tiles.extend(world.tiles());
    part.step = world.step_count();
    part.tiling = (!world.partition().is_uniform()).then(|| Arc::new(world.partition().clone()));
    let bodies: usize = world.views().map(|tile| tile.bodies().len()).sum();
    // Bodies come and go a few at a time, and twice the memory would be much.
    if part.bodies.capacity() < bodies {
        part.bodies.reserve_exact(bodies + bodies / 16);
    }
    part.bodies.extend(world.bodies().map(row));
    if let Some(live) = &mut part.live {
        world.views().for_each(|tile| add_tile(live, &tile));
    }
}

fn add_tile(live: &mut Live, tile: &TileView<'_>) {
    let (first, bodies) = (live.contacts.len(), tile.bodies().len());
    live.contacts.resize(first + bodies, 0);
    live.asleep.extend_from_slice(tile.asleep());
    // Where none may sleep, nobody says so.
    live.asleep.resize(first + bodies, false);
    live.ghosts.extend(tile.ghosts().map(|ghost| (row(ghost), tile.id().0)));
    // Those that press: others are only near.
    for contact in tile.contacts().filter(|contact| contact.normal_impulse > 0.0) {
        for body in contact.owned.into_iter().flatten() {
            let count = &mut live.contacts[first + body];
            *count = count.saturating_add(1);
        }
        // Of two tiles that share one, the owner of its first body shows it. Statics are nobody's.
        if !contact.is_border || contact.owned[0].is_some() {
            let [one, other] = contact.points;
            live.points.push((0.5 * (one + other), contact.normal_impulse));
        }
    }
}

/// A body as it would be recorded.
pub(super) fn row(body: Body) -> Row {
    Row {
        id: body.id.0,
        x: body.position.x,
        y: body.position.y,
        angle: body.rotation.angle(),
        vx: body.velocity.x,
        vy: body.velocity.y,
        omega: body.angular_velocity,
        kind: body.kind.0,
        padding: 0,
    }
}
