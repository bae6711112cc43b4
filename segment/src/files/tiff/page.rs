//! A page of a TIFF: its size, what its samples are, and where they are stored.

use super::directory::Directory;

/// What the samples of a pixel stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Photometric {
    /// Grey, 0 white.
    WhiteIsZero,
    /// Grey, 0 black.
    BlackIsZero,
    Rgb,
    /// Places in the page's colour map.
    Palette,
    Cmyk,
    /// Lightness and hue.
    YCbCr,
}

/// How a sample's bits are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Unsigned,
    Signed,
    Float,
}

/// A page of a TIFF.
pub(crate) struct Page<'a> {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Samples per pixel, opacity and others included.
    pub(crate) samples: usize,
    /// Bits per sample, 1 to 64.
    pub(crate) bits: usize,
    pub(crate) format: Format,
    pub(crate) photometric: Photometric,
    /// Meaning of the samples behind the colours: 1 and 2 are opacity, with colours multiplied by it or not.
    pub(crate) extra: Vec<u64>,
    /// Red, then green, then blue of every place of the palette.
    pub(crate) colour_map: Vec<u64>,
    /// EXIF's number of the orientation.
    pub(crate) orientation: u8,
    /// ICC profile.
    pub(crate) profile: Option<&'a [u8]>,
    /// A thumbnail or a level of a pyramid.
    pub(crate) reduced: bool,
    /// Images that follow without a directory of their own: ImageJ's stacks.
    pub(crate) stack: usize,
    pub(super) planar: bool,
    pub(super) compression: u64,
    pub(super) predictor: u64,
    pub(super) reversed_bits: bool,
    pub(super) big_endian: bool,
    pub(super) subsampling: [u64; 2],
    pub(super) tables: &'a [u8],
    /// Width and height of strips or tiles.
    pub(super) chunk: [usize; 2],
    pub(super) chunks: Vec<&'a [u8]>,
}

impl<'a> Page<'a> {
    /// The page of a directory of a file's bytes.
    pub(super) fn of(directory: &Directory<'a>, bytes: &'a [u8]) -> Result<Self, String> {
        let size = |tag| directory.number(tag).and_then(|n| usize::try_from(n).ok());
        let (Some(width @ 1..), Some(height @ 1..)) = (size(256), size(257)) else {
            return Err("the TIFF's page has no size".into());
        };
        let samples = size(277).unwrap_or(1);
        if !(1..=64).contains(&samples) {
            return Err(format!("the TIFF has {samples} samples per pixel"));
        }
        let bits = directory.numbers(258);
        let each = bits.first().copied().unwrap_or(1);
        if bits.iter().any(|b| *b != each) || !(1..=64).contains(&each) {
            return Err(format!(
                "the TIFF's samples have {bits:?} bits; save it with 8 or 16 bits each"
            ));
        }
        let format = match directory.number(339).unwrap_or(1) {
            2 => Format::Signed,
            3 if [16, 24, 32, 64].contains(&each) => Format::Float,
            1 | 4 => Format::Unsigned,
            other => return Err(format!("the TIFF's samples are of kind {other} with {each} bits")),
        };
        let photometric = match directory.number(262).unwrap_or(if samples < 3 { 1 } else { 2 }) {
            0 => Photometric::WhiteIsZero,
            1 | 4 | 32_803 | 34_892 => Photometric::BlackIsZero,
            2 => Photometric::Rgb,
            3 => Photometric::Palette,
            5 => Photometric::Cmyk,
            6 => Photometric::YCbCr,
            other => {
                let kind = match other {
                    8..=10 => "CIE Lab".to_owned(),
                    32_844 | 32_845 => "LogLuv".to_owned(),
                    other => format!("kind {other}"),
                };
                return Err(format!("the TIFF's colours are {kind}; save it as RGB or grey"));
            }
        };
        let tiled = directory.bytes(324).is_some();
        let chunk = if tiled {
            [size(322).unwrap_or(0), size(323).unwrap_or(0)]
        } else {
            [width, size(278).unwrap_or(height).min(height)]
        };
        // A strip or tile takes at most the place of the page, or of 4,096 x 4,096 pixels.
        let most = width.saturating_mul(height).saturating_mul(4).max(1 << 24);
        if chunk.contains(&0) || chunk[0].checked_mul(chunk[1]).is_none_or(|n| n > most) {
            return Err("the TIFF's strips or tiles have no sensible size".into());
        }
        let description = directory
            .bytes(270)
            .map_or(String::new().into(), String::from_utf8_lossy);
        let images = description.strip_prefix("ImageJ=").and_then(|text| {
            let line = text.lines().find_map(|line| line.strip_prefix("images="))?;
            line.trim().parse().ok()
        });
        Ok(Self {
            width,
            height,
            samples,
            bits: usize::try_from(each).unwrap_or(64),
            format,
            photometric,
            extra: directory.numbers(338),
            colour_map: directory.numbers(320),
            orientation: directory.number(274).and_then(|n| u8::try_from(n).ok()).unwrap_or(1),
            profile: directory.bytes(34_675),
            reduced: directory.number(254).unwrap_or(0) & 1 != 0 || directory.number(255) == Some(2),
            stack: images.unwrap_or(1),
            planar: directory.number(284) == Some(2) && samples > 1,
            compression: directory.number(259).unwrap_or(1),
            predictor: directory.number(317).unwrap_or(1),
            reversed_bits: directory.number(266) == Some(2),
            big_endian: directory.big_endian(),
            subsampling: match directory.numbers(530).as_slice() {
                &[x, y, ..] => [x, y],
                _ => [2, 2],
            },
            tables: directory.bytes(347).unwrap_or_default(),
            chunk,
            chunks: chunks(directory, bytes, tiled),
        })
    }

    /// Samples that are colour, in front of the others.
    pub(crate) fn colours(&self) -> usize {
        match self.photometric {
            Photometric::Rgb | Photometric::YCbCr => 3,
            Photometric::Cmyk => 4,
            _ => 1,
        }
    }

    /// Whether lightness and hue are converted to RGB when the page is decoded.
    pub(crate) fn converted(&self) -> bool {
        matches!(self.compression, 7 | 50_001) && !self.planar
    }

    /// Strips or tiles along rows and columns.
    pub(super) fn grid(&self) -> [usize; 2] {
        [self.width.div_ceil(self.chunk[0]), self.height.div_ceil(self.chunk[1])]
    }
}

/// The bytes of all strips or tiles, as far as they lie in the file.
fn chunks<'a>(directory: &Directory<'a>, bytes: &'a [u8], tiled: bool) -> Vec<&'a [u8]> {
    let [offsets, counts] = if tiled { [324, 325] } else { [273, 279] }.map(|tag| directory.numbers(tag));
    let whole = bytes.len() as u64;
    let length = |i: usize, offset: u64| match counts.get(i) {
        Some(count) if offsets.len() == counts.len() => *count,
        // Files of a single strip may not state its length.
        _ => whole.saturating_sub(offset),
    };
    let part = |(i, &offset): (usize, &u64)| {
        let end = offset.saturating_add(length(i, offset)).min(whole);
        let [start, end] = [offset, end].map(|n| usize::try_from(n).unwrap_or(usize::MAX));
        bytes.get(start..end).unwrap_or_default()
    };
    offsets.iter().enumerate().map(part).collect()
}
