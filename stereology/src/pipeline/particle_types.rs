//! The particle types of a material: their bodies, their shares, and their joint kernel.

use stereology_kmatrix::{EdgesError, SectionLaw, SectionOptions, Sizes};
use stereology_shape::{Body, BodyError, UnitBody};
use stereology_unfold::{Kernel, KernelError, SizeBins};

/// One type of particle.
#[derive(Clone, Debug)]
pub struct ParticleType {
    /// Its specification: `sphere`, `rock:1`, a mesh file.
    pub name: String,
    /// Its body.
    pub body: Body,
    /// Its share of the particles, by number.
    pub share: f64,
    law: SectionLaw,
}

impl ParticleType {
    /// Distribution of the profile sizes of this body on random planes.
    #[must_use]
    pub fn law(&self) -> &SectionLaw {
        &self.law
    }
}

/// The particle types of a material, with one common size distribution: section 3.3.
#[derive(Clone, Debug)]
pub struct ParticleTypes {
    types: Vec<ParticleType>,
}

/// Why particle types cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ParticleTypesError {
    /// An invalid body.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// A section law that cannot be computed.
    #[error("{name}: {why}")]
    Law {
        /// Which shape.
        name: String,
        /// Why.
        why: String,
    },
    /// A share that is not a positive number.
    #[error("{name}: the fraction of a shape must be a positive number, not {share}")]
    Share {
        /// Which shape.
        name: String,
        /// The given share.
        share: f64,
    },
    /// Another number of shares than of types.
    #[error("{shares} fractions for {types} shapes: give one fraction per shape")]
    Shares {
        /// Number of shares.
        shares: usize,
        /// Number of types.
        types: usize,
    },
    /// There are no types.
    #[error("no shape is given: name one, for instance sphere")]
    None,
    /// The bins of a kernel.
    #[error(transparent)]
    Edges(#[from] EdgesError),
    /// The joint kernel.
    #[error(transparent)]
    Kernel(#[from] KernelError),
}

/// Largest standard error of a kernel's entries, relative to a column sum of 1: well below the counting error of some
/// hundred profiles.
const LAW_TOLERANCE: f64 = 2e-3;

impl ParticleTypes {
    /// Types from names, bodies and shares; the shares are scaled to sum to 1.
    ///
    /// Computes the section law of each body: closed form for spheres and ellipsoids, up to some seconds for a mesh of
    /// many triangles.
    ///
    /// # Errors
    ///
    /// [`ParticleTypesError`]: no type, a share that is not positive, a body whose section law cannot be computed.
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

    /// The same types with other shares, one per type, scaled to sum to 1.
    ///
    /// # Errors
    ///
    /// [`ParticleTypesError::Shares`] unless there is one fraction per type; [`ParticleTypesError::Share`] for a share
    /// that is negative or not finite, or if all are zero.
    ///
    /// ```
    /// use stereology::pipeline::ParticleTypes;
    ///
    /// let types = ParticleTypes::parse(&["sphere", "box:1,1,2"])?;
    /// assert_eq!(types.clone().with_shares(&[3.0, 1.0])?.types()[1].share, 0.25);
    /// assert!(types.with_shares(&[1.0]).is_err());
    /// # Ok::<(), stereology::pipeline::ParticleTypesError>(())
    /// ```
    pub fn with_shares(mut self, shares: &[f64]) -> Result<Self, ParticleTypesError> {
        if shares.len() != self.types.len() {
            return Err(ParticleTypesError::Shares {
                shares: shares.len(),
                types: self.types.len(),
            });
        }
        let whole: f64 = shares.iter().sum();
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

    /// One of the types alone, with a share of 1.
    pub(crate) fn only(&self, index: usize) -> Self {
        let types = self.types[index..=index].iter().map(|of| ParticleType {
            share: 1.0,
            ..of.clone()
        });
        Self { types: types.collect() }
    }

    /// Types from their specifications, in equal shares: `sphere`, `ellipsoid:A,B,C`, `box:A,B,C`, `cylinder:D,L`,
    /// `rock:SEED`, a mesh file.
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

    /// The types; their shares sum to 1.
    #[must_use]
    pub fn types(&self) -> &[ParticleType] {
        &self.types
    }

    /// The body of each type, centred at its centroid and scaled to size 1.
    #[must_use]
    pub fn unit_bodies(&self) -> Vec<UnitBody> {
        self.types.iter().map(|of| UnitBody::new(&of.body)).collect()
    }

    /// Joint kernel of the types, Σ P(i) H_i K_i, in units of length: eqs. (10)-(12). For one type it is H K of eq.
    /// (5).
    ///
    /// # Errors
    ///
    /// [`ParticleTypesError::Edges`] for edges that do not form bins.
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
    /// [`ParticleTypesError::Edges`] for edges that do not form bins.
    ///
    /// # Examples
    ///
    /// A sphere of diameter 2 shows a profile below diameter 1 with probability 1 - √3/2, and has a caliper of 2: eqs.
    /// (2), (3).
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
        let kernel = Kernel::new(matrix, bins, self.law.unit_volume())?.with_unit_surface(unit_surface)?;
        Ok(kernel.with_profile_law(self.profile_law(0.0)))
    }
}

impl ParticleType {
    /// How many profiles no larger than x a particle of size 1 shows per unit area, at one particle per unit volume,
    /// under a capping angle in radians.
    pub(crate) fn profile_law(&self, angle: f64) -> impl Fn(f64) -> f64 + Send + Sync + use<> {
        let law = self.law.clone();
        let (caliper, seen) = (law.caliper_effective() / law.size(), angle.sin());
        move |x| caliper * law.cdf(x.max(seen))
    }
}

/// Closed form for spheres and ellipsoids; for meshes sections are integrated until the error of the kernel is below
/// [`LAW_TOLERANCE`].
fn section_law(name: &str, body: &Body) -> Result<SectionLaw, ParticleTypesError> {
    SectionLaw::of_body(body, &SectionOptions::default().with_tolerance(LAW_TOLERANCE)).map_err(|error| {
        ParticleTypesError::Law {
            name: name.to_owned(),
            why: error.to_string(),
        }
    })
}
