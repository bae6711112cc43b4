//! The paper's method: random sections one by one, as polygons or pixels (section 3.2). It is slow and simple, and the
//! reference for the exact sweep.

use crate::depth_measure::Moments;
use crate::distribution::Table;
use crate::exact::SectionLawError;
use crate::raster::StencilBuffer;
use crate::sample::Sample;
use crate::section_law::{Calipers, DEFAULT_CELLS, SectionLaw, standard_error};
use nalgebra::{Point3, UnitVector3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, UnitSphere};
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use stereology_metrics::Progress;
use stereology_shape::{Body, BodyKind, TriangleMesh};

/// Which area counts as the largest, A_max.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LargestArea {
    /// The body's largest section, found by maximisation.
    #[default]
    OfBody,
    /// The largest area among the random sections, as in the paper: always too small (by 1.8 % for a cube after 10,000
    /// sections).
    Encountered,
}

/// How a random section is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Slicing {
    /// Exact polygons.
    #[default]
    Polygons,
    /// The paper's method: the surface beyond the plane is drawn into a square image that contains the whole body.
    /// Pixels drawn an odd number of times are inside, and 4-connected components of such pixels are profiles. Profiles
    /// smaller than a pixel are lost, and profiles close together merge.
    Raster {
        /// Pixels along a side of the image, at least 8.
        resolution: usize,
    },
}

/// Options of [`SectionLaw::monte_carlo`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MonteCarloOptions {
    /// Sections that hit the body; the paper used 100,000.
    pub iterations: usize,
    /// Seed.
    pub seed: u64,
    /// Definition of A_max.
    pub largest: LargestArea,
    /// How a section is measured.
    pub slicing: Slicing,
}

impl Default for MonteCarloOptions {
    /// The paper's 100,000 sections, with the body's A_max.
    fn default() -> Self {
        Self {
            iterations: 100_000,
            seed: 0,
            largest: LargestArea::OfBody,
            slicing: Slicing::Polygons,
        }
    }
}

impl MonteCarloOptions {
    /// With this many sections that hit.
    #[must_use]
    pub const fn with_iterations(mut self, iterations: usize) -> Self {
        self.iterations = iterations;
        self
    }

    /// With this seed.
    #[must_use]
    pub const fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// With sections measured in this way.
    #[must_use]
    pub const fn with_slicing(mut self, slicing: Slicing) -> Self {
        self.slicing = slicing;
        self
    }

    /// With this A_max.
    #[must_use]
    pub const fn with_largest(mut self, largest: LargestArea) -> Self {
        self.largest = largest;
        self
    }
}

/// Batches whose spread gives the standard error.
const BATCHES: usize = 32;
/// The search is given up when more than this number of planes per required hit have been tried.
const PATIENCE: usize = 10_000;

/// The sections of one batch of random planes.
struct Batch {
    areas: Vec<f64>,
    hits: usize,
    planes: usize,
    /// Σ (area of the whole section)².
    total_squared: f64,
}

impl SectionLaw {
    /// The law from isotropic uniform random sections: random direction, random offset within the body's bounding
    /// sphere; planes that miss are drawn again; every disjoint profile counts.
    ///
    /// Offsets are uniform over the same length for every direction. Offsets uniform within the body's own extent would
    /// not be isotropic uniform random: wide directions must count more, otherwise the last column of K is wrong by
    /// 0.03 to 0.08. [`caliper_hull`](Self::caliper_hull) and [`caliper_effective`](Self::caliper_effective) come from
    /// the same loop. Complexity: iterations × triangles.
    ///
    /// # Errors
    ///
    /// [`SectionLawError`] for too few iterations or a body that no plane hits.
    ///
    /// ```
    /// use stereology_kmatrix::{MonteCarloOptions, SectionLaw};
    /// use stereology_shape::Body;
    ///
    /// let law = SectionLaw::monte_carlo(&Body::sphere(1.0)?, &MonteCarloOptions::default().with_iterations(20_000))?;
    /// assert!((law.cdf(0.6) - 0.2).abs() < 0.02); // 1 - sqrt(1 - 0.6²)
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn monte_carlo(body: &Body, options: &MonteCarloOptions) -> Result<Self, SectionLawError> {
        Self::monte_carlo_with_progress(body, options, &|_| ControlFlow::Continue(()))
    }

