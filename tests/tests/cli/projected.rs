//! What more ranks are said to bring.

use crate::{Desk, SMALL, assert_refused};
use atoll_tests::program::{self, run};
use atoll_tests::ways::Way;
use serde_json::Value;
use std::fs;

fn project(desk: &Desk, options: &str) -> program::Ended {
    let mut command = program::command();
    run(command.current_dir(desk.path()).args(["project", "world.toml"]).args(options.split_whitespace()))
}

#[test]
fn a_projection_tells_of_every_number_of_ranks() {
    let desk = Desk::new(SMALL);
    let options = "--bodies 3000 --tiles 6x6 --steps 40 --ranks 1,2,8,50 --json p.json --plot p.svg --quiet";
    let ended = project(&desk, options);
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{ended}");
    assert!(ended.stdout.contains("from 50 ranks on some have nothing to do: there are only 36 tiles"), "{ended}");
    let json: Value = serde_json::from_slice(&fs::read(desk.path().join("p.json")).unwrap()).unwrap();
    let alone = json["ms_per_step_alone"].as_f64().unwrap();
    let rows = json["predictions"].as_array().unwrap();
    let told: Vec<_> =
        rows.iter().map(|row| (row["ranks"].as_u64().unwrap(), row["balance"].as_str().unwrap())).collect();
    let rules = |ranks| ["off", "bodies", "measured"].map(|rule| (ranks, rule));
    assert_eq!(told, [&[(1, "off")][..], &rules(2), &rules(8), &rules(50)].concat());
    for row in rows {
        let number = |key: &str| row[key].as_f64().unwrap();
        let ranks = number("ranks");
        assert!((number("speedup") - alone / number("ms_per_step")).abs() < 1e-6 * ranks, "{row}");
        assert!(number("efficiency") <= 1.0 + 1e-9 && number("imbalance") >= 1.0 - 1e-9, "{row}");
        assert!((ranks == 1.0) == (number("exchange_ms") == 0.0), "{row}");
    }
    assert_eq!(rows[0]["ms_per_step"], alone);
    assert!(fs::read_to_string(desk.path().join("p.svg")).unwrap().contains("balance = measured"));
}

#[test]
fn a_projection_follows_tiles_that_are_cut_and_joined() {
    let desk = Desk::new(SMALL);
    let tiles = "--bodies 3000 --tiles 1x1 --set max_bodies=900 --set retile_every=3";
    let ended = project(&desk, &format!("{tiles} --steps 50 --ranks 1,4 --json p.json --quiet"));
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{ended}");
    assert!(ended.stdout.contains("tiles of 900 bodies at most, cut from 1 x 1 squares"), "{ended}");
    let json: Value = serde_json::from_slice(&fs::read(desk.path().join("p.json")).unwrap()).unwrap();
    let rows = json["predictions"].as_array().unwrap();
    assert_eq!(rows.len(), 4);
    for row in rows {
        let number = |key: &str| row[key].as_f64().unwrap();
        assert!(number("imbalance") >= 1.0 - 1e-9 && number("imbalance") < 3.0, "{row}");
        assert!(number("speedup") > 0.0 && number("idle_ranks") == 0.0, "{row}");
    }
    // What looking for new tiles takes is taken alone as well.
    assert!((rows[0]["speedup"].as_f64().unwrap() - 1.0).abs() < 1e-9, "{}", rows[0]);
}

