//! A world that is saved and restored goes on as one that never stopped: the same bits, whichever ranks held its tiles
//! before and whichever hold them now.

use atoll_core::{
    BroadPhase, Exchange, Facts, Ghosts, Hashes, SavedTile, Shape, Solver, StepReport, TileId, World, finish, step,
};
use atoll_tests::ranks::{RankHalo, Spread, run};
use atoll_tests::scenes;
use atoll_tests::world::{Scene, noise};
use glam::{DVec2, Vec2};

/// After so many steps bodies are sorted by place, again and again.
const SORT_INTERVAL: u32 = 8;
/// Before the first step; before, at and after a step that sorts.
const SAVES: [u64; 4] = [0, 47, 48, 49];
const LAST: u64 = 75;

/// A tile and its block.
type Saved = (SavedTile, Vec<u8>);

fn save(world: &World) -> Vec<Saved> {
    let mut bytes = Vec::new();
    let saved = world.save(&mut bytes);
    let mut rest = &bytes[..];
    saved.into_iter().map(|tile| (tile, rest.split_off(..tile.length).expect("as long as said").to_vec())).collect()
}

/// What a rank's part of a run comes to: hashes, what the last step counted, overlaps at the end.
#[derive(Clone, Copy, PartialEq, Debug)]
struct End {
    hashes: Hashes,
    contacts: u64,
    border_contacts: u64,
    migrations: u64,
    asleep: u64,
    overlaps: u64,
}

impl End {
    fn merge(self, other: Self) -> Self {
        Self {
            hashes: self.hashes.merge(other.hashes),
            contacts: self.contacts + other.contacts,
            border_contacts: self.border_contacts + other.border_contacts,
            migrations: self.migrations + other.migrations,
            asleep: self.asleep + other.asleep,
            overlaps: self.overlaps + other.overlaps,
        }
    }
}

/// Makes the steps that are left, and ends the run.
fn go_on(mut world: World, halo: &mut RankHalo<'_>) -> End {
    let mut report = StepReport::default();
    while world.step_count() < LAST {
        report = step(&mut world, halo).expect("a step that succeeds");
    }
    let StepReport { contacts, border_contacts, migrations, asleep, .. } = report;
    let hashes = world.hashes();
    let facts = Facts::total(finish(world, halo).expect("a run that ends well"));
    End { hashes, contacts, border_contacts, migrations, asleep, overlaps: facts.overlaps }
}

/// Saves a scene on two ranks at some steps, goes on from there on other numbers of ranks, and compares with the run
/// that did not stop.
fn goes_on_as_if_nothing_was(mut scene: Scene, tiles: (u32, u32), exchange: Exchange) -> End {
    scene.params.sort_interval = SORT_INTERVAL;
    let halves = |tile: TileId| usize::from(tile.0 >= tiles.0 * tiles.1 / 2);
    let spread = Spread { tiles, exchange, ranks: 2, rank_of: &halves, threads: 2 };
    let parts = run(&scene, spread, |mut world, halo| {
        let mut snapshots = Vec::new();
        for at in SAVES {
            while world.step_count() < at {
                step(&mut world, halo).expect("a step that succeeds");
            }
            snapshots.push((save(&world), world.hashes()));
        }
        (snapshots, go_on(world, halo))
    });
    let uninterrupted = parts.iter().map(|part| part.1).reduce(End::merge).expect("there are ranks");
    // What was saved is all there is.
    scene.bodies.clear();
    for (k, at) in SAVES.into_iter().enumerate() {
        let ranks = [3, 4, 1, 5][k];
        let tile_of = |saved: &&Saved| saved.0.tile;
        let snapshot: Vec<_> = parts.iter().flat_map(|part| &part.0[k].0).collect();
        assert!(snapshot.iter().map(tile_of).eq((0..tiles.0 * tiles.1).map(TileId)));
        let contacts: u64 = snapshot.iter().map(|saved| saved.0.contacts).sum();
        assert!(at == 0 || contacts > 9, "only {contacts} contacts are saved after {at} steps");
        let hashes = parts.iter().map(|part| part.0[k].1).reduce(Hashes::merge).expect("there are ranks");
        let drawn = |tile: TileId| (noise(7, u64::from(tile.0)) * ranks as f64) as usize;
        let ends = run(&scene, Spread { ranks, rank_of: &drawn, threads: 1 + k % 2, ..spread }, |mut world, halo| {
            let tiles: Vec<_> = world.tiles().collect();
            for &tile in &tiles {
                world.restore(tile, &snapshot[tile.0 as usize].1).expect("a tile as it was saved");
            }
            world.resume_at(at);
            assert!(save(&world).iter().eq(tiles.iter().map(|tile| snapshot[tile.0 as usize])), "saved again");
            (world.hashes(), go_on(world, halo))
        });
        assert_eq!(ends.iter().map(|end| end.0).reduce(Hashes::merge), Some(hashes), "after {at} steps");
        let end = ends.iter().map(|end| end.1).reduce(End::merge).expect("there are ranks");
        assert_eq!(end, uninterrupted, "{exchange:?}, {ranks} ranks, saved after {at} steps");
    }
    uninterrupted
}

