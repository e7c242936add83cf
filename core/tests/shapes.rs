//! How polygons, capsules, compounds and chains behave, held against what theory says of them and against boxes.

use atoll_core::*;
use glam::{DVec2, Vec2};

const G: f32 = 10.0;

fn polygon(points: &[(f32, f32)], radius: f32) -> Shape {
    let points: Vec<_> = points.iter().map(|&(x, y)| Vec2::new(x, y)).collect();
    Shape::polygon(&points, radius).unwrap()
}

fn square(side: f32) -> Shape {
    let half = 0.5 * side;
    polygon(&[(-half, -half), (half, -half), (half, half), (-half, half)], 0.0)
}

/// One of each that can lie flat, and half the height of it.
fn flat_shapes() -> [(Shape, f64); 5] {
    [
        (Shape::circle(0.25), 0.25),
        (Shape::rectangle(0.5, 0.5), 0.25),
        (square(0.5), 0.25),
        (Shape::capsule(0.5, 0.2).unwrap(), 0.2),
        (polygon(&[(-0.4, -0.1), (0.4, -0.1), (0.4, 0.1), (-0.4, 0.1)], 0.1), 0.2),
    ]
}

/// A static for each segment of a chain, named from a number on.
fn chain(points: &[DVec2], first: u64, material: Material) -> Vec<StaticBody> {
    let at = |i: isize| usize::try_from(i).ok().and_then(|i| points.get(i)).copied();
    let segment = |(i, ends): (usize, &[DVec2])| {
        let seen = |point: Option<DVec2>| point.map(|point| (point - ends[0]).as_vec2());
        let (before, after) = (seen(at(i as isize - 1)), seen(at(i as isize + 2)));
        let (segment, middle) = Segment::new(before, Vec2::ZERO, (ends[1] - ends[0]).as_vec2(), after).unwrap();
        let kind = Kind::new(Shape::Segment(segment), material);
        StaticBody::new(GlobalId(first + i as u64), kind, ends[0] + middle.as_dvec2())
    };
    points.windows(2).enumerate().map(segment).collect()
}

fn world(size: DVec2, tiles: (u32, u32), kinds: Vec<Kind>, statics: Vec<StaticBody>) -> World {
    let params = Params { gravity: Vec2::new(0.0, -G), ..Params::default() };
    let partition = Partition::uniform(DVec2::ZERO, size, tiles.0, tiles.1).unwrap();
    World::whole(&Blueprint { params, partition, kinds, statics }).unwrap()
}

fn bodies(world: &World) -> Vec<Body> {
    let mut all: Vec<_> = world.bodies().collect();
    all.sort_by_key(|body| body.id);
    all
}

/// A disc, a box and a capsule slide without friction over a thousand joints: none of them is felt.
#[test]
fn what_slides_over_a_chain_feels_no_joint() {
    let ice = Material { friction: 0.0, ..Material::default() };
    let points: Vec<DVec2> = (0..=1000).map(|i| DVec2::new(10.0 + 0.5 * f64::from(i), 5.0)).collect();
    for (number, (shape, height)) in flat_shapes().into_iter().enumerate() {
        for speed in [0.7_f32, 5.0] {
            let kinds = vec![Kind::new(shape.clone(), ice)];
            let mut world = world(DVec2::new(520.0, 20.0), (8, 1), kinds, chain(&points, 0, ice));
            let rest = 5.0 + height;
            let body = Body::at_rest(GlobalId(5000), KindId(0), DVec2::new(12.0, rest));
            world.add(Body { velocity: Vec2::new(speed, 0.0), ..body }).unwrap();
            let steps = if speed > 1.0 { 5800 } else { 2000 };
            for at in 0..steps {
                step(&mut world, &mut Loopback).unwrap();
                let body = world.bodies().next().unwrap();
                let off = (body.position.y - rest).abs();
                assert!(off < 1e-3, "shape {number} at {speed} m/s, step {at}, x {}: {off} m off", body.position.x);
                let lost = (body.velocity.x - speed).abs() / speed;
                assert!(lost < 1e-3, "shape {number}, step {at}: {} of {speed} m/s", body.velocity.x);
            }
            let body = world.bodies().next().unwrap();
            let expected = 12.0 + f64::from(speed) * f64::from(steps) / 60.0;
            assert!((body.position.x - expected).abs() < 1e-3 * expected, "{} for {expected}", body.position.x);
            assert!(body.rotation.s.abs() < 1e-3 || number == 0, "it turned to {:?}", body.rotation);
        }
    }
}

