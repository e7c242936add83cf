//! What moves by itself, or is moved: belts, paths, kinds that fall, are damped and turn in ways of their own, and sensors.

use atoll_core::*;
use glam::{DVec2, Vec2};
use std::f64::consts::TAU;

const G: f32 = 10.0;

/// Ten bodies in a row at most, on one tile and on four.
const TILES: [(u32, u32); 2] = [(1, 1), (2, 2)];

fn world(tiles: (u32, u32), kinds: Vec<Kind>, statics: Vec<StaticBody>) -> World {
    let params = Params { gravity: Vec2::new(0.0, -G), exchange: Exchange::Substep, ..Params::default() };
    let partition = Partition::uniform(DVec2::ZERO, DVec2::splat(40.0), tiles.0, tiles.1).unwrap();
    World::whole(&Blueprint { params, partition, kinds, statics }).unwrap()
}

fn solid(shape: Shape) -> Kind {
    Kind::new(shape, Material::default())
}

fn fixed(id: u64, shape: Shape, x: f64, y: f64) -> StaticBody {
    StaticBody::new(GlobalId(id), solid(shape), DVec2::new(x, y))
}

fn put(world: &mut World, id: u64, kind: u32, x: f64, y: f64) {
    world.add(Body::at_rest(GlobalId(id), KindId(kind), DVec2::new(x, y))).unwrap();
}

fn run(world: &mut World, steps: usize) {
    for _ in 0..steps {
        step(world, &mut Loopback).unwrap();
    }
}

fn body(world: &World, id: u64) -> Body {
    world.bodies().find(|body| body.id == GlobalId(id)).expect("it is there")
}

#[test]
fn a_belt_carries_what_lies_on_it_to_its_speed_and_no_further() {
    for tiles in TILES {
        for upside in [false, true] {
            let mut belt = fixed(0, Shape::rectangle(36.0, 1.0), 20.0, 19.5);
            belt.kind.material.surface_speed = 2.0;
            if upside {
                // Turned by half a turn it is the same belt.
                belt.rotation = Rot { c: -1.0, s: 0.0 };
            }
            let kinds = vec![solid(Shape::rectangle(0.5, 0.5)), solid(Shape::circle(0.25))];
            let mut world = world(tiles, kinds, vec![belt]);
            put(&mut world, 10, 0, 5.0, 20.25);
            // Friction 0.6: after 2 / (0.6 g) seconds it goes as the belt does.
            let slips = (2.0 / (0.6 * G) * 60.0) as usize;
            run(&mut world, slips / 2);
            let half = body(&world, 10).velocity.x;
            assert!((half - 1.0).abs() < 0.15, "{half} m/s halfway on {tiles:?}");
            run(&mut world, 60);
            let Body { position, velocity, rotation, .. } = body(&world, 10);
            assert!((velocity.x - 2.0).abs() < 1e-3 && velocity.y.abs() < 1e-3, "{velocity} on {tiles:?}");
            assert!((position.y - 20.25).abs() < 2e-3 && rotation.s.abs() < 1e-3, "{position} {rotation:?}");
            // Across the border at 20 m.
            run(&mut world, 600);
            let after = body(&world, 10);
            assert!((after.velocity.x - 2.0).abs() < 1e-3, "{} on {tiles:?}", after.velocity);
            assert!((after.position.x - position.x - 20.0).abs() < 0.02);
        }
    }
}

