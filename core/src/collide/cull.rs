//! Which of the candidates that the broad phase names are pairs that may touch: sixteen at a time, as most do not.

use super::broad_phase::Pair;
use super::proxies::Proxies;
use crate::model::body::Bodies;
use crate::parallel::lanes::{Arithmetic, Kernel, Lanes, Quad, WIDE, Wide, WideRow};
use crate::parallel::vectors::{Vectors, absolute};
use crate::tiling::blueprint::Setup;

/// Writes down those of some candidates that are pairs which the tile solves, and come near each other within the step, and says how many
/// these are: there is room for all.
pub(super) struct Cull<'a> {
    pub(super) bodies: &'a Bodies,
    pub(super) proxies: &'a Proxies,
    pub(super) setup: &'a Setup,
    pub(super) candidates: &'a [Pair],
    pub(super) near: &'a mut [Pair],
}

impl Kernel for Cull<'_> {
    type Output = usize;

    #[inline(always)]
    fn run<V: Lanes>(mut self) -> usize {
        let mut kept = 0;
        let (blocks, rest) = self.candidates.as_chunks::<WIDE>();
        for pairs in blocks {
            kept = self.keep::<V>(kept, pairs, WIDE);
        }
        if let Some(&last) = rest.last() {
            let mut pairs = [last; WIDE];
            pairs[..rest.len()].copy_from_slice(rest);
            kept = self.keep::<V>(kept, &pairs, rest.len());
        }
        kept
    }
}

impl Cull<'_> {
    /// Keeps those of some pairs that are to be kept, behind those that were: every one is written down, and counted or not, as a
    /// branch would be a coin toss. How many there are then.
    #[inline(always)]
    fn keep<V: Lanes>(&mut self, mut kept: usize, pairs: &[Pair; WIDE], count: usize) -> usize {
        let Self { bodies, proxies, setup, near, .. } = self;
        let apart = are_apart::<V::Wide>(bodies, proxies, setup, pairs);
        // Those of owned bodies are wanted always.
        let owned = proxies.owned as u32;
        let all_owned = pairs.iter().fold(true, |all, pair| all & (pair[0] < owned));
        let near = &mut near[..];
        for lane in 0..count {
            near[kept] = pairs[lane];
            kept += usize::from(apart[lane] == 0.0) & usize::from(all_owned || proxies.is_wanted(pairs[lane]));
        }
        kept
    }
}

/// Zero for pairs that may touch within the step.
///
/// They are none unless their grown AABBs overlap, and their bounding circles may touch: if distance < reach + closing speed x dt,
/// the contact rule with the greatest closing speed there can be. Of two round bodies that is known, of others only that it is no
/// more than their relative speed. All is multiplied by the distance, which saves a division. Nor do fast ones touch that stay apart by
/// where their centers are nearest within the step, as most of them do (see `Approach::pass_by`).
///
/// This reads the bodies' own bits, so two tiles that both see a pair agree on it.
#[inline(always)]
fn are_apart<V: Wide>(bodies: &Bodies, proxies: &Proxies, setup: &Setup, pairs: &[Pair; WIDE]) -> WideRow {
    let mut ways: [Quad; WIDE] = [[0.0; 4]; WIDE];
    let (mut a, mut b) = (ways, ways);
    for (lane, pair) in pairs.iter().enumerate() {
        let [first, second] = pair.map(|body| body as usize);
        let offset = (bodies.position[second] - bodies.position[first]).as_vec2();
        let between = bodies.velocity[second] - bodies.velocity[first];
        ways[lane] = [offset.x, offset.y, between.x, between.y];
        (a[lane], b[lane]) = (proxies.outline(first), proxies.outline(second));
    }
    let [x, y, vx, vy] = V::load_quads(&ways);
    let (offset, between) = (Vectors::new(x, y), Vectors::new(vx, vy));
    let [half_x_a, half_y_a, reach_a, bound_a] = V::load_quads(&a);
    let [half_x_b, half_y_b, reach_b, bound_b] = V::load_quads(&b);
    let (zero, one, dt) = (V::splat(0.0), V::splat(1.0), V::splat(setup.params.dt));
    let beside = absolute(offset.x).sub(half_x_a.add(half_x_b));
    let above = absolute(offset.y).sub(half_y_a.add(half_y_b));
    let (square, squared_speed) = (offset.dot(offset), between.dot(between));
    let (distance, speed) = (square.sqrt(), squared_speed.sqrt());
    // Of two round ones, none.
    let any_way = bound_a.if_positive(one, bound_b.if_positive(one, zero)).mul(speed.mul(distance));
    let opening = offset.dot(between);
    let closing = any_way.max(zero.sub(opening)).max(zero);
    let within = reach_a.add(reach_b).mul(distance).add(dt.mul(closing));
    let beyond = square.sub(within.mul(V::splat(1.0001)));
    // Of slow ones their old contact may know better.
    let is_slow = V::splat(setup.params.speculative_distance).sub(dt.mul(speed));
    let bounds = absolute(bound_a).add(absolute(bound_b));
    let passing = is_slow.if_positive(zero, passes(offset, between, bounds, setup));
    let mut apart = [0.0; WIDE];
    beside.if_positive(one, above.if_positive(one, beyond.if_positive(one, passing))).store(&mut apart);
    apart
}

