//! Sleeping: islands that rest are left out until something touches them.
//!
//! A body rests while its fastest point is slower than `sleep_speed`, and than who falls will be in half of `sleep_time`. An
//! island has rested as long as the one of its bodies that has rested least, and so has each of them from then on: who loses a support that was struck away must
//! rest anew. An island sleeps once it has rested for `sleep_time`; decided before each solve, on the step's contacts.
//! Whatever comes to touch it makes one larger island, which is awake as the newcomer is. A body without contacts is an
//! island of its own. Sleeping bodies have no velocity, feel no gravity, and keep their contacts with
//! their impulses, so that they wake as they fell asleep. Source: islands that sleep as in Box2D (E. Catto); here they
//! are found anew each step, so nothing has to be kept in order.
//!
//! An island may lie in several tiles. Each decides about its own part, in which ghosts rest as their owners said of them: who
//! moves anywhere in an island is heard of at once in the tiles that have it as a ghost, and from there on one tile further
//! with each step. Time counts on meanwhile, so of an island that spans more tiles than `sleep_time` has steps, those parts
//! sleep that are so many tiles from whoever moves. What a sleeper leans on in another tile may be struck, wake, and be gone before its own tile
//! hears of it: so whoever leaned on a ghost that is awake, or is gone, wakes.

use crate::model::id::GlobalId;
use crate::model::math;
use crate::solver::index::GraphNode;
use crate::tiling::blueprint::Setup;
use glam::Vec2;
use rustc_hash::FxHashMap;

/// Who rests since when. Empty where nobody may sleep.
#[derive(Clone, Default, Debug)]
pub(crate) struct Sleep {
    /// For each owned body how long it has rested, in seconds: `sleep_time` at most.
    still: Vec<f32>,
    /// For each ghost how long it had rested when its owner last said so, in seconds.
    ghosts: Vec<f32>,
    /// Owned bodies that have rested for long enough, each with a ghost that they touched in the last step.
    leaning: Vec<Leaning>,
    /// For each owned body whether its island sleeps.
    asleep: Vec<bool>,
    /// For each node of the contact graph that is the lowest of its island, how long that has rested, in seconds, and
    /// whether it sleeps.
    rested: Vec<f32>,
    islands: Vec<bool>,
}

/// An owned body that touched a ghost in the last step.
#[derive(Clone, Copy, Debug)]
struct Leaning {
    /// Its name, and where among the tile's bodies it was.
    id: GlobalId,
    was: usize,
    ghost: GlobalId,
}

impl Sleep {
    /// Bodies that have rested for so many seconds. Who of them sleeps is decided in the next step, as in every step.
    pub(crate) fn of(still: Vec<f32>) -> Self {
        let asleep = vec![false; still.len()];
        Self { still, asleep, ..Self::default() }
    }

    /// For each owned body whether it sleeps; empty where nobody may.
    pub(crate) fn asleep(&self) -> &[bool] {
        &self.asleep
    }

    /// For each owned body how long it has rested, in seconds; empty where nobody may sleep.
    pub(crate) fn still(&self) -> &[f32] {
        &self.still
    }

    /// For each ghost how long it had rested when its owner last said so, in seconds.
    pub(crate) fn ghosts(&self) -> &[f32] {
        &self.ghosts
    }

    /// How long one of the tile's bodies has rested that is no static: owned ones come first. Zero where nobody may sleep.
    pub(crate) fn rested(&self, body: usize, owned: usize) -> f32 {
        let rested = if body < owned { self.still.get(body) } else { self.ghosts.get(body - owned) };
        rested.copied().unwrap_or_default()
    }

    /// Forgets who leaned on whom.
    pub(crate) fn forget_leaning(&mut self) {
        self.leaning.clear();
    }

    /// An owned body that has rested for long enough, known by name and place, touched a ghost in the last step.
    pub(crate) fn lean(&mut self, (id, was): (GlobalId, usize), ghost: GlobalId) {
        self.leaning.push(Leaning { id, was, ghost });
    }

    /// Wakes those that leaned on a ghost which has rested less, or is gone. `ids` are those of the tile's owned bodies, then of its
    /// ghosts; `newcomers` the places of those that were given to it in this step.
    pub(crate) fn wake_leaning(&mut self, ids: &[GlobalId], newcomers: &[u32]) {
        if self.leaning.is_empty() {
            return;
        }
        let owned = self.still.len();
        let ghosts = ids[owned..].iter().copied().zip(self.ghosts.iter().copied());
        let came = newcomers.iter().map(|&place| (ids[place as usize], self.still[place as usize]));
        let rested: FxHashMap<GlobalId, f32> = ghosts.chain(came).collect();
        for Leaning { id, was, ghost } in self.leaning.drain(..) {
            let is_there = ids[..owned].get(was) == Some(&id);
            let place = if is_there { Some(was) } else { ids[..owned].iter().position(|&other| other == id) };
            if let Some(place) = place {
                let ghost = rested.get(&ghost).copied().unwrap_or_default();
                self.still[place] = math::min(self.still[place], ghost);
            }
        }
    }

    /// Forgets how long ghosts have rested.
    pub(crate) fn clear_ghosts(&mut self) {
        self.ghosts.clear();
    }

    /// There is one ghost more, which has rested for so many seconds.
    pub(crate) fn push_ghost(&mut self, rested: f32) {
        self.ghosts.push(rested);
    }

