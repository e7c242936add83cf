//! What threads bring within one tile, by each way to share its contacts (`physics.parallel`): the report's section 3.
//!
//! ```sh
//! cargo run --release -p atoll-benches --bin strategies [SCENE] [REPEATS [THREADS]]
//! ```
//!
//! Without a scene, all of them: `sparse`, `normal`, `pile`, `single-island`. Every strategy runs on THREADS threads, and
//! serial on one thread too, which every speedup is told against. They take turns, so that a machine that gets slower
//! meanwhile does so for all of them; figures are medians.
//!
//! - The solver's time is that of the phases `coloring`, `prepare` and `substeps`. Only the substeps of serial are all on
//!   one thread: constraint rows are written by all threads whatever the strategy, and so are the other phases.
//! - Islands are divided among threads in the phase `islands`, right after they are found. That time is told apart.
//! - Coloring is no cost of one strategy here. Its order is part of the result, and contacts of one color fill the lanes
//!   of a vector, on one thread as well: so every strategy colors.
//! - Strategies change no bit: if two runs of a scene differ, the program fails.
//!
//! Reported: islands bring a factor of 5 in typical scenes and coloring 3.9, in sparse scenes 5.2 and 3.8, and in a single
//! island 2.7 and 3.2 (a strategy with both, contacts packed by color whatever their islands: here `coloring`), on up
//! to 36 threads. How many threads each of these factors took, the report does not say: to be compared is which strategy
//! is ahead, not the factors.

use atoll::Summary;
use atoll_benches::{File, NORMAL, PILE, SINGLE_ISLAND, SPARSE, median, part_and_arguments, run};
use std::process::ExitCode;

/// A scene, in one tile.
struct Scene {
    name: &'static str,
    file: File,
    bodies: u64,
    steps: u64,
    /// Speedups by islands and by coloring.
    reported: Option<[f64; 2]>,
}

const SCENES: [Scene; 4] = [
    Scene { name: "sparse", file: SPARSE, bodies: 100_000, steps: 200, reported: Some([5.2, 3.8]) },
    Scene { name: "normal", file: NORMAL, bodies: 100_000, steps: 120, reported: Some([5.0, 3.9]) },
    Scene { name: "pile", file: PILE, bodies: 20_000, steps: 200, reported: None },
    Scene { name: "single-island", file: SINGLE_ISLAND, bodies: 50_000, steps: 60, reported: Some([2.7, 3.2]) },
];

/// Phases that depend on the strategy. All but the first are the solver's; see the top of the file.
const PHASES: [&str; 4] = ["islands", "coloring", "prepare", "substeps"];

/// What was measured of one strategy on some threads.
struct Row {
    strategy: &'static str,
    threads: u64,
    /// Of each repeat, in milliseconds a step.
    step: Vec<f64>,
    solver: Vec<f64>,
    phases: [Vec<f64>; PHASES.len()],
}

impl Row {
    fn new(strategy: &'static str, threads: u64) -> Self {
        Self { strategy, threads, step: Vec::new(), solver: Vec::new(), phases: Default::default() }
    }

    fn add(&mut self, run: &Summary) {
        let of = |phase| run.phases.iter().find(|(name, _)| *name == phase).map_or(0.0, |(_, time)| time.mean_ms);
        let times = PHASES.map(of);
        self.step.push(run.ms_per_step);
        self.solver.push(times[1..].iter().sum());
        self.phases.iter_mut().zip(times).for_each(|(all, time)| all.push(time));
    }

    fn step_ms(&self) -> f64 {
        median(self.step.clone())
    }

    fn solver_ms(&self) -> f64 {
        median(self.solver.clone())
    }
}

fn main() -> ExitCode {
    match compare() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("strategies: {error}");
            ExitCode::FAILURE
        }
    }
}

