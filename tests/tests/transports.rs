//! One configuration, one result, whatever carries the bytes: the program on every transport it was built with.

use atoll_tests::processes;
use atoll_tests::program::{self, Running};
use atoll_tests::ways::Way;
use serde_json::Value;
use std::process::Command;
use tempfile::tempdir;

const RANKS: [usize; 5] = [1, 2, 3, 4, 8];

/// The scenes, each with steps enough to mix ranks well and few enough for the slowest of them. `ATOLL_FULL_LENGTH` runs
/// them to their end.
const SCENES: [(&str, &[&str]); 4] = [
    (
        "configs/quickstart.toml",
        &["--tiles", "5x5", "--set", "max_bodies=700", "--set", "retile_every=5", "--steps", "60"],
    ),
    ("configs/pile.toml", &["--bodies", "2000", "--set", "exchange=substep", "--tiles", "4x3", "--steps", "40"]),
    (
        "configs/skewed.toml",
        &["--bodies", "2000", "--set", "tile_count=11", "--set", "retile_every=3", "--steps", "40"],
    ),
    (
        "configs/zoo.toml",
        &["--bodies", "500", "--tiles", "5x2", "--set", "max_bodies=50", "--set", "retile_every=7", "--steps", "60"],
    ),
];

fn summary(command: &mut Command) -> Value {
    let folder = tempdir().unwrap();
    program::run_to_summary(command.arg("--quiet"), &folder.path().join("summary.json"))
}

fn options(options: &'static [&'static str]) -> &'static [&'static str] {
    if std::env::var_os("ATOLL_FULL_LENGTH").is_some() { &options[..options.len() - 2] } else { options }
}

/// Rules by which tiles move from rank to rank, one for each of [`RANKS`]; at full length all of them.
const BALANCES: [&str; 5] = ["measured", "bodies", "shuffled", "measured", "off"];

fn balances(ranks: usize) -> impl Iterator<Item = &'static str> {
    let all = std::env::var_os("ATOLL_FULL_LENGTH").is_some() && ranks > 1;
    let own = RANKS.iter().position(|&other| other == ranks).expect("one of these");
    BALANCES.into_iter().enumerate().filter(move |&(i, _)| if all { i > 0 } else { i == own }).map(|(_, rule)| rule)
}

#[test]
fn every_transport_and_number_of_ranks_gives_the_same_hashes() {
    for (config, given) in SCENES {
        let given = options(given);
        let expected = summary(Way::Local.command(1, config).args(given));
        let mut passed_between_ranks = 0;
        for way in Way::all() {
            for ranks in RANKS.into_iter().filter(|&ranks| way.supports(ranks)) {
                // Threads within ranks that pass messages, for some.
                let threads = if ranks == 3 { "2" } else { "1" };
                for balance in balances(ranks) {
                    let moves = format!("balance={balance}");
                    let how = ["--threads", threads, "--set", &moves];
                    let found = summary(way.command(ranks, config).args(given).args(how));
                    for key in ["state_hash", "contact_hash", "config_hash", "steps", "bodies_lost"] {
                        assert_eq!(found[key], expected[key], "{key} of {config} over {way} on {ranks} ranks, {moves}");
                    }
                    let moved = found["tiles_moved"].as_u64().unwrap();
                    assert!(balance != "shuffled" || moved > 100, "{moved} tiles moved over {way}");
                    assert!(balance != "off" && ranks > 1 || moved == 0, "{moved} tiles moved over {way}");
                    assert!(found["imbalance"].as_f64().unwrap() >= 1.0, "{way} on {ranks} ranks");
                    assert_eq!(found["transport"], way.transport());
                    assert_eq!(found["ranks"], ranks, "{way}");
                    passed_between_ranks += u64::from(found["bytes_sent"].as_u64().unwrap() > 0);
                }
            }
        }
        assert!(
            passed_between_ranks >= 4 * (Way::all().len() as u64 - 1),
            "{config}: tiles have no neighbours elsewhere"
        );
    }
}

#[test]
fn the_report_comes_once_and_from_one_rank() {
    for way in Way::all().into_iter().filter(|way| way.supports(3)) {
        let ended = program::run(way.command(3, "configs/quickstart.toml").args(["--steps", "20", "--bodies", "2000"]));
        assert_eq!(ended.code, Some(0), "{way}: {ended}");
        assert_eq!(ended.stdout.matches("state hash").count(), 1, "{way}: {ended}");
        assert!(ended.stdout.contains(&format!("3 ranks ({}), 1 thread each", way.transport())), "{way}: {ended}");
    }
}

