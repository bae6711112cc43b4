//! Figures 3 to 11 of Urs et al. 2012 on a synthetic lattice fringe image: methods and scans by iteration, fringes, and
//! the effect of k, levels, neighbourhood and sizes.

use std::f64::consts::TAU;
use std::path::Path;

use anyhow::{Context, Result};
use image::imageops::{FilterType, resize};
use image::{Rgb, RgbImage};
use ndarray::Array2;
use plotters::style::RGBColor;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology::exemplar::{Method, Scan};

use super::bars::{BLUE, GREEN, RED, table as csv};
use super::growing::{column, row};
use super::lines::{Chart, Line, draw as chart};
use crate::laminar_study::{Case, HEAD, METHODS, Moment, Outcome, SCANS, band_passed, learning, ratio, run, table};
use crate::texture_table::replace_between;

/// The paper's size of image and solid.
const SIDE: usize = 128;
/// Size of the solids of the tables and of the parameter studies.
const SMALL: usize = 64;

const INK: RGBColor = RGBColor(40, 40, 40);
const GOLD: RGBColor = RGBColor(214, 158, 46);
const VIOLET: RGBColor = RGBColor(120, 90, 160);

/// A lattice fringe image of dense carbon: layers 7 pixels apart, undulating, of limited length (dislocations end
/// them), of changing contrast, under a slow background and grain. Values 0 to 1.
///
/// ```text
/// f = A cos(2π (y + u) / 7 + Σ ± atan2(y − y_k, x − x_k)) + B + grain
/// u, A, B: sums of waves of random direction, long along x
/// ```
pub fn fringe_image(side: usize, seed: u64) -> Array2<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // Sixteen waves of lengths about `along` and `across`, of unit variance together.
    let mut waves = |along: f64, across: f64| -> Vec<[f64; 3]> {
        (0..16)
            .map(|_| {
                let [a, b, phase] = [0; 3].map(|_| rng.random::<f64>());
                let turn = TAU * a;
                let stretch = (0.3 + 1.2 * b) * TAU;
                [stretch * turn.cos() / along, stretch * turn.sin() / across, TAU * phase]
            })
            .collect()
    };
    let (undulation, strength, background) = (waves(90.0, 160.0), waves(90.0, 40.0), waves(120.0, 120.0));
    let sum = |waves: &[[f64; 3]], y: f64, x: f64| -> f64 {
        waves
            .iter()
            .map(|[kx, ky, phase]| (kx * x + ky * y + phase).cos())
            .sum::<f64>()
            / 8.0_f64.sqrt()
    };
    let ends: Vec<[f64; 3]> = (0..side * side / 450)
        .map(|i| {
            let [y, x] = [0; 2].map(|_| rng.random::<f64>() * side as f64);
            [y, x, if i % 2 == 0 { 1.0 } else { -1.0 }]
        })
        .collect();
    let grain = Array2::from_shape_fn((side + 1, side + 1), |_| rng.random::<f64>() - 0.5);
    Array2::from_shape_fn((side, side), |(row, column)| {
        let (y, x) = (row as f64, column as f64);
        let turns: f64 = ends.iter().map(|[ey, ex, sign]| sign * (y - ey).atan2(x - ex)).sum();
        let phase = TAU * (y + 2.5 * sum(&undulation, y, x)) / 7.0 + turns;
        let fringe = (1.0 + 0.3 * sum(&strength, y, x)) * phase.cos();
        let noise: f64 = [(0, 0), (0, 1), (1, 0), (1, 1)]
            .iter()
            .map(|(a, b)| grain[[row + a, column + b]])
            .sum();
        let value = fringe + 0.25 * sum(&background, y, x) + 0.5 * noise;
        (0.5 + value / 4.2).clamp(0.0, 1.0) as f32
    })
}

/// The studied image, raw and band-passed.
fn inputs() -> Result<[Array2<f32>; 2]> {
    let raw = fringe_image(SIDE, 2012);
    let filtered = band_passed(&raw)?;
    Ok([raw, filtered])
}

