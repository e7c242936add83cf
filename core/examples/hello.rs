//! A box falls on a floor.

use atoll_core::glam::{DVec2, Vec2};
use atoll_core::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let solid = |width, height| Kind::new(Shape::rectangle(width, height), Material::default());
    let blueprint = Blueprint {
        params: Params { gravity: Vec2::new(0.0, -10.0), ..Params::default() },
        partition: Partition::uniform(DVec2::ZERO, DVec2::splat(10.0), 1, 1)?,
        kinds: vec![solid(1.0, 1.0)],
        statics: vec![StaticBody::new(GlobalId(0), solid(20.0, 2.0), DVec2::new(5.0, -1.0))],
    };
    let mut world = World::whole(&blueprint)?;
    world.add(Body::at_rest(GlobalId(1), KindId(0), DVec2::new(5.0, 4.5)))?;
    for second in 1..=3 {
        for _ in 0..60 {
            step(&mut world, &mut Loopback)?;
        }
        let facts = Facts::total(measure(&world, &mut Loopback)?);
        let height = world.bodies().next().expect("one body").position.y;
        println!("after {second} s: at {height:.3} m, {} contacts, {:.1e} J", facts.contacts, facts.kinetic_energy);
    }
    Ok(())
}
