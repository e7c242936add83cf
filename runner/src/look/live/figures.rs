//! How a run goes: what each rank tells, and what a page is told of it.

use super::protocol::Say;
use crate::rank::Held;
use atoll_core::Phase;
use bytemuck::{Pod, Zeroable};
use std::time::Instant;

/// How many phases a step has.
const PHASES: usize = Phase::ALL.len();

/// What one rank tells. All but the last three only grow.
#[derive(Clone, Copy, PartialEq, Default, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Part {
    /// Time of each phase, in the order of [`Phase::ALL`].
    phase_nanos: [u64; PHASES],
    /// How long it waited for others in steps.
    wait_nanos: u64,
    steps: u64,
    bodies: u64,
    contacts: u64,
    kinetic_energy: f64,
}

impl Part {
    /// That of a rank.
    pub(super) fn new(held: &Held<'_>) -> Self {
        Self {
            phase_nanos: Phase::ALL.map(|phase| held.world.timings().total(phase).as_nanos() as u64),
            wait_nanos: held.waited.as_nanos() as u64,
            steps: held.world.step_count(),
            bodies: held.world.views().map(|tile| tile.bodies().len() as u64).sum(),
            contacts: held.last.contacts,
            kinetic_energy: held.world.figures_of_bodies().kinetic_energy(),
        }
    }

    /// What was added since an earlier one, in what only grows.
    fn since(&self, earlier: &Self) -> Self {
        let phase = |i: usize| self.phase_nanos[i] - earlier.phase_nanos[i];
        let wait_nanos = self.wait_nanos - earlier.wait_nanos;
        Self { phase_nanos: std::array::from_fn(phase), wait_nanos, steps: self.steps - earlier.steps, ..*self }
    }

    fn nanos(&self) -> u64 {
        self.phase_nanos.iter().sum()
    }
}

/// How a run goes, from one time that all ranks tell to the next.
#[derive(Default, Debug)]
pub(super) struct Course {
    last: Option<(Instant, Vec<Part>)>,
}

impl Course {
    /// What pages are told once all ranks have told.
    pub(super) fn say(&mut self, parts: Vec<Part>) -> Say {
        let now = Instant::now();
        let sum = |figure: fn(&Part) -> u64| parts.iter().map(figure).sum::<u64>();
        let energy: f64 = parts.iter().map(|part| part.kinetic_energy).sum();
        let mut figures = vec![
            ("bodies", grouped(sum(|part| part.bodies))),
            ("contacts solved", grouped(sum(|part| part.contacts))),
            ("kinetic energy", with_prefix(energy, "J")),
        ];
        let (mut phases, mut busy) = (Vec::new(), Vec::new());
        if let Some((then, before)) = &self.last {
            let since: Vec<_> = parts.iter().zip(before).map(|(now, before)| now.since(before)).collect();
            let steps = since.first().map_or(0, |part| part.steps);
            if steps > 0 {
                let slowest = since.iter().map(Part::nanos).max().unwrap_or(0);
                let rate = steps as f64 / (now - *then).as_secs_f64();
                figures.insert(0, ("steps per second", digits(rate)));
                figures.insert(1, ("a step takes", format!("{} ms", digits(slowest as f64 * 1e-6 / steps as f64))));
                phases = self::phases(&since, steps);
                busy = since.iter().map(|part| 1.0 - part.wait_nanos as f64 / part.nanos().max(1) as f64).collect();
            }
        }
        self.last = Some((now, parts));
        Say::Figures { figures, phases, busy }
    }
}

/// Milliseconds of a step in each phase, in the mean of all ranks; waiting apart from the exchange.
fn phases(since: &[Part], steps: u64) -> Vec<(&'static str, f64)> {
    let ms = |nanos: u64| nanos as f64 * 1e-6 / (steps as f64 * since.len() as f64);
    let waited: u64 = since.iter().map(|part| part.wait_nanos).sum();
    let phase = |(i, phase): (usize, Phase)| {
        let nanos: u64 = since.iter().map(|part| part.phase_nanos[i]).sum();
        (phase.name(), ms(if phase == Phase::Exchange { nanos.saturating_sub(waited) } else { nanos }))
    };
    let all = Phase::ALL.into_iter().enumerate().map(phase).chain([("wait", ms(waited))]);
    all.filter(|(_, ms)| *ms >= 0.0005).collect()
}

/// A whole number, its digits in groups of three.
fn grouped(number: u64) -> String {
    crate::look::picture::grouped(number as usize)
}

/// A number with three digits that matter, or more before the point.
pub(super) fn digits(value: f64) -> String {
    let places = match value.abs() {
        size if size >= 100.0 || size == 0.0 => 0,
        size if size >= 10.0 => 1,
        size if size >= 1.0 => 2,
        _ => 3,
    };
    format!("{value:.places$}")
}

/// A quantity with the prefix of its unit that suits it.
fn with_prefix(value: f64, unit: &str) -> String {
    let prefixes = [("G", 1e9), ("M", 1e6), ("k", 1e3), ("", 1.0), ("m", 1e-3), ("µ", 1e-6)];
    let suits = |(_, size): &&(&str, f64)| value.abs() >= *size;
    match prefixes.iter().find(suits) {
        Some((prefix, size)) => format!("{} {prefix}{unit}", digits(value / size)),
        None => format!("{} {unit}", if value.is_finite() { "0".to_owned() } else { value.to_string() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_told_of_the_steps_since_they_were_told_before() {
        let mut course = Course::default();
        let part = |steps: u64, wait_nanos: u64| {
            let mut part = Part { steps, wait_nanos, bodies: 1000, kinetic_energy: 1500.0, ..Part::default() };
            part.phase_nanos[0] = steps * 2_000_000;
            part
        };
        let Say::Figures { figures, phases, busy } = course.say(vec![part(3, 9), part(3, 5)]) else {
            panic!("figures")
        };
        assert_eq!(figures[0], ("bodies", "2,000".to_owned()));
        assert_eq!(figures[2], ("kinetic energy", "3.00 kJ".to_owned()));
        assert!(phases.is_empty() && busy.is_empty());
        let Say::Figures { figures, busy, .. } = course.say(vec![part(5, 1_000_009), part(5, 5)]) else {
            panic!("figures")
        };
        assert_eq!((figures[1].clone(), busy), (("a step takes", "2.00 ms".to_owned()), vec![0.75, 1.0]));
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!([0.0, 0.01234, 9.876, 54.32, 1234.5].map(digits), ["0", "0.012", "9.88", "54.3", "1234"]);
        assert_eq!(with_prefix(0.0, "J"), "0 J");
        assert_eq!(with_prefix(2.5e-3, "J"), "2.50 mJ");
        assert_eq!(with_prefix(f64::INFINITY, "J"), "inf GJ");
    }
}
