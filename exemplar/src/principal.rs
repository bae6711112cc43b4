//! Principal components of the windows of the exemplars.

use nalgebra::{DMatrix, SymmetricEigen};
use rayon::prelude::*;

use crate::level::Level;
use crate::numbers::single;
use crate::window::Window;

/// Number of windows from which the components are computed.
const SAMPLE: usize = 4096;

/// Windows of one exemplar, projected on the principal components that contain most of their variance.
pub(crate) struct Projected {
    /// Number of components.
    pub(crate) dimensions: usize,
    /// Projected windows, one after the other, in the order of the level's list of windows.
    pub(crate) points: Vec<f32>,
}

impl Projected {
    /// Projects the windows of exemplar `sheet` on the components that contain the fraction `kept` of the variance, at
    /// most `most`.
    pub(crate) fn new(level: &Level, sheet: usize, window: &Window, kept: f64, most: usize) -> Self {
        let places = &level.windows[sheet];
        let counted: Vec<usize> = (0..window.len())
            .filter(|i| window.weights[i % window.weights.len()] > 0.0)
            .collect();
        let n = counted.len();
        let step = places.len().div_ceil(SAMPLE).max(1);
        let mut buffer = vec![0.0; window.len()];
        let mut sample = DMatrix::<f64>::zeros(places.len().div_ceil(step), n);
        for (i, &place) in places.iter().step_by(step).enumerate() {
            window.copy(level, place as usize, &mut buffer);
            for (j, &at) in counted.iter().enumerate() {
                sample[(i, j)] = f64::from(buffer[at]);
            }
        }
        let mean = sample.row_mean();
        for mut row in sample.row_iter_mut() {
            row -= &mean;
        }
        let eigen = SymmetricEigen::new(sample.tr_mul(&sample));
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let all: f64 = eigen.eigenvalues.iter().map(|v| v.max(0.0)).sum();
        let mut held = 0.0;
        let dimensions = order
            .iter()
            .take(most)
            .take_while(|&&i| {
                let more = held < kept * all;
                held += eigen.eigenvalues[i].max(0.0);
                more
            })
            .count()
            .max(1);
        let components: Vec<Vec<f32>> = order[..dimensions]
            .iter()
            .map(|&i| {
                let mut padded = vec![0.0; window.len()];
                for (j, &at) in counted.iter().enumerate() {
                    padded[at] = single(eigen.eigenvectors[(j, i)]);
                }
                padded
            })
            .collect();
        let points = places
            .par_chunks(256)
            .flat_map_iter(|places| {
                let mut buffer = vec![0.0_f32; window.len()];
                let mut points = Vec::with_capacity(places.len() * dimensions);
                for &place in places {
                    window.copy(level, place as usize, &mut buffer);
                    points.extend(
                        components
                            .iter()
                            .map(|component| component.iter().zip(&buffer).map(|(a, b)| a * b).sum::<f32>()),
                    );
                }
                points
            })
            .collect();
        Self { dimensions, points }
    }

    /// Number of windows.
    pub(crate) fn len(&self) -> usize {
        self.points.len() / self.dimensions
    }

    /// Components of one window.
    #[inline]
    pub(crate) fn point(&self, i: usize) -> &[f32] {
        &self.points[i * self.dimensions..(i + 1) * self.dimensions]
    }

    /// Squared distance of two windows.
    #[inline]
    pub(crate) fn squared(&self, a: &[f32], i: usize) -> f32 {
        a.iter().zip(self.point(i)).map(|(x, y)| (x - y) * (x - y)).sum()
    }
}
