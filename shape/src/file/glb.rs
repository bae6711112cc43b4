//! The container of a binary glTF 2.0 file: one mesh of triangles, its material, the bytes of both.

use std::collections::BTreeMap;
use std::io::{self, Write};

use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::buffer::{Target, View};
use gltf_json::image::MimeType;
use gltf_json::material::{AlphaCutoff, AlphaMode, StrengthFactor};
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::serialize::to_value;
use gltf_json::texture::{Info, MagFilter, MinFilter, Sampler, WrappingMode};
use gltf_json::validation::Checked::{self, Valid};
use gltf_json::{Accessor, Buffer, Extras, Image, Index, Material, Mesh, Node, Root, Scene, Texture, Value};
use nalgebra::{Point3, Vector3};

use crate::mesh::triangle_mesh::TriangleMesh;

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

/// A GLB while it is put together: the document, the binary chunk, and what its mesh will consist of.
pub(crate) struct Glb {
    root: Root,
    data: Vec<u8>,
    material: Material,
    attributes: BTreeMap<Checked<Semantic>, Index<Accessor>>,
}

impl Glb {
    /// A file without a mesh. If the mesh is not `opaque`, it is cut out where alpha is below 0.5.
    pub(crate) fn new(opaque: bool) -> Self {
        let mut root = Root::default();
        root.asset.generator = Some("stereology".to_owned());
        let mut material = Material {
            double_sided: true,
            ..Material::default()
        };
        material.pbr_metallic_roughness.metallic_factor = StrengthFactor(0.0);
        material.pbr_metallic_roughness.roughness_factor = StrengthFactor(0.6);
        if !opaque {
            material.alpha_mode = Valid(AlphaMode::Mask);
            material.alpha_cutoff = Some(AlphaCutoff(0.5));
        }
        Self {
            root,
            data: Vec::new(),
            material,
            attributes: BTreeMap::new(),
        }
    }

    fn add_view(&mut self, bytes: &[u8], target: Option<Target>) -> Index<View> {
        let view = View {
            buffer: Index::new(0),
            byte_length: bytes.len().into(),
            byte_offset: Some(self.data.len().into()),
            byte_stride: None,
            name: None,
            target: target.map(Valid),
            extensions: None,
            extras: Extras::default(),
        };
        self.data.extend(bytes);
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        self.root.push(view)
    }

    /// Adds `bytes` to the binary chunk and returns an accessor of all values in them.
    fn accessor(&mut self, bytes: &[u8], target: Target, component: ComponentType, type_: Type) -> Accessor {
        Accessor {
            buffer_view: Some(self.add_view(bytes, Some(target))),
            byte_offset: None,
            count: (bytes.len() / (component.size() * type_.multiplicity())).into(),
            component_type: Valid(GenericComponentType(component)),
            extensions: None,
            extras: Extras::default(),
            type_: Valid(type_),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: None,
        }
    }

    fn float_accessor(&mut self, values: impl Iterator<Item = f32>, type_: Type) -> Accessor {
        let bytes: Vec<u8> = values.flat_map(f32::to_le_bytes).collect();
        self.accessor(&bytes, Target::ArrayBuffer, ComponentType::F32, type_)
    }

    fn add_attribute(&mut self, semantic: Semantic, accessor: Accessor) {
        let index = self.root.push(accessor);
        self.attributes.insert(Valid(semantic), index);
    }

    /// Adds a PNG as the texture of the material: linear filters, mip maps, no repetition.
    pub(crate) fn add_texture(&mut self, png: &[u8]) {
        let view = self.add_view(png, None);
        let source = self.root.push(Image {
            buffer_view: Some(view),
            mime_type: Some(MimeType("image/png".to_owned())),
            name: None,
            uri: None,
            extensions: None,
            extras: Extras::default(),
        });
        let sampler = self.root.push(Sampler {
            mag_filter: Some(Valid(MagFilter::Linear)),
            min_filter: Some(Valid(MinFilter::LinearMipmapLinear)),
            wrap_s: Valid(WrappingMode::ClampToEdge),
            wrap_t: Valid(WrappingMode::ClampToEdge),
            ..Sampler::default()
        });
        let texture = self.root.push(Texture {
            name: None,
            sampler: Some(sampler),
            source,
            extensions: None,
            extras: Extras::default(),
        });
        self.material.pbr_metallic_roughness.base_color_texture = Some(Info {
            index: texture,
            tex_coord: 0,
            extensions: None,
            extras: Extras::default(),
        });
    }

    /// Adds colours in linear light, of four channels of 16 bits.
    pub(crate) fn add_colours(&mut self, corners: &Corners, of_vertex: impl Fn(u32) -> [u16; 4]) {
        let colours = corners.of.iter().flat_map(|corner| of_vertex(corner.vertex));
        let bytes: Vec<u8> = colours.flat_map(u16::to_le_bytes).collect();
        let mut accessor = self.accessor(&bytes, Target::ArrayBuffer, ComponentType::U16, Type::Vec4);
        accessor.normalized = true;
        self.add_attribute(Semantic::Colors(0), accessor);
    }

    /// Adds the texture coordinates.
    pub(crate) fn add_uvs(&mut self, corners: &Corners) {
        let accessor = self.float_accessor(corners.of.iter().flat_map(|corner| corner.uv), Type::Vec2);
        self.add_attribute(Semantic::TexCoords(0), accessor);
    }

