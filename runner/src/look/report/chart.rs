//! Charts as SVG whose colors are the page's: lines over time, areas on top of each other, bars.

use super::html::{Short, Text, Unit};
use std::fmt::Write as _;

/// Units that are written with each value, as they go with a prefix.
const PREFIXED: [&str; 3] = ["J", "m", "B"];

/// Of the drawing, in its own units.
const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 250.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 10.0;
const BOTTOM: f64 = 38.0;

/// Points of a line, at most: what a screen can show.
const POINTS: usize = 500;

/// One line, or one of the areas on top of each other.
#[derive(Clone, Debug)]
pub(super) struct Series {
    /// What it shows.
    pub name: String,
    /// Its color, a variable of the style sheet without the dashes.
    pub color: String,
    /// Whether it is the second run's.
    pub dashed: bool,
    /// Where it goes; what is no number is left out.
    pub points: Vec<(f64, f64)>,
}

/// What the lines are drawn on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Scale {
    /// With zero in sight.
    FromZero,
    /// As far as the values go.
    AsFar,
    /// Powers of ten; what is nothing lies on the lower edge.
    Decades,
}

/// What a chart is about.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axes<'a> {
    /// In words, for who cannot see it.
    pub title: &'a str,
    /// Along the bottom.
    pub x: &'a str,
    /// Along the left, with its unit.
    pub y: &'a str,
    /// How values are laid out.
    pub scale: Scale,
    /// Whether it is as wide as two.
    pub wide: bool,
}

/// Lines over time, and what they are.
pub(super) fn lines(axes: Axes<'_>, all: &[Series]) -> String {
    let all: Vec<Series> = all.iter().map(|one| Series { points: thinned(&one.points), ..one.clone() }).collect();
    let Some(plot) = Plot::new(axes, all.iter().flat_map(|one| one.points.iter().copied())) else {
        return nothing();
    };
    let mut drawing = plot.frame(axes);
    for one in &all {
        let dash = if one.dashed { " dash" } else { "" };
        let mut path = String::new();
        for &(x, y) in &one.points {
            let letter = if path.is_empty() { 'M' } else { 'L' };
            write!(path, "{letter}{:.1} {:.1}", plot.x(x), plot.y(y)).expect("a string takes any text");
        }
        if let [(x, y)] = one.points[..] {
            // A line of one point would not be seen.
            write!(path, "m-3 0h6M{:.1} {:.1}", plot.x(x), plot.y(y)).expect("a string takes any text");
        }
        writeln!(drawing, "<path class=\"line{dash}\" style=\"stroke:var(--{})\" d=\"{path}\"/>", one.color)
            .expect("a string takes any text");
    }
    let last = |one: &Series| one.points.last().map(|last| written(last.1, axes.y));
    legend(&all, false, last) + &drawn(axes, HEIGHT, &drawing)
}

/// Areas on top of each other, in milliseconds, the first at the bottom. All have values at the same places.
pub(super) fn areas(axes: Axes<'_>, all: &[Series]) -> String {
    let places: Vec<f64> = all.first().map_or_else(Vec::new, |one| one.points.iter().map(|point| point.0).collect());
    let groups = places.len().div_ceil(POINTS / 2).max(1);
    // Of some places together, the mean.
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let at: Vec<f64> = places.chunks(groups).map(mean).collect();
    let values = |one: &Series| {
        let values: Vec<f64> = one.points.iter().map(|point| if point.1.is_finite() { point.1 } else { 0.0 }).collect();
        values.chunks(groups).map(mean).collect::<Vec<_>>()
    };
    let mut edges = vec![vec![0.0; at.len()]];
    for one in all {
        let below = edges.last().expect("there is a first");
        edges.push(below.iter().zip(values(one)).map(|(below, value)| below + value).collect());
    }
    let top = edges.last().expect("there is a first").iter();
    let Some(plot) = Plot::new(axes, at.iter().copied().zip(top.copied())) else { return nothing() };
    let mut drawing = plot.frame(axes);
    for (one, edges) in all.iter().zip(edges.windows(2)) {
        let corner = |(x, y): (&f64, &f64)| format!("{:.1} {:.1}", plot.x(*x), plot.y(*y));
        let up: Vec<String> = at.iter().zip(&edges[1]).map(corner).collect();
        let down: Vec<String> = at.iter().zip(&edges[0]).rev().map(corner).collect();
        let path = [up, down].concat().join("L");
        writeln!(
            drawing,
            "<path style=\"fill:var(--{})\" d=\"M{path}Z\"><title>{}</title></path>",
            one.color,
            Text(&one.name)
        )
        .expect("a string takes any text");
    }
    let share = |one: &Series| over_all(&one.points).map(|mean| Unit(mean * 1e-3, "s").to_string());
    legend(all, true, share) + &drawn(axes, HEIGHT, &drawing)
}

