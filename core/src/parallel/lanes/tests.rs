//! Lanes do what plain numbers do: operation by operation, and in whole steps.

use super::*;
use crate::Loopback;
use crate::model::body::{Body, StaticBody};
use crate::model::id::{GlobalId, KindId, TileId};
use crate::model::math::{self, Rot};
use crate::model::params::{Exchange, Instructions, Params, Solver};
use crate::testing::{circle, rectangle};
use crate::tiling::blueprint::Blueprint;
use crate::tiling::partition::Partition;
use crate::world::World;
use glam::{DVec2, Vec2};
use std::hint::black_box;

/// What came of an operation, by its name: a row, or a column of quads.
type Results = Vec<(&'static str, Row)>;

/// Every operation there is.
struct Everything<'a> {
    a: &'a Row,
    b: &'a Row,
    quads: &'a [Quad],
    index: &'a [u32; LANES],
}

impl Kernel for Everything<'_> {
    type Output = Results;
    #[inline(always)]
    fn run<V: Lanes>(self) -> Results {
        let (a, b) = (V::load(self.a), V::load(self.b));
        let mut results: Results = Vec::new();
        let mut note = |name, value: V| {
            let mut row = [0.0; LANES];
            value.store(&mut row);
            results.push((name, row));
        };
        note("load", a);
        note("splat", V::splat(self.a[2]));
        note("add", a.add(b));
        note("sub", a.sub(b));
        note("mul", a.mul(b));
        note("div", a.div(b));
        note("sqrt", a.sqrt());
        note("max", a.max(b));
        note("min", a.min(b));
        note("if_positive", a.if_positive(b, a));
        let mut quads = self.quads.to_vec();
        let cells = Cell::from_mut(&mut quads[..]).as_slice_of_cells();
        let columns = V::gather(cells, self.index);
        columns.into_iter().for_each(|column| note("gather", column));
        V::gather_fixed(self.quads, self.index).into_iter().for_each(|column| note("gather_fixed", column));
        let [p, q, r, s] = V::load_quads(self.quads[..LANES].try_into().unwrap());
        [p, q, r, s].into_iter().for_each(|column| note("load_quads", column));
        V::scatter([q, p, s, r], cells, self.index);
        let mut block = [[0.0; 4]; LANES];
        V::store_quads([s, r, q, p], &mut block);
        for column in 0..4 {
            results.push(("scatter", std::array::from_fn(|l| quads[self.index[l] as usize][column])));
            results.push(("store_quads", block.map(|quad| quad[column])));
        }
        let pairs: [Pair; LANES] = std::array::from_fn(|l| [self.a[l], self.b[l]]);
        let [first, second] = V::load_pairs(&pairs);
        let mut block = [[0.0; 2]; LANES];
        V::store_pairs([second, first], &mut block);
        let mut places: [Place; LANES] = std::array::from_fn(|l| [0.1 * l as f64, 1e9 + self.quads[l][1] as f64]);
        let [x, y] = V::seen_from([0.3, 1e9], &places);
        V::advance([p, q], &mut places);
        let within = V::are_within(&places, [0.0, 1e9], [self.quads[7][0] as f64 + 0.8, 2e9]);
        let far = V::are_within(&places, [0.0, 1e9], [self.quads[7][0] as f64 + 0.7, 2e9]);
        let below = [a.all_below(2.0), p.all_below(8.5), p.all_below(8.0)];
        [first, second, x, y].into_iter().zip(["load_pairs", "load_pairs", "seen_from", "seen_from"]).for_each(
            |(value, name)| {
                let mut row = [0.0; LANES];
                value.store(&mut row);
                results.push((name, row));
            },
        );
        results.extend((0..2).map(|c| ("store_pairs", block.map(|pair| pair[c]))));
        results.extend((0..2).map(|c| ("advance", places.map(|place| (place[c] - [0.0, 1e9][c]) as f32))));
        let told = [within, far, below[0], below[1], below[2], false, false, false];
        results.push(("are_within, all_below", told.map(|is| if is { 1.0 } else { 0.0 })));
        both::<V::Wide>(&self, &mut results);
        results
    }
}

/// Two rows as one.
fn joined<T: Copy + Default>(low: &[T; LANES], high: &[T; LANES]) -> [T; WIDE] {
    let mut joined = [T::default(); WIDE];
    joined[..LANES].copy_from_slice(low);
    joined[LANES..].copy_from_slice(high);
    joined
}

