//! Manifolds against the distance of outlines, found by trying every edge against every edge.

use super::{Manifold, collide, convex, scale_of};
use crate::model::id::KindId;
use crate::model::kind::{Kind, KindRow, Material};
use crate::model::math::Rot;
use crate::model::shape::{Segment, Shape};
use crate::testing::{any_convex, any_rotation, cases, circle, distance, outline, rectangle};
use glam::{DVec2, Vec2};
use proptest::prelude::*;
use std::ops::Range;

/// Two bodies; B lies at `offset` from A.
#[derive(Clone, Debug)]
struct Two {
    a: Kind,
    rot_a: Rot,
    b: Kind,
    rot_b: Rot,
    offset: Vec2,
}

fn row(kind: &Kind) -> KindRow {
    KindRow::dynamic(kind, KindId(0)).unwrap()
}

impl Two {
    /// With no end of a reach: a manifold, however far they are apart.
    fn manifold(&self) -> Manifold {
        self.within(f32::INFINITY)
    }

    fn within(&self, reach: f32) -> Manifold {
        let (a, b) = (row(&self.a), row(&self.b));
        if !(a.form.is_simple() && b.form.is_simple()) {
            self.of_pieces_within(reach)
        } else {
            collide(&a, self.rot_a, &b, self.rot_b, self.offset, reach)
        }
    }

    /// As if both were made of pieces.
    fn of_pieces(&self) -> Manifold {
        self.of_pieces_within(f32::INFINITY)
    }

    fn of_pieces_within(&self, reach: f32) -> Manifold {
        let (a, b) = (row(&self.a), row(&self.b));
        let (pieces, rotations) = ([&a.pieces[0], &b.pieces[0]], [self.rot_a, self.rot_b]);
        let scale = scale_of([a.bounding_radius, b.bounding_radius]);
        convex::collide(pieces, rotations, self.offset, (reach, scale), None)
    }

    fn swapped(&self) -> Self {
        let (a, b) = (self.b.clone(), self.a.clone());
        Self { a, rot_a: self.rot_b, b, rot_b: self.rot_a, offset: -self.offset }
    }

    fn distance(&self) -> f64 {
        distance(&self.a.shape, self.rot_a, &self.b.shape, self.rot_b, self.offset)
    }

    /// The length that errors are measured by.
    fn size(&self) -> f32 {
        let radius = |kind: &Kind| kind.shape.bounding_radius();
        radius(&self.a) + radius(&self.b) + self.offset.length()
    }

    fn rounding(&self) -> f32 {
        4e-6 * self.size()
    }

    fn has_circle(&self) -> bool {
        [&self.a, &self.b].iter().any(|kind| matches!(kind.shape, Shape::Circle { .. }))
    }

    /// How deep they are in each other: the least way out across the edges of both and in 720 other directions.
    fn sampled_depth(&self) -> f64 {
        let (corners_a, round_a) = outline(&self.a.shape, self.rot_a, DVec2::ZERO);
        let (corners_b, round_b) = outline(&self.b.shape, self.rot_b, self.offset.as_dvec2());
        let across = |corners: &[DVec2]| -> Vec<DVec2> {
            let next = corners.iter().cycle().skip(1);
            corners.iter().zip(next).map(|(from, to)| (to - from).perp().normalize_or_zero()).collect()
        };
        let depth = |axis: DVec2| {
            let front_a = corners_a.iter().map(|corner| corner.dot(axis)).fold(f64::NEG_INFINITY, f64::max) + round_a;
            let back_b = corners_b.iter().map(|corner| corner.dot(axis)).fold(f64::INFINITY, f64::min) - round_b;
            front_a - back_b
        };
        let axes = across(&corners_a).into_iter().chain(across(&corners_b)).filter(|&axis| axis != DVec2::ZERO);
        let axes = axes.flat_map(|axis| [axis, -axis]);
        let around = (0..720).map(|k| DVec2::from_angle(f64::from(k) * std::f64::consts::TAU / 720.0));
        axes.chain(around).map(depth).fold(f64::INFINITY, f64::min)
    }
}

