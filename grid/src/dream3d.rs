//! The layout of DREAM.3D files, version 7: an image geometry and one array of cell data.

use crate::element::Element;
use crate::hdf5::{Attribute, Data, Object, Type, head as hdf5_head};
use crate::volume_shape::VolumeShape;

/// Everything before the samples.
pub(crate) fn head<T: Element>(shape: &VolumeShape, spacing: [f64; 3], bytes: u64) -> Vec<u8> {
    let VolumeShape { nz, ny, nx, channels } = *shape;
    let [nx, ny, nz, channels] = [nx, ny, nz, channels].map(|n| n as u64);
    let tuples = || Attribute::array("TupleDimensions", Type::Unsigned(8), words(&[nx, ny, nz]));
    let cells = Object::Array {
        attributes: vec![
            Attribute::array("ComponentDimensions", Type::Unsigned(8), words(&[channels])),
            Attribute::array("DataArrayVersion", Type::Signed(4), 2_i32.to_le_bytes().to_vec()),
            Attribute::text("ObjectType", &format!("DataArray<{}>", T::DREAM3D)),
            Attribute::text("Tuple Axis Dimensions", &format!("x={nx},y={ny},z={nz}")),
            tuples(),
        ],
        of: T::HDF5,
        sizes: vec![nz, ny, nx, channels],
        data: Data::Behind(bytes),
    };
    let cell_data = Object::Group {
        attributes: vec![
            Attribute::array("AttributeMatrixType", Type::Unsigned(4), 3_u32.to_le_bytes().to_vec()),
            tuples(),
        ],
        members: vec![(if channels == 3 { "rgb" } else { T::CELLS }, cells)],
    };
    let empty = || Object::Group {
        attributes: Vec::new(),
        members: Vec::new(),
    };
    let group = |name: &'static str, members| {
        let attributes = Vec::new();
        (name, Object::Group { attributes, members })
    };
    let image = vec![
        ("CellData", cell_data),
        ("_SIMPL_GEOMETRY", geometry([nx, ny, nz], spacing)),
    ];
    let root = Object::Group {
        attributes: vec![
            Attribute::text("DREAM3D Version", "6.5"),
            Attribute::text("FileVersion", "7.0"),
        ],
        members: vec![
            ("DataContainerBundles", empty()),
            group("DataContainers", vec![group("ImageDataContainer", image)]),
            ("Pipeline", empty()),
        ],
    };
    hdf5_head(&root, bytes)
}

fn geometry(counts: [u64; 3], spacing: [f64; 3]) -> Object {
    let number = |name, value: u32| Attribute::array(name, Type::Unsigned(4), value.to_le_bytes().to_vec());
    #[allow(clippy::cast_possible_truncation, reason = "DREAM.3D stores f32 here")]
    let floats = |values: [f64; 3]| values.iter().flat_map(|&value| (value as f32).to_le_bytes()).collect();
    let array = |of, bytes| Object::Array {
        attributes: Vec::new(),
        of,
        sizes: vec![3],
        data: Data::Here(bytes),
    };
    Object::Group {
        attributes: vec![
            Attribute::text("GeometryName", "ImageGeom"),
            number("GeometryType", 0),
            Attribute::text("GeometryTypeName", "ImageGeometry"),
            number("SpatialDimensionality", 3),
            number("UnitDimensionality", 3),
        ],
        members: vec![
            ("DIMENSIONS", array(Type::Signed(8), words(&counts))),
            ("ORIGIN", array(Type::Float32, floats([0.0; 3]))),
            ("SPACING", array(Type::Float32, floats(spacing))),
        ],
    }
}

fn words(values: &[u64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}