/// The mean of what each point says of all since the one before; of a single point that says something, that.
fn over_all(points: &[(f64, f64)]) -> Option<f64> {
    let (first, last) = points.first().zip(points.last())?;
    let length = last.0 - first.0;
    if length <= 0.0 {
        return Some(last.1);
    }
    let parts = points.windows(2).map(|pair| (pair[1].0 - pair[0].0) * pair[1].1);
    Some(parts.filter(|part| part.is_finite()).sum::<f64>() / length)
}

/// A part of a bar: its color, name and length.
pub(super) type Part = (String, String, f64);

/// A bar for each row, which has a name and is made of parts beside each other.
pub(super) fn bars(axes: Axes<'_>, rows: &[(String, Vec<Part>)]) -> String {
    let total = |parts: &[Part]| parts.iter().map(|part| part.2).sum::<f64>();
    let most = rows.iter().map(|(_, parts)| total(parts)).fold(0.0, f64::max);
    if !(most > 0.0 && most.is_finite()) {
        return nothing();
    }
    // Few are thick, many are thin, and the names of some are left out.
    let pitch = (600.0 / rows.len() as f64).clamp(3.0, 30.0);
    let named = (14.0 / pitch).ceil() as usize;
    let height = rows.len() as f64 * pitch + TOP + BOTTOM;
    let width = width(axes);
    let scale = (width - LEFT - RIGHT) / most;
    let mut drawing = String::new();
    let mut put = |text: String| drawing.push_str(&text);
    for (value, label) in ticks(0.0, most, 8, axes.x) {
        let x = LEFT + value * scale;
        put(format!("<path class=\"grid-line\" d=\"M{x:.1} {TOP}V{:.1}\"/>", height - BOTTOM));
        put(format!("<text class=\"middle\" x=\"{x:.1}\" y=\"{:.1}\">{label}</text>\n", height - BOTTOM + 16.0));
    }
    if !PREFIXED.contains(&axes.x) {
        put(format!(
            "<text class=\"middle\" x=\"{:.1}\" y=\"{:.1}\">{}</text>\n",
            (LEFT + width) / 2.0,
            height - 4.0,
            Text(axes.x)
        ));
    }
    for (row, (name, parts)) in rows.iter().enumerate() {
        let y = TOP + row as f64 * pitch;
        if row.is_multiple_of(named) {
            put(format!(
                "<text class=\"end\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                LEFT - 8.0,
                y + pitch / 2.0 + 4.0,
                Text(name)
            ));
        }
        let mut x = LEFT;
        for (color, part, value) in parts {
            let (long, thick) = (value * scale, pitch * 0.78);
            let what = Text(part);
            put(format!(
                "<rect style=\"fill:var(--{color})\" x=\"{x:.1}\" y=\"{:.1}\" width=\"{long:.1}\" height=\"{thick:.1}\"><title>{what}: {}</title></rect>",
                y + pitch * 0.11,
                Short(*value)
            ));
            x += long;
        }
        put("\n".to_owned());
    }
    drawn(axes, height, &drawing)
}