impl Two {
    /// Of shapes whose cores meet: the least way out across an edge of either.
    fn exact_depth(&self) -> f64 {
        let (corners_a, round_a) = outline(&self.a.shape, self.rot_a, DVec2::ZERO);
        let (corners_b, round_b) = outline(&self.b.shape, self.rot_b, self.offset.as_dvec2());
        let mut least = f64::INFINITY;
        for (own, other) in [(&corners_a, &corners_b), (&corners_b, &corners_a)] {
            for (from, to) in own.iter().zip(own.iter().cycle().skip(1)) {
                let along = (to - from).normalize_or_zero();
                // Two discs, whose cores are one point, part in any direction.
                let axes = if along == DVec2::ZERO { vec![] } else { vec![-along.perp(), along.perp(), along, -along] };
                for axis in axes {
                    let front = own.iter().map(|corner| corner.dot(axis)).fold(f64::NEG_INFINITY, f64::max);
                    let back = other.iter().map(|corner| corner.dot(axis)).fold(f64::INFINITY, f64::min);
                    least = least.min(front - back);
                }
            }
        }
        (if least.is_finite() { least } else { 0.0 }) + round_a + round_b
    }
}

fn least(manifold: &Manifold) -> f32 {
    manifold.points().iter().map(|point| point.separation).fold(f32::INFINITY, f32::min)
}

/// Sizes within two orders of magnitude; the centers as far apart as a part of the bounding radii together.
fn any_two(part: Range<f32>) -> impl Strategy<Value = Two> {
    let kind = || any_convex(0.1, 10.0);
    (kind(), any_rotation(), kind(), any_rotation(), any_rotation(), part).prop_map(
        |(a, rot_a, b, rot_b, direction, part)| {
            let far = a.shape.bounding_radius() + b.shape.bounding_radius();
            Two { a, rot_a, b, rot_b, offset: direction.rotate(Vec2::new(part * far, 0.0)) }
        },
    )
}

proptest! {
    #![proptest_config(cases(2_000))]

    /// The nearest point of the manifold of two separate shapes is as far as the shapes are apart, never nearer. Between
    /// boxes a face may win over a better one by the preference that keeps it from flickering.
    #[test]
    fn separations_are_distances(two in any_two(0.4..1.5)) {
        let apart = two.distance();
        if apart <= f64::from(two.rounding()) {
            return Ok(());
        }
        let manifold = two.manifold();
        prop_assert!(manifold.count >= 1);
        let error = f64::from(least(&manifold)) - apart;
        let further = if two.has_circle() { 0.0 } else { 0.0006 };
        let rounding = f64::from(two.rounding());
        prop_assert!(-rounding <= error && error <= rounding + further, "{} m off, {:?}", error, manifold);
    }

    /// Shapes that overlap have a negative separation: as deep as the shortest way out is long.
    #[test]
    fn depths_are_ways_out(two in any_two(0.0..0.8)) {
        let depth = two.sampled_depth();
        if two.distance() > 0.0 || depth <= 0.001 + f64::from(two.rounding()) {
            return Ok(());
        }
        let deepest = f64::from(-least(&two.manifold()));
        // A direction between two samples may be a little better.
        let tolerance = 0.0006 + 1e-4 * f64::from(two.size());
        prop_assert!((deepest - depth).abs() <= tolerance, "{} m deep, manifold says {}", depth, deepest);
    }

    #[test]
    fn manifolds_make_sense(two in any_two(0.0..1.5)) {
        let manifold = two.manifold();
        let size = two.size();
        prop_assert!((manifold.normal.length() - 1.0).abs() < 1e-5);
        prop_assert!((1..=2).contains(&manifold.count));
        for point in manifold.points() {
            prop_assert!(point.anchor.is_finite() && point.separation.is_finite());
            prop_assert!(point.anchor.length() <= 1.5 * size && point.separation.abs() <= 2.0 * size);
        }
        if let [first, second] = manifold.points() {
            prop_assert!(first.feature != second.feature, "two points of one name");
        }
        // Pulled apart along the normal by the depth, nothing overlaps any more: B lies where the normal points.
        let out = manifold.normal * (-least(&manifold) + 0.002 + two.rounding());
        let moved = Two { offset: two.offset + out, ..two.clone() };
        prop_assert!(least(&manifold) > 0.0 || moved.distance() > 0.0, "{:?} does not lead out", manifold.normal);
    }

    /// From the other body the same contact is seen: the normal turned round, the same places, the same depths. Where
    /// two faces of boxes are equally good, each body may see its own.
    #[test]
    fn swapping_the_bodies_turns_the_normal_round(two in any_two(0.0..1.5)) {
        let (there, back) = (two.manifold(), two.swapped().manifold());
        let further = if two.has_circle() { 0.0 } else { 0.0006 };
        prop_assert!((least(&there) - least(&back)).abs() <= further + two.rounding());
        let same_axis = (there.normal + back.normal).length() < 1e-4;
        prop_assert!(same_axis || !two.has_circle() || least(&there) < 0.0, "{:?} {:?}", there, back);
        if same_axis && there.count == 1 && back.count == 1 {
            let (one, other) = (there.points[0], back.points[0]);
            let gap = (one.anchor - (two.offset + other.anchor)).length();
            prop_assert!(gap <= 0.0012 + further + 10.0 * two.rounding(), "the point lies {} m elsewhere", gap);
        }
    }

    /// A contact may be left out only if it is further than asked for.
    #[test]
    fn what_is_within_reach_is_found(two in any_two(0.0..1.5), reach in 0.0_f32..2.0) {
        let manifold = two.within(reach);
        if manifold.count == 0 {
            prop_assert!(two.distance() > f64::from(reach - two.rounding()));
        } else {
            prop_assert_eq!(manifold, two.manifold());
        }
    }
}

