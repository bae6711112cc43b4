//! Fourier transforms of fields with one to three axes of any length.

use std::array;
use std::sync::Arc;

use ndarray::{Array, ArrayBase, ArrayView, ArrayViewMut2, ArrayViewMut3, Axis, Data, Dimension};
use rayon::prelude::*;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftDirection, FftPlanner};

use crate::{Complex, Real, SpectrumError};

/// Number of lanes gathered at once along an axis that is not contiguous: two cache lines of complex `f32`.
const LANES: usize = 16;
/// Smaller fields are transformed on the calling thread, because distributing them would cost more.
const PARALLEL_FROM: usize = 1 << 17;

/// Signed frequency of bin `index` of `n`, in cycles per sample: `index / n`, minus one in the upper half.
///
/// # Examples
///
/// ```
/// use stereology_spectrum::frequency;
///
/// assert_eq!(frequency(1, 4), 0.25);
/// assert_eq!(frequency(3, 4), -0.25);
/// assert_eq!(frequency(3, 5), -0.4);
/// ```
#[must_use]
pub fn frequency(index: usize, n: usize) -> f64 {
    let signed = if 2 * index < n || n == 1 {
        index as f64
    } else {
        index as f64 - n as f64
    };
    signed / n as f64
}

/// Samples of an array in C order.
pub(crate) fn contiguous<S: Data, D: Dimension>(array: &ArrayBase<S, D>) -> &[S::Elem] {
    array.as_slice().expect("an array in C order is contiguous")
}

fn contiguous_mut<T, D: Dimension>(array: &mut Array<T, D>) -> &mut [T] {
    array.as_slice_mut().expect("an array in C order is contiguous")
}

fn checked(shape: &[usize]) -> Result<Vec<usize>, SpectrumError> {
    if shape.is_empty() || shape.len() > 3 || shape.contains(&0) {
        return Err(SpectrumError::Shape { shape: shape.to_vec() });
    }
    Ok(shape.to_vec())
}

fn same(expected: &[usize], found: &[usize]) -> Result<(), SpectrumError> {
    if expected == found {
        return Ok(());
    }
    Err(SpectrumError::Mismatch {
        expected: expected.to_vec(),
        found: found.to_vec(),
    })
}

/// Buffers of a transform, reused between calls so that a hot loop does not allocate. Created by [`RealFft::work`].
#[derive(Clone, Debug)]
pub struct Work<T> {
    row: Vec<T>,
    lanes: Vec<Complex<T>>,
    scratch: Vec<Complex<T>>,
}

/// Transform of real fields of one shape. The spectrum has the shape of the field, except that the last length `n`
/// becomes `n/2 + 1`.
///
/// `O(N log N)` for any size, including primes. Fields of 2^17 samples or more use all threads.
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use stereology_spectrum::RealFft;
///
/// let fft = RealFft::<f32>::new(&[4, 6, 5])?;
/// let spectrum = fft.forward(Array3::from_elem((4, 6, 5), 2.0_f32).view())?;
/// assert_eq!(spectrum.dim(), (4, 6, 3));
/// assert!((spectrum[[0, 0, 0]].re - 240.0).abs() < 1e-3);
/// # Ok::<(), stereology_spectrum::SpectrumError>(())
/// ```
#[derive(Clone)]
pub struct RealFft<T: Real> {
    shape: Vec<usize>,
    spectrum_shape: Vec<usize>,
    rows_forward: Arc<dyn RealToComplex<T>>,
    rows_inverse: Arc<dyn ComplexToReal<T>>,
    across: Across<T>,
}

impl<T: Real> std::fmt::Debug for RealFft<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RealFft")
            .field("shape", &self.shape)
            .finish_non_exhaustive()
    }
}

impl<T: Real> RealFft<T> {
    /// Plans the transform of fields of `shape`: one to three axes, any length.
    ///
    /// # Errors
    ///
    /// [`SpectrumError::Shape`] for no axis, more than three, or an axis without samples.
    pub fn new(shape: &[usize]) -> Result<Self, SpectrumError> {
        let shape = checked(shape)?;
        let last = shape[shape.len() - 1];
        let mut planner = RealFftPlanner::new();
        let mut spectrum_shape = shape.clone();
        spectrum_shape[shape.len() - 1] = last / 2 + 1;
        Ok(Self {
            rows_forward: planner.plan_fft_forward(last),
            rows_inverse: planner.plan_fft_inverse(last),
            across: Across::new(&shape[..shape.len() - 1]),
            shape,
            spectrum_shape,
        })
    }

    /// Shape of the fields.
    #[must_use]
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// Shape of the spectra.
    #[must_use]
    pub fn spectrum_shape(&self) -> &[usize] {
        &self.spectrum_shape
    }

