//! Panels of bar charts as SVG, and their numbers as CSV.

use std::fs;
use std::io::Write;
use std::path::Path;

use anyhow::{Result, anyhow};
use plotters::prelude::*;

/// One set of bars of a panel.
pub struct Series<'a> {
    /// Name for the legend.
    pub name: &'a str,
    /// Height of each bar.
    pub values: &'a [f64],
    /// Lower and upper end of each bar's whisker.
    pub errors: Option<&'a [(f64, f64)]>,
    /// Colour.
    pub colour: RGBColor,
}

/// One chart.
pub struct Panel<'a> {
    /// Title.
    pub title: &'a str,
    /// Label of the horizontal axis.
    pub across: &'a str,
    /// Ends of the horizontal axis; bars are spaced evenly between them.
    pub span: [f64; 2],
    /// Label of the vertical axis.
    pub up: &'a str,
    /// The sets of bars, drawn next to each other.
    pub series: Vec<Series<'a>>,
}

pub const BLUE: RGBColor = RGBColor(62, 105, 160);
pub const RED: RGBColor = RGBColor(196, 78, 60);
pub const GREEN: RGBColor = RGBColor(60, 140, 95);
pub const GREY: RGBColor = RGBColor(165, 165, 165);
const INK: RGBColor = RGBColor(50, 50, 50);
const PANEL: (u32, u32) = (430, 320);

/// Draws panels in rows of `columns`.
pub fn draw(path: &Path, panels: &[Panel<'_>], columns: usize) -> Result<()> {
    let rows = panels.len().div_ceil(columns);
    let size = (PANEL.0 * columns as u32, PANEL.1 * rows as u32);
    let root = SVGBackend::new(path, size).into_drawing_area();
    root.fill(&WHITE).map_err(|error| anyhow!("{error}"))?;
    for (area, panel) in root.split_evenly((rows, columns)).iter().zip(panels) {
        draw_panel(area, panel).map_err(|error| anyhow!("{}: {error}", panel.title))?;
    }
    root.present().map_err(|error| anyhow!("{}: {error}", path.display()))
}

fn draw_panel(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    panel: &Panel<'_>,
) -> Result<(), Box<dyn std::error::Error>> {
    let top = panel
        .series
        .iter()
        .flat_map(|of| {
            of.values
                .iter()
                .enumerate()
                .map(|(i, v)| of.errors.map_or(*v, |e| e[i].1.max(*v)))
        })
        .fold(1e-300, f64::max);
    // The legend is above the bars, one line per series.
    let headroom = if panel.series.len() > 1 {
        1.08 + 0.16 * panel.series.len() as f64
    } else {
        1.08
    };
    let [first, last] = panel.span;
    let mut chart = ChartBuilder::on(area)
        .margin(10)
        .caption(panel.title, ("sans-serif", 17).into_font().color(&INK))
        .x_label_area_size(36)
        .y_label_area_size(56)
        .build_cartesian_2d(first..last, 0.0..headroom * top)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(INK.mix(0.1))
        .x_desc(panel.across)
        .y_desc(panel.up)
        .draw()?;
    let beside = panel.series.len() as f64;
    for (place, of) in panel.series.iter().enumerate() {
        let step = (last - first) / of.values.len() as f64;
        let left = |i: usize| first + (i as f64 + 0.1 + 0.8 * place as f64 / beside) * step;
        let width = 0.8 / beside * step;
        let bar =
            |(i, &value): (usize, &f64)| Rectangle::new([(left(i), 0.0), (left(i) + width, value)], of.colour.filled());
        let colour = of.colour;
        chart
            .draw_series(of.values.iter().enumerate().map(bar))?
            .label(of.name)
            .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 12, y + 5)], colour.filled()));
        if let Some(errors) = of.errors {
            let whisker = |(i, &(lower, upper)): (usize, &(f64, f64))| {
                let x = left(i) + 0.5 * width;
                PathElement::new(vec![(x, lower), (x, upper)], INK)
            };
            chart.draw_series(errors.iter().enumerate().map(whisker))?;
        }
    }
    if panel.series.len() > 1 {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.8))
            .draw()?;
    }
    Ok(())
}

/// Writes a table: a header and rows.
pub fn table(path: &Path, header: &[&str], rows: &[Vec<String>]) -> Result<()> {
    let mut file = fs::File::create(path)?;
    writeln!(file, "{}", header.join(","))?;
    rows.iter().try_for_each(|row| writeln!(file, "{}", row.join(",")))?;
    Ok(())
}
