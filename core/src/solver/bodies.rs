//! The bodies a solver works on: those with contacts, compacted.

use super::batches::{Batches, Graph};
use super::index::{GraphNode, SolverIndex, forget};
use crate::collide::broad_phase::Pair;
use crate::exchange::record::{GhostRefresh, Unseen};
use crate::model::params::{Ghosts, Parallel};
use crate::parallel::lanes::Quad;
use crate::parallel::team::Team;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::Vec2;

/// The root of how much heavier a frozen ghost is made than it is. With mass-weighted velocities infinity cannot be
/// written down; this leaves 1e-12 of what an impulse would do, and that is taken back in every substep.
const FROZEN: f32 = 1_048_576.0;

/// Bodies with contacts, batch by batch, in the order of the tile's bodies within each.
#[derive(Default, Debug)]
pub(crate) struct SolverBodies {
    /// Velocity x, y and angular velocity, mass-weighted; one unused.
    pub(crate) velocity: Vec<Quad>,
    /// Displacement x, y of the step so far, mass-weighted; of its rotation the cosine less one, and the sine times the
    /// root of the inertia.
    pub(crate) pose: Vec<Quad>,
    /// Velocity in this substep before any impulse of a contact: what contacts did is the difference, and the next
    /// substep's warm start.
    pub(crate) start: Vec<Quad>,
    /// Roots of mass, inertia, inverse inertia, inverse mass.
    pub(crate) weight: Vec<Quad>,
    /// Ghosts, in the order of these bodies.
    pub(crate) ghosts: Vec<Ghost>,
    /// For each body of the tile what it is in the graph of contacts; empty once that is made into `index`.
    node: Vec<GraphNode>,
    /// For each body of the tile which of these it is; empty while it has a `node`.
    index: Vec<SolverIndex>,
    /// Contacts between bodies that move, as nodes: bodies with contacts, in the order of the tile.
    links: Vec<Pair>,
    /// For each node which body of the tile it is.
    touched: Vec<u32>,
    /// The first node that is a ghost.
    pub(crate) first_ghost: usize,
    pub(crate) frozen: bool,
}

/// A ghost among the solver's bodies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ghost {
    pub(crate) place: SolverIndex,
    /// What it is given in every substep, mass-weighted; its velocity, if it is frozen.
    pub(crate) given: [f32; 3],
}

const ZERO: Quad = [0.0; 4];

impl SolverBodies {
    /// Numbers the bodies that have contacts: the nodes of the contact graph.
    pub(crate) fn number(&mut self, tile: &Tile, contacts: &[Pair]) {
        let dynamic = tile.owned + tile.ghosts();
        self.node = forget(std::mem::take(&mut self.index), tile.bodies.len());
        // Whoever has a contact is taken for a static, until it turns out to move.
        for &[a, b] in contacts {
            self.node[a as usize] = GraphNode::STATIC;
            self.node[b as usize] = GraphNode::STATIC;
        }
        // Every body is written down, and counted if it has a contact: a branch here would be a coin toss.
        self.touched.resize(dynamic, 0);
        let mut count = 0;
        for bodies in [0..tile.owned, tile.owned..dynamic] {
            self.first_ghost = count;
            for body in bodies {
                let node = &mut self.node[body];
                self.touched[count] = body as u32;
                let has_contact = *node == GraphNode::STATIC;
                *node = if has_contact { GraphNode::new(count as u32) } else { GraphNode::NO_CONTACT };
                count += usize::from(has_contact);
            }
        }
        self.touched.truncate(count);
        self.links.clear();
        for &[a, b] in contacts {
            if let (Some(a), Some(b)) = (self.node[a as usize].number(), self.node[b as usize].number()) {
                self.links.push([a, b]);
            }
        }
    }

    /// For each body of the tile what it is in the graph of contacts.
    pub(crate) fn nodes(&self) -> &[GraphNode] {
        &self.node
    }

    /// How many bodies have contacts, and which of them touch.
    pub(crate) fn graph(&self) -> (usize, &[Pair]) {
        (self.touched.len(), &self.links)
    }

    /// For each body of the tile which of these it is.
    pub(crate) fn places(&self) -> &[SolverIndex] {
        &self.index
    }

