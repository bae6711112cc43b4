//! Triangle meshes that enclose a solid, checked once.

use nalgebra::{Point3, Vector3};

use crate::mesh::measures;
use crate::mesh::mesh_error::{MeshError, Repair};
use crate::mesh::quickhull::hull_mesh;
use crate::mesh::self_intersection::first_crossing;
use crate::mesh::topology::{self, Neighbours};
use crate::mesh::triangle_mesh::{TriangleMesh, flush_tiny};
use crate::mesh::winding::ray_crossing;

/// A closed, oriented, manifold triangle mesh that encloses a volume. Section laws need one.
///
/// Every edge is shared by exactly two triangles with consistent orientation. Safe repairs are made and listed by
/// [`repairs`](Self::repairs); any other defect is an error that states its position. The mesh may consist of several
/// bodies that share no edge: a body inside another is a cavity (its triangles face the cavity); separate bodies are
/// one particle of several components, measured together. A surface that intersects itself or another of its bodies is
/// an error that states the position.
///
/// # Examples
///
/// ```
/// use stereology_shape::{ClosedMesh, TriangleMesh};
///
/// let cube = ClosedMesh::try_from(TriangleMesh::cuboid([1.0; 3]))?;
/// assert!((cube.volume() - 1.0).abs() < 1e-12);
/// assert!((cube.mean_width() - 1.5).abs() < 1e-12);
///
/// let mut open = TriangleMesh::cuboid([1.0; 3]);
/// open.triangles.pop();
/// assert!(ClosedMesh::try_from(open).is_err());
/// # Ok::<(), stereology_shape::MeshError>(())
/// ```
#[derive(Clone, PartialEq)]
pub struct ClosedMesh {
    mesh: TriangleMesh,
    neighbours: Neighbours,
    /// `None`: the mesh is its own hull.
    hull: Option<TriangleMesh>,
    repairs: Vec<Repair>,
    volume: f64,
    surface_area: f64,
    centroid: Point3<f64>,
    mean_width: f64,
    signed_mean_width: f64,
    convex: bool,
}

impl TryFrom<TriangleMesh> for ClosedMesh {
    type Error = MeshError;

    /// Checks the mesh, makes safe repairs, and measures it. Cost: T log T, and the pairs of triangles whose bounding
    /// boxes overlap.
    fn try_from(mesh: TriangleMesh) -> Result<Self, MeshError> {
        Self::welded_within(mesh, 0.0)
    }
}

impl ClosedMesh {
    /// The mesh with vertices nearer than `tolerance` to each other joined ([`TriangleMesh::weld_within`]), then
    /// checked as by `try_from`.
    ///
    /// # Errors
    ///
    /// [`MeshError`] if the triangles enclose no solid.
    ///
    /// ```
    /// use stereology_shape::{ClosedMesh, Repair, TriangleMesh};
    ///
    /// // A cube of two halves whose seams do not match exactly.
    /// let cube = TriangleMesh::cuboid([1.0; 3]);
    /// let (mut one, mut two) = (cube.clone(), cube.mapped(|p| p * (1.0 + 1e-9)));
    /// two.triangles.drain(..6);
    /// one.triangles.truncate(6);
    /// let halves = one.with(&two);
    /// assert!(ClosedMesh::try_from(halves.clone()).is_err());
    /// assert_eq!(ClosedMesh::welded_within(halves, 1e-6)?.repairs()[0], Repair::WeldedWithinTolerance { count: 8 });
    /// # Ok::<(), stereology_shape::MeshError>(())
    /// ```
    pub fn welded_within(mut mesh: TriangleMesh, tolerance: f64) -> Result<Self, MeshError> {
        let mut repairs = Vec::new();
        let mut note = |count: usize, repair: Repair| {
            if count > 0 {
                repairs.push(repair);
            }
        };
        check_numbers(&mesh)?;
        let count = flush_tiny(&mut mesh.vertices);
        note(count, Repair::FlushedCoordinates { count });
        let count = mesh.weld();
        note(count, Repair::WeldedVertices { count });
        if tolerance > 0.0 {
            let count = mesh.weld_within(tolerance);
            note(count, Repair::WeldedWithinTolerance { count });
        }
        let count = topology::drop_degenerate(&mut mesh);
        note(count, Repair::DroppedDegenerate { count });
        let count = topology::drop_duplicates(&mut mesh);
        note(count, Repair::DroppedDuplicates { count });
        let count = mesh.drop_unused_vertices();
        note(count, Repair::DroppedUnusedVertices { count });
        let mut neighbours = topology::neighbours(&mesh)?;
        let parts = topology::components(&neighbours);
        let count = topology::orient(&mut mesh, &mut neighbours, &parts)?;
        note(count, Repair::TurnedTriangles { count });
        if let Some(crossing) = first_crossing(&mesh, &neighbours) {
            return Err(MeshError::SelfIntersection {
                triangles: crossing.triangles,
                place: crossing.place.coords.into(),
                count: crossing.count,
            });
        }
        let bodies = turn_inside_out(&mut mesh, &mut neighbours, &parts);
        note(bodies, Repair::TurnedInsideOut { bodies });
        Self::measure(mesh, neighbours, repairs, parts.len())
    }
}

