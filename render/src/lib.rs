//! Pictures of blocks and meshes whose colour is a function of the point.
//!
//! Whatever can name a colour at a point of space can be looked at: [`render_block`] shows three faces of a box of it, as the paper shows its solids; [`render_mesh`] shows any triangle mesh carved from it. The colour is asked only
//! where a ray meets the surface, so a solid of any resolution costs no memory here.
//!
//! The light is a studio's: a key light with soft shadows, a sky that reaches into hollows as far as it is seen (ambient occlusion), light thrown back by the ground. Colours come in as sRGB-encoded values / 255, are turned into
//! linear light for shading, and back:
//!
//! ```text
//! picture = encode( linear(colour) · E / E₀ ),    E = key · max(0, n·l) · V_key + ∫ sky(ω) V(ω) n·ω dω / π
//! ```
//!
//! with V what is not hidden and E₀ the light on a face that looks up and is not hidden: such a face keeps its colour to the byte, so a picture can be held against the photograph.
//!
//! Every pixel is looked at in several places, each with its own few rays of light, and the light (not the colour) is averaged over near places of the same surface: soft shadows without grain. The same bytes at any number of threads.
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
//! Rasterising with shadow maps (hollows stay flat); many rays a pixel without averaging (sixteen times the time for the same grain); light baked into vertices (coarse meshes have none where it matters).

mod block;
mod camera;
mod light;
mod mesh_picture;
mod scene;
mod tile;

pub use block::{BlockOptions, render_block};
pub use camera::Camera;
pub use mesh_picture::{RenderError, RenderOptions, render_mesh, render_mesh_with_progress};
