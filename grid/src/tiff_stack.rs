//! TIFF with one page per z slice, laid out as ImageJ's stacks: the samples of all pages in one block, then the
//! directories.
//!
//! In a file that declares itself an ImageJ stack, ImageJ and other readers use only the first directory and expect the
//! samples of all pages without a gap.

use crate::element::Element;
use crate::length_unit::LengthUnit;
use crate::volume_shape::VolumeShape;
use crate::voxel_size::VoxelSize;

/// The bytes before and after the samples: of a standard TIFF, or of a BigTIFF if 32-bit offsets do not suffice.
pub(crate) fn frame<T: Element>(shape: &VolumeShape, size: &VoxelSize, bytes: u64) -> (Vec<u8>, Vec<u8>) {
    let resolution = Resolution::of(size);
    // A page's directory takes some 300 bytes.
    let big = bytes.saturating_add(1024 * shape.nz as u64) > u64::from(u32::MAX);
    let kind = Kind { big };
    let start = kind.head_length();
    let directories = (start + bytes).next_multiple_of(2);
    let head = if big {
        [b"II\x2b\0\x08\0\0\0", &directories.to_le_bytes()[..]].concat()
    } else {
        [b"II\x2a\0", kind.offset(directories).as_slice()].concat()
    };
    let mut tail = vec![0; usize::from(directories > start + bytes)];
    let slab = bytes / shape.nz as u64;
    for z in 0..shape.nz {
        let at = directories + (tail.len() as u64 - (directories - start - bytes));
        let mut page = Directory::default();
        page.describe::<T>(kind, shape, &resolution, start + z as u64 * slab, slab);
        if z == 0 {
            page.add(IMAGE_DESCRIPTION, ASCII, description(shape.nz, &resolution));
        }
        tail.extend(page.written(kind, at, z + 1 == shape.nz));
    }
    (head, tail)
}

/// The description from which ImageJ reads the number of slices, their spacing and its unit.
fn description(slices: usize, resolution: &Resolution) -> Vec<u8> {
    let Resolution { spacing, name, .. } = resolution;
    let unit = name.map_or(String::new(), |name| format!("unit={name}\n"));
    let spacing = spacing[2];
    format!("ImageJ=1.54f\nimages={slices}\nslices={slices}\n{unit}spacing={spacing}\nloop=false\n\0").into_bytes()
}

/// The size of a voxel in a unit that TIFF knows, so that all readers agree.
struct Resolution {
    spacing: [f64; 3],
    /// 1: no unit, 2: inch, 3: centimetre.
    tag: u16,
    name: Option<&'static str>,
}

impl Resolution {
    fn of(size: &VoxelSize) -> Self {
        match size.unit {
            None => Self {
                spacing: size.sides,
                tag: 1,
                name: None,
            },
            Some(LengthUnit::Inch) => Self {
                spacing: size.sides,
                tag: 2,
                name: Some("inch"),
            },
            Some(unit) => Self {
                spacing: size
                    .sides
                    .map(|side| side / (LengthUnit::Centimetre.in_metres() / unit.in_metres())),
                tag: 3,
                name: Some("cm"),
            },
        }
    }
}

const IMAGE_WIDTH: u16 = 256;
const IMAGE_LENGTH: u16 = 257;
const BITS_PER_SAMPLE: u16 = 258;
const COMPRESSION: u16 = 259;
const PHOTOMETRIC: u16 = 262;
const IMAGE_DESCRIPTION: u16 = 270;
const STRIP_OFFSETS: u16 = 273;
const SAMPLES_PER_PIXEL: u16 = 277;
const ROWS_PER_STRIP: u16 = 278;
const STRIP_BYTE_COUNTS: u16 = 279;
const X_RESOLUTION: u16 = 282;
const Y_RESOLUTION: u16 = 283;
const RESOLUTION_UNIT: u16 = 296;
const SAMPLE_FORMAT: u16 = 339;

const ASCII: u16 = 2;
const SHORT: u16 = 3;
const LONG: u16 = 4;
const RATIONAL: u16 = 5;
const LONG8: u16 = 16;

/// Standard TIFF has 32-bit offsets, BigTIFF 64-bit ones.
#[derive(Clone, Copy, Debug)]
struct Kind {
    big: bool,
}

impl Kind {
    fn head_length(self) -> u64 {
        if self.big { 16 } else { 8 }
    }

