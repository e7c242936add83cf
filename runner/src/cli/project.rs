//! `atoll project`: what more ranks would bring.

use super::args::ProjectArgs;
use super::console::{Console, complain};
use super::interrupt::stop_on_signals;
use super::output::{self, Kept, WholeFile};
use super::progress::Show;
use crate::config::{Config, TransportKind};
use crate::error::{Exit, RunError};
use crate::plan::Plan;
use crate::project::{Projection, Wanted, svg};
use crate::rank::Observer;
use std::sync::Arc;

/// Does it, with everything that can be refused refused before anything heavy starts.
///
/// # Errors
/// If the configuration makes no world, the physics ends in a state that is not finite, or a file cannot be written.
pub(super) fn run(args: &ProjectArgs) -> Result<Exit, RunError> {
    let options = [("--json", args.json.as_deref()), ("--plot", args.plot.as_deref())];
    let mut config = Config::load(&args.config, &args.overrides()?)?;
    Kept { runs: Vec::new(), configuration: Some(&args.config), scene: config.scene_files() }.check(options)?;
    let [json, plot] = WholeFile::check_all(options)?;
    (config.run.ranks, config.run.threads, config.run.transport) = (1, Some(1), Some(TransportKind::Local));
    let plan = Plan::new(&config)?;
    plan.notes().iter().for_each(|note| complain(note));

    let stop = stop_on_signals(true, || std::process::exit(Exit::Interrupted as i32));
    let show = if args.quiet { Show::Nothing } else { Show::OnStderr };
    let observer = Observer { listener: Some(Arc::new(Console::new(show))), stop, ..Observer::default() };
    let wanted = Wanted { ranks: args.ranks.clone(), threads: args.threads, times: args.times, network: args.network };
    let Some(projection) = Projection::make(&plan, &wanted, &observer)? else {
        complain(&"interrupted: a projection needs all steps");
        return Ok(Exit::Interrupted);
    };
    let write =
        |file: Option<WholeFile>, text: &dyn Fn() -> String| file.map_or(Ok(()), |file| file.write(text().as_bytes()));
    let to_json = || serde_json::to_string_pretty(&projection).expect("figures and words, under names") + "\n";
    let written = write(json, &to_json).and(write(plot, &|| svg(&projection)));
    output::show(&projection)?;
    written?;
    Ok(Exit::Done)
}
