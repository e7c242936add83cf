//! What a run leaves to look at: the trace of its threads, and the page about it, opened in a browser where there is one.

use atoll_tests::program::{self, Ended, run};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::fs;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use tempfile::{TempDir, tempdir};

/// Sections that make a small world with borders that bodies cross.
const SMALL: &str = "[scene]\nkind = \"rooms\"\nbodies = 600\n\n[run]\nsteps = 12\ntiles = [3, 3]\n";

/// A folder with one configuration in it.
fn desk(config: &str) -> TempDir {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("world.toml"), config).unwrap();
    folder
}

/// `atoll`, started in a folder, with arguments separated by spaces.
fn atoll(folder: &Path, line: &str) -> Ended {
    run(program::command().current_dir(folder).args(line.split_whitespace()))
}

/// One complete event of a trace.
#[derive(Clone, PartialEq, Debug)]
struct Slice {
    name: String,
    start: f64,
    end: f64,
    args: Value,
}

/// The slices of each process and thread, in the order of the file; and the names of these.
type Trace = (BTreeMap<(u64, u64), Vec<Slice>>, BTreeSet<String>);

fn trace(file: &Path) -> Trace {
    let json = program::summary(file);
    let (mut slices, mut names) = (BTreeMap::<_, Vec<_>>::new(), BTreeSet::new());
    for event in json["traceEvents"].as_array().unwrap() {
        let number = |key: &str| event[key].as_f64().unwrap_or_else(|| panic!("no {key} in {event}"));
        let thread = (event["pid"].as_u64().unwrap(), event["tid"].as_u64().unwrap());
        // Viewers keep zero for the system's idle process.
        assert!(thread.0 > 0 && thread.1 > 0, "{event}");
        match event["ph"].as_str().unwrap() {
            "M" if event["name"].as_str().unwrap().ends_with("_name") => {
                names.insert(event["args"]["name"].as_str().unwrap().to_owned());
            }
            "M" => {}
            "X" => {
                let (start, name) = (number("ts"), event["name"].as_str().unwrap().to_owned());
                let slice = Slice { name, start, end: start + number("dur"), args: event["args"].clone() };
                slices.entry(thread).or_default().push(slice);
            }
            other => panic!("{other} in {event}"),
        }
    }
    (slices, names)
}

/// Each slice begins after the one before it, and ends before all those end that had not ended when it began.
#[track_caller]
fn assert_nest(slices: &[Slice]) {
    // Microseconds to three places, as floating-point numbers.
    let rounding = 1e-4;
    let (mut open, mut before) = (Vec::<&Slice>::new(), 0.0);
    for slice in slices {
        assert!(slice.start >= before && slice.end >= slice.start, "{slice:?}");
        before = slice.start;
        while open.last().is_some_and(|last| last.end <= slice.start + rounding && last.end < slice.end) {
            open.pop();
        }
        if let Some(last) = open.last() {
            assert!(slice.end <= last.end + rounding, "{slice:?} begins in {last:?} and ends after it");
        }
        open.push(slice);
    }
}

/// A trace of two ranks with two threads each, which made `steps`. Says which threads did anything.
fn assert_whole(file: &Path, steps: &[u64]) -> Vec<(u64, u64)> {
    let (slices, names) = trace(file);
    assert!(
        slices.keys().all(|(rank, thread)| (1..=2).contains(rank) && (1..=2).contains(thread)),
        "{:?}",
        slices.keys()
    );
    let expected = ["rank 0", "rank 1", "thread 0", "thread 1"];
    assert!(expected.iter().all(|name| names.contains(*name)), "{names:?}");
    slices.values().for_each(|slices| assert_nest(slices));
    for rank in [1, 2] {
        let made: Vec<u64> = slices[&(rank, 1)]
            .iter()
            .filter(|slice| slice.name == "step")
            .filter_map(|one| one.args["step"].as_u64())
            .collect();
        assert_eq!(made, steps, "rank {rank}");
        let of_rank = || slices.iter().filter(|(thread, _)| thread.0 == rank).flat_map(|(_, slices)| slices);
        let done: BTreeSet<&str> = of_rank().map(|slice| slice.name.as_str()).collect();
        for phase in atoll_core::Phase::ALL.map(atoll_core::Phase::name).into_iter().chain(["wait", "output"]) {
            assert!(done.contains(phase), "no {phase} on rank {rank}: {done:?}");
        }
        // Stages are of tiles.
        let stages = of_rank().filter(|slice| slice.name == "narrow_phase");
        assert!(stages.clone().count() > 0 && stages.clone().all(|slice| slice.args["tile"].as_u64() < Some(36)));
        let in_exchange =
            slices[&(rank, 1)].windows(2).any(|pair| pair[0].name == "exchange" && pair[1].name == "wait");
        assert!(in_exchange, "waiting is a part of the exchange");
    }
    slices.into_keys().collect()
}

