//! Pictures as sRGB, whatever file they come from: the one reader of all photographs and example images.

use std::io::Cursor;

use image::metadata::Orientation;
use image::{DynamicImage, ImageBuffer, ImageDecoder, ImageFormat, ImageReader, Limits};
use stereology_metrics::Finding;

use super::colour_profile::Profile;
use super::decoding::{check_png, guarded, whole_jpeg};
use super::tiff::{Format, Page, Photometric, Samples, is_tiff, main_page};
use super::value_range::ValueRange;

/// A picture as sRGB of 8 or 16 bits, grey or colours, without opacity.
pub(crate) struct Picture {
    pub(crate) image: DynamicImage,
    /// How it is to be turned to be upright.
    pub(crate) orientation: Orientation,
    pub(crate) findings: Vec<Finding>,
}

/// A picture that is stored at [width, height].
#[derive(Debug, PartialEq)]
pub(crate) enum Refusal {
    /// More pixels than allowed.
    TooLarge([u32; 2]),
    /// Why it cannot be read.
    Unreadable(String),
}

impl From<String> for Refusal {
    fn from(reason: String) -> Self {
        Self::Unreadable(reason)
    }
}

/// What a decoder gives.
struct Decoded {
    image: DynamicImage,
    profile: Option<Vec<u8>>,
    orientation: Orientation,
    findings: Vec<Finding>,
    /// Whether samples of 16 bits are all of the range.
    full_range: bool,
}

/// Decodes the bytes of a file of at most `most` pixels.
pub(crate) fn decode(bytes: &[u8], most: u64) -> Result<Picture, Refusal> {
    let decoded = if is_tiff(bytes) {
        of_tiff(bytes, most)
    } else {
        of_other(bytes, most)
    }?;
    Ok(guarded(|| Ok(decoded.finished()))?)
}

/// Refuses a picture of more than `most` pixels.
fn check_size([width, height]: [u32; 2], most: u64) -> Result<(), Refusal> {
    if u64::from(width) * u64::from(height) > most {
        return Err(Refusal::TooLarge([width, height]));
    }
    Ok(())
}

/// PNG, JPEG, WebP, BMP or GIF.
fn of_other(bytes: &[u8], most: u64) -> Result<Decoded, Refusal> {
    let reason = |e: &dyn std::fmt::Display| e.to_string();
    let format = image::guess_format(bytes).map_err(|_| foreign(bytes))?;
    let bytes = match format {
        ImageFormat::Jpeg => whole_jpeg(bytes).ok_or("the file is truncated: the JPEG's end is missing".to_owned())?,
        ImageFormat::Png => {
            check_png(bytes)?;
            bytes
        }
        _ => bytes,
    };
    let header = || -> Result<[u32; 2], String> {
        let reader = ImageReader::with_format(Cursor::new(bytes), format);
        let (width, height) = reader.into_dimensions().map_err(|e| reason(&e))?;
        Ok([width, height])
    };
    check_size(guarded(header)?, most)?;
    let decode = || -> Result<Decoded, String> {
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        // The number of pixels is limited by `most`.
        reader.limits(Limits::no_limits());
        let mut decoder = reader.into_decoder().map_err(|e| reason(&e))?;
        let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
        let profile = decoder.icc_profile().unwrap_or(None);
        let image = DynamicImage::from_decoder(decoder).map_err(|e| reason(&e))?;
        Ok(Decoded {
            image,
            profile,
            orientation,
            findings: Vec::new(),
            full_range: false,
        })
    };
    Ok(guarded(decode)?)
}

/// Why the bytes are no picture that can be read, by what they are.
fn foreign(bytes: &[u8]) -> String {
    let at = |place: usize, magic: &[u8]| bytes.get(place..).is_some_and(|rest| rest.starts_with(magic));
    let kind = if at(4, b"ftyphei") || at(4, b"ftypmif1") || at(4, b"ftypavif") {
        "HEIC or AVIF"
    } else if at(0, b"\xff\x0a") || at(4, b"JXL ") {
        "JPEG XL"
    } else if at(4, b"jP  ") || at(0, b"\xff\x4f\xff\x51") {
        "JPEG 2000"
    } else if at(0, b"8BPS") {
        "Photoshop"
    } else if at(0, b"%PDF") {
        "PDF"
    } else {
        return "its first bytes are of no known image format".into();
    };
    format!("it is a file of {kind}; save it as PNG, TIFF or JPEG")
}

