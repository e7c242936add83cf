//! What stands around the bodies: walls, boxes without walls on top, floors.

use atoll_core::{GlobalId, Kind, Material, Shape, StaticBody};
use glam::{DVec2, Vec2};

/// Thickness of what encloses an open box, in meters.
const THICKNESS: f64 = 4.0;
/// The walls of an open box rise above it by this, in meters.
const RISE: f64 = 20.0;

/// A static rectangle between two corners.
pub(super) fn wall(id: GlobalId, low: DVec2, high: DVec2) -> StaticBody {
    let half: Vec2 = ((high - low) * 0.5).as_vec2();
    let kind = Kind::new(Shape::Box { half }, Material::default());
    StaticBody::new(id, kind, (low + high) * 0.5)
}

/// Four walls inside the border of a rectangle, with ids from `first`: left, right, bottom, top.
pub(super) fn room(first: u64, low: DVec2, high: DVec2, thickness: f64) -> [StaticBody; 4] {
    let left = (low, DVec2::new(low.x + thickness, high.y));
    let right = (DVec2::new(high.x - thickness, low.y), high);
    let bottom = (low, DVec2::new(high.x, low.y + thickness));
    let top = (DVec2::new(low.x, high.y - thickness), high);
    let mut id = first;
    [left, right, bottom, top].map(|(low, high)| {
        id += 1;
        wall(GlobalId(id - 1), low, high)
    })
}

/// A floor and two walls outside a rectangle, their faces on its border, with ids from 0: below, left, right.
pub(super) fn open_box(low: DVec2, high: DVec2) -> Vec<StaticBody> {
    let top = high.y + RISE;
    vec![
        wall(GlobalId(0), low - DVec2::splat(THICKNESS), DVec2::new(high.x + THICKNESS, low.y)),
        wall(GlobalId(1), DVec2::new(low.x - THICKNESS, low.y), DVec2::new(low.x, top)),
        wall(GlobalId(2), DVec2::new(high.x, low.y), DVec2::new(high.x + THICKNESS, top)),
    ]
}

/// Low and high corner of a static that is a rectangle and not turned.
#[cfg(test)]
pub(super) fn rectangle(fixed: &StaticBody) -> (DVec2, DVec2) {
    let Shape::Box { half } = fixed.kind.shape else { panic!("walls are boxes") };
    (fixed.position - half.as_dvec2(), fixed.position + half.as_dvec2())
}
