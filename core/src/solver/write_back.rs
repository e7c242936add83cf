//! Every owned body's new state, solved or flown, written back to the tile.

use super::bodies::SolverBodies;
use super::index::SolverIndex;
use super::motion::{Motion, Outer};
use crate::exchange::rim::{Rim, RimBody};
use crate::model::body::Body;
use crate::model::id::{GlobalId, KindId};
use crate::model::math::Rot;
use crate::parallel::lanes::{Kernel, LANES, Lanes, Pair, Place, Row};
use crate::parallel::team::Team;
use crate::parallel::vectors::{Vectors, absolute};
use crate::tiling::blueprint::Setup;
use crate::tiling::partition::Region;
use crate::tiling::pushes::Push;
use crate::tiling::tile::Tile;
use bytemuck::cast_slice_mut;
use std::ops::Range;

/// Bodies in a piece of work, at least.
const GRAIN: usize = 2048;

/// Who was pushed by less than this part of what gravity gave was not pushed.
const SLIGHTLY: f32 = 1e-3;

/// Writes the solved bodies' new state back, and moves those without contacts. Ghosts' results are scratch: their
/// owners' stand. Who sleeps is left alone. Notes who may concern other tiles from now on.
pub(crate) fn write_back(tile: &mut Tile, solved: &SolverBodies, setup: &Setup, team: Team) {
    let mover = Mover { solved, motion: Motion::new(setup), interior: &tile.interior, pushes: &tile.pushes, setup };
    let mut rim = std::mem::take(&mut tile.rim.bodies);
    rim.clear();
    let (bodies, owned) = (&mut tile.bodies, tile.owned);
    let mut rest = Owned {
        position: cast_slice_mut(&mut bodies.position[..owned]),
        rotation: cast_slice_mut(&mut bodies.rotation[..owned]),
        velocity: cast_slice_mut(&mut bodies.velocity[..owned]),
        angular_velocity: &mut bodies.angular_velocity[..owned],
        id: &bodies.id[..owned],
        kind: &bodies.kind[..owned],
        place: &solved.places()[..owned],
        asleep: tile.sleep.asleep(),
    };
    let region = &tile.region;
    let parts = team.ranges(owned, GRAIN).map(|range| WriteBack {
        owned: rest.split_off(range.len()),
        first: range.start,
        mover,
        region,
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
    position: &'a mut [Place],
    rotation: &'a mut [Pair],
    velocity: &'a mut [Pair],
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

    /// Blocks of eight bodies from here on.
    #[inline(always)]
    fn eights<const N: usize>(&mut self, first: usize) -> Eights<'_, N> {
        let range = first..first + N * LANES;
        Eights {
            position: blocks(&mut self.position[range.clone()]),
            rotation: blocks(&mut self.rotation[range.clone()]),
            velocity: blocks(&mut self.velocity[range.clone()]),
            spin: blocks(&mut self.angular_velocity[range.clone()]),
            place: self.place[range.clone()].as_chunks().0.try_into().expect("as many"),
            kind: self.kind[range.clone()].as_chunks().0.try_into().expect("as many"),
            asleep: if self.asleep.is_empty() { &[] } else { &self.asleep[range] },
        }
    }

    fn body(&self, i: usize) -> Body {
        let &Self { ref position, ref rotation, ref velocity, ref angular_velocity, id, kind, .. } = self;
        let [c, s] = rotation[i];
        Body {
            id: id[i],
            position: position[i].into(),
            rotation: Rot { c, s },
            velocity: velocity[i].into(),
            angular_velocity: angular_velocity[i],
            kind: kind[i],
        }
    }
}

/// A column of so many blocks of eight.
#[inline(always)]
fn blocks<T, const N: usize>(column: &mut [T]) -> &mut [[T; LANES]; N] {
    column.as_chunks_mut().0.try_into().expect("as many")
}

/// Blocks of eight bodies: where they are, rotation, velocity, angular velocity; and which the solver has them as.
struct Eights<'a, const N: usize> {
    position: &'a mut [[Place; LANES]; N],
    rotation: &'a mut [[Pair; LANES]; N],
    velocity: &'a mut [[Pair; LANES]; N],
    spin: &'a mut [Row; N],
    place: &'a [[SolverIndex; LANES]; N],
    kind: &'a [[KindId; LANES]; N],
    /// Empty where nobody sleeps.
    asleep: &'a [bool],
}

