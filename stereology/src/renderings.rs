//! Rendered images of a packing, and of a mesh carved from a solid; lit as by [`render`](crate::render).

use std::collections::BTreeMap;

use image::RgbImage;
use nalgebra::{Point3, Vector3};
use stereology_anneal::Packing;
use stereology_metrics::Progress;
use stereology_render::{Camera, Material, RenderError, RenderOptions, render_material, render_mesh};
use stereology_shape::{BodyKind, Particle, TriangleMesh, UnitBody};
use stereology_volume::Solid;

/// Image of a mesh carved from a solid; voids are holes. `place` maps a point of the mesh to the solid and preserves
/// lengths: the identity, a shift, [`turned`](stereology_volume::turned).
///
/// # Errors
///
/// As [`render_material`].
///
/// # Examples
///
/// ```
/// use nalgebra::{Point3, UnitQuaternion, Vector3};
/// use std::ops::ControlFlow;
/// use stereology::renderings::render_solid;
/// use stereology::render::{Camera, RenderOptions};
/// use stereology::shape::{Arrangement, Body, Particle, PeriodicBox, TriangleMesh, UnitBody};
/// use stereology::volume::Solid;
///
/// let ball = UnitBody::new(&Body::sphere(1.0)?);
/// let bubble = Particle { shape: 0, size: 3.0, category: 0, position: Point3::origin(), orientation: UnitQuaternion::identity() };
/// let foam = Solid::new(Arrangement::new(vec![ball], vec![bubble], PeriodicBox::new(Vector3::repeat(5.0))?)?, vec![[0.5; 3]], [0.9, 0.8, 0.5], None)?.with_voids(&[0])?;
/// let block = TriangleMesh::cuboid([5.0; 3]);
/// let options = RenderOptions::default().with_size(60, 60);
/// let picture = render_solid(&foam, &block, &|p| *p, &Camera::default(), &options, &|_| ControlFlow::Continue(()))?;
/// assert_eq!(picture.dimensions(), (60, 60));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn render_solid(
    solid: &Solid,
    mesh: &TriangleMesh,
    place: &(dyn Fn(&Point3<f64>) -> Point3<f64> + Sync),
    camera: &Camera,
    options: &RenderOptions,
    progress: Progress<'_>,
) -> Result<RgbImage, RenderError> {
    let colour = |p: &Point3<f64>| solid.colour_at(&place(p));
    let voids = |p: &Point3<f64>| solid.void_distance_at(&place(p));
    let mut material = Material::new(&colour);
    if !solid.voids().is_empty() {
        material = material.with_voids(&voids);
    }
    render_material(mesh, &material, camera, options, progress)
}

