//! `junkyard`: pentagons fall into a basin, and a large box goes to and fro among them. The scene of that name in the benchmarks of Box2D
//! (E. Catto).

use super::yards::{Fixture, Yard};
use atoll_core::{Kind, Material, Path, Shape, Travel};
use glam::{DVec2, Vec2};
use std::f64::consts::{PI, TAU};

/// Half the width of the basin, the height of its walls, and from block to block, in meters: blocks overlap a little.
const HALF: u32 = 80;
const HEIGHT: u32 = 50;
const OVERLAP: f32 = 0.1;
/// The origin of Box2D's scene, seen from the low corner of a yard.
const ORIGIN: DVec2 = DVec2::new(81.0, 0.5);
/// Bodies: columns, how many are in one, around them a circle of so many meters, and the height of the lowest.
const COLUMNS: u64 = 200;
const ROWS: u64 = 40;
const RADIUS: f64 = 0.25;
const LOWEST: f64 = 15.0;
/// Bodies stand beside their column by as much, in turn to the left and to the right, in meters.
const BESIDE: f64 = 0.1;
/// The box that pushes: in meters, how far it goes to each side, and how fast, in rad/s.
const PUSHER: Vec2 = Vec2::new(4.0, 8.0);
const AMPLITUDE: f64 = 60.0;
const FREQUENCY: f64 = 0.2;

/// A basin with its box.
#[derive(Debug)]
pub(super) struct Junkyard;

/// The blocks that a floor and two walls are made of, in the order of Box2D's scenes: half so wide, its walls so high, in meters. It
/// stands on a point that is `origin` from the low corner of its yard.
pub(super) fn basin(origin: DVec2, half: u32, height: u32) -> Vec<Fixture> {
    let block = |width: f32, height: f32, x: f64, y: f64| {
        let kind = Kind::new(Shape::rectangle(width, height), Material::default());
        Fixture::still(kind, origin + DVec2::new(x, y))
    };
    let (long, half) = (1.0 + OVERLAP, f64::from(half));
    let floor = (0..=2 * half as u32).map(|number| block(long, 1.0, f64::from(number) - half, 0.0));
    let wall = |x: f64| (1..=height).map(move |number| block(1.0, long, x, f64::from(number)));
    floor.chain(wall(-half)).chain(wall(half)).collect()
}

impl Yard for Junkyard {
    const BODIES: u64 = COLUMNS * ROWS;
    const ROW: u64 = ROWS;
    const SIZE: DVec2 = DVec2::new(162.0, 64.0);
    const BESIDE: f64 = BESIDE;

    fn kind() -> Kind {
        // Corners on a circle, each a golden section of the whole turn after the last.
        let golden = PI * (5.0_f64.sqrt() - 1.0);
        let corner = |number: u32| {
            let angle = golden * f64::from(number);
            (RADIUS * DVec2::new(libm::cos(angle), libm::sin(angle))).as_vec2()
        };
        let shape = Shape::polygon(&[0, 1, 2, 3, 4].map(corner), 0.0).expect("five corners");
        Kind::new(shape, Material::default())
    }

    fn around() -> Vec<Fixture> {
        let mut all = basin(ORIGIN, HALF, HEIGHT);
        let travel = Travel::Sine { amplitude: DVec2::new(AMPLITUDE, 0.0), period: TAU / FREQUENCY, phase: 0.0 };
        all.push(Fixture {
            kind: Kind::new(Shape::Box { half: 0.5 * PUSHER }, Material::default()),
            place: ORIGIN + DVec2::new(0.0, 0.5 * f64::from(PUSHER.y)),
            path: Some(Path { travel, turning: 0.0 }),
        });
        all
    }

    fn place(column: u64, at: u64) -> DVec2 {
        let beside = if (column * ROWS + at).is_multiple_of(2) { -BESIDE } else { BESIDE };
        let x = 1.5 * (2.0 * column as f64 - COLUMNS as f64) * RADIUS;
        ORIGIN + DVec2::new(x + beside, LOWEST + 4.0 * RADIUS * at as f64)
    }
}
