//! Hard discs by the rule of their collisions alone: what a gas of them does, without any engine.

use glam::DVec2;
use std::f64::consts::TAU;

/// In seconds. None of the speeds asked about brings a disc further in it than a hundredth of its radius.
const STEP: f64 = 4e-4;

/// Smooth discs of mass 1 in rows in the middle of a square room whose walls take no energy.
pub(super) struct HardDiscs {
    /// Of a row, and rows.
    pub(super) side: u32,
    /// Between neighbours' centers in the beginning, in meters.
    pub(super) apart: f64,
    pub(super) radius: f64,
    /// With which all begin, in m/s; nobody is ever faster than twice of it, or next to nobody.
    pub(super) speed: f64,
    pub(super) restitution: f64,
}

impl HardDiscs {
    /// Mean of v^2 / 2 per direction after some times, in seconds, ascending; of a gas whose first directions follow from a number.
    pub(super) fn temperatures(&self, gas: u32, times: [f64; 2]) -> [f64; 2] {
        let &Self { side, apart, radius, speed, restitution } = self;
        let half = 0.5 * f64::from(side) * apart + 1.0;
        let middle = DVec2::splat(0.5 * f64::from(side - 1));
        let numbers = 0..side * side;
        let place = |k: u32| (DVec2::new((k % side).into(), (k / side).into()) - middle) * apart;
        let direction = |k: u32| DVec2::from_angle((2.399_963_2 * f64::from(k) + f64::from(gas * k * k)) % TAU);
        let mut places: Vec<DVec2> = numbers.clone().map(place).collect();
        let mut velocities: Vec<DVec2> = numbers.map(|k| direction(k) * speed).collect();
        // Who may meet until pairs are found anew.
        let reach = 3.0 * radius;
        let renew = ((reach - 2.0 * radius) / (4.0 * speed * STEP)) as u64;
        let mut near = Vec::new();
        let mut made = 0;
        times.map(|time| {
            while (made as f64) < time / STEP {
                if made % renew == 0 {
                    find_near(&places, reach, &mut near);
                }
                made += 1;
                for &(i, j) in &near {
                    let between = places[j] - places[i];
                    let closing = between.dot(velocities[i] - velocities[j]);
                    if closing > 0.0 && between.length_squared() < 4.0 * radius * radius {
                        let change = 0.5 * (1.0 + restitution) * closing / between.length_squared() * between;
                        velocities[i] -= change;
                        velocities[j] += change;
                    }
                }
                for (place, velocity) in places.iter_mut().zip(&mut velocities) {
                    let beyond = |x: f64, v: f64| x.abs() > half - radius && x * v > 0.0;
                    velocity.x *= if beyond(place.x, velocity.x) { -1.0 } else { 1.0 };
                    velocity.y *= if beyond(place.y, velocity.y) { -1.0 } else { 1.0 };
                    *place += *velocity * STEP;
                }
            }
            velocities.iter().map(|velocity| 0.5 * velocity.length_squared()).sum::<f64>() / velocities.len() as f64
        })
    }
}

/// Pairs of which one is no further from the other than that.
fn find_near(places: &[DVec2], reach: f64, near: &mut Vec<(usize, usize)>) {
    near.clear();
    let mut by_x: Vec<usize> = (0..places.len()).collect();
    by_x.sort_by(|&i, &j| places[i].x.total_cmp(&places[j].x));
    for (k, &i) in by_x.iter().enumerate() {
        let beside = by_x[k + 1..].iter().take_while(|&&j| places[j].x - places[i].x < reach);
        near.extend(beside.filter(|&&j| places[i].distance_squared(places[j]) < reach * reach).map(|&j| (i, j)));
    }
}
