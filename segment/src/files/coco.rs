//! Outlines as COCO annotations, which most labelling tools and networks write.

use std::io::{self, Write};

use ndarray::Array2;
use serde_json::{Value, json};

use crate::conversions::whole_part;
use crate::files::drawn::Drawing;
use crate::labels::outline::{Outline, Ring, fill_outlines, outlines};

/// Outlines of the annotations of the image that has the photo's size, (height, width), or of several such the photo's
/// name: polygons or run-length masks. Numbers are the annotations' ids if these are distinct, else from 1.
pub(crate) fn parse(file: &Value, size: (usize, usize), name: Option<&str>) -> Result<Drawing, String> {
    // Networks write the list of annotations alone.
    let list = file.as_array().or_else(|| file["annotations"].as_array());
    let annotations = list.map_or(&[][..], Vec::as_slice);
    if annotations.iter().any(|a| a.get("segments_info").is_some()) {
        return Err("it is COCO's panoptic format, whose outlines are in a PNG beside it; give that PNG".into());
    }
    let chosen = chosen_image(file, size, name)?;
    let ours: Vec<&Value> = annotations
        .iter()
        .filter(|a| chosen.is_none() || key(&a["image_id"]) == chosen || a.get("image_id").is_none())
        .collect();
    let mut found = Vec::new();
    let mut left_out = Vec::new();
    for annotation in ours {
        let at = |what: &str| format!("annotation {}: {what}", annotation["id"]);
        let id = key(&annotation["id"]).and_then(|id| id.parse::<u32>().ok());
        let segmentation = &annotation["segmentation"];
        let components = if let Some(rings) = segmentation.as_array() {
            rings
                .iter()
                .map(flat_ring)
                .collect::<Option<Vec<_>>>()
                .ok_or_else(|| at("the polygon is not a list of numbers x, y, x, y, ..."))?
        } else if segmentation.is_object() {
            runs(segmentation, size).ok_or_else(|| at("the run-length mask is damaged or not of the photo's size"))?
        } else {
            Vec::new()
        };
        if components.iter().flatten().all(|ring| ring.len() < 3) {
            left_out.push("without an outline (boxes, points)");
        } else {
            found.push((id, components));
        }
    }
    Ok(Drawing::numbered(found).with_left_out(&left_out))
}

/// An id, whether it is a number or text.
fn key(id: &Value) -> Option<String> {
    match id {
        Value::String(text) => Some(text.trim().to_owned()),
        Value::Number(number) => Some(number.to_string().trim_end_matches(".0").to_owned()),
        _ => None,
    }
}

/// The id of the image that is the photo; `None` if the file lists no images.
fn chosen_image(file: &Value, (height, width): (usize, usize), name: Option<&str>) -> Result<Option<String>, String> {
    let Some(images) = file["images"].as_array().filter(|images| !images.is_empty()) else {
        return Ok(None);
    };
    let side = |value: &Value| key(value).and_then(|n| n.parse::<f64>().ok()).filter(|n| *n > 0.0);
    let has = |image: &Value, key: &str, wanted: usize| {
        side(&image[key]).is_none_or(|n| n.to_bits() == (wanted as f64).to_bits())
    };
    let fitting: Vec<&Value> = images
        .iter()
        .filter(|i| has(i, "height", height) && has(i, "width", width))
        .collect();
    let is_named = |image: &&&Value| {
        let file = image["file_name"].as_str().unwrap_or("");
        name.is_some() && file.rsplit(['/', '\\']).next() == name
    };
    let named: Vec<&&Value> = fitting.iter().filter(is_named).collect();
    match (fitting.as_slice(), named.as_slice()) {
        ([one], _) => Ok(key(&one["id"])),
        (_, [one]) => Ok(key(&one["id"])),
        ([], _) if images.len() == 1 => Err(format!(
            "its image is {}x{} pixels, the photo {width}x{height}; export the annotations at the photo's size",
            images[0]["width"], images[0]["height"]
        )),
        ([], _) => Err(format!(
            "it contains annotations of {} images, none of the photo's size of {width}x{height}; export the annotations of the photo",
            images.len()
        )),
        _ => Err(format!(
            "it contains annotations of {} images of the photo's size of {width}x{height}, and not exactly one with the photo's name; export those of one image",
            fitting.len()
        )),
    }
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