/// As in a run, tiles are dealt by the bodies that they begin with: all are in a quarter of the domain here, which was one rank's.
#[test]
fn a_projection_deals_tiles_by_bodies() {
    let mut scene =
        String::from("format = \"atoll-scene/1\"\ndomain = [[0.0, 0.0], [40.0, 40.0]]\n[[kinds]]\ncircle = 0.25\n");
    for k in 0..900 {
        scene += &format!("[[body]]\nx = {}\ny = {}\n", 1.0 + 0.6 * f64::from(k % 30), 1.0 + 0.6 * f64::from(k / 30));
    }
    let desk = Desk::new(&scene);
    let ended = project(&desk, "--tiles 8x8 --steps 3 --times 3 --ranks 4 --json p.json --quiet");
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{ended}");
    let json: Value = serde_json::from_slice(&fs::read(desk.path().join("p.json")).unwrap()).unwrap();
    let off = &json["predictions"][0];
    // Of four ranks; no more than noise.
    assert!(off["imbalance"].as_f64().unwrap() < 2.5, "{off}");
    // Of three steps the last is the last quarter.
    assert!(off["last_quarter_ms"].as_f64().unwrap() > 0.0, "{off}");
}

#[test]
fn a_projection_follows_borders_that_move() {
    let desk = Desk::new(SMALL);
    let tiles = "--bodies 3000 --tiles bisected --set tile_count=6 --set retile_every=3";
    let ended = project(&desk, &format!("{tiles} --steps 50 --times 2 --ranks 1,6 --json p.json --quiet"));
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{ended}");
    assert!(ended.stdout.contains("6 tiles with borders that follow the bodies"), "{ended}");
    let json: Value = serde_json::from_slice(&fs::read(desk.path().join("p.json")).unwrap()).unwrap();
    assert_eq!(json["retile"], "bisected");
    let rows = json["predictions"].as_array().unwrap();
    assert!(rows.iter().all(|row| row["moving_ms"].as_f64().unwrap() > 0.0 && row["tiles_moved"] == 0), "{rows:?}");
}

#[test]
fn a_projection_measures_what_is_between_ranks() {
    let desk = Desk::new(SMALL);
    for way in Way::all().into_iter().filter(|&way| way.supports(2)) {
        let (transport, mut command) = (way.transport(), way.program(2));
        command.current_dir(desk.path()).args(["project", "world.toml", "--fit", "--set"]);
        let options = format!("transport={transport} --bodies 300 --steps 5 --ranks 1,4 --json p.json --quiet");
        let ended = run(command.args(options.split_whitespace()));
        assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{ended}");
        assert!(ended.stdout.contains(&format!("measured among 2 with transport {transport};")), "{ended}");
        let json: Value = serde_json::from_slice(&fs::read(desk.path().join("p.json")).unwrap()).unwrap();
        assert_eq!(json["measured"], serde_json::json!({"transport": transport, "ranks": 2}));
        // Neither nothing nor beyond what any machine has.
        let number = |key: &str| json[key].as_f64().unwrap();
        assert!(number("bandwidth") > 1e6 && number("bandwidth") <= 1e12 && number("latency_s") < 1.0, "{json}");
    }
}

#[test]
fn what_cannot_be_projected_is_refused() {
    let desk = Desk::new(SMALL);
    for (options, expected) in [
        ("--ranks 0", "invalid value '0' for '--ranks <N,...>': must be a whole number within 1 to 1048576; see"),
        ("--ranks 1,x", "invalid value 'x' for '--ranks <N,...>': must be a whole number"),
        ("--threads 0", "invalid value '0' for '--threads <T>': must be a whole number within 1 to 1024"),
        (
            "--network lan",
            "invalid value 'lan' for '--network <NETWORK>': a network is one of node, cluster, ethernet, or",
        ),
        ("--fit --network node", "the argument '--fit' cannot be used with '--network <NETWORK>'"),
        ("--bodies -5", "--bodies -5: must be a whole number"),
        ("--json no/such/x.json", "--json no/such/x.json: "),
        ("--json world.toml", "--json world.toml: "),
        ("--plot p.png", "invalid value 'p.png' for '--plot <FILE>': is drawn as SVG; end its name in .svg; see"),
    ] {
        assert_refused(&project(&desk, options), 2, expected);
    }
    assert_eq!(desk.files(), ["world.toml"]);
}
