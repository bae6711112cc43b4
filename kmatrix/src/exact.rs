//! The section law of any body: exact over depth, low-discrepancy directions, standard error from random rotations.

use crate::depth_measure::{DepthMeasure, Moments};
use crate::directions::half_sphere;
use crate::distribution::{Distribution, Table};
use crate::plane::Surface;
use crate::sample::Sample;
use crate::section_law::{Calipers, DEFAULT_CELLS, SectionLaw, Squares, standard_error};
use crate::sweep::Sweep;
use nalgebra::UnitQuaternion;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::f64::consts::FRAC_PI_2;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use stereology_metrics::Progress;
use stereology_shape::{Body, BodyKind, ClosedMesh, isotropic_rotation};

/// When the computation of a section law ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Effort {
    /// Until the largest standard error of the matrix is at most this.
    Tolerance(f64),
    /// About this many directions in total, at least one per rotation.
    Directions(usize),
}

/// Options of [`SectionLaw::of_body`].
///
/// ```
/// use stereology_kmatrix::{Effort, SectionOptions};
/// let options = SectionOptions::default().with_tolerance(1e-3);
/// assert_eq!(options.effort, Effort::Tolerance(1e-3));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionOptions {
    /// Tolerance or number of directions.
    pub effort: Effort,
    /// Number of bins of the matrix whose standard error the tolerance applies to.
    pub bins: usize,
    /// Random rotations of the directions; fewer than 32 make the standard error itself uncertain.
    pub rotations: usize,
    /// Cells of the table of F, besides the nodes that make the matrix of `bins` bins exact; `None`: as many as the
    /// effort requires.
    pub cells: Option<usize>,
    /// Seed of the rotations.
    pub seed: u64,
}

impl Default for SectionOptions {
    /// Standard error 0.001 of a matrix of 10 bins, from 32 rotations.
    fn default() -> Self {
        Self {
            effort: Effort::Tolerance(1e-3),
            bins: 10,
            rotations: 32,
            cells: None,
            seed: 0,
        }
    }
}

impl SectionOptions {
    /// Until the largest standard error of the matrix is at most this.
    #[must_use]
    pub const fn with_tolerance(mut self, tolerance: f64) -> Self {
        self.effort = Effort::Tolerance(tolerance);
        self
    }

    /// With about this many directions.
    #[must_use]
    pub const fn with_directions(mut self, directions: usize) -> Self {
        self.effort = Effort::Directions(directions);
        self
    }

    /// With the tolerance for a matrix of this many bins.
    #[must_use]
    pub const fn with_bins(mut self, bins: usize) -> Self {
        self.bins = bins;
        self
    }

    /// With this seed.
    #[must_use]
    pub const fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }
}

/// Why a section law was not computed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SectionLawError {
    /// A tolerance that is not positive.
    #[error("the tolerance {0} must be positive")]
    Tolerance(f64),
    /// Too few directions, rotations, sections or cells.
    #[error("{what}: {given} given, at least {least} needed")]
    TooFew {
        /// The quantity.
        what: &'static str,
        /// Requested number.
        given: usize,
        /// Smallest possible number.
        least: usize,
    },
    /// Too many of something.
    #[error("{what}: {given} given, at most {most} can be handled")]
    TooMany {
        /// The quantity.
        what: &'static str,
        /// Requested number.
        given: usize,
        /// Largest possible number.
        most: usize,
    },
    /// The tolerance was not reached with the largest number of directions.
    #[error(
        "the standard error is {reached} after {directions} directions, but {asked} was requested: use a larger tolerance"
    )]
    NotReached {
        /// The standard error that was reached.
        reached: f64,
        /// The tolerance.
        asked: f64,
        /// Directions used.
        directions: usize,
    },
    /// No sampled plane cuts the body.
    #[error("no sampled plane cuts the body: its volume is too small for its extent")]
    NoSections,
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled,
}

/// A tolerance that needs more directions than this is out of reach.
const MOST_DIRECTIONS: f64 = 4e6;

