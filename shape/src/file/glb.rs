//! The container of a binary glTF 2.0 file: one mesh of triangles, its material, the bytes of both.

use std::collections::BTreeMap;
use std::io::{self, Write};

use nalgebra::{Point3, Vector3};

use crate::mesh::triangle_mesh::TriangleMesh;

const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;
const FLOAT: u32 = 5126;
const U16: u32 = 5123;
const U32: u32 = 5125;

/// Vertices of a GLB: those of the mesh, once for each normal and place in the texture they have.
pub(crate) struct Corners {
    of: Vec<Corner>,
    triangles: Vec<[u32; 3]>,
}

struct Corner {
    vertex: u32,
    normal: [f32; 3],
    uv: [f32; 2],
}

impl Corners {
    /// `uv` gives the place in the texture of a corner (0, 1, 2) of a triangle.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "GLB is single precision; more than 2^32 corners do not fit into memory"
    )]
    pub(crate) fn new(
        mesh: &TriangleMesh,
        normals: &[[Vector3<f64>; 3]],
        uv: impl Fn(usize, usize) -> [f64; 2],
    ) -> Self {
        let mut of = Vec::new();
        let mut known: Vec<BTreeMap<[u32; 5], u32>> = vec![BTreeMap::new(); mesh.vertices.len()];
        let corners = mesh.triangles.iter().zip(normals).enumerate();
        let triangles = corners
            .map(|(index, (triangle, normals))| {
                std::array::from_fn(|k| {
                    let vertex = triangle[k];
                    let normal: [f32; 3] = normals[k].map(|x| x as f32).into();
                    let uv = uv(index, k).map(|x| x as f32);
                    let key = [normal[0], normal[1], normal[2], uv[0], uv[1]].map(f32::to_bits);
                    *known[vertex as usize].entry(key).or_insert_with(|| {
                        of.push(Corner { vertex, normal, uv });
                        (of.len() - 1) as u32
                    })
                })
            })
            .collect();
        Self { of, triangles }
    }
}

/// A GLB as it is put together.
#[derive(Default)]
pub(crate) struct Glb {
    data: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
    /// Members of the document beside the mesh: `"images":[...],` and so on, each with its comma.
    extras: String,
}

