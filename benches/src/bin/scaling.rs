//! What ranks and threads bring on NORMAL and SKEWED, as the report asks it: every number of both that this machine has cores for,
//! beside the report's own figures and what `atoll project` says of up to the report's 144 ranks.
//!
//! ```sh
//! cargo run --release -p atoll-benches --bin scaling [STEPS [FOLDER]]
//! ```
//!
//! Writes `speedup_normal.svg`, `phases_normal.svg` and the same of SKEWED into FOLDER, if one is given. The report's figures are
//! in `benches/reported.csv`, of 600 steps on a cluster with 36 cores a node.

use atoll::Config;
use atoll::internals::{Plan, Projection, Wanted};
use atoll::{Observer, Summary};
use atoll_benches::{File, NORMAL, SKEWED, run};
use plotters::coord::Shift;
use plotters::prelude::*;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{fs, thread};

/// Its lines: scene, ranks, threads, seconds of 600 steps.
const REPORTED: &str = include_str!("../../reported.csv");
const REPORTED_STEPS: f64 = 600.0;

/// What is projected.
const PROJECTED: [usize; 9] = [1, 2, 4, 8, 16, 36, 64, 100, 144];

/// What is projected on: of more ranks the default has too few tiles.
const FINE: &str = "32x32";

const SCENES: [(&str, File); 2] = [("NORMAL", NORMAL), ("SKEWED", SKEWED)];

/// Milliseconds of a step on some ranks with some threads each.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Point {
    ranks: usize,
    threads: usize,
    ms: f64,
}

impl Point {
    fn cores(&self) -> f64 {
        (self.ranks * self.threads) as f64
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match measure(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("scaling: {error}");
            ExitCode::FAILURE
        }
    }
}

fn measure(arguments: &[String]) -> Result<(), String> {
    let usage = || "usage: scaling [STEPS [FOLDER]]".to_owned();
    let steps: u64 = arguments.first().map_or(Ok(600), |text| text.parse()).map_err(|_| usage())?;
    let folder = arguments.get(1).map(PathBuf::from);
    if let Some(folder) = &folder {
        fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    let cores = thread::available_parallelism().map_or(1, usize::from);
    for (scene, file) in SCENES {
        let runs = all_runs(file, steps, cores)?;
        let measured: Vec<Point> = runs.iter().map(point).collect();
        let reported = reported(scene);
        let projected = [("auto", project(file, "auto", steps)?), (FINE, project(file, FINE, steps)?)];
        tell(scene, steps, &runs, &reported);
        for (tiles, points) in &projected {
            tell_projected(scene, steps, tiles, points, measured[0].ms);
        }
        if let Some(folder) = &folder {
            let name = scene.to_lowercase();
            let speedup = draw(|area| draw_speedup(area, scene, &measured, &reported, &projected));
            write(folder, &format!("speedup_{name}.svg"), &speedup)?;
            write(folder, &format!("phases_{name}.svg"), &draw(|area| draw_phases(area, scene, &runs)))?;
        }
    }
    Ok(())
}

/// Ranks and threads that go by twos, as long as each has a core.
fn all_runs(file: File, steps: u64, cores: usize) -> Result<Vec<Summary>, String> {
    let mut runs = Vec::new();
    let powers = || (0..).map(|k| 1 << k).take_while(|&number: &usize| number <= cores);
    for ranks in powers() {
        for threads in powers().filter(|threads| ranks * threads <= cores) {
            let [steps, ranks, threads] = [steps, ranks as u64, threads as u64].map(|number| number.to_string());
            runs.push(run(file, &[("steps", &steps), ("ranks", &ranks), ("threads", &threads)])?);
        }
    }
    if runs.iter().any(|other| other.state_hash != runs[0].state_hash) {
        return Err("ranks and threads gave different states".to_owned());
    }
    Ok(runs)
}

fn point(run: &Summary) -> Point {
    Point { ranks: run.ranks, threads: run.threads, ms: run.ms_per_step }
}

/// What one core takes, in milliseconds.
fn alone(points: &[Point]) -> f64 {
    points.iter().find(|point| point.cores() == 1.0).map_or(f64::NAN, |point| point.ms)
}

fn reported(scene: &str) -> Vec<Point> {
    let point = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        let [of, ranks, threads, seconds] = fields[..] else { panic!("four fields: {line}") };
        let ms = 1e3 * seconds.parse::<f64>().expect("a number") / REPORTED_STEPS;
        let [ranks, threads] = [ranks, threads].map(|text| text.parse().expect("a whole number"));
        (of == scene).then_some(Point { ranks, threads, ms })
    };
    REPORTED.lines().skip(1).filter_map(point).collect()
}

