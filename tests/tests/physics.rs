//! Small worlds whose outcome is known, each on one tile and again with a tile border, and a corner of four tiles,
//! through the middle of the action: same thresholds.

use atoll_core::{Body, Exchange, GlobalId, Material, Path, Rot, Shape};
use atoll_tests::scenes;
use atoll_tests::world::{ALL_WAYS, Cut, EXACT_WAYS, Scene, Sim, Way};
use glam::{DVec2, Vec2};

const MIDDLE: DVec2 = DVec2::new(3.0, 5.0);

fn rough(friction: f32) -> Material {
    Material { friction, ..Material::default() }
}

fn bouncy(restitution: f32) -> Material {
    Material { friction: 0.0, restitution, ..Material::default() }
}

/// Steps a scene every given way, and hands each outcome over with the one on a single tile.
fn compare(scene: &Scene, ways: &[Way], steps: u32, check: impl Fn(&Sim, &Sim, Way)) {
    let whole = |exchange| {
        let mut sim = scene.start((Cut::Whole, exchange));
        sim.run(steps);
        sim
    };
    for &way in ways {
        let mut sim = scene.start(way);
        sim.run(steps);
        check(&sim, &whole(way.1), way);
    }
}

#[test]
fn free_flight_is_exact() {
    // With such numbers every sum of the closed form is exact in single precision too.
    let mut scene = Scene::new(MIDDLE, -8.0);
    scene.params.dt = 1.0 / 64.0;
    let kind = scene.kind(Shape::rectangle(0.5, 0.25), Material::default());
    let start = MIDDLE - DVec2::new(1.5, 0.5);
    let id = scene.body(kind, start, Vec2::new(3.0, 5.0));
    scene.last().angular_velocity = 2.0;
    compare(&scene, &ALL_WAYS, 64, |sim, whole, way| {
        let body = sim.body(id);
        assert_eq!(body.position, start + DVec2::new(3.0, 5.0 - 8.0 / 2.0), "{way:?}");
        assert_eq!((body.velocity, body.angular_velocity), (Vec2::new(3.0, -3.0), 2.0), "{way:?}");
        assert!((body.rotation.angle() - 2.0).abs() < 1e-3, "{way:?}: {}", body.rotation.angle());
        assert_eq!(body, whole.body(id), "{way:?}");
        assert_eq!(sim.hashes(), whole.hashes(), "{way:?}");
    });
}

/// Defect: each bounce lost the speed that gravity gives in a substep, so a ball had 0.6 of its energy after 20 s.
#[test]
fn elastic_balls_bounce_for_ever() {
    for exchange in [Exchange::Step, Exchange::Substep] {
        let mut scene = Scene::new(MIDDLE, -10.0);
        scene.params.restitution_threshold = 0.0;
        let kind = scene.kind(Shape::circle(0.1), bouncy(1.0));
        scene.wall(MIDDLE - DVec2::new(0.0, 2.5), (8.0, 1.0), 0.0, bouncy(1.0));
        let floor = MIDDLE.y - 2.0 + 0.1;
        let alone = [0.25, 1.0, 3.0].map(|height| {
            let at = DVec2::new(MIDDLE.x - height, floor + height);
            (vec![scene.body(kind, at, Vec2::ZERO)], 10.0 * height, 1e-4)
        });
        let pair = [0.5, 0.9].map(|height| scene.body(kind, DVec2::new(MIDDLE.x + 2.0, floor + height), Vec2::ZERO));
        let mut sim = scene.start((Cut::Whole, exchange));
        sim.run(20 * 60);
        for (balls, energy, worst) in alone.into_iter().chain([(pair.to_vec(), 10.0 * (0.5 + 0.9 - 0.2), 0.05)]) {
            let of = |id| {
                let body = sim.body(id);
                10.0 * (body.position.y - floor) + 0.5 * f64::from(body.velocity.length_squared())
            };
            let lift = if balls.len() > 1 { 10.0 * 0.2 } else { 0.0 };
            let left = (balls.iter().map(|&id| of(id)).sum::<f64>() - lift) / energy;
            assert!((left - 1.0).abs() < worst, "{exchange:?}: {left} of energy {energy} is left of {balls:?}");
        }
    }
}

