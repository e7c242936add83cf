//! Every number that a step depends on, with unit, default and meaning.

use crate::model::error::SetupError;
use crate::model::math::max;
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
    /// A quadtree of fat AABBs that lives from step to step; bodies that left theirs are put in anew (the report's).
    Quadtree,
}

/// How contact impulses are found.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Solver {
    /// Substepped soft constraints with relax (Box2D v3's scheme).
    #[default]
    SoftStep,
    /// Sequential impulses over each half of the step: projected Gauss-Seidel with warm starting and accumulated clamping, and
    /// Baumgarte's position correction (the report's). Counts as two substeps.
    Pgs,
}

/// How the islands of a tile are found. The same islands, and the same bits, whichever.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum IslandSearch {
    /// Disjoint sets joined contact by contact.
    #[default]
    UnionFind,
    /// Depth-first search over each body's contacts (the report's).
    Dfs,
    /// Disjoint sets joined by all threads at once.
    ParallelUnionFind,
}

/// How one tile's contacts are shared among threads, where there are more threads than tiles. The same bits, whichever.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Parallel {
    /// Not at all.
    Serial,
    /// Every island on one thread (the report's).
    Islands,
    /// Contacts of one color on all threads at once, whatever their islands.
    Coloring,
    /// Large islands by color, the small ones by island.
    #[default]
    Auto,
}

/// For which instructions the inner loops are compiled. The same bits, whichever.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Instructions {
    /// The widest vectors that this processor has.
    #[default]
    Auto,
    /// None but those that every processor of its kind has: what all others are held against.
    Portable,
    /// AVX2, of x86-64; refused where there is none.
    Avx2,
    /// AVX-512 (F, VL, BW, DQ), of x86-64; refused where there is none.
    Avx512,
}

impl Instructions {
    /// As configurations have it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Portable => "portable",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }
}

/// How a ghost takes part in the contacts of a tile that does not own it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Ghosts {
    /// With its true mass; the owner's result stands.
    #[default]
    Dynamic,
    /// Read-only: infinite mass, constant velocity (the report's). For comparison: it doubles border impulses.
    Frozen,
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
    /// Greatest angular speed, in rad/s (none: infinity). No body turns further than an eighth of a turn in a
    /// substep; where a step has fewer than four, in a fourth of the step or so.
    pub max_angular_speed: f32,
    /// Stiffness of a contact between dynamic bodies, in Hz (30); twice that against statics. Held below a quarter of
    /// the substep rate.
    pub contact_hertz: f32,
    /// Damping ratio of a contact (10, strongly overdamped: contacts push, they do not spring).
    pub contact_damping_ratio: f32,
    /// Greatest speed at which overlap is pushed out, in m/s (3). More resolves overlap sooner, with more energy.
    pub push_out_speed: f32,
    /// A contact is made of bodies nearer than this, and of those that will touch within the step, in m (0.02).
    pub speculative_distance: f32,
    /// A contact's manifold is kept until this much relative motion, in m (0.05), less of small bodies and narrow contacts. Zero computes every manifold anew, and piles never quite come to rest.
    pub recycle_distance: f32,
    /// Approach speed below which nothing bounces, in m/s (1).
    pub restitution_threshold: f32,
    /// Least margin of a body's AABB, in m (0.05).
    pub margin_floor: f32,
    /// Greatest margin of a body's AABB, in m (0.5). A step in which a body moves further costs an exchange more. Part of the width
    /// of the halo.
    pub margin_cap: f32,
    /// Bodies of a greater bounding radius are few, and do not widen the halo, in m (none: infinity). A step in which one of them lies
    /// over the rim of its tile's halo costs an exchange more.
    pub large_radius: f32,
    /// The bodies of a tile are sorted by place every so many steps (32). For memory locality alone, yet part of the
    /// result: constraint order follows body order.
    pub sort_interval: u32,
    /// Sync points (per step).
    pub exchange: Exchange,
    /// Broad phase (grid). Changes no bit of the result.
    pub broad_phase: BroadPhase,
    /// Solver (soft-step).
    pub solver: Solver,
    /// Passes over all contacts in a step of [`Solver::Pgs`] (10), half of them in each half. More make stacks stiffer; the solver's cost grows with
    /// them.
    pub iterations: u32,
    /// Part of an overlap that [`Solver::Pgs`] pushes out in a step (0.1), at most `push_out_speed`. More resolves it
    /// sooner, with more energy.
    pub baumgarte: f32,
    /// Overlap that [`Solver::Pgs`] leaves alone, in m (0.005), so that resting contacts do not flicker.
    pub linear_slop: f32,
    /// How islands are found (union-find). Changes no bit of the result.
    pub island_search: IslandSearch,
    /// How a tile's contacts are shared among threads (auto). Changes no bit of the result.
    pub parallel: Parallel,
    /// For which instructions the inner loops are compiled (auto). Changes no bit of the result.
    pub instructions: Instructions,
    /// What ghosts are (dynamic).
    pub ghosts: Ghosts,
    /// Islands that rest are left out until something touches them (no).
    pub sleep: bool,
    /// Speed of a body's fastest point below which it counts as resting, in m/s (0.05); or a quarter of what gravity gives it in
    /// `sleep_time`, if that is less.
    pub sleep_speed: f32,
    /// An island falls asleep once all its bodies have rested for so long, in s (0.5).
    pub sleep_time: f32,
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
            max_angular_speed: f32::INFINITY,
            contact_hertz: 30.0,
            contact_damping_ratio: 10.0,
            push_out_speed: 3.0,
            speculative_distance: 0.02,
            recycle_distance: 0.05,
            restitution_threshold: 1.0,
            margin_floor: 0.05,
            margin_cap: 0.5,
            large_radius: f32::INFINITY,
            sort_interval: 32,
            exchange: Exchange::default(),
            broad_phase: BroadPhase::default(),
            solver: Solver::default(),
            iterations: 10,
            baumgarte: 0.1,
            linear_slop: 0.005,
            island_search: IslandSearch::default(),
            parallel: Parallel::default(),
            instructions: Instructions::default(),
            ghosts: Ghosts::default(),
            sleep: false,
            sleep_speed: 0.05,
            sleep_time: 0.5,
        }
    }
}

