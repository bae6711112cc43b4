//! Rendering of meshes.

use crate::camera::{Camera, View};
use crate::light::Studio;
use crate::object::{Object, Voids};
use crate::paths::{Colour, World};
use crate::scene::Scene;
use crate::tile::Rendering;
use image::RgbImage;
use nalgebra::Point3;
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use stereology_imaging::linear;
use stereology_metrics::Progress;
use stereology_shape::TriangleMesh;

/// Maximum number of pixels of an image.
const MOST_PIXELS: u64 = 1 << 28;
/// Coordinates are below this and extents above its inverse, so that squares of areas neither overflow nor vanish.
const LARGEST: f64 = 1e60;
/// The ground lies this fraction of the extent below the object, so that light reaches voids that open towards it.
const GAP: f64 = 1e-4;
/// Edge of a tile in pixels.
const TILE: usize = 32;

/// Options of [`render_mesh`] and [`render_material`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderOptions {
    /// Pixels along a row.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Samples per pixel along each axis, 1 to 16.
    pub samples: u32,
    /// Colour behind the object and of the ground, encoded values / 255.
    pub background: [f32; 3],
    /// Whether the object stands on a ground plane and casts a shadow on it.
    pub ground: bool,
    /// Strength of a clear coat that reflects the sky: 0 is matt stone, 1 is polished.
    pub gloss: f64,
}

impl Default for RenderOptions {
    /// 1024 × 1024 pixels with 2 × 2 samples each, on a near-white ground, half polished.
    fn default() -> Self {
        Self {
            width: 1024,
            height: 1024,
            samples: 2,
            background: [0.96, 0.96, 0.955],
            ground: true,
            gloss: 0.5,
        }
    }
}

impl RenderOptions {
    /// Sets the size in pixels.
    ///
    /// ```
    /// # use stereology_render::RenderOptions;
    /// assert_eq!(RenderOptions::default().with_size(300, 200).height, 200);
    /// ```
    #[must_use]
    pub const fn with_size(self, width: u32, height: u32) -> Self {
        Self { width, height, ..self }
    }

    /// Sets the samples per pixel along each axis.
    #[must_use]
    pub const fn with_samples(self, samples: u32) -> Self {
        Self { samples, ..self }
    }
}

/// Why an image cannot be rendered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The mesh has no triangles.
    #[error("the mesh has no triangles")]
    Empty,
    /// A triangle refers to a vertex that does not exist.
    #[error("triangle {triangle} refers to a vertex beyond the {vertices} that exist")]
    Index {
        /// Index of the triangle.
        triangle: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// A vertex is not finite (below 10⁶⁰), or all vertices coincide.
    #[error("the mesh's vertices must be finite and not all the same{}", match vertex { Some(i) => format!("; vertex {i} is not finite"), None => String::new() })]
    Vertices {
        /// The first vertex that is not finite.
        vertex: Option<usize>,
    },
    /// A side of the block is not a positive length.
    #[error("the sides of a block must be positive finite lengths, not {sides:?}")]
    Sides {
        /// The sides given.
        sides: [f64; 3],
    },
    /// An option is out of range.
    #[error("{what}")]
    Options {
        /// What is wrong and what is allowed.
        what: &'static str,
    },
    /// The progress callback cancelled the work.
    #[error("cancelled")]
    Cancelled,
}

/// Renders a mesh whose colour is a function of the point.
///
/// `colour` receives points of the surface in the mesh's coordinates and returns sRGB-encoded values / 255. The mesh
/// need not be closed; facets that meet at less than 35° are shaded as one smooth surface. Cost: about 5 rays per
/// sample of the object or its ground, a microsecond or less each; seconds for a million pixels with 2 × 2 samples,
/// half a minute with 8 × 8. The bytes do not depend on the number of threads.
///
/// # Errors
///
/// [`RenderError`] if the mesh is empty or broken, or the camera or an option is invalid.
///
/// # Examples
///
/// ```
/// use stereology_render::{Camera, RenderOptions, render_mesh};
/// use stereology_shape::TriangleMesh;
///
/// let torus = TriangleMesh::torus(2.0, 0.8, 48, 24);
/// let options = RenderOptions::default().with_size(80, 60);
/// let image = render_mesh(&torus, &|p| if p.x > 0.0 { [0.8, 0.2, 0.2] } else { [0.2, 0.2, 0.8] }, &Camera::default(), &options)?;
/// assert_eq!(image.dimensions(), (80, 60));
/// # Ok::<(), stereology_render::RenderError>(())
/// ```
pub fn render_mesh(
    mesh: &TriangleMesh,
    colour: Colour<'_>,
    camera: &Camera,
    options: &RenderOptions,
) -> Result<RgbImage, RenderError> {
    let material = Material::new(colour);
    render_material(mesh, &material, camera, options, &|_| ControlFlow::Continue(()))
}