#[test]
fn bad_input_takes_one_line_on_every_transport() {
    for way in Way::all().into_iter().filter(|way| way.supports(3)) {
        for (options, expected) in [
            (&["--bodies", "-5"][..], "atoll: --bodies -5: must be a whole number"),
            (&["--json", "no/such/folder/x.json"], "atoll: --json no/such/folder/x.json: "),
            (&["--set", "hertz=1", "--set", "gravity=[3e38,3e38]"], "atoll: step "),
        ] {
            let ended = program::run(way.command(3, "configs/quickstart.toml").arg("--quiet").args(options));
            let code = if expected.ends_with("step ") { 4 } else { 2 };
            assert_eq!(ended.code, Some(code), "{way}: {ended}");
            let lines = ended.complaints().into_iter().filter(|line| line.starts_with(expected)).count();
            assert_eq!(lines, 1, "{way}: not one line that says {expected}: {ended}");
            assert!(ended.stdout.is_empty() || way.transport() == "mpi", "{way}: {ended}");
        }
    }
}

#[test]
fn a_request_to_stop_ends_all_ranks_after_the_same_step() {
    for way in Way::all().into_iter().filter(|way| way.supports(3)) {
        let folder = tempdir().unwrap();
        let json = folder.path().join("summary.json");
        let mut command = way.command(3, "configs/quickstart.toml");
        let mut running = Running::start(command.args(["--steps", "4000000000", "--json"]).arg(&json));
        running.wait_for_line("step ");
        if let Way::Mpi(_) = way {
            // The launcher would end them all at once. One of them hears of it, and not the one that speaks.
            processes::ranks_of(&running, 3)[2].signal("TERM");
        } else {
            running.signal("TERM");
        }
        let ended = running.end();
        assert_eq!(ended.code, Some(130), "{way}: {ended}");
        assert!(ended.stdout.contains("interrupted"), "{way}: {ended}");
        let summary = program::summary(&json);
        assert!(summary["interrupted"] == true && summary["bodies_lost"] == 0, "{way}: {summary:#}");
    }
}

#[cfg(feature = "iceoryx2")]
mod iceoryx2 {
    use super::*;

    #[test]
    fn a_small_limit_on_the_stack_is_enough() {
        let usual = || Way::Iceoryx2.command(2, "configs/quickstart.toml");
        let mut limited = Command::new("bash");
        limited.args(["-c", "ulimit -s 64 && exec \"$@\"", "bash"]).arg(usual().get_program()).args(usual().get_args());
        program::at_home(&mut limited);
        let given = ["--bodies", "2000", "--tiles", "2x2", "--steps", "20"];
        assert_eq!(summary(limited.args(given))["state_hash"], summary(usual().args(given))["state_hash"]);
    }

    #[test]
    fn a_second_interrupt_ends_even_ranks_that_hang() {
        let before = processes::shared_memory();
        let mut running =
            Running::start(Way::Iceoryx2.command(3, "configs/quickstart.toml").args(["--steps", "4000000000"]));
        running.wait_for_line("step ");
        let ranks = processes::ranks_of(&running, 3);
        ranks[1].signal("STOP");
        running.signal("INT");
        running.wait_for_line("atoll: stopping after this step");
        // Sooner, it would be taken for the same interrupt.
        std::thread::sleep(std::time::Duration::from_millis(600));
        running.signal("INT");
        let ended = running.end();
        assert_eq!(ended.code, Some(130), "{ended}");
        assert!(ranks.iter().all(|rank| !rank.lives()), "a rank lives on");
        let left = processes::left_in_shared_memory(&before);
        assert!(left.is_empty(), "left behind {left:?}");
    }

    #[test]
    fn a_configuration_that_can_be_read_but_once_is_refused() {
        let folder = tempdir().unwrap();
        let pipe = folder.path().join("world.toml");
        assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo starts").success());
        let writer = std::thread::spawn({
            let pipe = pipe.clone();
            move || std::fs::write(pipe, "[scene]\nkind = \"rooms\"\nbodies = 400\n[run]\ntiles = [2, 2]\n")
        });
        let ended = program::run(&mut Way::Iceoryx2.command(2, pipe.to_str().unwrap()));
        writer.join().unwrap().unwrap();
        assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{ended}");
        assert!(ended.stderr.contains("with transport iceoryx2 it must be a regular file"), "{ended}");
    }

