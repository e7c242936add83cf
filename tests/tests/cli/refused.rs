//! What the program refuses before it begins, and in which words.

use crate::{Desk, SMALL, assert_refused};
use atoll_tests::program::{self, run};
use std::fs;

/// A world nobody waits for. What is refused with it is refused before anything heavy starts, or runs out of time.
const ENDLESS: &str = "[scene]\nkind = \"rooms\"\nbodies = 5_000_000\n\n[run]\nsteps = 4_000_000_000\nranks = 2\n";

/// What a scene may be called.
const KINDS: &str = r#""rooms", "pile", "pyramids", "sparse", "single-island", "stack", "smash", "compounds", "junkyard", "washer", "tumbler", "zoo", "slope" or "file""#;

/// The endless world with some options, separated by spaces, is refused as bad input.
#[track_caller]
fn refused(options: &str, expected: &str) {
    let desk = Desk::new(ENDLESS);
    assert_refused(&run(&mut desk.atoll(options.split_whitespace())), 2, expected);
    assert_eq!(desk.files(), ["world.toml"], "{options} left something behind");
}

/// A configuration is refused as bad input.
#[track_caller]
fn file_refused(config: &str, expected: &str) {
    let ended = run(&mut Desk::new(config).atoll([]));
    assert_refused(&ended, 2, &format!("world.toml{expected}"));
}

#[test]
fn sizes_must_be_positive() {
    let (number, or_auto) = ("a whole number within ", "\"auto\", or a whole number within 1 to 1024");
    for (option, key, must) in [
        ("--bodies", "scene.bodies", number),
        ("--steps", "run.steps", number),
        ("--ranks", "run.ranks", number),
        ("--threads", "run.threads", or_auto),
    ] {
        for value in ["0", "-3", "2.5", "nan", "inf", "1e30", "many", "2x2"] {
            refused(&format!("{option} {value}"), &format!("{option} {value}: must be {must}"));
            refused(&format!("--set {key}={value}"), &format!("--set {key}={value}: must be {must}"));
        }
    }
    refused("--bodies 99", "--bodies 99: must be a whole number within 100 to ");
    refused("--seed -1", "--seed -1: must be a whole number within 0 to ");
    refused("--tiles=-1x2", "--tiles -1x2: must be \"auto\", \"bisected\", \"adaptive\", or columns and rows");
    for value in ["0x3", "3x0", "3", "axb", "3x2x1", "nan", "70000x1"] {
        refused(
            &format!("--tiles {value}"),
            &format!("--tiles {value}: must be \"auto\", \"bisected\", \"adaptive\", or columns and rows"),
        );
    }
}

#[test]
fn physics_must_make_sense() {
    for key in ["hertz", "contact_hertz", "max_linear_speed", "max_angular_speed"] {
        for value in ["0", "-1", "nan"] {
            refused(&format!("--set {key}={value}"), &format!("--set physics.{key}={value}: must be "));
        }
    }
    for key in [
        "linear_damping",
        "angular_damping",
        "speculative_distance",
        "recycle_distance",
        "restitution_threshold",
        "margin_floor",
        "margin_cap",
        "push_out_speed",
        "contact_damping_ratio",
    ] {
        for value in ["-1", "nan", "inf"] {
            refused(&format!("--set {key}={value}"), &format!("--set physics.{key}={value}: must be "));
        }
        refused(&format!("--set {key}=1e39"), &format!("--set physics.{key}=1e39: must be a number of at most 3.4e38"));
        refused(&format!("--set {key}=\"1\""), &format!("--set physics.{key}=\"1\": must be a number"));
    }
    for value in ["0", "-4", "65", "nan"] {
        refused(&format!("--set substeps={value}"), &format!("--set physics.substeps={value}: must be "));
    }
    for value in ["-10", "[0]", "[0,0,0]", "[nan,0]", "[0,inf]"] {
        refused(&format!("--set gravity={value}"), &format!("--set physics.gravity={value}: must be "));
    }
    for (key, value) in [("power", "0"), ("power", "nan"), ("power", "11")] {
        refused(&format!("--set {key}={value}"), &format!("--set scene.{key}={value}: must be a number within "));
    }
    refused("--peer-timeout 0", "--peer-timeout 0: must be a number within ");
    refused("--peer-timeout nan", "--peer-timeout nan: must be a number within ");
    refused("--set sort_interval=-1", "--set physics.sort_interval=-1: must be a whole number within ");
    refused("--set sleep=maybe", "--set physics.sleep=maybe: must be true or false");
}