    /// [`monte_carlo`](Self::monte_carlo) with progress and cancellation.
    ///
    /// # Errors
    ///
    /// As [`monte_carlo`](Self::monte_carlo), and [`SectionLawError::Cancelled`].
    pub fn monte_carlo_with_progress(
        body: &Body,
        options: &MonteCarloOptions,
        progress: Progress<'_>,
    ) -> Result<Self, SectionLawError> {
        if options.iterations < BATCHES {
            return Err(SectionLawError::TooFew {
                what: "random sections",
                given: options.iterations,
                least: BATCHES,
            });
        }
        check_slicing(options.slicing)?;
        let radius = bounding_radius(body);
        let triangles = triangles(body, options.slicing);
        let wanted = options.iterations.div_ceil(BATCHES);
        let done = AtomicUsize::new(0);
        let batches: Vec<Batch> = (0..BATCHES)
            .into_par_iter()
            .map(|task| {
                let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
                rng.set_stream(task as u64);
                let mut slicer = Slicer::new(body, &triangles, radius, options.slicing);
                let batch = draw_planes(&mut slicer, radius, wanted, &mut rng)?;
                let share = (done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / BATCHES as f64;
                if progress(share).is_break() {
                    Err(SectionLawError::Cancelled)
                } else {
                    Ok(batch)
                }
            })
            .collect::<Result<_, _>>()?;

        let met = batches
            .iter()
            .flat_map(|batch| &batch.areas)
            .copied()
            .fold(0.0, f64::max);
        let max_area = match options.largest {
            LargestArea::OfBody => body.largest_section_area(),
            LargestArea::Encountered => met,
        };
        // Offsets are uniform over the diameter of the bounding sphere: a fraction of the planes is that fraction of
        // the diameter.
        let length = |count: usize, batch: &Batch| 2.0 * radius * count as f64 / batch.planes as f64;
        let mean = |of: &dyn Fn(&Batch) -> f64| batches.iter().map(of).sum::<f64>() / BATCHES as f64;
        let profiles = |batch: &Batch| length(batch.areas.len(), batch);
        let lengths = Calipers {
            hull: mean(&|batch| length(batch.hits, batch)),
            chi: body.signed_mean_width(),
            effective: mean(&profiles),
            effective_error: standard_error(batches.iter().map(profiles)),
        };
        let samples: Vec<Sample> = batches
            .iter()
            .map(|batch| count_below(batch, max_area, 2.0 * radius))
            .collect();
        let hits = batches.iter().map(|batch| batch.hits).sum();
        let law = Self::from_samples(body, &samples, &Table::equal_angles(DEFAULT_CELLS), lengths, 1.0, hits)?;
        Ok(Self { max_area, ..law })
    }
}

fn bounding_radius(body: &Body) -> f64 {
    match body.kind() {
        BodyKind::Sphere { diameter } => 0.5 * diameter,
        BodyKind::Ellipsoid { semi_axes: [a, b, c] } => a.max(b).max(c),
        BodyKind::Mesh(mesh) => {
            let centre = mesh.centroid();
            mesh.vertices()
                .iter()
                .map(|vertex| (vertex - centre).norm())
                .fold(0.0, f64::max)
        }
        _ => body.size(),
    }
}

fn check_slicing(slicing: Slicing) -> Result<(), SectionLawError> {
    match slicing {
        Slicing::Raster {
            resolution: given @ ..8,
        } => Err(SectionLawError::TooFew {
            what: "pixels along a side",
            given,
            least: 8,
        }),
        Slicing::Raster {
            resolution: given @ 16_385..,
        } => Err(SectionLawError::TooMany {
            what: "pixels along a side",
            given,
            most: 16_384,
        }),
        _ => Ok(()),
    }
}

/// The triangles to draw; empty for polygons.
fn triangles(body: &Body, slicing: Slicing) -> TriangleMesh {
    match slicing {
        Slicing::Polygons => TriangleMesh::default(),
        Slicing::Raster { .. } => body.to_triangles(5),
    }
}

/// Measures one section after another.
enum Slicer<'a> {
    Polygons(&'a Body),
    Raster(Point3<f64>, StencilBuffer<'a>),
}

impl<'a> Slicer<'a> {
    fn new(body: &'a Body, triangles: &'a TriangleMesh, radius: f64, slicing: Slicing) -> Self {
        match slicing {
            Slicing::Polygons => Self::Polygons(body),
            Slicing::Raster { resolution } => {
                let centre = body.centroid();
                let buffer = StencilBuffer::new(&triangles.vertices, &triangles.triangles, centre, radius, resolution);
                Self::Raster(centre, buffer)
            }
        }
    }

    fn centre(&self) -> Point3<f64> {
        match self {
            Self::Polygons(body) => body.centroid(),
            Self::Raster(centre, _) => *centre,
        }
    }

    fn profile_areas(&mut self, normal: &UnitVector3<f64>, offset: f64) -> Vec<f64> {
        match self {
            Self::Polygons(body) => body.profile_areas(normal, offset),
            Self::Raster(_, buffer) => buffer.profile_areas(normal, offset),
        }
    }
}

/// The paper's histogram after so many random sections, against the law.
#[derive(Clone, Debug, PartialEq)]
pub struct Residual {
    /// Random sections that hit.
    pub iterations: usize,
    /// For each bin of √(A / A_max): the fraction of the profiles counted in it minus that of the law. The paper found
    /// it below 0.005 in every bin within 100,000 iterations.
    pub per_bin: Vec<f64>,
}

/// Sections between two evaluations of the histogram.
const BLOCK: usize = 500;

impl SectionLaw {
    /// Convergence of the paper's histogram of the largest particle's profiles (the last column of K) to this law: its
    /// residual after 500, 1000, ... random sections of `body`.
    ///
    /// # Errors
    ///
    /// As [`monte_carlo`](Self::monte_carlo).
    ///
    /// ```
    /// use stereology_kmatrix::{MonteCarloOptions, SectionLaw};
    /// use stereology_shape::Body;
    ///
    /// let sphere = Body::sphere(1.0)?;
    /// let options = MonteCarloOptions::default().with_iterations(10_000);
    /// let residuals = SectionLaw::sphere(1.0)?.residuals(&sphere, 10, &options)?;
    /// assert!(residuals[19].iterations == 10_000 && residuals[19].per_bin.iter().all(|r| r.abs() < 0.03));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn residuals(
        &self,
        body: &Body,
        bins: usize,
        options: &MonteCarloOptions,
    ) -> Result<Vec<Residual>, SectionLawError> {
        check_slicing(options.slicing)?;
        let radius = bounding_radius(body);
        let triangles = triangles(body, options.slicing);
        let blocks = options.iterations.div_ceil(BLOCK);
        let histograms: Vec<Vec<f64>> = (0..blocks)
            .into_par_iter()
            .map_init(
                || Slicer::new(body, &triangles, radius, options.slicing),
                |slicer, block| {
                    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
                    rng.set_stream(block as u64);
                    let batch = draw_planes(slicer, radius, BLOCK, &mut rng)?;
                    let mut histogram = vec![0.0; bins];
                    for area in batch.areas {
                        let x = (area / self.max_area).sqrt();
                        // Bins are (a, b].
                        let bin = (0..bins)
                            .find(|&i| x <= (i + 1) as f64 / bins as f64)
                            .unwrap_or(bins - 1);
                        histogram[bin] += 1.0;
                    }
                    Ok(histogram)
                },
            )
            .collect::<Result<_, SectionLawError>>()?;
        let exact: Vec<f64> = (0..bins)
            .map(|i| self.cdf((i + 1) as f64 / bins as f64) - self.cdf(i as f64 / bins as f64))
            .collect();
        let mut sum = vec![0.0; bins];
        let residuals = histograms.iter().enumerate().map(|(block, histogram)| {
            sum.iter_mut().zip(histogram).for_each(|(sum, count)| *sum += count);
            let whole: f64 = sum.iter().sum();
            Residual {
                iterations: (block + 1) * BLOCK,
                per_bin: sum
                    .iter()
                    .zip(&exact)
                    .map(|(count, exact)| count / whole - exact)
                    .collect(),
            }
        });
        Ok(residuals.collect())
    }
}

fn draw_planes(
    slicer: &mut Slicer<'_>,
    radius: f64,
    wanted: usize,
    rng: &mut ChaCha8Rng,
) -> Result<Batch, SectionLawError> {
    let centre = slicer.centre();
    let mut batch = Batch {
        areas: Vec::with_capacity(wanted),
        hits: 0,
        planes: 0,
        total_squared: 0.0,
    };
    // The loop ends at one hit more than required, which is not counted: stopping at a counted hit would make hits seem
    // more frequent than they are.
    loop {
        if batch.planes > PATIENCE * wanted {
            return Err(SectionLawError::NoSections);
        }
        let normal = UnitVector3::new_normalize(Vector3::from(UnitSphere.sample(rng)));
        let offset = centre.coords.dot(&normal) + radius * (2.0 * rng.random::<f64>() - 1.0);
        let areas = slicer.profile_areas(&normal, offset);
        if batch.hits == wanted && !areas.is_empty() {
            return Ok(batch);
        }
        batch.planes += 1;
        batch.total_squared += areas.iter().sum::<f64>().powi(2);
        batch.hits += usize::from(!areas.is_empty());
        batch.areas.extend(areas);
    }
}

/// The length of the offsets with a profile up to the area of every node.
fn count_below(batch: &Batch, max_area: f64, span: f64) -> Sample {
    let mut areas = batch.areas.clone();
    areas.sort_by(f64::total_cmp);
    let unit = span / batch.planes as f64;
    let mut below: Vec<f64> = Table::equal_angles(DEFAULT_CELLS)
        .iter()
        .map(|theta| areas.partition_point(|&area| area <= max_area * theta.sin().powi(2)) as f64 * unit)
        .collect();
    let last = below.len() - 1;
    below[last] = areas.len() as f64 * unit;
    let moments = Moments {
        profiles: areas.len() as f64 * unit,
        holes: 0.0,
        area: areas.iter().sum::<f64>() * unit,
        area_squared: areas.iter().map(|area| area * area).sum::<f64>() * unit,
        total_squared: batch.total_squared * unit,
        largest: areas.last().copied().unwrap_or(0.0),
    };
    Sample { below, moments }
}
