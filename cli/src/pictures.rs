//! How commands read images: with a limit by the memory that they need, and findings as warnings.

use std::path::Path;

use clap::{Args, ValueEnum};
use image::RgbImage;
use stereology::segment::{self, PhotoOptions, read_photo_with};

use crate::answer::Notes;
use crate::failure::{Explain, Failure};
use crate::warnings::Warning;

/// Memory that the default limit allows, bytes.
const MEMORY: u64 = 1_800_000_000;

/// Limit of the size of images.
#[derive(Args, Clone, Copy, Debug)]
pub struct ImageLimit {
    /// Refuse images with more pixels [default: what 1.8 GB of memory hold]
    #[arg(long, value_name = "N")]
    pub max_pixels: Option<u64>,
}

impl ImageLimit {
    /// Options of reading for a command that needs so many bytes per pixel.
    pub fn options(self, bytes_per_pixel: u64) -> PhotoOptions {
        PhotoOptions {
            most_pixels: self.max_pixels.unwrap_or(MEMORY / bytes_per_pixel),
            bytes_per_pixel,
            ..PhotoOptions::default()
        }
    }

    /// Reads an image as 8-bit sRGB; what was guessed is added to the notes.
    pub fn read(self, path: &Path, bytes_per_pixel: u64, notes: &mut Notes) -> Result<RgbImage, Failure> {
        let read = read_photo_with(path, &self.options(bytes_per_pixel)).at(path)?;
        warn(notes, read.findings, path);
        Ok(read.photo)
    }
}

/// Adds findings on an image as warnings that name it.
pub fn warn(notes: &mut Notes, findings: Vec<Warning>, path: &Path) {
    let name = path
        .file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned();
    for finding in findings {
        notes.warn(Warning::new(finding.code, format!("{name}: {}", finding.message)));
    }
}

/// The orientation that a camera noted in a photograph.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Exif {
    /// Turn the photograph upright; labels that belong to the pixels as stored are recognised and turned as well
    #[default]
    Auto,
    /// Turn the photograph upright; labels belong to the upright photograph
    Apply,
    /// Take the pixels as stored; labels belong to them
    Ignore,
}

impl Exif {
    /// The choice of the library.
    pub fn choice(self) -> segment::Exif {
        match self {
            Self::Auto => segment::Exif::Auto,
            Self::Apply => segment::Exif::Apply,
            Self::Ignore => segment::Exif::Ignore,
        }
    }
}
