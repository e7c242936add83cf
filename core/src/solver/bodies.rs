//! The bodies a solver works on: those with contacts, compacted; and the flight of the others.

use super::lanes::{Kernel, LANES, Lanes, Quad, Row, dispatch};
use crate::broad_phase::Pair;
use crate::halo::{GhostRefresh, Unseen};
use crate::id::GlobalId;
use crate::math::Rot;
use crate::setup::Setup;
use crate::tile::Tile;
use glam::{DVec2, Vec2};

/// The place of a body that has no contact.
pub(crate) const NOT_SOLVED: u32 = u32::MAX;

/// Bodies with contacts, in the order of the tile's bodies. The first stands for all statics and never moves.
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
    weight: Vec<Quad>,
    /// For each body of the tile its place here.
    place: Vec<u32>,
    /// The tile's body at each place.
    body: Vec<u32>,
    /// Places of the ghosts and what each is given per substep, mass-weighted.
    ghosts: Vec<(u32, [f32; 3])>,
}

const ZERO: Quad = [0.0; 4];

impl SolverBodies {
    /// Picks the bodies with contacts.
    pub(super) fn gather(&mut self, tile: &Tile, contacts: &[Pair], setup: &Setup) {
        let bodies = &tile.bodies;
        let dynamic = tile.owned + tile.ghosts();
        self.place.clear();
        self.place.resize(bodies.len(), NOT_SOLVED);
        for &[a, b] in contacts {
            self.place[a as usize] = 0;
            self.place[b as usize] = 0;
        }
        for column in [&mut self.velocity, &mut self.pose, &mut self.start, &mut self.weight] {
            column.clear();
            column.push(ZERO);
        }
        self.body.clear();
        self.body.push(NOT_SOLVED);
        self.ghosts.clear();
        for i in 0..dynamic {
            if self.place[i] == NOT_SOLVED {
                continue;
            }
            let place = self.body.len() as u32;
            self.place[i] = place;
            self.body.push(i as u32);
            let kind = setup.kind(bodies.kind[i]);
            let velocity = bodies.velocity[i] * kind.root_mass;
            self.velocity.push([velocity.x, velocity.y, bodies.angular_velocity[i] * kind.root_inertia, 0.0]);
            self.weight.push([kind.root_mass, kind.root_inertia, kind.root_inv_inertia, kind.root_inv_mass]);
            if i >= tile.owned {
                self.ghosts.push((place, [0.0; 3]));
                self.give_ghost(self.ghosts.len() - 1, &tile.unseen[i - tile.owned]);
            }
        }
        // Whole blocks of eight: the kernels need no remainder.
        let padded = self.body.len().next_multiple_of(LANES);
        for column in [&mut self.velocity, &mut self.pose, &mut self.start, &mut self.weight] {
            column.resize(padded, ZERO);
        }
    }

    /// Sets what a ghost is given per substep from now on.
    fn give_ghost(&mut self, ghost: usize, unseen: &Unseen) {
        let (place, given) = &mut self.ghosts[ghost];
        let [_, _, root_inv_inertia, root_inv_mass] = self.weight[*place as usize];
        *given = [unseen.linear.x * root_inv_mass, unseen.linear.y * root_inv_mass, unseen.angular * root_inv_inertia];
    }

    /// Takes over a ghost's state from its owner. Its share of the next warm start stays this tile's own.
    pub(crate) fn refresh(&mut self, body: usize, refresh: &GhostRefresh) {
        let place = self.place[body];
        if place == NOT_SOLVED {
            return;
        }
        let i = place as usize;
        for (k, &velocity) in refresh.velocity.iter().enumerate() {
            let impulse = self.velocity[i][k] - self.start[i][k];
            self.velocity[i][k] = velocity;
            self.start[i][k] = velocity - impulse;
        }
        self.pose[i] = refresh.pose;
        let ghost = self.ghosts.binary_search_by_key(&place, |ghost| ghost.0).expect("only ghosts are refreshed");
        self.give_ghost(ghost, &refresh.unseen);
    }

    /// Mass-weighted velocity and pose of a body with a contact, as another tile's ghost takes them over.
    pub(crate) fn state_of(&self, body: u32) -> ([f32; 3], Quad) {
        let place = self.index_of(body) as usize;
        let [x, y, w, _] = self.velocity[place];
        ([x, y, w], self.pose[place])
    }

    /// How many, whole blocks of eight.
    pub(super) fn len(&self) -> usize {
        self.velocity.len()
    }

    /// How many bodies that move.
    pub(crate) fn moving(&self) -> usize {
        self.body.len() - 1
    }

    /// The place of a body of the tile with a contact; 0 for a static.
    #[inline(always)]
    pub(crate) fn index_of(&self, body: u32) -> u32 {
        self.place[body as usize]
    }

    pub(super) fn integrate_velocities(&mut self, substep: u32, setup: &Setup) {
        let motion = Motion::new(setup);
        dispatch(IntegrateVelocities { bodies: self, motion, first: substep == 0 });
        for &(place, given) in &self.ghosts {
            for (k, given) in given.into_iter().enumerate() {
                self.start[place as usize][k] += given;
                self.velocity[place as usize][k] += given;
            }
        }
    }

