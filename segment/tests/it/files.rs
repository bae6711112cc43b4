//! Photos and label maps in files.

use image::{DynamicImage, ImageBuffer, Luma, RgbImage, Rgba};
use ndarray::Array2;
use stereology_segment::{
    SegmentError, SegmentOptions, Segmentation, read_labels, read_labels_for, read_photo, write_labels,
};
use tiff::encoder::{TiffEncoder, colortype};

/// 16 bits are rounded, grey becomes three channels, transparency is composited over white.
#[test]
fn kinds_of_photo() {
    let folder = tempfile::tempdir().unwrap();
    let read = |image: DynamicImage| {
        let file = folder.path().join("photo.png");
        image.save(&file).unwrap();
        read_photo(&file).unwrap().get_pixel(0, 0).0
    };
    assert_eq!(
        read(DynamicImage::ImageLuma16(ImageBuffer::from_pixel(
            2,
            2,
            Luma([257 * 80])
        ))),
        [80; 3]
    );
    assert_eq!(
        read(DynamicImage::ImageLuma8(ImageBuffer::from_pixel(2, 2, Luma([7])))),
        [7; 3]
    );
    assert_eq!(
        read(DynamicImage::ImageRgba8(ImageBuffer::from_pixel(
            2,
            2,
            Rgba([0, 100, 200, 0])
        ))),
        [255; 3]
    );
    assert_eq!(
        read(DynamicImage::ImageRgba8(ImageBuffer::from_pixel(
            2,
            2,
            Rgba([0, 100, 200, 255])
        ))),
        [0, 100, 200]
    );
}

/// Palettes are applied, and so is the EXIF orientation: an image stored on its side with orientation 6 is upright.
#[test]
fn palettes_and_orientation() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("photo.png");
    let mut encoder = png::Encoder::new(std::fs::File::create(&file).unwrap(), 2, 1);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(vec![10, 20, 30, 200, 100, 50]);
    encoder.write_header().unwrap().write_image_data(&[1, 0]).unwrap();
    let read = read_photo(&file).unwrap();
    assert_eq!(
        [read.get_pixel(0, 0).0, read.get_pixel(1, 0).0],
        [[200, 100, 50], [10, 20, 30]]
    );
    let file = folder.path().join("photo.jpg");
    let lying = RgbImage::from_fn(64, 32, |x, _| image::Rgb([if x < 32 { 20 } else { 220 }; 3]));
    lying.save(&file).unwrap();
    let plain = std::fs::read(&file).unwrap();
    // One entry of the first directory: tag 0x0112, a short, 6: turn by a quarter to the right.
    let exif: &[u8] = b"\xff\xe1\x00\x22Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
    std::fs::write(&file, [&plain[..2], exif, &plain[2..]].concat()).unwrap();
    let standing = read_photo(&file).unwrap();
    assert_eq!(standing.dimensions(), (32, 64));
    assert!(standing.get_pixel(16, 10)[0] < 40 && standing.get_pixel(16, 54)[0] > 200);
}

/// Missing, empty, text and truncated files are refused, each with its own error.
#[test]
fn bad_photos() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("photo.png");
    assert!(matches!(read_photo(&file), Err(SegmentError::Open { .. })));
    std::fs::write(&file, b"").unwrap();
    assert!(matches!(read_photo(&file), Err(SegmentError::EmptyFile { .. })));
    std::fs::write(&file, b"this is not an image").unwrap();
    assert!(matches!(read_photo(&file), Err(SegmentError::Decode { .. })));
    RgbImage::from_fn(64, 64, |x, y| image::Rgb([x as u8, y as u8, (x * y) as u8]))
        .save(&file)
        .unwrap();
    let whole = std::fs::read(&file).unwrap();
    std::fs::write(&file, &whole[..whole.len() / 2]).unwrap();
    assert!(matches!(read_photo(&file), Err(SegmentError::Decode { .. })));
    let file = folder.path().join("photo.jpg");
    RgbImage::from_fn(64, 64, |x, y| image::Rgb([x as u8, y as u8, (x * y) as u8]))
        .save(&file)
        .unwrap();
    assert!(read_photo(&file).is_ok());
    let whole = std::fs::read(&file).unwrap();
    std::fs::write(&file, &whole[..whole.len() - 20]).unwrap();
    assert!(matches!(read_photo(&file), Err(SegmentError::Decode { .. })));
}

