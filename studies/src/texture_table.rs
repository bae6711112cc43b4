//! Agreement of the slices of synthesised volumes with their exemplar: along the axes and obliquely, in every mode.

use std::fmt::Write as _;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result};
use nalgebra::{Unit, Vector3};
use ndarray::{Array2, Array3, Array4, Axis};
use stereology::metrics::wasserstein_sorted;
use stereology::pyramid::{
    Exemplar, Mode, SteerablePyramid, TextureOptions, cut_band, cut_variances, synthesize_volume_with_report,
};
use stereology::spectrum::{RealFft, frequency, periodic_component};

use crate::figures::textures::{beside, picture_of};

const TEXTURES: [&str; 6] = [
    "granite002A_128",
    "terrazzo003_128",
    "concrete011_128",
    "gravel_gray_512",
    "grass_gray_512",
    "rock058_512",
];
const MODES: [(&str, Mode); 4] = [
    ("slices", Mode::Slices),
    ("oriented", Mode::Oriented),
    ("spectrum", Mode::Spectrum),
    ("volume", Mode::Volume),
];
const SEEDS: u64 = 3;
const SIDE: usize = 64;
const LEVELS: usize = 3;
const ORIENTATIONS: usize = 4;
const MARKS: [&str; 2] = [
    "<!-- measured by cargo xtask acceptance -->\n",
    "<!-- end of what was measured -->\n",
];

/// Synthesises every texture in `data` in every mode, writes the table between the marks of `page`, and images of the
/// cubes beside their exemplars into `results`.
pub fn run(data: &Path, results: &Path, page: &Path) -> Result<()> {
    fs::create_dir_all(results)?;
    let mut text = String::from(
        "| texture | mode | var 100 | var 110 | var 111 | var random | high 100 | high oblique | W1 100 | W1 oblique | kurtosis 100 | kurtosis oblique | cones | steps |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    println!("{text}");
    for name in TEXTURES {
        let file = data.join(format!("{name}.png"));
        let picture = image::open(&file)
            .with_context(|| file.display().to_string())?
            .into_rgb8();
        let exemplar = Array3::from_shape_fn((picture.height() as usize, picture.width() as usize, 3), |(y, x, c)| {
            f32::from(picture.get_pixel(x as u32, y as u32).0[c]) / 255.0
        });
        let wanted = Wanted::of(&exemplar)?;
        for (mode_name, mode) in MODES {
            let mut sum = [0.0; 12];
            for seed in 0..SEEDS {
                let options = TextureOptions::default().with_mode(mode).with_seed(seed);
                let go = |_: f64, _: &_| ControlFlow::Continue(());
                let (volume, _) =
                    synthesize_volume_with_report(&Exemplar::new(exemplar.view()), [SIDE; 3], &options, &go)?;
                if seed == 0 && mode == Mode::Slices {
                    beside(&picture, &picture_of(&volume)?).save(results.join(format!("{name}.png")))?;
                }
                for (sum, figure) in sum.iter_mut().zip(wanted.compare(&volume)?) {
                    *sum += figure / SEEDS as f64;
                }
            }
            let figures: Vec<String> = sum.iter().map(|figure| format!("{figure:.3}")).collect();
            let line = format!("| {name} | {mode_name} | {} |", figures.join(" | "));
            println!("{line}");
            writeln!(text, "{line}")?;
        }
    }
    replace_between(page, MARKS, &text)
}

/// Replaces the text between two marks of a page.
pub fn replace_between(page: &Path, marks: [&str; 2], text: &str) -> Result<()> {
    let old = fs::read_to_string(page).with_context(|| page.display().to_string())?;
    let parts = old
        .split_once(marks[0])
        .and_then(|(before, rest)| Some((before, rest.split_once(marks[1])?.1)));
    let (before, after) = parts.with_context(|| format!("{}: the marks are missing", page.display()))?;
    fs::write(page, format!("{before}{}{text}{}{after}", marks[0], marks[1]))?;
    Ok(())
}

/// Statistics of the exemplar's luminance.
struct Wanted {
    /// Mean squares: high-pass, then levels (sum over orientations).
    variances: Vec<f64>,
    /// Sorted coefficients of each level, orientations together.
    levels: Vec<Vec<f32>>,
}

impl Wanted {
    fn of(exemplar: &Array3<f32>) -> Result<Self> {
        let image: Array2<f32> =
            periodic_component(luminance(exemplar.view().into_dyn()).into_dimensionality()?.view())?;
        let bands = SteerablePyramid::new([image.nrows(), image.ncols()], LEVELS, ORIENTATIONS)?.build(image.view())?;
        let summaries = bands.summaries();
        let level = |l: usize| {
            summaries
                .iter()
                .filter(move |b| b.level == l && b.orientation.is_some())
        };
        Ok(Self {
            variances: [summaries[0].mean_square]
                .into_iter()
                .chain((0..LEVELS).map(|l| level(l).map(|b| b.mean_square).sum()))
                .collect(),
            levels: (0..LEVELS)
                .map(|l| {
                    sorted((0..ORIENTATIONS).flat_map(|b| bands.oriented(l, b).iter().copied().collect::<Vec<_>>()))
                })
                .collect(),
        })
    }

    fn compare(&self, volume: &Array4<f32>) -> Result<[f64; 12]> {
        let grey: Array3<f32> = luminance(volume.view().into_dyn()).into_dimensionality()?;
        let families = families();
        let mut rms = [0.0; 4];
        let mut high = [0.0; 4];
        for (f, normals) in families.iter().enumerate() {
            let found = cut_variances(grey.view(), normals, LEVELS)?;
            let ln = |band: usize| {
                found
                    .iter()
                    .map(move |bands| (bands[band] / self.variances[band]).ln().powi(2))
            };
            rms[f] = root_mean((1..=LEVELS).flat_map(ln));
            high[f] = root_mean(ln(0));
        }
        let mut shape = [[0.0; 2]; 2];
        for (oblique, normals) in [families[0].clone(), families[1..].iter().map(|of| of[0]).collect()]
            .iter()
            .enumerate()
        {
            let (mut distance, mut kurtosis) = (Vec::new(), Vec::new());
            for normal in normals {
                for (level, wanted) in self.levels.iter().enumerate() {
                    let bands = (0..ORIENTATIONS)
                        .map(|b| cut_band(grey.view(), normal, level, b, ORIENTATIONS))
                        .collect::<Result<Vec<_>, _>>()?;
                    // Every fifth coefficient suffices.
                    let found = sorted(bands.iter().flat_map(|band| band.iter().step_by(5).copied()));
                    distance.push(relative_distance(&found, wanted));
                    kurtosis.push((fourth(&found) - fourth(wanted)).powi(2));
                }
            }
            shape[oblique] = [
                distance.iter().sum::<f64>() / distance.len() as f64,
                root_mean(kurtosis.into_iter()),
            ];
        }
        let oblique_high = root_mean(high[1..].iter().map(|v| v * v));
        Ok([
            rms[0],
            rms[1],
            rms[2],
            rms[3],
            high[0],
            oblique_high,
            shape[0][0],
            shape[1][0],
            shape[0][1],
            shape[1][1],
            cones(&grey)?,
            steps(volume),
        ])
    }
}

/// Normals: the axes, the face diagonals, the space diagonals, and eight spread over the sphere.
fn families() -> [Vec<Unit<Vector3<f64>>>; 4] {
    let all = |list: &[[f64; 3]]| list.iter().map(|v| Unit::new_normalize(Vector3::from(*v))).collect();
    let spread = (0..8).map(|i| {
        let (z, angle) = ((f64::from(i) + 0.5) / 8.0, f64::from(i) * 2.399_963 + 0.7);
        let across = (1.0 - z * z).sqrt();
        Unit::new_normalize(Vector3::new(across * angle.cos(), across * angle.sin(), z))
    });
    [
        all(&[[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]]),
        all(&[
            [1., 1., 0.],
            [1., 0., 1.],
            [0., 1., 1.],
            [1., -1., 0.],
            [1., 0., -1.],
            [0., 1., -1.],
        ]),
        all(&[[1., 1., 1.], [-1., 1., 1.], [1., -1., 1.], [1., 1., -1.]]),
        spread.collect(),
    ]
}

fn luminance(colours: ndarray::ArrayViewD<'_, f32>) -> ndarray::ArrayD<f32> {
    let last = colours.ndim() - 1;
    colours.map_axis(Axis(last), |c| 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2])
}

