//! A body at the origin with size 1, prepared for fast queries.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::{Point3, UnitVector3, Vector3, Vector4};

use crate::body::{Body, BodyKind, mesh_profile_areas};
use crate::mesh::closed_mesh::ClosedMesh;
use crate::query::chord::Chords;
use crate::query::convex::{SupportMap, half_spaces};
use crate::query::elliptic;
use crate::query::inside::Columns;
use crate::query::nearest::BoxTree;

/// A [`Body`] moved so that its centroid is at the origin and scaled to size 1: the circle with the area of its largest
/// section has diameter 1. A [`Particle`](crate::Particle) is such a body, scaled, rotated and moved.
///
/// Clones share the prepared data.
///
/// # Examples
///
/// ```
/// use nalgebra::{Point3, Vector3};
/// use stereology_shape::{Body, UnitBody};
///
/// let ball = UnitBody::new(&Body::sphere(25.0)?);
/// assert_eq!(ball.bounding_radius(), 0.5);
/// assert!(ball.contains(&Point3::new(0.0, 0.0, 0.49)));
/// assert_eq!(ball.signed_distance(&Point3::new(0.0, 2.0, 0.0)), 1.5);
/// assert_eq!(ball.support(&Vector3::x()), Point3::new(0.5, 0.0, 0.0));
/// # Ok::<(), stereology_shape::BodyError>(())
/// ```
#[derive(Clone, Debug)]
pub struct UnitBody {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    body: Body,
    mesh: Option<ClosedMesh>,
    form: Form,
    volume: f64,
    bounding_radius: f64,
    inscribed_radius: f64,
}

#[derive(Debug)]
enum Form {
    Sphere,
    Ellipsoid {
        axes: Vector3<f64>,
    },
    /// Convex, with few faces.
    Polytope {
        half_spaces: Vec<Vector4<f64>>,
        support: SupportMap,
        tree: BoxTree,
    },
    /// Not convex, or with many faces.
    Mesh {
        columns: Columns,
        support: SupportMap,
        tree: BoxTree,
    },
}

/// Up to this number of faces, testing all half-spaces is faster than looking up a column of triangles.
const FEW_FACES: usize = 64;

impl UnitBody {
    /// Moves and scales the body and prepares its queries. Cost for meshes of T triangles: T log T.
    #[must_use]
    pub fn new(body: &Body) -> Self {
        let size = body.size();
        let (form, mesh) = match body.kind() {
            BodyKind::Sphere { .. } => (Form::Sphere, None),
            BodyKind::Ellipsoid { semi_axes } => (
                Form::Ellipsoid {
                    axes: Vector3::from(semi_axes) / size,
                },
                None,
            ),
            BodyKind::Mesh(mesh) => {
                let mesh = mesh.centred_and_scaled(&mesh.centroid(), size.recip());
                (prepare(&mesh), Some(mesh))
            }
        };
        let volume = body.volume() / size.powi(3);
        let bounding_radius = match &form {
            Form::Sphere => 0.5,
            Form::Ellipsoid { axes } => axes.max(),
            _ => mesh.as_ref().map_or(0.0, |mesh| mesh.reach(&Point3::origin())),
        };
        let mut inner = Inner {
            body: body.clone(),
            mesh,
            form,
            volume,
            bounding_radius,
            inscribed_radius: 0.0,
        };
        inner.inscribed_radius = (-inner.signed_distance(&Point3::origin())).max(0.0);
        Self { inner: Arc::new(inner) }
    }

    /// The body as given, in its own position and size.
    #[must_use]
    pub fn body(&self) -> &Body {
        &self.inner.body
    }

    /// The mesh in unit coordinates, if the body is a mesh.
    #[must_use]
    pub fn mesh(&self) -> Option<&ClosedMesh> {
        self.inner.mesh.as_ref()
    }

    /// Volume at size 1; a particle of size s has s³ times this volume.
    #[must_use]
    pub fn volume(&self) -> f64 {
        self.inner.volume
    }

    /// Area of the surface at size 1.
    #[must_use]
    pub fn surface_area(&self) -> f64 {
        self.body().surface_area() / self.body().size().powi(2)
    }

    /// Mean width of the hull at size 1.
    #[must_use]
    pub fn mean_width(&self) -> f64 {
        self.body().mean_width() / self.body().size()
    }

