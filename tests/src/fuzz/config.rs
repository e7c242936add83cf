//! Configurations, and what is planned from them.

use super::{Outcome, assert_one_line};
use atoll::Config;
use atoll::config::ConfigError;
use atoll::internals::Plan;
use atoll::scene::SceneKind;

/// What a target has time to plan: bodies, ranks, and tiles along both axes together.
const SMALL: (u64, usize, u32) = (2000, 64, 128);

/// What may be said about how a run is computed, and must not show in what is computed.
const HOW: [(&str, &str); 6] = [
    ("run.ranks", "3"),
    ("run.threads", "2"),
    ("run.transport", "channel"),
    ("run.peer_timeout", "5"),
    ("output.record_every", "7"),
    ("output.log_every", "7"),
];

/// The text of a file, and after it any number of `key=value` as for `--set`, with a zero byte before each. It is
/// refused in one line, or it is a configuration that means something.
pub fn config(bytes: &[u8]) -> Outcome<ConfigError> {
    let Ok(text) = std::str::from_utf8(bytes) else { return Outcome { accepted: false, refusals: Vec::new() } };
    let mut parts = text.split('\0');
    let text = parts.next().unwrap_or_default();
    let mut overrides: Vec<_> = parts.filter_map(|part| part.split_once('=')).collect();
    let config = Config::from_toml_str("fuzz.toml", text, &overrides);
    if let Ok(config) = &config {
        assert_eq!(Config::from_toml_str("fuzz.toml", text, &overrides), Ok(config.clone()), "read again");
        check(config);
        overrides.extend(HOW);
        let otherwise = Config::from_toml_str("fuzz.toml", text, &overrides);
        let otherwise = otherwise.expect("any configuration can be computed in another way");
        let tiles = config.run.tiles.unwrap_or([1, 1]);
        assert_eq!(config.hash(tiles), otherwise.hash(tiles), "how it is computed shows");
    }
    Outcome::of(config)
}

/// Every number is one that can be computed with.
fn check(config: &Config) {
    let Config { scene, run, params, output: _ } = config;
    params.check().expect("what the core refuses is refused as a configuration");
    assert!(scene.bodies >= scene.kind.least_bodies() && run.steps >= 1 && run.ranks >= 1 && run.threads != Some(0));
    assert!(!run.peer_timeout.is_zero());
    match scene.kind {
        SceneKind::File(_) => panic!("no such file is there"),
        SceneKind::Rooms { power } => assert!(power.is_finite() && power > 0.0),
        SceneKind::Pile { jitter } => assert!(jitter.is_finite() && jitter >= 0.0),
        SceneKind::Pyramids { base } => assert!(base >= 2),
        SceneKind::Slope { angle, friction } => assert!((0.0..90.0).contains(&angle) && friction >= 0.0),
        SceneKind::Sparse
        | SceneKind::SingleIsland
        | SceneKind::Stack
        | SceneKind::Smash
        | SceneKind::Compounds
        | SceneKind::Junkyard
        | SceneKind::Washer
        | SceneKind::Tumbler
        | SceneKind::Zoo => {}
    }
    let tiles = run.tiles.unwrap_or([1, 1]);
    assert!(tiles.iter().all(|&count| count >= 1));

    let canonical = config.canonical(tiles);
    let named = |line: &str| line.split_once(" = ").is_some_and(|(name, value)| !name.is_empty() && !value.is_empty());
    assert!(canonical.ends_with('\n') && canonical.lines().all(named), "{canonical}");
    assert!(!canonical.contains("NaN"), "{canonical}");
    let mut expected = config.clone();
    (expected.run.tiles, expected.run.ranks_asked_for) = (Some(tiles), false);
    assert_eq!(Config::from_toml_str("again.toml", &config.to_toml(tiles), &[]), Ok(expected), "written and read");
    let hash = config.hash(tiles);
    assert!(hash.len() == 32 && hash.bytes().all(|digit| digit.is_ascii_hexdigit()), "{hash}");

    if scene.bodies <= SMALL.0 && run.ranks <= SMALL.1 && tiles[0].saturating_add(tiles[1]) <= SMALL.2 {
        Plan::new(config).map_or_else(assert_one_line, |plan| check_plan(&plan));
    }
}

/// A world that can be built has a place for every body and a rank for every tile.
fn check_plan(plan: &Plan) {
    plan.notes().iter().for_each(assert_one_line);
    let (low, high) = plan.scene.domain();
    assert!(low.is_finite() && high.is_finite() && low.cmplt(high).all(), "{low} to {high}");
    let partition = &plan.blueprint.partition;
    assert_eq!(partition.roots(), plan.tiles);
    // Squares that are cut from the start are more tiles.
    let least = plan.tiles.iter().product::<u32>() as usize;
    assert!(partition.tiles() == least || partition.levels().is_some() && partition.tiles() > least);
    assert!(
        !plan.scene.iter().map(Result::unwrap).any(|body| plan.scene.has_escaped(&body)),
        "a body starts outside of its home"
    );
    let tiles: usize = (0..plan.assignment.ranks()).map(|rank| plan.assignment.tiles_of(rank).len()).sum();
    assert_eq!(tiles, plan.blueprint.partition.tiles(), "every tile is somebody's");
}
