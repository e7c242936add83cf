//! The page in a real browser.

use atoll::recording::{Recording, Row};
use atoll_tests::browser::{self, Browser};
use atoll_tests::page::Served;
use atoll_tests::program;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use tempfile::{TempDir, tempdir};

/// A small world in which bodies are large enough to be pointed at.
const WORLD: &str = "[scene]\nkind = \"rooms\"\nbodies = 600\n\n[run]\nsteps = 60\nranks = 2\ntiles = [3, 3]\n\
    max_bodies = 120\nretile_every = 2\n";

/// It, recorded twice: once with another seed.
static DESK: LazyLock<TempDir> = LazyLock::new(|| {
    let desk = tempdir().unwrap();
    std::fs::write(desk.path().join("world.toml"), WORLD).unwrap();
    for (out, more) in [("a", ""), ("b", "--set exchange=substep")] {
        let line = format!("run world.toml --out {out} --record-every 2 --quiet {more}");
        let ended = program::run(program::command().current_dir(desk.path()).args(line.split_whitespace()));
        assert_eq!(ended.code, Some(0), "{ended}");
    }
    desk
});

fn serve(line: &str) -> Served {
    Served::start(program::command().current_dir(DESK.path()).arg("view").args(line.split_whitespace()))
}

/// A browser that shows it, once it has drawn something.
fn show(program: &Path, served: &Served) -> Browser {
    let mut browser = Browser::start(program, [1100, 700]);
    browser.open(&served.url);
    browser.wait_for("window.atoll !== undefined && atoll.state.frames > 0");
    browser
}

/// Asserts that nothing went wrong in the page, and that it has asked nobody else for anything.
#[track_caller]
fn assert_well(browser: &Browser, served: &Served) {
    assert!(browser.errors.is_empty(), "{:?}", browser.errors);
    let own = |url: &&String| {
        ["http", "ws"].iter().any(|scheme| url.starts_with(&format!("{scheme}://{}/", served.address())))
    };
    let others: Vec<_> = browser.requests.iter().filter(|url| !own(url) && !url.starts_with("data:")).collect();
    assert!(others.is_empty() && browser.requests.len() > 3, "{others:?}");
}

fn number(browser: &mut Browser, expression: &str) -> f64 {
    browser.evaluate(expression).as_f64().unwrap_or_else(|| panic!("{expression} is no number"))
}

fn step(browser: &mut Browser) -> u64 {
    number(browser, "atoll.state.step") as u64
}

fn rows(folder: &str, step: u64) -> Vec<Row> {
    let mut rows = Vec::new();
    Recording::open(&DESK.path().join(folder)).unwrap().read(step, &mut rows).unwrap();
    rows
}

/// Where on the page a place of the world is.
fn place(browser: &mut Browser, x: f64, y: f64) -> [f64; 2] {
    let place = browser.evaluate(&format!(
        "(() => {{ const c = document.getElementById('canvas'), m = atoll.state.camera, r = c.getBoundingClientRect(); \
         return [r.x + r.width / 2 + ({x} - m.x) * m.zoom / (c.width / c.clientWidth), \
                 r.y + r.height / 2 - ({y} - m.y) * m.zoom / (c.width / c.clientWidth)]; }})()"
    ));
    [0, 1].map(|i| place[i].as_f64().unwrap())
}

/// How many pixels in the middle of what is looked at are not paper: as the page draws them, and as `atoll render` does.
fn drawn(browser: &mut Browser, source: &str, step: u64, color: &str) -> [f64; 2] {
    browser.evaluate("document.getElementById('tiles').checked = false");
    let page = number(browser, "atoll.pixels(0.7)[0]");
    let view = browser.evaluate(
        "(() => { const c = document.getElementById('canvas'), m = atoll.state.camera, w = c.width / 2 / m.zoom, h = c.height / 2 / m.zoom; \
         return [c.width, c.height, m.x - w, m.y - h, m.x + w, m.y + h]; })()",
    );
    let view: Vec<String> = view.as_array().unwrap().iter().map(Value::to_string).collect();
    // Other tests draw at the same time.
    let folder = tempdir().unwrap();
    let out = folder.path().join("picture.png");
    let mut command = program::command();
    command.current_dir(DESK.path()).args([
        "render",
        source,
        "--quiet",
        "--bare",
        "--color",
        color,
        "--step",
        &step.to_string(),
    ]);
    command.arg("--size").arg(format!("{}x{}", view[0], view[1])).arg("--view").arg(view[2..].join(","));
    let ended = program::run(command.arg("--out").arg(&out));
    assert_eq!(ended.code, Some(0), "{ended}");
    let png = data_encoding::BASE64.encode(&std::fs::read(&out).unwrap());
    let picture = number(
        browser,
        &format!(
            "(async () => {{ const image = new Image(); image.src = 'data:image/png;base64,{png}'; await image.decode(); \
             const {{ width, height }} = image, w = Math.round(width * 0.7), h = Math.round(height * 0.7); \
             const context = new OffscreenCanvas(width, height).getContext('2d'); context.drawImage(image, 0, 0); \
             const {{ data }} = context.getImageData((width - w) >> 1, height - h - ((height - h) >> 1), w, h); let count = 0; \
             for (let i = 0; i < data.length; i += 4) count += 765 - data[i] - data[i + 1] - data[i + 2] > 24; return count; }})()"
        ),
    );
    [page, picture]
}