/// A chain is solid from its left only, and whoever comes fast does not pass between two segments.
#[test]
fn a_chain_holds_what_comes_from_its_free_side() {
    let points: Vec<DVec2> = (0..=40)
        .map(|i| {
            let x = 2.0 + 0.4 * f64::from(i);
            DVec2::new(x, 4.0 + (0.9 * x).sin())
        })
        .collect();
    let shapes = [
        Shape::circle(0.1),
        Shape::rectangle(0.2, 0.3),
        square(0.2),
        Shape::capsule(0.3, 0.05).unwrap(),
        polygon(&[(0.0, 0.0), (0.4, 0.1), (0.1, 0.3)], 0.0),
    ];
    let kinds: Vec<_> = shapes.iter().map(|shape| Kind::new(shape.clone(), Material::default())).collect();
    let mut held = world(DVec2::splat(20.0), (2, 2), kinds.clone(), chain(&points, 0, Material::default()));
    for i in 0..200_u64 {
        let place = DVec2::new(2.5 + 0.073 * i as f64, 9.0 + 0.37 * (i % 7) as f64);
        let body = Body::at_rest(GlobalId(100 + i), KindId((i % 5) as u32), place);
        held.add(Body { velocity: Vec2::new(3.0 - (i % 7) as f32, -10.0 * (i % 13) as f32), ..body }).unwrap();
    }
    let ground = |x: f64| 4.0 + (0.9 * x).sin();
    for _ in 0..300 {
        step(&mut held, &mut Loopback).unwrap();
        for body in held.bodies().filter(|body| (2.2..17.8).contains(&body.position.x)) {
            assert!(body.position.y > ground(body.position.x) - 0.1, "fell through at {}", body.position);
        }
    }
    let mut passes = world(DVec2::splat(20.0), (1, 1), kinds, chain(&points, 0, Material::default()));
    for (i, id) in (0..5).zip(100..) {
        let body = Body::at_rest(GlobalId(id), KindId(i), DVec2::new(4.0 + 2.0 * f64::from(i), 1.0));
        passes.add(Body { velocity: Vec2::new(0.0, 12.0), ..body }).unwrap();
    }
    let free: Vec<f32> = (0..40)
        .map(|_| {
            step(&mut passes, &mut Loopback).unwrap();
            bodies(&passes)[0].velocity.y
        })
        .collect();
    assert!(free.windows(2).all(|pair| (pair[1] - pair[0] + G / 60.0).abs() < 1e-4), "{free:?}");
}

/// A chain there and back, as edges of R.U.B.E. are read, holds from both sides.
#[test]
fn a_chain_there_and_back_is_solid_from_both_sides() {
    let points: Vec<DVec2> = (0..=32).map(|i| DVec2::new(2.0 + 0.5 * f64::from(i), 10.0)).collect();
    let back: Vec<DVec2> = points.iter().rev().copied().collect();
    let mut statics = chain(&points, 0, Material::default());
    statics.extend(chain(&back, 100, Material::default()));
    let shapes = flat_shapes();
    let kinds = shapes.iter().map(|(shape, _)| Kind::new(shape.clone(), Material::default())).collect();
    let mut world = world(DVec2::splat(20.0), (2, 2), kinds, statics);
    for (i, id) in (0..5).zip(1000..) {
        // Over a joint, and between two.
        let x = 3.0 + 3.1 * f64::from(i);
        let above = Body::at_rest(GlobalId(id), KindId(i), DVec2::new(x, 12.0));
        let below = Body::at_rest(GlobalId(id + 100), KindId(i), DVec2::new(x, 8.0));
        world.add(Body { velocity: Vec2::new(0.0, -9.0), ..above }).unwrap();
        world.add(Body { velocity: Vec2::new(0.0, 9.0), ..below }).unwrap();
    }
    let mut highest = [0.0_f64; 5];
    for _ in 0..300 {
        step(&mut world, &mut Loopback).unwrap();
        for (body, i) in bodies(&world).iter().zip((0..5).cycle()) {
            let half = shapes[i].1;
            if body.id.0 < 1100 {
                assert!(body.position.y > 10.0 + half - 0.05, "{i} fell to {}", body.position.y);
            } else {
                assert!(body.position.y < 10.0 - half + 0.05, "{i} rose to {}", body.position.y);
                highest[i] = highest[i].max(body.position.y + half);
            }
        }
    }
    for (body, (_, half)) in bodies(&world).iter().zip(&shapes) {
        assert!((body.position.y - 10.0 - half).abs() < 0.01 && body.velocity.length() < 0.01, "{body:?}");
    }
    assert!(highest.iter().all(|&top| top > 9.9), "{highest:?} came to the chain from below");
}

