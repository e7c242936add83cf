//! `atoll view`: a page in the browser that shows a run, or what runs have recorded.

use super::args::{Command, RunArgs, ViewArgs};
use super::console::complain;
use super::interrupt::stop_on_signals;
use crate::error::{Exit, RunError};
use crate::look::live::{Desk, Player, Server, Viewer};
use crate::look::recorded::Recorded;
use crate::plan::Plan;
use crate::rank::Host;
use std::io::ErrorKind;
use std::net::{IpAddr, Ipv4Addr};
use std::path::Path;
use std::process::Stdio;
use std::sync::Arc;

/// To look at a configuration is to run it.
pub(super) fn as_run(command: Command) -> Command {
    match command {
        Command::View(args) if args.sources.len() == 1 && !args.sources[0].is_dir() => {
            Command::Run(Box::new(args.into_run()))
        }
        other => other,
    }
}

/// Shows what is recorded in one folder or two, until it is interrupted.
///
/// # Errors
/// If something else was named, it cannot be read, or the page not served.
pub(super) fn run(args: &ViewArgs) -> Result<Exit, RunError> {
    let unsuitable =
        |option: &str, reason: &str| RunError::Unsuitable { option: option.to_owned(), reason: reason.to_owned() };
    let others =
        [("--tiles", args.tiles.is_some()), ("--out", args.out.is_some()), ("--commands", args.commands.is_some())];
    let other = others.into_iter().find(|(_, is_given)| *is_given).map(|(option, _)| option);
    if let Some(option) = args.values.first().or(other) {
        return Err(unsuitable(option, "what is recorded stays as it is; name a configuration to run it anew"));
    }
    if let Some(file) = args.sources.iter().find(|source| !source.is_dir()) {
        let reason = "two sources are folders of runs that were recorded; name two of these, or one configuration";
        return Err(unsuitable(&file.display().to_string(), reason));
    }
    let open = |folder: &std::path::PathBuf| Ok::<_, RunError>((name(folder), Recorded::open(folder)?));
    let recorded = args.sources.iter().map(open).collect::<Result<Vec<_>, _>>()?;
    recorded.iter().filter_map(|(_, recorded)| recorded.recording().damage()).for_each(|damage| complain(&damage));
    let desk = Arc::new(Desk::new(args.speed));
    let player = Player::new(recorded, Arc::clone(&desk))
        .ok_or_else(|| unsuitable("SOURCE", "there is no time of which all of these have a record; name others"))?;
    let server = serve(desk, args.port, args.bind)?;
    let stop = stop_on_signals(false, || std::process::exit(Exit::Interrupted as i32));
    tell(&server, args.bind, args.open);
    player.play(&stop)?;
    Ok(Exit::Done)
}

/// Where a run can be looked at. Every process of it has one, and that which speaks for all serves the page.
#[derive(Debug)]
pub(super) struct Window {
    /// Its page is there until it is dropped.
    _server: Option<Server>,
    desk: Option<Arc<Desk>>,
    lingers: bool,
    name: String,
}

impl Window {
    /// If the user wants to look.
    ///
    /// # Errors
    /// If the page cannot be served.
    pub(super) fn open(args: &RunArgs, speaks: bool) -> Result<Option<Self>, RunError> {
        if !args.view {
            return Ok(None);
        }
        let source = args.config.as_deref().or(args.resume.as_deref()).unwrap_or(Path::new(""));
        let mut window = Self { _server: None, desk: None, lingers: args.lingers, name: name(source) };
        if speaks {
            let desk = Arc::new(Desk::new(args.speed));
            let server = serve(Arc::clone(&desk), args.port, args.bind)?;
            tell(&server, args.bind, args.open);
            if args.lingers {
                let pace = if args.speed == 0.0 {
                    "as fast as it can".to_owned()
                } else {
                    format!("at {} x real time", args.speed)
                };
                complain(&format!("the run waits for the first page, then goes on {pace}; --speed says how fast"));
            }
            (window._server, window.desk) = (Some(server), Some(desk));
        }
        Ok(Some(window))
    }

    /// Who shows a run of this plan to pages.
    pub(super) fn host(&self, plan: &Plan) -> Arc<dyn Host> {
        Arc::new(Viewer::new(plan, self.desk.clone(), self.lingers, &self.name))
    }
}

/// What a source is called.
fn name(source: &Path) -> String {
    let whole = source.canonicalize().unwrap_or_else(|_| source.to_owned());
    let own = if whole.is_dir() { whole.file_name() } else { whole.file_stem() };
    own.unwrap_or(whole.as_os_str()).to_string_lossy().into_owned()
}

/// Serves the page.
fn serve(desk: Arc<Desk>, port: Option<u16>, bind: Option<IpAddr>) -> Result<Server, RunError> {
    let address = bind.unwrap_or(IpAddr::V4(Ipv4Addr::LOCALHOST));
    Server::start(address, port.unwrap_or(0), desk).map_err(|error| {
        let port = port.filter(|_| error.kind() != ErrorKind::AddrNotAvailable).map(|port| format!("--port {port}"));
        let option = port.or(bind.map(|bind| format!("--bind {bind}"))).unwrap_or("the page".to_owned());
        RunError::Unsuitable { option, reason: format!("{error}; give another, or none") }
    })
}

/// Tells the user where to look, and opens a browser if that is wanted.
fn tell(server: &Server, bind: Option<IpAddr>, open: bool) {
    if let Some(address) = bind.filter(|address| !address.is_loopback()) {
        complain(&format!(
            "--bind {address}: whoever reaches this machine and knows the address below can look at the run, pause it and \
             change its world; nothing is encrypted"
        ));
        if address.is_unspecified() {
            complain(&format!("open it with any address of this machine in the place of {address}"));
        }
    }
    let url = server.url();
    complain(&format!("open {url}"));
    if open && !start_browser(&url) {
        complain(&"--open: no browser can be started; open the address above in one");
    }
}

fn start_browser(url: &str) -> bool {
    let program = match () {
        () if cfg!(target_os = "macos") => "open",
        () if cfg!(windows) => "explorer",
        () => "xdg-open",
    };
    let mut command = std::process::Command::new(program);
    command.arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().is_ok()
}
