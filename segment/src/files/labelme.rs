//! Outlines as LabelMe writes them: one JSON file a picture, with a list of shapes.

use base64::{Engine, engine::general_purpose::STANDARD};
use serde_json::Value;

use crate::files::drawn::{Drawing, ellipse, rectangle};
use crate::files::label_raster::parse_image;
use crate::labels::outline::{Ring, outlines};

/// Outlines of the shapes: polygons, rectangles, circles and masks; shapes of one label and group are one profile.
/// Pixel corners are at whole numbers.
pub(crate) fn parse(file: &Value, (height, width): (usize, usize)) -> Result<Drawing, String> {
    let side = |key: &str| file[key].as_u64();
    if let (Some(h), Some(w)) = (side("imageHeight"), side("imageWidth"))
        && (h, w) != (height as u64, width as u64)
    {
        return Err(format!(
            "its image is {w}x{h} pixels, the photo {width}x{height}; export the annotations at the photo's size"
        ));
    }
    let mut found: Vec<(Option<u32>, Vec<Vec<Ring>>)> = Vec::new();
    let mut groups: Vec<(String, usize)> = Vec::new();
    let mut left_out = Vec::new();
    for (i, shape) in file["shapes"].as_array().into_iter().flatten().enumerate() {
        let Some(components) = components(shape).map_err(|what| format!("shape {i}: {what}"))? else {
            left_out.push("points or lines");
            continue;
        };
        let group = (!shape["group_id"].is_null()).then(|| format!("{} {}", shape["label"], shape["group_id"]));
        let earlier = group.as_ref().and_then(|g| groups.iter().find(|(name, _)| name == g));
        match earlier {
            Some((_, at)) => found[*at].1.extend(components),
            None => {
                groups.extend(group.map(|g| (g, found.len())));
                found.push((None, components));
            }
        }
    }
    Ok(Drawing::numbered(found).with_left_out(&left_out))
}

/// Rings of a shape; `None` for points and lines.
fn components(shape: &Value) -> Result<Option<Vec<Vec<Ring>>>, String> {
    let point = |p: &Value| Some([p.get(0)?.as_f64()?, p.get(1)?.as_f64()?]);
    let points: Option<Ring> = shape["points"].as_array().and_then(|p| p.iter().map(point).collect());
    let points = points.ok_or("its points are not pairs of numbers")?;
    let ring = match (shape["shape_type"].as_str().unwrap_or("polygon"), points.as_slice()) {
        ("polygon", [_, _, _, ..]) => points,
        ("rectangle", &[a, b]) => rectangle(a, [b[0] - a[0], b[1] - a[1]]),
        ("circle", &[centre, at]) => {
            let radius = (at[0] - centre[0]).hypot(at[1] - centre[1]);
            ellipse(centre, [radius; 2], 0.0)
        }
        ("mask", &[corner, ..]) => return mask(shape, corner).map(Some),
        ("polygon" | "point" | "points" | "line" | "linestrip", _) => return Ok(None),
        (other, _) => return Err(format!("a {other} of {} points", points.len())),
    };
    Ok(Some(vec![vec![ring]]))
}

/// Components of a mask: a PNG in base 64, placed at a corner.
fn mask(shape: &Value, [x, y]: [f64; 2]) -> Result<Vec<Vec<Ring>>, String> {
    let text = shape["mask"].as_str().ok_or("it has no mask")?;
    let png = STANDARD
        .decode(text)
        .map_err(|e| format!("its mask is no base 64 ({e})"))?;
    let mut labels = parse_image(&png, None)?.labels;
    labels.mapv_inplace(|l| u32::from(l != 0));
    let mut components = outlines(&labels).pop().map_or(Vec::new(), |o| o.components);
    for corner in components.iter_mut().flatten().flatten() {
        *corner = [corner[0] + x, corner[1] + y];
    }
    Ok(components)
}