#[test]
fn unknown_names_come_with_a_suggestion() {
    refused("--set scene.kind=room", &format!("--set scene.kind=room: must be {KINDS}; did you mean rooms?"));
    refused("--set kind=ocean", &format!("--set scene.kind=ocean: must be {KINDS}"));
    refused("--set sovler=soft-step", "--set sovler=soft-step: unknown key; did you mean physics.solver?");
    refused("--set physics.substep=3", "--set physics.substep=3: unknown key; did you mean physics.substeps?");
    refused("--set run.bodies=3", "--set run.bodies=3: unknown key; did you mean scene.bodies?");
    refused(
        "--set exchange=substeps",
        "--set physics.exchange=substeps: must be \"step\" or \"substep\"; did you mean ",
    );
    refused(
        "--transport chanel",
        "--transport chanel: must be \"local\", \"channel\", \"iceoryx2\" or \"mpi\"; did you mean channel?",
    );
    refused("--rnks 2", "unexpected argument '--rnks' found; a similar argument exists: '--ranks'");
    refused("--frobnicate", "unexpected argument '--frobnicate' found");

    file_refused(
        "[scene]\nkind = \"piel\"\n",
        &format!(": scene.kind = \"piel\": must be {KINDS}; did you mean pile?"),
    );
    file_refused("[scene]\nknid = \"pile\"\n", ": scene.knid = \"pile\": unknown key; did you mean scene.kind?");
    file_refused("[sceen]\nkind = \"pile\"\n", ": unknown section [sceen]; did you mean [scene]?");
    file_refused("kind = \"pile\"\n", ": kind = \"pile\": unknown key; did you mean scene.kind?");
    file_refused("[run]\nsteps = 5\n", &format!(": scene.kind is missing: must be {KINDS}"));
}

#[test]
fn values_that_do_not_go_together_are_refused() {
    refused("--transport local --ranks 2", "--transport local: one rank at most, and this run has 2");
    refused("--set jitter=0.1", "--set scene.jitter=0.1: scenes of this kind have no scene.jitter");
    refused("--set kind=pile --set power=2", "--set scene.power=2: scenes of this kind have no scene.power");
    refused("--set base=5", "--set scene.base=5: scenes of this kind have no scene.base");
    refused("--set kind=slope --set angle=90", "--set scene.angle=90: must be a number within 0 to 60");
    let frozen = "--set physics.ghosts=frozen: must be \"dynamic\" with exchange = \"substep\"";
    refused("--set ghosts=frozen --set exchange=substep", &format!("{frozen}; or use exchange = \"step\""));
    // Nobody asked for it: the scene does.
    let by_default = format!("{frozen}, the default of this scene; or use exchange = \"step\"");
    refused("--set ghosts=frozen --set kind=pile", &by_default);
    refused("--set margin_floor=2", "physics.margin_cap = 0.5 (the default): must be finite and at least margin_floor");
}

#[test]
fn usage_takes_one_line_too() {
    refused("--set", "a value is required for '--set <KEY=VALUE>'");
    refused("--set solver", "--set solver: write key=value");
    refused("--set =3", "--set =3: unknown key");
    refused("--set run=3", "--set run=3: unknown key");
    refused("--bodies", "a value is required for '--bodies <N>'");
    refused("--bodies 1000 --bodies 2000", "the argument '--bodies <N>' cannot be used multiple times");
    refused("another.toml", "unexpected argument 'another.toml' found");
    let desk = Desk::new(SMALL);
    for (arguments, expected) in [
        (&["run"][..], "the following required arguments were not provided: <CONFIG>"),
        (&["runn", "world.toml"], "unrecognized subcommand 'runn'; a similar subcommand exists: 'run'"),
        (&["world.toml"], "unrecognized subcommand 'world.toml'"),
    ] {
        assert_refused(&run(program::command().current_dir(desk.path()).args(arguments)), 2, expected);
    }
    assert_refused(&run(desk.atoll([]).env("RUST_LOG", "a=b=c")), 2, "RUST_LOG = a=b=c: ");
    assert_refused(&run(&mut desk.atoll(["--set", "hertz=a\nb"])), 2, "--set physics.hertz=a b: must be a number");
    assert_refused(&run(&mut desk.atoll(["--json", "no\nfolder/x"])), 2, "--json no folder/x: ");
}

