//! The report's own choices, which stay for comparison: its solver, and its ghosts.

use atoll_core::{Exchange, Ghosts, GlobalId, Material, SetupError, Shape, Solver, World};
use atoll_tests::scenes;
use atoll_tests::world::{Cut, Scene};
use glam::{DVec2, Vec2};

fn pgs(mut scene: Scene) -> Scene {
    scene.params.solver = Solver::Pgs;
    scene
}

/// On one tile. Over a border it falls: ghosts hear of their owners once a step, however many the iterations.
#[test]
fn a_stack_stands_by_sequential_impulses() {
    let scene = pgs(scenes::stack(10));
    let start = scene.bodies[9].position;
    let mut sim = scene.start((Cut::Whole, Exchange::Step));
    sim.run(300);
    let sunk = (sim.bodies()[9].position - start).length();
    assert!(sunk < 0.08, "{sunk}");
    assert!(sim.greatest_speed() < 0.2, "{}", sim.greatest_speed());
}

#[test]
fn a_heap_stays_within_its_walls_by_sequential_impulses() {
    let scene = pgs(scenes::pile(20, 20));
    let mut sim = scene.start((Cut::Whole, Exchange::Step));
    sim.run(300);
    let facts = sim.finish();
    assert!(facts.mean_penetration < 0.02 && facts.max_penetration < 0.12, "{facts:?}");
    assert!(facts.kinetic_energy / facts.mass < 0.2, "{facts:?}");
}

/// Head on over a border: both owners find the impulse of a wall, which is that of the pair twice over.
#[test]
fn frozen_ghosts_double_what_meets_on_a_border() {
    let energy = |ghosts| {
        let mut scene = Scene::new(DVec2::ZERO, 0.0);
        scene.params.ghosts = ghosts;
        let kind = scene.kind(Shape::circle(0.5), Material { friction: 0.0, ..Material::default() });
        for side in [-1.0, 1.0] {
            scene.body(kind, DVec2::new(0.9 * side, 0.0), Vec2::new(-3.0 * side as f32, 0.0));
        }
        let mut sim = scene.start((Cut::Columns, Exchange::Step));
        let before = sim.kinetic_energy();
        sim.run(30);
        (sim.kinetic_energy() / before, sim.momentum().length())
    };
    let (kept, momentum) = energy(Ghosts::Dynamic);
    assert!(kept < 0.01 && momentum < 1e-6, "{kept} {momentum}");
    // Each side stops as before a wall that comes at 3 m/s: it leaves with that speed.
    let (kept, momentum) = energy(Ghosts::Frozen);
    assert!((kept - 1.0).abs() < 0.1 && momentum < 1e-3, "{kept} {momentum}");
}

/// A frozen ghost moves on as it was told to, whatever it meets.
#[test]
fn a_frozen_ghost_gives_way_to_nothing() {
    let mut scene = Scene::new(DVec2::ZERO, 0.0);
    scene.params.ghosts = Ghosts::Frozen;
    let light = scene.kind(Shape::circle(0.2), Material { friction: 0.0, ..Material::default() });
    let heavy = scene.kind(Shape::circle(0.2), Material { friction: 0.0, density: 1000.0, ..Material::default() });
    let ball = scene.body(light, DVec2::new(-0.3, 0.0), Vec2::ZERO);
    scene.body(heavy, DVec2::new(0.3, 0.0), Vec2::new(-4.0, 0.0));
    let mut sim = scene.start((Cut::Columns, Exchange::Step));
    sim.run(10);
    let velocity = sim.body(ball).velocity;
    assert!((velocity.x + 4.0).abs() < 0.3, "{velocity}");
}

#[test]
fn frozen_ghosts_within_a_step_are_refused() {
    let mut scene = Scene::new(DVec2::ZERO, 0.0);
    scene.params.ghosts = Ghosts::Frozen;
    let refused = World::new(&scene.blueprint((1, 1), Exchange::Substep), &[]).unwrap_err();
    assert_eq!(refused, SetupError::FrozenSubsteps);
}

/// The two solvers bring a ball to the same roll down a slope.
#[test]
fn both_solvers_roll_alike() {
    let speed = |solver| {
        let mut scene = Scene::new(DVec2::ZERO, -10.0);
        scene.params.solver = solver;
        scene.wall(DVec2::ZERO, (30.0, 1.0), -0.3, Material::default());
        let kind = scene.kind(Shape::circle(0.5), Material::default());
        let id: GlobalId = scene.body(kind, DVec2::new(-5.0, 2.59), Vec2::ZERO);
        let mut sim = scene.start((Cut::Whole, Exchange::Step));
        sim.run(90);
        sim.body(id).velocity.length()
    };
    let (soft, reported) = (speed(Solver::SoftStep), speed(Solver::Pgs));
    assert!(soft > 1.0 && (soft - reported).abs() < 0.05 * soft, "{soft} {reported}");
}
