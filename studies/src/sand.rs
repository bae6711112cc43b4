//! A CT scan of sand with a label for every grain: sliced, unfolded, and compared with the grains of the volume.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::fs::File;
use std::io::BufReader;
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result, bail};
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;
use stereology::kmatrix::Sizes;
use stereology::pipeline::{DensityOptions, MeasuredProfiles, ParticleTypes, unfold_profiles};
use stereology::shape::Body;
use stereology::unfold::{
    Bootstrap, BoundingBox, EdgeRule, Estimate, ProfileCounts, SamplingWindow, SizeBins, UnfoldOptions, Unfolding,
    capped_kernel, equal_edges, unfold,
};
use tiff::decoder::{Decoder, DecodingResult};

/// Distance of the slices in voxels.
const APART: usize = 10;
/// Detection limits in voxels. Profiles of less than eight voxels are noise of the labels; below seven voxels in
/// diameter an error of the label's border by half a voxel changes the area by more than a quarter. Very few grains are
/// that small.
const LEAST_SIZES: [f64; 2] = [3.19, 7.0];

/// A connected component of a label on a slice.
struct Piece {
    label: u16,
    /// Diameter of the circle with its area.
    size: f64,
    around: BoundingBox,
}

/// The section law of the labelled grains themselves, measured on planes rather than assumed from a body.
#[derive(Default)]
struct GrainLaw {
    /// Sizes of profiles relative to the grain's largest, ascending.
    relative: Vec<f64>,
    /// Mean number of profiles over the grain's size: H of a grain of size 1, components counted separately.
    caliper: f64,
    /// Mean volume divided by the cube of the size.
    unit_volume: f64,
    /// Sizes of the grains, ascending.
    sizes: Vec<f64>,
}

/// Labels, x fastest.
struct Labels {
    /// Sizes along z, y, x.
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

    /// Height and width of the slices across an axis.
    fn slice_shape(&self, axis: usize) -> [usize; 2] {
        match axis {
            0 => [self.shape[1], self.shape[2]],
            1 => [self.shape[0], self.shape[2]],
            _ => [self.shape[0], self.shape[1]],
        }
    }

    /// The connected components of every label on a slice.
    fn pieces(&self, axis: usize, depth: usize) -> Vec<Piece> {
        let [u, v] = match axis {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        };
        let [height, width] = self.slice_shape(axis);
        let label = |y: usize, x: usize| {
            let mut place = [0; 3];
            (place[axis], place[u], place[v]) = (depth, y, x);
            self.at(place)
        };
        let mut seen = vec![false; height * width];
        let mut pieces = Vec::new();
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
            pieces.push(Piece {
                label: of,
                size: (4.0 * area as f64 / PI).sqrt(),
                around: BoundingBox {
                    left: least[0] as f64,
                    top: least[1] as f64,
                    right: (most[0] + 1) as f64,
                    bottom: (most[1] + 1) as f64,
                },
            });
        }
        pieces
    }

    /// Profiles of the slices across an axis, with weights for the edges; the area of all slices is added to `area`.
    fn profiles(&self, axis: usize, into: &mut MeasuredProfiles) {
        let [height, width] = self.slice_shape(axis);
        for depth in (APART / 2..self.shape[axis]).step_by(APART) {
            let slice = into.slices.last().map_or(0, |last| last + 1);
            let mut pieces = self.pieces(axis, depth);
            pieces.retain(|piece| piece.size >= LEAST_SIZES[0]);
            let boxes: Vec<BoundingBox> = pieces.iter().map(|piece| piece.around).collect();
            let weights = SamplingWindow::continuous(width as f64, height as f64)
                .weigh(&boxes, EdgeRule::MilesLantuejoul)
                .weights;
            into.area += (width * height) as f64;
            into.slices.extend(vec![slice; pieces.len()]);
            into.categories.extend(vec![0; pieces.len()]);
            into.sizes.extend(pieces.iter().map(|piece| piece.size));
            into.weights.extend(weights);
        }
    }

    /// The section law of the grains that do not touch the box, on all planes along the axes.
    fn section_law(&self) -> GrainLaw {
        let labels = usize::from(self.values.iter().copied().max().unwrap_or(0)) + 1;
        let (mut sizes, mut volumes, mut cut) = (vec![Vec::new(); labels], vec![0.0; labels], vec![false; labels]);
        for axis in 0..3 {
            let [height, width] = self.slice_shape(axis);
            for depth in 0..self.shape[axis] {
                for piece in self.pieces(axis, depth) {
                    let of = usize::from(piece.label);
                    let BoundingBox {
                        left,
                        top,
                        right,
                        bottom,
                    } = piece.around;
                    cut[of] |= depth == 0 || depth + 1 == self.shape[axis];
                    cut[of] |= left < 1.0 || top < 1.0 || right > width as f64 - 1.0 || bottom > height as f64 - 1.0;
                    volumes[of] += PI * piece.size * piece.size / 12.0;
                    sizes[of].push(piece.size);
                }
            }
        }
        let mut law = GrainLaw::default();
        let whole: Vec<usize> = (1..labels).filter(|&of| !cut[of] && !sizes[of].is_empty()).collect();
        let share = 1.0 / whole.len() as f64;
        for of in whole {
            let largest = sizes[of].iter().copied().fold(0.0, f64::max);
            law.relative.extend(sizes[of].iter().map(|size| size / largest));
            law.unit_volume += share * volumes[of] / largest.powi(3);
            law.caliper += share * sizes[of].len() as f64 / 3.0 / largest;
            law.sizes.push(largest);
        }
        law.relative.sort_by(f64::total_cmp);
        law
    }

    /// Middle and least semi-axis relative to the largest: medians over the inertia ellipsoids of the grains that do
    /// not touch the box.
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

