//! Owners and regions against each other and against trying every tile.

use super::{Adaptive, Bisector, Load, Partition, Region, Surroundings, Tally};
use crate::model::error::SetupError;
use crate::model::id::TileId;
use crate::testing::cases;
use glam::{DVec2, Vec2};
use proptest::prelude::*;

/// The levels of a forest, in which squares are cut as a list of choices has it.
fn levels(roots: usize, choices: &[bool]) -> Vec<u8> {
    fn grow(level: u8, choices: &mut impl Iterator<Item = bool>, levels: &mut Vec<u8>) {
        if level < 6 && choices.next() == Some(true) {
            (0..4).for_each(|_| grow(level + 1, choices, levels));
        } else {
            levels.push(level);
        }
    }
    let (mut levels, mut choices) = (Vec::new(), choices.iter().copied());
    (0..roots).for_each(|_| grow(0, &mut choices, &mut levels));
    levels
}

fn any_uniform(most: u32) -> impl Strategy<Value = Partition> {
    let low = prop_oneof![Just(0.0), -1e3..1e3, -1e9..1e9];
    let size = (-2.0_f64..6.0).prop_map(|exponent| 10.0_f64.powf(exponent));
    (low.clone(), low, size.clone(), size, 1..=most, 1..=most).prop_filter_map(
        "tiles without a width",
        |(x, y, width, height, columns, rows)| {
            let min = DVec2::new(x, y);
            Partition::uniform(min, min + DVec2::new(width, height), columns, rows).ok()
        },
    )
}

fn any_partition() -> impl Strategy<Value = Partition> {
    let choices = prop::collection::vec(any::<bool>(), 1..200);
    let forest = (any_uniform(3), choices).prop_filter_map("tiles without a width", |(squares, choices)| {
        let [columns, rows] = squares.roots();
        let levels = levels(squares.tiles(), &choices);
        Partition::forest(squares.min(), squares.max(), columns, rows, &levels).ok()
    });
    prop_oneof![any_uniform(40), forest, any_bisection()]
}

/// A bisection made for bodies that lie anywhere, or all in one place.
fn any_bisection() -> impl Strategy<Value = Partition> {
    let places = prop::collection::vec((0.0_f64..1.0, 0.0_f64..1.0, 1_u64..50), 0..60);
    (any_uniform(1), 1_u32..90, places, any::<bool>()).prop_filter_map(
        "tiles without a width",
        |(all, tiles, places, one)| {
            let (low, size) = (all.min(), all.max() - all.min());
            let place = |(x, y, bodies)| (low + size * if one { DVec2::splat(0.3) } else { DVec2::new(x, y) }, bodies);
            Partition::bisected(low, all.max(), tiles, 0.0, places.into_iter().map(place)).ok()
        },
    )
}

fn tiles(partition: &Partition) -> impl Iterator<Item = TileId> + use<> {
    (0..partition.tiles() as u32).map(TileId)
}

/// One coordinate: anywhere, outside, or exactly upon or right beside one of the edges.
fn coordinate(edges: &[f64], pick: prop::sample::Index, part: f64, how: u8) -> f64 {
    let (low, high) = (edges[0], edges[edges.len() - 1]);
    let edge = *pick.get(edges);
    match how {
        0 => edge,
        1 => edge.next_up(),
        2 => edge.next_down(),
        3 => low + (high - low) * (3.0 * part - 1.0),
        _ => low + (high - low) * part,
    }
}

fn any_point_in(partition: Partition) -> impl Strategy<Value = (Partition, DVec2)> {
    let axis = (any::<prop::sample::Index>(), 0.0..1.0, 0_u8..8);
    (axis.clone(), axis).prop_map(move |((px, x, how_x), (py, y, how_y))| {
        let edges = |axis: fn(DVec2) -> f64| {
            let rectangles = tiles(&partition).map(|tile| partition.rectangle(tile));
            let mut edges: Vec<f64> = rectangles.flat_map(|Region { min, max }| [axis(min), axis(max)]).collect();
            edges.sort_unstable_by(f64::total_cmp);
            edges.dedup();
            edges
        };
        let (columns, rows) = (edges(|point| point.x), edges(|point| point.y));
        (partition.clone(), DVec2::new(coordinate(&columns, px, x, how_x), coordinate(&rows, py, y, how_y)))
    })
}

