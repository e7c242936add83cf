//! Discs and polygons, sixteen pairs at once: what `manifold/convex.rs` does for one, in the same words and with the same bits.

use super::manifolds::Manifolds;
use super::moments::{Points, Search, Shaped, Shapes};
use super::outlines::{Polygon, WideOutlines};
use super::pairs::{Pairs, WidePairs};
use crate::collide::broad_phase::Pair;
use crate::model::contact::Contact;
use crate::parallel::lanes::{Wide, WideRow};
use crate::parallel::vectors::Vectors;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// Sixteen pairs of a disc and a polygon.
#[derive(Default, Debug)]
pub(in crate::collide) struct WideDiscs {
    pairs: WidePairs,
    outlines: WideOutlines,
    /// One where the disc is body A, else zero.
    are_first: WideRow,
    /// Of bodies A and B.
    radii: [WideRow; 2],
}

impl Shaped for WideDiscs {
    const NEED_REGISTERS: bool = true;

    #[inline(always)]
    fn set(&mut self, lane: usize, tile: &Tile, bodies: Pair, known: Option<&Contact>, setup: &Setup) {
        let [a, b] = bodies.map(|body| &setup.kind(tile.bodies.kind[body as usize]).pieces[0]);
        let is_first = a.outline.count() == 1;
        self.pairs.set(lane, tile, bodies, known, setup);
        self.outlines.set(lane, if is_first { b } else { a });
        self.are_first[lane] = if is_first { 1.0 } else { 0.0 };
        (self.radii[0][lane], self.radii[1][lane]) = (a.radius, b.radius);
    }

    #[inline(always)]
    fn look<V: Wide>(&self, points: &mut Points, search: Search, setup: &Setup) {
        let mut pairs = self.pairs.load::<V>(setup);
        pairs.radius = [V::load(&self.radii[0]), V::load(&self.radii[1])];
        let outline = self.outlines.polygon(self.outlines.most_corners());
        points.look(&pairs, &Discs { outline, are_first: V::load(&self.are_first) }, search, setup);
    }
}

/// Polygons, in the frames of their bodies; the other of each pair is a disc.
struct Discs<V> {
    outline: Polygon<V>,
    /// One where the disc is body A, else zero.
    are_first: V,
}

impl<V: Wide> Shapes<V> for Discs<V> {
    const WITH_DISCS: bool = true;

    #[inline(always)]
    fn manifolds(&self, pairs: &Pairs<V>, offset: Vectors<V>, turning: [Vectors<V>; 2], _: V) -> Manifolds<V> {
        let (one, zero, half) = (V::splat(1.0), V::splat(0.0), V::splat(0.5));
        let none = Vectors::new(zero, zero);
        let rotation = [turning[0].rotate(pairs.rotation[0]), turning[1].rotate(pairs.rotation[1])];
        // In the frame of body A, be it the disc or not.
        let (turn, center) = (rotation[0].to(rotation[1]), rotation[0].unrotate(offset));
        let mut polygon = self.outline.seen(turn, center, self.outline.most);
        for i in 0..polygon.most {
            polygon.corners[i] = Vectors::pick(self.are_first, polygon.corners[i], self.outline.corners[i]);
            polygon.normals[i] = Vectors::pick(self.are_first, polygon.normals[i], self.outline.normals[i]);
        }
        let point = Vectors::pick(self.are_first, none, center.plus(turn.rotate(none)));
        let (outward, distance, _) = polygon.nearest(point);
        let normal = Vectors::pick(self.are_first, outward.opposite(), outward);
        let on_a = Vectors::pick(self.are_first, point, point.minus(outward.scaled(distance)));
        let separation = distance.sub(pairs.radius[0]).sub(pairs.radius[1]);
        let anchor = on_a.plus(normal.scaled(pairs.radius[0].add(half.mul(separation))));
        // Back to the frame of the world.
        let (normal, anchor) = (rotation[0].rotate(normal), rotation[0].rotate(anchor));
        Manifolds::single(one, normal, anchor, separation, zero)
    }
}
