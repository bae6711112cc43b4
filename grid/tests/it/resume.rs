//! A resumed volume equals the volume written without interruption, byte for byte.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use proptest::prelude::*;
use stereology_grid::{Element, Format, GridError, VolumeShape, resume_volume, write_volume};

use crate::contents;

/// Writes a volume of `sample`, cancelled before the slab `end`, and returns which slabs were requested.
fn write<T: Element>(
    path: &Path,
    shape: VolumeShape,
    end: usize,
    sample: impl Fn(usize) -> T,
) -> (Result<(), GridError>, Vec<usize>) {
    let mut asked = Vec::new();
    let result = resume_volume::<T>(
        path,
        Format::from_path(path).unwrap(),
        shape,
        [1.0, 2.0, 3.0],
        |z, mut slab| {
            asked.push(z);
            for (i, place) in slab.iter_mut().enumerate() {
                *place = sample(1000 * z + i);
            }
            if z < end {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        },
    );
    (result, asked)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn a_volume_gone_on_with_is_the_same(
        nz in 1_usize..80, ny in 1_usize..40, nx in 1_usize..150, colours in any::<bool>(), end in 0_usize..80, cut in 0_u64..40,
    ) {
        let shape = VolumeShape { nz, ny, nx, channels: if colours { 3 } else { 1 } };
        for format in Format::ALL {
            let place = tempfile::tempdir().unwrap();
            let path = place.path().join(format!("v{format}"));
            let sample = |i: usize| ((i * 2_654_435_761) >> 7).to_le_bytes()[0];
            write(&path, shape, nz, sample).0.unwrap();
            let whole = contents(&path);

            if path.is_dir() { fs::remove_dir_all(&path).unwrap() } else { fs::remove_file(&path).unwrap() }
            let (first, _) = write(&path, shape, end, sample);
            prop_assert_eq!(first.is_ok(), end >= nz);
            let partial = place.path().join(format!("v{format}.partial"));
            if partial.is_file() {
                // Killed in the middle of a write.
                let file = fs::File::options().write(true).open(&partial).unwrap();
                file.set_len(file.metadata().unwrap().len().saturating_sub(cut)).unwrap();
            }
            let (second, asked) = write(&path, shape, nz, sample);
            second.unwrap();
            prop_assert_eq!(contents(&path), whole);
            if end < nz && format != Format::Zarr && cut == 0 {
                let again = 2 * usize::from(end > 0);
                prop_assert_eq!(asked.len(), nz - end + again, "{:?}", asked);
            }
            prop_assert!(!partial.exists());
        }
    }
}

#[test]
fn the_beginning_of_another_volume_is_refused_and_left_alone() {
    let shape = VolumeShape {
        nz: 70,
        ny: 5,
        nx: 4,
        channels: 1,
    };
    for format in Format::ALL {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join(format!("v{format}"));
        assert!(write(&path, shape, 40, |i| i as f32).0.is_err());
        let before = contents(place.path());
        assert!(
            matches!(
                write(&path, shape, 70, |_| 7.0_f32).0,
                Err(GridError::OtherPartial { .. })
            ),
            "{format}"
        );
        assert_eq!(contents(place.path()), before);
        // Without resuming it is written anew.
        write_volume::<f32>(&path, format, shape, [1.0; 3], |_, _| ControlFlow::Continue(())).unwrap();
    }
}
