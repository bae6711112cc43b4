//! Figures 2 to 6 of Stone et al. 2014 on a synthetic soapstone, and how seams and similarity depend on the window.

use std::fmt::Write as _;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::Result;
use image::imageops::{FilterType, replace, resize};
use image::{Rgb, RgbImage};
use nalgebra::Point3;
use ndarray::{Array3, ArrayView3, Axis};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology::grow::{
    GrowOptions, Grown, LevelOptions, Planes, Voxels, flood_fill, grow, grow_image, synthesize_by_levels,
};
use stereology::metrics::{Family, seams, sections};
use stereology::pipeline::{CompareOptions, compare_solid};
use stereology::render::{Camera, RenderOptions, render_mesh};
use stereology::shape::{ClosedMesh, TriangleMesh};

use crate::texture_table::replace_between;

const SIDE: usize = 256;

fn go(_: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Draws all figures of growth.
pub fn draw(folder: &Path) -> Result<()> {
    let stone = soapstone();
    shown(&stone.view()).save(folder.join("grow-1-soapstone.png"))?;
    pictures(folder, &stone)?;
    flood(folder)?;
    let block = Array3::from_elem((80, 80, 80), true);
    let cube = grown(&block, &stone, &GrowOptions::default().with_seeds(19))?;
    let slice = shown(&cube.values.index_axis(Axis(1), 40));
    let labels = cube.labels.index_axis(Axis(1), 40);
    let cells = RgbImage::from_fn(80, 80, |x, y| Rgb(cell_colour(labels[[y as usize, x as usize]])));
    row(&[larger(&slice, 4), larger(&cells, 4)]).save(folder.join("grow-4-cube.png"))?;
    body(folder, &stone)?;
    table(folder, &stone)
}

fn grown(mask: &Array3<bool>, stone: &Array3<f32>, options: &GrowOptions) -> Result<Grown> {
    Ok(grow(mask.view(), stone.view(), &[], options, &go)?)
}

/// Flakes of three minerals on each other, as an electron microscope shows soapstone: values 0 to 1.
fn soapstone() -> Array3<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(14);
    let mut grey = Array3::from_elem((SIDE, SIDE, 1), 0.35_f32);
    for flake in 0..2600 {
        let [cy, cx, turn] = [SIDE as f64, SIDE as f64, std::f64::consts::PI].map(|most| most * rng.random::<f64>());
        let length = 3.0 + 13.0 * rng.random::<f64>().powi(3) * if flake < 600 { 1.6 } else { 1.0 };
        let width = length * (0.2 + 0.25 * rng.random::<f64>());
        let mineral = match (10.0 * rng.random::<f64>()) as u32 {
            0..=4 => 0.38,
            5..=7 => 0.58,
            8 => 0.78,
            _ => 0.18,
        };
        let tone = mineral + 0.07 * (rng.random::<f64>() - 0.5);
        let (sin, cos) = turn.sin_cos();
        let reach = length.ceil() as i64;
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let (v, u) = (dy as f64, dx as f64);
                let along = (u * cos + v * sin) / length;
                let across = (v * cos - u * sin) / width;
                if along * along + across * across < 1.0 {
                    // The image is periodic, so its border cuts no flake.
                    let place = |c: f64, d: i64| (c as i64 + d).rem_euclid(SIDE as i64) as usize;
                    grey[[place(cy, dy), place(cx, dx), 0]] = tone as f32;
                }
            }
        }
    }
    // Grain as in a real image, so that windows inside a flake are not all alike.
    let sharp = grey.mapv(|v| v + 0.16 * (rng.random::<f32>() - 0.5));
    Array3::from_shape_fn((SIDE, SIDE, 1), |(y, x, _)| {
        let sum: f32 = [(0, 0), (0, 1), (1, 0), (1, 1)]
            .map(|(dy, dx)| sharp[[(y + dy) % SIDE, (x + dx) % SIDE, 0]])
            .iter()
            .sum();
        (sum / 4.0).clamp(0.0, 1.0)
    })
}