/// Some of the bodies, from the first of them on.
struct WriteBack<'a> {
    owned: Owned<'a>,
    first: usize,
    mover: Mover<'a>,
    region: &'a Region,
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
            self.eights::<V, 4>(first);
        }
        for first in (fours..ones).step_by(LANES) {
            self.eights::<V, 1>(first);
        }
        self.last::<V>(ones);
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

impl WriteBack<'_> {
    #[inline(always)]
    fn eights<V: Lanes, const N: usize>(&mut self, first: usize) {
        let (are_within, are_finite) = self.mover.go::<V, N>(self.owned.eights(first), self.first + first);
        for (block, are_within) in are_within.into_iter().enumerate() {
            if !are_within {
                let first = first + block * LANES;
                self.note_rim(first..first + LANES);
            }
        }
        if !are_finite {
            self.note_not_finite(first..first + N * LANES);
        }
    }

    /// Those that are too few for a block.
    #[inline(always)]
    fn last<V: Lanes>(&mut self, first: usize) {
        let (owned, rest) = (&self.owned, first..self.owned.id.len());
        let count = rest.len();
        let (mut position, mut rotation, mut velocity) =
            ([[[0.0; 2]; LANES]], [[[1.0, 0.0]; LANES]], [[[0.0; 2]; LANES]]);
        let (mut spin, mut place, mut asleep) = ([[0.0; LANES]], [[SolverIndex::NOT_SOLVED; LANES]], [false; LANES]);
        let mut kind = [[KindId(0); LANES]];
        position[0][..count].copy_from_slice(&owned.position[rest.clone()]);
        rotation[0][..count].copy_from_slice(&owned.rotation[rest.clone()]);
        velocity[0][..count].copy_from_slice(&owned.velocity[rest.clone()]);
        spin[0][..count].copy_from_slice(&owned.angular_velocity[rest.clone()]);
        place[0][..count].copy_from_slice(&owned.place[rest.clone()]);
        kind[0][..count].copy_from_slice(&owned.kind[rest.clone()]);
        if !owned.asleep.is_empty() {
            asleep[..count].copy_from_slice(&owned.asleep[rest.clone()]);
        }
        let eight = Eights {
            position: &mut position,
            rotation: &mut rotation,
            velocity: &mut velocity,
            spin: &mut spin,
            place: &place,
            kind: &kind,
            asleep: if owned.asleep.is_empty() { &[] } else { &asleep },
        };
        self.mover.go::<V, 1>(eight, self.first + first);
        let owned = &mut self.owned;
        owned.position[rest.clone()].copy_from_slice(&position[0][..count]);
        owned.rotation[rest.clone()].copy_from_slice(&rotation[0][..count]);
        owned.velocity[rest.clone()].copy_from_slice(&velocity[0][..count]);
        owned.angular_velocity[rest.clone()].copy_from_slice(&spin[0][..count]);
        self.note_rim(rest.clone());
        self.note_not_finite(rest);
    }

    /// Notes those that may concern other tiles.
    #[inline(always)]
    fn note_rim(&mut self, bodies: Range<usize>) {
        for i in bodies {
            let (position, velocity) = (self.owned.position[i].into(), self.owned.velocity[i].into());
            let Mover { interior, setup, .. } = self.mover;
            if !interior.contains(position) | setup.goes_far(velocity) {
                self.rim.extend(RimBody::of(self.owned.body(i), (self.first + i) as u32, self.region, setup));
            }
        }
    }

    #[cold]
    fn note_not_finite(&mut self, bodies: Range<usize>) {
        let named = bodies.map(|i| self.owned.body(i)).filter(|body| !body.is_finite()).map(|body| body.id);
        self.not_finite = self.not_finite.into_iter().chain(named).min();
    }
}

