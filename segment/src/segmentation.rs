//! Profiles of a photograph, their colours and the binder: the result of a segmentation.

use image::RgbImage;
use ndarray::Array2;
use stereology_metrics::{Finding, KruskalWallis};

use crate::labels::category::{Category, categorise, size_by_category};
use crate::labels::halo::halo_categories;
use crate::labels::profile::{Index, Profile, Window, measure, size_of_area, weigh};
use crate::options::SegmentOptions;
use crate::quality::profile_findings;

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
    /// Fraction of the photo's area in profiles, cut ones included.
    pub area_fraction: f64,
    /// Sum of the weights over the window's area, per square pixel.
    pub number_per_area: f64,
    /// Equivalent circular diameter of [`SegmentOptions::min_area`]: the detection limit for unfolding.
    pub min_size: f64,
    /// Whether profiles of different categories differ in size; `None` for fewer than two categories.
    pub size_by_category: Option<KruskalWallis>,
    /// What to know before trusting it. Codes of the photo: `no-binder`, `vague-binder`, `area-fraction`,
    /// `few-profiles`, `unstable-count`, `edge-heavy`, `near-minimum`, `halo`. Of a label map: `clipped-labels`,
    /// `split-label`, `mask-split`, `holes-filled`, `small-labels`.
    pub findings: Vec<Finding>,
    /// Whether there is a photo: without one, colours mean nothing.
    pub has_colours: bool,
    pub(crate) photo: RgbImage,
    /// Pixels of the mask that belong to no profile: too small, or flecks.
    pub(crate) rejected: Vec<[usize; 2]>,
}

impl Segmentation {
    /// All measurements from labels and photo; labels of small profiles become 0.
    pub(crate) fn measured(photo: &RgbImage, mut labels: Array2<u32>, options: &SegmentOptions) -> Self {
        let mut profiles = measure(photo, &labels, options.min_area);
        let ids: Vec<u32> = profiles.iter().map(|p| p.id).collect();
        labels.mapv_inplace(|l| if ids.binary_search(&l).is_ok() { l } else { 0 });
        let (height, width) = labels.dim();
        let (area, frame_limited) = weigh(&mut profiles, (height, width), options.edge_rule);
        let categories = categorise(&mut profiles, options.categories, options.seed);
        let total: f64 = profiles.iter().map(|p| p.area).sum();
        let mut sum = ([0_u64; 3], 0_u64);
        for (_, pixel) in labels.iter().zip(photo.pixels()).filter(|(l, _)| **l == 0) {
            (0..3).for_each(|c| sum.0[c] += u64::from(pixel[c]));
            sum.1 += 1;
        }
        let area_fraction = total / (width * height) as f64;
        Self {
            binder: Binder {
                colour: sum.0.map(|s| s as f64 / (255.0 * sum.1.max(1) as f64)),
            },
            window: Window { width, height, area },
            area_fraction,
            number_per_area: profiles.iter().map(|p| p.weight).sum::<f64>() / area,
            size_by_category: size_by_category(&profiles),
            min_size: size_of_area(options.min_area as f64),
            labels,
            findings: profile_findings(&profiles, area_fraction, frame_limited, options),
            profiles,
            categories,
            has_colours: true,
            photo: photo.clone(),
            rejected: Vec::new(),
        }
    }

    /// Without the categories that are halos of others, with a finding that states how many profiles were left out.
    pub(crate) fn without_halos(self, options: &SegmentOptions) -> Self {
        let halos = halo_categories(&self.labels, &self.profiles, &self.categories, self.binder.colour);
        if halos.is_empty() {
            return self;
        }
        let ids: Vec<u32> = self.profiles.iter().map(|p| p.id).collect();
        let index = Index::new(&ids);
        let labels = self.labels.mapv(|l| {
            let is_halo = l != 0 && halos.contains(&self.profiles[index.of(l)].category);
            if is_halo { 0 } else { l }
        });
        let mut out = Self::measured(&self.photo, labels, options);
        let dropped = self.profiles.len() - out.profiles.len();
        out.findings.push(Finding::new("halo", format!("{dropped} regions that lie along particles, with colours between theirs and that of the binder, are blur or compression and were left out; look at the overlay, and use a photo that is sharper or compressed less if they are particles")));
        out
    }

    /// Notes the pixels of a mask that belong to no profile. The mask may be of a reduced photo.
    pub(crate) fn reject(&mut self, mask: &Array2<bool>) {
        let ((rows, columns), (height, width)) = (mask.dim(), self.labels.dim());
        let outside = self.labels.indexed_iter().filter(|(_, l)| **l == 0);
        let in_mask = outside.filter(|((y, x), _)| mask[[y * rows / height, x * columns / width]]);
        self.rejected = in_mask.map(|((y, x), _)| [y, x]).collect();
    }

    /// Numbers 1, 2, ... in reading order of the first pixels.
    pub(crate) fn renumber(&mut self) {
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