#[track_caller]
fn assert_alike([page, picture]: [f64; 2]) {
    assert!(page > 500.0 && (page / picture - 1.0).abs() < 0.03, "{page} on the page, {picture} in the picture");
}

/// Clicks on a body and says which is picked.
fn pick(browser: &mut Browser, row: &Row) -> String {
    let at = place(browser, row.x, row.y);
    browser.click(at);
    browser.wait_for("atoll.state.body !== null");
    browser.evaluate("document.getElementById('body-id').textContent").as_str().unwrap().to_owned()
}

/// A body with room around it, in the middle of the world.
fn lonely(rows: &[Row]) -> &Row {
    let far = |row: &&Row| {
        rows.iter().filter(|other| other.id != row.id).all(|other| (other.x - row.x).hypot(other.y - row.y) > 0.8)
    };
    let middle = |row: &Row| (row.x - 0.5 * middle_of(rows)[0]).hypot(row.y - 0.5 * middle_of(rows)[1]);
    rows.iter().filter(far).min_by(|a, b| middle(a).total_cmp(&middle(b))).expect("somebody is alone")
}

fn middle_of(rows: &[Row]) -> [f64; 2] {
    let sum = rows.iter().fold([0.0; 2], |[x, y], row| [x + row.x, y + row.y]);
    sum.map(|sum| 2.0 * sum / rows.len() as f64)
}

#[test]
fn a_recording_is_drawn_played_scrubbed_zoomed_and_its_bodies_picked() {
    let Some(program) = browser::find() else { return };
    let served = serve("a");
    let mut browser = show(&program, &served);
    browser.wait_for("atoll.state.step > 4");
    browser.press(" ");
    browser.wait_for("document.getElementById('play').textContent === 'Play'");
    // Further than where it was, and to the end.
    for to in [20, 40, 60] {
        browser.evaluate(&format!(
            "(() => {{ const bar = document.getElementById('scrub'); bar.value = {}; bar.dispatchEvent(new Event('input')); }})()",
            to / 2
        ));
        browser.wait_for(&format!("atoll.state.step === {to}"));
    }
    assert_alike(drawn(&mut browser, "a", 60, "kind"));
    browser.screenshot("recording");
    for (key, expected) in [("ArrowLeft", 58), ("ArrowLeft", 56), ("ArrowRight", 58)] {
        browser.press(key);
        browser.wait_for(&format!("atoll.state.step === {expected}"));
    }
    // Nearer, around one that is alone.
    let rows = rows("a", 58);
    let row = lonely(&rows);
    let at = place(&mut browser, row.x, row.y);
    let zoom = number(&mut browser, "atoll.state.camera.zoom");
    // A page knows of whole pixels.
    let cursor = at.map(f64::round);
    browser.wheel(cursor, -600.0);
    browser.wait_for(&format!("atoll.state.camera.zoom > {}", 3.0 * zoom));
    let (now, nearer) = (place(&mut browser, row.x, row.y), number(&mut browser, "atoll.state.camera.zoom") / zoom);
    let then = [0, 1].map(|i| cursor[i] + nearer * (at[i] - cursor[i]));
    assert!((now[0] - then[0]).hypot(now[1] - then[1]) < 0.5, "it is zoomed to the cursor: {then:?} {now:?}");
    assert_eq!(pick(&mut browser, row), row.id.to_string());
    browser.press("2");
    browser.wait_for("atoll.state.legend.includes('speed')");
    assert_alike(drawn(&mut browser, "a", 58, "speed"));
    browser.screenshot("recording_near");
    browser.press("Escape");
    browser.wait_for("document.getElementById('body').hidden");
    assert_well(&browser, &served);
    served.interrupt();
    assert_eq!(served.end().code, Some(0));
}