/// Figure 2: images of 256² from exemplars of 50² and 200², grown and by resolution levels.
fn pictures(folder: &Path, stone: &Array3<f32>) -> Result<()> {
    for side in [50, 200] {
        let piece = stone.slice_axis(Axis(0), (0..side).into());
        let piece = piece.slice_axis(Axis(1), (0..side).into());
        let window = if side == 50 { 9 } else { 11 };
        let one = grow_image(piece, [SIDE; 2], &GrowOptions::default().with_window(window), &go)?;
        let levels = LevelOptions::default().with_levels(3).with_window(7);
        let other = synthesize_by_levels(piece, [SIDE; 2], &levels, &go)?;
        row(&[shown(&piece), shown(&one.view()), shown(&other.view())])
            .save(folder.join(format!("grow-2-from-{side}.png")))?;
    }
    Ok(())
}

/// Figure 3: a flood fill of a square at four moments.
fn flood(folder: &Path) -> Result<()> {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let n = 160;
    let seeds: Vec<([usize; 3], u32)> = (1..=14)
        .map(|label| ([0, rng.random_range(0..n), rng.random_range(0..n)], label))
        .collect();
    let fill = flood_fill(Array3::from_elem((1, n, n), true).view(), &seeds);
    let moments = [0.1, 0.35, 0.7, 1.0].map(|share: f64| {
        let mut picture = RgbImage::from_pixel(n as u32, n as u32, Rgb([255; 3]));
        for &[_, y, x] in &fill.order[..(share * fill.order.len() as f64) as usize] {
            picture.put_pixel(x as u32, y as u32, Rgb(cell_colour(fill.labels[[0, y, x]])));
        }
        for ([_, y, x], _) in &seeds {
            for (dy, dx) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                picture.put_pixel((x + dx).min(n - 1) as u32, (y + dy).min(n - 1) as u32, Rgb([0; 3]));
            }
        }
        larger(&picture, 2)
    });
    row(&moments).save(folder.join("grow-3-flood-fill.png"))?;
    Ok(())
}

/// A body with arms and dents, in place of the paper's armadillo: a ball whose radius follows waves over it.
fn knobbly() -> TriangleMesh {
    TriangleMesh::icosphere(2.0, 6).mapped(|p| {
        let waves = (4.0 * p.x).sin() * (3.0 * p.y + 0.5).cos() + 0.8 * (5.0 * p.z + 1.0).sin() * (3.0 * p.x).cos();
        Point3::from(p.coords * (0.75 + 0.22 * waves))
    })
}

/// Figures 5 and 6: the body's surface, and three slices through one point, by window.
fn body(folder: &Path, stone: &Array3<f32>) -> Result<()> {
    let mesh = knobbly();
    let voxels = Voxels::of_mesh(&ClosedMesh::try_from(mesh.clone())?, 96)?;
    let mut rows = Vec::new();
    for window in [0, 5, 9] {
        let made = grown(
            &voxels.inside,
            stone,
            &GrowOptions::default().with_window(window).with_seeds(24),
        )?;
        let (nz, ny, nx) = voxels.inside.dim();
        let slice = |axis: usize, at: usize| {
            let (values, inside) = (
                made.values.index_axis(Axis(axis), at),
                voxels.inside.index_axis(Axis(axis), at),
            );
            let picture = shown(&values);
            let picture = RgbImage::from_fn(picture.width(), picture.height(), |x, y| {
                if inside[[y as usize, x as usize]] {
                    *picture.get_pixel(x, y)
                } else {
                    Rgb([255; 3])
                }
            });
            larger(&picture, 3)
        };
        rows.push(row(&[slice(0, nz / 2), slice(1, ny / 2), slice(2, nx / 2)]));
        if window == 5 {
            let colour = |p: &Point3<f64>| match voxels.nearest_inside(p, 3.0) {
                Some(([z, y, x], _)) => [made.values[[z, y, x, 0]]; 3],
                None => [0.5; 3],
            };
            let options = RenderOptions {
                gloss: 0.1,
                ..RenderOptions::default().with_size(640, 640)
            };
            render_mesh(&mesh, &colour, &Camera::default(), &options)?.save(folder.join("grow-5-body.png"))?;
        }
    }
    column(&rows).save(folder.join("grow-6-slices.png"))?;
    Ok(())
}

