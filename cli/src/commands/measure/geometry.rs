//! Geometry of the phases in JSON and in lines.

use ndarray::{Array4, ArrayView3};
use schemars::JsonSchema;
use serde::Serialize;
use stereology::metrics::Chords;
use stereology::pipeline::{PlanarPhase, SpatialPhase, planar_phases, spatial_phases};
use stereology_report::{PhaseRow, significant};

/// Geometry of both phases.
#[derive(Debug, Serialize, JsonSchema)]
pub struct PhasesFields {
    /// Grey levels above the threshold.
    bright: PhaseFields,
    /// Grey levels up to the threshold.
    dark: PhaseFields,
}

/// Geometry of a phase.
#[derive(Debug, Serialize, JsonSchema)]
pub struct PhaseFields {
    /// On the exemplar's image or slices.
    exemplar: PlanarFields,
    /// On the measured slices of the volume.
    slices: PlanarFields,
    /// In the exemplar's volume; null if it is an image.
    exemplar_volume: Option<SpatialFields>,
    /// In the volume; null if it is an image or has a mask.
    volume: Option<SpatialFields>,
}

/// Geometry of a phase on slices.
#[derive(Debug, Serialize, JsonSchema)]
pub struct PlanarFields {
    /// Fraction of the area.
    fraction: f64,
    /// Length of the boundary per area, by Crofton's formula with four directions; 1 / pixel.
    boundary_length: f64,
    /// Surface per volume of an isotropic solid with this boundary, 4/π times its length per area; 1 / pixel.
    specific_surface: f64,
    /// Components minus holes per area, pixels that share a corner are connected; 1 / pixel².
    euler_8: f64,
    /// Components minus holes per area, pixels that share a side are connected; 1 / pixel².
    euler_4: f64,
    /// Mean chord length of random lines, π times fraction over boundary length, in pixels; null without a boundary.
    mean_intercept: Option<f64>,
    /// Number of chords along rows and columns that end inside.
    chords: usize,
    /// Their mean length in pixels; null if there are none.
    mean_chord: Option<f64>,
    /// Standard deviation of their lengths over the mean; null if there are none.
    chord_variation: Option<f64>,
}

/// Geometry of a phase in a volume.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SpatialFields {
    /// Fraction of the volume.
    fraction: f64,
    /// Surface per volume, by Crofton's formula with 13 directions; 1 / voxel.
    specific_surface: f64,
    /// Integral of the mean curvature over the surface per volume, from planes normal to the axes; 1 / voxel².
    mean_curvature: f64,
    /// Components minus tunnels plus cavities per volume, voxels that share a corner are connected; 1 / voxel³.
    euler_26: f64,
    /// Components minus tunnels plus cavities per volume, voxels that share a face are connected; 1 / voxel³.
    euler_6: f64,
    /// Mean chord length of random lines, 4 times fraction over specific surface, in voxels; null without a surface.
    mean_intercept: Option<f64>,
    /// Number of chords along the axes that end inside.
    chords: usize,
    /// Their mean length in voxels; null if there are none.
    mean_chord: Option<f64>,
    /// Standard deviation of their lengths over the mean; null if there are none.
    chord_variation: Option<f64>,
}

impl PlanarFields {
    fn of(phase: &PlanarPhase) -> Self {
        let (of, chords) = (&phase.functionals, phase.chords);
        Self {
            fraction: of.fraction,
            boundary_length: of.boundary_length,
            specific_surface: of.specific_surface(),
            euler_8: of.euler_8,
            euler_4: of.euler_4,
            mean_intercept: Some(of.mean_intercept()).filter(|length| length.is_finite()),
            chords: chords.map_or(0, |chords| chords.count),
            mean_chord: chords.map(|chords| chords.mean),
            chord_variation: chords.map(|chords| chords.variation),
        }
    }
}

