//! `slope`: flat boxes on an incline that falls to the right. They slide if the tangent of its angle is greater than the
//! friction, and stay where they are otherwise; far down a block holds what slides that far.
//!
//! The middle of the boxes is the middle of the domain, so that with 2 x 2 tiles borders meet there. Bodies take no
//! draws: every seed gives the same world.

use super::Layout;
use atoll_core::{Body, GlobalId, Kind, KindId, Material, Rot, Shape, StaticBody};
use glam::{DVec2, Vec2};

/// Half width and half height of a box, in meters: so flat that none topples before it slides.
const BOX: Vec2 = Vec2::new(0.5, 0.25);
/// From box to box, in meters.
const SPACING: f64 = 5.0;
/// The incline runs on below the lowest box by this, and above the highest, in meters: more than a box slides in the five
/// seconds of the configuration.
const RUN: f64 = 150.0;
/// Half the thickness of the incline, in meters.
const THICKNESS: f64 = 1.0;
/// Half the side of the block at its end, in meters: thicker than anything moves in a step.
const BLOCK: f64 = 2.0;
/// Around the incline, in meters.
const SPACE: f64 = 5.0;

/// The layout of `slope`.
#[derive(Debug)]
pub(super) struct Slope {
    bodies: u64,
    rotation: Rot,
    material: Material,
}

impl Slope {
    /// `angle` is in degrees.
    pub(super) fn new(bodies: u64, angle: f64, friction: f64) -> Self {
        let angle = angle.to_radians();
        let rotation = Rot { c: libm::cos(angle) as f32, s: -libm::sin(angle) as f32 };
        Self { bodies, rotation, material: Material { friction: friction as f32, ..Material::default() } }
    }

    /// Half the length of the incline, in meters.
    fn reach(&self) -> f64 {
        0.5 * SPACING * (self.bodies - 1) as f64 + RUN
    }

    /// The point so far along the incline, downwards, and so far above the centers of the boxes, in meters. Made of the
    /// bits that the bodies turn by, so that nothing starts inside anything else.
    fn point(&self, along: f64, above: f64) -> DVec2 {
        let (c, s) = (f64::from(self.rotation.c), f64::from(self.rotation.s));
        DVec2::new(c * along - s * above, s * along + c * above)
    }

    /// Where a box lies, in meters.
    fn place(&self, index: u64) -> DVec2 {
        self.point(SPACING * (index as f64 - 0.5 * (self.bodies - 1) as f64), 0.0)
    }

    fn kind(&self, half: Vec2) -> Kind {
        Kind::new(Shape::Box { half }, self.material)
    }
}

impl Layout for Slope {
    fn bodies(&self) -> u64 {
        self.bodies
    }

    fn kinds(&self) -> Vec<Kind> {
        vec![self.kind(BOX)]
    }

    fn domain(&self) -> (DVec2, DVec2) {
        let corner = self.point(self.reach(), 0.0).abs() + SPACE;
        (-corner, corner)
    }

    fn statics(&self) -> Vec<StaticBody> {
        let surface = -f64::from(BOX.y);
        let incline = (self.point(0.0, surface - THICKNESS), Vec2::new(self.reach() as f32, THICKNESS as f32));
        let block = (self.point(self.reach(), surface + BLOCK), Vec2::splat(BLOCK as f32));
        let ids = (0..).map(GlobalId);
        let fixed = |(id, (position, half))| StaticBody {
            rotation: self.rotation,
            ..StaticBody::new(id, self.kind(half), position)
        };
        ids.zip([incline, block]).map(fixed).collect()
    }

    fn body(&self, index: u64, id: GlobalId, _seed: u64) -> Body {
        let (rotation, velocity) = (self.rotation, Vec2::ZERO);
        Body { id, position: self.place(index), rotation, velocity, angular_velocity: 0.0, kind: KindId(0) }
    }

    fn extent(&self, first: u64, last: u64) -> (DVec2, DVec2) {
        let [a, b] = [first, last].map(|index| self.place(index));
        (a.min(b), a.max(b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_lie_upon_the_incline_apart_from_each_other() {
        for (bodies, angle) in [(1, 0.0), (1, 25.0), (2, 35.0), (300, 60.0)] {
            let slope = Slope::new(bodies, angle, 0.6);
            let statics = slope.statics();
            assert_eq!(statics.iter().map(|fixed| fixed.id.0).collect::<Vec<_>>(), [0, 1]);
            let Shape::Box { half } = statics[0].kind.shape else { panic!("the incline is a box") };
            let (low, high) = slope.domain();
            assert!((low + high).length() < 1e-9);
            for index in 0..bodies {
                let body = slope.body(index, GlobalId(2 + index), 1);
                let from = (body.position - statics[0].position).as_vec2();
                let there = body.rotation.unrotate(from);
                assert!((there.y - half.y - BOX.y).abs() < 1e-3 && there.x.abs() < half.x - 1.0, "{body:?}");
                if index > 0 {
                    let step = body.position - slope.body(index - 1, GlobalId(0), 1).position;
                    assert!((step.length() - SPACING).abs() < 1e-3 && step.x > 0.0 && step.y <= 0.0);
                }
            }
        }
    }

    #[test]
    fn the_middle_of_the_boxes_is_the_middle_of_the_domain() {
        assert_eq!(Slope::new(1, 25.0, 0.6).body(0, GlobalId(2), 1).position, DVec2::ZERO);
        let pair = Slope::new(2, 25.0, 0.6);
        let places = [0, 1].map(|index| pair.body(index, GlobalId(2 + index), 1).position);
        assert!((places[0] + places[1]).length() < 1e-12);
    }
}