fn project(file: File, tiles: &str, steps: u64) -> Result<Vec<Point>, String> {
    let steps = steps.to_string();
    let overrides = [("steps", steps.as_str()), ("tiles", tiles), ("ranks", "1"), ("threads", "1")];
    let config = Config::from_toml_str(file.name, file.text, &overrides).map_err(|error| error.to_string())?;
    let plan = Plan::new(&config).map_err(|error| error.to_string())?;
    let network = "cluster".parse()?;
    let wanted = Wanted { ranks: PROJECTED.to_vec(), threads: 1, times: 1, network, measured: None };
    let projection = Projection::make(&plan, &wanted, &Observer::default()).map_err(|error| error.to_string())?;
    let predictions = projection.expect("nobody stops it").predictions;
    let best = predictions.iter().filter(|one| one.ranks == 1 || one.balance == "measured");
    Ok(best.map(|one| Point { ranks: one.ranks, threads: one.threads, ms: one.ms_per_step }).collect())
}

fn tell(scene: &str, steps: u64, runs: &[Summary], reported: &[Point]) {
    let (ours, theirs) = (runs[0].ms_per_step, alone(reported));
    eprintln!("\n{scene}, {steps} steps, measured here, and the report's on as many");
    eprintln!(
        "{:>6}{:>9}{:>10}{:>10}{:>11}{:>14}{:>10}{:>11}",
        "ranks", "threads", "ms/step", "speedup", "imbalance", "reported ms", "speedup", "times ours"
    );
    for run in runs {
        let (ranks, threads, ms) = (run.ranks, run.threads, run.ms_per_step);
        let same = reported.iter().find(|point| (point.ranks, point.threads) == (ranks, threads));
        let (reported_ms, reported_speedup) = same.map_or((f64::NAN, f64::NAN), |point| (point.ms, theirs / point.ms));
        let (speedup, imbalance, times) = (ours / ms, run.imbalance, reported_ms / ms);
        eprintln!(
            "{ranks:>6}{threads:>9}{ms:>10.2}{speedup:>10.2}{imbalance:>11.3}{reported_ms:>14.1}{reported_speedup:>10.2}{times:>11.1}"
        );
        println!(
            r#"{{"bench":"scaling","scene":"{scene}","steps":{steps},"ranks":{ranks},"threads":{threads},"ms_per_step":{ms:.3},"speedup":{speedup:.3},"imbalance":{imbalance:.4},"tiles_moved":{},"reported_ms":{}}}"#,
            run.tiles_moved,
            same.map_or("null".to_owned(), |point| format!("{:.3}", point.ms)),
        );
    }
    if let Some(best) = reported.iter().min_by(|a, b| a.ms.total_cmp(&b.ms)) {
        let (cores, ms) = (best.cores(), best.ms);
        eprintln!("the report's best: {ms:.2} ms on {cores} cores, {:.1} times one thread here", ours / ms);
    }
}

