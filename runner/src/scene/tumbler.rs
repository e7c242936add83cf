//! `tumbler`: boxes in a square drum that turns. The scene of that name in the benchmarks of Box2D (E. Catto), but that the drum turns
//! whatever lies in it, where Box2D's has a motor.

use super::yards::{Fixture, Yard};
use atoll_core::{Kind, Material, Part, Path, Rot, Shape, Travel};
use glam::{DVec2, Vec2};

/// How fast drums turn, in degrees per second: Box2D's, here and in `washer`.
pub(super) const TURNING: f64 = 25.0;

/// From the drum's middle to that of a wall, and half the thickness of it, in meters.
const HALF: f32 = 10.0;
const HALF_WALL: f32 = 0.5;
/// Boxes along a side of their square, the side of one, and from one to the next, in meters.
const SIDE: u64 = 45;
const BOX: f32 = 0.25;
const SPACING: f64 = 0.4;

/// A drum, in a square that it has room in.
#[derive(Debug)]
pub(super) struct Tumbler;

/// Something around the middle of a yard, as large as that leaves room for, that turns.
pub(super) fn drum(parts: Vec<Part>, yard: DVec2) -> Fixture {
    let shape = Shape::compound(parts).expect("the parts of a drum");
    let path = Path { travel: Travel::Rest, turning: TURNING.to_radians() };
    Fixture { kind: Kind::new(shape, Material::default()), place: 0.5 * yard, path: Some(path) }
}

impl Yard for Tumbler {
    const BODIES: u64 = SIDE * SIDE;
    const ROW: u64 = SIDE;
    const SIZE: DVec2 = DVec2::new(32.0, 32.0);

    fn kind() -> Kind {
        Kind::new(Shape::rectangle(BOX, BOX), Material::default())
    }

    fn around() -> Vec<Fixture> {
        let wall = |direction: Vec2| {
            let across = (Vec2::ONE - direction.abs()) * HALF + direction.abs() * HALF_WALL;
            Part { shape: Shape::Box { half: across }, position: direction * HALF, rotation: Rot::IDENTITY }
        };
        vec![drum([Vec2::X, -Vec2::X, Vec2::Y, -Vec2::Y].map(wall).to_vec(), Self::SIZE)]
    }

    fn place(row: u64, at: u64) -> DVec2 {
        0.5 * Self::SIZE + SPACING * (DVec2::new(at as f64, row as f64) - 0.5 * SIDE as f64)
    }
}
