//! Results by which all builds and machines are judged: the hashes in `golden.txt`, of every configuration in `configs/`,
//! made small, and of every choice that changes bits.
//!
//! Other tests compare Atoll with itself as it is; these compare it with what it was. So a change of compiler, of a
//! library, of one constant shows. Where results change on purpose,
//!
//! ```sh
//! ATOLL_GOLDEN=renew cargo test --release -p atoll-tests --test golden
//! ```
//!
//! writes the file anew, and CHANGELOG.md says **results**.

use atoll::Config;
use atoll_core::{Exchange, Hashes, Instructions, Material, Rot, Shape};
use atoll_tests::program::{self, watched};
use atoll_tests::scenes;
use atoll_tests::world::Scene;
use glam::{DVec2, Vec2};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;

/// Keys and values, as after `--set`.
type Overrides = &'static [(&'static str, &'static str)];

/// Every configuration, small.
const CONFIGS: &[(&str, Overrides)] = &[
    ("compounds", &[("bodies", "300"), ("steps", "140"), ("tiles", "3x4")]),
    ("junkyard", &[("bodies", "1200"), ("steps", "140"), ("tiles", "5x2")]),
    ("large_pyramid", &[("bodies", "820"), ("base", "40"), ("steps", "60")]),
    ("normal", &[("bodies", "4000"), ("steps", "80")]),
    ("pile", &[("bodies", "1500"), ("steps", "80")]),
    ("pyramids", &[("bodies", "1100"), ("steps", "100")]),
    ("quickstart", &[("bodies", "3000"), ("steps", "80")]),
    ("report", &[("bodies", "3000"), ("steps", "80"), ("tiles", "4x4")]),
    ("single_island", &[("bodies", "2500"), ("steps", "60")]),
    ("skewed", &[("bodies", "4000"), ("steps", "80")]),
    ("slope", &[("bodies", "20"), ("steps", "80"), ("tiles", "2x2")]),
    ("smash", &[("bodies", "2000"), ("steps", "80")]),
    ("sparse", &[("bodies", "4000"), ("steps", "100")]),
    ("stack", &[("steps", "80"), ("tiles", "2x2")]),
    ("tumbler", &[("bodies", "1000"), ("steps", "100"), ("tiles", "2x2")]),
    ("washer", &[("bodies", "1800"), ("steps", "100"), ("tiles", "3x3")]),
    ("zoo", &[("bodies", "700"), ("steps", "100"), ("tiles", "5x2")]),
];

/// What changes bits, on scenes where it does: first bodies that meet in flight, then bodies that rest.
const CHOICES: &[(&str, Overrides)] = &[
    ("quickstart", &[("bodies", "2000"), ("steps", "100"), ("tiles", "1x1")]),
    ("quickstart", &[("bodies", "2000"), ("steps", "100"), ("tiles", "3x2")]),
    ("quickstart", &[("bodies", "2000"), ("steps", "100"), ("tiles", "8x8")]),
    ("quickstart", &[("bodies", "2000"), ("steps", "100"), ("tiles", "3x2"), ("seed", "2")]),
    ("quickstart", &[("bodies", "2000"), ("steps", "100"), ("tiles", "3x2"), ("exchange", "substep")]),
    ("quickstart", &[("bodies", "2000"), ("steps", "100"), ("tiles", "3x2"), ("ghosts", "frozen")]),
    ("quickstart", &[("bodies", "2000"), ("steps", "100"), ("tiles", "3x2"), ("solver", "pgs")]),
    (
        "quickstart",
        &[
            ("bodies", "2000"),
            ("steps", "100"),
            ("tiles", "3x2"),
            ("gravity", "[1.5, -4]"),
            ("linear_damping", "0.1"),
            ("angular_damping", "0.2"),
            ("max_linear_speed", "12"),
            ("max_angular_speed", "9"),
            ("recycle_distance", "0"),
            ("sort_interval", "7"),
            ("hertz", "75"),
            ("substeps", "3"),
        ],
    ),
    ("skewed", &[("bodies", "3000"), ("steps", "80"), ("tiles", "2x1"), ("max_bodies", "150"), ("retile_every", "5")]),
    ("skewed", &[("bodies", "3000"), ("steps", "80"), ("tile_count", "10"), ("retile_every", "5")]),
    ("pile", &[("bodies", "1000"), ("steps", "80"), ("tile_count", "9"), ("retile_every", "3")]),
    ("zoo", &[("bodies", "500"), ("steps", "100"), ("tile_count", "7"), ("retile_every", "4")]),
    ("pile", &[("bodies", "1000"), ("steps", "80"), ("tiles", "1x1")]),
    ("pile", &[("bodies", "1000"), ("steps", "80"), ("tiles", "3x2")]),
    ("pile", &[("bodies", "1000"), ("steps", "80"), ("tiles", "8x8")]),
    ("pile", &[("bodies", "1000"), ("steps", "80"), ("tiles", "3x2"), ("seed", "2")]),
    ("pile", &[("bodies", "1000"), ("steps", "80"), ("tiles", "3x2"), ("exchange", "step")]),
    ("pile", &[("bodies", "1000"), ("steps", "80"), ("tiles", "3x2"), ("exchange", "step"), ("ghosts", "frozen")]),
    ("pile", &[("bodies", "1000"), ("steps", "80"), ("tiles", "3x2"), ("solver", "pgs")]),
    ("pile", &[("bodies", "1000"), ("steps", "80"), ("tiles", "2x1"), ("max_bodies", "60"), ("retile_every", "3")]),
    ("pyramids", &[("bodies", "550"), ("steps", "80"), ("tiles", "1x1"), ("sleep", "true")]),
    ("zoo", &[("bodies", "500"), ("steps", "100"), ("tiles", "3x1"), ("exchange", "step")]),
    ("zoo", &[("bodies", "500"), ("steps", "100"), ("tiles", "3x1"), ("solver", "pgs")]),
    ("zoo", &[("bodies", "500"), ("steps", "100"), ("tiles", "2x1"), ("max_bodies", "60"), ("retile_every", "5")]),
    ("zoo", &[("bodies", "300"), ("steps", "150"), ("tiles", "3x2"), ("sleep", "true"), ("sleep_speed", "0.3")]),
];

