//! Two tiles, a halo of one's own, and a disc that flies from one tile into the other.

use atoll_core::glam::{DVec2, Vec2};
use atoll_core::{
    Blueprint, Body, GlobalId, Halo, Inbox, Kind, KindId, Material, Outbox, Params, Partition, Shape, World, step,
};
use std::convert::Infallible;

/// Delivers as [`atoll_core::Loopback`] does, and counts what it delivers.
struct Counting {
    messages: usize,
}

impl Halo for Counting {
    type Error = Infallible;
    fn exchange(&mut self, outbox: &mut Outbox, inbox: &mut Inbox) -> Result<(), Infallible> {
        self.messages += outbox.messages().count();
        let _ = outbox.deliver(inbox);
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let partition = Partition::uniform(DVec2::ZERO, DVec2::new(20.0, 10.0), 2, 1)?;
    let disc = Kind::new(Shape::circle(0.2), Material::default());
    let blueprint = Blueprint { params: Params::default(), partition, kinds: vec![disc], statics: vec![] };
    let mut world = World::whole(&blueprint)?;
    let disc = Body::at_rest(GlobalId(0), KindId(0), DVec2::new(9.0, 5.0));
    world.add(Body { velocity: Vec2::new(3.0, 0.0), ..disc })?;
    let mut halo = Counting { messages: 0 };
    for _ in 0..60 {
        let report = step(&mut world, &mut halo)?;
        if report.migrations > 0 {
            println!("step {}: the disc changed tiles; {} messages so far", report.step, halo.messages);
        }
    }
    println!("{:?}\n{}", world.bodies().next().expect("one body").position, world.hashes());
    Ok(())
}
