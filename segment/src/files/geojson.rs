//! Outlines as GeoJSON polygons, as segmenteverygrain, QGIS and QuPath write them.

use std::io::{self, Write};

use serde_json::{Value, json};

use crate::files::drawn::{Drawing, opened};
use crate::labels::outline::{Outline, Ring};

/// Half a pixel: coordinates are those of pixel centres, from 0, as in segmenteverygrain.
const CENTRE: f64 = 0.5;

/// Outlines of the polygons of features, in collections, in lists, or one per line, with the integers of a property
/// `label` or `id` if every outline has its own, else numbered from 1. Features without a geometry, points and lines
/// are left out.
///
/// Where all y are at most 0, they are QGIS's of an image without coordinates: minus the distance from the upper edge,
/// pixel corners at whole numbers. QuPath's features, which have a type of object, have pixel corners at whole numbers
/// too.
pub(crate) fn parse(values: &[Value]) -> Result<Drawing, String> {
    let mut features = Vec::new();
    values.iter().try_for_each(|value| collect(value, &mut features))?;
    let mut found: Vec<(&Value, Vec<Vec<Ring>>)> = Vec::new();
    let mut left_out = Vec::new();
    for (i, feature) in features.into_iter().enumerate() {
        let geometry = if feature.get("geometry").is_some() {
            &feature["geometry"]
        } else {
            feature
        };
        let at = |what: &str| format!("feature {i}: {what}");
        let mut polygons: Vec<&Value> = Vec::new();
        let mut others = Vec::new();
        gather(geometry, &mut polygons, &mut others).map_err(|what| at(&what))?;
        if polygons.is_empty() {
            left_out.push(others.first().copied().unwrap_or("without a geometry"));
            continue;
        }
        let rings = polygons
            .into_iter()
            .map(|p| polygon(p).ok_or_else(|| at("coordinates are not rings of numbers")));
        found.push((feature, rings.collect::<Result<Vec<_>, _>>()?));
    }
    let mut all = found.iter().flat_map(|f| f.1.iter().flatten().flatten());
    let down = !found.is_empty() && all.all(|c| c[1] <= 0.0);
    let corners_are_whole = found.iter().any(|f| f.0["properties"].get("objectType").is_some());
    for corner in found.iter_mut().flat_map(|f| f.1.iter_mut().flatten().flatten()) {
        if down {
            corner[1] = -corner[1];
        } else if !corners_are_whole {
            *corner = corner.map(|v| v + CENTRE);
        }
    }
    let key = ["label", "id"].into_iter().find(|key| is_numbered(&found, key));
    let numbered = found
        .into_iter()
        .map(|(feature, components)| (key.and_then(|key| number(feature, key)), components));
    Ok(Drawing::numbered(numbered.collect()).with_left_out(&left_out))
}

/// The features of a value: of a collection, of a list, or itself.
fn collect<'a>(value: &'a Value, features: &mut Vec<&'a Value>) -> Result<(), String> {
    if let Some(list) = value.as_array() {
        return list.iter().try_for_each(|value| collect(value, features));
    }
    match value["type"].as_str() {
        Some("FeatureCollection") => {
            let list = value["features"].as_array();
            let list = list.ok_or("the feature collection has no list of features")?;
            list.iter().try_for_each(|value| collect(value, features))
        }
        Some(_) => {
            features.push(value);
            Ok(())
        }
        None => {
            let keys: Vec<&str> = value
                .as_object()
                .into_iter()
                .flatten()
                .map(|(key, _)| key.as_str())
                .take(8)
                .collect();
            Err(format!(
                "the JSON is none of GeoJSON, COCO, LabelMe or VIA (it has {}); export polygons in one of these formats",
                if keys.is_empty() {
                    "no keys".to_owned()
                } else {
                    keys.join(", ")
                }
            ))
        }
    }
}

/// The polygons of a geometry, and the kinds of others that it has.
fn gather<'a>(
    geometry: &'a Value,
    polygons: &mut Vec<&'a Value>,
    others: &mut Vec<&'static str>,
) -> Result<(), String> {
    if geometry.is_null() {
        return Ok(());
    }
    match geometry["type"].as_str() {
        Some("Polygon") => polygons.push(&geometry["coordinates"]),
        Some("MultiPolygon") => polygons.extend(geometry["coordinates"].as_array().into_iter().flatten()),
        Some("GeometryCollection") => {
            let parts = geometry["geometries"].as_array();
            parts
                .into_iter()
                .flatten()
                .try_for_each(|part| gather(part, polygons, others))?;
        }
        Some("Point" | "MultiPoint") => others.push("points"),
        Some("LineString" | "MultiLineString") => others.push("lines"),
        Some("Feature") => others.push("without a geometry"),
        Some(other) => return Err(format!("a {other}; only polygons have an area")),
        None => return Err("a geometry without a type".into()),
    }
    Ok(())
}

/// Rings of a polygon; the corner that closes a ring is dropped.
fn polygon(rings: &Value) -> Option<Vec<Ring>> {
    let ring = |ring: &Value| -> Option<Ring> {
        let corner = |c: &Value| Some([c.get(0)?.as_f64()?, c.get(1)?.as_f64()?]);
        Some(opened(ring.as_array()?.iter().map(corner).collect::<Option<Ring>>()?))
    };
    rings.as_array()?.iter().map(ring).collect()
}

/// The number of a feature.
fn number(feature: &Value, key: &str) -> Option<u32> {
    let given = feature["properties"][key].as_u64().or_else(|| feature[key].as_u64());
    given.and_then(|n| u32::try_from(n).ok()).filter(|n| *n > 0)
}

/// Whether all features have numbers of their own.
fn is_numbered(found: &[(&Value, Vec<Vec<Ring>>)], key: &str) -> bool {
    let mut given: Vec<u32> = found.iter().filter_map(|f| number(f.0, key)).collect();
    given.sort_unstable();
    given.dedup();
    given.len() == found.len()
}

/// Writes one feature per line.
pub(crate) fn write(out: &mut dyn Write, outlines: &[Outline]) -> io::Result<()> {
    let ring = |ring: &Ring| -> Vec<[f64; 2]> {
        let closed = ring.iter().chain(ring.first());
        closed.map(|c| c.map(|v| v - CENTRE)).collect()
    };
    writeln!(out, r#"{{"type": "FeatureCollection", "features": ["#)?;
    for (i, outline) in outlines.iter().enumerate() {
        let components: Vec<Vec<_>> = outline
            .components
            .iter()
            .map(|p| p.iter().map(ring).collect())
            .collect();
        let geometry = match components.as_slice() {
            [component] => json!({ "type": "Polygon", "coordinates": component }),
            _ => json!({ "type": "MultiPolygon", "coordinates": components }),
        };
        let feature =
            json!({ "type": "Feature", "id": outline.id, "properties": { "label": outline.id }, "geometry": geometry });
        writeln!(out, "{feature}{}", if i + 1 < outlines.len() { "," } else { "" })?;
    }
    writeln!(out, "]}}")
}
