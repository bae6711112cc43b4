//! Short deterministic runs of changed bytes over every parser of pictures and labels: a result or an error, never a
//! panic, and soon.

use std::time::{Duration, Instant};

use image::{Rgb, RgbImage};
use ndarray::Array2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_segment::{PhotoOptions, read_label_file, read_labels_for, read_photo_with, write_labels};

use crate::made_files::{MadePage, PLAIN, TiffMaker, compressed, npy, png_with_palette};

/// Changed files from each whole one.
const CASES: u64 = 60;
/// A case takes milliseconds; this leaves room for busy machines.
const SLOW: Duration = Duration::from_secs(10);

/// A few changes: bits and bytes replaced, parts removed or repeated, the end cut off, numbers made large.
fn mutated(from: &[u8], rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = from.to_vec();
    for _ in 0..rng.random_range(1..5) {
        if bytes.is_empty() {
            break;
        }
        // Headers are hit as often as all the rest.
        let end = if rng.random() {
            bytes.len().min(120)
        } else {
            bytes.len()
        };
        let at = rng.random_range(0..end);
        let to = (at + rng.random_range(1..24)).min(bytes.len());
        match rng.random_range(0..7) {
            0 => bytes[at] = rng.random(),
            1 => bytes[at] ^= 1 << rng.random_range(0..8),
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..to)),
            4 => {
                let part = bytes[at..to].to_vec();
                bytes.splice(at..at, part);
            }
            5 => bytes[at..to].fill(0xff),
            _ => bytes[at] = b'0' + rng.random_range(0..10),
        }
    }
    bytes
}

/// Whole files of every kind.
fn files() -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let labels = Array2::from_shape_fn((24, 32), |(y, x)| {
        u32::from(x.abs_diff(8).pow(2) + y.abs_diff(9).pow(2) < 30)
            + 7 * u32::from((20..28).contains(&x) && (5..9).contains(&y))
    });
    let photo = RgbImage::from_fn(32, 24, |x, y| Rgb([(x * 8) as u8, (y * 9) as u8, (x * y) as u8]));
    let mut files = Vec::new();
    for name in ["l.tif", "l.png", "l.npy", "l.geojson", "l.json", "l.zip"] {
        let file = folder.path().join(name);
        write_labels(&file, labels.view()).unwrap();
        files.push(std::fs::read(file).unwrap());
    }
    for name in ["p.png", "p.jpg", "p.tif", "p.bmp", "p.gif", "p.webp"] {
        let file = folder.path().join(name);
        photo.save(&file).unwrap();
        files.push(std::fs::read(file).unwrap());
    }
    let grey: Vec<u8> = photo.pixels().map(|p| p[0]).collect();
    let fields: [(u16, &[u32]); 4] = [(258, &[8]), (262, &[1]), (259, &[8]), (317, &[2])];
    let profile = moxcms::ColorProfile::new_adobe_rgb().encode().unwrap();
    let page = MadePage {
        bytes: vec![(34_675, profile)],
        ..MadePage::new(32, 24, &fields, vec![compressed(&grey)])
    };
    for (big_endian, big) in [(false, false), (true, false), (false, true)] {
        files.push(TiffMaker { big_endian, big }.file(&[page.clone(), page.clone()]));
    }
    let zstd = ruzstd::encoding::compress_to_vec(&grey[..], ruzstd::encoding::CompressionLevel::Fastest);
    let mut xz = lzma_rust2::XzWriter::new(Vec::new(), lzma_rust2::XzOptions::with_preset(1)).unwrap();
    std::io::Write::write_all(&mut xz, &grey).unwrap();
    let lzw = weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8)
        .encode(&grey)
        .unwrap();
    for (number, chunk) in [
        (50_000, zstd),
        (34_925, xz.finish().unwrap()),
        (5, lzw),
        (4, vec![0x5a; 90]),
    ] {
        let bits = if number == 4 { 1 } else { 8 };
        let fields: [(u16, &[u32]); 3] = [(258, &[bits]), (262, &[0]), (259, &[number])];
        files.push(PLAIN.file(&[MadePage::new(32, 24, &fields, vec![chunk])]));
    }
    files.push(png_with_palette(&[1, 2, 3, 4, 5, 6]));
    files.push(npy("<f2", [24, 32], &[0; 24 * 32 * 2]));
    files.push(br#"{"version":"5","imageHeight":24,"imageWidth":32,"shapes":[{"label":"g","shape_type":"polygon","group_id":null,"points":[[5,5],[25,5],[25,20]]},{"shape_type":"mask","points":[[2,2],[4,4]],"mask":"iVBORw0KGgo="}]}"#.to_vec());
    files.push(br#"{"p1":{"filename":"p","regions":[{"shape_attributes":{"name":"ellipse","cx":15,"cy":12,"rx":8,"ry":4,"theta":0.2}}]}}"#.to_vec());
    files.push(br#"{"images":[{"id":"1","width":32,"height":24}],"annotations":[{"id":1,"image_id":"1","segmentation":{"size":[24,32],"counts":"53:0j2"}},{"id":2,"image_id":"1","segmentation":[[2,2,9,2,9,9]]}]}"#.to_vec());
    files
}

#[test]
fn changed_files_are_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("changed");
    // A picture of more pixels would be refused as such.
    let options = PhotoOptions {
        most_pixels: 1 << 20,
        ..PhotoOptions::default()
    };
    for (kind, whole) in files().iter().enumerate() {
        for case in 0..CASES {
            let mut rng = ChaCha8Rng::seed_from_u64(20 + kind as u64);
            rng.set_stream(case);
            std::fs::write(&file, mutated(whole, &mut rng)).unwrap();
            let start = Instant::now();
            if let Ok(read) = read_photo_with(&file, &options) {
                assert!(u64::from(read.photo.width()) * u64::from(read.photo.height()) <= 1 << 20);
            }
            if let Ok(read) = read_labels_for(&file, (24, 32)) {
                assert!(read.labels.len() == 24 * 32 || read.labels.nrows() * read.labels.ncols() < 1 << 20);
            }
            // Sizes that a file states alone are limited too, but by much more than a test should take.
            if whole.starts_with(b"\x93NUMPY") {
                let _ = read_label_file(&file);
            }
            assert!(
                start.elapsed() < SLOW,
                "kind {kind}, case {case}: {:?}",
                start.elapsed()
            );
        }
    }
}
