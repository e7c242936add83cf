//! The program as its user meets it: what it refuses and in which words, exit codes, files.

use atoll_tests::program::{self, Ended, run, watched};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// Sections that make a small world, done at once.
const SMALL: &str = "[scene]\nkind = \"rooms\"\nbodies = 400\n\n[run]\nsteps = 5\ntiles = [2, 2]\n";
/// A world nobody waits for. What is refused with it is refused before anything heavy starts, or runs out of time.
const ENDLESS: &str = "[scene]\nkind = \"rooms\"\nbodies = 5_000_000\n\n[run]\nsteps = 4_000_000_000\nranks = 2\n";

/// What a scene may be called.
const KINDS: &str = r#""rooms", "pile", "pyramids", "sparse", "single-island", "stack" or "slope""#;

/// A folder with one configuration in it.
struct Desk(TempDir);

impl Desk {
    fn new(config: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("world.toml"), config).unwrap();
        Self(folder)
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    /// `atoll run world.toml`, started in the folder.
    fn atoll<'a>(&self, options: impl IntoIterator<Item = &'a str>) -> Command {
        let mut command = program::command();
        command.current_dir(self.path()).args(["run", "world.toml"]).args(options);
        command
    }

    fn files(&self) -> Vec<String> {
        let name = |entry: std::io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
        let mut names: Vec<String> = fs::read_dir(self.path()).unwrap().map(name).collect();
        names.sort();
        names
    }
}

/// Nothing on stdout, one line on stderr, and that one starts with `atoll: ` and what is expected.
#[track_caller]
fn assert_refused(ended: &Ended, code: i32, expected: &str) {
    let complaints = ended.complaints();
    let told = complaints.len() == 1 && complaints[0].starts_with(&format!("atoll: {expected}"));
    assert!(ended.code == Some(code) && ended.stdout.is_empty() && told, "expected {expected:?}, {code}: {ended}");
}

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
    for (option, key) in
        [("--bodies", "scene.bodies"), ("--steps", "run.steps"), ("--ranks", "run.ranks"), ("--threads", "run.threads")]
    {
        for value in ["0", "-3", "2.5", "nan", "inf", "1e30", "many", "2x2"] {
            refused(&format!("{option} {value}"), &format!("{option} {value}: must be a whole number within "));
            refused(&format!("--set {key}={value}"), &format!("--set {key}={value}: must be a whole number within "));
        }
    }
    refused("--bodies 99", "--bodies 99: must be a whole number within 100 to ");
    refused("--seed -1", "--seed -1: must be a whole number within 0 to ");
    refused("--tiles=-1x2", "--tiles -1x2: must be \"auto\", or columns and rows");
    for value in ["0x3", "3x0", "3", "axb", "3x2x1", "nan", "70000x1"] {
        refused(&format!("--tiles {value}"), &format!("--tiles {value}: must be \"auto\", or columns and rows"));
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
    refused(
        "--set sleep=true --tiles 2x2",
        "this configuration makes no world: sleep = true on 4 tiles: an island that sleeps must lie in one tile; use \
         tiles = [1, 1], or sleep = false",
    );
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
    refused("--json world.toml/summary.json", "--json world.toml/summary.json: ");
    refused("--timings no/such/folder/times.csv", "--timings no/such/folder/times.csv: ");
    refused("--timings .", "--timings .: it is a directory");
    refused("--log no/such/folder/log.csv", "--log no/such/folder/log.csv: ");
    refused("--log .", "--log .: it is a directory");
    refused("--log world.toml", "--log world.toml: that is the configuration of this run and must not be written over");
    refused("--json out --log out", "--log out: --json writes to the same file");
    refused("--json out --timings out", "--timings out: --json writes to the same file");
}

#[test]
fn a_state_that_is_not_finite_ends_all_ranks_with_exit_code_4() {
    let desk = Desk::new(SMALL);
    for ranks in ["1", "3"] {
        let options = ["--quiet", "--ranks", ranks, "--set", "hertz=1", "--set", "gravity=[3e38,3e38]"];
        let ended = run(&mut desk.atoll(options));
        assert_refused(&ended, 4, "step ");
        assert!(ended.stderr.contains("the state of body 16 is no longer finite"), "{ended}");
    }
}

