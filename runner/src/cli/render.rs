//! `atoll render`: a picture or a film of a run.

use super::args::RenderArgs;
use super::console::{Console, complain};
use super::interrupt::stop_on_signals;
use super::output::{self, Kept};
use super::progress::Show;
use crate::config::{Config, OutputConfig};
use crate::error::{Exit, RunError};
use crate::folder::RunFolder;
use crate::look::film::{Film, FilmKind, Rate, remove_unfinished};
use crate::look::frame::{Frame, Setting};
use crate::look::picture::{ColorBy, Layers, Look, Painter, View, whole_view};
use crate::look::recorded::Recorded;
use crate::look::source::{End, Live, Shown, records, show_recorded, what_is_recorded};
use crate::plan::Plan;
use crate::rank::{Listener, Observer};
use crate::wording::plural;
use atoll_core::GlobalId;
use glam::DVec2;
use std::sync::Arc;

/// Pictures in a second of a film of a configuration, where nobody says.
const FPS: u32 = 30;
/// Pictures in a second that a film shows at least, be some alike: of fewer players make strange things.
const LEAST_SHOWN: f64 = 10.0;
/// A picture of a film stands for so many seconds at most.
const LONGEST: f64 = 100.0;
/// How many times as wide as a body that is followed is what is shown around it.
const AROUND: f64 = 20.0;

/// Does it, with everything that can be refused refused before anything heavy starts.
///
/// # Errors
/// Whatever kept it from being made. Nothing is left behind then.
pub(super) fn run(args: &RenderArgs) -> Result<Exit, RunError> {
    let configuration = Some(args.source.as_path()).filter(|source| source.is_file());
    let kept = Kept { runs: vec![&args.source], configuration, ..Kept::default() };
    kept.check([("--out", Some(args.out.as_path()))])?;
    let kind = FilmKind::of(&args.out)?;
    check_out(args, kind)?;
    let mut source = if args.source.is_dir() { open(args)? } else { plan(args)? };
    let setting = source.setting().clone();
    let (shown, rate) = paced(source.shown(args, kind)?, setting.hertz, args, kind)?;
    if let Some(id) = args.follow {
        source.check_followed(GlobalId(id), &setting, shown)?;
    }

    let mut film = Film::create(&args.out, args.size, rate)?;
    let layers = Layers { tiles: args.tiles, ghosts: args.ghosts, contacts: args.contacts };
    let look = Look { size: args.size, color: args.color, layers, bare: args.bare };
    let mut painter = Painter::new(&setting, look);
    let mut seen = args.view.unwrap_or_else(|| whole_view(&setting));
    let mut draw = |frame: &Frame| {
        // Before it is there, all of the world; where it is no longer, its last place.
        if let Some(around) = args.follow.and_then(|id| view_around(id, args, &setting, frame)) {
            seen = around;
        }
        film.add(painter.draw(frame, &seen))
    };
    let out = args.out.clone();
    let stop = stop_on_signals(true, move || {
        remove_unfinished(&out);
        std::process::exit(Exit::Interrupted as i32)
    });
    let show = if args.quiet { Show::Nothing } else { Show::OnStderr };
    let console = Arc::new(Console::new(show));
    let end = match &mut source {
        Source::Live(live) => {
            let observer = Observer { listener: Some(console), stop, ..Observer::default() };
            live.show(shown, needs_run(args).is_some(), observer, &mut draw)?.0
        }
        Source::Recorded(recorded) => {
            console.begins(shown.first, shown.last);
            let shown = show_recorded(recorded, shown, &stop, &mut |frame| {
                draw(frame)?;
                console.made(frame.step);
                Ok(())
            });
            console.ends();
            shown?
        }
    };
    if end == End::Interrupted {
        complain(&format!("interrupted: {} is not written", args.out.display()));
        return Ok(Exit::Interrupted);
    }
    film.finish()?;
    let (frames, [width, height]) = (shown.count(), args.size);
    let frames = plural(frames as u64, "picture");
    let steps = if shown.count() == 1 {
        format!("step {}", shown.first)
    } else {
        format!("steps {} to {}, every {}", shown.first, shown.last, shown.every)
    };
    let pace = if kind.most_per_second().is_some() && shown.count() > 1 {
        let speed =
            args.speed.filter(|speed| *speed != 1.0).map_or("real time".to_owned(), |x| format!("{x} x real time"));
        format!("; {} a second, {speed}", (100.0 * rate.added).round() / 100.0)
    } else {
        String::new()
    };
    output::show(&format!("{}: {frames} of {width} x {height}, {steps}{pace}\n", args.out.display()))?;
    Ok(Exit::Done)
}