impl SpatialFields {
    fn of(phase: &SpatialPhase) -> Self {
        let (of, chords): (_, Option<Chords>) = (&phase.functionals, phase.chords);
        Self {
            fraction: of.fraction,
            specific_surface: of.specific_surface,
            mean_curvature: of.mean_curvature,
            euler_26: of.euler_26,
            euler_6: of.euler_6,
            mean_intercept: Some(of.mean_intercept()).filter(|length| length.is_finite()),
            chords: chords.map_or(0, |chords| chords.count),
            mean_chord: chords.map(|chords| chords.mean),
            chord_variation: chords.map(|chords| chords.variation),
        }
    }
}

impl PhasesFields {
    /// Of the slices of exemplar and volume, and of both as volumes; of the volume only if it is `whole`.
    pub fn of(
        [exemplar, slices]: [&[ArrayView3<'_, f32>]; 2],
        [exemplar_volume, volume]: [&Array4<f32>; 2],
        whole: bool,
        threshold: f32,
    ) -> Self {
        let [exemplar, slices] = [exemplar, slices].map(|images| planar_phases(images, threshold));
        let [exemplar_volume, volume] = [(exemplar_volume, true), (volume, whole)]
            .map(|(of, whole)| (whole && of.dim().0 > 1).then(|| spatial_phases(of.view(), threshold)));
        let [bright, dark] = [0, 1].map(|k| PhaseFields {
            exemplar: PlanarFields::of(&exemplar[k]),
            slices: PlanarFields::of(&slices[k]),
            exemplar_volume: exemplar_volume.as_ref().map(|of| SpatialFields::of(&of[k])),
            volume: volume.as_ref().map(|of| SpatialFields::of(&of[k])),
        });
        Self { bright, dark }
    }

    /// The geometry by row: quantity of a phase, then exemplar, slices, exemplar's volume, volume.
    pub fn rows(&self) -> Vec<PhaseRow> {
        let both = [("bright", &self.bright), ("dark", &self.dark)];
        both.into_iter().flat_map(|(name, phase)| phase.rows(name)).collect()
    }

    /// The geometry in lines.
    pub fn lines(&self) -> Vec<String> {
        let shown = |value: &Option<f64>| value.map_or_else(|| "-".to_owned(), significant);
        let rows = self.rows();
        let head = format!("{:<34} {:>10} {:>10} {:>10}", "", "exemplar", "slices", "volume");
        let line = |row: &PhaseRow| {
            format!(
                "{:<34} {:>10} {:>10} {:>10}",
                format!("{} phase: {}", row.phase, row.quantity),
                shown(&row.values[0]),
                shown(&row.values[1]),
                shown(&row.values[3])
            )
        };
        std::iter::once(head).chain(rows.iter().map(line)).collect()
    }
}

impl PhaseFields {
    fn rows(&self, phase: &'static str) -> Vec<PhaseRow> {
        type Planar = fn(&PlanarFields) -> Option<f64>;
        type Spatial = fn(&SpatialFields) -> Option<f64>;
        let row = |quantity: &'static str, planar: Planar, spatial: Spatial| PhaseRow {
            phase,
            quantity,
            values: [
                planar(&self.exemplar),
                planar(&self.slices),
                self.exemplar_volume.as_ref().and_then(spatial),
                self.volume.as_ref().and_then(spatial),
            ],
        };
        vec![
            row("fraction", |of| Some(of.fraction), |of| Some(of.fraction)),
            row(
                "specific surface",
                |of| Some(of.specific_surface),
                |of| Some(of.specific_surface),
            ),
            row(
                "Euler number per 10,000",
                |of| Some(5e3 * (of.euler_8 + of.euler_4)),
                |of| Some(5e3 * (of.euler_26 + of.euler_6)),
            ),
            row("mean chord", |of| of.mean_chord, |of| of.mean_chord),
            row("chord variation", |of| of.chord_variation, |of| of.chord_variation),
        ]
    }
}
