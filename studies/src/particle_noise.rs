//! Noise of particles, estimated from all of them or from each alone: the effect on their borders.

use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::Result;
use image::RgbImage;
use ndarray::{Array2, Array3};
use stereology::pyramid::{Exemplar, TextureError, TextureOptions, synthesize_image};
use stereology::sample;
use stereology::segment::{SegmentOptions, Segmentation, read_photo, segment};

use crate::texture_table::replace_between;

const MARKS: [&str; 2] = [
    "<!-- noise measured by cargo xtask acceptance -->\n",
    "<!-- end of noise -->\n",
];

/// Compares both on the built-in sample and on the photographs in `data`, and writes the table between the marks of
/// `page`.
pub fn run(data: &Path, page: &Path) -> Result<()> {
    let mut text = String::from(
        "| photograph | picture | step over the border | step inside particles | ratio | noise inside |\n|---|---|---|---|---|---|\n",
    );
    compare("built-in sample", &sample::photo()?, &mut text)?;
    for name in ["terrazzo009_cc0.jpg", "synth_medium_102.jpg"] {
        compare(name, &read_photo(data.join(name))?, &mut text)?;
    }
    println!("{text}");
    replace_between(page, MARKS, &text)
}

fn compare(name: &str, photo: &RgbImage, text: &mut String) -> Result<()> {
    let go = |_: f64| ControlFlow::Continue(());
    let found = segment(photo, &SegmentOptions::default(), &go)?;
    let residual = found.residual();
    let means = Array3::from_shape_fn(residual.dim(), |(y, x, c)| {
        f32::from(photo.get_pixel(x as u32, y as u32).0[c]) / 255.0 - residual[[y, x, c]]
    });
    let nothing = Array3::zeros(residual.dim());
    let pooled = pooled(&found, &residual)?;
    let alone = alone(&found, &residual, &pooled)?;
    for (picture, noise) in [
        ("photograph", &residual),
        ("mean colours alone", &nothing),
        ("noise pooled over particles", &pooled),
        ("noise of each particle alone", &alone),
    ] {
        let [border, inside, spread] = measure(&found.labels, &(&means + noise), noise);
        let ratio = if inside > 1e-6 {
            format!("{:.2}", border / inside)
        } else {
            "-".to_owned()
        };
        writeln!(
            text,
            "| {name} | {picture} | {border:.4} | {inside:.4} | {ratio} | {spread:.4} |"
        )?;
    }
    Ok(())
}

fn synthesised(residual: &Array3<f32>, mask: &Array2<bool>, size: [usize; 2]) -> Result<Array3<f32>, TextureError> {
    let go = |_: f64| ControlFlow::Continue(());
    let exemplar = Exemplar::new(residual.view()).with_mask(mask.view());
    synthesize_image(&exemplar, size, &TextureOptions::default(), &go)
}

/// Noise of binder and particles from their pixels at least two pixels away from any border.
fn pooled(found: &Segmentation, residual: &Array3<f32>) -> Result<Array3<f32>> {
    let labels = &found.labels;
    let (height, width) = labels.dim();
    let inner = Array2::from_shape_fn((height, width), |(y, x)| depth_at_least(labels, y, x, 2));
    let of = |particle: bool| {
        let mask = Array2::from_shape_fn((height, width), |at| (labels[at] > 0) == particle && inner[at]);
        synthesised(residual, &mask, [height, width])
    };
    let (binder, particles) = (of(false)?, of(true)?);
    Ok(Array3::from_shape_fn(residual.dim(), |(y, x, c)| {
        if labels[[y, x]] > 0 {
            particles[[y, x, c]]
        } else {
            binder[[y, x, c]]
        }
    }))
}

/// Noise of each particle from its own pixels if there are enough of them, else the pooled noise.
fn alone(found: &Segmentation, residual: &Array3<f32>, pooled: &Array3<f32>) -> Result<Array3<f32>> {
    let mut noise = pooled.clone();
    let most = found.labels.iter().copied().max().unwrap_or(0) as usize;
    let mut boxes = vec![[usize::MAX, 0, usize::MAX, 0]; most + 1];
    for ((y, x), &label) in found.labels.indexed_iter() {
        let of = &mut boxes[label as usize];
        *of = [of[0].min(y), of[1].max(y + 1), of[2].min(x), of[3].max(x + 1)];
    }
    for (label, &[top, bottom, left, right]) in boxes.iter().enumerate().skip(1) {
        if top == usize::MAX || bottom - top < 8 || right - left < 8 {
            continue;
        }
        let sides = (bottom - top, right - left);
        let part = Array3::from_shape_fn((sides.0, sides.1, 3), |(y, x, c)| residual[[top + y, left + x, c]]);
        let mask = Array2::from_shape_fn(sides, |(y, x)| found.labels[[top + y, left + x]] as usize == label);
        let made = match synthesised(&part, &mask, [sides.0, sides.1]) {
            Err(TextureError::MaskTooSmall { .. }) => continue,
            made => made?,
        };
        for ((y, x, c), &value) in made.indexed_iter().filter(|((y, x, _), _)| mask[[*y, *x]]) {
            noise[[top + y, left + x, c]] = value;
        }
    }
    Ok(noise)
}

/// Whether all pixels within `reach` along rows and columns have the pixel's own label.
fn depth_at_least(labels: &Array2<u32>, y: usize, x: usize, reach: usize) -> bool {
    let (height, width) = labels.dim();
    let rows = y.saturating_sub(reach)..(y + reach + 1).min(height);
    rows.flat_map(|v| (x.saturating_sub(reach)..(x + reach + 1).min(width)).map(move |u| [v, u]))
        .all(|at| labels[at] == labels[[y, x]])
}

/// Mean absolute difference of luminance between neighbours across a border of particle and binder, and between
/// neighbours inside particles; and the noise's standard deviation inside particles.
fn measure(labels: &Array2<u32>, picture: &Array3<f32>, noise: &Array3<f32>) -> [f64; 3] {
    let grey = |of: &Array3<f32>, [y, x]: [usize; 2]| {
        f64::from(0.299 * of[[y, x, 0]] + 0.587 * of[[y, x, 1]] + 0.114 * of[[y, x, 2]])
    };
    let (height, width) = labels.dim();
    let (mut border, mut inside, mut spread) = ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0));
    for y in 0..height - 1 {
        for x in 0..width - 1 {
            let deep = labels[[y, x]] > 0 && depth_at_least(labels, y, x, 2);
            for other in [[y + 1, x], [y, x + 1]] {
                let step = (grey(picture, [y, x]) - grey(picture, other)).abs();
                let to = if deep {
                    &mut inside
                } else if (labels[[y, x]] == 0) != (labels[other] == 0) {
                    &mut border
                } else {
                    continue;
                };
                to.0 += step;
                to.1 += 1.0;
            }
            if deep {
                spread.0 += grey(noise, [y, x]).powi(2);
                spread.1 += 1.0;
            }
        }
    }
    [border.0 / border.1, inside.0 / inside.1, f64::sqrt(spread.0 / spread.1)]
}