fn compare() -> Result<(), String> {
    let (chosen, [repeats, threads]) =
        part_and_arguments(&SCENES.map(|scene| scene.name), ["REPEATS", "THREADS"], [9, 2])?;
    eprintln!("speedups to serial on 1 thread, here on {threads} threads; reported: on up to 36\n");
    let mut measured = Vec::new();
    for scene in SCENES.into_iter().filter(|scene| chosen(scene.name)) {
        let (rows, facts) = in_turns(&scene, repeats, threads)?;
        table(&scene, &rows, &facts, repeats);
        measured.push((scene, rows));
    }
    eprintln!("auto, its time to that of the better of islands and coloring:");
    eprintln!("{:>14}{:>9}{:>16}{:>9}{:>16}", "scene", "solver", "to", "step", "to");
    for (scene, rows) in measured {
        let [solver, step] = [Row::solver_ms, Row::step_ms].map(|time| auto_to_better(&rows, time));
        eprintln!("{:>14}{:>9.3}{:>16}{:>9.3}{:>16}", scene.name, solver.0, solver.1, step.0, step.1);
        println!(
            r#"{{"bench":"strategies-auto","scene":"{}","threads":{threads},"solver_ratio":{:.3},"solver_to":"{}","step_ratio":{:.3},"step_to":"{}"}}"#,
            scene.name, solver.0, solver.1, step.0, step.1
        );
    }
    Ok(())
}

/// All strategies on one scene, and what all runs have in common. The first row is serial on one thread.
fn in_turns(scene: &Scene, repeats: u64, threads: u64) -> Result<(Vec<Row>, Summary), String> {
    let mut rows = vec![Row::new("serial", 1)];
    rows.extend((threads > 1).then(|| Row::new("serial", threads)));
    rows.extend(["islands", "coloring", "auto"].map(|strategy| Row::new(strategy, threads)));
    let mut first: Option<Summary> = None;
    for _ in 0..repeats {
        for row in &mut rows {
            let summary = one_run(scene, row.strategy, row.threads)?;
            row.add(&summary);
            let first = first.get_or_insert_with(|| summary.clone());
            same_bits(first, &summary).map_err(|which| {
                let Row { strategy, threads, .. } = row;
                format!("{}: {which} of {strategy} on {threads} threads are not those of serial on 1", scene.name)
            })?;
        }
    }
    Ok((rows, first.expect("at least one repeat")))
}

fn one_run(scene: &Scene, strategy: &str, threads: u64) -> Result<Summary, String> {
    let (bodies, steps, threads) = (scene.bodies.to_string(), scene.steps.to_string(), threads.to_string());
    let one_tile = [("tiles", "1x1"), ("ranks", "1"), ("threads", &threads)];
    let overrides = [("bodies", bodies.as_str()), ("steps", &steps), ("parallel", strategy)];
    run(scene.file, &[overrides, one_tile].concat()).map_err(|error| format!("{}: {error}", scene.name))
}

/// Says what differs.
fn same_bits(a: &Summary, b: &Summary) -> Result<(), &'static str> {
    match (a.state_hash == b.state_hash, a.contact_hash == b.contact_hash) {
        (true, true) => Ok(()),
        (false, _) => Err("the final bodies"),
        (true, false) => Err("the final contacts"),
    }
}

fn table(scene: &Scene, rows: &[Row], facts: &Summary, repeats: u64) {
    let Scene { name, bodies, steps, .. } = scene;
    let [islands, largest_island, colors] =
        [facts.islands, facts.largest_island, facts.colors].map(|of_step| of_step.expect("steps were made"));
    let contacts = facts.contacts;
    eprintln!("{name}: {bodies} bodies in one tile, {steps} steps, median of {repeats}");
    eprintln!(
        "at the end: contacts {contacts}, islands {islands}, bodies in the largest {largest_island}, colors {colors}"
    );
    eprintln!("{:>28}{:>20}{:>20}{:>11}{:>10}{:>10}", "step", "solver", "reported", "islands", "coloring", "of step");
    eprintln!(
        "{:>10}{:>8}{:>10}{:>10}{:>10}{:>10}{:>10}{:>11}{:>10}{:>10}",
        "strategy", "threads", "ms", "speedup", "ms", "speedup", "speedup", "ms", "ms", "%"
    );
    for row in rows {
        let Row { strategy, threads, .. } = row;
        let (step, solver) = (row.step_ms(), row.solver_ms());
        let (step_speedup, solver_speedup) = (rows[0].step_ms() / step, rows[0].solver_ms() / solver);
        let [islands_ms, coloring, prepare, substeps] = row.phases.clone().map(median);
        let share = coloring / step;
        let reported = reported(scene, strategy);
        let reported_text = reported.map_or("-".to_owned(), |speedup| format!("{speedup:.1}"));
        let percent = 100.0 * share;
        eprintln!(
            "{strategy:>10}{threads:>8}{step:>10.3}{step_speedup:>10.2}{solver:>10.3}{solver_speedup:>10.2}{reported_text:>10}{islands_ms:>11.3}{coloring:>10.3}{percent:>10.1}"
        );
        let (state_hash, contact_hash) = (&facts.state_hash, &facts.contact_hash);
        let reported_json = reported.map_or("null".to_owned(), |speedup| speedup.to_string());
        println!(
            r#"{{"bench":"strategies","scene":"{name}","bodies":{bodies},"steps":{steps},"strategy":"{strategy}","threads":{threads},"step_ms":{step:.3},"step_speedup":{step_speedup:.3},"solver_ms":{solver:.3},"solver_speedup":{solver_speedup:.3},"reported_speedup":{reported_json},"islands_ms":{islands_ms:.3},"coloring_ms":{coloring:.3},"prepare_ms":{prepare:.3},"substeps_ms":{substeps:.3},"coloring_share":{share:.4},"contacts":{contacts},"islands":{islands},"largest_island":{largest_island},"colors":{colors},"repeats_step_ms":{:.3?},"repeats_solver_ms":{:.3?},"state_hash":"{state_hash}","contact_hash":"{contact_hash}"}}"#,
            row.step, row.solver
        );
    }
    eprintln!();
}

