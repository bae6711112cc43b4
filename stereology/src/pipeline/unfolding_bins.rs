//! The bins of a fit: fine profile bins and fine size bins, with edges at the reported bins and at the threshold.

use crate::pipeline::ParticleTypes;
use stereology_kmatrix::Sizes;
use stereology_unfold::{
    Method, divided_edges, fitting_edges, fitting_profile_edges, measured_edges, true_profile_edges,
};

/// The bins of a fit: profile bins fine enough to lose little information, size bins fine enough for a smooth density,
/// both with an edge at the threshold. The paper's inverse needs a square kernel, so its bins are the reported ones; so
/// are the size bins where all sizes are at the upper edges.
#[derive(Clone, Debug, PartialEq)]
pub struct UnfoldingBins {
    /// Edges of the profile bins.
    pub profile_edges: Vec<f64>,
    /// Edges of the size bins of the kernel; those of the reported bins are among them.
    pub size_edges: Vec<f64>,
    /// Errors of the measured sizes, if there are any.
    pub error: Option<SizeError>,
}

/// Errors of measured sizes.
#[derive(Clone, Debug, PartialEq)]
pub struct SizeError {
    /// Relative standard deviation.
    pub relative: f64,
    /// Edges of bins of true profile sizes.
    pub true_edges: Vec<f64>,
    /// Particles up to this size are not estimated.
    pub threshold: f64,
}

/// With a hundred profile bins or more the loss of information does not show in the densities.
const PROFILE_BINS: usize = 100;

/// Number of profile bins: as many, rounded up so that an even number of them makes a reported bin. Histograms show
/// halves of the reported bins.
fn profile_bins(edges: &[f64]) -> usize {
    let halves = 2 * edges.len().saturating_sub(1).max(1);
    PROFILE_BINS.div_ceil(halves) * halves
}

/// With forty size bins or more the steps of a smooth estimate are not visible.
const SIZE_BINS: usize = 40;

impl UnfoldingBins {
    /// Bins for densities in the bins between `edges`, from a threshold (0: none) on.
    ///
    /// ```
    /// use stereology::{kmatrix::Sizes, pipeline::UnfoldingBins, unfold::Method};
    /// let bins = UnfoldingBins::new(&[0.0, 0.5, 1.0], 0.0, Method::Auto, Sizes::Integrated);
    /// assert_eq!((bins.profile_edges.len(), bins.size_edges.len()), (101, 41));
    /// ```
    #[must_use]
    pub fn new(edges: &[f64], threshold: f64, method: Method, sizes: Sizes) -> Self {
        if method == Method::Paper {
            return Self {
                profile_edges: edges.to_vec(),
                size_edges: edges.to_vec(),
                error: None,
            };
        }
        Self {
            profile_edges: divided_edges(edges, profile_bins(edges), threshold),
            size_edges: match sizes {
                Sizes::Integrated => divided_edges(edges, SIZE_BINS, threshold),
                Sizes::UpperEdge => edges.to_vec(),
            },
            error: None,
        }
    }

    /// [`new`](Self::new) with bins from which grids of linear, root and logarithmic spacing can be made, the last from
    /// `smallest`, the size of the smallest profile, to `top`: the largest size that particles may have, if that is
    /// larger than the last edge.
    ///
    /// ```
    /// use stereology::{kmatrix::Sizes, pipeline::UnfoldingBins, unfold::Method};
    /// let bins = UnfoldingBins::for_profiles(&[0.0, 0.5, 1.0], 0.01, 0.0, 1.5, Method::Auto, Sizes::Integrated);
    /// assert!(bins.profile_edges.len() > 101 && bins.size_edges.len() > 80);
    /// assert_eq!(bins.size_edges.last(), Some(&1.5));
    /// ```
    #[must_use]
    pub fn for_profiles(edges: &[f64], smallest: f64, threshold: f64, top: f64, method: Method, sizes: Sizes) -> Self {
        let fits_grids = matches!(method, Method::Auto | Method::Penalised | Method::Sparse | Method::Em);
        if !fits_grids || sizes == Sizes::UpperEdge {
            return Self::new(edges, threshold, method, sizes);
        }
        Self {
            profile_edges: fitting_profile_edges(edges, profile_bins(edges), smallest, threshold, top),
            size_edges: fitting_edges(edges, smallest, threshold, top),
            error: None,
        }
    }

