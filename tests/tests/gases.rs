//! Many bodies that meet and part, against what theory and experiments say of them: gases and a silo.

use atoll_core::{Exchange, GlobalId, Kind, KindId, Material, Rot, Segment, Shape, StaticBody};
use atoll_tests::scenes;
use atoll_tests::world::{Scene, Sim, noise};
use glam::{DVec2, Vec2};

const MIDDLE: DVec2 = DVec2::new(-3.0, 8.0);

/// Smooth discs in a closed room without gravity, in rows, each with the same speed in some direction.
fn gas(side: u64, apart: f64, radius: f32, speed: f32, restitution: f32) -> Scene {
    let mut scene = Scene::new(MIDDLE, 0.0);
    let material = Material { friction: 0.0, restitution, ..Material::default() };
    let half = 0.5 * side as f64 * apart + 1.0;
    scene.half = DVec2::splat(half + 4.0);
    let length = 2.0 * half as f32 + 4.0;
    for (direction, size) in [(DVec2::X, (2.0, length)), (DVec2::Y, (length, 2.0))] {
        for way in [-1.0, 1.0] {
            scene.wall(MIDDLE + direction * way * (half + 1.0), size, 0.0, Material { restitution: 1.0, ..material });
        }
    }
    let disc = scene.kind(Shape::circle(radius), material);
    for k in 0..side * side {
        let place = DVec2::new((k % side) as f64, (k / side) as f64) - DVec2::splat(0.5 * (side - 1) as f64);
        let angle = (noise(5, k) * std::f64::consts::TAU) as f32;
        scene.body(disc, MIDDLE + place * apart, Rot::from_angle(angle).rotate(Vec2::X) * speed);
    }
    scene
}

/// Defect: with exchange "step" they gained energy without bound, which the program warns of; on one tile they lost three quarters
/// of it, as who was hit and met another in the same step was stopped there; and over borders as much of what bounced is sure as both
/// owners know of.
#[test]
fn discs_of_restitution_1_keep_their_energy() {
    for (grid, side, apart, steps, keep) in [
        ((1, 1), 14, 1.0, 3000, 0.99),
        ((2, 3), 14, 1.0, 3000, 0.99),
        ((4, 4), 14, 1.0, 3000, 0.99),
        ((7, 7), 14, 1.0, 3000, 0.99),
        ((12, 12), 14, 1.0, 3000, 0.99),
        // Two centimeters between them: each meets several others in each step.
        ((1, 1), 40, 0.42, 120, 0.97),
        ((5, 5), 40, 0.42, 120, 0.95),
    ] {
        let mut scene = gas(side, apart, 0.2, 5.0, 1.0);
        scene.params.restitution_threshold = 0.0;
        let mut sim = scene.start_on(grid, Exchange::Substep);
        let before = sim.kinetic_energy();
        let mut most = 0.0_f64;
        for _ in 0..30 {
            sim.run(steps / 30);
            most = most.max(sim.kinetic_energy() / before);
        }
        let after = sim.kinetic_energy() / before;
        println!("{grid:?}, {apart} m apart: at most {most:.4}, at the end {after:.4} of the energy");
        assert!(most < 1.005, "{grid:?}, {apart} m apart: {most} of the energy there was");
        assert!(after > keep, "{grid:?}, {apart} m apart: {after} of the energy is left");
    }
}