proptest! {
    #![proptest_config(cases(512))]

    #[test]
    fn every_point_belongs_to_the_tile_that_contains_it(
        (partition, point) in any_partition().prop_flat_map(any_point_in)
    ) {
        let owner = partition.locate(point);
        let containing: Vec<_> = tiles(&partition).filter(|&tile| partition.region(tile).contains(point)).collect();
        prop_assert_eq!(containing, vec![owner]);
        prop_assert_eq!(partition.region(owner).nearest(point), point);
        let elsewhere = partition.region(TileId(0)).nearest(point);
        prop_assert_eq!(partition.locate(elsewhere), TileId(0));
    }

    #[test]
    fn a_box_reaches_the_tiles_that_it_meets(
        (partition, point) in any_partition().prop_flat_map(any_point_in),
        half in (0.0_f32..1.0, 0.0_f32..1.0),
        reach in 0.0_f64..0.3,
    ) {
        // Some tiles wide.
        let size = partition.rectangle(TileId(0)).size();
        let half = Vec2::new(half.0, half.1) * size.as_vec2() * 3.0;
        let reach = reach * size.x;
        let grown = half.as_dvec2() + DVec2::splat(reach);
        let (low, high) = (point - grown, point + grown);
        let meets = |tile: &TileId| {
            let region = partition.region(*tile);
            low.x < region.max.x && high.x >= region.min.x && low.y < region.max.y && high.y >= region.min.y
        };
        let reached: Vec<_> = partition.reached(point, half, reach).collect();
        prop_assert_eq!(&reached, &tiles(&partition).filter(meets).collect::<Vec<_>>());
        prop_assert!(reached.contains(&partition.locate(point)));
        // And so has whoever has looked around from any tile.
        let mut around = Surroundings::default();
        for tile in tiles(&partition) {
            around.look_around(&partition, tile, 2.0 * size.min_element());
            prop_assert_eq!(&reached, &around.met(&partition, low, high).collect::<Vec<_>>());
        }
        prop_assert!(tiles(&partition).all(|tile| reached.contains(&tile) == partition.reaches(tile, point, half, reach)));
    }

    #[test]
    fn neighbours_share_an_edge_or_a_corner(partition in any_partition(), pick in any::<prop::sample::Index>()) {
        let tile = TileId(pick.index(partition.tiles()) as u32);
        let own = partition.rectangle(tile);
        let touches = |other: &TileId| {
            let other = partition.rectangle(*other);
            own.min.cmple(other.max).all() && other.min.cmple(own.max).all()
        };
        let expected: Vec<_> = tiles(&partition).filter(touches).collect();
        prop_assert_eq!(partition.around(tile).collect::<Vec<_>>(), &expected[..]);
        prop_assert!(tiles(&partition).all(|other| partition.are_neighbours(tile, other) == expected.contains(&other)));
    }

    /// Of one forest from another over the same squares.
    #[test]
    fn what_changes_takes_up_the_same_place(
        squares in any_uniform(3),
        choices in [prop::collection::vec(any::<bool>(), 1..90), prop::collection::vec(any::<bool>(), 1..90)],
    ) {
        let [columns, rows] = squares.roots();
        let forests = choices.map(|choices| {
            Partition::forest(squares.min(), squares.max(), columns, rows, &levels(squares.tiles(), &choices))
        });
        let [Ok(old), Ok(new)] = forests else { return Ok(()) };
        let changes = old.changes(&new).unwrap();
        let ends = changes.last().map(|last| (last.old.end as usize, last.new.end as usize));
        prop_assert_eq!(ends, Some((old.tiles(), new.tiles())));
        for change in changes {
            prop_assert!(change.old.len() == 1 || change.new.len() == 1);
            let corners = |partition: &Partition, range: &std::ops::Range<u32>| {
                let first = partition.rectangle(TileId(range.start)).min;
                (first, partition.rectangle(TileId(range.end - 1)).max)
            };
            prop_assert_eq!(corners(&old, &change.old), corners(&new, &change.new));
        }
    }

    #[test]
    fn tiles_are_cut_where_many_are_and_joined_where_few_are(
        places in prop::collection::vec((0.0_f64..1.0, 0.0_f64..1.0), 0..600),
        skew in 1.0_f64..6.0,
        most in 1_u64..60,
    ) {
        let rule = Adaptive { max_bodies: most, least_side: 1e-2 };
        let place = |&(x, y): &(f64, f64)| DVec2::new(x.powf(skew), y.powf(skew));
        let count = |partition: &Partition| {
            let mut counts = vec![0; partition.tiles()];
            places.iter().for_each(|at| counts[partition.locate(place(at)).0 as usize] += 1);
            counts
        };
        let bodies = || places.iter().map(|at| (place(at), 1));
        let cut = Partition::adaptive(DVec2::ZERO, DVec2::ONE, [2, 1], &rule, bodies()).unwrap();
        let small = |tile: usize| cut.rectangle(TileId(tile as u32)).size().min_element() < 2e-2;
        prop_assert!(count(&cut).iter().enumerate().all(|(tile, &bodies)| bodies <= most || small(tile)));
        // A census of it changes nothing; with nobody left all is joined; and from there all is cut again.
        let census = |partition: &Partition, rule: &Adaptive, bodies: &[DVec2]| {
            let mut census = Vec::new();
            for tile in tiles(partition) {
                let own = bodies.iter().filter(|at| partition.locate(**at) == tile);
                let mut own: Vec<(DVec2, u64)> = own.map(|&at| (at, 1)).collect();
                let level = partition.levels().unwrap()[tile.0 as usize];
                rule.count(tile, level, partition.rectangle(tile), &mut own, &mut census);
            }
            census
        };
        let all: Vec<DVec2> = places.iter().map(place).collect();
        prop_assert_eq!(cut.adapted(&rule, &census(&cut, &rule, &all)).unwrap(), None);
        let empty = cut.adapted(&rule, &census(&cut, &rule, &[])).unwrap();
        let empty = empty.unwrap_or_else(|| cut.clone());
        prop_assert_eq!(empty.levels(), Some(&[0, 0][..]));
        let again = empty.adapted(&rule, &census(&empty, &rule, &all)).unwrap().unwrap_or(empty);
        prop_assert_eq!(&again, &cut);
        // What is no census of it is refused.
        let short = census(&cut, &rule, &all);
        prop_assert!(cut.adapted(&rule, &short[1..]).is_err());
    }
}