#[test]
fn an_elastic_pair_swaps_velocities() {
    let mut scene = Scene::new(MIDDLE, 0.0);
    let kind = scene.kind(Shape::circle(0.5), bouncy(1.0));
    let direction = Rot::from_angle(0.4).rotate(Vec2::X);
    let (fast, slow) = (direction * 3.0, direction * -1.0);
    let left = scene.body(kind, MIDDLE - direction.as_dvec2() * 1.2, fast);
    let right = scene.body(kind, MIDDLE + direction.as_dvec2() * 0.9, slow);
    compare(&scene, &ALL_WAYS, 60, |sim, _, way| {
        let error = (sim.body(left).velocity - slow).length() + (sim.body(right).velocity - fast).length();
        assert!(error < 1e-3, "{way:?}: {:?} {:?}", sim.body(left).velocity, sim.body(right).velocity);
        assert!(sim.body(left).angular_velocity.abs() + sim.body(right).angular_velocity.abs() < 1e-3, "{way:?}");
    });
}

/// A slope that falls to the right, its surface through the middle, and a body whose surface lies upon it there.
fn on_a_slope(angle: f32, friction: f32, shape: Shape, above: f32) -> (Scene, GlobalId) {
    let mut scene = Scene::new(MIDDLE, -10.0);
    let turn = Rot::from_angle(-angle);
    let along = |x: f32, y: f32| MIDDLE + turn.rotate(Vec2::new(x, y)).as_dvec2();
    scene.wall(along(0.0, -1.0 - above), (60.0, 2.0), -angle, rough(friction));
    let kind = scene.kind(shape, rough(friction));
    let id = scene.body(kind, MIDDLE, Vec2::ZERO);
    scene.last().rotation = turn;
    (scene, id)
}

#[test]
fn a_box_slides_if_the_slope_is_steeper_than_friction_holds() {
    for friction in [0.2_f32, 0.6] {
        for steeper in [0.95_f32, 1.05] {
            let angle = (steeper * friction).atan();
            for shape in scenes::boxes(1.0, 0.5) {
                let (scene, id) = on_a_slope(angle, friction, shape, 0.25);
                compare(&scene, &EXACT_WAYS, 120, |sim, _, way| {
                    let moved = (sim.body(id).position - MIDDLE).length();
                    if steeper < 1.0 {
                        assert!(moved < 0.005, "{way:?}: moved {moved} m on a slope that friction {friction} holds");
                    } else {
                        // a = g (sin - friction cos), for two seconds.
                        let expected = f64::from(0.5 * 10.0 * (angle.sin() - friction * angle.cos()) * 4.0);
                        assert!((moved / expected - 1.0).abs() < 0.05, "{way:?}: slid {moved} m, not {expected}");
                        assert!((sim.body(id).rotation.angle() + angle).abs() < 0.01, "{way:?}: it turned");
                    }
                });
            }
        }
    }
}

/// Defect: contacts that were kept lagged behind a table that turned with what lay upon it: that crept upwards, and slid eight degrees late.
#[test]
fn a_box_slides_off_a_table_as_it_is_tilted() {
    for (friction, at) in [(0.3, 0.0), (0.5, 0.0), (0.5, 3.0)] {
        let mut scene = Scene::new(DVec2::ZERO, -10.0);
        scene.wall(DVec2::ZERO, (18.0, 1.0), 0.0, rough(friction));
        scene.statics[0].path = Some(Path { turning: 0.01, ..Path::default() });
        let kind = scene.kind(Shape::rectangle(1.0, 0.5), rough(friction));
        let id = scene.body(kind, DVec2::new(at, 0.75), Vec2::ZERO);
        let mut sim = scene.start_on((1, 1), Exchange::Step);
        let mut angle = 0.0;
        loop {
            sim.run(1);
            angle += 0.01 / 60.0;
            let body = sim.body(id);
            let along = body.rotation.unrotate(body.position.as_vec2()).x - at as f32;
            assert!(
                angle < 1.0 && along < 0.01,
                "friction {friction} at {at} m: it is {along} m uphill at {angle} rad"
            );
            if along < -0.01 {
                break;
            }
        }
        let slope = f32::tan(angle);
        println!("friction {friction} at {at} m: slides at {slope:.3}");
        assert!((slope / friction - 1.0).abs() < 0.05, "friction {friction} at {at} m: it slides at {slope}");
    }
}

