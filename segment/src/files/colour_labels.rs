//! Labels from numbers of any kind, and from colours.

use ndarray::Array2;
use stereology_metrics::Finding;

use crate::conversions::{index, whole_part};

/// Advice for files whose samples are not labels.
pub(crate) const ADVICE: &str = "give one channel of whole numbers, 0 for the binder, or one colour per profile";
/// Colours beyond which those of few pixels are suspected to be blends.
const MANY_COLOURS: usize = 64;
/// Pixels of a colour that may be a blend.
const BLEND: u32 = 4;

/// Labels from stored numbers: whole numbers from 0 on. Numbers that are not numbers are the binder. So is -1, which
/// OpenCV's watershed gives to borders; where no pixel is 0, its background 1 is the binder too.
pub(crate) fn number_labels(
    shape: (usize, usize),
    values: impl Iterator<Item = f64>,
) -> Result<(Array2<u32>, Vec<Finding>), String> {
    let (mut missing, mut borders, mut zeros) = (0_usize, 0_usize, 0_usize);
    let label = |value: f64| -> Result<u32, String> {
        if value.is_nan() {
            missing += 1;
            return Ok(0);
        }
        if value.to_bits() == (-1.0_f64).to_bits() {
            borders += 1;
            return Ok(0);
        }
        if value < 0.0 {
            return Err(format!("the label {value} is negative; {ADVICE}"));
        }
        if value.fract() != 0.0 || value > f64::from(u32::MAX) {
            return Err(format!(
                "the label {value} is not a whole number of at most 32 bits; {ADVICE}"
            ));
        }
        zeros += usize::from(value < 1.0);
        Ok(index(whole_part(value)))
    };
    let samples = values.map(label).collect::<Result<Vec<u32>, String>>()?;
    let mut labels = shaped(shape, samples)?;
    let mut findings = Vec::new();
    if missing > 0 {
        findings.push(Finding::new(
            "binder-numbers",
            format!("{missing} pixels of the label map are not numbers (NaN) and were taken as the binder"),
        ));
    }
    if borders > 0 {
        let background = zeros == 0 && labels.iter().any(|l| *l == 1);
        if background {
            labels.mapv_inplace(|l| if l == 1 { 0 } else { l });
        }
        let what = if background {
            "and the label 1, its background, were"
        } else {
            "was"
        };
        findings.push(Finding::new(
            "binder-numbers",
            format!("the label -1 of {borders} pixels (borders of OpenCV's watershed, or no label) {what} taken as the binder"),
        ));
    }
    Ok((labels, findings))
}

/// Labels from colours (red, green, blue, opacity): every colour is one label, R + 256 G + 65,536 B as in COCO's
/// panoptic maps; if all are grey, the grey level. Black and the transparent are the binder, or where there are
/// neither, the colour of most pixels at the edges.
pub(crate) fn colour_labels(
    shape: (usize, usize),
    colours: &[[u16; 4]],
) -> Result<(Array2<u32>, Vec<Finding>), String> {
    let key = |c: &[u16; 4]| if c[3] == 0 { [0; 3] } else { [c[0], c[1], c[2]] };
    let mut used: Vec<[u16; 3]> = Vec::new();
    let mut last = None;
    for colour in colours.iter().map(key) {
        if last != Some(colour) {
            used.push(colour);
            // Runs repeat colours: keep the list short.
            if used.len() > 1 << 22 {
                used.sort_unstable();
                used.dedup();
            }
        }
        last = Some(colour);
    }
    used.sort_unstable();
    used.dedup();
    let place = |colour: [u16; 3]| used.partition_point(|c| *c < colour);
    let mut pixels = vec![0_u32; used.len()];
    colours.iter().for_each(|c| pixels[place(key(c))] += 1);
    let blends = pixels.iter().filter(|n| **n < BLEND).count();
    if used.len() > MANY_COLOURS && 2 * blends > used.len() {
        return Err(format!(
            "the image has {} colours, of which {blends} have fewer than {BLEND} pixels: it is a photo, or its colours are blended (smooth edges, JPEG); export the label map without smoothing, one colour or number per profile",
            used.len()
        ));
    }
    let grey = used.iter().all(|c| c[0] == c[1] && c[1] == c[2]);
    let small = used.iter().flatten().all(|v| *v < 256);
    let mut numbers: Vec<u32> = used
        .iter()
        .zip(0..)
        .map(|(c, i)| {
            let [r, g, b] = c.map(u32::from);
            if grey {
                r
            } else if small {
                r + 256 * g + 65_536 * b
            } else {
                // Sorted: black, if there is any, is the first.
                i + u32::from(used[0] != [0; 3])
            }
        })
        .collect();
    let mut findings = Vec::new();
    if !grey {
        let binder = if used[0] == [0; 3] {
            "black or transparent".to_owned()
        } else {
            let at = edge_colour(shape, colours.iter().map(|c| place(key(c))), used.len());
            numbers[at] = 0;
            let [r, g, b] = used[at];
            format!("({r}, {g}, {b}), which has most pixels at the edges,")
        };
        findings.push(Finding::new(
            "colour-labels",
            format!(
                "the label map has {} colours: each was taken as a profile, {binder} as the binder",
                used.len()
            ),
        ));
    }
    let labels = colours.iter().map(|c| numbers[place(key(c))]).collect();
    Ok((shaped(shape, labels)?, findings))
}

/// The place of the colour of most pixels along the edges.
fn edge_colour((height, width): (usize, usize), places: impl Iterator<Item = usize>, count: usize) -> usize {
    let mut pixels = vec![0_usize; count];
    for (i, place) in places.enumerate() {
        let (y, x) = (i / width, i % width);
        pixels[place] += usize::from(y == 0 || x == 0 || y + 1 == height || x + 1 == width);
    }
    let most = pixels.iter().copied().max().unwrap_or(0);
    pixels.iter().position(|n| *n == most).unwrap_or(0)
}

/// Samples as an array.
pub(crate) fn shaped(shape: (usize, usize), samples: Vec<u32>) -> Result<Array2<u32>, String> {
    let (found, wanted) = (samples.len(), shape.0 * shape.1);
    Array2::from_shape_vec(shape, samples)
        .map_err(|_| format!("{found} samples for {wanted} pixels: more than one channel; {ADVICE}"))
}
