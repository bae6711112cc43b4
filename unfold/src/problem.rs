//! The part of counts and kernel above the threshold, on the bins of the kernel and on those that are reported.

use crate::grid::{Grid, grids};
use crate::kernel::Kernel;
use crate::options::{Bootstrap, UnfoldOptions};
use crate::point_kernel::PointKernel;
use crate::population::Population;
use crate::profile_counts::ProfileCounts;
use crate::unfold_error::UnfoldError;
use nalgebra::{DMatrix, DVector};

/// Counts that are Poisson's, and what particles of each bin show of them.
pub(crate) struct Problem {
    /// Expected counts of one particle per unit volume in each kept bin of the kernel: kernel × area / dispersion.
    pub(crate) fine: DMatrix<f64>,
    /// The same by reported bin, with particles spread over its kept bins as the kernel has it.
    pub(crate) coarse: DMatrix<f64>,
    /// Internal grids of the smooth estimate, made from the kept bins.
    pub(crate) grids: Vec<Grid>,
    /// Expected counts of particles of single sizes, if the kernel knows them.
    pub(crate) points: Option<PointKernel>,
    /// Middle size of each kept bin.
    pub(crate) middles: Vec<f64>,
    /// Counts above the threshold over their dispersion.
    pub(crate) counts: Vec<f64>,
    /// Index of each kept bin among the kernel's.
    pub(crate) columns: Vec<usize>,
    /// Reported bin of each column of `coarse`.
    pub(crate) reported: Vec<usize>,
    /// Column of `coarse` that each kept bin belongs to, and its fraction of that column's width.
    pub(crate) parts: Vec<(usize, f64)>,
    pub(crate) first_row: usize,
    pub(crate) threshold: f64,
}

impl Problem {
    pub(crate) fn new(counts: &ProfileCounts, kernel: &Kernel, options: &UnfoldOptions) -> Result<Self, UnfoldError> {
        let matrix = kernel.matrix();
        if counts.counts().len() != matrix.nrows() {
            return Err(UnfoldError::Rows {
                counts: counts.counts().len(),
                rows: matrix.nrows(),
            });
        }
        check(options)?;
        let requested = options.min_size.unwrap_or(0.0);
        if !(requested.is_finite() && requested >= 0.0) {
            return Err(UnfoldError::Threshold(requested));
        }
        let edges = counts.edges();
        // A threshold that is an edge but for rounding is that edge.
        let first_row = edges.partition_point(|&edge| edge < requested * (1.0 - 1e-12));
        let kept = counts.counts().get(first_row..).unwrap_or(&[]);
        if kept.iter().sum::<f64>() <= 0.0 {
            return Err(UnfoldError::Threshold(requested));
        }
        let rows = matrix.rows(first_row, kept.len());
        let columns: Vec<usize> = (0..matrix.ncols()).filter(|&j| rows.column(j).sum() > 0.0).collect();
        if let Some(bin) = (0..kept.len()).find(|&i| kept[i] > 0.0 && rows.row(i).sum() <= 0.0) {
            return Err(UnfoldError::Unexplained { bin: bin + first_row });
        }
        let scale = counts.area() / counts.dispersion();
        let fine = rows.select_columns(&columns) * scale;
        let sizes = kernel.sizes();
        let last = sizes.reported_edges()[sizes.reported_edges().len() - 1];
        // Sizes above the last reported edge are no part of a bin with sizes spread evenly over it.
        let width = |j: usize| (sizes.edges()[j + 1].min(last) - sizes.edges()[j]).max(0.0);
        let mean_width = columns.iter().map(|&j| width(j)).sum::<f64>() / columns.len() as f64;
        let widths: Vec<f64> = columns.iter().map(|&j| width(j) / mean_width).collect();
        let groups = sizes.groups();
        let mut reported: Vec<usize> = columns.iter().map(|&j| groups[j]).collect();
        reported.dedup();
        let place = |j: usize| reported.iter().position(|&group| group == groups[j]).unwrap_or(0);
        let mut group_widths = vec![0.0; reported.len()];
        for (&j, width) in columns.iter().zip(&widths) {
            group_widths[place(j)] += width;
        }
        let parts: Vec<(usize, f64)> = columns
            .iter()
            .zip(&widths)
            .map(|(&j, width)| (place(j), width / group_widths[place(j)]))
            .collect();
        let mut coarse = DMatrix::zeros(kept.len(), reported.len());
        for (k, &(group, share)) in parts.iter().enumerate() {
            let mut column = coarse.column_mut(group);
            column += fine.column(k) * share;
        }
        let kept_edges: Vec<(f64, f64)> = columns
            .iter()
            .map(|&j| (sizes.edges()[j], sizes.edges()[j + 1]))
            .collect();
        Ok(Self {
            grids: grids(&fine, &kept_edges, sizes.is_spread(), last),
            points: PointKernel::new(kernel, counts, first_row),
            middles: kept_edges.iter().map(|bin| 0.5 * (bin.0 + bin.1)).collect(),
            fine,
            coarse,
            counts: kept.iter().map(|count| count / counts.dispersion()).collect(),
            columns,
            reported,
            parts,
            first_row,
            threshold: edges[first_row],
        })
    }

    /// Densities of the kept bins from those of the reported ones.
    pub(crate) fn spread(&self, coarse: &[f64]) -> Vec<f64> {
        self.parts.iter().map(|&(group, share)| coarse[group] * share).collect()
    }

    /// Expected counts.
    pub(crate) fn refold(&self, population: &Population) -> Vec<f64> {
        let mut expected = &self.fine * DVector::from_column_slice(&population.spread);
        if let Some(points) = &self.points {
            for spike in &population.spikes {
                let column = DVector::from_vec(points.column(spike.size));
                expected.axpy(spike.density, &column, 1.0);
            }
        }
        expected.iter().copied().collect()
    }

    /// The population on all bins of the kernel; zero where there is none.
    pub(crate) fn widen(&self, population: &Population, bins: usize) -> Population {
        let mut spread = vec![0.0; bins];
        for (&j, &density) in self.columns.iter().zip(&population.spread) {
            spread[j] = density;
        }
        Population {
            spread,
            spikes: population.spikes.clone(),
        }
    }
}

fn check(options: &UnfoldOptions) -> Result<(), UnfoldError> {
    if let Some(bootstrap @ Bootstrap { replicates, level, .. }) = options.bootstrap
        && (bootstrap.replicates < 2 || !(level > 0.0 && level < 1.0))
    {
        return Err(UnfoldError::Bootstrap { replicates, level });
    }
    if options.tolerance.is_nan() || options.tolerance <= 0.0 {
        return Err(UnfoldError::Tolerance(options.tolerance));
    }
    if !(0.0..=0.25).contains(&options.smoothing) {
        return Err(UnfoldError::Smoothing(options.smoothing));
    }
    Ok(())
}
