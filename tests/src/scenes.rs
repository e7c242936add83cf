//! Worlds that more than one test file looks at.

use crate::world::{Scene, noise};
use atoll_core::{Material, Shape};
use glam::{DVec2, Vec2};

/// A box of some width and height, in meters, and the same given as a polygon: what holds for one holds for the other.
pub fn boxes(width: f32, height: f32) -> [Shape; 2] {
    let half = 0.5 * Vec2::new(width, height);
    let corners = [-half, Vec2::new(half.x, -half.y), half, Vec2::new(-half.x, half.y)];
    [Shape::rectangle(width, height), Shape::polygon(&corners, 0.0).expect("four corners")]
}

/// Boxes of 0.2 m, one upon the other, hardly out of line; tile borders cross in the middle of the stack.
pub fn stack(boxes: u32) -> Scene {
    let mut scene = Scene::new(DVec2::new(0.0, 0.1 * f64::from(boxes)), -10.0);
    scene.wall(DVec2::new(0.0, -1.0), (40.0, 2.0), 0.0, Material::default());
    let kind = scene.kind(Shape::rectangle(0.2, 0.2), Material::default());
    for k in 0..boxes {
        let x = 0.01 * (noise(3, u64::from(k)) - 0.5);
        scene.body(kind, DVec2::new(x, 0.1 + 0.2 * f64::from(k)), Vec2::ZERO);
    }
    scene
}

/// Boxes and circles around the crossing of the tile borders that fall towards it and collide, while all of them drift.
pub fn cluster(bodies: u64, seed: u64) -> Scene {
    let mut scene = Scene::new(DVec2::new(0.0, 1.0), 0.0);
    let kinds = [
        scene.kind(Shape::rectangle(0.2, 0.2), Material::default()),
        scene.kind(Shape::circle(0.2), Material::default()),
    ];
    for k in 0..bodies {
        let offset = DVec2::new(noise(seed, 2 * k) - 0.5, noise(seed, 2 * k + 1) - 0.5) * 4.0;
        let velocity = (offset * -2.0).as_vec2() + Vec2::new(0.3, 0.2);
        scene.body(kinds[k as usize % 2], scene.middle + offset, velocity);
    }
    scene
}

/// A heap of boxes and circles between a floor and two walls, row by row as in the scene `pile`.
pub fn pile(columns: u64, rows: u64) -> Scene {
    let high = DVec2::new(0.5 * columns as f64 + 0.5, 0.5 * rows as f64 + 1.0);
    let mut scene = Scene::new(0.5 * high, -10.0);
    scene.half = 0.5 * high;
    let material = Material::default();
    scene.wall(DVec2::new(0.5 * high.x, -1.0), (high.x as f32 + 8.0, 2.0), 0.0, material);
    for x in [-1.0, high.x + 1.0] {
        scene.wall(DVec2::new(x, high.y), (2.0, 2.0 * high.y as f32 + 4.0), 0.0, material);
    }
    let kinds = [scene.kind(Shape::rectangle(0.2, 0.2), material), scene.kind(Shape::circle(0.2), material)];
    for k in 0..columns * rows {
        let x = 0.5 + 0.5 * (k % columns) as f64 + 0.02 * (noise(1, 2 * k + 1) - 0.5);
        let y = 0.3 + 0.5 * (k / columns) as f64;
        let kind = kinds[usize::from(noise(1, 2 * k) < 0.5)];
        scene.body(kind, DVec2::new(x, y), Vec2::ZERO);
    }
    scene
}

/// A room without gravity, full of boxes and circles that fly about, as in the scene `rooms`: 1.4 m of room each.
pub fn room(side: u64, seed: u64) -> Scene {
    let length = 1.4 * side as f64;
    let mut scene = Scene::new(DVec2::splat(0.5 * length), 0.0);
    scene.half = DVec2::splat(0.5 * length + 2.0);
    let material = Material::default();
    let long = length as f32 + 4.0;
    for (x, y, size) in [
        (-1.0, 0.5 * length, (2.0, long)),
        (length + 1.0, 0.5 * length, (2.0, long)),
        (0.5 * length, -1.0, (long, 2.0)),
        (0.5 * length, length + 1.0, (long, 2.0)),
    ] {
        scene.wall(DVec2::new(x, y), size, 0.0, material);
    }
    let kinds = [scene.kind(Shape::rectangle(0.2, 0.2), material), scene.kind(Shape::circle(0.2), material)];
    for k in 0..side * side {
        let place = DVec2::new(0.7 + 1.4 * (k % side) as f64, 0.7 + 1.4 * (k / side) as f64);
        let draw = |what: u64| noise(seed, 4 * k + what);
        let velocity = Vec2::new((20.0 * draw(1)) as f32, (20.0 * draw(2)) as f32);
        scene.body(kinds[usize::from(draw(0) < 0.5)], place, velocity);
        scene.last().angular_velocity = (5.0 * draw(3)) as f32;
    }
    scene
}