impl SectionLaw {
    /// The section law of any body: closed form for spheres and ellipsoids, exact over depth for meshes.
    ///
    /// For a mesh and a direction, a sweep over the sorted vertices computes exactly the length of the depths that show
    /// a profile of each size. Only the mean over directions is estimated. It is taken over a Fibonacci lattice, once
    /// for each of [`SectionOptions::rotations`] random rotations, whose spread gives the standard error. With a
    /// tolerance, lattices grow until the error is within it. Complexity per direction: V log V + T for V vertices and
    /// T triangles, plus the length of the contours at every saddle.
    ///
    /// The same options give the same bits at any number of threads. Several disjoint bodies in one mesh are one
    /// particle with several profiles.
    ///
    /// # Errors
    ///
    /// [`SectionLawError`] for invalid options or a tolerance out of reach.
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_kmatrix::{SectionLaw, SectionOptions};
    /// use stereology_shape::Body;
    ///
    /// let brick = SectionLaw::of_body(&Body::cuboid([1.0, 2.0, 3.0])?, &SectionOptions::default().with_directions(1024))?;
    /// assert!((brick.caliper_effective() - 3.0).abs() < 1e-9); // (1 + 2 + 3) / 2
    /// assert!(brick.standard_error(10) < 0.003);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of_body(body: &Body, options: &SectionOptions) -> Result<Self, SectionLawError> {
        Self::of_body_with_progress(body, options, &|_| ControlFlow::Continue(()))
    }

    /// [`of_body`](Self::of_body) with progress and cancellation.
    ///
    /// # Errors
    ///
    /// As [`of_body`](Self::of_body), and [`SectionLawError::Cancelled`].
    pub fn of_body_with_progress(
        body: &Body,
        options: &SectionOptions,
        progress: Progress<'_>,
    ) -> Result<Self, SectionLawError> {
        check(options)?;
        match body.kind() {
            BodyKind::Mesh(mesh) => of_mesh(body, mesh, options, progress),
            BodyKind::Ellipsoid { semi_axes } => Ok(Self::ellipsoid_of(body, semi_axes)),
            _ => Ok(Self::sphere_of(body)),
        }
    }
}

fn check(options: &SectionOptions) -> Result<(), SectionLawError> {
    let too_few = |what, given, least| Err(SectionLawError::TooFew { what, given, least });
    match options.effort {
        Effort::Tolerance(tolerance) if tolerance.is_nan() || tolerance <= 0.0 => {
            return Err(SectionLawError::Tolerance(tolerance));
        }
        Effort::Directions(0) => return too_few("directions", 0, 1),
        _ => {}
    }
    if options.rotations < 2 {
        return too_few("random rotations", options.rotations, 2);
    }
    if let Some(cells @ ..16) = options.cells {
        return too_few("cells of the table", cells, 16);
    }
    if options.bins == 0 {
        too_few("bins", 0, 1)
    } else {
        Ok(())
    }
}

/// Number of cells of the table of F.
fn cells(options: &SectionOptions) -> usize {
    options.cells.unwrap_or(match options.effort {
        Effort::Tolerance(tolerance) if tolerance >= 3e-3 => 64,
        Effort::Tolerance(tolerance) if tolerance >= 5e-4 => 256,
        _ => DEFAULT_CELLS,
    })
}

/// What all directions of a mesh share.
struct Task<'a> {
    body: &'a Body,
    surface: Surface<'a>,
    nodes: Nodes,
    bounds: Vec<f64>,
    options: &'a SectionOptions,
}

fn of_mesh(
    body: &Body,
    mesh: &ClosedMesh,
    options: &SectionOptions,
    progress: Progress<'_>,
) -> Result<SectionLaw, SectionLawError> {
    let surface = Surface::new(mesh);
    let max_area = body.largest_section_area() / (surface.reach * surface.reach);
    let nodes = Nodes::new(cells(options), options.bins);
    let task = Task {
        bounds: nodes
            .angles
            .iter()
            .map(|theta| max_area * theta.sin().powi(2))
            .collect(),
        body,
        surface,
        nodes,
        options,
    };
    match options.effort {
        Effort::Directions(directions) => {
            let count = directions.div_ceil(options.rotations);
            task.law(&task.samples(0, count, 1.0, progress)?, count)
        }
        Effort::Tolerance(tolerance) => task.within(tolerance, progress),
    }
}

