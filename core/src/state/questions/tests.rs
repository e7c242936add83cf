use super::outline::Outline;
use super::*;
use crate::Loopback;
use crate::model::body::StaticBody;
use crate::model::id::KindId;
use crate::model::kind::{Kind, KindRow};
use crate::model::math::Rot;
use crate::model::params::Params;
use crate::model::path::{Path, Travel};
use crate::model::shape::{Part, Shape};
use crate::step::step;
use crate::testing::{any_convex, any_rotation, cases, circle, rectangle};
use crate::tiling::blueprint::Blueprint;
use crate::tiling::partition::Partition;
use crate::{Command, TileId};
use glam::Vec2;
use proptest::prelude::*;

fn blueprint(columns: u32, rows: u32, far: DVec2) -> Blueprint {
    let partition = Partition::uniform(far, far + DVec2::new(40.0, 20.0), columns, rows).unwrap();
    let wall = |id, x: f64| {
        let upright = StaticBody::new(GlobalId(id), rectangle(0.3, 30.0), far + DVec2::new(x, 10.0));
        StaticBody { rotation: Rot::from_angle(0.1 * id as f32), ..upright }
    };
    let kinds = vec![circle(0.25), rectangle(0.5, 0.3), rectangle(0.1, 3.0), circle(2.0)];
    let lift = StaticBody {
        path: Some(Path { travel: Travel::Line { velocity: DVec2::new(6.0, 2.0) }, turning: 2.0 }),
        ..StaticBody::new(GlobalId(2), rectangle(3.0, 1.0), far + DVec2::new(25.0, 16.0))
    };
    Blueprint { params: Params::default(), partition, kinds, statics: vec![wall(0, 1.0), wall(1, 30.0), lift] }
}

/// Numbers from 0 to 1 that look random.
struct Any(u64);

impl Any {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f64 / (1 << 24) as f64
    }

    fn place(&mut self) -> DVec2 {
        DVec2::new(44.0 * self.next() - 2.0, 24.0 * self.next() - 2.0)
    }
}

fn fill(world: &mut World, any: &mut Any, far: DVec2) {
    for id in 0..900 {
        let kind = KindId(if id % 97 == 0 { 3 } else { id % 3 });
        let (place, angle) = (any.place(), 6.3 * any.next() as f32);
        let body = Body::at_rest(GlobalId(10 + u64::from(id)), kind, far + place);
        let velocity = Vec2::new(any.next() as f32 - 0.5, any.next() as f32 - 0.5);
        world.add(Body { rotation: Rot::from_angle(angle), velocity, ..body }).unwrap();
    }
}

/// All that there is to be met, one by one.
fn outlines(world: &World) -> Vec<Outline<'_>> {
    let all = world.bodies().chain(world.setup.statics_at(world.step));
    all.map(|body| world.outline(&body)).collect()
}

#[test]
fn rays_may_end_and_bodies_be_as_far_away_as_numbers_go() {
    let mut world = World::whole(&blueprint(4, 3, DVec2::ZERO)).unwrap();
    let from = DVec2::new(3.0, 5.0);
    for kind in 0..3 {
        let id = GlobalId(10 + u64::from(kind));
        let at = from + DVec2::new(4.0, 3.0 * f64::from(kind));
        world.add(Body::at_rest(id, KindId(kind), at)).unwrap();
        for lonely in [DVec2::new(1e30, -1e30), DVec2::new(-1e30, 7.0)] {
            let hermit = world.insert(Body::at_rest(id, KindId(0), lonely)).unwrap();
            for far in [1e37, 1e155, 1e308, f64::MAX] {
                let begin = DVec2::new(from.x, at.y);
                let near = world.cast_ray(begin, begin + DVec2::X * 8.0).unwrap();
                let hit = world.cast_ray(begin, begin + DVec2::X * far).unwrap();
                let off = hit.point.distance(near.point) + hit.normal.distance(near.normal);
                assert!(hit.id == id && off < 1e-9 && hit.fraction > 0.0, "{far}: {hit:?}");
            }
            assert_eq!(world.at_point(at), [id]);
            assert!(world.remove(hermit));
        }
    }
    // Corners that are none.
    let around = [from - DVec2::ONE, from + DVec2::splat(9.0)];
    assert_eq!(world.in_rectangle(around[0], around[1]).len(), 3);
    assert_eq!(world.in_rectangle(around[1], around[0]), []);
    assert_eq!(world.in_rectangle(DVec2::NAN, around[1]), []);
}