/// They are computed like any others, and the user may want to know.
#[test]
fn bodies_that_escaped_are_told_at_the_end() {
    let desk = Desk::new(SMALL);
    let options = ["--quiet", "--set", "gravity=[1e6,0]", "--steps", "60"];
    let mut command = desk.atoll(options);
    let json = desk.path().join("summary.json");
    let ended = run(command.env("RUST_LOG", "off").arg("--json").arg(&json));
    let escaped = program::summary(&json)["escaped"].as_u64().unwrap();
    assert!(ended.code == Some(0) && escaped > 0 && ended.stdout.contains("state hash"), "{ended}");
    assert_eq!(ended.complaints().len(), 1, "{ended}");
    let line = format!("atoll: {escaped} of 400 bodies escaped: they ended outside of the domain, or of their room");
    assert!(ended.stderr.starts_with(&line), "{ended}");
}

#[cfg(target_os = "linux")]
#[test]
fn output_that_cannot_be_written_in_the_end_gives_exit_code_5() {
    let desk = Desk::new(SMALL);
    let ended = run(&mut desk.atoll(["--quiet", "--json", "/dev/full"]));
    assert_eq!((ended.code, ended.complaints().len()), (Some(5), 1), "{ended}");
    assert!(ended.stderr.starts_with("atoll: cannot write /dev/full: "), "{ended}");
    // The other file is written all the same.
    let ended = run(&mut desk.atoll(["--quiet", "--timings", "/dev/full", "--json", "summary.json"]));
    assert_eq!((ended.code, ended.complaints().len()), (Some(5), 1), "{ended}");
    assert!(ended.stderr.starts_with("atoll: cannot write /dev/full: "), "{ended}");
    assert_eq!(desk.files(), ["summary.json", "world.toml"]);
}

/// A header, then for each rank a line per phase and one for the whole step, which they add up to.
#[test]
fn timings_tell_where_the_time_of_each_rank_went() {
    let desk = Desk::new(SMALL);
    let options = ["--quiet", "--ranks", "2", "--threads", "2", "--timings", "times.csv"];
    let json = program::run_to_summary(&mut desk.atoll(options), &desk.path().join("summary.json"));
    let text = fs::read_to_string(desk.path().join("times.csv")).unwrap();
    assert_eq!(desk.files(), ["summary.json", "times.csv", "world.toml"]);
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("rank,threads,steps,phase,mean_ms,share"));
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let mut phases: Vec<&str> = json["phases"].as_object().unwrap().keys().map(String::as_str).collect();
    phases.sort_unstable();
    for rank in ["0", "1"] {
        let mine: Vec<_> = rows.iter().filter(|row| row[0] == rank).collect();
        assert!(mine.iter().all(|row| row.len() == 6 && row[1..3] == ["2", "5"]), "{text}");
        let (step, parts) = mine.split_last().unwrap();
        let mut named: Vec<&str> = parts.iter().map(|row| row[3]).collect();
        named.sort_unstable();
        assert_eq!((step[3], named), ("step", phases.clone()), "{text}");
        for column in [4, 5] {
            let number = |row: &[&str]| row[column].parse::<f64>().unwrap();
            let sum: f64 = parts.iter().map(|row| number(row)).sum();
            let whole = number(step);
            // Rounded to six places each.
            assert!(whole > 0.0 && (sum - whole).abs() <= 1e-4, "{sum} of {whole} in\n{text}");
        }
    }
    assert_eq!(rows.len(), 2 * (phases.len() + 1), "{text}");
}

/// What a value must be.
type Holds<'a> = &'a dyn Fn(&Value) -> bool;