#[test]
fn borders_that_move_are_drawn() {
    let Some(program) = browser::find() else { return };
    let config = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/skewed.toml");
    let tiles = "--tiles bisected --set tile_count=12 --ranks 3";
    let served = serve(&format!("{config} --bodies 3000 --steps 100000 --speed 3 {tiles}"));
    let mut browser = show(&program, &served);
    assert_eq!(browser.evaluate("document.getElementById('speed').selectedOptions[0].text"), json!("3 ×"));
    browser.wait_for("atoll.state.step > 40");
    assert_eq!(number(&mut browser, "atoll.state.hello.sources[0].corners.length"), 12.0);
    // A line on two sides of each tile and around all, and more where ranks meet.
    let lines = number(&mut browser, "atoll.state.sources[0].lines.count") - 2.0 - 24.0;
    assert!((2.0..40.0).contains(&lines), "{lines} lines where ranks meet");
    browser.screenshot("bisected");
    assert_well(&browser, &served);
    served.interrupt();
    assert_eq!(served.end().code, Some(130));
}

#[test]
fn a_run_is_paused_stepped_and_its_bodies_followed() {
    let Some(program) = browser::find() else { return };
    let served = serve("world.toml --steps 100000");
    let mut browser = show(&program, &served);
    // Tiles are cut by then.
    browser.wait_for("atoll.state.step > 12");
    browser.press(" ");
    browser.wait_for("document.getElementById('play').textContent === 'Play'");
    let mut last = step(&mut browser);
    // It stands still once what was on the way is there.
    loop {
        std::thread::sleep(std::time::Duration::from_millis(200));
        let now = step(&mut browser);
        if now == last {
            break;
        }
        last = now;
    }
    for _ in 0..2 {
        browser.press("ArrowRight");
        last += 1;
        browser.wait_for(&format!("atoll.state.step === {last}"));
    }
    // A line on two sides of each tile and around all, and more where ranks meet.
    let tiles = number(&mut browser, "atoll.state.hello.sources[0].levels.length");
    assert_eq!(number(&mut browser, "atoll.state.hello.sources[0].rank_of_tile.length"), tiles);
    let lines = number(&mut browser, "atoll.state.sources[0].lines.count") - 2.0 - 2.0 * tiles;
    // How many depends on the step that it has come to.
    assert!(tiles > 9.0 && lines > 6.0 && lines < 2.0 * tiles, "{tiles} tiles, {lines} lines where ranks meet");
    browser.screenshot("tiles");
    // The same bits, recorded.
    let ended = program::run(program::command().current_dir(DESK.path()).args([
        "run",
        "world.toml",
        "--quiet",
        "--overwrite",
        "--out",
        "c",
        "--record-every",
        &last.to_string(),
        "--steps",
        &last.to_string(),
    ]));
    assert_eq!(ended.code, Some(0), "{ended}");
    assert_alike(drawn(&mut browser, "c", last, "kind"));
    let rows = rows("c", last);
    let row = lonely(&rows);
    assert_eq!(pick(&mut browser, row), row.id.to_string());
    browser.screenshot("live");
    browser.evaluate("document.getElementById('follow').click()");
    browser.press(" ");
    browser.wait_for(&format!("atoll.state.step > {}", last + 5));
    browser.press(" ");
    browser.wait_for("document.getElementById('play').textContent === 'Play'");
    browser.wait_for(
        "Math.hypot(atoll.state.camera.x - atoll.state.marked[0], atoll.state.camera.y - atoll.state.marked[1]) < 1e-6",
    );
    for (key, color) in [("6", "contacts"), ("7", "state"), ("5", "rank"), ("4", "tile"), ("3", "spin")] {
        browser.press(key);
        browser.wait_for(&format!("atoll.state.legend.includes('{color}')"));
    }
    browser.wait_for("document.querySelectorAll('.strip').length === 2");
    // Keys are the world's again once something was clicked beside it.
    for control in ["tiles", "figures", "follow"] {
        let middle = browser.evaluate(&format!(
            "(() => {{ const r = document.getElementById('{control}').getBoundingClientRect(); \
             return [r.x + r.width / 2, r.y + r.height / 2]; }})()"
        ));
        browser.click([0, 1].map(|i| middle[i].as_f64().unwrap()));
        for expected in ["Pause", "Play"] {
            browser.press(" ");
            browser.wait_for(&format!("document.getElementById('play').textContent === '{expected}'"));
        }
    }
    browser.evaluate("document.getElementById('color').focus(), document.getElementById('color').dispatchEvent(new Event('change', { bubbles: true }))");
    assert_eq!(browser.evaluate("document.activeElement.id"), json!("canvas"));
    browser.press("f");
    browser.screenshot("live_followed");
    assert_well(&browser, &served);
    served.interrupt();
    let ended = served.end();
    assert_eq!(ended.code, Some(130), "{ended}");
    browser.wait_for("document.getElementById('message').textContent.startsWith('The run is over')");
}

