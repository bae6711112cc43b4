//! The section law of any body: exact in depth, low-discrepancy directions, an error bar from random rotations.

use crate::depth_measure::{DepthMeasure, Moments};
use crate::directions::half_sphere;
use crate::distribution::{Distribution, Table};
use crate::section_law::{Calipers, SectionLaw, standard_error};
use crate::sweep::{Surface, Sweep};
use nalgebra::UnitQuaternion;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use stereology_shape::{Body, BodyKind, ClosedMesh, isotropic_rotation};

/// Called with the share done, from any thread; `Break` cancels.
pub type Progress<'a> = &'a (dyn Fn(f64) -> ControlFlow<()> + Sync);

/// How much work a section law is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Effort {
    /// Until the largest standard error of the matrix is at most this.
    Tolerance(f64),
    /// About this many directions in all: at least one a rotation.
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
    /// Bins of the matrix whose standard error the tolerance is for.
    pub bins: usize,
    /// Random rotations of the directions; fewer than 32 make the standard error itself uncertain.
    pub rotations: usize,
    /// Cells of the table that holds F.
    pub cells: usize,
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
            cells: crate::section_law::DEFAULT_CELLS,
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
        /// What there is too little of.
        what: &'static str,
        /// How many were asked for.
        given: usize,
        /// How many it takes.
        least: usize,
    },
    /// The tolerance was not reached with the largest number of directions.
    #[error(
        "a standard error of {reached} after {directions} directions, {asked} was asked for: ask for a larger tolerance"
    )]
    NotReached {
        /// The standard error that was reached.
        reached: f64,
        /// The tolerance.
        asked: f64,
        /// Directions used.
        directions: usize,
    },
    /// The body shows no section, so there is nothing to count.
    #[error("no plane that was tried cuts the body: its volume is too small for its extent")]
    NoSections,
    /// The caller broke off.
    #[error("cancelled")]
    Cancelled,
}

/// Directions beyond which a tolerance counts as out of reach.
const MOST_DIRECTIONS: usize = 1 << 22;

impl SectionLaw {
    /// The section law of any body: closed form for spheres and ellipsoids, exact in depth for meshes.
    ///
    /// For a mesh and a direction, the measure of depths that show a profile of each size is computed exactly by a sweep over the sorted
    /// vertices; only the mean over directions is left. It is taken over a Fibonacci lattice, once for each of
    /// [`SectionOptions::rotations`] random rotations, whose spread gives the standard error. With a tolerance, lattices grow until the
    /// error is within it. Cost of a direction: V log V + T, plus the length of the contours at every saddle.
    ///
    /// Same bits for same options, at any number of threads. Several disjoint bodies in one mesh are one particle that shows several profiles.
    ///
    /// # Errors
    ///
    /// [`SectionLawError`] for options that make no sense or a tolerance out of reach.
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

    /// [`of_body`](Self::of_body) that tells how far it is and can be cancelled.
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
    if options.cells < 16 {
        return too_few("cells of the table", options.cells, 16);
    }
    if options.bins == 0 {
        too_few("bins", 0, 1)
    } else {
        Ok(())
    }
}

/// What one set of directions, or one batch of random sections, saw: means over directions of lengths of offsets.
pub(crate) struct Sample {
    /// Offsets with a profile up to each node's area.
    pub(crate) below: Vec<f64>,
    pub(crate) moments: Moments,
}