#[test]
fn a_trace_has_every_phase_of_every_thread_and_changes_nothing() {
    // Enough for a thread to wake up in time.
    let desk = desk(&SMALL.replace("600", "8000").replace("[3, 3]", "[6, 6]"));
    let options = "--ranks 2 --threads 2 --set exchange=substep --record-every 1 --quiet";
    let mut threads = BTreeSet::new();
    // A thread that comes too late for the little there is to do does nothing; not so every time.
    for _ in 0..20 {
        let line = format!("run world.toml {options} --out a --overwrite --trace t.json --trace-steps 4..10");
        let with = atoll(desk.path(), &line);
        assert_eq!((with.code, with.complaints().len()), (Some(0), 0), "{with}");
        threads.extend(assert_whole(&desk.path().join("t.json"), &[4, 5, 6, 7, 8, 9]));
        if threads.len() == 4 {
            break;
        }
    }
    assert_eq!(threads.into_iter().collect::<Vec<_>>(), [(1, 1), (1, 2), (2, 1), (2, 2)]);
    let without = atoll(desk.path(), &format!("run world.toml {options} --out b"));
    assert_eq!(without.code, Some(0), "{without}");
    let same = atoll(desk.path(), "diff a b");
    assert_eq!(same.code, Some(0), "{same}");
}

#[cfg(feature = "iceoryx2")]
#[test]
fn ranks_in_processes_of_their_own_have_one_clock() {
    let desk = desk(SMALL);
    let options = "--ranks 2 --threads 2 --set exchange=substep --record-every 1 --out a --quiet --transport iceoryx2";
    let ended = atoll(desk.path(), &format!("run world.toml {options} --trace t.json"));
    assert_eq!((ended.code, ended.complaints().len()), (Some(0), 0), "{ended}");
    assert_whole(&desk.path().join("t.json"), &(0..10).collect::<Vec<_>>());
    // Nobody leaves a step's first exchange before all have entered it.
    let doubt = 2.0
        * program::summary(&desk.path().join("t.json"))["otherData"]["clocks_differ_by_at_most_us"].as_f64().unwrap();
    let (slices, _) = trace(&desk.path().join("t.json"));
    let waits = |rank| slices[&(rank, 1)].iter().filter(|slice| slice.name == "wait");
    for (a, b) in waits(1).zip(waits(2)) {
        assert!(a.start <= b.end + doubt && b.start <= a.end + doubt, "{a:?} {b:?} {doubt}");
    }
}

#[test]
fn a_trace_is_of_the_steps_that_were_made() {
    let desk = desk(SMALL);
    let tell = |line: &str| atoll(desk.path(), &format!("run world.toml --quiet --trace t.json {line}"));
    let ended = atoll(desk.path(), "run world.toml --quiet --out a --checkpoint-every 6");
    assert_eq!(ended.code, Some(0), "{ended}");
    let none = tell("--resume a --steps 14 --trace-steps 1..2");
    let expected =
        "atoll: --trace: none of the steps that were to be traced was made; choose others with --trace-steps";
    assert!(none.code == Some(0) && none.complaints().contains(&expected), "{none}");
    assert!(trace(&desk.path().join("t.json")).0.is_empty());
    // Whatever log lines are asked for.
    let quiet = run(program::command().current_dir(desk.path()).env("RUST_LOG", "off").args([
        "run",
        "world.toml",
        "--quiet",
        "--trace",
        "t.json",
    ]));
    assert_eq!((quiet.code, quiet.complaints().len()), (Some(0), 0), "{quiet}");
    let (slices, _) = trace(&desk.path().join("t.json"));
    assert_eq!(slices[&(1, 1)].iter().filter(|slice| slice.name == "step").count(), 10);
    for (line, code, expected) in [
        (
            "--trace-steps 5..5",
            2,
            "atoll: invalid value '5..5' for '--trace-steps <A..B>': write A..B, such as 100..110",
        ),
        (
            "--trace-steps 90..95",
            2,
            "atoll: --trace-steps 90..95: the last step that is to be made is 11, counted from 0; choose",
        ),
        ("--json t.json", 2, "atoll: --trace t.json: --json writes to the same file"),
        (
            "--trace-steps 1..2 --trace /nowhere/t.json",
            2,
            "atoll: the argument '--trace <FILE>' cannot be used multiple times",
        ),
    ] {
        let ended = tell(line);
        assert_eq!(ended.code, Some(code), "{ended}");
        assert!(ended.complaints().len() == 1 && ended.stderr.starts_with(expected), "{ended}");
    }
    let ended = atoll(desk.path(), "run world.toml --trace nowhere/t.json");
    assert!(ended.code == Some(2) && ended.stderr.starts_with("atoll: --trace nowhere/t.json: "), "{ended}");
}