/// Ten discs in a row, a millimeter apart, and one of 28.8 times their mass. Blow by blow, as they follow on each other, the energy stays, and
/// the last disc goes off at 38.7 m/s. Defect: with those within a step passed on only in part it doubled.
#[test]
fn a_blow_goes_through_a_row_as_blow_by_blow() {
    let mut scene = Scene::new(MIDDLE, 0.0);
    scene.half = DVec2::new(200.0, 8.0);
    let material = Material { friction: 0.0, restitution: 1.0, ..Material::default() };
    let light = scene.kind(Shape::circle(0.25), material);
    let heavy = scene.kind(Shape::circle(0.3), Material { density: 20.0, ..material });
    for k in 0..10 {
        scene.body(light, MIDDLE + DVec2::new(0.501 * f64::from(k), 0.0), Vec2::ZERO);
    }
    scene.body(heavy, MIDDLE - DVec2::new(2.0, 0.0), Vec2::new(20.0, 0.0));
    let mut sim = scene.start_on((1, 1), Exchange::Substep);
    let before = sim.kinetic_energy();
    sim.run(120);
    let fastest = sim.world.bodies().map(|body| body.velocity.x).fold(0.0, f32::max);
    assert!((sim.kinetic_energy() / before - 1.0).abs() < 1e-3, "{} of {before} J", sim.kinetic_energy());
    assert!((fastest - 38.7).abs() < 0.1, "the fastest goes at {fastest} m/s");
}

/// Defect: what pressed at a light body from below, against a heavy one that bounced off the ground and left it, threw it up with fifty times
/// its weight: of 2 kJ came 3.7, for a step.
#[test]
fn a_light_body_under_a_heavy_one_that_bounces_gains_no_energy() {
    let material = |density, restitution| Material { density, restitution, ..Material::default() };
    let (mut worst, mut where_is_it) = (0.0, String::new());
    for case in 0..240 {
        let mut scene = Scene::new(MIDDLE, -10.0);
        scene.half = DVec2::splat(30.0);
        scene.wall(MIDDLE - DVec2::new(0.0, 0.5), (60.0, 1.0), 0.0, material(1.0, 0.0));
        let plank = [Shape::rectangle(0.9, 0.1), Shape::rectangle(0.4, 0.3), Shape::circle(0.15)][case % 3].clone();
        let height = [0.05, 0.15, 0.15][case % 3];
        let light = scene.kind(plank, material(0.3, 0.0));
        let corners = [(-0.6, -0.3), (0.4, -0.5), (0.6, 0.2), (-0.2, 0.5)].map(Vec2::from);
        let heavy = scene.kind(Shape::polygon(&corners, 0.3).unwrap(), material(4.0, 0.5));
        let random = |k: u64| noise(11, 8 * case as u64 + k);
        scene.body(light, MIDDLE + DVec2::new(0.0, height), Vec2::ZERO);
        let place = DVec2::new(2.4 * random(0) - 1.2, 1.7 + random(1));
        scene.body(heavy, MIDDLE + place, Vec2::new(2.0 * random(2) as f32 - 1.0, -25.0 * random(3) as f32));
        let body = scene.last();
        body.rotation = Rot::from_angle(6.0 * random(4) as f32);
        body.angular_velocity = 20.0 * random(5) as f32 - 10.0;
        let mut sim = scene.start_on((1, 1), Exchange::Step);
        let energy = |sim: &Sim| {
            let lifted = sim.world.bodies().map(|body| sim.mass(&body) * 10.0 * (body.position.y - MIDDLE.y));
            sim.kinetic_energy() + lifted.sum::<f64>()
        };
        let before = energy(&sim);
        for step in 0..40 {
            sim.run(1);
            let part = energy(&sim) / before;
            if part > worst {
                (worst, where_is_it) = (part, format!("case {case}, step {step}"));
            }
        }
    }
    assert!(worst < 1.02, "{where_is_it}: {worst} of the energy that there was");
}

