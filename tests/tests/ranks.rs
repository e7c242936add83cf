//! Ranks, threads and the assignment are how a world is computed, never what: one tile grid, one trajectory. Here over
//! the smallest halo there can be; the program over its transports is tested elsewhere.

use atoll_core::{Exchange, Facts, GlobalId, Hashes, Material, Shape, StepError, StepReport, TileId, finish, step};
use atoll_tests::ranks::{RankOf, Spread, run};
use atoll_tests::scenes;
use atoll_tests::world::{Scene, noise};
use glam::{DVec2, Vec2};

/// What a run comes to: hashes halfway and at the end, the last report, the closing facts.
#[derive(Clone, PartialEq, Debug)]
struct Outcome {
    halfway: Hashes,
    hashes: Hashes,
    report: StepReport,
    migrations: u64,
    facts: Facts,
}

fn outcome(scene: &Scene, spread: Spread<'_>, steps: u32) -> Outcome {
    let parts = run(scene, spread, |mut world, halo| {
        let mut halfway = Hashes::default();
        let (mut report, mut migrations) = (StepReport::default(), 0);
        for i in 0..steps {
            if i == steps / 2 {
                halfway = world.hashes();
            }
            report = step(&mut world, halo).expect("a step that succeeds");
            migrations += report.migrations;
        }
        let hashes = world.hashes();
        (halfway, hashes, report, migrations, finish(world, halo).expect("a run that ends well"))
    });
    let mut whole = parts[0].2;
    for (.., report, _, _) in &parts[1..] {
        assert_eq!((report.step, report.stopped), (whole.step, whole.stopped));
        whole.contacts += report.contacts;
        whole.border_contacts += report.border_contacts;
        whole.ghosts += report.ghosts;
        whole.migrations += report.migrations;
        whole.islands += report.islands;
        whole.largest_island = whole.largest_island.max(report.largest_island);
        whole.asleep += report.asleep;
        whole.colors = whole.colors.max(report.colors);
    }
    Outcome {
        halfway: parts.iter().map(|part| part.0).reduce(Hashes::merge).unwrap(),
        hashes: parts.iter().map(|part| part.1).reduce(Hashes::merge).unwrap(),
        report: whole,
        migrations: parts.iter().map(|part| part.3).sum(),
        facts: Facts::total(parts.into_iter().flat_map(|part| part.4)),
    }
}

/// The same world alone, on one rank that asks nobody.
fn alone(scene: &Scene, tiles: (u32, u32), exchange: Exchange, steps: u32) -> Outcome {
    let mut sim = scene.start_on(tiles, exchange);
    let (mut halfway, mut migrations) = (Hashes::default(), 0);
    for i in 0..steps {
        if i == steps / 2 {
            halfway = sim.hashes();
        }
        sim.run(1);
        migrations += sim.report.migrations;
    }
    Outcome { halfway, hashes: sim.hashes(), report: sim.report, migrations, facts: sim.finish() }
}

