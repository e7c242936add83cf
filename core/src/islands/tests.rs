//! The searches against the definition, and against each other.

use super::parallel::ParallelUnionFind;
use super::{IslandSizes, Islands};
use crate::Loopback;
use crate::model::body::{Body, StaticBody};
use crate::model::contact::SlotKind;
use crate::model::id::{GlobalId, KindId, TileId};
use crate::model::math::Rot;
use crate::model::params::{Exchange, IslandSearch, Params};
use crate::parallel::team::Team;
use crate::testing::{cases, circle, rectangle};
use crate::tiling::blueprint::Blueprint;
use crate::tiling::partition::Partition;
use crate::tiling::tile::Tile;
use crate::world::World;
use crate::{StepReport, step};
use glam::{DVec2, Vec2};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, PoisonError};

/// Nodes, and links between them.
type Graph = (usize, Vec<[u32; 2]>);

/// Threads of the pool in which the searches are tried: more than a small machine has, so that they interrupt each other.
const THREADS: usize = 4;

fn pool() -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(THREADS).build().unwrap()
}

/// The roots of all nodes from the definition alone: each takes the lowest number its neighbours know, until nothing
/// changes.
fn spread(nodes: usize, links: &[[u32; 2]]) -> Vec<u32> {
    let mut roots: Vec<_> = (0..nodes as u32).collect();
    let mut changes = true;
    while changes {
        changes = false;
        // There and back, so that chains in either direction take two rounds.
        for &[a, b] in links.iter().chain(links.iter().rev()) {
            let lowest = roots[a as usize].min(roots[b as usize]);
            for node in [a, b] {
                changes |= roots[node as usize] != lowest;
                roots[node as usize] = lowest;
            }
        }
    }
    roots
}

fn sizes(roots: &[u32]) -> IslandSizes {
    let mut members = BTreeMap::<u32, u64>::new();
    for &root in roots {
        *members.entry(root).or_default() += 1;
    }
    IslandSizes { islands: members.len() as u64, largest: members.values().copied().max().unwrap_or(0) }
}

/// What every search, on one thread and on those of the pool, is tried with, the buffers used again and again.
struct Searches {
    pool: ThreadPool,
    islands: Islands,
    parallel: ParallelUnionFind,
    roots: Vec<u32>,
}

impl Searches {
    fn new() -> Self {
        Self { pool: pool(), islands: Islands::default(), parallel: ParallelUnionFind::default(), roots: Vec::new() }
    }

    /// Checks that all find the same islands, the parallel one also if its work is cut finer than is worth while.
    fn check(&mut self, nodes: usize, links: &[[u32; 2]]) -> IslandSizes {
        let Self { pool, islands, parallel, roots } = self;
        let expected = spread(nodes, links);
        let sizes = sizes(&expected);
        pool.install(|| {
            for team in [Team::ALONE, Team::of_pool()] {
                for search in [IslandSearch::UnionFind, IslandSearch::Dfs, IslandSearch::ParallelUnionFind] {
                    assert_eq!(islands.find(search, nodes, links, team), sizes, "{search:?} {team:?}");
                    assert_eq!(islands.roots(), expected, "{search:?} {team:?}");
                }
                for grain in [1, 7, 7, 7] {
                    assert_eq!(parallel.find(nodes, links, team, grain, roots), sizes, "{team:?} {grain}");
                    assert_eq!(*roots, expected, "{team:?} {grain}");
                }
            }
        });
        sizes
    }
}

/// Chains side by side, their links in the order that is worst for union by index.
fn chains(nodes: u32, strands: u32) -> Vec<[u32; 2]> {
    (strands..nodes).rev().map(|i| [i - strands, i]).collect()
}

/// Every node linked to one.
fn star(nodes: u32, middle: u32) -> Vec<[u32; 2]> {
    (0..nodes).filter(|&i| i != middle).map(|i| [middle, i]).collect()
}

fn any_graph() -> impl Strategy<Value = Graph> {
    let random = (1_usize..300).prop_flat_map(|nodes| {
        let node = 0..nodes as u32;
        let link = [node.clone(), node];
        (Just(nodes), prop::collection::vec(link, 0..2 * nodes))
    });
    let shuffled = |links: Vec<_>| Just(links).prop_shuffle();
    let chain = (1_u32..300, 1_u32..9).prop_flat_map(move |(nodes, strands)| {
        let links = chains(nodes, strands);
        (Just(nodes as usize), prop_oneof![Just(links.clone()), shuffled(links)])
    });
    let hub = (1_u32..300, any::<prop::sample::Index>()).prop_flat_map(move |(nodes, middle)| {
        (Just(nodes as usize), shuffled(star(nodes, middle.index(nodes as usize) as u32)))
    });
    let single = (0_usize..50).prop_map(|nodes| (nodes, Vec::new()));
    prop_oneof![4 => random, 2 => chain, 1 => hub, 1 => single]
}

