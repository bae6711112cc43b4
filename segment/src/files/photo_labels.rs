//! Label maps that belong to a photo, however the photo was turned when they were drawn.

use std::path::Path;

use image::RgbImage;
use image::metadata::Orientation;
use ndarray::{Array2, Axis};
use stereology_metrics::Finding;

use crate::error::SegmentError;
use crate::files::label_map::{LabelFile, read};
use crate::files::photo::PhotoFile;
use crate::labels::profile::{Index, distinct};

/// Fraction of the variance of the photo's colours by which one way of turning labels must explain more than another.
const CLEARLY: f64 = 0.02;

impl PhotoFile {
    /// Reads a label map for this photo, as [`read_labels_for`](crate::read_labels_for) does, with the photo's file
    /// name to choose among several images of one file.
    ///
    /// Many tools ignore the orientation that a camera notes in a photo, and label the pixels as stored. Where the
    /// photo was turned, or the label file has an orientation of its own, the labels are turned as well if only that
    /// fits the photo's size, or if the profiles then explain clearly more of the variance of its colours. The findings
    /// `labels-turned` and, where neither way is clearly better, `exif-orientation` report it.
    ///
    /// # Errors
    ///
    /// As [`read_labels_for`](crate::read_labels_for).
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_segment::{PhotoOptions, read_photo_with, write_labels};
    ///
    /// # let folder = tempfile::tempdir()?;
    /// let (photo, labels) = (folder.path().join("photo.png"), folder.path().join("labels.tif"));
    /// image::RgbImage::new(3, 2).save(&photo)?;
    /// let map = ndarray::array![[0, 1, 1], [0, 0, 2_u32]];
    /// write_labels(&labels, map.view())?;
    /// let photo = read_photo_with(&photo, &PhotoOptions::default())?;
    /// assert_eq!(photo.labels(&labels)?.labels, map);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn labels(&self, path: impl AsRef<Path>) -> Result<LabelFile, SegmentError> {
        let path = path.as_ref();
        let size = (self.photo.height() as usize, self.photo.width() as usize);
        let name = self.name.as_deref();
        let upright = read(path, Some(size), name);
        let stored = self.turned.map(|turn| {
            let (height, width) = size;
            let stored = if is_quarter(turn) { (width, height) } else { size };
            read(path, Some(stored), name).map(|file| turn_file(file, turn))
        });
        let noted = upright
            .as_ref()
            .ok()
            .filter(|file| file.orientation != Orientation::NoTransforms);
        let noted = noted.map(|file| turn_file(file.clone(), file.orientation));
        let turned = [stored.and_then(Result::ok), noted].into_iter().flatten();
        let turned: Vec<LabelFile> = turned.filter(|file| file.labels.dim() == size).collect();
        let upright = match upright {
            Ok(file) if file.labels.dim() == size || turned.is_empty() => file,
            other => {
                let Some(fits) = turned.into_iter().next() else {
                    return other;
                };
                return Ok(reported(fits, "they fit only so"));
            }
        };
        if turned.is_empty() {
            return Ok(upright);
        }
        let here = explained(&self.photo, &upright.labels);
        let mut best: Option<(f64, LabelFile)> = None;
        for file in turned.into_iter().filter(|file| file.labels != upright.labels) {
            let there = explained(&self.photo, &file.labels);
            if best.as_ref().is_none_or(|(most, _)| there > *most) {
                best = Some((there, file));
            }
        }
        Ok(match best {
            None => upright,
            Some((there, _)) if here > there + CLEARLY => upright,
            Some((there, file)) if there > here + CLEARLY => reported(file, "their outlines then follow its colours"),
            Some(_) => {
                let mut file = upright;
                file.findings.push(Finding::new(
                    "exif-orientation",
                    "the photo or the label map notes an orientation, and it cannot be seen whether the labels belong to the upright photo, which was assumed, or to the pixels as stored; look at the overlay",
                ));
                file
            }
        })
    }
}