/// Every number of ranks, and for each another way to deal out the tiles; threads one and two by turns.
fn check(scene: &Scene, tiles: (u32, u32), exchange: Exchange, steps: u32) -> Outcome {
    let count = (tiles.0 * tiles.1) as usize;
    let expected = alone(scene, tiles, exchange, steps);
    for (k, ranks) in [1_usize, 2, 3, 4, 7].into_iter().enumerate() {
        let blocks = move |tile: TileId| tile.0 as usize * ranks / count;
        let dealt = move |tile: TileId| tile.0 as usize % ranks;
        let drawn = move |tile: TileId| (noise(99, u64::from(tile.0)) * ranks as f64) as usize;
        let ways: [RankOf<'_>; 3] = [&blocks, &dealt, &drawn];
        for (threads, rank_of) in [(1 + k % 2, ways[k % 3]), (2 - k % 2, ways[(k + 1) % 3])] {
            let found = outcome(scene, Spread { tiles, exchange, ranks, rank_of, threads }, steps);
            assert_eq!(found, expected, "{ranks} ranks of {threads} threads on {tiles:?} tiles, {exchange:?}");
        }
    }
    expected
}

const GRIDS: [(u32, u32); 3] = [(1, 1), (3, 2), (8, 8)];

#[test]
fn a_room_of_flying_bodies_is_the_same_on_any_ranks() {
    let scene = scenes::room(18, 7);
    for exchange in [Exchange::Step, Exchange::Substep] {
        for tiles in GRIDS {
            let outcome = check(&scene, tiles, exchange, 40);
            assert_eq!(outcome.facts.bodies, 18 * 18);
            if tiles != (1, 1) {
                assert!(outcome.migrations > 30 && outcome.report.ghosts > 30, "{outcome:?}");
            }
        }
    }
}

#[test]
fn a_pile_is_the_same_on_any_ranks() {
    let scene = scenes::pile(24, 12);
    for exchange in [Exchange::Step, Exchange::Substep] {
        for tiles in GRIDS {
            let outcome = check(&scene, tiles, exchange, 60);
            assert!(outcome.report.contacts > 300, "{outcome:?}");
            assert!(tiles == (1, 1) || outcome.report.border_contacts > 5, "{outcome:?}");
        }
    }
}

#[test]
fn another_seed_another_trajectory() {
    let hashes = |seed| alone(&scenes::room(10, seed), (3, 2), Exchange::Step, 20).hashes;
    assert_eq!(hashes(1), hashes(1));
    let (one, other) = (hashes(1), hashes(2));
    assert!(one.state != other.state && one.contact != other.contact);
}

#[test]
fn a_request_to_stop_reaches_every_rank_in_the_same_step() {
    let scene = scenes::room(6, 1);
    let rank_of = |tile: TileId| tile.0 as usize % 3;
    let spread = Spread { tiles: (3, 2), exchange: Exchange::Step, ranks: 4, rank_of: &rank_of, threads: 1 };
    let stopped = run(&scene, spread, |mut world, halo| {
        // Only the rank of tile 2 asks, and only after five steps. Rank 3 has no tile at all.
        let asks = world.tiles().any(|tile| tile == TileId(2));
        for i in 0..20 {
            if i == 5 && asks {
                world.request_stop();
            }
            if step(&mut world, halo).expect("a step that succeeds").stopped {
                return (i, world.step_count());
            }
        }
        panic!("nobody stopped");
    });
    assert_eq!(stopped, [(5, 6); 4]);
}

/// Bodies whose speed passes the greatest float in a known step; those named by `early` in step 3, all in step 5.
fn overflowing(early: &[u64]) -> Scene {
    let mut scene = Scene::new(DVec2::ZERO, 0.0);
    scene.half = DVec2::splat(4.0);
    // A substep adds 1e36 m/s: a step 4e36.
    scene.params.dt = 0.125;
    scene.params.gravity = Vec2::new(0.0, 3.2e37);
    let kind = scene.kind(Shape::circle(0.2), Material::default());
    for k in 0..12_u32 {
        let id = scene.body(kind, DVec2::new(-3.6 + 0.6 * f64::from(k), 0.5), Vec2::ZERO);
        // The rest to the greatest float is used up after some substeps of the step meant.
        let steps = if early.contains(&id.0) { 3.5 } else { 5.5 };
        scene.last().velocity.y = f32::MAX - 4e36 * steps;
    }
    scene
}

#[test]
fn a_state_that_overflows_is_named_by_every_rank() {
    for exchange in [Exchange::Step, Exchange::Substep] {
        for (early, lowest) in [(vec![10, 4, 9], 4), (vec![11], 11), (vec![], 0)] {
            let scene = overflowing(&early);
            let at = if early.is_empty() { 5 } else { 3 };
            let rank_of = |tile: TileId| tile.0 as usize % 3;
            let spread = Spread { tiles: (4, 1), exchange, ranks: 4, rank_of: &rank_of, threads: 1 };
            let expected = StepError::NonFinite { step: at, id: GlobalId(lowest) };
            let errors = run(&scene, spread, |mut world, halo| {
                // The step in which it appears ends; the next one is refused.
                for _ in 0..=at {
                    step(&mut world, halo).expect("a step that succeeds");
                }
                (step(&mut world, halo).unwrap_err(), world.step_count())
            });
            for (error, steps) in errors {
                assert_eq!((error, steps), (expected.clone(), at + 1), "{exchange:?}, {early:?}");
            }
            // A run that ends with that step hears of it in its closing exchange.
            let errors = run(&scene, spread, |mut world, halo| {
                for _ in 0..=at {
                    step(&mut world, halo).expect("a step that succeeds");
                }
                finish(world, halo).unwrap_err()
            });
            assert!(errors.iter().all(|error| *error == expected), "{exchange:?}: {errors:?}");
        }
    }
}

#[test]
fn an_overflow_within_a_collision_is_caught_in_its_step() {
    // The greatest speeds there are, head on: relative velocity, and so the impulse, is infinite in the first step.
    let mut scene = Scene::new(DVec2::ZERO, 0.0);
    let kind = scene.kind(Shape::circle(0.5), Material::default());
    scene.body(kind, DVec2::new(-3.0, 3.0), Vec2::ZERO);
    for side in [-1.0, 1.0] {
        scene.body(kind, DVec2::new(0.51 * side, 0.0), Vec2::new(-3e38 * side as f32, 0.0));
    }
    for exchange in [Exchange::Step, Exchange::Substep] {
        let rank_of = |tile: TileId| tile.0 as usize;
        let spread = Spread { tiles: (2, 1), exchange, ranks: 2, rank_of: &rank_of, threads: 1 };
        let errors = run(&scene, spread, |mut world, halo| {
            let first = step(&mut world, halo);
            first.and_then(|_| step(&mut world, halo)).unwrap_err()
        });
        let expected = StepError::NonFinite { step: 0, id: GlobalId(1) };
        assert!(errors.iter().all(|error| *error == expected), "{exchange:?}: {errors:?}");
    }
}
