//! One picture in the many ways in which files store it.

use image::{ImageBuffer, Luma, Rgb, RgbImage, Rgba};
use stereology_segment::{Exif, PhotoFile, PhotoOptions, SegmentError, read_grey, read_photo, read_photo_with};

use crate::made_files::{MadePage, PLAIN, TiffMaker, compressed, png_with_palette};

const SIZE: [u32; 2] = [23, 17];

/// A picture of patches.
fn level(x: u32, y: u32) -> [u8; 3] {
    let patch = (x / 5 + 3 * (y / 4)) as u8;
    [20 + 13 * patch, 230 - 9 * patch, 90 + 5 * (patch % 7)]
}

fn samples() -> Vec<u8> {
    let places = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
    places.flat_map(|(x, y)| level(x, y)).collect()
}

fn read(bytes: &[u8]) -> Result<PhotoFile, SegmentError> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("photo");
    std::fs::write(&file, bytes).unwrap();
    read_photo_with(&file, &PhotoOptions::default())
}

fn codes(read: &PhotoFile) -> Vec<&'static str> {
    read.findings.iter().map(|f| f.code).collect()
}

#[track_caller]
fn assert_same(bytes: &[u8], tolerance: u8, expected: &[&str]) {
    let read = read(bytes).unwrap();
    assert_eq!(read.photo.dimensions(), (SIZE[0], SIZE[1]));
    for (x, y, pixel) in read.photo.enumerate_pixels() {
        let near = pixel.0.iter().zip(level(x, y)).all(|(a, b)| a.abs_diff(b) <= tolerance);
        assert!(near, "({x}, {y}): {:?} for {:?}", pixel.0, level(x, y));
    }
    assert_eq!(codes(&read), expected);
}

/// A TIFF of the picture with these fields and strips.
fn tiff(maker: TiffMaker, fields: &[(u16, &[u32])], chunks: Vec<Vec<u8>>) -> Vec<u8> {
    maker.file(&[MadePage::new(SIZE[0], SIZE[1], fields, chunks)])
}

const RGB: [(u16, &[u32]); 3] = [(258, &[8, 8, 8]), (262, &[2]), (277, &[3])];

