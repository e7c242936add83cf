use crate::testing::{circle, rectangle};
use crate::*;
use glam::{DVec2, Vec2};
use rayon::ThreadPoolBuilder;

/// Bodies that fall into a trough, on some tiles: of one kind, which are boxes, or of two, boxes and balls.
fn heap(kinds: u32, tiles: (u32, u32), params: Params) -> World {
    let wall = |id, x, y| StaticBody::new(GlobalId(id), rectangle(0.5, 20.0), DVec2::new(x, y));
    let blueprint = Blueprint {
        params: Params { gravity: Vec2::new(1.0, -10.0), ..params },
        partition: Partition::uniform(DVec2::new(-4.0, -1.0), DVec2::new(4.0, 11.0), tiles.0, tiles.1).unwrap(),
        kinds: vec![rectangle(0.5, 0.4), circle(0.25)],
        statics: vec![
            StaticBody::new(GlobalId(0), rectangle(20.0, 1.0), DVec2::new(0.0, -0.5)),
            wall(1, -2.5, 5.0),
            wall(2, 2.5, 5.0),
        ],
    };
    let mut world = World::whole(&blueprint).unwrap();
    for i in 0..60_u32 {
        let position = DVec2::new(f64::from(i % 6) * 0.6 - 1.5, f64::from(i / 6) * 0.55 + 0.3);
        let velocity = Vec2::new((i * 7 % 5) as f32 - 2.0, 0.0);
        let body = Body::at_rest(GlobalId(u64::from(i) + 3), KindId(i % kinds), position);
        assert!(world.add(Body { velocity, angular_velocity: 1.5, ..body }).unwrap());
    }
    world
}

fn figures_of_step(world: &mut World) -> Figures {
    world.take_figures_of_next_step();
    step(world, &mut Loopback).unwrap();
    *world.figures().unwrap()
}

#[track_caller]
fn assert_near(found: f64, expected: f64, scale: f64) {
    assert!((found - expected).abs() <= 1e-12 * scale, "{found} and not {expected}");
}

/// Energies are those of a measured state after the step. Contacts are those of a measured state before it, but that there no
/// manifold is kept from earlier steps, nor is one that of the middle of the step, as are those of balls.
#[test]
fn a_step_tells_what_is_measured_before_and_after_it() {
    for exchange in [Exchange::Step, Exchange::Substep] {
        let params = Params { recycle_distance: 0.0, exchange, ..Params::default() };
        let mut world = heap(1, (3, 2), params);
        let mut most = 0;
        for _ in 0..80 {
            let before = Facts::total(measure(&world, &mut Loopback).unwrap());
            let figures = figures_of_step(&mut world);
            let after = Facts::total(measure(&world, &mut Loopback).unwrap());
            let counts = (figures.contacts, figures.border_contacts, figures.overlaps);
            assert_eq!(counts, (before.contacts, before.border_contacts, before.overlaps));
            assert_eq!(figures.max_overlap(), before.max_penetration);
            // Whoever presses is held as he is; measured anew, one who rocks on a corner is taken as he will touch.
            assert!((figures.mean_overlap() - before.mean_penetration).abs() < 1e-5);
            assert_eq!(figures.bodies, after.bodies);
            assert_near(figures.kinetic_energy(), after.kinetic_energy, after.kinetic_energy);
            let [x, y] = figures.momentum();
            assert_near(x, after.momentum[0], 100.0);
            assert_near(y, after.momentum[1], 100.0);
            // Nothing else is needed to know of the bodies.
            let now = world.figures_of_bodies();
            assert_eq!(
                (now.kinetic, now.potential, now.angular),
                (figures.kinetic, figures.potential, figures.angular)
            );
            most = most.max(figures.overlaps);
        }
        assert!(most > 60, "{most} overlaps: the heap has not settled");
    }
}

#[test]
fn manifolds_that_are_kept_tell_nearly_the_same() {
    let mut world = heap(2, (2, 2), Params::default());
    for _ in 0..200 {
        step(&mut world, &mut Loopback).unwrap();
    }
    let before = Facts::total(measure(&world, &mut Loopback).unwrap());
    let figures = figures_of_step(&mut world);
    assert!(figures.contacts.abs_diff(before.contacts) <= 3, "{} and {}", figures.contacts, before.contacts);
    // A manifold is kept while its bodies have moved less than this against each other, so no point is further off.
    let off = Params::default().recycle_distance.into();
    let told = [figures.mean_overlap(), figures.max_overlap(), before.mean_penetration, before.max_penetration];
    assert!((told[0] - told[2]).abs() < off && (told[1] - told[3]).abs() < off, "{told:?}");
    assert!(told[2] > 0.0 && figures.overlaps > 0, "{told:?}");
}

#[test]
fn nothing_is_told_that_was_not_asked_for() {
    let mut world = heap(2, (1, 1), Params::default());
    assert!(world.figures().is_none());
    figures_of_step(&mut world);
    step(&mut world, &mut Loopback).unwrap();
    assert!(world.figures().is_none());
    // But of the step after which all stop.
    world.request_stop();
    assert!(step(&mut world, &mut Loopback).unwrap().stopped && world.figures().is_some());
}