#[test]
fn bodies_that_fly_about() {
    for exchange in [Exchange::Step, Exchange::Substep] {
        let end = goes_on_as_if_nothing_was(scenes::room(16, 3), (8, 8), exchange);
        assert!(end.migrations > 0 && end.contacts > 20 && end.border_contacts > 5, "{end:?}");
    }
}

fn in_a_pile(end: End) {
    assert!(end.contacts > 300 && end.border_contacts > 5 && end.overlaps > 50, "{end:?}");
}

#[test]
fn a_pile_over_borders() {
    for exchange in [Exchange::Step, Exchange::Substep] {
        in_a_pile(goes_on_as_if_nothing_was(scenes::pile(24, 12), (3, 2), exchange));
    }
}

#[test]
fn a_pile_of_what_bounces() {
    let mut scene = scenes::pile(20, 12);
    scene.kinds.iter_mut().for_each(|kind| kind.material.restitution = 0.6);
    for exchange in [Exchange::Step, Exchange::Substep] {
        let end = goes_on_as_if_nothing_was(scene.clone(), (3, 2), exchange);
        assert!(end.contacts > 100 && end.border_contacts > 5, "{end:?}");
    }
}

#[test]
fn a_pile_in_a_quadtree() {
    let mut scene = scenes::pile(24, 12);
    scene.params.broad_phase = BroadPhase::Quadtree;
    in_a_pile(goes_on_as_if_nothing_was(scene, (3, 2), Exchange::Substep));
}

#[test]
fn a_pile_by_sequential_impulses() {
    let mut scene = scenes::pile(24, 12);
    scene.params.solver = Solver::Pgs;
    in_a_pile(goes_on_as_if_nothing_was(scene, (3, 2), Exchange::Step));
}

#[test]
fn a_pile_with_frozen_ghosts() {
    let mut scene = scenes::pile(24, 12);
    scene.params.ghosts = Ghosts::Frozen;
    in_a_pile(goes_on_as_if_nothing_was(scene, (3, 2), Exchange::Step));
}

/// Some sleep already when the first is saved, others fall asleep later, and a ball wakes some.
#[test]
fn islands_that_sleep_and_wake() {
    let mut scene = Scene::new(DVec2::new(0.0, 5.0), -10.0);
    (scene.params.sleep, scene.params.sleep_time) = (true, 0.2);
    let material = atoll_core::Material::default();
    scene.wall(DVec2::new(0.0, -1.0), (40.0, 2.0), 0.0, material);
    let (boxed, ball) = (scene.kind(Shape::rectangle(0.5, 0.5), material), scene.kind(Shape::circle(0.3), material));
    for stack in 0..3 {
        for k in 0..3 {
            // The higher one starts, the later it rests.
            let height = 0.25 + 0.5 * f64::from(k) + 0.2 * f64::from(stack);
            scene.body(boxed, DVec2::new(4.0 * f64::from(stack), height), Vec2::ZERO);
        }
    }
    scene.body(ball, DVec2::new(-3.0, 0.3), Vec2::new(4.0, 0.0));
    for (tiles, exchange) in [((1, 1), Exchange::Step), ((9, 3), Exchange::Step), ((9, 3), Exchange::Substep)] {
        let end = goes_on_as_if_nothing_was(scene.clone(), tiles, exchange);
        assert!(end.asleep > 0 && end.asleep < 9, "{end:?}");
    }
}