/// Seams, similarity and sharpness by window and planes, for docs/grow.md.
fn table(folder: &Path, stone: &Array3<f32>) -> Result<()> {
    let block = Array3::from_elem((48, 48, 48), true);
    let mut text = String::from(
        "\n| window | planes | step across seams / inside | SWD 7 | SWD 16 | gradient ratio | KL grey |\n|---|---|---|---|---|---|---|\n",
    );
    let mut floors = String::new();
    for (window, planes) in [
        (0, Planes::Axis),
        (3, Planes::Axis),
        (5, Planes::Axis),
        (5, Planes::Oblique),
        (7, Planes::Axis),
        (9, Planes::Axis),
        (11, Planes::Axis),
    ] {
        let options = GrowOptions::default()
            .with_window(window)
            .with_planes(planes)
            .with_seeds(20);
        let made = grown(&block, stone, &options)?;
        let seam = seams(made.values.view(), made.labels.view());
        let all: Vec<ArrayView3<'_, f32>> = Family::ALL
            .iter()
            .flat_map(|f| sections(made.values.view(), *f))
            .collect();
        let options = CompareOptions {
            patches: Some(4096),
            ..CompareOptions::default()
        };
        let found = compare_solid(&[stone.view()], &all, &options, &go)?;
        let number = |v: Option<f64>| v.map_or_else(|| "-".to_owned(), |v| format!("{v:.3}"));
        let name = if planes == Planes::Axis { "axis" } else { "oblique" };
        writeln!(
            text,
            "| {window} | {name} | {} | {} | {} | {} | {} |",
            number(seam.visibility()),
            number(found.swd7.value),
            number(found.swd16.value),
            number(found.gradient_ratio.value),
            number(found.kl_grey.value)
        )?;
        floors = format!(
            "| floor | | 1 | {} | {} | 1 ± {} | {} |\n",
            number(found.swd7.floor),
            number(found.swd16.floor),
            number(found.gradient_ratio.floor),
            number(found.kl_grey.floor)
        );
    }
    text.push_str(&floors);
    fs::write(folder.join("grow-windows.md"), &text)?;
    let page = folder.parent().unwrap_or(folder).join("grow.md");
    replace_between(
        &page,
        [
            "<!-- measured by cargo xtask figures grow -->",
            "<!-- end of what was measured by figures -->",
        ],
        &text,
    )?;
    fs::remove_file(folder.join("grow-windows.md"))?;
    Ok(())
}

/// A distinct colour for each cell.
fn cell_colour(label: u32) -> [u8; 3] {
    let mut rng = ChaCha8Rng::seed_from_u64(u64::from(label));
    [0; 3].map(|_| rng.random_range(70..240))
}

fn shown(values: &ArrayView3<'_, f32>) -> RgbImage {
    let (height, width, _) = values.dim();
    RgbImage::from_fn(width as u32, height as u32, |x, y| {
        let grey = (255.0 * values[[y as usize, x as usize, 0]]).round().clamp(0.0, 255.0) as u8;
        Rgb([grey; 3])
    })
}

fn larger(picture: &RgbImage, factor: u32) -> RgbImage {
    resize(
        picture,
        factor * picture.width(),
        factor * picture.height(),
        FilterType::Nearest,
    )
}

/// Images side by side, aligned at the top.
pub fn row(pictures: &[RgbImage]) -> RgbImage {
    let height = pictures.iter().map(RgbImage::height).max().unwrap_or(1);
    let width: u32 = pictures.iter().map(|p| p.width() + 8).sum();
    let mut all = RgbImage::from_pixel(width.saturating_sub(8).max(1), height, Rgb([255; 3]));
    let mut at = 0;
    for picture in pictures {
        replace(&mut all, picture, at, 0);
        at += i64::from(picture.width()) + 8;
    }
    all
}

/// Images one above the other.
pub fn column(pictures: &[RgbImage]) -> RgbImage {
    let width = pictures.iter().map(RgbImage::width).max().unwrap_or(1);
    let height: u32 = pictures.iter().map(|p| p.height() + 8).sum();
    let mut all = RgbImage::from_pixel(width, height.saturating_sub(8).max(1), Rgb([255; 3]));
    let mut at = 0;
    for picture in pictures {
        replace(&mut all, picture, 0, at);
        at += i64::from(picture.height()) + 8;
    }
    all
}
