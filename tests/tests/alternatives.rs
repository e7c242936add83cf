//! Ways of computing that must not show: with each of them a scene ends in the same bits.

use atoll::{Config, Summary};
use atoll_tests::program::{self, watched};

/// A run in this process.
fn run(path: &'static str, overrides: &[(&str, &str)]) -> Summary {
    let text = std::fs::read_to_string(program::root().join(path)).unwrap();
    let config = Config::from_toml_str(path, &text, overrides).unwrap();
    let what = format!("{path} with {overrides:?}");
    watched(&what, move || atoll::run(&config)).unwrap_or_else(|error| panic!("{what}: {error}"))
}

/// Runs a scene with either value of a key, on so many ranks of so many threads, and compares.
fn agree(path: &'static str, scene: &[(&str, &str)], key: &str, [one, other]: [&str; 2], ranks: &str, threads: &str) {
    let with = |value: &str| {
        let mut all = scene.to_vec();
        all.extend([(key, value), ("ranks", ranks), ("threads", threads)]);
        run(path, &all)
    };
    let (one, other) = (with(one), with(other));
    assert!(one.contacts > one.bodies / 100, "{path}: only {} contacts", one.contacts);
    let bits = |summary: &Summary| {
        (summary.state_hash.clone(), summary.contact_hash.clone(), summary.contacts, summary.migrations)
    };
    assert_eq!(bits(&one), bits(&other), "{path} with {scene:?}, {ranks} ranks, {threads} threads");
}

#[test]
fn grid_and_quadtree_agree_where_bodies_fly() {
    for tiles in ["1x1", "4x4"] {
        for (ranks, threads) in [("1", "2"), ("2", "1")] {
            let scene = [("bodies", "3000"), ("steps", "120"), ("tiles", tiles)];
            agree("configs/quickstart.toml", &scene, "broad_phase", ["grid", "quadtree"], ranks, threads);
        }
    }
}

#[test]
fn grid_and_quadtree_agree_in_a_pile() {
    for (ranks, threads) in [("1", "2"), ("2", "1")] {
        let scene = [("bodies", "3000"), ("steps", "150"), ("tiles", "2x2")];
        agree("configs/pile.toml", &scene, "broad_phase", ["grid", "quadtree"], ranks, threads);
    }
}