/// However the tiles are spread, and however many threads work on one of them.
#[test]
fn ranks_and_threads_change_no_bit() {
    let blueprint = |tiles| Blueprint {
        params: Params { gravity: Vec2::new(0.3, -9.81), ..Params::default() },
        partition: Partition::uniform(DVec2::ZERO, DVec2::splat(100.0), tiles, 1).unwrap(),
        kinds: vec![circle(0.3), rectangle(0.4, 0.7)],
        statics: Vec::new(),
    };
    let bodies = |i: u32| {
        let position = DVec2::new(f64::from(i % 100) + 0.1, f64::from(i / 100) * 0.5);
        let velocity = Vec2::new((i % 17) as f32 / 7.0 - 1.0, (i % 13) as f32 / 3.0 - 2.0);
        let body = Body::at_rest(GlobalId(u64::from(i)), KindId(i % 2), position);
        Body { velocity, angular_velocity: (i % 11) as f32 - 5.0, ..body }
    };
    let world = |tiles, own: &[TileId]| {
        let mut world = World::new(&blueprint(tiles), own).unwrap();
        for i in 0..12_001 {
            world.add(bodies(i)).unwrap();
        }
        world
    };
    // One tile of three pieces.
    let with_threads = |threads| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| figures_of_step(&mut world(1, &[TileId(0)])))
    };
    let one = with_threads(1);
    assert_eq!(with_threads(3), one);
    assert!(one.overlaps > 1000 && one.max_overlap() > 0.1, "{} overlaps", one.overlaps);
    // Tiles of one rank, and of two.
    let all: Vec<_> = (0..4).map(TileId).collect();
    let whole = world(4, &all).figures_of_bodies();
    let mut parts = world(4, &all[2..]).figures_of_bodies();
    parts.merge(&world(4, &all[..2]).figures_of_bodies());
    assert_eq!(parts, whole);
    assert_eq!(whole.bodies, 12_001);
}

/// With such numbers every sum of the closed form is exact in single precision too.
#[test]
fn free_flight_keeps_its_energy() {
    let low = DVec2::new(-10.0, -20.0);
    let blueprint = Blueprint {
        params: Params { gravity: Vec2::new(0.0, -8.0), dt: 1.0 / 64.0, ..Params::default() },
        partition: Partition::uniform(low, DVec2::splat(30.0), 1, 1).unwrap(),
        kinds: vec![rectangle(0.5, 0.25)],
        statics: Vec::new(),
    };
    let mut world = World::whole(&blueprint).unwrap();
    let body = Body::at_rest(GlobalId(1), KindId(0), DVec2::new(1.5, 4.5));
    world.add(Body { velocity: Vec2::new(3.0, 5.0), angular_velocity: 2.0, ..body }).unwrap();
    let mass = f64::from(blueprint.kinds[0].material.density) * 0.125;
    let inertia = f64::from(mass as f32 * blueprint.kinds[0].shape.inertia_per_mass());
    let start = world.figures_of_bodies();
    assert_eq!((start.bodies, start.contacts, start.momentum()), (1, 0, [3.0 * mass, 5.0 * mass]));
    assert_eq!(start.potential_energy(), mass * 8.0 * 24.5);
    assert_near(start.kinetic_energy(), mass * 17.0 + 2.0 * inertia, 100.0);
    assert_near(start.angular_momentum(), mass * (1.5 * 5.0 - 4.5 * 3.0) + 2.0 * inertia, 100.0);
    for n in 1..=64 {
        let figures = figures_of_step(&mut world);
        let time = f64::from(n) / 64.0;
        let expected = start.kinetic_energy() + start.potential_energy();
        assert_near(figures.kinetic_energy() + figures.potential_energy(), expected, 1e3);
        assert_eq!(figures.momentum(), [3.0 * mass, mass * (5.0 - 8.0 * time)]);
        // About the origin its weight turns it: x is on the right, so clockwise.
        let (x, y) = (1.5 + 3.0 * time, 4.5 + 5.0 * time - 4.0 * time * time);
        let angular = mass * (x * (5.0 - 8.0 * time) - y * 3.0) + 2.0 * inertia;
        assert_near(figures.angular_momentum(), angular, 100.0);
    }
}

/// Two balls around their middle, far from the origin: nothing turns them, and nothing stops them.
#[test]
fn what_nothing_turns_keeps_its_angular_momentum() {
    let blueprint = Blueprint {
        params: Params { gravity: Vec2::ZERO, ..Params::default() },
        partition: Partition::uniform(DVec2::ZERO, DVec2::splat(100.0), 2, 2).unwrap(),
        kinds: vec![circle(0.5)],
        statics: Vec::new(),
    };
    let mut world = World::whole(&blueprint).unwrap();
    for side in [-1.0, 1.0] {
        let body = Body::at_rest(GlobalId(if side < 0.0 { 0 } else { 1 }), KindId(0), DVec2::new(50.0 + side, 50.0));
        world.add(Body { velocity: Vec2::new(0.0, side as f32 * 4.0), angular_velocity: 3.0, ..body }).unwrap();
    }
    let mass = f64::from(blueprint.kinds[0].material.density) * std::f64::consts::PI / 4.0;
    let expected = 2.0 * mass * 4.0 + 2.0 * mass * 0.125 * 3.0;
    for _ in 0..60 {
        let figures = figures_of_step(&mut world);
        assert!((figures.angular_momentum() - expected).abs() < 1e-5 * expected, "{}", figures.angular_momentum());
        assert_eq!((figures.momentum(), figures.contacts, figures.potential_energy()), ([0.0; 2], 0, 0.0));
    }
}
