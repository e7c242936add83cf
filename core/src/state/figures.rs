//! What a step left behind, in figures that are the same however tiles are spread over ranks and threads.
//!
//! Each piece of a tile's bodies and contacts is added up in order, and the sums of the pieces without any rounding: so they can
//! be joined in any order, and nobody has to hear of every tile.

use super::sum::ExactSum;
use crate::collide::narrow_phase::Contacts;
use crate::model::body::Bodies;
use crate::parallel::lanes::{Kernel, Lanes};
use crate::parallel::team::Team;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use bytemuck::{Pod, Zeroable};
use glam::{DVec2, Vec2};
use std::ops::Range;

#[cfg(test)]
mod tests;

/// Bodies, and contacts, in a piece: part of what sums round to, so threads have no say in it.
const PIECE: usize = 4096;

/// The figures of a world, or of a part of it, after a step: energies and momenta of its bodies, and the contacts of that step
/// as they were found, with the bodies where they were when it began. Plain data, so that ranks can gather them as bytes.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Figures {
    /// Bodies.
    pub bodies: u64,
    /// Touching manifolds (a point nearer than the speculative distance), each counted by one tile.
    pub contacts: u64,
    /// Those of them between bodies of two tiles.
    pub border_contacts: u64,
    /// Contact points that overlap.
    pub overlaps: u64,
    /// The bits of the deepest of them.
    most: u64,
    depth: ExactSum,
    kinetic: ExactSum,
    potential: ExactSum,
    momentum: [ExactSum; 2],
    angular: ExactSum,
}

impl Figures {
    /// Energy of motion, rotation included, in J.
    pub fn kinetic_energy(&self) -> f64 {
        self.kinetic.value()
    }

    /// Energy in the field of gravity, in J: zero at the low corner of the domain.
    pub fn potential_energy(&self) -> f64 {
        self.potential.value()
    }

    /// Sum of mass times velocity, in kg m/s.
    pub fn momentum(&self) -> [f64; 2] {
        self.momentum.map(|sum| sum.value())
    }

    /// Angular momentum about the origin of the world, counter-clockwise, spins included, in kg m^2/s.
    pub fn angular_momentum(&self) -> f64 {
        self.angular.value()
    }

    /// Mean depth of the contact points that overlap, in meters.
    pub fn mean_overlap(&self) -> f64 {
        if self.overlaps > 0 { self.depth.value() / self.overlaps as f64 } else { 0.0 }
    }

    /// The greatest depth, in meters.
    pub fn max_overlap(&self) -> f64 {
        f64::from_bits(self.most)
    }

    /// Adds those of another part. The order makes no difference.
    pub fn merge(&mut self, other: &Self) {
        self.bodies += other.bodies;
        self.contacts += other.contacts;
        self.border_contacts += other.border_contacts;
        self.overlaps += other.overlaps;
        // Depths are not negative, and sorted as their bits are.
        self.most = self.most.max(other.most);
        self.depth.merge(&other.depth);
        self.kinetic.merge(&other.kinetic);
        self.potential.merge(&other.potential);
        self.momentum.iter_mut().zip(&other.momentum).for_each(|(sum, other)| sum.merge(other));
        self.angular.merge(&other.angular);
    }

    /// Adds the bodies of a tile.
    pub(crate) fn add_bodies(&mut self, tile: &Tile, setup: &Setup, team: Team) {
        self.bodies += tile.owned as u64;
        let [gravity_x, gravity_y] = setup.params.gravity.as_dvec2().to_array();
        let sum = |range| setup.lanes.run(SumBodies { bodies: &tile.bodies, range, setup });
        in_pieces(tile.owned, team, sum, |sums: BodySums| {
            self.kinetic.add(0.5 * sums.twice_kinetic);
            self.potential.add(-(gravity_x * sums.moment[0] + gravity_y * sums.moment[1]));
            self.momentum.iter_mut().zip(sums.momentum).for_each(|(sum, part)| sum.add(part));
            self.angular.add(sums.angular);
        });
    }

    /// Adds the contacts that a tile found.
    pub(crate) fn add_contacts(&mut self, tile: &Tile, contacts: &Contacts, setup: &Setup, team: Team) {
        let count = |range| Overlaps::among(tile, contacts, range, setup);
        in_pieces(tile.contacts.own(), team, count, |found: Overlaps| {
            self.contacts += found.contacts;
            self.border_contacts += found.border_contacts;
            self.overlaps += found.points;
            self.depth.add(found.depth);
            self.most = self.most.max(found.most.to_bits());
        });
    }
}

/// Does the pieces of some things, and takes in what comes of them.
fn in_pieces<R: Send>(len: usize, team: Team, work: impl Fn(Range<usize>) -> R + Sync, take: impl FnMut(R)) {
    let pieces = (0..len).step_by(PIECE).map(|start| start..len.min(start + PIECE));
    if team.is_alone() {
        pieces.map(work).for_each(take);
    } else {
        team.for_each(pieces.collect(), work).into_iter().for_each(take);
    }
}

/// Contacts counted, and how deep their points lie in each other.
#[derive(Default)]
pub(super) struct Overlaps {
    pub(super) contacts: u64,
    pub(super) border_contacts: u64,
    /// Those that overlap.
    pub(super) points: u64,
    /// The sum of their depths, in meters.
    pub(super) depth: f64,
    pub(super) most: f64,
}

