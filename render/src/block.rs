//! A block of the solid with three visible faces, as in the paper (figure 5).

use crate::camera::Camera;
use crate::paths::Colour;
use crate::render::{RenderError, RenderOptions, render_mesh};
use image::RgbImage;
use nalgebra::{Point3, Vector3};
use stereology_shape::TriangleMesh;

/// Options of [`render_block`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockOptions {
    /// Position of the camera; z is up.
    pub camera: Camera,
    /// Size, samples per pixel, background, ground, gloss.
    pub render: RenderOptions,
}

impl Default for BlockOptions {
    /// 800 × 800 pixels with 3 × 3 samples each, on white, seen from above a corner, without gloss: the top keeps its
    /// colours, the sides are slightly shaded.
    fn default() -> Self {
        let camera = Camera {
            azimuth: 38.0,
            elevation: 30.0,
            distance: None,
            field_of_view: 22.0,
            up: Vector3::z_axis(),
        };
        let render = RenderOptions {
            width: 800,
            height: 800,
            samples: 3,
            background: [1.0; 3],
            ground: true,
            gloss: 0.0,
        };
        Self { camera, render }
    }
}

impl BlockOptions {
    /// Sets the size in pixels.
    ///
    /// ```
    /// # use stereology_render::BlockOptions;
    /// assert_eq!(BlockOptions::default().with_size(300, 200).render.width, 300);
    /// ```
    #[must_use]
    pub const fn with_size(self, width: u32, height: u32) -> Self {
        Self {
            render: self.render.with_size(width, height),
            ..self
        }
    }
}

/// Renders the box from the origin to `sides`: its top and two sides, with the colour that `colour` gives at each point
/// (sRGB-encoded values / 255).
///
/// # Errors
///
/// [`RenderError::Sides`] unless all three are positive and finite, [`RenderError::Options`].
///
/// # Examples
///
/// ```
/// use nalgebra::Vector3;
/// use stereology_render::{BlockOptions, render_block};
///
/// let grey = render_block(&|_| [0.5; 3], Vector3::repeat(1.0), &BlockOptions::default().with_size(101, 101))?;
/// let top = grey.get_pixel(50, 30).0[0];
/// assert!(top.abs_diff(128) <= 2); // the top keeps its colour
/// assert!(grey.get_pixel(35, 65).0[0] < top); // the sides are shaded
/// assert_eq!(grey.get_pixel(2, 2).0, [255; 3]);
/// # Ok::<(), stereology_render::RenderError>(())
/// ```
pub fn render_block(colour: Colour<'_>, sides: Vector3<f64>, options: &BlockOptions) -> Result<RgbImage, RenderError> {
    if !sides.iter().all(|side| side.is_finite() && *side > 0.0) {
        return Err(RenderError::Sides { sides: sides.into() });
    }
    let middle = 0.5 * sides;
    let block = TriangleMesh::cuboid(sides.into()).mapped(|p| Point3::from(p.coords + middle));
    render_mesh(&block, colour, &options.camera, &options.render)
}
