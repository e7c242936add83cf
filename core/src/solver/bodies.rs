//! The bodies a solver works on: those with contacts, compacted.

use super::batches::{Batch, Batches, Graph};
use super::index::{GraphNode, SolverIndex, forget};
use crate::collide::broad_phase::Pair;
use crate::collide::narrow_phase::Contacts;
use crate::exchange::record::{GhostRefresh, Unseen};
use crate::model::body::Bodies;
use crate::model::contact::Contact;
use crate::model::kind::KindRow;
use crate::model::math::{Rot, dot, max, right_perp, turn};
use crate::model::params::{Ghosts, Parallel};
use crate::parallel::lanes::{Kernel, LANES, LaneSet, Lanes, Quad};
use crate::parallel::team::Team;
use crate::parallel::vectors::absolute;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::Vec2;

/// The root of how much heavier a frozen ghost is made than it is. With mass-weighted velocities infinity cannot be
/// written down; this leaves 1e-12 of what an impulse would do, and that is taken back in every substep.
const FROZEN: f32 = 1_048_576.0;

/// The contacts with statics whose surface moves: which, the static, and who touches it.
fn carrying<'a>(tile: &'a Tile, contacts: &'a [Pair], setup: &'a Setup) -> impl Iterator<Item = (u32, u32, u32)> + 'a {
    let dynamic = (tile.owned + tile.ghosts()) as u32;
    let sides = (0..).zip(contacts).flat_map(|(contact, &[a, b])| [(contact, a, b), (contact, b, a)]);
    sides.filter(move |&(_, body, _)| body >= dynamic && setup.drives(tile.bodies.kind[body as usize]))
}

/// Bodies with contacts, batch by batch, in the order of the tile's bodies within each.
#[derive(Default, Debug)]
pub(crate) struct SolverBodies {
    /// Velocity x, y and angular velocity, mass-weighted; the root of the inverse mass, less than zero for a round body.
    pub(crate) velocity: Vec<Quad>,
    /// Displacement x, y of the step so far, mass-weighted; of its rotation what the cosine lacks of one, and the sine, times the root of
    /// the inertia.
    pub(crate) pose: Vec<Quad>,
    /// Velocity in this substep before any impulse of a contact: what contacts did is the difference, and the next
    /// substep's warm start.
    pub(crate) start: Vec<Quad>,
    /// Roots of mass, inertia, inverse inertia, inverse mass.
    pub(crate) weight: Vec<Quad>,
    /// How each moves by itself ([`Dynamics::factors`](crate::model::kind::Dynamics::factors)); empty where all do alike.
    pub(crate) factors: Vec<Quad>,
    /// Ghosts, and what moves statics' surfaces, in the order of these bodies.
    pub(crate) ghosts: Vec<Ghost>,
    /// For each body of the tile, and then each carrier, what it is in the graph of contacts; empty once that is made into `index`.
    node: Vec<GraphNode>,
    /// For each body of the tile, and then each carrier, which of these it is; empty while it has a `node`.
    index: Vec<SolverIndex>,
    /// One for each contact of a static whose surface moves with a body, ascending.
    carriers: Vec<Carrier>,
    /// Contacts between bodies that move, as nodes: bodies with contacts, in the order of the tile.
    links: Vec<Pair>,
    /// For each node which body of the tile it is.
    touched: Vec<u32>,
    /// The first node that is a ghost.
    pub(crate) first_ghost: usize,
    frozen: bool,
}

/// The bodies of some batches that lie in order, or of one of them.
pub(crate) struct Parts<'a> {
    /// Where the first of them is.
    first: usize,
    pub(crate) velocity: &'a mut [Quad],
    pub(crate) pose: &'a mut [Quad],
    pub(crate) start: &'a mut [Quad],
    pub(crate) weight: &'a [Quad],
    /// Empty where all move alike by themselves.
    pub(crate) factors: &'a [Quad],
    pub(crate) ghosts: &'a [Ghost],
}

