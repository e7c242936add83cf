//! Islands that rest are left out, and wake when something touches them.

use atoll_core::{Exchange, GlobalId, Material, Shape};
use atoll_tests::scenes;
use atoll_tests::world::{Cut, Scene, Sim};
use glam::{DVec2, Vec2};

const WHOLE: (Cut, Exchange) = (Cut::Whole, Exchange::Step);

/// Two stacks of three boxes far from each other, and a ball that comes for the left one after some seconds.
fn stacks_and_a_ball() -> (Scene, GlobalId) {
    let mut scene = Scene::new(DVec2::new(0.0, 5.0), -10.0);
    scene.params.sleep = true;
    scene.wall(DVec2::new(0.0, -1.0), (40.0, 2.0), 0.0, Material::default());
    let boxed = scene.kind(Shape::rectangle(0.5, 0.5), Material::default());
    let ball = scene.kind(Shape::circle(0.3), Material { friction: 0.0, ..Material::default() });
    for x in [-5.0, 5.0] {
        for k in 0..3 {
            scene.body(boxed, DVec2::new(x, 0.25 + 0.5 * f64::from(k)), Vec2::ZERO);
        }
    }
    let ball = scene.body(ball, DVec2::new(-17.0, 0.3), Vec2::new(5.0, 0.0));
    (scene, ball)
}

fn rest(sim: &mut Sim, steps: u32) {
    sim.run(steps);
    assert_eq!(sim.report.asleep, 6, "{:?}", sim.report);
}

/// One tile, tiles with borders through both stacks and below them, and tiles smaller than these.
const GRIDS: [(u32, u32); 3] = [(1, 1), (8, 8), (40, 40)];

#[test]
fn what_rests_falls_asleep_and_does_not_move() {
    let (scene, _) = stacks_and_a_ball();
    for (tiles, exchange) in GRIDS.map(|tiles| (tiles, Exchange::Step)).into_iter().chain([((8, 8), Exchange::Substep)])
    {
        let mut sim = scene.start_on(tiles, exchange);
        sim.run(20);
        assert_eq!(sim.report.asleep, 0);
        rest(&mut sim, 60);
        let before = sim.bodies();
        rest(&mut sim, 20);
        for (before, after) in before.iter().zip(sim.bodies()).take(6) {
            assert_eq!(*before, after);
            assert_eq!((after.velocity, after.angular_velocity), (Vec2::ZERO, 0.0));
        }
    }
}

#[test]
fn a_touch_wakes_the_whole_island_and_no_other() {
    let (scene, ball) = stacks_and_a_ball();
    for (tiles, exchange) in GRIDS.map(|tiles| (tiles, Exchange::Substep)).into_iter().chain([((8, 8), Exchange::Step)])
    {
        let mut sim = scene.start_on(tiles, exchange);
        rest(&mut sim, 100);
        let before = sim.bodies();
        // The ball arrives after 11.45 m at 5 m/s.
        sim.run(42);
        assert_eq!(sim.report.asleep, 3, "{:?}", sim.report);
        assert!(sim.body(ball).velocity.x < 4.9);
        sim.run(8);
        let after = sim.bodies();
        for k in 0..3 {
            assert!(after[k].velocity.length() > 0.1, "{:?}", after[k]);
            assert_eq!(after[k + 3], before[k + 3]);
        }
    }
}

/// A tile in which nothing changes is left out; asked for its figures it makes its step all the same, and that shows nowhere. Then
/// a ball strikes what sleeps.
#[test]
fn what_stands_still_is_left_out_and_shows_in_no_bit() {
    let mut scene = scenes::pile(24, 12);
    (scene.params.sleep, scene.params.sleep_speed) = (true, 1.0);
    let bodies = scene.bodies.len() as u64;
    let ball = atoll_core::Body { id: GlobalId(9_999), velocity: Vec2::new(0.0, -20.0), ..scene.bodies[0] };
    for exchange in [Exchange::Step, Exchange::Substep] {
        let ends = [false, true].map(|is_asked| {
            let mut sim = scene.start_on((3, 2), exchange);
            let mut counts = Vec::new();
            for at in 0..340 {
                if at == 300 {
                    let top = sim.bodies().iter().map(|body| body.position).max_by(|a, b| a.y.total_cmp(&b.y)).unwrap();
                    sim.world.add(atoll_core::Body { position: top + DVec2::new(0.1, 3.0), ..ball }).unwrap();
                }
                if is_asked {
                    sim.world.take_figures_of_next_step();
                }
                sim.run(1);
                counts.push(sim.report);
            }
            assert_eq!(counts[299].asleep, bodies, "{exchange:?}: {:?}", counts[299]);
            assert!(counts[339].asleep < bodies / 2, "{exchange:?}: {:?}", counts[339]);
            (sim.hashes(), counts)
        });
        assert!(ends[0] == ends[1], "{exchange:?}: who asks for figures changes them");
    }
}

