//! The real volume: a CT scan of sand with a label for every grain, cut, unfolded, and compared with what the volume holds.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::fs::File;
use std::io::BufReader;
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result, bail};
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;
use stereology::pipeline::{DensityOptions, MeasuredProfiles, ParticleTypes, particle_densities};
use stereology::unfold::{Bootstrap, BoundingBox, EdgeRule, Estimate, UnfoldOptions, edge_weights};
use tiff::decoder::{Decoder, DecodingResult};

/// Slices are so many voxels apart.
const APART: usize = 10;
/// Profiles smaller than this are noise of the labels; voxels.
const LEAST_AREA: usize = 8;

/// Labels, x fastest.
struct Labels {
    /// Of z, y, x.
    shape: [usize; 3],
    values: Vec<u16>,
}

impl Labels {
    fn read(path: &Path) -> Result<Self> {
        let file = File::open(path).with_context(|| path.display().to_string())?;
        let mut decoder = Decoder::new(BufReader::new(file))?;
        let (width, height) = decoder.dimensions()?;
        let mut values = Vec::new();
        let mut pages = 0;
        loop {
            match decoder.read_image()? {
                DecodingResult::U16(page) => values.extend(page),
                _ => bail!("{}: labels of 16 bits are needed", path.display()),
            }
            pages += 1;
            if !decoder.more_images() {
                break;
            }
            decoder.next_image()?;
        }
        Ok(Self {
            shape: [pages, height as usize, width as usize],
            values,
        })
    }

    fn at(&self, place: [usize; 3]) -> u16 {
        self.values[(place[0] * self.shape[1] + place[1]) * self.shape[2] + place[2]]
    }

    /// Profiles of every slice across an axis, with weights for the edges; the area of all slices is added to `area`.
    fn profiles(&self, axis: usize, into: &mut MeasuredProfiles) {
        let [u, v] = match axis {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        };
        let (height, width) = (self.shape[u], self.shape[v]);
        for depth in (APART / 2..self.shape[axis]).step_by(APART) {
            let label = |y: usize, x: usize| {
                let mut place = [0; 3];
                (place[axis], place[u], place[v]) = (depth, y, x);
                self.at(place)
            };
            let slice = into.slices.last().map_or(0, |last| last + 1);
            let mut seen = vec![false; height * width];
            let (mut sizes, mut boxes) = (Vec::new(), Vec::new());
            for start in 0..height * width {
                let of = label(start / width, start % width);
                if of == 0 || seen[start] {
                    continue;
                }
                seen[start] = true;
                let (mut open, mut area) = (vec![start], 0);
                let (mut least, mut most) = ([usize::MAX; 2], [0; 2]);
                while let Some(pixel) = open.pop() {
                    let (y, x) = (pixel / width, pixel % width);
                    area += 1;
                    least = [least[0].min(x), least[1].min(y)];
                    most = [most[0].max(x), most[1].max(y)];
                    let beside = [
                        (x > 0).then(|| pixel - 1),
                        (x + 1 < width).then(|| pixel + 1),
                        (y > 0).then(|| pixel - width),
                        (y + 1 < height).then(|| pixel + width),
                    ];
                    for next in beside.into_iter().flatten() {
                        if !seen[next] && label(next / width, next % width) == of {
                            seen[next] = true;
                            open.push(next);
                        }
                    }
                }
                if area >= LEAST_AREA {
                    sizes.push((4.0 * area as f64 / PI).sqrt());
                    boxes.push(BoundingBox {
                        left: least[0] as f64,
                        top: least[1] as f64,
                        right: (most[0] + 1) as f64,
                        bottom: (most[1] + 1) as f64,
                    });
                }
            }
            let weights = edge_weights(&boxes, width as f64, height as f64, EdgeRule::MilesLantuejoul);
            into.area += (width * height) as f64;
            into.slices.extend(vec![slice; sizes.len()]);
            into.categories.extend(vec![0; sizes.len()]);
            into.sizes.extend(sizes);
            into.weights.extend(weights);
        }
    }