#[test]
fn levels_that_are_no_cut_are_refused() {
    let forest = |levels: &[u8]| Partition::forest(DVec2::ZERO, DVec2::ONE, 1, 1, levels);
    let z = [1, 1, 2, 2, 2, 2, 1];
    assert_eq!(forest(&z).unwrap().levels(), Some(&z[..]));
    let corners: Vec<_> =
        tiles(&forest(&z).unwrap()).map(|tile| forest(&z).unwrap().rectangle(tile).min.to_array()).collect();
    assert_eq!(corners, [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [0.25, 0.5], [0.0, 0.75], [0.25, 0.75], [0.5, 0.5]]);
    assert_eq!(forest(&z).unwrap().cell(TileId(3)), ([1, 2], [4, 4]));
    for (levels, tile) in [(&[][..], 0), (&[1, 1, 1], 3), (&[1, 1, 1, 1, 1], 4), (&[2, 1, 1, 1, 1], 1), (&[25; 4], 0)] {
        let error = forest(levels).unwrap_err();
        assert_eq!(error, SetupError::BadForest { tile: TileId(tile) }, "{levels:?}");
    }
    // Between two neighbouring numbers there is no middle.
    let far = DVec2::splat(1e16);
    assert!(Partition::forest(far, far + 2.0, 1, 1, &[1; 4]).is_err());
}

