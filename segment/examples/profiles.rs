//! Profiles of a photo: `cargo run -p stereology-segment --example profiles -- PHOTO [FOLDER]`; without a photo, of a
//! synthetic test image.

#![allow(clippy::cast_possible_truncation, reason = "levels of a synthetic test image")]
#![allow(clippy::print_stdout, reason = "a program")]

use std::{error::Error, ops::ControlFlow, path::PathBuf};

use stereology_segment::{PhotoOptions, SegmentOptions, read_photo_with, segment, write_labels};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1);
    let (photo, compression) = match arguments.next() {
        Some(path) => {
            let read = read_photo_with(path, &PhotoOptions::default())?;
            (read.photo, read.compression)
        }
        None => (drawn(), None),
    };
    let options = SegmentOptions::default().with_compression(compression);
    let segmentation = segment(&photo, &options, &|_| ControlFlow::Continue(()))?;
    let n = segmentation.profiles.len();
    let mean = segmentation.profiles.iter().map(|p| p.size).sum::<f64>() / n as f64;
    println!(
        "{n} profiles, mean size {mean:.2} pixels, area fraction {:.4}",
        segmentation.area_fraction
    );
    for (i, c) in segmentation.categories.iter().enumerate() {
        let [r, g, b] = c.colour.map(|v| (255.0 * v).round());
        println!("category {i}: {} profiles, colour {r} {g} {b}", c.profiles);
    }
    for finding in &segmentation.findings {
        println!("{}: {}", finding.code, finding.message);
    }
    if let Some(folder) = arguments.next().map(PathBuf::from) {
        std::fs::create_dir_all(&folder)?;
        write_labels(folder.join("labels.tif"), segmentation.labels.view())?;
        segmentation.overlay().save(folder.join("overlay.png"))?;
        segmentation.means().save(folder.join("means.png"))?;
        segmentation.residual_image().save(folder.join("residual.png"))?;
    }
    Ok(())
}

/// Red and dark discs of two sizes on a pale ground.
fn drawn() -> image::RgbImage {
    image::RgbImage::from_fn(480, 360, |x, y| {
        let (column, row) = (x / 40, y / 40);
        let radius = if (column + row) % 2 == 0 { 8.0 } else { 14.0 };
        let inside = (f64::from(x % 40) - 19.5).hypot(f64::from(y % 40) - 19.5) < radius;
        let texture = ((x * 7919 + y * 104_729) % 7) as u8;
        match (inside, column % 2) {
            (false, _) => image::Rgb([215 + texture, 210 + texture, 200 + texture]),
            (true, 0) => image::Rgb([150 + texture, 60, 50 + texture]),
            (true, _) => image::Rgb([40 + texture, 42, 45]),
        }
    })
}
