//! Figures over time, from the logs of the runs.

use super::chart::{Axes, Scale, Series, lines};
use super::columns::Columns;
use super::html::figure;
use super::letter;
use super::source::Source;

/// A chart: its name, title, unit, what there is to know, how it is laid out, and its lines: column, words, color.
type Chart = (
    &'static str,
    &'static str,
    &'static str,
    &'static str,
    Scale,
    &'static [(&'static str, &'static str, &'static str)],
);

const CHARTS: [Chart; 8] = [
    (
        "energy",
        "Energy",
        "J",
        "Kinetic with rotation; potential from the lower left corner of the domain on.",
        Scale::AsFar,
        &[("kinetic_energy", "kinetic", "s0"), ("potential_energy", "potential", "s1"), (TOTAL, "total", "s2")],
    ),
    (
        "contacts",
        "Contacts",
        "contacts",
        "Touching pairs, and those of them between bodies of two tiles.",
        Scale::FromZero,
        &[("contacts", "all", "s0"), ("border_contacts", "across tiles", "s1")],
    ),
    (
        "overlap",
        "Overlap",
        "m",
        "How deep bodies lay in each other, as the step found them; closing figures are measured anew.",
        Scale::FromZero,
        &[("max_overlap", "most", "s5"), ("mean_overlap", "mean", "s0")],
    ),
    (
        "momentum",
        "Momentum",
        "kg m/s",
        "Of all bodies together; what never moves takes some up.",
        Scale::AsFar,
        &[("momentum_x", "x", "s0"), ("momentum_y", "y", "s1")],
    ),
    (
        "angular_momentum",
        "Angular momentum",
        "kg m\u{b2}/s",
        "Of all bodies together, about the origin.",
        Scale::AsFar,
        &[("angular_momentum", "all bodies", "s3")],
    ),
    (
        "islands",
        "Islands and sleep",
        "count",
        "Groups of bodies in contact, bodies in the largest, and bodies that sleep.",
        Scale::FromZero,
        &[
            ("islands", "islands", "s0"),
            ("largest_island", "bodies in the largest", "s1"),
            ("asleep", "bodies asleep", "s2"),
        ],
    ),
    (
        "tiles",
        "Between tiles",
        "bodies per step",
        "Copies that tiles hold of their neighbours\u{2019} bodies, and bodies that change their owner.",
        Scale::FromZero,
        &[("ghosts", "ghosts", "s0"), (MIGRATIONS, "migrations", "s4")],
    ),
    ("bodies", "Bodies", "bodies", "None is ever lost.", Scale::FromZero, &[("bodies", "bodies", "s2")]),
];

/// Stands for the sum of both energies.
const TOTAL: &str = "kinetic_energy+potential_energy";
/// Stands for what a log adds up from line to line, by the steps between these.
const MIGRATIONS: &str = "migrations/step";

/// All charts of which any run has logged something.
pub(super) fn of(sources: &[Source]) -> String {
    if sources.iter().all(|source| source.log.is_none()) {
        return String::new();
    }
    let mut text = String::from("<h2>Over time</h2>\n<div class=\"grid\">\n");
    for (name, title, unit, about, scale, columns) in CHARTS {
        let mut all = Vec::new();
        for &(column, words, color) in columns {
            for (run, source) in sources.iter().enumerate() {
                let points = source.log.as_ref().and_then(|log| points(source, log, column));
                let name = if sources.len() > 1 { format!("{words}, {}", letter(run)) } else { words.to_owned() };
                all.extend(points.map(|points| Series { name, color: color.to_owned(), dashed: run > 0, points }));
            }
        }
        if !all.is_empty() {
            let axes = Axes { title: &format!("{title} over time"), x: "time, s", y: unit, scale, wide: false };
            text.push_str(&figure(name, false, title, about, &lines(axes, &all)));
        }
    }
    text + "</div>\n"
}

/// A column over time, or the sum of two, or what one is by another's change since the line before.
pub(super) fn points(source: &Source, log: &Columns, column: &str) -> Option<Vec<(f64, f64)>> {
    let times = times(source, log)?.into_iter();
    if let Some((one, other)) = column.split_once('+') {
        let sums = log.get(one)?.iter().zip(log.get(other)?).map(|(one, other)| one + other);
        return Some(times.zip(sums).collect());
    }
    if let Some((one, other)) = column.split_once('/') {
        let (one, other) = (log.get(one)?, log.get(other)?);
        let parts = one.iter().skip(1).zip(other.windows(2)).map(|(one, other)| one / (other[1] - other[0]).max(1.0));
        return Some(times.skip(1).zip(parts).collect()).filter(|points: &Vec<_>| !points.is_empty());
    }
    Some(times.zip(log.get(column)?.iter().copied()).collect())
}

/// When each line of a log was written, in seconds of the simulated world.
pub(super) fn times(source: &Source, log: &Columns) -> Option<Vec<f64>> {
    let steps = || Some(log.get("step")?.iter().map(|step| source.time(*step)).collect());
    log.get("time").map(<[f64]>::to_vec).or_else(steps)
}
