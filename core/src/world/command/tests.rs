use super::*;
use crate::Loopback;
use crate::model::body::StaticBody;
use crate::model::kind::{Dynamics, Material};
use crate::model::math::Rot;
use crate::model::params::{Exchange, Params};
use crate::model::shape::Shape;
use crate::step::{finish, step};
use crate::testing::{circle, rectangle};
use crate::tiling::blueprint::Blueprint;
use crate::tiling::partition::Partition;
use std::collections::BTreeMap;

fn blueprint(exchange: Exchange, columns: u32, sleep: bool) -> Blueprint {
    let params = Params { gravity: Vec2::new(0.0, -10.0), exchange, sleep, ..Params::default() };
    let partition = Partition::uniform(DVec2::new(-8.0, 0.0), DVec2::new(8.0, 8.0), columns, 1).unwrap();
    let statics = vec![StaticBody::new(GlobalId(0), rectangle(40.0, 2.0), DVec2::new(0.0, -1.0))];
    Blueprint { params, partition, kinds: vec![circle(0.25), rectangle(0.5, 0.5)], statics }
}

fn heap(bodies: u64) -> impl Iterator<Item = Body> {
    (0..bodies).map(|k| {
        let place = DVec2::new(0.52 * (k % 24) as f64 - 6.0, 0.26 + 0.51 * (k / 24) as f64);
        Body::at_rest(GlobalId(k + 1), KindId((k % 3 > 0).into()), place)
    })
}

fn world(exchange: Exchange, columns: u32) -> World {
    let mut world = World::whole(&blueprint(exchange, columns, false)).unwrap();
    heap(240).for_each(|body| assert!(world.add(body).unwrap()));
    world
}

fn sorted(world: &World) -> Vec<Body> {
    let mut bodies: Vec<Body> = world.bodies().collect();
    bodies.sort_unstable_by_key(|body| body.id);
    bodies
}

/// A pseudo-random number below a bound, for each of the numbers from 0.
fn pick(number: u64, bound: u64) -> u64 {
    (number.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 33) % bound
}

/// A kind for which the halo must grow, and one for which it need not, that moves otherwise.
fn added_kinds() -> [Kind; 2] {
    let dynamics = Dynamics { gravity_scale: 0.5, ..Dynamics::default() };
    [circle(0.9), Kind { dynamics, ..circle(0.1) }]
}

/// Some commands for a step.
fn commands(number: u64) -> Vec<Command> {
    let id = |k: u64| GlobalId(1 + pick(16 * number + k, 320));
    let body = |k: u64| {
        let place = DVec2::new(pick(16 * number + k, 1500) as f64 * 0.01 - 7.5, 6.0 + 0.6 * k as f64);
        Body { velocity: Vec2::new(0.0, -3.0), ..Body::at_rest(GlobalId(1000 + 4 * number + k), KindId(0), place) }
    };
    let mut all: Vec<Command> = (0..3).map(|k| Command::Add(body(k))).collect();
    all.extend((0..4).map(|k| Command::Remove(id(k))));
    // A name that was just given back.
    all.push(Command::Add(Body { id: id(0), kind: KindId(1), ..body(3) }));
    all.push(Command::SetVelocity { id: id(5), velocity: Vec2::new(3.0, 4.0), angular_velocity: -2.0 });
    let at = Some(DVec2::new(0.1, 0.2));
    all.push(Command::Impulse { id: id(6), impulse: Vec2::new(0.1, 0.4), at, angular: 0.01 });
    all.push(Command::Force { id: id(7), force: Vec2::new(2.0, 0.0), torque: 0.1, steps: 5 });
    all.push(Command::SetKind { id: id(8), kind: KindId((number % 2) as u32) });
    // Most likely a name that is taken.
    all.push(Command::Add(Body { id: id(9), ..body(3) }));
    match number {
        9 => all.push(Command::SetGravity(Vec2::new(5.0, -8.0))),
        14 => all.push(Command::AddKind(added_kinds()[0].clone())),
        15..20 => all.push(Command::Add(Body { id: GlobalId(5000 + number), kind: KindId(2), ..body(4) })),
        20 => all.push(Command::AddKind(added_kinds()[1].clone())),
        21..25 => all.push(Command::Add(Body { id: GlobalId(5000 + number), kind: KindId(3), ..body(4) })),
        _ => {}
    }
    all
}

