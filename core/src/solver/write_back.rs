//! Every owned body's new state, solved or flown, written back to the tile.

use super::bodies::SolverBodies;
use super::index::SolverIndex;
use super::motion::Motion;
use crate::exchange::rim::{Rim, RimBody};
use crate::model::body::Body;
use crate::model::id::{GlobalId, KindId};
use crate::model::math::{Rot, apart, side_by_side};
use crate::parallel::lanes::{Kernel, LANES, Lanes, Quad, Row};
use crate::parallel::team::Team;
use crate::parallel::vectors::Vectors;
use crate::tiling::blueprint::Setup;
use crate::tiling::partition::Region;
use crate::tiling::tile::Tile;
use glam::{DVec2, Vec2};

/// Bodies in a piece of work, at least.
const GRAIN: usize = 4096;

/// Writes the solved bodies' new state back, and moves those without contacts. Ghosts' results are scratch: their
/// owners' stand. Who sleeps is left alone. Notes who may concern other tiles from now on.
pub(crate) fn write_back(tile: &mut Tile, solved: &SolverBodies, setup: &Setup, team: Team) {
    let motion = Motion::new(setup);
    let mut rim = std::mem::take(&mut tile.rim.bodies);
    rim.clear();
    let (bodies, owned) = (&mut tile.bodies, tile.owned);
    let mut rest = Owned {
        position: &mut bodies.position[..owned],
        rotation: &mut bodies.rotation[..owned],
        velocity: &mut bodies.velocity[..owned],
        angular_velocity: &mut bodies.angular_velocity[..owned],
        id: &bodies.id[..owned],
        kind: &bodies.kind[..owned],
        place: &solved.places()[..owned],
        asleep: tile.sleep.asleep(),
    };
    let (region, interior) = (&tile.region, &tile.interior);
    let parts = team.ranges(owned, GRAIN).map(|range| WriteBack {
        owned: rest.split_off(range.len()),
        first: range.start,
        solved,
        motion,
        region,
        interior,
        setup,
        rim: if range.start == 0 { std::mem::take(&mut rim) } else { Vec::new() },
        not_finite: None,
    });
    let mut ends = team.for_each(parts.collect(), |part| setup.lanes.run(part)).into_iter();
    let (mut rim, mut not_finite) = ends.next().expect("one range at least");
    for (more, other) in ends {
        rim.extend(more);
        not_finite = not_finite.into_iter().chain(other).min();
    }
    tile.rim = Rim { bodies: rim, is_known: true };
    tile.counts.not_finite = not_finite;
}

/// Owned bodies of a tile, to be given their new state: columns of one length, so that an index is checked once.
struct Owned<'a> {
    position: &'a mut [DVec2],
    rotation: &'a mut [Rot],
    velocity: &'a mut [Vec2],
    angular_velocity: &'a mut [f32],
    id: &'a [GlobalId],
    kind: &'a [KindId],
    /// Among the solver's bodies.
    place: &'a [SolverIndex],
    /// Empty where nobody sleeps.
    asleep: &'a [bool],
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
            kind: self.kind.split_off(..count).expect(ENOUGH),
            place: self.place.split_off(..count).expect(ENOUGH),
            asleep: self.asleep.split_off(..count.min(self.asleep.len())).expect(ENOUGH),
        }
    }

    /// Reads up to eight bodies.
    #[inline(always)]
    fn read(&self, first: usize, count: usize) -> Eight {
        let mut eight = Eight::default();
        let (position, rotation) = (&self.position[first..][..count], &self.rotation[first..][..count]);
        let (velocity, spin) = (&self.velocity[first..][..count], &self.angular_velocity[first..][..count]);
        for lane in 0..count {
            eight.position[lane] = position[lane];
            eight.moves[lane] = side_by_side(velocity[lane], rotation[lane]);
            eight.spin[lane] = spin[lane];
        }
        eight
    }

    /// Writes up to eight bodies, but those that sleep.
    #[inline(always)]
    fn write(&mut self, first: usize, count: usize, eight: &Eight) {
        let (position, rotation) = (&mut self.position[first..][..count], &mut self.rotation[first..][..count]);
        let (velocity, spin) = (&mut self.velocity[first..][..count], &mut self.angular_velocity[first..][..count]);
        for lane in 0..count {
            if !self.asleep.is_empty() && self.asleep[first + lane] {
                continue;
            }
            position[lane] = eight.position[lane];
            (velocity[lane], rotation[lane]) = apart(eight.moves[lane]);
            spin[lane] = eight.spin[lane];
        }
    }
}

