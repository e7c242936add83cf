//! What the documentation tells people to type is understood by the program, and the files it names are there.

use atoll::config::{Config, ConfigError};
use atoll::internals::Plan;
use atoll::internals::{Cli, Command};
use atoll_tests::program::root;
use clap::{CommandFactory, Parser};
use std::fs;
use std::path::PathBuf;

fn pages() -> Vec<PathBuf> {
    let docs = fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let docs = docs.filter(|path| path.extension().is_some_and(|ending| ending == "md"));
    docs.chain(["README.md", "CONTRIBUTING.md", "ARCHITECTURE.md"].map(|name| root().join(name))).collect()
}

/// The lines of a page's blocks of shell commands.
fn commands(text: &str) -> Vec<&str> {
    let mut within = false;
    let mut commands = Vec::new();
    for line in text.lines() {
        if line.starts_with("```") {
            within = line == "```sh";
        } else if within {
            commands.push(line);
        }
    }
    commands
}

/// The arguments of the program in a command that runs it, launched or not, from the verb on.
fn arguments(command: &str) -> Option<Vec<&str>> {
    let words: Vec<&str> = command.split_whitespace().collect();
    let is_verb = |word: &str| Cli::command().find_subcommand(word).is_some();
    let program = words.windows(2).position(|pair| pair[0].ends_with("atoll") && is_verb(pair[1]));
    let cargo = words.windows(2).position(|pair| pair[0] == "--" && is_verb(pair[1]));
    program.or(cargo).map(|at| words[at + 1..].to_vec())
}

#[test]
fn commands_that_run_the_program_are_understood() {
    let mut understood = 0;
    for page in pages() {
        let text = fs::read_to_string(&page).unwrap();
        for arguments in commands(&text).into_iter().filter_map(arguments) {
            let line = arguments.join(" ");
            // Not a command but how commands are made.
            if line.contains("CONFIG") || line.contains("[--") {
                continue;
            }
            let at = format!("{}: {line}", page.display());
            let cli = Cli::try_parse_from([&["atoll"], &arguments[..]].concat());
            let command = cli.unwrap_or_else(|error| panic!("{at}: {error}")).command;
            understood += 1;
            let Command::Run(run) = command else { continue };
            // A run that goes on needs none, and what runs leave is not there yet.
            let Some(config) = run.config.as_ref().filter(|config| !config.starts_with("runs")) else { continue };
            match Config::load(&root().join(config), &run.overrides().unwrap()) {
                // A transport that this build leaves out.
                Ok(_) | Err(ConfigError::NotBuiltIn { .. }) => {}
                Err(error) => panic!("{at}: {error}"),
            }
        }
    }
    assert!(understood >= 14, "only {understood} commands were found");
}

/// The readme shows a run of `configs/normal.toml`.
#[test]
fn the_configuration_hash_shown_is_still_right() {
    let config = Config::load(&root().join("configs/normal.toml"), &[]).unwrap();
    let plan = Plan::new(&config).unwrap();
    let line = format!("config hash   {}", config.hash(plan.tiles));
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    assert!(readme.lines().any(|shown| shown == line), "README.md does not show: {line}");
}

#[test]
fn links_lead_somewhere() {
    let mut followed = 0;
    for page in pages() {
        let text = fs::read_to_string(&page).unwrap();
        for target in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if !target.contains("://") && !target.starts_with('#') {
                let path = page.parent().unwrap().join(target.split('#').next().unwrap());
                assert!(path.exists(), "{}: there is no {target}", page.display());
                followed += 1;
            }
        }
    }
    assert!(followed >= 10, "only {followed} links were found");
}

/// Every path in backticks on the page of the architecture, from the root, from the sources of a package, or from the folder
/// named last before it in its line.
#[test]
fn files_that_the_architecture_names_exist() {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let is_path = |span: &&str| {
        let plain = span.chars().all(|c| c.is_alphanumeric() || "_./{},-".contains(c));
        plain && (span.contains('/') || [".rs", ".sh", ".txt"].iter().any(|end| span.ends_with(end)))
    };
    // `a/{b,c}.rs` stands for two.
    let each = |path: &str| match path.split_once('{').zip(path.split_once('}')) {
        Some(((before, rest), (_, after))) => {
            let names = rest.split_once('}').expect("a brace that closes").0;
            names.split(',').map(|name| format!("{before}{name}{after}")).collect()
        }
        None => vec![path.to_owned()],
    };
    let (mut found, mut missing) = (0, Vec::new());
    for line in text.lines() {
        let mut nearest = root().to_owned();
        for path in line.split('`').skip(1).step_by(2).filter(is_path).flat_map(each) {
            let homes = ["", "core/src", "transport/src", "runner/src"].map(|home| root().join(home));
            let file = homes.iter().chain([&nearest]).map(|home| home.join(&path)).find(|file| file.exists());
            match file {
                Some(file) => {
                    nearest = if file.is_dir() { file } else { file.parent().expect("a folder").to_owned() };
                    found += 1;
                }
                None => missing.push(path),
            }
        }
    }
    assert!(missing.is_empty(), "ARCHITECTURE.md names what is not there: {missing:?}");
    assert!(found > 60, "only {found} paths were found");
}