    /// Number of samples of a field.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.shape.iter().product()
    }

    /// New buffers for [`Self::forward_into`] and [`Self::inverse_into`].
    #[must_use]
    pub fn work(&self) -> Work<T> {
        let zero = Complex::new(T::zero(), T::zero());
        let rows = self
            .rows_forward
            .get_scratch_len()
            .max(self.rows_inverse.get_scratch_len());
        Work {
            row: vec![T::zero(); self.shape[self.shape.len() - 1]],
            lanes: vec![zero; LANES * self.across.longest()],
            scratch: vec![zero; rows.max(self.across.scratch())],
        }
    }

    /// Spectrum of a real field.
    ///
    /// # Errors
    ///
    /// [`SpectrumError::Mismatch`] if the field has another shape.
    pub fn forward<D: Dimension>(&self, field: ArrayView<'_, T, D>) -> Result<Array<Complex<T>, D>, SpectrumError> {
        same(&self.shape, field.shape())?;
        let mut dim = field.raw_dim();
        dim[self.shape.len() - 1] = self.spectrum_shape[self.shape.len() - 1];
        let field = field.as_standard_layout();
        let mut spectrum = Array::from_elem(dim, Complex::new(T::zero(), T::zero()));
        let values = contiguous(&field);
        let bins = contiguous_mut(&mut spectrum);
        self.forward_into(values, bins, &mut self.work());
        Ok(spectrum)
    }

    /// Inverse transform to a real field, divided by the number of samples.
    ///
    /// The spectrum is assumed to be Hermitian: imaginary parts that no real field has are ignored.
    ///
    /// # Errors
    ///
    /// [`SpectrumError::Mismatch`] if the spectrum has another shape.
    pub fn inverse<D: Dimension>(&self, spectrum: Array<Complex<T>, D>) -> Result<Array<T, D>, SpectrumError> {
        same(&self.spectrum_shape, spectrum.shape())?;
        let mut dim = spectrum.raw_dim();
        dim[self.shape.len() - 1] = self.shape[self.shape.len() - 1];
        let mut spectrum = if spectrum.is_standard_layout() {
            spectrum
        } else {
            spectrum.as_standard_layout().into_owned()
        };
        let mut field = Array::from_elem(dim, T::zero());
        let values = contiguous_mut(&mut field);
        let bins = contiguous_mut(&mut spectrum);
        self.inverse_into(bins, values, &mut self.work());
        let scale = T::one() / T::from_f64_lossy(self.samples() as f64);
        field.mapv_inplace(|v| v * scale);
        Ok(field)
    }

    /// [`Self::forward`] on slices in C order. Below 2^17 samples it runs on the calling thread and does not allocate.
    ///
    /// # Panics
    ///
    /// If the slices do not have the numbers of samples of [`Self::shape`] and [`Self::spectrum_shape`], or `work`
    /// belongs to another transform.
    pub fn forward_into(&self, field: &[T], spectrum: &mut [Complex<T>], work: &mut Work<T>) {
        let (n, half) = self.row_lengths();
        if self.samples() < PARALLEL_FROM {
            self.rows_forward_into(field, spectrum, work);
            self.across.transform(spectrum, half, FftDirection::Forward, work);
        } else {
            spectrum
                .par_chunks_mut(half * LANES)
                .zip(field.par_chunks(n * LANES))
                .for_each_init(
                    || self.work(),
                    |work, (bins, values)| self.rows_forward_into(values, bins, work),
                );
            self.across.transform_parallel(spectrum, half, FftDirection::Forward);
        }
    }

    /// Inverse transform on slices in C order, **not** divided by the number of samples.
    ///
    /// Below 2^17 samples it runs on the calling thread and does not allocate. The contents of `spectrum` are
    /// overwritten.
    ///
    /// # Panics
    ///
    /// If the slices do not have the numbers of samples of [`Self::shape`] and [`Self::spectrum_shape`], or `work`
    /// belongs to another transform.
    pub fn inverse_into(&self, spectrum: &mut [Complex<T>], field: &mut [T], work: &mut Work<T>) {
        let (n, half) = self.row_lengths();
        if self.samples() < PARALLEL_FROM {
            self.across.transform(spectrum, half, FftDirection::Inverse, work);
            self.rows_inverse_into(spectrum, field, work);
        } else {
            self.across.transform_parallel(spectrum, half, FftDirection::Inverse);
            field
                .par_chunks_mut(n * LANES)
                .zip(spectrum.par_chunks_mut(half * LANES))
                .for_each_init(
                    || self.work(),
                    |work, (values, bins)| self.rows_inverse_into(bins, values, work),
                );
        }
    }

    fn row_lengths(&self) -> (usize, usize) {
        let last = self.shape.len() - 1;
        (self.shape[last], self.spectrum_shape[last])
    }

    fn rows_forward_into(&self, field: &[T], spectrum: &mut [Complex<T>], work: &mut Work<T>) {
        let (n, half) = self.row_lengths();
        assert_eq!(
            field.len() / n,
            spectrum.len() / half,
            "field and spectrum have as many rows"
        );
        for (row, bins) in field.chunks_exact(n).zip(spectrum.chunks_exact_mut(half)) {
            work.row.copy_from_slice(row);
            self.rows_forward
                .process_with_scratch(&mut work.row, bins, &mut work.scratch)
                .expect("row lengths were planned");
        }
    }

    fn rows_inverse_into(&self, spectrum: &mut [Complex<T>], field: &mut [T], work: &mut Work<T>) {
        let (n, half) = self.row_lengths();
        assert_eq!(
            field.len() / n,
            spectrum.len() / half,
            "field and spectrum have as many rows"
        );
        for (row, bins) in field.chunks_exact_mut(n).zip(spectrum.chunks_exact_mut(half)) {
            // Rounding leaves small imaginary parts in the bins that are real by symmetry.
            bins[0].im = T::zero();
            if n.is_multiple_of(2) {
                bins[half - 1].im = T::zero();
            }
            self.rows_inverse
                .process_with_scratch(bins, row, &mut work.scratch)
                .expect("row lengths were planned");
        }
    }
}