/// Eight bodies: position, velocity and rotation, angular velocity.
#[derive(Clone, Copy, Default)]
struct Eight {
    position: [DVec2; LANES],
    moves: [Quad; LANES],
    spin: Row,
}

impl Eight {
    /// Zero times a finite number is zero: a test for all of them, in integers, as their order does not matter.
    #[inline(always)]
    fn is_finite(&self) -> bool {
        let (mut places, mut others) = (0, 0);
        for lane in 0..LANES {
            let ([vx, vy, c, s], position) = (self.moves[lane], self.position[lane]);
            places |= ((position.x + position.y) * 0.0).to_bits();
            others |= ((vx + vy + c + s + self.spin[lane]) * 0.0).to_bits();
        }
        // But for their signs.
        places << 1 == 0 && others << 1 == 0
    }

    fn is_finite_in(&self, lane: usize) -> bool {
        self.position[lane].is_finite() && self.moves[lane].iter().all(|v| v.is_finite()) && self.spin[lane].is_finite()
    }
}

/// Some of the bodies, from the first of them on.
struct WriteBack<'a> {
    owned: Owned<'a>,
    first: usize,
    solved: &'a SolverBodies,
    motion: Motion,
    region: &'a Region,
    interior: &'a Region,
    setup: &'a Setup,
    rim: Vec<RimBody>,
    /// The lowest of those whose state is no longer finite.
    not_finite: Option<GlobalId>,
}

impl Kernel for WriteBack<'_> {
    type Output = (Vec<RimBody>, Option<GlobalId>);

    #[inline(always)]
    fn run<V: Lanes>(mut self) -> Self::Output {
        let all = self.owned.id.len();
        // Blocks of eight, four at a time: roots and quotients take long, and none need wait for those of another.
        let (fours, ones) = (all / (4 * LANES) * (4 * LANES), all / LANES * LANES);
        for first in (0..fours).step_by(4 * LANES) {
            self.blocks::<V, 4>(first, LANES);
        }
        for first in (fours..ones).step_by(LANES) {
            self.blocks::<V, 1>(first, LANES);
        }
        self.blocks::<V, 1>(ones, all - ones);
        (self.rim, self.not_finite)
    }
}

/// What the step did to eight bodies: where they have gone, how they have turned, and their velocities now.
#[derive(Clone, Copy)]
struct Motions<V> {
    moved: Vectors<V>,
    turned: Vectors<V>,
    velocity: Vectors<V>,
    spin: V,
}

/// Which of eight bodies were solved.
#[derive(Clone, Copy)]
struct Solved {
    /// Among the solver's bodies. Who is not solved is a static here: its own result is taken in the end.
    index: [u32; LANES],
    /// One for who is not.
    flies: Row,
    flying: usize,
}

