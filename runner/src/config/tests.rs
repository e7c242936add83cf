//! What is accepted, and what is said about everything else.

use super::*;
use crate::scene::{SceneKind, SceneSpec};
use atoll_core::{BroadPhase, Exchange, Ghosts, Instructions, IslandSearch, Parallel, Params, Solver};
use glam::Vec2;
use std::path::Path;
use std::time::Duration;

/// What a scene may be called.
const KINDS: &str = r#""rooms", "pile", "pyramids", "sparse", "single-island", "stack", "smash", "compounds", "junkyard", "washer", "tumbler", "zoo", "slope" or "file""#;
const ROOMS: &str = "[scene]\nkind = \"rooms\"\n";

fn read(text: &str, overrides: &[(&str, &str)]) -> Result<Config, String> {
    Config::from_toml_str("test.toml", text, overrides).map_err(|error| {
        let line = error.to_string();
        assert!(!line.contains('\n'), "more than one line: {line}");
        line
    })
}

/// With one more key in the file.
fn with(section: &str, line: &str) -> Result<Config, String> {
    let text = if section == "scene" { format!("{ROOMS}{line}\n") } else { format!("{ROOMS}[{section}]\n{line}\n") };
    read(&text, &[])
}

#[test]
fn the_kind_of_scene_chooses_the_defaults() {
    let rooms = read(ROOMS, &[]).unwrap();
    assert_eq!(rooms.params, Params::default());
    assert_eq!((rooms.scene.bodies, rooms.scene.seed), (700_000, 1));
    assert_eq!((rooms.run.steps, rooms.run.ranks, rooms.run.threads, rooms.run.tiles), (600, 1, None, None));
    assert_eq!(rooms.transport(), TransportKind::Local);

    let pile = read("[scene]\nkind = \"pile\"", &[]).unwrap();
    assert_eq!((pile.params.gravity, pile.params.exchange), (Vec2::new(0.0, -10.0), Exchange::Substep));
    let pile = read("[scene]\nkind = \"pile\"", &[("exchange", "step"), ("gravity", "[1, 2.5]")]).unwrap();
    assert_eq!((pile.params.gravity, pile.params.exchange), (Vec2::new(1.0, 2.5), Exchange::Step));

    for (name, bodies, rests) in [
        ("pyramids", 22_000, true),
        ("sparse", 100_000, false),
        ("single-island", 100_000, true),
        ("stack", 10, true),
        ("smash", 9601, false),
        ("slope", 1, true),
    ] {
        let config = read(&format!("[scene]\nkind = \"{name}\""), &[]).unwrap();
        assert_eq!((config.scene.kind.name(), config.scene.bodies), (name, bodies));
        assert_eq!(
            (config.params.gravity.y < 0.0, config.params.exchange == Exchange::Substep),
            (rests, rests),
            "{name}"
        );
    }
}

#[test]
fn scenes_have_keys_of_their_own() {
    let kind =
        |name: &str, key: (&str, &str)| read(&format!("[scene]\nkind = \"{name}\""), &[key]).map(|c| c.scene.kind);
    assert_eq!(kind("pyramids", ("base", "3")), Ok(SceneKind::Pyramids { base: 3 }));
    assert_eq!(kind("slope", ("angle", "31")), Ok(SceneKind::Slope { angle: 31.0, friction: 0.6 }));
    assert_eq!(kind("slope", ("friction", "0")), Ok(SceneKind::Slope { angle: 25.0, friction: 0.0 }));
    for (name, key, value, expected) in [
        ("pyramids", "base", "1", "must be a whole number within 2 to 100"),
        ("pyramids", "base", "101", "must be a whole number within 2 to 100"),
        ("slope", "angle", "-1", "must be a number within 0 to 60"),
        ("slope", "angle", "nan", "must be a number within 0 to 60"),
        ("slope", "friction", "3", "must be a number within 0 to 2"),
        ("sparse", "bodies", "99", "must be a whole number within 100 to 10000000000"),
        ("sparse", "base", "10", "scenes of this kind have no scene.base; leave it out"),
        ("stack", "friction", "1", "scenes of this kind have no scene.friction; leave it out"),
    ] {
        assert_eq!(kind(name, (key, value)).unwrap_err(), format!("--set scene.{key}={value}: {expected}"));
    }
}