    #[test]
    fn more_ranks_than_a_machine_is_meant_for_are_refused() {
        let ended = program::run(Way::Iceoryx2.command(65, "configs/quickstart.toml").args(["--tiles", "9x9"]));
        assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{ended}");
        assert!(ended.stderr.starts_with("atoll: 65 ranks asked for, but"), "{ended}");
    }
}

/// Each of the processes of a launcher would make all of it.
#[test]
fn a_run_that_a_launcher_started_says_how_it_is_to_join() {
    let options = ["run", "configs/quickstart.toml", "--bodies", "100", "--steps", "1", "--quiet"];
    let started = |more: &[&str]| {
        let mut command = program::command();
        program::run(command.args(options).args(more).env("PMI_SIZE", "4").env("PMI_RANK", "0"))
    };
    let ended = started(&[]);
    assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{ended}");
    let expected = "atoll: an MPI launcher started 4 processes, and this one would make the whole run by itself: ";
    assert!(ended.stderr.starts_with(expected) && ended.stderr.contains("--transport mpi"), "{ended}");
    assert_eq!(started(&["--transport", "channel"]).code, Some(0));
}

#[cfg(feature = "mpi")]
mod mpi {
    use super::*;
    use atoll_tests::mpi::{foreign_mpirun, mpirun};

    #[test]
    fn ranks_asked_for_are_checked_against_those_started() {
        let ended = program::run(Way::Mpi("alltoallv").command(2, "configs/quickstart.toml").args(["--ranks", "3"]));
        assert_eq!(ended.code, Some(2), "{ended}");
        let expected = "atoll: --ranks 3, but the launcher started 2: ";
        assert_eq!(ended.complaints().iter().filter(|line| line.starts_with(expected)).count(), 1, "{ended}");
    }

    #[test]
    fn a_launcher_of_another_mpi_is_caught() {
        let expected = "atoll: the launcher started 4 processes, but each finds itself alone: ";
        let options = ["run", "configs/quickstart.toml", "--transport", "mpi", "--quiet"];
        if let Some(mut command) = foreign_mpirun(4) {
            command.arg(program::atoll(program::Profile::CURRENT)).args(options);
            let ended = program::run(program::at_home(&mut command));
            assert_eq!(ended.code, Some(2), "{ended}");
            assert_eq!(ended.complaints().iter().filter(|line| line.starts_with(expected)).count(), 1, "{ended}");
        }
        // What such a launcher amounts to: processes that are told of each other in a language they do not speak.
        for (size, rank) in [("PMI_SIZE", "PMI_RANK"), ("OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK")] {
            let mut command = program::command();
            let ended = program::run(command.args(options).env(size, "4").env(rank, "0"));
            assert_eq!(ended.code, Some(2), "{ended}");
            assert_eq!(ended.complaints().iter().filter(|line| line.starts_with(expected)).count(), 1, "{ended}");
        }
    }

    #[test]
    fn a_rank_started_otherwise_is_named() {
        let program = program::atoll(program::Profile::CURRENT);
        let started = |options: &[&str]| {
            // One rank as it should be, one with options of its own, two more as they should be.
            let mut command = mpirun(1);
            let rank = ["run", "configs/quickstart.toml", "--transport", "mpi", "--quiet"];
            command.arg(program).args(rank);
            command.args([":", "-n", "1"]).arg(program).args(rank).args(options);
            command.args([":", "-n", "2"]).arg(program).args(rank);
            program::run(program::at_home(&mut command))
        };
        for (options, expected) in [
            (&["--seed", "2"][..], "atoll: rank 1 was started with configuration "),
            (
                &["--set", "mpi_exchange=sparse"],
                "atoll: rank 1 was started with mpi_exchange sparse, and most ranks with",
            ),
            (&["--bodies", "-1"], "atoll: rank 1: --bodies -1: must be a whole number"),
        ] {
            let ended = started(options);
            assert_eq!(ended.code, Some(2), "{options:?}: {ended}");
            assert_eq!(ended.complaints().iter().filter(|line| line.starts_with(expected)).count(), 1, "{ended}");
        }
    }
}