/// Defect: where nobody came in faster than bounces, a blow was passed on in each step anew: bodies stood still with the speed that they came
/// with, a box of 0.3 m/s hopped with eight times its energy, and a stack of 5 m/s came to 1.4 times of it.
#[test]
fn a_stack_that_falls_gains_no_energy() {
    for (shape, height) in
        [(Shape::circle(0.25), 0.5), (Shape::rectangle(0.5, 0.5), 0.5), (Shape::rectangle(0.4, 2.0), 2.0)]
    {
        for (count, restitution) in [(1, 0.5), (1, 1.0), (2, 0.5), (5, 0.5)] {
            for (gravity, speed) in [(0.0, 0.3), (1.0, 0.3), (1.0, 0.9), (10.0, 0.3), (10.0, 5.0)] {
                let mut scene = Scene::new(MIDDLE, -gravity);
                let material = Material { restitution, ..Material::default() };
                scene.wall(MIDDLE - DVec2::new(0.0, 0.5), (40.0, 1.0), 0.0, material);
                let kind = scene.kind(shape.clone(), material);
                for k in 0..count {
                    let place = DVec2::new(0.0, height * (f64::from(k) + 0.5) + 0.02);
                    scene.body(kind, MIDDLE + place, Vec2::new(0.0, -speed));
                }
                let mut sim = scene.start_on((1, 1), Exchange::Step);
                let mass = f64::from(shape.area());
                let energy = |sim: &Sim| {
                    let heights: f64 = sim.world.bodies().map(|body| body.position.y - MIDDLE.y).sum();
                    sim.kinetic_energy() + mass * f64::from(gravity) * heights
                };
                let before = energy(&sim);
                let mut most = 0.0_f64;
                for _ in 0..240 {
                    sim.run(1);
                    most = most.max(energy(&sim));
                }
                let what = format!("{count} of {shape:?}, restitution {restitution}, {speed} m/s at {gravity} m/s^2");
                assert!(most < 1.02 * before, "{what}: {most} J of {before}");
                // Without gravity those of a stack go on to part.
                let rest = if gravity > 0.0 { 1e-4 * mass } else { 0.15 * before };
                assert!(sim.kinetic_energy() < rest || speed > 1.0, "{what}: still has {} J", sim.kinetic_energy());
            }
        }
    }
}

/// What a blow within a step gives is passed on in the next one, and what lies in a pile is not: that would be thrown about for ever.
#[test]
fn what_bounces_comes_to_rest_in_a_bin() {
    for (shape, restitution) in [(Shape::circle(0.2), 0.9), (Shape::rectangle(0.4, 0.4), 0.5)] {
        for (threshold, exchange, grid) in [(1.0, Exchange::Step, (1, 1)), (0.0, Exchange::Substep, (3, 3))] {
            let mut scene = gas(20, 0.6, 0.2, 1.0, restitution);
            scene.params.gravity = Vec2::new(0.0, -10.0);
            scene.params.restitution_threshold = threshold;
            scene.kinds[0].shape = shape.clone();
            let weight = 10.0 * scene.kinds[0].shape.area() * scene.kinds[0].material.density;
            let mut sim = scene.start_on(grid, exchange);
            let energy = |sim: &Sim| {
                let heights: f64 = sim.world.bodies().map(|body| body.position.y).sum();
                sim.kinetic_energy() + f64::from(weight) * heights
            };
            let (begun, mut before, mut gained) = (energy(&sim), energy(&sim), 0.0);
            for _ in 0..900 {
                sim.run(1);
                let now = energy(&sim);
                gained += (now - before).max(0.0);
                before = now;
            }
            let (left, lost) = (sim.kinetic_energy(), begun - before);
            println!("{shape:?}, threshold {threshold}: gained {gained:.3} J, lost {lost:.1} J, {left:.5} J are left");
            assert!(gained < 0.02 * lost, "{shape:?}, threshold {threshold}: gained {gained} J, lost {lost} J");
            assert!(left < 1e-3 * lost, "{shape:?}, threshold {threshold}: {left} of {lost} J are left");
        }
    }
}

