//! Volumes of other programs: any sample type, byte order, order of axes; damaged ones are refused.
#![allow(clippy::cast_possible_truncation, clippy::float_cmp, reason = "values of a test")]

use flate2::Compression;
use flate2::write::GzEncoder;
use ndarray::Array4;
use proptest::prelude::*;
use std::fs;
use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;
use stereology_grid::{Element, Format, SampleType, VolumeShape, read_volume, write_volume};

fn ramp() -> Array4<f32> {
    Array4::from_shape_fn((3, 4, 5, 3), |(z, y, x, c)| (60 * z + 15 * y + 3 * x + c) as f32)
}

fn written<T: Element>(file: &Path, cast: impl Fn(f32) -> T) {
    let ramp = ramp();
    let shape = VolumeShape {
        nz: 3,
        ny: 4,
        nx: 5,
        channels: 3,
    };
    write_volume::<T>(
        file,
        Format::from_path(file).unwrap(),
        shape,
        [1.0; 3],
        |z, mut slab| {
            slab.indexed_iter_mut()
                .for_each(|((y, x, c), v)| *v = cast(ramp[[z, y, x, c]]));
            ControlFlow::Continue(())
        },
    )
    .unwrap();
}

#[test]
fn what_is_written_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["v.npy", "v.nrrd", "v.tif"] {
        let file = folder.path().join(name);
        written::<u8>(&file, |v| v as u8);
        let read = read_volume(&file).unwrap();
        assert_eq!((read.sample_type, read.samples), (SampleType::U8, ramp()), "{name}");
        fs::remove_file(&file).unwrap();
        written::<f32>(&file, |v| v);
        let read = read_volume(&file).unwrap();
        assert_eq!((read.sample_type, read.samples), (SampleType::F32, ramp()), "{name}");
    }
}

fn npy(descr: &str, order: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let mut text = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}");
    while (text.len() + 11) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    [
        b"\x93NUMPY\x01\0",
        &(text.len() as u16).to_le_bytes()[..],
        text.as_bytes(),
        data,
    ]
    .concat()
}

#[test]
fn every_type_and_order_of_numpy_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("v.npy");
    let read = |bytes: Vec<u8>| {
        fs::write(&file, bytes).unwrap();
        read_volume(&file).unwrap()
    };
    let numbers = [1.0_f32, -2.0, 300.0, 4.0, 5.0, 6.0];
    let bytes = |each: &dyn Fn(f32) -> Vec<u8>| numbers.iter().flat_map(|&n| each(n)).collect::<Vec<u8>>();
    for (descr, data) in [
        ("<i2", bytes(&|n| (n as i16).to_le_bytes().to_vec())),
        (">i2", bytes(&|n| (n as i16).to_be_bytes().to_vec())),
        ("<i8", bytes(&|n| (n as i64).to_le_bytes().to_vec())),
        (">f8", bytes(&|n| f64::from(n).to_be_bytes().to_vec())),
    ] {
        let picture = read(npy(descr, "False", "(2, 3)", &data)).samples;
        assert_eq!(picture.dim(), (1, 2, 3, 1), "{descr}");
        assert_eq!(picture.iter().copied().collect::<Vec<_>>(), numbers, "{descr}");
        let turned = read(npy(descr, "True", "(2, 3)", &data)).samples;
        assert_eq!(turned[[0, 1, 0, 0]], -2.0, "{descr}");
    }
    assert_eq!(
        read(npy("|b1", "False", "(2, 2, 2)", &[0, 1, 7, 0, 0, 0, 0, 1]))
            .samples
            .sum(),
        3.0
    );
    assert_eq!(
        read(npy("|u1", "False", "(2, 5, 3)", &[9; 30])).samples.dim(),
        (1, 2, 5, 3)
    );
}

#[test]
fn nrrd_may_be_packed_big_endian_detached_and_have_its_channels_last() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("v.nrrd");
    let start = "NRRD0004\n# a comment: ignored\ntype: unsigned short\ndimension: 4\nkinds: domain domain domain vector\nsizes: 2 3 4 2\nendian: big\n";
    let data: Vec<u8> = (0..48_u16).flat_map(u16::to_be_bytes).collect();
    let mut packed = GzEncoder::new(Vec::new(), Compression::default());
    packed.write_all(&data).unwrap();
    fs::write(
        &file,
        [start.as_bytes(), b"encoding: gzip\n\n", &packed.finish().unwrap()].concat(),
    )
    .unwrap();
    let read = read_volume(&file).unwrap();
    assert_eq!(read.samples.dim(), (4, 3, 2, 2));
    assert_eq!((read.samples[[1, 2, 1, 0]], read.samples[[1, 2, 1, 1]]), (11.0, 35.0));

    let header = folder.path().join("v.nhdr");
    fs::write(&header, format!("{start}encoding: raw\ndata file: v.raw\n")).unwrap();
    fs::write(folder.path().join("v.raw"), &data).unwrap();
    assert_eq!(read_volume(&header).unwrap(), read);
    fs::write(folder.path().join("v.raw"), &data[1..]).unwrap();
    assert!(read_volume(&header).unwrap_err().to_string().contains("truncated"));
}

#[test]
fn what_is_no_volume_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes, why) in [
        ("a.npy", b"hello".to_vec(), "no .npy"),
        ("b.nrrd", b"hello".to_vec(), "no NRRD"),
        ("c.tif", b"II*\0\x08\0\0\0".to_vec(), "TIFF"),
        ("d.raw", vec![], ".npy, .nrrd and .tif"),
        ("e.npy", npy("|u1", "False", "(0, 3)", &[]), "no samples"),
        ("f.npy", npy("|u1", "False", "(3,)", &[0; 3]), "axes"),
        ("g.npy", npy("<U4", "False", "(1, 1)", &[0; 16]), "astype"),
        (
            "h.nrrd",
            b"NRRD0004\ntype: float\nsizes: 999999999999 999999999999\nencoding: raw\n\n".to_vec(),
            "counted",
        ),
    ] {
        let file = folder.path().join(name);
        fs::write(&file, bytes).unwrap();
        let message = read_volume(&file).unwrap_err().to_string();
        assert!(message.contains(name) && message.contains(why), "{message}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn any_byte_changed_is_read_or_refused(place in 0_usize..600, byte in any::<u8>(), kind in 0_usize..3) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(["v.npy", "v.nrrd", "v.tif"][kind]);
        written::<u8>(&file, |v| v as u8);
        let mut bytes = fs::read(&file).unwrap();
        let place = place % bytes.len();
        bytes[place] = byte;
        fs::write(&file, bytes).unwrap();
        let _ = read_volume(&file);
    }
}
