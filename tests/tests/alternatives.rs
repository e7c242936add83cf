//! Everything that can be chosen gives one trajectory on any ranks and threads; and what only decides how a step is
//! computed gives the same trajectory as what it may be chosen instead of. On every scene.

use atoll::{Config, Summary};
use atoll_tests::program::{self, watched};

/// A scene, made small.
type Small = (&'static str, &'static [(&'static str, &'static str)]);

const SCENES: [Small; 8] = [
    ("configs/normal.toml", &[("bodies", "2000"), ("steps", "60"), ("tiles", "3x2")]),
    ("configs/skewed.toml", &[("bodies", "2000"), ("steps", "60"), ("tiles", "4x4")]),
    ("configs/pile.toml", &[("bodies", "1500"), ("steps", "60"), ("tiles", "3x2")]),
    ("configs/pyramids.toml", &[("bodies", "1100"), ("steps", "40"), ("tiles", "2x2")]),
    ("configs/sparse.toml", &[("bodies", "4000"), ("steps", "40")]),
    ("configs/single_island.toml", &[("bodies", "2500"), ("steps", "40")]),
    ("configs/stack.toml", &[("steps", "100"), ("tiles", "2x2")]),
    ("configs/slope.toml", &[("bodies", "20"), ("steps", "100"), ("tiles", "2x2")]),
];

/// A run in this process.
fn run((path, small): Small, overrides: &[(&str, &str)]) -> Summary {
    let text = std::fs::read_to_string(program::root().join(path)).unwrap();
    let overrides: Vec<_> = small.iter().chain(overrides).copied().collect();
    let config = Config::from_toml_str(path, &text, &overrides).unwrap();
    let what = format!("{path} with {overrides:?}");
    let summary = watched(&what, move || atoll::run(&config)).unwrap_or_else(|error| panic!("{what}: {error}"));
    assert_eq!((summary.bodies_lost, summary.escaped), (0, 0), "{what}");
    assert!(summary.contacts >= summary.bodies / 100, "{what}: only {} contacts", summary.contacts);
    summary
}

/// All that may not depend on how a run was made.
fn bits(summary: &Summary) -> (String, String, u64, u64) {
    (summary.state_hash.clone(), summary.contact_hash.clone(), summary.contacts, summary.migrations)
}

/// Runs a scene with some choice on ranks 1, 2 and 4 and threads 1 and 2, which must agree, and returns the bits.
fn one_result(scene: Small, choice: &[(&str, &str)]) -> (String, String, u64, u64) {
    let expected = bits(&run(scene, choice));
    for (ranks, threads) in [("1", "2"), ("2", "1"), ("2", "2"), ("4", "1"), ("4", "2")] {
        let all: Vec<_> = choice.iter().copied().chain([("ranks", ranks), ("threads", threads)]).collect();
        assert_eq!(bits(&run(scene, &all)), expected, "{} with {all:?}", scene.0);
    }
    expected
}

#[test]
fn grid_and_quadtree_find_the_same() {
    for scene in SCENES {
        let grid = one_result(scene, &[("broad_phase", "grid")]);
        assert_eq!(one_result(scene, &[("broad_phase", "quadtree")]), grid, "{}", scene.0);
    }
}

#[test]
fn islands_found_any_way_and_shared_any_way_are_the_same() {
    for scene in SCENES {
        let expected = bits(&run(scene, &[]));
        for (islands, parallel) in [
            ("dfs", "serial"),
            ("parallel-union-find", "islands"),
            ("union-find", "coloring"),
            ("parallel-union-find", "auto"),
        ] {
            let choice = [("islands", islands), ("parallel", parallel)];
            assert_eq!(one_result(scene, &choice), expected, "{} with {choice:?}", scene.0);
        }
    }
}

/// Another solver is another result, but one.
#[test]
fn sequential_impulses_have_one_result() {
    for scene in SCENES {
        let soft = bits(&run(scene, &[]));
        assert_ne!(one_result(scene, &[("solver", "pgs")]), soft, "{}", scene.0);
    }
}

/// Where bodies meet across borders, freezing them shows.
#[test]
fn frozen_ghosts_have_one_result() {
    for scene in SCENES {
        let frozen = one_result(scene, &[("exchange", "step"), ("ghosts", "frozen")]);
        if ["configs/pile.toml", "configs/skewed.toml"].contains(&scene.0) {
            assert_ne!(frozen, bits(&run(scene, &[("exchange", "step")])), "{}", scene.0);
        }
    }
}

/// The report's own way, as its configuration has it.
#[test]
fn the_reported_way_has_one_result() {
    let scene = ("configs/report.toml", &[("bodies", "2500"), ("steps", "80"), ("tiles", "4x4")][..]);
    let reported = one_result(scene, &[]);
    let also = one_result(scene, &[("broad_phase", "grid"), ("islands", "union-find"), ("parallel", "auto")]);
    assert_eq!(reported, also);
}

/// What sleeps wakes at the same step everywhere.
#[test]
fn sleep_has_one_result() {
    for (path, small, steps) in [
        ("configs/stack.toml", &[("tiles", "2x2")][..], "200"),
        ("configs/pyramids.toml", &[("bodies", "550"), ("tiles", "1x1")][..], "150"),
        ("configs/pile.toml", &[("bodies", "600"), ("tiles", "3x2"), ("seed", "1"), ("sleep_speed", "0.3")][..], "420"),
    ] {
        let asleep = run((path, small), &[("sleep", "true"), ("steps", steps)]).asleep;
        assert!(asleep > Some(0), "{path}: nobody sleeps");
        one_result((path, small), &[("sleep", "true"), ("steps", steps)]);
    }
}
