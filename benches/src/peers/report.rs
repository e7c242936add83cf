//! The repeats of each engine joined: JSON for programs, a table for people.

use super::case::Case;
use super::quality::Quality;
use super::{Engine, Run};
use crate::median;
use serde::Serialize;
use std::fmt::Write as _;

/// What is told about one engine.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Row {
    /// Its name.
    pub engine: String,
    /// Its version.
    pub engine_version: String,
    /// The scene.
    pub scene: String,
    /// Dynamic bodies.
    pub bodies: u64,
    /// Steps made.
    pub steps: u64,
    /// Threads they were made on.
    pub threads: usize,
    /// Median over the repeats, in ms.
    pub ms_per_step: f64,
    /// Each repeat, in ms.
    pub repeats_ms_per_step: Vec<f64>,
    /// Median over the repeats, in bytes.
    pub peak_rss_bytes: u64,
    /// Of the first repeat.
    #[serde(flatten)]
    pub quality: Quality,
}

impl Row {
    /// Joins the repeats; `None` where there is none.
    pub fn new(engine: Engine, case: &Case, runs: &[Run]) -> Option<Self> {
        let first = runs.first()?;
        let microseconds = |ms: f64| (ms * 1e3).round() / 1e3;
        let times: Vec<f64> = runs.iter().map(|run| microseconds(run.ms_per_step)).collect();
        Some(Self {
            engine: engine.to_string(),
            engine_version: first.engine_version.clone(),
            scene: case.scene.clone(),
            bodies: case.plan.scene.bodies(),
            steps: case.steps,
            threads: case.threads,
            ms_per_step: microseconds(median(times.clone())),
            repeats_ms_per_step: times,
            peak_rss_bytes: median(runs.iter().map(|run| run.peak_rss_bytes as f64).collect()) as u64,
            quality: first.quality,
        })
    }
}

/// The table, with time and memory by Atoll's where that is a row.
pub fn table(rows: &[Row], repeats: usize) -> String {
    let mut text = String::new();
    let Some(first) = rows.first() else { return text };
    let Row { scene, bodies, steps, threads, .. } = first;
    let mut line = |words: String| writeln!(text, "{}", words.trim_end()).expect("a string takes any text");
    line(format!("{scene}, {bodies} bodies, {steps} steps, {threads} threads, median of {repeats}"));
    line(format!(
        "{:<8}{:>10}{:>9}{:>10}{:>9}{:>10}{:>12}{:>12}{:>10}{:>10}{:>9}  version",
        "engine", "ms/step", "/ atoll", "MB", "/ atoll", "contacts", "J/kg", "v^2/2", "mean mm", "max mm", "escaped"
    ));
    let atoll = rows.iter().find(|row| row.engine == Engine::Atoll.to_string());
    let ratio = |value: f64, of: Option<f64>| match of {
        Some(of) if of > 0.0 => format!("{:.2}", value / of),
        _ => "-".to_owned(),
    };
    for row in rows {
        let Quality {
            contacts, kinetic_energy_per_kg, mean_half_v2, mean_penetration, max_penetration, escaped, ..
        } = row.quality;
        let time = ratio(row.ms_per_step, atoll.map(|atoll| atoll.ms_per_step));
        let memory = ratio(row.peak_rss_bytes as f64, atoll.map(|atoll| atoll.peak_rss_bytes as f64));
        line(format!(
            "{:<8}{:>10.3}{time:>9}{:>10.1}{memory:>9}{contacts:>10}{:>12}{:>12}{:>10.3}{:>10.3}{escaped:>9}  {}",
            row.engine,
            row.ms_per_step,
            row.peak_rss_bytes as f64 * 1e-6,
            significant(kinetic_energy_per_kg),
            significant(mean_half_v2),
            mean_penetration * 1e3,
            max_penetration * 1e3,
            row.engine_version
        ));
    }
    text
}

/// Four digits, whatever the size.
fn significant(value: f64) -> String {
    if value == 0.0 || (1e-2..1e5).contains(&value) { format!("{value:.4}") } else { format!("{value:.3e}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peers::case::{SceneName, Wishes};

    fn run(ms_per_step: f64, peak_rss_bytes: u64) -> Run {
        let quality = Quality { kinetic_energy_per_kg: 3e-7, ..Quality::default() };
        Run { engine_version: "9.9".to_owned(), ms_per_step, peak_rss_bytes, quality }
    }

    #[test]
    fn rows_have_medians_and_the_table_ratios() {
        let wishes = Wishes { bodies: Some(500), ..Wishes::default() };
        let case = Case::new(SceneName::Normal, wishes).unwrap();
        assert_eq!(Row::new(Engine::Atoll, &case, &[]), None);
        let atoll = Row::new(Engine::Atoll, &case, &[run(4.0, 10_000_000), run(1.0, 10_000_000), run(2.0, 10_000_000)]);
        let box2d = Row::new(Engine::Box2d, &case, &[run(3.0, 25_000_000)]);
        let rows = [atoll.unwrap(), box2d.unwrap()];
        assert_eq!((rows[0].ms_per_step, rows[1].ms_per_step), (2.0, 3.0));
        let told = table(&rows, 3);
        let words: Vec<Vec<&str>> = told.lines().map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(words[2][..5], ["atoll", "2.000", "1.00", "10.0", "1.00"]);
        assert_eq!(words[3][..7], ["box2d", "3.000", "1.50", "25.0", "2.50", "0", "3.000e-7"]);
        // Without Atoll there is nothing to compare with.
        assert!(table(&rows[1..], 1).lines().nth(2).unwrap().contains(" - "));
        let json = serde_json::to_string(&rows[1]).unwrap();
        let expected = r#"{"engine":"box2d","engine_version":"9.9","scene":"normal","bodies":500,"steps":200,"threads":1,"ms_per_step":3.0,"repeats_ms_per_step":[3.0],"peak_rss_bytes":25000000,"contacts":0,"#;
        assert!(json.starts_with(expected), "{json}");
    }
}
