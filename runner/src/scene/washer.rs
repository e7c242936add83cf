//! `washer`: boxes in a round drum with four paddles, which turns. The scene of that name in the benchmarks of Box2D (E. Catto), but that
//! the drum does not drift by 2 mm/s.

use super::tumbler::drum;
use super::yards::{Fixture, Yard};
use atoll_core::{Kind, Material, Part, Polygon, Rot, Shape};
use glam::{DVec2, Vec2};
use std::f64::consts::TAU;

/// The drum is made of so many pieces, each of which overlaps the next by a fifth of its own angle.
const PIECES: u32 = 36;
const OVERLAP: f64 = 0.1;
/// Every ninth has a paddle.
const PADDLES: u32 = 9;
/// From the drum's middle to the ends of the paddles, to its inside and to its outside, in meters.
const RADII: [f64; 3] = [14.0, 16.0, 18.0];
/// Boxes along a side of their square, the side of one, and from one to the next, in meters.
const SIDE: u64 = 90;
const BOX: f32 = 0.2;
const SPACING: f64 = 0.21;

/// A drum, in a square that it has room in.
#[derive(Debug)]
pub(super) struct Washer;

/// What is between two distances from the middle and two angles, which count in pieces.
fn piece([near, far]: [f64; 2], [from, to]: [f64; 2]) -> Part {
    let point = |radius: f64, angle: f64| {
        let angle = angle * TAU / f64::from(PIECES);
        DVec2::new(radius * libm::cos(angle), radius * libm::sin(angle)).as_vec2()
    };
    let points: [Vec2; 4] = [point(near, from), point(far, from), point(near, to), point(far, to)];
    let (polygon, position) = Polygon::hull(&points, 0.0).expect("four corners");
    Part { shape: Shape::Polygon(polygon), position, rotation: Rot::IDENTITY }
}

impl Yard for Washer {
    const BODIES: u64 = SIDE * SIDE;
    const ROW: u64 = SIDE;
    const SIZE: DVec2 = DVec2::new(40.0, 40.0);

    fn kind() -> Kind {
        Kind::new(Shape::rectangle(BOX, BOX), Material::default())
    }

    fn around() -> Vec<Fixture> {
        let [end, inside, outside] = RADII;
        let mut parts = Vec::new();
        for number in 0..PIECES {
            let from = f64::from(number);
            parts.push(piece([inside, outside], [from - OVERLAP, from + 1.0 + OVERLAP]));
            if number % PADDLES == 0 {
                parts.push(piece([end, inside], [from, from + 1.0]));
            }
        }
        vec![drum(parts, Self::SIZE)]
    }

    fn place(row: u64, at: u64) -> DVec2 {
        // Box2D begins a little further out than half of them are wide.
        0.5 * Self::SIZE + SPACING * DVec2::new(at as f64, row as f64) - 0.11 * SIDE as f64
    }
}