fn two(a: Kind, b: Kind, x: f32, y: f32) -> Two {
    Two { a, rot_a: Rot::IDENTITY, b, rot_b: Rot::IDENTITY, offset: Vec2::new(x, y) }
}

#[test]
fn a_box_stands_upon_a_box_on_two_points() {
    let manifold = two(rectangle(4.0, 1.0), rectangle(1.0, 1.0), 0.25, 0.99).manifold();
    assert_eq!(manifold.normal, Vec2::Y);
    let mut places: Vec<_> = manifold.points().iter().map(|point| point.anchor.x).collect();
    places.sort_by(f32::total_cmp);
    assert_eq!(places, [-0.25, 0.75]);
    for point in manifold.points() {
        assert!((point.separation + 0.01).abs() < 1e-6 && (point.anchor.y - 0.495).abs() < 1e-6);
    }
    // Over the edge: only as wide as both.
    let manifold = two(rectangle(4.0, 1.0), rectangle(1.0, 1.0), 2.25, 1.0).manifold();
    let mut places: Vec<_> = manifold.points().iter().map(|point| point.anchor.x).collect();
    places.sort_by(f32::total_cmp);
    assert_eq!(places, [1.75, 2.0]);
}

/// Defect: where a box tilted a little and its own face was the one to measure from, the points had other names, and what rested on
/// it was not held up for a step.
#[test]
fn points_keep_their_names_whichever_face_they_are_measured_from() {
    let mut upon = two(rectangle(1.0, 1.0), rectangle(1.0, 1.0), 0.0, 0.99);
    for measure in [Two::manifold, Two::of_pieces] {
        let mut measured_from_a = [false; 2];
        let mut names = [[-0.05, -0.3], [-0.05, 0.3], [0.05, -0.3], [0.05, 0.3]].map(|[tilt, beside]| {
            (upon.rot_b, upon.offset.x) = (Rot::from_angle(tilt), beside);
            let manifold = measure(&upon);
            measured_from_a[usize::from(manifold.normal == Vec2::Y)] = true;
            let [mut left, mut right] = manifold.points;
            if left.anchor.x > right.anchor.x {
                std::mem::swap(&mut left, &mut right);
            }
            [left.feature, right.feature]
        });
        assert_eq!(measured_from_a, [true; 2]);
        assert_ne!(names[0][0], names[0][1]);
        names.sort_unstable();
        assert_eq!(names[0], names[3]);
    }
}

#[test]
fn circles_meet_on_the_line_of_their_centers() {
    let manifold = two(circle(1.0), circle(0.5), 3.0, 4.0).manifold();
    assert_eq!((manifold.normal, manifold.points[0].separation), (Vec2::new(0.6, 0.8), 3.5));
    assert!((manifold.points[0].anchor - Vec2::new(0.6, 0.8) * 2.75).length() < 1e-6);
}

#[test]
fn a_circle_meets_a_corner_of_a_box_along_the_diagonal() {
    let manifold = two(rectangle(2.0, 2.0), circle(1.0), 4.0, 5.0).manifold();
    assert_eq!((manifold.normal, manifold.points[0].separation), (Vec2::new(0.6, 0.8), 4.0));
}

#[test]
fn shapes_upon_one_another_are_told_apart_always_alike() {
    for kinds in
        [[circle(1.0), circle(0.5)], [circle(1.0), rectangle(1.0, 2.0)], [rectangle(1.0, 2.0), rectangle(0.5, 0.5)]]
    {
        let [a, b] = kinds;
        let upon = two(a, b, 0.0, 0.0);
        let manifold = upon.manifold();
        assert!(manifold.count > 0 && least(&manifold) < 0.0 && (manifold.normal.length() - 1.0).abs() < 1e-6);
        assert_eq!(manifold, upon.manifold());
    }
}