#[test]
fn frozen_ghosts_are_heard_of_once_a_step() {
    let must = "--set physics.ghosts=frozen: must be \"dynamic\" with exchange = \"substep\"";
    let error = read(ROOMS, &[("ghosts", "frozen"), ("exchange", "substep")]).unwrap_err();
    assert_eq!(error, format!("{must}; or use exchange = \"step\""));
    let error = read("[scene]\nkind = \"pile\"", &[("ghosts", "frozen")]).unwrap_err();
    assert_eq!(error, format!("{must}, the default of this scene; or use exchange = \"step\""));
    let config = read("[scene]\nkind = \"pile\"", &[("ghosts", "frozen"), ("exchange", "step")]).unwrap();
    assert_eq!(config.params.ghosts, Ghosts::Frozen);
}

#[test]
fn every_key_can_be_given() {
    let text = r#"
        scene = { kind = "rooms", bodies = 1_000, seed = 5, power = 1.2 }
        [run]
        steps = 7
        ranks = 2
        threads = 3
        transport = "channel"
        tiles = [4, 5]
        max_bodies = 600
        retile_every = 8
        peer_timeout = 2.5
        instructions = "portable"
        mpi_exchange = "sparse"
        balance = "bodies"
        [physics]
        hertz = 120
        substeps = 2
        gravity = [0, -9.81]
        linear_damping = 0.1
        angular_damping = 0.2
        max_linear_speed = inf
        max_angular_speed = 100
        contact_hertz = 20
        contact_damping_ratio = 5
        push_out_speed = 2
        speculative_distance = 0.03
        recycle_distance = 0
        restitution_threshold = 2
        margin_floor = 0.1
        margin_cap = 0.4
        sort_interval = 16
        broad_phase = "quadtree"
        solver = "pgs"
        iterations = 20
        baumgarte = 0.3
        linear_slop = 0.01
        islands = "dfs"
        parallel = "serial"
        exchange = "step"
        ghosts = "frozen"
        sleep = true
        sleep_speed = 0.1
        sleep_time = 1
        [output]
        record_every = 10
        checkpoint_every = 100
        log_every = 5
    "#;
    let config = read(text, &[]).unwrap();
    assert_eq!(config.scene, SceneSpec { kind: SceneKind::Rooms { power: 1.2 }, bodies: 1000, seed: 5 });
    assert_eq!((config.run.steps, config.run.ranks, config.run.threads), (7, 2, Some(3)));
    assert_eq!((config.run.transport, config.run.tiles), (Some(TransportKind::Channel), Some([4, 5])));
    assert_eq!(config.run.peer_timeout, Duration::from_millis(2500));
    assert_eq!((config.run.mpi_exchange, config.run.ranks_asked_for), (MpiExchange::Sparse, false));
    assert_eq!(config.run.retiling, Some(Retiling { how: Retile::Adaptive { max_bodies: 600 }, every: 8 }));
    assert_eq!(config.run.balance, Balance::Bodies);
    assert_eq!(config.params.instructions, Instructions::Portable);
    assert_eq!((config.params.dt, config.params.substeps), (1.0 / 120.0, 2));
    assert_eq!((config.params.max_linear_speed, config.params.margin_cap), (f32::INFINITY, 0.4));
    assert_eq!((config.params.sort_interval, config.params.parallel), (16, Parallel::Serial));
    assert_eq!((config.params.broad_phase, config.params.solver), (BroadPhase::Quadtree, Solver::Pgs));
    assert_eq!((config.params.iterations, config.params.baumgarte, config.params.linear_slop), (20, 0.3, 0.01));
    assert_eq!((config.params.island_search, config.params.ghosts), (IslandSearch::Dfs, Ghosts::Frozen));
    assert_eq!((config.params.sleep, config.params.sleep_speed, config.params.sleep_time), (true, 0.1, 1.0));
    assert_eq!(config.output, OutputConfig { record_every: Some(10), checkpoint_every: Some(100), log_every: 5 });

    let keys: usize = text.lines().filter(|line| line.contains('=') && !line.contains('{')).count();
    // The scene's four stand on one line; path, digest, jitter, base, angle and friction belong to other kinds, and tile_count to
    // other tiles.
    assert_eq!(keys + 4 + 7, keys::KEYS.len(), "a key is missing from this test");
}

