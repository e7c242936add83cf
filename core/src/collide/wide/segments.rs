//! Segments of chains and convex pieces, sixteen pairs at once: what `manifold/chain.rs` does for one, in the same words and with the same
//! bits.

use super::manifolds::Manifolds;
use super::moments::{Points, Search, Shaped, Shapes, WidePieces};
use super::outlines::{Face, Polygon, WideOutlines, clip};
use super::pairs::{Pairs, WidePairs};
use crate::collide::broad_phase::Pair;
use crate::collide::manifold::chain::{ASLANT, BEYOND, FAR, Lies, SAME};
use crate::collide::touch::{LEAST_PART, LEAST_WAY, lies};
use crate::model::contact::Contact;
use crate::model::piece::{Joint, Piece};
use crate::parallel::lanes::{Quad, WIDE, Wide, WideRow};
use crate::parallel::vectors::{Vectors, less, negated};
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// A piece of one body of sixteen pairs, and the segment that the other is.
#[derive(Default, Debug)]
pub(in crate::collide) struct WideSegments {
    pairs: WidePairs,
    outlines: WideOutlines,
    /// Center of the piece; one where it [lies](Lies) on the segment, and how far behind it that may be.
    centers: [Quad; WIDE],
    /// From where to where the segment leads.
    ends: [Quad; WIDE],
    /// Where it starts, and where it ends: see [`joint`].
    joints: [[Quad; WIDE]; 2],
    /// One where the segment is body A, else zero.
    are_first: WideRow,
}

impl Shaped for WideSegments {
    const NEED_REGISTERS: bool = true;

    #[inline(always)]
    fn set(&mut self, lane: usize, tile: &Tile, bodies: Pair, known: Option<&Contact>, setup: &Setup) {
        let kinds = bodies.map(|body| setup.kind(tile.bodies.kind[body as usize]));
        let pieces = [&kinds[0].pieces[0], &kinds[1].pieces[0]];
        self.pairs.set(lane, tile, bodies, known, setup);
        self.set_pieces(lane, pieces, lies(pieces, known, setup));
    }

    #[inline(always)]
    fn look<V: Wide>(&self, points: &mut Points, search: Search, setup: &Setup) {
        let pairs = self.pairs.load::<V>(setup);
        let [center_x, center_y, lies, most_behind] = V::load_quads(&self.centers);
        let [from_x, from_y, to_x, to_y] = V::load_quads(&self.ends);
        let ends = [Vectors::new(from_x, from_y), Vectors::new(to_x, to_y)];
        let along = ends[1].minus(ends[0]);
        let length = along.dot(along).sqrt();
        let along = Vectors::new(along.x.div(length), along.y.div(length));
        let segments = Segments {
            outline: self.outlines.polygon(self.outlines.most_corners()),
            radius: self.outlines.radii(),
            center: Vectors::new(center_x, center_y),
            lies,
            most_behind,
            ends,
            length,
            along,
            n: Vectors::new(negated(along.y), along.x),
            joints: [Joints::load(&self.joints[0]), Joints::load(&self.joints[1])],
            are_first: V::load(&self.are_first),
        };
        points.look(&pairs, &segments, search, setup);
    }
}

impl WidePieces for WideSegments {
    #[inline(always)]
    fn pairs(&mut self) -> &mut WidePairs {
        &mut self.pairs
    }

    #[inline(always)]
    fn set_pieces(&mut self, lane: usize, [a, b]: [&Piece; 2], lies: Lies) {
        let ([piece, segment], is_first) = if a.side.is_some() { ([b, a], 1.0) } else { ([a, b], 0.0) };
        self.are_first[lane] = is_first;
        self.outlines.set(lane, piece);
        let (is_lying, most) = lies.map_or((0.0, 0.0), |most| (1.0, most));
        self.centers[lane] = [piece.center.x, piece.center.y, is_lying, most];
        let [to, from] = segment.outline.edge(0);
        self.ends[lane] = [from.x, from.y, to.x, to.y];
        let side = segment.side.expect("a segment is solid from one side");
        (self.joints[0][lane], self.joints[1][lane]) = (joint(side.start), joint(side.end));
    }
}

