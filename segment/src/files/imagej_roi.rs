//! Outlines as ImageJ's regions of interest, the format of Fiji's ROI manager and StarDist.
//!
//! The format is that of ImageJ's class `RoiDecoder`: 64 bytes of header, big endian, then corners as 16-bit numbers
//! from the box's corner, as floats, or as a path of segments.

use std::io::{self, Cursor, Read, Seek, Write};

use zip::{CompressionMethod, ZipArchive, ZipWriter, write::SimpleFileOptions};

use crate::conversions::{index, single, whole_part};
use crate::labels::outline::{Outline, Ring};

/// First bytes of a region.
pub(crate) const MAGIC: &[u8] = b"Iout";

/// Bytes before the corners.
const HEADER: usize = 64;
/// Most bytes of one region: some million corners.
const LARGEST: u64 = 64 << 20;
/// Corners that approximate an oval.
const OVAL: usize = 256;
/// Bit of the options for corners in floats.
const SUB_PIXEL: u16 = 128;
/// Version written: that of ImageJ 1.52.
const VERSION: u16 = 227;
const TRACED: u8 = 8;
const RECTANGLE: u8 = 1;

/// Outlines of the regions of an archive, with the numbers N of names `label-N` if all have one, else numbered from 1;
/// and how many regions have no area (points and lines), which are left out.
pub(crate) fn parse_archive(bytes: &[u8]) -> Result<(Vec<Outline>, usize), String> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| e.to_string())?;
    let mut found: Vec<(Option<u32>, Vec<Vec<Ring>>)> = Vec::new();
    let mut without_area = 0;
    for i in 0..archive.len() {
        let entry = archive.by_index(i).map_err(|e| e.to_string())?;
        let name = entry.name().map_err(|e| e.to_string())?.into_owned();
        if name.ends_with(".npy") {
            return Err(
                "it is a NumPy archive of arrays, not an ImageJ archive of regions; save the label array alone as .npy"
                    .into(),
            );
        }
        if !name.ends_with(".roi") {
            continue;
        }
        let mut region = Vec::new();
        entry
            .take(LARGEST)
            .read_to_end(&mut region)
            .map_err(|e| format!("{name}: {e}"))?;
        match parse(&region).map_err(|e| format!("{name}: {e}"))? {
            Some(components) => found.push((number(&name), components)),
            None => without_area += 1,
        }
    }
    let mut given: Vec<u32> = found.iter().filter_map(|f| f.0).collect();
    given.sort_unstable();
    given.dedup();
    let keep = given.len() == found.len();
    let outlines = (1..).zip(found).map(|(n, (id, components))| Outline {
        id: id.filter(|_| keep).unwrap_or(n),
        components,
    });
    Ok((outlines.collect(), without_area))
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

/// Rings of a region; `None` for points and lines.
pub(crate) fn parse(region: &[u8]) -> Result<Option<Vec<Vec<Ring>>>, String> {
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
    if path > 0 {
        return segments(path, &float).map(Some);
    }
    let ring: Ring = match region[6] {
        1 if short(50)? & SUB_PIXEL != 0 => {
            let (x, y, w, h) = (float(18)?, float(22)?, float(26)?, float(30)?);
            vec![[x, y], [x + w, y], [x + w, y + h], [x, y + h]]
        }
        1 => vec![[left, top], [right, top], [right, bottom], [left, bottom]],
        2 => {
            let (x, y, a, b) = (
                0.5 * (left + right),
                0.5 * (top + bottom),
                0.5 * (right - left),
                0.5 * (bottom - top),
            );
            let angle = |k: usize| std::f64::consts::TAU * k as f64 / OVAL as f64;
            (0..OVAL)
                .map(|k| [x + a * angle(k).cos(), y + b * angle(k).sin()])
                .collect()
        }
        0 | 7 | 8 => {
            let n = match short(16)? {
                0 => long(18)? as usize, // more than 65,535 corners
                n => usize::from(n),
            };
            let floats = short(50)? & SUB_PIXEL != 0 && short(4)? >= 222;
            if region.len() < HEADER + n * if floats { 12 } else { 4 } {
                return Err(cut());
            }
            let corner = |i: usize| -> Result<[f64; 2], String> {
                if floats {
                    let start = HEADER + 4 * n;
                    Ok([float(start + 4 * i)?, float(start + 4 * (n + i))?])
                } else {
                    Ok([left + signed(HEADER + 2 * i)?, top + signed(HEADER + 2 * (n + i))?])
                }
            };
            (0..n).map(corner).collect::<Result<_, _>>()?
        }
        _ => return Ok(None),
    };
    Ok(Some(vec![vec![ring]]))
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
    for ring in &mut rings {
        if ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
    }
    Ok(vec![rings])
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
            let components = parse(region).unwrap()?;
            Some(Outline { id: 1, components }.area())
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
