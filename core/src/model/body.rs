//! Bodies: one by one as records, and many as a structure of arrays.

use crate::model::id::{GlobalId, KindId};
use crate::model::kind::Kind;
use crate::model::math::Rot;
use crate::model::path::{Path, Travel};
use bytemuck::{Pod, Zeroable};
use glam::{DVec2, Vec2};
use std::ops::Range;

/// The whole state of one dynamic body. This is also how a body travels: 48 bytes, nothing rounded.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Body {
    /// Name, for life.
    pub id: GlobalId,
    /// Center of mass in the world, in meters.
    pub position: DVec2,
    /// Orientation.
    pub rotation: Rot,
    /// Velocity of the center, in m/s.
    pub velocity: Vec2,
    /// Angular velocity, in rad/s, counter-clockwise.
    pub angular_velocity: f32,
    /// Row of the table of kinds.
    pub kind: KindId,
}

impl Body {
    /// A body that stands upright and does not move.
    pub fn at_rest(id: GlobalId, kind: KindId, position: DVec2) -> Self {
        Self { id, position, rotation: Rot::IDENTITY, velocity: Vec2::ZERO, angular_velocity: 0.0, kind }
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.position.is_finite()
            && self.rotation.is_finite()
            && self.velocity.is_finite()
            && self.angular_velocity.is_finite()
    }

    /// Whether it is so far out that single precision may have no number for what follows from that.
    pub(crate) fn is_too_far(&self) -> bool {
        /// In m along an axis.
        const FARTHEST: f64 = 1e30;
        self.position.abs().max_element() > FARTHEST
    }
}

/// A body that never moves, or moves as its path has it, whatever it meets: every rank knows all of them.
#[derive(Clone, PartialEq, Debug)]
pub struct StaticBody {
    /// Name; statics take the lowest.
    pub id: GlobalId,
    /// Center in the world, in meters.
    pub position: DVec2,
    /// Orientation.
    pub rotation: Rot,
    /// What it is.
    pub kind: Kind,
    /// How it moves; none if it never does.
    pub path: Option<Path>,
}

impl StaticBody {
    /// A static that stands upright and never moves.
    pub fn new(id: GlobalId, kind: Kind, position: DVec2) -> Self {
        Self { id, position, rotation: Rot::IDENTITY, kind, path: None }
    }

    /// Where it is and how it is turned as a step begins; `dt` is the length of a step in seconds.
    pub fn pose(&self, step: u64, dt: f32) -> (DVec2, Rot) {
        self.path.map_or((self.position, self.rotation), |path| path.pose(self.position, self.rotation, step, dt))
    }

    /// One that is in its first step where this one is when so many steps were made, and goes on as it does; `dt` is the length of a step
    /// in seconds.
    pub fn begun_at(&self, step: u64, dt: f32) -> Self {
        let Some(path) = self.path else { return self.clone() };
        let (position, rotation) = self.pose(step, dt);
        // Other ways have a middle, which stays.
        let position = if matches!(path.travel, Travel::Line { .. }) { position } else { self.position };
        Self { position, rotation, path: Some(path.begun_at(step, dt)), ..self.clone() }
    }
}

/// Many bodies, a column for each field, all of one length.
#[derive(Clone, Default, Debug)]
pub struct Bodies {
    /// Names.
    pub id: Vec<GlobalId>,
    /// Centers of mass, in meters.
    pub position: Vec<DVec2>,
    /// Orientations.
    pub rotation: Vec<Rot>,
    /// Velocities, in m/s.
    pub velocity: Vec<Vec2>,
    /// Angular velocities, in rad/s.
    pub angular_velocity: Vec<f32>,
    /// Rows of the table of kinds.
    pub kind: Vec<KindId>,
}

macro_rules! each_column {
    ($self:ident, $column:ident => $body:expr) => {{
        {
            let $column = &mut $self.id;
            $body;
        }
        {
            let $column = &mut $self.position;
            $body;
        }
        {
            let $column = &mut $self.rotation;
            $body;
        }
        {
            let $column = &mut $self.velocity;
            $body;
        }
        {
            let $column = &mut $self.angular_velocity;
            $body;
        }
        {
            let $column = &mut $self.kind;
            $body;
        }
    }};
}

impl Bodies {
    /// How many.
    pub fn len(&self) -> usize {
        self.id.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.id.is_empty()
    }

    /// Whether it holds memory.
    pub(crate) fn has_room(&self) -> bool {
        self.id.capacity() > 0
    }

    /// One body as a record.
    #[inline]
    pub fn get(&self, index: usize) -> Body {
        Body {
            id: self.id[index],
            position: self.position[index],
            rotation: self.rotation[index],
            velocity: self.velocity[index],
            angular_velocity: self.angular_velocity[index],
            kind: self.kind[index],
        }
    }

    /// Makes room for so many more, and for an eighth beside: few come at a time, and twice the room would be most of a tile's memory.
    pub(crate) fn reserve(&mut self, more: usize) {
        let wanted = self.len() + more;
        each_column!(self, column => if column.capacity() < wanted {
            column.reserve_exact(wanted + wanted / 8 - column.len());
        });
    }

    /// Appends one.
    pub fn push(&mut self, body: Body) {
        self.id.push(body.id);
        self.position.push(body.position);
        self.rotation.push(body.rotation);
        self.velocity.push(body.velocity);
        self.angular_velocity.push(body.angular_velocity);
        self.kind.push(body.kind);
    }

    /// Puts one in the place of another.
    pub(crate) fn set(&mut self, index: usize, body: Body) {
        self.id[index] = body.id;
        self.position[index] = body.position;
        self.rotation[index] = body.rotation;
        self.velocity[index] = body.velocity;
        self.angular_velocity[index] = body.angular_velocity;
        self.kind[index] = body.kind;
    }

    /// Puts some in the place of those in a range, however many.
    pub(crate) fn replace(&mut self, range: Range<usize>, bodies: &[Body]) {
        self.id.splice(range.clone(), bodies.iter().map(|body| body.id));
        self.position.splice(range.clone(), bodies.iter().map(|body| body.position));
        self.rotation.splice(range.clone(), bodies.iter().map(|body| body.rotation));
        self.velocity.splice(range.clone(), bodies.iter().map(|body| body.velocity));
        self.angular_velocity.splice(range.clone(), bodies.iter().map(|body| body.angular_velocity));
        self.kind.splice(range, bodies.iter().map(|body| body.kind));
    }

    pub(crate) fn truncate(&mut self, length: usize) {
        each_column!(self, column => column.truncate(length));
    }

    /// Keeps those whose index is to stay.
    pub(crate) fn retain(&mut self, stays: impl Fn(usize) -> bool) {
        each_column!(self, column => {
            let mut indices = 0..;
            column.retain(|_| indices.next().is_some_and(&stays));
        });
    }

    /// Reorders the first `order.len()` bodies: the one at `order[i]` comes to `i`. `self` must hold no others.
    pub(crate) fn permute(&mut self, order: &[u32]) {
        debug_assert_eq!(order.len(), self.len());
        each_column!(self, column => {
            // With the room that there was.
            let mut permuted = Vec::with_capacity(column.capacity());
            permuted.extend(order.iter().map(|&from| column[from as usize]));
            *column = permuted;
        });
    }

    /// All of them as records.
    pub fn iter(&self) -> impl Iterator<Item = Body> + '_ {
        (0..self.len()).map(|i| self.get(i))
    }
}