fn of_tiff(bytes: &[u8], most: u64) -> Result<Decoded, Refusal> {
    let (page, findings) = main_page(bytes, None)?;
    let side = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let size = [side(page.width), side(page.height)];
    check_size(size, most)?;
    let samples = guarded(|| page.read())?;
    let decoded = guarded(|| of_samples(&page, samples, size, findings))?;
    Ok(decoded)
}

/// Samples of a TIFF as a picture.
fn of_samples(page: &Page<'_>, samples: Samples, size: [u32; 2], findings: Vec<Finding>) -> Result<Decoded, String> {
    let mut out = Decoded {
        image: DynamicImage::new_luma8(0, 0),
        profile: page.profile.map(<[u8]>::to_vec),
        orientation: Orientation::from_exif(page.orientation).unwrap_or(Orientation::NoTransforms),
        findings,
        full_range: true,
    };
    let (colours, step) = (page.colours(), page.samples);
    let opacity = page
        .extra
        .iter()
        .position(|kind| matches!(kind, 1 | 2))
        .map(|i| (colours + i, page.extra[i] == 1));
    let opacity =
        opacity.or((page.extra.is_empty() && step == colours + 1 && colours != 4).then_some((colours, false)));
    if colours > step {
        return Err(format!(
            "the TIFF has {step} samples per pixel, its colours need {colours}"
        ));
    }
    if colours == 1 && step > 2 {
        return Err(format!(
            "the TIFF has {step} channels that are no colours; save one of them as grey"
        ));
    }
    let levels = levels_of(page, samples, colours, &mut out.findings);
    let pixels = levels.chunks_exact(step);
    let is_cmyk = page.photometric == Photometric::Cmyk;
    if is_cmyk
        && let Some(profile) = out.profile.as_deref().and_then(Profile::of)
        && let Some(rgb) = profile.of_cmyk(
            &levels
                .chunks_exact(step)
                .flat_map(|p| [0, 1, 2, 3].map(|c| byte(p[c])))
                .collect::<Vec<_>>(),
        )
    {
        out.profile = None;
        out.image = buffer(size, rgb).map(DynamicImage::ImageRgb8)?;
        return Ok(out);
    }
    let colour = |pixel: &[u16]| -> [u16; 3] {
        match page.photometric {
            Photometric::WhiteIsZero => [u16::MAX - pixel[0]; 3],
            Photometric::Cmyk => {
                let left = |ink: u16| u64::from(u16::MAX - ink);
                [0, 1, 2].map(|c| {
                    let level = (left(pixel[c]) * left(pixel[3]) + 32_767) / 65_535;
                    u16::try_from(level).unwrap_or(u16::MAX)
                })
            }
            // What is not compressed as JPEG was not converted when it was decoded.
            Photometric::YCbCr if !page.converted() => of_lightness_and_hue([pixel[0], pixel[1], pixel[2]]),
            _ if colours == 1 => [pixel[0]; 3],
            _ => [pixel[0], pixel[1], pixel[2]],
        }
    };
    let palette = page.photometric == Photometric::Palette;
    let look_up = |place: u16| {
        let count = page.colour_map.len() / 3;
        let small = page.colour_map.iter().all(|v| *v < 256);
        [0, 1, 2].map(|c| {
            let stored = page
                .colour_map
                .get(c * count + usize::from(place))
                .copied()
                .unwrap_or(0);
            u16::try_from(if small { stored * 257 } else { stored }).unwrap_or(u16::MAX)
        })
    };
    let rgba = pixels.flat_map(|pixel| {
        let [r, g, b] = if palette { look_up(pixel[0]) } else { colour(pixel) };
        let Some((at, multiplied)) = opacity else {
            return [r, g, b, u16::MAX];
        };
        let alpha = pixel[at];
        let straight = |c: u16| match (multiplied, alpha) {
            (true, 1..) => u16::try_from(u64::from(c) * 65_535 / u64::from(alpha)).unwrap_or(u16::MAX),
            _ => c,
        };
        [straight(r), straight(g), straight(b), alpha]
    });
    // Small samples are kept small.
    let narrow = page.bits <= 8 && page.format == Format::Unsigned;
    out.image = match (narrow, opacity.is_some(), colours == 1 && !palette) {
        (true, false, true) => DynamicImage::ImageLuma8(buffer(size, rgba.step_by(4).map(byte).collect())?),
        (false, false, true) => DynamicImage::ImageLuma16(buffer(size, rgba.step_by(4).collect())?),
        (true, _, _) => DynamicImage::ImageRgba8(buffer(size, rgba.map(byte).collect())?),
        (false, _, _) => DynamicImage::ImageRgba16(buffer(size, rgba.collect())?),
    };
    if opacity.is_none() && out.image.color().has_alpha() {
        out.image = match out.image {
            DynamicImage::ImageRgba8(_) => DynamicImage::ImageRgb8(out.image.into_rgb8()),
            _ => DynamicImage::ImageRgb16(out.image.into_rgb16()),
        };
    }
    Ok(out)
}