#[test]
fn two_recordings_are_side_by_side_and_where_they_part_is_marked() {
    let Some(program) = browser::find() else { return };
    let compared = program::diff(&folder("a"), &folder("b"), &["--json", folder("d.json").to_str().unwrap()]);
    assert_eq!(compared.code, Some(1), "{compared}");
    let first = program::summary(&folder("d.json"))["first_difference"]["step"].as_u64().unwrap();
    let served = serve("a b");
    let mut browser = show(&program, &served);
    browser.wait_for("!document.getElementById('difference').disabled");
    browser.press("n");
    browser.wait_for(&format!("atoll.state.step === {first}"));
    assert_eq!(browser.evaluate("document.getElementById('clock').classList.contains('difference')"), json!(true));
    let steps = browser.evaluate("[...atoll.pixels()].every((count) => count > 500)");
    assert_eq!(steps, json!(true));
    browser.press("ArrowLeft");
    browser.wait_for("!document.getElementById('clock').classList.contains('difference')");
    browser.screenshot("two");
    // In the right one.
    let rows = rows("b", first - 2);
    let row = lonely(&rows);
    let [x, y] = place(&mut browser, row.x, row.y);
    let quarter = number(&mut browser, "document.getElementById('canvas').clientWidth / 4");
    browser.click([x + quarter, y]);
    browser.wait_for("atoll.state.body !== null && atoll.state.body.source === 1");
    assert_eq!(browser.evaluate("atoll.state.body.id"), json!(row.id.to_string()));
    // One list of colors is of both, and so are all records.
    let heads = "[...document.querySelectorAll('#legend strong, #legend em')].map((head) => head.textContent)";
    assert_eq!(browser.evaluate(heads), json!(["kind"]));
    assert_eq!(browser.evaluate("document.getElementById('beyond').hidden"), json!(true));
    assert_well(&browser, &served);
    // Of other kinds, and for a shorter time.
    let kinds = "[[kinds]]\nname = \"pebble\"\ncircle = 0.3\n";
    let world = format!("format = \"atoll-scene/1\"\ndomain = [[0, 0], [9, 9]]\n{kinds}[[body]]\nx = 4\ny = 5\n");
    std::fs::write(folder("pebble.toml"), world).unwrap();
    let line = "run pebble.toml --steps 5 --out pebble --record-every 1 --quiet";
    let ended = program::run(program::command().current_dir(DESK.path()).args(line.split(' ')));
    assert_eq!(ended.code, Some(0), "{ended}");
    let served = serve("a pebble");
    browser.open(&served.url);
    browser.wait_for("window.atoll !== undefined && atoll.state.frames > 0");
    assert_eq!(browser.evaluate(heads), json!(["kind", "a", "pebble"]));
    let listed = "[...document.querySelectorAll('#legend em:last-of-type ~ span')].map((row) => row.textContent)";
    assert_eq!(browser.evaluate(listed), json!(["pebble"]));
    assert_eq!(
        browser.evaluate("document.getElementById('beyond').textContent"),
        json!("in the 3 records of both; only a has 28 more, only pebble has 3 more")
    );
    browser.screenshot("two_unlike");
    assert!(browser.errors.is_empty(), "{:?}", browser.errors);
}

#[test]
fn a_page_shows_what_is_refused_and_why_a_run_failed() {
    let Some(program) = browser::find() else { return };
    std::fs::write(folder("acts.jsonl"), "{\"step\": 120, \"remove\": 777777}\n").unwrap();
    let served = serve("world.toml --steps 100000 --commands acts.jsonl");
    let mut browser = show(&program, &served);
    // As another page would ask for it.
    browser.evaluate(
        "(() => { const other = new WebSocket(location.href.replace('http', 'ws').replace('/?', '/socket?')); \
         other.onopen = () => other.send(JSON.stringify({ do: 'command', line: '{\"remove\":999999}' })); })()",
    );
    browser.wait_for("document.getElementById('note').textContent.endsWith('there is no body 999999; left out')");
    browser.wait_for("/The run has failed: .*no body 777777/.test(document.getElementById('message').textContent)");
    browser.screenshot("failed");
    assert_well(&browser, &served);
    assert_eq!(served.end().code, Some(2));
}