/// Both corners of an end press as it comes down upon it nearly flat, and only one may be what throws it back; and what throws a corner
/// back may turn its slip round: holding it then would add up to a half of the energy there was.
#[test]
fn a_rod_between_elastic_walls_gains_no_energy() {
    for (length, thickness, friction) in
        [(2.0, 0.1, 0.0), (1.0, 0.05, 0.0), (1.0, 0.4, 0.0), (2.0, 0.1, 1.0), (1.0, 1.0, 0.3), (1.0, 0.4, 0.6)]
    {
        let what = format!("{length} x {thickness} m, friction {friction}");
        let mut left = 0.0;
        for rod in 0..40 {
            let mut scene = gas(1, 5.0, 0.2, 5.0, 1.0);
            scene.params.restitution_threshold = 0.0;
            scene.kinds[0].shape = Shape::rectangle(length, thickness);
            scene.kinds[0].material.friction = friction;
            scene.statics.iter_mut().for_each(|wall| wall.kind.material.friction = friction);
            scene.last().rotation = Rot::from_angle(6.0 * noise(8, rod) as f32);
            scene.last().angular_velocity = 8.0 * noise(9, rod) as f32 - 4.0;
            let mut sim = scene.start_on((1, 1), Exchange::Step);
            let begin = sim.kinetic_energy();
            let mut before = begin;
            for step in 0..400 {
                sim.run(1);
                let now = sim.kinetic_energy();
                let most = if friction > 0.0 { 1.01 } else { 1.001 };
                assert!(now < most * before, "{what}, rod {rod}: {now} of {before} J in step {step}");
                before = now;
            }
            left += before / begin / 40.0;
        }
        assert!(left > 0.99 || friction > 0.0, "{what}: {left} of the energy is left");
    }
}

/// Off two pieces of ground that are nearly in line a body is thrown by each in turn, and each then parts faster than it should: a few
/// turns left a disc with a third more than it brought, and a box with twice of it.
#[test]
fn nobody_gains_energy_in_a_round_room_of_many_pieces() {
    const PIECES: u64 = 1440;
    let material = Material { friction: 0.0, restitution: 1.0, ..Material::default() };
    for shape in [Shape::circle(0.3), Shape::rectangle(0.5, 0.5), Shape::rectangle(1.0, 0.1)] {
        let mut left = 0.0;
        for run in 0..8 {
            let mut scene = Scene::new(DVec2::ZERO, 0.0);
            scene.params.restitution_threshold = 0.0;
            let corner = |k: u64| Vec2::from_angle((k as f64 * std::f64::consts::TAU / PIECES as f64) as f32) * 4.0;
            for k in 0..PIECES {
                let ends = [k + PIECES - 1, k, k + 1, k + 2].map(corner);
                let (piece, middle) =
                    Segment::new(Some(ends[0]), ends[1], ends[2], Some(ends[3])).expect("a piece with a length");
                let kind = Kind::new(Shape::Segment(piece), material);
                scene.statics.push(StaticBody::new(GlobalId(k), kind, middle.as_dvec2()));
            }
            let kind = scene.kind(shape.clone(), material);
            let place = DVec2::new(noise(1, run) - 0.5, noise(2, run) - 0.5);
            scene.body(kind, place, Vec2::from_angle(6.0 * noise(3, run) as f32) * 5.0);
            let mut sim = scene.start_on((1, 1), Exchange::Step);
            let before = sim.kinetic_energy();
            for _ in 0..50 {
                sim.run(30);
                let now = sim.kinetic_energy();
                assert!(now < 1.05 * before, "{shape:?} in run {run}: {now} of {before} J");
            }
            left += sim.kinetic_energy() / before / 8.0;
        }
        println!("{shape:?}: {left:.4} of the energy is left");
        assert!(left > 0.97, "{shape:?}: {left} of the energy is left");
    }
}

/// Of a sequence: slope and offset of the line through it, and the greatest distance from that as a part of its range.
fn line(points: &[(f64, f64)]) -> (f64, f64, f64) {
    let count = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / count, y + point.1 / count));
    let (xx, xy) = points
        .iter()
        .fold((0.0, 0.0), |(xx, xy), point| (xx + (point.0 - x) * (point.0 - x), xy + (point.0 - x) * (point.1 - y)));
    let slope = xy / xx;
    let offset = y - slope * x;
    let range = points[points.len() - 1].1 - points[0].1;
    let worst = points.iter().map(|point| (point.1 - offset - slope * point.0).abs()).fold(0.0, f64::max);
    (slope, offset, worst / range.abs())
}