impl<'a> Parts<'a> {
    /// Takes the bodies of a batch out. What lies before them is passed over.
    pub(crate) fn split_off(&mut self, batch: &Batch) -> Self {
        const IN_ORDER: &str = "batches lie in order";
        let (skipped, count) = (batch.bodies.start - self.first, batch.bodies.len());
        self.first = batch.bodies.end;
        let take = |column: &mut &'a mut [Quad]| {
            column.split_off_mut(..skipped).expect(IN_ORDER);
            column.split_off_mut(..count).expect(IN_ORDER)
        };
        let take_fixed = |column: &mut &'a [Quad]| {
            column.split_off(..skipped).expect(IN_ORDER);
            column.split_off(..count).expect(IN_ORDER)
        };
        let before = |ghosts: &[Ghost], place: usize| ghosts.partition_point(|ghost| ghost.place.get() < place);
        self.ghosts.split_off(..before(self.ghosts, batch.bodies.start)).expect(IN_ORDER);
        let own_ghosts = before(self.ghosts, batch.bodies.end);
        Self {
            first: batch.bodies.start,
            velocity: take(&mut self.velocity),
            pose: take(&mut self.pose),
            start: take(&mut self.start),
            weight: take_fixed(&mut self.weight),
            factors: if self.factors.is_empty() { &[] } else { take_fixed(&mut self.factors) },
            ghosts: self.ghosts.split_off(..own_ghosts).expect(IN_ORDER),
        }
    }
}

/// A body of the solver whose velocity is given from outside, or a part of it: a ghost, a [`Carrier`], or one that a force pushes at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ghost {
    pub(crate) place: SolverIndex,
    /// What it is given in every substep, mass-weighted; its velocity in the first, if it is held.
    pub(crate) given: [f32; 3],
    /// The part of that which is by forces; how much faster it is from each substep to the next, if it is held.
    pub(crate) gain: [f32; 3],
    /// Whether nothing else moves it.
    pub(crate) held: bool,
}

/// Stands for a static whose surface moves, in one of its contacts: a body of a velocity that no impulse changes. One for each contact,
/// as bodies that share one could not be solved side by side, and would be one island.
#[derive(Clone, Copy, Debug)]
struct Carrier {
    contact: u32,
    /// The static, among the bodies of the tile.
    body: u32,
    /// Who touches it, as a node of the graph.
    partner: u32,
}

/// The roots of the mass and the inertia of a carrier: so large that nothing is left of what an impulse does to its velocity.
const CARRIER: f32 = (1_u64 << 50) as f32;

/// More than the root of a carrier's inverse mass, less than that of any body.
pub(crate) const LIGHTEST: f32 = 2.0 / CARRIER;

const ZERO: Quad = [0.0; 4];

/// What is added to the velocity of a static that turns, in m/s, for a disc that lies on it and goes around with it, so that it leads along
/// the chord of the step's arc and not along the tangent. On the tangent the disc comes out slower than what carries it, and friction makes
/// spin of that. Bodies that are not round turn with what they lie on, and need none of it; what is round itself stays where it is as it
/// turns. Of two bodies the static is the first; the arm leads from its center to the disc's, `outward` out of its surface.
fn drawn_in(bodies: &Bodies, [of, disc]: [usize; 2], arm: Vec2, outward: Vec2, setup: &Setup) -> Option<Vec2> {
    /// How fast the disc goes along the static, as a part of how fast it is carried.
    const MOST_SLIP: f32 = 0.25;
    /// How far the static may turn in a step, in rad.
    const MOST_ANGLE: f32 = 0.25;
    let spin = bodies.angular_velocity[of];
    let angle = spin * setup.params.dt;
    let [from, around] = [of, disc].map(|body| setup.kind(bodies.kind[body]));
    if spin == 0.0 || angle.abs() > MOST_ANGLE || around.not_round > 0.0 || from.not_round == 0.0 {
        return None;
    }
    let carried = turn(spin, arm);
    let slip = bodies.velocity[disc] - bodies.velocity[of] - carried;
    // Who lies comes nearer by half of what the surface turns away by, or, before he was drawn in, by all of it or nothing.
    let (nearer, away) = (-dot(slip, outward), 1.1 * carried.length() * angle.abs());
    let lies = (-0.1 * away..=away).contains(&nearer);
    let may_bounce =
        away > setup.params.restitution_threshold && [from, around].iter().any(|kind| kind.material.restitution > 0.0);
    if may_bounce || !lies || slip.length_squared() > MOST_SLIP * MOST_SLIP * carried.length_squared() {
        return None;
    }
    // (1 - cos)/angle and sin/angle - 1, as far as it matters. Separations know of the sine.
    let (inward, back) = (angle * (0.5 - angle * angle / 24.0), carried * (-angle * angle / 6.0));
    Some(back - outward * dot(back, outward) - arm * (spin * inward))
}