    /// Puts the islands of the graph into batches.
    pub(crate) fn arrange(&mut self, batches: &mut Batches, graph: Graph<'_>, parallel: Parallel, team: Team) {
        self.index = batches.divide(graph, std::mem::take(&mut self.node), parallel, team);
    }

    /// Takes in the bodies of the batches.
    pub(crate) fn load(&mut self, tile: &Tile, batches: &Batches, setup: &Setup) {
        let total = batches.all.last().map_or(0, |batch| batch.bodies.end);
        for column in [&mut self.velocity, &mut self.pose, &mut self.start, &mut self.weight] {
            column.clear();
            column.resize(total, ZERO);
        }
        self.ghosts.clear();
        self.frozen = setup.params.ghosts == Ghosts::Frozen;
        let bodies = &tile.bodies;
        for node in 0..self.touched.len() {
            let i = self.touched[node] as usize;
            let place = self.index[i];
            if place == SolverIndex::NOT_SOLVED {
                continue;
            }
            let kind = setup.kind(bodies.kind[i]);
            let scale = self.weight_scale(tile, i as u32);
            let (root_mass, root_inertia) = (kind.root_mass * scale, kind.root_inertia * scale);
            let velocity = bodies.velocity[i] * root_mass;
            let velocity = [velocity.x, velocity.y, bodies.angular_velocity[i] * root_inertia];
            self.velocity[place.get()] = [velocity[0], velocity[1], velocity[2], 0.0];
            self.weight[place.get()] =
                [root_mass, root_inertia, kind.root_inv_inertia / scale, kind.root_inv_mass / scale];
            if i >= tile.owned {
                let given = if self.frozen { velocity } else { self.given(place, &tile.unseen[i - tile.owned]) };
                self.ghosts.push(Ghost { place, given });
            }
        }
        self.ghosts.sort_unstable_by_key(|ghost| ghost.place);
    }

    /// What the roots of a body's masses are multiplied by.
    #[inline(always)]
    pub(crate) fn weight_scale(&self, tile: &Tile, body: u32) -> f32 {
        let body = body as usize;
        if self.frozen && body >= tile.owned && body < tile.owned + tile.ghosts() { FROZEN } else { 1.0 }
    }

    /// Mass-weighted, what a ghost is given per substep.
    fn given(&self, place: SolverIndex, unseen: &Unseen) -> [f32; 3] {
        let [_, _, root_inv_inertia, root_inv_mass] = self.weight[place.get()];
        [unseen.linear.x * root_inv_mass, unseen.linear.y * root_inv_mass, unseen.angular * root_inv_inertia]
    }

    /// Takes over a ghost's state from its owner, if it has a contact here. Its share of the next warm start stays this tile's own.
    pub(crate) fn refresh(&mut self, body: usize, refresh: &GhostRefresh) {
        let place = self.index[body];
        if place == SolverIndex::NOT_SOLVED {
            return;
        }
        let i = place.get();
        for (k, &velocity) in refresh.velocity.iter().enumerate() {
            let impulse = self.velocity[i][k] - self.start[i][k];
            self.velocity[i][k] = velocity;
            self.start[i][k] = velocity - impulse;
        }
        self.pose[i] = refresh.pose;
        let ghost = self.ghosts.binary_search_by_key(&place, |ghost| ghost.place).expect("only ghosts are refreshed");
        self.ghosts[ghost].given = self.given(place, &refresh.unseen);
    }

    /// Mass-weighted velocity and pose of a body with a contact, as another tile's ghost takes them over.
    pub(crate) fn state_of(&self, body: u32) -> ([f32; 3], Quad) {
        let place = self.place_of(body).get();
        let [x, y, w, _] = self.velocity[place];
        ([x, y, w], self.pose[place])
    }

    /// How far a body of the tile has gone in the step, in m, if it is solved.
    pub(crate) fn displacement(&self, body: usize) -> Option<Vec2> {
        let place = self.index[body];
        let moved = |place: SolverIndex| {
            let ([x, y, ..], [.., root_inv_mass]) = (self.pose[place.get()], self.weight[place.get()]);
            Vec2::new(x, y) * root_inv_mass
        };
        (place != SolverIndex::NOT_SOLVED).then(|| moved(place))
    }

    /// Which of these a body of the tile is.
    #[inline(always)]
    pub(crate) fn place_of(&self, body: u32) -> SolverIndex {
        self.index[body as usize]
    }
}
