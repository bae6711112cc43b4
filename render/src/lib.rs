//! Pictures of blocks and meshes whose colour is a function of the point.
//!
//! Whatever can name a colour at a point of space can be looked at: [`render_block`] shows three faces of a box of it, as the paper shows its solids; [`render_mesh`] shows any triangle mesh carved from it. The colour is asked only
//! where a ray meets the surface, so a solid of any resolution costs no memory here.
//!
//! The light is a studio's: a key light with soft shadows, a sky, a grey ground that throws light back. It is followed from surface to surface until it leaves, so hollows glow in their own colour. Colours come in as sRGB-encoded
//! values / 255, are turned into linear light for shading, and back:
//!
//! ```text
//! E(p, n)  = key · n·l · V_key + ∫ L(p, ω) n·ω dω / π          L = sky(ω), or what is met there: linear(colour) · E
//! picture  = encode( (1 − F) · linear(colour) · E / E₀ + F · L(mirrored) )
//! ```
//!
//! with V what is not hidden, F the Fresnel term of a clear coat (0 without one), and E₀ the light on a face that looks up and is not hidden: such a face keeps its colour to the byte, so a picture can be held against the photograph.
//! The integrals are sums over paths of light: unbiased at 8 × 8 places a pixel. With fewer, the light (not the colour) is averaged over near places of the same surface: soft shadows without grain. [`sky_map`] gives the light to
//! other renderers; held against Mitsuba, pictures agree within a grey level. The same bytes at any number of threads.
//!
//! # A block of marble
//!
//! ```
//! use nalgebra::{Point3, Vector3};
//! use stereology_render::{BlockOptions, render_block};
//!
//! let marble = |p: &Point3<f64>| {
//!     let vein = (0.5 + 0.5 * (4.0 * p.x + 3.0 * (2.0 * p.y).sin() + 2.0 * (3.0 * p.z).sin()).sin()) as f32;
//!     [0.9 - 0.5 * vein.powi(4), 0.88 - 0.5 * vein.powi(4), 0.85 - 0.45 * vein.powi(4)]
//! };
//! let picture = render_block(&marble, Vector3::new(3.0, 3.0, 3.0), &BlockOptions::default().with_size(96, 96))?;
//! assert_eq!(picture.dimensions(), (96, 96));
//! # Ok::<(), stereology_render::RenderError>(())
//! ```
//!
//! # A ball carved from it
//!
//! ```
//! use stereology_render::{Camera, RenderOptions, render_mesh};
//! use stereology_shape::TriangleMesh;
//!
//! let ball = TriangleMesh::icosphere(2.0, 3);
//! let stripes = |p: &nalgebra::Point3<f64>| if (5.0 * p.z).sin() > 0.0 { [0.8, 0.3, 0.2] } else { [0.9, 0.85, 0.8] };
//! let picture = render_mesh(&ball, &stripes, &Camera::default(), &RenderOptions::default().with_size(64, 64))?;
//! assert_ne!(picture.get_pixel(32, 32), picture.get_pixel(0, 0));
//! # Ok::<(), stereology_render::RenderError>(())
//! ```
//!
//! # What was rejected
//!
//! Rasterising with shadow maps (hollows stay flat); ambient occlusion with a constant for what is hidden (hollows are grey whatever their colour); light baked into vertices (coarse meshes have none where it matters).

mod block;
mod camera;
mod hierarchy;
mod hollows;
mod light;
mod mesh_picture;
mod paths;
mod scene;
mod sky_map;
mod tile;

pub use block::{BlockOptions, render_block};
pub use camera::Camera;
pub use mesh_picture::{Material, RenderError, RenderOptions, render_material, render_mesh};
pub use sky_map::sky_map;
