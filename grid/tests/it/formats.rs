//! All formats hold the same bytes of the same voxels.

use ndarray::{Array3, Array4, Axis};
use proptest::prelude::*;
use std::fs::{self, File};
use std::ops::ControlFlow;
use std::path::Path;
use stereology_grid::{Format, VolumeShape, read_npy, write_volume};
use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::Tag;

fn volume() -> impl Strategy<Value = Array4<u8>> {
    (1_usize..5, 1_usize..5, 1_usize..7, prop_oneof![Just(1_usize), Just(3)]).prop_flat_map(|(nz, ny, nx, c)| {
        prop::collection::vec(any::<u8>(), nz * ny * nx * c)
            .prop_map(move |v| Array4::from_shape_vec((nz, ny, nx, c), v).unwrap())
    })
}

fn write(path: &Path, array: &Array4<u8>, spacing: [f64; 3]) {
    let (nz, ny, nx, channels) = array.dim();
    let shape = VolumeShape { nz, ny, nx, channels };
    write_volume::<u8>(path, Format::from_path(path).unwrap(), shape, spacing, |z, mut slab| {
        slab.assign(&array.index_axis(Axis(0), z));
        ControlFlow::Continue(())
    })
    .unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Our reader and another's give back what was written.
    #[test]
    fn npy_is_read_back(array in volume()) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("v.npy");
        write(&file, &array, [1.0; 3]);
        let (nz, ny, nx, c) = array.dim();
        let ours = read_npy::<u8>(&file).unwrap();
        let theirs: ndarray::ArrayD<u8> = ndarray_npy::read_npy(&file).unwrap();
        prop_assert_eq!(&ours, &theirs);
        prop_assert_eq!(ours.ndim(), if c == 1 { 3 } else { 4 });
        prop_assert_eq!(ours.into_shape_with_order((nz, ny, nx, c)).unwrap(), array);
    }

    /// NRRD and VTI end their headers at the same samples as .npy, byte for byte.
    #[test]
    fn raw_formats_hold_the_same_bytes(array in volume()) {
        let folder = tempfile::tempdir().unwrap();
        let samples = array.iter().copied().collect::<Vec<u8>>();
        for (name, footer) in [("v.npy", ""), ("v.nrrd", ""), ("v.h5", ""), ("v.vti", "\n  </AppendedData>\n</VTKFile>\n")] {
            let file = folder.path().join(name);
            write(&file, &array, [1.0; 3]);
            let bytes = fs::read(&file).unwrap();
            let bytes = bytes.strip_suffix(footer.as_bytes()).unwrap();
            prop_assert!(bytes.ends_with(&samples), "{}", name);
            if name == "v.vti" {
                let length = &bytes[bytes.len() - samples.len() - 8..][..8];
                prop_assert_eq!(length, (samples.len() as u64).to_le_bytes());
            }
        }
    }

    /// Every page of the stack is a z.
    #[test]
    fn tiff_pages_are_slabs(array in volume()) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("v.tif");
        write(&file, &array, [1.0; 3]);
        let mut decoder = Decoder::new(File::open(&file).unwrap()).unwrap();
        for page in array.outer_iter() {
            let DecodingResult::U8(samples) = decoder.read_image().unwrap() else { panic!("not u8") };
            prop_assert_eq!(samples, page.iter().copied().collect::<Vec<u8>>());
            if decoder.more_images() { decoder.next_image().unwrap(); }
        }
        prop_assert!(!decoder.more_images());
    }
}

/// Ids and distances survive every bit pattern that matters.
#[test]
fn wide_samples_are_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let shape = VolumeShape {
        nz: 2,
        ny: 3,
        nx: 700,
        channels: 1,
    };
    let ids = Array3::from_shape_fn((2, 3, 700), |(z, y, x)| {
        u32::MAX - u32::try_from(2100 * z + 700 * y + x).unwrap()
    });
    let distances = ids.mapv(|id| -1.0 / f32::from_bits(id >> 3));
    for format in [Format::Npy, Format::Tiff] {
        let (a, b) = (
            folder.path().join(format!("id{format}")),
            folder.path().join(format!("distance{format}")),
        );
        write_volume::<u32>(&a, format, shape, [1.0; 3], |z, mut slab| {
            slab.index_axis_mut(Axis(2), 0).assign(&ids.index_axis(Axis(0), z));
            ControlFlow::Continue(())
        })
        .unwrap();
        write_volume::<f32>(&b, format, shape, [1.0; 3], |z, mut slab| {
            slab.index_axis_mut(Axis(2), 0)
                .assign(&distances.index_axis(Axis(0), z));
            ControlFlow::Continue(())
        })
        .unwrap();
        if format == Format::Npy {
            assert_eq!(read_npy::<u32>(&a).unwrap(), ids.clone().into_dyn());
            assert_eq!(ndarray_npy::read_npy::<_, Array3<f32>>(&b).unwrap(), distances);
        } else {
            let mut decoder = Decoder::new(File::open(&a).unwrap()).unwrap();
            let DecodingResult::U32(page) = decoder.read_image().unwrap() else {
                panic!("not u32")
            };
            assert_eq!(page, ids.index_axis(Axis(0), 0).iter().copied().collect::<Vec<_>>());
            let mut decoder = Decoder::new(File::open(&b).unwrap()).unwrap();
            decoder.next_image().unwrap();
            let DecodingResult::F32(page) = decoder.read_image().unwrap() else {
                panic!("not f32")
            };
            assert_eq!(
                page,
                distances.index_axis(Axis(0), 1).iter().copied().collect::<Vec<_>>()
            );
        }
    }
}

/// ImageJ reads pixels per unit from the resolution and the z step from the description.
#[test]
fn tiff_tells_the_spacing() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("v.tif");
    for spacing in [[0.25, 3.0, 7.5], [1e-4, 2e3, 1e9]] {
        write(&file, &Array4::zeros((2, 3, 4, 3)), spacing);
        let mut decoder = Decoder::new(File::open(&file).unwrap()).unwrap();
        for (tag, spacing) in [(Tag::XResolution, spacing[0]), (Tag::YResolution, spacing[1])] {
            let fraction = decoder.get_tag_u32_vec(tag).unwrap();
            let found = f64::from(fraction[1]) / f64::from(fraction[0]);
            assert!((found / spacing - 1.0).abs() < 1e-6, "{tag:?} {found}");
        }
        let description = decoder.get_tag_ascii_string(Tag::ImageDescription).unwrap();
        assert!(
            description.contains(&format!("slices=2\nspacing={}\n", spacing[2])),
            "{description}"
        );
    }
}
