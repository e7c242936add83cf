//! What is done to a world while it runs.

use super::Outcome;
use atoll::error::ScriptError;
use atoll::internals::rehearse;
use atoll_core::{
    Blueprint, Body, Exchange, GlobalId, Kind, KindId, Loopback, Material, Params, Partition, Shape, StaticBody,
    StepError, World, step,
};
use glam::{DVec2, Vec2};

/// A few bodies on a floor, over two tiles.
fn world() -> World {
    let solid = |shape| Kind::new(shape, Material::default());
    let params = Params {
        gravity: Vec2::new(0.0, -10.0),
        exchange: Exchange::Substep,
        max_linear_speed: 50.0,
        ..Params::default()
    };
    let blueprint = Blueprint {
        params,
        partition: Partition::uniform(DVec2::ZERO, DVec2::new(8.0, 4.0), 2, 1).expect("it has room"),
        kinds: vec![solid(Shape::rectangle(0.5, 0.5)), solid(Shape::circle(0.25))],
        statics: vec![StaticBody::new(GlobalId(0), solid(Shape::rectangle(20.0, 1.0)), DVec2::new(4.0, -0.5))],
    };
    let mut world = World::whole(&blueprint).expect("it can be");
    for k in 0..8 {
        let place = DVec2::new(2.1 + 0.5 * (k % 4) as f64, 0.26 + 0.5 * (k / 4) as f64);
        world.add(Body::at_rest(GlobalId(k + 1), KindId((k % 2) as u32), place)).expect("its name is free");
    }
    world
}

/// Text as lines of commands, done to a small world, which is stepped before and after. Whatever they are, they are refused in one
/// line, done, or left out, and a step ends well or says that a body is no longer anywhere. Says also how many were done and not.
pub fn commands(bytes: &[u8]) -> (Outcome<ScriptError>, [usize; 2]) {
    let text = String::from_utf8_lossy(bytes);
    let mut world = world();
    step(&mut world, &mut Loopback).expect("nothing moves yet");
    let rehearsed = rehearse(&text, &mut world);
    let counts = *rehearsed.as_ref().unwrap_or(&[0; 2]);
    let before = world.body_count();
    for _ in 0..2 {
        match step(&mut world, &mut Loopback) {
            Ok(_) => assert_eq!(world.body_count(), before, "a body was lost"),
            Err(StepError::NonFinite { .. }) => break,
            Err(error) => panic!("{error}"),
        }
    }
    (Outcome::of(rehearsed), counts)
}