#[test]
fn platforms_carry_and_push_and_feel_nothing() {
    for tiles in TILES {
        // A lift that goes up and down, a cart that goes to and fro, and a heavy load on each.
        let path = |travel| Some(Path { travel, turning: 0.0 });
        let lift = StaticBody {
            path: path(Travel::Sine { amplitude: DVec2::new(0.0, 3.0), period: 6.0, phase: 0.0 }),
            ..fixed(0, Shape::rectangle(4.0, 1.0), 10.0, 19.9)
        };
        let cart = StaticBody {
            path: path(Travel::Sine { amplitude: DVec2::new(4.0, 0.0), period: 10.0, phase: 0.25 }),
            ..fixed(1, Shape::rectangle(4.0, 1.0), 22.0, 9.0)
        };
        let heavy = Kind::new(Shape::rectangle(1.0, 1.0), Material { density: 1e6, ..Material::default() });
        let mut world = world(tiles, vec![heavy, solid(Shape::circle(0.5))], vec![lift, cart]);
        put(&mut world, 10, 0, 10.0, 20.9);
        put(&mut world, 11, 0, 26.0, 10.0);
        for at in 1..=600 {
            run(&mut world, 1);
            let time = f64::from(at) / 60.0;
            let (up, right) = (body(&world, 10), body(&world, 11));
            let height = 20.9 + 3.0 * (TAU * time / 6.0).sin();
            assert!((up.position.y - height).abs() < 0.02, "{} for {height} at {time} s, {tiles:?}", up.position.y);
            // Friction carries it at up to 6 m/s^2; the cart takes 1.6.
            let place = 22.0 + 4.0 * (TAU * (time / 10.0 + 0.25)).sin();
            assert!((right.position.x - place).abs() < 0.05, "{} for {place} at {time} s", right.position.x);
            assert!((right.position.y - 10.0).abs() < 5e-3 && right.rotation.s.abs() < 5e-3);
        }
    }
}

/// By Coulomb's friction its mean speed over whole periods dies away. With the speed of the static as it is on the mean of a step it went on by
/// 0.12 m/s for ever, as friction then turns round between two steps alone, and a period of whole steps has them always alike.
#[test]
fn what_slides_on_a_shaker_goes_nowhere() {
    for tiles in TILES {
        let rough = |shape| Kind::new(shape, Material { friction: 0.4, ..Material::default() });
        let shaken = Travel::Sine { amplitude: DVec2::new(0.5, 0.0), period: 1.0, phase: 0.0 };
        let shaker = StaticBody {
            path: Some(Path { travel: shaken, turning: 0.0 }),
            ..StaticBody::new(GlobalId(0), rough(Shape::rectangle(36.0, 1.0)), DVec2::new(20.0, 19.5))
        };
        let mut world = world(tiles, vec![rough(Shape::rectangle(1.0, 0.4))], vec![shaker]);
        put(&mut world, 1, 0, 19.0, 20.2);
        run(&mut world, 600);
        let before = body(&world, 1).position.x;
        run(&mut world, 600);
        let speed = (body(&world, 1).position.x - before) / 10.0;
        assert!(speed.abs() < 0.03, "{speed} m/s on {tiles:?}");
    }
}

/// What bounces off a plate that goes round leaves as Newton's restitution and a friction that holds have it of the speed of the plate as they
/// meet: each speed against a search for that moment.
#[test]
fn a_plate_that_goes_round_throws_back_as_fast_as_it_is_when_it_is_hit() {
    const RESTITUTION: f64 = 0.8;
    const RADIUS: f64 = 0.1;
    const PERIOD: f64 = 0.4;
    let gravity = f64::from(G);
    for tiles in TILES {
        let ball = Material { restitution: RESTITUTION as f32, friction: 2.0, ..Material::default() };
        let travel = Travel::Circle { radius: RADIUS, period: PERIOD, phase: 0.0 };
        let plate = StaticBody {
            path: Some(Path { travel, turning: 0.0 }),
            ..fixed(100, Shape::rectangle(39.0, 1.0), 20.0, 19.5)
        };
        let mut world = world(tiles, vec![Kind::new(Shape::circle(0.1), ball)], vec![plate]);
        (0..100).for_each(|i| put(&mut world, i, 0, 1.0 + 0.38 * i as f64, 22.0 + 0.0173 * i as f64));
        let mut bounces = 0;
        let mut falling: Vec<Body> = world.bodies().collect();
        falling.sort_by_key(|body| body.id);
        for at in 0..90 {
            run(&mut world, 1);
            for body in world.bodies() {
                let fell = &mut falling[body.id.0 as usize];
                if fell.velocity.y > 0.0 || body.velocity.y <= 0.0 {
                    *fell = body;
                    continue;
                }
                let phase = |time: f64| TAU * (f64::from(at) / 60.0 + time) / PERIOD;
                let top = |time: f64| 20.1 + RADIUS * phase(time).sin();
                let speed = f64::from(fell.velocity.y);
                let falls = |time: f64| fell.position.y + speed * time - 0.5 * gravity * time * time;
                let hit = (0..).map(|i| f64::from(i) * 1e-5).find(|&time| falls(time) <= top(time)).unwrap();
                let plate = DVec2::new(-phase(hit).sin(), phase(hit).cos()) * (RADIUS * TAU / PERIOD);
                let rolls = f64::from(fell.velocity.x + 0.1 * fell.angular_velocity);
                let leaves = DVec2::new(
                    f64::from(fell.velocity.x) - (rolls - plate.x) / 3.0,
                    (1.0 + RESTITUTION) * plate.y + RESTITUTION * (gravity * hit - speed),
                );
                let velocity = body.velocity.as_dvec2();
                let off = (velocity - leaves).abs().max_element();
                assert!(off < 0.02, "{velocity} m/s and not {leaves} off a plate of {plate} m/s on {tiles:?}");
                bounces += 1;
                *fell = body;
            }
        }
        assert!(bounces > 110);
    }
}

