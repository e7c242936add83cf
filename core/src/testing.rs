//! What this crate's own tests share.

use crate::collide::manifold::nearest;
use crate::model::kind::{Kind, KindRow, Material};
use crate::model::math::Rot;
use crate::model::shape::Shape;
use glam::{DVec2, Vec2};
use proptest::prelude::*;

/// How many cases a property is tried on, unless the environment says `PROPTEST_CASES`.
pub(crate) fn cases(cases: u32) -> ProptestConfig {
    let asked = std::env::var_os("PROPTEST_CASES").is_some();
    if asked { ProptestConfig::default() } else { ProptestConfig::with_cases(cases) }
}

/// A rough circle.
pub(crate) fn circle(radius: f32) -> Kind {
    Kind::new(Shape::circle(radius), Material::default())
}

/// A rough box of the given whole sides.
pub(crate) fn rectangle(width: f32, height: f32) -> Kind {
    Kind::new(Shape::rectangle(width, height), Material::default())
}

/// Circles and boxes, evenly spread over the orders of magnitude between two sizes.
pub(crate) fn any_kind(least: f32, most: f32) -> impl Strategy<Value = Kind> {
    let size = move || (least.log10()..most.log10()).prop_map(|exponent| 10.0_f32.powf(exponent));
    prop_oneof![size().prop_map(circle), (size(), size()).prop_map(|(width, height)| rectangle(width, height))]
}

/// Circles, boxes, polygons, capsules and rounded polygons, as [`any_kind`].
pub(crate) fn any_convex(least: f32, most: f32) -> impl Strategy<Value = Kind> {
    let size = move || (least.log10()..most.log10()).prop_map(|exponent| 10.0_f32.powf(exponent));
    let corner = || (-1.0_f32..1.0, -1.0_f32..1.0).prop_map(|(x, y)| Vec2::new(x, y));
    let rounding = || prop_oneof![Just(0.0_f32), 0.01_f32..1.0];
    let polygon = (prop::collection::vec(corner(), 3..9), size(), rounding()).prop_filter_map(
        "points that make a polygon",
        |(points, size, rounding)| {
            let points: Vec<Vec2> = points.into_iter().map(|point| point * size).collect();
            Shape::polygon(&points, rounding * size).ok()
        },
    );
    let capsule =
        (size(), size()).prop_filter_map("sizes of a capsule", |(length, radius)| Shape::capsule(length, radius).ok());
    prop_oneof![
        1 => any_kind(least, most),
        3 => polygon.prop_map(|shape| Kind::new(shape, Material::default())),
        1 => capsule.prop_map(|shape| Kind::new(shape, Material::default())),
    ]
}

/// Any direction; the four straight ones more often than chance would have it.
pub(crate) fn any_rotation() -> impl Strategy<Value = Rot> {
    prop_oneof![
        1 => Just(Rot::IDENTITY),
        1 => Just(Rot { c: 0.0, s: -1.0 }),
        4 => (-3.2_f32..3.2).prop_map(Rot::from_angle),
    ]
}

/// How far surfaces are to be from each other, in m: where some number is named, about touching.
pub(crate) fn any_gap() -> impl Strategy<Value = Option<f32>> {
    prop_oneof![Just(None), (-0.004_f32..0.004).prop_map(Some)]
}

/// Where the second body is to be, seen from the first, if its surface is to be so far from that: moved there straight from an offset.
pub(crate) fn at_gap(gap: Option<f32>, [a, b]: [&KindRow; 2], rotations: [Rot; 2], offset: DVec2) -> DVec2 {
    let Some(gap) = gap else { return offset };
    let manifold = nearest(a, rotations[0], b, rotations[1], offset.as_vec2(), f32::INFINITY);
    let separation = manifold.nearest().map_or(gap, |point| point.separation);
    offset + (manifold.normal * (gap - separation)).as_dvec2()
}

/// The outline of a convex shape in double precision: corners, and how far around them it reaches.
pub(crate) fn outline(shape: &Shape, rotation: Rot, center: DVec2) -> (Vec<DVec2>, f64) {
    let (c, s) = (f64::from(rotation.c), f64::from(rotation.s));
    let place = |v: DVec2| center + DVec2::new(c * v.x - s * v.y, s * v.x + c * v.y);
    match shape {
        Shape::Circle { radius } => (vec![center], f64::from(*radius)),
        Shape::Box { half } => {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            (corners.map(|(x, y)| place(half.as_dvec2() * DVec2::new(x, y))).to_vec(), 0.0)
        }
        Shape::Polygon(polygon) => {
            let corners = polygon.corners().iter().map(|corner| place(corner.as_dvec2()));
            (corners.collect(), f64::from(polygon.radius()))
        }
        Shape::Segment(_) | Shape::Compound(_) => panic!("not convex, or not solid"),
    }
}

/// Distance of two shapes by trying every edge against every edge; zero or less where they overlap.
pub(crate) fn distance(a: &Shape, rot_a: Rot, b: &Shape, rot_b: Rot, offset: Vec2) -> f64 {
    let (corners_a, round_a) = outline(a, rot_a, DVec2::ZERO);
    let (corners_b, round_b) = outline(b, rot_b, offset.as_dvec2());
    if holds(&corners_a, corners_b[0]) || holds(&corners_b, corners_a[0]) {
        return -round_a - round_b;
    }
    let edges = |corners: &[DVec2]| -> Vec<(DVec2, DVec2)> {
        (0..corners.len()).map(|i| (corners[i], corners[(i + 1) % corners.len()])).collect()
    };
    let mut least = f64::INFINITY;
    for (a0, a1) in edges(&corners_a) {
        for (b0, b1) in edges(&corners_b) {
            if cross(a1 - a0, b0 - a0) * cross(a1 - a0, b1 - a0) < 0.0
                && cross(b1 - b0, a0 - b0) * cross(b1 - b0, a1 - b0) < 0.0
            {
                return -round_a - round_b;
            }
            // Edges that do not cross are nearest at an end of one of them.
            for (point, edge) in [(a0, (b0, b1)), (a1, (b0, b1)), (b0, (a0, a1)), (b1, (a0, a1))] {
                least = least.min(to_edge(point, edge));
            }
        }
    }
    least - round_a - round_b
}

fn cross(a: DVec2, b: DVec2) -> f64 {
    a.x * b.y - a.y * b.x
}

/// Whether a point lies in the polygon of the given corners, counter-clockwise; never in a point or a line.
fn holds(corners: &[DVec2], point: DVec2) -> bool {
    corners.len() > 2
        && (0..corners.len()).all(|i| {
            let (from, to) = (corners[i], corners[(i + 1) % corners.len()]);
            cross(to - from, point - from) >= 0.0
        })
}

fn to_edge(point: DVec2, (from, to): (DVec2, DVec2)) -> f64 {
    let along = to - from;
    let length = along.dot(along);
    let part = if length > 0.0 { ((point - from).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
    (point - from - along * part).length()
}