/// The last normal that a contact may have there; whether there are any; and whether it juts out, as one that is no joint does not.
#[inline(always)]
fn joint(joint: Joint) -> Quad {
    match joint {
        Joint::Free(limit) => [limit.x, limit.y, 1.0, 0.0],
        Joint::Convex { normal, is_end } => [normal.x, normal.y, if is_end { 1.0 } else { 0.0 }, 1.0],
        Joint::Concave => [0.0; 4],
    }
}

/// Ends of sixteen segments: see [`joint`].
struct Joints<V> {
    limit: Vectors<V>,
    touches: V,
    juts_out: V,
}

impl<V: Wide> Joints<V> {
    #[inline(always)]
    fn load(quads: &[Quad; WIDE]) -> Self {
        let [x, y, touches, juts_out] = V::load_quads(quads);
        Self { limit: Vectors::new(x, y), touches, juts_out }
    }
}

/// Sixteen segments, in the frames of their bodies, and pieces in those of theirs.
struct Segments<V> {
    outline: Polygon<V>,
    radius: V,
    center: Vectors<V>,
    /// One where the piece [lies](Lies) on the segment, else zero; and how far behind that it may be.
    lies: V,
    most_behind: V,
    ends: [Vectors<V>; 2],
    length: V,
    along: Vectors<V>,
    n: Vectors<V>,
    joints: [Joints<V>; 2],
    /// One where it is of body A, else zero.
    are_first: V,
}

/// Manifolds at a corner, with a radius around it, so high over a segment.
#[inline(always)]
fn at_corner<V: Wide>(some: V, corner: Vectors<V>, height: V, n: Vectors<V>, radius: V, feature: V) -> Manifolds<V> {
    let separation = height.sub(radius);
    let anchor = corner.minus(n.scaled(height.sub(V::splat(0.5).mul(separation))));
    Manifolds::single(some, n, anchor, separation, feature)
}

/// One where a manifold is further than what makes a contact.
#[inline(always)]
fn is_far<V: Wide>(found: &Manifolds<V>) -> V {
    let (_, separation) = found.least();
    less(V::splat(FAR), separation)
}

/// Pieces at one end of their segments.
struct AtEnd<V> {
    distance: V,
    found: Manifolds<V>,
}

impl<V: Wide> AtEnd<V> {
    /// Nowhere yet.
    #[inline(always)]
    fn none() -> Self {
        let (zero, none) = (V::splat(0.0), Vectors::new(V::splat(0.0), V::splat(0.0)));
        Self { distance: V::splat(f32::INFINITY), found: Manifolds::single(zero, none, none, zero, zero) }
    }

    /// Takes another where it is asked to, and that is nearer.
    #[inline(always)]
    fn take(&mut self, asked: V, distance: V, found: &Manifolds<V>) {
        let nearer = less(distance, self.distance).mul(asked);
        self.distance = nearer.if_positive(distance, self.distance);
        self.found = Manifolds::pick(nearer, found, &self.found);
    }
}

/// Zero where a number is positive, else one.
#[inline(always)]
fn not<V: Wide>(positive: V) -> V {
    positive.if_positive(V::splat(0.0), V::splat(1.0))
}

/// One where `a >= b`, else zero.
#[inline(always)]
fn at_least<V: Wide>(a: V, b: V) -> V {
    not(less(a, b))
}

/// How far a unit vector is turned from one to another: the sine of that angle.
#[inline(always)]
fn turned<V: Wide>(from: Vectors<V>, v: Vectors<V>, to: Vectors<V>) -> V {
    let (zero, one) = (V::splat(0.0), V::splat(1.0));
    less(from.cross(to), zero).if_positive(zero.sub(one), one).mul(from.cross(v))
}

impl<V: Wide> Segments<V> {
    /// One where a place along the segment is between its ends.
    #[inline(always)]
    fn is_over(&self, place: V) -> V {
        at_least(place, V::splat(0.0)).mul(at_least(self.length, place))
    }

