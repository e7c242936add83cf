//! How two runs part.

use super::chart::{Axes, Scale, Series, lines};
use super::html::{Text, figure};
use super::source::Source;
use crate::look::compare::{Comparison, StepDeviation};

/// What is drawn of a step.
type Quantity = fn(&StepDeviation) -> f64;

const LINES: [(&str, &str, Quantity); 4] = [
    ("position, m", "s0", |step| step.position.max),
    ("velocity, m/s", "s1", |step| step.velocity.max),
    ("angle, rad", "s2", |step| step.angle.max),
    ("angular velocity, rad/s", "s3", |step| step.angular_velocity.max),
];

/// What their recordings say, nothing for one run alone.
pub(super) fn of(sources: &[Source], comparison: Option<&Comparison>) -> String {
    let [a, b] = sources else { return String::new() };
    let heading = "<h2>How they part</h2>\n";
    let Some(comparison) = comparison else {
        return format!("{heading}<p class=\"note\">Not both runs are recorded, so how they part is unknown.</p>\n");
    };
    let verdict = match (&comparison.first_difference, comparison.steps.last()) {
        (_, None) => "They have recorded no step in common.".to_owned(),
        (None, _) if comparison.identical => "They are identical, bit for bit.".to_owned(),
        (None, _) => {
            "All that both have recorded is identical, bit for bit; not so how far they went, or how they ended."
                .to_owned()
        }
        (Some(first), _) => {
            let columns =
                if first.columns.is_empty() { String::new() } else { format!(", in {}", first.columns.join(", ")) };
            format!("They first differ at step {}, in body {}{columns}.", first.step, first.id)
        }
    };
    // Where their steps have not one length, a step is at a different time in each.
    let (x, unit) = if a.time(1.0) == b.time(1.0) { ("time, s", a.time(1.0)) } else { ("step", 1.0) };
    let at = |step: u64| step as f64 * unit;
    let series = |(name, color, quantity): (&str, &str, Quantity)| Series {
        name: name.to_owned(),
        color: color.to_owned(),
        dashed: false,
        points: comparison.steps.iter().map(|step| (at(step.step), quantity(step))).collect(),
    };
    let share = Series {
        name: "bodies that differ".to_owned(),
        color: "s5".to_owned(),
        dashed: false,
        points: comparison.steps.iter().map(|step| (at(step.step), step.differing as f64)).collect(),
    };
    let title = "Greatest deviation of any body";
    let axes = Axes { title, x, y: "deviation", scale: Scale::Decades, wide: false };
    let about = "On a scale of powers of ten; the lower edge stands for none at all.";
    let deviation = figure("deviation", false, title, about, &lines(axes, &LINES.map(series)));
    let title = "Bodies that differ";
    let axes = Axes { title, x, y: "bodies", scale: Scale::FromZero, wide: false };
    let differing = figure("differing", false, title, "In any bit of what is recorded.", &lines(axes, &[share]));
    format!("{heading}<p>{}</p>\n<div class=\"grid\">\n{deviation}{differing}</div>\n", Text(&verdict))
}
