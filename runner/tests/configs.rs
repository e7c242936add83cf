//! The configurations that come with the program can all be run.

use atoll::config::{OutputConfig, Retiling};
use atoll::{Config, Override};
use std::path::{Path, PathBuf};

fn files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let files: Vec<PathBuf> = entries.filter(|path| path.is_file()).collect();
    assert!(!files.is_empty());
    files
}

#[test]
fn each_runs_a_step_at_a_small_size() {
    for path in files() {
        let config = Config::load(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
        // Large worlds, but for two that show a handful of boxes, those that are as Box2D's benchmarks have them, and the zoo.
        let box2d =
            ["large_pyramid.toml", "smash.toml", "compounds.toml", "junkyard.toml", "washer.toml", "tumbler.toml"];
        let mut few = ["stack.toml", "slope.toml", "zoo.toml"].iter().chain(&box2d);
        let few = few.any(|name| path.ends_with(name));
        assert_eq!(config.scene.bodies < 20_000, few, "{}", path.display());
        let text = std::fs::read_to_string(&path).unwrap();
        let config = Config::from_toml_str("small", &text, &[("bodies", "300"), ("steps", "1")]).unwrap();
        let summary = atoll::run(&config).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert_eq!((summary.bodies, summary.bodies_lost, summary.escaped), (300, 0, 0));
    }
}

#[test]
fn the_worlds_in_files_run_too() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/worlds");
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut run = 0;
    for path in entries.filter(|path| path.extension().is_some_and(|ending| ending == "toml")) {
        let overrides = [Override::set("steps", "60"), Override::set("tiles", "2x2"), Override::set("ranks", "2")];
        let config = Config::load(&path, &overrides).unwrap_or_else(|error| panic!("{error}"));
        let summary = atoll::run(&config).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert_eq!((summary.bodies, summary.bodies_lost, summary.escaped), (48, 0, 0), "{}", path.display());
        run += 1;
    }
    assert!(run > 0);
}

#[test]
fn so_do_the_worlds_of_each_shape() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/worlds/shapes");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let config = Config::load(&path, &[Override::set("steps", "200"), Override::set("tiles", "2x1")]).unwrap();
        let summary = atoll::run(&config).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert_eq!((summary.bodies_lost, summary.escaped), (0, 0), "{}", path.display());
    }
}

#[test]
fn what_the_full_example_comments_out_are_the_defaults() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/normal.toml");
    let text = std::fs::read_to_string(path).unwrap();
    let is_key = |line: &str| line.split_once(" = ").is_some_and(|(key, _)| !key.contains(' '));
    let uncommented: Vec<&str> =
        text.lines().map(|line| line.strip_prefix("# ").filter(|rest| is_key(rest)).unwrap_or(line)).collect();
    let explicit = Config::from_toml_str("explicit", &uncommented.join("\n"), &[]).unwrap();
    let mut implicit = Config::from_toml_str("implicit", &text, &[]).unwrap();
    assert!(uncommented.iter().filter(|line| line.starts_with("margin_cap")).count() == 1);
    // Spelt out, it says what the default would have chosen.
    implicit.run.transport = Some(implicit.transport());
    // By default there are none, and that no number can say.
    assert!(explicit.output.record_every.is_some() && explicit.output.checkpoint_every.is_some());
    assert_eq!(implicit.output, OutputConfig::default());
    assert_eq!(explicit.output.log_every, implicit.output.log_every);
    implicit.output = explicit.output;
    // Tiles follow the bodies only where somebody says how.
    assert_eq!((explicit.run.retiling, implicit.run.retiling), (Some(Retiling::ADAPTIVE), None));
    implicit.run.retiling = explicit.run.retiling;
    assert_eq!(explicit, implicit);
}