    pub(super) fn integrate_positions(&mut self, setup: &Setup) {
        dispatch(IntegratePositions { bodies: self, h: setup.h });
    }
}

/// What moves a body in a substep, but contacts.
#[derive(Clone, Copy)]
struct Motion {
    h: f32,
    /// Velocity gained.
    gravity: Vec2,
    linear_damping: f32,
    angular_damping: f32,
    max_linear_speed: f32,
    max_angular_speed: f32,
}

impl Motion {
    fn new(setup: &Setup) -> Self {
        let (h, params) = (setup.h, &setup.params);
        Self {
            h,
            gravity: params.gravity * h,
            linear_damping: 1.0 / (1.0 + h * params.linear_damping),
            angular_damping: 1.0 / (1.0 + h * params.angular_damping),
            max_linear_speed: params.max_linear_speed,
            max_angular_speed: params.max_angular_speed,
        }
    }

    /// The velocities after the substep's outer forces. The roots of mass and inertia weigh them; ones do not.
    #[inline(always)]
    fn accelerate<V: Lanes>(&self, [vx, vy, w]: [V; 3], root_mass: V, root_inertia: V) -> [V; 3] {
        let one = V::splat(1.0);
        let damping = V::splat(self.linear_damping);
        let mut vx = vx.add(root_mass.mul(V::splat(self.gravity.x))).mul(damping);
        let mut vy = vy.add(root_mass.mul(V::splat(self.gravity.y))).mul(damping);
        if self.max_linear_speed < f32::INFINITY {
            let speed = vx.mul(vx).add(vy.mul(vy)).sqrt();
            let limit = V::splat(self.max_linear_speed).mul(root_mass);
            let scale = speed.sub(limit).if_positive(limit.div(speed), one);
            (vx, vy) = (vx.mul(scale), vy.mul(scale));
        }
        let mut w = w.mul(V::splat(self.angular_damping));
        if self.max_angular_speed < f32::INFINITY {
            let limit = V::splat(self.max_angular_speed).mul(root_inertia);
            w = w.min(limit).max(V::splat(0.0).sub(limit));
        }
        [vx, vy, w]
    }
}

/// A rotation turned on by a small angle, at length one again.
#[inline(always)]
fn turn_on<V: Lanes>(c: V, s: V, angle: V) -> (V, V) {
    let turned_c = c.sub(angle.mul(s));
    let turned_s = s.add(angle.mul(c));
    let scale = V::splat(1.0).div(turned_c.mul(turned_c).add(turned_s.mul(turned_s)).sqrt());
    (turned_c.mul(scale), turned_s.mul(scale))
}

struct IntegrateVelocities<'a> {
    bodies: &'a mut SolverBodies,
    motion: Motion,
    first: bool,
}

impl Kernel for IntegrateVelocities<'_> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let SolverBodies { velocity, start, weight, .. } = self.bodies;
        let (velocity, start) = (velocity.as_chunks_mut::<LANES>().0, start.as_chunks_mut::<LANES>().0);
        for ((velocity, start), weight) in velocity.iter_mut().zip(start).zip(weight.as_chunks::<LANES>().0) {
            let [vx, vy, w, rest] = V::load_quads(velocity);
            let [root_mass, root_inertia, ..] = V::load_quads(weight);
            let new = self.motion.accelerate([vx, vy, w], root_mass, root_inertia);
            let [nx, ny, nw] = new;
            let warm = if self.first {
                new
            } else {
                let [sx, sy, sw, _] = V::load_quads(start);
                [nx.add(vx.sub(sx)), ny.add(vy.sub(sy)), nw.add(w.sub(sw))]
            };
            V::store_quads([nx, ny, nw, rest], start);
            V::store_quads([warm[0], warm[1], warm[2], rest], velocity);
        }
    }
}

struct IntegratePositions<'a> {
    bodies: &'a mut SolverBodies,
    h: f32,
}

impl Kernel for IntegratePositions<'_> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let SolverBodies { velocity, pose, weight, .. } = self.bodies;
        let (h, one) = (V::splat(self.h), V::splat(1.0));
        let blocks = velocity.as_chunks::<LANES>().0.iter().zip(weight.as_chunks::<LANES>().0);
        for (pose, (velocity, weight)) in pose.as_chunks_mut::<LANES>().0.iter_mut().zip(blocks) {
            let [vx, vy, w, _] = V::load_quads(velocity);
            let [_, root_inertia, root_inv_inertia, _] = V::load_quads(weight);
            let [x, y, c, s] = V::load_quads(pose);
            let (c, s) = turn_on(c.add(one), s.mul(root_inv_inertia), h.mul(w.mul(root_inv_inertia)));
            V::store_quads([x.add(h.mul(vx)), y.add(h.mul(vy)), c.sub(one), s.mul(root_inertia)], pose);
        }
    }
}

