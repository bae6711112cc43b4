//! Sections of the finished solid, measured like the photograph.

use stereology_metrics::{Progress, wasserstein};

use crate::pipeline::narrowing::{count_between, pixels_between};
use crate::pipeline::outline_comparison::compare_outlines;
use crate::pipeline::{MeasuredProfiles, OutlineComparison};
use image::RgbImage;
use rayon::prelude::*;
use std::ops::ControlFlow;
use stereology_imaging::connected_components;
use stereology_segment::{SegmentError, SegmentOptions, Segmentation, segment};
use stereology_volume::{Axis, SlicePlane, Solid, SolidError};

/// Sections of the solid, compared with the photograph.
#[derive(Clone, Debug)]
pub struct Verification {
    /// Sections measured exactly, from the bodies: a test of unfolding and packing.
    pub exact: Comparison,
    /// Sections drawn at the photograph's scale and measured like the photograph: the only test that shows a bias of
    /// the segmentation. `None` if no particles were found on them.
    pub resegmented: Option<Comparison>,
    /// Outlines on the drawn sections, compared with those of the photograph; `None` if too few profiles have a shape.
    pub outlines: Option<OutlineComparison>,
    /// Profile sizes of the exact sections, above the detection limit of the photograph.
    pub section_sizes: Vec<f64>,
    /// Area of the exact sections; length squared.
    pub section_area: f64,
    /// The drawn sections.
    pub pictures: Vec<RgbImage>,
}

/// Comparison of sections with the photograph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Profiles counted on the photograph.
    pub profiles_photo: usize,
    /// Profiles counted on the sections.
    pub profiles_synthetic: usize,
    /// Wasserstein-1 distance of the profile sizes, divided by their mean on the photograph.
    pub size_w1: f64,
    /// Area fraction of the profiles on the photograph.
    pub area_fraction_photo: f64,
    /// Area fraction of the profiles on the sections.
    pub area_fraction_synthetic: f64,
    /// Wasserstein-1 distance of the colours, mean over red, green and blue, encoded values / 255: of mean colours
    /// weighted by area for exact sections, of pixels for drawn ones.
    pub colour_distance: f64,
}

