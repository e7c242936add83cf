//! One record: in memory on its way to a file, and as it is read back.

use atoll_core::{Body, Rot};
use bytemuck::{Pod, Zeroable};

/// The bodies of one rank after a step, a column for each field. Filled where the bodies are and written elsewhere; used
/// again, it allocates nothing.
#[derive(Clone, Default, Debug)]
pub struct Record {
    pub(super) step: u32,
    pub(super) id: Vec<u64>,
    pub(super) x: Vec<f64>,
    pub(super) y: Vec<f64>,
    // Angles are left to the writer: they take longer than all the rest.
    pub(super) rotation: Vec<Rot>,
    pub(super) vx: Vec<f32>,
    pub(super) vy: Vec<f32>,
    pub(super) omega: Vec<f32>,
    pub(super) kind: Vec<u32>,
}

impl Record {
    /// Forgets what it holds and takes the bodies after `step` steps, in their order.
    ///
    /// # Panics
    /// If a step has no place in 32 bits, which no configuration allows.
    pub fn fill(&mut self, step: u64, bodies: impl Iterator<Item = Body>) {
        self.step = u32::try_from(step).expect("a run makes at most 2^32 - 1 steps");
        self.id.clear();
        self.x.clear();
        self.y.clear();
        self.rotation.clear();
        self.vx.clear();
        self.vy.clear();
        self.omega.clear();
        self.kind.clear();
        bodies.for_each(|body| {
            self.id.push(body.id.0);
            self.x.push(body.position.x);
            self.y.push(body.position.y);
            self.rotation.push(body.rotation);
            self.vx.push(body.velocity.x);
            self.vy.push(body.velocity.y);
            self.omega.push(body.angular_velocity);
            self.kind.push(body.kind.0);
        });
    }

    /// Bodies in it.
    pub fn len(&self) -> usize {
        self.id.len()
    }

    /// Whether there is none: its rank was idle.
    pub fn is_empty(&self) -> bool {
        self.id.is_empty()
    }
}

/// A body as it was recorded.
#[derive(Clone, Copy, PartialEq, Default, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Row {
    /// Its name.
    pub id: u64,
    /// Center of mass, in m.
    pub x: f64,
    /// Center of mass, in m.
    pub y: f64,
    /// In rad, from -pi to pi.
    pub angle: f32,
    /// Velocity, in m/s.
    pub vx: f32,
    /// Velocity, in m/s.
    pub vy: f32,
    /// Angular velocity, in rad/s, counter-clockwise.
    pub omega: f32,
    /// Row of the table of kinds; in recordings of format 1, which have none, 0.
    pub kind: u32,
    /// Nothing: so that rows are plain data.
    #[doc(hidden)]
    pub padding: u32,
}
