//! What particles must be to be packed at all.

use stereology_shape::{Particle, PeriodicBox, UnitBody};

/// A particle that cannot be in a packing.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ParticleError {
    /// Its shape is not in the list of bodies.
    #[error("particle {index} is of shape {shape}, but there are {shapes} shapes (numbered from 0)")]
    NoSuchShape {
        /// Which particle.
        index: usize,
        /// What it asks for.
        shape: usize,
        /// How many there are.
        shapes: usize,
    },
    /// Its size is not a positive number.
    #[error("particle {index} has size {size}; sizes are positive finite lengths")]
    Size {
        /// Which particle.
        index: usize,
        /// Its size.
        size: f64,
    },
    /// Its position or orientation is not a number.
    #[error("the position or orientation of particle {index} is not finite")]
    Place {
        /// Which particle.
        index: usize,
    },
    /// There are more than can be numbered.
    #[error("{0} particles are too many: at most 100 million")]
    TooMany(usize),
    /// It reaches over more than four periods of the box.
    #[error(
        "particle {index} is {diameter} long, more than four times the shortest side of the box ({side}): take a larger box"
    )]
    TooLong {
        /// Which particle.
        index: usize,
        /// Its bounding diameter.
        diameter: f64,
        /// The shortest side of the box.
        side: f64,
    },
}

/// Checks every particle.
pub(crate) fn check(bodies: &[UnitBody], particles: &[Particle], period: &PeriodicBox) -> Result<(), ParticleError> {
    if particles.len() > 100_000_000 {
        return Err(ParticleError::TooMany(particles.len()));
    }
    let side = period.sides().min();
    for (index, particle) in particles.iter().enumerate() {
        let Some(body) = bodies.get(particle.shape) else {
            return Err(ParticleError::NoSuchShape {
                index,
                shape: particle.shape,
                shapes: bodies.len(),
            });
        };
        if !(particle.size.is_finite() && particle.size > 0.0) {
            return Err(ParticleError::Size {
                index,
                size: particle.size,
            });
        }
        let mut numbers = particle.position.iter().chain(particle.orientation.coords.iter());
        if !numbers.all(|x| x.is_finite()) || (particle.orientation.norm() - 1.0).abs() > 1e-9 {
            return Err(ParticleError::Place { index });
        }
        let diameter = 2.0 * body.bounding_radius() * particle.size;
        if diameter > 4.0 * side {
            return Err(ParticleError::TooLong { index, diameter, side });
        }
    }
    Ok(())
}

/// Volume of all particles over that of the box, both summed in order.
pub(crate) fn fraction(bodies: &[UnitBody], particles: &[Particle], period: &PeriodicBox) -> f64 {
    particles
        .iter()
        .map(|p| bodies[p.shape].volume() * p.size.powi(3))
        .sum::<f64>()
        / period.volume()
}