fn folder(name: &str) -> PathBuf {
    DESK.path().join(name)
}

#[test]
fn what_cannot_be_shown_is_refused_in_one_line() {
    for (line, expected) in [
        ("a --ranks 2", "--ranks: what is recorded stays as it is; name a configuration to run it anew"),
        ("a --tiles 2x2", "--tiles: what is recorded stays as it is; name a configuration to run it anew"),
        ("a world.toml", "world.toml: two sources are folders of runs that were recorded; name two of these"),
        ("nowhere.toml", "nowhere.toml"),
        (".", "holds no recording"),
        ("a --bind 192.0.2.1", "--bind 192.0.2.1: "),
        ("a b c", "see atoll view --help"),
        ("world.toml --speed 0", "must be seconds of the world in one, from 0.001 to 1e6, or max"),
        ("", "the following required arguments were not provided"),
    ] {
        let ended = program::run(program::command().current_dir(DESK.path()).arg("view").args(line.split_whitespace()));
        assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{line}: {ended}");
        assert!(ended.stderr.contains(expected), "{line}: {ended}");
    }
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    for verb in ["view", "run"] {
        let view = if verb == "run" { "--view" } else { "--ranks=1" };
        let mut command = program::command();
        let ended = program::run(command.current_dir(DESK.path()).args([verb, "world.toml", view, "--port", &port]));
        assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{ended}");
        assert!(ended.stderr.contains(&format!("--port {port}: Address already in use")), "{ended}");
    }
}

#[test]
fn a_hand_drops_pulls_and_takes_away_bodies_and_the_run_repeats_from_its_folder() {
    let Some(program) = browser::find() else { return };
    let served = serve("world.toml --steps 100000 --out hand");
    let mut browser = show(&program, &served);
    browser.press(" ");
    browser.wait_for("document.getElementById('play').textContent === 'Play'");
    let zoom = "atoll.state.camera.zoom > 60";
    let middle = browser.evaluate("[atoll.state.camera.x, atoll.state.camera.y]");
    let middle = [0, 1].map(|i| middle[i].as_f64().unwrap());
    let at = place(&mut browser, middle[0], middle[1]).map(f64::round);
    browser.wheel(at, -1200.0);
    browser.wait_for(zoom);
    let kept = || std::fs::read_to_string(folder("hand").join("commands.jsonl")).unwrap_or_default();
    let wait_for = |what: &str| {
        let begun = std::time::Instant::now();
        while !kept().contains(what) {
            assert!(begun.elapsed() < program::LIMIT, "{what} is not in {}", kept());
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
    };
    // One that was dropped is where it was dropped, as nothing moves.
    browser.press("d");
    browser.wait_for("!document.getElementById('shape-choice').hidden");
    browser.click(at);
    wait_for("\"add\"");
    browser.screenshot("hand");
    browser.press("p");
    browser.drag(at, [at[0] + 90.0, at[1] - 40.0], "atoll.state.body !== null");
    wait_for("\"velocity\"");
    let dropped = browser.evaluate("atoll.state.body.id").as_str().unwrap().parse::<u64>().unwrap();
    for _ in 0..3 {
        browser.press("ArrowRight");
    }
    browser.press("e");
    browser.wait_for("atoll.state.body !== null");
    let now = browser.evaluate("atoll.state.body.at");
    let now = place(&mut browser, now[0].as_f64().unwrap(), now[1].as_f64().unwrap());
    browser.click(now);
    wait_for(&format!("\"remove\":{dropped}"));
    browser.press("d");
    browser.click(at);
    browser.press(" ");
    browser.wait_for("atoll.state.step > 30");
    assert_well(&browser, &served);
    served.interrupt();
    let ended = served.end();
    assert_eq!(ended.code, Some(130), "{ended}");
    let summary = program::summary(&folder("hand").join("summary.json"));
    assert_eq!((&summary["bodies"], &summary["bodies_lost"]), (&json!(601), &json!(0)), "{}", kept());
    let (json, steps) = (folder("again.json"), summary["steps"].to_string());
    let mut again = program::command();
    again.arg("run").arg(folder("hand").join("run.toml")).args(["--quiet", "--ranks", "1", "--steps", &steps]);
    let again = again.arg("--commands").arg(folder("hand").join("commands.jsonl"));
    let repeated = program::run_to_summary(again, &json);
    for key in ["state_hash", "contact_hash", "steps"] {
        assert_eq!(repeated[key], summary[key], "{key}");
    }
}