#[test]
fn overrides_win_and_the_last_of_them_most() {
    let config = read(ROOMS, &[("scene.bodies", "1e3"), ("bodies", "2000"), ("tiles", "3x2")]).unwrap();
    assert_eq!((config.scene.bodies, config.run.tiles), (2000, Some([3, 2])));
    // What is wrong is refused, also where something else wins over it.
    let error = read(ROOMS, &[("steps", "many"), ("run.steps", "2")]).unwrap_err();
    assert!(error.starts_with("--set run.steps=many: must be a whole number"), "{error}");
    let error = read(ROOMS, &[("solver", "pgz"), ("solver", "pgs")]).unwrap_err();
    assert!(error.contains("pgz") && error.contains("did you mean"), "{error}");
    let retiling = |overrides: &[_]| read(ROOMS, overrides).unwrap().run.retiling.map(|r| (r.how, r.every));
    let adaptive = |max_bodies| Retile::Adaptive { max_bodies };
    assert_eq!(retiling(&[("tiles", "adaptive"), ("retile_every", "5")]), Some((adaptive(48_000), 5)));
    assert_eq!(retiling(&[("tiles", "3x2"), ("max_bodies", "70")]), Some((adaptive(70), 32)));
    assert_eq!(retiling(&[("tiles", "bisected"), ("retile_every", "5")]), Some((Retile::Bisected, 5)));
    for bisected in [&[("tile_count", "7")][..], &[("tiles", "bisected"), ("tile_count", "7")]] {
        assert_eq!(
            (retiling(bisected).unwrap().0, read(ROOMS, bisected).unwrap().run.tiles),
            (Retile::Bisected, Some([7, 1]))
        );
    }
    for both in [("tiles", "3x2"), ("tiles", "adaptive"), ("max_bodies", "70")] {
        let error = read(ROOMS, &[both, ("tile_count", "7")]).unwrap_err();
        assert_eq!(error, "--set run.tile_count=7: goes with tiles = \"bisected\" alone: say that, or leave it out");
    }
    let error = read(ROOMS, &[("tiles", "bisected"), ("max_bodies", "70")]).unwrap_err();
    assert!(error.contains("tiles that are bisected have as much to do as each other; leave it out"), "{error}");
    let error = read(ROOMS, &[("tiles", "3x2"), ("retile_every", "5")]).unwrap_err();
    assert_eq!(
        error,
        "--set run.retile_every=5: tiles stay as they are here; add tiles = \"bisected\" or \"adaptive\", or leave it out"
    );
    let config = read(ROOMS, &[("tiles", "3x2"), ("run.tiles", "auto"), ("kind", "pile")]).unwrap();
    assert_eq!((config.run.tiles, config.scene.kind.name()), (None, "pile"));
    assert_eq!(read(ROOMS, &[("kind", "\"pile\"")]).unwrap().scene.kind.name(), "pile");
    assert_eq!(read(ROOMS, &[("ranks", "3")]).unwrap().transport(), TransportKind::Channel);
}

