//! The command line. Values of the configuration stay text here: the configuration checks them, whether they come from
//! a file or from here.

mod project;
mod recordings;
mod render;
mod run;
mod scene;
mod values;
mod view;

pub(crate) use project::ProjectArgs;
pub(crate) use recordings::{DiffArgs, ExportArgs, InfoArgs, ReportArgs};
pub(crate) use render::RenderArgs;
pub(crate) use run::RunArgs;
pub(crate) use scene::{BodiesAs, SceneArgs, SceneCheckArgs, SceneCommand, SceneExportArgs, SceneImportArgs};
pub(crate) use view::ViewArgs;

use crate::wording::OneLine;
use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser, Subcommand};
use std::ffi::OsStr;
use std::path::PathBuf;

/// Very large 2-D rigid-body worlds: one trajectory, bit for bit, on one core, one machine or a cluster.
#[derive(Debug, Parser)]
#[command(name = "atoll", version, arg_required_else_help = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a scene and report what became of it.
    Run(Box<RunArgs>),
    /// Compare what two runs recorded: the exit code is 0 if it is the same, 1 if it differs, 2 if that cannot be told.
    Diff(DiffArgs),
    /// Look at a run while it goes on, or at what runs have recorded, in a browser.
    View(Box<ViewArgs>),
    /// Make a picture or a film of what a run has recorded, or of a configuration, which is run for it.
    Render(Box<RenderArgs>),
    /// Tell what the folder of a run, a snapshot or a segment of a recording holds.
    Info(InfoArgs),
    /// Write a page about a run, or two side by side: what was run, pictures, figures over time, where the time went.
    Report(ReportArgs),
    /// Tell what more ranks would bring, without having them.
    Project(Box<ProjectArgs>),
    /// Write what a run has recorded as files for other programs.
    Export(ExportArgs),
    /// Write and check worlds of one's own in files.
    Scene(SceneArgs),
}

/// What clap has to say about bad usage, on one line. `words` are the arguments, the first of which may be verbs.
pub fn one_line(error: &clap::Error, words: impl IntoIterator<Item: AsRef<OsStr>>) -> String {
    let text = error.render().to_string();
    // No option is meant as a value.
    let unsaid = ["Usage:", "For more information", "tip: to pass '"];
    let said = |line: &&str| !(line.is_empty() || unsaid.iter().any(|start| line.starts_with(start)));
    let lines: Vec<&str> = text.lines().map(str::trim).filter(said).collect();
    let line = lines.join(" ").replace(" tip: ", "; ");
    let hint = if lacks_configuration(error) {
        "; name a configuration such as configs/quickstart.toml, or go on with a run by --resume DIR"
    } else {
        ""
    };
    let (mut verb, mut command) = (String::new(), Cli::command());
    for word in words {
        let Some(deeper) = command.find_subcommand(word.as_ref()).cloned() else { break };
        verb = format!("{verb} {}", deeper.get_name());
        command = deeper;
    }
    // What was typed is quoted as it was typed.
    format!("{}{hint}; see atoll{verb} --help", OneLine(line.strip_prefix("error: ").unwrap_or(&line)))
}

/// The path of a plot: what ends otherwise would not be what its name says.
fn svg() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| {
        let is_svg = path.extension().is_none_or(|extension| extension.eq_ignore_ascii_case("svg"));
        if is_svg { Ok(path) } else { Err("is drawn as SVG; end its name in .svg") }
    })
}

fn lacks_configuration(error: &clap::Error) -> bool {
    let missing = error.get(ContextKind::InvalidArg).filter(|_| error.kind() == ErrorKind::MissingRequiredArgument);
    matches!(missing, Some(ContextValue::Strings(names)) if names.iter().any(|name| name == "<CONFIG>"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn complaint(line: &str) -> String {
        let words = || line.split_whitespace();
        one_line(&Cli::try_parse_from(words()).unwrap_err(), words().skip(1))
    }

    #[test]
    fn the_definition_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn bad_usage_takes_one_line() {
        for (line, expected, help) in [
            (
                "atoll run c.toml --rnks 2",
                "unexpected argument '--rnks' found; a similar argument exists: '--ranks'; see",
                "atoll run --help",
            ),
            ("atoll run c.toml --ranks", "a value is required for '--ranks <N>'", "atoll run --help"),
            ("atoll run", "the following required arguments were not provided: <CONFIG>", "atoll run --help"),
            (
                "atoll scene export",
                "the following required arguments were not provided: --out <DIR>",
                "atoll scene export --help",
            ),
            ("atoll project c.toml --resume x", "unexpected argument '--resume' found; see", "atoll project --help"),
            ("atoll runn c.toml", "unrecognized subcommand 'runn'; a similar subcommand exists: 'run'", "atoll --help"),
        ] {
            let text = complaint(line);
            assert!(text.starts_with(expected) && !text.contains('\n'), "{text}");
            assert!(text.ends_with(&format!("; see {help}")), "{text}");
        }
        let error = Cli::try_parse_from(["atoll", "ru\r\u{1b}[2Jn"]).unwrap_err();
        let text = one_line(&error, [""; 0]);
        assert!(text.starts_with("unrecognized subcommand 'ru n'"), "{text}");
    }
}