/// The names of some series, and a value of each.
pub(super) fn legend(all: &[Series], boxes: bool, value: impl Fn(&Series) -> Option<String>) -> String {
    let entry = |one: &Series| {
        let class = if boxes {
            " box"
        } else if one.dashed {
            " dash"
        } else {
            ""
        };
        let value = value(one).map(|value| format!(" <b>{value}</b>")).unwrap_or_default();
        format!("<li><i class=\"key{class}\" style=\"--c:var(--{})\"></i>{}{value}</li>", one.color, Text(&one.name))
    };
    format!("<ul class=\"legend\">{}</ul>", all.iter().map(entry).collect::<String>())
}

fn nothing() -> String {
    "<p>no values</p>".to_owned()
}

/// Of a drawing.
fn width(axes: Axes<'_>) -> f64 {
    if axes.wide { 2.0 * WIDTH } else { WIDTH }
}

fn drawn(axes: Axes<'_>, height: f64, drawing: &str) -> String {
    let (title, width) = (Text(axes.title), width(axes));
    format!(
        "<svg viewBox=\"0 0 {width} {height:.0}\" role=\"img\" aria-label=\"{title}\"><title>{title}</title>\n{drawing}</svg>"
    )
}

/// Where values lie on a drawing.
struct Plot {
    width: f64,
    x: (f64, f64),
    y: (f64, f64),
    scale: Scale,
}

impl Plot {
    /// None where there is no value.
    fn new(axes: Axes<'_>, points: impl Iterator<Item = (f64, f64)> + Clone) -> Option<Self> {
        let points = points.filter(|point| point.0.is_finite() && point.1.is_finite());
        let bounds = |values: &mut dyn Iterator<Item = f64>| {
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
        };
        let x = bounds(&mut points.clone().map(|point| point.0));
        let (low, high) = bounds(&mut points.clone().map(|point| point.1));
        if low > high {
            return None;
        }
        let y = match axes.scale {
            Scale::FromZero => padded(low.min(0.0), high.max(0.0)),
            Scale::AsFar => padded(low, high),
            Scale::Decades => {
                let real = points.map(|point| point.1).filter(|value| *value > 0.0);
                let (low, high) = bounds(&mut real.clone().map(|value| value.clamp(1e-30, 1e30)));
                if low > high { (-16.0, 0.0) } else { (low.log10().floor() - 1.0, high.log10().floor() + 1.0) }
            }
        };
        let x = if x.0 < x.1 { x } else { (x.0 - 0.5, x.1 + 0.5) };
        Some(Self { width: width(axes), x, y, scale: axes.scale })
    }

    fn x(&self, x: f64) -> f64 {
        LEFT + (x - self.x.0) / (self.x.1 - self.x.0) * (self.width - LEFT - RIGHT)
    }

    fn y(&self, y: f64) -> f64 {
        let y = match self.scale {
            Scale::Decades => if y > 0.0 { y.log10() } else { f64::NEG_INFINITY }.clamp(self.y.0, self.y.1),
            _ => y,
        };
        HEIGHT - BOTTOM - (y - self.y.0) / (self.y.1 - self.y.0) * (HEIGHT - TOP - BOTTOM)
    }

