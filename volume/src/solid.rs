//! The solid: the particle, colour and distance at any point of a periodic material.

use crate::cells::Cells;
use crate::colour::add;
use crate::residual::{Field, Lookup, Residual};
use crate::solid_error::{LARGEST_PARTICLE, MOST_BORDER_SAMPLES, SolidError};
use crate::strip::Strip;
use crate::voids::Voids;
use nalgebra::{Point3, Vector3};
use ndarray::Array4;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::sync::Arc;
use stereology_shape::{Arrangement, Particle, PeriodicBox, UnitBody};

/// The bounding balls of the particles may have this many times the volume of the box.
const MOST_CROWDED: f64 = 64.0;
/// Relative error allowed where a side of the box must be a multiple of the residual's period.
const PERIOD_TOLERANCE: f64 = 1e-6;

/// A solid texture: particles in a binder with the residual of a photograph, defined at every point of space.
///
/// The solid repeats with the sides of its box. Where particles overlap, the one with the lower index is visible.
/// Copies share their data.
///
/// # Examples
///
/// A single sphere:
///
/// ```
/// use nalgebra::{Point3, UnitQuaternion, Vector3};
/// use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};
/// use stereology_volume::Solid;
///
/// let sphere = UnitBody::new(&Body::sphere(1.0)?);
/// let particle =
///     Particle { shape: 0, size: 4.0, category: 2, position: Point3::origin(), orientation: UnitQuaternion::identity() };
/// let period = PeriodicBox::new(Vector3::repeat(10.0))?;
/// let solid = Solid::new(Arrangement::new(vec![sphere], vec![particle], period)?, vec![[0.8, 0.2, 0.1]], [0.5; 3], None)?;
///
/// assert_eq!(solid.id_at(&Point3::new(0.0, 0.0, 1.9)), Some(0));
/// assert_eq!(solid.id_at(&Point3::new(0.0, 0.0, 8.1)), Some(0)); // its image
/// assert_eq!(solid.category_at(&Point3::new(1.0, 0.0, 10.0)), Some(2));
/// assert_eq!(solid.colour_at(&Point3::new(5.0, 5.0, 5.0)), [0.5; 3]);
/// assert_eq!(solid.distance_at(&Point3::new(0.0, 7.0, 0.0)), 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Solid {
    arrangement: Arrangement,
    colours: Arc<[[f32; 3]]>,
    binder: [f32; 3],
    cells: Arc<Cells>,
    residual: Option<Arc<Fields>>,
    lookup: Lookup,
    border_samples: u32,
    voids: Option<Arc<Voids>>,
}

#[derive(Debug)]
struct Fields {
    binder: Field,
    particles: Field,
    voxel: f64,
}

impl Solid {
    /// A solid of coloured particles in a binder.
    ///
    /// `colours[i]` is the mean colour of particle i and `binder` that of the binder, sRGB-encoded values / 255; the
    /// residual, if any, is added to them: its binder part outside particles, its particle part inside. Positions may
    /// lie outside the box. Cost: less than 1 µs per cell of the search grid, with 32 cells per particle.
    ///
    /// # Errors
    ///
    /// [`SolidError`] states which particle, colour or residual is not valid, and why.
    pub fn new(
        arrangement: Arrangement,
        colours: Vec<[f32; 3]>,
        binder: [f32; 3],
        residual: Option<Residual>,
    ) -> Result<Self, SolidError> {
        check_particles(&arrangement)?;
        check_colours(&colours, arrangement.particles().len(), binder)?;
        let (residual, cells) = rayon::join(
            || {
                residual
                    .map(|residual| Fields::new(residual, arrangement.period()))
                    .transpose()
            },
            || Cells::new(arrangement.bodies(), arrangement.particles(), arrangement.period()),
        );
        let residual = residual?;
        Ok(Self {
            arrangement,
            colours: colours.into(),
            binder,
            cells: Arc::new(cells),
            residual: residual.map(Arc::new),
            lookup: Lookup::default(),
            border_samples: 4,
            voids: None,
        })
    }