/// Compressions, predictors, byte orders, tiles, planes and big files all give the same pixels.
#[test]
fn tiff_layouts() {
    let plain = samples();
    for maker in [(false, false), (true, false), (false, true), (true, true)] {
        let maker = TiffMaker {
            big_endian: maker.0,
            big: maker.1,
        };
        assert_same(&tiff(maker, &RGB, vec![plain.clone()]), 0, &[]);
    }
    let with = |more: &[(u16, &'static [u32])], chunks| tiff(PLAIN, &[&RGB[..], more].concat(), chunks);
    assert_same(&with(&[(259, &[8])], vec![compressed(&plain)]), 0, &[]);
    let lzw = weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8)
        .encode(&plain)
        .unwrap();
    assert_same(&with(&[(259, &[5])], vec![lzw]), 0, &[]);
    let zstd = ruzstd::encoding::compress_to_vec(&plain[..], ruzstd::encoding::CompressionLevel::Fastest);
    assert_same(&with(&[(259, &[50_000])], vec![zstd]), 0, &[]);
    // PackBits: each row a copied run.
    let rows = plain.chunks(3 * SIZE[0] as usize);
    let packed: Vec<u8> = rows
        .clone()
        .flat_map(|r| [&[r.len() as u8 - 1][..], r].concat())
        .collect();
    assert_same(&with(&[(259, &[32_773])], vec![packed]), 0, &[]);
    // Differences to the pixel before.
    let differences: Vec<u8> = rows
        .clone()
        .flat_map(|r| (0..r.len()).map(|i| if i < 3 { r[i] } else { r[i].wrapping_sub(r[i - 3]) }))
        .collect();
    assert_same(
        &with(&[(317, &[2]), (259, &[8])], vec![compressed(&differences)]),
        0,
        &[],
    );
    // A strip per row; reversed bits; planes.
    assert_same(&with(&[(278, &[1])], rows.map(<[u8]>::to_vec).collect()), 0, &[]);
    assert_same(
        &with(&[(266, &[2])], vec![plain.iter().map(|b| b.reverse_bits()).collect()]),
        0,
        &[],
    );
    let planes = (0..3)
        .map(|c| plain.iter().skip(c).step_by(3).copied().collect())
        .collect();
    assert_same(&with(&[(284, &[2])], planes), 0, &[]);
    // Tiles of 16 x 16, padded at the right and below.
    let tile = |left: u32, top: u32| -> Vec<u8> {
        let places = (top..top + 16).flat_map(|y| (left..left + 16).map(move |x| (x, y)));
        places
            .flat_map(|(x, y)| {
                if x < SIZE[0] && y < SIZE[1] {
                    level(x, y)
                } else {
                    [9; 3]
                }
            })
            .collect()
    };
    let tiles = [(0, 0), (16, 0), (0, 16), (16, 16)].map(|(x, y)| tile(x, y)).to_vec();
    assert_same(&with(&[(322, &[16]), (323, &[16])], tiles), 0, &[]);
}

/// LZMA as libtiff writes it: bytes made by xz of 23 x 17 zeros but for one.
#[test]
fn tiff_lzma() {
    let mut xz = lzma_rust2::XzWriter::new(Vec::new(), lzma_rust2::XzOptions::with_preset(1)).unwrap();
    std::io::Write::write_all(&mut xz, &samples()).unwrap();
    let packed = xz.finish().unwrap();
    assert_same(
        &tiff(PLAIN, &[&RGB[..], &[(259, &[34_925])]].concat(), vec![packed]),
        0,
        &[],
    );
}

/// Samples of other sizes and kinds, with the guess of their range said; ink, palettes and inverted grey.
#[test]
fn tiff_samples() {
    let plain = samples();
    let wide = |scale: u32| {
        plain
            .iter()
            .flat_map(|v| ((u32::from(*v) * scale) as u16).to_le_bytes())
            .collect::<Vec<u8>>()
    };
    let of = |bits: &'static [u32], more: &[(u16, &'static [u32])], chunk: Vec<u8>| {
        let fields = [&[(258, bits), (262, &[2_u32] as &[u32]), (277, &[3])], more].concat();
        tiff(PLAIN, &fields, vec![chunk])
    };
    assert_same(&of(&[16], &[], wide(257)), 0, &[]);
    assert_same(&of(&[16], &[], wide(16)), 1, &["range-guessed"]);
    assert_same(&of(&[16], &[], wide(1)), 0, &["range-guessed"]);
    assert_same(&of(&[16], &[(339, &[2])], wide(16)), 1, &["range-guessed"]);
    let floats = |scale: f32| {
        plain
            .iter()
            .flat_map(|v| (f32::from(*v) * scale).to_le_bytes())
            .collect::<Vec<u8>>()
    };
    assert_same(&of(&[32], &[(339, &[3])], floats(1.0 / 255.0)), 0, &["range-guessed"]);
    assert_same(&of(&[32], &[(339, &[3])], floats(1.0)), 0, &["range-guessed"]);
    // Twelve bits, two samples in three bytes; rows end on a byte.
    let row = |r: &[u8]| -> Vec<u8> {
        let bit = |v: u8, k: u32| ((u16::from(v) << 4 | 8) >> (11 - k) & 1) as u8;
        let bits: Vec<u8> = r.iter().flat_map(|v| (0..12).map(move |k| bit(*v, k))).collect();
        let byte = |b: &[u8]| {
            b.iter()
                .zip([128, 64, 32, 16, 8, 4, 2, 1])
                .map(|(bit, place)| bit * place)
                .sum()
        };
        bits.chunks(8).map(byte).collect()
    };
    let twelve = plain.chunks(3 * SIZE[0] as usize).flat_map(row).collect();
    assert_same(&of(&[12], &[], twelve), 1, &[]);
    // Inks are what is missing from white.
    let ink = plain
        .chunks(3)
        .flat_map(|p| [255 - p[0], 255 - p[1], 255 - p[2], 0])
        .collect();
    assert_same(
        &tiff(PLAIN, &[(258, &[8; 4]), (262, &[5]), (277, &[4])], vec![ink]),
        0,
        &[],
    );
    // A palette of all patches, and places of four bits.
    let mut colours: Vec<[u8; 3]> = plain.chunks(3).map(|p| [p[0], p[1], p[2]]).collect();
    colours.sort_unstable();
    colours.dedup();
    let map: Vec<u32> = (0..3)
        .flat_map(|c| (0..256).map(move |i| (i, c)))
        .map(|(i, c)| colours.get(i).map_or(0, |p| 257 * u32::from(p[c])))
        .collect();
    let places = plain
        .chunks(3)
        .map(|p| colours.iter().position(|c| c == p).unwrap() as u8)
        .collect();
    assert_same(
        &tiff(PLAIN, &[(258, &[8]), (262, &[3]), (320, &map)], vec![places]),
        0,
        &[],
    );
    let inverted = MadePage::new(2, 1, &[(258, &[8]), (262, &[0])], vec![vec![0, 200]]);
    assert_eq!(
        read(&PLAIN.file(&[inverted])).unwrap().photo.into_raw(),
        [255, 255, 255, 55, 55, 55]
    );
}