fn of_mesh(
    body: &Body,
    mesh: &ClosedMesh,
    options: &SectionOptions,
    progress: Progress<'_>,
) -> Result<SectionLaw, SectionLawError> {
    let surface = Surface::new(mesh);
    let max_area = body.largest_section_area() / (surface.reach * surface.reach);
    let bounds: Vec<f64> = Table::equal_angles(options.cells)
        .iter()
        .map(|theta| max_area * theta.sin().powi(2))
        .collect();
    let sample = |rotation: usize, count: usize| {
        let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
        rng.set_stream(rotation as u64);
        let turn: UnitQuaternion<f64> = isotropic_rotation(&mut rng);
        let mut sweep = Sweep::default();
        let mut measure = DepthMeasure::new(bounds.clone());
        for direction in half_sphere(count) {
            sweep.run(&surface, &(turn * direction), &mut measure);
        }
        Sample::mean(&measure, count as f64)
    };
    let run = |count: usize, expected: f64| -> Result<Vec<Sample>, SectionLawError> {
        let done = AtomicUsize::new(0);
        (0..options.rotations)
            .into_par_iter()
            .map(|rotation| {
                let sample = sample(rotation, count);
                let share = (done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / options.rotations as f64;
                if progress(share * expected).is_break() {
                    Err(SectionLawError::Cancelled)
                } else {
                    Ok(sample)
                }
            })
            .collect()
    };
    let finish = |samples: &[Sample], count: usize| {
        let mean = |of: fn(&Moments) -> f64| {
            samples.iter().map(|sample| of(&sample.moments)).sum::<f64>() / samples.len() as f64
        };
        let error = |of: fn(&Moments) -> f64| standard_error(samples.iter().map(|sample| of(&sample.moments)));
        let chi = body.signed_mean_width();
        let lengths = Calipers {
            hull: body.mean_width(),
            chi,
            effective: chi + mean(|moments| moments.holes) * surface.reach,
            effective_error: error(|moments| moments.holes) * surface.reach,
        };
        let apart = (mean(|moments| moments.profiles - moments.holes) - chi / surface.reach).abs();
        // Heights are rounded to 2^-26 of the reach.
        let chi_discrepancy = apart / error(|moments| moments.profiles - moments.holes).max(1e-7);
        let area_unit = surface.reach * surface.reach;
        let law = SectionLaw::from_samples(body, samples, lengths, area_unit, count * options.rotations)?;
        Ok(SectionLaw { chi_discrepancy, ..law })
    };
    match options.effort {
        Effort::Directions(directions) => {
            let count = directions.div_ceil(options.rotations);
            finish(&run(count, 1.0)?, count)
        }
        Effort::Tolerance(tolerance) => {
            let mut count = 4;
            let mut expected = 0.1;
            loop {
                let law = finish(&run(count, expected)?, count)?;
                let reached = law.standard_error(options.bins);
                if reached <= tolerance {
                    return Ok(law);
                }
                // Errors fall like the -3/4 power of the directions for bodies with faces, faster for smooth ones.
                let growth = (1.2 * (reached / tolerance).powf(4.0 / 3.0)).clamp(1.5, 16.0);
                expected = if growth < 16.0 { 0.9 } else { 0.3 };
                count = next_count(count, growth);
                if count * options.rotations > MOST_DIRECTIONS {
                    let directions = law.directions();
                    return Err(SectionLawError::NotReached {
                        reached,
                        asked: tolerance,
                        directions,
                    });
                }
            }
        }
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A positive number far below 2^53.
fn next_count(count: usize, growth: f64) -> usize {
    (count as f64 * growth).ceil() as usize
}

impl Sample {
    pub(crate) fn mean(measure: &DepthMeasure, count: f64) -> Self {
        let moments = measure.moments;
        Self {
            below: measure.cumulative().iter().map(|length| length / count).collect(),
            moments: Moments {
                profiles: moments.profiles / count,
                holes: moments.holes / count,
                area: moments.area / count,
                largest: moments.largest,
            },
        }
    }
}

impl SectionLaw {
    /// A law from samples on equal angles; areas of the samples are in units of `area_unit`.
    pub(crate) fn from_samples(
        body: &Body,
        samples: &[Sample],
        lengths: Calipers,
        area_unit: f64,
        directions: usize,
    ) -> Result<Self, SectionLawError> {
        let angles = Table::equal_angles(samples.first().map_or(1, |sample| sample.below.len() - 1));
        let mut tables = Vec::with_capacity(samples.len());
        for sample in samples {
            let whole = sample.below[sample.below.len() - 1];
            if whole.is_nan() || whole <= 0.0 {
                return Err(SectionLawError::NoSections);
            }
            let mut highest = 0.0_f64;
            // Sums of lengths do not decrease but for rounding.
            let values = sample.below.iter().map(|below| {
                highest = highest.max(below / whole);
                highest
            });
            let mut values: Vec<f64> = values.collect();
            values[0] = 0.0;
            let last = values.len() - 1;
            values[last] = 1.0;
            tables.push(Table::new(angles.clone(), values));
        }
        Ok(Self {
            distribution: Distribution::Table(Table::mean(&tables)),
            samples: tables,
            lengths,
            max_area: body.largest_section_area(),
            largest_met: samples.iter().map(|sample| sample.moments.largest).fold(0.0, f64::max) * area_unit,
            volume: body.volume(),
            surface_area: body.surface_area(),
            directions,
            chi_discrepancy: 0.0,
        })
    }
}
