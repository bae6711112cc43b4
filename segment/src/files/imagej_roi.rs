//! Outlines as ImageJ's regions of interest, the format of Fiji's ROI manager and StarDist.
//!
//! The format is that of ImageJ's class `RoiDecoder`: 64 bytes of header, big endian, then corners as 16-bit numbers
//! from the box's corner, as floats, or as a path of segments.

use std::collections::BTreeSet;
use std::io::{self, Cursor, Read, Seek, Write};

use zip::{CompressionMethod, ZipArchive, ZipWriter, write::SimpleFileOptions};

use crate::conversions::{index, single, whole_part};
use crate::files::drawn::{Drawing, ellipse, opened, rectangle};
use crate::labels::outline::{Outline, Ring};
use stereology_metrics::Finding;

/// First bytes of a region.
pub(crate) const MAGIC: &[u8] = b"Iout";

/// Bytes before the corners.
const HEADER: usize = 64;
/// Most bytes of all regions of an archive, unpacked: some million corners.
const LARGEST: u64 = 64 << 20;
/// Bit of the options for corners in floats.
const SUB_PIXEL: u16 = 128;
/// Version written: that of ImageJ 1.52.
const VERSION: u16 = 227;
const TRACED: u8 = 8;
const RECTANGLE: u8 = 1;
const OVAL: u8 = 2;

/// A region: its rings, and the number of its slice, 0 if it belongs to all.
pub(crate) struct Region {
    /// Empty for points and lines.
    components: Vec<Vec<Ring>>,
    slice: u32,
}

/// Outlines of the regions of an archive, with the numbers N of names `label-N` if all have one, else numbered from 1;
/// points and lines are left out. Of regions of several slices, those of the first one are taken.
pub(crate) fn parse_archive(bytes: &[u8]) -> Result<Drawing, String> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| e.to_string())?;
    let mut found: Vec<(Option<u32>, Region)> = Vec::new();
    let mut left_out = Vec::new();
    let mut taken = 0;
    for i in 0..archive.len() {
        let entry = archive.by_index(i).map_err(|e| e.to_string())?;
        let name = entry.name().map_err(|e| e.to_string())?.into_owned();
        let lower = name.to_ascii_lowercase();
        if lower.ends_with(".npy") {
            return Err(
                "it is a NumPy archive of arrays, not an ImageJ archive of regions; save the label array alone as .npy"
                    .into(),
            );
        }
        // macOS adds an entry of its own beside each.
        let own = lower.rsplit('/').next().is_some_and(|file| file.starts_with("._"));
        if !lower.ends_with(".roi") || own || lower.starts_with("__macosx/") {
            continue;
        }
        let mut bytes = Vec::new();
        entry
            .take(LARGEST - taken + 1)
            .read_to_end(&mut bytes)
            .map_err(|e| format!("{name}: {e}"))?;
        taken += bytes.len() as u64;
        if taken > LARGEST {
            return Err(format!(
                "its regions have more than {} megabytes; divide the archive",
                LARGEST >> 20
            ));
        }
        let region = parse(&bytes).map_err(|e| format!("{name}: {e}"))?;
        if region.components.is_empty() {
            left_out.push("points or lines");
        } else {
            found.push((number(&lower), region));
        }
    }
    let slices: BTreeSet<u32> = found.iter().map(|f| f.1.slice).filter(|s| *s > 0).collect();
    let finding = (slices.len() > 1).then(|| slices.first()).flatten().map(|first| {
        let others = found.iter().filter(|f| f.1.slice > 0 && f.1.slice != *first).count();
        Finding::new(
            "other-slices",
            format!(
                "the regions belong to {} slices; the {others} of slices other than {first} were left out",
                slices.len()
            ),
        )
    });
    if let Some(first) = slices.first() {
        found.retain(|f| f.1.slice == 0 || f.1.slice == *first);
    }
    let outlines = found.into_iter().map(|(id, region)| (id, region.components));
    let mut drawing = Drawing::numbered(outlines.collect()).with_left_out(&left_out);
    drawing.findings.extend(finding);
    Ok(drawing)
}

/// The outline of a file of a single region.
pub(crate) fn parse_file(bytes: &[u8]) -> Result<Drawing, String> {
    let components = parse(bytes)?.components;
    if components.is_empty() {
        return Ok(Drawing::default().with_left_out(&["points or lines"]));
    }
    Ok(Drawing::numbered(vec![(None, components)]))
}

/// N of `label-N.roi`.
fn number(name: &str) -> Option<u32> {
    let name = name.rsplit('/').next()?;
    name.strip_prefix("label-")?
        .strip_suffix(".roi")?
        .parse()
        .ok()
        .filter(|n| *n > 0)
}

