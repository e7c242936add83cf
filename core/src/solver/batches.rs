//! Batches: bodies and contacts that share nothing with those of other batches, so that each can be solved on its own.
//!
//! A batch is one or several whole islands. Within an island the order of constraints follows from its contacts alone
//! (see [`super::coloring`]), so how islands are put into batches changes no bit.

use super::constraint::columns::{Each, Members};
use super::index::{GraphNode, SolverIndex, place_all};
use crate::collide::broad_phase::Pair;
use crate::model::params::Parallel;
use crate::parallel::lanes::LANES;
use crate::parallel::team::Team;
use std::ops::Range;

/// Contacts in a batch of small islands, at least: enough to fill most lanes, few enough to stay in a core's cache.
const SMALL: u32 = 1024;

/// With this many contacts an island is worth all threads at once.
const LARGE: u32 = 4096;

/// Most pieces that contacts of one color are cut into, and so most threads that solve one island.
pub(crate) const MOST_SLICES: u32 = 32;

/// Groups in a piece, at least: less is not worth waiting for another thread.
const GROUPS_PER_SLICE: u32 = 8;

/// One batch. Ranges are of the solver's buffers, where those of one batch lie together, in the order of batches.
#[derive(Clone, Default, Debug)]
pub(crate) struct Batch {
    /// Contacts, as places in [`Batches::contacts`].
    pub(crate) contacts: Range<usize>,
    /// Solver bodies: first some that stand for all statics, a padding to whole blocks of eight at the end.
    pub(crate) bodies: Range<usize>,
    /// How many stand for statics: one for each slice, so that no two threads write to the same.
    pub(crate) statics: u32,
    /// Whether several threads are to solve it together.
    pub(crate) large: bool,
    /// Whether other tiles are to hear of some of its bodies within the step, or this tile of theirs.
    pub(crate) at_border: bool,
    /// Whether it goes from contacts to impulses before the next one begins: its rows lie where those of the batch before lay, in the
    /// cache. The others keep theirs until the step ends.
    pub(crate) at_once: bool,
    pub(crate) colors: Range<usize>,
    /// Among the rows of batches that keep them, or else from zero.
    pub(crate) groups: Each<Range<usize>>,
    /// Where the members of its groups begin.
    pub(crate) members: Each<usize>,
}

impl Batch {
    /// The members of its groups.
    pub(crate) fn members_of<'a>(&self, all: &'a Each<Vec<Members>>) -> Each<&'a [Members]> {
        std::array::from_fn(|column| &all[column][self.members[column]..][..self.groups[column].len()])
    }

    /// Into how many pieces to cut so many groups of one color.
    pub(crate) fn slices(&self, groups: usize) -> u32 {
        (groups as u32 / GROUPS_PER_SLICE).clamp(1, self.statics)
    }
}

/// The contacts of a tile and their islands.
#[derive(Clone)]
pub(crate) struct Graph<'a> {
    pub(crate) contacts: &'a [Pair],
    /// For each node, a body with contacts, the lowest of its island.
    pub(crate) roots: &'a [u32],
    /// Nodes in the largest island.
    pub(crate) largest: u64,
    /// The nodes that are ghosts that are heard of within the step. Islands with such, or with bodies that others hear of, and
    /// islands without are not mixed: these need not wait for word.
    pub(crate) ghosts: Range<usize>,
    /// Bodies of the tile that others hear of within the step.
    pub(crate) sent: &'a [u32],
    /// For each root whether its island sleeps. None where nobody may.
    pub(crate) sleeps: Option<&'a [bool]>,
    /// Whether rows are asked for when all is solved.
    pub(crate) keeps_rows: bool,
}

/// How a tile's contacts are put into batches.
#[derive(Default, Debug)]
pub(crate) struct Batches {
    pub(crate) all: Vec<Batch>,
    /// Contacts by batch, and in canonical order within each.
    pub(crate) contacts: Vec<u32>,
    /// For each island, named by its lowest node, how many contacts it has, and then its batch.
    of_island: Vec<u32>,
    /// For each island whether it has a body that is heard of within the step.
    at_border: Vec<bool>,
    /// Whether there is more than one thread to solve a batch.
    crews: bool,
    /// Whether every batch keeps its rows.
    keeps_rows: bool,
}

/// An island without contacts that are to be solved.
const NO_BATCH: u32 = u32::MAX;

impl Batches {
    /// The batch that has one of the solver's bodies.
    pub(crate) fn of_body(&self, place: usize) -> &Batch {
        &self.all[self.all.partition_point(|batch| batch.bodies.end <= place)]
    }