#[test]
fn a_stack_of_ten_boxes_stands() {
    for (way, shape) in EXACT_WAYS.into_iter().flat_map(|way| scenes::boxes(0.2, 0.2).map(|shape| (way, shape))) {
        let mut scene = scenes::stack(10);
        scene.kinds[0].shape = shape;
        let mut sim = scene.start(way);
        let top = |sim: &Sim| sim.body(GlobalId(10)).position;
        let start = top(&sim);
        sim.run(120);
        let settled = top(&sim);
        sim.run(480);
        let (all, late) = ((top(&sim) - start).length(), (top(&sim) - settled).length());
        println!("{way:?}: the top moved {all:.4} m, {late:.6} m of it after 2 s");
        assert!(all < 0.05 && late < 0.005, "{way:?}: the top moved {all} m, {late} m of it after 2 s");
        assert!(way.0 == Cut::Whole || sim.report.border_contacts > 0, "{way:?}: the border is elsewhere");
    }
}

#[test]
fn a_stack_stands_anywhere_in_a_wide_world() {
    // Half a light-second from the origin, and upon a floor whose center is 45 km away.
    let stacks = [(DVec2::new(1.5e8, -1.2e8), 40.0, 0.0), (DVec2::ZERO, 1e5, 45_000.0)];
    for (origin, width, beside) in stacks {
        let near = scenes::stack(10);
        let mut scene = Scene::new(near.middle + origin, -10.0);
        scene.wall(origin + DVec2::new(beside, -1.0), (width, 2.0), 0.0, Material::default());
        scene.kinds = near.kinds;
        scene.bodies = near.bodies;
        for body in &mut scene.bodies {
            body.position += origin;
        }
        for way in EXACT_WAYS {
            let mut sim = scene.start(way);
            let top = |sim: &Sim| sim.body(GlobalId(10)).position;
            let start = top(&sim);
            sim.run(300);
            let moved = (top(&sim) - start).length();
            assert!(moved < 0.05, "{origin}, {way:?}: the top moved {moved} m");
        }
    }
}

#[test]
fn a_pyramid_stands() {
    scenes::boxes(1.0, 1.0).into_iter().for_each(pyramid);
}

fn pyramid(shape: Shape) {
    let mut scene = Scene::new(DVec2::new(0.0, 3.0), -10.0);
    scene.wall(DVec2::new(0.0, -1.0), (40.0, 2.0), 0.0, Material::default());
    let kind = scene.kind(shape, Material::default());
    for row in 0..10 {
        for i in 0..10 - row {
            let x = f64::from(i) - 0.5 * f64::from(9 - row);
            scene.body(kind, DVec2::new(1.05 * x, 0.5 + f64::from(row)), Vec2::ZERO);
        }
    }
    let start = scene.start(EXACT_WAYS[0]).bodies();
    for way in EXACT_WAYS {
        let mut sim = scene.start(way);
        sim.run(200);
        let moved = |(now, then): (&Body, &Body)| (now.position - then.position).length();
        let most = sim.bodies().iter().zip(&start).map(moved).fold(0.0, f64::max);
        println!("{way:?}: moved {most:.4} m, speed {:.5} m/s", sim.greatest_speed());
        assert!(most < 0.05, "{way:?}: a box moved {most} m");
        assert!(sim.greatest_speed() < 0.01, "{way:?}: a box moves at {} m/s", sim.greatest_speed());
    }
}

/// At a quarter of the rate of substeps, where it would sway for ever if solve had friction last, as relax has.
#[test]
fn a_pyramid_rests_where_contacts_are_as_stiff_as_they_may_be() {
    let mut scene = Scene::new(DVec2::new(0.0, 3.0), -10.0);
    scene.params.substeps = 2;
    scene.wall(DVec2::new(0.0, -0.5), (40.0, 1.0), 0.0, Material::default());
    let kind = scene.kind(Shape::rectangle(0.5, 0.5), Material::default());
    for row in 0..12 {
        for i in 0..12 - row {
            let x = f64::from(i) - 0.5 * f64::from(11 - row);
            scene.body(kind, DVec2::new(0.5 * x, 0.25 + 0.5 * f64::from(row)), Vec2::ZERO);
        }
    }
    let mut sim = scene.start(EXACT_WAYS[0]);
    sim.run(600);
    assert!(sim.greatest_speed() < 0.001, "a box moves at {} m/s", sim.greatest_speed());
}