/// A paddle that turns hits a disc: with restitution 1 the disc leaves with twice the speed of what hits it.
#[test]
fn a_paddle_hits_as_hard_as_it_turns() {
    for tiles in TILES {
        let bouncy = Material { friction: 0.0, restitution: 1.0, ..Material::default() };
        let paddle = StaticBody {
            kind: Kind::new(Shape::rectangle(4.0, 0.5), bouncy),
            path: Some(Path { travel: Travel::Rest, turning: 2.0 }),
            ..fixed(0, Shape::circle(1.0), 20.0, 20.0)
        };
        let mut disc = Kind::new(Shape::circle(0.2), bouncy);
        disc.dynamics.gravity_scale = 0.0;
        let mut world = world(tiles, vec![disc], vec![paddle]);
        put(&mut world, 10, 0, 21.5, 21.0);
        run(&mut world, 60);
        let disc = body(&world, 10);
        // Where it was met the paddle's surface came at |w x r|, along its normal at w times the way along the paddle.
        let speed = disc.velocity.length();
        let along = (1.5_f32 * 1.5 + 1.0 - 0.45 * 0.45).sqrt();
        assert!((speed - 2.0 * 2.0 * along).abs() < 0.03 * speed, "{speed} m/s for {}", 4.0 * along);
    }
}

#[test]
fn kinds_fall_are_damped_and_turn_in_ways_of_their_own() {
    for tiles in TILES {
        let ball = |dynamics| Kind { dynamics, ..solid(Shape::circle(0.2)) };
        let plain = Dynamics::default();
        let kinds = vec![
            ball(plain),
            ball(Dynamics { gravity_scale: 0.0, ..plain }),
            ball(Dynamics { gravity_scale: -0.5, ..plain }),
            ball(Dynamics { gravity_scale: 0.0, linear_damping: 2.0, angular_damping: 3.0, ..plain }),
            Kind { dynamics: Dynamics { fixed_rotation: true, ..plain }, ..solid(Shape::rectangle(1.0, 1.0)) },
        ];
        let floor = fixed(0, Shape::rectangle(40.0, 1.0), 20.0, 0.5);
        let mut world = world(tiles, kinds, vec![floor]);
        for kind in 0..4 {
            put(&mut world, 10 + u64::from(kind), kind, 4.0 + 3.0 * f64::from(kind), 30.0);
        }
        let fast = Body { velocity: Vec2::X, angular_velocity: 5.0, ..body(&world, 13) };
        world.remove(GlobalId(13));
        world.add(fast).unwrap();
        // It stands on a corner, and would fall over.
        let tilted = Body::at_rest(GlobalId(14), KindId(4), DVec2::new(30.0, 2.0));
        world.add(Body { rotation: Rot::from_angle(0.4), angular_velocity: 3.0, ..tilted }).unwrap();
        run(&mut world, 60);
        let fallen = |id| body(&world, id).velocity.y;
        assert!((fallen(10) + 10.0).abs() < 1e-4 && fallen(11) == 0.0 && (fallen(12) - 5.0).abs() < 1e-4);
        let damped = body(&world, 13);
        let left = |rate: f32| (1.0 + rate / 240.0).powi(-240);
        assert!((damped.velocity.x - left(2.0)).abs() < 1e-5, "{}", damped.velocity.x);
        assert!((damped.angular_velocity - 5.0 * left(3.0)).abs() < 1e-5, "{}", damped.angular_velocity);
        let tilted = body(&world, 14);
        assert_eq!(tilted.rotation, Rot::from_angle(0.4), "it turned");
        assert!(tilted.angular_velocity == 0.0 && tilted.velocity.length() < 0.01 && tilted.position.y < 1.7);
    }
}

