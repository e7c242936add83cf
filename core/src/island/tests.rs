//! Union-find against a search that walks.

use super::{IslandSizes, Islands, UnionFind};
use crate::body::{Body, StaticBody};
use crate::contact::SlotKind;
use crate::id::{GlobalId, KindId, TileId};
use crate::math::Rot;
use crate::params::{Exchange, Params};
use crate::partition::TileGrid;
use crate::setup::Blueprint;
use crate::testing::{Loopback, cases, circle, rectangle};
use crate::tile::Tile;
use crate::world::World;
use crate::{StepReport, step};
use glam::{DVec2, Vec2};
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// For every number the lowest one that a walk along the links leads to.
fn depth_first(count: usize, links: &[(u32, u32)]) -> Vec<u32> {
    let mut neighbours = vec![Vec::new(); count];
    for &(a, b) in links {
        neighbours[a as usize].push(b);
        neighbours[b as usize].push(a);
    }
    let mut lowest = vec![u32::MAX; count];
    for start in 0..count as u32 {
        let mut stack = vec![start];
        while let Some(at) = stack.pop() {
            if lowest[at as usize] == u32::MAX {
                lowest[at as usize] = start;
                stack.extend_from_slice(&neighbours[at as usize]);
            }
        }
    }
    lowest
}

fn sizes(lowest: &[u32]) -> IslandSizes {
    let mut members = BTreeMap::<u32, u64>::new();
    for &root in lowest {
        *members.entry(root).or_default() += 1;
    }
    IslandSizes { islands: members.len() as u64, largest: members.values().copied().max().unwrap_or(0) }
}

fn check(count: usize, links: &[(u32, u32)]) -> IslandSizes {
    let expected = depth_first(count, links);
    let mut sets = UnionFind::default();
    sets.reset(count);
    for &(a, b) in links {
        sets.union(a, b);
    }
    let found: Vec<_> = (0..count as u32).map(|i| sets.find(i)).collect();
    assert_eq!(found, expected);
    let islands = Islands::default().find(count, links.iter().copied());
    assert_eq!(islands, sizes(&expected));
    islands
}

fn any_graph() -> impl Strategy<Value = (usize, Vec<(u32, u32)>)> {
    (1_usize..300).prop_flat_map(|count| {
        let node = 0..count as u32;
        let link = (node.clone(), node);
        (Just(count), prop::collection::vec(link, 0..2 * count))
    })
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn random_graphs((count, mut links) in any_graph()) {
        let forward = check(count, &links);
        links.reverse();
        prop_assert_eq!(check(count, &links), forward, "the order of the links shows");
    }
}

#[test]
fn simple_graphs() {
    let islands = |islands, largest| IslandSizes { islands, largest };
    assert_eq!(check(0, &[]), islands(0, 0));
    assert_eq!(check(3, &[]), islands(3, 1));
    assert_eq!(check(4, &[(3, 3), (1, 2), (2, 1)]), islands(3, 2));
    // The longest path there can be, in the worst order, and a star.
    let path: Vec<_> = (0..9_999).rev().map(|i| (i, i + 1)).collect();
    assert_eq!(check(10_000, &path), islands(1, 10_000));
    let star: Vec<_> = (0..9_999).map(|i| (9_999, i)).collect();
    assert_eq!(check(10_000, &star), islands(1, 10_000));
    // What one search leaves behind does not show in the next, smaller one.
    let mut reused = Islands::default();
    reused.find(10_000, path.into_iter());
    assert_eq!(reused.find(2, std::iter::empty()), islands(2, 1));
}

/// Columns of bodies that fall onto a floor, on 2 x 2 tiles.
fn pile() -> World {
    let grid = TileGrid::new(DVec2::ZERO, DVec2::new(6.0, 3.0), 2, 2).unwrap();
    let floor = StaticBody {
        id: GlobalId(0),
        position: DVec2::new(3.0, -0.5),
        rotation: Rot::IDENTITY,
        kind: rectangle(20.0, 1.0),
    };
    let params = Params { gravity: Vec2::new(0.0, -10.0), exchange: Exchange::Substep, ..Params::default() };
    let kinds = vec![circle(0.2), rectangle(0.2, 0.2)];
    let mut world =
        World::new(&Blueprint { params, grid, kinds, statics: vec![floor] }, &[0, 1, 2, 3].map(TileId)).unwrap();
    for i in 0..72_u32 {
        let (column, row) = (i % 12, i / 12);
        // Columns of unequal spacing: some lean on each other, some do not.
        let x = 0.3 + 0.38 * f64::from(column) + 0.14 * f64::from(column / 3) + 0.02 * f64::from(i % 5);
        world
            .add(Body {
                id: GlobalId(1 + u64::from(i)),
                position: DVec2::new(x, 0.25 + 0.45 * f64::from(row)),
                rotation: Rot::IDENTITY,
                velocity: Vec2::ZERO,
                angular_velocity: 0.0,
                kind: KindId(i % 3 % 2),
            })
            .unwrap();
    }
    world
}

/// The islands of a tile from its contacts: bodies, owned or ghosts, that touch anything.
fn of_tile(tile: &Tile) -> IslandSizes {
    let index = |kind| match kind {
        SlotKind::Owned(i) => Some(i as u32),
        SlotKind::Ghost(g) => Some((tile.owned + g) as u32),
        SlotKind::Static(_) => None,
    };
    let mut touching = BTreeSet::new();
    let mut links = Vec::new();
    for (key, _) in tile.contacts.iter() {
        let ends = [index(key.low().kind()), index(key.high().kind())];
        touching.extend(ends.into_iter().flatten());
        if let [Some(a), Some(b)] = ends {
            links.push((a, b));
        }
    }
    let place = |body: u32| touching.range(..body).count() as u32;
    let links: Vec<_> = links.into_iter().map(|(a, b)| (place(a), place(b))).collect();
    check(touching.len(), &links)
}

#[test]
fn the_islands_of_a_pile() {
    let mut world = pile();
    let mut most = 0;
    for _ in 0..60 {
        let report = step(&mut world, &mut Loopback).unwrap();
        let mut expected = StepReport::default();
        for islands in world.tile_states().iter().map(of_tile) {
            expected.islands += islands.islands;
            expected.largest_island = expected.largest_island.max(islands.largest);
        }
        assert_eq!((report.islands, report.largest_island), (expected.islands, expected.largest_island));
        most = most.max(report.largest_island);
        assert!(report.step < 59 || report.islands >= 4, "the pile should hold several islands, {report:?}");
    }
    assert!(most >= 10, "the pile should hold one of ten bodies, the largest has {most}");
}
