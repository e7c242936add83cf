//! The library as somebody uses it who has all tiles in one process: `atoll_core` without a halo of one's own.

use atoll_core::{
    Adaptive, Blueprint, Body, BodyFault, Exchange, Facts, GlobalId, Halo, Hashes, Inbox, KindId, Loopback, NotHere,
    Outbox, Params, Partition, Rot, SetupError, Shape, Solver, StepError, TileId, World, finish, halo_width, measure,
    step,
};
use atoll_tests::program;
use atoll_tests::scenes;
use glam::{DVec2, Vec2};
use std::time::{Duration, Instant};

/// Looking at a world changes nothing of what comes, and shows what it would end with.
#[test]
fn a_world_can_be_measured_at_any_step() {
    for (tiles, exchange, solver) in [
        ((1, 1), Exchange::Step, Solver::SoftStep),
        ((3, 2), Exchange::Step, Solver::Pgs),
        ((3, 2), Exchange::Substep, Solver::SoftStep),
    ] {
        let mut scene = scenes::pile(12, 8);
        scene.params = Params { solver, ..scene.params };
        let (mut looked_at, mut left_alone) =
            (scene.start_on(tiles, exchange).world, scene.start_on(tiles, exchange).world);
        let mut contacts = 0;
        for _ in 0..60 {
            // Before the first step, after the last one, and in between.
            let facts = Facts::total(measure(&looked_at, &mut Loopback).unwrap());
            assert_eq!(facts.bodies, 96);
            contacts += facts.contacts;
            assert_eq!(step(&mut looked_at, &mut Loopback).unwrap(), step(&mut left_alone, &mut Loopback).unwrap());
        }
        assert!(contacts > 1000, "only {contacts} contacts in all steps");
        assert_eq!(looked_at.hashes(), left_alone.hashes());
        assert_ne!(looked_at.hashes(), Hashes::default());
        assert_eq!(measure(&looked_at, &mut Loopback), finish(left_alone, &mut Loopback));
    }
}

fn two_tiles() -> Blueprint {
    let scene = scenes::room(4, 1);
    scene.blueprint((2, 1), Exchange::Step)
}

#[test]
fn a_halo_that_delivers_on_the_spot_refuses_half_a_world() {
    let mut half = World::new(&two_tiles(), &[TileId(0)]).unwrap();
    let middle = two_tiles().partition.region(TileId(0)).max.x;
    assert!(half.add(Body::at_rest(GlobalId(9), KindId(0), DVec2::new(middle - 0.1, 2.0))).unwrap());
    let refused = step(&mut half, &mut Loopback).unwrap_err();
    assert_eq!(refused, StepError::Halo(NotHere { tile: TileId(1) }));
    assert!(refused.to_string().contains("tile 1"), "{refused}");
}

/// Of some sync points one fails, having delivered or not: then the world refuses to go on, and is what it was once it is restored.
#[test]
fn a_world_whose_halo_failed_goes_on_once_it_is_restored() {
    struct Breaks {
        left: u32,
        delivers: bool,
    }
    impl Halo for Breaks {
        type Error = &'static str;
        fn exchange(&mut self, outbox: &mut Outbox, inbox: &mut Inbox) -> Result<(), &'static str> {
            let breaks = self.left == 0;
            if !breaks || self.delivers {
                assert_eq!(outbox.deliver(inbox), None);
            }
            self.left = self.left.wrapping_sub(1);
            if breaks { Err("the wire broke") } else { Ok(()) }
        }
    }
    for exchange in [Exchange::Step, Exchange::Substep] {
        let mut scene = scenes::pile(12, 8);
        // Bodies change tiles all the time.
        scene.bodies.iter_mut().for_each(|body| body.velocity = Vec2::new(6.0 - 2.0 * (body.id.0 % 7) as f32, 3.0));
        let begun = || scene.start_on((4, 3), exchange).world;
        let mut undisturbed = begun();
        let mut ends = Vec::new();
        (0..30).for_each(|_| {
            step(&mut undisturbed, &mut Loopback).unwrap();
            ends.push(undisturbed.hashes());
        });
        for (left, delivers) in [(0, false), (0, true), (3, true)] {
            let mut world = begun();
            for _ in 0..15 {
                step(&mut world, &mut Loopback).unwrap();
            }
            let mut bytes = Vec::new();
            let saved = world.save(&mut bytes);
            let left = if exchange == Exchange::Step { 0 } else { left };
            let broken = step(&mut world, &mut Breaks { left, delivers });
            assert_eq!(broken, Err(StepError::Halo("the wire broke")));
            assert_eq!(step(&mut world, &mut Loopback), Err(StepError::Halfway { step: 15 }));
            assert_eq!(measure(&world, &mut Loopback), Err(StepError::Halfway { step: 15 }));
            let mut rest = &bytes[..];
            for tile in saved {
                world.restore(tile.tile, rest.split_off(..tile.length).unwrap()).unwrap();
            }
            world.resume_at(15);
            for expected in &ends[15..] {
                step(&mut world, &mut Loopback).unwrap();
                assert!(world.hashes() == *expected, "{exchange:?}, {left}, {delivers}");
            }
        }
    }
}

