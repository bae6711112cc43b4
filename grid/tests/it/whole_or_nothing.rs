//! A file appears whole or not at all, and what cannot be is refused before anything is asked for.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use stereology_grid::{Format, GridError, VolumeShape, write_atomically, write_volume};

const SHAPE: VolumeShape = VolumeShape {
    nz: 5,
    ny: 2,
    nx: 2,
    channels: 1,
};
/// All that are one file.
const FORMATS: [Format; 5] = [Format::Npy, Format::Nrrd, Format::Vti, Format::Tiff, Format::Hdf5];

fn zeros(path: &Path, format: Format, shape: VolumeShape, spacing: [f64; 3]) -> Result<(), GridError> {
    write_volume::<u8>(path, format, shape, spacing, |_, _| ControlFlow::Continue(()))
}

#[test]
fn the_name_appears_with_the_last_slab() {
    let folder = tempfile::tempdir().unwrap();
    for format in Format::ALL {
        let file = folder.path().join(format!("v{format}"));
        let partial = folder.path().join(format!("v{format}.partial"));
        write_volume::<u8>(&file, format, SHAPE, [1.0; 3], |_, _| {
            assert!(!file.exists() && partial.exists());
            ControlFlow::Continue(())
        })
        .unwrap();
        assert!(file.exists() && !partial.exists());
    }
}

#[test]
fn a_cancelled_volume_leaves_nothing_and_spares_the_old_one() {
    for format in FORMATS {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(format!("v{format}"));
        fs::write(&file, "old").unwrap();
        let cancelled = write_volume::<u8>(&file, format, SHAPE, [1.0; 3], |z, _| {
            if z == 3 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        assert!(matches!(cancelled, Err(GridError::Cancelled)));
        assert_eq!(fs::read_to_string(&file).unwrap(), "old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}

/// A folder is as whole as a file: another Zarr folder gives way to it only when it is finished, and nothing else gives
/// way.
#[test]
fn a_folder_appears_whole_or_not_at_all() {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("v.zarr");
    zeros(&path, Format::Zarr, SHAPE, [1.0; 3]).unwrap();
    let old = fs::read(path.join("zarr.json")).unwrap();
    let cancelled = write_volume::<u8>(&path, Format::Zarr, SHAPE, [2.0; 3], |_, _| ControlFlow::Break(()));
    assert!(matches!(cancelled, Err(GridError::Cancelled)));
    assert_eq!(fs::read(path.join("zarr.json")).unwrap(), old);
    zeros(&path, Format::Zarr, SHAPE, [2.0; 3]).unwrap();
    assert_ne!(fs::read(path.join("zarr.json")).unwrap(), old);
    assert_eq!(fs::read_dir(place.path()).unwrap().count(), 1);

    let thesis = place.path().join("thesis.zarr");
    fs::create_dir(&thesis).unwrap();
    fs::write(thesis.join("thesis.tex"), "years of work").unwrap();
    assert!(zeros(&thesis, Format::Zarr, SHAPE, [1.0; 3]).is_err());
    assert!(thesis.join("thesis.tex").exists());
}

/// Slabs are written while others are computed: an error of writing is returned and stops the computation.
#[test]
fn what_cannot_be_written_ends_the_work() {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("v.zarr");
    let in_the_way = place.path().join("v.zarr.partial/0/c");
    let shape = VolumeShape { nz: 1000, ..SHAPE };
    let mut asked = 0;
    let failed = write_volume::<u8>(&path, Format::Zarr, shape, [1.0; 3], |z, _| {
        if z == 3 {
            fs::write(&in_the_way, "a file where a folder is wanted").unwrap();
        }
        asked += 1;
        ControlFlow::Continue(())
    });
    assert!(matches!(failed, Err(GridError::Io { .. })), "{failed:?}");
    // The first shards are full with slab 31; one more may be done and one begun.
    assert!(asked <= 34, "{asked}");
    assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);
}

#[test]
fn impossible_volumes_are_refused_before_a_file_is_made() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |shape: VolumeShape, format: Format, spacing: [f64; 3]| {
        let error = zeros(&folder.path().join("v"), format, shape, spacing).unwrap_err();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        error
    };
    let million = VolumeShape {
        nz: 1_000_000,
        ny: 1_000_000,
        nx: 1_000_000,
        channels: 3,
    };
    for format in Format::ALL {
        assert!(matches!(refused(million, format, [1.0; 3]), GridError::NoRoom { .. }));
    }
    let shape = VolumeShape {
        nz: usize::MAX,
        ..million
    };
    assert!(matches!(
        refused(shape, Format::Npy, [1.0; 3]),
        GridError::Uncountable { .. }
    ));
    let shape = VolumeShape { nx: 0, ..SHAPE };
    assert!(matches!(refused(shape, Format::Npy, [1.0; 3]), GridError::Empty { .. }));
    let shape = VolumeShape { channels: 2, ..SHAPE };
    assert!(matches!(
        refused(shape, Format::Tiff, [1.0; 3]),
        GridError::Channels { .. }
    ));
    for spacing in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            refused(SHAPE, Format::Vti, [1.0, spacing, 1.0]),
            GridError::Spacing { .. }
        ));
    }
}

#[test]
fn missing_folders_and_folders_in_the_way_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("missing").join("v.npy");
    let error = zeros(&missing, Format::Npy, SHAPE, [1.0; 3]).unwrap_err().to_string();
    assert!(error.contains("missing"), "{error}");
    let error = write_atomically(folder.path(), |_| Ok(())).unwrap_err().to_string();
    assert!(error.contains("is a folder"), "{error}");
}