fn check_numbers(mesh: &TriangleMesh) -> Result<(), MeshError> {
    const LIMIT: usize = u32::MAX as usize / 4;
    if let Some(vertex) = mesh.vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
        return Err(MeshError::NotFinite { vertex });
    }
    if mesh.triangles.len() > LIMIT || mesh.vertices.len() > LIMIT {
        return Err(MeshError::TooLarge {
            triangles: mesh.triangles.len(),
            limit: LIMIT,
        });
    }
    let vertices = mesh.vertices.len();
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        if let Some(&index) = corners.iter().find(|&&i| i as usize >= vertices) {
            return Err(MeshError::IndexOutOfRange {
                triangle,
                index,
                vertices,
            });
        }
    }
    if mesh.triangles.is_empty() {
        return Err(MeshError::Empty);
    }
    Ok(())
}

/// Reverses every body whose orientation does not match its nesting: a body inside an odd number of others bounds a
/// cavity. Returns their number.
fn turn_inside_out(mesh: &mut TriangleMesh, across: &mut Neighbours, parts: &[Vec<u32>]) -> usize {
    let boxes: Vec<_> = parts.iter().map(|part| bounding_box(mesh, part)).collect();
    let within =
        |p: &Point3<f64>, (low, high): &(Point3<f64>, Point3<f64>)| (0..3).all(|k| low[k] < p[k] && p[k] < high[k]);
    let mut wrong = Vec::new();
    for (i, part) in parts.iter().enumerate() {
        let point = mesh.corners(part[0] as usize)[0];
        let depth = (0..parts.len())
            .filter(|&j| j != i && within(&point, &boxes[j]))
            .filter(|&j| {
                parts[j]
                    .iter()
                    .map(|&t| ray_crossing(&mesh.corners(t as usize), &point))
                    .sum::<i32>()
                    != 0
            })
            .count();
        let outward = measures::signed_volume(mesh, part, &boxes[i].0) > 0.0;
        if outward != (depth % 2 == 0) {
            wrong.push(i);
        }
    }
    for &i in &wrong {
        for &t in &parts[i] {
            topology::turn(mesh, across, t as usize);
        }
    }
    wrong.len()
}

fn bounding_box(mesh: &TriangleMesh, part: &[u32]) -> (Point3<f64>, Point3<f64>) {
    let first = mesh.corners(part[0] as usize)[0];
    let corners = part.iter().flat_map(|&t| mesh.corners(t as usize));
    corners.fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)))
}

/// Surface area, volume and centroid of a mesh that encloses a volume.
fn solid(mesh: &TriangleMesh) -> Result<(f64, f64, Point3<f64>), MeshError> {
    let (low, high) = mesh.bounding_box().ok_or(MeshError::Empty)?;
    let extent = (high - low).max();
    if extent == 0.0 {
        return Err(MeshError::ZeroVolume);
    }
    if !(1e-60..=1e60).contains(&extent) {
        return Err(MeshError::Extent { extent });
    }
    let surface_area = measures::surface_area(mesh);
    let (volume, centroid) = measures::volume_and_centroid(mesh, &nalgebra::center(&low, &high));
    // Rounding of the sum is about ε × surface × extent.
    if volume.is_nan() || volume <= 1e-13 * surface_area * extent {
        return Err(MeshError::ZeroVolume);
    }
    Ok((surface_area, volume, centroid))
}

impl ClosedMesh {
    fn measure(
        mesh: TriangleMesh,
        neighbours: Neighbours,
        repairs: Vec<Repair>,
        bodies: usize,
    ) -> Result<Self, MeshError> {
        let (surface_area, volume, centroid) = solid(&mesh)?;
        let signed_mean_width = measures::signed_mean_width(&mesh, &neighbours);
        let hull = hull_mesh(&mesh.vertices).map_err(|_| MeshError::ZeroVolume)?;
        let (_, hull_volume, _) = solid(&hull)?;
        let mean_width = measures::signed_mean_width(&hull, &topology::neighbours(&hull)?);
        let convex = bodies == 1 && volume >= (1.0 - CONVEX_VOLUME_TOLERANCE) * hull_volume;
        let hull = Some(hull);
        Ok(Self {
            mesh,
            neighbours,
            hull,
            repairs,
            volume,
            surface_area,
            centroid,
            mean_width,
            signed_mean_width,
            convex,
        })
    }

    /// The closed mesh of a convex hull, which needs no repair and is its own hull.
    pub(crate) fn from_hull(mesh: TriangleMesh) -> Result<Self, MeshError> {
        let neighbours = topology::neighbours(&mesh)?;
        let (surface_area, volume, centroid) = solid(&mesh)?;
        let mean_width = measures::signed_mean_width(&mesh, &neighbours);
        let (hull, repairs, signed_mean_width) = (None, Vec::new(), mean_width);
        Ok(Self {
            mesh,
            neighbours,
            hull,
            repairs,
            volume,
            surface_area,
            centroid,
            mean_width,
            signed_mean_width,
            convex: true,
        })
    }