    /// Puts islands into batches, but those that sleep. `nodes` gives for each body of the tile what it is in the graph;
    /// returns which of the solver's bodies it is.
    pub(crate) fn divide(
        &mut self,
        graph: Graph<'_>,
        nodes: Vec<GraphNode>,
        parallel: Parallel,
        team: Team,
    ) -> Vec<SolverIndex> {
        let Graph { contacts, roots, largest, sleeps, .. } = graph;
        (self.crews, self.keeps_rows) = (!team.is_alone(), graph.keeps_rows);
        self.all.clear();
        self.contacts.clear();
        if contacts.is_empty() {
            return place_all(nodes, |_| SolverIndex::NOT_SOLVED);
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
            let at_border = !graph.ghosts.is_empty() || !graph.sent.is_empty();
            self.put_together(contacts.len(), nodes, roots.len(), [crew, at_border])
        } else {
            self.put_apart(graph, nodes, parallel, together.then_some(crew))
        }
    }

    /// A batch of nothing yet, for a crew if there is one and it is worth it.
    fn begin(&self, crew: bool, at_border: bool) -> Batch {
        let large = self.crews && crew;
        let at_once = !(self.crews || at_border || self.keeps_rows);
        Batch { large, at_border, at_once, statics: if large { MOST_SLICES } else { 1 }, ..Batch::default() }
    }

    /// Everything in one batch.
    fn put_together(
        &mut self,
        contacts: usize,
        nodes: Vec<GraphNode>,
        moving: usize,
        [crew, at_border]: [bool; 2],
    ) -> Vec<SolverIndex> {
        let mut batch = self.begin(crew, at_border);
        let statics = batch.statics;
        batch.contacts = 0..contacts;
        batch.bodies = 0..(statics as usize + moving).next_multiple_of(LANES);
        self.contacts.extend(0..contacts as u32);
        self.all.push(batch);
        let after = |statics: u32| move |node: GraphNode| node.placed(|number| SolverIndex::new(statics + number));
        // After one static, as is usual, all numbers stay as they are: the compiler leaves nothing to do.
        if statics == 1 { place_all(nodes, after(1)) } else { place_all(nodes, after(statics)) }
    }

    /// Islands into the batches that [`choose`](Self::choose) has them in.
    fn put_apart(
        &mut self,
        graph: Graph<'_>,
        nodes: Vec<GraphNode>,
        parallel: Parallel,
        together: Option<bool>,
    ) -> Vec<SolverIndex> {
        let Graph { contacts, roots, .. } = graph;
        let island_of = |[a, b]: Pair| {
            let node = nodes[a as usize].number().or_else(|| nodes[b as usize].number());
            roots[node.expect("one of a contact's bodies moves") as usize]
        };
        self.of_island.clear();
        self.of_island.resize(roots.len(), 0);
        for &pair in contacts {
            self.of_island[island_of(pair) as usize] += 1;
        }
        self.at_border.clear();
        self.at_border.resize(roots.len(), false);
        roots[graph.ghosts.clone()].iter().for_each(|&root| self.at_border[root as usize] = true);
        for node in graph.sent.iter().filter_map(|&body| nodes[body as usize].number()) {
            self.at_border[roots[node as usize] as usize] = true;
        }
        self.choose(graph, parallel, together);

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
        for &pair in contacts {
            let batch = self.of_island[island_of(pair) as usize];
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
            let batch = self.of_island[island_of(pair) as usize];
            if batch != NO_BATCH {
                let end = &mut self.all[batch as usize].contacts.end;
                self.contacts[*end] = i;
                *end += 1;
            }
        }
        let mut place = |number: u32| {
            let batch = self.of_island[roots[number as usize] as usize];
            if batch == NO_BATCH {
                return SolverIndex::NOT_SOLVED;
            }
            let end = &mut self.all[batch as usize].bodies.end;
            *end += 1;
            SolverIndex::new(*end as u32 - 1)
        };
        let places = place_all(nodes, |node| node.placed(&mut place));
        for batch in &mut self.all {
            batch.bodies.end = batch.bodies.end.next_multiple_of(LANES);
        }
        places
    }

