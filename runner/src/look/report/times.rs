//! Where the time went: over the run, and on each rank.

use super::chart::{Axes, Part, Scale, Series, areas, bars, lines};
use super::columns::Columns;
use super::html::{Unit, figure};
use super::letter;
use super::over_time::{points, times};
use super::source::Source;

/// Phases in the order of a step, with their colors: what is alike has like ones.
const PHASES: [(&str, &str); 15] = [
    ("migrate", "p0"),
    ("exchange", "p1"),
    ("wait", "p2"),
    ("flush", "p3"),
    ("broad_phase", "p4"),
    ("narrow_phase", "p5"),
    ("islands", "p6"),
    ("coloring", "p7"),
    ("prepare", "p8"),
    ("substeps", "p9"),
    ("border", "p10"),
    ("finalize", "p11"),
    ("balance", "p12"),
    ("output", "p13"),
    ("other", "p14"),
];

/// In front of the columns of phases in a log.
const PREFIX: &str = "ms_";

/// All there is to tell of time.
pub(super) fn of(sources: &[Source]) -> String {
    let mut figures = over_run(sources);
    figures +=
        &together(sources, "step_time", "Time per step", "ms", "Of the wall clock.", Scale::FromZero, "ms_per_step");
    let about = "The busy time of the slowest rank to the mean of all: 1 is perfect balance.";
    figures += &together(sources, "balance", "Balance", "slowest to mean", about, Scale::AsFar, "busiest_to_mean");
    for (run, source) in sources.iter().enumerate() {
        if let Some(timings) = &source.timings {
            figures += &ranks(source, timings, of_run(sources, run));
        }
    }
    figures += &memory(sources);
    if figures.is_empty() {
        figures
    } else {
        format!("<h2>Where the time went</h2>\n<div class=\"grid\">\n{figures}</div>\n")
    }
}

/// Which run is meant, where there are two.
fn of_run(sources: &[Source], run: usize) -> Option<&'static str> {
    (sources.len() > 1).then(|| letter(run))
}

fn name_of(base: &str, run: Option<&str>) -> String {
    run.map_or(base.to_owned(), |run| format!("{base}_{}", run.to_lowercase()))
}

fn title_of(base: &str, run: Option<&str>) -> String {
    run.map_or(base.to_owned(), |run| format!("{base}, {run}"))
}

/// Time per phase, on top of each other.
fn over_run(sources: &[Source]) -> String {
    let mut text = String::new();
    for (run, source) in sources.iter().enumerate() {
        let Some((log, at)) = source.log.as_ref().and_then(|log| Some((log, times(source, log)?))) else { continue };
        let phase = |column: &str| {
            let name = column.strip_prefix(PREFIX).filter(|name| *name != "per_step")?;
            let mut points: Vec<_> = at.iter().copied().zip(log.get(column)?.iter().copied()).collect();
            // Each line tells of the steps since the one before; of what was before the first step, the one after.
            if let [first, second, ..] = &mut points[..]
                && first.0 == 0.0
            {
                first.1 = second.1;
            }
            Some((name.to_owned(), points))
        };
        let series: Vec<Series> = log
            .names_with(PREFIX)
            .filter_map(phase)
            .filter(|(_, points)| points.iter().any(|point| point.1 > 0.0))
            .map(|(name, points)| Series { color: color(&name).to_owned(), name: words(&name), dashed: false, points })
            .collect();
        if series.is_empty() {
            continue;
        }
        let (run, about) = (
            of_run(sources, run),
            "Mean over ranks, one phase on top of another; in the legend, its mean over the run.",
        );
        let title = title_of("Time per phase over the run", run);
        let axes = Axes { title: &title, x: "time, s", y: "ms per step", scale: Scale::FromZero, wide: run.is_none() };
        text += &figure(&name_of("phases", run), run.is_none(), &title, about, &areas(axes, &series));
    }
    text
}

