//! `compounds`: bodies of two triangles each fall into a basin. The scene of that name in the benchmarks of Box2D (E. Catto).

use super::junkyard::basin;
use super::yards::{Fixture, Yard};
use atoll_core::{Kind, Material, Part, Polygon, Rot, Shape};
use glam::{DVec2, Vec2};

/// Half the width of the basin, and the height of its walls, in meters.
const HALF: u32 = 40;
const HEIGHT: u32 = 100;
/// The origin of Box2D's scene, seen from the low corner of a yard.
const ORIGIN: DVec2 = DVec2::new(41.0, 0.5);
/// Bodies: columns, how many are in one, and from one to the next, in meters.
const COLUMNS: u64 = 20;
const ROWS: u64 = 150;
const SPACING: DVec2 = DVec2::new(2.0, 2.25);
/// The lowest of the first column, in meters.
const FIRST: DVec2 = DVec2::new(-19.0, 5.575);
/// Bodies stand beside their column by as much, in turn to the right and to the left, in meters.
const BESIDE: f64 = 0.25;
/// One of the triangles, in meters; the other is its mirror image.
const TRIANGLE: [Vec2; 3] = [Vec2::new(-1.0, 0.0), Vec2::new(0.5, 1.0), Vec2::new(0.0, 2.0)];

/// A basin.
#[derive(Debug)]
pub(super) struct Compounds;

impl Yard for Compounds {
    const BODIES: u64 = COLUMNS * ROWS;
    const ROW: u64 = ROWS;
    const SIZE: DVec2 = DVec2::new(82.0, 400.0);
    const BESIDE: f64 = BESIDE;

    fn kind() -> Kind {
        let part = |side: f32| {
            let corners = TRIANGLE.map(|corner| corner * Vec2::new(side, 1.0));
            let (polygon, position) = Polygon::hull(&corners, 0.0).expect("three corners");
            Part { shape: Shape::Polygon(polygon), position, rotation: Rot::IDENTITY }
        };
        let material = Material { friction: 0.5, ..Material::default() };
        Kind::new(Shape::compound(vec![part(1.0), part(-1.0)]).expect("two triangles"), material)
    }

    fn around() -> Vec<Fixture> {
        basin(ORIGIN, HALF, HEIGHT)
    }

    fn place(column: u64, at: u64) -> DVec2 {
        let beside = if (column * ROWS + at).is_multiple_of(2) { BESIDE } else { -BESIDE };
        // Box2D counts from the lower end of a body, and its center of mass is half as high as it is.
        ORIGIN + FIRST + SPACING * DVec2::new(column as f64, at as f64) + DVec2::new(beside, 1.0)
    }
}