/// Every key there must be.
#[test]
fn the_summary_has_all_its_keys() {
    let desk = Desk::new(SMALL);
    let json = program::run_to_summary(
        // Tiles that do not end where the rooms do, so that something passes between them.
        &mut desk.atoll(["--quiet", "--ranks", "2", "--threads", "2", "--tiles", "3x3"]),
        &desk.path().join("summary.json"),
    );
    let count = |value: &Value| value.is_u64();
    let number = |value: &Value| value.as_f64().is_some_and(f64::is_finite);
    let fraction = |value: &Value| value.as_f64().is_some_and(|number| (0.0..=1.0).contains(&number));
    let positive = |value: &Value| value.as_f64().is_some_and(|number| number > 0.0);
    let hash = |value: &Value| {
        let digit = |byte: u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte);
        value.as_str().is_some_and(|text| text.len() == 32 && text.bytes().all(digit))
    };
    let pair = |value: &Value| {
        value.as_array().is_some_and(|pair| pair.len() == 2 && pair.iter().all(|number| number.as_f64().is_some()))
    };
    let phases = |value: &Value| {
        let times = |phase: &Value| {
            let time = |key: &str| phase[key].as_f64().filter(|&ms| ms >= 0.0 && ms.is_finite());
            // With a little room: the mean is rounded apart from the greatest.
            time("mean_ms").zip(time("max_rank_ms")).is_some_and(|(mean, most)| mean <= most * (1.0 + 1e-9))
        };
        value.as_object().is_some_and(|phases| !phases.is_empty() && phases.values().all(times))
    };
    let keys: [(&str, Holds); 32] = [
        ("bodies", &|value| *value == 400),
        ("steps", &|value| *value == 5),
        ("ranks", &|value| *value == 2),
        ("threads", &|value| *value == 2),
        ("tiles", &|value| *value == serde_json::json!([3, 3])),
        ("transport", &|value| *value == "channel"),
        ("machine", &|value| value.as_str().is_some_and(|machine| machine.contains(std::env::consts::ARCH))),
        ("wall_s", &positive),
        ("ms_per_step", &positive),
        ("state_hash", &hash),
        ("contact_hash", &hash),
        ("bodies_lost", &|value| *value == 0),
        ("escaped", &|value| *value == 0),
        ("contacts", &count),
        ("border_contact_fraction", &fraction),
        ("ghosts", &count),
        ("migrations", &count),
        ("bytes_sent", &|value| value.as_u64().is_some_and(|bytes| bytes > 0)),
        ("mass", &positive),
        ("kinetic_energy", &positive),
        ("mean_half_v2", &positive),
        ("mean_spin2", &positive),
        ("momentum", &pair),
        ("max_penetration", &number),
        ("mean_penetration", &number),
        ("constraint_violation", &number),
        ("max_constraint_violation", &number),
        ("islands", &count),
        ("largest_island", &count),
        ("asleep", &count),
        ("colors", &count),
        ("phases", &phases),
    ];
    for (key, holds) in keys {
        let value = json.get(key).unwrap_or_else(|| panic!("{key} is missing"));
        assert!(holds(value), "{key} is {value}");
    }
    if cfg!(target_os = "linux") {
        assert!(positive(&json["peak_rss_bytes"]), "peak_rss_bytes is {}", json["peak_rss_bytes"]);
    }
    assert_eq!(desk.files(), ["summary.json", "world.toml"], "something else was left behind");
}

#[test]
fn a_world_larger_than_the_machine_is_refused_before_anything_heavy() {
    for options in ["--tiles 65535x65535", "--bodies 10000000000", "--tiles 60000x60000 --ranks 1024"] {
        refused(options, "too large for this machine: ");
    }
}

#[test]
fn quiet_leaves_only_the_report() {
    let desk = Desk::new(SMALL);
    let ended = run(&mut desk.atoll(["--quiet", "--json", "summary.json"]));
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{ended}");
    let json = program::summary(&desk.path().join("summary.json"));
    for key in ["state_hash", "contact_hash"] {
        assert!(ended.stdout.contains(json[key].as_str().unwrap()), "{ended}");
    }
    assert!(ended.stdout.contains("0 lost, 0 escaped"), "{ended}");
    assert!(!ended.stdout.contains('\u{1b}'), "escape sequences without a terminal: {ended}");
}

#[test]
fn the_log_is_plain_text_where_there_is_no_terminal() {
    let ended = run(Desk::new(SMALL).atoll(["--quiet", "--ranks", "2"]).env("RUST_LOG", "atoll=info"));
    assert_eq!(ended.code, Some(0), "{ended}");
    assert!(ended.stderr.contains("rank=1") && !ended.stderr.contains('\u{1b}'), "{ended}");
}

#[test]
fn a_summary_replaces_the_one_before() {
    let desk = Desk::new(SMALL);
    let path = desk.path().join("summary.json");
    fs::write(&path, "what was there before, and longer than it ".repeat(1000)).unwrap();
    let json = program::run_to_summary(&mut desk.atoll(["--seed", "7"]), &path);
    assert_eq!(json["seed"], 7);
}