/// What frames come from.
enum Source {
    Recorded(Box<Recorded>),
    Live(Box<Live>),
}

fn unsuitable(option: impl ToString, reason: impl ToString) -> RunError {
    RunError::Unsuitable { option: option.to_string(), reason: reason.to_string() }
}

/// Refuses options that do not suit what is to be made.
fn check_out(args: &RenderArgs, kind: FilmKind) -> Result<(), RunError> {
    let film = [
        args.every.map(|every| ("--every", every.to_string())),
        args.fps.map(|fps| ("--fps", fps.to_string())),
        args.speed.map(|speed| ("--speed", speed.to_string())),
    ];
    match (kind.is_film(), args.step, film.into_iter().flatten().next()) {
        (false, _, Some((option, value))) => Err(unsuitable(
            format!("{option} {value}"),
            "a .png is one picture; leave it out, or name a film such as .gif",
        )),
        (true, Some(step), _) => {
            Err(unsuitable(format!("--step {step}"), "a film shows many steps; leave it out, or name a .png"))
        }
        _ => Ok(()),
    }
}

/// The first option that only a run under way can satisfy, if one was given.
fn needs_run(args: &RenderArgs) -> Option<&'static str> {
    match args.color {
        _ if args.ghosts => Some("--ghosts"),
        _ if args.contacts => Some("--contacts"),
        ColorBy::Contacts => Some("--color contacts"),
        ColorBy::Asleep => Some("--color asleep"),
        _ => None,
    }
}

/// What was recorded.
fn open(args: &RenderArgs) -> Result<Source, RunError> {
    if let Some(option) = args.values.first() {
        return Err(unsuitable(option, "what is recorded stays as it is; name a configuration to run it anew"));
    }
    if let Some(option) = needs_run(args) {
        let folder = RunFolder::new("render", &args.source);
        let again = folder.configuration();
        let but = if folder.commands().exists() { ", but without what was done in it" } else { "" };
        let reason = format!("a recording does not tell; {} runs it again, and shows it{but}", again.display());
        return Err(unsuitable(option, reason));
    }
    let recorded = Recorded::open(&args.source)?;
    recorded.recording().damage().iter().for_each(|damage| complain(damage));
    Ok(Source::Recorded(Box::new(recorded)))
}

/// What a configuration is about to do.
fn plan(args: &RenderArgs) -> Result<Source, RunError> {
    let mut config = Config::load(&args.source, &args.values.overrides()?)?;
    let kept = Kept { scene: config.scene_files(), ..Kept::default() };
    kept.check([("--out", Some(args.out.as_path()))])?;
    // Whatever it wants to be written.
    config.output = OutputConfig::default();
    Live::check(&config)?;
    let plan = Plan::new(&config)?;
    for note in plan.notes() {
        complain(&note);
    }
    Ok(Source::Live(Box::new(Live::new(plan))))
}

impl Source {
    fn setting(&self) -> &Setting {
        match self {
            Self::Recorded(recorded) => recorded.setting(),
            Self::Live(live) => live.setting(),
        }
    }

    /// The steps to show.
    fn shown(&self, args: &RenderArgs, kind: FilmKind) -> Result<Shown, RunError> {
        if !kind.is_film() {
            return self.step(args.step).map(Shown::only);
        }
        match self {
            Self::Recorded(recorded) => records(recorded, args.every),
            Self::Live(live) => {
                let real_time = live.setting().hertz * args.speed.unwrap_or(1.0) / f64::from(args.fps.unwrap_or(FPS));
                let every = args.every.unwrap_or(real_time.round().max(1.0) as u64);
                let last = live.plan().config.run.steps;
                Ok(Shown { first: 0, every, last: last - last % every })
            }
        }
    }