fn root_mean(squares: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = squares.collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

fn sorted(values: impl Iterator<Item = f32>) -> Vec<f32> {
    let mut values: Vec<f32> = values.collect();
    values.sort_unstable_by(f32::total_cmp);
    values
}

/// Wasserstein-1 distance divided by the standard deviation of `wanted`; both are sorted.
fn relative_distance(found: &[f32], wanted: &[f32]) -> f64 {
    let square = wanted.iter().map(|&v| f64::from(v).powi(2)).sum::<f64>() / wanted.len() as f64;
    wasserstein_sorted(found, wanted) / square.sqrt()
}

/// Kurtosis about zero.
fn fourth(values: &[f32]) -> f64 {
    let mean = |p: i32| values.iter().map(|&v| f64::from(v).powi(p)).sum::<f64>() / values.len() as f64;
    mean(4) / mean(2).powi(2)
}

/// Power within 18 degrees of an axis relative to the mean of its shell, frequencies 1/8 to 1/4.
fn cones(grey: &Array3<f32>) -> Result<f64> {
    let spectrum = RealFft::<f32>::new(&[SIDE; 3])?.forward(grey.view())?;
    let mut shells = vec![(0.0, 0.0, 0.0, 0.0); SIDE];
    for ((z, y, x), value) in spectrum.indexed_iter() {
        let k = [frequency(z, SIDE), frequency(y, SIDE), x as f64 / SIDE as f64];
        let radius = k.iter().map(|k| k * k).sum::<f64>().sqrt();
        if !(0.125..0.25).contains(&radius) {
            continue;
        }
        let weight = if x == 0 || 2 * x == SIDE { 1.0 } else { 2.0 };
        let shell = &mut shells[(radius * SIDE as f64).round() as usize];
        let power = weight * f64::from(value.norm_sqr());
        shell.0 += power;
        shell.1 += weight;
        if k.iter().any(|k| k.abs() > radius * 18.0_f64.to_radians().cos()) {
            shell.2 += power;
            shell.3 += weight;
        }
    }
    let inside: Vec<_> = shells.iter().filter(|s| s.3 > 0.0).collect();
    let sum: f64 = inside.iter().map(|s| s.2 / (s.0 / s.1)).sum();
    Ok(sum / inside.iter().map(|s| s.3).sum::<f64>())
}

/// Largest mean difference of neighbouring planes relative to the median, over all axes, including the periodic border.
fn steps(volume: &Array4<f32>) -> f64 {
    (0..3)
        .map(|axis| {
            let n = volume.len_of(Axis(axis));
            let step = |i: usize| {
                let (a, b) = (
                    volume.index_axis(Axis(axis), i),
                    volume.index_axis(Axis(axis), (i + 1) % n),
                );
                a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>()
            };
            let mut steps: Vec<f64> = (0..n).map(step).collect();
            steps.sort_by(f64::total_cmp);
            steps[n - 1] / (0.5 * (steps[n / 2 - 1] + steps[n / 2]))
        })
        .fold(0.0, f64::max)
}