#[test]
fn answers_are_those_of_looking_at_each_body() {
    for far in [DVec2::ZERO, DVec2::new(-3e8, 7e8)] {
        let mut any = Any(7);
        let mut world = World::whole(&blueprint(4, 3, far)).unwrap();
        fill(&mut world, &mut any, far);
        let (mut hits, mut found) = (0, 0);
        for round in 0..8 {
            let all = outlines(&world);
            for number in 0..3400 {
                let (from, mut to) = (far + any.place(), far + any.place());
                match number % 4 {
                    0 => to.x = from.x,
                    1 => to.y = from.y,
                    2 => to = from + (to - from) * 0.05,
                    _ => {}
                }
                let expected = all.iter().filter_map(|outline| outline.cast_ray(from, to)).reduce(RayHit::nearer);
                assert_eq!(world.cast_ray(from, to), expected, "{from} {to}");
                hits += usize::from(expected.is_some());
                let odd = all.iter().filter(|outline| outline.id.0 % 2 == 1);
                let expected = odd.filter_map(|outline| outline.cast_ray(from, to)).reduce(RayHit::nearer);
                assert_eq!(world.cast_ray_among(from, to, |body| body.id.0 % 2 == 1), expected);
                let (low, high) = (from.min(to), from.min(to) + (from.max(to) - from.min(to)) * 0.1);
                let names = |is_meant: &dyn Fn(&Outline) -> bool| {
                    let mut names: Vec<_> = all.iter().filter(|outline| is_meant(outline)).map(|o| o.id).collect();
                    names.sort_unstable();
                    names
                };
                let expected = names(&|outline| outline.meets_rectangle(low, high));
                assert_eq!(world.in_rectangle(low, high), expected);
                found += expected.len();
                assert_eq!(world.at_point(from), names(&|outline| outline.holds(from)));
            }
            let everywhere = world.in_rectangle(DVec2::NEG_INFINITY, DVec2::INFINITY);
            assert_eq!(everywhere.len(), all.len());
            drop(all);
            // What changed is seen, at once.
            match round {
                0 => drop(step(&mut world, &mut Loopback).unwrap()),
                1 => drop((10..300).map(|id| world.remove(GlobalId(id))).collect::<Vec<_>>()),
                // Nobody else is elsewhere for it, though those of a tile have other places in it.
                2 => world.settle(),
                3 => {
                    let place = far + DVec2::new(20.0, 10.0);
                    world.add(Body::at_rest(GlobalId(5000), KindId(3), place)).unwrap();
                    assert!(world.at_point(place).contains(&GlobalId(5000)));
                }
                // What moves is elsewhere then.
                5 => world.resume_at(world.step_count() + 40),
                // Rows of statics' kinds move on.
                4 => drop(world.add_kind(&circle(0.2)).unwrap()),
                _ => drop(world.command(&Command::SetKind { id: GlobalId(700), kind: KindId(3) }).unwrap()),
            }
        }
        assert!(hits > 8000 && found > 17_000, "{hits} hits, {found} found");
    }
}

#[test]
fn pairs_that_touch_are_those_that_each_body_tells_of() {
    for (columns, rows) in [(1, 1), (4, 3)] {
        let mut world = World::whole(&blueprint(columns, rows, DVec2::ZERO)).unwrap();
        fill(&mut world, &mut Any(5), DVec2::ZERO);
        let told = |world: &World| {
            let of = |body: Body| world.touching(body.id).into_iter().map(|contact| contact.bodies.into());
            let mut pairs: Vec<(GlobalId, GlobalId)> = world.bodies().flat_map(of).collect();
            pairs.sort_unstable();
            pairs.dedup();
            pairs
        };
        for _ in 0..2 {
            step(&mut world, &mut Loopback).unwrap();
        }
        let before = world.contact_pairs();
        assert!(before.len() > 300, "{} pairs", before.len());
        assert_eq!(before, told(&world));
        let is_gone = |&id: &GlobalId| (10..200).contains(&id.0);
        (10..200).for_each(|id| assert!(world.remove(GlobalId(id))));
        let now = world.contact_pairs();
        assert_eq!(now, told(&world));
        assert_eq!(pairs_not_in(&now, &before), []);
        let ended = pairs_not_in(&before, &now);
        assert!(!ended.is_empty() && ended.iter().all(|(a, b)| is_gone(a) || is_gone(b)));
        assert_eq!(ended.len() + now.len(), before.len());
    }
}

