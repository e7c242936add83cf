//! A picture of how two recordings come apart.

use super::{Comparison, StepDeviation};
use plotters::prelude::*;
use std::error::Error;

const SIZE: (u32, u32) = (900, 540);

/// What is drawn of a step.
type Quantity = fn(&StepDeviation) -> f64;

const LINES: [(&str, RGBColor, Quantity); 4] = [
    ("position, m", RGBColor(31, 119, 180), |step| step.position.max),
    ("velocity, m/s", RGBColor(255, 127, 14), |step| step.velocity.max),
    ("angle, rad", RGBColor(44, 160, 44), |step| step.angle.max),
    ("angular velocity, rad/s", RGBColor(148, 103, 189), |step| step.angular_velocity.max),
];

/// The greatest deviations over the steps, on a logarithmic scale whose lower edge stands for zero, as SVG.
pub fn svg(comparison: &Comparison) -> String {
    let mut text = String::new();
    draw(comparison, &SVGBackend::with_string(&mut text, SIZE).into_drawing_area())
        .expect("a string takes any drawing");
    text
}

fn draw(
    comparison: &Comparison,
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
) -> Result<(), Box<dyn Error>> {
    let steps = &comparison.steps;
    let first = steps.first().map_or(0, |step| step.step) as f64;
    let last = steps.last().map_or(0, |step| step.step) as f64;
    let values = || steps.iter().flat_map(|step| LINES.map(|(_, _, quantity)| quantity(step)));
    let (low, high) = decades(values());
    area.fill(&WHITE)?;
    let title = match comparison.identical {
        true => "identical",
        false if steps.iter().all(StepDeviation::has_same_bodies) => "greatest deviation of any body",
        false => "greatest deviation of any body; some are missing or doubled",
    };
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 20))
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(76)
        .build_cartesian_2d(first..last.max(first + 1.0), (low..high).log_scale())?;
    let label = |value: &f64| if *value < 2.0 * low { "0".to_owned() } else { format!("{value:.0e}") };
    let mut mesh = chart.configure_mesh();
    mesh.light_line_style(WHITE).x_desc("step").y_desc("deviation");
    mesh.x_label_formatter(&|step| format!("{step:.0}")).y_label_formatter(&label);
    mesh.draw()?;
    for (name, color, quantity) in LINES {
        let points = steps.iter().map(|step| (step.step as f64, quantity(step).clamp(low, high)));
        chart
            .draw_series(LineSeries::new(points, color.stroke_width(2)))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
    }
    let legend = SeriesLabelPosition::LowerRight;
    chart.configure_series_labels().position(legend).background_style(WHITE).border_style(BLACK).draw()?;
    area.present()?;
    Ok(())
}

/// What is less, or more, is drawn as if it were that: the scale would have no end otherwise.
const DRAWN: (f64, f64) = (1e-30, 1e30);

/// Powers of ten that hold all values between them, and one more below, for zero.
fn decades(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let real = values.filter(|value| *value > 0.0 && value.is_finite()).map(|value| value.clamp(DRAWN.0, DRAWN.1));
    let least = real.clone().fold(f64::INFINITY, f64::min);
    let most = real.fold(0.0, f64::max);
    if most == 0.0 {
        return (1e-16, 1.0);
    }
    (10_f64.powf(least.log10().floor() - 1.0), 10_f64.powf(most.log10().floor() + 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_has_an_end() {
        let near = |(low, high): (f64, f64), expected: [f64; 2]| {
            [low, high].iter().zip(expected).all(|(value, expected)| (value / expected - 1.0).abs() < 1e-9)
        };
        assert!(near(decades([0.0, 0.02, 3.0].into_iter()), [1e-3, 10.0]));
        let (low, high) = decades([f64::from_bits(1), f64::MAX, f64::INFINITY].into_iter());
        assert!(low >= 1e-32 && high <= 1e32 && low <= DRAWN.0 && high >= DRAWN.1, "{low} to {high}");
    }
}
