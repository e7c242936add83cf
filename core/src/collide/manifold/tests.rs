//! Manifolds against the distance of outlines, found by trying every edge against every edge.

use super::{Manifold, collide};
use crate::model::id::KindId;
use crate::model::math::Rot;
use crate::model::shape::{Kind, KindRow, Shape};
use crate::testing::{any_kind, any_rotation, cases, circle, distance, outline, rectangle};
use glam::{DVec2, Vec2};
use proptest::prelude::*;
use std::ops::Range;

/// Two bodies; B lies at `offset` from A.
#[derive(Clone, Copy, Debug)]
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
        collide(&row(&self.a), self.rot_a, &row(&self.b), self.rot_b, self.offset, f32::INFINITY)
    }

    fn swapped(&self) -> Self {
        Self { a: self.b, rot_a: self.rot_b, b: self.a, rot_b: self.rot_a, offset: -self.offset }
    }

    fn distance(&self) -> f64 {
        distance(self.a.shape, self.rot_a, self.b.shape, self.rot_b, self.offset)
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
        [self.a, self.b].iter().any(|kind| matches!(kind.shape, Shape::Circle { .. }))
    }

    /// How deep they are in each other: the least way out along the axes of both and 720 other directions.
    fn sampled_depth(&self) -> f64 {
        let (corners_a, round_a) = outline(self.a.shape, self.rot_a, DVec2::ZERO);
        let (corners_b, round_b) = outline(self.b.shape, self.rot_b, self.offset.as_dvec2());
        let depth = |axis: DVec2| {
            let front_a = corners_a.iter().map(|corner| corner.dot(axis)).fold(f64::NEG_INFINITY, f64::max) + round_a;
            let back_b = corners_b.iter().map(|corner| corner.dot(axis)).fold(f64::INFINITY, f64::min) - round_b;
            front_a - back_b
        };
        let axes = [self.rot_a, self.rot_b].map(|rot| DVec2::new(f64::from(rot.c), f64::from(rot.s)));
        let axes = axes.into_iter().flat_map(|axis| [axis, axis.perp(), -axis, -axis.perp()]);
        let around = (0..720).map(|k| DVec2::from_angle(f64::from(k) * std::f64::consts::TAU / 720.0));
        axes.chain(around).map(depth).fold(f64::INFINITY, f64::min)
    }
}

fn least(manifold: &Manifold) -> f32 {
    manifold.points().iter().map(|point| point.separation).fold(f32::INFINITY, f32::min)
}

/// Sizes within two orders of magnitude; the centers as far apart as a part of the bounding radii together.
fn any_two(part: Range<f32>) -> impl Strategy<Value = Two> {
    let kind = || any_kind(0.1, 10.0);
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
        let moved = Two { offset: two.offset + out, ..two };
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
        let manifold = collide(&row(&two.a), two.rot_a, &row(&two.b), two.rot_b, two.offset, reach);
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
        let manifold = two(kinds[0], kinds[1], 0.0, 0.0).manifold();
        assert!(manifold.count > 0 && least(&manifold) < 0.0 && (manifold.normal.length() - 1.0).abs() < 1e-6);
        assert_eq!(manifold, two(kinds[0], kinds[1], 0.0, 0.0).manifold());
    }
}
