//! The whole chain: from a photograph to a solid, with a verdict on whether to trust it.

use crate::pipeline::colouring::{ColourSample, particle_colours};
use crate::pipeline::digest::Digest;
use crate::pipeline::finished::{Finished, packing_inputs, texture_inputs};
use crate::pipeline::narrowing::single;
use crate::pipeline::{
    DensityError, DensityOptions, Evidence, Extent, FineDetails, MeasuredProfiles, ParticleDensities, ParticleTypes,
    Population, PopulationFailure, Recipe, ResidualSpectra, ShapeDensity, Verdict, Verification, VerificationError,
    densities_by_shape, fine_details, population, residual_spectra, unfold_profiles, verify,
};
use image::RgbImage;
use ndarray::Array2;
use std::ops::ControlFlow;
use stereology_anneal::{PackError, PackOptions, Packing, pack, populate};
use stereology_metrics::Finding;
use stereology_pyramid::{TextureError, TextureOptions};
use stereology_segment::{SegmentError, SegmentOptions, Segmentation, segment};
use stereology_shape::{Arrangement, ArrangementError};
use stereology_unfold::UnfoldError;
use stereology_volume::{Solid, SolidError};

/// A step of the chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Step {
    /// Segmentation of the photograph.
    Segment,
    /// Unfolding of the profiles.
    Unfold,
    /// Packing of the particles.
    Pack,
    /// Synthesis of the residual volume.
    Texture,
    /// Comparison of sections of the solid with the photograph.
    Verify,
}

impl Step {
    /// Name of the step in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Segment => "segment",
            Self::Unfold => "unfold",
            Self::Pack => "pack",
            Self::Texture => "texture",
            Self::Verify => "verify",
        }
    }
}

/// Options of [`synthesize`].
#[derive(Clone, Debug)]
pub struct SynthesisOptions {
    /// Size of a pixel: the unit of all lengths below and of the results.
    pub pixel: f64,
    /// Segmentation; areas in pixels.
    pub segment: SegmentOptions,
    /// Unfolding.
    pub densities: DensityOptions,
    /// Size of the solid.
    pub extent: Extent,
    /// Volume fraction of particles; by default the photograph's area fraction.
    pub fraction: Option<f64>,
    /// Particle types, by index, that are voids.
    pub voids: Vec<usize>,
    /// Packing.
    pub pack: PackOptions,
    /// The residual volume.
    pub texture: TextureOptions,
    /// Side of the residual volume in voxels, each as large as a pixel.
    pub texture_voxels: usize,
    /// Seed: the same seed gives the same bits.
    pub seed: u64,
}

impl Default for SynthesisOptions {
    /// Lengths in pixels, a residual volume of 128³ voxels, and the defaults of every step.
    fn default() -> Self {
        Self {
            pixel: 1.0,
            segment: SegmentOptions::default(),
            densities: DensityOptions::default(),
            extent: Extent::default(),
            fraction: None,
            voids: Vec::new(),
            pack: PackOptions::default(),
            texture: TextureOptions::default(),
            texture_voxels: 128,
            seed: 0,
        }
    }
}

/// A solid, and the results of all steps.
#[derive(Clone, Debug)]
pub struct Synthesis {
    /// The profiles of the photograph.
    pub segmentation: Segmentation,
    /// The same profiles in the unit of length, as they were unfolded.
    pub profiles: MeasuredProfiles,
    /// Particles per volume.
    pub densities: ParticleDensities,
    /// The particles that were packed, and their number.
    pub population: Population,
    /// Their packing, with its certificate.
    pub packing: Packing,
    /// The residual volumes.
    pub details: FineDetails,
    /// The solid.
    pub solid: Solid,
    /// Its sections, compared with the photograph.
    pub verification: Verification,
    /// Particles per volume under several shapes.
    pub by_shape: Vec<ShapeDensity>,
    /// Power spectra of the residual in photograph and sections; `None` if either is too small or all outlines.
    pub spectra: Option<ResidualSpectra>,
    /// Whether to trust the result.
    pub verdict: Verdict,
    /// Remarks of all steps, in their order.
    pub findings: Vec<Finding>,
    /// Digest of what the packing was made of.
    pub packing_inputs: Digest,
    /// Digest of what the residual volumes were made of.
    pub texture_inputs: Digest,
    /// Steps of an earlier run that were taken up.
    pub taken_up: Vec<Step>,
}

