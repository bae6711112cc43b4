//! TIFF files: their pages, and the samples of a page as they are stored.
//!
//! The crate `tiff` knows neither palettes nor LZMA, needs a C compiler for Zstandard, and refuses hue at a lower
//! resolution, samples of 12 bits and reversed bits. So the container is read here, while compressions are those of
//! other crates.

mod chunks;
mod directory;
mod page;
mod samples;

use stereology_metrics::Finding;

use directory::directories;
pub(crate) use page::{Format, Page, Photometric};
pub(crate) use samples::{Samples, float};

/// Whether a file is a TIFF, small or big.
pub(crate) fn is_tiff(bytes: &[u8]) -> bool {
    let magic: [&[u8]; 4] = [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"];
    magic.iter().any(|start| bytes.starts_with(start))
}

/// The main page of a TIFF: of the pages of `size`, (height, width), or else of those that are neither thumbnails nor
/// levels of a pyramid, the first of the largest; with a finding if there are others.
pub(crate) fn main_page(bytes: &[u8], size: Option<(usize, usize)>) -> Result<(Page<'_>, Vec<Finding>), String> {
    let directories = directories(bytes)?;
    let count = directories.len();
    let mut pages: Vec<(usize, Page<'_>)> = Vec::new();
    let mut error = None;
    for (i, directory) in directories.iter().enumerate() {
        match Page::of(directory, bytes) {
            Ok(page) => pages.push((i + 1, page)),
            Err(reason) => error = error.or(Some(reason)),
        }
    }
    let area = |page: &Page<'_>| page.width.saturating_mul(page.height);
    let fits = |page: &Page<'_>| size == Some((page.height, page.width));
    // The first of the best: the later ones do not replace it.
    let better = |a: &Page<'_>, b: &Page<'_>| (fits(a), !a.reduced, area(a)) > (fits(b), !b.reduced, area(b));
    let mut best: Option<(usize, Page<'_>)> = None;
    let mut sizes: Vec<(usize, usize)> = Vec::new();
    for (number, page) in pages {
        sizes.push((page.height, page.width));
        if best.as_ref().is_none_or(|(_, b)| better(&page, b)) {
            best = Some((number, page));
        }
    }
    let Some((number, page)) = best else {
        return Err(error.unwrap_or_else(|| "the TIFF has no page".into()));
    };
    let same = sizes.iter().filter(|s| **s == (page.height, page.width)).count();
    let finding = if same > 1 || page.stack > 1 {
        let slices = same.max(page.stack);
        Some(Finding::new(
            "first-page",
            format!(
                "the TIFF is a stack of {slices} images of {} x {} pixels; the first one was read: save only the page that belongs to the photo",
                page.width, page.height
            ),
        ))
    } else if count > 1 {
        Some(Finding::new(
            "main-page",
            format!(
                "the TIFF has {count} pages of different sizes (thumbnails, levels of a pyramid); page {number} of {} x {} pixels was read",
                page.width, page.height
            ),
        ))
    } else {
        None
    };
    Ok((page, finding.into_iter().collect()))
}