/// Stacks of ten of a shape, over a corner of four tiles and away from any: how far they have sunk and moved after ten seconds.
fn stack(shape: Shape, height: f64, tiles: (u32, u32)) -> (f64, f64, f32) {
    let floor = StaticBody::new(
        GlobalId(0),
        Kind::new(Shape::rectangle(40.0, 2.0), Material::default()),
        DVec2::new(10.0, 3.0),
    );
    let mut world = world(DVec2::splat(20.0), tiles, vec![Kind::new(shape, Material::default())], vec![floor]);
    for i in 0..10 {
        let place = DVec2::new(10.0, 4.0 + height * (i as f64 + 0.5));
        world.add(Body::at_rest(GlobalId(1 + i), KindId(0), place)).unwrap();
    }
    for _ in 0..600 {
        step(&mut world, &mut Loopback).unwrap();
    }
    let (mut sunk, mut moved, mut fast) = (0.0_f64, 0.0_f64, 0.0_f32);
    for (i, body) in bodies(&world).iter().enumerate() {
        sunk = sunk.max((body.position.y - (4.0 + height * (i as f64 + 0.5))).abs());
        moved = moved.max((body.position.x - 10.0).abs());
        fast = fast.max(body.velocity.length() + body.angular_velocity.abs());
    }
    (sunk, moved, fast)
}

#[test]
fn polygons_capsules_and_compounds_stack_as_boxes_do() {
    let part = |shape, x, y| Part { shape, position: Vec2::new(x, y), rotation: Rot::IDENTITY };
    // A table: a plate on two legs, upside up. Its height is 1, and its center of mass at half of that.
    let table = Shape::compound(vec![
        part(Shape::rectangle(2.0, 0.2), 0.0, 0.4),
        part(Shape::rectangle(0.2, 0.6), -0.8, 0.0),
        part(Shape::rectangle(0.2, 0.6), 0.8, 0.0),
        part(Shape::rectangle(2.0, 0.2), 0.0, -0.4),
    ])
    .unwrap();
    let hexagon: Vec<(f32, f32)> =
        (0..6).map(|i| (i as f32 * std::f32::consts::FRAC_PI_3).sin_cos()).map(|(s, c)| (c, s)).collect();
    let shapes = [
        ("boxes", Shape::rectangle(1.0, 1.0), 1.0),
        ("squares", square(1.0), 1.0),
        ("hexagons", polygon(&hexagon, 0.0), 3.0_f64.sqrt()),
        ("rounded boxes", polygon(&[(-0.4, -0.4), (0.4, -0.4), (0.4, 0.4), (-0.4, 0.4)], 0.1), 1.0),
        ("capsules", Shape::capsule(1.0, 0.25).unwrap(), 0.5),
        ("tables", table, 1.0),
    ];
    for tiles in [(1, 1), (2, 2)] {
        for (name, shape, height) in shapes.clone() {
            let (sunk, moved, fast) = stack(shape, height, tiles);
            println!("{name} {tiles:?}: sunk {sunk:.5}, moved {moved:.5}, speed {fast:.6}");
            assert!(sunk < 0.05 && moved < 0.05 && fast < 0.01, "{name} on {tiles:?} tiles: {sunk} {moved} {fast}");
        }
    }
}

/// A square given as a polygon does as a box does.
#[test]
fn a_square_is_a_box() {
    let run = |shape: Shape| {
        let floor = StaticBody::new(
            GlobalId(0),
            Kind::new(Shape::rectangle(40.0, 2.0), Material::default()),
            DVec2::new(10.0, 3.0),
        );
        let mut world = world(DVec2::splat(20.0), (2, 2), vec![Kind::new(shape, Material::default())], vec![floor]);
        for i in 0..60_u64 {
            let place = DVec2::new(7.0 + 0.9 * (i % 7) as f64, 5.0 + 1.1 * (i / 7) as f64);
            let body = Body::at_rest(GlobalId(1 + i), KindId(0), place);
            world.add(Body { rotation: Rot::from_angle(0.3 * i as f32), ..body }).unwrap();
        }
        let mut contacts = 0;
        for _ in 0..600 {
            contacts = step(&mut world, &mut Loopback).unwrap().contacts;
        }
        let facts = Facts::total(measure(&world, &mut Loopback).unwrap());
        (contacts, facts)
    };
    let ((boxes, box_facts), (squares, square_facts)) = (run(Shape::rectangle(0.8, 0.8)), run(square(0.8)));
    println!("{boxes} {squares} {box_facts:?} {square_facts:?}");
    assert!(boxes.abs_diff(squares) * 5 < boxes, "{boxes} and {squares} contacts");
}
