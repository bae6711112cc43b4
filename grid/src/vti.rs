//! VTK XML image data: the voxels as raw appended cell data.

use crate::element::Element;
use crate::volume_shape::VolumeShape;
use crate::voxel_size::VoxelSize;

/// Everything before the samples, including their number of bytes (`UInt64`).
pub(crate) fn header<T: Element>(shape: &VolumeShape, size: &VoxelSize, bytes: u64) -> Vec<u8> {
    let VolumeShape { nz, ny, nx, channels } = *shape;
    let [sx, sy, sz] = size.sides;
    // VTK stores a string as the codes of its characters and a zero.
    let unit = size.unit.map_or(String::new(), |unit| {
        let codes: Vec<String> = unit.symbol().bytes().chain([0]).map(|code| code.to_string()).collect();
        format!(
            r#"
    <FieldData>
      <Array type="String" Name="unit" NumberOfTuples="1" format="ascii">{}</Array>
    </FieldData>"#,
            codes.join(" ")
        )
    });
    let name = if channels == 3 { "rgb" } else { "values" };
    let mut header = format!(
        r#"<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
  <ImageData WholeExtent="0 {nx} 0 {ny} 0 {nz}" Origin="0 0 0" Spacing="{sx} {sy} {sz}">{unit}
    <Piece Extent="0 {nx} 0 {ny} 0 {nz}">
      <CellData Scalars="{name}">
        <DataArray type="{}" Name="{name}" NumberOfComponents="{channels}" format="appended" offset="0"/>
      </CellData>
    </Piece>
  </ImageData>
  <AppendedData encoding="raw">
   _"#,
        T::VTK
    )
    .into_bytes();
    header.extend_from_slice(&bytes.to_le_bytes());
    header
}

pub(crate) const FOOTER: &[u8] = b"\n  </AppendedData>\n</VTKFile>\n";
