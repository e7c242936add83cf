//! Worlds of which theory knows what becomes of them, in every engine by one code: program `fidelity`.
//!
//! Each case is a figure with a theoretical value: of single collisions (`laws`), and of crowds (`crowds`). It is measured at several lengths of a step, and, where surfaces meet, for
//! many moments within the step in which they do: what is told is the mean error and the worst one, in parts of the value.

mod crowds;
mod hard_discs;
mod laws;

use crate::peers::given::{Corners, Given};
use crate::peers::{Engine, Failure, Simulation, atoll, box2d, rapier};
use atoll_core::{Blueprint, Body};
use laws::Law;
use serde::Serialize;
use std::fmt::Write as _;

/// Steps per second that are usual.
pub const HERTZ: [u32; 4] = [60, 120, 240, 960];

/// Moments within a step.
const PHASES: u32 = 20;

/// The start of a case.
struct Start {
    blueprint: Blueprint,
    bodies: Vec<Body>,
}

impl Given for Start {
    fn blueprint(&self) -> &Blueprint {
        &self.blueprint
    }

    fn bodies(&self) -> impl Iterator<Item = Body> {
        self.bodies.iter().copied()
    }

    fn home(&self, _: u64) -> Corners {
        [self.blueprint.partition.min().to_array(), self.blueprint.partition.max().to_array()]
    }

    fn threads(&self) -> usize {
        1
    }
}

/// What an engine makes of a case.
#[derive(Clone, PartialEq, Debug, Serialize)]
struct Row {
    case: String,
    theory: f64,
    engine: String,
    hertz: u32,
    /// Mean over the phases.
    mean: f64,
    /// The greatest error, as a part of what theory says.
    worst: f64,
}

const ENGINES: [Engine; 3] = [Engine::Atoll, Engine::Box2d, Engine::Rapier];

/// Measures the cases whose name has `only` in it, tells each row as JSON, and returns all as a table.
///
/// # Errors
/// If an engine refuses a world, or fails.
pub fn table(only: &str, hertz: &[u32], mut tell: impl FnMut(&str)) -> Result<String, Failure> {
    let mut table = String::from("| case | theory | Hz |");
    let _ = ENGINES.iter().try_for_each(|engine| write!(table, " {engine} | error |"));
    let _ = writeln!(table, "\n|---|---|---|{}", "---|---|".repeat(ENGINES.len()));
    for law in laws::laws().iter().chain(&crowds::laws()).filter(|law| law.name.contains(only)) {
        let theory = (law.theory)();
        for &hertz in hertz {
            let _ = write!(table, "| {} | {} | {hertz} |", law.name, short(theory));
            for engine in ENGINES {
                let row = measure(law, theory, engine, hertz)?;
                tell(&serde_json::to_string(&row).map_err(Failure::broken)?);
                let _ = write!(table, " {} | {} % |", short(row.mean), short(100.0 * row.worst));
            }
            table.push('\n');
        }
    }
    Ok(table)
}

fn measure(law: &Law, theory: f64, engine: Engine, hertz: u32) -> Result<Row, Failure> {
    let (mut sum, mut worst) = (0.0, 0.0_f64);
    for phase in 0..law.phases {
        let start = (law.start)(f64::from(hertz), f64::from(phase) / f64::from(law.phases));
        let value = match engine {
            Engine::Atoll => (law.read)(&mut Course::new(atoll::Simulated::new(&start)?, hertz)),
            Engine::Box2d => (law.read)(&mut Course::new(box2d::Worlds::new(&start)?, hertz)),
            Engine::Rapier => (law.read)(&mut Course::new(rapier::Simulated::new(&start), hertz)),
        };
        let value = value.map_err(Failure::broken)?;
        sum += value;
        worst = worst.max((value / theory - 1.0).abs());
    }
    let (case, engine, mean) = (law.name.clone(), engine.to_string(), sum / f64::from(law.phases));
    Ok(Row { case, theory, engine, hertz, mean, worst })
}

/// A figure in three digits or so.
fn short(value: f64) -> String {
    let digits = (3.0 - value.abs().max(1e-3).log10().floor()).clamp(0.0, 4.0) as usize;
    format!("{value:.digits$}")
}

/// A world on its way.
struct Course<'a> {
    simulation: Box<dyn Simulation + 'a>,
    hertz: f64,
}

impl<'a> Course<'a> {
    fn new(simulation: impl Simulation + 'a, hertz: u32) -> Self {
        Self { simulation: Box::new(simulation), hertz: f64::from(hertz) }
    }

    /// Steps for so many seconds, and looks at the bodies then.
    fn after(&mut self, seconds: f64) -> Result<Vec<Body>, String> {
        for _ in 0..(seconds * self.hertz).round() as u64 {
            self.simulation.step()?;
        }
        Ok(self.simulation.bodies())
    }
}