/// A column of all runs in one chart.
fn together(
    sources: &[Source],
    name: &str,
    title: &str,
    unit: &str,
    about: &str,
    scale: Scale,
    column: &str,
) -> String {
    let line = |(run, source): (usize, &Source)| {
        // Nothing was measured before the first step.
        let mut points = points(source, source.log.as_ref()?, column)?;
        points.retain(|point| point.1 > 0.0);
        let name = of_run(sources, run).unwrap_or(column_words(column)).to_owned();
        Some(Series { name, color: ["s0", "s1"][run].to_owned(), dashed: run > 0, points })
    };
    let all: Vec<Series> = sources.iter().enumerate().filter_map(line).filter(|one| !one.points.is_empty()).collect();
    if all.is_empty() {
        return String::new();
    }
    let axes = Axes { title: &format!("{title} over time"), x: "time, s", y: unit, scale, wide: false };
    figure(name, false, title, about, &lines(axes, &all))
}

fn column_words(column: &str) -> &str {
    if column == "ms_per_step" { "ms per step" } else { "slowest to mean" }
}

/// The time of each rank, a bar each.
fn ranks(source: &Source, timings: &Columns, run: Option<&str>) -> String {
    let Some((of_rank, ms)) = timings.get("rank").zip(timings.get("mean_ms")) else { return String::new() };
    let mut rows: Vec<(String, Vec<Part>)> = Vec::new();
    for line in 0..timings.rows() {
        let (rank, phase) = (of_rank[line].to_string(), timings.word("phase", line));
        if rows.last().is_none_or(|row| row.0 != rank) {
            rows.push((rank, Vec::new()));
        }
        let parts = &mut rows.last_mut().expect("one was put there").1;
        if phase != "step" && ms[line] > 0.0 {
            parts.push((color(phase).to_owned(), words(phase), ms[line]));
        }
    }
    let mut all: Vec<Series> = Vec::new();
    for (color, name, _) in rows.iter().flat_map(|(_, parts)| parts) {
        if !all.iter().any(|one| one.name == *name) {
            all.push(Series { name: name.clone(), color: color.clone(), dashed: false, points: Vec::new() });
        }
    }
    let title = title_of("Time per phase of each rank", run);
    let axes = Axes { title: &title, x: "ms per step", y: "rank", scale: Scale::FromZero, wide: true };
    let threads = match source.number("threads").or(source.config.run.threads.map(|threads| threads as f64)) {
        Some(1.0) => "; 1 thread each".to_owned(),
        Some(threads) => format!("; {threads} threads each"),
        None => String::new(),
    };
    let about = format!("A bar for each rank, mean over the run, in ms per step{threads}.");
    let content = super::chart::legend(&all, true, |_| None) + &bars(axes, &rows);
    figure(&name_of("ranks", run), true, &title, &about, &content)
}

/// Memory at most, beside what lies on disk.
fn memory(sources: &[Source]) -> String {
    let row = |(run, source): (usize, &Source)| {
        let parts = [("s0", "memory at most", source.number("peak_rss_bytes")?)];
        let name = of_run(sources, run).unwrap_or("all ranks").to_owned();
        Some((name, parts.map(|(color, name, bytes)| (color.to_owned(), name.to_owned(), bytes)).to_vec()))
    };
    let rows: Vec<_> = sources.iter().enumerate().filter_map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    let each = |source: &Source| {
        let bytes = source.number("peak_rss_bytes")?;
        Some(format!("{} per body", Unit(bytes / source.config.scene.bodies.max(1) as f64, "B")))
    };
    let each: Vec<String> = sources.iter().filter_map(each).collect();
    let about = format!("The most held at once, summed over processes: {}.", each.join(" and "));
    let axes = Axes { title: "Memory", x: "B", y: "run", scale: Scale::FromZero, wide: true };
    figure("memory", true, "Memory", &about, &bars(axes, &rows))
}

fn color(phase: &str) -> &'static str {
    PHASES.iter().find(|one| one.0 == phase).map_or("p14", |one| one.1)
}

fn words(phase: &str) -> String {
    phase.replace('_', " ")
}