/// Nothing bounces that comes nearer at less than this, in m/s: bodies at rest that touch have such speeds, and pass on a blow.
const SLIGHT: f32 = 1e-5;

impl Params {
    /// What bounces comes nearer at more than this, in m/s.
    pub(crate) fn least_bounce(&self) -> f32 {
        max(self.restitution_threshold, SLIGHT)
    }

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
        require("large_radius", self.large_radius, self.large_radius > 0.0, "positive")?;
        require("sort_interval", self.sort_interval as f32, self.sort_interval > 0, "at least 1")?;
        require("iterations", self.iterations as f32, (1..=1000).contains(&self.iterations), "within 1 to 1000")?;
        require("baumgarte", self.baumgarte, (0.0..=1.0).contains(&self.baumgarte), "within 0 to 1")?;
        not_negative("linear_slop", self.linear_slop)?;
        not_negative("sleep_speed", self.sleep_speed)?;
        positive("sleep_time", self.sleep_time)?;
        if self.ghosts == Ghosts::Frozen && self.exchange == Exchange::Substep {
            return Err(SetupError::FrozenSubsteps);
        }
        Ok(())
    }

    /// How often velocities and positions are integrated in a step.
    pub(crate) fn integrations(&self) -> u32 {
        match self.solver {
            Solver::SoftStep => self.substeps,
            Solver::Pgs => 2,
        }
    }

    /// How often bounces are worked out in a step. Both owners of a border contact do so with what each knows, and take the lesser; once
    /// they have heard of each other's, who parts too slowly yet gets the rest.
    pub(crate) fn bounce_rounds(&self) -> u32 {
        match self.exchange {
            Exchange::Step => 1,
            Exchange::Substep => 2,
        }
    }

    /// Length of a substep in seconds.
    pub(crate) fn substep(&self) -> f32 {
        self.dt / self.integrations() as f32
    }
}

fn require(name: &'static str, value: f32, holds: bool, must: &'static str) -> Result<(), SetupError> {
    if holds { Ok(()) } else { Err(SetupError::BadParam { name, value: f64::from(value), must }) }
}