    /// The step to show in a single picture.
    fn step(&self, asked: Option<u64>) -> Result<u64, RunError> {
        let refused = |step, reason| Err(unsuitable(format!("--step {step}"), reason));
        match self {
            Self::Recorded(recorded) => {
                let steps = recorded.recording().steps();
                match asked {
                    Some(step) if steps.binary_search(&step).is_err() => {
                        refused(step, format!("{}; give one of these", what_is_recorded(recorded)))
                    }
                    _ => Ok(asked.or(steps.last().copied()).unwrap_or_default()),
                }
            }
            Self::Live(live) => {
                let last = live.plan().config.run.steps;
                match asked {
                    Some(step) if step > last => {
                        refused(step, format!("the run makes {last} steps; give --steps {step} as well"))
                    }
                    _ => Ok(asked.unwrap_or(last)),
                }
            }
        }
    }

    /// Whether there is a body to follow, in one of the frames at least.
    fn check_followed(&self, id: GlobalId, setting: &Setting, shown: Shown) -> Result<(), RunError> {
        let refused = |reason: &str| Err(unsuitable(format!("--follow {id}"), reason));
        if setting.statics.iter().any(|body| body.id == id) {
            return refused("that is a static; name a dynamic body, or use --view");
        }
        let mut rows = Vec::new();
        match self {
            Self::Recorded(recorded) => {
                for step in shown.steps() {
                    recorded.recording().read(step, &mut rows)?;
                    if rows.iter().any(|row| row.id == id.0) {
                        return Ok(());
                    }
                }
            }
            Self::Live(live) if live.has(id)? => return Ok(()),
            Self::Live(_) => {}
        }
        let when =
            if shown.count() == 1 { format!(" at step {}", shown.first) } else { " at any step shown".to_owned() };
        refused(&format!("there is no body of that name{when}; give the id of another"))
    }
}

/// As many of some pictures as a film can show in the time that it is to last, and how many are in a second then.
fn paced(shown: Shown, hertz: f64, args: &RenderArgs, kind: FilmKind) -> Result<(Shown, Rate), RunError> {
    let Some(most) = kind.most_per_second() else { return Ok((shown, Rate { added: 1.0, shown: 1.0 })) };
    let most = args.fps.map_or(most, |fps| most.min(fps.into()));
    let rate = |every: u64| args.speed.unwrap_or(1.0) * hertz / every as f64;
    let of = (rate(shown.every) / most - 1e-9).ceil().max(1.0) as u64;
    let every = shown.every.saturating_mul(of);
    let shown = Shown { every, last: shown.first + (shown.last - shown.first) / every * every, ..shown };
    let added = if shown.count() > 1 { rate(every) } else { 1.0 };
    if added * LONGEST < 1.0 {
        let (seconds, speed) = ((1.0 / added).ceil(), (every as f64 / hertz).ceil());
        let reason =
            format!("each picture would stand for {seconds} seconds; try --speed {speed}, which shows one a second");
        return Err(unsuitable("--speed", reason));
    }
    let repeated = added * (LEAST_SHOWN / added).ceil().max(1.0);
    Ok((shown, Rate { added, shown: args.fps.map_or(repeated, f64::from) }))
}

/// The part of the world around a body, if it is there.
fn view_around(id: u64, args: &RenderArgs, setting: &Setting, frame: &Frame) -> Option<View> {
    let body = frame.bodies.iter().find(|body| body.id == id)?;
    let size = 2.0 * f64::from(setting.kinds[body.kind as usize].shape.bounding_radius());
    let width = args.width.unwrap_or(AROUND * size);
    let [columns, rows] = args.size.map(f64::from);
    let (center, half) = (DVec2::new(body.x, body.y), DVec2::new(0.5 * width, 0.5 * width * rows / columns));
    Some(View { low: center - half, high: center + half })
}
