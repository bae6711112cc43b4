//! Geometry of the bright and the dark phase of slices and volumes: Minkowski functionals and chords.

use ndarray::{Array2, Array3, ArrayView3, ArrayView4, Axis};
use rayon::prelude::*;
use stereology_metrics::{
    Chords, PlanarFunctionals, SpatialFunctionals, chord_lengths, grey, planar_functionals, spatial_functionals,
};

/// A phase of slices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarPhase {
    /// Means over the slices, weighted by their areas.
    pub functionals: PlanarFunctionals,
    /// Chords along rows and columns that end inside the slices; `None` if there are none.
    pub chords: Option<Chords>,
}

/// A phase of a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpatialPhase {
    /// Minkowski functionals.
    pub functionals: SpatialFunctionals,
    /// Chords along all axes that end inside the volume; `None` if there are none.
    pub chords: Option<Chords>,
}

/// Geometry of the bright phase (grey levels above `threshold`) and of the dark one in slices (row, column, channel).
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use stereology::pipeline::planar_phases;
///
/// let stripes = Array3::from_shape_fn((40, 40, 1), |(y, _, _)| if y / 4 % 2 == 0 { 0.9_f32 } else { 0.1 });
/// let [bright, dark] = planar_phases(&[stripes.view()], 0.5);
/// assert_eq!((bright.functionals.fraction, dark.chords.unwrap().mean), (0.5, 4.0));
/// ```
#[must_use]
pub fn planar_phases(slices: &[ArrayView3<'_, f32>], threshold: f32) -> [PlanarPhase; 2] {
    let phases: Vec<Array2<bool>> = slices
        .par_iter()
        .map(|slice| grey(*slice).mapv(|v| v > threshold))
        .collect();
    [true, false].map(|bright| {
        let each: Vec<(f64, PlanarFunctionals, Vec<usize>)> = phases
            .par_iter()
            .map(|phase| {
                let own = phase.mapv(|above| above == bright);
                let chords = [Axis(0), Axis(1)].map(|axis| chord_lengths(own.view(), axis));
                (own.len() as f64, planar_functionals(own.view()), chords.concat())
            })
            .collect();
        let area = each.iter().map(|(area, _, _)| area).sum::<f64>().max(1.0);
        let mean = |of: &dyn Fn(&PlanarFunctionals) -> f64| each.iter().map(|(a, f, _)| a * of(f)).sum::<f64>() / area;
        let chords: Vec<usize> = each.iter().flat_map(|(_, _, chords)| chords.iter().copied()).collect();
        PlanarPhase {
            functionals: PlanarFunctionals {
                fraction: mean(&|f| f.fraction),
                boundary_length: mean(&|f| f.boundary_length),
                euler_8: mean(&|f| f.euler_8),
                euler_4: mean(&|f| f.euler_4),
            },
            chords: Chords::of(&chords),
        }
    })
}

/// Geometry of the bright phase and of the dark one in a volume (z, y, x, channel).
///
/// # Examples
///
/// ```
/// use ndarray::Array4;
/// use stereology::pipeline::spatial_phases;
///
/// let layers = Array4::from_shape_fn((24, 24, 24, 1), |(z, _, _, _)| if z / 4 % 2 == 0 { 0.9_f32 } else { 0.1 });
/// let [bright, dark] = spatial_phases(layers.view(), 0.5);
/// assert_eq!(bright.functionals.fraction, 0.5);
/// assert_eq!(bright.functionals.specific_surface, dark.functionals.specific_surface);
/// ```
#[must_use]
pub fn spatial_phases(volume: ArrayView4<'_, f32>, threshold: f32) -> [SpatialPhase; 2] {
    let (nz, ny, nx, _) = volume.dim();
    let mut above = Array3::from_elem((nz, ny, nx), false);
    above
        .outer_iter_mut()
        .into_par_iter()
        .zip(volume.outer_iter().into_par_iter())
        .for_each(|(mut above, slice)| above.assign(&grey(slice).mapv(|v| v > threshold)));
    [true, false].map(|bright| {
        let phase = above.mapv(|above| above == bright);
        // Rows and columns of constant z, and lines along z.
        let mut chords: Vec<usize> = phase
            .outer_iter()
            .flat_map(|plane| [Axis(0), Axis(1)].map(|axis| chord_lengths(plane, axis)).concat())
            .collect();
        chords.extend(phase.axis_iter(Axis(1)).flat_map(|plane| chord_lengths(plane, Axis(0))));
        SpatialPhase {
            functionals: spatial_functionals(phase.view()),
            chords: Chords::of(&chords),
        }
    })
}
