//! Worlds that are far from comfortable: tiles as small as bodies, and a blow of tons. Each was a defect.

use atoll_core::{Exchange, Material, Shape, Solver};
use atoll_tests::scenes;
use atoll_tests::world::Scene;
use glam::{DVec2, Vec2};

/// With `pgs` and tiles of a meter a pile was blown to all sides at thousands of meters a second.
#[test]
fn a_pile_on_tiles_that_are_hardly_larger_than_bodies_stays_one() {
    for (solver, most) in [(Solver::SoftStep, 0.01), (Solver::Pgs, 2.0)] {
        for grid in [(7, 7), (12, 12)] {
            for exchange in [Exchange::Step, Exchange::Substep] {
                let mut scene = scenes::pile(24, 30);
                scene.params.solver = solver;
                let mut sim = scene.start_on(grid, exchange);
                sim.run(300);
                let what = format!("{solver:?}, {grid:?}, {exchange:?}");
                let outside = |place: DVec2| (place - scene.middle).abs().cmpgt(scene.half + 1.0).any();
                assert_eq!(sim.bodies().iter().filter(|body| outside(body.position)).count(), 0, "{what}");
                let facts = sim.finish();
                let energy = facts.kinetic_energy / facts.mass;
                println!("{what}: {energy:.1e} J/kg, greatest overlap {:.3} m", facts.max_penetration);
                assert!(energy < most, "{what}: {energy} J/kg");
            }
        }
    }
}

/// With exchange "step" it rose again as fast as it had come where tiles are smaller than it.
#[test]
fn a_heavy_disc_upon_a_plank_rises_no_faster_where_there_are_tiles() {
    let rises = |exchange, grid| {
        let mut scene = Scene::new(DVec2::new(0.0, 20.0), -10.0);
        scene.half = DVec2::splat(40.0);
        let material = Material::default();
        scene.wall(DVec2::new(0.0, -1.0), (200.0, 2.0), 0.0, material);
        let plank = scene.kind(Shape::rectangle(60.0, 1.0), material);
        let disc = scene.kind(Shape::circle(10.0), material);
        scene.body(plank, DVec2::new(0.0, 0.5), Vec2::ZERO);
        let id = scene.body(disc, DVec2::new(0.3, 13.0), Vec2::new(0.0, -24.0));
        let mut sim = scene.start_on(grid, exchange);
        let mut most = 0.0_f32;
        for _ in 0..60 {
            sim.run(1);
            most = most.max(sim.body(id).velocity.y);
        }
        most
    };
    let alone = rises(Exchange::Step, (1, 1));
    // Two passes a substep do not settle a plank of 60 m under five times its weight.
    assert!(alone < 9.0, "{alone} m/s on one tile");
    for exchange in [Exchange::Substep, Exchange::Step] {
        for grid in [(2, 2), (4, 4), (8, 8)] {
            let speed = rises(exchange, grid);
            assert!(speed < 1.1 * alone, "{exchange:?}, {grid:?}: {speed} m/s, and {alone} m/s on one tile");
        }
    }
}