/// Mean of v^2 / 2 of both directions: the temperature of discs of mass 1.
fn temperature(sim: &Sim) -> f64 {
    let bodies = sim.bodies();
    bodies.iter().map(|body| 0.5 * f64::from(body.velocity.length_squared())).sum::<f64>() / bodies.len() as f64
}

/// Haff's law: a gas of discs of restitution e cools as T0 / (1 + t / tau)^2, so that 1 / sqrt(T) grows straight, at half the rate of
/// collisions at T = 1 times (1 - e^2) / 2: of n discs of diameter d in an area that rate is 2 d n sqrt(pi T) by g, where g allows
/// for that they exclude each other (P. Haff, "Grain flow as a fluid-mechanical phenomenon", 1983; for discs: I. Goldhirsch,
/// "Rapid granular flows", 2003; g: D. Henderson, 1975).
#[test]
fn a_gas_of_discs_cools_by_haffs_law() {
    let (side, apart, radius, restitution) = (140, 1.25, 0.1_f32, 0.8);
    let mut scene = gas(side, apart, radius, 2.0, restitution);
    scene.params.restitution_threshold = 0.0;
    let mut sim = scene.start_on((4, 4), Exchange::Substep);
    let (diameter, density) = (2.0 * f64::from(radius), 1.0 / (apart * apart));
    let part = density * std::f64::consts::PI * f64::from(radius * radius);
    let contact = (1.0 - 7.0 / 16.0 * part) / ((1.0 - part) * (1.0 - part));
    let rate = 2.0 * diameter * density * contact * std::f64::consts::PI.sqrt();
    let expected = 0.25 * rate * f64::from(1.0 - restitution * restitution);
    // First each speed must come to what a gas has.
    sim.run(120);
    let mut points = Vec::new();
    for k in 0..30 {
        sim.run(20);
        points.push((f64::from(k) / 3.0, 1.0 / temperature(&sim).sqrt()));
    }
    let (slope, _, bend) = line(&points);
    println!(
        "1 / sqrt(T) from {:.3} to {:.3}: slope {slope:.4}, expected {expected:.4}, bent by {bend:.3}",
        points[0].1, points[29].1
    );
    assert!(bend < 0.05, "not straight: {points:?}");
    assert!((slope / expected - 1.0).abs() < 0.1, "slope {slope} instead of {expected}");
}

const SEEDS: u64 = 3;

/// Grains of two sizes about 0.1 m in a silo 3 m wide with a flat bottom, and an opening in that; so many rows of them.
fn silo(opening: f64, rows: u64, seed: u64) -> Scene {
    const COLUMNS: u64 = 26;
    let half = 0.056 * COLUMNS as f64 + 0.02;
    let mut scene = Scene::new(DVec2::new(0.0, 4.0), -10.0);
    scene.half = DVec2::new(12.0, 16.0);
    let material = Material { friction: 0.5, ..Material::default() };
    for side in [-1.0, 1.0] {
        scene.wall(DVec2::new(side * (half + 0.25), 8.0), (0.5, 17.0), 0.0, material);
        let width = half + 0.5 - 0.5 * opening;
        scene.wall(DVec2::new(side * 0.5 * (opening + width), -0.25), (width as f32, 0.5), 0.0, material);
    }
    // Far below, so that what lies there does not matter.
    scene.wall(DVec2::new(0.0, -10.0), (24.0, 1.0), 0.0, material);
    let kinds = [0.045, 0.055].map(|radius| scene.kind(Shape::circle(radius), material));
    for k in 0..COLUMNS * rows {
        let place = DVec2::new((k % COLUMNS) as f64 - 0.5 * (COLUMNS - 1) as f64, (k / COLUMNS) as f64 + 0.54) * 0.112;
        // Columns that are quite straight would stand.
        let aside = DVec2::new(0.001 * noise(seed + SEEDS, k), 0.0);
        scene.body(kinds[usize::from(noise(seed, k) < 0.5)], place + aside, Vec2::ZERO);
    }
    scene
}

