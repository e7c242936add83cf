//! The same bits whatever computes them: any number of ranks and threads, any transport, either build profile, any
//! environment. What is equal is equal for one tile grid; worlds on different grids agree physically, and that is the
//! business of other tests.
//!
//! Equal `state_hash` and `contact_hash` mean the same bodies, the same contacts and so the same future.

use atoll::{Config, Summary};
use atoll_tests::program::{self, Profile, watched};
use std::collections::BTreeSet;
use std::process::Command;

/// A scene small enough to run a hundred times, and large enough that everything happens in it.
#[derive(Clone, Copy)]
struct Scene {
    /// Path of its configuration, from the root of the repository.
    config: &'static str,
    bodies: u64,
    steps: u64,
}

/// Bodies that fly, cross borders and collide.
const QUICKSTART: Scene = Scene { config: "configs/quickstart.toml", bodies: 3000, steps: 40 };
/// Bodies that fall onto each other, with borders through the heap and `exchange = "substep"`.
const PILE: Scene = Scene { config: "configs/pile.toml", bodies: 1000, steps: 60 };

const GRIDS: [&str; 3] = ["1x1", "3x2", "8x8"];
/// The first of these on one rank of one thread is what all others are compared with. Seven ranks share three times two
/// tiles with one of them idle.
const RANKS: [u64; 5] = [1, 2, 3, 4, 7];
const THREADS: [u64; 2] = [1, 2];

/// State hash and contact hash.
type Hashes = (String, String);

impl Scene {
    /// A run in this process.
    fn run(self, overrides: &[(&str, &str)]) -> Summary {
        let path = program::root().join(self.config);
        let text = std::fs::read_to_string(&path).unwrap();
        let (bodies, steps) = (self.bodies.to_string(), self.steps.to_string());
        let mut all = vec![("bodies", bodies.as_str()), ("steps", &steps)];
        all.extend(overrides);
        let what = format!("{} with {overrides:?}", self.config);
        let config = Config::from_toml_str(self.config, &text, &all).unwrap();
        let summary = watched(&what, move || atoll::run(&config)).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_eq!((summary.bodies, summary.steps, summary.bodies_lost), (self.bodies, self.steps, 0), "{what}");
        summary
    }

    /// A run of the program; what an override says for [`run`](Self::run), an option says here.
    fn command(self, profile: Profile, options: &str) -> Command {
        let mut command = program::command_of(profile);
        command.args(["run", self.config, "--quiet"]).args(options.split_whitespace());
        command.args(["--bodies", &self.bodies.to_string(), "--steps", &self.steps.to_string()]);
        command
    }
}

fn hashes(summary: &Summary) -> Hashes {
    (summary.state_hash.clone(), summary.contact_hash.clone())
}

/// Runs a command to its end and returns the hashes of its summary.
fn hashes_of(mut command: Command) -> Hashes {
    let folder = tempfile::tempdir().unwrap();
    let json = program::run_to_summary(&mut command, &folder.path().join("summary.json"));
    let text = |key: &str| json[key].as_str().unwrap_or_else(|| panic!("{key} is missing")).to_owned();
    (text("state_hash"), text("contact_hash"))
}

/// Every number of ranks and threads, on every transport that can have it, gives the hashes of one thread alone.
fn ranks_threads_and_transports_agree(scene: Scene, grid: &str) {
    let alone = scene.run(&[("tiles", grid), ("ranks", "1"), ("threads", "1"), ("transport", "local")]);
    something_happened(&alone);
    for ranks in RANKS {
        for threads in THREADS {
            for transport in if ranks == 1 { &["local", "channel"][..] } else { &["channel"][..] } {
                let (ranks, threads) = (ranks.to_string(), threads.to_string());
                let how = [("tiles", grid), ("ranks", &ranks), ("threads", &threads), ("transport", transport)];
                let summary = scene.run(&how);
                assert_eq!(hashes(&summary), hashes(&alone), "{} with {how:?}", scene.config);
                // Counts of physics agree too; counts of messages need not.
                let counts =
                    |summary: &Summary| (summary.contacts, summary.ghosts, summary.migrations, summary.escaped);
                assert_eq!(counts(&summary), counts(&alone), "{} with {how:?}", scene.config);
                assert_eq!(summary.momentum, alone.momentum, "{} with {how:?}", scene.config);
            }
        }
    }
}

/// Without contacts, ghosts and migrants, equal hashes would say little.
fn something_happened(summary: &Summary) {
    assert!(summary.contacts > summary.bodies / 100, "only {} contacts", summary.contacts);
    if summary.tiles != [1, 1] {
        let crossed = summary.ghosts > Some(0) && summary.migrations > 0 && summary.border_contact_fraction > 0.0;
        assert!(crossed, "nothing at the borders of {:?} tiles", summary.tiles);
    }
}

#[test]
fn quickstart_on_one_tile() {
    ranks_threads_and_transports_agree(QUICKSTART, "1x1");
}