    /// Lines of the grid, and what is written beside them.
    fn frame(&self, axes: Axes<'_>) -> String {
        let (right, bottom) = (self.width - RIGHT, HEIGHT - BOTTOM);
        let mut text = String::new();
        let mut put = |piece: String| text.push_str(&piece);
        let levels = match self.scale {
            Scale::Decades => decades(self.y.0, self.y.1),
            _ => ticks(self.y.0, self.y.1, 5, axes.y),
        };
        for (value, label) in levels {
            let y = if self.scale == Scale::Decades { self.y(10_f64.powf(value)) } else { self.y(value) };
            put(format!("<path class=\"grid-line\" d=\"M{LEFT} {y:.1}H{right}\"/>"));
            put(format!("<text class=\"end\" x=\"{:.1}\" y=\"{:.1}\">{label}</text>\n", LEFT - 7.0, y + 4.0));
        }
        for (value, label) in ticks(self.x.0, self.x.1, 6, axes.x) {
            let x = self.x(value);
            put(format!("<path class=\"axis\" d=\"M{x:.1} {bottom}v4\"/>"));
            put(format!("<text class=\"middle\" x=\"{x:.1}\" y=\"{:.1}\">{label}</text>\n", bottom + 17.0));
        }
        put(format!("<path class=\"axis\" d=\"M{LEFT} {bottom}H{right}\"/>"));
        let middle = f64::midpoint(LEFT, right);
        put(format!("<text class=\"middle\" x=\"{middle:.1}\" y=\"{:.1}\">{}</text>\n", HEIGHT - 3.0, Text(axes.x)));
        let across = f64::midpoint(TOP, bottom);
        if !PREFIXED.contains(&axes.y) {
            put(format!(
                "<text class=\"middle\" transform=\"translate(11 {across:.1}) rotate(-90)\">{}</text>\n",
                Text(axes.y)
            ));
        }
        text
    }
}

/// A little room above and below.
fn padded(low: f64, high: f64) -> (f64, f64) {
    let size = high - low;
    // What is one value, or nearly, lies in the middle.
    let room = if size > 1e-9 * low.abs().max(high.abs()) { 0.05 * size } else { (0.5 * high.abs()).max(0.5) };
    (if low == 0.0 && high > 0.0 { 0.0 } else { low - room }, if high == 0.0 && low < 0.0 { 0.0 } else { high + room })
}

/// Round numbers within bounds, and how they are written.
fn ticks(low: f64, high: f64, most: usize, unit: &str) -> Vec<(f64, String)> {
    let raw = (high - low) / most as f64;
    let power = 10_f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power).into_iter().find(|step| *step >= raw * 0.999);
    let step = step.unwrap_or(10.0 * power);
    let (first, last) = ((low / step - 1e-9).ceil(), (high / step + 1e-9).floor());
    let count = (last - first).clamp(0.0, 2.0 * most as f64) as usize;
    let value = |i: usize| (first + i as f64) * step;
    (0..=count).map(|i| (value(i), written(value(i), unit))).collect()
}

/// A value as it stands beside an axis.
fn written(value: f64, unit: &str) -> String {
    if PREFIXED.contains(&unit) { format!("{:.4}", Unit(value, unit)) } else { format!("{:.4}", Short(value)) }
}

/// Powers of ten within bounds, which are their logarithms; the lowest stands for nothing.
fn decades(low: f64, high: f64) -> Vec<(f64, String)> {
    let every = ((high - low) / 7.0).ceil().max(1.0);
    let label =
        |power: f64| if power == low { "0".to_owned() } else { format!("1e{power:.0}").replace('-', "\u{2212}") };
    let count = ((high - low) / every) as usize;
    (0..=count).map(|i| low + i as f64 * every).map(|power| (power, label(power))).collect()
}

/// As many points as can be seen: of those between, the least and the most.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let points: Vec<_> = points.iter().copied().filter(|point| point.0.is_finite() && point.1.is_finite()).collect();
    if points.len() <= POINTS {
        return points;
    }
    let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
    let few = points.chunks(points.len().div_ceil(POINTS / 2)).flat_map(|some| {
        let ends = [some.iter().min_by(by_value), some.iter().max_by(by_value)];
        let mut ends: Vec<_> = ends.into_iter().flatten().copied().collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        ends
    });
    few.chain(points.last().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_over_a_run_counts_each_line_for_the_steps_that_it_tells_of() {
        // After 10, 30 and 31 steps.
        let mean = over_all(&[(0.0, 1.0), (10.0, 1.0), (30.0, 4.0), (31.0, 60.0)]).unwrap();
        assert!((mean - 150.0 / 31.0).abs() < 1e-12, "{mean}");
        assert_eq!(over_all(&[(0.5, 3.0)]), Some(3.0));
        assert_eq!(over_all(&[]), None);
    }
}
