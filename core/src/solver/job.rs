//! A batch with its part of the solver's buffers, for one thread or a crew of them.

use super::batches::Batch;
use super::bodies::{Ghost, Parts};
use super::constraint::columns::{Color, SharedColumns, Slices};
use super::constraint::kernels::{Pass, Table};
use super::motion::Motion;
use crate::parallel::crew::Member;
use crate::parallel::lanes::{LANES, Lanes, Quad};
use crate::parallel::shared::Shared;
use crate::parallel::vectors::Vectors;
use std::ops::Range;

/// Bodies in a piece of a stage.
const BODIES_PER_PIECE: usize = 64 * LANES;

/// One batch, to be solved. Indices of bodies count from the batch's first.
///
/// It is run either by one thread alone, or by the members of one crew, which get different pieces of every stage and
/// meet between stages.
pub(crate) struct Job<'a> {
    pub(crate) velocity: Shared<'a, Quad>,
    pub(crate) pose: Shared<'a, Quad>,
    pub(crate) start: Shared<'a, Quad>,
    pub(crate) weight: &'a [Quad],
    /// Empty where all bodies move alike by themselves.
    pub(crate) factors: &'a [Quad],
    pub(crate) groups: SharedColumns<'a>,
    pub(crate) colors: &'a [Color],
    /// Sorted by place, which counts from `base`.
    pub(crate) ghosts: &'a [Ghost],
    pub(crate) base: usize,
    /// Whether it waits for word from other tiles, or gives it, between substeps.
    pub(crate) at_border: bool,
    /// Whether it is worth a crew.
    pub(crate) large: bool,
}

impl<'a> Job<'a> {
    /// Of a batch with its bodies and its groups; `colors` are those of all batches.
    pub(crate) fn new(batch: &Batch, bodies: Parts<'a>, groups: Slices<'a>, colors: &'a [Color]) -> Self {
        let Parts { velocity, pose, start, weight, factors, ghosts, .. } = bodies;
        let colors = &colors[batch.colors.clone()];
        Self {
            velocity: Shared::new(velocity),
            pose: Shared::new(pose),
            start: Shared::new(start),
            weight,
            factors,
            groups: groups.share(),
            colors,
            ghosts,
            base: batch.bodies.start,
            at_border: batch.at_border,
            large: batch.large && colors.iter().any(|color| color.slices > 1),
        }
    }

    /// One pass over all contacts, color by color. Colors of one slice that follow each other are one stage, done by one
    /// member: meeting costs more than they do.
    #[inline(always)]
    pub(crate) fn each_color<V: Lanes>(&self, member: &Member<'a>, pass: impl Pass) {
        let mut colors = self.colors;
        while let Some(first) = colors.first() {
            let small = colors.iter().take_while(|color| color.slices == 1).count();
            let (stage, rest) = colors.split_at(small.max(1));
            for slice in member.pieces(first.slices) {
                self.colors_of_stage::<V>(stage, slice, pass);
            }
            colors = rest;
        }
    }

    /// One piece of a stage: a slice of one color, or several colors whole.
    #[inline(always)]
    fn colors_of_stage<V: Lanes>(&self, stage: &[Color], slice: u32, pass: impl Pass) {
        for color in stage {
            // SAFETY: the pieces of a stage are different groups of one color, and these share no body that moves; each
            // piece has a body of its own that stands for statics. A stage of several colors has one piece, and so have contacts that
            // are solved one by one.
            let (groups, bodies) = unsafe {
                let bodies = Table { velocity: self.velocity.cells(), pose: self.pose.cells() };
                (self.groups.range(color.slice(slice)), bodies)
            };
            groups.pass_color::<V::Wide>(color, pass, bodies);
        }
    }

    /// The bodies that fall to a member of the crew in one stage, range by range.
    #[inline(always)]
    fn bodies(&self, member: &Member<'a>) -> impl Iterator<Item = Range<usize>> {
        let bodies = self.velocity.len();
        member.pieces(bodies.div_ceil(BODIES_PER_PIECE) as u32).map(move |piece| {
            let first = piece as usize * BODIES_PER_PIECE;
            first..bodies.min(first + BODIES_PER_PIECE)
        })
    }

