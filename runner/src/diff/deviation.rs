//! How far the bodies of two records are apart.

use crate::trajectory::Row;
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
    /// In m.
    pub position: Deviation,
    /// In rad, the shorter way round.
    pub angle: Deviation,
    /// In m/s.
    pub velocity: Deviation,
    /// In rad/s.
    pub angular_velocity: Deviation,
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

    /// Whether no quantity deviates more than so much.
    pub fn is_within(&self, most: f64) -> bool {
        self.has_same_bodies() && self.greatest() <= most
    }

    fn has_same_bodies(&self) -> bool {
        [self.missing_in_a, self.missing_in_b, self.doubled_in_a, self.doubled_in_b].iter().all(|some| some.count == 0)
    }
}

impl Bodies {
    fn add(&mut self, id: u64) {
        self.count += 1;
        self.first.get_or_insert(id);
    }
}

impl Deviation {
    /// Until [`finish`](Self::finish), `rms` is the sum of squares.
    fn add(&mut self, id: u64, value: f64) {
        let value = if value.is_nan() { f64::INFINITY } else { value };
        self.rms += value * value;
        if value > self.max {
            (self.max, self.id) = (value, Some(id));
        }
    }

    fn finish(&mut self, bodies: u64) {
        self.rms = (self.rms / bodies.max(1) as f64).sqrt();
    }
}

/// Compares two records whose rows are in the order of their bodies. Also gives the rows that each has of the lowest body
/// that is not the same in both.
pub(super) fn measure<'a>(step: u64, a: &'a [Row], b: &'a [Row]) -> (StepDeviation, Option<[&'a [Row]; 2]>) {
    let (none, nobody) = (Deviation::default(), Bodies::default());
    let mut sum = StepDeviation {
        step,
        bodies: 0,
        differing: 0,
        position: none,
        angle: none,
        velocity: none,
        angular_velocity: none,
        missing_in_a: nobody,
        missing_in_b: nobody,
        doubled_in_a: nobody,
        doubled_in_b: nobody,
    };
    let mut first = None;
    let (mut a, mut b) = (a, b);
    while let Some(id) = a.first().into_iter().chain(b.first()).map(|row| row.id).min() {
        let (of_a, of_b) = (take(&mut a, id), take(&mut b, id));
        if let ([in_a], [in_b]) = (of_a, of_b) {
            sum.bodies += 1;
            if bytemuck::bytes_of(in_a) == bytemuck::bytes_of(in_b) {
                continue;
            }
            sum.add(in_a, in_b);
        } else {
            for (rows, missing, doubled) in [
                (of_a, &mut sum.missing_in_a, &mut sum.doubled_in_a),
                (of_b, &mut sum.missing_in_b, &mut sum.doubled_in_b),
            ] {
                match rows.len() {
                    0 => missing.add(id),
                    1 => {}
                    _ => doubled.add(id),
                }
            }
        }
        first.get_or_insert([of_a, of_b]);
    }
    for quantity in [&mut sum.position, &mut sum.angle, &mut sum.velocity, &mut sum.angular_velocity] {
        quantity.finish(sum.bodies);
    }
    (sum, first)
}

impl StepDeviation {
    /// Adds a body that differs.
    fn add(&mut self, a: &Row, b: &Row) {
        let id = a.id;
        let apart = |a: f32, b: f32| f64::from(a) - f64::from(b);
        self.differing += 1;
        self.position.add(id, libm::hypot(a.x - b.x, a.y - b.y));
        let turn = apart(a.angle, b.angle).abs() % TAU;
        self.angle.add(id, if turn > PI { TAU - turn } else { turn });
        self.velocity.add(id, libm::hypot(apart(a.vx, b.vx), apart(a.vy, b.vy)));
        self.angular_velocity.add(id, apart(a.omega, b.omega).abs());
    }
}

/// Takes the rows of a body from the front.
fn take<'a>(rows: &mut &'a [Row], id: u64) -> &'a [Row] {
    let (of_body, rest) = rows.split_at(rows.iter().take_while(|row| row.id == id).count());
    *rows = rest;
    of_body
}
