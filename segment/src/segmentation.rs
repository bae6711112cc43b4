//! From a photograph, or a photograph and a label map, to profiles.

use std::ops::ControlFlow;

use image::RgbImage;
use ndarray::Array2;
use stereology_imaging::{connected_components, gaussian_filter_rgb, lab_image};

use crate::{
    binder::{BinderModel, length},
    category::{Category, SizeByCategory, categorise, size_by_category},
    error::SegmentError,
    faint::faint_regions,
    finding::Finding,
    options::{BinderChoice, Holes, SegmentOptions},
    photo::encoded_image,
    profile::{Index, Profile, Window, measure, size_of_area, weigh},
    quality::{LEAST_SHARE, counts_by_rise, counts_by_threshold},
    refine::half_contrast,
    regions::{fill_holes, hysteresis, open},
    split::{contrast_depth, fill_label_holes, hills_of, rising, shape_depth, split_by_colour},
    tones::{TONE_DISTANCE, TwoTones, densest, main_colours, mean_depth},
};

/// What lies between the particles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Binder {
    /// Mean of the encoded values of all pixels outside profiles, sRGB / 255.
    pub colour: [f64; 3],
}

/// Profiles of a photo, their colours, and the binder. Lengths in pixels.
#[derive(Clone, Debug)]
pub struct Segmentation {
    /// Profile of every pixel, axes (y, x): [`Profile::id`], or 0 for the binder.
    pub labels: Array2<u32>,
    /// By increasing id.
    pub profiles: Vec<Profile>,
    /// Colour categories, most profiles first.
    pub categories: Vec<Category>,
    /// The binder.
    pub binder: Binder,
    /// Where profiles are counted.
    pub window: Window,
    /// Share of the photo's area in profiles, cut ones included.
    pub area_fraction: f64,
    /// Sum of the weights over the window's area, per square pixel.
    pub number_per_area: f64,
    /// Size of the smallest profile looked for, the circle of [`SegmentOptions::min_area`]: the truncation to hand to unfolding.
    pub min_size: f64,
    /// Whether profiles of different categories differ in size; `None` for fewer than two categories.
    pub size_by_category: Option<SizeByCategory>,
    /// What to know before trusting it.
    pub findings: Vec<Finding>,
    pub(crate) photo: RgbImage,
    /// Pixels that stood out but were left out: too small, or flecks.
    pub(crate) rejected: Vec<[usize; 2]>,
}

/// Where a segmentation stands, 0 to 1, and whether to go on.
type Progress<'a> = &'a (dyn Fn(f64) -> ControlFlow<()> + Sync);