/// Both points of its contact are stopped at once, whenever in the step it lands.
#[test]
fn who_lands_flat_does_not_turn() {
    for (way, shape) in ALL_WAYS.into_iter().flat_map(|way| scenes::boxes(0.2, 2.0).map(|shape| (way, shape))) {
        for k in 0..5 {
            let mut scene = Scene::new(MIDDLE, -10.0);
            scene.wall(MIDDLE + DVec2::new(0.0, -0.5), (20.0, 1.0), 0.0, Material::default());
            let column = scene.kind(shape.clone(), Material::default());
            let id = scene.body(column, MIDDLE + DVec2::new(0.3, 2.0 + 0.02 * f64::from(k)), Vec2::ZERO);
            let mut sim = scene.start(way);
            for step in 0..40 {
                sim.run(1);
                let spin = sim.body(id).angular_velocity;
                assert!(spin.abs() < 1e-3, "{way:?}, fall {k}: {spin} rad/s after step {step}");
            }
        }
    }
}

/// Turned about a lower corner, with nine tenths of the energy that it takes to come over it, and eleven.
#[test]
fn slender_boxes_tip_with_the_energy_that_it_takes() {
    for (width, height) in [(0.1_f32, 1.0_f32), (0.2, 2.0), (0.5, 2.0)] {
        for shape in scenes::boxes(width, height) {
            for (part, tips) in [(0.9_f32, false), (1.1, true)] {
                let mut scene = Scene::new(MIDDLE, -10.0);
                scene.wall(MIDDLE + DVec2::new(0.0, -0.5), (20.0, 1.0), 0.0, rough(1.0));
                let kind = scene.kind(shape.clone(), rough(1.0));
                let half = 0.5 * Vec2::new(width, height);
                let id = scene.body(kind, MIDDLE + DVec2::new(0.0, f64::from(half.y)), Vec2::ZERO);
                let inertia = half.length_squared() * (4.0 / 3.0);
                let spin = (part * 2.0 * 10.0 * (half.length() - half.y) / inertia).sqrt();
                scene.last().velocity = Vec2::new(half.y, half.x) * spin;
                scene.last().angular_velocity = -spin;
                let mut sim = scene.start_on((1, 1), Exchange::Step);
                sim.run(300);
                let fell = sim.body(id).rotation.c < 0.5;
                assert_eq!(fell, tips, "{width} m x {height} m with {part} of the energy");
            }
        }
    }
}

#[test]
fn a_circle_rolls_down_a_slope_without_slipping() {
    let (angle, radius) = (0.3_f32, 0.5);
    let (scene, id) = on_a_slope(angle, 0.6, Shape::circle(radius), radius);
    compare(&scene, &EXACT_WAYS, 120, |sim, _, way| {
        let body = sim.body(id);
        // A disc falls down a slope with two thirds of what a frictionless body does.
        let expected = 10.0 * angle.sin() * 2.0 / 3.0 * 2.0;
        let speed = body.velocity.length();
        assert!((speed / expected - 1.0).abs() < 0.02, "{way:?}: rolls at {speed} m/s, not {expected}");
        let slip = speed + body.angular_velocity * radius;
        assert!(slip.abs() < 0.01 * speed, "{way:?}: slips at {slip} of {speed} m/s");
    });
}

#[test]
fn a_sliding_circle_comes_to_roll_with_two_thirds_of_its_speed() {
    let mut scene = Scene::new(MIDDLE, -10.0);
    scene.wall(MIDDLE - DVec2::new(0.0, 1.5), (60.0, 2.0), 0.0, rough(0.3));
    let kind = scene.kind(Shape::circle(0.5), rough(0.3));
    let id = scene.body(kind, MIDDLE - DVec2::new(1.0, 0.0), Vec2::new(3.0, 0.0));
    compare(&scene, &EXACT_WAYS, 120, |sim, _, way| {
        let body = sim.body(id);
        assert!((body.velocity.x - 2.0).abs() < 0.02, "{way:?}: rolls at {} m/s", body.velocity.x);
        assert!((body.angular_velocity * 0.5 + body.velocity.x).abs() < 0.01, "{way:?}: slips");
        assert!(body.position.x > MIDDLE.x, "{way:?}: the border is elsewhere");
    });
}