/// A stack that slept stands as one that did not; sleep saves work, not motion.
#[test]
fn a_stack_that_slept_and_woke_still_stands() {
    let mut scene = scenes::stack(10);
    scene.params.sleep = true;
    let mut sim = scene.start(WHOLE);
    sim.run(120);
    assert_eq!(sim.report.asleep, 10);
    let top = sim.bodies()[9].position;
    // A push too weak to move it, strong enough to wake it.
    let kind = scene.bodies[0].kind;
    let id = GlobalId(99);
    let body = atoll_core::Body { id, position: top + DVec2::new(0.0, 0.2), kind, ..scene.bodies[9] };
    sim.world.add(body).unwrap();
    sim.run(10);
    assert_eq!(sim.report.asleep, 0);
    sim.run(300);
    assert_eq!(sim.report.asleep, 11);
    assert!((sim.bodies()[9].position - top).length() < 0.01);
}

/// Bodies are sorted anew on fixed steps, whoever has just come.
#[test]
fn a_body_may_come_on_a_step_that_sorts() {
    let (scene, _) = stacks_and_a_ball();
    let mut sim = scene.start(WHOLE);
    sim.run(3 * scene.params.sort_interval);
    assert_eq!(sim.report.asleep, 6);
    let body = atoll_core::Body { id: GlobalId(99), position: DVec2::new(-10.0, 0.25), ..scene.bodies[0] };
    sim.world.add(body).unwrap();
    sim.run(1);
    assert_eq!(sim.report.asleep, 6);
    sim.run(60);
    assert!(sim.body(GlobalId(99)).velocity.length() < 0.01);
}

/// Who has long rested upon something must not hang in the air when that is struck away.
#[test]
fn what_loses_its_support_falls() {
    let mut scene = Scene::new(DVec2::new(0.0, 5.0), -10.0);
    scene.params.sleep = true;
    let smooth = Material { friction: 0.0, ..Material::default() };
    scene.wall(DVec2::new(0.0, -1.0), (40.0, 2.0), 0.0, smooth);
    let boxed = scene.kind(Shape::rectangle(0.5, 0.5), smooth);
    let heavy = scene.kind(Shape::circle(0.2), Material { density: 500.0, ..smooth });
    scene.body(boxed, DVec2::new(0.0, 0.25), Vec2::ZERO);
    let upper = scene.body(boxed, DVec2::new(0.0, 0.75), Vec2::ZERO);
    // Arrives when both have slept for a while.
    scene.body(heavy, DVec2::new(-18.0, 0.2), Vec2::new(12.0, 0.0));
    let mut sim = scene.start(WHOLE);
    sim.run(75);
    assert_eq!(sim.report.asleep, 2, "{:?}", sim.report);
    sim.run(60);
    let height = sim.body(upper).position.y;
    assert!(height < 0.5, "the upper box hangs at {height}");
}

/// Nor if that is removed, in a tile of its own.
#[test]
fn what_rests_on_who_is_removed_falls() {
    let (scene, _) = stacks_and_a_ball();
    for (tiles, exchange) in [((1, 1), Exchange::Step), ((40, 40), Exchange::Step), ((40, 40), Exchange::Substep)] {
        let mut sim = scene.start_on(tiles, exchange);
        rest(&mut sim, 100);
        let [middle, upper] = [1, 2].map(|k| sim.bodies()[k]);
        assert!(sim.world.remove(middle.id));
        sim.run(30);
        let fallen = upper.position.y - sim.body(upper.id).position.y;
        assert!(fallen > 0.4, "{tiles:?}, {exchange:?}: the upper box has fallen {fallen} m");
    }
}