/// Why a solid could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SynthesisError {
    /// Segmentation.
    #[error(transparent)]
    Segment(#[from] SegmentError),
    /// Unfolding.
    #[error(transparent)]
    Densities(#[from] DensityError),
    /// Population of the box.
    #[error(transparent)]
    Population(#[from] PopulationFailure),
    /// Arrangement of the particles.
    #[error(transparent)]
    Arrangement(#[from] ArrangementError),
    /// Packing.
    #[error(transparent)]
    Pack(#[from] PackError),
    /// Residual volume.
    #[error(transparent)]
    Texture(#[from] TextureError),
    /// Assembly of the solid.
    #[error(transparent)]
    Solid(#[from] SolidError),
    /// Comparison with the photograph.
    #[error(transparent)]
    Verification(#[from] VerificationError),
    /// An invalid size of a pixel.
    #[error("the size of a pixel is {0}: it must be positive and finite")]
    Pixel(f64),
}

impl SynthesisError {
    /// Whether the caller cancelled.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        matches!(
            self,
            Self::Segment(SegmentError::Cancelled)
                | Self::Densities(DensityError::Unfold(UnfoldError::Cancelled))
                | Self::Pack(PackError::Cancelled)
                | Self::Texture(TextureError::Cancelled)
                | Self::Verification(VerificationError::Cancelled)
        )
    }
}

/// Makes the solid of a photograph. Its profiles are segmented, or taken from a label map (y, x).
///
/// `progress` receives the step and the completed fraction of it, and may cancel. Memory: some hundred bytes per pixel
/// and per voxel of the residual volume.
///
/// # Errors
///
/// [`SynthesisError`] of the step that failed.
///
/// # Examples
///
/// ```
/// use image::{Rgb, RgbImage};
/// use ndarray::Array2;
/// use std::ops::ControlFlow;
/// use stereology::pipeline::{Extent, ParticleTypes, SynthesisOptions, synthesize};
///
/// // A synthetic test image of 25 brick discs in a pale binder.
/// let disc = |x: u32, y: u32| (x % 40).abs_diff(20).pow(2) + (y % 40).abs_diff(20).pow(2) < (6 + (x / 40 + y / 40)).pow(2);
/// let photo = RgbImage::from_fn(200, 200, |x, y| if disc(x, y) { Rgb([170, 70, 50]) } else { Rgb([225, 220, 210]) });
/// let labels = Array2::from_shape_fn((200, 200), |(y, x)| if disc(x as u32, y as u32) { (1 + x / 40 + 5 * (y / 40)) as u32 } else { 0 });
/// // Without the label map the profiles are segmented.
/// let options = SynthesisOptions { extent: Extent::Count(300), texture_voxels: 16, ..SynthesisOptions::default() };
/// let made = synthesize(&photo, Some(labels), &ParticleTypes::parse(&["sphere"])?, &options, &|_, _| ControlFlow::Continue(()))?;
/// let sections = made.verification.exact;
/// assert!((sections.area_fraction_synthetic / sections.area_fraction_photo - 1.0).abs() < 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # References
///
/// Jagnow, Dorsey & Rushmeier 2004, sections 3 and 4.
pub fn synthesize(
    photo: &RgbImage,
    labels: Option<Array2<u32>>,
    types: &ParticleTypes,
    options: &SynthesisOptions,
    progress: &(dyn Fn(Step, f64) -> ControlFlow<()> + Sync),
) -> Result<Synthesis, SynthesisError> {
    synthesize_from(photo, labels, types, options, &Finished::default(), progress)
}

/// [`synthesize`], which takes up the packing and the residual volume of an earlier run if they were made of the same
/// inputs with the same options. The result is the same, bit for bit.
///
/// # Errors
///
/// As [`synthesize`].
pub fn synthesize_from(
    photo: &RgbImage,
    labels: Option<Array2<u32>>,
    types: &ParticleTypes,
    options: &SynthesisOptions,
    finished: &Finished,
    progress: &(dyn Fn(Step, f64) -> ControlFlow<()> + Sync),
) -> Result<Synthesis, SynthesisError> {
    if !(options.pixel.is_finite() && options.pixel > 0.0) {
        return Err(SynthesisError::Pixel(options.pixel));
    }
    let recipe = match labels {
        Some(_) => Recipe::Labelled(&options.segment),
        None => Recipe::Segmented(&options.segment),
    };
    let segmentation = match labels {
        Some(labels) => Segmentation::from_labels(photo, labels, &options.segment)?,
        None => segment(photo, &options.segment, &|done| progress(Step::Segment, done))?,
    };
    let profiles = measured_profiles(&segmentation, options.pixel);
    let densities = unfold_profiles(&profiles, types, &options.densities, &|done| {
        progress(Step::Unfold, done)
    })?;
    let fraction = options.fraction.unwrap_or(segmentation.area_fraction);
    let texture_period = options.texture_voxels as f64 * options.pixel;
    // With the fractions of the fit.
    let types = &densities.types;
    let population = population(
        &densities,
        types,
        fraction,
        options.extent,
        texture_period,
        options.seed,
    )?;
    let start = Arrangement::new(
        types.unit_bodies(),
        populate(&population.grains, &population.period, options.seed),
        population.period,
    )?;
    let mut taken_up = Vec::new();
    let packing_inputs = packing_inputs(&start, types, &options.pack);
    let packing = match finished
        .packing
        .as_ref()
        .and_then(|of| of.packing(&packing_inputs, &start))
    {
        Some(packing) => {
            taken_up.push(Step::Pack);
            packing
        }
        None => pack(&start, &options.pack, &|done| progress(Step::Pack, done))?,
    };
    let texture_inputs = texture_inputs(&segmentation, options.pixel, options.texture_voxels, &options.texture);
    let details = match finished.texture.as_ref().filter(|of| of.inputs == texture_inputs) {
        Some(of) => {
            taken_up.push(Step::Texture);
            of.details.clone()
        }
        None => fine_details(
            &segmentation,
            &segmentation.residual(),
            options.texture_voxels,
            options.pixel,
            &options.texture,
            &|done| progress(Step::Texture, done),
        )?,
    };
    let solid = Solid::new(
        packing.arrangement().clone(),
        particle_colours(
            packing.particles(),
            &colour_samples(&segmentation, options.pixel),
            options.seed,
        ),
        segmentation.binder.colour.map(single),
        Some(details.residual.clone()),
    )?
    .with_voids(&options.voids)?;
    let verification = verify(&solid, &segmentation, &profiles, recipe, options.pixel, &|done| {
        progress(Step::Verify, done)
    })?;
    let mut findings: Vec<Finding> = segmentation
        .findings
        .iter()
        .map(|finding| Finding::new(finding.code, finding.message.clone()))
        .collect();
    let by_shape = densities_by_shape(&profiles, &options.densities);
    let spectra = residual_spectra(&segmentation, &solid, options.pixel).ok();
    let verdict = Verdict::new(&Evidence {
        findings: findings.clone(),
        profiles: verification.exact.profiles_photo,
        deviance: densities.all.deviance,
        degrees_of_freedom: densities.all.degrees_of_freedom,
        total: densities.all.total,
        volume_fraction: population.unfolded_fraction,
        area_fraction: segmentation.area_fraction,
        smallest_gap: packing.certificate().least_gap / mean_size(&packing),
        exact: verification.exact,
        resegmented: verification.resegmented,
        outlines: verification.outlines,
        texture_error: spectra.as_ref().map(ResidualSpectra::log_error),
    });
    for of_step in [&densities.findings, &population.findings, &details.findings] {
        findings.extend(of_step.iter().cloned());
    }
    Ok(Synthesis {
        segmentation,
        profiles,
        densities,
        population,
        packing,
        details,
        solid,
        verification,
        by_shape,
        spectra,
        verdict,
        findings,
        packing_inputs,
        texture_inputs,
        taken_up,
    })
}

fn colour_samples(segmentation: &Segmentation, pixel: f64) -> Vec<ColourSample> {
    let profiles = segmentation.profiles.iter();
    profiles.map(|profile| ColourSample::of(profile, pixel)).collect()
}

fn mean_size(packing: &Packing) -> f64 {
    let particles = packing.particles();
    particles.iter().map(|particle| particle.size).sum::<f64>() / particles.len().max(1) as f64
}

/// The profiles of a segmentation in the unit of length, ready to be unfolded.
///
/// # Examples
///
/// ```
/// use image::{Rgb, RgbImage};
/// use ndarray::Array2;
/// use stereology::pipeline::measured_profiles;
/// use stereology::segment::{SegmentOptions, Segmentation};
///
/// // A disc of diameter 40 pixels, at .1 mm per pixel.
/// let disc = |x: usize, y: usize| x.abs_diff(50).pow(2) + y.abs_diff(50).pow(2) <= 20 * 20;
/// let photo = RgbImage::from_fn(100, 100, |x, y| Rgb(if disc(x as usize, y as usize) { [170, 70, 50] } else { [225, 220, 210] }));
/// let labels = Array2::from_shape_fn((100, 100), |(y, x)| u32::from(disc(x, y)));
/// let found = measured_profiles(&Segmentation::from_labels(&photo, labels, &SegmentOptions::default())?, 0.1);
/// assert!((found.sizes[0] - 4.0).abs() < 0.05);
/// # Ok::<(), stereology::segment::SegmentError>(())
/// ```
#[must_use]
pub fn measured_profiles(segmentation: &Segmentation, pixel: f64) -> MeasuredProfiles {
    let profiles = &segmentation.profiles;
    MeasuredProfiles {
        sizes: profiles.iter().map(|profile| profile.size * pixel).collect(),
        weights: profiles.iter().map(|profile| profile.weight).collect(),
        categories: profiles.iter().map(|profile| profile.category).collect(),
        colours: segmentation.categories.iter().map(|category| category.colour).collect(),
        slices: Vec::new(),
        positions: profiles
            .iter()
            .map(|profile| [profile.x * pixel, profile.y * pixel])
            .collect(),
        types: Vec::new(),
        area: segmentation.window.area * pixel * pixel,
        min_size: MeasuredProfiles::limit_below(segmentation.min_size * pixel),
        size_error: 0.0,
    }
}