    /// Radius of the smallest ball about the centroid that contains the body.
    #[must_use]
    pub fn bounding_radius(&self) -> f64 {
        self.inner.bounding_radius
    }

    /// Radius of the largest ball about the centroid inside the body; 0 if the centroid is outside (torus).
    #[must_use]
    pub fn inscribed_radius(&self) -> f64 {
        self.inner.inscribed_radius
    }

    /// Whether the body is convex.
    #[must_use]
    pub fn is_convex(&self) -> bool {
        self.body().is_convex()
    }

    /// A point of the body's convex hull farthest in a direction of any length except 0.
    #[must_use]
    pub fn support(&self, direction: &Vector3<f64>) -> Point3<f64> {
        match &self.inner.form {
            Form::Sphere => Point3::from(direction * (0.5 / direction.norm())),
            Form::Ellipsoid { axes } => {
                let stretched = axes.component_mul(direction);
                Point3::from(axes.component_mul(&stretched) / stretched.norm())
            }
            Form::Polytope { support, .. } | Form::Mesh { support, .. } => support.support(direction),
        }
    }

    /// Whether a point is inside; points on the surface may count as either.
    #[must_use]
    pub fn contains(&self, p: &Point3<f64>) -> bool {
        self.inner.contains(p)
    }

    /// The chords of the lines `origin + s across + t along` of a plane: exact to rounding for balls, ellipsoids and
    /// convex bodies with few faces; for other bodies bounded by the largest ball in the body and the smallest ball
    /// around it.
    ///
    /// Cost: one square root per face, then one product per line and face that the plane meets. A zero `along` gives
    /// meaningless chords.
    ///
    /// ```
    /// use nalgebra::{Point3, Vector3};
    /// use stereology_shape::{Body, UnitBody};
    ///
    /// let ball = UnitBody::new(&Body::sphere(1.0)?);
    /// let chords = ball.chords(&Point3::new(-2.0, 0.0, 0.0), &Vector3::y(), &Vector3::x());
    /// let chord = chords.at(0.3);
    /// assert!((chord.sure[0] - 1.6).abs() < 1e-8 && (chord.sure[1] - 2.4).abs() < 1e-8);
    /// # Ok::<(), stereology_shape::BodyError>(())
    /// ```
    #[must_use]
    pub fn chords(&self, origin: &Point3<f64>, across: &Vector3<f64>, along: &Vector3<f64>) -> Chords {
        let origin = &origin.coords;
        match &self.inner.form {
            Form::Sphere => Chords::of_balls([0.5, 0.5], origin, across, along),
            Form::Ellipsoid { axes } => {
                let [origin, across, along] = [origin, across, along].map(|v| v.component_div(axes));
                Chords::of_balls([1.0, 1.0], &origin, &across, &along)
            }
            Form::Polytope { half_spaces, .. } => {
                Chords::of_faces(self.inner.bounding_radius, half_spaces, origin, across, along)
            }
            Form::Mesh { .. } => {
                let balls = [self.inner.inscribed_radius, self.inner.bounding_radius];
                Chords::of_balls(balls, origin, across, along)
            }
        }
    }

    /// Euclidean distance to the surface, negative inside (for ellipsoids to about 1e-12).
    #[must_use]
    pub fn signed_distance(&self, p: &Point3<f64>) -> f64 {
        self.inner.signed_distance(p)
    }