/// Samples as levels of 16 bits, places of a palette as they are; with a finding if their range was guessed.
fn levels_of(page: &Page<'_>, samples: Samples, colours: usize, findings: &mut Vec<Finding>) -> Vec<u16> {
    let step = page.samples;
    if page.photometric == Photometric::Palette {
        return match samples {
            Samples::Bytes(v) => v.into_iter().map(u16::from).collect(),
            Samples::Shorts(v) => v,
            _ => Vec::new(),
        };
    }
    let largest_of_bits = |bits: usize| (1_u32 << bits) - 1;
    let is_colour = |i: usize| i % step < colours;
    match samples {
        Samples::Bytes(v) => {
            let most = largest_of_bits(page.bits);
            let wide = |v: u8| u16::try_from(u32::from(v) * 65_535 / most).unwrap_or(u16::MAX);
            v.into_iter().map(wide).collect()
        }
        Samples::Shorts(mut v) => {
            let seen = v.iter().enumerate().filter(|(i, _)| is_colour(*i)).map(|(_, v)| *v);
            let range = if page.bits == 16 {
                ValueRange::of_shorts(seen.max().unwrap_or(0))
            } else {
                ValueRange {
                    black: 0.0,
                    white: f64::from(largest_of_bits(page.bits)),
                    finding: None,
                }
            };
            stretch(&mut v, &range, is_colour);
            findings.extend(range.finding);
            v
        }
        Samples::Whole(v) => spread(v.into_iter().map(|v| v as f64).collect(), false, is_colour, findings),
        Samples::Real(v) => spread(v, true, is_colour, findings),
    }
}

/// Stretches samples of 16 bits to a range; opacity keeps its own.
fn stretch(values: &mut [u16], range: &ValueRange, is_colour: impl Fn(usize) -> bool) {
    if range.white < f64::from(u16::MAX) {
        for (_, v) in values.iter_mut().enumerate().filter(|(i, _)| is_colour(*i)) {
            *v = range.level(f64::from(*v));
        }
    }
}

/// Other numbers as levels of 16 bits.
fn spread(values: Vec<f64>, float: bool, is_colour: impl Fn(usize) -> bool, findings: &mut Vec<Finding>) -> Vec<u16> {
    let part = |colour: bool| {
        let chosen = values.iter().enumerate().filter(|(i, _)| is_colour(*i) == colour);
        ValueRange::of_numbers(chosen.map(|(_, v)| *v), float)
    };
    let range = [false, true].map(part);
    let levels = values
        .iter()
        .enumerate()
        .map(|(i, v)| range[usize::from(is_colour(i))].level(*v))
        .collect();
    let [_, of_colours] = range;
    findings.extend(of_colours.finding);
    levels
}

