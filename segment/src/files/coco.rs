//! Outlines as COCO annotations, which most labelling tools and networks write.

use std::io::{self, Write};

use ndarray::Array2;
use serde_json::{Value, json};

use crate::conversions::whole_part;
use crate::labels::outline::{Outline, Ring, fill_outlines, outlines};

/// Outlines of the annotations of the image whose size is (height, width): polygons or run-length masks. Numbers are
/// the annotations' ids if these are distinct, else from 1.
pub(crate) fn parse(file: &Value, (height, width): (usize, usize)) -> Result<Vec<Outline>, String> {
    let images = file["images"].as_array().map_or(&[][..], Vec::as_slice);
    let fits = |image: &&Value| {
        let size = (image["height"].as_u64(), image["width"].as_u64());
        size == (Some(height as u64), Some(width as u64))
    };
    let chosen = match images {
        [] => None,
        [one] if fits(&one) => one["id"].as_i64(),
        [one] => {
            return Err(format!(
                "its image is {}x{} pixels, the photo {width}x{height}; export the annotations at the photo's size",
                one["width"], one["height"]
            ));
        }
        several => {
            let mut fitting = several.iter().filter(fits);
            match (fitting.next(), fitting.next()) {
                (Some(one), None) => one["id"].as_i64(),
                _ => {
                    return Err(format!(
                        "it contains annotations of {} images, and not exactly one has the photo's size of {width}x{height}; export those of one image",
                        several.len()
                    ));
                }
            }
        }
    };
    let annotations = file["annotations"].as_array().map_or(&[][..], Vec::as_slice);
    let ours: Vec<&Value> = annotations
        .iter()
        .filter(|a| chosen.is_none() || a["image_id"].as_i64() == chosen)
        .collect();
    let mut ids: Vec<u32> = ours
        .iter()
        .filter_map(|a| a["id"].as_u64().and_then(|n| u32::try_from(n).ok()))
        .filter(|n| *n > 0)
        .collect();
    let mut sorted = ids.clone();
    sorted.sort_unstable();
    sorted.dedup();
    if sorted.len() != ours.len() {
        ids = (1..).take(ours.len()).collect();
    }
    let mut found = Vec::new();
    for (annotation, id) in ours.into_iter().zip(ids) {
        let at = |what: &str| format!("annotation {}: {what}", annotation["id"]);
        let segmentation = &annotation["segmentation"];
        let components = if let Some(rings) = segmentation.as_array() {
            rings
                .iter()
                .map(flat_ring)
                .collect::<Option<Vec<_>>>()
                .ok_or_else(|| at("the polygon is not a list of numbers x, y, x, y, ..."))?
        } else if segmentation.is_object() {
            runs(segmentation, (height, width))
                .ok_or_else(|| at("the run-length mask is damaged or not of the photo's size"))?
        } else {
            return Err(at("no segmentation; boxes are not outlines"));
        };
        found.push(Outline { id, components });
    }
    Ok(found)
}

/// A ring of numbers x, y, x, y, ...
fn flat_ring(ring: &Value) -> Option<Vec<Ring>> {
    let numbers = ring
        .as_array()?
        .iter()
        .map(Value::as_f64)
        .collect::<Option<Vec<f64>>>()?;
    let corners = numbers.chunks_exact(2);
    corners
        .remainder()
        .is_empty()
        .then(|| vec![corners.map(|c| [c[0], c[1]]).collect()])
}

/// Components of a run-length mask (runs of zeros and ones down the columns), given as numbers or as a compressed
/// string.
fn runs(segmentation: &Value, (height, width): (usize, usize)) -> Option<Vec<Vec<Ring>>> {
    let size = &segmentation["size"];
    if size[0].as_u64()? != height as u64 || size[1].as_u64()? != width as u64 {
        return None;
    }
    let counts: Vec<i64> = match &segmentation["counts"] {
        Value::String(code) => decode(code.as_bytes())?,
        counts => counts.as_array()?.iter().map(Value::as_i64).collect::<Option<_>>()?,
    };
    let mut inside = Vec::new();
    let mut at = 0_usize;
    for (i, run) in counts.into_iter().enumerate() {
        let end = at
            .checked_add(usize::try_from(run).ok()?)
            .filter(|end| *end <= height * width)?;
        if i % 2 == 1 && end > at {
            inside.push(at..end);
        }
        at = end;
    }
    // Only the columns from the first to the last pixel are needed.
    let (Some(first), Some(last)) = (inside.first(), inside.last()) else {
        return Some(Vec::new());
    };
    let (left, right) = (first.start / height, (last.end - 1) / height + 1);
    let mut mask = Array2::zeros((height, right - left));
    for k in inside.into_iter().flatten() {
        mask[[k % height, k / height - left]] = 1;
    }
    let mut components = outlines(&mask).pop().map_or(Vec::new(), |o| o.components);
    components
        .iter_mut()
        .flatten()
        .flatten()
        .for_each(|c| c[0] += left as f64);
    Some(components)
}