/// A world of the library on some tiles.
struct World {
    name: &'static str,
    scene: fn() -> Scene,
    grid: (u32, u32),
    exchange: Exchange,
    steps: u32,
}

/// What no configuration has.
const WORLDS: [World; 5] = [
    World { name: "bouncing exchange=step", scene: bouncing, grid: (3, 2), exchange: Exchange::Step, steps: 120 },
    World { name: "bouncing exchange=substep", scene: bouncing, grid: (3, 2), exchange: Exchange::Substep, steps: 120 },
    World { name: "scales exchange=substep", scene: scales, grid: (2, 1), exchange: Exchange::Substep, steps: 200 },
    World { name: "large exchange=step", scene: large, grid: (5, 4), exchange: Exchange::Step, steps: 200 },
    World { name: "large exchange=substep", scene: large, grid: (5, 4), exchange: Exchange::Substep, steps: 200 },
];

/// A case by name, as the golden file has it: the configuration, and what is set in it.
fn name(config: &str, overrides: Overrides) -> String {
    let set: Vec<String> = overrides.iter().map(|(key, value)| format!("{key}={}", value.replace(' ', ""))).collect();
    format!("{config} {}", set.join(" "))
}

fn cases() -> impl Iterator<Item = (&'static str, Overrides)> {
    CONFIGS.iter().chain(CHOICES).copied()
}

fn file() -> PathBuf {
    program::root().join("tests/golden.txt")
}

/// Hashes of states and of contacts by case.
type Results = BTreeMap<String, [String; 2]>;

fn golden() -> Results {
    let text = std::fs::read_to_string(file()).unwrap();
    let entry = |line: &str| {
        let [case, state, contacts] = line.split('|').map(str::trim).collect::<Vec<_>>()[..] else {
            panic!("golden.txt: not a case and two hashes: {line}");
        };
        (case.to_owned(), [state.to_owned(), contacts.to_owned()])
    };
    text.lines().filter(|line| !line.starts_with('#')).map(entry).collect()
}

fn renew(results: &Results) {
    let mut text =
        "# Hashes of states and contacts, of runs with these settings. See tests/tests/golden.rs.\n".to_owned();
    let names = cases().map(|(config, overrides)| name(config, overrides));
    for case in names.chain(WORLDS.map(|world| world.name.to_owned())) {
        let [state, contacts] = &results[&case];
        writeln!(text, "{case} | {state} | {contacts}").unwrap();
    }
    std::fs::write(file(), text).unwrap();
}

/// Bodies that bounce, and walls that stand aslant.
fn bouncing() -> Scene {
    let mut scene = scenes::room(12, 5);
    scene.kinds.iter_mut().for_each(|kind| kind.material.restitution = 0.7);
    scene.statics.iter_mut().for_each(|wall| wall.rotation = Rot::from_angle(0.03));
    scene
}