/// Finds the profiles of particles in a photo of a section.
///
/// The steps, each a function of its own: [`encoded_image`] and [`gaussian_filter_rgb`]; [`BinderModel`], whose colour and light are fitted robustly; [`hysteresis`] of the distance to it, [`fill_holes`], [`open`];
/// [`half_contrast`]; [`split_by_colour`](crate::split_by_colour), [`split_by_shape`](crate::split_by_shape); small profiles dropped, edges weighed, colours put in categories.
///
/// # Errors
///
/// A photo that is too small or of one colour, an option out of range, nothing that stands out, or cancelled. A photo without a binder is no error but the finding `no-binder`.
///
/// # Complexity
///
/// Linear in pixels, but for the inverse Ackermann function and the sorting of parts of different colours that touch; about 90 bytes a pixel.
///
/// # References
///
/// Jagnow, Dorsey & Rushmeier 2004, sections 4.2 and 5.2.
///
/// # Examples
///
/// See the crate's first page.
pub fn segment(
    photo: &RgbImage,
    options: &SegmentOptions,
    progress: Progress<'_>,
) -> Result<Segmentation, SegmentError> {
    options.check()?;
    let (width, height) = photo.dimensions();
    if width < 16 || height < 16 {
        return Err(SegmentError::TooSmall { width, height });
    }
    let first = *photo.get_pixel(0, 0);
    if photo.pixels().all(|p| *p == first) {
        return Err(SegmentError::SingleColour { colour: first.0 });
    }
    let report = |done| match progress(done) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(SegmentError::Cancelled),
    };
    report(0.0)?;
    let colours = gaussian_filter_rgb(encoded_image(photo).view(), options.smoothing);
    report(0.15)?;
    let mut binder = match options.binder {
        BinderChoice::Found => BinderModel::fit(&colours, options.seed),
        BinderChoice::Colour(colour) => BinderModel::fit_near(&colours, colour.map(|v| v as f32)),
        BinderChoice::MainColour(number) => {
            let main = main_colours(&colours, options.seed);
            let Some((colour, _)) = main.get(number) else {
                return Err(SegmentError::Option {
                    option: "binder",
                    value: number as f64,
                    requirement: "a main colour of the photo is numbered from 0, and there are at most eight",
                });
            };
            BinderModel::fit_near(&colours, *colour)
        }
    };
    let given = options.binder != BinderChoice::Found;
    report(0.3)?;
    let mut deviation = binder.deviation(&colours);
    let mut distance = deviation.mapv(length);
    deviation = binder.blunted(HUE_SCATTER).deviation(&colours);
    let [mut low, mut high] = options.thresholds;
    let mut rounds = ROUNDS;
    // Holes in a whole region may be binder between particles that touch: only small ones are filled before it is cut.
    let mut hole_share = HOLE_SHARE;
    let mut share = binder.share();
    let connected = given || surrounds(&distance.mapv(|z| z < low));
    let mut clear = connected && stands_out(&distance, low, high);
    let (mut find_faint, mut vague, mut one_tone) = (true, false, false);
    if !clear && !given {
        let even = binder.even_light(&gaussian_filter_rgb(
            encoded_image(photo).view(),
            0.5 * options.smoothing,
        ));
        let tones = TwoTones::find(&even, options.seed).filter(|t| t.apart() > TWO_TONES);
        let two = tones.and_then(|tones| {
            let binder = tones.binder(&even);
            let candidates = binder.deviation(&even);
            let mut nearness = candidates.mapv(length);
            (edge_slope(&nearness) > TONE_EDGE).then(|| {
                tones.lower_beyond(&binder, &even, &mut nearness);
                (nearness, candidates, binder.share())
            })
        });
        if let Some((nearness, candidates, covered)) = two {
            (distance, deviation) = (nearness, candidates);
            (high, rounds, hole_share, share, clear) = (1.2 * low, 1, None, covered, true);
            (find_faint, one_tone) = (false, true);
        } else {
            // No heap of colours stands apart: what lies near the densest spot may still be a binder.
            let near = BinderModel::fit_near(&colours, densest(&colours));
            let nearness = near.distance(&colours);
            let thresholds = [NEAR * low, NEAR * high];
            if near.share() > LEAST_SHARE
                && surrounds(&nearness.mapv(|z| z < thresholds[0]))
                && stands_out(&nearness, thresholds[0], thresholds[1])
            {
                deviation = near.blunted(HUE_SCATTER).deviation(&colours);
                ([low, high], share, clear, vague) = (thresholds, near.share(), true, true);
                (binder, distance, find_faint) = (near, nearness, false);
            }
        }
    }
    let mut mask = hysteresis(&distance, low, high);
    report(0.4)?;
    let fill = |mask: &mut Array2<bool>| {
        if let (Holes::Fill, Some(part)) = (options.holes, hole_share) {
            fill_holes(mask, |hole, around| hole <= options.min_area.max(around / part));
        }
    };
    fill(&mut mask);
    open(&mut mask);
    // The first outline follows the threshold, so that its cores hold blurred rims; later rounds have cleaner ones.
    let blur = options.smoothing.hypot(SHARP);
    for _ in 0..rounds {
        mask = half_contrast(&deviation, &mask, blur);
    }
    if find_faint {
        let faint = faint_regions(&colours, &binder, &mask, [FAINT * low, FAINT * high]);
        mask.zip_mut_with(&faint, |m, z| *m |= *z > 0.0);
        distance.zip_mut_with(&faint, |d, z| *d = d.max(*z));
    }
    fill(&mut mask);
    open(&mut mask);
    report(0.6)?;
    let parts = split_by_colour(&lab_image(colours.view()), &mask, options.seed);
    report(0.75)?;
    let depth = if one_tone {
        contrast_depth(&distance, &parts, CLEAR * TONE_DISTANCE)
    } else {
        shape_depth(&parts)
    };
    let hills = hills_of(&parts, &depth);
    let mut labels = hills.divided(rising(parts.dim(), options.rise));
    let by_rise = counts_by_rise(&hills, parts.dim(), options);
    drop((hills, parts, depth));
    drop_faint(&mut labels, &distance, &deviation, high, options.min_area);
    if options.holes == Holes::Fill {
        fill_label_holes(&mut labels);
    }
    report(0.9)?;
    let mut out = Segmentation::measured(photo, labels, options);
    if out.profiles.is_empty() {
        return Err(SegmentError::NoParticles {
            min_area: options.min_area,
        });
    }
    let left_out = mask.indexed_iter().filter(|(p, m)| **m && out.labels[*p] == 0);
    out.rejected = left_out.map(|((y, x), _)| [y, x]).collect();
    out.renumber();
    out.judge_binder(share, clear);
    if vague {
        out.findings.push(Finding::new("vague-binder", "the binder's colours go over into those of particles: what differs clearly from the commonest colour is outlined, and particles of the binder's own colours are missed; look at the overlay, give the binder's colour, or import a label map".into()));
    }
    out.judge_count(
        counts_by_threshold(&distance, &deviation, [low, high], options),
        by_rise,
    );
    report(1.0)?;
    Ok(out)
}