#[test]
fn out_of_range_and_of_the_wrong_type() {
    for (section, line, expected) in [
        ("scene", "bodies = 0", "test.toml: scene.bodies = 0: must be a whole number within 100 to 10000000000"),
        ("scene", "bodies = -5", "test.toml: scene.bodies = -5: must be a whole number within 100"),
        ("scene", "bodies = 99", "test.toml: scene.bodies = 99: must be a whole number within 100"),
        ("scene", "bodies = 1000.5", "test.toml: scene.bodies = 1000.5: must be a whole number"),
        ("scene", "bodies = nan", "test.toml: scene.bodies = nan: must be a whole number"),
        ("scene", "bodies = \"many\"", "test.toml: scene.bodies = \"many\": must be a whole number"),
        ("scene", "seed = -1", "test.toml: scene.seed = -1: must be a whole number within 0 to"),
        ("scene", "power = nan", "test.toml: scene.power = nan: must be a number within 0.1 to 10"),
        ("scene", "power = true", "test.toml: scene.power = true: must be a number"),
        ("run", "steps = 0", "test.toml: run.steps = 0: must be a whole number within 1 to"),
        ("run", "ranks = 0", "test.toml: run.ranks = 0: must be a whole number within 1 to 1024"),
        ("run", "threads = 0", "test.toml: run.threads = 0: must be \"auto\", or a whole number within 1 to 1024"),
        (
            "run",
            "tiles = [0, 3]",
            "test.toml: run.tiles = [0, 3]: must be \"auto\", \"bisected\", \"adaptive\", or columns and rows",
        ),
        ("run", "tiles = [3]", "test.toml: run.tiles = [3]: must be"),
        ("run", "tiles = \"3by2\"", "test.toml: run.tiles = \"3by2\": must be"),
        (
            "output",
            "record_every = 0",
            "test.toml: output.record_every = 0: must be a whole number within 1 to 4294967295",
        ),
        ("output", "checkpoint_every = 1e10", "test.toml: output.checkpoint_every = 1e10: must be a whole"),
        ("run", "peer_timeout = 0", "test.toml: run.peer_timeout = 0: must be a number within 0.001 to"),
        ("physics", "hertz = 0", "test.toml: physics.hertz = 0: must be positive and finite"),
        ("physics", "hertz = -60", "test.toml: physics.hertz = -60: must be positive and finite"),
        ("physics", "hertz = nan", "test.toml: physics.hertz = nan: must be positive and finite"),
        ("physics", "hertz = inf", "test.toml: physics.hertz = inf: must be positive and finite"),
        ("physics", "hertz = 1e39", "test.toml: physics.hertz = 1e39: must be a number of at most"),
        ("physics", "substeps = 0", "test.toml: physics.substeps = 0: must be within 1 to 64"),
        ("physics", "substeps = 65", "test.toml: physics.substeps = 65: must be within 1 to 64"),
        (
            "physics",
            "gravity = -10",
            "test.toml: physics.gravity = -10: must be two numbers of at most 3.4e38, such as [0, -10]",
        ),
        (
            "physics",
            "hertz = 0.00099",
            "test.toml: physics.hertz = 0.00099: must be positive and finite, and at least 0.001",
        ),
        ("physics", "gravity = [0, 1e300]", "test.toml: physics.gravity = [0, 1e300]: must be two numbers of at most"),
        ("physics", "gravity = [0, nan]", "test.toml: physics.gravity = [0, nan]: must be finite"),
        ("physics", "push_out_speed = -1", "test.toml: physics.push_out_speed = -1: must be at least 0 and finite"),
        ("physics", "sleep = 1", "test.toml: physics.sleep = 1: must be true or false"),
        (
            "physics",
            "margin_floor = 2",
            "physics.margin_cap = 0.5 (the default): must be finite and at least margin_floor",
        ),
    ] {
        let error = with(section, line).unwrap_err();
        assert!(error.starts_with(expected), "{line}\n  says     {error}\n  expected {expected}");
    }
}

#[test]
fn unknown_names_come_with_a_suggestion() {
    for (text, expected) in [
        (
            "[scene]\nkind = \"room\"",
            &*format!("test.toml: scene.kind = \"room\": must be {KINDS}; did you mean rooms?"),
        ),
        ("[scene]\nkind = \"sea\"", &format!("test.toml: scene.kind = \"sea\": must be {KINDS}")),
        ("[scene]\nknid = \"rooms\"", "test.toml: scene.knid = \"rooms\": unknown key; did you mean scene.kind?"),
        ("[sceen]\nkind = \"rooms\"", "test.toml: unknown section [sceen]; did you mean [scene]?"),
        ("[run]\nsubsteps = 4", "test.toml: run.substeps = 4: unknown key; did you mean physics.substeps?"),
        ("steps = 4", "test.toml: steps = 4: unknown key; did you mean run.steps?"),
        ("scene = \"rooms\"", "test.toml: scene = \"rooms\": must be a table; give its keys below a line [scene]"),
        ("", &format!("test.toml: scene.kind is missing: must be {KINDS}")),
        ("[physics.more]\nx = 1\n[scene]\nkind = \"pile\"", "test.toml: physics.more = { x = 1 }: unknown key"),
    ] {
        let error = read(text, &[]).unwrap_err();
        assert_eq!(error, expected, "{text}");
    }
    assert_eq!(
        read(ROOMS, &[("sovler", "pgs")]).unwrap_err(),
        "--set sovler=pgs: unknown key; did you mean physics.solver?"
    );
}