/// `alone` is what one thread took here with the default tiles.
fn tell_projected(scene: &str, steps: u64, tiles: &str, points: &[Point], alone: f64) {
    eprintln!("{scene} projected, tiles {tiles}, over one thread of the default tiles");
    eprintln!("{:>6}{:>10}{:>10}{:>12}", "ranks", "ms/step", "speedup", "efficiency");
    for &Point { ranks, ms, .. } in points {
        let (speedup, efficiency) = (alone / ms, alone / ms / ranks as f64);
        eprintln!("{ranks:>6}{ms:>10.3}{speedup:>10.2}{:>10.1} %", 100.0 * efficiency);
        println!(
            r#"{{"bench":"scaling-projected","scene":"{scene}","steps":{steps},"tiles":"{tiles}","ranks":{ranks},"ms_per_step":{ms:.4},"efficiency":{efficiency:.4}}}"#
        );
    }
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

fn draw(draw: impl Fn(&Area<'_>) -> Result<(), Box<dyn Error>>) -> String {
    let mut text = String::new();
    draw(&SVGBackend::with_string(&mut text, (900, 600)).into_drawing_area()).expect("a string takes any drawing");
    text
}

fn write(folder: &Path, name: &str, text: &str) -> Result<(), String> {
    let path = folder.join(name);
    fs::write(&path, text).map_err(|error| format!("{}: {error}", path.display()))
}

/// Times as fast as one thread of the same, over cores. Of what needs several threads a rank, the best.
fn draw_speedup(
    area: &Area<'_>,
    scene: &str,
    measured: &[Point],
    reported: &[Point],
    projected: &[(&str, Vec<Point>)],
) -> Result<(), Box<dyn Error>> {
    let most = 160.0;
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(area)
        .caption(format!("{scene}: speedup over one core of the same"), ("sans-serif", 20))
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d((1.0..most).log_scale(), (1.0..400.0).log_scale())?;
    let plain = |value: &f64| format!("{value}");
    let mut mesh = chart.configure_mesh();
    mesh.x_desc("ranks x threads").y_desc("times as fast").light_line_style(WHITE);
    mesh.x_label_formatter(&plain).y_label_formatter(&plain).draw()?;
    let ideal = [(1.0, 1.0), (most, most)];
    let ours = measured[0].ms;
    let mut lines = vec![("as many times as cores".to_owned(), RGBColor(160, 160, 160), ideal.to_vec())];
    let speedups = |points: &[Point], alone: f64, one: fn(&Point) -> usize| {
        let mut points: Vec<_> =
            points.iter().filter(|point| one(point) == 1).map(|point| (point.cores(), alone / point.ms)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    };
    let theirs = alone(reported);
    let by_ranks: fn(&Point) -> usize = |point| point.threads;
    let by_threads: fn(&Point) -> usize = |point| point.ranks;
    lines.push(("reported, ranks".to_owned(), RGBColor(214, 39, 40), speedups(reported, theirs, by_ranks)));
    lines.push(("reported, threads".to_owned(), RGBColor(255, 152, 150), speedups(reported, theirs, by_threads)));
    lines.push(("measured here, ranks".to_owned(), RGBColor(31, 119, 180), speedups(measured, ours, by_ranks)));
    lines.push(("measured here, threads".to_owned(), RGBColor(23, 190, 207), speedups(measured, ours, by_threads)));
    for ((tiles, points), color) in projected.iter().zip([RGBColor(152, 223, 138), RGBColor(44, 160, 44)]) {
        lines.push((format!("projected, tiles {tiles}"), color, speedups(points, ours, by_ranks)));
    }
    for (name, color, points) in lines {
        chart.draw_series(points.iter().map(|&point| Circle::new(point, 3, color.filled())))?;
        chart
            .draw_series(LineSeries::new(points, color.stroke_width(2)))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
    }
    let legend = SeriesLabelPosition::UpperLeft;
    chart.configure_series_labels().position(legend).background_style(WHITE).border_style(BLACK).draw()?;
    area.present()?;
    Ok(())
}

/// Milliseconds of a step in each phase, a bar for each run.
fn draw_phases(area: &Area<'_>, scene: &str, runs: &[Summary]) -> Result<(), Box<dyn Error>> {
    let most = runs.iter().map(|run| run.ms_per_step).fold(0.0, f64::max) * 1.1;
    let name = |run: &Summary| format!("{} x {}", run.ranks, run.threads);
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(area)
        .caption(format!("{scene}: where the time goes, ranks x threads"), ("sans-serif", 20))
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(64)
        // With room for the legend.
        .build_cartesian_2d(0.0..1.25 * runs.len() as f64, 0.0..most)?;
    let mut mesh = chart.configure_mesh();
    mesh.disable_x_mesh().disable_x_axis().y_desc("ms per step").light_line_style(WHITE).draw()?;
    let style = ("sans-serif", 14).into_font().color(&BLACK);
    let names = runs.iter().enumerate().map(|(at, run)| {
        let place = (at as f64 + 0.35, run.ms_per_step + 0.03 * most);
        Text::new(name(run), place, style.clone())
    });
    chart.draw_series(names)?;
    for phase in 0..runs[0].phases.len() {
        let (name, color) = (runs[0].phases[phase].0, Palette99::pick(phase).to_rgba());
        let bars = runs.iter().enumerate().map(|(at, run)| {
            let below: f64 = run.phases[..phase].iter().map(|(_, time)| time.mean_ms).sum();
            let corner = (at as f64 + 0.15, below);
            Rectangle::new([corner, (at as f64 + 0.85, below + run.phases[phase].1.mean_ms)], color.filled())
        });
        let mark = move |(x, y)| Rectangle::new([(x, y - 5), (x + 14, y + 5)], color.filled());
        chart.draw_series(bars)?.label(name.replace('_', " ")).legend(mark);
    }
    let legend = SeriesLabelPosition::UpperRight;
    chart.configure_series_labels().position(legend).background_style(WHITE).border_style(BLACK).draw()?;
    area.present()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_report_tells_of_one_core_and_of_144() {
        for (scene, alone, best) in [("NORMAL", 1628.848, 6.293), ("SKEWED", 1660.0, 18.852)] {
            let points = reported(scene);
            let one = points.iter().find(|point| point.cores() == 1.0).unwrap();
            assert!((one.ms * 0.6 / alone - 1.0).abs() < 0.2, "{scene}: {one:?}");
            let most = points.iter().find(|point| point.ranks == 144).unwrap();
            assert!((most.ms * 0.6 - best).abs() < 1e-3, "{scene}: {most:?}");
        }
    }

    #[test]
    fn drawings_show_every_line() {
        let point = |ranks, threads, ms| Point { ranks, threads, ms };
        let measured = [point(1, 1, 8.0), point(1, 2, 4.2), point(2, 1, 4.1)];
        let projected = [("auto", measured.to_vec()), ("9x9", measured.to_vec())];
        let text = draw(|area| draw_speedup(area, "NORMAL", &measured, &reported("NORMAL"), &projected));
        for line in ["reported, ranks", "reported, threads", "measured here, ranks", "projected, tiles 9x9"] {
            assert!(text.contains(line), "{line}");
        }
        let small = [("bodies", "300"), ("steps", "2"), ("ranks", "2")];
        let runs = [run(NORMAL, &small).unwrap()];
        let text = draw(|area| draw_phases(area, "NORMAL", &runs));
        assert!(text.contains("narrow phase") && text.contains("2 x "), "{text}");
    }
}