fn reported(mut file: LabelFile, why: &str) -> LabelFile {
    file.findings.push(Finding::new(
        "labels-turned",
        format!("the labels belong to the photo's pixels as stored, before the orientation noted in the file; they were turned with the photo ({why})"),
    ));
    file
}

fn is_quarter(turn: Orientation) -> bool {
    matches!(
        turn,
        Orientation::Rotate90 | Orientation::Rotate270 | Orientation::Rotate90FlipH | Orientation::Rotate270FlipH
    )
}

fn turn_file(file: LabelFile, turn: Orientation) -> LabelFile {
    LabelFile {
        labels: turned(file.labels, turn),
        findings: file.findings,
        orientation: Orientation::NoTransforms,
    }
}

/// Turns a label map as an orientation turns a photo.
fn turned(mut labels: Array2<u32>, turn: Orientation) -> Array2<u32> {
    if is_quarter(turn) {
        labels.swap_axes(0, 1);
    }
    let (rows, columns) = (Axis(0), Axis(1));
    match turn {
        Orientation::NoTransforms | Orientation::Rotate90FlipH => {}
        Orientation::FlipHorizontal | Orientation::Rotate90 => labels.invert_axis(columns),
        Orientation::FlipVertical | Orientation::Rotate270 => labels.invert_axis(rows),
        Orientation::Rotate180 | Orientation::Rotate270FlipH => {
            labels.invert_axis(rows);
            labels.invert_axis(columns);
        }
    }
    labels.as_standard_layout().into_owned()
}

/// Fraction of the variance of the photo's colours that lies between profiles and binder.
fn explained(photo: &RgbImage, labels: &Array2<u32>) -> f64 {
    let ids = distinct(labels);
    let index = Index::new(&ids);
    // Of each group: pixels, sums of colours.
    let mut groups = vec![(0_u64, [0_u64; 3]); ids.len() + 1];
    let mut squares = 0_u64;
    for (&label, pixel) in labels.iter().zip(photo.pixels()) {
        let group = &mut groups[if label == 0 { ids.len() } else { index.of(label) }];
        group.0 += 1;
        for c in 0..3 {
            group.1[c] += u64::from(pixel[c]);
            squares += u64::from(pixel[c]).pow(2);
        }
    }
    let share = |(n, sums): &(u64, [u64; 3])| match n {
        0 => 0.0,
        n => sums.iter().map(|s| (*s as f64).powi(2)).sum::<f64>() / *n as f64,
    };
    let all = groups.iter().fold((0, [0; 3]), |a: (u64, [u64; 3]), b| {
        (a.0 + b.0, std::array::from_fn(|c| a.1[c] + b.1[c]))
    });
    let total = squares as f64 - share(&all);
    if total <= 0.0 {
        return 0.0;
    }
    (groups.iter().map(share).sum::<f64>() - share(&all)) / total
}

#[cfg(test)]
#[allow(clippy::cast_possible_truncation, reason = "small sizes and levels")]
mod tests {
    use super::*;
    use image::DynamicImage;

    /// Labels are turned exactly as the image crate turns pictures.
    #[test]
    fn labels_turn_as_photos_do() {
        let labels = Array2::from_shape_fn((3, 5), |(y, x)| (10 * y + x) as u32);
        for turn in (1..=8).filter_map(Orientation::from_exif) {
            let picture = image::GrayImage::from_fn(5, 3, |x, y| image::Luma([labels[[y as usize, x as usize]] as u8]));
            let mut picture = DynamicImage::ImageLuma8(picture);
            picture.apply_orientation(turn);
            let picture = picture.into_luma8();
            let wanted = Array2::from_shape_fn((picture.height() as usize, picture.width() as usize), |(y, x)| {
                u32::from(picture.get_pixel(x as u32, y as u32)[0])
            });
            assert_eq!(turned(labels.clone(), turn), wanted, "{turn:?}");
        }
    }
}
