//! Batches: bodies and contacts that share nothing with those of other batches, so that each can be solved on its own.
//!
//! A batch is one or several whole islands. Within an island the order of constraints follows from its contacts alone
//! (see [`super::coloring`]), so how islands are put into batches changes no bit.

use super::lanes::LANES;
use super::place::{NOT_SOLVED, STATIC};
use crate::broad_phase::Pair;
use crate::params::Parallel;
use crate::team::Team;
use std::ops::Range;

/// Contacts in a batch of small islands, at least: enough to fill most lanes, few enough to stay in a core's cache.
const SMALL: u32 = 1024;

/// With this many contacts an island is worth all threads at once.
const LARGE: u32 = 4096;

/// Most pieces that contacts of one color are cut into, and so most threads that solve one island.
pub(super) const MOST_SLICES: u32 = 32;

/// Groups of eight in a piece, at least: less is not worth waiting for another thread.
const GROUPS_PER_SLICE: u32 = 16;

/// One batch. Ranges are of the solver's buffers, where those of one batch lie together, in the order of batches.
#[derive(Clone, Default, Debug)]
pub(super) struct Batch {
    /// Contacts, as places in [`Batches::contacts`].
    pub(super) contacts: Range<usize>,
    /// Solver bodies: first some that stand for all statics, a padding to whole blocks of eight at the end.
    pub(super) bodies: Range<usize>,
    /// How many stand for statics: one for each slice, so that no two threads write to the same.
    pub(super) statics: u32,
    /// Whether several threads are to solve it together.
    pub(super) large: bool,
    pub(super) colors: Range<usize>,
    pub(super) singles: Range<usize>,
    pub(super) doubles: Range<usize>,
}

impl Batch {
    fn new(large: bool) -> Self {
        Self { large, statics: if large { MOST_SLICES } else { 1 }, ..Self::default() }
    }

    /// Into how many pieces to cut so many groups of one color.
    pub(super) fn slices(&self, groups: usize) -> u32 {
        (groups as u32 / GROUPS_PER_SLICE).clamp(1, self.statics)
    }
}

/// The contacts of a tile and their islands.
#[derive(Clone, Copy)]
pub(super) struct Graph<'a> {
    pub(super) contacts: &'a [Pair],
    /// For each node, a body with contacts, the lowest of its island.
    pub(super) roots: &'a [u32],
    /// Nodes in the largest island.
    pub(super) largest: u64,
    /// For each root whether its island sleeps. None where nobody may.
    pub(super) sleeps: Option<&'a [bool]>,
}

/// How a tile's contacts are put into batches.
#[derive(Default, Debug)]
pub(super) struct Batches {
    pub(super) all: Vec<Batch>,
    /// Contacts by batch, and in canonical order within each.
    pub(super) contacts: Vec<u32>,
    /// For each island, named by its lowest node, how many contacts it has, and then its batch.
    of_island: Vec<u32>,
    /// Whether there is more than one thread to solve a batch.
    crews: bool,
}

fn is_node(place: u32) -> bool {
    place != NOT_SOLVED && place != STATIC
}

/// An island without contacts that are to be solved.
const NO_BATCH: u32 = u32::MAX;

impl Batches {
    /// Puts islands into batches, but those that sleep. `place` gives for each body of the tile its node plus one,
    /// [`STATIC`] or [`NOT_SOLVED`]; afterwards, its place among the solver's bodies.
    pub(super) fn divide(&mut self, graph: Graph<'_>, place: &mut [u32], parallel: Parallel, team: Team) {
        let Graph { contacts, roots, largest, sleeps } = graph;
        self.crews = !team.is_alone();
        self.all.clear();
        self.contacts.clear();
        if contacts.is_empty() {
            return;
        }
        // An island that is nearly everything is worth no sorting: the others may as well be solved with it.
        let (is_large, is_most) = (contacts.len() >= LARGE as usize, 4 * largest >= 3 * roots.len() as u64);
        let together = match parallel {
            Parallel::Serial | Parallel::Coloring => true,
            Parallel::Islands => false,
            Parallel::Auto => !is_large || is_most,
        };
        let crew = parallel == Parallel::Coloring || parallel == Parallel::Auto && is_large;
        if together && sleeps.is_none() {
            self.put_together(contacts.len(), place, roots.len(), crew);
        } else {
            self.put_apart(graph, place, parallel, together.then_some(crew));
        }
    }