/// One for pairs that stay apart by where their centers are nearest within the step, given the sum of their bounding radii. Where
/// speeds overflow nothing is known: then they do not pass.
#[inline(always)]
pub(super) fn passes<V: Arithmetic>(offset: Vectors<V>, between: Vectors<V>, bounds: V, setup: &Setup) -> V {
    let zero = V::splat(0.0);
    let squared_speed = between.dot(between).max(V::splat(f32::MIN_POSITIVE));
    let nearest = zero.sub(offset.dot(between)).div(squared_speed);
    let gap = offset.plus(between.scaled(nearest.max(zero).min(V::splat(setup.params.dt))));
    let near = bounds.add(V::splat(setup.params.speculative_distance));
    gap.dot(gap).sub(near.mul(near)).if_positive(V::splat(1.0), zero)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collide::broad_phase::tests::{Stuffed, any_tile};
    use crate::model::math::{dot, max, min};
    use crate::model::params::Instructions;
    use crate::parallel::lanes::LaneSet;
    use crate::testing::cases;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(cases(256))]

        /// As told one by one, in words of plain numbers.
        #[test]
        fn sixteen_at_once_are_culled_as_one_by_one(tile in any_tile(40, 3)) {
            let Stuffed { setup, tile: held, proxies } = &tile;
            let bodies = &held.bodies;
            let count = bodies.len() as u32;
            let all: Vec<Pair> = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b])).collect();
            let passes = |[a, b]: Pair| {
                let (offset, a, b) = (tile.offset([a, b]), a as usize, b as usize);
                let between = bodies.velocity[b] - bodies.velocity[a];
                let nearest = -dot(offset, between) / max(dot(between, between), f32::MIN_POSITIVE);
                let gap = offset + between * min(max(nearest, 0.0), setup.params.dt);
                let bound = |body: usize| setup.kind(bodies.kind[body]).bounding_radius;
                let near = bound(a) + bound(b) + setup.params.speculative_distance;
                let is_slow = setup.params.dt * dot(between, between).sqrt() < setup.params.speculative_distance;
                !is_slow && dot(gap, gap) > near * near
            };
            let is_near = |&pair: &Pair| proxies.is_wanted(pair) && tile.is_pair(pair) && !passes(pair);
            let expected: Vec<Pair> = all.iter().copied().filter(is_near).collect();
            for instructions in [Instructions::Auto, Instructions::Portable] {
                let mut near = vec![[7, 8]; all.len()];
                let cull = Cull { bodies, proxies, setup, candidates: &all, near: &mut near };
                let kept = LaneSet::of(instructions).unwrap().run(cull);
                prop_assert_eq!(&near[..kept], &expected);
            }
        }
    }
}
