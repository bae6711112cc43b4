//! The steerable pyramid of volumes, with tight families of axes.

use std::sync::Arc;

use nalgebra::Vector3;
use ndarray::{Array3, ArrayView3, ArrayViewMut3};
use stereology_spectrum::Real;

use crate::PyramidError;
use crate::bank::{FilterBank, most_levels};
use crate::filters::Directions;
use crate::steerable::check_spacing;

/// Tight families of axes, whose filters `(v_b · u)^p` divide the power of every direction u: `Σ_b (v_b · u)^2p = n /
/// (2p + 1)`. Three axes with p = 2 are not tight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axes {
    /// No axes: one band per level.
    #[default]
    Isotropic,
    /// The three axes of the array, p = 1.
    Octahedron,
    /// The six axes through the corners of an icosahedron, p = 2.
    Icosahedron,
    /// The ten axes through the corners of a dodecahedron, p = 2.
    Dodecahedron,
}

impl Axes {
    /// Unit vectors (x, y, z); empty if isotropic.
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_pyramid::Axes;
    ///
    /// let square: f64 = Axes::Icosahedron.vectors().iter().map(|v| v.x.powi(4)).sum();
    /// assert!((square - 6.0 / 5.0).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn vectors(self) -> Vec<Vector3<f64>> {
        let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
        // The three even permutations of (x, y, z).
        let turned = |x: f64, y: f64, z: f64| [Vector3::new(x, y, z), Vector3::new(y, z, x), Vector3::new(z, x, y)];
        let vectors: Vec<Vector3<f64>> = match self {
            Self::Isotropic => vec![],
            Self::Octahedron => turned(1.0, 0.0, 0.0).to_vec(),
            Self::Icosahedron => [turned(golden, 1.0, 0.0), turned(golden, -1.0, 0.0)].concat(),
            Self::Dodecahedron => {
                let cube = [(1.0, 1.0, 1.0), (-1.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, -1.0)];
                let cube = cube.map(|(x, y, z)| Vector3::new(x, y, z));
                let others = [turned(0.0, 1.0 / golden, golden), turned(0.0, -1.0 / golden, golden)].concat();
                [cube.to_vec(), others].concat()
            }
        };
        vectors.into_iter().map(|v| v.normalize()).collect()
    }

    fn directions(self) -> Directions {
        let vectors: Vec<[f64; 3]> = self.vectors().iter().map(|v| [v.z, v.y, v.x]).collect();
        match self {
            Self::Isotropic => Directions::none(),
            Self::Octahedron => Directions::space(vectors, 1),
            Self::Icosahedron | Self::Dodecahedron => Directions::space(vectors, 2),
        }
    }
}

/// The steerable pyramid of volumes of one shape: any size from 8 samples per axis, periodic, with perfect
/// reconstruction.
///
/// # Formula
///
/// ```text
/// band(l, b) = FT⁻¹[ L_1 L_½ … H_{2^−(l+1)} A_b v̂ ],   A_b = (−i)^p √((2p + 1)/n) (v_b · u)^p
/// ```
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use stereology_pyramid::{Axes, VolumePyramid};
///
/// let volume = Array3::from_shape_fn((9, 16, 21), |(z, y, x)| ((5 * z * z + 3 * y + x * x) % 13) as f64);
/// let pyramid = VolumePyramid::new([9, 16, 21], [1.0; 3], 1, Axes::Icosahedron)?;
/// let bands = pyramid.build(volume.view())?;
/// assert_eq!(bands.oriented(0, 5).dim(), (9, 16, 21));
/// let back = pyramid.reconstruct(&bands);
/// assert!(volume.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-12 * 13.0));
/// # Ok::<(), stereology_pyramid::PyramidError>(())
/// ```
#[derive(Clone, Debug)]
pub struct VolumePyramid<T: Real> {
    bank: Arc<FilterBank<T>>,
    directions: Directions,
}

impl<T: Real> VolumePyramid<T> {
    /// Pyramid of volumes of `shape` (z, y, x) with distances `spacing` between samples (z, y, x; any unit).
    ///
    /// # Errors
    ///
    /// [`PyramidError::VolumeLevels`] for a side under 8 samples or levels that do not fit, [`PyramidError::Spacing`].
    pub fn new(shape: [usize; 3], spacing: [f64; 3], levels: usize, axes: Axes) -> Result<Self, PyramidError> {
        check_spacing(&spacing)?;
        let most = most_levels(&shape, &spacing);
        if levels == 0 || levels > most {
            return Err(PyramidError::VolumeLevels {
                shape,
                requested: levels,
                most,
            });
        }
        let directions = axes.directions();
        Ok(Self {
            bank: Arc::new(FilterBank::new(&shape, &spacing, levels, &directions)),
            directions,
        })
    }

    /// Decomposes a volume into bands.
    ///
    /// # Errors
    ///
    /// [`PyramidError::VolumeShape`] for another shape, [`PyramidError::VolumeNotFinite`] for NaN or infinity.
    pub fn build(&self, volume: ArrayView3<'_, T>) -> Result<VolumeBands<T>, PyramidError> {
        let expected = [0, 1, 2].map(|axis| self.bank.shape()[axis]);
        let (nz, ny, nx) = volume.dim();
        if expected != [nz, ny, nx] {
            return Err(PyramidError::VolumeShape {
                expected,
                found: [nz, ny, nx],
            });
        }
        if let Some((at, _)) = volume.indexed_iter().find(|(_, v)| !v.is_finite()) {
            return Err(PyramidError::VolumeNotFinite { at: [at.0, at.1, at.2] });
        }
        let values: Vec<T> = volume.iter().copied().collect();
        let mut coefficients = vec![T::zero(); self.bank.coefficients()];
        self.bank.analyse(&values, &mut coefficients, &mut self.bank.work());
        Ok(VolumeBands {
            coefficients,
            bank: Arc::clone(&self.bank),
            directions: self.directions.clone(),
        })
    }

