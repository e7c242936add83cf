//! A comparison as people read it.

use super::{Bodies, Comparison, Difference, Side, State, StepDeviation, unlike_ends};
use crate::wording::{OneLine, between, plural};
use std::collections::BTreeSet;
use std::fmt::{self, Display, Formatter};

/// Rows of the table, at most.
const ROWS: usize = 12;

impl Display for Comparison {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (a, b) = (self.a.folder.display(), self.b.folder.display());
        for key in &self.configuration {
            // They come from files that anybody may have written.
            let [key, in_a, in_b] = [&key.key, &key.a, &key.b].map(|text| OneLine(text));
            writeln!(f, "the configurations differ: {key} is {in_a} in {a} and {in_b} in {b}")?;
        }
        for side in [&self.a, &self.b] {
            if side.incomplete > 0 {
                let folder = side.folder.display();
                let steps = match side.incomplete {
                    1 => "last step is".to_owned(),
                    count => format!("last {count} steps are"),
                };
                writeln!(f, "{folder}: the {steps} held by some ranks only, and left out")?;
            }
            if side.ended.is_none() {
                writeln!(
                    f,
                    "{}: the run is under way or was killed, so how it ends is not compared",
                    side.folder.display()
                )?;
            }
        }
        self.write_verdict(f)?;
        for (side, only) in [(&self.a, &self.only_in_a), (&self.b, &self.only_in_b)] {
            if let (Some(first), Some(last)) = (only.first(), only.last()) {
                let (folder, records) = (side.folder.display(), plural(only.len() as u64, "record"));
                writeln!(f, "only {folder} has {records} of steps {first} to {last}")?;
            }
        }
        self.write_bodies(f)?;
        if let Some(first) = &self.first_difference {
            self.write_first(f, first)?;
        }
        for (what, values) in unlike_ends([&self.a, &self.b]) {
            let [in_a, in_b] = values.each_ref().map(|value| OneLine(value));
            writeln!(f, "the ends differ: {what} is {in_a} in {a} and {in_b} in {b}")?;
        }
        if self.steps.iter().any(|step| step.differing > 0) { self.write_table(f) } else { Ok(()) }
    }
}

impl Comparison {
    fn write_verdict(&self, f: &mut Formatter<'_>) -> fmt::Result {
        // What keeps them from being the same is then what was not recorded by both, or by all ranks, or the ends.
        let are_of_both = self.only_in_a.is_empty() && self.only_in_b.is_empty();
        let is_known = are_of_both || !self.steps.is_empty();
        let as_far = is_known && self.steps.iter().all(|step| step.is_same(self.tolerance));
        let who = if are_of_both { "all ranks" } else { "both" };
        let verdict = match (self.identical, self.same, self.tolerance) {
            (true, ..) => "identical".to_owned(),
            (_, true, Some(most)) => format!("the same within {most}"),
            (_, false, Some(most)) if as_far => format!("the same within {most} as far as {who} recorded"),
            (_, false, None) if as_far => format!("the same as far as {who} recorded"),
            (_, _, Some(most)) if self.steps.iter().any(|step| step.greatest() > most) => {
                format!("differ by more than {most}")
            }
            _ => "differ".to_owned(),
        };
        let Some((first, last)) = self.steps.first().zip(self.steps.last()) else {
            return writeln!(f, "{verdict}: no step was recorded by both");
        };
        let counts = || self.steps.iter().map(|step| step.bodies);
        let (fewest, most) = (counts().min().unwrap_or(0), counts().max().unwrap_or(0));
        let (records, bodies) = (plural(self.steps.len() as u64, "record"), between(fewest, most, "body"));
        write!(f, "{verdict}: {records} of {bodies}, steps {} to {}", first.step, last.step)?;
        match self.steps.iter().filter(|step| !step.is_none()).count() {
            0 => {}
            all if all == self.steps.len() => write!(f, ", none of them alike in every bit")?,
            some => write!(f, ", {some} of them not alike in every bit")?,
        }
        match (self.tolerance, self.steps.iter().filter(|step| !step.is_same(self.tolerance)).count()) {
            (Some(most), some) if some > 0 => writeln!(f, ", {some} not within {most}"),
            _ => writeln!(f),
        }
    }