/// Labels of 8 and 16 bits as PNG, and signed ones as TIFF, are read; negative numbers are refused.
#[test]
fn kinds_of_labels() {
    let folder = tempfile::tempdir().unwrap();
    let png = folder.path().join("labels.png");
    ImageBuffer::from_fn(3, 2, |x, y| Luma([(300 * x + y) as u16]))
        .save(&png)
        .unwrap();
    assert_eq!(
        read_labels(&png).unwrap(),
        ndarray::array![[0, 300, 600], [1, 301, 601]]
    );
    let tif = folder.path().join("labels.tif");
    let write = |samples: &[i32]| {
        let mut file = std::fs::File::create(&tif).unwrap();
        TiffEncoder::new(&mut file)
            .unwrap()
            .write_image::<colortype::GrayI32>(2, 1, samples)
            .unwrap();
    };
    write(&[5, 0]);
    assert_eq!(read_labels(&tif).unwrap(), ndarray::array![[5, 0]]);
    write(&[-2, 0]);
    assert!(matches!(read_labels(&tif), Err(SegmentError::LabelFormat { .. })));
}

/// Labels come back as they were written; the residual is a float TIFF of three channels.
#[test]
fn written_and_read() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("labels.tif");
    for largest in [9_u32, 65_535, 65_536] {
        let labels = Array2::from_shape_fn((20, 30), |(y, x)| if y < 10 && x < 10 { largest } else { 0 });
        write_labels(&file, labels.view()).unwrap();
        assert_eq!(read_labels(&file).unwrap(), labels);
    }
    let photo = RgbImage::from_fn(30, 20, |x, y| image::Rgb([x as u8, y as u8, 77]));
    let labels = Array2::from_shape_fn((20, 30), |(y, _)| u32::from(y < 8));
    let found = Segmentation::from_labels(&photo, labels, &SegmentOptions::default()).unwrap();
    let residual = folder.path().join("residual.tif");
    found.write_residual(&residual).unwrap();
    let mut decoder = tiff::decoder::Decoder::new(std::fs::File::open(&residual).unwrap()).unwrap();
    let tiff::decoder::DecodingResult::F32(samples) = decoder.read_image().unwrap() else {
        panic!("not f32")
    };
    assert_eq!(samples, found.residual().into_raw_vec_and_offset().0);
}

/// A header that states 10¹² pixels is refused before memory is allocated.
#[test]
fn false_headers() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("labels.tif");
    write_labels(&file, Array2::from_elem((16, 16), 1).view()).unwrap();
    let mut bytes = std::fs::read(&file).unwrap();
    for tag in [256_u16, 257] {
        // Width and height: tag, type LONG, one value.
        let entry = [&tag.to_le_bytes()[..], &[4, 0, 1, 0, 0, 0]].concat();
        let place = bytes.windows(8).position(|window| window == entry).unwrap() + 8;
        bytes[place..place + 4].copy_from_slice(&1_000_000_u32.to_le_bytes());
    }
    std::fs::write(&file, bytes).unwrap();
    let refused = read_labels(&file).unwrap_err().to_string();
    assert!(refused.contains("labels.tif"), "{refused}");
}

/// Numbers, components, holes and touching labels survive the round trip through every format.
#[test]
fn label_files_round_trip() {
    let folder = tempfile::tempdir().unwrap();
    let mut labels = Array2::from_shape_fn((60, 90), |(y, x)| {
        let from = |cx: f64, cy: f64| (x as f64 - cx).hypot(y as f64 - cy);
        match () {
            () if from(20.0, 20.0) < 6.0 => 0, // a hole
            () if from(20.0, 20.0) < 12.0 => 7,
            () if from(42.0, 20.0) < 10.5 => 3, // touches 7
            () if from(70.0, 15.0) < 5.0 || from(75.0, 45.0) < 8.0 => 900, // in two pieces
            () if from(0.0, 59.0) < 14.0 => 1,  // at the corner
            () => 0,
        }
    });
    labels[[30, 80]] = 65_000;
    for name in ["l.tif", "l.png", "l.npy", "l.geojson", "l.json", "l.zip"] {
        let file = folder.path().join(name);
        write_labels(&file, labels.view()).unwrap();
        let read = read_labels_for(&file, (60, 90)).unwrap();
        assert_eq!((read.labels, read.findings.len()), (labels.clone(), 0), "{name}");
        let once = std::fs::read(&file).unwrap();
        write_labels(&file, labels.view()).unwrap();
        assert_eq!(once, std::fs::read(&file).unwrap(), "{name}");
        // A photo of another size.
        if name.starts_with("l.g") || name.ends_with("json") || name.ends_with("zip") {
            assert!(
                matches!(read_labels_for(&file, (30, 40)), Err(SegmentError::LabelFormat { .. })),
                "{name}"
            );
        }
    }
    labels[[30, 80]] = 70_000;
    assert!(write_labels(folder.path().join("l.png"), labels.view()).is_err());
    assert!(write_labels(folder.path().join("l.bmp"), labels.view()).is_err());
}