    /// Interpolation of the residual between its voxels; [`Lookup::VarianceKept`] by default.
    #[must_use]
    pub fn with_lookup(self, lookup: Lookup) -> Self {
        Self { lookup, ..self }
    }

    /// Images take the mean of n × n points of a pixel on the border of a particle: from 1 (the centre only) to 16; the
    /// default is 4.
    ///
    /// # Errors
    ///
    /// [`SolidError::BorderSamples`] for other numbers.
    pub fn with_border_samples(self, n: u32) -> Result<Self, SolidError> {
        if !(1..=MOST_BORDER_SAMPLES).contains(&n) {
            return Err(SolidError::BorderSamples(n));
        }
        Ok(Self {
            border_samples: n,
            ..self
        })
    }

    /// The same solid in its mean colours only, as in figure 5 (a).
    #[must_use]
    pub fn without_residual(&self) -> Self {
        Self {
            residual: None,
            ..self.clone()
        }
    }

    /// The same solid whose particles of these shapes (indices of [`Self::bodies`]) are voids.
    ///
    /// They keep the colour of their profiles in the photograph, which slices and voxels show. Their alpha is 0, and
    /// rendered images and carved meshes show holes.
    ///
    /// # Errors
    ///
    /// [`SolidError::Void`] if there is no such shape.
    ///
    /// # Examples
    ///
    /// ```
    /// # use nalgebra::{Point3, UnitQuaternion, Vector3};
    /// # use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};
    /// # use stereology_volume::Solid;
    /// # let bubble = UnitBody::new(&Body::sphere(1.0)?);
    /// # let particle = Particle { shape: 0, size: 4.0, category: 0, position: Point3::origin(), orientation: UnitQuaternion::identity() };
    /// # let period = PeriodicBox::new(Vector3::repeat(10.0))?;
    /// let foam = Solid::new(Arrangement::new(vec![bubble], vec![particle], period)?, vec![[0.2; 3]], [0.8; 3], None)?.with_voids(&[0])?;
    /// assert!(foam.is_void_at(&Point3::new(9.0, 0.0, 0.0)));
    /// assert_eq!(foam.void_distance_at(&Point3::new(0.0, 5.0, 0.0)), 3.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn with_voids(self, shapes: &[usize]) -> Result<Self, SolidError> {
        let voids = Voids::new(&self.arrangement, shapes)?.map(Arc::new);
        Ok(Self { voids, ..self })
    }

    /// The shapes that are voids, in ascending order.
    #[must_use]
    pub fn voids(&self) -> &[usize] {
        self.voids.as_ref().map_or(&[], |voids| voids.shapes())
    }

    /// Whether a point is in a void: its alpha is 0.
    #[must_use]
    pub fn is_void_at(&self, p: &Point3<f64>) -> bool {
        let p = self.period().wrap(p);
        self.voids
            .as_ref()
            .is_some_and(|voids| voids.contain(self.bodies(), &p))
    }

    /// Distance to the nearest surface of a void, negative inside a void; infinite without voids.
    #[must_use]
    pub fn void_distance_at(&self, p: &Point3<f64>) -> f64 {
        let p = self.period().wrap(p);
        self.voids
            .as_ref()
            .map_or(f64::INFINITY, |voids| voids.distance(self.bodies(), &p))
    }

    /// The particles and their box.
    #[must_use]
    pub fn arrangement(&self) -> &Arrangement {
        &self.arrangement
    }

    /// The bodies that particles are copies of.
    #[must_use]
    pub fn bodies(&self) -> &[UnitBody] {
        self.arrangement.bodies()
    }

    /// The particles, in the order of their ids.
    #[must_use]
    pub fn particles(&self) -> &[Particle] {
        self.arrangement.particles()
    }

    /// Mean colour of each particle.
    #[must_use]
    pub fn colours(&self) -> &[[f32; 3]] {
        &self.colours
    }

    /// Mean colour of the binder.
    #[must_use]
    pub fn binder(&self) -> [f32; 3] {
        self.binder
    }

    /// The box whose sides are the periods of the solid.
    #[must_use]
    pub fn period(&self) -> &PeriodicBox {
        self.arrangement.period()
    }

    /// Index of the particle at a point, `None` in the binder. Some 100 ns, nearly independent of the number of
    /// particles.
    #[must_use]
    pub fn id_at(&self, p: &Point3<f64>) -> Option<usize> {
        self.id_within(&self.period().wrap(p))
    }

    /// Category of the particle at a point, `None` in the binder.
    #[must_use]
    pub fn category_at(&self, p: &Point3<f64>) -> Option<u8> {
        self.id_at(p).map(|id| self.particles()[id].category)
    }

    /// Colour at a point: mean colour plus residual. Not clamped: the residual may take values outside 0..1.
    #[must_use]
    pub fn colour_at(&self, p: &Point3<f64>) -> [f32; 3] {
        let p = self.period().wrap(p);
        let id = self.id_within(&p);
        let mean = self.mean_colour(id);
        match &self.residual {
            None => mean,
            Some(_) => add(mean, self.residual_within(&p, id.is_some())),
        }
    }

    /// Colours at many points, in their order, in parallel: the same bits as [`Self::colour_at`] at any number of
    /// threads.
    ///
    /// Points are evaluated in the order of a curve through the box, so that random points make good use of the cache.
    ///
    /// ```
    /// # use nalgebra::{Point3, Vector3};
    /// # use stereology_shape::{Arrangement, PeriodicBox};
    /// # use stereology_volume::Solid;
    /// let solid = Solid::new(Arrangement::new(vec![], vec![], PeriodicBox::new(Vector3::repeat(1.0))?)?, vec![], [0.5; 3], None)?;
    /// assert_eq!(solid.colours_at(&[Point3::origin(); 2]), [[0.5; 3]; 2]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn colours_at(&self, points: &[Point3<f64>]) -> Vec<[f32; 3]> {
        let place = |p: &Point3<f64>| self.period().curve_place(p);
        let mut order: Vec<(u32, usize)> = points.par_iter().map(place).zip(0..points.len()).collect();
        order.par_sort_unstable();
        // Gathered in a separate pass, many at a time.
        let sorted: Vec<Point3<f64>> = order.par_iter().map(|&(_, i)| points[i]).collect();
        let sorted: Vec<[f32; 3]> = sorted
            .par_iter()
            .with_min_len(1024)
            .map(|p| self.colour_at(p))
            .collect();
        let mut colours = vec![[0.0; 3]; points.len()];
        for ((_, i), colour) in order.into_iter().zip(sorted) {
            colours[i] = colour;
        }
        colours
    }

    /// Distance to the nearest surface of a particle, negative inside; infinite without particles. Exact; it takes a
    /// microsecond or more.
    ///
    /// Inside a particle it is the distance to that particle's surface; without overlaps no other surface is nearer.
    #[must_use]
    pub fn distance_at(&self, p: &Point3<f64>) -> f64 {
        self.cells.distance(self.bodies(), &self.period().wrap(p))
    }

    pub(crate) fn id_within(&self, p: &Point3<f64>) -> Option<usize> {
        self.cells.particle_at(self.bodies(), p)
    }

    /// The particles met by some rows.
    pub(crate) fn strip(&self, z: f64, ys: [f64; 2]) -> Strip<'_> {
        self.cells.strip(self.bodies(), z, ys)
    }

    /// The voids met by some rows; `None` without voids.
    pub(crate) fn strip_of_voids(&self, z: f64, ys: [f64; 2]) -> Option<Strip<'_>> {
        self.voids.as_ref().map(|voids| voids.strip(self.bodies(), z, ys))
    }

    /// The residuals of binder and particles.
    pub(crate) fn fields(&self) -> Option<[&Field; 2]> {
        self.residual.as_ref().map(|fields| [&fields.binder, &fields.particles])
    }

    pub(crate) fn lookup(&self) -> Lookup {
        self.lookup
    }

    pub(crate) fn mean_colour(&self, id: Option<usize>) -> [f32; 3] {
        id.map_or(self.binder, |id| self.colours[id])
    }

    /// The residual at a point of the box, of the particles or of the binder.
    pub(crate) fn residual_within(&self, p: &Point3<f64>, in_particle: bool) -> [f32; 3] {
        self.fields()
            .map_or([0.0; 3], |fields| fields[usize::from(in_particle)].at(p, self.lookup))
    }

    /// Edge of the residual's voxels.
    pub(crate) fn residual_voxel(&self) -> Option<f64> {
        self.residual.as_ref().map(|fields| fields.voxel)
    }

    pub(crate) fn border_samples(&self) -> u32 {
        self.border_samples
    }
}