impl WriteBack<'_> {
    /// Blocks of up to eight bodies. Those that were solved and those that flew lie in no order, so both is done for all of them where
    /// there are some of either.
    #[inline(always)]
    fn blocks<V: Lanes, const N: usize>(&mut self, first: usize, count: usize) {
        let mut all = [Eight::default(); N];
        let mut solved = [Solved { index: [0; LANES], flies: [1.0; LANES], flying: LANES - count }; N];
        let mut flying = 0;
        let zero = Vectors::new(V::splat(0.0), V::splat(0.0));
        let mut motions = [Motions { moved: zero, turned: zero, velocity: zero, spin: zero.x }; N];
        let mut rotations = [zero; N];
        for block in 0..N {
            all[block] = self.owned.read(first + block * LANES, count);
            let solved = &mut solved[block];
            for (lane, &place) in self.owned.place[first + block * LANES..][..count].iter().enumerate() {
                let is_solved = place != SolverIndex::NOT_SOLVED;
                solved.index[lane] = if is_solved { place.get() as u32 } else { SolverIndex::STATIC.get() as u32 };
                solved.flies[lane] = if is_solved { 0.0 } else { 1.0 };
                solved.flying += usize::from(!is_solved);
            }
            flying += solved.flying;
            let [vx, vy, c, s] = V::load_quads(&all[block].moves);
            motions[block].velocity = Vectors::new(vx, vy);
            motions[block].spin = V::load(&all[block].spin);
            rotations[block] = Vectors::new(c, s);
        }
        if flying > 0 {
            self.fly(&mut motions);
        }
        if flying < N * LANES {
            for (motions, solved) in motions.iter_mut().zip(&solved) {
                *motions = Motions::pick(V::load(&solved.flies), *motions, self.solved(&solved.index));
            }
        }
        for block in 0..N {
            let (motions, eight) = (&motions[block], &mut all[block]);
            let turned = motions.turned.rotate(rotations[block]);
            let rotation = turned.scaled(V::splat(1.0).div(turned.dot(turned).sqrt()));
            let (mut x, mut y): (Row, Row) = Default::default();
            motions.moved.x.store(&mut x);
            motions.moved.y.store(&mut y);
            for lane in 0..LANES {
                eight.position[lane] += DVec2::new(f64::from(x[lane]), f64::from(y[lane]));
            }
            motions.spin.store(&mut eight.spin);
            V::store_quads([motions.velocity.x, motions.velocity.y, rotation.x, rotation.y], &mut eight.moves);
        }
        for (block, eight) in all.iter().enumerate() {
            let first = first + block * LANES;
            self.owned.write(first, count, eight);
            self.note_rim(first, count, eight);
            if !eight.is_finite() {
                self.note_not_finite(first, count, eight);
            }
        }
    }

    /// Bodies without contacts, through all substeps.
    #[inline(always)]
    fn fly<V: Lanes, const N: usize>(&self, blocks: &mut [Motions<V>; N]) {
        let (h, one, zero) = (V::splat(self.motion.h), V::splat(1.0), V::splat(0.0));
        for block in &mut *blocks {
            (block.moved, block.turned) = (Vectors::new(zero, zero), Vectors::new(one, zero));
        }
        for _ in 0..self.setup.params.integrations() {
            for block in &mut *blocks {
                let velocity = [block.velocity.x, block.velocity.y, block.spin];
                let [vx, vy, spin] = self.motion.accelerate(velocity, one, one);
                (block.velocity, block.spin) = (Vectors::new(vx, vy), spin);
                block.moved = Vectors::new(block.moved.x.add(h.mul(vx)), block.moved.y.add(h.mul(vy)));
                let (c, s) = self.motion.turn(block.turned.x, block.turned.y, spin);
                block.turned = Vectors::new(c, s);
            }
        }
    }

    #[inline(always)]
    fn note_rim(&mut self, first: usize, count: usize, eight: &Eight) {
        let mut outside = 0;
        for (lane, (&position, [vx, vy, ..])) in (0..).zip(eight.position.iter().zip(eight.moves)) {
            let concerns = !self.interior.contains(position) | self.setup.goes_far(Vec2::new(vx, vy));
            outside |= u32::from(concerns) << lane;
        }
        outside &= (1 << count) - 1;
        while outside != 0 {
            let lane = outside.trailing_zeros() as usize;
            let (i, (velocity, rotation)) = (first + lane, apart(eight.moves[lane]));
            let body = Body {
                id: self.owned.id[i],
                position: eight.position[lane],
                rotation,
                velocity,
                angular_velocity: eight.spin[lane],
                kind: self.owned.kind[i],
            };
            self.rim.extend(RimBody::of(body, (self.first + i) as u32, self.region, self.setup));
            outside &= outside - 1;
        }
    }

    #[cold]
    fn note_not_finite(&mut self, first: usize, count: usize, eight: &Eight) {
        let lanes = (0..count).filter(|&lane| !eight.is_finite_in(lane));
        self.not_finite = self.not_finite.into_iter().chain(lanes.map(|lane| self.owned.id[first + lane])).min();
    }

    /// Bodies with contacts, as the solver left them.
    #[inline(always)]
    fn solved<V: Lanes>(&self, index: &[u32; LANES]) -> Motions<V> {
        let [_, _, root_inv_inertia, root_inv_mass] = V::gather_fixed(&self.solved.weight, index);
        let [x, y, c, s] = V::gather_fixed(&self.solved.pose, index);
        let [vx, vy, w, _] = V::gather_fixed(&self.solved.velocity, index);
        Motions {
            moved: Vectors::new(x, y).scaled(root_inv_mass),
            turned: Vectors::new(c.add(V::splat(1.0)), s.mul(root_inv_inertia)),
            velocity: Vectors::new(vx, vy).scaled(root_inv_mass),
            spin: w.mul(root_inv_inertia),
        }
    }
}

impl<V: Lanes> Motions<V> {
    /// `yes` where a number is positive, else `no`.
    #[inline(always)]
    fn pick(positive: V, yes: Self, no: Self) -> Self {
        Self {
            moved: Vectors::pick(positive, yes.moved, no.moved),
            turned: Vectors::pick(positive, yes.turned, no.turned),
            velocity: Vectors::pick(positive, yes.velocity, no.velocity),
            spin: positive.if_positive(yes.spin, no.spin),
        }
    }
}