/// Why a verification failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VerificationError {
    /// A section could not be drawn.
    #[error(transparent)]
    Solid(#[from] SolidError),
    /// A section that contains particles could not be segmented.
    #[error("a section of the solid could not be segmented: {0}")]
    Segment(#[from] SegmentError),
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled,
}

/// Exact sections per axis.
const DEPTHS: usize = 32;
/// Limits of the number of drawn sections, which cover twice the area of the photograph.
const FEWEST_PICTURES: usize = 3;
const MOST_PICTURES: usize = 6;
/// Largest side of a drawn section in pixels.
const LARGEST_PICTURE: f64 = 1024.0;

/// How the profiles of the photograph were found, so that sections are measured in the same way.
#[derive(Clone, Copy, Debug)]
pub enum Recipe<'a> {
    /// By segmentation with these options.
    Segmented(&'a SegmentOptions),
    /// From a label map of another tool; sections then use the particles of their pixels as labels.
    Labelled(&'a SegmentOptions),
}

/// Sections `solid` at many depths along all axes and compares profile sizes, area fraction and colours with those of
/// the photograph.
///
/// `pixel` is the size of a pixel of the photograph. Cost: 96 exact sections and three to six drawn sections of one
/// period.
///
/// # Errors
///
/// [`VerificationError`].
///
/// # Examples
///
/// The photograph is a section through the middle of the only sphere; sections at all depths show less of it.
///
/// ```
/// use std::ops::ControlFlow;
/// use stereology::pipeline::{Recipe, measured_profiles, verify};
/// use stereology::segment::{SegmentOptions, Segmentation};
/// use nalgebra::{Point3, UnitQuaternion, Vector3};
/// use stereology::pipeline::ParticleTypes;
/// use stereology::shape::{Arrangement, Particle, PeriodicBox};
/// use stereology::volume::{Axis, SlicePlane, Solid};
///
/// // A sphere of diameter 40 in a box of side 64.
/// let spheres = ParticleTypes::parse(&["sphere"])?;
/// let particle = Particle { shape: 0, size: 40.0, category: 0, position: Point3::new(32.0, 32.0, 32.0), orientation: UnitQuaternion::identity() };
/// let period = PeriodicBox::new(Vector3::repeat(64.0))?;
/// let solid = Solid::new(Arrangement::new(spheres.unit_bodies(), vec![particle], period)?, vec![[0.7, 0.3, 0.2]], [0.9; 3], None)?;
/// let middle = SlicePlane::across(Axis::Z, 32.0);
/// let options = SegmentOptions::default();
/// let photo = Segmentation::from_labels(&solid.slice(&middle, 64, 64, 1.0)?, solid.slice_ids(&middle, 64, 64, 1.0)?, &options)?;
/// let sizes = measured_profiles(&photo, 1.0);
/// let sections = verify(&solid, &photo, &sizes, Recipe::Labelled(&options), 1.0, &|_| ControlFlow::Continue(()))?.exact;
/// let sphere = std::f64::consts::PI / 6.0 * (40.0_f64 / 64.0).powi(3);
/// assert!((sections.area_fraction_synthetic / sphere - 1.0).abs() < 0.01);
/// assert!(sections.area_fraction_photo > 2.0 * sphere);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn verify(
    solid: &Solid,
    photo: &Segmentation,
    profiles: &MeasuredProfiles,
    recipe: Recipe<'_>,
    pixel: f64,
    progress: Progress<'_>,
) -> Result<Verification, VerificationError> {
    let go_on = |done: f64| match progress(done) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(VerificationError::Cancelled),
    };
    go_on(0.0)?;
    let photo_sizes: Vec<(f64, f64)> = profiles
        .sizes
        .iter()
        .copied()
        .zip(profiles.weights.iter().copied())
        .filter(|(_, weight)| *weight > 0.0)
        .collect();
    let sections = exact_sections(solid, profiles.min_size);
    let exact = Comparison {
        profiles_photo: photo_sizes.len(),
        profiles_synthetic: sections.sizes.len(),
        size_w1: size_w1(
            &photo_sizes,
            &sections.sizes.iter().map(|&size| (size, 1.0)).collect::<Vec<_>>(),
        ),
        area_fraction_photo: photo.area_fraction,
        area_fraction_synthetic: sections.covered / sections.area,
        colour_distance: colour_distance(&mean_colours(photo), &sections.colours),
    };
    go_on(0.2)?;

    let pictures = drawn_sections(solid, photo, pixel)?;
    go_on(0.4)?;
    let measured = pictures
        .par_iter()
        .map(|drawn| measure(drawn, recipe, &|_| progress(0.4)))
        .collect::<Result<Vec<_>, VerificationError>>()?;
    let measured: Vec<Segmentation> = measured.into_iter().flatten().collect();
    let outlines = compare_outlines(photo, &measured);
    let resegmented = (!measured.is_empty()).then(|| {
        let sizes: Vec<(f64, f64)> = measured
            .iter()
            .flat_map(|of| of.profiles.iter().map(|profile| (profile.size * pixel, profile.weight)))
            .filter(|(_, weight)| *weight > 0.0)
            .collect();
        let whole: f64 = pictures
            .iter()
            .map(|drawn| f64::from(drawn.picture.width() * drawn.picture.height()))
            .sum();
        let covered: f64 = measured
            .iter()
            .map(|of| of.area_fraction * of.labels.len() as f64)
            .sum();
        let pixels: Vec<&RgbImage> = pictures.iter().map(|drawn| &drawn.picture).collect();
        Comparison {
            profiles_photo: photo_sizes.len(),
            profiles_synthetic: sizes.len(),
            size_w1: size_w1(&photo_sizes, &sizes),
            area_fraction_photo: photo.area_fraction,
            area_fraction_synthetic: covered / whole,
            colour_distance: colour_distance(&pixel_colours(&[photo.photo()]), &pixel_colours(&pixels)),
        }
    });
    go_on(1.0)?;
    Ok(Verification {
        exact,
        resegmented,
        outlines,
        section_sizes: sections.sizes,
        section_area: sections.area,
        pictures: pictures.into_iter().map(|drawn| drawn.picture).collect(),
    })
}

fn size_w1(photo: &[(f64, f64)], synthetic: &[(f64, f64)]) -> f64 {
    let weight: f64 = photo.iter().map(|(_, weight)| weight).sum();
    let mean = photo.iter().map(|(size, weight)| size * weight).sum::<f64>() / weight;
    wasserstein(photo, synthetic) / mean
}

/// Colours and their weights, by channel.
type Colours = [Vec<(f64, f64)>; 3];

fn colour_distance(a: &Colours, b: &Colours) -> f64 {
    a.iter().zip(b).map(|(a, b)| wasserstein(a, b)).sum::<f64>() / 3.0
}