/// What moves bodies by a step.
#[derive(Clone, Copy)]
struct Mover<'a> {
    solved: &'a SolverBodies,
    motion: Motion,
    interior: &'a Region,
    /// By body.
    pushes: &'a [Push],
    setup: &'a Setup,
}

impl Mover<'_> {
    /// Moves blocks of eight bodies, but those that sleep. Those that were solved and those that flew lie in no order, so both is done
    /// for all of them where there are some of either. Whether those of each block concern no other tile now, and all are finite.
    #[inline(always)]
    fn go<V: Lanes, const N: usize>(&self, eights: Eights<'_, N>, first: usize) -> ([bool; N], bool) {
        let Eights { position, rotation, velocity, spin, place, kind, asleep } = eights;
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let nothing = Vectors::new(zero, zero);
        let mut motions = [Motions { moved: nothing, turned: nothing, velocity: nothing, spin: zero }; N];
        // Who is not solved is a static here: its own result is taken in the end.
        let (mut index, mut flies, mut flying) = ([[0_u32; LANES]; N], [[0.0; LANES]; N], 0);
        for block in 0..N {
            // One loop for each, so that all of them are vectors.
            for (index, place) in index[block].iter_mut().zip(&place[block]) {
                *index = place.solved_or_static().get() as u32;
            }
            for (flies, place) in flies[block].iter_mut().zip(&place[block]) {
                *flies = if *place == SolverIndex::NOT_SOLVED { 1.0 } else { 0.0 };
            }
            for place in &place[block] {
                flying += u32::from(*place == SolverIndex::NOT_SOLVED);
            }
            let [vx, vy] = V::load_pairs(&velocity[block]);
            (motions[block].velocity, motions[block].spin) = (Vectors::new(vx, vy), V::load(&spin[block]));
        }
        if flying > 0 {
            self.fly(&mut motions, kind, first);
        }
        if flying < (N * LANES) as u32 {
            for block in 0..N {
                let mut solved = self.solved(&index[block]);
                if self.motion.falls() {
                    let [vx, vy] = V::load_pairs(&velocity[block]);
                    self.fall(&mut solved, Vectors::new(vx, vy), &kind[block]);
                }
                motions[block] = Motions::pick(V::load(&flies[block]), motions[block], solved);
            }
        }
        let (mut are_within, mut are_finite) = ([true; N], true);
        for block in 0..N {
            let Motions { mut moved, turned, velocity: mut now, spin: mut turns } = motions[block];
            let [c, s] = V::load_pairs(&rotation[block]);
            let before = Vectors::new(c, s);
            let turned = turned.rotate(before);
            let mut after = turned.scaled(one.div(turned.dot(turned).sqrt()));
            if !asleep.is_empty() {
                let mut awake = [1.0; LANES];
                for (awake, &asleep) in awake.iter_mut().zip(&asleep[block * LANES..][..LANES]) {
                    *awake = if asleep { 0.0 } else { 1.0 };
                }
                let ([vx, vy], awake) = (V::load_pairs(&velocity[block]), V::load(&awake));
                // Whoever goes so far stays where it is, to the sign of a zero.
                let nowhere = Vectors::new(V::splat(-0.0), V::splat(-0.0));
                moved = Vectors::pick(awake, moved, nowhere);
                after = Vectors::pick(awake, after, before);
                now = Vectors::pick(awake, now, Vectors::new(vx, vy));
                turns = awake.if_positive(turns, V::load(&spin[block]));
            }
            V::advance([moved.x, moved.y], &mut position[block]);
            V::store_pairs([after.x, after.y], &mut rotation[block]);
            V::store_pairs([now.x, now.y], &mut velocity[block]);
            turns.store(&mut spin[block]);
            let Region { min, max } = *self.interior;
            let fastest = absolute(now.x).max(absolute(now.y)).mul(V::splat(self.setup.params.dt));
            are_within[block] = V::are_within(&position[block], min.into(), max.into())
                & fastest.all_below(self.setup.params.margin_cap);
            // A sum is finite only if all its parts are.
            let sum = moved.x.add(moved.y).add(after.x).add(after.y).add(now.x).add(now.y).add(turns);
            are_finite &= absolute(sum).all_below(f32::MAX);
        }
        (are_within, are_finite)
    }

    /// Bodies without contacts, through all substeps; `first` is the first of them.
    #[inline(always)]
    fn fly<V: Lanes, const N: usize>(&self, blocks: &mut [Motions<V>; N], kinds: &[[KindId; LANES]; N], first: usize) {
        let alike = self.motion.outer();
        if self.setup.factors.is_empty() && self.pushes.is_empty() {
            return self.fly_by::<V, N, false, false>(blocks, &[alike; N], 0);
        }
        let mut outer = [alike; N];
        if !self.setup.factors.is_empty() {
            for (outer, kinds) in outer.iter_mut().zip(kinds) {
                *outer = self.outer_of(kinds);
            }
        }
        if self.pushes.is_empty() {
            self.fly_by::<V, N, true, false>(blocks, &outer, 0);
        } else {
            self.fly_by::<V, N, true, true>(blocks, &outer, first);
        }
    }

    /// As [`fly`](Self::fly), by what moves each block, or all of them alike: that stays in registers; and by forces, where there are some.
    #[inline(always)]
    fn fly_by<V: Lanes, const N: usize, const EACH: bool, const PUSHED: bool>(
        &self,
        blocks: &mut [Motions<V>; N],
        outer: &[Outer<V>; N],
        first: usize,
    ) {
        let (h, one, zero) = (V::splat(self.motion.h), V::splat(1.0), V::splat(0.0));
        let gains = if PUSHED { self.gains(first) } else { [[[0.0; LANES]; 4]; N] };
        let nothing = Vectors::new(zero, zero);
        let (changes, mut before) = (EACH || PUSHED || self.motion.accelerates(), [nothing; N]);
        for (block, before) in blocks.iter_mut().zip(&mut before) {
            (block.moved, block.turned) = (nothing, Vectors::new(one, zero));
            if changes {
                *before = self.motion.limited(block.velocity);
            }
        }
        for _ in 0..self.setup.params.integrations() {
            for (i, block) in blocks.iter_mut().enumerate() {
                let outer = if EACH { outer[i] } else { self.motion.outer() };
                let velocity = [block.velocity.x, block.velocity.y, block.spin];
                let [mut vx, mut vy, mut spin] = self.motion.accelerate(outer, velocity, one, one);
                if PUSHED {
                    let [x, y, w, is_pushed] = &gains[i];
                    let (pushed, after) =
                        (V::load(is_pushed), [vx.add(V::load(x)), vy.add(V::load(y)), spin.add(V::load(w))]);
                    let after = self.motion.limit(after, one, one);
                    vx = pushed.if_positive(after[0], vx);
                    vy = pushed.if_positive(after[1], vy);
                    spin = pushed.if_positive(after[2], spin);
                }
                (block.velocity, block.spin) = (Vectors::new(vx, vy), spin);
                block.moved = Vectors::new(block.moved.x.add(h.mul(vx)), block.moved.y.add(h.mul(vy)));
                block.turned = self.motion.turn_on(block.turned, spin);
            }
        }
        if !changes {
            return;
        }
        // Who flies goes in each substep by the mean of the velocities before and after: under gravity alone that is a parabola, and
        // keeps its energy. Where damping takes half of the speed in a substep that would be further than it goes.
        let half = V::splat(0.5 * self.motion.h);
        for (i, (block, before)) in blocks.iter_mut().zip(before).enumerate() {
            let outer = if EACH { outer[i] } else { self.motion.outer() };
            let lag = before.minus(block.velocity).scaled(half);
            block.moved = Vectors::pick(outer.is_slight(), block.moved.plus(lag), block.moved);
        }
    }

    /// What moves bodies of kinds that move in ways of their own.
    #[inline(always)]
    fn outer_of<V: Lanes>(&self, kinds: &[KindId; LANES]) -> Outer<V> {
        self.motion.outer_of(&kinds.map(|kind| self.setup.factors[kind.0 as usize]))
    }

    /// Of eight solved bodies, which had these velocities `before`, lets those fall as who flies whom nothing has pushed: their velocities
    /// tell.
    #[inline(always)]
    fn fall<V: Lanes>(&self, solved: &mut Motions<V>, before: Vectors<V>, kinds: &[KindId; LANES]) {
        let outer = if self.setup.factors.is_empty() { self.motion.outer() } else { self.outer_of(kinds) };
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let start = self.motion.limited(before);
        let mut falls = start;
        for _ in 0..self.setup.params.integrations() {
            let [vx, vy, _] = self.motion.accelerate(outer, [falls.x, falls.y, zero], one, one);
            falls = Vectors::new(vx, vy);
        }
        let gained = outer.gained().scaled(V::splat(self.setup.params.integrations() as f32));
        let pushed = solved.velocity.minus(falls);
        let unpushed = V::splat(SLIGHTLY * SLIGHTLY).mul(gained.dot(gained)).sub(pushed.dot(pushed));
        // Damped, it would go further than the solver saw.
        let change = Vectors::pick(outer.is_undamped(), start.minus(solved.velocity), gained.scaled(V::splat(-1.0)));
        let lag = change.scaled(V::splat(0.5 * self.motion.h));
        solved.moved = solved.moved.plus(Vectors::pick(unpushed, lag, Vectors::new(zero, zero)));
    }

    /// What forces give bodies in a substep, and one for those that they push at.
    fn gains<const N: usize>(&self, first: usize) -> [[Row; 4]; N] {
        let mut gains = [[[0.0; LANES]; 4]; N];
        let from = self.pushes.partition_point(|push| (push.body as usize) < first);
        for push in &self.pushes[from..] {
            let place = push.body as usize - first;
            let Some(block) = gains.get_mut(place / LANES) else { break };
            for (column, part) in block.iter_mut().zip([push.gain[0], push.gain[1], push.gain[2], 1.0]) {
                column[place % LANES] = part;
            }
        }
        gains
    }

    /// Bodies with contacts, as the solver left them.
    #[inline(always)]
    fn solved<V: Lanes>(&self, index: &[u32; LANES]) -> Motions<V> {
        let [_, _, root_inv_inertia, root_inv_mass] = V::gather_fixed(&self.solved.weight, index);
        let [x, y, lost, s] = V::gather_fixed(&self.solved.pose, index);
        let [vx, vy, w, _] = V::gather_fixed(&self.solved.velocity, index);
        // What contacts, and bounces, did after the limits of the last substep.
        let (one, velocity) = (V::splat(1.0), [vx.mul(root_inv_mass), vy.mul(root_inv_mass), w.mul(root_inv_inertia)]);
        let [vx, vy, spin] = self.motion.limit(velocity, one, one);
        Motions {
            moved: Vectors::new(x, y).scaled(root_inv_mass),
            turned: Vectors::new(V::splat(1.0).sub(lost.mul(root_inv_inertia)), s.mul(root_inv_inertia)),
            velocity: Vectors::new(vx, vy),
            spin,
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