/// A copy by way of bytes.
fn saved_and_restored(world: &World, exchange: Exchange, columns: u32) -> World {
    let mut bytes = Vec::new();
    let saved = world.save(&mut bytes);
    let mut again = World::whole(&blueprint(exchange, columns, false)).unwrap();
    for kind in &added_kinds()[..world.setup.dynamic_kinds - 2] {
        again.add_kind(kind).unwrap();
    }
    again.command(&Command::SetGravity(world.gravity())).unwrap();
    let mut rest = &bytes[..];
    for saved in saved {
        again.restore(saved.tile, rest.split_off(..saved.length).unwrap()).unwrap();
    }
    again.resume_at(world.step_count());
    again.forces = world.forces.clone();
    again
}

/// Bodies as a table of them would have it.
fn follow(table: &mut BTreeMap<GlobalId, Body>, command: &Command) -> bool {
    match *command {
        Command::Add(body) => table.insert(body.id, body).is_none(),
        Command::Remove(id) => table.remove(&id).is_some(),
        Command::SetVelocity { id, velocity, angular_velocity } => {
            let change = |body: &mut Body| (body.velocity, body.angular_velocity) = (velocity, angular_velocity);
            table.get_mut(&id).map(change).is_some()
        }
        Command::Impulse { id, impulse, at, angular } => {
            let change = |body: &mut Body| {
                let [third, fourth] = added_kinds();
                let kind = &[circle(0.25), rectangle(0.5, 0.5), third, fourth][body.kind.0 as usize];
                let mass = kind.material.density * kind.shape.area();
                body.velocity += impulse * (1.0 / mass);
                let arm = (at.unwrap() - body.position).as_vec2();
                body.angular_velocity += (angular + cross(arm, impulse)) / (mass * kind.shape.inertia_per_mass());
            };
            table.get_mut(&id).map(change).is_some()
        }
        Command::SetKind { id, kind } => table.get_mut(&id).map(|body| body.kind = kind).is_some(),
        Command::Force { id, .. } | Command::Wake(id) => table.contains_key(&id),
        Command::AddKind(_) | Command::SetGravity(_) => true,
    }
}

#[test]
fn a_world_follows_its_commands_as_a_table_does_and_can_be_saved_at_once() {
    for (exchange, columns) in [(Exchange::Substep, 5), (Exchange::Step, 5), (Exchange::Step, 1)] {
        let mut world = world(exchange, columns);
        let mut settled_often = self::world(exchange, columns);
        let (mut applied, mut refused) = (0, 0);
        for number in 0..30 {
            let mut table: BTreeMap<GlobalId, Body> = world.bodies().map(|body| (body.id, body)).collect();
            for command in commands(number) {
                let _ = settled_often.command(&command);
                settled_often.settle();
                let is_double = matches!(command, Command::Add(body) if table.contains_key(&body.id));
                match world.command(&command) {
                    Ok(here) => {
                        assert_eq!(here, follow(&mut table, &command), "{command:?}");
                        applied += usize::from(here);
                    }
                    Err(SetupError::NameTaken { .. }) => assert!(is_double, "{command:?}"),
                    Err(error) => panic!("{command:?}: {error}"),
                }
                refused += usize::from(is_double);
            }
            assert_eq!(sorted(&world), table.values().copied().collect::<Vec<_>>(), "before step {number}");
            assert_eq!(world.body_count(), table.len());
            assert!((0..400).map(GlobalId).all(|id| world.get(id) == table.get(&id).copied()));
            let mut again = saved_and_restored(&world, exchange, columns);
            assert_eq!(again.hashes(), world.hashes());
            // Whoever was given back is known by name as well.
            let there = *table.values().next().unwrap();
            assert_eq!(again.add(there), Err(SetupError::NameTaken { id: there.id }));
            for _ in 0..2 {
                step(&mut world, &mut Loopback).unwrap();
                step(&mut again, &mut Loopback).unwrap();
                step(&mut settled_often, &mut Loopback).unwrap();
                assert_eq!(again.hashes(), world.hashes(), "after step {number}");
                assert_eq!(settled_often.hashes(), world.hashes(), "after step {number}");
            }
        }
        assert!(applied > 250 && refused > 0, "{applied} applied, {refused} refused");
        assert!([2, 3].iter().all(|&kind| world.bodies().any(|body| body.kind == KindId(kind))));
        finish(world, &mut Loopback).unwrap();
    }
}