/// The mean colours of profiles and binder, weighted by area.
fn mean_colours(photo: &Segmentation) -> Colours {
    std::array::from_fn(|channel| {
        let covered: f64 = photo.profiles.iter().map(|profile| profile.area).sum();
        let binder = (photo.binder.colour[channel], photo.labels.len() as f64 - covered);
        photo
            .profiles
            .iter()
            .map(|profile| (profile.colour[channel], profile.area))
            .chain([binder])
            .collect()
    })
}

fn pixel_colours(pictures: &[&RgbImage]) -> Colours {
    std::array::from_fn(|channel| {
        let mut counts = [0.0; 256];
        for picture in pictures {
            for pixel in picture.pixels() {
                counts[usize::from(pixel.0[channel])] += 1.0;
            }
        }
        counts
            .iter()
            .enumerate()
            .map(|(value, &count)| (value as f64 / 255.0, count))
            .collect()
    })
}

struct Sections {
    sizes: Vec<f64>,
    area: f64,
    covered: f64,
    colours: Colours,
}

/// Profiles above `min_size` on equally spaced planes perpendicular to each axis.
fn exact_sections(solid: &Solid, min_size: f64) -> Sections {
    let sides = solid.period().sides();
    let planes: Vec<(Axis, f64)> = [Axis::X, Axis::Y, Axis::Z]
        .into_iter()
        .flat_map(|axis| (0..DEPTHS).map(move |i| (axis, (i as f64 + 0.5) / DEPTHS as f64 * sides[axis.index()])))
        .collect();
    let found: Vec<Vec<(usize, f64)>> = planes
        .par_iter()
        .map(|&(axis, depth)| solid.section_profiles(axis, depth))
        .collect();
    let area: f64 = planes
        .iter()
        .map(|(axis, _)| solid.period().volume() / sides[axis.index()])
        .sum();
    let mut sections = Sections {
        sizes: Vec::new(),
        area,
        covered: 0.0,
        colours: Colours::default(),
    };
    for (particle, profile) in found.into_iter().flatten() {
        let size = (4.0 * profile / std::f64::consts::PI).sqrt();
        if size <= min_size {
            continue;
        }
        sections.sizes.push(size);
        sections.covered += profile;
        for channel in 0..3 {
            sections.colours[channel].push((f64::from(solid.colours()[particle][channel]), profile));
        }
    }
    for channel in 0..3 {
        sections.colours[channel].push((f64::from(solid.binder()[channel]), area - sections.covered));
    }
    sections
}

/// A section at the photograph's scale.
struct DrawnSection {
    picture: RgbImage,
    labels: ndarray::Array2<u32>,
}

fn drawn_sections(solid: &Solid, photo: &Segmentation, pixel: f64) -> Result<Vec<DrawnSection>, SolidError> {
    let sides = solid.period().sides();
    let pixels = pixels_between(sides.min() / pixel, 16.0, LARGEST_PICTURE);
    let enough = 2.0 * photo.labels.len() as f64 / f64::from(pixels).powi(2);
    (0..count_between(enough, FEWEST_PICTURES, MOST_PICTURES))
        .map(|i| {
            let axis = [Axis::X, Axis::Y, Axis::Z][i % 3];
            // Multiples of the golden ratio are well spread for any number of sections.
            let depth = (0.5 + i as f64 * 0.618_033_988_749_895).fract() * sides[axis.index()];
            let plane = SlicePlane::across(axis, depth);
            Ok(DrawnSection {
                picture: solid.slice(&plane, pixels, pixels, pixel)?,
                labels: solid.slice_ids(&plane, pixels, pixels, pixel)?,
            })
        })
        .collect()
}

/// The profiles of a drawn section, found like those of the photograph; `None` if there are none.
fn measure(
    drawn: &DrawnSection,
    recipe: Recipe<'_>,
    progress: Progress<'_>,
) -> Result<Option<Segmentation>, VerificationError> {
    let found = match recipe {
        Recipe::Segmented(options) => segment(&drawn.picture, options, progress),
        Recipe::Labelled(options) => {
            // Two images of one particle are two profiles.
            let (labels, _) = connected_components(drawn.labels.view(), |id| id != 0);
            Segmentation::from_labels(&drawn.picture, labels, options)
        }
    };
    match found {
        Ok(segmentation) => Ok(Some(segmentation)),
        Err(SegmentError::NoParticles { .. } | SegmentError::SingleColour { .. } | SegmentError::NoLabels) => Ok(None),
        Err(SegmentError::Cancelled) => Err(VerificationError::Cancelled),
        Err(error) => Err(error.into()),
    }
}
