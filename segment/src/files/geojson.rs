//! Outlines as GeoJSON polygons, as segmenteverygrain and QGIS write them.

use std::io::{self, Write};

use serde_json::{Value, json};

use crate::labels::outline::{Outline, Ring};

/// Half a pixel: coordinates are those of pixel centres, from 0, as in segmenteverygrain.
const CENTRE: f64 = 0.5;

/// Outlines of the polygons of a feature collection, with the integers of a property `label` or `id` if every feature
/// has its own, else numbered from 1.
///
/// Where all y are at most 0, they are QGIS's of an image without coordinates: minus the distance from the upper edge,
/// pixel corners at whole numbers.
pub(crate) fn parse(file: &Value) -> Result<Vec<Outline>, String> {
    let single = [file.clone()];
    let features = match file["type"].as_str() {
        Some("FeatureCollection") => file["features"]
            .as_array()
            .ok_or("the feature collection has no list of features")?
            .as_slice(),
        _ => &single,
    };
    let mut components = Vec::new();
    for (i, feature) in features.iter().enumerate() {
        let geometry = if feature["geometry"].is_object() {
            &feature["geometry"]
        } else {
            feature
        };
        let at = |what: &str| format!("feature {i}: {what}");
        let polygons: Vec<&Value> = match geometry["type"].as_str() {
            Some("Polygon") => vec![&geometry["coordinates"]],
            Some("MultiPolygon") => geometry["coordinates"].as_array().into_iter().flatten().collect(),
            Some(other) => return Err(at(&format!("a {other}; only polygons have an area"))),
            None => return Err(at("no geometry")),
        };
        let rings = polygons
            .into_iter()
            .map(|p| polygon(p).ok_or_else(|| at("coordinates are not rings of numbers")));
        components.push(rings.collect::<Result<Vec<_>, _>>()?);
    }
    let mut corners = components.iter().flatten().flatten().flatten();
    if !components.is_empty() && corners.all(|c| c[1] <= 0.0) {
        components
            .iter_mut()
            .flatten()
            .flatten()
            .flatten()
            .for_each(|c| c[1] = -c[1]);
    } else {
        let all = components.iter_mut().flatten().flatten().flatten();
        all.for_each(|c| *c = c.map(|v| v + CENTRE));
    }
    let ids = numbers(features);
    Ok(ids
        .into_iter()
        .zip(components)
        .map(|(id, components)| Outline { id, components })
        .collect())
}

/// Rings of a polygon; the corner that closes a ring is dropped.
fn polygon(rings: &Value) -> Option<Vec<Ring>> {
    let ring = |ring: &Value| -> Option<Ring> {
        let corner = |c: &Value| Some([c.get(0)?.as_f64()?, c.get(1)?.as_f64()?]);
        let mut ring = ring.as_array()?.iter().map(corner).collect::<Option<Ring>>()?;
        if ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
        Some(ring)
    };
    rings.as_array()?.iter().map(ring).collect()
}

/// Labels of the features.
fn numbers(features: &[Value]) -> Vec<u32> {
    for key in ["label", "id"] {
        let number = |f: &Value| f["properties"][key].as_u64().or_else(|| f[key].as_u64());
        let given: Option<Vec<u32>> = features
            .iter()
            .map(|f| number(f).and_then(|n| u32::try_from(n).ok()).filter(|n| *n > 0))
            .collect();
        if let Some(given) = given {
            let mut sorted = given.clone();
            sorted.sort_unstable();
            sorted.dedup();
            if sorted.len() == given.len() {
                return given;
            }
        }
    }
    (1..).take(features.len()).collect()
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
