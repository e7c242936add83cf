//! How far the bodies of two records are apart.

use crate::folder::recording::Row;
use serde::Serialize;
use std::f64::consts::{PI, TAU};

/// Two records of one step.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct StepDeviation {
    /// The step.
    pub step: u64,
    /// Bodies that both records have once, and so can be compared.
    pub bodies: u64,
    /// Of those, how many differ in any bit.
    pub differing: u64,
    /// And how many by more than the tolerance, if there is one.
    pub beyond: Option<u64>,
    /// In m.
    pub position: Deviation,
    /// In rad, the shorter way round.
    pub angle: Deviation,
    /// In m/s.
    pub velocity: Deviation,
    /// In rad/s.
    pub angular_velocity: Deviation,
    /// Of the bodies that are compared, those that are of another kind. No tolerance is so great.
    pub other_kind: Bodies,
    /// Bodies that the first record lacks.
    pub missing_in_a: Bodies,
    /// Bodies that the second record lacks.
    pub missing_in_b: Bodies,
    /// Bodies that the first record has more than once.
    pub doubled_in_a: Bodies,
    /// Bodies that the second record has more than once.
    pub doubled_in_b: Bodies,
}

/// Of one quantity, over the bodies of a step. Infinite where a body's difference is no number.
#[derive(Clone, Copy, PartialEq, Default, Debug, Serialize)]
pub struct Deviation {
    /// The greatest.
    pub max: f64,
    /// The root of the mean square.
    pub rms: f64,
    /// The lowest body with the greatest, unless that is zero.
    pub id: Option<u64>,
}

/// Some bodies.
#[derive(Clone, Copy, PartialEq, Default, Debug, Serialize)]
pub struct Bodies {
    /// How many.
    pub count: u64,
    /// The lowest.
    pub first: Option<u64>,
}

impl StepDeviation {
    /// The greatest deviation of all four quantities.
    pub fn greatest(&self) -> f64 {
        let all = [self.position, self.angle, self.velocity, self.angular_velocity];
        all.iter().map(|deviation| deviation.max).fold(0.0, f64::max)
    }

    /// Whether the records are the same bit for bit.
    pub fn is_none(&self) -> bool {
        self.differing == 0 && self.has_same_bodies()
    }

    /// Whether no quantity deviates more than so much; without a tolerance, whether the records are the same bit for bit.
    pub fn is_same(&self, tolerance: Option<f64>) -> bool {
        tolerance.map_or(self.is_none(), |most| self.has_same_bodies() && self.greatest() <= most)
    }

    /// Whether each record has each body once, of the same kind.
    pub(super) fn has_same_bodies(&self) -> bool {
        let missing = [self.missing_in_a, self.missing_in_b];
        let doubled = [self.doubled_in_a, self.doubled_in_b];
        missing.iter().chain(&doubled).chain([&self.other_kind]).all(|some| some.count == 0)
    }
}

impl Bodies {
    fn add(&mut self, id: u64) {
        self.count += 1;
        self.first.get_or_insert(id);
    }
}

/// What becomes a [`Deviation`] when all bodies are added.
#[derive(Clone, Copy, Default)]
struct Sum {
    max: f64,
    squares: f64,
    id: Option<u64>,
}

impl Sum {
    fn add(&mut self, id: u64, value: f64) {
        self.squares += value * value;
        if value > self.max {
            (self.max, self.id) = (value, Some(id));
        }
    }

    fn finish(self, bodies: u64) -> Deviation {
        Deviation { max: self.max, rms: (self.squares / bodies.max(1) as f64).sqrt(), id: self.id }
    }
}

/// Compares two records whose rows are in the order of their bodies. Also gives the rows that each has of the lowest body
/// that is not the same in both: within the tolerance, if there is one, else bit for bit.
pub(super) fn measure<'a>(
    step: u64,
    mut a: &'a [Row],
    mut b: &'a [Row],
    tolerance: Option<f64>,
) -> (StepDeviation, Option<[&'a [Row]; 2]>) {
    let (mut bodies, mut differing, mut beyond, mut sums) = (0, 0, 0, [Sum::default(); 4]);
    let (mut missing, mut doubled) = ([Bodies::default(); 2], [Bodies::default(); 2]);
    let (mut other_kind, mut first) = (Bodies::default(), None);
    while let Some(id) = a.first().into_iter().chain(b.first()).map(|row| row.id).min() {
        let both = [take(&mut a, id), take(&mut b, id)];
        if let [[in_a], [in_b]] = both {
            bodies += 1;
            if bytemuck::bytes_of(in_a) == bytemuck::bytes_of(in_b) {
                continue;
            }
            differing += 1;
            let apart = apart(in_a, in_b);
            sums.iter_mut().zip(apart).for_each(|(sum, value)| sum.add(id, value));
            if in_a.kind != in_b.kind {
                other_kind.add(id);
            } else if tolerance.is_some_and(|most| apart.iter().all(|value| *value <= most)) {
                continue;
            }
            beyond += 1;
        }
        for (side, rows) in both.iter().enumerate() {
            match rows.len() {
                0 => missing[side].add(id),
                1 => {}
                _ => doubled[side].add(id),
            }
        }
        first.get_or_insert(both);
    }
    let [position, angle, velocity, angular_velocity] = sums.map(|sum| sum.finish(bodies));
    let ([missing_in_a, missing_in_b], [doubled_in_a, doubled_in_b]) = (missing, doubled);
    let deviation = StepDeviation {
        step,
        bodies,
        differing,
        beyond: tolerance.map(|_| beyond),
        position,
        angle,
        velocity,
        angular_velocity,
        other_kind,
        missing_in_a,
        missing_in_b,
        doubled_in_a,
        doubled_in_b,
    };
    (deviation, first)
}

/// How far a body is apart in position, angle, velocity and angular velocity.
pub(super) fn apart(a: &Row, b: &Row) -> [f64; 4] {
    let less = |a: f32, b: f32| f64::from(a) - f64::from(b);
    let turn = less(a.angle, b.angle).abs() % TAU;
    let values = [
        libm::hypot(a.x - b.x, a.y - b.y),
        if turn > PI { TAU - turn } else { turn },
        libm::hypot(less(a.vx, b.vx), less(a.vy, b.vy)),
        less(a.omega, b.omega).abs(),
    ];
    values.map(|value| if value.is_nan() { f64::INFINITY } else { value })
}

/// Takes the rows of a body from the front.
fn take<'a>(rows: &mut &'a [Row], id: u64) -> &'a [Row] {
    let (of_body, rest) = rows.split_at(rows.iter().take_while(|row| row.id == id).count());
    *rows = rest;
    of_body
}