/// Slices, progress by iteration, and fringes, at the paper's size.
pub fn draw(folder: &Path) -> Result<()> {
    let [raw, filtered] = inputs()?;
    let hilbert: Vec<Case> = METHODS
        .iter()
        .map(|(_, method)| *method)
        .chain([Method::Best])
        .map(|method| Case::new(method, Scan::Hilbert, SIDE))
        .collect();
    let scans = SCANS[..3].iter().map(|(_, scan)| Case::new(Method::Kopf, *scan, SIDE));
    let cases: Vec<Case> = hilbert.iter().copied().chain(scans).collect();
    let of_raw = run(&raw, &cases)?;
    let of_filtered = run(&filtered, &hilbert)?;
    let pictures = |picture: &Array2<f32>, of: &[Outcome]| {
        let all: Vec<RgbImage> = std::iter::once(picture)
            .chain(of[..4].iter().map(|o| &o.slice))
            .map(shown)
            .collect();
        row(&all)
    };
    column(&[pictures(&raw, &of_raw), pictures(&filtered, &of_filtered)])
        .save(folder.join("laminar-slices.png"))
        .context("laminar-slices.png")?;
    iterations(folder, &of_raw, &of_filtered)?;
    fringes(folder, &of_raw[..4])
}

/// All methods and scans, for docs/exemplar.md.
pub fn draw_table(folder: &Path) -> Result<()> {
    let [raw, filtered] = inputs()?;
    let mut text = format!("\n{HEAD}");
    text.push_str(&table("drawn", &raw, SMALL, 3, true)?);
    text.push_str(&table("drawn, band-passed", &filtered, SMALL, 1, false)?);
    text.push('\n');
    let page = folder.parent().unwrap_or(folder).join("exemplar.md");
    let marks = [
        "<!-- measured by cargo xtask figures laminar -->",
        "<!-- end of what was measured by figures -->",
    ];
    replace_between(&page, marks, &text)
}

fn shown(picture: &Array2<f32>) -> RgbImage {
    let (height, width) = picture.dim();
    let small = RgbImage::from_fn(width as u32, height as u32, |x, y| {
        Rgb([(255.0 * picture[[y as usize, x as usize]]).round().clamp(0.0, 255.0) as u8; 3])
    });
    resize(&small, 2 * small.width(), 2 * small.height(), FilterType::Nearest)
}

/// Name and colour of an outcome's method.
fn method_of(outcome: &Outcome) -> (&'static str, RGBColor) {
    match outcome.case.method {
        Method::WeiLevoy => ("Wei & Levoy", BLUE),
        Method::Kopf => ("Kopf", RED),
        Method::ChenWang => ("Chen & Wang", GREEN),
        Method::Best => ("best", GOLD),
    }
}

fn scan_of(outcome: &Outcome) -> (&'static str, RGBColor) {
    match outcome.case.scan {
        Scan::Lexicographic => ("lexicographic", BLUE),
        Scan::Random => ("random", GREEN),
        Scan::Morton => ("Morton", VIOLET),
        Scan::Hilbert => ("Hilbert", RED),
    }
}