/// Grains that leave it in a second, once they lie on each other, the mean of some silos.
fn discharge(opening: f64, rows: u64) -> f64 {
    let rates = (0..SEEDS).map(|seed| {
        let mut sim = silo(opening, rows, seed).start_on((3, 4), Exchange::Substep);
        let below = |sim: &Sim| sim.bodies().iter().filter(|body| body.position.y < -0.5).count();
        sim.run(90);
        let (first, mut steps) = (below(&sim), 0);
        while below(&sim) < first + 400 {
            sim.run(10);
            steps += 10;
            assert!(steps < 1000, "only {} left through {opening} m", below(&sim) - first);
        }
        (below(&sim) - first) as f64 * 60.0 / f64::from(steps)
    });
    rates.sum::<f64>() / SEEDS as f64
}

/// A silo discharges at a rate that does not depend on how full it is (unlike a fluid), and with a power 3/2 of its opening less
/// somewhat more than a grain (W. Beverloo, H. Leniger, J. van de Velde, "The flow of granular solids through orifices", 1961).
#[test]
fn a_silo_discharges_as_silos_do() {
    let rates = [60, 90, 120].map(|rows| discharge(1.0, rows));
    println!("grains a second from 60, 90 and 120 rows: {rates:.1?}");
    let mean = rates.iter().sum::<f64>() / 3.0;
    assert!(rates.iter().all(|rate| (rate / mean - 1.0).abs() < 0.1), "the rate depends on the height: {rates:?}");
    let points = [0.8_f64, 0.9, 1.0, 1.2, 1.4].map(|opening| ((opening - 1.4 * 0.1).ln(), discharge(opening, 80).ln()));
    let (exponent, _, bend) = line(&points);
    println!("exponent {exponent:.3}, bent by {bend:.3}");
    assert!((exponent - 1.5).abs() < 0.2, "exponent {exponent}");
}

/// 30,000 boxes, or discs, that fly about a room keep at 60 Hz the spin that they keep with short steps.
#[test]
fn what_turns_keeps_as_much_spin_as_with_short_steps() {
    for (name, kind) in [("boxes", 0), ("discs", 1)] {
        let spin = |hertz: u32| {
            let mut scene = scenes::room(173, 1);
            scene.params.dt = 1.0 / hertz as f32;
            scene.bodies.iter_mut().for_each(|body| body.kind = KindId(kind));
            let mut sim = scene.start_on((6, 6), Exchange::Step);
            sim.run(120 * hertz / 60);
            let bodies = sim.bodies();
            bodies.iter().map(|body| f64::from(body.angular_velocity).powi(2)).sum::<f64>() / bodies.len() as f64
        };
        let (usual, short) = (spin(60), spin(480));
        println!("{name}: mean square spin {usual:.2} at 60 Hz, {short:.2} at 480");
        assert!((usual / short - 1.0).abs() < 0.06, "{name}: {usual} rad^2/s^2 and not {short}");
    }
}