/// The root of a body's inverse mass, less than zero for a round one.
fn marked(root_inv_mass: f32, kind: &KindRow) -> f32 {
    if kind.not_round > 0.0 { root_inv_mass } else { -root_inv_mass }
}

impl SolverBodies {
    /// For each batch to take its own.
    pub(crate) fn parts(&mut self) -> Parts<'_> {
        let Self { velocity, pose, start, weight, factors, ghosts, .. } = self;
        Parts { first: 0, velocity, pose, start, weight, factors, ghosts }
    }

    /// Numbers the bodies that have contacts: the nodes of the contact graph.
    pub(crate) fn number(&mut self, tile: &Tile, contacts: &[Pair], setup: &Setup) {
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
        self.carriers.clear();
        if setup.any_drives() {
            self.number_carriers(tile, contacts, setup);
        }
    }

    /// Carriers are nodes behind all others, known by places behind all bodies of the tile.
    fn number_carriers(&mut self, tile: &Tile, contacts: &[Pair], setup: &Setup) {
        for (contact, body, other) in carrying(tile, contacts, setup) {
            let partner = self.node[other as usize].number().expect("one of a contact's bodies moves");
            self.node.push(GraphNode::new((self.touched.len() + self.carriers.len()) as u32));
            self.carriers.push(Carrier { contact, body, partner });
        }
    }

    /// Whether the carriers of these contacts are those that were numbered: another tile may have as many bodies, and contacts of the
    /// same, and yet other statics.
    pub(crate) fn has_carriers_of(&self, tile: &Tile, contacts: &[Pair], setup: &Setup) -> bool {
        let known = self.carriers.iter().map(|carrier| (carrier.contact, carrier.body));
        !setup.any_drives() || carrying(tile, contacts, setup).map(|(contact, body, _)| (contact, body)).eq(known)
    }

    /// Who touches a static whose surface moves: as nodes, one for each carrier, which belongs to their islands.
    pub(crate) fn carried(&self) -> impl Iterator<Item = u32> + '_ {
        self.carriers.iter().map(|carrier| carrier.partner)
    }

    /// The body of the tile that a node is.
    pub(crate) fn body_of(&self, node: u32) -> u32 {
        self.touched[node as usize]
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
    pub(crate) fn load(&mut self, tile: &Tile, contacts: &Contacts, batches: &Batches, setup: &Setup, step: u64) {
        let total = batches.all.last().map_or(0, |batch| batch.bodies.end);
        for column in [&mut self.velocity, &mut self.pose, &mut self.start, &mut self.weight] {
            column.clear();
            column.resize(total, ZERO);
        }
        self.factors.clear();
        if !setup.factors.is_empty() {
            self.factors.resize(total, ZERO);
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
            let root_inv_mass = kind.root_inv_mass / scale;
            self.velocity[place.get()] = [velocity[0], velocity[1], velocity[2], marked(root_inv_mass, kind)];
            self.weight[place.get()] = [root_mass, root_inertia, kind.root_inv_inertia / scale, root_inv_mass];
            if let Some(&factors) = setup.factors.get(bodies.kind[i].0 as usize) {
                self.factors[place.get()] = factors;
            }
            let pushed = tile.gain(i).map(|[x, y, spin]| [x * root_mass, y * root_mass, spin * root_inertia]);
            if i >= tile.owned {
                let pushed = pushed.unwrap_or_default();
                let given =
                    if self.frozen { velocity } else { self.given(place, &tile.unseen[i - tile.owned], pushed) };
                self.ghosts.push(Ghost {
                    place,
                    given,
                    gain: if self.frozen { [0.0; 3] } else { pushed },
                    held: self.frozen,
                });
            } else if let Some(pushed) = pushed {
                self.ghosts.push(Ghost { place, given: pushed, gain: pushed, held: false });
            }
        }
        self.load_carriers(tile, contacts, setup, step);
        self.ghosts.sort_unstable_by_key(|ghost| ghost.place);
    }

    /// A carrier goes as its static does, in each substep as that does then and over all as far; where that is a belt, along the contact as
    /// well, which the separation does not show.
    fn load_carriers(&mut self, tile: &Tile, contacts: &Contacts, setup: &Setup, step: u64) {
        let bodies = &tile.bodies;
        let later = 0.5 * (setup.params.integrations() - 1) as f32;
        for (&Carrier { contact, body, .. }, &place) in self.carriers.iter().zip(&self.index[bodies.len()..]) {
            if place == SolverIndex::NOT_SOLVED {
                continue;
            }
            let [first, second] = contacts.bodies[contact as usize];
            let Contact { normal, offset, .. } = tile.contacts.contacts[contact as usize];
            let (outward, arm, other) =
                if first == body { (normal, offset, second) } else { (-normal, -offset, first) };
            let i = body as usize;
            let kind = setup.kind(bodies.kind[i]);
            let runs = right_perp(outward) * kind.material.surface_speed;
            let velocity = bodies.velocity[i] + runs;
            let row = tile.statics.get(i - tile.owned - tile.ghosts()).copied();
            let row = row.or_else(|| setup.row_of_going(bodies.id[i]));
            let faster = row.map_or(Vec2::ZERO, |row| setup.acceleration_at(row, step)) * setup.params.substep();
            let velocity = if faster == Vec2::ZERO { velocity } else { velocity - faster * later };
            let drawn_in = drawn_in(bodies, [i, other as usize], arm, outward, setup);
            let velocity = drawn_in.map_or(velocity, |more| velocity + more);
            let given = [velocity.x, velocity.y, bodies.angular_velocity[i]].map(|speed| speed * CARRIER);
            let gain = [faster.x, faster.y, 0.0].map(|speed| speed * CARRIER);
            let root_inv_mass = if drawn_in.is_some() { -1.0 / CARRIER } else { marked(1.0 / CARRIER, kind) };
            self.velocity[place.get()] = [given[0], given[1], given[2], root_inv_mass];
            self.weight[place.get()] = [CARRIER, CARRIER, 1.0 / CARRIER, 1.0 / CARRIER];
            self.ghosts.push(Ghost { place, given, gain, held: true });
        }
    }

    /// What the roots of a body's masses are multiplied by.
    #[inline(always)]
    pub(crate) fn weight_scale(&self, tile: &Tile, body: u32) -> f32 {
        let body = body as usize;
        if self.frozen && body >= tile.owned && body < tile.owned + tile.ghosts() { FROZEN } else { 1.0 }
    }

    /// Mass-weighted, what a ghost is given per substep.
    fn given(&self, place: SolverIndex, unseen: &Unseen, pushed: [f32; 3]) -> [f32; 3] {
        let [_, _, root_inv_inertia, root_inv_mass] = self.weight[place.get()];
        [
            unseen.linear.x * root_inv_mass + pushed[0],
            unseen.linear.y * root_inv_mass + pushed[1],
            unseen.angular * root_inv_inertia + pushed[2],
        ]
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
        let ghost = self.ghost_at(place).expect("only ghosts are refreshed");
        self.ghosts[ghost].given = self.given(place, &refresh.unseen, self.ghosts[ghost].gain);
    }

    /// Whether a body with a contact is solved: not if it sleeps.
    pub(crate) fn is_solved(&self, body: u32) -> bool {
        self.place_of(body) != SolverIndex::NOT_SOLVED
    }

    /// Mass-weighted velocity and pose of a body that is solved, as another tile's ghost takes them over.
    pub(crate) fn state_of(&self, body: u32) -> ([f32; 3], Quad) {
        let place = self.place_of(body).get();
        let [x, y, w, _] = self.velocity[place];
        ([x, y, w], self.pose[place])
    }

    /// How far a body of the tile has gone in the step, in m, and how far its turning took what is one meter from its center, if it is
    /// solved.
    pub(crate) fn moved(&self, body: usize) -> Option<(Vec2, f32)> {
        let place = self.index[body];
        let moved = |place: SolverIndex| {
            let [x, y, lost, s] = self.pose[place.get()];
            let [.., root_inv_inertia, root_inv_mass] = self.weight[place.get()];
            (Vec2::new(x, y) * root_inv_mass, (lost * lost + s * s).sqrt() * root_inv_inertia)
        };
        (place != SolverIndex::NOT_SOLVED).then(|| moved(place))
    }

    /// Moves one of these on for so many seconds, by what its velocity has become since it was that.
    pub(crate) fn go_on(&mut self, place: usize, before: Quad, time: f32) {
        let ([vx, vy, w, _], [_, root_inertia, root_inv_inertia, _]) = (self.velocity[place], self.weight[place]);
        let [x, y, lost, s] = &mut self.pose[place];
        *x += (vx - before[0]) * time;
        *y += (vy - before[1]) * time;
        let turned = Rot { c: 1.0 - *lost * root_inv_inertia, s: *s * root_inv_inertia };
        let turned = Rot::from_angle((w - before[2]) * root_inv_inertia * time).after(turned);
        (*lost, *s) = ((1.0 - turned.c) * root_inertia, turned.s * root_inertia);
    }

    /// How far any has gone in the step, in m, or what is so many meters from its center has, at most.
    pub(crate) fn furthest(&self, arm: f32, lanes: LaneSet) -> f32 {
        lanes.run(Furthest { pose: &self.pose, weight: &self.weight, arm })
    }

    /// Those bodies of the tile that have contacts and are its own, ascending.
    pub(crate) fn owned(&self) -> &[u32] {
        &self.touched[..self.first_ghost]
    }

    /// Whether there are any that stand for statics whose surface moves.
    #[inline(always)]
    pub(crate) fn have_carriers(&self) -> bool {
        !self.carriers.is_empty()
    }

    /// Which of these the bodies of a contact are, given their places: of a static whose surface moves, the one that carries there.
    #[cold]
    pub(crate) fn carried_in(&self, contact: u32, places: [SolverIndex; 2]) -> [SolverIndex; 2] {
        if !places.contains(&SolverIndex::STATIC) {
            return places;
        }
        let Some(carrier) = self.carrier_in(contact) else { return places };
        places.map(|place| if place == SolverIndex::STATIC { carrier } else { place })
    }

    /// How much faster the static of a contact gets from each substep to the next, in m/s.
    pub(crate) fn static_gain_in(&self, contact: u32) -> Vec2 {
        let Some(ghost) = self.carrier_in(contact).and_then(|place| self.ghost_at(place)) else { return Vec2::ZERO };
        let [x, y, _] = self.ghosts[ghost].gain;
        Vec2::new(x, y) / CARRIER
    }

    fn ghost_at(&self, place: SolverIndex) -> Option<usize> {
        self.ghosts.binary_search_by_key(&place, |ghost| ghost.place).ok()
    }

    fn carrier_in(&self, contact: u32) -> Option<SolverIndex> {
        let found = self.carriers.binary_search_by_key(&contact, |carrier| carrier.contact);
        found.ok().map(|found| self.index[self.index.len() - self.carriers.len() + found])
    }

    /// Which of these a body of the tile is.
    #[inline(always)]
    pub(crate) fn place_of(&self, body: u32) -> SolverIndex {
        self.index[body as usize]
    }
}

