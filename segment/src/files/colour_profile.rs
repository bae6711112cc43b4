//! Colours of an embedded ICC profile as sRGB.

use image::{DynamicImage, ImageBuffer};
use moxcms::{ColorProfile, DataColorSpace, Layout, ProfileText, TransformOptions};
use stereology_metrics::Finding;

/// Levels of 8 bits by which a profile may differ from sRGB to be taken as sRGB: those of its rounding.
const SAME: u8 = 2;

/// A profile and the layout of pixels it is for.
pub(crate) struct Profile {
    profile: ColorProfile,
    name: String,
}

impl Profile {
    /// The profile of these bytes, if they are one of pictures in RGB, grey or CMYK.
    pub(crate) fn of(bytes: &[u8]) -> Option<Self> {
        let profile = ColorProfile::new_from_slice(bytes).ok()?;
        let name = match &profile.description {
            Some(ProfileText::PlainString(name)) => name.clone(),
            Some(ProfileText::Localizable(names)) => names.first().map_or_else(String::new, |n| n.value.clone()),
            Some(ProfileText::Description(name)) => name.ascii_string.clone(),
            None => String::new(),
        };
        let name = name.trim_matches(|c: char| c.is_whitespace() || c == '\0').to_owned();
        Some(Self { profile, name })
    }

    fn is(&self, space: DataColorSpace) -> bool {
        self.profile.color_space == space
    }

    /// Colours of CMYK pixels, 0 no ink, as sRGB; `None` if the profile is of another kind.
    pub(crate) fn of_cmyk(&self, cmyk: &[u8]) -> Option<Vec<u8>> {
        if !self.is(DataColorSpace::Cmyk) {
            return None;
        }
        let srgb = ColorProfile::new_srgb();
        let options = TransformOptions::default();
        let transform = self
            .profile
            .create_transform_8bit(Layout::Rgba, &srgb, Layout::Rgb, options);
        let mut out = vec![0; cmyk.len() / 4 * 3];
        transform.ok()?.transform(cmyk, &mut out).ok()?;
        Some(out)
    }

    /// The picture's colours as sRGB, and a finding if they changed.
    pub(crate) fn applied(&self, image: DynamicImage) -> (DynamicImage, Option<Finding>) {
        let name = if self.name.is_empty() {
            "without a name"
        } else {
            &self.name
        };
        let unused = |image, why: &str| {
            let what = format!("the picture's colour profile, {name}, {why}; the colours were taken as sRGB");
            (image, Some(Finding::new("colour-profile", what)))
        };
        let coloured = image.color().has_color();
        if self.is(DataColorSpace::Cmyk) {
            return unused(
                image,
                "is one of CMYK, and the file's CMYK colours were converted without it",
            );
        }
        let of_grey = self.is(DataColorSpace::Gray);
        if !(self.is(DataColorSpace::Rgb) || of_grey) || (of_grey && coloured) {
            return unused(image, "does not fit its pixels");
        }
        match self.is_srgb() {
            None => unused(image, "could not be applied"),
            Some(true) => (image, None),
            Some(false) => match self.converted(&image) {
                None => unused(image, "could not be applied"),
                Some(converted) => {
                    let what = format!("the picture's colours were converted from its colour profile, {name}, to sRGB");
                    (converted, Some(Finding::new("colour-profile", what)))
                }
            },
        }
    }

    /// Whether the profile leaves a lattice of colours as they are; `None` if it cannot be applied.
    fn is_srgb(&self) -> Option<bool> {
        let levels = [0_u8, 17, 40, 90, 128, 190, 225, 255];
        let colours: Vec<u8> = if self.is(DataColorSpace::Gray) {
            levels.iter().flat_map(|&v| [v; 3]).collect()
        } else {
            let two = |r: u8| levels.into_iter().flat_map(move |g| levels.map(move |b| [r, g, b]));
            levels.into_iter().flat_map(two).flatten().collect()
        };
        let lattice = image::RgbImage::from_raw(u32::try_from(colours.len() / 3).ok()?, 1, colours.clone())?;
        let seen = self.converted(&lattice.into())?.into_rgb8();
        Some(colours.iter().zip(seen.as_raw()).all(|(a, b)| a.abs_diff(*b) <= SAME))
    }

    fn converted(&self, image: &DynamicImage) -> Option<DynamicImage> {
        let (width, height) = (image.width(), image.height());
        let srgb = ColorProfile::new_srgb();
        let options = TransformOptions::default();
        let of_grey = self.is(DataColorSpace::Gray);
        let alpha = image.color().has_alpha();
        let (from, to) = match (of_grey, alpha) {
            (true, false) => (Layout::Gray, Layout::Rgb),
            (true, true) => (Layout::GrayAlpha, Layout::Rgba),
            (false, false) => (Layout::Rgb, Layout::Rgb),
            (false, true) => (Layout::Rgba, Layout::Rgba),
        };
        let samples = width as usize * height as usize * if alpha { 4 } else { 3 };
        let short = image.color().bytes_per_pixel() / image.color().channel_count() > 1;
        if short {
            let stored = match (of_grey, alpha) {
                (true, false) => image.to_luma16().into_raw(),
                (true, true) => image.to_luma_alpha16().into_raw(),
                (false, false) => image.to_rgb16().into_raw(),
                (false, true) => image.to_rgba16().into_raw(),
            };
            let transform = self.profile.create_transform_16bit(from, &srgb, to, options).ok()?;
            let mut out = vec![0_u16; samples];
            transform.transform(&stored, &mut out).ok()?;
            return if alpha {
                ImageBuffer::from_raw(width, height, out).map(DynamicImage::ImageRgba16)
            } else {
                ImageBuffer::from_raw(width, height, out).map(DynamicImage::ImageRgb16)
            };
        }
        let stored = match (of_grey, alpha) {
            (true, false) => image.to_luma8().into_raw(),
            (true, true) => image.to_luma_alpha8().into_raw(),
            (false, false) => image.to_rgb8().into_raw(),
            (false, true) => image.to_rgba8().into_raw(),
        };
        let transform = self.profile.create_transform_8bit(from, &srgb, to, options).ok()?;
        let mut out = vec![0_u8; samples];
        transform.transform(&stored, &mut out).ok()?;
        if alpha {
            ImageBuffer::from_raw(width, height, out).map(DynamicImage::ImageRgba8)
        } else {
            ImageBuffer::from_raw(width, height, out).map(DynamicImage::ImageRgb8)
        }
    }
}
