//! HDF5 files are read back by a library that is not ours, and a damaged one is refused by it.

use hdf5_pure::{Error, File};
use ndarray::Array4;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use stereology_grid::{Element, Format, VolumeShape, write_volume};

const CELLS: &str = "DataContainers/ImageDataContainer/CellData";
const GEOMETRY: &str = "DataContainers/ImageDataContainer/_SIMPL_GEOMETRY";

fn written<T: Element>(folder: &Path, channels: usize, sample: impl Fn(usize) -> T) -> (Vec<u8>, Vec<T>) {
    let file = folder.join("v.dream3d");
    let (nz, ny, nx) = (2, 3, 5);
    let shape = VolumeShape { nz, ny, nx, channels };
    let array = Array4::from_shape_fn((nz, ny, nx, channels), |(z, y, x, c)| {
        sample(((z * ny + y) * nx + x) * channels + c)
    });
    write_volume::<T>(&file, Format::Hdf5, shape, [0.5, 1.0, 2.0], |z, mut slab| {
        slab.assign(&array.index_axis(ndarray::Axis(0), z));
        ControlFlow::Continue(())
    })
    .unwrap();
    (fs::read(file).unwrap(), array.into_iter().collect())
}

/// Everything that a reader sees of a file of bytes, as text.
fn contents(bytes: &[u8], name: &str) -> Result<String, Error> {
    let file = File::from_bytes(bytes.to_vec())?;
    let mut text = String::new();
    for path in ["DataContainers", CELLS, GEOMETRY, "DataContainerBundles", "Pipeline"] {
        let group = file.group(path)?;
        let mut attributes: Vec<_> = group.attrs()?.into_iter().collect();
        attributes.sort_by(|a, b| a.0.cmp(&b.0));
        text += &format!("{path}: {:?} {:?} {attributes:?}\n", group.groups()?, group.datasets()?);
    }
    text += &format!("{:?}\n", file.root().attrs()?.get("FileVersion"));
    text += &format!("{:?}\n", file.group("DataContainers/ImageDataContainer")?.groups()?);
    for array in ["DIMENSIONS", "ORIGIN", "SPACING"] {
        text += &format!("{:?}\n", file.dataset(&format!("{GEOMETRY}/{array}"))?.shape()?);
    }
    let cells = file.dataset(&format!("{CELLS}/{name}"))?;
    let mut attributes: Vec<_> = cells.attrs()?.into_iter().collect();
    attributes.sort_by(|a, b| a.0.cmp(&b.0));
    Ok(text + &format!("{:?} {attributes:?}\n", cells.shape()?))
}

#[test]
fn colours_ids_and_distances_are_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let cells = |bytes: Vec<u8>, name: &str| {
        let file = File::from_bytes(bytes).unwrap();
        file.dataset(&format!("{CELLS}/{name}")).unwrap()
    };
    let (bytes, colours) = written(folder.path(), 3, |i| u8::try_from(2 * i).unwrap());
    let read = cells(bytes, "rgb");
    assert_eq!(read.shape().unwrap(), [2, 3, 5, 3]);
    assert_eq!(read.read::<u8>().unwrap(), colours);

    // DREAM.3D reads ids as i32.
    let (bytes, ids) = written(folder.path(), 1, |i| 70_000 * u32::try_from(i).unwrap());
    let read = cells(bytes, "FeatureIds").read::<i32>().unwrap();
    assert!(read.iter().map(|&id| u32::try_from(id).unwrap()).eq(ids));

    let (bytes, distances) = written(folder.path(), 1, |i| -0.25 * i as f32);
    assert_eq!(cells(bytes, "values").read::<f32>().unwrap(), distances);
}

#[test]
fn the_geometry_has_sizes_and_spacing_along_x_y_z() {
    let folder = tempfile::tempdir().unwrap();
    let (bytes, _) = written(folder.path(), 3, |_| 0_u8);
    let file = File::from_bytes(bytes.clone()).unwrap();
    let array = |name: &str| file.dataset(&format!("{GEOMETRY}/{name}")).unwrap();
    assert_eq!(array("DIMENSIONS").read::<i64>().unwrap(), [5, 3, 2]);
    assert_eq!(array("SPACING").read::<f32>().unwrap(), [0.5, 1.0, 2.0]);
    assert_eq!(array("ORIGIN").read::<f32>().unwrap(), [0.0; 3]);
    let text = contents(&bytes, "rgb").unwrap();
    for expected in [
        "ImageGeometry",
        "TupleDimensions\", U64Array([5, 3, 2])",
        "DataArray<uint8_t>",
        "\"7.0\"",
    ] {
        assert!(text.contains(expected), "{expected} is not in {text}");
    }
}

/// Superblock and object headers carry checksums: if ours were wrong, or not checked, this fails.
#[test]
fn a_changed_byte_of_superblock_or_object_header_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (bytes, _) = written(folder.path(), 3, |_| 0_u8);
    assert!(contents(&bytes, "rgb").is_ok());
    let mut checked: Vec<usize> = (0..48).collect();
    let headers: Vec<usize> = (0..bytes.len() - 4)
        .filter(|&at| &bytes[at..at + 4] == b"OHDR")
        .collect();
    assert_eq!(headers.len(), 11, "six groups below the root, the root and four arrays");
    for start in headers {
        let length = u32::from_le_bytes(bytes[start + 6..start + 10].try_into().unwrap());
        checked.extend(start..start + 10 + usize::try_from(length).unwrap() + 4);
    }
    for at in checked {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x10;
        assert!(
            contents(&damaged, "rgb").is_err(),
            "byte {at}, {:#04x}, is not checked",
            bytes[at]
        );
    }
}