/// Figures of a page about one run that has recorded and logged.
const FIGURES: [&str; 13] = [
    "first_picture",
    "last_picture",
    "energy",
    "contacts",
    "overlap",
    "momentum",
    "angular_momentum",
    "islands",
    "tiles",
    "phases",
    "step_time",
    "balance",
    "ranks",
];

/// A browser without a window. One that was named must be there.
fn browser() -> Option<OsString> {
    let named = std::env::var_os("ATOLL_BROWSER").filter(|name| !name.is_empty());
    let usual = ["chromium-headless-shell", "chromium", "chromium-browser", "google-chrome"];
    let names = named.clone().map_or_else(|| usual.map(OsString::from).to_vec(), |named| vec![named]);
    let runs = |name: &OsString| {
        let command = Command::new(name)
            .arg("--version")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        command.is_ok_and(|status| status.success())
    };
    let found = names.into_iter().find(runs);
    assert!(found.is_some() || named.is_none(), "ATOLL_BROWSER, {named:?}, does not start");
    found
}

/// What a browser makes of a page. The test fails where it complains, or asks anybody for anything.
fn opened(browser: &OsString, page: &Path) -> String {
    // Whoever asks for something asks here, and is sent away.
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let (proxy, asked) = (listener.local_addr().unwrap(), Arc::new(AtomicUsize::new(0)));
    let count = Arc::clone(&asked);
    thread::spawn(move || {
        for _ in listener.incoming() {
            count.fetch_add(1, Ordering::SeqCst);
        }
    });
    let profile = tempdir().unwrap();
    let mut command = Command::new(browser);
    command.args([
        "--headless",
        "--no-sandbox",
        "--disable-dev-shm-usage",
        "--disable-gpu",
        "--disable-background-networking",
    ]);
    command.args([
        "--disable-component-update",
        "--no-first-run",
        "--disable-sync",
        "--enable-logging=stderr",
        "--v=0",
    ]);
    command.arg(format!("--user-data-dir={}", profile.path().display()));
    command.arg(format!("--proxy-server=http://{proxy}"));
    command.arg("--proxy-bypass-list=<-loopback>");
    command.arg("--dump-dom").arg(format!("file://{}", page.display()));
    let ended = run(program::at_home(&mut command));
    assert_eq!(ended.code, Some(0), "{ended}");
    assert!(!ended.stderr.contains("CONSOLE"), "{}", ended.stderr);
    assert_eq!(asked.load(Ordering::SeqCst), 0, "the page asks somebody for something");
    ended.stdout
}

