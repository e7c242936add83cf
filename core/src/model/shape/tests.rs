//! Shapes against numbers found in other ways: hulls by trying, masses by darts.

use super::*;
use crate::testing::cases;
use proptest::prelude::*;

/// Points within a square, some of them upon each other or in a line.
fn any_points() -> impl Strategy<Value = Vec<Vec2>> {
    let exact = || (-4..5_i32, -4..5_i32).prop_map(|(x, y)| Vec2::new(x as f32, y as f32) * 0.25);
    let free = || (-1.0_f32..1.0, -1.0_f32..1.0).prop_map(|(x, y)| Vec2::new(x, y));
    (prop_oneof![prop::collection::vec(exact(), 1..12), prop::collection::vec(free(), 1..12)], -6..7_i32)
        .prop_map(|(points, size)| points.into_iter().map(|point| point * 10.0_f32.powi(size)).collect())
}

fn size(points: &[Vec2]) -> f32 {
    points.iter().flat_map(|a| points.iter().map(move |b| (*a - *b).length())).fold(0.0, f32::max)
}

proptest! {
    #![proptest_config(cases(20_000))]

    /// A hull is convex, counter-clockwise, holds every point that it was made of but for a little, and has no other corners; its
    /// center of mass is at the origin; and it is its own hull, to the bit.
    #[test]
    fn hulls_are_hulls(points in any_points(), rounding in prop_oneof![Just(0.0_f32), 0.001_f32..1.0]) {
        let size = size(&points);
        let radius = rounding * size;
        let (polygon, center) = match Polygon::hull(&points, radius) {
            Ok(found) => found,
            Err(ShapeError::Flat) => {
                let flat = points.iter().all(|&a| points.iter().all(|&b| points.iter().all(|&c| {
                    (b - a).perp_dot(c - a).abs() <= 1e-3 * size * (size + f32::MIN_POSITIVE)
                })));
                prop_assert!(flat && (radius <= 1e-4 * size || size == 0.0), "refused: {points:?}");
                return Ok(());
            }
            Err(ShapeError::Corners { count }) => {
                prop_assert!(count > MOST_CORNERS && points.len() >= count);
                return Ok(());
            }
            Err(error) => panic!("{error}"),
        };
        let (corners, tiny) = (polygon.corners(), 2e-4 * size);
        let next = |i: usize| corners[(i + 1) % corners.len()];
        for (i, &corner) in corners.iter().enumerate() {
            let edge = next(i) - corner;
            prop_assert!(corners.len() == 2 || edge.perp_dot(next(i + 1) - next(i)) > 0.0, "not convex");
            prop_assert!(points.iter().any(|&point| (point - center - corner).length() < 1e-5 * size), "made up");
            for &point in &points {
                prop_assert!(edge.perp_dot(point - center - corner) >= -tiny * edge.length(), "left out {point:?}");
            }
        }
        prop_assert!(polygon.mass().center.length() < 1e-5 * f64::from(size + radius));
        let (again, moved) = Polygon::hull(corners, radius).unwrap();
        prop_assert_eq!(again, polygon);
        prop_assert_eq!(moved, Vec2::ZERO);
    }
}

fn holds(shape: &Shape, point: Vec2) -> bool {
    match shape {
        Shape::Circle { radius } => point.length() <= *radius,
        Shape::Box { half } => point.abs().cmple(*half).all(),
        Shape::Polygon(polygon) => {
            let corners = polygon.corners();
            let edges = || (0..corners.len()).map(|i| (corners[i], corners[(i + 1) % corners.len()]));
            let is_near = |(from, to): (Vec2, Vec2)| {
                let part = ((point - from).dot(to - from) / (to - from).length_squared()).clamp(0.0, 1.0);
                (point - from - (to - from) * part).length() <= polygon.radius()
            };
            let inside = edges().all(|(from, to)| (to - from).perp_dot(point - from) >= 0.0);
            corners.len() > 2 && inside || edges().any(is_near)
        }
        Shape::Segment(_) => false,
        Shape::Compound(_) => panic!("one by one"),
    }
}

/// Area, center and moment about it, by darts.
fn by_darts(shape: &Shape) -> (f64, DVec2, f64) {
    let parts = match shape {
        Shape::Compound(compound) => compound.parts().to_vec(),
        other => vec![Part { shape: other.clone(), position: Vec2::ZERO, rotation: Rot::IDENTITY }],
    };
    let reach = shape.bounding_radius();
    let (mut state, darts) = (1_u64, 1_000_000);
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as f32 / (1_u64 << 31) as f32 * 2.0 - 1.0
    };
    let (mut count, mut sum, mut square) = (0.0, DVec2::ZERO, 0.0);
    for _ in 0..darts {
        let point = Vec2::new(random(), random()) * reach;
        let times =
            parts.iter().filter(|part| holds(&part.shape, part.rotation.unrotate(point - part.position))).count();
        let (times, point) = (times as f64, point.as_dvec2());
        (count, sum, square) = (count + times, sum + point * times, square + times * point.length_squared());
    }
    let (all, center) = (f64::from(4.0 * reach * reach), sum / count);
    (
        all * count / f64::from(darts),
        center,
        all * square / f64::from(darts) - all * count / f64::from(darts) * center.length_squared(),
    )
}

