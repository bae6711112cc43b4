//! Photos and label maps in files.

use image::{DynamicImage, ImageBuffer, Luma, RgbImage, Rgba};
use ndarray::Array2;
use stereology_segment::{SegmentError, SegmentOptions, Segmentation, read_labels, read_photo, write_labels};
use tiff::encoder::{TiffEncoder, colortype};

/// 16 bits are rounded, grey becomes colour, transparency shows white.
#[test]
fn kinds_of_photo() {
    let folder = tempfile::tempdir().unwrap();
    let read = |picture: DynamicImage| {
        let file = folder.path().join("photo.png");
        picture.save(&file).unwrap();
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

/// Missing, empty, text and cut files are refused, each in its words.
#[test]
fn bad_photos() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("photo.png");
    assert!(matches!(read_photo(&file), Err(SegmentError::Open { .. })));
    std::fs::write(&file, b"").unwrap();
    assert!(matches!(read_photo(&file), Err(SegmentError::EmptyFile { .. })));
    std::fs::write(&file, b"this is no picture").unwrap();
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

/// Labels of 8 and 16 bits as PNG, and signed ones as TIFF, are read; colours and negative numbers are refused.
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
    RgbImage::new(2, 2).save(&png).unwrap();
    assert!(matches!(read_labels(&png), Err(SegmentError::LabelFormat { .. })));
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
    write(&[-1, 0]);
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

/// A header that claims 10¹² pixels is refused before memory is asked for.
#[test]
fn lying_headers() {
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