/// Requirements of a solid beyond those of any arrangement.
fn check_particles(arrangement: &Arrangement) -> Result<(), SolidError> {
    let side = arrangement.sides().min();
    let mut balls = 0.0;
    for (index, particle) in arrangement.particles().iter().enumerate() {
        let (body, size) = (&arrangement.bodies()[particle.shape], particle.size);
        if 2.0 * body.bounding_radius() * size > LARGEST_PARTICLE * side {
            return Err(SolidError::TooLarge {
                particle: index,
                size,
                side,
            });
        }
        if particle.category == u8::MAX {
            return Err(SolidError::Category { particle: index });
        }
        balls += 4.0 / 3.0 * PI * (body.bounding_radius() * size).powi(3);
    }
    let times = balls / arrangement.period().volume();
    if times > MOST_CROWDED {
        Err(SolidError::Crowded { times })
    } else {
        Ok(())
    }
}

fn check_colours(colours: &[[f32; 3]], particles: usize, binder: [f32; 3]) -> Result<(), SolidError> {
    if colours.len() != particles {
        return Err(SolidError::Colours {
            colours: colours.len(),
            particles,
        });
    }
    let finite = |colour: &[f32; 3]| colour.iter().all(|value| value.is_finite());
    if !finite(&binder) {
        return Err(SolidError::Colour { particle: None });
    }
    match colours.iter().position(|colour| !finite(colour)) {
        Some(particle) => Err(SolidError::Colour {
            particle: Some(particle),
        }),
        None => Ok(()),
    }
}