#[test]
fn filters_and_sensors_let_through() {
    let ball =
        |categories, mask, group| Kind { filter: Filter { categories, mask, group }, ..solid(Shape::circle(0.3)) };
    let mut gate = fixed(1, Shape::rectangle(10.0, 2.0), 10.0, 10.0);
    gate.kind.sensor = true;
    let mut floor = fixed(0, Shape::rectangle(40.0, 1.0), 20.0, 0.5);
    floor.kind.filter = Filter { categories: 2, ..Filter::default() };
    let kinds = vec![ball(1, u32::MAX, 0), ball(1, 1, 0), ball(4, u32::MAX, -3), ball(4, u32::MAX, -3)];
    let mut world = world((2, 2), kinds, vec![floor, gate]);
    put(&mut world, 10, 0, 8.0, 14.0);
    // Touches no floor.
    put(&mut world, 11, 1, 15.0, 14.0);
    // Two that do not touch each other, one upon the other.
    put(&mut world, 12, 2, 30.0, 1.3);
    put(&mut world, 13, 3, 30.0, 1.9);
    let mut seen = Vec::new();
    for _ in 0..100 {
        run(&mut world, 1);
        let inside = world.inside_sensors(&world.sensors());
        let falls = body(&world, 10).position.y;
        let is_inside = (8.7..=11.3).contains(&falls);
        assert_eq!(inside.contains(&(GlobalId(1), GlobalId(10))), is_inside, "at {falls} m");
        assert!(inside.iter().all(|(sensor, body)| *sensor == GlobalId(1) && body.0 < 12));
        seen.push(is_inside);
    }
    assert!(seen.iter().any(|&inside| inside) && !seen[99]);
    run(&mut world, 200);
    assert!((body(&world, 10).position.y - 1.3).abs() < 0.01, "the gate pushed");
    assert!(body(&world, 11).position.y < -5.0, "the floor held what does not touch it");
    assert!((body(&world, 13).position.y - 1.3).abs() < 0.01, "two of a negative group touch");
}

#[test]
fn what_cannot_move_so_is_refused() {
    let blueprint = |kind: Kind, fixed: StaticBody| Blueprint {
        params: Params::default(),
        partition: Partition::uniform(DVec2::ZERO, DVec2::ONE, 1, 1).unwrap(),
        kinds: vec![kind],
        statics: vec![fixed],
    };
    let mut belt = solid(Shape::circle(1.0));
    belt.material.surface_speed = 1.0;
    let wall = fixed(3, Shape::circle(1.0), 0.0, 0.0);
    let refused = World::whole(&blueprint(belt.clone(), wall.clone())).unwrap_err();
    assert_eq!(refused, SetupError::SurfaceMoves { kind: KindId(0) });
    let path = Path { travel: Travel::Circle { radius: 1.0, period: 0.0, phase: 0.0 }, turning: 0.0 };
    let lost = StaticBody { path: Some(path), ..wall };
    let refused = World::whole(&blueprint(solid(Shape::circle(1.0)), lost)).unwrap_err();
    assert_eq!(refused, SetupError::BadStatic { id: GlobalId(3) });
}