#[test]
fn more_ranks_than_tiles_is_mentioned_once() {
    let desk = Desk::new(SMALL);
    let path = desk.path().join("summary.json");
    let alone = program::run_to_summary(&mut desk.atoll(["--quiet"]), &path);
    let ended = run(&mut desk.atoll(["--quiet", "--ranks", "9", "--json", "summary.json"]));
    assert_eq!((ended.code, ended.complaints().len()), (Some(0), 1), "{ended}");
    assert!(ended.stderr.starts_with("atoll: 5 of 9 ranks stay idle: there are only 4 tiles"), "{ended}");
    let many = program::summary(&path);
    assert_eq!((&many["ranks"], &many["state_hash"]), (&9.into(), &alone["state_hash"]));
}

/// Circles of a pile with the most jitter start up to 0.4 m inside each other. They are pushed apart at no more than
/// the push-out speed of 3 m/s, keep next to nothing of it, and none is thrown out.
#[test]
fn bodies_that_overlap_at_the_start_are_pushed_apart_gently() {
    let desk = Desk::new("[scene]\nkind = \"pile\"\nbodies = 500\njitter = 0.25\n\n[run]\nsteps = 1\ntiles = [3, 2]\n");
    let path = desk.path().join("summary.json");
    let after = |steps: &str| {
        program::run_to_summary(&mut desk.atoll(["--quiet", "--steps", steps, "--set", "gravity=[0,0]"]), &path)
    };
    let value = |json: &Value, key: &str| json[key].as_f64().unwrap();
    let first = after("1");
    assert!(value(&first, "max_penetration") > 0.2, "they hardly overlap: {first:#}");
    for steps in ["1", "5", "20", "60"] {
        let json = after(steps);
        // What a single body at the push-out speed would have, if all others were at rest.
        assert!(value(&json, "mean_half_v2") < 0.5 * 3.0 * 3.0 / 500.0, "after {steps} steps: {json:#}");
        assert_eq!(json["bodies_lost"], 0);
    }
    let last = after("60");
    assert!(value(&last, "max_penetration") < 0.05, "they still overlap: {last:#}");
}

#[test]
fn a_reader_that_has_seen_enough_is_no_failure() {
    let desk = Desk::new(SMALL);
    let mut command = desk.atoll(["--quiet"]);
    let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let status = watched("a run without a reader", move || child.wait().unwrap());
    assert_eq!(status.code(), Some(0));
}

#[test]
fn help_and_version() {
    for (arguments, expected) in [
        (&["--help"][..], "Usage: atoll <COMMAND>"),
        (&["help", "run"], "Usage: atoll run"),
        (&["--version"], concat!("atoll ", env!("CARGO_PKG_VERSION"))),
    ] {
        let ended = run(program::command().args(arguments));
        assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{ended}");
        assert!(ended.stdout.contains(expected), "{ended}");
    }
    let help = run(program::command().args(["run", "--help"])).stdout;
    for option in [
        "--ranks",
        "--threads",
        "--transport",
        "--tiles",
        "--bodies",
        "--steps",
        "--seed",
        "--set",
        "--out",
        "--record-every",
        "--checkpoint-every",
        "--overwrite",
        "--resume",
        "--restarts",
        "--json",
        "--timings",
    ] {
        assert!(help.contains(option), "{option} is not in the help:\n{help}");
    }
    // Nothing asked: the help, as an error.
    let ended = run(&mut program::command());
    assert!(ended.code == Some(2) && ended.stderr.contains("Usage: atoll <COMMAND>"), "{ended}");
}

/// The first command of the README, at a size that suits a test, from wherever one stands.
#[test]
fn the_first_command_works_from_anywhere() {
    let elsewhere = tempfile::tempdir().unwrap();
    let absolute = program::root().join("configs/quickstart.toml");
    let from = |folder: &Path, config: &Path| {
        let json = elsewhere.path().join("summary.json");
        let mut command = program::command();
        command.current_dir(folder).arg("run").arg(config).args(["--quiet", "--bodies", "2000", "--steps", "10"]);
        let json = program::run_to_summary(&mut command, &json);
        assert_eq!((&json["ranks"], &json["transport"]), (&4.into(), &"channel".into()));
        json["state_hash"].clone()
    };
    let at_root = from(program::root(), Path::new("configs/quickstart.toml"));
    assert_eq!(from(elsewhere.path(), &absolute), at_root);
    assert_eq!(from(&program::root().join("core"), Path::new("../configs/quickstart.toml")), at_root);
}