#[test]
fn random_graphs() {
    let searches = Mutex::new(Searches::new());
    let mut runner = TestRunner::new(cases(256));
    let outcome = runner.run(&any_graph(), |(nodes, mut links)| {
        let mut searches = searches.lock().unwrap_or_else(PoisonError::into_inner);
        let forward = searches.check(nodes, &links);
        links.reverse();
        prop_assert_eq!(searches.check(nodes, &links), forward, "the order of the links shows");
        Ok(())
    });
    outcome.unwrap_or_else(|failure| panic!("{failure}"));
}

#[test]
fn simple_graphs() {
    let mut searches = Searches::new();
    let mut check = |nodes, links: &[[u32; 2]]| {
        let IslandSizes { islands, largest } = searches.check(nodes, links);
        (islands, largest)
    };
    // The longest path there can be, in the worst order, and stars: first, so that whatever they leave behind would show
    // in the smaller ones.
    assert_eq!(check(20_000, &chains(20_000, 1)), (1, 20_000));
    assert_eq!(check(20_000, &chains(20_000, 3)), (3, 6_667));
    assert_eq!(check(20_000, &star(20_000, 19_999)), (1, 20_000));
    assert_eq!(check(20_000, &[]), (20_000, 1));
    assert_eq!(check(0, &[]), (0, 0));
    assert_eq!(check(3, &[]), (3, 1));
    assert_eq!(check(4, &[[3, 3], [1, 2], [2, 1]]), (3, 2));
}

/// Threads that meet: the links of every node to two lesser ones lie half the list apart, so that two threads often want
/// to put one root under something at the same time. Each link counts: one that gets lost parts an island.
#[test]
fn threads_that_meet() {
    let threes = 40_000;
    let links: Vec<_> = (0..2).flat_map(|low| (0..threes).map(move |i| [3 * i + 2, 3 * i + low])).collect();
    let (mut parallel, mut roots) = (ParallelUnionFind::default(), Vec::new());
    let pool = ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    pool.install(|| {
        for round in 0..200 {
            let grain = links.len() / 2;
            let found = parallel.find(3 * threes as usize, &links, Team::of_pool(), grain, &mut roots);
            assert_eq!(found, IslandSizes { islands: threes.into(), largest: 3 }, "round {round}");
            assert!(roots.iter().enumerate().all(|(i, &root)| root as usize == i / 3 * 3), "round {round}");
        }
    });
}

#[test]
#[should_panic(expected = "out of bounds")]
fn a_link_to_no_node() {
    Islands::default().find(IslandSearch::UnionFind, 2, &[[1, 2]], Team::ALONE);
}

/// Columns of bodies that fall onto a floor, on 2 x 2 tiles.
fn pile() -> World {
    let partition = Partition::uniform(DVec2::ZERO, DVec2::new(6.0, 3.0), 2, 2).unwrap();
    let floor = StaticBody {
        id: GlobalId(0),
        position: DVec2::new(3.0, -0.5),
        rotation: Rot::IDENTITY,
        kind: rectangle(20.0, 1.0),
        path: None,
    };
    let params = Params { gravity: Vec2::new(0.0, -10.0), exchange: Exchange::Substep, ..Params::default() };
    let kinds = vec![circle(0.2), rectangle(0.2, 0.2)];
    let mut world =
        World::new(&Blueprint { params, partition, kinds, statics: vec![floor] }, &[0, 1, 2, 3].map(TileId)).unwrap();
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

/// The islands of a tile, but for those of ghosts alone, and the bodies in the largest: from its contacts.
fn of_tile(tile: &Tile, searches: &mut Searches) -> (u64, u64) {
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
    let links: Vec<_> = links.into_iter().map(|(a, b)| [place(a), place(b)]).collect();
    let sizes = searches.check(touching.len(), &links);
    let own = place(tile.owned as u32);
    let roots = spread(touching.len(), &links);
    ((0..own).zip(roots).filter(|(node, root)| node == root).count() as u64, sizes.largest)
}

#[test]
fn the_islands_of_a_pile() {
    let mut world = pile();
    let mut searches = Searches::new();
    let mut most = 0;
    for _ in 0..60 {
        let report = step(&mut world, &mut Loopback).unwrap();
        let mut expected = StepReport::default();
        for tile in world.tile_states() {
            let (islands, largest) = of_tile(tile, &mut searches);
            expected.islands += islands;
            expected.largest_island = expected.largest_island.max(largest);
        }
        assert_eq!((report.islands, report.largest_island), (expected.islands, expected.largest_island));
        most = most.max(report.largest_island);
        assert!(report.step < 59 || report.islands >= 4, "the pile should hold several islands, {report:?}");
    }
    assert!(most >= 10, "the pile should hold one of ten bodies, the largest has {most}");
}