impl Glb {
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let target = target.map_or_else(String::new, |target| format!(r#","target":{target}"#));
        let (from, length) = (self.data.len(), bytes.len());
        self.views.push(format!(
            r#"{{"buffer":0,"byteOffset":{from},"byteLength":{length}{target}}}"#
        ));
        self.data.extend(bytes);
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        self.views.len() - 1
    }

    fn accessor(&mut self, bytes: &[u8], target: u32, form: &str) -> usize {
        let view = self.view(bytes, Some(target));
        self.accessors.push(format!(r#"{{"bufferView":{view},{form}}}"#));
        self.accessors.len() - 1
    }

    /// A PNG as the only texture: its index.
    pub(crate) fn texture(&mut self, png: &[u8]) -> usize {
        let view = self.view(png, None);
        // Linear filters, mip maps; no repetition.
        self.extras = format!(
            concat!(
                r#""images":[{{"bufferView":{},"mimeType":"image/png"}}],"#,
                r#""samplers":[{{"magFilter":9729,"minFilter":9987,"wrapS":33071,"wrapT":33071}}],"#,
                r#""textures":[{{"source":0,"sampler":0}}],"#
            ),
            view
        );
        0
    }

    /// Colours of 16 bits and four channels as an attribute.
    pub(crate) fn colours(&mut self, corners: &Corners, of_vertex: impl Fn(u32) -> [u16; 4]) -> String {
        let colours = corners.of.iter().flat_map(|corner| of_vertex(corner.vertex));
        let bytes: Vec<u8> = colours.flat_map(u16::to_le_bytes).collect();
        let count = corners.of.len();
        let form = format!(r#""componentType":{U16},"normalized":true,"count":{count},"type":"VEC4""#);
        format!(r#","COLOR_0":{}"#, self.accessor(&bytes, VERTICES, &form))
    }

    /// Places in the texture as an attribute.
    pub(crate) fn uvs(&mut self, corners: &Corners) -> String {
        let uvs = corners.of.iter().flat_map(|corner| corner.uv);
        let bytes: Vec<u8> = uvs.flat_map(f32::to_le_bytes).collect();
        let count = corners.of.len();
        let form = format!(r#""componentType":{FLOAT},"count":{count},"type":"VEC2""#);
        format!(r#","TEXCOORD_0":{}"#, self.accessor(&bytes, VERTICES, &form))
    }

    /// Writes the file: positions, normals, the other `attributes`, and the material's members beside its roughness.
    ///
    /// Single precision loses a mesh far from the origin, so it is written about its centre and moved there by its
    /// node.
    #[allow(clippy::cast_possible_truncation, reason = "GLB is single precision")]
    pub(crate) fn write(
        mut self,
        out: &mut impl Write,
        mesh: &TriangleMesh,
        corners: &Corners,
        attributes: &str,
        [material, surface]: [&str; 2],
    ) -> io::Result<()> {
        let (low, high) = bounds(mesh);
        let centre = nalgebra::center(&low, &high);
        let single = |v: Vector3<f64>| -> [f32; 3] { v.map(|x| x as f32).into() };
        let place = |corner: &Corner| single(mesh.vertices[corner.vertex as usize] - centre);
        let bytes =
            |values: Vec<[f32; 3]>| -> Vec<u8> { values.into_iter().flatten().flat_map(f32::to_le_bytes).collect() };
        let count = corners.of.len();
        let (low, high) = (single(low - centre), single(high - centre));
        let positions = self.accessor(
            &bytes(corners.of.iter().map(place).collect()),
            VERTICES,
            &format!(
                r#""componentType":{FLOAT},"count":{count},"type":"VEC3","min":[{},{},{}],"max":[{},{},{}]"#,
                low[0], low[1], low[2], high[0], high[1], high[2]
            ),
        );
        let normals = self.accessor(
            &bytes(corners.of.iter().map(|corner| corner.normal).collect()),
            VERTICES,
            &format!(r#""componentType":{FLOAT},"count":{count},"type":"VEC3""#),
        );
        let indices: Vec<u8> = corners
            .triangles
            .iter()
            .flatten()
            .flat_map(|i| i.to_le_bytes())
            .collect();
        let count = 3 * corners.triangles.len();
        let indices = self.accessor(
            &indices,
            INDICES,
            &format!(r#""componentType":{U32},"count":{count},"type":"SCALAR""#),
        );
        let Point3 { coords: c } = centre;
        let json = format!(
            concat!(
                r#"{{"asset":{{"version":"2.0","generator":"stereology"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0,"translation":[{},{},{}]}}],"#,
                r#""materials":[{{{}"doubleSided":true,"pbrMetallicRoughness":{{{}"metallicFactor":0,"roughnessFactor":0.6}}}}],{}"#,
                r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":{},"NORMAL":{}{}}},"indices":{},"material":0}}]}}],"#,
                r#""accessors":[{}],"bufferViews":[{}],"buffers":[{{"byteLength":{}}}]}}"#
            ),
            c.x,
            c.y,
            c.z,
            material,
            surface,
            self.extras,
            positions,
            normals,
            attributes,
            indices,
            self.accessors.join(","),
            self.views.join(","),
            self.data.len()
        );
        let mut json = json.into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let length = |bytes: usize| {
            u32::try_from(bytes)
                .map_err(|_| io::Error::other("a GLB holds at most 4 GB; take a mesh of fewer triangles"))
        };
        let whole = length(12 + 8 + json.len() + 8 + self.data.len())?;
        out.write_all(b"glTF\x02\0\0\0")?;
        out.write_all(&whole.to_le_bytes())?;
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &self.data)] {
            out.write_all(&length(chunk.len())?.to_le_bytes())?;
            out.write_all(kind)?;
            out.write_all(chunk)?;
        }
        Ok(())
    }
}

/// What is transparent is cut out: half between what is seen and a hole is the hole's rim.
pub(crate) fn alpha_mode(opaque: bool) -> &'static str {
    if opaque {
        ""
    } else {
        r#""alphaMode":"MASK","alphaCutoff":0.5,"#
    }
}

fn bounds(mesh: &TriangleMesh) -> (Point3<f64>, Point3<f64>) {
    let each = |from: f64, nearer: fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64>| {
        let coordinates = mesh
            .triangles
            .iter()
            .flatten()
            .map(|&i| mesh.vertices[i as usize].coords);
        Point3::from(coordinates.fold(Vector3::repeat(from), |far, v| nearer(&far, &v)))
    };
    (each(f64::INFINITY, Vector3::inf), each(f64::NEG_INFINITY, Vector3::sup))
}