    /// Which bodies cannot be compared.
    fn write_bodies(&self, f: &mut Formatter<'_>) -> fmt::Result {
        type Kind = fn(&StepDeviation) -> Bodies;
        let missing: [Kind; 2] = [|step| step.missing_in_a, |step| step.missing_in_b];
        let doubled: [Kind; 2] = [|step| step.doubled_in_a, |step| step.doubled_in_b];
        let sides = || [&self.a, &self.b].into_iter();
        let missing = sides().zip(missing).map(|(side, bodies)| (side, "lacks", bodies));
        let doubled = sides().zip(doubled).map(|(side, bodies)| (side, "has more than once", bodies));
        let name = |side: &Side| side.folder.display().to_string();
        let all = missing.chain(doubled).map(|(side, does, bodies)| (format!("{} {does}", name(side)), bodies));
        let other: (String, Kind) = (format!("{} has of other kinds", name(&self.b)), |step| step.other_kind);
        for (does, bodies) in all.chain([other]) {
            let mut steps = self.steps.iter().filter(|step| bodies(step).count > 0);
            if let Some(step) = steps.next() {
                let (some, more) = (bodies(step), steps.count());
                let (count, id) = (plural(some.count, "body"), some.first.unwrap_or(0));
                let more = if more > 0 {
                    format!(", and some at {}", plural(more as u64, "later step"))
                } else {
                    String::new()
                };
                writeln!(f, "{does} {count} at step {}, the lowest is {id}{more}", step.step)?;
            }
        }
        Ok(())
    }

    fn write_first(&self, f: &mut Formatter<'_>, first: &Difference) -> fmt::Result {
        let columns =
            if first.columns.is_empty() { String::new() } else { format!(", in {}", first.columns.join(", ")) };
        let beyond = match self.tolerance {
            Some(most) if first.times == [1, 1] => format!(" beyond {most}"),
            _ => String::new(),
        };
        writeln!(f, "first difference{beyond}: step {}, body {}{columns}", first.step, first.id)?;
        let width =
            [&self.a, &self.b].map(|side| side.folder.display().to_string().len()).into_iter().max().unwrap_or(0);
        let mut line = |side: &Side, times: usize, state: &Option<State>| {
            write!(f, "  {:<width$}  ", side.folder.display().to_string())?;
            match (times, state) {
                (1, Some(state)) => writeln!(f, "{state}"),
                (0 | 1, _) => writeln!(f, "lacks it"),
                (2, _) => writeln!(f, "has it twice"),
                _ => writeln!(f, "has it {times} times"),
            }
        };
        line(&self.a, first.times[0], &first.a)?;
        line(&self.b, first.times[1], &first.b)
    }

    /// How the greatest deviations grow.
    fn write_table(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f)?;
        let differing = if self.tolerance.is_some() { "beyond" } else { "differing" };
        let heads = ["step", differing, "position, m", "rms, m", "angle, rad", "velocity, m/s", "omega, rad/s"];
        let row = |f: &mut Formatter<'_>, cells: [String; 7]| {
            let [step, differing, rest @ ..] = cells;
            write!(f, "{step:>10} {differing:>10}")?;
            rest.iter().try_for_each(|cell| write!(f, " {cell:>13}"))?;
            writeln!(f)
        };
        row(f, heads.map(str::to_owned))?;
        for step in self.rows() {
            let figure = |value: f64| if value == 0.0 { "0".to_owned() } else { format!("{value:.3e}") };
            let StepDeviation { position, angle, velocity, angular_velocity, .. } = step;
            let figures = [position.max, position.rms, angle.max, velocity.max, angular_velocity.max].map(figure);
            let [a, b, c, d, e] = figures;
            row(f, [step.step.to_string(), step.beyond.unwrap_or(step.differing).to_string(), a, b, c, d, e])?;
        }
        Ok(())
    }

    /// The rows of the table: steps as far apart as can be, the last among them, with that of the first difference and that
    /// of the greatest deviation in position.
    fn rows(&self) -> impl Iterator<Item = &StepDeviation> {
        let first = self.first_difference.as_ref();
        let first = first.and_then(|first| self.steps.iter().position(|step| step.step == first.step));
        let mut far = None;
        for (i, step) in self.steps.iter().enumerate() {
            if step.position.max > far.map_or(0.0, |far: usize| self.steps[far].position.max) {
                far = Some(i);
            }
        }
        let all = self.steps.len();
        let rows = |count: usize| {
            let evenly = (1..=count).map(|i| i * all / count - 1);
            evenly.chain(first).chain(far).collect::<BTreeSet<_>>()
        };
        let few = (1..=all.min(ROWS)).rev().map(rows).find(|rows| rows.len() <= ROWS);
        few.unwrap_or_default().into_iter().map(|i| &self.steps[i])
    }
}

impl Display for State {
    /// In full: every number is read back as the same bits.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        if let Some(tile) = self.tile {
            write!(f, "in tile {tile}: ")?;
        }
        let Self { tile: _, x, y, angle, vx, vy, omega, kind } = self;
        write!(f, "x {x}, y {y}, angle {angle}, vx {vx}, vy {vy}, omega {omega}")?;
        kind.map_or(Ok(()), |kind| write!(f, ", kind {kind}"))
    }
}