/// Looks for [how far](SolverBodies::furthest) any has gone.
struct Furthest<'a> {
    pose: &'a [Quad],
    weight: &'a [Quad],
    arm: f32,
}

impl Kernel for Furthest<'_> {
    type Output = f32;

    #[inline(always)]
    fn run<V: Lanes>(self) -> f32 {
        let (mut furthest, arm) = (V::splat(0.0), V::splat(self.arm));
        let ((poses, rest), (weights, rest_weights)) = (self.pose.as_chunks(), self.weight.as_chunks());
        let (mut last, mut last_weights) = ([ZERO; LANES], [ZERO; LANES]);
        last[..rest.len()].copy_from_slice(rest);
        last_weights[..rest.len()].copy_from_slice(rest_weights);
        for (pose, weight) in poses.iter().zip(weights).chain([(&last, &last_weights)]) {
            let [x, y, lost, s] = V::load_quads(pose);
            let [_, _, root_inv_inertia, root_inv_mass] = V::load_quads(weight);
            let turned = absolute(lost).add(absolute(s)).mul(root_inv_inertia);
            let way = absolute(x).add(absolute(y)).mul(root_inv_mass).add(arm.mul(turned));
            furthest = way.max(furthest);
        }
        let mut ways = [0.0; LANES];
        furthest.store(&mut ways);
        ways.into_iter().fold(0.0, max)
    }
}
