//! The `zarr.json` of the folder and of each resolution.

use crate::element::Element;
use crate::volume_shape::VolumeShape;
use crate::voxel_size::VoxelSize;
use crate::zarr::shard::CHUNK;

/// Metadata of the folder: axes, resolutions with their spacing, and for colours the display of the channels.
pub(crate) fn group(levels: &[VolumeShape], finest: &VolumeShape, size: &VoxelSize) -> String {
    let spacing = size.sides;
    let counts = |shape: &VolumeShape| [shape.nz, shape.ny, shape.nx];
    let datasets: Vec<String> = levels
        .iter()
        .enumerate()
        .map(|(level, shape)| {
            // A voxel of a coarser resolution covers 2^level fine voxels along each axis and has their common centre.
            let fine = [spacing[2], spacing[1], spacing[0]];
            let times = 2_f64.powi(i32::try_from(level).unwrap_or(i32::MAX));
            debug_assert!(counts(shape).iter().zip(counts(finest)).all(|(&n, of)| n == of.div_ceil(1 << level)));
            let [sz, sy, sx] = fine.map(|s| s * times);
            let [tz, ty, tx] = fine.map(|s| 0.5 * s * times);
            format!(
                r#"{{"path":"{level}","coordinateTransformations":[{{"type":"scale","scale":[1,{sz},{sy},{sx}]}},{{"type":"translation","translation":[0,{tz},{ty},{tx}]}}]}}"#
            )
        })
        .collect();
    let omero = if finest.channels == 3 {
        let channel = |(name, colour): (&str, &str)| {
            format!(
                r#"{{"label":"{name}","color":"{colour}","active":true,"window":{{"min":0,"max":255,"start":0,"end":255}}}}"#
            )
        };
        let channels = [("red", "FF0000"), ("green", "00FF00"), ("blue", "0000FF")].map(channel);
        format!(r#","omero":{{"channels":[{}]}}"#, channels.join(","))
    } else {
        String::new()
    };
    let unit = size
        .unit
        .map_or(String::new(), |unit| format!(r#","unit":"{}""#, unit.udunits()));
    let space = ["z", "y", "x"].map(|axis| format!(r#"{{"name":"{axis}","type":"space"{unit}}}"#));
    let axes = format!(r#"[{{"name":"c","type":"channel"}},{}]"#, space.join(","));
    format!(
        "{{\"zarr_format\":3,\"node_type\":\"group\",\"attributes\":{{\"ome\":{{\"version\":\"0.5\",\"multiscales\":[{{\"name\":\"solid\",\"axes\":{axes},\"datasets\":[{}]}}]{omero}}}}}}}\n",
        datasets.join(",")
    )
}

/// Metadata of one resolution: an uncompressed array (c, z, y, x) in shards of chunks.
pub(crate) fn array<T: Element>(shape: &VolumeShape, chunks: &[usize; 2]) -> String {
    let VolumeShape { nz, ny, nx, channels } = *shape;
    let [sy, sx] = chunks.map(|n| n * CHUNK);
    let (n, of) = (CHUNK, T::ZARR);
    let little = r#"{"name":"bytes","configuration":{"endian":"little"}}"#;
    let samples = if T::BITS == 8 { r#"{"name":"bytes"}"# } else { little };
    let codecs = format!(
        r#"[{{"name":"sharding_indexed","configuration":{{"chunk_shape":[{channels},{n},{n},{n}],"codecs":[{samples}],"index_codecs":[{little},{{"name":"crc32c"}}],"index_location":"end"}}}}]"#
    );
    let keys = r#"{"name":"default","configuration":{"separator":"/"}}"#;
    let grid = format!(r#"{{"name":"regular","configuration":{{"chunk_shape":[{channels},{n},{sy},{sx}]}}}}"#);
    let array =
        format!(r#""zarr_format":3,"node_type":"array","shape":[{channels},{nz},{ny},{nx}],"data_type":"{of}""#);
    format!(
        "{{{array},\"chunk_grid\":{grid},\"chunk_key_encoding\":{keys},\"fill_value\":0,\"codecs\":{codecs},\"attributes\":{{}},\"dimension_names\":[\"c\",\"z\",\"y\",\"x\"]}}\n"
    )
}