impl Task<'_> {
    /// Enlarges the lattices until the error of the matrix is within the tolerance.
    fn within(&self, tolerance: f64, progress: Progress<'_>) -> Result<SectionLaw, SectionLawError> {
        let rotations = self.options.rotations;
        let (mut pass, mut count, mut expected) = (0, 8, 0.1);
        loop {
            // New rotations every time, so that rotations that agree by chance are not used again.
            let samples = self.samples(pass, count, expected, progress)?;
            let reached = self.nodes.largest_error(&samples);
            if reached <= tolerance {
                return self.law(&samples, count);
            }
            // The error is about inversely proportional to the number of directions for bodies with faces, and
            // decreases faster for smooth ones.
            let growth = (1.15 * reached / tolerance).powf(1.1);
            let needed = growth * (count * rotations) as f64;
            if needed.is_nan() || needed > MOST_DIRECTIONS {
                return Err(SectionLawError::NotReached {
                    reached,
                    asked: tolerance,
                    directions: count * rotations,
                });
            }
            expected = if growth < 16.0 { 0.9 } else { 0.3 };
            count = next_count(count, growth.clamp(1.3, 16.0));
            pass += 1;
        }
    }

    /// One sample per rotation, each over `count` directions.
    fn samples(
        &self,
        pass: u64,
        count: usize,
        expected: f64,
        progress: Progress<'_>,
    ) -> Result<Vec<Sample>, SectionLawError> {
        let rotations = self.options.rotations;
        let done = AtomicUsize::new(0);
        (0..rotations)
            .into_par_iter()
            .map_init(
                || Sweep::new(&self.surface),
                |sweep, rotation| {
                    let sample = self.sample(sweep, pass << 32 | rotation as u64, count, &|share| {
                        progress(expected * (done.load(Ordering::Relaxed) as f64 + share) / rotations as f64)
                    })?;
                    done.fetch_add(1, Ordering::Relaxed);
                    Ok(sample)
                },
            )
            .collect()
    }

    fn sample(
        &self,
        sweep: &mut Sweep<'_>,
        stream: u64,
        count: usize,
        progress: &dyn Fn(f64) -> ControlFlow<()>,
    ) -> Result<Sample, SectionLawError> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.options.seed);
        rng.set_stream(stream);
        let turn: UnitQuaternion<f64> = isotropic_rotation(&mut rng);
        let mut measure = DepthMeasure::new(self.bounds.clone());
        for (k, direction) in half_sphere(count).enumerate() {
            if k % 64 == 0 && progress(k as f64 / count as f64).is_break() {
                return Err(SectionLawError::Cancelled);
            }
            sweep.run(&(turn * direction), &mut measure);
        }
        Ok(Sample::mean(&measure, count as f64))
    }

    fn law(&self, samples: &[Sample], count: usize) -> Result<SectionLaw, SectionLawError> {
        let mean = |of: fn(&Moments) -> f64| {
            samples.iter().map(|sample| of(&sample.moments)).sum::<f64>() / samples.len() as f64
        };
        let error = |of: fn(&Moments) -> f64| standard_error(samples.iter().map(|sample| of(&sample.moments)));
        let (chi, reach) = (self.body.signed_mean_width(), self.surface.reach);
        let lengths = Calipers {
            hull: self.body.mean_width(),
            chi,
            effective: chi + mean(|moments| moments.holes) * reach,
            effective_error: error(|moments| moments.holes) * reach,
        };
        let apart = (mean(|moments| moments.profiles - moments.holes) - chi / reach).abs();
        // Heights are rounded, so counts have a rounding error where edges are level.
        let chi_discrepancy = apart / error(|moments| moments.profiles - moments.holes).max(1e-7);
        let directions = count * self.options.rotations;
        let law = SectionLaw::from_samples(self.body, samples, &self.nodes.angles, lengths, reach, directions)?;
        Ok(SectionLaw { chi_discrepancy, ..law })
    }
}

/// The angles θ = asin x at which F is known. The ratios i / j of a matrix's bins are among them, so that the matrix
/// needs no interpolation.
pub(crate) struct Nodes {
    pub(crate) angles: Vec<f64>,
    bins: usize,
    /// The node of ratio i / j, 1 ≤ i ≤ j, at index (j − 1) j / 2 + i − 1; empty for many bins.
    ratios: Vec<usize>,
}

/// With more bins than this the ratios would need too many nodes.
const MOST_EXACT_BINS: usize = 40;

impl Nodes {
    pub(crate) fn new(cells: usize, bins: usize) -> Self {
        let mut angles = Table::equal_angles(cells);
        let exact = bins <= MOST_EXACT_BINS;
        let ratio = |i: usize, j: usize| {
            if i == j {
                FRAC_PI_2
            } else {
                (i as f64 / j as f64).asin()
            }
        };
        let pairs = || (1..=bins).flat_map(|j| (1..=j).map(move |i| (i, j)));
        if exact {
            angles.extend(pairs().map(|(i, j)| ratio(i, j)));
            angles.sort_by(f64::total_cmp);
            // 2 / 4 and 1 / 2 have the same bits; an equal angle closer than this would make an empty cell.
            angles.dedup_by(|next, last| *next - *last < 1e-9);
            let last = angles.len() - 1;
            angles[last] = FRAC_PI_2;
        }
        let node = |angle: f64| {
            let above = angles.partition_point(|&node| node < angle).min(angles.len() - 1);
            if above > 0 && angle - angles[above - 1] < angles[above] - angle {
                above - 1
            } else {
                above
            }
        };
        let ratios = if exact {
            pairs().map(|(i, j)| node(ratio(i, j))).collect()
        } else {
            Vec::new()
        };
        Self { angles, bins, ratios }
    }

