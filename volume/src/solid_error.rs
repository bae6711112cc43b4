//! Why particles, colours and residual do not make a solid, or a solid no image.

/// A particle may be this many times the shortest side of the box across, its own images overlapping then: a guard against sizes and boxes of different units.
pub(crate) const LARGEST_PARTICLE: f64 = 2.0;
/// Largest number of points per pixel along each axis.
pub(crate) const MOST_BORDER_SAMPLES: u32 = 16;

/// Why particles, colours and residual do not make a solid.
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
    /// The particles overlap many times over.
    #[error(
        "the balls about the particles have {times:.0} times the volume of the box; are sizes and box in the same unit?"
    )]
    Crowded {
        /// Volume of the balls over that of the box.
        times: f64,
    },
    /// Category 255 has no number left in the exported channel, where 0 is the binder.
    #[error("particle {particle} is of category 255; categories go from 0 to 254")]
    Category {
        /// Index of the particle.
        particle: usize,
    },
    /// There must be one colour a particle.
    #[error("{colours} colours for {particles} particles; give one each")]
    Colours {
        /// Colours given.
        colours: usize,
        /// Particles given.
        particles: usize,
    },
    /// A colour is no finite number.
    #[error("the colour of {} is not finite", match particle { Some(i) => format!("particle {i}"), None => "the binder".into() })]
    Colour {
        /// Index of the particle; `None`: the binder's colour.
        particle: Option<usize>,
    },
    /// A residual is empty, not of three channels, not finite, or its voxel is no positive length.
    #[error(
        "the residual of the {part} has axes (z, y, x, channel) {shape:?} and voxel {voxel}; it needs at least one voxel, three channels, finite values and a positive voxel"
    )]
    Residual {
        /// `binder` or `particles`.
        part: &'static str,
        /// Shape of the array given.
        shape: [usize; 4],
        /// Edge of a voxel.
        voxel: f64,
    },
    /// A void is of a shape that is not there.
    #[error("shape {shape} cannot be a void: there are {bodies} shapes, counted from 0")]
    Void {
        /// The shape named.
        shape: usize,
        /// Number of bodies.
        bodies: usize,
    },
    /// A plane has no direction or no place.
    #[error("no plane has normal {normal:?} and offset {offset}; the normal must not be zero, and all must be finite")]
    Plane {
        /// The normal given.
        normal: [f64; 3],
        /// The offset given.
        offset: f64,
    },
    /// A picture that cannot be made.
    #[error("no picture has {width} x {height} pixels of edge {pixel}; ask for 1 to 2^30 pixels of a positive edge")]
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
        "the box's side of {side} along {axis} is no multiple of the residual's period of {period}; round the box, or the solid would have a seam"
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