    /// Lower bound of [`Self::signed_distance`]: equal to it inside the body, and much faster outside.
    ///
    /// Outside a convex body it is the height above a plane that has the body on its other side, which is nearly the
    /// distance if that plane is well chosen.
    ///
    /// ```
    /// use nalgebra::Point3;
    /// use stereology_shape::{Body, UnitBody};
    ///
    /// let rock = UnitBody::new(&Body::rock(1));
    /// let p = Point3::new(0.3, 0.5, 0.6);
    /// let (bound, distance) = (rock.signed_distance_bound(&p), rock.signed_distance(&p));
    /// assert!(bound <= distance && bound > 0.9 * distance);
    /// # Ok::<(), stereology_shape::BodyError>(())
    /// ```
    #[must_use]
    pub fn signed_distance_bound(&self, p: &Point3<f64>) -> f64 {
        match &self.inner.form {
            Form::Polytope {
                half_spaces, support, ..
            } => {
                let outward = half_spaces
                    .iter()
                    .map(|face| face.xyz() * height(face, p).max(0.0))
                    .sum::<Vector3<f64>>();
                let highest = highest(half_spaces, p);
                if highest <= 0.0 {
                    return highest;
                }
                // Beyond an edge or a corner, in the direction of the mean of its faces' normals.
                let normal = outward.normalize();
                highest.max(normal.dot(&(p - support.support(&normal))))
            }
            Form::Ellipsoid { axes } => {
                let scaled = p.coords.component_div(axes);
                if scaled.norm_squared() < 1.0 {
                    return self.signed_distance(p);
                }
                // The tangent plane where the line from the centre to the point leaves the body.
                let normal = scaled.component_div(axes).normalize();
                normal.dot(&p.coords) - elliptic::half_width(axes, &normal)
            }
            Form::Sphere | Form::Mesh { .. } => self.signed_distance(p),
        }
    }

    /// Areas of the disjoint profiles of the section by the plane n·x = `offset`, holes subtracted; at most π/4 each.
    #[must_use]
    pub fn profile_areas(&self, normal: &UnitVector3<f64>, offset: f64) -> Vec<f64> {
        if offset.abs() >= self.inner.bounding_radius {
            return Vec::new();
        }
        let one = |area: f64| if area > 0.0 { vec![area] } else { Vec::new() };
        match (&self.inner.form, &self.inner.mesh) {
            (Form::Ellipsoid { axes }, _) => one(elliptic::section_area(axes, normal, offset)),
            (_, Some(mesh)) => mesh_profile_areas(mesh, normal, offset),
            _ => one(PI * (0.5 - offset) * (0.5 + offset)),
        }
    }
}

fn prepare(mesh: &ClosedMesh) -> Form {
    let support = SupportMap::new(mesh.hull());
    let tree = BoxTree::new(mesh.as_triangle_mesh());
    if mesh.is_convex() {
        let half_spaces = half_spaces(mesh.hull());
        if half_spaces.len() <= FEW_FACES {
            return Form::Polytope {
                half_spaces,
                support,
                tree,
            };
        }
    }
    Form::Mesh {
        columns: Columns::new(mesh.as_triangle_mesh()),
        support,
        tree,
    }
}

impl Inner {
    fn contains(&self, p: &Point3<f64>) -> bool {
        let square = p.coords.norm_squared();
        // The balls about the centroid decide most cases.
        if square >= self.bounding_radius * self.bounding_radius {
            return false;
        }
        match &self.form {
            Form::Sphere => true,
            _ if square < self.inscribed_radius * self.inscribed_radius => true,
            Form::Ellipsoid { axes } => p.coords.component_div(axes).norm_squared() < 1.0,
            Form::Polytope { half_spaces, .. } => half_spaces.iter().all(|face| height(face, p) <= 0.0),
            Form::Mesh { columns, .. } => columns.contains(p),
        }
    }

    fn signed_distance(&self, p: &Point3<f64>) -> f64 {
        match &self.form {
            Form::Sphere => p.coords.norm() - 0.5,
            Form::Ellipsoid { axes } => elliptic::signed_distance(axes, p),
            Form::Polytope { half_spaces, tree, .. } => {
                // Inside a convex body the nearest surface point lies on the nearest face's plane; outside it may be on
                // an edge.
                let highest = highest(half_spaces, p);
                if highest <= 0.0 { highest } else { tree.distance(p) }
            }
            Form::Mesh { columns, tree, .. } => {
                let distance = tree.distance(p);
                if columns.contains(p) { -distance } else { distance }
            }
        }
    }
}

/// How far `p` is above the plane of the face that it is highest above.
fn highest(faces: &[Vector4<f64>], p: &Point3<f64>) -> f64 {
    faces
        .iter()
        .map(|face| height(face, p))
        .fold(f64::NEG_INFINITY, f64::max)
}

/// How far `p` is above the plane of a face.
fn height(face: &Vector4<f64>, p: &Point3<f64>) -> f64 {
    face.x * p.x + face.y * p.y + face.z * p.z - face.w
}
