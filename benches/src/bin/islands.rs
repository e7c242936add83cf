//! The searches for islands, on graphs as a tile has them, on one thread and on two.
//!
//! ```sh
//! cargo run --release -p atoll-benches --bin islands [REPEATS]
//! ```
//!
//! Graphs of about 100,000 nodes: bodies that fly, of which few touch; and a heap, one island, with its contacts in the
//! order of the rows, as a step finds them, and in no order. Depth-first search builds its lists of neighbours first, and
//! that time counts. All searches take turns, so that a machine that gets slower meanwhile does so for all of them; the
//! table gives medians, the ratio to union-find on one thread, and the least, which tells more about two threads where
//! other programs run.

use atoll_benches::{arguments, median};
use atoll_core::IslandSearch;
use atoll_core::islands::{IslandSizes, Islands};
use rayon::ThreadPoolBuilder;
use std::process::ExitCode;
use std::time::Instant;

const SEARCHES: [(&str, IslandSearch); 3] = [
    ("union-find", IslandSearch::UnionFind),
    ("dfs", IslandSearch::Dfs),
    ("parallel-union-find", IslandSearch::ParallelUnionFind),
];
const THREADS: [usize; 2] = [1, 2];

/// Columns and rows of the heap.
const SIDE: u32 = 316;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("islands: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), String> {
    let [repeats] = arguments(["REPEATS"], [51])?;
    let pools = THREADS.map(|threads| ThreadPoolBuilder::new().num_threads(threads).build());
    let graphs = [
        ("sparse", 100_000, sparse()),
        ("heap", SIDE * SIDE, heap()),
        ("heap shuffled", SIDE * SIDE, shuffled(heap())),
    ];

    eprintln!("median of {repeats}");
    eprintln!(
        "{:>14}{:>8}{:>8}{:>22}{:>9}{:>10}{:>8}{:>10}",
        "graph", "nodes", "links", "search", "threads", "us", "ratio", "least us"
    );
    for (graph, nodes, links) in graphs {
        let mut buffers = SEARCHES.map(|_| THREADS.map(|_| Islands::default()));
        let mut microseconds = SEARCHES.map(|_| THREADS.map(|_| Vec::new()));
        // The first round fills the buffers.
        for round in 0..=repeats {
            for (s, (name, search)) in SEARCHES.into_iter().enumerate() {
                for (t, pool) in pools.iter().enumerate() {
                    let islands = &mut buffers[s][t];
                    let find = || {
                        let start = Instant::now();
                        let sizes = islands.find_in_pool(search, nodes as usize, &links);
                        (sizes, start.elapsed().as_secs_f64() * 1e6)
                    };
                    let (sizes, time) = pool.as_ref().map_err(ToString::to_string)?.install(find);
                    if round > 0 {
                        microseconds[s][t].push(time);
                    }
                    if sizes != expected(graph) || buffers[s][t].roots() != buffers[0][0].roots() {
                        return Err(format!("{name} on {} threads finds other islands: {sizes:?}", THREADS[t]));
                    }
                }
            }
        }

        let usual = median(microseconds[0][0].clone());
        for ((name, _), of_search) in SEARCHES.into_iter().zip(microseconds) {
            for (threads, all) in THREADS.into_iter().zip(of_search) {
                let least = all.iter().copied().fold(f64::INFINITY, f64::min);
                let (time, links) = (median(all), links.len());
                let ratio = time / usual;
                eprintln!("{graph:>14}{nodes:>8}{links:>8}{name:>22}{threads:>9}{time:>10.0}{ratio:>8.2}{least:>10.0}");
                println!(
                    r#"{{"bench":"islands","graph":"{graph}","nodes":{nodes},"links":{links},"search":"{name}","threads":{threads},"us":{time:.1},"ratio":{ratio:.3},"least_us":{least:.1}}}"#
                );
            }
        }
    }
    Ok(())
}

fn expected(graph: &str) -> IslandSizes {
    match graph {
        "sparse" => IslandSizes { islands: 95_000, largest: 3 },
        _ => IslandSizes { islands: 1, largest: u64::from(SIDE * SIDE) },
    }
}

/// 2,500 islands of three among 100,000 nodes: 5,000 links.
fn sparse() -> Vec<[u32; 2]> {
    (0..2500).map(|i| 40 * i).flat_map(|i| [[i, i + 1], [i + 1, i + 2]]).collect()
}

/// Neighbours in a square lattice, and every other diagonal: 248,693 links, in the order of the rows.
fn heap() -> Vec<[u32; 2]> {
    let mut links = Vec::new();
    for (row, column) in (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| (row, column))) {
        let node = row * SIDE + column;
        let (right, up) = (column + 1 < SIDE, row + 1 < SIDE);
        links.extend(right.then_some([node, node + 1]));
        links.extend(up.then_some([node, node + SIDE]));
        links.extend((right && up && (row + column) % 2 == 0).then_some([node, node + SIDE + 1]));
    }
    links
}

/// The same links in an arbitrary order, always the same one (Fisher and Yates; Knuth's MMIX generator).
fn shuffled(mut links: Vec<[u32; 2]>) -> Vec<[u32; 2]> {
    let mut state = 1_u64;
    for i in (1..links.len()).rev() {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        links.swap(i, (state >> 33) as usize % (i + 1));
    }
    links
}