/// Semi-axes 1, b^p, c^p of an ellipsoid whose mean width is that of the grains, both relative to the equal-volume
/// diameter. The mean width of the grains is larger than that of their inertia ellipsoids, as they are neither smooth
/// nor convex.
fn with_width([b, c]: [f64; 2], width: f64) -> Result<[f64; 2]> {
    let [mut low, mut high] = [0.0, 6.0];
    for _ in 0..40 {
        let power = 0.5 * (low + high);
        let [b, c]: [f64; 2] = [b.powf(power), c.powf(power)];
        let body = Body::parse(&format!("ellipsoid:1,{b},{c}"))?;
        if body.mean_width() / (6.0 * body.volume() / PI).cbrt() < width {
            low = power;
        } else {
            high = power;
        }
    }
    Ok([b.powf(low), c.powf(low)])
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
    let [number, mean, fraction] = [
        known("NV_per_voxel3_central_guard16")?,
        known("d_eq_mean_central")?,
        known("VV")?,
    ];
    let mut profiles = MeasuredProfiles::default();
    for axis in 0..3 {
        labels.profiles(axis, &mut profiles);
    }
    let law = labels.section_law();
    let [b, c] = labels.axis_ratios();
    let per_volume = (6.0 * law.unit_volume / PI).cbrt();
    let [wide_b, wide_c] = with_width([b, c], law.caliper / per_volume)?;
    let mut text = format!(
        "\nSand, a real CT volume: {} profiles on slices {APART} voxels apart along three axes, Miles-Lantuéjoul weights, against the labels of the volume (sizes as equal-volume \
         diameters; 90 % intervals by resampling slices; the ln evidence compares shapes on the same bins):\n\n| shape | detection limit, voxels | whole grains below it | density / true | mean size / true | \
         volume fraction / true | ln evidence | method |\n|---|---|---|---|---|---|---|---|\n",
        profiles.weights.iter().filter(|weight| **weight > 0.0).count(),
    );
    let bootstrap = Bootstrap {
        resampling: stereology::unfold::Resampling::Slices,
        ..Bootstrap::default()
    };
    let over = |estimate: Estimate, scale: f64| match estimate.interval {
        Some(of) => format!(
            "{:.3} ({:.3} to {:.3})",
            estimate.value * scale,
            of.lower * scale,
            of.upper * scale
        ),
        None => format!("{:.3}", estimate.value * scale),
    };
    let shapes = [
        ("sphere".to_owned(), "sphere".to_owned()),
        (
            format!("ellipsoid:1,{b:.3},{c:.3}, median inertia ellipsoid"),
            format!("ellipsoid:1,{b},{c}"),
        ),
        (
            format!("ellipsoid:1,{wide_b:.3},{wide_c:.3}, with the grains' mean width"),
            format!("ellipsoid:1,{wide_b},{wide_c}"),
        ),
    ];
    for least in LEAST_SIZES {
        // A profile of exactly that size is kept: the detection limit is just below it.
        profiles.min_size = least;
        let unfolding = UnfoldOptions::default().with_bootstrap(bootstrap);
        let mut row = |name: &str, found: &Unfolding, unit_volume: f64| {
            // The size of a particle is that of its largest section; the true sizes are equal-volume diameters.
            let ratio = (6.0 * unit_volume / PI).cbrt();
            writeln!(
                text,
                "| {name} | {:.1} | {} of {} | {} | {} | {} | {:.1} | {} |",
                found.threshold,
                law.sizes.iter().filter(|size| **size < found.threshold).count(),
                law.sizes.len(),
                over(found.total, 1.0 / number),
                over(found.mean_size, ratio / mean),
                over(found.volume_fraction, 1.0 / fraction),
                found.evidence.unwrap_or(f64::NAN),
                found.method.name()
            )
        };
        let mut threshold = least;
        for (name, shape) in &shapes {
            let types = ParticleTypes::parse(&[shape])?;
            let options = DensityOptions {
                unfold: unfolding,
                ..DensityOptions::default()
            };
            let found = unfold_profiles(&profiles, &types, &options, &|_| ControlFlow::Continue(()))?.all;
            threshold = found.threshold;
            row(name, &found, types.unit_bodies()[0].volume())?;
        }
        row(
            "the grains' own section law",
            &by_law(&profiles, &law, unfolding.with_min_size(threshold))?,
            law.unit_volume,
        )?;
    }
    Ok(text)
}

/// Unfolds with the section law of the labelled grains: the error that remains if the shape is known.
fn by_law(profiles: &MeasuredProfiles, law: &GrainLaw, options: UnfoldOptions) -> Result<Unfolding> {
    let largest = profiles.sizes.iter().copied().fold(0.0, f64::max);
    let edges = equal_edges(largest, DensityOptions::default().bins);
    let threshold = options.min_size.unwrap_or(0.0);
    let spheres = ParticleTypes::parse(&["sphere"])?;
    let smallest = profiles.sizes.iter().copied().fold(largest, f64::min);
    let bins = spheres.unfolding_bins(&edges, smallest, threshold, largest, options.method, Sizes::Integrated);
    let up_to = |x: f64| law.relative.partition_point(|of| *of <= x) as f64 / law.relative.len() as f64;
    let sizes = SizeBins::integrated(&bins.size_edges)?.reported_in(&edges)?;
    let kernel = capped_kernel(&up_to, law.caliper, 0.0, &bins.profile_edges, sizes, law.unit_volume)?;
    let counts = ProfileCounts::from_slices(
        &profiles.sizes,
        Some(&profiles.weights),
        &profiles.slices,
        &bins.profile_edges,
        profiles.area,
    )?;
    Ok(unfold(&counts, &kernel, &options)?)
}