/// Nor if that, longer than tiles are, is struck away within one step.
#[test]
fn what_lies_on_a_plank_that_is_struck_away_falls() {
    let mut scene = Scene::new(DVec2::new(0.0, 5.0), -10.0);
    scene.params.sleep = true;
    scene.wall(DVec2::new(0.0, -1.0), (40.0, 2.0), 0.0, Material::default());
    scene.wall(DVec2::new(0.0, 1.5), (2.0, 3.0), 0.0, Material::default());
    let [plank, boxed] = [(24.0, 0.3), (0.4, 0.4)]
        .map(|(width, height)| scene.kind(Shape::rectangle(width, height), Material::default()));
    let ball = scene.kind(Shape::circle(0.4), Material { density: 500.0, ..Material::default() });
    scene.body(plank, DVec2::new(0.0, 3.15), Vec2::ZERO);
    let boxes: Vec<GlobalId> =
        (-5..=5).map(|k| scene.body(boxed, DVec2::new(2.0 * f64::from(k), 3.5), Vec2::ZERO)).collect();
    for (tiles, exchange) in [((1, 1), Exchange::Step), ((40, 1), Exchange::Step), ((40, 1), Exchange::Substep)] {
        let mut sim = scene.start_on(tiles, exchange);
        sim.run(100);
        assert_eq!(sim.report.asleep, 12, "{:?}", sim.report);
        let position = DVec2::new(9.0, 6.5);
        let velocity = Vec2::new(0.0, -150.0);
        sim.world
            .add(atoll_core::Body { id: GlobalId(99), position, velocity, kind: ball, ..scene.bodies[0] })
            .unwrap();
        sim.run(60);
        let still: Vec<_> = boxes.iter().filter(|&&id| (sim.body(id).position.y - 3.5).abs() < 0.05).collect();
        assert!(still.is_empty(), "{tiles:?}, {exchange:?}: {still:?} hang in the air");
    }
}

#[test]
fn without_gravity_a_lone_body_at_rest_sleeps_too() {
    let mut scene = Scene::new(DVec2::ZERO, 0.0);
    scene.params.sleep = true;
    let kind = scene.kind(Shape::circle(0.5), Material::default());
    scene.body(kind, DVec2::ZERO, Vec2::ZERO);
    scene.body(kind, DVec2::new(-6.0, 0.0), Vec2::new(4.0, 0.0));
    let mut sim = scene.start(WHOLE);
    sim.run(60);
    assert_eq!(sim.report.asleep, 1);
    sim.run(60);
    assert_eq!(sim.report.asleep, 0);
    assert!(sim.body(GlobalId(0)).velocity.x > 1.0);
}

#[test]
fn under_weak_gravity_nobody_falls_asleep_in_the_air() {
    for gravity in [0.08, 0.01] {
        let mut scene = Scene::new(DVec2::ZERO, -gravity);
        scene.params.sleep = true;
        scene.wall(DVec2::new(0.0, -1.0), (40.0, 2.0), 0.0, Material::default());
        let kind = scene.kind(Shape::rectangle(0.5, 0.5), Material::default());
        // One falls from rest, as do two upon each other; one is thrown up.
        let fall = f64::from(0.5 * gravity) * 16.0;
        let bodies = [(-5.0, 0.25, 0.0), (0.0, 0.25, 0.0), (0.0, 0.75, 0.0), (5.0, 0.25 - fall, 4.0 * gravity)];
        let bodies = bodies.map(|(x, y, up)| scene.body(kind, DVec2::new(x, y + fall), Vec2::new(0.0, up)));
        let mut sim = scene.start(WHOLE);
        sim.run(4 * 60 - 12);
        assert_eq!(sim.report.asleep, 0, "{gravity} m/s^2");
        let fallen = 0.5 * f64::from(gravity) * 3.8 * 3.8;
        assert!((sim.body(bodies[0]).position.y - (0.25 + fall - fallen)).abs() < 0.02 * fall);
        sim.run(10 * 60);
        assert_eq!(sim.report.asleep, 4, "{gravity} m/s^2");
    }
}

/// How long a body has rested belongs to the future of the world, so to its hash.
#[test]
fn rest_shows_in_the_contact_hash() {
    let mut scene = Scene::new(DVec2::ZERO, 0.0);
    scene.params.sleep = true;
    let kind = scene.kind(Shape::circle(0.5), Material::default());
    scene.body(kind, DVec2::ZERO, Vec2::ZERO);
    let hashes = |steps| {
        let mut sim = scene.start(WHOLE);
        sim.run(steps);
        sim.hashes()
    };
    assert_eq!(hashes(3).state, hashes(4).state);
    assert_ne!(hashes(3).contact, hashes(4).contact);
}
