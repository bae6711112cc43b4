//! A plot: its key and its SVG. Curves of an exemplar and a volume.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::prelude::*;

const SIZE: (u32, u32) = (520, 320);
pub(crate) const BARS: RGBColor = RGBColor(168, 187, 206);
pub(crate) const FIT: RGBColor = RGBColor(196, 78, 32);
pub(crate) const SOLID: RGBColor = RGBColor(38, 120, 88);
pub(crate) const INK: RGBColor = RGBColor(60, 60, 60);

pub(crate) type Failed = Box<dyn std::error::Error>;

/// A plot for a page.
#[derive(Clone, Debug)]
pub(crate) struct Plot {
    /// Meanings of the colours.
    pub(crate) key: Vec<KeyEntry>,
    /// SVG without a fixed size, or the reason why there is none.
    pub(crate) drawing: Result<String, String>,
}

/// Meaning of a colour.
#[derive(Clone, Debug)]
pub(crate) struct KeyEntry {
    /// CSS colour.
    pub(crate) colour: String,
    /// What has this colour.
    pub(crate) meaning: &'static str,
}

impl Plot {
    /// Draws a plot with this key.
    pub(crate) fn draw(key: &[(RGBColor, &'static str)], draw: impl FnOnce(&Area<'_>) -> Result<(), Failed>) -> Self {
        let mut svg = String::new();
        let result = {
            let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
            draw(&area).and_then(|()| area.present().map_err(Failed::from))
        };
        let fixed = format!("width=\"{}\" height=\"{}\" ", SIZE.0, SIZE.1);
        let entry = |&(RGBColor(r, g, b), meaning)| KeyEntry {
            colour: format!("rgb({r}, {g}, {b})"),
            meaning,
        };
        Self {
            key: key.iter().map(entry).collect(),
            drawing: match result {
                Ok(()) => Ok(svg.replacen(&fixed, "role=\"img\" ", 1)),
                Err(error) => Err(format!("This plot could not be drawn: {error}")),
            },
        }
    }
}

pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(crate) type Chart<'a, 'b, X, Y> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<X, Y>>;
pub(crate) type Linear = plotters::coord::types::RangedCoordf64;

pub(crate) fn axes<'a, 'b>(
    area: &'a Area<'b>,
    x: Range<f64>,
    y: Range<f64>,
    x_name: &str,
    y_name: &str,
) -> Result<Chart<'a, 'b, Linear, Linear>, Failed> {
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(64)
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(INK.mix(0.1))
        .x_desc(x_name)
        .y_desc(y_name)
        .x_label_formatter(&|x| tick(*x))
        .y_label_formatter(&|y| tick(*y))
        .axis_style(INK.mix(0.5))
        .label_style(("sans-serif", 14, &INK))
        .draw()?;
    Ok(chart)
}

pub(crate) fn tick(value: f64) -> String {
    // Ticks are computed by addition, so rounding can miss zero.
    if value.abs() < 1e-12 {
        "0".to_owned()
    } else if value.abs() >= 1e5 || value.abs() < 1e-3 {
        format!("{value:.1e}")
    } else {
        let text = format!("{value:.4}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    }
}

pub(crate) fn highest(values: impl Iterator<Item = f64>) -> f64 {
    let highest = values.filter(|value| value.is_finite()).fold(0.0, f64::max);
    if highest > 0.0 { 1.08 * highest } else { 1.0 }
}

const BESIDE: [(RGBColor, &str); 2] = [(INK, "exemplar"), (FIT, "volume")];

/// Curves of exemplar and volume over the same values of x.
pub(crate) fn pair(places: &[f64], values: &[Vec<f64>; 2], x_name: &str, y_name: &str) -> Plot {
    let points = [0, 1].map(|k| {
        places
            .iter()
            .copied()
            .zip(values[k].iter().copied())
            .collect::<Vec<_>>()
    });
    beside(points, x_name, y_name)
}

/// Distribution functions of two sorted lists.
pub(crate) fn distribution(values: &[Vec<f64>; 2], x_name: &str) -> Plot {
    let points = [0, 1].map(|k| {
        let n = values[k].len() as f64;
        let shares = (0..values[k].len()).map(|i| (i + 1) as f64 / n);
        // The largest one per cent would compress the rest.
        let most = |(_, share): &(f64, f64)| *share <= 0.99;
        values[k]
            .iter()
            .copied()
            .zip(shares)
            .take_while(most)
            .collect::<Vec<_>>()
    });
    beside(points, x_name, "fraction")
}

/// A value of every slice of the volume, with the mean of the exemplar as a horizontal line.
pub(crate) fn slices(values: &[Vec<f64>; 2], x_name: &str, y_name: &str) -> Plot {
    let n = values[1].len().max(1) as f64;
    let mean = values[0].iter().sum::<f64>() / values[0].len().max(1) as f64;
    let of_volume = values[1]
        .iter()
        .enumerate()
        .map(|(i, v)| ((i as f64 + 0.5) / n, *v))
        .collect();
    beside([vec![(0.0, mean), (1.0, mean)], of_volume], x_name, y_name)
}

fn beside(points: [Vec<(f64, f64)>; 2], x_name: &str, y_name: &str) -> Plot {
    let all = || points.iter().flatten().copied();
    let (left, right) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p.0), b.max(p.0)));
    if left >= right {
        return Plot {
            key: Vec::new(),
            drawing: Err("There is nothing to show.".to_owned()),
        };
    }
    Plot::draw(&BESIDE, |area| {
        let lowest = all().map(|p| p.1).fold(0.0, f64::min);
        let is_below = lowest < 0.0 && all().all(|p| p.1 <= 0.0);
        let top = if is_below { 0.0 } else { highest(all().map(|p| p.1)) };
        let mut chart = axes(area, left..right, 1.08 * lowest..top, x_name, y_name)?;
        for (points, (colour, _)) in points.iter().zip(BESIDE) {
            chart.draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?;
        }
        Ok(())
    })
}