/// Colours of lightness and hue, ITU-R BT.601 with all levels in use.
fn of_lightness_and_hue([y, cb, cr]: [u16; 3]) -> [u16; 3] {
    let [y, cb, cr] = [f64::from(y), f64::from(cb) - 32_896.0, f64::from(cr) - 32_896.0];
    let range = ValueRange {
        black: 0.0,
        white: 65_535.0,
        finding: None,
    };
    [y + 1.402 * cr, y - 0.344_136 * cb - 0.714_136 * cr, y + 1.772 * cb].map(|v| range.level(v))
}

/// A level of 16 bits as one of 8, rounded.
fn byte(level: u16) -> u8 {
    u8::try_from((u32::from(level) + 128) / 257).unwrap_or(u8::MAX)
}

fn buffer<P: image::Pixel>(
    [width, height]: [u32; 2],
    samples: Vec<P::Subpixel>,
) -> Result<ImageBuffer<P, Vec<P::Subpixel>>, String> {
    ImageBuffer::from_raw(width, height, samples).ok_or_else(|| "it has fewer samples than pixels".into())
}

impl Decoded {
    /// Guesses the range of 16 bits, applies the profile, and lays the picture over white.
    fn finished(mut self) -> Picture {
        if !self.full_range {
            self.guess_range();
        }
        if let Some(bytes) = self.profile.take() {
            match Profile::of(&bytes) {
                Some(profile) => {
                    let (image, finding) = profile.applied(self.image);
                    self.image = image;
                    self.findings.extend(finding);
                }
                None => self.findings.push(Finding::new(
                    "colour-profile",
                    "the picture's colour profile is damaged; its colours were taken as sRGB",
                )),
            }
        }
        let (image, through) = over_white(self.image);
        if through > 0 {
            let pixels = f64::from(image.width()) * f64::from(image.height());
            self.findings.push(Finding::new(
                "alpha-over-white",
                format!(
                    "{:.1} % of the photo's pixels are transparent and were composited over white; save it without transparency if they are not meant to be white",
                    100.0 * through as f64 / pixels
                ),
            ));
        }
        Picture {
            image,
            orientation: self.orientation,
            findings: self.findings,
        }
    }

    fn guess_range(&mut self) {
        let channels = usize::from(self.image.color().channel_count());
        let colours = channels - usize::from(self.image.color().has_alpha());
        let samples: &mut [u16] = match &mut self.image {
            DynamicImage::ImageLuma16(image) => image,
            DynamicImage::ImageLumaA16(image) => image,
            DynamicImage::ImageRgb16(image) => image,
            DynamicImage::ImageRgba16(image) => image,
            _ => return,
        };
        let is_colour = |i: usize| i % channels < colours;
        let seen = samples
            .iter()
            .enumerate()
            .filter(|(i, _)| is_colour(*i))
            .map(|(_, v)| *v);
        let range = ValueRange::of_shorts(seen.max().unwrap_or(0));
        stretch(samples, &range, is_colour);
        self.findings.extend(range.finding);
    }
}

/// A picture over a white background, and the number of its pixels that were not opaque.
fn over_white(image: DynamicImage) -> (DynamicImage, usize) {
    if !image.color().has_alpha() {
        return (image, 0);
    }
    let short = image.color().bytes_per_pixel() / image.color().channel_count() > 1;
    let through = image.to_luma_alpha16().pixels().filter(|p| p[1] < u16::MAX).count();
    if !short {
        let image = image.into_rgba8();
        let out = image::RgbImage::from_fn(image.width(), image.height(), |x, y| {
            let [r, g, b, a] = image.get_pixel(x, y).0.map(u32::from);
            // Rounded; at most 255 because the weights sum to 255.
            image::Rgb([r, g, b].map(|c| u8::try_from((c * a + 255 * (255 - a) + 127) / 255).unwrap_or(255)))
        });
        return (out.into(), through);
    }
    let image = image.into_rgba16();
    let most = u64::from(u16::MAX);
    let out = ImageBuffer::from_fn(image.width(), image.height(), |x, y| {
        let [r, g, b, a] = image.get_pixel(x, y).0.map(u64::from);
        let over = |c: u64| u16::try_from((c * a + most * (most - a) + most / 2) / most).unwrap_or(u16::MAX);
        image::Rgb([over(r), over(g), over(b)])
    });
    (DynamicImage::ImageRgb16(out), through)
}