/// A ball upon a border under a heap of balls a fiftieth of its size: who touches it may be far from the tile beside.
fn scales() -> Scene {
    let mut scene = Scene::new(DVec2::new(10.0, 8.0), -10.0);
    scene.half = DVec2::new(10.0, 8.0);
    let material = Material::default();
    scene.wall(DVec2::new(10.0, -1.0), (24.0, 2.0), 0.0, material);
    for x in [-1.0, 21.0] {
        scene.wall(DVec2::new(x, 8.0), (2.0, 20.0), 0.0, material);
    }
    let kinds = [5.0, 0.1].map(|radius| scene.kind(Shape::circle(radius), material));
    scene.body(kinds[0], DVec2::new(10.2, 5.0), Vec2::ZERO);
    for k in 0..1500 {
        let place = DVec2::new(0.2 + 0.22 * f64::from(k % 90), 10.5 + 0.25 * f64::from(k / 90));
        scene.body(kinds[1], place, Vec2::new(0.0, -10.0));
    }
    scene
}

/// The same where that ball widens no halo.
fn large() -> Scene {
    let mut scene = scales();
    scene.params.large_radius = 1.0;
    scene
}

impl World {
    fn hashes(&self, instructions: Instructions) -> [String; 2] {
        let mut scene = (self.scene)();
        scene.params.instructions = instructions;
        let mut sim = scene.start_on(self.grid, self.exchange);
        sim.run(self.steps);
        let Hashes { state, contact } = sim.world.hashes();
        [format!("{state:032x}"), format!("{contact:032x}")]
    }
}

/// The hashes of every case, by runs in this process on some set of instructions, as a configuration and as the library
/// call it.
fn results((word, instructions): (&'static str, Instructions)) -> Results {
    let run = |(config, overrides): (&str, Overrides)| {
        let path = format!("configs/{config}.toml");
        let text = std::fs::read_to_string(program::root().join(&path)).unwrap();
        let all: Vec<_> = overrides.iter().copied().chain([("instructions", word)]).collect();
        let config_read = Config::from_toml_str(&path, &text, &all).unwrap();
        let case = name(config, overrides);
        let summary =
            watched(&case, move || atoll::run(&config_read)).unwrap_or_else(|error| panic!("{case}: {error}"));
        (case, [summary.state_hash, summary.contact_hash])
    };
    let worlds = WORLDS.iter().map(|world| (world.name.to_owned(), world.hashes(instructions)));
    cases().map(run).chain(worlds).collect()
}

/// Compares, and says what to do.
fn judge(results: &Results, what: &str) {
    let golden = golden();
    let differs = |(case, hashes): &(&String, &[String; 2])| golden.get(*case) != Some(hashes);
    let other: Vec<&String> = results.iter().filter(differs).map(|(case, _)| case).collect();
    assert!(
        other.is_empty() && golden.len() == results.len(),
        "{what}: {} of {} results are not those of tests/golden.txt:\n  {}\nIf nothing was meant to change, this is a bug: \
         find the change that did it. If results change on purpose, renew the file with\n  ATOLL_GOLDEN=renew cargo test \
         --release -p atoll-tests --test golden\nand say **results** in CHANGELOG.md, with the reason.",
        other.len().max(golden.len().abs_diff(results.len())),
        results.len(),
        other.iter().map(|case| case.as_str()).collect::<Vec<_>>().join("\n  ")
    );
}

#[test]
fn results_are_golden() {
    let results = results(("auto", Instructions::Auto));
    if std::env::var_os("ATOLL_GOLDEN").is_some_and(|wish| wish == "renew") {
        renew(&results);
    }
    judge(&results, "this build");
}

/// Whole runs on lanes that are not this processor's widest. What `auto` takes without AVX2 is portable, and AVX2 without AVX-512.
#[test]
#[cfg(target_arch = "x86_64")]
fn results_are_golden_on_portable_lanes() {
    if is_x86_feature_detected!("avx2") {
        judge(&results(("portable", Instructions::Portable)), "portable lanes");
    }
}

#[test]
#[cfg(target_arch = "x86_64")]
fn results_are_golden_on_avx2() {
    if is_x86_feature_detected!("avx512f") {
        judge(&results(("avx2", Instructions::Avx2)), "AVX2");
    }
}

/// A choice that changed nothing would guard nothing.
#[test]
fn every_case_differs() {
    let golden = golden();
    let states: std::collections::BTreeSet<&String> = golden.values().map(|[state, _]| state).collect();
    assert_eq!(states.len(), cases().count() + WORLDS.len(), "two cases of golden.txt have one state");
}

#[test]
fn every_configuration_is_among_them() {
    let files = std::fs::read_dir(program::root().join("configs")).unwrap();
    let files =
        files.map(|entry| entry.unwrap().path()).filter(|path| path.extension().is_some_and(|end| end == "toml"));
    let mut names: Vec<String> = files.map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned()).collect();
    names.sort();
    let known: Vec<&str> = CONFIGS.iter().map(|(config, _)| *config).collect();
    assert_eq!(names, known, "give every file in configs/ a line in CONFIGS of tests/golden.rs, and renew golden.txt");
}