    /// Middle and least semi-axis over the largest: medians of the inertia ellipsoids of the grains that do not touch the box.
    fn axis_ratios(&self) -> [f64; 2] {
        let grains = usize::from(self.values.iter().copied().max().unwrap_or(0)) + 1;
        let mut sums = vec![(0.0, Vector3::zeros(), Matrix3::zeros(), false); grains];
        for z in 0..self.shape[0] {
            for y in 0..self.shape[1] {
                for x in 0..self.shape[2] {
                    let place = Vector3::new(x as f64, y as f64, z as f64);
                    let of = &mut sums[usize::from(self.at([z, y, x]))];
                    of.0 += 1.0;
                    of.1 += place;
                    of.2 += place * place.transpose();
                    let edge = |at: usize, of: usize| at == 0 || at + 1 == of;
                    of.3 |= edge(z, self.shape[0]) || edge(y, self.shape[1]) || edge(x, self.shape[2]);
                }
            }
        }
        let mut ratios = [Vec::new(), Vec::new()];
        for (count, sum, square, _) in sums.iter().skip(1).filter(|of| of.0 > 50.0 && !of.3) {
            let mean = sum / *count;
            let spread = square / *count - mean * mean.transpose();
            let mut axes: Vec<f64> = spread
                .symmetric_eigenvalues()
                .iter()
                .map(|v| v.max(0.0).sqrt())
                .collect();
            axes.sort_by(|a, b| b.total_cmp(a));
            ratios[0].push(axes[1] / axes[0]);
            ratios[1].push(axes[2] / axes[0]);
        }
        ratios.map(|mut of| {
            of.sort_by(f64::total_cmp);
            of[of.len() / 2]
        })
    }
}

/// The part of the acceptance table about the sand in the folder `data`.
pub fn compare(data: &Path) -> Result<String> {
    let folder = data.join("volumes");
    let labels = Labels::read(&folder.join("sand_100x200x200_labels_u16.tif"))?;
    let truth: Value = serde_json::from_reader(File::open(folder.join("sand_truth.json"))?)?;
    let known = |name: &str| {
        truth[name]
            .as_f64()
            .with_context(|| format!("sand_truth.json has no {name}"))
    };
    let mut profiles = MeasuredProfiles::default();
    for axis in 0..3 {
        labels.profiles(axis, &mut profiles);
    }
    // A profile of exactly the least area was kept: the threshold lies just below it.
    profiles.min_size = (4.0 * LEAST_AREA as f64 / PI).sqrt() * (1.0 - 1e-9);
    let [b, c] = labels.axis_ratios();
    let mut text = format!(
        "\nSand, a real CT volume: {} profiles on slices {APART} voxels apart along three axes, Miles-Lantuéjoul weights, against the labels of the volume (sizes as equal-volume \
         diameters; 90 % intervals by drawing slices):\n\n| shape | density / true | mean size / true | volume fraction / true | method |\n|---|---|---|---|---|\n",
        profiles.weights.iter().filter(|weight| **weight > 0.0).count()
    );
    for shape in ["sphere".to_owned(), format!("ellipsoid:1,{b:.3},{c:.3}")] {
        let types = ParticleTypes::parse(&[&shape])?;
        let bootstrap = Bootstrap {
            resampling: stereology::unfold::Resampling::Slices,
            ..Bootstrap::default()
        };
        let options = DensityOptions {
            unfold: UnfoldOptions::default().with_bootstrap(bootstrap),
            ..DensityOptions::default()
        };
        let found = particle_densities(&profiles, &types, &options, &|_| ControlFlow::Continue(()))?.all;
        // The size of a body is that of its largest section; equal volume is another diameter.
        let ratio = (6.0 * types.unit_bodies()[0].volume() / PI).cbrt();
        let over = |estimate: Estimate, scale: f64| match estimate.interval {
            Some(of) => format!(
                "{:.3} ({:.3} to {:.3})",
                estimate.value * scale,
                of.lower * scale,
                of.upper * scale
            ),
            None => format!("{:.3}", estimate.value * scale),
        };
        writeln!(
            text,
            "| {shape} | {} | {} | {} | {} |",
            over(found.total, 1.0 / known("NV_per_voxel3_central_guard16")?),
            over(found.mean_size, ratio / known("d_eq_mean_central")?),
            over(found.volume_fraction, 1.0 / known("VV")?),
            found.method.name()
        )?;
    }
    Ok(text)
}