    /// An offset in the file; those of a standard TIFF are known to fit in 32 bits.
    fn offset(self, at: u64) -> Vec<u8> {
        let mut bytes = at.to_le_bytes().to_vec();
        bytes.truncate(self.offset_length());
        bytes
    }

    fn offset_length(self) -> usize {
        if self.big { 8 } else { 4 }
    }
}

/// The tags of a page and their values.
#[derive(Debug, Default)]
struct Directory {
    entries: Vec<(u16, u16, Vec<u8>)>,
}

impl Directory {
    fn add(&mut self, tag: u16, kind: u16, value: Vec<u8>) {
        self.entries.push((tag, kind, value));
    }

    fn describe<T: Element>(&mut self, kind: Kind, shape: &VolumeShape, resolution: &Resolution, at: u64, bytes: u64) {
        let VolumeShape { ny, nx, channels, .. } = *shape;
        let short = |value: u16| value.to_le_bytes().to_vec();
        let each = |value: u16| value.to_le_bytes().repeat(channels);
        let long = |n: usize| u32::try_from(n).unwrap_or(u32::MAX).to_le_bytes().to_vec();
        let place = if kind.big { LONG8 } else { LONG };
        self.add(IMAGE_WIDTH, LONG, long(nx));
        self.add(IMAGE_LENGTH, LONG, long(ny));
        self.add(BITS_PER_SAMPLE, SHORT, each(T::BITS));
        self.add(COMPRESSION, SHORT, short(1));
        self.add(PHOTOMETRIC, SHORT, short(if channels == 1 { 1 } else { 2 }));
        self.add(STRIP_OFFSETS, place, kind.offset(at));
        self.add(SAMPLES_PER_PIXEL, SHORT, short(if channels == 1 { 1 } else { 3 }));
        self.add(ROWS_PER_STRIP, LONG, long(ny));
        self.add(STRIP_BYTE_COUNTS, place, kind.offset(bytes));
        self.add(X_RESOLUTION, RATIONAL, per_unit(resolution.spacing[0]));
        self.add(Y_RESOLUTION, RATIONAL, per_unit(resolution.spacing[1]));
        self.add(RESOLUTION_UNIT, SHORT, short(resolution.tag));
        self.add(SAMPLE_FORMAT, SHORT, each(T::TIFF_SAMPLE));
    }

    /// The bytes of the directory at the even offset `at`, followed by the values that do not fit into their entries.
    fn written(mut self, kind: Kind, at: u64, last: bool) -> Vec<u8> {
        self.entries.sort_by_key(|entry| entry.0);
        let room = kind.offset_length();
        let entry = 4 + 2 * room;
        let count = self.entries.len() as u64;
        let mut out = if kind.big {
            count.to_le_bytes().to_vec()
        } else {
            count.to_le_bytes()[..2].to_vec()
        };
        let values = at + (out.len() + self.entries.len() * entry + room) as u64;
        let mut behind = Vec::new();
        for (tag, type_of, value) in &self.entries {
            let size = match *type_of {
                ASCII => 1,
                SHORT => 2,
                LONG => 4,
                _ => 8,
            };
            out.extend(tag.to_le_bytes());
            out.extend(type_of.to_le_bytes());
            out.extend(kind.offset((value.len() / size) as u64));
            if value.len() <= room {
                out.extend(value);
                out.extend(vec![0; room - value.len()]);
            } else {
                out.extend(kind.offset(values + behind.len() as u64));
                behind.extend(value);
                behind.resize(behind.len().next_multiple_of(2), 0);
            }
        }
        let next = if last { 0 } else { values + behind.len() as u64 };
        out.extend(kind.offset(next));
        out.extend(behind);
        out
    }
}

/// Pixels per unit of length as a fraction, to one part in a million if 32 bits allow it.
#[expect(clippy::cast_possible_truncation, reason = "clamped to the range of u32 above")]
fn per_unit(spacing: f64) -> Vec<u8> {
    let largest = f64::from(u32::MAX);
    let (n, d) = if spacing >= 1.0 {
        let n = (largest / spacing).floor().clamp(1.0, 1e6);
        (n, (n * spacing).round().clamp(1.0, largest))
    } else {
        let d = (largest * spacing).floor().clamp(1.0, 1e6);
        ((d / spacing).round().clamp(1.0, largest), d)
    };
    [(n as u32).to_le_bytes(), (d as u32).to_le_bytes()].concat()
}
