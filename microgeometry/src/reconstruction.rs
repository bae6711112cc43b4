//! From a contact distribution to a signed distance for every triangle of a mesh.

use std::ops::ControlFlow;
use std::str::FromStr;

use stereology_shape::TriangleMesh;

use crate::budget::{UNIT, area_weights, levels};
use crate::contact::ContactDistribution;
use crate::dual::{Adjacency, DualGraph, Metric};
use crate::error::MicrogeometryError;
use crate::labelling::Labelling;
use crate::measure::{distribution_of, interface_distances, violations};
use crate::paper::Paper;
use crate::patches::Patches;
use crate::relaxation::{Moves, relaxed};
use crate::tight::{GivenInterface, Tight};
use stereology_metrics::Progress;

/// Method of labelling the triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Looks ahead (a seed that would force more triangles into a bin than it has room for is refused) and moves the
    /// interface between the regions until distances to it have the required distribution, so that labels are true
    /// distances. Triangles that share a vertex are neighbours; triangles count by area.
    #[default]
    Tight,
    /// Exactly section 4.4 of the paper: triangles that share an edge are neighbours, every triangle counts one,
    /// leftovers take the average of their neighbours. 5 to 12 % are left over where triangles are as large as bins,
    /// half of them on fine meshes.
    Paper,
}

impl Method {
    /// `tight` or `paper`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Tight => "tight",
            Self::Paper => "paper",
        }
    }
}

impl FromStr for Method {
    type Err = MicrogeometryError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "tight" => Ok(Self::Tight),
            "paper" => Ok(Self::Paper),
            _ => Err(MicrogeometryError::Parameter(format!(
                "{text:?} is not a method: tight or paper"
            ))),
        }
    }
}

/// Weight of a triangle in the histogram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weighting {
    /// Its area: the distribution is that of a random point of the surface, however uneven the mesh.
    Area,
    /// One, as in the paper: the distribution is that of a random triangle.
    Count,
}

/// Options of a reconstruction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReconstructOptions {
    /// Method of labelling.
    pub method: Method,
    /// Which triangles are neighbours; `None`: the method's default.
    pub adjacency: Option<Adjacency>,
    /// Weights of triangles; `None`: the method's default.
    pub weighting: Option<Weighting>,
    /// How steps are measured.
    pub metric: Metric,
    /// Seed of the random choices.
    pub seed: u64,
}

impl ReconstructOptions {
    /// With this method.
    #[must_use]
    pub const fn with_method(self, method: Method) -> Self {
        Self { method, ..self }
    }

    /// With this seed.
    #[must_use]
    pub const fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// With this metric.
    #[must_use]
    pub const fn with_metric(self, metric: Metric) -> Self {
        Self { metric, ..self }
    }

    /// With these weights of triangles.
    #[must_use]
    pub const fn with_weighting(self, weighting: Weighting) -> Self {
        Self {
            weighting: Some(weighting),
            ..self
        }
    }

    /// With these neighbours.
    #[must_use]
    pub const fn with_adjacency(self, adjacency: Adjacency) -> Self {
        Self {
            adjacency: Some(adjacency),
            ..self
        }
    }
}

/// Labels, and their accuracy.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Reconstruction {
    /// Signed distance of each triangle to the interface, distribution units.
    pub labels: Vec<f64>,
    /// Fraction of the triangles for which the histogram had no label left: their labels are between their bounds.
    pub left_over: f64,
    /// Fraction of all labels in another bin than the histogram requires: leftovers, and labels for which there was no
    /// triangle in their bin and which moved towards the interface. If it is far above zero, the mesh cannot have the
    /// distribution ([`Reconstruction::shortfalls`]).
    pub misplaced: f64,
    /// Edges of the dual on which labels differ by more than their length; always 0 for a reconstruction.
    pub violations: usize,
    /// Earth mover's distance of the labels to the distribution, bins.
    pub emd_labels: f64,
    /// Earth mover's distance of the distances to the interface, measured again from the labels' signs. `None` if one
    /// region is missing.
    pub emd_measured: Option<f64>,
    /// Bins with less than their required fraction, farthest from the interface first.
    pub shortfalls: Vec<Shortfall>,
    /// Number of connected components of the mesh, each of which got its fraction of the distribution.
    pub components: usize,
}

/// A bin that could not be filled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shortfall {
    /// 0, 1, ... in the positive region, −1, −2, ... in the negative one.
    pub bin: i64,
    /// Required fraction of the surface.
    pub wanted: f64,
    /// Fraction reached.
    pub got: f64,
}

/// Shortfalls smaller than this fraction of the surface are not reported.
const REPORTED: f64 = 1e-4;