    /// Along the segment's own normal, as far as the piece, of which some are but a corner, is over it.
    #[inline(always)]
    fn against_face(&self, other: &Polygon<V>, single: V) -> Manifolds<V> {
        let Self { n, radius, .. } = *self;
        let (one, zero) = (V::splat(1.0), V::splat(0.0));
        let [from, to] = self.ends;
        let mut edge = Face::none();
        for number in 0..other.most {
            let against = zero.sub(other.normals[number].dot(n));
            edge = Face::pick(against.sub(edge.figure), &other.face(number, against), &edge);
        }
        let clipped = clip([to, from], n, edge.ends, [zero, radius]);
        let feature = edge.number.add(edge.number);
        let over = Manifolds {
            some: not(clipped.none),
            two: clipped.two,
            tells: V::splat(0.0),
            normal: n,
            anchor: clipped.anchor,
            separation: clipped.separation,
            feature: [feature, feature.add(one)],
        };
        let point = other.corners[0];
        let way = to.minus(from);
        let (along, height, square) = (point.minus(from).dot(way), point.minus(from).dot(n), way.dot(way));
        let beyond = V::splat(BEYOND);
        let is_over = at_least(along, zero.sub(beyond).mul(square)).mul(at_least(one.add(beyond).mul(square), along));
        Manifolds::pick(single, &at_corner(is_over, point, height, n, radius, zero), &over)
    }

    /// One where corners and edges of the piece come between the ends of the segment at one of some heights.
    #[inline(always)]
    fn comes_to(&self, other: &Polygon<V>, [lowest, highest]: [V; 2]) -> V {
        let Self { along, n, .. } = *self;
        let (mut low, mut high) = (V::splat(f32::INFINITY), V::splat(f32::NEG_INFINITY));
        for number in 0..other.most {
            let ends = other.face(number, low).ends;
            let (here, there) = (ends[0].minus(self.ends[0]), ends[1].minus(self.ends[0]));
            let (first, last) = (here.dot(n), there.dot(n));
            let (lower, upper) = (first.min(last).max(lowest), first.max(last).min(highest));
            let (fall, comes) = (first.sub(last), at_least(upper, lower));
            let is_level = not(fall.max(last.sub(first)));
            for (height, part) in [(lower, V::splat(0.0)), (upper, V::splat(1.0))] {
                let part = is_level.if_positive(part, first.sub(height).div(fall));
                let place = here.plus(there.minus(here).scaled(part)).dot(along);
                low = comes.if_positive(low.min(place), low);
                high = comes.if_positive(high.max(place), high);
            }
        }
        at_least(self.length, low).mul(at_least(high, V::splat(0.0)))
    }

