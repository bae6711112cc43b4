//! Why a solid, or an image of it, cannot be made.

/// A particle may be this many times as long as the shortest side of the box (its own images then overlap): a guard
/// against sizes and boxes in different units.
pub(crate) const LARGEST_PARTICLE: f64 = 2.0;
/// Largest number of points per pixel along each axis.
pub(crate) const MOST_BORDER_SAMPLES: u32 = 16;

/// Why a solid, or an image of it, cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolidError {
    /// A particle is far larger than the box.
    #[error(
        "particle {particle} of size {size} is more than {LARGEST_PARTICLE} times the box's shortest side of {side}; are both in the same unit?"
    )]
    TooLarge {
        /// Index of the particle.
        particle: usize,
        /// Its size.
        size: f64,
        /// The box's shortest side.
        side: f64,
    },
    /// The particles overlap too often.
    #[error(
        "the balls about the particles have {times:.0} times the volume of the box; are sizes and box in the same unit?"
    )]
    Crowded {
        /// Volume of the balls over that of the box.
        times: f64,
    },
    /// Category 255 cannot be numbered in the exported channel, where 0 is the binder.
    #[error("particle {particle} is of category 255; categories go from 0 to 254")]
    Category {
        /// Index of the particle.
        particle: usize,
    },
    /// There must be one colour per particle.
    #[error("{colours} colours for {particles} particles; one per particle is needed")]
    Colours {
        /// Colours given.
        colours: usize,
        /// Particles given.
        particles: usize,
    },
    /// A colour is not finite.
    #[error("the colour of {} is not finite", match particle { Some(i) => format!("particle {i}"), None => "the binder".into() })]
    Colour {
        /// Index of the particle; `None`: the binder's colour.
        particle: Option<usize>,
    },
    /// A residual is empty, without three channels, not finite, or its voxel is not a positive length.
    #[error(
        "the residual of the {part} has voxels (x, y, z) = ({}, {}, {}), {} channels and voxels of edge {voxel}; it needs at least one voxel, three channels, finite values and a positive edge",
        .shape[2], .shape[1], .shape[0], .shape[3]
    )]
    Residual {
        /// `binder` or `particles`.
        part: &'static str,
        /// Shape of the array given.
        shape: [usize; 4],
        /// Edge of a voxel.
        voxel: f64,
    },
    /// A void has a shape that does not exist.
    #[error("shape {shape} cannot be a void: there are {bodies} shapes, counted from 0")]
    Void {
        /// The shape given.
        shape: usize,
        /// Number of bodies.
        bodies: usize,
    },
    /// A plane without direction or position.
    #[error(
        "a plane cannot have normal {normal:?} and offset {offset}; the normal must not be zero, and all numbers must be finite"
    )]
    Plane {
        /// The normal given.
        normal: [f64; 3],
        /// The offset given.
        offset: f64,
    },
    /// An image that cannot be made.
    #[error(
        "an image cannot have {width} x {height} pixels of edge {pixel}; 1 to 2^30 pixels of a positive edge are possible"
    )]
    Picture {
        /// Pixels along a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Edge of a pixel.
        pixel: f64,
    },
    /// Too few or too many points per pixel.
    #[error("{0} points per pixel along each axis; 1 to {MOST_BORDER_SAMPLES} are possible")]
    BorderSamples(u32),
    /// The residual does not repeat with the box.
    #[error(
        "the box's side of {side} along {axis} is not a multiple of the residual's period of {period}; adjust the box, otherwise the solid would have a seam"
    )]
    Period {
        /// `x`, `y` or `z`.
        axis: char,
        /// The box's side.
        side: f64,
        /// The residual's period.
        period: f64,
    },
}
