//! Profiles of particles of one exact size, for estimates whose sizes are points and not bins.

use crate::kernel::Kernel;
use crate::profile_counts::ProfileCounts;
use crate::profile_law::ProfileLaw;

/// Expected counts of particles of any single size.
#[derive(Clone, Debug)]
pub(crate) struct PointKernel {
    law: ProfileLaw,
    /// Edges of the profile bins; that above the highest profiles is the size of the largest.
    edges: Vec<f64>,
    /// Size of the largest profile, if it is known.
    largest_profile: f64,
    /// Counts per profile per area.
    scale: f64,
    /// The largest size that particles may have.
    largest: f64,
}

impl PointKernel {
    /// On the profile bins from `first_row` on; `None` if the kernel does not know its law, or has sizes at edges only.
    pub(crate) fn new(kernel: &Kernel, counts: &ProfileCounts, first_row: usize) -> Option<Self> {
        let law = kernel.law().filter(|_| kernel.sizes().is_spread())?;
        let mut edges = counts.edges()[first_row..].to_vec();
        let highest = counts.counts()[first_row..].iter().rposition(|&n| n > 0.0)?;
        let known = counts
            .largest()
            .filter(|&size| edges[highest] < size && size <= edges[highest + 1]);
        if let Some(size) = known {
            edges[highest + 1] = size;
        }
        Some(Self {
            law: law.clone(),
            largest_profile: known.unwrap_or(0.0),
            edges,
            scale: counts.area() / counts.dispersion(),
            largest: *kernel.sizes().edges().last()?,
        })
    }

    /// Expected counts by profile bin of one particle of this size per unit volume.
    pub(crate) fn column(&self, size: f64) -> Vec<f64> {
        let mut below = self.law.up_to(self.edges[0], size);
        let bins = self.edges[1..].iter().map(|&edge| {
            let up_to = self.law.up_to(edge, size);
            let here = (up_to - below).max(0.0) * self.scale;
            below = up_to;
            here
        });
        bins.collect()
    }

    /// Expected counts above a profile size.
    pub(crate) fn above(&self, profile: f64, size: f64) -> f64 {
        (self.law.up_to(size, size) - self.law.up_to(profile, size)).max(0.0) * self.scale
    }

    pub(crate) fn edges(&self) -> &[f64] {
        &self.edges
    }

    pub(crate) fn largest_profile(&self) -> f64 {
        self.largest_profile
    }

    /// The largest size that particles may have.
    pub(crate) fn largest(&self) -> f64 {
        self.largest
    }
}