    /// What is between each segment and a piece, seen from the segment.
    #[inline(always)]
    fn collide(&self, other: &Polygon<V>, center: Vectors<V>, reach: V) -> Manifolds<V> {
        let Self { radius, length, along, n, .. } = *self;
        let zero = V::splat(0.0);
        let from = self.ends[0];
        let single = less(other.count, V::splat(2.0));
        let (mut lowest, mut corner, mut number) = (V::splat(f32::INFINITY), other.corners[0], zero);
        let mut highest = V::splat(f32::NEG_INFINITY);
        let (mut first, mut last) = (lowest, highest);
        for (i, &at) in other.corners[..other.most].iter().enumerate() {
            let (height, place) = (at.minus(from).dot(n), at.minus(from).dot(along));
            let lower = less(height, lowest);
            corner = Vectors::pick(lower, at, corner);
            number = lower.if_positive(V::splat(i as f32), number);
            lowest = lower.if_positive(height, lowest);
            (highest, first, last) = (height.max(highest), place.min(first), place.max(last));
        }
        let far = reach.add(radius);
        let beyond = less(far, lowest).max(less(highest, zero.sub(far)));
        let beyond = beyond.max(less(length.add(far), first)).max(less(last, zero.sub(far)));
        let is_over = self.is_over(corner.minus(from).dot(along));
        let from_center = center.minus(from);
        let is_pressed = at_least(highest.add(radius), zero.sub(self.most_behind)).mul(self.lies);
        let is_pressed = is_pressed.mul(self.is_over(from_center.dot(along)));
        let is_before = is_pressed.max(at_least(from_center.dot(n), zero));
        let against = self.against_face(other, single);
        // A round one with an edge that leans out beyond the end comes down with the edge's other corner.
        let of_lowest = at_corner(is_over, corner, lowest, n, radius, V::splat(512.0).add(number));
        let mut over = Manifolds::pick(against.some, &against, &of_lowest);
        over.some = over.some.mul(is_before);
        // What is between the ends has nothing to do with these.
        let margin = V::splat(BEYOND).mul(length);
        let is_within = at_least(first, margin).mul(at_least(length.sub(margin), last));
        let behind = zero.sub(radius.add(self.most_behind));
        let mut done = over.some.mul(is_within).mul(at_least(highest, behind)).max(beyond);
        if !not(done).any_positive() {
            over.some = beyond.if_positive(zero, over.some);
            return over;
        }
        let at_ends = [nearest_of(other, self.ends[0], single), nearest_of(other, self.ends[1], single)];
        // What has come behind the segment around an end of it is not pressed into its face.
        let doubtful = done.if_positive(zero, less(over.least().1, zero).mul(over.some));
        if doubtful.any_positive() {
            // Its lowest corner may be above the surface by no more than rounding then.
            let comes = self.comes_to(other, [behind, radius.max(lowest)]);
            let comes = comes.max(at_least(radius, at_ends[0].1)).max(at_least(radius, at_ends[1].1));
            over.some = doubtful.if_positive(comes, over.some);
        }
        // What lies over the segment with its nearest point is nearest there.
        done = done.max(over.some.mul(less(zero, lowest)).mul(is_over));
        let at_end = self.at_ends(at_ends, center, [single, is_before], &over, lowest);
        let mut found = Manifolds::pick(done, &over, &at_end);
        found.some = beyond.if_positive(zero, found.some);
        found
    }

    /// Whether a point is an end that something leaves.
    #[inline(always)]
    fn is_at_left_end(&self, point: Vectors<V>, [start, end]: [V; 2]) -> V {
        let place = point.minus(self.ends[0]).dot(self.along);
        let margin = V::splat(BEYOND).mul(self.length);
        start.mul(at_least(margin, place)).max(end.mul(at_least(place, self.length.sub(margin))))
    }

