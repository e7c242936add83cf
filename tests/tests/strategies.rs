//! How islands are found and how contacts are shared among threads is how a step is made, never what: one world, one
//! trajectory, for every strategy on any number of threads.

use atoll_core::{Exchange, Hashes, IslandSearch, Material, Parallel, Shape, Solver, TileId, step};
use atoll_tests::ranks::{Spread, run};
use atoll_tests::scenes;
use atoll_tests::world::Scene;
use glam::{DVec2, Vec2};

const STRATEGIES: [Parallel; 4] = [Parallel::Serial, Parallel::Islands, Parallel::Coloring, Parallel::Auto];
const SEARCHES: [IslandSearch; 3] = [IslandSearch::UnionFind, IslandSearch::Dfs, IslandSearch::ParallelUnionFind];

/// Hashes after some steps on fewer tiles than threads, so that threads work within a tile.
fn hashes(scene: &Scene, tiles: (u32, u32), exchange: Exchange, threads: usize, steps: u32) -> Hashes {
    let rank_of = |_: TileId| 0;
    let spread = Spread { tiles, exchange, ranks: 1, rank_of: &rank_of, threads };
    let ends = run(scene, spread, |mut world, halo| {
        let mut contacts = 0;
        for _ in 0..steps {
            contacts = step(&mut world, halo).expect("a step that succeeds").contacts;
        }
        assert!(contacts > 100, "only {contacts} contacts");
        world.hashes()
    });
    ends[0]
}

fn all_strategies_agree(mut scene: Scene, steps: u32) {
    for exchange in [Exchange::Step, Exchange::Substep] {
        for tiles in [(1, 1), (2, 1)] {
            scene.params.parallel = Parallel::Serial;
            let expected = hashes(&scene, tiles, exchange, 1, steps);
            for (k, parallel) in STRATEGIES.into_iter().enumerate() {
                for threads in [1, 2, 3] {
                    scene.params.parallel = parallel;
                    scene.params.island_search = SEARCHES[(k + threads) % 3];
                    let found = hashes(&scene, tiles, exchange, threads, steps);
                    assert_eq!(found, expected, "{parallel:?}, {threads} threads, {tiles:?} tiles, {exchange:?}");
                }
            }
        }
    }
}

/// One island of some thousand contacts: large enough that `auto` gives it to all threads.
#[test]
fn a_pile() {
    all_strategies_agree(scenes::pile(64, 40), 40);
}

/// Many islands, and walls that all of them touch.
#[test]
fn a_crowd_of_islands() {
    let mut scene = Scene::new(DVec2::splat(25.0), -10.0);
    scene.half = DVec2::splat(26.0);
    for row in 0..10 {
        scene.wall(DVec2::new(25.0, 5.0 * f64::from(row)), (50.0, 0.5), 0.0, Material::default());
    }
    let kinds = [Shape::rectangle(0.4, 0.4), Shape::circle(0.25)].map(|shape| scene.kind(shape, Material::default()));
    for row in 0..10 {
        for stack in 0..40 {
            for k in 0..1 + (stack + row) % 5 {
                let place = DVec2::new(1.0 + 1.2 * f64::from(stack), 5.0 * f64::from(row) + 0.55 + 0.55 * f64::from(k));
                scene.body(kinds[(k + stack) as usize % 2], place, Vec2::new(0.3 * f64::from(k) as f32, 0.0));
            }
        }
    }
    all_strategies_agree(scene, 60);
}

#[test]
fn what_bounces() {
    let mut scene = scenes::pile(24, 16);
    for kind in &mut scene.kinds {
        kind.material.restitution = 0.6;
    }
    all_strategies_agree(scene, 50);
}

#[test]
fn with_the_other_solver() {
    let mut scene = scenes::pile(48, 20);
    scene.params.solver = Solver::Pgs;
    all_strategies_agree(scene, 40);
}

/// A body with more contacts than there are colors: the rest overflows.
#[test]
fn around_a_hub() {
    let mut scene = Scene::new(DVec2::ZERO, 0.0);
    let hub = scene.kind(Shape::circle(4.0), Material::default());
    let small = scene.kind(Shape::circle(0.15), Material::default());
    scene.body(hub, DVec2::ZERO, Vec2::ZERO);
    for k in 0..78 {
        let direction = atoll_core::Rot::from_angle(std::f32::consts::TAU * k as f32 / 78.0).rotate(Vec2::X);
        for ring in 0..2 {
            let place = direction.as_dvec2() * (4.16 + 0.31 * f64::from(ring));
            scene.body(small, place, direction * -1.0);
        }
    }
    all_strategies_agree(scene, 30);
}
