//! Numbers of profiles of the same synthetic test images as PNG, as JPEGs and at other sizes.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result};
use image::codecs::jpeg::JpegEncoder;
use image::imageops::{FilterType, blur, resize};
use image::{Rgb, RgbImage};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use stereology::segment::{Compression, SegmentOptions, segment};

use crate::texture_table::replace_between;

const MARKS: [&str; 2] = ["<!-- scales -->\n", "<!-- end of scales -->\n"];
const QUALITIES: [u8; 6] = [95, 85, 75, 60, 45, 35];
const FACTORS: [f64; 6] = [0.5, 0.6, 1.5, 2.0, 2.6, 3.0];
const FILTERS: [(&str, FilterType); 2] = [("Lanczos", FilterType::Lanczos3), ("cubic", FilterType::CatmullRom)];
const SIZE: [u32; 2] = [640, 480];
/// Least area of the profiles that are counted, pixels of the image at its own size.
const LEAST_AREA: f64 = 100.0;

/// A kind of test image.
struct Kind {
    name: &'static str,
    corners: bool,
    /// Least distance between particles, pixels; negative for particles that touch.
    gap: f64,
    number: usize,
    radius: f64,
    colours: &'static [[f64; 3]],
    binder: [f64; 3],
    blur: f32,
    noise: f64,
    /// Standard deviation of a texture of lightness, of flecks some pixels wide.
    texture: f64,
}

const KINDS: [Kind; 5] = [
    Kind {
        name: "ellipses of four colours, sharp",
        corners: false,
        gap: 3.0,
        number: 150,
        radius: 11.0,
        colours: &[
            [150.0, 60.0, 50.0],
            [60.0, 90.0, 95.0],
            [35.0, 35.0, 38.0],
            [195.0, 160.0, 100.0],
        ],
        binder: [226.0, 222.0, 214.0],
        blur: 0.6,
        noise: 2.0,
        texture: 0.0,
    },
    Kind {
        name: "three colours, touching",
        corners: false,
        gap: -1.5,
        number: 230,
        radius: 12.0,
        colours: &[[150.0, 60.0, 50.0], [60.0, 90.0, 95.0], [200.0, 160.0, 60.0]],
        binder: [225.0, 222.0, 215.0],
        blur: 0.7,
        noise: 2.0,
        texture: 0.0,
    },
    Kind {
        name: "sections of cubes, blurred",
        corners: true,
        gap: 3.0,
        number: 130,
        radius: 12.0,
        colours: &[[60.0, 70.0, 140.0], [150.0, 50.0, 40.0]],
        binder: [205.0, 200.0, 190.0],
        blur: 1.5,
        noise: 2.0,
        texture: 0.0,
    },
    Kind {
        name: "grey ellipses without noise",
        corners: false,
        gap: 3.0,
        number: 130,
        radius: 11.0,
        colours: &[[60.0; 3], [40.0; 3], [90.0; 3]],
        binder: [200.0; 3],
        blur: 1.0,
        noise: 0.0,
        texture: 0.0,
    },
    Kind {
        name: "pale ellipses, binder with texture",
        corners: false,
        gap: 3.0,
        number: 130,
        radius: 13.0,
        colours: &[
            [175.0, 120.0, 85.0],
            [90.0, 105.0, 90.0],
            [205.0, 190.0, 150.0],
            [70.0, 60.0, 85.0],
        ],
        binder: [158.0, 152.0, 146.0],
        blur: 0.7,
        noise: 1.0,
        texture: 5.0,
    },
];
/// Standard deviation of the blur of a texture, pixels.
const FLECKS: f32 = 1.5;