    /// The same of those whose ends count, from the direction and the distance of the piece at these; `over` is what is along the normal.
    #[inline(always)]
    fn at_ends(
        &self,
        nearest_at: [(Vectors<V>, V); 2],
        center: Vectors<V>,
        [single, is_before]: [V; 2],
        over: &Manifolds<V>,
        lowest: V,
    ) -> Manifolds<V> {
        let n = self.n;
        let (zero, half) = (V::splat(0.0), V::splat(0.5));
        let (mut touched, mut nearest) = (AtEnd::none(), AtEnd::none());
        let is_near = at_least(self.radius, lowest);
        let is_in_front = at_least(center.minus(self.ends[0]).dot(n), zero);
        // How far from a joint what comes out there rather along the normal of the next segment; and where it does along its own.
        let (mut beyond, mut leaves) = (V::splat(f32::NEG_INFINITY), [zero; 2]);
        let far = single.if_positive(zero, V::splat(SAME));
        for (number, (&end, joint)) in self.ends.iter().zip(&self.joints).enumerate() {
            let (outward, distance) = nearest_at[number];
            let normal = outward.opposite();
            let limit = joint.limit;
            let from_n = turned(n, normal, limit);
            let goes_on = at_least(from_n, far).mul(at_least(normal.dot(limit), normal.dot(n)));
            beyond = goes_on.mul(joint.juts_out).if_positive(beyond.max(distance), beyond);
            let is_aslant =
                at_least(from_n, V::splat(ASLANT)).mul(is_near).mul(is_in_front).mul(less(lowest, distance));
            leaves[number] = goes_on.if_positive(zero, is_aslant.mul(joint.juts_out));
            let is_out = is_before.max(at_least(center.minus(end).dot(limit), zero));
            let from_limit = joint.juts_out.if_positive(far, zero.sub(far));
            let is_between = at_least(from_n, far).mul(at_least(turned(limit, normal, n), from_limit));
            let may = is_between.mul(joint.touches).mul(is_out);
            let separation = distance.sub(self.radius);
            let anchor = end.plus(normal.scaled(half.mul(separation)));
            let feature = single.if_positive(zero, V::splat(256.0 + number as f32));
            let found = Manifolds::single(V::splat(1.0), normal, anchor, separation, feature);
            touched.take(may, distance, &found);
            // Whoever is on the solid side, but for a joint, is let through.
            nearest.take(is_before, distance, &found);
        }
        // There the next segment has it, or this one from the joint.
        let over =
            &over.without([self.is_at_left_end(over.anchor[0], leaves), self.is_at_left_end(over.anchor[1], leaves)]);
        let (has_over, has_nearest) = (over.some, nearest.found.some);
        let is_touched = touched.found.some.mul(not(is_far(&touched.found)));
        // What lies over an edge is deep in the wall below it, or within its rounding, and touches what is before the edge; and along the segment's normal what
        // reaches beyond it may be nearer than what is over it.
        let is_below = is_near.mul(less(lowest, beyond));
        let is_nearer = is_far(over).mul(is_far(&nearest.found));
        let only_nearest = not(is_touched).mul(has_nearest);
        let tells = only_nearest.mul(has_over.if_positive(is_below.max(is_nearer), V::splat(1.0)));
        // Both are ways out.
        let is_way_out = has_over.mul(at_least(zero, lowest)).mul(at_least(lowest, touched.distance));
        let takes_over = has_over.mul(not(is_touched).max(is_way_out));
        let found = Manifolds::pick(takes_over, over, &touched.found);
        let mut found = Manifolds::pick(tells, &nearest.found, &found);
        found.tells = tells;
        found
    }
}

/// As [`Convex::nearest`](crate::model::convex::Convex::nearest), where some are but a corner: direction and distance.
#[inline(always)]
fn nearest_of<V: Wide>(other: &Polygon<V>, point: Vectors<V>, single: V) -> (Vectors<V>, V) {
    let (one, zero) = (V::splat(1.0), V::splat(0.0));
    let (normal, height, _) = other.nearest(point);
    let away = point.minus(other.corners[0]);
    let distance = away.dot(away).sqrt();
    let direction = Vectors::new(away.x.div(distance), away.y.div(distance));
    let direction = Vectors::pick(distance, direction, Vectors::new(zero, one));
    (Vectors::pick(single, direction, normal), single.if_positive(distance, height))
}

impl<V: Wide> Shapes<V> for Segments<V> {
    const OF_SEGMENTS: bool = true;
    const WITH_DISCS: bool = true;

    #[inline(always)]
    fn least_way(&self) -> V {
        V::splat(LEAST_WAY).min(V::splat(LEAST_PART).mul(self.length))
    }

    #[inline(always)]
    fn manifolds(&self, pairs: &Pairs<V>, offset: Vectors<V>, turning: [Vectors<V>; 2], reach: V) -> Manifolds<V> {
        let rotation = [turning[0].rotate(pairs.rotation[0]), turning[1].rotate(pairs.rotation[1])];
        let way = Vectors::pick(self.are_first, offset, offset.opposite());
        let own = Vectors::pick(self.are_first, rotation[0], rotation[1]);
        let (turn, seen) = (own.to(Vectors::pick(self.are_first, rotation[1], rotation[0])), own.unrotate(way));
        let other = self.outline.seen(turn, seen, self.outline.most);
        let center = turn.rotate(self.center).plus(seen);
        let mut found = self.collide(&other, center, reach);
        // Back to the frame of the world, and of body A.
        let normal = own.rotate(found.normal);
        found.normal = Vectors::pick(self.are_first, normal, normal.opposite());
        for anchor in &mut found.anchor {
            let from_center = own.rotate(*anchor);
            *anchor = Vectors::pick(self.are_first, from_center, from_center.plus(offset));
        }
        found
    }
}

#[cfg(test)]
mod tests;