#[test]
fn a_page_tells_of_a_run_and_needs_no_other_file() {
    let desk = desk(SMALL);
    let made = |line: &str| {
        let ended = atoll(desk.path(), &format!("{line} --quiet"));
        assert_eq!(ended.code, Some(0), "{ended}");
    };
    made("run world.toml --out a --ranks 2 --record-every 4 --log-every 1");
    made("run world.toml --out b --ranks 2 --record-every 4 --log-every 1 --seed 2");
    let page = |line: &str| {
        let ended = atoll(desk.path(), &format!("report {line}"));
        assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{ended}");
        fs::read_to_string(desk.path().join("page.html")).unwrap()
    };
    let one = page("a --out page.html");
    let two = page("a b --out page.html");
    let pages = [(&one, false), (&two, true)];
    for (text, is_two) in pages {
        let figures = FIGURES.map(|name| match (name, is_two) {
            ("first_picture" | "last_picture" | "phases" | "ranks", true) => format!("{name}_b"),
            _ => name.to_owned(),
        });
        for name in figures.iter().map(String::as_str).chain(is_two.then_some("deviation")) {
            assert!(text.contains(&format!("<figure id=\"{name}\"")), "no figure {name}");
        }
        // Pictures are letters of any kind.
        let words: String =
            text.split("base64,").map(|part| part.split_once('"').map_or(part, |(_, rest)| rest)).collect();
        for outside in ["http:", "https:", "<script", "@import", "url(", "src=\"/", "NaN", "no values"] {
            assert!(!words.contains(outside), "{outside}");
        }
    }
    let Some(browser) = browser() else {
        eprintln!("==> left out: the page in a browser; install chromium-headless-shell, or name one in ATOLL_BROWSER");
        return;
    };
    for (text, _) in pages {
        let file = desk.path().join("page.html");
        fs::write(&file, text).unwrap();
        let document = opened(&browser, &file);
        let count = |what: &str| [text, &document].map(|text| text.matches(what).count());
        for what in ["<figure ", "<svg ", "<img ", "<path ", "<table"] {
            let [written, shown] = count(what);
            assert!(written > 0 && written == shown, "{what}: {written} written, {shown} there");
        }
    }
    // That the browser would have told is known.
    let bad = desk.path().join("bad.html");
    fs::write(&bad, "<script>console.error('seen')</script>").unwrap();
    let told = std::panic::catch_unwind(|| opened(&browser, &bad));
    assert!(told.is_err(), "an error in the console is not seen");
    fs::write(&bad, "<img src=\"http://example.org/x.png\">").unwrap();
    let told = std::panic::catch_unwind(|| opened(&browser, &bad));
    assert!(told.is_err(), "a request is not seen");
}

#[test]
fn a_page_says_what_is_missing_and_refuses_what_is_no_run() {
    let desk = desk(SMALL);
    let ended = atoll(desk.path(), "run world.toml --out a --quiet --record-every 3 --checkpoint-every 3");
    assert_eq!(ended.code, Some(0), "{ended}");
    let run = desk.path().join("a");
    // As a killed run leaves it, with a hostile remark in its configuration.
    for file in ["summary.json", "log.csv", "timings.csv"] {
        fs::remove_file(run.join(file)).unwrap();
    }
    let toml = fs::read_to_string(run.join("run.toml")).unwrap();
    fs::write(run.join("run.toml"), toml + "# <script>alert(1)</script>\n").unwrap();
    let ended = atoll(desk.path(), "report a --out page.html");
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{ended}");
    let page = fs::read_to_string(desk.path().join("page.html")).unwrap();
    for text in ["was killed", "no <code>log.csv</code>", "&lt;script&gt;alert(1)"] {
        assert!(page.contains(text), "{text}");
    }
    assert!(!page.contains("<script"));

    let refused = |line: &str, expected: &str| {
        let ended = atoll(desk.path(), line);
        let complaints = ended.complaints();
        assert_eq!((ended.code, complaints.len()), (Some(2), 1), "{ended}");
        assert!(complaints[0].contains(expected), "{expected:?}: {ended}");
    };
    refused("report nowhere --out p.html", "no run was begun there");
    refused("report a a a --out p.html", "unexpected");
    refused("report a", "--out <FILE>");
    refused("report a --out a/run.toml", "must not be written over");
    refused("report a --out nowhere/p.html", "--out nowhere/p.html: ");
    fs::write(run.join("log.csv"), "step,time\n0,0.0\n6,O.1\n").unwrap();
    refused("report a --out p.html", "log.csv is damaged: line 3 is no row of this log; remove it, or bring back");
    fs::remove_file(run.join("log.csv")).unwrap();
    // Of step 6, of which nothing is drawn.
    let middle = run.join("rank-00000/steps-0000000006-0000000006.parquet");
    let good = fs::read(&middle).unwrap();
    let bad: Vec<u8> = good.iter().enumerate().map(|(at, byte)| if at == 600 { !byte } else { *byte }).collect();
    fs::write(&middle, bad).unwrap();
    refused("report a --out p.html", "the bytes of step 6 are not those that were written");
    fs::write(&middle, good).unwrap();
    let segment = fs::read_dir(run.join("rank-00000")).unwrap().next().unwrap().unwrap().path();
    let bytes = fs::read(&segment).unwrap();
    fs::write(&segment, &bytes[..bytes.len() / 2]).unwrap();
    refused("report a --out p.html", ".parquet");
    assert!(!desk.path().join("p.html").exists());
}