    /// The mesh moved so that `centre` is at the origin, and scaled. The triangles stay; the measures are scaled.
    pub(crate) fn centred_and_scaled(&self, centre: &Point3<f64>, scale: f64) -> Self {
        let place = |p: &Point3<f64>| Point3::from((p - centre) * scale);
        Self {
            mesh: self.mesh.mapped(place),
            neighbours: self.neighbours.clone(),
            hull: self.hull.as_ref().map(|hull| hull.mapped(place)),
            repairs: self.repairs.clone(),
            volume: self.volume * scale.powi(3),
            surface_area: self.surface_area * scale * scale,
            centroid: place(&self.centroid),
            mean_width: self.mean_width * scale,
            signed_mean_width: self.signed_mean_width * scale,
            convex: self.convex,
        }
    }

    /// The repairs made when the mesh was checked; empty if there were none.
    ///
    /// ```
    /// # use stereology_shape::{ClosedMesh, Repair, TriangleMesh};
    /// let mut cube = TriangleMesh::cuboid([1.0; 3]);
    /// cube.triangles[3].swap(0, 1);
    /// assert_eq!(ClosedMesh::try_from(cube)?.repairs(), [Repair::TurnedTriangles { count: 1 }]);
    /// # Ok::<(), stereology_shape::MeshError>(())
    /// ```
    #[must_use]
    pub fn repairs(&self) -> &[Repair] {
        &self.repairs
    }

    /// Positions of the vertices.
    #[must_use]
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.mesh.vertices
    }

    /// Indices of the triangles' corners, counter-clockwise seen from outside.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.mesh.triangles
    }

    /// For each triangle, the triangles across its edges 0→1, 1→2, 2→0. Contours of sections follow them.
    #[must_use]
    pub fn neighbours(&self) -> &[[u32; 3]] {
        &self.neighbours
    }

    /// The plain triangles, for writing or drawing.
    #[must_use]
    pub fn as_triangle_mesh(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// The convex hull's triangles; the mesh's own if it was made by [`convex_hull`](crate::convex_hull).
    #[must_use]
    pub fn hull(&self) -> &TriangleMesh {
        self.hull.as_ref().unwrap_or(&self.mesh)
    }

    /// Enclosed volume, cavities subtracted; unit of length cubed.
    #[must_use]
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Area of all triangles; unit of length squared.
    #[must_use]
    pub fn surface_area(&self) -> f64 {
        self.surface_area
    }

    /// Centre of volume.
    #[must_use]
    pub fn centroid(&self) -> Point3<f64> {
        self.centroid
    }

    /// Mean width (mean caliper diameter) of the convex hull: the mean over all directions of the distance between two
    /// touching planes.
    ///
    /// The mean number of parallel planes of unit spacing that meet the body.
    ///
    /// # Formula
    ///
    /// ```text
    /// H_hull = (1/4π) Σ over hull edges of length × angle between the normals        (box a × b × c: (a + b + c) / 2)
    /// ```
    #[must_use]
    pub fn mean_width(&self) -> f64 {
        self.mean_width
    }

    /// The same sum over the mesh's own edges, concave angles negative: the mean of profiles minus holes over random
    /// planes, per plane spacing. Equal to [`mean_width`](Self::mean_width) if the body is convex.
    #[must_use]
    pub fn signed_mean_width(&self) -> f64 {
        self.signed_mean_width
    }

    /// Whether the mesh is one body that fills its convex hull, to one part in ten million of the volume: rounded
    /// coordinates make dents of that order.
    #[must_use]
    pub fn is_convex(&self) -> bool {
        self.convex
    }

    /// Distance from `centre` to the farthest point of the body.
    pub(crate) fn reach(&self, centre: &Point3<f64>) -> f64 {
        self.hull()
            .vertices
            .iter()
            .map(|v| (v - centre).norm())
            .fold(0.0, f64::max)
    }

    /// Lowest and highest n·x of the body.
    pub(crate) fn extent(&self, normal: &Vector3<f64>) -> (f64, f64) {
        let heights = self.hull().vertices.iter().map(|v| v.coords.dot(normal));
        heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| {
            (low.min(h), high.max(h))
        })
    }
}

impl std::fmt::Debug for ClosedMesh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ClosedMesh")
            .field("vertices", &self.mesh.vertices.len())
            .field("triangles", &self.mesh.triangles.len())
            .field("volume", &self.volume)
            .field("convex", &self.convex)
            .field("repairs", &self.repairs)
            .finish_non_exhaustive()
    }
}

/// A mesh whose volume is below that of its hull by at most this fraction counts as convex.
const CONVEX_VOLUME_TOLERANCE: f64 = 1e-7;