#[test]
fn what_is_no_point_belongs_to_some_tile_all_the_same() {
    let partition = Partition::uniform(DVec2::ZERO, DVec2::new(4.0, 3.0), 4, 3).unwrap();
    let (inf, nan) = (f64::INFINITY, f64::NAN);
    for (x, y, tile) in [
        (inf, inf, 11),
        (-inf, -inf, 0),
        (-inf, inf, 8),
        (inf, 1.5, 7),
        (f64::MAX, f64::MIN, 3),
        (nan, 1.5, 4),
        (2.5, nan, 2),
        (nan, nan, 0),
    ] {
        assert_eq!(partition.locate(DVec2::new(x, y)), TileId(tile), "({x}, {y})");
    }
    assert!(tiles(&partition).all(|tile| !partition.region(tile).contains(DVec2::new(nan, 1.0))));
    // Nor does a box without bounds break anything: it reaches everywhere.
    assert_eq!(partition.reached(DVec2::ONE, Vec2::splat(f32::INFINITY), 0.0).count(), 12);
}

#[test]
fn regions_are_half_open_and_share_their_edges() {
    let partition = Partition::uniform(DVec2::new(-1.0, 2.0), DVec2::new(1.1, 3.3), 7, 5).unwrap();
    for row in 0..5 {
        for column in 0..7 {
            let region = |column: u32, row: u32| partition.region(TileId(row * 7 + column));
            let own = region(column, row);
            let right = if column < 6 { region(column + 1, row).min.x } else { f64::INFINITY };
            let above = if row < 4 { region(column, row + 1).min.y } else { f64::INFINITY };
            assert_eq!((own.max.x, own.max.y), (right, above));
            if column > 0 && row > 0 {
                assert!(own.contains(own.min));
                assert_eq!(partition.rectangle(TileId(row * 7 + column)).min, own.min);
            }
        }
    }
    assert_eq!(partition.region(TileId(0)).min, DVec2::splat(f64::NEG_INFINITY));
    assert_eq!(partition.rectangle(TileId(0)).min, partition.min());
}

