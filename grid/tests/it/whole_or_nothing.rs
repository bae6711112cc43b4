//! A file appears whole or not at all, and what cannot be is refused before anything is asked for.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use stereology_grid::{Format, GridError, VolumeShape, resume_volume, write_atomically, write_volume};

use crate::contents;

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
        write_volume::<u8>(&file, format, SHAPE, [1.0; 3], |_, _| {
            assert!(!file.exists());
            ControlFlow::Continue(())
        })
        .unwrap();
        assert!(file.exists());
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), Format::ALL.len());
}

/// Names that look temporary, or like what a replaced output was once called, can be anyone's.
#[test]
fn files_of_others_beside_an_output_are_left_alone() {
    for format in Format::ALL {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(format!("v{format}"));
        let others = [".partial", ".old", ".partial-old"].map(|end| folder.path().join(format!("v{format}{end}")));
        for other in &others {
            fs::create_dir(other).unwrap();
            fs::write(other.join("thesis"), "years of work").unwrap();
        }
        for spacing in [1.0, 2.0] {
            zeros(&file, format, SHAPE, [spacing; 3]).unwrap();
        }
        for other in &others {
            assert_eq!(fs::read_to_string(other.join("thesis")).unwrap(), "years of work");
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4);
    }
}

#[test]
fn names_of_255_bytes_can_be_written() {
    let folder = tempfile::tempdir().unwrap();
    for format in Format::ALL {
        let ending = format.to_string();
        let name = format!("{}{ending}", "ä".repeat((255 - ending.len()) / 2));
        zeros(&folder.path().join(&name), format, SHAPE, [1.0; 3]).unwrap();
        assert!(folder.path().join(&name).exists());
        fs::rename(folder.path().join(&name), folder.path().join("aside")).unwrap();
        let resumed = folder.path().join(&name);
        resume_volume::<u8>(&resumed, format, SHAPE, [1.0; 3], |_, _| ControlFlow::Continue(())).unwrap();
        assert!(resumed.exists());
        let aside = folder.path().join("aside");
        if aside.is_dir() {
            fs::remove_dir_all(aside).unwrap();
        } else {
            fs::remove_file(aside).unwrap();
        }
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), Format::ALL.len());
}

#[cfg(unix)]
#[test]
fn a_link_is_followed_and_stays() {
    for format in Format::ALL {
        let folder = tempfile::tempdir().unwrap();
        let (link, target) = (
            folder.path().join(format!("link{format}")),
            folder.path().join("deep/v"),
        );
        fs::create_dir(folder.path().join("deep")).unwrap();
        std::os::unix::fs::symlink("deep/v", &link).unwrap();
        for spacing in [1.0, 2.0] {
            zeros(&link, format, SHAPE, [spacing; 3]).unwrap();
            assert!(link.is_symlink() && target.exists() && !target.is_symlink());
        }
    }
}

/// Each of several writers of one name leaves a whole output, and a resumable one has a single writer.
#[test]
fn outputs_of_several_writers_are_never_mixed() {
    for format in Format::ALL {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(format!("v{format}"));
        std::thread::scope(|scope| {
            for value in 1..=4_u8 {
                let file = &file;
                scope.spawn(move || {
                    let shape = VolumeShape { nz: 70, ..SHAPE };
                    let _ = write_volume::<u8>(file, format, shape, [1.0; 3], |_, mut slab| {
                        slab.fill(value);
                        ControlFlow::Continue(())
                    });
                });
            }
        });
        let bytes = |path: &Path| contents(path).into_values().collect::<Vec<_>>();
        let there = bytes(&file);
        let same = (1..=4_u8).any(|value| {
            let alone = folder.path().join(format!("alone-{value}{format}"));
            let shape = VolumeShape { nz: 70, ..SHAPE };
            write_volume::<u8>(&alone, format, shape, [1.0; 3], |_, mut slab| {
                slab.fill(value);
                ControlFlow::Continue(())
            })
            .unwrap();
            bytes(&alone) == there
        });
        assert!(same, "{format}");
    }
}

#[test]
fn a_resumable_volume_has_one_writer() {
    for format in Format::ALL {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(format!("v{format}"));
        let mut seconds = Vec::new();
        resume_volume::<u8>(&file, format, SHAPE, [1.0; 3], |z, _| {
            if z == 2 {
                seconds.push(resume_volume::<u8>(&file, format, SHAPE, [1.0; 3], |_, _| {
                    ControlFlow::Continue(())
                }));
            }
            ControlFlow::Continue(())
        })
        .unwrap();
        assert!(
            matches!(seconds[..], [Err(GridError::InUse { .. })]),
            "{format}: {seconds:?}"
        );
    }
}

#[test]
fn a_partial_file_of_someone_else_is_not_resumed() {
    for format in Format::ALL {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(format!("v{format}"));
        let partial = folder.path().join(format!("v{format}.partial"));
        let thesis = if format == Format::Zarr {
            fs::create_dir(&partial).unwrap();
            partial.join("thesis")
        } else {
            partial
        };
        fs::write(&thesis, "years of work").unwrap();
        let refused = resume_volume::<u8>(&file, format, SHAPE, [1.0; 3], |_, _| ControlFlow::Continue(()));
        assert!(
            matches!(refused, Err(GridError::OtherPartial { .. })),
            "{format}: {refused:?}"
        );
        assert_eq!(fs::read_to_string(&thesis).unwrap(), "years of work");
        assert!(!file.exists());
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
    let shape = VolumeShape { nz: 1000, ..SHAPE };
    let mut asked = 0;
    let failed = write_volume::<u8>(&path, Format::Zarr, shape, [1.0; 3], |z, _| {
        if z == 3 {
            let staged = fs::read_dir(place.path()).unwrap().next().unwrap().unwrap().path();
            fs::write(staged.join("content.zarr/0/c"), "a file where a folder is wanted").unwrap();
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
