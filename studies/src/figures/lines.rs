//! Panels of line charts as SVG.

use std::path::Path;

use anyhow::{Result, anyhow};
use plotters::prelude::*;

/// One line of a chart.
pub struct Line {
    /// Name for the legend.
    pub name: String,
    /// Points.
    pub points: Vec<(f64, f64)>,
    /// Colour.
    pub colour: RGBColor,
}

/// One chart.
pub struct Chart {
    /// Title.
    pub title: String,
    /// Label of the horizontal axis.
    pub across: &'static str,
    /// Label of the vertical axis.
    pub up: &'static str,
    /// The ideal value, drawn as a grey line.
    pub ideal: Option<f64>,
    /// Lines.
    pub lines: Vec<Line>,
}

const INK: RGBColor = RGBColor(50, 50, 50);
const CHART: (u32, u32) = (400, 310);

/// Draws charts in rows of `columns`.
pub fn draw(path: &Path, charts: &[Chart], columns: usize) -> Result<()> {
    let rows = charts.len().div_ceil(columns);
    let root = SVGBackend::new(path, (CHART.0 * columns as u32, CHART.1 * rows as u32)).into_drawing_area();
    root.fill(&WHITE).map_err(|error| anyhow!("{error}"))?;
    for (area, chart) in root.split_evenly((rows, columns)).iter().zip(charts) {
        draw_chart(area, chart).map_err(|error| anyhow!("{}: {error}", chart.title))?;
    }
    root.present().map_err(|error| anyhow!("{}: {error}", path.display()))
}

/// Least and greatest value, with a margin.
fn range(values: impl Iterator<Item = f64>, below: f64, above: f64) -> std::ops::Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let room = (high - low).max(1e-9);
    low - below * room..high + above * room
}

fn draw_chart(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    chart: &Chart,
) -> Result<(), Box<dyn std::error::Error>> {
    let points = || chart.lines.iter().flat_map(|line| &line.points);
    let x = range(points().map(|p| p.0), 0.0, 0.0);
    // The legend is above the lines.
    let headroom = 0.15 + 0.14 * chart.lines.len() as f64;
    let y = range(points().map(|p| p.1).chain(chart.ideal), 0.05, headroom);
    let mut drawn = ChartBuilder::on(area)
        .margin(10)
        .caption(&chart.title, ("sans-serif", 16).into_font().color(&INK))
        .x_label_area_size(34)
        .y_label_area_size(52)
        .build_cartesian_2d(x.clone(), y)?;
    drawn
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(INK.mix(0.1))
        .x_desc(chart.across)
        .x_label_formatter(&|x| ((1e3 * x).round() / 1e3).to_string())
        .y_desc(chart.up)
        .draw()?;
    if let Some(ideal) = chart.ideal {
        drawn.draw_series([PathElement::new(vec![(x.start, ideal), (x.end, ideal)], INK.mix(0.5))])?;
    }
    for line in &chart.lines {
        let colour = line.colour;
        drawn
            .draw_series(LineSeries::new(line.points.iter().copied(), colour.stroke_width(2)))?
            .label(&line.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2)));
    }
    drawn
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .draw()?;
    Ok(())
}