/// The owned bodies of a tile, to be given their new state: columns of one length, so that an index is checked once.
struct Owned<'a> {
    position: &'a mut [DVec2],
    rotation: &'a mut [Rot],
    velocity: &'a mut [Vec2],
    angular_velocity: &'a mut [f32],
    id: &'a [GlobalId],
    not_finite: &'a mut Option<GlobalId>,
}

impl<'a> Owned<'a> {
    #[inline(always)]
    fn of(tile: &'a mut Tile) -> Self {
        let (bodies, owned) = (&mut tile.bodies, tile.owned);
        Self {
            position: &mut bodies.position[..owned],
            rotation: &mut bodies.rotation[..owned],
            velocity: &mut bodies.velocity[..owned],
            angular_velocity: &mut bodies.angular_velocity[..owned],
            id: &bodies.id[..owned],
            not_finite: &mut tile.counts.not_finite,
        }
    }

    /// Gives a body its new state, and notes if it is no longer finite.
    #[inline(always)]
    fn place(&mut self, i: usize, moved: Vec2, turned: Rot, velocity: Vec2, angular_velocity: f32) {
        let position = self.position[i] + DVec2::new(f64::from(moved.x), f64::from(moved.y));
        let rotation = turned.after(self.rotation[i]).normalized();
        self.position[i] = position;
        self.rotation[i] = rotation;
        self.velocity[i] = velocity;
        self.angular_velocity[i] = angular_velocity;
        // Zero times a finite number is zero; one test instead of seven.
        let probe = (rotation.c + rotation.s + velocity.x + velocity.y + angular_velocity) * 0.0;
        if (position.x + position.y) * 0.0 != 0.0 || probe != 0.0 {
            let id = self.id[i];
            *self.not_finite = Some(self.not_finite.map_or(id, |lowest| lowest.min(id)));
        }
    }
}

/// Writes the solved bodies' new state back to the tile. Ghosts' results are scratch: their owners' stand.
pub(crate) fn store(tile: &mut Tile, solved: &SolverBodies) {
    let mut owned = Owned::of(tile);
    for (place, &body) in solved.body.iter().enumerate().skip(1) {
        let i = body as usize;
        if i >= owned.id.len() {
            break;
        }
        let [_, _, root_inv_inertia, root_inv_mass] = solved.weight[place];
        let [x, y, c, s] = solved.pose[place];
        let [vx, vy, w, _] = solved.velocity[place];
        let turned = Rot { c: c + 1.0, s: s * root_inv_inertia };
        let (moved, velocity) = (Vec2::new(x, y) * root_inv_mass, Vec2::new(vx, vy) * root_inv_mass);
        owned.place(i, moved, turned, velocity, w * root_inv_inertia);
    }
}

/// Moves the owned bodies without contacts.
pub(crate) fn fly(tile: &mut Tile, solved: &SolverBodies, setup: &Setup) {
    let motion = Motion::new(setup);
    dispatch(Fly { tile, solved, motion, substeps: setup.params.integrations() });
}

struct Fly<'a> {
    tile: &'a mut Tile,
    solved: &'a SolverBodies,
    motion: Motion,
    substeps: u32,
}

impl Kernel for Fly<'_> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Self { tile, solved, motion, substeps } = self;
        let mut owned = Owned::of(tile);
        let mut block = [0_usize; LANES];
        let mut filled = 0;
        for (i, &place) in solved.place[..owned.id.len()].iter().enumerate() {
            block[filled] = i;
            filled += usize::from(place == NOT_SOLVED);
            if filled == LANES {
                fly_block::<V>(&mut owned, &block, &motion, substeps);
                filled = 0;
            }
        }
        fly_block::<V>(&mut owned, &block[..filled], &motion, substeps);
    }
}

/// Moves up to eight bodies through all substeps at once.
#[inline(always)]
fn fly_block<V: Lanes>(owned: &mut Owned<'_>, block: &[usize], motion: &Motion, substeps: u32) {
    let mut rows: [Row; 3] = [[0.0; LANES]; 3];
    for (lane, &i) in block.iter().enumerate() {
        let velocity = owned.velocity[i];
        (rows[0][lane], rows[1][lane], rows[2][lane]) = (velocity.x, velocity.y, owned.angular_velocity[i]);
    }
    let (h, one, zero) = (V::splat(motion.h), V::splat(1.0), V::splat(0.0));
    let mut velocity = rows.each_ref().map(V::load);
    let (mut x, mut y, mut c, mut s) = (zero, zero, one, zero);
    for _ in 0..substeps {
        velocity = motion.accelerate(velocity, one, one);
        (x, y) = (x.add(h.mul(velocity[0])), y.add(h.mul(velocity[1])));
        (c, s) = turn_on(c, s, h.mul(velocity[2]));
    }
    let mut out: [Row; 7] = [[0.0; LANES]; 7];
    for (row, value) in out.iter_mut().zip([velocity[0], velocity[1], velocity[2], x, y, c, s]) {
        value.store(row);
    }
    for (lane, &i) in block.iter().enumerate() {
        let [vx, vy, w, x, y, c, s] = out.each_ref().map(|row| row[lane]);
        owned.place(i, Vec2::new(x, y), Rot { c, s }, Vec2::new(vx, vy), w);
    }
}