/// Samples of fewer than eight bits are labels, not shades; TIFFs that show 0 as white are not inverted; NumPy arrays
/// may have any order and type.
#[test]
fn labels_as_stored() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("l");
    let wanted = ndarray::array![[0, 3, 15], [7, 0, 1]];
    let mut encoder = png::Encoder::new(std::fs::File::create(&file).unwrap(), 3, 2);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Four);
    encoder
        .write_header()
        .unwrap()
        .write_image_data(&[0x03, 0xf0, 0x70, 0x10])
        .unwrap();
    assert_eq!(read_labels(&file).unwrap(), wanted);
    let mut out = std::fs::File::create(&file).unwrap();
    let mut encoder = TiffEncoder::new(&mut out).unwrap();
    let mut image = encoder.new_image::<colortype::Gray8>(3, 2).unwrap();
    image
        .encoder()
        .write_tag(tiff::tags::Tag::PhotometricInterpretation, 0_u16)
        .unwrap();
    image.write_data(&[0, 3, 15, 7, 0, 1]).unwrap();
    encoder.write_image::<colortype::Gray8>(3, 2, &[9; 6]).unwrap();
    let read = read_labels_for(&file, (2, 3)).unwrap();
    assert_eq!((read.labels, read.findings[0].code), (wanted.clone(), "first-page"));
    for (kind, fortran, bytes) in [
        (
            "<i8",
            "False",
            [0_i64, 3, 15, 7, 0, 1]
                .iter()
                .flat_map(|v| v.to_le_bytes())
                .collect::<Vec<u8>>(),
        ),
        (
            ">u2",
            "True",
            [0_u16, 7, 3, 0, 15, 1].iter().flat_map(|v| v.to_be_bytes()).collect(),
        ),
        (
            "<f4",
            "False",
            [0_f32, 3.0, 15.0, 7.0, 0.0, 1.0]
                .iter()
                .flat_map(|v| v.to_le_bytes())
                .collect(),
        ),
    ] {
        let header = format!("{{'descr': '{kind}', 'fortran_order': {fortran}, 'shape': (2, 3), }}\n");
        let mut npy = b"\x93NUMPY\x01\x00".to_vec();
        npy.extend((header.len() as u16).to_le_bytes());
        npy.extend(header.as_bytes());
        npy.extend(bytes);
        std::fs::write(&file, &npy).unwrap();
        assert_eq!(read_labels(&file).unwrap(), wanted, "{kind}");
        std::fs::write(&file, &npy[..npy.len() - 1]).unwrap();
        assert!(read_labels(&file).is_err());
        let pickled = String::from_utf8_lossy(&npy).replace(kind, "|O");
        std::fs::write(
            &file,
            [
                b"\x93NUMPY\x01\x00",
                &pickled.as_bytes()[pickled.find('v').unwrap_or(0)..],
            ]
            .concat(),
        )
        .unwrap();
        assert!(read_labels(&file).is_err());
    }
}

/// Polygons of other tools: QGIS's y up, features without numbers, overlaps, points.
#[test]
fn foreign_outlines() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("l.geojson");
    let read = |text: &str| {
        std::fs::write(&file, text).unwrap();
        read_labels_for(&file, (20, 20))
    };
    let square = |x: f64, y: f64, side: f64, down: f64| {
        let (r, b) = (x + side, y + down * side);
        format!(
            r#"{{"type": "Feature", "geometry": {{"type": "Polygon", "coordinates": [[[{x},{y}],[{r},{y}],[{r},{b}],[{x},{b}],[{x},{y}]]]}}}}"#
        )
    };
    let all = |features: &[String]| {
        format!(
            r#"{{"type": "FeatureCollection", "features": [{}]}}"#,
            features.join(",")
        )
    };
    let count = |labels: &Array2<u32>, l: u32| labels.iter().filter(|v| **v == l).count();
    // segmenteverygrain: pixel centres at whole numbers.
    let found = read(&all(&[square(0.5, 0.5, 4.0, 1.0), square(9.5, 9.5, 5.0, 1.0)])).unwrap();
    assert_eq!(
        (count(&found.labels, 1), count(&found.labels, 2), found.labels[[1, 1]]),
        (16, 25, 1)
    );
    let qgis = read(&all(&[square(1.0, -1.0, 4.0, -1.0)])).unwrap();
    assert_eq!(
        (count(&qgis.labels, 1), qgis.labels[[1, 1]], qgis.labels[[0, 0]]),
        (16, 1, 0)
    );
    let over = read(&all(&[square(0.5, 0.5, 2.0, 1.0), square(0.5, 0.5, 4.0, 1.0)])).unwrap();
    assert_eq!(
        (count(&over.labels, 1), count(&over.labels, 2), over.findings[0].code),
        (4, 12, "overlapping-labels")
    );
    let far = read(&all(&[square(100.0, 0.5, 2.0, 1.0)])).unwrap_err().to_string();
    assert!(far.contains("20x20"), "{far}");
    for bad in [
        "{",
        "{}",
        r#"{"type": "Feature", "geometry": {"type": "Point", "coordinates": [1, 2]}}"#,
        "PK\u{3}\u{4}",
        "\u{80}pickle",
        "hello",
    ] {
        assert!(matches!(read(bad), Err(SegmentError::LabelFormat { .. })), "{bad}");
    }
}