/// In-place transform of complex fields of one shape.
///
/// `O(N log N)` for any size. Fields of 2^17 samples or more use all threads.
///
/// # Examples
///
/// ```
/// use ndarray::Array2;
/// use stereology_spectrum::{Complex, ComplexFft};
///
/// let fft = ComplexFft::new(&[6, 7])?;
/// let mut field = Array2::from_shape_fn((6, 7), |(y, x)| Complex::new(y as f64, x as f64));
/// let original = field.clone();
/// fft.forward(&mut field)?;
/// fft.inverse(&mut field)?;
/// assert!(field.iter().zip(&original).all(|(a, b)| (a - b).norm() < 1e-12));
/// # Ok::<(), stereology_spectrum::SpectrumError>(())
/// ```
#[derive(Clone)]
pub struct ComplexFft<T: Real> {
    shape: Vec<usize>,
    axes: Across<T>,
}

impl<T: Real> std::fmt::Debug for ComplexFft<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ComplexFft")
            .field("shape", &self.shape)
            .finish_non_exhaustive()
    }
}

impl<T: Real> ComplexFft<T> {
    /// Plans the transform of fields of `shape`: one to three axes, any length.
    ///
    /// # Errors
    ///
    /// [`SpectrumError::Shape`] for no axis, more than three, or an axis without samples.
    pub fn new(shape: &[usize]) -> Result<Self, SpectrumError> {
        let shape = checked(shape)?;
        Ok(Self {
            axes: Across::new(&shape),
            shape,
        })
    }

    /// Transforms a field to its spectrum, without scaling.
    ///
    /// # Errors
    ///
    /// [`SpectrumError::Mismatch`] if the field has another shape.
    pub fn forward<D: Dimension>(&self, field: &mut Array<Complex<T>, D>) -> Result<(), SpectrumError> {
        self.run(field, FftDirection::Forward)
    }

    /// Transforms a spectrum to its field, divided by the number of samples.
    ///
    /// # Errors
    ///
    /// [`SpectrumError::Mismatch`] if the spectrum has another shape.
    pub fn inverse<D: Dimension>(&self, spectrum: &mut Array<Complex<T>, D>) -> Result<(), SpectrumError> {
        self.run(spectrum, FftDirection::Inverse)?;
        let scale = T::one() / T::from_f64_lossy(spectrum.len() as f64);
        spectrum.mapv_inplace(|v| v * scale);
        Ok(())
    }

    fn run<D: Dimension>(
        &self,
        field: &mut Array<Complex<T>, D>,
        direction: FftDirection,
    ) -> Result<(), SpectrumError> {
        same(&self.shape, field.shape())?;
        if !field.is_standard_layout() {
            *field = field.as_standard_layout().into_owned();
        }
        let values = contiguous_mut(field);
        self.axes.transform_parallel(values, 1, direction);
        Ok(())
    }
}

/// Complex transforms along the leading axes of an array with `inner` values per element of these axes.
#[derive(Clone)]
struct Across<T: Real> {
    lengths: Vec<usize>,
    forward: Vec<Arc<dyn Fft<T>>>,
    inverse: Vec<Arc<dyn Fft<T>>>,
}

impl<T: Real> Across<T> {
    fn new(lengths: &[usize]) -> Self {
        let mut planner = FftPlanner::new();
        Self {
            lengths: lengths.to_vec(),
            forward: lengths.iter().map(|&n| planner.plan_fft_forward(n)).collect(),
            inverse: lengths.iter().map(|&n| planner.plan_fft_inverse(n)).collect(),
        }
    }