/// Image of the particles of a packing, each drawn whole at its position in the box, with the colour of its index.
///
/// Spheres and ellipsoids are drawn with 320 or 1280 faces, meshes with their own. Cost: some seconds per million
/// pixels, half a kilobyte per face.
///
/// # Errors
///
/// [`RenderError::Empty`] without particles; others as [`render_mesh`].
///
/// # Examples
///
/// ```
/// use nalgebra::{Point3, UnitQuaternion, Vector3};
/// use stereology::anneal::Packing;
/// use stereology::renderings::render_packing;
/// use stereology::render::RenderOptions;
/// use stereology::shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};
///
/// let ball = UnitBody::new(&Body::sphere(1.0)?);
/// let at = |x| Particle { shape: 0, size: 1.0, category: 0, position: Point3::new(x, 1.0, 1.0), orientation: UnitQuaternion::identity() };
/// let packing = Packing::verify(&Arrangement::new([ball], vec![at(0.5), at(2.0)], PeriodicBox::new(Vector3::new(3.0, 2.0, 2.0))?)?)?;
/// let colours = [[0.8, 0.3, 0.2], [0.2, 0.3, 0.8]];
/// let picture = render_packing(&packing, &|i| colours[i], &RenderOptions::default().with_size(80, 60))?;
/// assert_eq!(picture.dimensions(), (80, 60));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn render_packing(
    packing: &Packing,
    colour: &(dyn Fn(usize) -> [f32; 3] + Sync),
    options: &RenderOptions,
) -> Result<RgbImage, RenderError> {
    let (bodies, particles) = (packing.bodies(), packing.particles());
    let subdivisions = if particles.len() > 1000 { 2 } else { 3 };
    let outlines: Vec<TriangleMesh> = bodies.iter().map(|body| outline(body, subdivisions)).collect();
    let mut mesh = TriangleMesh {
        vertices: Vec::new(),
        triangles: Vec::new(),
    };
    for particle in particles {
        let of = &outlines[particle.shape];
        let first = u32::try_from(mesh.vertices.len()).unwrap_or(u32::MAX);
        mesh.vertices.extend(of.vertices.iter().map(|v| particle.to_world(v)));
        mesh.triangles
            .extend(of.triangles.iter().map(|t| t.map(|v| v.saturating_add(first))));
    }
    let owners = Owners::new(bodies, particles);
    let camera = Camera {
        up: Vector3::z_axis(),
        azimuth: 30.0,
        elevation: 24.0,
        ..Camera::default()
    };
    render_mesh(&mesh, &|p| colour(owners.of(p)), &camera, options)
}

fn outline(body: &UnitBody, subdivisions: u32) -> TriangleMesh {
    match (body.mesh(), body.body().kind()) {
        (Some(mesh), _) => mesh.as_triangle_mesh().clone(),
        (None, BodyKind::Ellipsoid { semi_axes }) => {
            let axes = Vector3::from(semi_axes) / body.body().size();
            TriangleMesh::icosphere(2.0, subdivisions).mapped(|p| Point3::from(p.coords.component_mul(&axes)))
        }
        (None, _) => TriangleMesh::icosphere(1.0, subdivisions),
    }
}

/// The particle of a point of the surface: the one whose surface is nearest.
struct Owners<'a> {
    bodies: &'a [UnitBody],
    particles: &'a [Particle],
    cell: f64,
    near: BTreeMap<[i64; 3], Vec<usize>>,
}

impl<'a> Owners<'a> {
    fn new(bodies: &'a [UnitBody], particles: &'a [Particle]) -> Self {
        let reach = |p: &Particle| bodies[p.shape].bounding_radius() * p.size * 1.001;
        let mean = particles.iter().map(reach).sum::<f64>() / particles.len().max(1) as f64;
        let mut owners = Self {
            bodies,
            particles,
            cell: (2.0 * mean).max(f64::MIN_POSITIVE),
            near: BTreeMap::new(),
        };
        for (i, particle) in particles.iter().enumerate() {
            let far = Vector3::repeat(reach(particle));
            let (from, to) = (
                owners.cell_of(&(particle.position - far)),
                owners.cell_of(&(particle.position + far)),
            );
            for x in from[0]..=to[0] {
                for y in from[1]..=to[1] {
                    for z in from[2]..=to[2] {
                        owners.near.entry([x, y, z]).or_default().push(i);
                    }
                }
            }
        }
        owners
    }

    #[allow(clippy::cast_possible_truncation, reason = "places are few cells from the origin")]
    fn cell_of(&self, p: &Point3<f64>) -> [i64; 3] {
        [p.x, p.y, p.z].map(|x| (x / self.cell).floor() as i64)
    }

    fn of(&self, p: &Point3<f64>) -> usize {
        let distance = |i: usize| {
            let particle = &self.particles[i];
            let local = self.bodies[particle.shape].signed_distance(&particle.to_local(p));
            (local * particle.size).abs()
        };
        let near = self.near.get(&self.cell_of(p)).map_or(&[][..], Vec::as_slice);
        near.iter()
            .map(|&i| (distance(i), i))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map_or(0, |(_, i)| i)
    }
}