/// Material of a mesh: its colour at any point, and its voids.
#[derive(Clone, Copy)]
pub struct Material<'a> {
    colour: Colour<'a>,
    voids: Option<Voids<'a>>,
}

impl std::fmt::Debug for Material<'_> {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_struct("Material")
            .field("voids", &self.voids.is_some())
            .finish_non_exhaustive()
    }
}

impl<'a> Material<'a> {
    /// A material without voids; `colour` returns sRGB-encoded values / 255.
    #[must_use]
    pub fn new(colour: Colour<'a>) -> Self {
        Self { colour, voids: None }
    }

    /// Adds voids, which the mesh cuts open.
    ///
    /// `distance` returns the signed distance to the nearest surface of a void: negative inside, never more than the
    /// true distance, infinite where there is no void. The wall of a void has the colour a little behind it. The mesh
    /// should be closed.
    #[must_use]
    pub fn with_voids(self, distance: &'a (dyn Fn(&Point3<f64>) -> f64 + Sync)) -> Self {
        Self {
            voids: Some(distance),
            ..self
        }
    }
}

/// [`render_mesh`] for a material that may have voids; reports its progress and can be cancelled.
///
/// # Errors
///
/// As [`render_mesh`], and [`RenderError::Cancelled`].
///
/// # Examples
///
/// A cube with a hole through it:
///
/// ```
/// use std::ops::ControlFlow;
/// use stereology_render::{Camera, Material, RenderError, RenderOptions, render_material};
/// use stereology_shape::TriangleMesh;
///
/// let cube = TriangleMesh::cuboid([1.0; 3]);
/// let hole = |p: &nalgebra::Point3<f64>| p.x.hypot(p.y) - 0.3;
/// let material = Material::new(&|_| [0.9, 0.6, 0.3]).with_voids(&hole);
/// let (camera, options) = (Camera { elevation: 89.0, up: nalgebra::Vector3::z_axis(), ..Camera::default() }, RenderOptions::default().with_size(64, 64));
/// let image = render_material(&cube, &material, &camera, &options, &|_| ControlFlow::Continue(()))?;
/// assert!(image.get_pixel(32, 32).0[0] + 30 < image.get_pixel(20, 20).0[0]); // little light reaches the ground inside the hole
/// let cancelled = render_material(&cube, &material, &camera, &options, &|_| ControlFlow::Break(()));
/// assert!(matches!(cancelled, Err(RenderError::Cancelled)));
/// # Ok::<(), RenderError>(())
/// ```
pub fn render_material(
    mesh: &TriangleMesh,
    material: &Material<'_>,
    camera: &Camera,
    options: &RenderOptions,
    progress: Progress<'_>,
) -> Result<RgbImage, RenderError> {
    check_mesh(mesh)?;
    check_camera(camera)?;
    check_options(options)?;
    let used: Vec<Point3<f64>> = mesh
        .triangles
        .iter()
        .flatten()
        .map(|&i| mesh.vertices[i as usize])
        .collect();
    let (low, high) = used
        .iter()
        .fold((used[0], used[0]), |(low, high), p| (low.inf(p), high.sup(p)));
    let extent = (high - low).amax();
    if extent < LARGEST.recip() {
        return Err(RenderError::Vertices { vertex: None });
    }
    let view = View::new(camera, &used, [options.width, options.height]);
    let bottom = used
        .iter()
        .map(|p| p.coords.dot(&camera.up))
        .fold(f64::INFINITY, f64::min);
    let world = World {
        object: Object {
            scene: Scene::new(mesh),
            voids: material.voids,
            extent,
        },
        studio: Studio::new(camera.up, &view.forward),
        colour: material.colour,
        ground: options.ground.then_some(bottom - GAP * extent),
        up: camera.up,
        middle: nalgebra::center(&low, &high),
        gloss: options.gloss,
    };
    let rendering = Rendering {
        world,
        view,
        samples: options.samples,
        background: options.background.map(linear),
    };
    paint(&rendering, [options.width, options.height], progress)
}