    fn plan(&self, axis: usize, direction: FftDirection) -> &dyn Fft<T> {
        match direction {
            FftDirection::Forward => self.forward[axis].as_ref(),
            FftDirection::Inverse => self.inverse[axis].as_ref(),
        }
    }

    fn longest(&self) -> usize {
        self.lengths.iter().copied().max().unwrap_or(0)
    }

    fn scratch(&self) -> usize {
        self.forward
            .iter()
            .chain(&self.inverse)
            .map(|f| f.get_inplace_scratch_len())
            .max()
            .unwrap_or(0)
    }

    /// The array as (preceding axes, this axis, following values).
    fn split<'a>(&self, values: &'a mut [Complex<T>], axis: usize, inner: usize) -> ArrayViewMut3<'a, Complex<T>> {
        let outer: usize = self.lengths[..axis].iter().product();
        let behind: usize = self.lengths[axis + 1..].iter().product::<usize>() * inner;
        ArrayViewMut3::from_shape((outer, self.lengths[axis], behind), values).expect("the array has the planned shape")
    }

    fn transform(&self, values: &mut [Complex<T>], inner: usize, direction: FftDirection, work: &mut Work<T>) {
        for axis in 0..self.lengths.len() {
            let plan = self.plan(axis, direction);
            for mut matrix in self.split(values, axis, inner).outer_iter_mut() {
                for lanes in matrix.axis_chunks_iter_mut(Axis(1), LANES) {
                    transform_lanes(plan, lanes, &mut work.lanes, &mut work.scratch);
                }
            }
        }
    }

    fn transform_parallel(&self, values: &mut [Complex<T>], inner: usize, direction: FftDirection) {
        let zero = Complex::new(T::zero(), T::zero());
        let buffers = || (vec![zero; LANES * self.longest()], vec![zero; self.scratch()]);
        for axis in 0..self.lengths.len() {
            let plan = self.plan(axis, direction);
            let mut view = self.split(values, axis, inner);
            let mut tasks: Vec<ArrayViewMut2<'_, Complex<T>>> = Vec::new();
            for matrix in view.outer_iter_mut() {
                let mut rest = matrix;
                while rest.ncols() > LANES {
                    let (lanes, behind) = rest.split_at(Axis(1), LANES);
                    tasks.push(lanes);
                    rest = behind;
                }
                tasks.push(rest);
            }
            if tasks.iter().map(ArrayViewMut2::len).sum::<usize>() < PARALLEL_FROM {
                let (mut lanes, mut scratch) = buffers();
                tasks
                    .into_iter()
                    .for_each(|task| transform_lanes(plan, task, &mut lanes, &mut scratch));
            } else {
                tasks
                    .into_par_iter()
                    .with_min_len(8)
                    .for_each_init(buffers, |(lanes, scratch), task| {
                        transform_lanes(plan, task, lanes, scratch);
                    });
            }
        }
    }
}

/// Transforms every column of a matrix of at most [`LANES`] columns.
fn transform_lanes<T: Real>(
    plan: &dyn Fft<T>,
    mut matrix: ArrayViewMut2<'_, Complex<T>>,
    lanes: &mut [Complex<T>],
    scratch: &mut [Complex<T>],
) {
    // Copy several rows at once, so that their values fill a cache line of each lane.
    const ROWS: usize = 8;
    let (n, columns) = matrix.dim();
    let lanes = &mut lanes[..n * columns];
    for (block, rows) in matrix.axis_chunks_iter(Axis(0), ROWS).enumerate() {
        let mut rows = rows.axis_iter(Axis(0));
        let rows: [&[Complex<T>]; ROWS] =
            array::from_fn(|_| rows.next().and_then(|row| row.to_slice()).unwrap_or_default());
        for (c, lane) in lanes.chunks_exact_mut(n).enumerate() {
            let lane = &mut lane[block * ROWS..];
            lane.iter_mut().zip(&rows).for_each(|(to, row)| *to = row[c]);
        }
    }
    plan.process_with_scratch(lanes, scratch);
    for (block, mut rows) in matrix.axis_chunks_iter_mut(Axis(0), ROWS).enumerate() {
        let mut rows = rows.outer_iter_mut();
        let mut rows: [&mut [Complex<T>]; ROWS] =
            array::from_fn(|_| rows.next().and_then(ArrayBase::into_slice).unwrap_or_default());
        for (c, lane) in lanes.chunks_exact(n).enumerate() {
            let lane = &lane[block * ROWS..];
            rows.iter_mut().zip(lane).for_each(|(row, from)| row[c] = *from);
        }
    }
}
