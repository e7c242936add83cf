//! The candidates that may touch, sorted.

use super::GRAIN;
use crate::collide::broad_phase::Pair;
use crate::collide::cull::Cull;
use crate::collide::proxies::Proxies;
use crate::parallel::team::Team;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// Pairs, ascending.
#[derive(Default, Debug)]
pub(super) struct Sorted {
    /// What is left of each piece of the candidates.
    near: Vec<Near>,
    /// For each body that may be a pair's first where its pairs end, among those of its part of the bodies.
    ends: Vec<u32>,
    pairs: Vec<Pair>,
}

#[derive(Default, Debug)]
struct Near {
    /// The first `kept` of these; what an earlier step left behind them is written over, which saves filling it with zeros.
    pairs: Vec<Pair>,
    kept: usize,
    /// The same pairs by the part of the bodies in which their first one lies, where there are several.
    of_part: Vec<Vec<Pair>>,
}

impl Near {
    fn pairs(&self) -> &[Pair] {
        &self.pairs[..self.kept]
    }

    /// Deals out the pairs to parts, into which so many bodies are cut.
    fn deal(&mut self, bodies: usize, parts: usize) {
        self.of_part.resize_with(parts, Vec::new);
        self.of_part.iter_mut().for_each(Vec::clear);
        for &pair in &self.pairs[..self.kept] {
            self.of_part[pair[0] as usize * parts / bodies].push(pair);
        }
    }

    fn of_part(&self, part: usize) -> &[Pair] {
        self.of_part.get(part).map_or(self.pairs(), |pairs| pairs)
    }
}

impl Sorted {
    /// Keeps those of some candidates that may touch, sorted.
    pub(super) fn find(&mut self, tile: &Tile, proxies: &Proxies, candidates: &[Pair], setup: &Setup, team: Team) {
        let bodies = proxies.pairing;
        let pieces = team.pieces(candidates.len(), GRAIN);
        let parts = pieces.min(team.size());
        self.near.resize_with(pieces, Near::default);
        let near = team.ranges(candidates.len(), GRAIN).zip(&mut self.near).collect();
        team.for_each(near, |(range, near)| {
            if near.pairs.len() < range.len() {
                near.pairs.resize(range.len(), [0, 0]);
            }
            let (candidates, room) = (&candidates[range], &mut near.pairs);
            near.kept = setup.lanes.run(Cull { bodies: &tile.bodies, proxies, setup, candidates, near: room });
            if setup.filters {
                let kind = |body: u32| setup.kind(tile.bodies.kind[body as usize]);
                near.pairs.truncate(near.kept);
                near.pairs.retain(|&[a, b]| kind(a).touches(kind(b)));
                near.kept = near.pairs.len();
            }
            near.of_part.clear();
            if parts > 1 {
                near.deal(bodies, parts);
            }
        });
        self.ends.resize(bodies, 0);
        self.pairs.resize(self.near.iter().map(|near| near.kept).sum(), [0, 0]);
        let (near, mut ends, mut pairs) = (&self.near, &mut self.ends[..], &mut self.pairs[..]);
        let parts = (0..parts).map(|part| {
            const ENOUGH: &str = "as many are left";
            let [first, end] = [part, part + 1].map(|part| (part * bodies).div_ceil(parts));
            let count = near.iter().map(|near| near.of_part(part).len()).sum();
            let (ends, pairs) = (ends.split_off_mut(..end - first), pairs.split_off_mut(..count));
            (part, first, ends.expect(ENOUGH), pairs.expect(ENOUGH))
        });
        team.for_each(parts.collect(), |(part, first, ends, pairs)| {
            sort(|| near.iter().flat_map(|near| near.of_part(part)).copied(), first, ends, pairs);
        });
    }

    pub(super) fn pairs(&self) -> &[Pair] {
        &self.pairs
    }
}

/// Sorts pairs: counted by their lower index, which begins with `first`, then by hand within the few of each body.
fn sort<I: Iterator<Item = Pair>>(pairs: impl Fn() -> I, first: usize, ends: &mut [u32], sorted: &mut [Pair]) {
    ends.fill(0);
    pairs().for_each(|pair| ends[pair[0] as usize - first] += 1);
    let mut sum = 0;
    for end in &mut *ends {
        (sum, *end) = (sum + *end, sum);
    }
    pairs().for_each(|pair| {
        let place = &mut ends[pair[0] as usize - first];
        sorted[*place as usize] = pair;
        *place += 1;
    });
    let mut begin = 0;
    for &end in &*ends {
        let own = &mut sorted[begin..end as usize];
        if own.len() > 1 {
            own.sort_unstable();
        }
        begin = end as usize;
    }
}