/// Numbers that are as good as random.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as f32 / (1_u64 << 31) as f32
    }

    fn below(&mut self, end: usize) -> usize {
        ((self.next() * end as f32) as usize).min(end - 1)
    }
}

/// Shapes of every form; many of them fit each other exactly.
fn forms() -> Vec<Shape> {
    let polygon = |points: &[(f32, f32)], radius| {
        Shape::polygon(&points.iter().map(|&(x, y)| Vec2::new(x, y)).collect::<Vec<_>>(), radius).unwrap()
    };
    let around = |count: usize| -> Vec<(f32, f32)> {
        (0..count).map(|i| (i as f32 / count as f32 * std::f32::consts::TAU).sin_cos()).collect()
    };
    let square = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
    let mut all = vec![Shape::circle(0.5), Shape::circle(2.0), Shape::rectangle(1.0, 1.0), Shape::rectangle(4.0, 0.25)];
    all.extend([polygon(&square, 0.0), polygon(&square, 0.25), polygon(&[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], 0.0)]);
    all.extend([
        polygon(&[(0.0, 0.0), (6.0, 0.1), (0.0, 0.2)], 0.0),
        polygon(&[(0.0, 0.0), (3.0, 1.0), (0.0, 1.0)], 0.5),
    ]);
    all.extend((3..9).map(|count| polygon(&around(count), 0.0)));
    all.extend([(1.0, 0.5), (4.0, 0.1), (0.1, 1.0)].map(|(length, radius)| Shape::capsule(length, radius).unwrap()));
    all
}

/// A million placements, and a good part of them just so that faces, corners and axes meet.
#[test]
fn pieces_are_as_far_apart_or_as_deep_as_they_are() {
    let (mut random, forms) = (Random(7), forms());
    let placements = 1_000_000;
    let quarter = std::f32::consts::FRAC_PI_4;
    let mut deep = 0;
    for number in 0..placements {
        let [a, b] = [0, 1].map(|_| Kind::new(forms[random.below(forms.len())].clone(), Material::default()));
        let exact = number % 4 == 0;
        let mut rotation = || match exact {
            true => Rot::from_angle(random.below(8) as f32 * quarter),
            false => Rot::from_angle(random.next() * 6.3),
        };
        let (rot_a, rot_b) = (rotation(), rotation());
        let far = a.shape.bounding_radius() + b.shape.bounding_radius();
        let offset = match exact {
            true => Vec2::new(random.below(17) as f32 - 8.0, random.below(17) as f32 - 8.0) * 0.25,
            false => Rot::from_angle(random.next() * 6.3).rotate(Vec2::new(1.3 * far * random.next(), 0.0)),
        };
        let two = Two { a, rot_a, b, rot_b, offset };
        let (apart, manifold) = (two.distance(), two.of_pieces());
        let (found, rounding) = (f64::from(least(&manifold)), f64::from(two.rounding()));
        assert!((manifold.normal.length() - 1.0).abs() < 1e-5, "{two:?}: {manifold:?}");
        let (_, round_a) = outline(&two.a.shape, rot_a, DVec2::ZERO);
        let (_, round_b) = outline(&two.b.shape, rot_b, DVec2::ZERO);
        let cores = apart + round_a + round_b;
        if cores > rounding {
            let error = found - apart;
            assert!(-rounding <= error && error <= rounding + 0.0006, "{error} m off: {two:?} {manifold:?}");
        } else {
            deep += 1;
            let depth = two.exact_depth();
            assert!((found + depth).abs() <= 0.0006 + rounding, "{depth} m deep: {two:?} {manifold:?}");
        }
        for point in manifold.points() {
            assert!(point.anchor.is_finite() && point.anchor.length() <= two.size(), "{two:?} {manifold:?}");
        }
    }
    assert!(deep > placements / 8, "{deep}");
}