    /// Everything in one batch.
    fn put_together(&mut self, contacts: usize, place: &mut [u32], nodes: usize, crew: bool) {
        let mut batch = Batch::new(self.crews && crew);
        let more = batch.statics - 1;
        if more > 0 {
            place.iter_mut().filter(|place| is_node(**place)).for_each(|place| *place += more);
        }
        batch.contacts = 0..contacts;
        batch.bodies = 0..(batch.statics as usize + nodes).next_multiple_of(LANES);
        self.contacts.extend(0..contacts as u32);
        self.all.push(batch);
    }

    /// Islands into the batches that [`choose`](Self::choose) has them in.
    fn put_apart(&mut self, graph: Graph<'_>, place: &mut [u32], parallel: Parallel, together: Option<bool>) {
        let Graph { contacts, roots, sleeps, .. } = graph;
        let island_of = |place: &[u32], [a, b]: Pair| {
            let node = if place[a as usize] == STATIC { place[b as usize] } else { place[a as usize] } - 1;
            roots[node as usize]
        };
        self.of_island.clear();
        self.of_island.resize(roots.len(), 0);
        for &pair in contacts {
            self.of_island[island_of(place, pair) as usize] += 1;
        }
        self.choose(roots, sleeps, parallel, together);

        // Bodies: in the order of the tile within each batch.
        for &root in roots {
            let batch = self.of_island[root as usize];
            if batch != NO_BATCH {
                self.all[batch as usize].bodies.end += 1;
            }
        }
        let mut first = 0;
        for batch in &mut self.all {
            let end = first + batch.statics as usize + batch.bodies.end;
            (batch.bodies, first) = (first..first + batch.statics as usize, end.next_multiple_of(LANES));
        }
        // Contacts are counted while bodies still go by their nodes.
        for &pair in contacts {
            let batch = self.of_island[island_of(place, pair) as usize];
            if batch != NO_BATCH {
                self.all[batch as usize].contacts.end += 1;
            }
        }
        let mut sum = 0;
        for batch in &mut self.all {
            let count = batch.contacts.end;
            batch.contacts = sum..sum;
            sum += count;
        }
        self.contacts.resize(sum, 0);
        for (i, &pair) in (0..).zip(contacts) {
            let batch = self.of_island[island_of(place, pair) as usize];
            if batch != NO_BATCH {
                let end = &mut self.all[batch as usize].contacts.end;
                self.contacts[*end] = i;
                *end += 1;
            }
        }
        for place in place.iter_mut().filter(|place| is_node(**place)) {
            let batch = self.of_island[roots[*place as usize - 1] as usize];
            *place = if batch == NO_BATCH {
                NOT_SOLVED
            } else {
                let end = &mut self.all[batch as usize].bodies.end;
                *end += 1;
                *end as u32 - 1
            };
        }
        for batch in &mut self.all {
            batch.bodies.end = batch.bodies.end.next_multiple_of(LANES);
        }
    }

    /// Decides which island goes into which batch, from the contacts of each alone: ascending, so that neighbours in
    /// memory stay neighbours.
    fn choose(&mut self, roots: &[u32], sleeps: Option<&[bool]>, parallel: Parallel, together: Option<bool>) {
        if let Some(crew) = together {
            self.all.push(Batch::new(self.crews && crew));
        }
        let (mut open, mut filled) = (NO_BATCH, 0);
        for (node, &root) in (0..).zip(roots) {
            if node != root {
                continue;
            }
            let weight = self.of_island[node as usize];
            self.of_island[node as usize] = if weight == 0 || sleeps.is_some_and(|sleeps| sleeps[root as usize]) {
                NO_BATCH
            } else if together.is_some() {
                0
            } else if parallel == Parallel::Auto && weight >= LARGE {
                self.all.push(Batch::new(self.crews));
                self.all.len() as u32 - 1
            } else {
                if open == NO_BATCH || filled >= SMALL {
                    self.all.push(Batch::new(false));
                    (open, filled) = (self.all.len() as u32 - 1, 0);
                }
                filled += weight;
                open
            };
        }
    }
}