/// Opacity is laid over white and said, in every format alike; an opaque picture gives no finding.
#[test]
fn opacity() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.png", "a.tif", "a.webp"] {
        for (alpha, grey, wanted) in [(255, 100, 100), (0, 100, 255), (51, 100, 224)] {
            let file = folder.path().join(name);
            image::RgbaImage::from_pixel(20, 20, Rgba([grey, grey, grey, alpha]))
                .save(&file)
                .unwrap();
            let read = read_photo_with(&file, &PhotoOptions::default()).unwrap();
            assert_eq!(read.photo.get_pixel(3, 3).0, [wanted; 3], "{name}");
            assert_eq!(codes(&read).contains(&"alpha-over-white"), alpha < 255, "{name}");
        }
    }
    // Colours that were multiplied by their opacity.
    let page = MadePage::new(
        1,
        1,
        &[(258, &[8; 4]), (262, &[2]), (277, &[4]), (338, &[1])],
        vec![vec![20, 20, 20, 51]],
    );
    assert_eq!(read(&PLAIN.file(&[page])).unwrap().photo.get_pixel(0, 0).0, [224; 3]);
}

/// BMP, GIF and WebP are read; 12 bits in the 16 of a PNG are found.
#[test]
fn other_formats() {
    let folder = tempfile::tempdir().unwrap();
    let photo = RgbImage::from_fn(SIZE[0], SIZE[1], |x, y| Rgb(level(x, y)));
    for name in ["p.bmp", "p.webp", "p.gif", "p.png"] {
        let file = folder.path().join(name);
        photo.save(&file).unwrap();
        let tolerance = if name == "p.gif" { 3 } else { 0 };
        assert_same(&std::fs::read(&file).unwrap(), tolerance, &[]);
    }
    let file = folder.path().join("grey.png");
    ImageBuffer::from_fn(8, 8, |x, _| Luma([(x * 585) as u16]))
        .save(&file)
        .unwrap();
    let read = read_photo_with(&file, &PhotoOptions::default()).unwrap();
    assert_eq!(
        (read.photo.get_pixel(7, 0).0, codes(&read)),
        ([255; 3], vec!["range-guessed"])
    );
    assert_eq!(read_grey(&file, &PhotoOptions::default()).unwrap().grey[[0, 7]], 1.0);
}

/// Colours of an embedded profile become sRGB, and that is said; those of sRGB's own stay.
#[test]
fn colour_profiles() {
    let photo = |profile: Vec<u8>| {
        let pixel = RgbImage::from_pixel(20, 20, Rgb([200, 100, 60]));
        let page = MadePage {
            bytes: vec![(34_675, profile)],
            ..MadePage::new(20, 20, &RGB, vec![pixel.into_raw()])
        };
        let read = read(&PLAIN.file(&[page])).unwrap();
        (read.photo.get_pixel(4, 4).0, codes(&read))
    };
    let stored = moxcms::ColorProfile::new_srgb().encode().unwrap();
    assert_eq!(photo(stored), ([200, 100, 60], vec![]));
    // Adobe RGB's red is more saturated: (200, 100, 60) of it is about (228, 99, 52) of sRGB.
    let (seen, found) = photo(moxcms::ColorProfile::new_adobe_rgb().encode().unwrap());
    assert!(seen[0] > 220 && seen[1].abs_diff(100) < 4 && seen[2] < 60, "{seen:?}");
    assert_eq!(found, ["colour-profile"]);
    let (seen, found) = photo(moxcms::ColorProfile::new_display_p3().encode().unwrap());
    assert!(seen[0] > 205 && seen[2] < 60 && found == ["colour-profile"], "{seen:?}");
    assert_eq!(photo(b"no profile".to_vec()), ([200, 100, 60], vec!["colour-profile"]));
    // A grey picture with a profile of grey.
    let page = MadePage {
        bytes: vec![(34_675, moxcms::ColorProfile::new_gray_with_gamma(1.0).encode().unwrap())],
        ..MadePage::new(20, 20, &[(258, &[8]), (262, &[1])], vec![vec![55; 400]])
    };
    let read = read(&PLAIN.file(&[page])).unwrap();
    // Linear 55 / 255 is encoded as 128.
    assert!(
        read.photo.get_pixel(0, 0)[0].abs_diff(128) < 3,
        "{:?}",
        read.photo.get_pixel(0, 0)
    );
    assert_eq!(codes(&read), ["colour-profile"]);
}