/// Labels the triangles of a mesh with signed distances whose distribution is `of`, so that no two labels differ by
/// more than the distance between the triangles (section 4.4 of the paper).
///
/// The mesh is in distribution units: see [`to_distribution_units`]. It may be open, have edges with more than two
/// triangles and several components (each gets its fraction of the distribution). Vertices at equal positions should
/// have been welded. Cost: about n log n.
///
/// # Errors
///
/// [`MicrogeometryError`] if the mesh has fewer than two triangles or none with area, is invalid, the metric is not
/// positive definite, or `progress` cancelled.
///
/// # Examples
///
/// ```
/// use std::ops::ControlFlow;
/// use stereology_microgeometry::{ContactDistribution, ReconstructOptions, reconstruct, to_distribution_units};
/// use stereology_shape::TriangleMesh;
///
/// let ball = to_distribution_units(&TriangleMesh::icosphere(2.0, 4), 20.0)?;
/// let of = ContactDistribution::new(1.0, vec![0.2, 0.15, 0.1, 0.05], vec![0.2, 0.15, 0.1, 0.05])?;
/// let made = reconstruct(&ball, &of, &ReconstructOptions::default(), &|_| ControlFlow::Continue(()))?;
/// assert_eq!((made.labels.len(), made.violations), (5120, 0));
/// assert!(made.left_over < 0.005 && made.emd_labels < 0.1);
/// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
/// ```
pub fn reconstruct(
    mesh: &TriangleMesh,
    of: &ContactDistribution,
    options: &ReconstructOptions,
    progress: Progress<'_>,
) -> Result<Reconstruction, MicrogeometryError> {
    let paper = options.method == Method::Paper;
    let adjacency = options
        .adjacency
        .unwrap_or(if paper { Adjacency::Edges } else { Adjacency::Vertices });
    let weighting = options
        .weighting
        .unwrap_or(if paper { Weighting::Count } else { Weighting::Area });
    let graph = DualGraph::new(mesh, adjacency, options.metric)?;
    let weights = match weighting {
        Weighting::Area => area_weights(graph.areas()),
        Weighting::Count => vec![1; graph.len()],
    };
    let total = weights.iter().sum();
    let (seed, bin) = (options.seed, of.bin_width());
    let made = if paper {
        let room = levels(of, 1, total);
        Paper {
            graph: &graph,
            weights: &weights,
            unit: if weighting == Weighting::Area { UNIT } else { 1 },
            bin,
            seed,
            progress,
        }
        .run(room)?
    } else {
        tight(&graph, of, &weights, weighting, seed, progress)?
    };
    describe(&graph, of, &weights, made)
}

/// Triangles smaller than this fraction of a square bin, on average, are first combined into patches.
const FINE: f64 = 0.7;
/// Least distance between the centres of patches, bins.
const PATCH: f64 = 0.8;
/// Below this fraction of a square bin, labels need not be longer than the distance to the interface.
const EXACT: f64 = 0.25;
/// Iterations of moving the interface: when it is found, and again on the triangles after patches.
const SWEEPS: [usize; 2] = [12, 2];
/// Random variation of the motions when the interface is found. For random fields on triangles as large as bins the
/// error of measured distances is .3 bins without it and .2 with it; from .5 to 1 there is no difference.
const NOISE: f64 = 0.75;

/// Labels from the farthest inwards, on patches of the mesh if it is fine; then the interface between the regions is
/// moved until distances to it fit; then labels for that interface.
fn tight(
    graph: &DualGraph,
    of: &ContactDistribution,
    weights: &[i64],
    weighting: Weighting,
    seed: u64,
    progress: Progress<'_>,
) -> Result<Labelling, MicrogeometryError> {
    let bin = of.bin_width();
    let total = weights.iter().sum();
    let label = |graph: &DualGraph, weights: &[i64], interface: Option<GivenInterface<'_>>, [from, to]: [f64; 2]| {
        Tight {
            graph,
            weights,
            height: bin / PARTS as f64,
            bin,
            tolerance: if weighting == Weighting::Area { UNIT / 8 } else { 0 },
            seed,
            interface,
            progress: &|done| progress(from + (to - from) * done),
        }
        .run(levels(of, PARTS, total))
    };
    let moves = |phase: usize| Moves {
        sweeps: SWEEPS[phase],
        noise: if phase == 0 { NOISE } else { 0.0 },
        seed,
    };
    let area = graph.areas().iter().sum::<f64>() / (graph.len() as f64 * bin * bin);
    let distance = if area < FINE {
        let patches = Patches::new(graph, PATCH * bin);
        let weights_of_patches = patches.weights(weights);
        let first = label(&patches.graph, &weights_of_patches, None, [0.0, 0.2])?;
        let moved = relaxed(&patches.graph, &weights_of_patches, of, &first.labels, moves(0));
        let carried = patches.carried(graph, &moved);
        progress_to(progress, 0.3)?;
        relaxed(graph, weights, of, &carried, moves(1))
    } else {
        let first = label(graph, weights, None, [0.0, 0.4])?;
        relaxed(graph, weights, of, &first.labels, moves(0))
    };
    progress_to(progress, 0.5)?;
    let interface = GivenInterface {
        distance: &distance,
        // Components without interface are labelled freely, which needs the bounds of both regions.
        across: area >= EXACT || distance.iter().any(|x| x.is_infinite()),
    };
    label(graph, weights, Some(interface), [0.5, 1.0])
}

