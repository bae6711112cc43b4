//! Damaged .npy files are refused with a reason, whatever their header promises.

use proptest::prelude::*;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use stereology_grid::{Format, GridError, VolumeShape, read_npy, write_volume};

fn whole() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("v.npy");
    let shape = VolumeShape {
        nz: 3,
        ny: 2,
        nx: 2,
        channels: 3,
    };
    write_volume::<f32>(&file, Format::Npy, shape, [1.0; 3], |_, _| ControlFlow::Continue(())).unwrap();
    fs::read(file).unwrap()
}

fn read(path: &Path, bytes: &[u8]) -> Result<ndarray::ArrayD<f32>, GridError> {
    fs::write(path, bytes).unwrap();
    read_npy::<f32>(path)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn cut_files_are_refused(length in 0_usize..272) {
        let folder = tempfile::tempdir().unwrap();
        let bytes = whole();
        prop_assert!(read(&folder.path().join("v.npy"), &bytes[..length.min(bytes.len() - 1)]).is_err());
    }

    #[test]
    fn any_bytes_are_read_or_refused(place in 0_usize..128, byte in any::<u8>()) {
        let folder = tempfile::tempdir().unwrap();
        let mut bytes = whole();
        bytes[place] = byte;
        let _ = read(&folder.path().join("v.npy"), &bytes);
    }
}

#[test]
fn a_header_cannot_ask_for_more_memory_than_the_file_holds() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("v.npy");
    for sizes in [
        "(9223372036854775807,)",
        "(4611686018427387904, 4611686018427387904)",
        "(1000000000000,)",
        "(-1,)",
    ] {
        let text = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {sizes}, }}\n");
        let length = u16::try_from(text.len()).unwrap().to_le_bytes();
        let error = read(&file, &[b"\x93NUMPY\x01\0", &length[..], text.as_bytes()].concat()).unwrap_err();
        assert!(matches!(error, GridError::NotNpy { .. }), "{error}");
    }
}

#[test]
fn fortran_order_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let text = "{'descr': '<f4', 'fortran_order': True, 'shape': (2, 3), }\n";
    let samples: Vec<u8> = (0..6_u8).flat_map(|i| f32::from(i).to_le_bytes()).collect();
    let length = u16::try_from(text.len()).unwrap().to_le_bytes();
    let bytes = [b"\x93NUMPY\x01\0", &length[..], text.as_bytes(), &samples].concat();
    let array = read(&folder.path().join("v.npy"), &bytes).unwrap();
    assert_eq!((array[[1, 0]], array[[0, 1]]), (1.0, 2.0));
}