fn parse(region: &[u8]) -> Result<Region, String> {
    if !region.starts_with(MAGIC) || region.len() < HEADER {
        return Err("is not an ImageJ region".into());
    }
    let cut = || "the region is truncated".to_owned();
    let short = |at: usize| -> Result<u16, String> {
        let bytes = region.get(at..at + 2).ok_or_else(cut)?;
        Ok(u16::from_be_bytes([bytes[0], bytes[1]]))
    };
    let signed = |at: usize| short(at).map(|v| f64::from(v.cast_signed()));
    let long = |at: usize| -> Result<u32, String> { Ok(u32::from(short(at)?) << 16 | u32::from(short(at + 2)?)) };
    let float = |at: usize| -> Result<f64, String> {
        let v = f64::from(f32::from_bits(long(at)?));
        if v.is_finite() {
            Ok(v)
        } else {
            Err("a corner is not a number".into())
        }
    };
    let (top, left, bottom, right) = (signed(8)?, signed(10)?, signed(12)?, signed(14)?);
    let path = long(36)? as usize;
    // ImageJ's position counts slices; hyperstacks have channel, slice and frame in a second header.
    let second = long(60)? as usize;
    let of_stack = |k: usize| {
        if second > 0 {
            long(second.saturating_add(4 + 4 * k)).unwrap_or(0)
        } else {
            0
        }
    };
    let [z, t] = [of_stack(1), of_stack(2)];
    let slice = match (z, t) {
        (0, 0) => long(56)?,
        // Distinct for frames of up to 65,536 slices.
        (z, t) => t.saturating_mul(1 << 16).saturating_add(z),
    };
    let of = |components| Region { components, slice };
    if path > 0 {
        return segments(path, &float).map(of);
    }
    let sub_pixel = short(50)? & SUB_PIXEL != 0 && short(4)? >= 222;
    let bounds = match region[6] {
        RECTANGLE if sub_pixel => [float(18)?, float(22)?, float(26)?, float(30)?],
        // ImageJ rounds the corner down to a whole pixel.
        OVAL if sub_pixel => [float(18)?.floor(), float(22)?.floor(), float(26)?, float(30)?],
        _ => [left, top, right - left, bottom - top],
    };
    let [x, y, w, h] = bounds;
    let ring: Ring = match region[6] {
        RECTANGLE => rectangle([x, y], [w, h]),
        OVAL => ellipse([x + 0.5 * w, y + 0.5 * h], [0.5 * w, 0.5 * h], 0.0),
        0 | 7 | 8 => {
            let n = match short(16)? {
                0 => long(18)? as usize, // more than 65,535 corners
                n => usize::from(n),
            };
            if region.len() < n.saturating_mul(if sub_pixel { 12 } else { 4 }).saturating_add(HEADER) {
                return Err(cut());
            }
            let corner = |i: usize| -> Result<[f64; 2], String> {
                if sub_pixel {
                    let start = HEADER + 4 * n;
                    Ok([float(start + 4 * i)?, float(start + 4 * (n + i))?])
                } else {
                    Ok([left + signed(HEADER + 2 * i)?, top + signed(HEADER + 2 * (n + i))?])
                }
            };
            (0..n).map(corner).collect::<Result<_, _>>()?
        }
        _ => return Ok(of(Vec::new())),
    };
    Ok(of(vec![vec![ring]]))
}

/// Rings of a path of moves, lines and curves; all belong to one component, filled by the even-odd rule.
fn segments(count: usize, float: &impl Fn(usize) -> Result<f64, String>) -> Result<Vec<Vec<Ring>>, String> {
    let mut rings: Vec<Ring> = Vec::new();
    let mut i = 0;
    while i < count {
        let value = |k: usize| float(HEADER + 4 * (i + k));
        let kind = whole_part(value(0)?);
        let points = match kind {
            0 | 1 => 1,
            2 => 2,
            3 => 3,
            4 => 0,
            _ => return Err("a segment of the path is of no known kind".into()),
        };
        let mut corners = Vec::new();
        for k in 0..points {
            corners.push([value(1 + 2 * k)?, value(2 + 2 * k)?]);
        }
        match (kind, corners.as_slice(), rings.last_mut()) {
            (0, &[to], _) => rings.push(vec![to]),
            (1, &[to], Some(ring)) => ring.push(to),
            (2 | 3, control, Some(ring)) => curve(ring, control),
            _ => {}
        }
        i += 1 + 2 * points;
    }
    Ok(vec![rings.into_iter().map(opened).collect()])
}

