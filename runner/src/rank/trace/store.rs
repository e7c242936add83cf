//! What one thread keeps of its spans. Nobody else looks at it while it works.

use super::clock::now;
use std::cell::{Cell, RefCell};
use std::mem;
use tracing::span::Id;

/// What this thread did for a while.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Kept {
    pub name: &'static str,
    pub of: Option<(&'static str, u64)>,
    pub start: u64,
    pub end: u64,
}

/// All that a thread has kept, in the order in which it ended.
#[derive(Default, Debug)]
pub(super) struct All {
    pub slices: Vec<Kept>,
    /// How many there was no room for.
    pub left_out: u64,
}

/// A span that this thread has made and not yet left.
struct Open {
    id: Id,
    name: &'static str,
    of: Option<(&'static str, u64)>,
    start: u64,
}

thread_local! {
    static ON: Cell<bool> = const { Cell::new(false) };
    static ROOM: Cell<usize> = const { Cell::new(0) };
    static OPEN: RefCell<Vec<Open>> = const { RefCell::new(Vec::new()) };
    static ALL: RefCell<All> = const { RefCell::new(All { slices: Vec::new(), left_out: 0 }) };
}

/// Lets this thread keep its spans from now on, up to so many, or no longer.
pub(super) fn turn(on: bool, room: usize) {
    ROOM.set(room);
    ON.set(on);
}

/// Whether this thread keeps its spans.
pub(super) fn is_on() -> bool {
    ON.get()
}

/// A span is made.
pub(super) fn open(id: &Id, name: &'static str, of: Option<(&'static str, u64)>) {
    OPEN.with_borrow_mut(|open| open.push(Open { id: id.clone(), name, of, start: 0 }));
}

/// It is entered.
pub(super) fn enter(id: &Id) {
    OPEN.with_borrow_mut(|open| {
        if let Some(span) = open.iter_mut().rev().find(|span| span.id == *id) {
            span.start = now();
        }
    });
}

/// It is left for good.
pub(super) fn exit(id: &Id) {
    let end = now();
    let span = OPEN.with_borrow_mut(|open| open.iter().rposition(|span| span.id == *id).map(|at| open.swap_remove(at)));
    let Some(Open { name, of, start, .. }) = span else { return };
    ALL.with_borrow_mut(|all| {
        if all.slices.len() < ROOM.get() {
            all.slices.push(Kept { name, of, start, end });
        } else {
            all.left_out += 1;
        }
    });
}

/// A span is gone, whether or not it was entered.
pub(super) fn close(id: &Id) {
    OPEN.with_borrow_mut(|open| open.retain(|span| span.id != *id));
}

/// Hands over all that was kept.
pub(super) fn take() -> All {
    ALL.with_borrow_mut(mem::take)
}
