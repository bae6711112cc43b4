//! Plots as SVG text.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::prelude::*;

use stereology::pipeline::ResidualSpectra;

use super::SizeFigures;

const SIZE: (u32, u32) = (520, 320);
const BARS: RGBColor = RGBColor(168, 187, 206);
const FIT: RGBColor = RGBColor(196, 78, 32);
const SOLID: RGBColor = RGBColor(38, 120, 88);
const INK: RGBColor = RGBColor(60, 60, 60);

type Failed = Box<dyn std::error::Error>;

/// Profiles by size: observed, refolded, and on sections of the solid.
pub(super) fn profiles(sizes: &SizeFigures, synthetic: &[f64], unit: &str) -> String {
    let key = [
        (BARS, "photograph, with its counting error"),
        (FIT, "refolded fit"),
        (SOLID, "sections of the solid"),
    ];
    drawn(&key, |area| {
        let edges = &sizes.profile_edges;
        // Per unit of size, so that bins of different widths compare.
        let each = |counts: &[f64]| -> Vec<f64> {
            edges
                .windows(2)
                .zip(counts)
                .map(|(bin, n)| n / (bin[1] - bin[0]))
                .collect()
        };
        let error = |sign: f64| each(&sizes.observed.iter().map(|n| n + sign * n.sqrt()).collect::<Vec<_>>());
        let (observed, refolded, synthetic) = (each(&sizes.observed), each(&sizes.refolded), each(synthetic));
        let (low, high) = (error(-1.0), error(1.0));
        let top = highest(high.iter().chain(&refolded).chain(&synthetic).copied());
        let mut chart = axes(
            area,
            span(edges),
            0.0..top,
            &format!("profile size ({unit})"),
            &format!("profiles per {unit} of size"),
        )?;
        chart.draw_series(bars(edges, &observed))?;
        chart.draw_series(whiskers(edges, low.into_iter().zip(high)))?;
        chart.draw_series(LineSeries::new(steps(edges, &refolded), FIT.stroke_width(2)))?;
        chart.draw_series(LineSeries::new(steps(edges, &synthetic), SOLID.stroke_width(2)))?;
        Ok(())
    })
}

/// Particles by size: unfolded with intervals, and packed.
pub(super) fn particles(sizes: &SizeFigures, unit: &str) -> String {
    drawn(&[(BARS, "unfolded"), (SOLID, "packed")], |area| {
        let edges = &sizes.particle_edges;
        let density: Vec<f64> = sizes.number_density.iter().map(|n| n.unwrap_or(0.0)).collect();
        let intervals = sizes.interval.clone().unwrap_or_default();
        // An interval may be far wider than what it is about; the bars must stay visible.
        let bulk = highest(density.iter().copied().chain(sizes.packed.iter().copied()));
        let top = highest(intervals.iter().map(|interval| interval.1)).clamp(bulk, 3.0 * bulk);
        let mut chart = axes(
            area,
            span(edges),
            0.0..top,
            &format!("particle size ({unit})"),
            &format!("particles per {unit}\u{b3}"),
        )?;
        chart.draw_series(bars(edges, &density))?;
        chart.draw_series(whiskers(
            edges,
            intervals.iter().map(|&(low, high)| (low, high.min(top))),
        ))?;
        chart.draw_series(LineSeries::new(steps(edges, &sizes.packed), SOLID.stroke_width(2)))?;
        let unknown = edges.windows(2).zip(&sizes.number_density).filter(|(_, n)| n.is_none());
        chart.draw_series(
            unknown.map(|(bin, _)| Rectangle::new([(bin[0], 0.0), (bin[1], top)], INK.mix(0.08).filled())),
        )?;
        Ok(())
    })
}

/// Power spectra of the residual.
pub(super) fn spectra(spectrum: &ResidualSpectra) -> String {
    drawn(
        &[(INK, "photograph"), (SOLID, "slices of the residual volume")],
        |area| {
            let positive = |values: &[f64]| -> Vec<(f64, f64)> {
                spectrum
                    .frequency
                    .iter()
                    .copied()
                    .zip(values.iter().copied())
                    .filter(|&(f, p)| f > 0.0 && p > 0.0)
                    .collect()
            };
            let (photo, slices) = (positive(&spectrum.photo), positive(&spectrum.sections));
            let powers = || photo.iter().chain(&slices).map(|point| point.1);
            let low = powers().fold(f64::INFINITY, f64::min);
            let high = powers().fold(0.0, f64::max);
            if !(low.is_finite() && high > 0.0) {
                return Ok(());
            }
            let first = photo
                .iter()
                .chain(&slices)
                .map(|point| point.0)
                .fold(f64::INFINITY, f64::min);
            let mut chart = ChartBuilder::on(area)
                .margin(12)
                .x_label_area_size(42)
                .y_label_area_size(64)
                .build_cartesian_2d((first * 0.9..0.5).log_scale(), (low / 1.5..high * 1.5).log_scale())?;
            chart
                .configure_mesh()
                .light_line_style(TRANSPARENT)
                .bold_line_style(INK.mix(0.1))
                .x_desc("cycles per pixel")
                .y_desc("power")
                .x_label_formatter(&|x| decade(*x))
                .y_label_formatter(&|y| format!("{y:.0e}"))
                .axis_style(INK.mix(0.5))
                .label_style(("sans-serif", 14, &INK))
                .draw()?;
            chart.draw_series(LineSeries::new(photo, INK.stroke_width(2)))?;
            chart.draw_series(LineSeries::new(slices, SOLID.stroke_width(2)))?;
            Ok(())
        },
    )
}