    /// Adds the mesh and writes the file.
    ///
    /// Single precision is too coarse for a mesh far from the origin, so positions are relative to the centre of the
    /// bounding box, and the node's translation is that centre.
    ///
    /// # Errors
    ///
    /// If a coordinate is not finite or too large for single precision, a normal is not finite, the mesh takes more
    /// than 4 GB, or `out` fails.
    pub(crate) fn write(mut self, out: &mut impl Write, mesh: &TriangleMesh, corners: &Corners) -> io::Result<()> {
        let bounds = bounds(mesh);
        let centre = nalgebra::center(&bounds[0], &bounds[1]);
        check_numbers(mesh, corners, centre)?;
        self.add_positions(mesh, corners, bounds, centre);
        let normals = self.float_accessor(corners.of.iter().flat_map(|corner| corner.normal), Type::Vec3);
        self.add_attribute(Semantic::Normals, normals);
        let indices = corners.triangles.iter().flatten();
        let bytes: Vec<u8> = indices.flat_map(|i| i.to_le_bytes()).collect();
        let indices = self.accessor(&bytes, Target::ElementArrayBuffer, ComponentType::U32, Type::Scalar);
        let indices = self.root.push(indices);
        let (root, data) = self.into_scene(indices);

        let mut document = to_value(root)?;
        // The translation of `gltf_json::Node` is in single precision.
        document["nodes"][0]["translation"] = <[f64; 3]>::from(centre.coords).into();
        write_chunks(out, document.to_string().into_bytes(), &data)
    }

    /// Adds positions relative to `centre`, with their bounds.
    #[allow(clippy::cast_possible_truncation, reason = "GLB is single precision")]
    fn add_positions(&mut self, mesh: &TriangleMesh, corners: &Corners, bounds: [Point3<f64>; 2], centre: Point3<f64>) {
        let relative = |p: Point3<f64>| -> [f32; 3] { (p - centre).map(|x| x as f32).into() };
        let vertices = corners.of.iter().map(|corner| mesh.vertices[corner.vertex as usize]);
        let mut accessor = self.float_accessor(vertices.flat_map(relative), Type::Vec3);
        let [min, max] = bounds.map(|corner| Value::from(relative(corner)));
        (accessor.min, accessor.max) = (Some(min), Some(max));
        self.add_attribute(Semantic::Positions, accessor);
    }

    /// The document, with a scene of one node of one mesh, and the binary chunk.
    fn into_scene(self, indices: Index<Accessor>) -> (Root, Vec<u8>) {
        let Self {
            mut root,
            data,
            material,
            attributes,
        } = self;
        let material = root.push(material);
        let primitive = Primitive {
            attributes,
            extensions: None,
            extras: Extras::default(),
            indices: Some(indices),
            material: Some(material),
            mode: Valid(Mode::Triangles),
            targets: None,
        };
        let mesh = root.push(Mesh {
            extensions: None,
            extras: Extras::default(),
            name: None,
            primitives: vec![primitive],
            weights: None,
        });
        let node = root.push(Node {
            mesh: Some(mesh),
            ..Node::default()
        });
        root.scene = Some(root.push(Scene {
            extensions: None,
            extras: Extras::default(),
            name: None,
            nodes: vec![node],
        }));
        root.push(Buffer {
            byte_length: data.len().into(),
            name: None,
            uri: None,
            extensions: None,
            extras: Extras::default(),
        });
        (root, data)
    }
}

/// Writes the header and both chunks. The length of `data` must be a multiple of 4.
fn write_chunks(out: &mut impl Write, mut json: Vec<u8>, data: &[u8]) -> io::Result<()> {
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = |bytes: usize| {
        u32::try_from(bytes).map_err(|_| io::Error::other("a GLB holds at most 4 GB; take a mesh of fewer triangles"))
    };
    let whole = length(12 + 8 + json.len() + 8 + data.len())?;
    out.write_all(b"glTF\x02\0\0\0")?;
    out.write_all(&whole.to_le_bytes())?;
    for (kind, chunk) in [(b"JSON", &*json), (b"BIN\0", data)] {
        out.write_all(&length(chunk.len())?.to_le_bytes())?;
        out.write_all(kind)?;
        out.write_all(chunk)?;
    }
    Ok(())
}

/// glTF has no place for infinities and values that are not numbers.
#[allow(clippy::cast_possible_truncation, reason = "GLB is single precision")]
fn check_numbers(mesh: &TriangleMesh, corners: &Corners, centre: Point3<f64>) -> io::Result<()> {
    let bad = |corner: &&Corner| {
        let position = mesh.vertices[corner.vertex as usize] - centre;
        let is_finite = position.iter().all(|x| (*x as f32).is_finite())
            && corner.normal.iter().chain(&corner.uv).all(|x| x.is_finite());
        !is_finite
    };
    match corners.of.iter().find(bad) {
        None => Ok(()),
        Some(corner) => Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            format!(
                "vertex {}: its position, normal or place in the texture is not finite, or too large for single precision",
                corner.vertex
            ),
        )),
    }
}

fn bounds(mesh: &TriangleMesh) -> [Point3<f64>; 2] {
    let each = |from: f64, nearer: fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64>| {
        let coordinates = mesh
            .triangles
            .iter()
            .flatten()
            .map(|&i| mesh.vertices[i as usize].coords);
        Point3::from(coordinates.fold(Vector3::repeat(from), |far, v| nearer(&far, &v)))
    };
    [each(f64::INFINITY, Vector3::inf), each(f64::NEG_INFINITY, Vector3::sup)]
}
