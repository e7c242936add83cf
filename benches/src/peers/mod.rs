//! One scene, or any world of yours, body for body, in Atoll, in Box2D v3 and in rapier2d: program `peers`.
//!
//! Every run is a process of its own, the engines take turns, and the figures are medians. The clock measures steps
//! alone; the memory is the process's peak after the last step. Then the final bodies of every engine go into a fresh
//! [`atoll_core::World`], and the same code measures contacts, overlap and energy for all ([`quality`]).
//!
//! # What is set alike
//!
//! Bodies, walls, shapes, density, friction, restitution and their mixing rules; gravity and damping, also of single kinds,
//! who never turns, categories and masks; length of a step, substeps;
//! stiffness and damping of contacts (twice the stiffness against walls, which is Box2D's and rapier's own rule); the
//! speed of pushing out; linear and angular damping; no sleep; no continuous collision.
//!
//! # What each engine keeps
//!
//! - **Atoll**: `f64` positions; segments that are solid from one side, where those of the others are from both; the tiles and the
//!   exchange of the configuration. All tiles are in one process, and no transport is between them.
//! - **Box2D**: its cap of 400 m/s, its turn of at most an eighth a step, its margins, `f32` positions; its AVX2 kernels,
//!   compiled by the C compiler at `-O3`. More threads are its own scheduler's. It counts a solver block's bodies in 16
//!   bits, so a world never gets more than [`box2d::MOST_BODIES`]; rooms that nothing can leave are worlds of their own,
//!   stepped one after another.
//! - **rapier2d**: as Box2D, whose scheme it follows: a cap of 400 m/s, prediction 0.02 m, recycled and clustered
//!   contacts, its 2 x 2 block solver, one internal iteration and one of stabilization per substep. One world. It has no
//!   threshold of restitution. Its vectors have four lanes, and the instructions are those that Rust was told to use
//!   (`RUSTFLAGS="-C target-cpu=native"` allows it AVX2; Atoll finds that out by itself).

pub mod atoll;
pub mod box2d;
pub mod case;
pub mod children;
pub mod given;
pub mod quality;
pub mod rapier;
pub mod report;
#[cfg(test)]
mod tests;

use ::atoll_core::Body;
use case::Case;
use clap::ValueEnum;
use given::Given as _;
use quality::Quality;
use rayon::ThreadPool;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::time::Instant;

/// What can be compared.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
#[value(rename_all = "lower")]
pub enum Engine {
    /// This workspace.
    Atoll,
    /// Box2D v3, in C.
    Box2d,
    /// rapier2d, in Rust.
    Rapier,
}

impl fmt::Display for Engine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Atoll => "atoll",
            Self::Box2d => "box2d",
            Self::Rapier => "rapier",
        })
    }
}

/// A world in one of the engines.
pub trait Simulation {
    /// Makes one step.
    ///
    /// # Errors
    /// If the engine says that it cannot.
    fn step(&mut self) -> Result<(), String>;

    /// Sum of the masses of the dynamic bodies, in kg, as the engine has them.
    fn mass(&self) -> f64;

    /// The state of all dynamic bodies, in the order of their ids.
    fn bodies(&self) -> Vec<Body>;
}

/// What one run in one engine was like.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Run {
    /// Name and version, as the engine tells it.
    pub engine_version: String,
    /// Mean time of a step, in ms; zero without steps.
    pub ms_per_step: f64,
    /// The most memory the process held until the last step, in bytes.
    pub peak_rss_bytes: u64,
    /// What its bodies look like at the end.
    pub quality: Quality,
}

/// Why there is no figure.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Failure {
    /// What the program exits with: 2 for what was asked, 1 for what went wrong.
    pub exit: u8,
    /// What and how to mend it, in one line.
    pub message: String,
}

impl Failure {
    /// What was asked for cannot be done.
    pub fn refused(message: impl fmt::Display) -> Self {
        Self { exit: 2, message: message.to_string() }
    }

    /// Something went wrong on the way.
    pub fn broken(message: impl fmt::Display) -> Self {
        Self { exit: 1, message: message.to_string() }
    }
}

/// Runs a case in an engine, here and now.
///
/// # Errors
/// If the engine refuses the case, has other bodies than the case, or ends in a state that cannot be measured.
pub fn run(engine: Engine, case: &Case) -> Result<Run, Failure> {
    match engine {
        Engine::Atoll => pool(case)?.install(|| measure(atoll::version(), atoll::Simulated::new(case)?, case)),
        Engine::Box2d => measure(box2d::version(), box2d::Worlds::new(case)?, case),
        Engine::Rapier => pool(case)?.install(|| measure(rapier::version(), rapier::Simulated::new(case), case)),
    }
}

/// Threads for the engines that use rayon.
fn pool(case: &Case) -> Result<ThreadPool, Failure> {
    rayon::ThreadPoolBuilder::new().num_threads(case.threads).build().map_err(Failure::broken)
}

fn measure(engine_version: String, mut simulation: impl Simulation, case: &Case) -> Result<Run, Failure> {
    let (mass, expected) = (simulation.mass(), case.mass());
    if (mass / expected - 1.0).abs() > 1e-4 {
        return Err(Failure::broken(format!(
            "its bodies weigh {mass} kg instead of {expected} kg: not the same scene"
        )));
    }
    let start = Instant::now();
    for _ in 0..case.steps {
        simulation.step().map_err(Failure::broken)?;
    }
    let wall = start.elapsed();
    let peak_rss_bytes = crate::peak_rss_bytes();
    let bodies = simulation.bodies();
    drop(simulation);
    let quality = pool(case)?.install(|| quality::measure(case, &bodies))?;
    let ms_per_step = wall.as_secs_f64() * 1e3 / case.steps.max(1) as f64;
    Ok(Run { engine_version, ms_per_step, peak_rss_bytes, quality })
}
