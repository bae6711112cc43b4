//! Profiles: the measurements of each sectioned particle from a label map and a photo.

use image::RgbImage;
use ndarray::Array2;
use stereology_metrics::{BoundingBox, EdgeRule, SamplingWindow};

use crate::labels::profile_shape::{ProfileShape, ShapeSums};

/// The section of one particle. Lengths in pixels, colours sRGB / 255.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Its number in the label map.
    pub id: u32,
    /// Centre of area, pixels from the photo's left edge.
    pub x: f64,
    /// Centre of area, pixels from the photo's upper edge.
    pub y: f64,
    /// Area, pixels.
    pub area: f64,
    /// Equivalent circular diameter (ECD), √(4 A / π).
    pub size: f64,
    /// Mean of the encoded values, 0 to 1.
    pub colour: [f64; 3],
    /// Colour category, from 0.
    pub category: u8,
    /// Whether the photo's edge cuts it.
    pub touches_edge: bool,
    /// How much it counts by the edge rule: 1 or 0 by the associated point rule.
    pub weight: f64,
    /// Left, upper, right, lower edge, pixels.
    pub bounding_box: [usize; 4],
    /// Number of pixels.
    pub pixels: u64,
    /// Axis ratio, ellipticity, solidity and orientation; `None` below 50 pixels and of pixels on one line.
    pub shape: Option<ProfileShape>,
}

/// Where profiles are counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Width of the photo, pixels.
    pub width: usize,
    /// Height of the photo, pixels.
    pub height: usize,
    /// Area to which the weights belong, square pixels: that of the counting frame, or of the photo.
    pub area: f64,
}

/// Profiles of a label map by increasing number; those of fewer than `min_area` pixels are left out. Categories are 0
/// and weights 1 until they are set.
pub(crate) fn measure(photo: &RgbImage, labels: &Array2<u32>, min_area: usize) -> Vec<Profile> {
    #[derive(Clone)]
    struct Sums {
        shape: ShapeSums,
        colour: [u64; 3],
        bounds: [usize; 4],
    }
    let empty = Sums {
        shape: ShapeSums::default(),
        colour: [0; 3],
        bounds: [usize::MAX, usize::MAX, 0, 0],
    };
    let ids = distinct(labels);
    let index = Index::new(&ids);
    let mut sums = vec![empty; ids.len()];
    for (((y, x), &label), pixel) in labels.indexed_iter().zip(photo.pixels()) {
        if label == 0 {
            continue;
        }
        let s = &mut sums[index.of(label)];
        s.shape.add(x, y);
        (0..3).for_each(|c| s.colour[c] += u64::from(pixel[c]));
        s.bounds = [
            s.bounds[0].min(x),
            s.bounds[1].min(y),
            s.bounds[2].max(x + 1),
            s.bounds[3].max(y + 1),
        ];
    }
    let (height, width) = labels.dim();
    ids.into_iter()
        .zip(sums)
        .filter(|(_, s)| s.shape.count() >= min_area as u64)
        .map(|(id, s)| {
            let area = s.shape.count() as f64;
            let [x, y] = s.shape.centre();
            Profile {
                id,
                x,
                y,
                area,
                size: size_of_area(area),
                colour: s.colour.map(|c| c as f64 / (255.0 * area)),
                category: 0,
                touches_edge: s.bounds[0] == 0 || s.bounds[1] == 0 || s.bounds[2] == width || s.bounds[3] == height,
                weight: 1.0,
                bounding_box: s.bounds,
                pixels: s.shape.count(),
                shape: s.shape.shape(),
            }
        })
        .collect()
}

/// Equivalent circular diameter of an area.
pub(crate) fn size_of_area(area: f64) -> f64 {
    (4.0 * area / std::f64::consts::PI).sqrt()
}

/// The labels in use, increasing, without 0.
pub(crate) fn distinct(labels: &Array2<u32>) -> Vec<u32> {
    let mut ids: Vec<u32> = Vec::new();
    let mut last = 0;
    for &l in labels {
        if l != last && l != 0 {
            ids.push(l);
        }
        last = l;
    }
    ids.sort_unstable();
    ids.dedup();
    ids
}

/// Position of a label among the labels in use: by a table while that is small, else by binary search.
pub(crate) struct Index<'a> {
    ids: &'a [u32],
    table: Vec<u32>,
}

impl<'a> Index<'a> {
    pub(crate) fn new(ids: &'a [u32]) -> Self {
        let largest = ids.last().copied().unwrap_or(0) as usize;
        let mut table = Vec::new();
        if largest < 1 << 24 {
            table = vec![0; largest + 1];
            (0..).zip(ids).for_each(|(i, &id)| table[id as usize] = i);
        }
        Self { ids, table }
    }

    /// Position of a label that is in use.
    pub(crate) fn of(&self, label: u32) -> usize {
        match self.table.get(label as usize) {
            Some(&i) => i as usize,
            None => self.ids.partition_point(|&id| id < label),
        }
    }
}

/// Gives every profile its weight; returns the area they belong to, and whether the frame of the associated point rule
/// is limited because a profile extends over more than half the photo.
pub(crate) fn weigh(profiles: &mut [Profile], (height, width): (usize, usize), rule: EdgeRule) -> (f64, bool) {
    let boxes: Vec<BoundingBox> = profiles
        .iter()
        .map(|p| {
            let [left, top, right, bottom] = p.bounding_box.map(|side| side as f64);
            BoundingBox {
                left,
                top,
                right,
                bottom,
            }
        })
        .collect();
    let weights = SamplingWindow::pixels(width, height).weigh(&boxes, rule);
    for (profile, weight) in profiles.iter_mut().zip(weights.weights) {
        profile.weight = weight;
    }
    (weights.area, weights.frame_limited)
}
