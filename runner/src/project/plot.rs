//! A picture of how much faster more ranks would be.

use super::{Prediction, Projection};
use crate::wording::plural;
use plotters::prelude::*;
use std::error::Error;

const SIZE: (u32, u32) = (900, 600);

/// Each rule with the color of its line.
const LINES: [(&str, RGBColor); 3] =
    [("off", RGBColor(148, 103, 189)), ("bodies", RGBColor(255, 127, 14)), ("measured", RGBColor(31, 119, 180))];

/// Speedup over ranks times threads, for each rule and at best, on logarithmic scales, as SVG.
pub(crate) fn svg(projection: &Projection) -> String {
    let mut text = String::new();
    draw(projection, &SVGBackend::with_string(&mut text, SIZE).into_drawing_area())
        .expect("a string takes any drawing");
    text
}

fn draw(
    projection: &Projection,
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
) -> Result<(), Box<dyn Error>> {
    let hands = |one: &Prediction| (one.ranks * one.threads) as f64;
    let predictions = &projection.predictions;
    let most = predictions.iter().map(hands).fold(2.0, f64::max);
    let least = predictions.iter().map(|one| one.speedup).fold(1.0, f64::min).max(1e-3);
    area.fill(&WHITE)?;
    let title =
        format!("{}, {}: projected speedup over one thread", projection.scene, plural(projection.bodies, "body"));
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 20))
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d((1.0..most).log_scale(), (least..most).log_scale())?;
    let plain = |value: &f64| format!("{value}");
    let mut mesh = chart.configure_mesh();
    mesh.x_desc("ranks x threads").y_desc("times as fast").light_line_style(WHITE);
    mesh.x_label_formatter(&plain).y_label_formatter(&plain).draw()?;
    let gray = RGBColor(140, 140, 140);
    let ideal = LineSeries::new([(1.0, 1.0), (most, most)], gray.stroke_width(1));
    chart.draw_series(ideal)?.label("at best").legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], gray));
    for (rule, color) in LINES {
        // One rank is the same by every rule.
        let points: Vec<(f64, f64)> = predictions
            .iter()
            .filter(|one| one.ranks == 1 || one.balance == rule)
            .map(|one| (hands(one), one.speedup.max(least)))
            .collect();
        let marks = points.iter().map(|&point| Circle::new(point, 3, color.filled()));
        chart.draw_series(marks)?;
        chart
            .draw_series(LineSeries::new(points, color.stroke_width(2)))?
            .label(format!("balance = {rule}"))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
    }
    let legend = SeriesLabelPosition::UpperLeft;
    chart.configure_series_labels().position(legend).background_style(WHITE).border_style(BLACK).draw()?;
    area.present()?;
    Ok(())
}