#[test]
fn configurations_that_cannot_be_read_are_named() {
    let desk = Desk::new(SMALL);
    fs::write(desk.path().join("latin1.toml"), b"# caf\xe9\n[scene]\nkind = \"pile\"\n").unwrap();
    for name in ["missing.toml", "no/such/folder/world.toml", "latin1.toml", "."] {
        let ended = run(program::command().current_dir(desk.path()).args(["run", name]));
        assert_refused(&ended, 2, &format!("{name}: cannot read this configuration: "));
    }
    file_refused("[scene]\nkind = \"rooms\"\nbodies = = 3\n", ", line 3: ");
    file_refused("[scene\nkind = \"rooms\"\n", ", line 1: ");
    file_refused("[scene]\nkind = \"rooms\"\nkind = \"pile\"\n", ", line 3: ");
    file_refused("[scene]\nkind = \"rooms\n\n\nbodies = 5\n", ", line 2: ");
    file_refused("[scene]\nkind = \"rooms\"\nbodies = nan\n", ": scene.bodies = nan: must be a whole number within ");
    file_refused("[scene]\nkind = \"rooms\"\nbodies = [\n1,\n2 ]\n", ": scene.bodies = [");
    file_refused("", ": scene.kind is missing");
    // What only a scene has makes it one.
    let scene = "domain = [[0, 0], [9, 9]]\n[[kinds]]\ncircle = 1\n";
    file_refused(scene, ": format: is missing: must be \"atoll-scene/1\", which says that this is a scene");
    file_refused(
        &format!("format = \"atol-scene/1\"\n{scene}"),
        ": format = \"atol-scene/1\": must be \"atoll-scene/1\"",
    );
}

#[test]
fn options_for_a_folder_need_one() {
    let folder = "the following required arguments were not provided: <--out <DIR>|--resume <DIR>>";
    for option in ["--record-every 5", "--checkpoint-every 5", "--restarts 1"] {
        refused(option, folder);
    }
    let logged = "the following required arguments were not provided: <--log <FILE>|--out <DIR>|--resume <DIR>>";
    refused("--log-every 5", logged);
    refused("--overwrite", "the following required arguments were not provided: --out <DIR>");
    refused("--out a --resume a", "the argument '--out <DIR>' cannot be used with '--resume <DIR>'");
    let must = "must be a whole number within 1 to 4294967295";
    for key in ["record_every", "checkpoint_every", "log_every"] {
        let option = format!("--{}", key.replace('_', "-"));
        refused(&format!("--out a {option} 0"), &format!("{option} 0: {must}"));
        refused(&format!("--set {key}=1.5"), &format!("--set output.{key}=1.5: {must}"));
    }
}

#[test]
fn a_path_that_cannot_be_written_is_refused_before_anything_heavy() {
    refused("--json no/such/folder/summary.json", "--json no/such/folder/summary.json: ");
    refused("--json .", "--json .: it is a directory");
    refused("--json -", "--json -: for standard output name /dev/stdout");
    refused("--json world.toml/summary.json", "--json world.toml/summary.json: ");
    refused("--timings no/such/folder/times.csv", "--timings no/such/folder/times.csv: ");
    refused("--timings .", "--timings .: it is a directory");
    refused("--log no/such/folder/log.csv", "--log no/such/folder/log.csv: ");
    refused("--log .", "--log .: it is a directory");
    refused("--log world.toml", "--log world.toml: that is the configuration of this run and must not be written over");
    refused("--json out --log out", "--log out: --json writes to the same file");
    refused("--json out --timings ./out", "--timings ./out: --json writes to the same file");
}

#[test]
fn commands_are_not_written_over() {
    let (desk, acts) = (Desk::new(SMALL), "{\"step\": 2, \"gravity\": [0, -1]}\n");
    fs::write(desk.path().join("acts.jsonl"), acts).unwrap();
    for option in ["--answers", "--json", "--log", "--timings", "--trace"] {
        let ended = run(&mut desk.atoll(["--commands", "acts.jsonl", option, "acts.jsonl"]));
        let expected =
            format!("{option} acts.jsonl: that is the file of this run's commands and must not be written over");
        assert_refused(&ended, 2, &expected);
        assert_eq!(fs::read_to_string(desk.path().join("acts.jsonl")).unwrap(), acts, "{option}");
    }
}

#[test]
fn a_world_larger_than_the_machine_is_refused_before_anything_heavy() {
    for options in ["--tiles 65535x65535", "--bodies 10000000000", "--tiles 60000x60000 --ranks 1024"] {
        refused(options, "too large for this machine: ");
    }
}
