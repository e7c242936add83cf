//! Worlds by chance, of all that a scene, a configuration and commands may say: whatever computes them, they are the same.

use atoll_tests::program::{self, Ended};
use proptest::prelude::*;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::tempdir;

const WIDTH: f64 = 30.0;
const HEIGHT: f64 = 20.0;

#[derive(Clone, Debug)]
struct Any {
    kinds: Vec<String>,
    statics: Vec<String>,
    /// Rows of the table of bodies, without their names and kinds; and a number that chooses the kind.
    bodies: Vec<(String, usize)>,
    /// When, and what; names and kinds are left over whole numbers.
    acts: Vec<(u32, Act)>,
    /// Of the configuration.
    keys: Vec<String>,
    gravity: [f64; 2],
    steps: u32,
}

#[derive(Clone, Debug)]
enum Act {
    Add(String),
    Remove(usize),
    Strike(usize, f64),
    Throw(usize, f64),
    Change(usize, usize),
    Gravity(f64),
    Look([f64; 2], [f64; 2]),
    Follow(usize),
}

fn rounded(range: std::ops::Range<f64>) -> impl Strategy<Value = f64> {
    range.prop_map(|x| (1000.0 * x).round() / 1000.0)
}

/// A key with one of these values, or nothing said of it.
fn maybe(key: &'static str, values: &'static [&'static str]) -> impl Strategy<Value = String> {
    prop_oneof![3 => Just(String::new()), 1 => prop::sample::select(values).prop_map(move |x| format!("{key} = {x}\n"))]
}

fn shape() -> impl Strategy<Value = String> {
    let side = || prop_oneof![8 => rounded(0.2..1.0), 1 => rounded(1.0..4.0)];
    let corner = || (rounded(-0.6..0.6), rounded(-0.6..0.6)).prop_map(|(x, y)| format!("[{x}, {y}]"));
    // Three that make a triangle whatever the others are.
    let corners = prop::collection::vec(corner(), 0..6).prop_map(|more| {
        [vec!["[0.5, 0.0]".into(), "[-0.2, 0.5]".into(), "[-0.3, -0.4]".into()], more].concat().join(", ")
    });
    let rounding = prop_oneof![Just(String::new()), rounded(0.02..0.2).prop_map(|r| format!("radius = {r}\n"))];
    prop_oneof![
        (side(), side()).prop_map(|(width, height)| format!("box = [{width}, {height}]\n")),
        side().prop_map(|side| format!("circle = {}\n", 0.5 * side)),
        (side(), side()).prop_map(|(length, side)| format!("capsule = [{length}, {}]\n", 0.3 * side)),
        (corners, rounding).prop_map(|(corners, rounding)| format!("polygon = [{corners}]\n{rounding}")),
        (side(), rounded(-0.5..0.5), rounded(-3.0..3.0)).prop_map(|(side, x, angle)| format!(
            "parts = [{{ box = [{side}, 0.2] }}, {{ circle = 0.2, at = [{x}, 0.1] }}, \
             {{ capsule = [0.5, 0.1], at = [-0.3, 0.3], angle = {angle} }}]\n"
        )),
    ]
}

/// What it is made of, and whom it touches.
fn matter() -> impl Strategy<Value = String> {
    let keys = (
        maybe("friction", &["0.0", "0.3", "1.0"]),
        maybe("restitution", &["0.1", "0.5", "0.9"]),
        maybe("density", &["0.3", "3.0"]),
        maybe("categories", &["1", "2", "3"]),
        maybe("mask", &["1", "3"]),
        maybe("group", &["-1", "1"]),
        prop_oneof![9 => Just(String::new()), 1 => Just("sensor = true\n".to_owned())],
    );
    keys.prop_map(|(a, b, c, d, e, f, g)| [a, b, c, d, e, f, g].concat())
}

fn any_kind() -> impl Strategy<Value = String> {
    let motion = (
        maybe("gravity_scale", &["0.0", "-1.0", "2.0"]),
        maybe("linear_damping", &["0.5"]),
        maybe("angular_damping", &["0.5"]),
        maybe("fixed_rotation", &["true"]),
    );
    (shape(), matter(), motion).prop_map(|(shape, matter, (a, b, c, d))| [shape, matter, a, b, c, d].concat())
}

fn any_static() -> impl Strategy<Value = String> {
    let moves = maybe(
        "path",
        &[
            "{ line = [1.5, -0.5] }",
            "{ sine = [4.0, 1.0], period = 2.0, phase = 0.3 }",
            "{ circle = 2.0, period = -3.0, turning = 1.0 }",
            "{ turning = -4.0 }",
        ],
    );
    let one = (shape(), matter(), maybe("surface_speed", &["-2.0", "1.0"]), moves, rounded(-3.0..3.0), anywhere())
        .prop_map(|(shape, matter, belt, moves, angle, [x, y])| {
            format!("{shape}{matter}{belt}{moves}x = {x}\ny = {y}\nangle = {angle}\n")
        });
    let chain = prop::collection::vec(rounded(0.0..0.4 * HEIGHT), 2..10).prop_map(|heights| {
        let place = |(i, y): (usize, &f64)| format!("[{}, {y}]", 3.0 * i as f64);
        format!("chain = [{}]\n", heights.iter().enumerate().map(place).collect::<Vec<_>>().join(", "))
    });
    prop_oneof![12 => one, 1 => chain]
}

fn anywhere() -> impl Strategy<Value = [f64; 2]> {
    [rounded(0.3..WIDTH - 0.3), rounded(0.3..HEIGHT - 0.3)]
}

fn any_body() -> impl Strategy<Value = String> {
    let speed = || prop_oneof![4 => Just(0.0), 4 => rounded(-5.0..5.0), 1 => rounded(-90.0..90.0)];
    (anywhere(), rounded(-3.0..3.0), speed(), speed(), rounded(-4.0..4.0))
        .prop_map(|([x, y], angle, vx, vy, omega)| format!("{x},{y},{angle},{vx},{vy},{omega}"))
}

fn any_act() -> impl Strategy<Value = Act> {
    let who = any::<u16>().prop_map(usize::from);
    prop_oneof![
        any_body().prop_map(Act::Add),
        who.clone().prop_map(Act::Remove),
        (who.clone(), rounded(-5.0..5.0)).prop_map(|(who, blow)| Act::Strike(who, blow)),
        (who.clone(), rounded(-80.0..80.0)).prop_map(|(who, speed)| Act::Throw(who, speed)),
        (who.clone(), who).prop_map(|(who, kind)| Act::Change(who, kind)),
        rounded(-10.0..5.0).prop_map(Act::Gravity),
        (anywhere(), anywhere()).prop_map(|(from, to)| Act::Look(from, to)),
        any::<u16>().prop_map(|who| Act::Follow(who.into())),
    ]
}

/// Tiles, and what else changes bits.
fn any_keys() -> impl Strategy<Value = Vec<String>> {
    let tiles = prop_oneof![
        1 => Just("tiles=[1,1]").prop_map(str::to_owned),
        4 => (1..7, 1..5).prop_map(|(columns, rows)| format!("tiles=[{columns},{rows}]")),
        2 => (2..9, 1..20).prop_map(|(count, every)| format!("tile_count={count} retile_every={every}")),
        2 => (20..100, 1..20).prop_map(|(most, every)| format!("tiles=\"adaptive\" max_bodies={most} retile_every={every}")),
    ];
    let others = (
        prop::sample::select(&["exchange=step", "exchange=substep"][..]),
        prop::sample::select(&["", "", "", "solver=pgs"][..]),
        prop::sample::select(&["", "substeps=2", "hertz=120", "sort_interval=1", "recycle_distance=0"][..]),
        prop::sample::select(&["", "", "sleep=true sleep_speed=0.5 sleep_time=0.1"][..]),
    );
    (tiles, others).prop_map(|(tiles, (a, b, c, d))| {
        let all = [tiles.as_str(), a, b, c, d].join(" ");
        all.split_whitespace().map(str::to_owned).collect()
    })
}

fn any_world() -> impl Strategy<Value = Any> {
    let kinds = prop::collection::vec(any_kind(), 1..5);
    let statics = prop_oneof![2 => 0..8_usize, 1 => 60..120_usize]
        .prop_flat_map(|count| prop::collection::vec(any_static(), count));
    let bodies = prop::collection::vec((any_body(), any::<u16>().prop_map(usize::from)), 1..300);
    let acts = prop_oneof![Just(0..1_usize), Just(1..20_usize)]
        .prop_flat_map(|count| prop::collection::vec((0..50_u32, any_act()), count));
    let gravity = [prop_oneof![3 => Just(0.0), 1 => Just(1.5)], prop_oneof![3 => Just(-10.0), 1 => Just(0.0)]];
    (kinds, statics, bodies, acts, any_keys(), gravity, 30..60_u32).prop_map(
        |(kinds, statics, bodies, acts, keys, gravity, steps)| Any {
            kinds,
            statics,
            bodies,
            acts,
            keys,
            gravity,
            steps,
        },
    )
}

impl Any {
    /// Four walls and all else, in this folder; the bodies in this order or the other.
    fn write(&self, folder: &Path, reversed: bool) -> PathBuf {
        fs::create_dir_all(folder).unwrap();
        let mut text = format!(
            "format = \"atoll-scene/1\"\ndomain = [[0.0, 0.0], [{WIDTH}, {HEIGHT}]]\n[bodies]\npath = \"bodies.csv\"\n\
             [physics]\ngravity = {:?}\n",
            self.gravity
        );
        for kind in &self.kinds {
            text += &format!("[[kinds]]\n{kind}");
        }
        let wall = |x: f64, y: f64, width: f64, height: f64| format!("box = [{width}, {height}]\nx = {x}\ny = {y}\n");
        let walls = [
            wall(0.5 * WIDTH, -0.5, WIDTH + 2.0, 1.0),
            wall(0.5 * WIDTH, HEIGHT + 0.5, WIDTH + 2.0, 1.0),
            wall(-0.5, 0.5 * HEIGHT, 1.0, HEIGHT),
            wall(WIDTH + 0.5, 0.5 * HEIGHT, 1.0, HEIGHT),
        ];
        for fixed in walls.iter().chain(&self.statics) {
            text += &format!("[[statics]]\n{fixed}");
        }
        let row = |(id, (row, kind)): (usize, &(String, usize))| format!("{id},{},{row}\n", kind % self.kinds.len());
        let mut rows: Vec<String> = self.bodies.iter().enumerate().map(row).collect();
        if reversed {
            rows.reverse();
        }
        fs::write(folder.join("bodies.csv"), "id,kind,x,y,angle,vx,vy,omega\n".to_owned() + &rows.concat()).unwrap();
        fs::write(folder.join("world.toml"), text).unwrap();
        folder.join("world.toml")
    }

    /// What is done, as lines of a file.
    fn commands(&self) -> String {
        let mut acts = self.acts.clone();
        acts.sort_by_key(|(step, _)| *step);
        let lines = |(number, (step, act)): (usize, &(u32, Act))| {
            let name = |who: usize| who % self.bodies.len();
            let all: Vec<(&str, Value)> = match act {
                Act::Add(row) => {
                    let figures: Vec<f64> = row.split(',').map(|figure| figure.parse().unwrap()).collect();
                    let [x, y, angle, vx, vy, omega] = figures[..] else { unreachable!("it has six") };
                    let id = 1000 + number;
                    vec![("add", json!({"id": id, "x": x, "y": y, "angle": angle, "vx": vx, "vy": vy, "omega": omega}))]
                }
                Act::Remove(who) => vec![("remove", json!(name(*who)))],
                Act::Strike(who, blow) => {
                    vec![("impulse", json!({"id": name(*who), "x": blow, "y": 1.0, "angular": 0.1}))]
                }
                Act::Throw(who, speed) => {
                    vec![("velocity", json!({"id": name(*who), "vx": speed, "vy": 1.0, "omega": 1.0}))]
                }
                Act::Change(who, kind) => vec![("kind", json!({"id": name(*who), "kind": kind % self.kinds.len()}))],
                Act::Gravity(y) => vec![("gravity", json!([0.0, y]))],
                Act::Look(from, to) => {
                    let [low, high] = [f64::min, f64::max].map(|of| [of(from[0], to[0]), of(from[1], to[1])]);
                    vec![
                        ("ray", json!({"from": from, "to": to})),
                        ("rectangle", json!({"low": low, "high": high})),
                        ("point", json!(from)),
                    ]
                }
                Act::Follow(who) => vec![
                    ("touching", json!(name(*who))),
                    ("body", json!(name(*who))),
                    ("contacts", json!(who % 2 == 0)),
                    ("sensors", json!(who % 3 == 0)),
                ],
            };
            all.into_iter().map(|(what, value)| format!("{}\n", json!({"step": step, what: value}))).collect::<String>()
        };
        acts.iter().enumerate().map(lines).collect()
    }

    fn run(&self, world: &Path, steps: u32, how: &[&str]) -> Ended {
        let mut command = program::command();
        let steps = steps.to_string();
        command.arg("run").arg(world).args(["--quiet", "--steps", &steps]).args(how);
        self.keys.iter().for_each(|key| {
            command.args(["--set", key]);
        });
        if !self.acts.is_empty() {
            command.arg("--commands").arg(world.parent().unwrap().with_file_name("acts.jsonl")).arg("--skip-refused");
            command.arg("--answers").arg(world.with_file_name("answers.jsonl"));
        }
        program::run(&mut command)
    }
}

/// Exit code and hashes.
fn outcome(ended: &Ended) -> (Option<i32>, Vec<&str>) {
    let hashes = ended.stdout.lines().filter(|line| line.starts_with("state hash") || line.starts_with("contact hash"));
    (ended.code, hashes.collect())
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: std::env::var("PROPTEST_CASES").map_or(24, |cases| cases.parse().unwrap()),
        max_shrink_iters: 200,
        ..ProptestConfig::default()
    })]

    #[test]
    fn whatever_computes_them_they_are_the_same(any in any_world()) {
        let folder = tempdir().unwrap();
        let [world, turned] = [("as-made", false), ("turned", true)]
            .map(|(name, reversed)| any.write(&folder.path().join(name), reversed));
        fs::write(folder.path().join("acts.jsonl"), any.commands()).unwrap();
        let alone = any.run(&world, any.steps, &["--ranks", "1", "--threads", "1"]);
        // A world that flies apart does so everywhere.
        let (code, hashes) = outcome(&alone);
        prop_assert!(code == Some(0) && hashes.len() == 2 || code == Some(4), "{alone}");
        let answers = |world: &Path| fs::read_to_string(world.with_file_name("answers.jsonl")).unwrap_or_default();
        let heard = answers(&world);
        let way = "--ranks 3 --threads 2 --set balance=shuffled --set parallel=islands";
        let spread = any.run(&world, any.steps, &way.split(' ').collect::<Vec<_>>());
        prop_assert_eq!(outcome(&spread), (code, hashes.clone()), "on three ranks: {}", spread.stderr);
        prop_assert!(code == Some(4) || answers(&world) == heard, "other answers on three ranks");
        let other = "--ranks 1 --threads 2 --set instructions=portable --set broad_phase=quadtree --set islands=dfs \
                     --set parallel=coloring";
        let otherwise = any.run(&turned, any.steps, &other.split(' ').collect::<Vec<_>>());
        prop_assert_eq!(outcome(&otherwise), (code, hashes.clone()), "computed otherwise: {}", otherwise.stderr);
        let others = answers(&turned);
        let differs = heard.lines().zip(others.lines()).find(|(one, other)| one != other);
        prop_assert!(code == Some(4) || others == heard, "other answers where it is computed otherwise: {differs:?}");
        if code == Some(0) {
            let out = folder.path().join("out");
            let first = any.run(&world, any.steps / 2, &["--checkpoint-every", "10", "--out", out.to_str().unwrap()]);
            prop_assert_eq!(first.code, Some(0), "{}", first);
            let steps = any.steps.to_string();
            let mut rest = program::command();
            rest.args(["run", "--quiet", "--steps", &steps, "--ranks", "2", "--skip-refused", "--resume"]).arg(&out);
            let rest = program::run(&mut rest);
            prop_assert_eq!(outcome(&rest), (code, hashes), "gone on with: {}", rest.stderr);
        }
    }
}
