//! What it costs to act on a world and to ask it: rays on `configs/normal.toml`, bodies that are removed and added, and, to
//! compare with, bodies that go from one tile to another. On one thread.
//!
//! `cargo run --release -p atoll-benches --bin acting [STEPS]`, of that world before rays are cast.

use atoll::Config;
use atoll::internals::{Plan, part_of_scene};
use atoll_core::{
    Blueprint, Body, GlobalId, Kind, KindId, Loopback, Material, Params, Partition, Phase, Shape, World, step,
};
use atoll_transport::Rank;
use glam::{DVec2, Vec2};
use std::path::Path;
use std::time::Instant;

type Failure = Box<dyn std::error::Error + Send + Sync>;

const MILLION: u64 = 1_000_000;

/// Numbers from 0 to 1 that look random.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn main() -> Result<(), Failure> {
    let steps = std::env::args().nth(1).map_or(Ok(100), |steps| steps.parse())?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    pool.install(|| {
        rays(steps)?;
        churn()?;
        migrations()
    })
}

/// A million rays of all lengths from anywhere.
fn rays(steps: u64) -> Result<(), Failure> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/normal.toml");
    let config = Config::load(&path, &[])?;
    let plan = Plan::new(&Config::from_toml_str("normal", &config.to_toml([9, 9]), &[("ranks", "1")])?)?;
    let mut world = part_of_scene(&plan, Rank(0))?;
    for _ in 0..steps {
        step(&mut world, &mut Loopback)?;
    }
    let (low, size) = (world.partition().min(), world.partition().max() - world.partition().min());
    let mut random = Random(1);
    let mut place = || low + DVec2::new(random.next(), random.next()) * size;
    let start = Instant::now();
    let first = world.cast_ray(place(), place());
    println!("{} bodies: {:.1} ms until the first answer ({first:?})", world.body_count(), ms(start));
    let start = Instant::now();
    let hits = (0..MILLION).filter(|_| world.cast_ray(place(), place()).is_some()).count();
    println!("a million rays between any two points: {:.0} ms, {hits} hits", ms(start));
    let start = Instant::now();
    let near = (0..MILLION).filter(|_| {
        let from = place();
        world.cast_ray(from, from + DVec2::new(3.0, 1.0)).is_some()
    });
    println!("{} of a million rays of 3 m hit: {:.0} ms", near.count(), ms(start));
    let start = Instant::now();
    let around = |place: DVec2| world.in_rectangle(place - 0.5, place + 0.5).len();
    let found: usize = (0..MILLION).map(|_| around(place())).sum();
    println!("a million squares of 1 m: {:.0} ms, {found} bodies", ms(start));
    Ok(())
}

fn world(bodies: u64, speed: f32) -> Result<World, Failure> {
    let side = bodies.isqrt();
    let size = DVec2::splat(side as f64);
    let partition = Partition::uniform(DVec2::ZERO, size, 40, 40)?;
    let kind = Kind::new(Shape::circle(0.2), Material::default());
    let blueprint = Blueprint { params: Params::default(), partition, kinds: vec![kind], statics: Vec::new() };
    let mut world = World::whole(&blueprint)?;
    for k in 0..side * side {
        let place = DVec2::new((k % side) as f64 + 0.5, (k / side) as f64 + 0.5);
        world.add(Body { velocity: Vec2::new(speed, 0.0), ..Body::at_rest(GlobalId(k), KindId(0), place) })?;
    }
    Ok(world)
}

/// A million bodies go and others come, in ten turns with a step between.
fn churn() -> Result<(), Failure> {
    let mut world = world(MILLION, 0.0)?;
    let (turns, each) = (10, MILLION / 10);
    let mut random = Random(2);
    let mut names: Vec<GlobalId> = world.bodies().map(|body| body.id).collect();
    step(&mut world, &mut Loopback)?;
    for turn in 0..turns {
        let mut gone: Vec<Body> = Vec::new();
        for _ in 0..each {
            let id = names.swap_remove((random.next() * names.len() as f64) as usize);
            gone.extend(world.get(id));
        }
        let start = Instant::now();
        gone.iter().for_each(|body| assert!(world.remove(body.id)));
        world.settle();
        let removed = ms(start) * 1e6 / each as f64;
        let start = Instant::now();
        for body in &gone {
            names.push(world.insert(*body)?);
        }
        world.settle();
        let added = ms(start) * 1e6 / each as f64;
        step(&mut world, &mut Loopback)?;
        println!("turn {turn}: {removed:.0} ns to remove one, {added:.0} ns to add one, {} MB", resident() / 1_000_000);
    }
    Ok(())
}

/// The same world, standing still, and moving by a meter a step: what that takes more, for each body that changes tiles.
fn migrations() -> Result<(), Failure> {
    let time = |speed: f32| -> Result<(f64, u64), Failure> {
        let mut world = world(MILLION, speed)?;
        step(&mut world, &mut Loopback)?;
        let before = world.timings().total(Phase::Migrate);
        let mut migrations = 0;
        for _ in 0..40 {
            migrations += step(&mut world, &mut Loopback)?.migrations;
        }
        Ok(((world.timings().total(Phase::Migrate) - before).as_secs_f64() * 1e9, migrations))
    };
    let ((still, none), (moving, some)) = (time(0.0)?, time(30.0)?);
    assert_eq!(none, 0);
    println!("{some} migrations: {:.0} ns each", (moving - still) / some as f64);
    Ok(())
}

fn ms(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// Memory of this process, in bytes.
fn resident() -> u64 {
    let statm = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    statm.split(' ').nth(1).and_then(|pages| pages.parse::<u64>().ok()).unwrap_or(0) * 4096
}