#[test]
fn whatever_slept_on_a_body_that_is_gone_falls() {
    let fixed = |change: fn(&mut World)| {
        let mut world = World::whole(&blueprint(Exchange::Step, 1, true)).unwrap();
        for k in 0..3 {
            let place = DVec2::new(0.0, 0.25 + 0.5 * f64::from(k));
            world.add(Body::at_rest(GlobalId(1 + k as u64), KindId(1), place)).unwrap();
        }
        let asleep = |world: &mut World| step(world, &mut Loopback).unwrap().asleep;
        for _ in 0..120 {
            asleep(&mut world);
        }
        assert_eq!(asleep(&mut world), 3);
        change(&mut world);
        for _ in 0..60 {
            asleep(&mut world);
        }
        world.get(GlobalId(3)).unwrap()
    };
    assert!((fixed(|_| ()).position.y - 1.25).abs() < 0.02);
    let fallen = fixed(|world| assert!(world.remove(GlobalId(1))));
    assert!((fallen.position.y - 0.75).abs() < 0.02, "{fallen:?}");
    // The same gravity, and to remove a static, which is not done, changes nothing.
    let left = fixed(|world| {
        assert!(world.command(&Command::SetGravity(world.gravity())).unwrap());
        assert_eq!(world.touching(GlobalId(1)).len(), 2);
        assert!(!world.remove(GlobalId(0)));
        assert_eq!(world.touching(GlobalId(1)).len(), 2);
        assert_eq!(step(world, &mut Loopback).unwrap().asleep, 3);
    });
    assert!((left.position.y - 1.25).abs() < 0.02, "{left:?}");
    let lifted = fixed(|world| assert!(world.command(&Command::SetGravity(Vec2::new(0.0, 10.0))).unwrap()));
    assert!(lifted.position.y > 4.0, "{lifted:?}");
    let struck = fixed(|world| {
        let impulse = Vec2::new(1.0, 0.0);
        assert!(world.command(&Command::Impulse { id: GlobalId(3), impulse, at: None, angular: 0.0 }).unwrap());
    });
    assert!(struck.position.x > 0.3, "{struck:?}");
}

#[test]
fn a_force_is_its_time_over_the_mass() {
    let mut world =
        World::whole(&Blueprint { params: Params::default(), ..blueprint(Exchange::Step, 3, false) }).unwrap();
    let id = world.insert(Body::at_rest(GlobalId(0), KindId(1), DVec2::new(0.0, 4.0))).unwrap();
    assert_eq!(id, GlobalId(1));
    // A quarter of a kilogram, through half a second.
    let force = Command::Force { id, force: Vec2::new(0.5, 0.0), torque: 0.0, steps: 30 };
    assert!(world.command(&force).unwrap());
    for _ in 0..45 {
        step(&mut world, &mut Loopback).unwrap();
    }
    let speed = world.get(id).unwrap().velocity;
    assert!((speed.x - 1.0).abs() < 1e-4 && speed.y == 0.0, "{speed}");
    assert_eq!(world.insert(Body::at_rest(id, KindId(0), DVec2::ONE)).unwrap(), GlobalId(2));
}