    /// A body that has rested for so many seconds takes the place of another, or the one behind the last.
    pub(crate) fn set(&mut self, place: usize, rested: f32) {
        match self.still.get_mut(place) {
            Some(still) => *still = rested,
            None => self.still.push(rested),
        }
    }

    /// Whether all owned bodies, of which there are so many, have rested for long enough.
    pub(crate) fn all_rest(&self, owned: usize, setup: &Setup) -> bool {
        let rests = |all: bool, &still: &f32| all & (still >= setup.params.sleep_time);
        setup.params.sleep && self.still.len() == owned && self.still.iter().fold(true, rests)
    }

    /// Makes room for bodies that were added; these have not rested yet.
    pub(crate) fn resize(&mut self, owned: usize) {
        self.still.resize(owned, 0.0);
        self.asleep.resize(owned, false);
    }

    /// Forgets all bodies but those whose place is to stay.
    pub(crate) fn retain(&mut self, stays: impl Fn(usize) -> bool) {
        let mut places = 0..;
        self.still.retain(|_| places.next().is_some_and(&stays));
        let mut places = 0..;
        self.asleep.retain(|_| places.next().is_some_and(&stays));
    }

    /// Has a body rest anew, if it is known how long it has rested, and with it its island.
    pub(crate) fn wake(&mut self, index: usize) {
        if let Some(still) = self.still.get_mut(index) {
            *still = 0.0;
        }
    }

    pub(crate) fn wake_all(&mut self) {
        self.still.fill(0.0);
    }

    /// Follows the bodies to a new order: the one at `order[i]` comes to `i`.
    pub(crate) fn permute(&mut self, order: &[u32]) {
        if !self.still.is_empty() {
            // Bodies may have been added since.
            self.resize(order.len());
            self.still = order.iter().map(|&from| self.still[from as usize]).collect();
            self.asleep = order.iter().map(|&from| self.asleep[from as usize]).collect();
        }
    }

    /// For each node that is the lowest of its island whether that sleeps, as was decided last.
    pub(crate) fn islands(&self) -> &[bool] {
        &self.islands
    }

    /// Decides which islands sleep. `nodes` gives for each body what it is in the graph of contacts, `roots` for each node
    /// the lowest of its island. Takes the velocity of those that sleep. Returns how many bodies do.
    pub(crate) fn decide(
        &mut self,
        nodes: &[GraphNode],
        roots: &[u32],
        velocity: &mut [Vec2],
        angular_velocity: &mut [f32],
        setup: &Setup,
    ) -> u64 {
        let root_of = |node: GraphNode| node.number().map(|number| roots[number as usize] as usize);
        self.rested.clear();
        self.rested.resize(roots.len(), f32::INFINITY);
        for (&node, &still) in nodes.iter().zip(self.still.iter().chain(&self.ghosts)) {
            if let Some(root) = root_of(node) {
                self.rested[root] = math::min(still, self.rested[root]);
            }
        }
        self.islands.clear();
        self.islands.extend(self.rested.iter().map(|&rested| rested >= setup.params.sleep_time));
        let mut count = 0;
        for (i, asleep) in self.asleep.iter_mut().enumerate() {
            if let Some(root) = root_of(nodes[i]) {
                self.still[i] = self.rested[root];
            }
            *asleep = self.still[i] >= setup.params.sleep_time;
            if *asleep {
                (velocity[i], angular_velocity[i]) = (Vec2::ZERO, 0.0);
                count += 1;
            }
        }
        count
    }

    /// Counts on for those that rest, as they are slow.
    pub(crate) fn count_on(&mut self, rests: impl Fn(usize) -> bool, setup: &Setup) {
        for (i, still) in self.still.iter_mut().enumerate().filter(|&(i, _)| !self.asleep[i]) {
            let longer = math::min(*still + setup.params.dt, setup.params.sleep_time);
            *still = if rests(i) { longer } else { 0.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::params::Params;
    use crate::tiling::blueprint::Blueprint;
    use crate::tiling::partition::Partition;
    use glam::DVec2;

    #[test]
    fn an_island_rests_as_long_as_its_least_rested_body() {
        let partition = Partition::uniform(DVec2::ZERO, DVec2::ONE, 1, 1).unwrap();
        let params = Params { sleep: true, ..Params::default() };
        let setup = Setup::new(&Blueprint { params, partition, kinds: Vec::new(), statics: Vec::new() }).unwrap();
        let mut sleep = Sleep { still: vec![9.0, 0.1, 9.0, 9.0], asleep: vec![true; 4], ..Sleep::default() };
        let mut decide = |nodes: [Option<u32>; 4], roots: &[u32]| {
            let nodes = nodes.map(|node| node.map_or(GraphNode::NO_CONTACT, GraphNode::new));
            let count = sleep.decide(&nodes, roots, &mut [Vec2::ONE; 4], &mut [1.0; 4], &setup);
            (sleep.islands.clone(), count, sleep.asleep.clone(), sleep.still.clone())
        };
        // The first two touch each other, the third something that never moves, the last nothing.
        let (islands, count, asleep, still) = decide([Some(0), Some(1), Some(2), None], &[0, 0, 2]);
        assert_eq!((islands[0], islands[2], count), (false, true, 2));
        assert_eq!((asleep, still), (vec![false, false, true, true], vec![0.1, 0.1, 9.0, 9.0]));
        // Once apart, the first must rest anew by itself.
        let (_, _, asleep, _) = decide([None, None, Some(0), None], &[0]);
        assert_eq!(asleep, [false, false, true, true]);
    }
}