impl Overlaps {
    /// Among some contacts of a tile.
    pub(super) fn among(tile: &Tile, contacts: &Contacts, range: Range<usize>, setup: &Setup) -> Self {
        let mut all = Self::default();
        let (keys, known) = (&tile.contacts.keys[range.clone()], &tile.contacts.contacts[range.clone()]);
        let (separations, bodies) = (&contacts.separation[range.clone()], &contacts.bodies[range]);
        for (((key, contact), separation), [a, _]) in keys.iter().zip(known).zip(separations).zip(bodies) {
            // Both owners of a border contact see it; the one with body A counts it.
            let border = key.is_border();
            if border && *a as usize >= tile.owned {
                continue;
            }
            let separation = &separation[..contact.point_count()];
            let touching = separation.iter().any(|&s| s < setup.params.speculative_distance);
            all.contacts += u64::from(touching);
            all.border_contacts += u64::from(touching && border);
            for &separation in separation.iter().filter(|&&s| s < 0.0) {
                let depth = -f64::from(separation);
                all.points += 1;
                all.depth += depth;
                all.most = if depth > all.most { depth } else { all.most };
            }
        }
        all
    }
}

/// What the bodies of a piece come to.
#[derive(Default)]
struct BodySums {
    twice_kinetic: f64,
    /// Of the masses that gravity pulls, about the low corner of the domain.
    moment: [f64; 2],
    momentum: [f64; 2],
    angular: f64,
}

struct SumBodies<'a> {
    bodies: &'a Bodies,
    range: Range<usize>,
    setup: &'a Setup,
}

/// How many bodies are added up side by side: part of what sums round to, whatever a register holds.
const WIDTH: usize = 4;

/// A number of each of some bodies.
type Wide = [f64; WIDTH];

#[inline(always)]
fn each(value: impl Fn(usize) -> f64) -> Wide {
    std::array::from_fn(value)
}

#[inline(always)]
fn add(a: Wide, b: Wide) -> Wide {
    each(|k| a[k] + b[k])
}

#[inline(always)]
fn sub(a: Wide, b: Wide) -> Wide {
    each(|k| a[k] - b[k])
}

#[inline(always)]
fn mul(a: Wide, b: Wide) -> Wide {
    each(|k| a[k] * b[k])
}

/// Sums of the bodies at each place of their four.
#[derive(Default)]
struct WideSums {
    twice_kinetic: Wide,
    moment: [Wide; 2],
    momentum: [Wide; 2],
    angular: Wide,
}

impl WideSums {
    /// Adds four bodies: masses, moments of inertia and masses that gravity pulls, places, velocities and spins.
    #[inline(always)]
    fn add(
        &mut self,
        masses: [[f32; 3]; WIDTH],
        positions: &[DVec2; WIDTH],
        velocities: &[Vec2; WIDTH],
        spins: &[f32; WIDTH],
        setup: &Setup,
    ) {
        let low = setup.partition.min();
        let [mass, inertia, pulled] = [0, 1, 2].map(|column| each(|k| f64::from(masses[k][column])));
        let (x, y) = (each(|k| positions[k].x), each(|k| positions[k].y));
        let (dx, dy) = (sub(x, [low.x; WIDTH]), sub(y, [low.y; WIDTH]));
        let (vx, vy) = (each(|k| f64::from(velocities[k].x)), each(|k| f64::from(velocities[k].y)));
        let w = each(|k| f64::from(spins[k]));
        let (px, py, spin) = (mul(mass, vx), mul(mass, vy), mul(inertia, w));
        self.momentum = [add(self.momentum[0], px), add(self.momentum[1], py)];
        self.moment = [add(self.moment[0], mul(pulled, dx)), add(self.moment[1], mul(pulled, dy))];
        self.twice_kinetic = add(self.twice_kinetic, add(add(mul(px, vx), mul(py, vy)), mul(spin, w)));
        self.angular = add(self.angular, add(sub(mul(x, py), mul(y, px)), spin));
    }

    fn total(self) -> BodySums {
        let total = |[a, b, c, d]: Wide| (a + b) + (c + d);
        BodySums {
            twice_kinetic: total(self.twice_kinetic),
            moment: self.moment.map(total),
            momentum: self.momentum.map(total),
            angular: total(self.angular),
        }
    }
}

impl Kernel for SumBodies<'_> {
    type Output = BodySums;
    #[inline(always)]
    fn run<V: Lanes>(self) -> BodySums {
        let Self { bodies, range, setup } = self;
        let (positions, velocities) = (&bodies.position[range.clone()], &bodies.velocity[range.clone()]);
        let (spins, kinds) = (&bodies.angular_velocity[range.clone()], &bodies.kind[range]);
        let mut sums = WideSums::default();
        let (positions, last_positions) = positions.as_chunks();
        let (velocities, last_velocities) = velocities.as_chunks();
        let (spins, last_spins) = spins.as_chunks();
        let (kinds, last_kinds) = kinds.as_chunks();
        for (((positions, velocities), spins), kinds) in positions.iter().zip(velocities).zip(spins).zip(kinds) {
            let masses = kinds.map(|kind| setup.kind(kind).masses());
            sums.add(masses, positions, velocities, spins, setup);
        }
        // Where there are fewer than four, the others weigh nothing.
        let few = last_positions.len();
        if few > 0 {
            let (mut positions, mut velocities, mut spins) = ([DVec2::ZERO; WIDTH], [Vec2::ZERO; WIDTH], [0.0; WIDTH]);
            positions[..few].copy_from_slice(last_positions);
            velocities[..few].copy_from_slice(last_velocities);
            spins[..few].copy_from_slice(last_spins);
            let masses = std::array::from_fn(|k| last_kinds.get(k).map_or([0.0; 3], |&kind| setup.kind(kind).masses()));
            sums.add(masses, &positions, &velocities, &spins, setup);
        }
        sums.total()
    }
}
