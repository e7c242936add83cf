//! `atoll project`: what more ranks would bring.

use super::args::ProjectArgs;
use super::console::{Console, complain};
use super::interrupt::stop_on_signals;
use super::output::{self, Kept, WholeFile};
use super::progress::Show;
use crate::config::{Config, TransportKind};
use crate::error::{Exit, RunError};
use crate::launch;
use crate::plan::Plan;
use crate::project::{Measured, Network, Projection, Wanted, svg};
use crate::rank::Observer;
use std::sync::Arc;

/// Does it, with everything that can be refused refused before anything heavy starts.
///
/// # Errors
/// If the configuration makes no world, the physics ends in a state that is not finite, or a file cannot be written.
pub(super) fn run(args: &ProjectArgs) -> Result<Exit, RunError> {
    #[cfg(feature = "iceoryx2")]
    if let Some(rank) = launch::iceoryx2::RankProcess::of_this() {
        return Ok(rank.measure(complain));
    }
    let Some((mut config, network, measured)) = begin(args)? else { return Ok(Exit::Done) };
    let options = [("--json", args.json.as_deref()), ("--plot", args.plot.as_deref())];
    Kept { configuration: Some(&args.config), scene: config.scene_files(), ..Kept::default() }.check(options)?;
    let [json, plot] = WholeFile::check_all(options)?;
    (config.run.ranks, config.run.threads, config.run.transport) = (1, Some(1), Some(TransportKind::Local));
    let plan = Plan::new(&config)?;
    plan.notes().iter().for_each(|note| complain(note));

    let stop = stop_on_signals(true, || std::process::exit(Exit::Interrupted as i32));
    let show = if args.quiet { Show::Nothing } else { Show::OnStderr };
    let observer = Observer { listener: Some(Arc::new(Console::new(show))), stop, ..Observer::default() };
    let (ranks, threads, times) = (args.ranks.clone(), args.threads, args.times);
    let wanted = Wanted { ranks, threads, times, network, measured };
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

/// Reads the configuration, and finds what is between ranks. Nothing where that has been measured and another process is to go on.
///
/// # Errors
/// If it cannot be read, or what is between ranks cannot be measured.
fn begin(args: &ProjectArgs) -> Result<Option<(Config, Network, Option<Measured>)>, RunError> {
    let config = args.overrides().and_then(|values| Config::load(&args.config, &values)).map_err(RunError::from);
    if !args.fit {
        return Ok(Some((config?, args.network, None)));
    }
    #[cfg(feature = "mpi")]
    if config.as_ref().map_or_else(|_| launch::is_launched(), |config| config.transport() == TransportKind::Mpi) {
        let fit = launch::fit_job(config, complain)?;
        return Ok(fit.map(|(config, (network, measured))| (config, network, Some(measured))));
    }
    let config = config?;
    launch::check_alone(&config)?;
    let (network, measured) = launch::fit(&config)?;
    Ok(Some((config, network, Some(measured))))
}