/// Neither what has come around an end of a segment, nor what is far behind it: the search for pairs may leave such out.
#[test]
fn who_touches_a_segment_is_near_it() {
    let (mut random, at) = (Random(3), |x: f32, y: f32| Some(Vec2::new(x, y)));
    let (from, to) = (Vec2::new(-1.5, -0.5), Vec2::new(1.5, 0.5));
    let (mut around, mut within) = (0, 0);
    for (before, after) in
        [(None, None), (at(-2.5, -1.5), at(2.5, 1.5)), (at(-2.5, -0.2), at(2.5, 0.2)), (None, at(1.5, -1.0))]
    {
        let segment = Kind::new(Shape::Segment(Segment::new(before, from, to, after).unwrap().0), Material::default());
        let segment = crate::model::piece::pieces(&segment.shape);
        for _ in 0..40_000 {
            let [long, thick] = [0.2 + 6.0 * random.next() * random.next(), 0.02 + 0.5 * random.next()];
            let is_rounded = random.next() < 0.5;
            let (core, radius) = if is_rounded { (0.0, 0.5 * thick) } else { (0.5 * thick, 0.0) };
            let capsule = || Kind::new(Shape::capsule(long, radius).unwrap(), Material::default());
            let piece = row(&if is_rounded { capsule() } else { rectangle(long, thick) });
            let rotation = Rot::from_angle(random.next() * 6.3);
            let offset = Rot::from_angle(random.next() * 6.3).rotate(Vec2::new(5.0 * random.next(), 0.0));
            let lies = (random.next() < 0.5).then_some(0.01);
            let pieces = [&segment[0], &piece.pieces[0]];
            let manifold = convex::collide(pieces, [Rot::IDENTITY, rotation], offset, (f32::INFINITY, 1.0), lies);
            let Some(nearest) = manifold.nearest().filter(|_| !manifold.is_distance()) else { continue };
            let apart = |part: f32| {
                let seen = rotation.unrotate(from + (to - from) * part - offset).abs() - Vec2::new(0.5 * long, core);
                seen.max(Vec2::ZERO).length() - radius
            };
            let least = (0..=300).map(|i| apart(i as f32 / 300.0)).fold(f32::INFINITY, f32::min);
            if nearest.separation < 0.0 {
                assert!(least < 0.02, "{least} m apart: {offset} {rotation:?} {long} {thick} {lies:?} {manifold:?}");
                within += 1;
            }
            around += usize::from(least > 0.02);
        }
    }
    assert!(around > 1000 && within > 1000, "{around}, {within}");
}

/// Whoever overlaps several segments of flat ground has a contact with each of them, tilted and rounded as it may be.
#[test]
fn who_lies_on_a_chain_of_short_segments_is_held_by_each() {
    let polygon = |half: Vec2, radius| {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec2::new(x, y) * half);
        Shape::polygon(&corners, radius).unwrap()
    };
    let at = |x: f32| Vec2::new(x, 0.0);
    // How it is turned, in degrees, and how high its center is; from where to where it overlaps the ground.
    for (shape, degrees, height, [first, last]) in [
        (Shape::capsule(0.4, 0.01).unwrap(), 1.0, 0.002, [-0.2, 0.2]),
        (Shape::capsule(0.4, 0.01).unwrap(), 1.0, -0.002, [-0.2, 0.2]),
        (polygon(Vec2::new(0.2, 0.1), 0.005), 0.5, 0.098, [-0.2, 0.2]),
        (Shape::rectangle(0.5, 0.1), 5.0, -0.055, [-0.05, 0.25]),
        (Shape::rectangle(0.5, 0.1), 5.0, 0.045, [-0.25, 0.05]),
        (Shape::circle(0.2), 0.0, 0.15, [-0.05, 0.05]),
        (Shape::circle(0.2), 0.0, -0.205, [-0.05, 0.05]),
    ] {
        let piece = &crate::model::piece::pieces(&shape)[0];
        for number in -3..3 {
            let (from, to) = (at(0.1 * number as f32 + 0.05), at(0.1 * number as f32 + 0.15));
            let is_over = from.x.max(first) + 0.02 < to.x.min(last);
            let middle = 0.5 * (from + to);
            let ends = [from - at(0.1), from, to, to + at(0.1)].map(|end| end - middle);
            let segment = Segment::new(Some(ends[0]), ends[1], ends[2], Some(ends[3])).unwrap().0;
            let ground = &crate::model::piece::pieces(&Shape::Segment(segment))[0];
            let offset = Vec2::new(0.0, height) - middle;
            let rotations = [Rot::IDENTITY, Rot::from_angle(f32::to_radians(degrees))];
            let manifold = convex::collide([ground, piece], rotations, offset, (f32::INFINITY, 1.0), Some(0.01));
            let touches = !manifold.is_distance() && manifold.nearest().is_some_and(|nearest| nearest.separation < 0.0);
            // Where the center is behind, those segments hold it that are below that.
            let is_below = from.x <= 0.0 && 0.0 <= to.x;
            let is_held = is_over && (height > 0.0 || is_below);
            assert!(touches || !is_held, "{shape:?} at {height} over {from}: {manifold:?}");
        }
    }
}