impl Segmentation {
    /// Everything that follows from labels and photo; labels of small profiles become 0.
    pub(crate) fn measured(photo: &RgbImage, mut labels: Array2<u32>, options: &SegmentOptions) -> Self {
        let mut profiles = measure(photo, &labels, options.min_area);
        let ids: Vec<u32> = profiles.iter().map(|p| p.id).collect();
        labels.mapv_inplace(|l| if ids.binary_search(&l).is_ok() { l } else { 0 });
        let (height, width) = labels.dim();
        let (area, cut_short) = weigh(&mut profiles, (height, width), options.edge_rule);
        let categories = categorise(&mut profiles, options.categories, options.seed);
        let total: f64 = profiles.iter().map(|p| p.area).sum();
        let mut sum = ([0_u64; 3], 0_u64);
        for (_, pixel) in labels.iter().zip(photo.pixels()).filter(|(l, _)| **l == 0) {
            (0..3).for_each(|c| sum.0[c] += u64::from(pixel[c]));
            sum.1 += 1;
        }
        let mut out = Self {
            binder: Binder {
                colour: sum.0.map(|s| s as f64 / (255.0 * sum.1.max(1) as f64)),
            },
            window: Window { width, height, area },
            area_fraction: total / (width * height) as f64,
            number_per_area: profiles.iter().map(|p| p.weight).sum::<f64>() / area,
            size_by_category: size_by_category(&profiles, options.seed),
            min_size: size_of_area(options.min_area as f64),
            labels,
            profiles,
            categories,
            findings: Vec::new(),
            photo: photo.clone(),
            rejected: Vec::new(),
        };
        out.judge_profiles(options, cut_short);
        out
    }

    /// Numbers 1, 2, ... in reading order of the first pixels.
    fn renumber(&mut self) {
        let ids: Vec<u32> = self.profiles.iter().map(|p| p.id).collect();
        let index = Index::new(&ids);
        let mut new = vec![0_u32; ids.len()];
        let mut next = 1;
        for l in self.labels.iter_mut().filter(|l| **l != 0) {
            let number = &mut new[index.of(*l)];
            if *number == 0 {
                *number = next;
                next += 1;
            }
            *l = *number;
        }
        for (p, id) in self.profiles.iter_mut().zip(new) {
            p.id = id;
        }
        self.profiles.sort_by_key(|p| p.id);
    }
}

/// Thresholds over the usual ones where no binder stands apart.
const NEAR: f32 = 0.5;
/// Thresholds of faint regions over those of clear ones: hardly any of the binder is further than three and a half deviations over many pixels at once.
const FAINT: f32 = 0.7;
/// Least scatter, sRGB / 255, while outlines are drawn: four levels.
const HUE_SCATTER: f64 = 4.0 / 255.0;
/// Mean difference of a small profile to the binder, in standard deviations of the binder and [`HUE_SCATTER`], from which it is one.
const VISIBLE: f64 = 2.5;
/// Standard deviation of the blur of a sharp photo, pixels.
pub(crate) const SHARP: f32 = 0.8;
/// Share of the distance of two tones at which touching particles are apart.
const CLEAR: f32 = 0.7;
/// Rounds of refining outlines: the third moves them by less than a tenth of a pixel.
const ROUNDS: usize = 3;
/// Holes of less than a twentieth of their region's area are filled before it is cut.
const HOLE_SHARE: Option<usize> = Some(20);
/// Distance of two tones over the sum of their scatters from which they are two: 1.48 was seen in gravel, 1.62 to 1.85 in tomograms and thin sections.
const TWO_TONES: f64 = 1.55;
/// Slope of the borders between two tones, a pixel's share of their distance, from which they are edges: 0.15 was seen in shaded pebbles, 0.33 to 0.47 in tomograms and thin sections.
const TONE_EDGE: f32 = 0.25;