    /// Reconstructs a volume from bands.
    ///
    /// # Panics
    ///
    /// If the bands belong to a pyramid with another shape, levels or axes.
    #[must_use]
    pub fn reconstruct(&self, bands: &VolumeBands<T>) -> Array3<T> {
        assert_eq!(
            self.bank.ranges(),
            bands.bank.ranges(),
            "the bands belong to another pyramid"
        );
        let shape = [0, 1, 2].map(|axis| self.bank.shape()[axis]);
        let mut volume = vec![T::zero(); shape.iter().product()];
        self.bank
            .synthesise(&bands.coefficients, &mut volume, &mut self.bank.work());
        Array3::from_shape_vec(shape, volume).expect("as many samples as the shape has")
    }
}

/// The bands of one volume: the high-pass residual, bands by level (0 is the finest) and axis, and the low-pass
/// residual.
#[derive(Clone, Debug)]
pub struct VolumeBands<T: Real> {
    coefficients: Vec<T>,
    bank: Arc<FilterBank<T>>,
    directions: Directions,
}

impl<T: Real> VolumeBands<T> {
    /// The high-pass residual: frequencies beyond Nyquist, in the corners of the frequency cube; full size.
    #[must_use]
    pub fn high(&self) -> ArrayView3<'_, T> {
        self.band(0, 0)
    }

    /// Band of a level (0 the finest) and an axis, in the order of [`Axes::vectors`] (0 if isotropic).
    ///
    /// # Panics
    ///
    /// If the pyramid has no such level or axis.
    #[must_use]
    pub fn oriented(&self, level: usize, axis: usize) -> ArrayView3<'_, T> {
        self.band(self.index(level, axis), level)
    }

    /// Mutable [`Self::oriented`].
    ///
    /// # Panics
    ///
    /// If the pyramid has no such level or axis.
    pub fn oriented_mut(&mut self, level: usize, axis: usize) -> ArrayViewMut3<'_, T> {
        let range = self.bank.ranges()[self.index(level, axis)].clone();
        let shape = self.shape_at(level);
        ArrayViewMut3::from_shape(shape, &mut self.coefficients[range]).expect("a band has the shape of its level")
    }

    /// The low-pass residual: coarser than the last level, with the mean of the volume.
    #[must_use]
    pub fn low(&self) -> ArrayView3<'_, T> {
        self.band(self.bank.ranges().len() - 1, self.bank.level_count())
    }

    /// The band of a level for a filter along any `axis` (x, y, z): an exact linear combination of the bands of the
    /// level.
    ///
    /// # Formula
    ///
    /// ```text
    /// (a · u) = Σ_b (3/n) (v_b · a) (v_b · u)                    p = 1
    /// (a · u)² = Σ_b (15 (v_b · a)² − 3)/(2n) (v_b · u)²         p = 2, icosahedron and dodecahedron
    /// ```
    ///
    /// # Panics
    ///
    /// If the pyramid has no such level.
    ///
    /// # Examples
    ///
    /// ```
    /// use nalgebra::Vector3;
    /// use ndarray::Array3;
    /// use stereology_pyramid::{Axes, VolumePyramid};
    ///
    /// let volume = Array3::from_shape_fn((16, 16, 16), |(z, y, x)| ((5 * z * z + 3 * y + x * x) % 13) as f64);
    /// let bands = VolumePyramid::new([16; 3], [1.0; 3], 1, Axes::Dodecahedron)?.build(volume.view())?;
    /// let own = nalgebra::Unit::new_normalize(Axes::Dodecahedron.vectors()[7]);
    /// let steered = bands.steered(0, &own);
    /// assert!(steered.iter().zip(bands.oriented(0, 7)).all(|(a, b)| (a - b).abs() < 1e-10));
    /// # Ok::<(), stereology_pyramid::PyramidError>(())
    /// ```
    #[must_use]
    pub fn steered(&self, level: usize, axis: &nalgebra::Unit<Vector3<f64>>) -> Array3<T> {
        let n = self.directions.count() as f64;
        let mut sum = Array3::zeros(self.shape_at(level));
        for (b, v) in self.directions.vectors().iter().enumerate() {
            let along = v[2] * axis.x + v[1] * axis.y + v[0] * axis.z;
            let weight = T::from_f64_lossy(match self.directions.power() {
                1 => 3.0 * along / n,
                2 => (15.0 * along * along - 3.0) / (2.0 * n),
                _ => 1.0,
            });
            sum.zip_mut_with(&self.oriented(level, b), |s, &v| *s = *s + weight * v);
        }
        sum
    }

    fn index(&self, level: usize, axis: usize) -> usize {
        let (levels, count) = (self.bank.level_count(), self.bank.orientations());
        assert!(
            level < levels && axis < count,
            "no band ({level}, {axis}) among {levels} x {count}"
        );
        1 + level * count + axis
    }

    fn shape_at(&self, level: usize) -> [usize; 3] {
        [0, 1, 2].map(|axis| self.bank.shape_at(level)[axis])
    }

    fn band(&self, band: usize, level: usize) -> ArrayView3<'_, T> {
        let values = &self.coefficients[self.bank.ranges()[band].clone()];
        ArrayView3::from_shape(self.shape_at(level), values).expect("a band has the shape of its level")
    }
}