fn progress_to(progress: Progress<'_>, done: f64) -> Result<(), MicrogeometryError> {
    match progress(done) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(MicrogeometryError::Cancelled),
    }
}

/// Levels per bin: labels follow the slope of the distribution within bins. The error of measured distances is .3 bins
/// with 1 level and .25 with 2; 4 are better for coarse random fields (.16) and worse for thin structures (.9 instead
/// of .6).
const PARTS: usize = 2;

fn describe(
    graph: &DualGraph,
    of: &ContactDistribution,
    weights: &[i64],
    made: Labelling,
) -> Result<Reconstruction, MicrogeometryError> {
    let weights: Vec<f64> = weights.iter().map(|&w| w as f64).collect();
    let labels = made.labels;
    let got = distribution_of(&labels, &weights, of.bin_width())?;
    let both = labels.iter().any(|x| x.is_sign_negative()) && labels.iter().any(|x| !x.is_sign_negative());
    let measured = interface_distances(graph, &labels);
    // A component of one region only has no interface.
    let reached = measured.iter().zip(&weights).filter(|(d, _)| d.is_finite());
    let emd_measured = if both {
        let measured = ContactDistribution::from_distances(of.bin_width(), reached.map(|(d, w)| (*d, *w)))?;
        Some(of.earth_movers_distance(&measured))
    } else {
        None
    };
    let mut shortfalls = Vec::new();
    let mut misplaced = 0.0;
    for (sign, wanted, got) in [(-1, of.negative(), got.negative()), (1, of.positive(), got.positive())] {
        for k in (0..wanted.len().max(got.len())).rev() {
            let at = |of: &[f64]| of.get(k).copied().unwrap_or_default();
            let (wanted, got) = (at(wanted), at(got));
            misplaced += (wanted - got).max(0.0);
            if wanted - got > REPORTED {
                let bin = if sign > 0 { k as i64 } else { -(k as i64) - 1 };
                shortfalls.push(Shortfall { bin, wanted, got });
            }
        }
    }
    Ok(Reconstruction {
        violations: violations(graph, &labels),
        emd_labels: of.earth_movers_distance(&got),
        emd_measured,
        left_over: made.left_over,
        misplaced,
        shortfalls,
        components: graph.components().len(),
        labels,
    })
}

/// The mesh scaled so that its longest box side is 2 `units` distribution units ("scale units", table 1 of the paper).
///
/// # Errors
///
/// [`MicrogeometryError::Parameter`] if `units` is not a positive number, [`MicrogeometryError::NoArea`] if all
/// vertices are one point.
///
/// ```
/// # use stereology_microgeometry::to_distribution_units;
/// # use stereology_shape::TriangleMesh;
/// let scaled = to_distribution_units(&TriangleMesh::cuboid([1.0, 2.0, 4.0]), 30.0)?;
/// assert_eq!(scaled.bounding_box().unwrap().1.z, 30.0);
/// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
/// ```
pub fn to_distribution_units(mesh: &TriangleMesh, units: f64) -> Result<TriangleMesh, MicrogeometryError> {
    if !(units.is_finite() && units > 0.0) {
        return Err(MicrogeometryError::Parameter(format!(
            "scale units must be a positive finite number, not {units}: half the longest box side in distribution units"
        )));
    }
    let side = longest_side(mesh)?;
    Ok(mesh.mapped(|p| p * (2.0 * units / side)))
}

/// Longest side of the box around the mesh's triangles.
pub(crate) fn longest_side(mesh: &TriangleMesh) -> Result<f64, MicrogeometryError> {
    if let Some(vertex) = mesh.vertices.iter().position(|p| !p.iter().all(|x| x.abs() < 1e60)) {
        return Err(MicrogeometryError::NotFinite { vertex });
    }
    match mesh.bounding_box() {
        Some((low, high)) if (high - low).max() > 0.0 => Ok((high - low).max()),
        _ => Err(MicrogeometryError::NoArea),
    }
}