/// Counts the profiles of all versions of all test images and writes the table between the marks of `page`.
pub fn run(page: &Path) -> Result<()> {
    let mut rows = vec![
        String::from("| version |"),
        String::from("|---|"),
        String::from("| PNG |"),
    ];
    rows.extend(QUALITIES.map(|quality| format!("| JPEG, quality {quality} |")));
    for (name, _) in FILTERS {
        rows.extend(FACTORS.map(|factor| format!("| {factor} times the size, {name} |")));
    }
    for (seed, kind) in (0..).zip(&KINDS) {
        let mut column = vec![format!(" {} |", kind.name), String::from("---|")];
        column.extend(counts(&kind.draw(seed))?.iter().map(|count| format!(" {count} |")));
        rows.iter_mut().zip(column).for_each(|(row, cell)| row.push_str(&cell));
    }
    let text = rows.join("\n") + "\n";
    print!("{text}");
    replace_between(page, MARKS, &text)
}

/// Numbers of profiles of all versions of an image.
fn counts(drawn: &RgbImage) -> Result<Vec<usize>> {
    let mut counts = vec![count(drawn, 1.0, None)?];
    let halved = with_halved_hue(drawn);
    for quality in QUALITIES {
        let mut bytes = Vec::new();
        JpegEncoder::new_with_quality(&mut bytes, quality).encode_image(&halved)?;
        let compression = Compression::of(&bytes).context("a JPEG has tables")?;
        let decoded = image::load_from_memory(&bytes)?.into_rgb8();
        counts.push(count(&decoded, 1.0, Some(compression))?);
    }
    for (_, filter) in FILTERS {
        for factor in FACTORS {
            let side = |n: u32| (f64::from(n) * factor).round() as u32;
            let resized = resize(drawn, side(drawn.width()), side(drawn.height()), filter);
            counts.push(count(&resized, factor, None)?);
        }
    }
    Ok(counts)
}

/// Number of profiles of an image that is `factor` times its own size.
fn count(photo: &RgbImage, factor: f64, compression: Option<Compression>) -> Result<usize> {
    let options = SegmentOptions::default()
        .with_min_area((LEAST_AREA * factor * factor).round() as usize)
        .with_compression(compression);
    Ok(segment(photo, &options, &|_| ControlFlow::Continue(()))?.profiles.len())
}

/// The image with the hue of every square of 2 x 2 pixels averaged, as JPEGs of cameras store it.
fn with_halved_hue(image: &RgbImage) -> RgbImage {
    let hue = |p: &Rgb<u8>| {
        let [r, g, b] = p.0.map(f64::from);
        let y = 0.299 * r + 0.587 * g + 0.114 * b;
        ([r - y, g - y, b - y], y)
    };
    RgbImage::from_fn(image.width(), image.height(), |x, y| {
        let (left, top) = (x - x % 2, y - y % 2);
        let square = [(left, top), (left + 1, top), (left, top + 1), (left + 1, top + 1)];
        let hues = square.map(|(x, y)| hue(image.get_pixel(x.min(image.width() - 1), y.min(image.height() - 1))).0);
        let (_, lightness) = hue(image.get_pixel(x, y));
        let channel = |c: usize| lightness + hues.iter().map(|h| h[c]).sum::<f64>() / 4.0;
        Rgb([0, 1, 2].map(|c| channel(c).round().clamp(0.0, 255.0) as u8))
    })
}

/// A particle's section: an ellipse, or the section of a cube.
struct Figure {
    centre: [f64; 2],
    radius: f64,
    ratio: f64,
    /// Direction of the axes in the plane.
    angle: f64,
    /// Normal of the plane in the cube's own axes, and its distance from the cube's centre.
    plane: ([f64; 3], f64),
    colour: [f64; 3],
}

impl Figure {
    fn contains(&self, corners: bool, [x, y]: [f64; 2]) -> bool {
        let (sin, cos) = self.angle.sin_cos();
        let (x, y) = (x - self.centre[0], y - self.centre[1]);
        let (u, v) = ((x * cos + y * sin) / self.radius, (y * cos - x * sin) / self.radius);
        if !corners {
            return u * u + (v / self.ratio).powi(2) < 1.0;
        }
        let (n, offset) = self.plane;
        // Two unit vectors in the plane.
        let length = n[0].hypot(n[1]);
        let a = [-n[1] / length, n[0] / length, 0.0];
        let b = [
            n[1] * a[2] - n[2] * a[1],
            n[2] * a[0] - n[0] * a[2],
            n[0] * a[1] - n[1] * a[0],
        ];
        (0..3).all(|c| (u * a[c] + v * b[c] + offset * n[c]).abs() < 0.8)
    }
}