#[test]
fn parts_of_a_world_answer_together_as_the_whole() {
    let blueprint = blueprint(4, 1, DVec2::ZERO);
    let mut whole = World::whole(&blueprint).unwrap();
    fill(&mut whole, &mut Any(3), DVec2::ZERO);
    let halves = [[0, 2], [1, 3]].map(|tiles| {
        let mut half = World::new(&blueprint, &tiles.map(TileId)).unwrap();
        fill(&mut half, &mut Any(3), DVec2::ZERO);
        half
    });
    let mut any = Any(9);
    for _ in 0..2000 {
        let (from, to) = (any.place(), any.place());
        let joined = halves.iter().filter_map(|half| half.cast_ray(from, to)).reduce(RayHit::nearer);
        assert_eq!(joined, whole.cast_ray(from, to));
        let mut joined: Vec<_> = halves.iter().flat_map(|half| half.in_rectangle(from - 0.5, from + 0.5)).collect();
        joined.sort_unstable();
        joined.dedup();
        assert_eq!(joined, whole.in_rectangle(from - 0.5, from + 0.5));
    }
}

#[test]
fn a_ray_that_begins_inside_hits_at_once_and_one_that_ends_before_does_not() {
    let mut world = World::whole(&blueprint(1, 1, DVec2::ZERO)).unwrap();
    assert_eq!(world.cast_ray(DVec2::new(5.0, 5.0), DVec2::new(6.0, 5.0)), None);
    world.add(Body::at_rest(GlobalId(7), KindId(3), DVec2::new(10.0, 5.0))).unwrap();
    let hit = world.cast_ray(DVec2::new(5.0, 5.0), DVec2::new(15.0, 5.0)).unwrap();
    assert_eq!((hit.id, hit.point, hit.normal), (GlobalId(7), DVec2::new(8.0, 5.0), DVec2::NEG_X));
    assert!((hit.fraction - 0.3).abs() < 1e-15);
    assert_eq!(world.cast_ray(DVec2::new(5.0, 5.0), DVec2::new(7.99, 5.0)), None);
    // Past it, along its border, and no way at all.
    assert_eq!(world.cast_ray(DVec2::new(13.0, 5.0), DVec2::new(20.0, 5.0)), None);
    let inside = world.cast_ray(DVec2::new(10.5, 5.0), DVec2::new(10.5, 5.0)).unwrap();
    assert_eq!((inside.id, inside.fraction, inside.normal), (GlobalId(7), 0.0, DVec2::ZERO));
    assert_eq!(world.cast_ray(DVec2::new(12.5, 5.0), DVec2::new(12.5, 5.0)), None);
    assert_eq!(world.cast_ray(DVec2::new(10.0, 9.0), DVec2::new(10.0, f64::NEG_INFINITY)), None);
    assert!(World::whole(&blueprint(1, 1, DVec2::ZERO)).unwrap().in_rectangle(DVec2::ZERO, DVec2::ONE).len() < 3);
}

proptest! {
    #![proptest_config(cases(300))]

    /// Whoever looks along a ray point by point finds the same.
    #[test]
    fn a_ray_meets_a_shape_where_the_shape_begins(
        parts in prop::collection::vec((any_convex(0.1, 2.0), any_rotation(), -1.0_f32..1.0, -1.0_f32..1.0), 1..4),
        rotation in any_rotation(),
        from in (-4.0..4.0, -4.0..4.0),
        to in (-4.0..4.0, -4.0..4.0),
    ) {
        let part = |(kind, rotation, x, y): &(Kind, Rot, f32, f32)| {
            Part { shape: kind.shape.clone(), position: Vec2::new(*x, *y), rotation: *rotation }
        };
        let kind = match &parts[..] {
            [(alone, ..)] => alone.clone(),
            several => Kind { shape: Shape::compound(several.iter().map(part).collect()).unwrap(), ..parts[0].0.clone() },
        };
        let (from, to) = (DVec2::from(from), DVec2::from(to));
        let body = Body { rotation, ..Body::at_rest(GlobalId(0), KindId(0), DVec2::ZERO) };
        let kind = KindRow::fixed(&kind).unwrap();
        let outline = Outline::new(&body, &kind);
        const LOOKS: u32 = 2000;
        let begins = (0..=LOOKS).map(|k| f64::from(k) / f64::from(LOOKS)).find(|&part| outline.holds(from.lerp(to, part)));
        match outline.cast_ray(from, to) {
            Some(hit) => {
                let about = 1e-4 / from.distance(to);
                prop_assert!(begins.is_none_or(|begins| hit.fraction <= begins + about), "{hit:?}, {begins:?}");
                let near = DVec2::splat(1e-4);
                prop_assert!(outline.meets_rectangle(hit.point - near, hit.point + near), "{hit:?} is beside it");
            }
            None => prop_assert_eq!(begins, None),
        }
    }
}