#[test]
fn masses_are_those_that_darts_find() {
    let points = |points: &[(f32, f32)]| points.iter().map(|&(x, y)| Vec2::new(x, y)).collect::<Vec<_>>();
    let triangle = points(&[(0.0, 0.0), (2.0, 0.2), (0.3, 1.0)]);
    let house = points(&[(-1.0, 0.0), (1.0, 0.0), (1.0, 1.5), (0.0, 2.5), (-1.0, 1.5)]);
    let polygon = |points: &[Vec2], radius| Shape::polygon(points, radius).unwrap();
    let part = |shape, x, y, angle| Part { shape, position: Vec2::new(x, y), rotation: Rot::from_angle(angle) };
    let shapes = [
        polygon(&triangle, 0.0),
        polygon(&triangle, 0.4),
        polygon(&house, 0.0),
        polygon(&house, 0.2),
        Shape::capsule(2.0, 0.5).unwrap(),
        Shape::rectangle(2.0, 0.6),
        Shape::circle(0.7),
        Shape::compound(vec![
            part(Shape::rectangle(2.0, 0.2), 0.0, 0.0, 0.3),
            part(polygon(&triangle, 0.1), 0.4, 1.0, 1.0),
            part(Shape::circle(0.4), -0.5, 0.8, 0.0),
            part(Shape::capsule(1.0, 0.2).unwrap(), 3.0, 0.8, 2.0),
        ])
        .unwrap(),
    ];
    for shape in &shapes {
        let (area, center, moment) = by_darts(shape);
        let inertia = f64::from(shape.inertia_per_mass()) * f64::from(shape.area());
        let near = |a: f64, b: f64| (a - b).abs() < 0.006 * a.abs().max(b.abs());
        assert!(near(area, shape.area().into()), "{shape:?}: area {} for {area}", shape.area());
        assert!(near(moment, inertia), "{shape:?}: moment {inertia} for {moment}");
        assert!(center.length() < 0.004 * f64::from(shape.bounding_radius()), "{shape:?}: center {center}");
    }
    // A square has what a box has, and a capsule of no length would be a disc.
    let square = polygon(&points(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]), 0.0);
    assert_eq!((square.area(), square.inertia_per_mass()), (1.0, Shape::rectangle(1.0, 1.0).inertia_per_mass()));
    let short = Shape::capsule(1e-3, 1.0).unwrap();
    assert!((short.inertia_per_mass() - 0.5).abs() < 1e-3 && (short.area() - std::f32::consts::PI).abs() < 3e-3);
}

#[test]
fn what_is_no_shape_is_refused() {
    let error = |points: &[(f32, f32)], radius| {
        let points: Vec<_> = points.iter().map(|&(x, y)| Vec2::new(x, y)).collect();
        Shape::polygon(&points, radius).unwrap_err()
    };
    let around = |count: usize| -> Vec<(f32, f32)> {
        (0..count).map(|i| (i as f32 / count as f32 * std::f32::consts::TAU).sin_cos()).collect()
    };
    assert_eq!(error(&[], 1.0), ShapeError::Flat);
    assert_eq!(error(&[(0.0, 0.0), (0.0, 0.0)], 1.0), ShapeError::Flat);
    assert_eq!(error(&[(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)], 0.0), ShapeError::Flat);
    assert_eq!(error(&[(0.0, 0.0), (1.0, 0.0)], 1e-5), ShapeError::Thin);
    assert_eq!(error(&[(0.0, 0.0), (1.0, f32::NAN), (2.0, 2.0)], 0.0), ShapeError::NotFinite);
    assert_eq!(error(&[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], -0.1), ShapeError::NotFinite);
    assert_eq!(error(&around(9), 0.0), ShapeError::Corners { count: 9 });
    assert!(Shape::polygon(&around(8).iter().map(|&(x, y)| Vec2::new(x, y)).collect::<Vec<_>>(), 0.0).is_ok());
    let part = |shape| Part { shape, position: Vec2::ZERO, rotation: Rot::IDENTITY };
    let segment = Segment::new(None, Vec2::ZERO, Vec2::X, None).unwrap().0;
    assert_eq!(Shape::compound(vec![]).unwrap_err(), ShapeError::Parts { count: 0 });
    let wrong = vec![part(Shape::circle(1.0)), part(Shape::Segment(segment))];
    assert_eq!(Shape::compound(wrong).unwrap_err(), ShapeError::Part { number: 2 });
    assert_eq!(Shape::compound(vec![part(Shape::circle(-1.0))]).unwrap_err(), ShapeError::NotFinite);
    assert_eq!(Segment::new(None, Vec2::X, Vec2::X, None).unwrap_err(), ShapeError::Joint);
    assert_eq!(Segment::new(Some(Vec2::X), Vec2::X, Vec2::Y, None).unwrap_err(), ShapeError::Joint);
}