/// Columns of discs that fall on a floor, and bounce off it and each other. Defect: what pressed within the step where discs had moved apart
/// gave energy, and a column of twenty rose to many times the height that it fell from.
#[test]
fn a_column_that_falls_and_bounces_gains_no_energy() {
    for (count, restitution, height, gap) in [
        (2, 1.0, 0.5, 0.0),
        (3, 1.0, 0.5, 0.0),
        (5, 1.0, 0.5, 0.0),
        (10, 1.0, 3.0, 0.0),
        (10, 0.5, 3.0, 0.0),
        (20, 1.0, 3.0, 0.01),
        (20, 0.8, 1.0, 0.01),
        (10, 0.3, 1.0, 0.01),
        (10, 0.9, 10.0, 0.0),
    ] {
        for tiles in [1, 4] {
            let mut scene = Scene::new(DVec2::new(0.0, 40.0), -10.0);
            scene.half = DVec2::new(10.0, 60.0);
            let material = Material { friction: 0.0, restitution, ..Material::default() };
            scene.wall(DVec2::new(0.0, -0.5), (20.0, 1.0), 0.0, material);
            let disc = scene.kind(Shape::circle(0.5), material);
            for k in 0..count {
                scene.body(disc, DVec2::new(0.0, 0.5 + height + (1.0 + gap) * f64::from(k)), Vec2::ZERO);
            }
            let mut sim = scene.start_on((1, tiles), Exchange::Substep);
            // Above that of the column at rest, by that of its fall.
            let fall = sim.mass(&sim.bodies()[0])
                * 10.0
                * (height * f64::from(count) + gap * f64::from(count * (count - 1) / 2));
            let energy = |sim: &Sim| {
                let lifted = sim.bodies().iter().map(|body| sim.mass(body) * 10.0 * body.position.y).sum::<f64>();
                sim.kinetic_energy() + lifted
            };
            let before = energy(&sim);
            let mut most = 0.0_f64;
            for _ in 0..240 {
                sim.run(1);
                most = most.max((energy(&sim) - before) / fall);
            }
            let what = format!("{count} discs of restitution {restitution}, {height} m above the floor, {tiles} tiles");
            // Over borders each tile knows a part of who bounces off whom.
            let allowed = if tiles == 1 { 0.01 } else { 0.3 };
            assert!(most < allowed, "{what}: {most} of the energy of the fall came from nowhere");
        }
    }
}

/// A crowd that is pressed together from all sides, without gravity. Defect: with any restitution above zero a blow was passed on in each step anew,
/// and nobody held anybody: bodies went halfway into each other, and came out with more energy than they had.
#[test]
fn a_crowd_does_not_go_into_itself() {
    for (restitution, deep) in [(0.0, 0.05), (0.1, 0.05), (0.5, 0.05), (0.9, 0.08)] {
        let mut scene = Scene::new(MIDDLE, 0.0);
        let material = Material { restitution, ..Material::default() };
        let kinds = [Shape::circle(0.3), Shape::rectangle(0.5, 0.4)].map(|shape| scene.kind(shape, material));
        for k in 0..400 {
            let place = DVec2::new((k % 20) as f64, (k / 20) as f64) - DVec2::splat(9.5);
            let shake = Vec2::new(noise(21, 2 * k) as f32, noise(21, 2 * k + 1) as f32) - Vec2::splat(0.5);
            let inward = -0.35 * place.as_vec2();
            scene.body(kinds[k as usize % 2], MIDDLE + 0.8 * place, inward + 0.5 * shake);
        }
        for (tiles, steps) in [((1, 1), 80), ((1, 1), 110), ((1, 1), 140), ((4, 4), 110), ((4, 4), 140)] {
            let mut sim = scene.start_on(tiles, Exchange::Substep);
            let mut least = f64::INFINITY;
            for _ in 0..steps {
                sim.run(1);
                let energy = sim.kinetic_energy();
                // Over borders each tile knows a part of who bounces off whom: with other crowds 1.01 on the average, and 1.14 once.
                let most = if tiles == (1, 1) { 1.001 } else { 1.1 };
                assert!(energy < most * least, "restitution {restitution}, {tiles:?}: {energy} J of {least}");
                least = least.min(energy);
            }
            let facts = sim.finish();
            println!("restitution {restitution}, {tiles:?}, {steps} steps: {} m deep", facts.max_penetration);
            assert!(facts.max_penetration < deep, "restitution {restitution}, {tiles:?}: {} m", facts.max_penetration);
        }
    }
}