    /// These bins for sizes that were measured with an error of this relative standard deviation, the smallest with
    /// size `smallest`; 0: none.
    ///
    /// ```
    /// use stereology::{kmatrix::Sizes, pipeline::UnfoldingBins, unfold::Method};
    /// let bins = UnfoldingBins::new(&[0.0, 0.5, 1.0], 0.0, Method::Auto, Sizes::Integrated).with_size_error(0.1, 0.01, 0.0);
    /// assert!(bins.profile_edges.last() > Some(&1.4));
    /// ```
    #[must_use]
    pub fn with_size_error(mut self, relative: f64, smallest: f64, threshold: f64) -> Self {
        if relative > 0.0 {
            let largest = self.size_edges.last().copied().unwrap_or(0.0);
            // A profile may be smaller than the smallest that was measured.
            let from = (0.5 * smallest).clamp(largest * SMALLEST, 0.5 * largest);
            self.profile_edges = measured_edges(&self.profile_edges, relative);
            self.error = Some(SizeError {
                relative,
                true_edges: true_profile_edges(from, largest, relative),
                threshold,
            });
        }
        self
    }
}

/// True profile sizes are divided down to this fraction of the largest size.
const SMALLEST: f64 = 1e-4;

/// The highest profile bin is widened until it holds this fraction of the profiles of the largest particles. Planes
/// rarely give the largest section of a body (of a mesh, possibly none of the planes tried), so a profile there could
/// not be explained, or would count for far too many particles.
const TOP_SHARE: f64 = 0.01;

impl ParticleTypes {
    /// [`UnfoldingBins::for_profiles`] with the highest profile bin up to the last edge wide enough that every type has
    /// profiles in it.
    ///
    /// ```
    /// use stereology::{kmatrix::Sizes, pipeline::ParticleTypes, unfold::Method};
    /// let edges = [0.0, 0.5, 1.0];
    /// let top = |shape: &str| {
    ///     let bins = ParticleTypes::parse(&[shape])?.unfolding_bins(&edges, 0.1, 0.0, 1.0, Method::Auto, Sizes::Integrated);
    ///     Ok::<_, stereology::pipeline::ParticleTypesError>(bins.profile_edges[bins.profile_edges.len() - 2])
    /// };
    /// assert_eq!(top("sphere")?, 0.99);
    /// assert!(top("box:1,1,2")? < 0.99); // rarely cut through two opposite edges
    /// # Ok::<(), stereology::pipeline::ParticleTypesError>(())
    /// ```
    #[must_use]
    pub fn unfolding_bins(
        &self,
        edges: &[f64],
        smallest: f64,
        threshold: f64,
        top: f64,
        method: Method,
        sizes: Sizes,
    ) -> UnfoldingBins {
        let mut bins = UnfoldingBins::for_profiles(edges, smallest, threshold, top, method, sizes);
        let (Some(&largest), false) = (edges.last(), method == Method::Paper) else {
            return bins;
        };
        let shown = |edge: f64| {
            let shares = self.types().iter().map(|of| 1.0 - of.law().cdf(edge / largest));
            shares.fold(1.0, f64::min) >= TOP_SHARE
        };
        let inner = bins
            .profile_edges
            .partition_point(|&edge| edge < largest * (1.0 - 1e-12));
        let kept = (1..inner).rev().find(|&k| shown(bins.profile_edges[k])).unwrap_or(0);
        bins.profile_edges.drain(kept + 1..inner);
        bins
    }
}
