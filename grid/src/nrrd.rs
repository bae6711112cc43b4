//! NRRD with attached raw data: header lines, an empty line, the samples.

use crate::element::Element;
use crate::volume_shape::VolumeShape;
use crate::voxel_size::VoxelSize;

pub(crate) fn header<T: Element>(shape: &VolumeShape, size: &VoxelSize) -> Vec<u8> {
    let VolumeShape { nz, ny, nx, channels } = *shape;
    let [sx, sy, sz] = size.sides;
    let units = size.unit.map_or(String::new(), |unit| {
        format!("space units: \"{unit}\" \"{unit}\" \"{unit}\"\n")
    });
    let (dimension, channel, none, centre, kind) = match channels {
        1 => (3, String::new(), "", "", ""),
        3 => (4, "3 ".to_string(), "none ", "none ", "RGB-color "),
        n => (4, format!("{n} "), "none ", "none ", "vector "),
    };
    format!(
        "NRRD0005\n\
         type: {}\n\
         dimension: {dimension}\n\
         space dimension: 3\n\
         sizes: {channel}{nx} {ny} {nz}\n\
         space directions: {none}({sx},0,0) (0,{sy},0) (0,0,{sz})\n\
         {units}\
         centerings: {centre}cell cell cell\n\
         kinds: {kind}domain domain domain\n\
         endian: little\n\
         encoding: raw\n\
         space origin: ({},{},{})\n\n",
        T::NRRD,
        sx / 2.0,
        sy / 2.0,
        sz / 2.0,
    )
    .into_bytes()
}