/// A thumbnail in front of the picture, and levels of a pyramid behind it, are passed over; of a stack, the first image
/// is read.
#[test]
fn pages() {
    let grey = |side: u32, value: u8, more: &[(u16, &[u32])]| {
        let fields = [&[(258, &[8_u32] as &[u32]), (262, &[1])], more].concat();
        MadePage::new(side, side, &fields, vec![vec![value; (side * side) as usize]])
    };
    let found = |pages: &[MadePage]| {
        let read = read(&PLAIN.file(pages)).unwrap();
        (read.photo.width(), read.photo.get_pixel(0, 0)[0], codes(&read))
    };
    let small = grey(5, 9, &[(254, &[1])]);
    assert_eq!(found(&[small.clone(), grey(20, 77, &[])]), (20, 77, vec!["main-page"]));
    assert_eq!(found(&[grey(20, 77, &[]), small]), (20, 77, vec!["main-page"]));
    assert_eq!(
        found(&[grey(20, 77, &[]), grey(20, 78, &[])]),
        (20, 77, vec!["first-page"])
    );
}

/// The orientation noted in a TIFF is applied, unless it is to be ignored.
#[test]
fn orientation() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("photo.tif");
    let page = MadePage::new(3, 1, &[(258, &[8]), (262, &[1]), (274, &[6])], vec![vec![1, 2, 3]]);
    std::fs::write(&file, PLAIN.file(&[page])).unwrap();
    let read = |exif| {
        read_photo_with(
            &file,
            &PhotoOptions {
                exif,
                ..PhotoOptions::default()
            },
        )
        .unwrap()
    };
    let upright = read(Exif::Auto);
    assert_eq!(
        (upright.photo.dimensions(), upright.photo.get_pixel(0, 0)[0]),
        ((1, 3), 1)
    );
    assert!(upright.turned.is_some() && read(Exif::Apply).turned.is_none());
    assert_eq!(read(Exif::Ignore).photo.dimensions(), (3, 1));
}

/// Palettes that are no colours, damaged strips, unknown compressions and other formats are refused with their names;
/// large pictures before they are decoded.
#[test]
fn refusals() {
    let reason = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
    for length in [1, 4, 769, 771] {
        assert!(reason(&png_with_palette(&vec![7; length])).contains("PLTE"), "{length}");
    }
    assert!(read(&png_with_palette(&[1, 2, 3])).is_ok());
    assert!(reason(&tiff(PLAIN, &RGB, vec![vec![0; 100]])).contains("truncated"));
    let jpeg2000 = [&RGB[..], &[(259, &[34_712])]].concat();
    assert!(reason(&tiff(PLAIN, &jpeg2000, vec![vec![0; 100]])).contains("JPEG 2000"));
    assert!(reason(b"\0\0\0\x18ftypheic\0\0\0\0").contains("HEIC"));
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("large.tif");
    std::fs::write(
        &file,
        PLAIN.file(&[MadePage::new(1 << 30, 1 << 30, &RGB, vec![vec![0; 9]])]),
    )
    .unwrap();
    let refused = read_photo(&file);
    assert!(
        matches!(
            refused,
            Err(SegmentError::TooLarge {
                width: 1_073_741_824,
                ..
            })
        ),
        "{refused:?}"
    );
}

/// A motion photo is a JPEG with a film behind it.
#[test]
fn motion_photos() {
    let photo = RgbImage::from_fn(SIZE[0], SIZE[1], |x, y| Rgb(level(x, y)));
    let mut bytes = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 98)
        .encode_image(&photo)
        .unwrap();
    let alone = read(&bytes).unwrap().photo;
    bytes.extend(b"\0\0\0\x18ftypmp42\xff\xda\0\x08\x01 film \xff\xda");
    assert_eq!(read(&bytes).unwrap().photo, alone);
}