    /// The largest standard error of the matrix.
    fn largest_error(&self, samples: &[Sample]) -> f64 {
        let count = samples.len() as f64;
        let Ok(shares) = Shares::of(samples) else {
            return f64::INFINITY;
        };
        let mut largest = 0.0_f64;
        // Differences of F between two nodes; `None` stands for F(0) = 0.
        let mut spread = |from: Option<usize>, to: usize, scale: f64| {
            let at = |sample: &Sample| {
                shares.of_sample(sample, to) - from.map_or(0.0, |from| shares.of_sample(sample, from))
            };
            let mean = shares.mean[to] - from.map_or(0.0, |from| shares.mean[from]);
            let squares = samples.iter().map(|sample| (at(sample) - mean).powi(2)).sum::<f64>();
            largest = largest.max(scale * scale * squares);
        };
        if self.ratios.is_empty() {
            // Many bins: differences of F over equal steps of x are at most those between nodes at the same distance.
            let table: Vec<usize> = (0..=self.bins)
                .map(|i| {
                    self.angles
                        .partition_point(|&angle| angle < (i as f64 / self.bins as f64).asin())
                })
                .map(|node| node.min(self.angles.len() - 1))
                .collect();
            for pair in table.windows(2) {
                spread(Some(pair[0]), pair[1], 1.0);
            }
        }
        for j in 1..=self.bins {
            let column = j * (j - 1) / 2;
            if self.ratios.is_empty() {
                break;
            }
            let size = j as f64 / self.bins as f64;
            for i in 0..j {
                let from = if i == 0 {
                    None
                } else {
                    Some(self.ratios[column + i - 1])
                };
                spread(from, self.ratios[column + i], size);
            }
        }
        (largest / (count - 1.0) / count).sqrt()
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A positive number far below 2^53.
fn next_count(count: usize, growth: f64) -> usize {
    (count as f64 * growth).ceil() as usize
}

/// F at the nodes: the ratio of sums over all rotations.
///
/// The mean of the ratios of single rotations would have a bias that no number of rotations removes, because with few
/// directions the mean length of the offsets of a rotation is correlated with its profiles. The error of the ratio of
/// sums is only of the order of the product of two standard errors. The deviation of each rotation is given to first
/// order: F + (below − F whole) / mean whole.
struct Shares {
    mean: Vec<f64>,
    whole: f64,
}

impl Shares {
    fn of(samples: &[Sample]) -> Result<Self, SectionLawError> {
        let nodes = samples.first().map_or(0, |sample| sample.below.len());
        let count = samples.len() as f64;
        let below: Vec<f64> = (0..nodes)
            .map(|node| samples.iter().map(|sample| sample.below[node]).sum::<f64>() / count)
            .collect();
        let whole = below.last().copied().unwrap_or(0.0);
        if whole.is_nan() || whole <= 0.0 {
            return Err(SectionLawError::NoSections);
        }
        let mut mean: Vec<f64> = below.iter().map(|below| below / whole).collect();
        // F(0) = 0: a section without area is not a profile.
        mean[0] = 0.0;
        Ok(Self { mean, whole })
    }

    fn of_sample(&self, sample: &Sample, node: usize) -> f64 {
        let mean = self.mean[node];
        if node == 0 {
            return mean;
        }
        let whole = sample.below[sample.below.len() - 1];
        mean + (sample.below[node] - mean * whole) / self.whole
    }
}

impl SectionLaw {
    /// A law from samples at these angles. Lengths of the samples are in units of `unit`.
    pub(crate) fn from_samples(
        body: &Body,
        samples: &[Sample],
        angles: &[f64],
        lengths: Calipers,
        unit: f64,
        directions: usize,
    ) -> Result<Self, SectionLawError> {
        let shares = Shares::of(samples)?;
        let mut highest = 0.0_f64;
        // Sums of lengths decrease only by rounding.
        let values = shares.mean.iter().map(|share| {
            highest = highest.max(*share);
            highest
        });
        let whole = Table::new(angles.to_vec(), values.collect());
        let tables: Vec<Table> = samples
            .iter()
            .map(|sample| {
                Table::new(
                    angles.to_vec(),
                    (0..angles.len()).map(|node| shares.of_sample(sample, node)).collect(),
                )
            })
            .collect();
        Ok(Self {
            distribution: Distribution::Table(whole),
            samples: tables,
            lengths,
            max_area: body.largest_section_area(),
            largest_met: samples.iter().map(|sample| sample.moments.largest).fold(0.0, f64::max) * unit * unit,
            squares: Squares::of(samples, lengths, unit),
            volume: body.volume(),
            surface_area: body.surface_area(),
            directions,
            chi_discrepancy: 0.0,
        })
    }
}
