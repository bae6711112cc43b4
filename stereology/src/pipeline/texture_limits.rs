//! Whether an exemplar is within the reach of Heeger-Bergen synthesis, seen on the result.

use ndarray::{ArrayView3, ArrayView4};
use stereology_metrics::{BlockSource, BlockTest, Family, Finding, Level, block_test};

/// What a synthesis of sub-bands did not reach.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureLimits {
    /// The block test of the result and its exemplar; the one with the greatest accuracy if there are several
    /// exemplars. `None` if the result or the exemplar has too few blocks.
    pub blocks: Option<BlockTest>,
    /// The finding `beyond-heeger-bergen`, if the result lacks structures of the exemplar.
    pub finding: Option<Finding>,
}

/// Error of the band statistics of the finished volume above which the exemplar's bands contradict its grey levels: 5 %
/// in power. Textures without large structures reach .0001 to .008.
const BANDS: f64 = 0.05;

/// Side in voxels from which the error of the bands counts: a smaller volume has too few features for the grey levels
/// and the power of a coarse texture at once.
const LARGE: usize = 64;

/// Differences of features in standard deviations that are worth naming.
const NAMED: f64 = 0.7;

/// Features of directions; the mode that matches every axis on its own can give them.
const DIRECTIONS: [&str; 3] = ["anisotropy", "direction_along", "direction_diagonal"];

/// Compares a synthesised volume (z, y, x, channel) with its exemplars (row, column, channel), values 0 to 1: one for
/// all slices, or one normal to each of z, y and x.
///
/// Heeger-Bergen synthesis reproduces the power of the sub-bands, their tails and the grey levels, but not how bands
/// depend on each other: edges, chips, cracks, layers and two-phase materials become speckle. The finding
/// `beyond-heeger-bergen` is made if the block test is [`Level::Bad`] (false alarms: less than one in a hundred for
/// textures finer than a tenth of a block), or if `band_error`, the error of the band statistics of the volume
/// ([`final_error`](stereology_pyramid::TextureReport::final_error)), exceeds .05 in a volume of at least 64 voxels
/// along each axis. Cost: about 1 s, independent of the
/// size of the volume.
///
/// # Examples
///
/// ```
/// use ndarray::{Array3, Array4};
/// use stereology::pipeline::texture_limits;
///
/// let layers = Array3::from_shape_fn((64, 64, 1), |(y, x, _)| if (y + x / 9) / 5 % 2 == 0 { 0.8_f32 } else { 0.2 });
/// let speckle = Array4::from_shape_fn((64, 64, 64, 1), |(z, y, x, _)| ((z * 13 + y * 29 + x * 47 + x * y * z) % 17) as f32 / 17.0);
/// let found = texture_limits(&[layers.view()], speckle.view(), 0.0, 0);
/// assert_eq!(found.finding.unwrap().code, "beyond-heeger-bergen");
/// ```
#[must_use]
pub fn texture_limits(
    exemplars: &[ArrayView3<'_, f32>],
    volume: ArrayView4<'_, f32>,
    band_error: f64,
    seed: u64,
) -> TextureLimits {
    // Exemplars are normal to z, y, x; the second of two is for y and x.
    const NORMALS: [Family; 3] = [Family::Xy, Family::Xz, Family::Yz];
    let of = |exemplar: &ArrayView3<'_, f32>, families: &[Family]| {
        let images = [*exemplar];
        let solid = BlockSource::Volume {
            voxels: volume,
            families,
            mask: None,
        };
        block_test(&BlockSource::Images(&images), &solid, seed)
    };
    let tests: Vec<BlockTest> = match exemplars {
        [one] => of(one, &NORMALS).into_iter().collect(),
        [first, second] => [of(first, &NORMALS[..1]), of(second, &NORMALS[1..])]
            .into_iter()
            .flatten()
            .collect(),
        several => several
            .iter()
            .zip(NORMALS)
            .filter_map(|(exemplar, family)| of(exemplar, &[family]))
            .collect(),
    };
    let blocks = tests.into_iter().max_by(|a, b| {
        let order = a.level().cmp(&b.level());
        order.then(a.accuracy.total_cmp(&b.accuracy))
    });
    let (nz, ny, nx, _) = volume.dim();
    let band_error = if nz.min(ny).min(nx) < LARGE { 0.0 } else { band_error };
    let finding = finding(blocks.as_ref(), band_error, exemplars.len() > 1);
    TextureLimits { blocks, finding }
}

/// [`texture_limits`] of a synthesised image (row, column, channel).
#[must_use]
pub fn image_texture_limits(exemplar: ArrayView3<'_, f32>, image: ArrayView3<'_, f32>, seed: u64) -> TextureLimits {
    let [exemplar, image] = [[exemplar], [image]];
    let blocks = block_test(&BlockSource::Images(&exemplar), &BlockSource::Images(&image), seed);
    // An image has no axes to give images to.
    let finding = finding(blocks.as_ref(), 0.0, true);
    TextureLimits { blocks, finding }
}

fn finding(blocks: Option<&BlockTest>, band_error: f64, is_oriented: bool) -> Option<Finding> {
    let mut reasons = Vec::new();
    let mut has_direction = false;
    if let Some(test) = blocks.filter(|test| test.level() == Level::Bad) {
        let named = || test.features.iter().filter(|feature| feature.difference.abs() >= NAMED);
        has_direction = named().any(|feature| DIRECTIONS.contains(&feature.name));
        let features = named()
            .take(3)
            .map(|of| format!("{} {:.2} for {:.2}", of.name, of.solid, of.exemplar));
        let features: Vec<String> = features.collect();
        reasons.push(format!(
            "a classifier distinguishes {:.0} % of the blocks of {} pixels from the exemplar's (p = {:.3}){}{}",
            100.0 * test.accuracy,
            test.side,
            test.p_value,
            if features.is_empty() { "" } else { "; " },
            features.join(", ")
        ));
    }
    if band_error > BANDS {
        reasons.push(format!(
            "the sub-bands of its slices differ by {:.0} % in power",
            100.0 * band_error
        ));
    }
    let advice = if has_direction && !is_oriented {
        "copying pixels (`exemplar`) keeps them, and one image per axis (mode `oriented`) keeps directions"
    } else {
        "copying pixels (`exemplar`) keeps them"
    };
    let message = format!(
        "the exemplar has structures that the synthesis of sub-bands does not reproduce: {}; {advice}",
        reasons.join("; ")
    );
    (!reasons.is_empty()).then(|| Finding::new("beyond-heeger-bergen", message))
}