#[test]
fn a_transport_that_is_not_built_in_says_how_to_build_it() {
    for kind in [TransportKind::Mpi, TransportKind::Iceoryx2] {
        let name = kind.name();
        match read(ROOMS, &[("transport", name)]) {
            Ok(config) => assert!(kind.is_built_in() && config.transport() == kind, "{name}"),
            Err(error) => {
                let expected = format!("--set run.transport={name}: this program was built without it; build it again");
                assert!(!kind.is_built_in() && error.starts_with(&expected), "{error}");
                assert!(error.contains(&format!("--features {name}`")), "{error}");
            }
        }
    }
}

#[test]
fn ranks_of_the_command_line_are_asked_for() {
    let asked = |text: &str, overrides: &[(&str, &str)]| read(text, overrides).unwrap().run.ranks_asked_for;
    assert!(!asked(&format!("{ROOMS}[run]\nranks = 4\n"), &[]));
    assert!(asked(ROOMS, &[("ranks", "4")]));
}

#[test]
fn keys_that_mean_nothing_here_are_refused() {
    let error = read(ROOMS, &[("jitter", "0.02")]).unwrap_err();
    assert_eq!(error, "--set scene.jitter=0.02: scenes of this kind have no scene.jitter; leave it out");
    let error = read(ROOMS, &[("transport", "local"), ("ranks", "2")]).unwrap_err();
    assert!(error.starts_with("--set run.transport=local: one rank at most, and this run has 2"), "{error}");
}

#[test]
fn what_is_not_toml_is_told_with_its_line() {
    let error = read("[scene]\nkind = \"rooms\"\nbodies = = 3\n", &[]).unwrap_err();
    assert!(error.starts_with("test.toml, line 3: "), "{error}");
    let error = read("[scene]\nkind = \"rooms\"\nkind = \"pile\"\n", &[]).unwrap_err();
    assert!(error.starts_with("test.toml, line 3: "), "{error}");
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let error = Config::load(Path::new("no/such/file.toml"), &[]).unwrap_err().to_string();
    assert!(error.starts_with("no/such/file.toml: cannot read this configuration: "), "{error}");
}

#[test]
fn options_are_named_as_they_were_written() {
    let overrides = [Override::option("--bodies", "scene.bodies", "-5")];
    let error = Config::read("test.toml", ROOMS, &overrides, super::read::Readers::new(true)).unwrap_err().to_string();
    assert!(error.starts_with("--bodies -5: must be a whole number within 100"), "{error}");
    assert_eq!(
        Override::parse("solver").unwrap_err().to_string().split(';').next(),
        Some("--set solver: write key=value, such as --set physics.substeps=8")
    );
}

#[test]
fn what_the_user_wrote_stays_on_one_line() {
    let error = read(ROOMS, &[("peer_timeout", "'''\na\r\nb'''")]).unwrap_err();
    assert!(error.starts_with("--set run.peer_timeout=''' a b''': must be "), "{error}");
    let error = read(ROOMS, &[("a\rb\u{1b}", "1")]).unwrap_err();
    assert!(error.starts_with("--set a b=1: unknown key"), "{error}");
    for text in ["\"a\\nb\" = 1", "[\"a\\nb\"]", "[run]\n\"a\\r\\nb\" = 1"] {
        let error = read(text, &[]).unwrap_err();
        assert!(error.contains("a b") && !error.contains('\r'), "{error}");
    }
    let error = Override::parse("a\nb").unwrap_err().to_string();
    assert!(error.starts_with("--set a b: write key=value"), "{error}");
}
