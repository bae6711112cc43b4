//! Outlines as the VGG Image Annotator (VIA) writes them: regions of several pictures, by a key of name and size.

use serde_json::Value;

use crate::files::drawn::{Drawing, ellipse, rectangle};
use crate::labels::outline::Ring;

/// The pictures of a file: of a project, or of exported annotations; `None` if it is neither.
pub(crate) fn pictures(file: &Value) -> Option<Vec<&Value>> {
    let listed = file.get("_via_img_metadata").unwrap_or(file).as_object()?;
    let pictures: Vec<&Value> = listed.values().filter(|v| v.get("regions").is_some()).collect();
    (!pictures.is_empty() || file.get("_via_img_metadata").is_some()).then_some(pictures)
}

/// Outlines of the regions of the photo's picture: the only one, or that of the photo's name. Pixel corners are at
/// whole numbers.
pub(crate) fn parse(pictures: &[&Value], name: Option<&str>) -> Result<Drawing, String> {
    let is_named = |p: &&&Value| name.is_some() && p["filename"].as_str() == name;
    let named: Vec<&&Value> = pictures.iter().filter(is_named).collect();
    let picture = match (pictures, named.as_slice()) {
        ([one], _) => one,
        (_, [one]) => *one,
        _ => {
            return Err(format!(
                "it contains annotations of {} images, and not exactly one with the photo's name; export those of one image",
                pictures.len()
            ));
        }
    };
    let regions: Vec<&Value> = match &picture["regions"] {
        Value::Array(list) => list.iter().collect(),
        Value::Object(map) => map.values().collect(),
        _ => Vec::new(),
    };
    let mut found = Vec::new();
    let mut left_out = Vec::new();
    for (i, region) in regions.into_iter().enumerate() {
        match ring(&region["shape_attributes"]).map_err(|what| format!("region {i}: {what}"))? {
            Some(ring) => found.push((None, vec![vec![ring]])),
            None => left_out.push("points or lines"),
        }
    }
    Ok(Drawing::numbered(found).with_left_out(&left_out))
}

/// The ring of a region; `None` for points and lines.
fn ring(shape: &Value) -> Result<Option<Ring>, String> {
    let all = |keys: [&str; 4]| -> Result<[f64; 4], String> {
        let mut values = [0.0; 4];
        for (value, key) in values.iter_mut().zip(keys) {
            *value = shape[key]
                .as_f64()
                .ok_or_else(|| format!("its {key} is not a number"))?;
        }
        Ok(values)
    };
    Ok(Some(match shape["name"].as_str() {
        Some("polygon") => {
            let axis = |key: &str| -> Option<Vec<f64>> { shape[key].as_array()?.iter().map(Value::as_f64).collect() };
            match (axis("all_points_x"), axis("all_points_y")) {
                (Some(x), Some(y)) if x.len() == y.len() => x.into_iter().zip(y).map(|(x, y)| [x, y]).collect(),
                _ => return Err("its points are not numbers".into()),
            }
        }
        Some("rect") => {
            let [x, y, w, h] = all(["x", "y", "width", "height"])?;
            rectangle([x, y], [w, h])
        }
        Some("circle") => {
            let [x, y, r, _] = all(["cx", "cy", "r", "r"])?;
            ellipse([x, y], [r, r], 0.0)
        }
        Some("ellipse") => {
            let [x, y, a, b] = all(["cx", "cy", "rx", "ry"])?;
            ellipse([x, y], [a, b], shape["theta"].as_f64().unwrap_or(0.0))
        }
        Some("point" | "polyline" | "line") => return Ok(None),
        other => return Err(format!("a region of kind {other:?}")),
    }))
}