/// Every operation of sixteen lanes: of `a` and `b`, and the other way round.
#[inline(always)]
fn both<W: Wide>(of: &Everything<'_>, results: &mut Results) {
    let (a, b) = (W::load(&joined(of.a, of.b)), W::load(&joined(of.b, of.a)));
    let mut note = |name, value: W| {
        let mut row = [0.0; WIDE];
        value.store(&mut row);
        results.extend(row.as_chunks().0.iter().map(|half| (name, *half)));
    };
    note("wide add", a.add(b));
    note("wide sub", a.sub(b));
    note("wide mul", a.mul(b));
    note("wide div", a.div(b));
    note("wide sqrt", a.sqrt());
    note("wide max", a.max(b));
    note("wide min", a.min(b));
    note("wide if_positive", a.if_positive(b, a));
    note("wide splat", W::splat(of.a[2]));
    // The quads twice over, each named once at most.
    let mut quads: Vec<Quad> = of.quads.iter().chain(of.quads).copied().collect();
    let length = of.quads.len() as u32;
    let index = joined(of.index, &of.index.map(|i| length + i));
    let sixteen: [Quad; WIDE] = std::array::from_fn(|l| quads[index[l] as usize]);
    W::load_quads(&sixteen).into_iter().for_each(|column| note("wide load_quads", column));
    let cells = Cell::from_mut(&mut quads[..]).as_slice_of_cells();
    let [p, q, r, s] = W::gather(cells, &index);
    [p, q, r, s].into_iter().for_each(|column| note("wide gather", column));
    W::scatter([q, p, s, r], cells, &index);
    let halves = index.as_chunks::<LANES>().0;
    let scattered = (0..4).flat_map(|column| halves.iter().map(move |half| (half, column)));
    results.extend(scattered.map(|(half, column)| ("wide scatter", half.map(|i| quads[i as usize][column]))));
    let mut stored = sixteen;
    W::store_quads([q, p, s, r], &mut stored);
    for column in 0..4 {
        results.extend(
            stored.as_chunks().0.iter().map(|half: &[Quad; LANES]| ("wide store_quads", half.map(|quad| quad[column]))),
        );
    }
    let last = std::array::from_fn(|l| if l + 1 == WIDE { f32::MIN_POSITIVE } else { -1.0 });
    let told = [W::splat(0.0), W::splat(f32::NAN), W::splat(-1.0), W::load(&last), W::splat(1.0)].map(W::any_positive);
    results.push(("any_positive", std::array::from_fn(|l| if told.get(l) == Some(&true) { 1.0 } else { 0.0 })));
}

/// The same on plain numbers.
fn expected(Everything { a, b, quads, index }: Everything<'_>) -> Results {
    let each = |f: fn(f32, f32) -> f32| -> Row { std::array::from_fn(|l| f(black_box(a[l]), black_box(b[l]))) };
    let mut results = vec![
        ("load", *a),
        ("splat", [a[2]; LANES]),
        ("add", each(|a, b| a + b)),
        ("sub", each(|a, b| a - b)),
        ("mul", each(|a, b| a * b)),
        ("div", each(|a, b| a / b)),
        ("sqrt", each(|a, _| a.sqrt())),
        ("max", each(math::max)),
        ("min", each(math::min)),
        ("if_positive", each(|a, b| if a > 0.0 { b } else { a })),
    ];
    let column = |of: &dyn Fn(usize) -> Quad, column: usize| -> Row { std::array::from_fn(|l| of(l)[column]) };
    results.extend((0..4).map(|c| ("gather", column(&|l| quads[index[l] as usize], c))));
    results.extend((0..4).map(|c| ("gather_fixed", column(&|l| quads[index[l] as usize], c))));
    results.extend((0..4).map(|c| ("load_quads", column(&|l| quads[l], c))));
    for c in 0..4 {
        results.push(("scatter", column(&|l| quads[l], [1, 0, 3, 2][c])));
        results.push(("store_quads", column(&|l| quads[l], [3, 2, 1, 0][c])));
    }
    results.extend([("load_pairs", *a), ("load_pairs", *b)]);
    let y = |l: usize| 1e9 + f64::from(quads[l][1]);
    results.push(("seen_from", std::array::from_fn(|l| (0.1 * l as f64 - 0.3) as f32)));
    results.push(("seen_from", std::array::from_fn(|l| (y(l) - 1e9) as f32)));
    results.extend([("store_pairs", *b), ("store_pairs", *a)]);
    results.push(("advance", std::array::from_fn(|l| (0.1 * l as f64 + f64::from(quads[l][0])) as f32)));
    results.push(("advance", std::array::from_fn(|l| (y(l) + f64::from(quads[l][1]) - 1e9) as f32)));
    results.push(("are_within, all_below", [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]));
    let two = |name, f: fn(f32, f32) -> f32| -> Results {
        let other: Row = std::array::from_fn(|l| f(black_box(b[l]), black_box(a[l])));
        vec![(name, each(f)), (name, other)]
    };
    results.extend(two("wide add", |a, b| a + b));
    results.extend(two("wide sub", |a, b| a - b));
    results.extend(two("wide mul", |a, b| a * b));
    results.extend(two("wide div", |a, b| a / b));
    results.extend(two("wide sqrt", |a, _| a.sqrt()));
    results.extend(two("wide max", math::max));
    results.extend(two("wide min", math::min));
    results.extend(two("wide if_positive", |a, b| if a > 0.0 { b } else { a }));
    results.extend([("wide splat", [a[2]; LANES]); 2]);
    let swapped = [1, 0, 3, 2];
    for (name, order) in [
        ("wide load_quads", [0, 1, 2, 3]),
        ("wide gather", [0, 1, 2, 3]),
        ("wide scatter", swapped),
        ("wide store_quads", swapped),
    ] {
        for c in order {
            results.extend([(name, column(&|l| quads[index[l] as usize], c)); 2]);
        }
    }
    results.push(("any_positive", [0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]));
    results
}