#[test]
fn grids_without_sense_are_refused() {
    let refused = |min: DVec2, max: DVec2, columns, rows| match Partition::uniform(min, max, columns, rows) {
        Err(error @ SetupError::BadGrid { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    };
    let (zero, one) = (DVec2::ZERO, DVec2::ONE);
    assert!(refused(zero, one, 0, 1).contains("at least one column"));
    assert!(refused(zero, one, 3, 0).contains("3 x 0 tiles"));
    assert!(refused(one, zero, 1, 1).contains("above its minimum"));
    assert!(refused(zero, DVec2::new(1.0, 0.0), 1, 1).contains("above its minimum"));
    assert!(refused(zero, DVec2::new(f64::NAN, 1.0), 1, 1).contains("finite"));
    assert!(refused(zero, DVec2::new(f64::INFINITY, 1.0), 1, 1).contains("finite"));
    assert!(refused(zero, one, u32::MAX, 2).contains("2^32"));
    // A million columns between two neighbouring numbers have no width.
    let far = DVec2::splat(1e15);
    assert!(refused(far, far + one, 1_000_000, 1).contains("width"));
}

/// A square with a dense corner: places of which no two have a coordinate in common.
fn corner() -> impl Iterator<Item = DVec2> {
    let spread = |count: u32, side: f64| {
        let place =
            move |k: u32| side * DVec2::new((f64::from(k) * 0.618_033_988_75).fract(), f64::from(k) / f64::from(count));
        (0..count).map(place)
    };
    spread(10_000, 0.3).chain(spread(2500, 1.0))
}

/// How many times the mean the tile with most to do has.
fn unevenness(partition: &Partition) -> f64 {
    let mut counts = vec![0_u32; partition.tiles()];
    corner().for_each(|place| counts[partition.locate(place).0 as usize] += 1);
    f64::from(counts.iter().copied().max().unwrap()) * counts.len() as f64 / 12_500.0
}

#[test]
fn tiles_that_are_bisected_have_as_much_to_do_each() {
    for tiles in [1, 2, 3, 7, 50, 144] {
        let partition =
            Partition::bisected(DVec2::ZERO, DVec2::ONE, tiles, 0.0, corner().map(|place| (place, 1))).unwrap();
        assert_eq!((partition.tiles(), partition.roots()), (tiles as usize, [tiles, 1]));
        assert!(unevenness(&partition) < 1.12, "{tiles}: {}", unevenness(&partition));
    }
}

/// What each tile has to do for the places of [`corner`], some of which are ghosts of others.
fn loads(partition: &Partition, halo: f64) -> Vec<Load> {
    let load = |tile| {
        let reached = |place: &DVec2| partition.reached(*place, Vec2::ZERO, halo).any(|other| other == tile);
        let mut owners: Vec<_> = corner().filter(reached).map(|place| partition.locate(place)).collect();
        let near = owners.len();
        owners.retain(|&owner| owner != tile);
        owners.sort_unstable();
        Load::new(partition.tiles(), tile, [near - owners.len(), 0, 0], &owners)
    };
    tiles(partition).map(load).collect()
}

/// What becomes of a partition by the places of [`corner`], counted by those of each tile, where anything does.
fn rebisected(partition: &Partition, halo: f64) -> Option<Partition> {
    let of_tile = |tile| corner().filter(move |&place| partition.locate(place) == tile);
    let tally = |tile| Tally::new(partition, of_tile(tile).map(|place| (place, 0)));
    let mut tallies: Vec<Tally> = tiles(partition).map(tally).collect();
    let mut bisecting = partition.bisect(&loads(partition, halo), halo).unwrap().unwrap();
    while !bisecting.is_done() {
        let counts = tallies.iter().rev().flat_map(|tally| bisecting.counts(tally)).flat_map(|(_, words)| words);
        let decisions = bisecting.decide(&counts.collect::<Vec<_>>()).unwrap();
        bisecting.cut(&decisions, &mut tallies).unwrap();
    }
    bisecting.partition().unwrap()
}

#[test]
fn what_comes_of_ghosts_is_shared_too() {
    let halo = 0.006;
    let all = |load: &Load| u64::from(load.own) + load.others.iter().copied().map(u64::from).sum::<u64>();
    let unevenness = |partition: &Partition| {
        let loads: Vec<u64> = loads(partition, halo).iter().map(all).collect();
        loads.iter().copied().max().unwrap() as f64 * loads.len() as f64 / loads.iter().sum::<u64>() as f64
    };
    // By bodies alone, those in the dense corner have more to do. What that is is known when it is done, so it takes some times.
    let mut partition = Partition::bisected(DVec2::ZERO, DVec2::ONE, 24, 0.0, corner().map(|at| (at, 1))).unwrap();
    let (before, mut moves) = (unevenness(&partition), 0);
    while let Some(next) = rebisected(&partition, halo) {
        (partition, moves) = (next, moves + 1);
        assert!(moves < 20);
    }
    assert!(before > 1.15 && unevenness(&partition) < 1.08, "{before} {}", unevenness(&partition));
    // Of those of a tile, what the first cut has cut off is told first.
    let loads = loads(&partition, halo);
    let told: Vec<bool> = loads.iter().map(|load| load.others[0] > 0).collect();
    assert!(told[..12].contains(&true) && told[12..].contains(&true) && told.contains(&false), "{told:?}");
}

#[test]
fn borders_move_to_where_there_is_much_to_do_and_stay_there() {
    let even = (0..400).map(|k| (DVec2::new(f64::from(k % 20) + 0.5, f64::from(k / 20) + 0.5) / 20.0, 1));
    let mut partition = Partition::bisected(DVec2::ZERO, DVec2::ONE, 12, 0.0, even).unwrap();
    assert!(unevenness(&partition) > 3.0);
    let mut moves = 0;
    while let Some(next) = rebisected(&partition, 0.0) {
        (partition, moves) = (next, moves + 1);
        assert!(moves < 4);
    }
    assert!(unevenness(&partition) < 1.12 && moves > 0, "{moves} {}", unevenness(&partition));
    let cuts = partition.cuts().unwrap().to_vec();
    assert_eq!(Partition::bisection(DVec2::ZERO, DVec2::ONE, &cuts).unwrap(), partition);
    // What is told of other tiles is refused, and so is what cannot be read, or cuts what is elsewhere.
    let load = |tile| Load::new(12, TileId(tile), [1, 0, 0], &[]);
    assert!(partition.bisect(&[load(12)], 0.0).is_err());
    let mut bisecting = partition.bisect(&[load(11)], 0.0).unwrap().unwrap();
    for words in [&[1, 0, 0, 0, 0][..], &[0, 0, 0, 0], &[0, 60, 5, 0, 0], &[0, 0, 1, 7, 7, 0, 0], &[0, 0, 0, 0, 0, 0]] {
        assert!(bisecting.decide(words).is_err(), "{words:?}");
    }
    let decided = |words: [u32; 3]| bytemuck::cast::<_, super::Decision>(words);
    assert!(bisecting.cut(&[decided([1, 0, 7])], &mut []).is_err());
    assert!(bisecting.cut(&[decided([0, 2, 7])], &mut []).is_err());
    assert!(bisecting.cut(&[decided([0, 1, 0])], &mut []).is_err());
    // Where nobody is, nothing is changed.
    while !bisecting.is_done() {
        bisecting.cut(&[], &mut []).unwrap();
    }
    assert_eq!(bisecting.partition().unwrap(), None);
}

#[test]
fn far_from_the_origin_tiles_keep_a_width_as_borders_move() {
    let bisected = |low: DVec2, tiles| {
        let even = (0..400).map(|k| (low + DVec2::new(f64::from(k % 20), f64::from(k / 20)), 1));
        Partition::bisected(low, low + 20.0, tiles, 0.0, even)
    };
    // From each domain all bodies lie far away, so that every cut goes as near to an edge as it may.
    for low in [DVec2::splat(1e8), DVec2::new(9e8, 0.0), DVec2::new(-1e8, 9e8)] {
        let mut partition = bisected(low, 64).unwrap();
        let spacing = low.abs().to_array().map(|far| far.next_up() - far);
        for _ in 0..8 {
            let Some(next) = rebisected(&partition, 0.85) else { break };
            partition = next;
            let wide = |tile| partition.rectangle(tile).size().cmpgt(500.0 * DVec2::from_array(spacing)).all();
            assert!(tiles(&partition).all(wide), "{low}");
        }
    }
    // More than there is room for are refused before any is cut.
    let refused = bisected(DVec2::splat(1e12), 1000).unwrap_err();
    assert!(matches!(refused, SetupError::BadGrid { columns: 1000, rows: 1, .. }), "{refused}");
    // But there are two axes to cut across.
    assert!(bisected(DVec2::new(1e12, 0.0), 1000).is_ok());
}

#[test]
fn cuts_must_lie_within_what_they_cut() {
    let cut = |axis, at| Bisector { axis, at };
    let refused = |cuts: &[Bisector]| match Partition::bisection(DVec2::ZERO, DVec2::ONE, cuts) {
        Err(SetupError::BadBisection { cut }) => cut,
        other => panic!("{other:?}"),
    };
    assert_eq!(refused(&[cut(0, 0)]), 0);
    assert_eq!(refused(&[cut(2, 7)]), 0);
    // Of three tiles one lies before the first cut; the second is of the other part.
    assert_eq!(refused(&[cut(0, 1 << 31), cut(0, 1 << 31)]), 1);
    assert!(Partition::bisection(DVec2::ZERO, DVec2::ONE, &[cut(0, 1 << 31), cut(0, (1 << 31) + 1)]).is_ok());
    assert!(Partition::bisection(DVec2::ZERO, DVec2::new(1.0, f64::NAN), &[]).is_err());
    // So near to each other that no number lies between.
    let (low, high) = (DVec2::splat(1e15), DVec2::splat(1e15 + 1.0));
    assert!(Partition::bisection(low, high, &[cut(0, 1), cut(0, 2)]).is_err());
}