/// What is held by its weight hangs still; what is pushed by less than friction holds does not creep; and two that are pressed together,
/// each by a tile of its own, stay, though nothing bears on either but what the other tile tells of it.
/// A body that comes under the name of one that went is another.
#[test]
fn a_force_goes_with_its_body() {
    let mut world = World::whole(&blueprint(Exchange::Step, 2, false)).unwrap();
    let body = Body::at_rest(GlobalId(3), KindId(0), DVec2::new(0.0, 6.0));
    world.add(body).unwrap();
    let push = Command::Force { id: body.id, force: Vec2::new(4.0, 0.0), torque: 0.0, steps: 100 };
    world.command(&push).unwrap();
    step(&mut world, &mut Loopback).unwrap();
    assert!(world.get(body.id).unwrap().velocity.x > 0.1);
    world.command(&Command::Remove(body.id)).unwrap();
    world.command(&Command::Add(body)).unwrap();
    step(&mut world, &mut Loopback).unwrap();
    assert_eq!(world.get(body.id).unwrap().velocity.x, 0.0);
}

#[test]
fn forces_that_are_in_balance_move_nobody() {
    for (exchange, columns) in
        [(Exchange::Substep, 1), (Exchange::Substep, 2), (Exchange::Step, 1), (Exchange::Step, 2)]
    {
        let mut world = World::whole(&blueprint(exchange, columns, false)).unwrap();
        let mass = world.setup.kind(KindId(1)).mass;
        let places = [(0.0, 6.0), (-3.0, 0.25), (-0.25, 3.0), (0.25, 3.0), (4.0, 0.25)].map(DVec2::from);
        let forces = [(0.0, 10.0), (5.9, 0.0), (40.0, 10.0), (-40.0, 10.0), (0.0, -90.0)].map(Vec2::from);
        let ids = places.map(|place| world.insert(Body::at_rest(GlobalId(0), KindId(1), place)).unwrap());
        for (id, force) in ids.into_iter().zip(forces) {
            // In two parts, to be added up.
            let half = Command::Force { id, force: 0.5 * mass * force, torque: 0.0, steps: 200 };
            (0..2).for_each(|_| assert!(world.command(&half).unwrap()));
        }
        (0..120).for_each(|_| assert!(step(&mut world, &mut Loopback).is_ok()));
        for (id, place) in ids.into_iter().zip(places) {
            let body = world.get(id).unwrap();
            let moved = (body.position - place).length();
            assert!(
                moved < 2e-3 && body.velocity.length() < 1e-4,
                "{exchange:?}, {columns} tiles: {moved} m, {body:?}"
            );
        }
        // What presses a body to the ground, its weight and the force, is told whole.
        let pressed = world.touching(ids[4]);
        let impulse: f32 = pressed.iter().map(|contact| contact.normal_impulse).sum();
        assert!((impulse - 100.0 * mass / 240.0).abs() < 1e-4, "{impulse}");
        // Who is removed touches nobody any more, in whichever tile, whether or not that is settled.
        let touch = |world: &World| world.touching(ids[2]).len();
        assert_eq!(touch(&world), 1);
        world.remove(ids[3]);
        assert_eq!(touch(&world), 0);
        world.settle();
        assert_eq!(touch(&world), 0);
    }
}

