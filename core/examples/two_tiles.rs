//! Two tiles, a halo of one's own, and a disc that flies from one tile into the other.

use atoll_core::{
    Blueprint, Body, GlobalId, Halo, Inbox, Kind, KindId, Material, Outbox, Params, Rot, Shape, TileGrid, TileId,
    World, step,
};
use glam::{DVec2, Vec2};
use std::convert::Infallible;

/// Both tiles live in this process: every message is delivered on the spot.
struct Loopback;

impl Halo for Loopback {
    type Error = Infallible;
    fn exchange(&mut self, outbox: &mut Outbox, inbox: &mut Inbox) -> Result<(), Infallible> {
        outbox.deliver(inbox);
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let grid = TileGrid::new(DVec2::ZERO, DVec2::new(20.0, 10.0), 2, 1)?;
    let disc = Kind { shape: Shape::circle(0.2), material: Material::default() };
    let blueprint = Blueprint { params: Params::default(), grid, kinds: vec![disc], statics: vec![] };
    let mut world = World::new(&blueprint, &[TileId(0), TileId(1)])?;
    world.add(Body {
        id: GlobalId(0),
        position: DVec2::new(9.0, 5.0),
        rotation: Rot::IDENTITY,
        velocity: Vec2::new(3.0, 0.0),
        angular_velocity: 0.0,
        kind: KindId(0),
    })?;
    for _ in 0..60 {
        let report = step(&mut world, &mut Loopback)?;
        if report.migrations > 0 {
            println!("step {}: the disc changed tiles", report.step);
        }
    }
    println!("{:?}\n{}", world.bodies().next().expect("one body").position, world.hashes());
    Ok(())
}
