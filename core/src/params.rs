//! Every number that a step depends on, with unit, default and meaning.

use crate::error::SetupError;
use glam::Vec2;

/// When tiles speak to each other within a step.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Exchange {
    /// Once, at the start. Good where borders see passing collisions.
    #[default]
    Step,
    /// After every substep too, and border impulses are averaged. For anything that rests on a border.
    Substep,
}

/// How pairs of near bodies are found.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum BroadPhase {
    /// Cells sorted in memory, built anew each step.
    #[default]
    Grid,
}

/// How contact impulses are found.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Solver {
    /// Substepped soft constraints with relax (Box2D v3's scheme).
    #[default]
    SoftStep,
}

/// The parameters of a step. `Default` is the setting of the scenes: 60 Hz, 4 substeps, no gravity.
#[derive(Clone, PartialEq, Debug)]
pub struct Params {
    /// Length of a step in seconds (1/60). Longer is faster and less exact.
    pub dt: f32,
    /// Substeps in a step (4). More make stacks stiffer; the solver's cost grows with them.
    pub substeps: u32,
    /// Acceleration of every dynamic body, in m/s^2 (none).
    pub gravity: Vec2,
    /// Rate at which velocity fades, in 1/s (0).
    pub linear_damping: f32,
    /// Rate at which spin fades, in 1/s (0).
    pub angular_damping: f32,
    /// Greatest speed of a center, in m/s (none: infinity).
    pub max_linear_speed: f32,
    /// Greatest angular speed, in rad/s (47: no more than an eighth of a turn a step, as in Box2D).
    pub max_angular_speed: f32,
    /// Stiffness of a contact between dynamic bodies, in Hz (30); twice that against statics. Held below a quarter of
    /// the substep rate.
    pub contact_hertz: f32,
    /// Damping ratio of a contact (10, strongly overdamped: contacts push, they do not spring).
    pub contact_damping_ratio: f32,
    /// Greatest speed at which overlap is pushed out, in m/s (3). More resolves overlap sooner, with more energy.
    pub push_out_speed: f32,
    /// A contact is made when separation < this + closing speed x dt, in m (0.02).
    pub speculative_distance: f32,
    /// A contact's normal and anchors stay frozen until this much relative motion, in m (0.05). Zero computes every
    /// manifold anew, and piles never quite come to rest.
    pub recycle_distance: f32,
    /// Approach speed below which nothing bounces, in m/s (1).
    pub restitution_threshold: f32,
    /// Least margin of a body's AABB, in m (0.05).
    pub margin_floor: f32,
    /// Greatest margin of a body's AABB, in m (0.5). Bodies that move further in a step may tunnel. Part of the width
    /// of the halo.
    pub margin_cap: f32,
    /// The bodies of a tile are sorted by place every so many steps (32). For memory locality alone, yet part of the
    /// result: constraint order follows body order.
    pub sort_interval: u32,
    /// Sync points (per step).
    pub exchange: Exchange,
    /// Broad phase (grid). Changes no bit of the result.
    pub broad_phase: BroadPhase,
    /// Solver (soft-step).
    pub solver: Solver,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            dt: 1.0 / 60.0,
            substeps: 4,
            gravity: Vec2::ZERO,
            linear_damping: 0.0,
            angular_damping: 0.0,
            max_linear_speed: f32::INFINITY,
            max_angular_speed: 47.0,
            contact_hertz: 30.0,
            contact_damping_ratio: 10.0,
            push_out_speed: 3.0,
            speculative_distance: 0.02,
            recycle_distance: 0.05,
            restitution_threshold: 1.0,
            margin_floor: 0.05,
            margin_cap: 0.5,
            sort_interval: 32,
            exchange: Exchange::default(),
            broad_phase: BroadPhase::default(),
            solver: Solver::default(),
        }
    }
}

impl Params {
    /// Refuses what no step can be made with.
    pub fn check(&self) -> Result<(), SetupError> {
        let positive = |name, value: f32| require(name, value, value > 0.0 && value.is_finite(), "positive and finite");
        let not_negative =
            |name, value: f32| require(name, value, value >= 0.0 && value.is_finite(), "at least 0 and finite");
        positive("dt", self.dt)?;
        require("substeps", self.substeps as f32, (1..=64).contains(&self.substeps), "within 1 to 64")?;
        require("gravity", self.gravity.length(), self.gravity.is_finite(), "finite")?;
        not_negative("linear_damping", self.linear_damping)?;
        not_negative("angular_damping", self.angular_damping)?;
        require("max_linear_speed", self.max_linear_speed, self.max_linear_speed > 0.0, "positive")?;
        require("max_angular_speed", self.max_angular_speed, self.max_angular_speed > 0.0, "positive")?;
        positive("contact_hertz", self.contact_hertz)?;
        not_negative("contact_damping_ratio", self.contact_damping_ratio)?;
        not_negative("push_out_speed", self.push_out_speed)?;
        not_negative("speculative_distance", self.speculative_distance)?;
        not_negative("recycle_distance", self.recycle_distance)?;
        not_negative("restitution_threshold", self.restitution_threshold)?;
        positive("margin_floor", self.margin_floor)?;
        require(
            "margin_cap",
            self.margin_cap,
            self.margin_cap >= self.margin_floor && self.margin_cap.is_finite(),
            "finite and at least margin_floor",
        )?;
        require("sort_interval", self.sort_interval as f32, self.sort_interval > 0, "at least 1")
    }

    /// Length of a substep in seconds.
    pub(crate) fn substep(&self) -> f32 {
        self.dt / self.substeps as f32
    }
}

fn require(name: &'static str, value: f32, holds: bool, must: &'static str) -> Result<(), SetupError> {
    if holds { Ok(()) } else { Err(SetupError::BadParam { name, value: f64::from(value), must }) }
}