impl Fields {
    fn new(residual: Residual, period: &PeriodicBox) -> Result<Self, SolidError> {
        let voxel = residual.voxel;
        let field = |part: &'static str, array: Array4<f32>| {
            let (nz, ny, nx, channels) = array.dim();
            let wrong = SolidError::Residual {
                part,
                shape: [nz, ny, nx, channels],
                voxel,
            };
            let sound = !array.is_empty() && channels == 3 && array.iter().all(|value| value.is_finite());
            if !(sound && voxel.is_finite() && voxel > 0.0) {
                return Err(wrong);
            }
            let mut voxels_per_length = Vector3::zeros();
            for (k, (n, axis)) in [(nx, 'x'), (ny, 'y'), (nz, 'z')].into_iter().enumerate() {
                let (side, length) = (period.sides()[k], n as f64 * voxel);
                let periods = (side / length).round();
                if periods < 1.0 || (periods * length / side - 1.0).abs() > PERIOD_TOLERANCE {
                    return Err(SolidError::Period {
                        axis,
                        side,
                        period: length,
                    });
                }
                // Computed from the side, not from the voxel, so that the last period ends exactly with the box.
                voxels_per_length[k] = periods * n as f64 / side;
            }
            Ok(Field::new(array, voxels_per_length))
        };
        Ok(Self {
            binder: field("binder", residual.binder)?,
            particles: field("particles", residual.particles)?,
            voxel,
        })
    }
}
