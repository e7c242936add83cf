//! Every owned body's new state, solved or flown, written back to the tile.

use super::bodies::SolverBodies;
use super::index::SolverIndex;
use super::motion::Motion;
use crate::model::id::GlobalId;
use crate::model::math::Rot;
use crate::parallel::lanes::{Kernel, LANES, Lanes, Row};
use crate::parallel::team::Team;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::{DVec2, Vec2};

/// Bodies in a piece of work, at least.
const GRAIN: usize = 4096;

/// Bodies sorted into solved and flown at a time.
const BLOCK: usize = 256;

/// Writes the solved bodies' new state back, and moves those without contacts. Ghosts' results are scratch: their
/// owners' stand. Who sleeps is left alone.
pub(crate) fn write_back(tile: &mut Tile, solved: &SolverBodies, setup: &Setup, team: Team) {
    let motion = Motion::new(setup);
    let (bodies, owned) = (&mut tile.bodies, tile.owned);
    let mut rest = Owned {
        position: &mut bodies.position[..owned],
        rotation: &mut bodies.rotation[..owned],
        velocity: &mut bodies.velocity[..owned],
        angular_velocity: &mut bodies.angular_velocity[..owned],
        id: &bodies.id[..owned],
        place: &solved.places()[..owned],
        asleep: tile.sleep.asleep(),
        not_finite: None,
    };
    let parts = team.ranges(owned, GRAIN).map(|range| rest.split_off(range.len())).collect();
    let substeps = setup.params.integrations();
    let not_finite = team.for_each(parts, |part| setup.lanes.run(WriteBack { owned: part, solved, motion, substeps }));
    tile.counts.not_finite = not_finite.into_iter().flatten().min();
}

/// Owned bodies of a tile, to be given their new state: columns of one length, so that an index is checked once.
struct Owned<'a> {
    position: &'a mut [DVec2],
    rotation: &'a mut [Rot],
    velocity: &'a mut [Vec2],
    angular_velocity: &'a mut [f32],
    id: &'a [GlobalId],
    /// Among the solver's bodies.
    place: &'a [SolverIndex],
    /// Empty where nobody sleeps.
    asleep: &'a [bool],
    not_finite: Option<GlobalId>,
}

impl<'a> Owned<'a> {
    /// Takes the first bodies out.
    fn split_off(&mut self, count: usize) -> Self {
        const ENOUGH: &str = "as many are left";
        Self {
            position: self.position.split_off_mut(..count).expect(ENOUGH),
            rotation: self.rotation.split_off_mut(..count).expect(ENOUGH),
            velocity: self.velocity.split_off_mut(..count).expect(ENOUGH),
            angular_velocity: self.angular_velocity.split_off_mut(..count).expect(ENOUGH),
            id: self.id.split_off(..count).expect(ENOUGH),
            place: self.place.split_off(..count).expect(ENOUGH),
            asleep: self.asleep.split_off(..count.min(self.asleep.len())).expect(ENOUGH),
            not_finite: None,
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
            self.not_finite = Some(self.not_finite.map_or(id, |lowest| lowest.min(id)));
        }
    }

    /// A body with contacts, from its solver body.
    #[inline(always)]
    fn store(&mut self, i: usize, solved: &SolverBodies) {
        let place = self.place[i].get();
        let [_, _, root_inv_inertia, root_inv_mass] = solved.weight[place];
        let [x, y, c, s] = solved.pose[place];
        let [vx, vy, w, _] = solved.velocity[place];
        let turned = Rot { c: c + 1.0, s: s * root_inv_inertia };
        let (moved, velocity) = (Vec2::new(x, y) * root_inv_mass, Vec2::new(vx, vy) * root_inv_mass);
        self.place(i, moved, turned, velocity, w * root_inv_inertia);
    }
}

struct WriteBack<'a> {
    owned: Owned<'a>,
    solved: &'a SolverBodies,
    motion: Motion,
    substeps: u32,
}

impl Kernel for WriteBack<'_> {
    type Output = Option<GlobalId>;
    #[inline(always)]
    fn run<V: Lanes>(self) -> Option<GlobalId> {
        let Self { mut owned, solved, motion, substeps } = self;
        let (mut flown, mut stored) = ([0_u32; BLOCK], [0_u32; BLOCK]);
        for first in (0..owned.id.len()).step_by(BLOCK) {
            let end = owned.id.len().min(first + BLOCK);
            // Written down in both lists and counted in one: a branch here would be a coin toss.
            let (mut flying, mut storing) = (0, 0);
            for (i, &place) in (first..end).zip(&owned.place[first..end]) {
                (flown[flying], stored[storing]) = (i as u32, i as u32);
                let flies = place == SolverIndex::NOT_SOLVED;
                flying += usize::from(flies);
                storing += usize::from(!flies);
            }
            if !owned.asleep.is_empty() {
                let mut awake = 0;
                for k in 0..flying {
                    flown[awake] = flown[k];
                    awake += usize::from(!owned.asleep[flown[k] as usize]);
                }
                flying = awake;
            }
            for &i in &stored[..storing] {
                owned.store(i as usize, solved);
            }
            for block in flown[..flying].chunks(LANES) {
                fly::<V>(&mut owned, block, &motion, substeps);
            }
        }
        owned.not_finite
    }
}

/// Moves up to eight bodies through all substeps at once.
#[inline(always)]
fn fly<V: Lanes>(owned: &mut Owned<'_>, block: &[u32], motion: &Motion, substeps: u32) {
    let mut rows: [Row; 3] = [[0.0; LANES]; 3];
    for (lane, &i) in block.iter().enumerate() {
        let i = i as usize;
        let velocity = owned.velocity[i];
        (rows[0][lane], rows[1][lane], rows[2][lane]) = (velocity.x, velocity.y, owned.angular_velocity[i]);
    }
    let (h, one, zero) = (V::splat(motion.h), V::splat(1.0), V::splat(0.0));
    let mut velocity = [V::load(&rows[0]), V::load(&rows[1]), V::load(&rows[2])];
    let (mut x, mut y, mut c, mut s) = (zero, zero, one, zero);
    for _ in 0..substeps {
        velocity = motion.accelerate(velocity, one, one);
        (x, y) = (x.add(h.mul(velocity[0])), y.add(h.mul(velocity[1])));
        (c, s) = motion.turn(c, s, velocity[2]);
    }
    let mut out: [Row; 7] = [[0.0; LANES]; 7];
    for (row, value) in out.iter_mut().zip([velocity[0], velocity[1], velocity[2], x, y, c, s]) {
        value.store(row);
    }
    for (lane, &i) in block.iter().enumerate() {
        let [vx, vy, w, x, y, c, s] = out.each_ref().map(|row| row[lane]);
        owned.place(i as usize, Vec2::new(x, y), Rot { c, s }, Vec2::new(vx, vy), w);
    }
}