#[test]
fn quickstart_on_3x2_tiles() {
    ranks_threads_and_transports_agree(QUICKSTART, "3x2");
}

#[test]
fn quickstart_on_8x8_tiles() {
    ranks_threads_and_transports_agree(QUICKSTART, "8x8");
}

#[test]
fn pile_on_one_tile() {
    ranks_threads_and_transports_agree(PILE, "1x1");
}

#[test]
fn pile_on_3x2_tiles() {
    ranks_threads_and_transports_agree(PILE, "3x2");
}

#[test]
fn pile_on_8x8_tiles() {
    ranks_threads_and_transports_agree(PILE, "8x8");
}

/// Tiles that threads help with: all alone, several at once, and one or two that are left over; contacts of one island in each, enough
/// for a crew, and of many.
#[test]
fn threads_that_help_show_nowhere() {
    let large = Scene { config: "configs/large_pyramid.toml", bodies: 5050, steps: 8 };
    let rooms = Scene { config: "configs/quickstart.toml", bodies: 20_000, steps: 12 };
    for (scene, grids) in [(large, ["1x1", "3x1", "7x1"]), (rooms, ["1x1", "5x1", "4x4"])] {
        for (grid, exchange) in grids.into_iter().zip(["step", "substep", "step"]) {
            let run =
                |threads| scene.run(&[("tiles", grid), ("ranks", "1"), ("exchange", exchange), ("threads", threads)]);
            let alone = run("1");
            for threads in ["2", "3", "6", "16"] {
                assert_eq!(hashes(&run(threads)), hashes(&alone), "{} on {grid}, {threads} threads", scene.config);
            }
        }
    }
}

/// The default grid follows from the configuration, never from ranks or threads.
#[test]
fn the_default_grid_is_the_same_for_everyone() {
    for scene in [QUICKSTART, PILE] {
        let alone = scene.run(&[("ranks", "1"), ("tiles", "auto")]);
        let shared = scene.run(&[("ranks", "3"), ("threads", "2"), ("tiles", "auto")]);
        assert_eq!((alone.tiles, hashes(&alone)), (shared.tiles, hashes(&shared)), "{}", scene.config);
    }
}

/// The optimizer may reorder, fuse or vectorize nothing that shows.
#[test]
fn debug_and_release_agree() {
    for scene in [QUICKSTART, PILE] {
        for grid in GRIDS {
            let here = hashes(&scene.run(&[("tiles", grid), ("ranks", "1")]));
            for how in ["--ranks 1 --threads 1", "--ranks 3 --threads 2"] {
                let there = hashes_of(scene.command(Profile::OTHER, &format!("--tiles {grid} {how}")));
                assert_eq!(there, here, "{} on {grid} tiles, {:?}, {how}", scene.config, Profile::OTHER);
            }
        }
    }
}

/// Nothing of the environment reaches the state: not the size of a thread pool somebody set, not what the allocator
/// fills memory with, not the language, not whether anybody listens to the log.
#[test]
fn the_environment_does_not_matter() {
    let environments: &[&[(&str, &str)]] = &[
        &[("RAYON_NUM_THREADS", "1")],
        &[("RAYON_NUM_THREADS", "5"), ("LC_ALL", "de_DE.UTF-8"), ("TZ", "Asia/Kathmandu")],
        // glibc's: every allocated byte starts as, and every freed one becomes, something else than zero.
        &[("MALLOC_PERTURB_", "165"), ("MALLOC_ARENA_MAX", "1")],
        &[("RUST_LOG", "atoll=debug"), ("RUST_BACKTRACE", "0")],
    ];
    for scene in [QUICKSTART, PILE] {
        let command = || scene.command(Profile::CURRENT, "--tiles 3x2 --ranks 2 --threads 2");
        let usual = hashes_of(command());
        for environment in environments {
            let mut command = command();
            command.envs(environment.iter().copied());
            assert_eq!(hashes_of(command), usual, "{} with {environment:?}", scene.config);
        }
    }
}

/// The hashes see what they should: another seed, another number of bodies or of steps, another setting.
#[test]
fn another_world_has_other_hashes() {
    // Of the heap so many steps that one body more, at its top, touches others.
    for scene in [QUICKSTART, Scene { steps: 90, ..PILE }] {
        let on_tiles = |scene: Scene, key: &str, value: &str| hashes(&scene.run(&[("tiles", "3x2"), (key, value)]));
        let all = [
            on_tiles(scene, "seed", "1"),
            on_tiles(scene, "seed", "2"),
            on_tiles(scene, "substeps", "3"),
            on_tiles(Scene { bodies: scene.bodies + 1, ..scene }, "seed", "1"),
            on_tiles(Scene { steps: scene.steps + 1, ..scene }, "seed", "1"),
        ];
        let states: BTreeSet<&String> = all.iter().map(|(state, _)| state).collect();
        let contacts: BTreeSet<&String> = all.iter().map(|(_, contacts)| contacts).collect();
        assert_eq!((states.len(), contacts.len()), (all.len(), all.len()), "{}: {all:#?}", scene.config);
    }
}