/// Who would be through a wall before anything is known of it is not.
#[test]
fn a_strong_force_drives_nobody_through_what_is_thin() {
    let mut world = world(Exchange::Step, 5);
    let id = world.insert(Body::at_rest(GlobalId(0), KindId(0), DVec2::new(7.2, 3.0))).unwrap();
    let force = Command::Force { id, force: Vec2::new(0.0, -1e4), torque: 0.0, steps: 3 };
    assert!(world.command(&force).unwrap());
    (0..30).for_each(|_| assert!(step(&mut world, &mut Loopback).is_ok()));
    let height = world.get(id).unwrap().position.y;
    assert!((0.2..0.3).contains(&height), "{height}");
}

#[test]
fn what_cannot_be_done_changes_nothing() {
    let mut world = world(Exchange::Substep, 5);
    let before = world.hashes();
    let nan = Vec2::new(f32::NAN, 0.0);
    let id = GlobalId(1);
    let bad = Body { position: DVec2::new(0.0, f64::INFINITY), ..Body::at_rest(GlobalId(999), KindId(0), DVec2::ZERO) };
    for (command, expected) in [
        (Command::Add(bad), SetupError::BadBody { id: bad.id, fault: BodyFault::NotFinite }),
        (
            Command::Add(Body { position: DVec2::new(0.0, -1e31), ..bad }),
            SetupError::BadBody { id: bad.id, fault: BodyFault::TooFar },
        ),
        (
            Command::Add(Body { position: DVec2::ONE, rotation: Rot { c: 2.0, s: 0.0 }, ..bad }),
            SetupError::BadBody { id: bad.id, fault: BodyFault::NoRotation },
        ),
        (
            Command::Add(Body::at_rest(bad.id, KindId(2), DVec2::ONE)),
            SetupError::BadBody { id: bad.id, fault: BodyFault::NoKind(KindId(2)) },
        ),
        (Command::Add(Body::at_rest(id, KindId(0), DVec2::ONE)), SetupError::NameTaken { id }),
        (
            Command::Add(Body::at_rest(GlobalId(0), KindId(0), DVec2::ONE)),
            SetupError::BadBody { id: GlobalId(0), fault: BodyFault::NameOfStatic },
        ),
        (Command::SetVelocity { id, velocity: nan, angular_velocity: 0.0 }, SetupError::NotFinite { id }),
        (Command::Impulse { id, impulse: nan, at: None, angular: 0.0 }, SetupError::NotFinite { id }),
        (Command::Force { id, force: nan, torque: 0.0, steps: 1 }, SetupError::NotFinite { id }),
        // What they lead to is not finite, or faster than anything may be.
        (Command::Add(Body { velocity: Vec2::X * 2e9, ..bad }), SetupError::NotFinite { id: bad.id }),
        (Command::SetVelocity { id, velocity: Vec2::X * 2e9, angular_velocity: 0.0 }, SetupError::NotFinite { id }),
        (Command::Impulse { id, impulse: Vec2::X * 2e38, at: None, angular: 0.0 }, SetupError::NotFinite { id }),
        (
            Command::Impulse { id, impulse: Vec2::X, at: Some(DVec2::Y * 1e300), angular: 0.0 },
            SetupError::NotFinite { id },
        ),
        (Command::Impulse { id, impulse: Vec2::ZERO, at: None, angular: 2e38 }, SetupError::NotFinite { id }),
        (Command::Force { id, force: Vec2::X * 1e38, torque: 3e38, steps: 1 }, SetupError::NotFinite { id }),
        (Command::SetKind { id, kind: KindId(2) }, SetupError::BadBody { id, fault: BodyFault::NoKind(KindId(2)) }),
        (Command::AddKind(Kind::new(Shape::circle(0.0), Material::default())), SetupError::BadKind { kind: KindId(2) }),
    ] {
        assert_eq!(world.command(&command), Err(expected));
    }
    assert!([nan, Vec2::new(0.0, -2e9)].iter().all(|&gravity| world.command(&Command::SetGravity(gravity)).is_err()));
    assert_eq!(world.command(&Command::Remove(GlobalId(9999))), Ok(false));
    assert_eq!(world.hashes(), before);
}
