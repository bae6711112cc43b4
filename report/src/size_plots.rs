//! Plots of a synthesis: profiles, particles and spectra.

use std::ops::Range;

use plotters::prelude::*;
use stereology::pipeline::ResidualSpectra;

use crate::figures::SizeFigures;
use crate::plot::{BARS, FIT, INK, Plot, SOLID, axes, highest, tick};

/// Profiles by size: observed, refolded, and on sections of the solid.
pub(crate) fn profiles(sizes: &SizeFigures, synthetic: &[f64], unit: &str) -> Plot {
    let key = [
        (BARS, "photograph, with its counting error"),
        (FIT, "refolded fit"),
        (SOLID, "sections of the solid"),
    ];
    Plot::draw(&key, |area| {
        let edges = &sizes.profile_edges;
        // Per unit of size, so that bins of different widths are comparable.
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
pub(crate) fn particles(sizes: &SizeFigures, unit: &str) -> Plot {
    Plot::draw(&[(BARS, "unfolded"), (SOLID, "packed")], |area| {
        let edges = &sizes.particle_edges;
        let density: Vec<f64> = sizes.number_density.iter().map(|n| n.unwrap_or(0.0)).collect();
        let intervals = sizes.interval.clone().unwrap_or_default();
        // An interval can be much wider than its bar, which must stay visible.
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
pub(crate) fn spectra(spectrum: &ResidualSpectra) -> Plot {
    Plot::draw(
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

/// Labels 1, 2 and 5 of each decade; more would overlap.
fn decade(value: f64) -> String {
    let leading = value / 10_f64.powf(value.log10().floor());
    if [1.0, 2.0, 5.0, 10.0].iter().any(|shown| (leading - shown).abs() < 1e-6) {
        tick(value)
    } else {
        String::new()
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
