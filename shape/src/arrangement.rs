//! Particles in a periodic box, checked once.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::particle::Particle;
use crate::periodic_box::PeriodicBox;
use crate::unit_body::UnitBody;

/// Particles, their neighbours and their periodic images are numbered with 32 bits.
const MOST_PARTICLES: usize = 100_000_000;
/// A particle may be this many times as long as the shortest side of the box.
const LONGEST: f64 = 4.0;
/// How far the norm of an orientation may be from 1: more than the rounding of a rotation, less than a typing error.
const NORM_TOLERANCE: f64 = 1e-9;

/// Particles in a periodic box: the bodies they are copies of, the particles, and the box.
///
/// Every particle is checked by [`Arrangement::new`]: its body exists, its size is a positive length, its position and
/// its orientation are finite, the orientation is a rotation, and it is not far longer than the box. Functions that
/// take an arrangement rely on that. Particles may overlap, and positions may lie outside the box. Clones share their
/// data.
///
/// # Examples
///
/// ```
/// use nalgebra::{Point3, UnitQuaternion, Vector3};
/// use stereology_shape::{Arrangement, ArrangementError, Body, Particle, PeriodicBox, UnitBody};
///
/// let ball = UnitBody::new(&Body::sphere(1.0)?);
/// let particle = Particle { shape: 0, size: 1.0, category: 0, position: Point3::origin(), orientation: UnitQuaternion::identity() };
/// let period = PeriodicBox::new(Vector3::repeat(2.0))?;
/// let one = Arrangement::new([ball.clone()], [particle], period)?;
/// assert!((one.fraction() - std::f64::consts::PI / 48.0).abs() < 1e-12);
///
/// let wrong = Particle { shape: 1, ..particle };
/// let error = Arrangement::new([ball], [particle, wrong], period).unwrap_err();
/// assert!(matches!(error, ArrangementError::NoSuchShape { particle: 1, .. }));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Arrangement {
    bodies: Arc<[UnitBody]>,
    particles: Arc<[Particle]>,
    period: PeriodicBox,
}

/// Why particles and bodies are not an arrangement.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArrangementError {
    /// The shape of a particle is not in the list of bodies.
    #[error("particle {particle} is of shape {shape}, but there are {shapes} shapes (numbered from 0)")]
    NoSuchShape {
        /// Index of the particle.
        particle: usize,
        /// Its shape.
        shape: usize,
        /// Number of bodies.
        shapes: usize,
    },
    /// A size is not a positive number.
    #[error("particle {particle} has size {size}; sizes are positive finite lengths")]
    Size {
        /// Index of the particle.
        particle: usize,
        /// Its size.
        size: f64,
    },
    /// A position is not finite.
    #[error("particle {particle} has position {position:?}; coordinates are finite lengths")]
    Position {
        /// Index of the particle.
        particle: usize,
        /// Its position.
        position: [f64; 3],
    },
    /// An orientation is not a rotation.
    #[error("the orientation of particle {particle} is a quaternion of norm {norm}; a rotation has norm 1")]
    Orientation {
        /// Index of the particle.
        particle: usize,
        /// Norm of its quaternion; not a number if one of its components is none.
        norm: f64,
    },
    /// A particle is far longer than the box.
    #[error(
        "particle {particle} is {length} long, more than {LONGEST} times the shortest side of the box ({side}); use the same unit for both, or a larger box"
    )]
    TooLong {
        /// Index of the particle.
        particle: usize,
        /// Diameter of the sphere about its centroid that encloses it.
        length: f64,
        /// The shortest side of the box.
        side: f64,
    },
    /// There are more particles than can be numbered.
    #[error("{0} particles are too many; at most {MOST_PARTICLES} are possible")]
    TooMany(usize),
}

impl Arrangement {
    /// Particles that are copies of `bodies`, in a box.
    ///
    /// # Errors
    ///
    /// [`ArrangementError`] states which particle is not valid, and why.
    pub fn new(
        bodies: impl Into<Arc<[UnitBody]>>,
        particles: impl Into<Arc<[Particle]>>,
        period: PeriodicBox,
    ) -> Result<Self, ArrangementError> {
        let (bodies, particles) = (bodies.into(), particles.into());
        if particles.len() > MOST_PARTICLES {
            return Err(ArrangementError::TooMany(particles.len()));
        }
        let side = period.sides().min();
        for (index, particle) in particles.iter().enumerate() {
            check(index, particle, &bodies, side)?;
        }
        Ok(Self {
            bodies,
            particles,
            period,
        })
    }

    /// Other particles of the same bodies in the same box.
    ///
    /// # Errors
    ///
    /// As [`Self::new`].
    pub fn with_particles(&self, particles: impl Into<Arc<[Particle]>>) -> Result<Self, ArrangementError> {
        Self::new(Arc::clone(&self.bodies), particles, self.period)
    }

    /// The same arrangement with every position in the box.
    #[must_use]
    pub fn wrapped(&self) -> Self {
        let wrap = |particle: &Particle| Particle {
            position: self.period.wrap(&particle.position),
            ..*particle
        };
        Self {
            bodies: Arc::clone(&self.bodies),
            particles: self.particles.iter().map(wrap).collect(),
            period: self.period,
        }
    }

    /// The bodies that particles are copies of.
    #[must_use]
    pub fn bodies(&self) -> &[UnitBody] {
        &self.bodies
    }

    /// The particles, in the order they were given.
    #[must_use]
    pub fn particles(&self) -> &[Particle] {
        &self.particles
    }

    /// The box that repeats.
    #[must_use]
    pub fn period(&self) -> &PeriodicBox {
        &self.period
    }

    /// Sides of the box along x, y, z.
    #[must_use]
    pub fn sides(&self) -> Vector3<f64> {
        self.period.sides()
    }

    /// Volume of the particles over that of the box; overlaps count twice.
    #[must_use]
    pub fn fraction(&self) -> f64 {
        self.particles
            .iter()
            .map(|particle| self.bodies[particle.shape].volume() * particle.size.powi(3))
            .sum::<f64>()
            / self.period.volume()
    }
}

fn check(index: usize, particle: &Particle, bodies: &[UnitBody], side: f64) -> Result<(), ArrangementError> {
    let Particle {
        shape,
        size,
        category: _,
        position,
        orientation,
    } = *particle;
    let Some(body) = bodies.get(shape) else {
        return Err(ArrangementError::NoSuchShape {
            particle: index,
            shape,
            shapes: bodies.len(),
        });
    };
    if !(size.is_finite() && size > 0.0) {
        return Err(ArrangementError::Size { particle: index, size });
    }
    if !position.iter().all(|x| x.is_finite()) {
        return Err(ArrangementError::Position {
            particle: index,
            position: position.coords.into(),
        });
    }
    let norm = orientation.norm();
    if norm.is_nan() || (norm - 1.0).abs() > NORM_TOLERANCE {
        return Err(ArrangementError::Orientation { particle: index, norm });
    }
    let length = 2.0 * body.bounding_radius() * size;
    if length > LONGEST * side {
        return Err(ArrangementError::TooLong {
            particle: index,
            length,
            side,
        });
    }
    Ok(())
}
