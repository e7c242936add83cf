//! `atoll scene check`: all that the files of a scene say.

use super::super::args::SceneCheckArgs;
use super::super::console::complain;
use super::super::output;
use crate::config::{Config, Override};
use crate::error::{Exit, RunError};
use crate::plan::Plan;
use crate::rank::{not_crowded, part_of_scene};
use crate::scene::SceneFile;
use crate::scene::file::Found;
use crate::wording::{Figure, OneLine, form_for, plural};
use atoll_core::{Facts, Loopback, Shape};
use atoll_transport::Rank;
use std::fmt::Write as _;

/// So many faults are told one by one.
const TOLD: u64 = 20;

/// Does it.
///
/// # Errors
/// If something is wrong, of which the last is told by the error.
pub(super) fn run(args: &SceneCheckArgs) -> Result<Exit, RunError> {
    let mut faults = 0;
    let checked = SceneFile::check(&args.scene, |fault| {
        faults += 1;
        if faults <= TOLD {
            complain(&fault);
        }
    });
    if faults > TOLD {
        complain(&format!("and {} more", faults - TOLD));
    }
    let (scene, found) = checked?;
    if faults > 0 {
        return Ok(Exit::Usage);
    }
    // Says what is wrong with the physics.
    let overrides = [("ranks", "1"), ("steps", "1")].map(|(key, value)| Override::set(key, value));
    let config = Config::load(&args.scene, &overrides)?;
    let mut text = in_words(&scene, &found);
    match Plan::new(&config) {
        Ok(plan) => {
            let world = part_of_scene(&plan, Rank(0))?;
            not_crowded(world.crowding(), world.body_count() as u64)?;
            let measured = atoll_core::measure(&world, &mut Loopback);
            let facts = Facts::total(measured.map_err(|error| RunError::Unsuitable {
                option: args.scene.display().to_string(),
                reason: format!("nothing can be computed with it: {error}"),
            })?);
            row(&mut text, "mass", &format!("{:.6} kg", Figure(facts.mass)));
            let overlaps = match facts.overlaps {
                0 => "none at the start".to_owned(),
                points => format!("{points} contact points at the start, the deepest {:.3e} m", facts.max_penetration),
            };
            row(&mut text, "overlaps", &overlaps);
        }
        // What is too large here may be run elsewhere.
        Err(RunError::TooLarge { .. }) => row(&mut text, "overlaps", "not looked for: too large for this machine"),
        Err(error) => return Err(error),
    }
    output::show(&text)?;
    Ok(Exit::Done)
}

fn in_words(scene: &SceneFile, found: &Found) -> String {
    let name = scene.name().map(|name| format!("{}: ", OneLine(name))).unwrap_or_default();
    let counts = [(scene.count(), "body"), (scene.statics().len() as u64, "static")];
    let [bodies, statics] = counts.map(|(count, word)| plural(count, word));
    let mut text = format!("{name}{bodies}, {statics}\n");
    let (low, high) = scene.domain();
    row(&mut text, "domain", &format!("{}, {} to {}, {} m", low.x, low.y, high.x, high.y));
    if let Some((low, high)) = found.extent {
        row(&mut text, "extent", &format!("{:.6}, {:.6} to {:.6}, {:.6} m", low.x, low.y, high.x, high.y));
    }
    if found.outside > 0 {
        let are = if found.outside == 1 { "is" } else { "are" };
        row(&mut text, "outside", &format!("{} {are} outside of the domain", plural(found.outside, "body")));
    }
    if let Some([least, most]) = found.ids {
        row(&mut text, "ids", &format!("{least} to {most}"));
    }
    for (number, (kind, bodies)) in scene.kinds().iter().zip(&found.by_kind).enumerate() {
        let name = scene.kind_names()[number].as_deref();
        let name = name.map(|name| format!(" ({})", OneLine(name))).unwrap_or_default();
        let shape = match &kind.shape {
            Shape::Box { half } => format!("{} of {} x {} m", form_for(*bodies, "box"), 2.0 * half.x, 2.0 * half.y),
            Shape::Circle { radius } => format!("{} of {radius} m radius", form_for(*bodies, "circle")),
            other => format!("of a {}", crate::wording::shape(other)),
        };
        row(&mut text, "kind", &format!("{number}{name}: {bodies} {shape}"));
    }
    row(&mut text, "digest", scene.digest());
    text
}

fn row(text: &mut String, name: &str, told: &str) {
    writeln!(text, "{name:<12} {told}").expect("a string takes any text");
}