/// Renders the tiles in parallel.
fn paint(
    rendering: &Rendering<'_>,
    [width, height]: [u32; 2],
    progress: Progress<'_>,
) -> Result<RgbImage, RenderError> {
    let (wide, high) = (width as usize, height as usize);
    let corners: Vec<[usize; 2]> = (0..high)
        .step_by(TILE)
        .flat_map(|y| (0..wide).step_by(TILE).map(move |x| [x, y]))
        .collect();
    let done = AtomicUsize::new(0);
    let tiles: Option<Vec<Vec<[u8; 3]>>> = corners
        .par_iter()
        .map(|&[x, y]| {
            let tile = rendering.tile([x, y], [TILE.min(wide - x), TILE.min(high - y)]);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress(done as f64 / corners.len() as f64)
                .is_continue()
                .then_some(tile)
        })
        .collect();
    let tiles = tiles.ok_or(RenderError::Cancelled)?;
    let mut image = RgbImage::new(width, height);
    let bytes: &mut [u8] = &mut image;
    for (&[x, y], tile) in corners.iter().zip(&tiles) {
        for (row, pixels) in tile.chunks(TILE.min(wide - x)).enumerate() {
            let start = 3 * ((y + row) * wide + x);
            bytes[start..start + 3 * pixels.len()].copy_from_slice(pixels.as_flattened());
        }
    }
    Ok(image)
}

fn check_mesh(mesh: &TriangleMesh) -> Result<(), RenderError> {
    if mesh.triangles.is_empty() {
        return Err(RenderError::Empty);
    }
    let vertices = mesh.vertices.len();
    if let Some(triangle) = mesh
        .triangles
        .iter()
        .position(|t| t.iter().any(|&i| i as usize >= vertices))
    {
        return Err(RenderError::Index { triangle, vertices });
    }
    match mesh.vertices.iter().position(|p| !p.iter().all(|x| x.abs() < LARGEST)) {
        Some(vertex) => Err(RenderError::Vertices { vertex: Some(vertex) }),
        None => Ok(()),
    }
}

pub(crate) fn check_camera(camera: &Camera) -> Result<(), RenderError> {
    let Camera {
        azimuth,
        elevation,
        distance,
        field_of_view,
        up,
    } = camera;
    let what = if !azimuth.is_finite() {
        "the camera's azimuth must be a finite angle in degrees"
    } else if !(-89.0..=89.0).contains(elevation) {
        "the camera's elevation must be between -89 and 89 degrees"
    } else if !(1.0..=120.0).contains(field_of_view) {
        "the camera's field of view must be between 1 and 120 degrees"
    } else if distance.is_some_and(|d| !(d.is_finite() && d > 0.0)) {
        "the camera's distance must be positive and finite"
    } else if !(up.norm() - 1.0).abs().le(&1e-6) {
        "the camera's up must be a direction"
    } else {
        return Ok(());
    };
    Err(RenderError::Options { what })
}

fn check_options(options: &RenderOptions) -> Result<(), RenderError> {
    let pixels = u64::from(options.width) * u64::from(options.height);
    let what = if pixels == 0 || pixels > MOST_PIXELS {
        "an image has 1 to 2^28 pixels"
    } else if !(1..=16).contains(&options.samples) {
        "a pixel has 1 to 16 samples along each axis"
    } else if !options.background.iter().all(|value| value.is_finite()) {
        "the background must be a colour of finite values"
    } else if !(0.0..=1.0).contains(&options.gloss) {
        "gloss is between 0 and 1"
    } else {
        return Ok(());
    };
    Err(RenderError::Options { what })
}