/// Median slope, across the border between two tones at half their distance, of the distance to one of them, as a share of their distance a pixel. 0 if there is no border.
fn edge_slope(distance: &Array2<f32>) -> f32 {
    let (height, width) = distance.dim();
    let half = 0.5 * TONE_DISTANCE;
    let mut slopes = Vec::new();
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let beyond = distance[[y, x]] >= half;
            if beyond != (distance[[y, x + 1]] >= half) || beyond != (distance[[y + 1, x]] >= half) {
                let across = |j: usize| distance[[j, x + 1]] - distance[[j, x - 1]];
                let down = |i: usize| distance[[y + 1, i]] - distance[[y - 1, i]];
                // Sobel's means of three rows and columns.
                let dx = across(y - 1) + 2.0 * across(y) + across(y + 1);
                let dy = down(x - 1) + 2.0 * down(x) + down(x + 1);
                slopes.push(dx.hypot(dy) / (8.0 * TONE_DISTANCE));
            }
        }
    }
    let middle = slopes.len() / 2;
    if slopes.is_empty() {
        return 0.0;
    }
    *slopes.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// Whether a mask can be the binder: its largest piece holds at least a third of it; and where the rest hangs together too, the mask is the one in thinner threads.
fn surrounds(mask: &Array2<bool>) -> bool {
    let rest = mask.mapv(|m| !m);
    let share = rest.iter().filter(|m| **m).count() as f64 / rest.len() as f64;
    let tangled = share > 0.35 && share_of_largest(&rest) > 0.5;
    share_of_largest(mask) > 1.0 / 3.0 && !(tangled && mean_depth(mask) > mean_depth(&rest))
}

/// Share of a mask in its largest piece.
fn share_of_largest(mask: &Array2<bool>) -> f64 {
    let (pieces, count) = connected_components(mask.view(), |m| m);
    let mut areas = vec![0_usize; count as usize + 1];
    pieces.iter().for_each(|&p| areas[p as usize] += 1);
    let all: usize = areas[1..].iter().sum();
    areas[1..]
        .iter()
        .max()
        .map_or(0.0, |largest| *largest as f64 / all as f64)
}

/// Whether the distances to the binder fall into two heaps: as many pixels well beyond the thresholds as between them, nearly.
fn stands_out(distance: &Array2<f32>, low: f32, high: f32) -> bool {
    let beyond = distance.iter().filter(|z| **z >= high).count();
    let between = distance.iter().filter(|z| **z >= low && **z < high).count();
    beyond as f64 > 0.6 * between as f64
}

/// Takes away labels of fewer than eight times `least` pixels that are flecks of the binder's texture, of which less than a tenth is at least `high` from the binder, or of the photo's compression, whose mean
/// difference is hardly visible.
pub(crate) fn drop_faint(
    labels: &mut Array2<u32>,
    distance: &Array2<f32>,
    blunted: &Array2<[f32; 3]>,
    high: f32,
    least: usize,
) {
    let count = labels.iter().copied().max().unwrap_or(0) as usize + 1;
    let mut sums = vec![(0_usize, 0_usize, 0.0_f64); count];
    for ((&label, z), d) in labels.iter().zip(distance).zip(blunted) {
        let sum = &mut sums[label as usize];
        sum.0 += usize::from(*z >= high);
        sum.1 += 1;
        sum.2 += f64::from(length(*d));
    }
    let kept: Vec<bool> = sums
        .iter()
        .map(|&(strong, all, seen)| all >= 8 * least || (10 * strong >= all && seen >= VISIBLE * all as f64))
        .collect();
    labels.mapv_inplace(|l| if l != 0 && kept[l as usize] { l } else { 0 });
}