fn compare(results: Results, expected: &Results, lanes: &str) {
    assert_eq!(results.len(), expected.len());
    for ((name, row), (same, right)) in results.into_iter().zip(expected) {
        assert_eq!(name, *same);
        for lane in 0..LANES {
            assert!(
                row[lane].to_bits() == right[lane].to_bits(),
                "`{name}` of the {lanes} lanes gives {:?} in lane {lane}, where plain numbers give {:?}: mend it in \
                 core/src/parallel/lanes/. Every lane does what plain f32 does, bit for bit; so machines agree.",
                row[lane],
                right[lane]
            );
        }
    }
}

#[test]
fn every_operation_does_in_each_lane_what_plain_numbers_do() {
    // Hidden from the compiler: the sign it gives to 0/0 when it folds it is not the processor's.
    let a = black_box([0.0, -0.0, 1.5, -2.25, 3.0e-39, 1.0e30, -7.0, f32::INFINITY]);
    let b = black_box([-0.0, 0.0, -1.5, 2.25, 1.0e-39, 3.0e30, 0.1, 2.0]);
    let quads: Vec<Quad> = (1..11).map(|i| [i as f32, 0.1 * i as f32, -(i as f32), 1.0 / i as f32]).collect();
    let all = || Everything { a: &a, b: &b, quads: &quads, index: &[7, 0, 3, 9, 1, 8, 2, 5] };
    let right = expected(all());
    compare(all().run::<Portable>(), &right, "portable");
    for instructions in [Instructions::Auto, Instructions::Avx2] {
        if let Some(lanes) = LaneSet::of(instructions) {
            compare(lanes.run(all()), &right, instructions.name());
        }
    }
}

/// A heap of discs and boxes that bounce, over four tiles.
fn heap(solver: Solver, exchange: Exchange, instructions: Instructions) -> World {
    let partition = Partition::uniform(DVec2::ZERO, DVec2::splat(8.0), 2, 2).unwrap();
    let mut kinds = vec![circle(0.2), rectangle(0.5, 0.3), rectangle(0.3, 0.4)];
    kinds.iter_mut().for_each(|kind| kind.material.restitution = 0.4);
    let wall = |id, x, y, width, height| StaticBody {
        id: GlobalId(id),
        position: DVec2::new(x, y),
        rotation: Rot::from_angle(0.02),
        kind: rectangle(width, height),
        path: None,
    };
    let statics = vec![wall(0, 4.0, 0.0, 9.0, 0.4), wall(1, 0.0, 4.0, 0.4, 9.0), wall(2, 8.0, 4.0, 0.4, 9.0)];
    let params =
        Params { solver, exchange, instructions, max_linear_speed: 9.0, max_angular_speed: 7.0, ..Params::default() };
    let tiles: Vec<TileId> = (0..4).map(TileId).collect();
    let mut world = World::new(&Blueprint { params, partition, kinds, statics }, &tiles).unwrap();
    for i in 0..120_u32 {
        let (x, y) = (f64::from(i % 12), f64::from(i / 12));
        let body = Body {
            id: GlobalId(u64::from(i) + 3),
            position: DVec2::new(1.0 + 0.53 * x + 0.01 * y, 0.6 + 0.51 * y),
            rotation: Rot::from_angle(0.3 * i as f32),
            velocity: Vec2::new((i % 7) as f32 - 3.0, -((i % 5) as f32)),
            angular_velocity: (i % 3) as f32 - 1.0,
            kind: KindId(i % 3),
        };
        world.add(body).unwrap();
    }
    world
}

#[test]
fn whole_steps_on_portable_lanes_give_the_same_bits() {
    for solver in [Solver::SoftStep, Solver::Pgs] {
        for exchange in [Exchange::Step, Exchange::Substep] {
            let run = |world: &mut World| {
                let report = crate::step(world, &mut Loopback).unwrap();
                (world.hashes(), report.contacts)
            };
            let mut widest = heap(solver, exchange, Instructions::Auto);
            let mut portable = heap(solver, exchange, Instructions::Portable);
            let mut contacts = 0;
            for step in 0..60 {
                let (expected, found) = (run(&mut widest), run(&mut portable));
                contacts += expected.1;
                assert!(
                    expected == found,
                    "{solver:?}, exchange {exchange:?}: in step {step} portable lanes and this processor's widest come to \
                     different bits. If the test of every operation passes, some kernel computes with something else \
                     than `Lanes`: make it one of their operations, in both."
                );
            }
            assert!(contacts > 1000, "hardly anything to solve: {contacts}");
        }
    }
}