#[test]
fn statics_that_cannot_be_are_refused() {
    let blueprint = two_tiles();
    let mut wide = blueprint.statics[0].clone();
    wide.kind.shape = Shape::polygon(&[Vec2::ZERO, Vec2::new(3e38, 0.0), Vec2::new(3e38, 3e38)], 0.0).unwrap();
    let mut turned = blueprint.statics[0].clone();
    turned.rotation = Rot { c: 0.5, s: 0.0 };
    for fixed in [wide, turned] {
        let (id, statics) = (fixed.id, vec![fixed]);
        let refused = World::whole(&Blueprint { statics, ..blueprint.clone() }).unwrap_err();
        assert_eq!(refused, SetupError::BadStatic { id });
    }
    for (length, radius) in [(-1.0, 0.5), (0.0, 0.5), (f32::NAN, 0.5), (1.0, 0.0)] {
        assert!(Shape::capsule(length, radius).is_err(), "{length} {radius}");
    }
}

#[test]
fn a_name_is_given_once() {
    let mut world = World::whole(&two_tiles()).unwrap();
    let (low, high) = (two_tiles().partition.min(), two_tiles().partition.max());
    let at = |id, part| Body::at_rest(GlobalId(id), KindId(0), low + (high - low) * part);
    for id in [10, 11, u64::MAX] {
        assert!(world.add(at(id, 0.3)).unwrap());
    }
    // Another place, another tile, is no excuse.
    for (id, part) in [(10, 0.3), (11, 0.8), (u64::MAX, 0.8)] {
        assert_eq!(world.add(at(id, part)), Err(SetupError::NameTaken { id: GlobalId(id) }));
    }
    // A static's.
    assert_eq!(world.add(at(0, 0.5)), Err(SetupError::BadBody { id: GlobalId(0), fault: BodyFault::NameOfStatic }));
    assert_eq!(world.bodies().count(), 3);
}

/// Tiles that follow the bodies: kilometers of nothing around a dense cluster cost next to nothing. Of several tries in turn the
/// quickest counts, as others may be busy beside; at full length with as many bodies as are asked about.
#[test]
fn nothing_around_a_cluster_costs_little() {
    let side = if std::env::var_os("ATOLL_FULL_LENGTH").is_some() { 317 } else { 60 };
    let scene = scenes::room(side, 1);
    let blueprint = scene.blueprint((1, 1), Exchange::Step);
    let rule = Adaptive::new(scene.bodies.len() as u64 / 8, halo_width(&blueprint.kinds, &blueprint.params));
    let run = |reach: f64| {
        let (middle, half) = (0.5 * (blueprint.partition.min() + blueprint.partition.max()), DVec2::splat(reach));
        let places = scene.bodies.iter().map(|body| (body.position, 1));
        let partition = Partition::adaptive(middle - half, middle + half, [1, 1], &rule, places).unwrap();
        let mut world = World::whole(&Blueprint { partition, ..blueprint.clone() }).unwrap();
        scene.bodies.iter().for_each(|body| assert!(world.add(*body).unwrap()));
        let begun = Instant::now();
        for number in 0..40 {
            if number % 10 == 0
                && let Some(partition) = world.partition().adapted(&rule, &world.census(&rule)).unwrap()
            {
                world.retile(&partition).unwrap();
            }
            step(&mut world, &mut Loopback).unwrap();
        }
        assert_eq!(world.bodies().count(), scene.bodies.len());
        begun.elapsed()
    };
    let [mut alone, mut apart] = [Duration::MAX; 2];
    for _ in 0..12 {
        alone = alone.min(run(0.7 * side as f64 + 2.0));
        apart = apart.min(run(5e4));
        println!("{} bodies: {alone:?} alone, {apart:?} in 10^5 m", scene.bodies.len());
        if apart < 2 * alone {
            return;
        }
    }
    panic!("{alone:?} alone, {apart:?} in 10^5 m");
}

/// What a blueprint says of memory is what a run takes, within a factor of two: few tiles, or many more than bodies.
#[test]
fn memory_is_foreseen() {
    for (bodies, tiles) in [(200_000_u64, 6_u32), (20_000, 300), (2_000, 700)] {
        let folder = tempfile::tempdir().unwrap();
        let (json, toml) = (folder.path().join("run.json"), format!("--tiles={tiles}x{tiles}"));
        let mut command = program::command_of(program::Profile::CURRENT);
        command.args(["run", "configs/normal.toml", "--steps", "2", "--quiet", &toml]);
        let peak =
            program::run_to_summary(command.args(["--bodies", &bodies.to_string()]), &json)["peak_rss_bytes"].as_u64();
        let side = 1210.0 * (bodies as f64 / 700_000.0).sqrt();
        let mut blueprint = scenes::room(4, 1).blueprint((1, 1), Exchange::Step);
        blueprint.partition = Partition::uniform(DVec2::splat(-10.0), DVec2::splat(side - 10.0), tiles, tiles).unwrap();
        let (foreseen, peak) = (blueprint.memory(bodies) as f64, peak.unwrap() as f64);
        assert!(
            foreseen < 2.0 * peak && peak < 1.3 * foreseen,
            "{bodies} bodies: {foreseen:e} foreseen, {peak:e} taken"
        );
    }
}