    /// What moves bodies but contacts; then last substep's impulses once more, unless this is the first, and what ghosts
    /// are given.
    #[inline(always)]
    pub(crate) fn integrate_velocities<V: Lanes>(&self, member: &Member<'a>, motion: &Motion, substep: u32) {
        for range in self.bodies(member) {
            // SAFETY: the pieces of a stage are different bodies.
            let (velocities, starts) = unsafe { (self.velocity.range(range.clone()), self.start.range(range.clone())) };
            let weights = self.weight[range.clone()].as_chunks::<LANES>().0;
            let (velocity, start) = (velocities.as_chunks_mut::<LANES>().0, starts.as_chunks_mut::<LANES>().0);
            let factors =
                if self.factors.is_empty() { &[] } else { self.factors[range.clone()].as_chunks::<LANES>().0 };
            for (i, ((velocity, start), weight)) in velocity.iter_mut().zip(start).zip(weights).enumerate() {
                let [vx, vy, w, rest] = V::load_quads(velocity);
                let [root_mass, root_inertia, ..] = V::load_quads(weight);
                let outer = match factors.get(i) {
                    None => motion.outer(),
                    Some(factors) => motion.outer_of(factors),
                };
                let new = motion.accelerate(outer, [vx, vy, w], root_mass, root_inertia);
                let [nx, ny, nw] = new;
                let warm = if substep == 0 {
                    new
                } else {
                    let [sx, sy, sw, _] = V::load_quads(start);
                    [nx.add(vx.sub(sx)), ny.add(vy.sub(sy)), nw.add(w.sub(sw))]
                };
                V::store_quads([nx, ny, nw, rest], start);
                V::store_quads([warm[0], warm[1], warm[2], rest], velocity);
            }
            for ghost in self.ghosts_in(&range) {
                let i = ghost.place.get() - self.base - range.start;
                for (k, (given, gain)) in ghost.given.into_iter().zip(ghost.gain).enumerate() {
                    if ghost.held {
                        let now = if gain == 0.0 { given } else { given + substep as f32 * gain };
                        (starts[i][k], velocities[i][k]) = (now, now);
                    } else {
                        starts[i][k] += given;
                        velocities[i][k] += given;
                    }
                }
            }
        }
    }

    /// The ghosts among some bodies.
    fn ghosts_in(&self, bodies: &Range<usize>) -> &[Ghost] {
        let before = |body: usize| self.ghosts.partition_point(|ghost| ghost.place.get() - self.base <= body);
        match bodies.start {
            _ if self.ghosts.is_empty() => &[],
            start => &self.ghosts[if start == 0 { 0 } else { before(start - 1) }..before(bodies.end - 1)],
        }
    }

    /// Moves bodies by their velocities.
    #[inline(always)]
    pub(crate) fn integrate_positions<V: Lanes>(&self, member: &Member<'a>, motion: &Motion) {
        let (h, one) = (V::splat(motion.h), V::splat(1.0));
        for range in self.bodies(member) {
            // SAFETY: the pieces of a stage are different bodies.
            let (velocity, pose) = unsafe { (self.velocity.range(range.clone()), self.pose.range(range.clone())) };
            let weight = self.weight[range].as_chunks::<LANES>().0;
            let blocks = velocity.as_chunks::<LANES>().0.iter().zip(weight);
            for (pose, (velocity, weight)) in pose.as_chunks_mut::<LANES>().0.iter_mut().zip(blocks) {
                let [vx, vy, w, _] = V::load_quads(velocity);
                let [_, root_inertia, root_inv_inertia, _] = V::load_quads(weight);
                let [x, y, lost, s] = V::load_quads(pose);
                let before = Vectors::new(one.sub(lost.mul(root_inv_inertia)), s.mul(root_inv_inertia));
                let Vectors { x: c, y: s } = motion.turn(before, w.mul(root_inv_inertia));
                let (lost, s) = (one.sub(c).mul(root_inertia), s.mul(root_inertia));
                V::store_quads([x.add(h.mul(vx)), y.add(h.mul(vy)), lost, s], pose);
            }
        }
    }
}