#[test]
fn a_ball_bounces_to_the_square_of_its_restitution() {
    for restitution in [0.0_f32, 0.4, 0.8, 1.0] {
        let mut scene = Scene::new(MIDDLE, -10.0);
        // The floor is below the middle, so that a bouncing ball crosses every border twice.
        scene.wall(MIDDLE - DVec2::new(0.0, 1.8), (60.0, 2.0), 0.0, bouncy(restitution));
        let kind = scene.kind(Shape::circle(0.5), bouncy(restitution));
        let rest = MIDDLE.y - 0.3;
        let id = scene.body(kind, DVec2::new(MIDDLE.x - 0.3, rest + 2.0), Vec2::new(0.5, 0.0));
        for way in EXACT_WAYS {
            let mut sim = scene.start(way);
            let mut height = |steps: u32| {
                (0..steps).fold(0.0, |most, _| {
                    sim.run(1);
                    f64::max(most, sim.body(id).position.y - rest)
                })
            };
            // It falls for sqrt(2 h / g) = 0.63 s, 38 steps; the next top is as high as it bounces.
            height(40);
            let (top, expected) = (height(45), 2.0 * f64::from(restitution * restitution));
            // The speed that is given back was measured up to one step before the impact.
            assert!(
                (top - expected).abs() < 0.03 + 0.08 * expected,
                "{way:?}: restitution {restitution} bounces to {top}, not {expected}"
            );
        }
    }
}

#[test]
fn an_isolated_cluster_keeps_its_momentum() {
    let scene = scenes::cluster(50, 5);
    for way in EXACT_WAYS {
        let mut sim = scene.start(way);
        let (start, size) = (sim.momentum(), sim.sum_of_momenta());
        sim.run(180);
        let drift = (sim.momentum() - start).length() / size;
        assert!(drift < 1e-5, "{way:?}: momentum drifted by {drift} of the sum of |p|");
    }
}

#[test]
fn overlapping_bodies_part_without_an_explosion() {
    // Two boxes half in each other: pushed out no faster than the push-out speed, of which little stays with them.
    let mut scene = Scene::new(MIDDLE, 0.0);
    let kind = scene.kind(Shape::rectangle(0.4, 0.4), Material::default());
    for x in [-0.1, 0.1] {
        scene.body(kind, MIDDLE + DVec2::new(x, 0.01 * x), Vec2::ZERO);
    }
    let (push_out, dt) = (f64::from(scene.params.push_out_speed), f64::from(scene.params.dt));
    for way in ALL_WAYS {
        let mut sim = scene.start(way);
        let gap = |sim: &Sim| (sim.bodies()[1].position - sim.bodies()[0].position).length();
        let mut fastest = 0.0;
        for _ in 0..120 {
            let before = gap(&sim);
            sim.run(1);
            fastest = f64::max(fastest, (gap(&sim) - before) / dt);
        }
        assert!(fastest <= 1.05 * push_out, "{way:?}: they part at {fastest} m/s");
        assert!(sim.greatest_speed() < 0.2, "{way:?}: still at {} m/s", sim.greatest_speed());
        assert!(sim.finish().max_penetration < 0.01, "{way:?}: still in each other");
    }
}

#[test]
fn a_crowd_in_one_spot_parts_without_an_explosion() {
    let mut scene = Scene::new(MIDDLE, 0.0);
    let kinds = [Shape::rectangle(0.4, 0.4), Shape::circle(0.2)].map(|shape| scene.kind(shape, Material::default()));
    for k in 0..30 {
        let place = DVec2::from_angle(2.4 * f64::from(k)) * 0.02 * f64::from(k).sqrt();
        scene.body(kinds[k as usize % 2], MIDDLE + place, Vec2::ZERO);
    }
    for way in ALL_WAYS {
        let mut sim = scene.start(way);
        let mut fastest = 0.0_f32;
        for _ in 0..240 {
            sim.run(1);
            fastest = fastest.max(sim.greatest_speed());
        }
        let facts = sim.finish();
        println!("{way:?}: at most {fastest} m/s, at the end {} J/kg", facts.kinetic_energy / facts.mass);
        assert!(fastest < 3.0 * scene.params.push_out_speed, "{way:?}: a body reached {fastest} m/s");
        assert!(facts.max_penetration < 0.01, "{way:?}: still in each other");
    }
}