    /// Decides which island goes into which batch, from the contacts of each alone: ascending, so that neighbours in
    /// memory stay neighbours.
    fn choose(&mut self, graph: Graph<'_>, parallel: Parallel, together: Option<bool>) {
        let Graph { roots, sleeps, .. } = graph;
        if let Some(crew) = together {
            self.all.push(self.begin(crew, self.at_border.contains(&true)));
        }
        // The batch that is being filled, and its contacts: of islands within the tile, and of those at its border.
        let mut open = [(NO_BATCH, 0); 2];
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
                self.all.push(self.begin(true, self.at_border[node as usize]));
                self.all.len() as u32 - 1
            } else {
                let at_border = self.at_border[node as usize];
                let (batch, filled) = &mut open[usize::from(at_border)];
                if *batch == NO_BATCH || *filled >= SMALL {
                    self.all.push(self.begin(false, at_border));
                    (*batch, *filled) = (self.all.len() as u32 - 1, 0);
                }
                *filled += weight;
                *batch
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::islands::Islands;
    use crate::model::params::IslandSearch;
    use proptest::prelude::*;

    /// Any contacts among bodies, the first two of which are statics.
    fn any_contacts() -> impl Strategy<Value = (usize, Vec<Pair>)> {
        (3..400_u32).prop_flat_map(|bodies| {
            let contact = (0..bodies, 2..bodies).prop_filter("two bodies", |(a, b)| a != b).prop_map(|(a, b)| [a, b]);
            (Just(bodies as usize), prop::collection::vec(contact, 0..3000))
        })
    }

    /// Numbers the bodies with contacts as the solver does: places, and links between nodes.
    fn number(bodies: usize, contacts: &[Pair]) -> (Vec<GraphNode>, Vec<Pair>) {
        let mut node = vec![GraphNode::NO_CONTACT; bodies];
        contacts.iter().flatten().for_each(|&body| node[body as usize] = GraphNode::STATIC);
        for (number, node) in (0..).zip(node[2..].iter_mut().filter(|node| **node == GraphNode::STATIC)) {
            *node = GraphNode::new(number);
        }
        let links = contacts.iter().map(|&[a, b]| Some([node[a as usize].number()?, node[b as usize].number()?]));
        let links = links.flatten().collect();
        (node, links)
    }

    proptest! {
        #![proptest_config(crate::testing::cases(64))]
        #[test]
        fn batches_share_nothing_and_leave_nothing_out((bodies, contacts) in any_contacts(), sleep: bool) {
            let (nodes, links) = number(bodies, &contacts);
            let count = nodes.iter().filter_map(|node| node.number()).count();
            let mut islands = Islands::default();
            let largest = islands.find(IslandSearch::UnionFind, count, &links, Team::ALONE).largest;
            let roots = islands.roots();
            let asleep: Vec<bool> = (0..count).map(|root| root % 3 == 0).collect();
            let sleeps = sleep.then_some(&asleep[..]);
            let ghosts = count - count / 8..count;
            let graph = Graph { contacts: &contacts, roots, largest, ghosts, sent: &[2], sleeps, keeps_rows: false };
            for parallel in [Parallel::Serial, Parallel::Islands, Parallel::Coloring, Parallel::Auto] {
                for team in [Team::ALONE, Team::of_pool()] {
                    let mut batches = Batches::default();
                    let place = batches.divide(graph.clone(), nodes.clone(), parallel, team);
                    let mut solved = vec![false; contacts.len()];
                    let mut next = (0, 0);
                    for batch in &batches.all {
                        prop_assert_eq!((batch.contacts.start, batch.bodies.start), next);
                        next = (batch.contacts.end, batch.bodies.end);
                        prop_assert_eq!(batch.bodies.len() % LANES, 0);
                        let own = &batches.contacts[batch.contacts.clone()];
                        prop_assert!(own.is_sorted(), "not in canonical order");
                        for &contact in own {
                            solved[contact as usize] = true;
                            for body in contacts[contact as usize] {
                                let place = place[body as usize].get();
                                let moving = batch.bodies.start + batch.statics as usize..batch.bodies.end;
                                prop_assert!(body < 2 || moving.contains(&place), "a body in another batch");
                            }
                        }
                    }
                    for (contact, solved) in contacts.iter().zip(solved) {
                        let node = contact.iter().find_map(|&body| nodes[body as usize].number());
                        let root = roots[node.expect("one moves") as usize];
                        prop_assert_eq!(solved, !(sleep && asleep[root as usize]));
                    }
                    let solved = |place: &SolverIndex| ![SolverIndex::STATIC, SolverIndex::NOT_SOLVED].contains(place);
                    let mut places: Vec<_> = place.into_iter().filter(solved).collect();
                    places.sort_unstable();
                    prop_assert!(places.windows(2).all(|pair| pair[0] < pair[1]), "two bodies at one place");
                }
            }
        }
    }
}