/// Appends a Bézier curve from the ring's last corner by de Casteljau's construction, in eight steps.
fn curve(ring: &mut Ring, control: &[[f64; 2]]) {
    let Some(&from) = ring.last() else { return };
    for step in 1..=8 {
        let t = f64::from(step) / 8.0;
        let mut points = vec![from];
        points.extend(control);
        while points.len() > 1 {
            points = points
                .windows(2)
                .map(|w| [w[0][0] + t * (w[1][0] - w[0][0]), w[0][1] + t * (w[1][1] - w[0][1])])
                .collect();
        }
        ring.extend(points);
    }
}

/// Writes an archive of one region a label, named `label-N.roi`: a traced polygon, or a path for labels with holes or
/// in components.
pub(crate) fn write<W: Write + Seek>(out: W, outlines: &[Outline]) -> io::Result<()> {
    let mut archive = ZipWriter::new(out);
    // The date is the format's first day: files hold no times.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(zip::DateTime::default());
    for outline in outlines {
        archive.start_file(format!("label-{}.roi", outline.id), options)?;
        archive.write_all(&region(outline))?;
    }
    archive.finish()?;
    Ok(())
}

/// A number of the header: corners lie within 32,767 pixels, which is checked before anything is written, and `TRACED`
/// regions have fewer than 2¹⁶ corners.
fn short(v: f64) -> u16 {
    u16::try_from(whole_part(v)).unwrap_or(u16::MAX)
}

fn region(outline: &Outline) -> Vec<u8> {
    let corners = || outline.components.iter().flatten().flatten();
    let [left, top, right, bottom] = corners().fold([f64::INFINITY, f64::INFINITY, 0.0, 0.0], |b: [f64; 4], c| {
        [b[0].min(c[0]), b[1].min(c[1]), b[2].max(c[0]), b[3].max(c[1])]
    });
    let mut bytes = vec![0_u8; HEADER];
    let put = |bytes: &mut Vec<u8>, at: usize, v: u16| bytes[at..at + 2].copy_from_slice(&v.to_be_bytes());
    bytes[..4].copy_from_slice(MAGIC);
    put(&mut bytes, 4, VERSION);
    for (at, v) in [(8, top), (10, left), (12, bottom), (14, right)] {
        put(&mut bytes, at, short(v));
    }
    match outline.components.as_slice() {
        [component] if component.len() == 1 && component[0].len() < 1 << 16 => {
            bytes[6] = TRACED;
            put(&mut bytes, 16, short(component[0].len() as f64));
            for axis in 0..2 {
                let from = [left, top][axis];
                component[0]
                    .iter()
                    .for_each(|c| bytes.extend(short(c[axis] - from).to_be_bytes()));
            }
        }
        components => {
            bytes[6] = RECTANGLE;
            let mut path: Vec<f32> = Vec::new();
            for ring in components.iter().flatten() {
                for (i, c) in ring.iter().enumerate() {
                    path.extend([if i == 0 { 0.0 } else { 1.0 }, single(c[0]), single(c[1])]);
                }
                path.push(4.0);
            }
            bytes[36..40].copy_from_slice(&index(path.len()).to_be_bytes());
            path.iter().for_each(|v| bytes.extend(v.to_be_bytes()));
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(kind: u8, bounds: [u16; 4], corners: u16) -> Vec<u8> {
        let mut bytes = vec![0; HEADER];
        bytes[..4].copy_from_slice(MAGIC);
        bytes[5] = 227;
        bytes[6] = kind;
        for (at, v) in (8..).step_by(2).zip(bounds.into_iter().chain([corners])) {
            bytes[at..at + 2].copy_from_slice(&v.to_be_bytes());
        }
        bytes
    }

    /// Rectangles, ovals and points as ImageJ writes them; a region cut short is refused.
    #[test]
    fn kinds() {
        let area = |region: &[u8]| {
            let components = parse(region).unwrap().components;
            (!components.is_empty()).then(|| Outline { id: 1, components }.area())
        };
        assert_eq!(area(&header(1, [2, 3, 7, 13], 0)), Some(50.0));
        let oval = area(&header(2, [0, 0, 20, 10], 0)).unwrap();
        assert!((oval / (std::f64::consts::PI * 50.0) - 1.0).abs() < 1e-3);
        assert_eq!(area(&header(10, [0, 0, 0, 0], 1)), None);
        assert!(parse(&header(7, [0, 0, 5, 5], 4)).is_err());
        let mut float = header(7, [0, 0, 5, 5], 3);
        float[50..52].copy_from_slice(&SUB_PIXEL.to_be_bytes());
        float.extend([0; 12]);
        [0.5_f32, 4.5, 0.5, 1.0, 1.0, 3.0]
            .iter()
            .for_each(|v| float.extend(v.to_be_bytes()));
        assert_eq!(area(&float), Some(4.0));
    }
}
