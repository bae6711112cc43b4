//! Rendering of blocks and meshes whose colour is a function of the point.
//!
//! Any function that gives a colour at a point of space can be rendered: [`render_block`] shows three faces of a box,
//! as the paper shows its solids; [`render_mesh`] shows any triangle mesh carved from the solid. The function is
//! evaluated only where a ray meets the surface, so a solid of any resolution needs no memory here.
//!
//! The lighting is that of a studio: a key light with soft shadows, a sky, and a grey ground that reflects light. Light
//! is traced from surface to surface until it leaves the scene, so cavities take on the colour of their walls. Colours
//! are sRGB-encoded values / 255, are converted to linear light for shading, and converted back:
//!
//! ```text
//! E(p, n) = key · n·l · V_key + ∫ L(p, ω) n·ω dω / π          L = sky(ω), or at a surface: linear(colour) · E
//! pixel   = encode( (1 − F) · linear(colour) · E / E₀ + F · L(mirrored) )
//! ```
//!
//! V is the visibility of the key light, F the Fresnel term of a clear coat (0 without one), and E₀ the light on an
//! unobstructed face that points up: such a face keeps its colour to the byte, so an image can be compared with the
//! photograph. The integrals are estimated by path tracing, without bias at 8 × 8 samples per pixel. With fewer, the
//! light (not the colour) is averaged over nearby samples of the same surface, which gives soft shadows without noise.
//! [`sky_map`] exports the lighting to other renderers; images agree with Mitsuba within one grey level. The bytes do
//! not depend on the number of threads.
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
//! let image = render_block(&marble, Vector3::new(3.0, 3.0, 3.0), &BlockOptions::default().with_size(96, 96))?;
//! assert_eq!(image.dimensions(), (96, 96));
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
//! let image = render_mesh(&ball, &stripes, &Camera::default(), &RenderOptions::default().with_size(64, 64))?;
//! assert_ne!(image.get_pixel(32, 32), image.get_pixel(0, 0));
//! # Ok::<(), stereology_render::RenderError>(())
//! ```
//!
//! # Rejected alternatives
//!
//! Rasterising with shadow maps (cavities look flat); ambient occlusion with constant reflected light (cavities are
//! grey whatever their colour); light baked into vertices (coarse meshes have too few vertices where the light
//! changes).

mod block;
mod camera;
mod hierarchy;
mod light;
mod object;
mod paths;
mod render;
mod scene;
mod sky_map;
mod tile;

pub use block::{BlockOptions, render_block};
pub use camera::Camera;
pub use render::{Material, RenderError, RenderOptions, render_material, render_mesh};
pub use sky_map::sky_map;