const BESIDE: [(RGBColor, &str); 2] = [(INK, "exemplar"), (FIT, "volume")];

/// Curves of exemplar and volume over the same places.
pub(super) fn pair(places: &[f64], values: &[Vec<f64>; 2], x_name: &str, y_name: &str) -> String {
    let points = [0, 1].map(|k| {
        places
            .iter()
            .copied()
            .zip(values[k].iter().copied())
            .collect::<Vec<_>>()
    });
    beside(points, x_name, y_name)
}

/// Shares of values up to each, of two sorted lists.
pub(super) fn distribution(values: &[Vec<f64>; 2], x_name: &str) -> String {
    let points = [0, 1].map(|k| {
        let n = values[k].len() as f64;
        let shares = (0..values[k].len()).map(|i| (i + 1) as f64 / n);
        // The longest in a hundred would press the others together.
        let most = |(_, share): &(f64, f64)| *share <= 0.99;
        values[k]
            .iter()
            .copied()
            .zip(shares)
            .take_while(most)
            .collect::<Vec<_>>()
    });
    beside(points, x_name, "share")
}

/// A value of every slice of the volume; the exemplar's mean is a line across.
pub(super) fn slices(values: &[Vec<f64>; 2], x_name: &str, y_name: &str) -> String {
    let n = values[1].len().max(1) as f64;
    let mean = values[0].iter().sum::<f64>() / values[0].len().max(1) as f64;
    let of_volume = values[1]
        .iter()
        .enumerate()
        .map(|(i, v)| ((i as f64 + 0.5) / n, *v))
        .collect();
    beside([vec![(0.0, mean), (1.0, mean)], of_volume], x_name, y_name)
}

fn beside(points: [Vec<(f64, f64)>; 2], x_name: &str, y_name: &str) -> String {
    let all = || points.iter().flatten().copied();
    let (left, right) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p.0), b.max(p.0)));
    if left >= right {
        return "<p>There is nothing to show.</p>".to_owned();
    }
    drawn(&BESIDE, |area| {
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

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The key of a plot and its SVG, scaled by the page; a plot that cannot be drawn says so.
fn drawn(key: &[(RGBColor, &str)], draw: impl FnOnce(&Area<'_>) -> Result<(), Failed>) -> String {
    let mut svg = String::new();
    let result = {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        draw(&area).and_then(|()| area.present().map_err(Failed::from))
    };
    if let Err(error) = result {
        return format!("<p>This plot could not be drawn: {error}</p>");
    }
    let key: String = key
        .iter()
        .map(|(colour, what)| {
            let RGBColor(r, g, b) = colour;
            format!("<span><i style=\"background: rgb({r}, {g}, {b})\"></i>{what}</span>")
        })
        .collect();
    let fixed = format!("width=\"{}\" height=\"{}\" ", SIZE.0, SIZE.1);
    format!(
        "<div class=\"key\">{key}</div>{}",
        svg.replacen(&fixed, "role=\"img\" ", 1)
    )
}

type Chart<'a, 'b, X, Y> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<X, Y>>;
type Linear = plotters::coord::types::RangedCoordf64;

fn axes<'a, 'b>(
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

/// 1, 2 and 5 of each decade; the others would overlap.
fn decade(value: f64) -> String {
    let leading = value / 10_f64.powf(value.log10().floor());
    if [1.0, 2.0, 5.0, 10.0].iter().any(|shown| (leading - shown).abs() < 1e-6) {
        tick(value)
    } else {
        String::new()
    }
}

fn tick(value: f64) -> String {
    // Marks are computed by steps, and zero may be missed by rounding.
    if value.abs() < 1e-12 {
        "0".to_owned()
    } else if value.abs() >= 1e5 || value.abs() < 1e-3 {
        format!("{value:.1e}")
    } else {
        let text = format!("{value:.4}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    }
}

fn bars(edges: &[f64], heights: &[f64]) -> Vec<Rectangle<(f64, f64)>> {
    edges
        .windows(2)
        .zip(heights)
        .map(|(bin, &height)| Rectangle::new([(bin[0], 0.0), (bin[1], height)], BARS.filled()))
        .collect()
}

/// A vertical line in the middle of each bin.
fn whiskers(edges: &[f64], intervals: impl Iterator<Item = (f64, f64)>) -> Vec<PathElement<(f64, f64)>> {
    edges
        .windows(2)
        .zip(intervals)
        .filter(|(_, (low, high))| low.is_finite() && high.is_finite() && high > low)
        .map(|(bin, (low, high))| {
            let middle = (bin[0] + bin[1]) / 2.0;
            PathElement::new(vec![(middle, low.max(0.0)), (middle, high)], INK.stroke_width(1))
        })
        .collect()
}

/// Outline of a histogram.
fn steps(edges: &[f64], heights: &[f64]) -> Vec<(f64, f64)> {
    edges
        .windows(2)
        .zip(heights)
        .flat_map(|(bin, &height)| [(bin[0], height), (bin[1], height)])
        .collect()
}

fn span(edges: &[f64]) -> Range<f64> {
    let last = edges.last().copied().filter(|last| *last > 0.0).unwrap_or(1.0);
    0.0..last
}

fn highest(values: impl Iterator<Item = f64>) -> f64 {
    let highest = values.filter(|value| value.is_finite()).fold(0.0, f64::max);
    if highest > 0.0 { 1.08 * highest } else { 1.0 }
}
