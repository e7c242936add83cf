//! A row of the log: what each rank brings to it, and what is written of that.

use crate::rank::facts::RankFacts;
use atoll_core::Figures;
use bytemuck::{Pod, Zeroable};
use std::fmt::Write as _;

/// The columns before those of the phases.
const COLUMNS: &str = "step,time,bodies,contacts,border_contacts,ghosts,migrations,islands,largest_island,asleep,\
    kinetic_energy,potential_energy,momentum_x,momentum_y,angular_momentum,overlaps,mean_overlap,max_overlap,\
    ms_per_step,busiest_to_mean";

/// All columns, in their order.
pub(super) fn columns() -> String {
    let phases = RankFacts::default().phases();
    phases.iter().fold(COLUMNS.to_owned(), |columns, (name, _)| format!("{columns},ms_{name}"))
}

/// What one rank brings to a row. Plain data, so that it travels as bytes.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Part {
    /// Since the row before, whose step is the one at which it resumed.
    pub(super) facts: RankFacts,
    pub(super) figures: Figures,
}

/// The row that the parts of all ranks come to. Numbers are the shortest that are read as the same bits, but for times.
pub(super) fn text(hertz: f64, parts: &[Part]) -> String {
    let facts = parts.iter().map(|part| part.facts).reduce(RankFacts::join).unwrap_or_default();
    let mut figures = Figures::default();
    parts.iter().for_each(|part| figures.merge(&part.figures));
    let mut text = facts.steps.to_string();
    float(&mut text, facts.steps as f64 / hertz);
    let counts = [figures.bodies, figures.contacts, figures.border_contacts, facts.ghosts, facts.migrations];
    for count in counts.into_iter().chain([facts.islands, facts.largest_island, facts.asleep]) {
        whole(&mut text, count);
    }
    let [momentum_x, momentum_y] = figures.momentum();
    for figure in [figures.kinetic_energy(), figures.potential_energy(), momentum_x, momentum_y] {
        float(&mut text, figure);
    }
    float(&mut text, figures.angular_momentum());
    whole(&mut text, figures.overlaps);
    float(&mut text, figures.mean_overlap());
    float(&mut text, figures.max_overlap());
    let made = (facts.steps - facts.resumed_at).max(1) as f64;
    let ms = |nanos: f64| nanos * 1e-6 / made;
    let busy = |part: &Part| part.facts.wall_nanos.saturating_sub(part.facts.wait_nanos);
    let (busiest, all_busy) = (parts.iter().map(busy).max().unwrap_or(0), parts.iter().map(busy).sum::<u64>());
    let ratio = if all_busy > 0 { busiest as f64 * parts.len() as f64 / all_busy as f64 } else { 0.0 };
    time(&mut text, ms(facts.wall_nanos as f64));
    time(&mut text, ratio);
    let phases: Vec<_> = parts.iter().map(|part| part.facts.phases()).collect();
    for phase in 0..RankFacts::default().phases().len() {
        let sum: u64 = phases.iter().map(|phases| phases[phase].1).sum();
        time(&mut text, ms(sum as f64 / parts.len() as f64));
    }
    text
}

fn whole(text: &mut String, number: u64) {
    write!(text, ",{number}").expect("a string takes any text");
}

fn float(text: &mut String, number: f64) {
    write!(text, ",{number:?}").expect("a string takes any text");
}

/// To a nanosecond, if milliseconds.
fn time(text: &mut String, number: f64) {
    write!(text, ",{number:.6}").expect("a string takes any text");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fields(text: &str) -> Vec<&str> {
        text.split(',').collect()
    }

    #[test]
    fn a_field_for_each_column_and_times_of_the_steps_since_the_row_before() {
        let columns = columns();
        assert!(columns.ends_with(",ms_border,ms_finalize,ms_balance,ms_output,ms_other"), "{columns}");
        let part = |scale: u64| {
            let mut facts = RankFacts { steps: 30, resumed_at: 20, migrations: scale, ..RankFacts::default() };
            (facts.wall_nanos, facts.wait_nanos, facts.output_nanos) = (60_000_000, 10_000_000 * scale, 5_000_000);
            // Of the exchange all was waiting.
            facts.phase_nanos[0] = 20_000_000;
            facts.phase_nanos[1] = 10_000_000 * scale;
            Part { facts, figures: Figures::default() }
        };
        let row = text(60.0, &[part(1), part(3)]);
        let [names, values] = [fields(&columns), fields(&row)];
        assert_eq!(names.len(), values.len());
        let value = |name: &str| values[names.iter().position(|column| *column == name).unwrap()];
        assert_eq!((value("step"), value("time"), value("migrations")), ("30", "0.5", "4"));
        assert_eq!((value("kinetic_energy"), value("overlaps"), value("mean_overlap")), ("0.0", "0", "0.0"));
        // Busy for 50 and 30 ms, of which 50 is 5/4 of the mean.
        assert_eq!((value("ms_per_step"), value("busiest_to_mean")), ("6.000000", "1.250000"));
        assert_eq!((value("ms_migrate"), value("ms_exchange"), value("ms_wait")), ("2.000000", "0.000000", "2.000000"));
        assert_eq!((value("ms_output"), value("ms_other")), ("0.500000", "1.500000"));
        // The start, when nothing has taken any time.
        let start = Part { facts: RankFacts::default(), figures: Figures::default() };
        assert!(text(60.0, &[start]).split(',').all(|value| value.parse() == Ok(0.0)));
    }
}
