//! A world that bodies are put into and taken out of while it runs, and that is asked what is where.

use atoll_core::glam::{DVec2, Vec2};
use atoll_core::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let solid = |shape| Kind::new(shape, Material::default());
    let floor = solid(Shape::rectangle(40.0, 2.0));
    let mut world = World::whole(&Blueprint {
        params: Params { gravity: Vec2::new(0.0, -10.0), ..Params::default() },
        partition: Partition::uniform(DVec2::ZERO, DVec2::new(20.0, 10.0), 2, 1)?,
        kinds: vec![solid(Shape::rectangle(1.0, 1.0)), solid(Shape::circle(0.5))],
        statics: vec![StaticBody::new(GlobalId(0), floor, DVec2::new(10.0, -1.0))],
    })?;
    let mut tower = Vec::new();
    for row in 0..5 {
        let place = DVec2::new(10.0, 0.5 + f64::from(row));
        tower.push(world.insert(Body::at_rest(GlobalId(0), KindId(0), place))?);
    }
    let (mut touching, mut meetings) = (world.contact_pairs(), 0);
    for step_number in 0..180 {
        if step_number == 60 {
            let ball = world.insert(Body::at_rest(GlobalId(0), KindId(1), DVec2::new(2.0, 3.0)))?;
            world.command(&Command::SetVelocity { id: ball, velocity: Vec2::new(25.0, 3.0), angular_velocity: 0.0 })?;
        }
        step(&mut world, &mut Loopback)?;
        let now = world.contact_pairs();
        // Who met in this step; the other way round it is who parted.
        meetings += pairs_not_in(&now, &touching).len();
        touching = now;
    }
    let hit = world.cast_ray(DVec2::new(10.0, 9.0), DVec2::new(10.0, -1.0)).expect("at least the floor is below");
    println!("{meetings} times two bodies met; {} pairs touch now", touching.len());
    println!("{} bodies; below (10, 9) lies {} at a height of {:.2} m", world.body_count(), hit.id, hit.point.y);
    println!("in the middle: {:?}", world.in_rectangle(DVec2::new(8.0, 0.1), DVec2::new(12.0, 9.0)));
    for id in tower {
        let (body, touched) = (world.get(id).expect("it fell, and is there"), world.touching(id).len());
        println!("box {id} is at {:.2} and touches {touched} others: {}", body.position, world.remove(id));
    }
    println!("{} left: {:?}", world.body_count(), world.bodies().map(|body| body.id).collect::<Vec<_>>());
    Ok(())
}