/// Decodes numbers in groups of five bits, offset by the character `0`; the sixth bit means that more groups follow.
/// From the fourth number on, differences to the number two before are stored.
fn decode(code: &[u8]) -> Option<Vec<i64>> {
    let mut numbers: Vec<i64> = Vec::new();
    let mut bytes = code.iter();
    while bytes.len() > 0 {
        let (mut value, mut shift) = (0_i64, 0_u32);
        loop {
            let bits = i64::from(bytes.next()?.checked_sub(48).filter(|b| *b < 64)?);
            value |= (bits & 31) << shift;
            shift += 5;
            if bits & 32 == 0 {
                if bits & 16 != 0 {
                    value |= -1_i64 << shift;
                }
                break;
            }
            if shift > 50 {
                return None;
            }
        }
        if let Some(before) = numbers.len().checked_sub(2).filter(|_| numbers.len() > 2) {
            value += numbers[before];
        }
        numbers.push(value);
    }
    Some(numbers)
}

/// Writes one annotation per line: polygons, or runs for labels with holes, which COCO's polygons cannot represent.
pub(crate) fn write(out: &mut dyn Write, outlines: &[Outline], (height, width): (usize, usize)) -> io::Result<()> {
    writeln!(
        out,
        r#"{{"images": [{{"id": 1, "width": {width}, "height": {height}, "file_name": ""}}],"#
    )?;
    writeln!(out, r#""categories": [{{"id": 1, "name": "profile"}}],"#)?;
    writeln!(out, r#""annotations": ["#)?;
    for (i, outline) in outlines.iter().enumerate() {
        let rings = || outline.components.iter().filter_map(|p| p.first());
        let bounds = rings()
            .flatten()
            .fold([f64::INFINITY, f64::INFINITY, 0.0, 0.0], |b: [f64; 4], c| {
                [b[0].min(c[0]), b[1].min(c[1]), b[2].max(c[0]), b[3].max(c[1])]
            });
        let holes = outline.components.iter().any(|p| p.len() > 1);
        let segmentation = if holes {
            json!({ "size": [height, width], "counts": counts(outline, bounds, (height, width)) })
        } else {
            json!(rings().map(|ring| ring.concat()).collect::<Vec<_>>())
        };
        let annotation = json!({
            "id": outline.id, "image_id": 1, "category_id": 1, "iscrowd": u8::from(holes),
            "area": outline.area(), "bbox": [bounds[0], bounds[1], bounds[2] - bounds[0], bounds[3] - bounds[1]],
            "segmentation": segmentation,
        });
        writeln!(out, "{annotation}{}", if i + 1 < outlines.len() { "," } else { "" })?;
    }
    writeln!(out, "]}}")
}

/// Runs of zeros and ones down the columns.
fn counts(outline: &Outline, bounds: [f64; 4], (height, width): (usize, usize)) -> Vec<usize> {
    let [left, top, right, bottom] = bounds.map(whole_part);
    let moved = |ring: &Ring| ring.iter().map(|c| [c[0] - left as f64, c[1] - top as f64]).collect();
    let components = outline
        .components
        .iter()
        .map(|p| p.iter().map(moved).collect())
        .collect();
    let (box_, _) = fill_outlines(&[Outline { id: 1, components }], (bottom - top, right - left));
    let mut counts = vec![0];
    let mut at = false;
    let mut push = |value: bool, run: usize, counts: &mut Vec<usize>| {
        if value != at {
            at = value;
            counts.push(0);
        }
        if let Some(last) = counts.last_mut() {
            *last += run;
        }
    };
    push(false, left * height, &mut counts);
    for column in box_.columns() {
        push(false, top, &mut counts);
        column.iter().for_each(|v| push(*v == 1, 1, &mut counts));
        push(false, height - bottom, &mut counts);
    }
    push(false, (width - right) * height, &mut counts);
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The string that pycocotools writes for the runs 5, 3, 10, 3, 100: differences of two before from the fourth on.
    #[test]
    fn compressed_runs_are_decoded() {
        // 5 -> '5', 3 -> '3', 10 -> ':', 3 - 3 = 0 -> '0', 100 - 10 = 90 -> 26 | more, 2.
        assert_eq!(decode(b"53:0j2").unwrap(), [5, 3, 10, 3, 100]);
        assert!(decode(b"5\x01").is_none() && decode(b"j").is_none());
    }
}