impl Kind {
    /// The image, drawn with four samples per pixel, blurred, with noise.
    fn draw(&self, seed: u64) -> RgbImage {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let figures = self.figures(&mut rng);
        let [width, height] = SIZE;
        let sharp = RgbImage::from_fn(2 * width, 2 * height, |x, y| {
            let at = [f64::from(x) / 2.0 + 0.25, f64::from(y) / 2.0 + 0.25];
            let inside = figures.iter().find(|f| {
                (f.centre[0] - at[0]).hypot(f.centre[1] - at[1]) < 2.0 * f.radius && f.contains(self.corners, at)
            });
            Rgb(inside.map_or(self.binder, |f| f.colour).map(|c| c as u8))
        });
        let pixels = resize(&blur(&sharp, 2.0 * self.blur), width, height, FilterType::Triangle);
        let flecks = self.flecks(&mut rng);
        let mut noise = || self.noise * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut rng);
        let noisy = pixels.pixels().zip(flecks).map(|(p, fleck)| {
            p.0.map(|c| {
                (f64::from(c) * (1.0 + fleck / 255.0) + noise())
                    .round()
                    .clamp(0.0, 255.0) as u8
            })
        });
        let values: Vec<u8> = noisy.flatten().collect();
        RgbImage::from_raw(width, height, values).unwrap_or(pixels)
    }

    /// The texture of every pixel, row by row: blurred noise.
    fn flecks(&self, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let [width, height] = SIZE;
        if self.texture == 0.0 {
            return vec![0.0; (width * height) as usize];
        }
        // Blurred independent values keep 1 / (4π σ²) of their variance; levels have a standard deviation of 48.
        let kept = 1.0 / (4.0 * std::f64::consts::PI * f64::from(FLECKS).powi(2)).sqrt();
        let mut level = || (128.0 + 48.0 * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, rng)) as u8;
        let noise = image::GrayImage::from_fn(width, height, |_, _| image::Luma([level()]));
        let blurred = blur(&noise, FLECKS);
        let size = self.texture / (48.0 * kept);
        blurred.pixels().map(|p| (f64::from(p.0[0]) - 127.5) * size).collect()
    }

    /// Figures that keep their distance, as many as find a place.
    fn figures(&self, rng: &mut ChaCha8Rng) -> Vec<Figure> {
        let mut figures: Vec<Figure> = Vec::new();
        for _ in 0..40 * self.number {
            if figures.len() == self.number {
                break;
            }
            let spread: f64 = StandardNormal.sample(rng);
            let radius = (self.radius * (0.35 * spread).exp()).clamp(4.0, 40.0);
            let normal: [f64; 3] = std::array::from_fn(|_| StandardNormal.sample(rng));
            let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
            let shade: f64 = StandardNormal.sample(rng);
            let figure = Figure {
                centre: SIZE.map(|side| f64::from(side) * rng.random::<f64>()),
                radius,
                ratio: 0.6 + 0.4 * rng.random::<f64>(),
                angle: std::f64::consts::PI * rng.random::<f64>(),
                plane: (normal.map(|n| n / length), 0.6 * rng.random::<f64>()),
                colour: self.colours[rng.random_range(0..self.colours.len())].map(|c| c + 5.0 * shade),
            };
            // Circumscribed circles: 1 for ellipses, 1.3 for almost all sections of cubes of edge 1.6.
            let around = if self.corners { 1.3 } else { 1.0 };
            let apart = |other: &Figure| {
                let distance = (other.centre[0] - figure.centre[0]).hypot(other.centre[1] - figure.centre[1]);
                distance > around * (other.radius + figure.radius) + self.gap
            };
            if figures.iter().all(apart) {
                figures.push(figure);
            }
        }
        figures
    }
}