/// Figures 7, 9 and 11: progress by iteration.
fn iterations(folder: &Path, raw: &[Outcome], filtered: &[Outcome]) -> Result<()> {
    type Of = (&'static str, fn(&Moment) -> f64, bool);
    let figures: [Of; 4] = [
        ("KL of greys", |m| m.kl_grey, false),
        ("deviation / the picture's", |m| m.std_ratio, true),
        ("skewness", |m| m.skewness, false),
        ("KL of orientations", |m| m.kl_orientation, false),
    ];
    let scans: Vec<&Outcome> = raw.iter().filter(|o| o.case.method == Method::Kopf).collect();
    let rows: [(&str, Vec<&Outcome>, bool); 3] = [
        ("raw", raw[..4].iter().collect(), false),
        ("band-passed", filtered.iter().collect(), false),
        ("raw, Kopf", scans, true),
    ];
    let (mut charts, mut lines) = (Vec::new(), Vec::new());
    for (input, outcomes, by_scan) in &rows {
        for (title, figure, has_ideal) in &figures {
            let ideal = match *title {
                "skewness" => outcomes[0].found.skewness.ideal,
                _ => has_ideal.then_some(1.0),
            };
            let line = |o: &&Outcome| {
                let (name, colour) = if *by_scan { scan_of(o) } else { method_of(o) };
                Line {
                    name: name.to_owned(),
                    points: o
                        .moments
                        .iter()
                        .enumerate()
                        .map(|(i, m)| (i as f64 + 1.0, figure(m)))
                        .collect(),
                    colour,
                }
            };
            charts.push(Chart {
                title: format!("{title}: {input}"),
                across: "iteration",
                up: "",
                ideal,
                lines: outcomes.iter().map(line).collect(),
            });
        }
        for o in outcomes {
            for (i, m) in o.moments.iter().enumerate() {
                let figures = [m.kl_grey, m.std_ratio, m.skewness, m.kl_orientation].map(|v| format!("{v:.5}"));
                let head = [
                    (*input).replace(',', ""),
                    method_of(o).0.into(),
                    scan_of(o).0.into(),
                    (i + 1).to_string(),
                ];
                lines.push(head.into_iter().chain(figures).collect());
            }
        }
    }
    chart(&folder.join("laminar-iterations.svg"), &charts, 4)?;
    let head = [
        "picture",
        "method",
        "scan",
        "iteration",
        "kl_grey",
        "std_ratio",
        "skewness",
        "kl_orientation",
    ];
    csv(&folder.join("laminar-iterations.csv"), &head, &lines)
}

/// Figures 7a, 8c and 10: distributions of grey values, orientations, lengths and tortuosities.
fn fringes(folder: &Path, outcomes: &[Outcome]) -> Result<()> {
    type Points = Vec<(f64, f64)>;
    let curves = |of: &dyn Fn(&Outcome, usize) -> Points| {
        let own = Line {
            name: "picture".into(),
            points: of(&outcomes[0], 0),
            colour: INK,
        };
        let others = outcomes.iter().map(|o| Line {
            name: method_of(o).0.into(),
            points: of(o, 1),
            colour: method_of(o).1,
        });
        std::iter::once(own).chain(others).collect::<Vec<Line>>()
    };
    let shares = |values: &[f64], most: f64| -> Vec<(f64, f64)> {
        let n = values.len() as f64;
        let at = |i: usize, v: &f64| (v.min(most), (i + 1) as f64 / n);
        let step = (values.len() / 400).max(1);
        values
            .iter()
            .enumerate()
            .filter(|(i, v)| i % step == 0 && **v <= most)
            .map(|(i, v)| at(i, v))
            .collect()
    };
    let bars = |values: &[f64], width: f64| -> Vec<(f64, f64)> {
        values.iter().enumerate().map(|(i, v)| (i as f64 * width, *v)).collect()
    };
    let all = [
        Chart {
            title: "Greys".into(),
            across: "grey level",
            up: "share",
            ideal: None,
            lines: curves(&|o, side| bars(&o.found.curves.grey[side], 1.0 / 64.0)),
        },
        Chart {
            title: "Orientations".into(),
            across: "degrees from the columns' axis",
            up: "share",
            ideal: None,
            lines: curves(&|o, side| {
                let mut turned = o.found.curves.orientation[side].clone();
                turned.rotate_right(18);
                bars(&turned, 5.0).into_iter().map(|(x, y)| (x - 90.0, y)).collect()
            }),
        },
        Chart {
            title: "Fringes no longer than".into(),
            across: "pixels",
            up: "share",
            ideal: None,
            lines: curves(&|o, side| shares(&o.found.curves.fringe_lengths[side], 120.0)),
        },
        Chart {
            title: "Fringes that wind no more than".into(),
            across: "length over distance of the ends",
            up: "share",
            ideal: None,
            lines: curves(&|o, side| shares(&o.found.curves.tortuosities[side], 1.5)),
        },
    ];
    chart(&folder.join("laminar-fringes.svg"), &all, 2)?;
    let mut rows = Vec::new();
    for o in outcomes {
        for (name, figure) in o.found.figures() {
            let said = |v: Option<f64>| v.map_or_else(String::new, |v| format!("{v:.5}"));
            rows.push(vec![
                method_of(o).0.into(),
                name.into(),
                said(figure.value),
                said(figure.ideal),
                said(figure.floor),
            ]);
        }
    }
    csv(
        &folder.join("laminar-fringes.csv"),
        &["method", "figure", "value", "ideal", "floor"],
        &rows,
    )
}

/// The effect of k, levels, neighbourhood and the sizes of image and solid.
pub fn draw_parameters(folder: &Path) -> Result<()> {
    let [raw, _] = inputs()?;
    let raw = &raw;
    let kopf = Case::new(Method::Kopf, Scan::Hilbert, SMALL);
    let counts = [1, 2, 4, 8, 15, 30, 60];
    let by_k: Vec<Case> = counts
        .iter()
        .map(|&k| Case {
            similar: Some(k),
            ..Case::new(Method::ChenWang, Scan::Hilbert, SMALL)
        })
        .collect();
    let by_levels: Vec<Case> = (1..=5).map(|levels| Case { levels, ..kopf }).collect();
    let by_side: Vec<Case> = [3, 5, 7, 9, 11]
        .iter()
        .map(|&neighbourhood| Case {
            neighbourhood,
            levels: 4,
            ..kopf
        })
        .collect();
    let by_size: Vec<Case> = [32, 48, 64, 96, 128]
        .iter()
        .map(|&size| Case { size, ..kopf })
        .collect();
    let sides = [48, 64, 96, 128, 192, 256];
    let mut by_picture = Vec::new();
    for side in sides {
        // As many levels as leave four neighbourhoods at the coarsest.
        let levels = if side < 64 {
            3
        } else if side < SIDE {
            4
        } else {
            5
        };
        by_picture.extend(run(&fringe_image(side, 2012), &[Case { levels, ..kopf }])?);
    }
    let times: Vec<f64> = counts.iter().map(|&k| learning(raw, k)).collect::<Result<_>>()?;
    let groups: Vec<(&str, &'static str, Vec<f64>, Vec<Outcome>)> = vec![
        (
            "k (Chen & Wang)",
            "k",
            counts.iter().map(|&k| k as f64).collect(),
            run(raw, &by_k)?,
        ),
        (
            "Levels (Kopf)",
            "levels",
            (1..=5).map(f64::from).collect(),
            run(raw, &by_levels)?,
        ),
        (
            "Neighbourhood (Kopf)",
            "pixels a side",
            vec![3.0, 5.0, 7.0, 9.0, 11.0],
            run(raw, &by_side)?,
        ),
        (
            "Size of the picture (Kopf)",
            "pixels a side",
            sides.map(|s| s as f64).to_vec(),
            by_picture,
        ),
        (
            "Size of the solid (Kopf)",
            "voxels a side",
            vec![32.0, 48.0, 64.0, 96.0, 128.0],
            run(raw, &by_size)?,
        ),
    ];
    let mut charts = vec![Chart {
        title: "Learning the k like each pixel".into(),
        across: "k",
        up: "CPU seconds",
        ideal: None,
        lines: vec![Line {
            name: "128² pixels".into(),
            points: counts.iter().map(|&k| k as f64).zip(times.iter().copied()).collect(),
            colour: GREEN,
        }],
    }];
    let mut rows: Vec<Vec<String>> = counts
        .iter()
        .zip(&times)
        .map(|(k, seconds)| {
            vec![
                "learning".into(),
                k.to_string(),
                "cpu_seconds".into(),
                format!("{seconds:.2}"),
            ]
        })
        .collect();
    for (title, across, values, outcomes) in &groups {
        let line = |name: &str, colour, figure: &dyn Fn(&Outcome) -> Option<f64>| Line {
            name: name.into(),
            points: values
                .iter()
                .zip(outcomes)
                .filter_map(|(v, o)| Some((*v, figure(o)?)))
                .collect(),
            colour,
        };
        charts.push(Chart {
            title: (*title).into(),
            across,
            up: "over the picture's",
            ideal: Some(1.0),
            lines: vec![
                line("deviation", BLUE, &|o| o.found.std_ratio.value),
                line("gradient", GREEN, &|o| o.found.gradient_ratio.value),
                line("fringe length", RED, &|o| ratio(o.found.fringe_length_by_ends)),
            ],
        });
        for (value, o) in values.iter().zip(outcomes) {
            for (name, figure) in o.found.figures() {
                let said = figure.value.map_or_else(String::new, |v| format!("{v:.5}"));
                rows.push(vec![(*title).into(), value.to_string(), name.into(), said]);
            }
        }
    }
    chart(&folder.join("laminar-parameters.svg"), &charts, 3)?;
    csv(
        &folder.join("laminar-parameters.csv"),
        &["varied", "value", "figure", "found"],
        &rows,
    )
}
