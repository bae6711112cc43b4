//! The types of particle a material is made of: their bodies, their shares, and the kernel they have together.

use stereology_kmatrix::{EdgesError, SectionLaw, SectionOptions, Sizes};
use stereology_shape::{Body, BodyError, UnitBody};
use stereology_unfold::{Kernel, KernelError, SizeBins};

/// One type of particle.
#[derive(Clone, Debug)]
pub struct ParticleType {
    /// What describes it: `sphere`, `rock:1`, a mesh file.
    pub name: String,
    /// Its body.
    pub body: Body,
    /// Its share of the particles, by number.
    pub share: f64,
    law: SectionLaw,
}

impl ParticleType {
    /// How often a random plane shows this body at each size.
    #[must_use]
    pub fn law(&self) -> &SectionLaw {
        &self.law
    }
}

/// The types of particle of a material, sharing one size distribution: section 3.3.
#[derive(Clone, Debug)]
pub struct ParticleTypes {
    types: Vec<ParticleType>,
}

/// Types of particle that cannot be.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ParticleTypesError {
    /// A body cannot be made.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// A section law cannot be computed.
    #[error("{name}: {why}")]
    Law {
        /// Which shape.
        name: String,
        /// Why.
        why: String,
    },
    /// A share that is none.
    #[error("{name}: the share of a shape is a positive number, not {share}")]
    Share {
        /// Which shape.
        name: String,
        /// What was given.
        share: f64,
    },
    /// There are no types.
    #[error("no shape is given: name one, for instance sphere")]
    None,
    /// The bins of a kernel.
    #[error(transparent)]
    Edges(#[from] EdgesError),
    /// The kernel of the types together.
    #[error(transparent)]
    Kernel(#[from] KernelError),
}

/// Largest standard error of a kernel's entries, relative to a column sum of 1: well below what some hundred profiles can tell.
const LAW_TOLERANCE: f64 = 2e-3;

impl ParticleTypes {
    /// Types from their bodies, names and shares; shares are scaled to sum to 1.
    ///
    /// Computes each body's section law: closed for spheres and ellipsoids, up to some seconds for a mesh of many triangles.
    ///
    /// # Errors
    ///
    /// [`ParticleTypesError`] for no types, a share that is not positive, a body whose law cannot be computed.
    pub fn new(bodies: Vec<(String, Body, f64)>) -> Result<Self, ParticleTypesError> {
        if bodies.is_empty() {
            return Err(ParticleTypesError::None);
        }
        if let Some((name, _, share)) = bodies.iter().find(|(_, _, share)| !(share.is_finite() && *share > 0.0)) {
            return Err(ParticleTypesError::Share {
                name: name.clone(),
                share: *share,
            });
        }
        let whole: f64 = bodies.iter().map(|(_, _, share)| share).sum();
        let types = bodies
            .into_iter()
            .map(|(name, body, share)| {
                let law = section_law(&name, &body)?;
                Ok(ParticleType {
                    name,
                    body,
                    share: share / whole,
                    law,
                })
            })
            .collect::<Result<_, ParticleTypesError>>()?;
        Ok(Self { types })
    }

    /// The same types in other shares, scaled to sum to 1; shares beyond the types are ignored.
    ///
    /// # Errors
    ///
    /// [`ParticleTypesError::Share`] for a share that is negative or not finite, or if all are zero.
    ///
    /// ```
    /// let types = stereology::pipeline::ParticleTypes::parse(&["sphere", "box:1,1,2"])?.with_shares(&[3.0, 1.0])?;
    /// assert_eq!(types.types()[1].share, 0.25);
    /// # Ok::<(), stereology::pipeline::ParticleTypesError>(())
    /// ```
    pub fn with_shares(mut self, shares: &[f64]) -> Result<Self, ParticleTypesError> {
        let whole: f64 = shares.iter().take(self.types.len()).sum();
        for (of, &share) in self.types.iter_mut().zip(shares) {
            if !(share.is_finite() && share >= 0.0 && whole > 0.0) {
                return Err(ParticleTypesError::Share {
                    name: of.name.clone(),
                    share,
                });
            }
            of.share = share / whole;
        }
        Ok(self)
    }

    /// One of the types, as if there were no other.
    pub(crate) fn only(&self, index: usize) -> Self {
        let types = self.types[index..=index].iter().map(|of| ParticleType {
            share: 1.0,
            ..of.clone()
        });
        Self { types: types.collect() }
    }

    /// Types from words, in equal shares: `sphere`, `ellipsoid:A,B,C`, `box:A,B,C`, `cylinder:D,L`, `rock:SEED`, a mesh file.
    ///
    /// # Errors
    ///
    /// [`ParticleTypesError`].
    ///
    /// ```
    /// let types = stereology::pipeline::ParticleTypes::parse(&["sphere", "box:1,1,2"])?;
    /// assert_eq!(types.types()[1].share, 0.5);
    /// # Ok::<(), stereology::pipeline::ParticleTypesError>(())
    /// ```
    pub fn parse(specs: &[&str]) -> Result<Self, ParticleTypesError> {
        let bodies = specs
            .iter()
            .map(|&spec| Ok((spec.to_owned(), Body::parse(spec)?, 1.0)))
            .collect::<Result<_, BodyError>>()?;
        Self::new(bodies)
    }

    /// The types, shares summing to 1.
    #[must_use]
    pub fn types(&self) -> &[ParticleType] {
        &self.types
    }

    /// The bodies at size 1 about their centroids, one a type.
    #[must_use]
    pub fn unit_bodies(&self) -> Vec<UnitBody> {
        self.types.iter().map(|of| UnitBody::new(&of.body)).collect()
    }

    /// The kernel of the types together, Σ P(i) H_i K_i, in units of length: eqs. (10)-(12). With one type it is H K of eq. (5).
    ///
    /// # Errors
    ///
    /// [`ParticleTypesError::Edges`] for edges that make no bins.
    ///
    /// # Examples
    ///
    /// One bin: eq. (1), N_A = H N_V, with H the mean of the two types' calipers.
    ///
    /// ```
    /// use stereology::{kmatrix::Sizes, pipeline::ParticleTypes};
    ///
    /// let both = ParticleTypes::parse(&["sphere", "ellipsoid:1,1,2"])?;
    /// let mean: f64 = both.types().iter().map(|of| 0.5 * of.body.mean_width() / of.body.size()).sum();
    /// let kernel = both.kernel(&[0.0, 3.0], &[0.0, 3.0], Sizes::UpperEdge)?;
    /// assert!((kernel.matrix()[(0, 0)] - 3.0 * mean).abs() < 1e-9);
    /// # Ok::<(), stereology::pipeline::ParticleTypesError>(())
    /// ```
    pub fn kernel(
        &self,
        profile_edges: &[f64],
        size_edges: &[f64],
        sizes: Sizes,
    ) -> Result<Kernel, ParticleTypesError> {
        let kernels = self
            .types
            .iter()
            .map(|of| of.kernel(profile_edges, size_edges, sizes))
            .collect::<Result<Vec<_>, _>>()?;
        let shares: Vec<f64> = self.types.iter().map(|of| of.share).collect();
        Ok(Kernel::mix(&kernels, &shares)?)
    }
}

impl ParticleType {
    /// The kernel H K of this type alone, in units of length: eqs. (2), (5).
    ///
    /// # Errors
    ///
    /// [`ParticleTypesError::Edges`] for edges that make no bins.
    ///
    /// # Examples
    ///
    /// A sphere of diameter 2 shows a profile below diameter 1 with probability 1 - √3/2, and has a caliper of 2: eqs. (2), (3).
    ///
    /// ```
    /// use stereology::{kmatrix::Sizes, pipeline::ParticleTypes};
    ///
    /// let spheres = ParticleTypes::parse(&["sphere"])?;
    /// let kernel = spheres.types()[0].kernel(&[0.0, 1.0, 2.0], &[0.0, 1.0, 2.0], Sizes::UpperEdge)?;
    /// assert!((kernel.matrix()[(0, 1)] - 2.0 * (1.0 - 0.75_f64.sqrt())).abs() < 1e-12);
    /// # Ok::<(), stereology::pipeline::ParticleTypesError>(())
    /// ```
    pub fn kernel(
        &self,
        profile_edges: &[f64],
        size_edges: &[f64],
        sizes: Sizes,
    ) -> Result<Kernel, ParticleTypesError> {
        let matrix = self.law.kernel(profile_edges, size_edges, sizes)?;
        let bins = match sizes {
            Sizes::UpperEdge => SizeBins::upper_edge(size_edges),
            Sizes::Integrated => SizeBins::integrated(size_edges),
        };
        let bins = bins.map_err(|error| ParticleTypesError::Law {
            name: self.name.clone(),
            why: error.to_string(),
        })?;
        let unit_surface = self.law.surface_area() / self.law.size().powi(2);
        Ok(Kernel::new(matrix, bins, self.law.unit_volume())?.with_unit_surface(unit_surface)?)
    }
}

/// Closed for spheres and ellipsoids; for meshes sections are integrated until the kernel is known to [`LAW_TOLERANCE`].
fn section_law(name: &str, body: &Body) -> Result<SectionLaw, ParticleTypesError> {
    SectionLaw::of_body(body, &SectionOptions::default().with_tolerance(LAW_TOLERANCE)).map_err(|error| {
        ParticleTypesError::Law {
            name: name.to_owned(),
            why: error.to_string(),
        }
    })
}