/// The speedup in the report, on up to 36 threads.
fn reported(scene: &Scene, strategy: &str) -> Option<f64> {
    let [islands, coloring] = scene.reported?;
    match strategy {
        "islands" => Some(islands),
        "coloring" => Some(coloring),
        _ => None,
    }
}

/// How much longer auto takes than the better of the two it chooses from, and which that is.
fn auto_to_better(rows: &[Row], time: fn(&Row) -> f64) -> (f64, &'static str) {
    let of = |strategy| rows.iter().find(|row| row.strategy == strategy).map(time).expect("a row for each strategy");
    let (islands, coloring) = (of("islands"), of("coloring"));
    let (better, least) = if islands <= coloring { ("islands", islands) } else { ("coloring", coloring) };
    (of("auto") / least, better)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_runs_at_a_small_size() {
        for scene in SCENES {
            let small = Scene { bodies: 300, steps: 3, ..scene };
            let (rows, facts) = in_turns(&small, 2, 2).unwrap();
            let strategies: Vec<_> = rows.iter().map(|row| (row.strategy, row.threads)).collect();
            assert_eq!(strategies, [("serial", 1), ("serial", 2), ("islands", 2), ("coloring", 2), ("auto", 2)]);
            assert_eq!((facts.tiles, facts.bodies), ([1, 1], 300), "{}", small.name);
            for row in rows {
                assert_eq!((row.step.len(), row.solver.len()), (2, 2), "{}", small.name);
                for (step, solver) in row.step.into_iter().zip(row.solver) {
                    assert!(0.0 < solver && solver < step, "{}: solver {solver} ms of {step}", small.name);
                }
                assert!(row.phases.iter().flatten().all(|&ms| ms > 0.0), "{}: a phase without a time", small.name);
            }
        }
    }

    #[test]
    fn runs_that_differ_are_told() {
        let scene = Scene { bodies: 300, steps: 3, ..SCENES[1] };
        let one = one_run(&scene, "auto", 1).unwrap();
        assert_eq!(same_bits(&one, &one_run(&scene, "serial", 2).unwrap()), Ok(()));
        let later = one_run(&Scene { steps: 4, ..scene }, "auto", 1).unwrap();
        assert_eq!(same_bits(&one, &later), Err("the final bodies"));
        let mut other = one.clone();
        other.contact_hash = later.contact_hash;
        assert_eq!(same_bits(&one, &other), Err("the final contacts"));
    }

    #[test]
    fn auto_is_compared_with_the_better_one() {
        let row = |strategy, ms: f64| Row { step: vec![ms], ..Row::new(strategy, 2) };
        let rows = |islands, coloring| [row("islands", islands), row("coloring", coloring), row("auto", 6.0)];
        assert_eq!(auto_to_better(&rows(4.0, 5.0), Row::step_ms), (1.5, "islands"));
        assert_eq!(auto_to_better(&rows(24.0, 12.0), Row::step_ms), (0.5, "coloring"));
    }
}
