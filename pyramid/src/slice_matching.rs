//! The iterations of a synthesis: repeated matching of the bands of slices, of oblique planes or of the volume.

use nalgebra::{Unit, Vector3};
use rayon::prelude::*;

use crate::bank::FilterBank;
use crate::canvas::{Canvas, band_mean_squares, match_bands};
use crate::cuts::{Cuts, face_diagonals, space_diagonals};
use crate::filters::Directions;
use crate::isotropy::Isotropy;
use crate::oblique::Oblique;
use crate::plan::root_mean_square;
use crate::reweight::Curvature;
use crate::targets::BandTargets;
use crate::{Cut, Mode, TextureError, TextureOptions, TextureReport, Watch};

/// Degree to which the band powers of each slice are brought to the mean over the slices before matching, as an
/// exponent: with 0 some slices of a coarse texture have half the contrast of others, with 1 all have the same.
const EVENNESS: f64 = 0.5;
/// A colour component with a smaller fraction of the variance does not affect the bands of the others when channels are
/// matched.
const NEGLIGIBLE: f64 = 0.02;

/// Input of all iterations.
pub(crate) struct Setup<'a> {
    pub(crate) size: [usize; 3],
    /// Colour components that vary, brightness first: only its bands are also matched on oblique planes.
    pub(crate) varying: &'a [usize],
    /// Fraction of the variance in each.
    pub(crate) variance_fractions: Vec<f64>,
    /// By axis (z, y, x) and varying component.
    pub(crate) targets: [&'a [BandTargets]; 3],
    pub(crate) options: &'a TextureOptions,
    pub(crate) levels: usize,
    pub(crate) watch: Watch<'a>,
}

/// Planes whose bands are matched together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Planes {
    Axes,
    FaceDiagonals,
    SpaceDiagonals,
}

impl Setup<'_> {
    /// Planes of one iteration. Slices come first and last; in between, iterations of slices and of oblique planes
    /// alternate, the last of them with planes normal to the space diagonals.
    fn planes(&self, iteration: usize) -> &'static [Planes] {
        let remaining = self.options.iterations - 1 - iteration;
        if self.options.mode == Mode::Oriented || self.options.cuts == Cut::Axes {
            return &[Planes::Axes];
        }
        match (remaining, iteration) {
            (0, _) => &[Planes::FaceDiagonals, Planes::Axes],
            (_, 0) => &[Planes::Axes],
            (1, _) => &[Planes::FaceDiagonals, Planes::SpaceDiagonals],
            (_, iteration) if iteration.is_multiple_of(2) => &[Planes::Axes],
            _ => &[Planes::FaceDiagonals],
        }
    }

    /// Number of passes over components in all iterations.
    fn passes(&self) -> usize {
        let slices = matches!(self.options.mode, Mode::Slices | Mode::Oriented);
        let of = |planes: &Planes| match planes {
            Planes::Axes => 3 * self.varying.len(),
            Planes::FaceDiagonals => 6,
            Planes::SpaceDiagonals => 4,
        };
        if slices {
            let iterations = 0..self.options.iterations;
            iterations.flat_map(|iteration| self.planes(iteration)).map(of).sum()
        } else {
            self.varying.len() * self.options.iterations
        }
    }
}

/// Reports progress to the caller.
struct Steps<'a> {
    done: usize,
    of: usize,
    watch: Watch<'a>,
}

impl Steps<'_> {
    fn next(&mut self, report: &TextureReport) -> Result<(), TextureError> {
        self.done += 1;
        self.report(report)
    }

    fn report(&self, report: &TextureReport) -> Result<(), TextureError> {
        if (self.watch)(self.done as f64 / self.of as f64, report).is_break() {
            return Err(TextureError::Cancelled);
        }
        Ok(())
    }
}

/// Mean square of one grey level of 8 bits.
const INVISIBLE: f64 = 1.0 / (255.0 * 255.0);

/// Error of the bands of cuts.
struct Convergence {
    cuts: Cuts,
    normals: Vec<Unit<Vector3<f64>>>,
    /// Target mean squares by axis (z, y, x), component and band.
    wanted: [Vec<Vec<f64>>; 3],
    /// Curvature of each component, once computed.
    curvatures: Vec<Option<Curvature>>,
}

impl Convergence {
    fn new(setup: &Setup<'_>) -> Self {
        let orientations = match setup.options.mode {
            Mode::Slices | Mode::Oriented => setup.options.orientations,
            Mode::Spectrum | Mode::Volume => 1,
        };
        let of = |targets: &[BandTargets]| targets.iter().map(|t| t.level_mean_squares(orientations)).collect();
        let mut normals = vec![Vector3::z_axis(), Vector3::y_axis(), Vector3::x_axis()];
        if setup.options.mode != Mode::Oriented {
            // Two of each kind are representative.
            normals.extend(face_diagonals().into_iter().take(2));
            normals.extend(space_diagonals().into_iter().take(2));
        }
        Self {
            cuts: Cuts::new(setup.size, setup.levels),
            normals,
            wanted: setup.targets.map(of),
            curvatures: setup.varying.iter().map(|_| None).collect(),
        }
    }

    /// Root mean square of ln(variance / that of the exemplar) over cuts and bands, in the first component. One grey
    /// level of 8 bits is added to both, so that a band that is not visible, such as the rounding noise of a smooth
    /// exemplar, is no error.
    fn error(&mut self, canvas: &Canvas<'_>, setup: &Setup<'_>) -> f64 {
        let Some(&first) = setup.varying.first() else {
            return 0.0;
        };
        let (mut sum, mut count) = (0.0, 0.0);
        let found = self.cuts.variances(&canvas.components[first], &self.normals);
        for (n, found) in found.iter().enumerate() {
            let wanted = &self.wanted[if n < 3 { n } else { 0 }][0];
            let bands = found[..found.len() - 1].iter().zip(wanted);
            for (f, w) in bands.filter(|(f, w)| **f > 0.0 && **w > 0.0) {
                sum += ((f + INVISIBLE) / (w + INVISIBLE)).ln().powi(2);
                count += 1.0;
            }
        }
        if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
    }

    /// Corrects the band variances of cuts in all directions to those of the first axis, in components with at least
    /// the fraction `least` of the variance.
    fn reweight(&mut self, canvas: &mut Canvas<'_>, setup: &Setup<'_>, least: f64) {
        let wanted = self.wanted[0].iter().zip(&mut self.curvatures);
        for ((&c, &fraction), (wanted, curvature)) in setup.varying.iter().zip(&setup.variance_fractions).zip(wanted) {
            if fraction >= least {
                self.cuts.reweight(&mut canvas.components[c], wanted, curvature);
            }
        }
    }
}

/// Matches the 2D bands of all slices, one axis (z, y, x) after the other, and in [`Mode::Slices`] those of oblique
/// planes, one normal after the other, and finally the band variances of cuts in all directions.
pub(crate) fn match_slices<'a>(
    mut canvas: Canvas<'a>,
    setup: &Setup<'_>,
    report: &mut TextureReport,
) -> Result<Canvas<'a>, TextureError> {
    let [nz, ny, nx] = setup.size;
    let (options, matching) = (setup.options, setup.options.matching);
    // The axes of the volume are permuted after each pass, so that slices are always contiguous.
    let permutations = [[nz, ny, nx], [ny, nx, nz], [nx, nz, ny]];
    let plane = Directions::plane(options.orientations);
    let banks = permutations.map(|[_, rows, columns]| FilterBank::new(&[rows, columns], &[], setup.levels, &plane));
    let mut isotropy = (options.mode == Mode::Slices).then(|| Isotropy::new(setup.size));
    let mut oblique = None;
    let mut convergence = Convergence::new(setup);
    let mut steps = Steps {
        done: 0,
        of: setup.passes(),
        watch: setup.watch,
    };
    let mut coefficients = Vec::new();
    for iteration in 0..options.iterations {
        let mut errors = Vec::new();
        if let Some(isotropy) = isotropy.as_mut().filter(|_| iteration > 0) {
            for &c in setup.varying {
                isotropy.restore(&mut canvas.components[c]);
            }
        }
        canvas.match_channels();
        for planes in setup.planes(iteration) {
            let diagonals = match planes {
                Planes::Axes => {
                    for (axis, (bank, [slices, rows, columns])) in banks.iter().zip(permutations).enumerate() {
                        for (&c, targets) in setup.varying.iter().zip(setup.targets[axis]) {
                            let field = &mut canvas.components[c];
                            errors.push(match_bands(field, bank, targets, matching, EVENNESS, &mut coefficients));
                            steps.next(report)?;
                        }
                        for component in &mut canvas.components {
                            *component = first_axis_last(component, slices, rows * columns);
                        }
                    }
                    continue;
                }
                Planes::FaceDiagonals => face_diagonals(),
                Planes::SpaceDiagonals => space_diagonals(),
            };
            // Free these first: both together would double the memory.
            coefficients = Vec::new();
            let oblique = oblique.get_or_insert_with(|| Oblique::new(setup.size, setup.levels, options.orientations));
            for (&first, targets) in setup.varying.iter().zip(setup.targets[0]).take(1) {
                for normal in &diagonals {
                    errors.push(oblique.match_cuts(&mut canvas.components[first], normal, targets, matching));
                    steps.next(report)?;
                }
            }
        }
        report.band_errors.push(root_mean_square(&errors));
        report.slice_errors.push(convergence.error(&canvas, setup));
        steps.report(report)?;
    }
    if options.mode == Mode::Slices && options.cuts == Cut::All && options.iterations > 0 {
        convergence.reweight(&mut canvas, setup, NEGLIGIBLE);
        canvas.match_channels();
        convergence.reweight(&mut canvas, setup, 0.0);
    }
    canvas.match_channels();
    report.final_error = convergence.error(&canvas, setup);
    Ok(canvas)
}

/// Matches the isotropic 3D bands of a volume.
pub(crate) fn match_volume<'a>(
    mut canvas: Canvas<'a>,
    setup: &Setup<'_>,
    report: &mut TextureReport,
) -> Result<Canvas<'a>, TextureError> {
    let bank = FilterBank::new(&setup.size, &[], setup.levels, &Directions::none());
    let mut convergence = Convergence::new(setup);
    let fields = setup.varying.iter().zip(setup.targets[0]);
    let corrected: Vec<Option<BandTargets>> = fields
        .map(|(&c, targets)| {
            let field = &canvas.components[c];
            (setup.options.mode == Mode::Spectrum).then(|| corrected(targets, &band_mean_squares(field, &bank)))
        })
        .collect();
    let mut steps = Steps {
        done: 0,
        of: setup.passes(),
        watch: setup.watch,
    };
    let mut coefficients = Vec::new();
    for _ in 0..setup.options.iterations {
        let mut errors = Vec::new();
        canvas.match_channels();
        for ((&c, targets), corrected) in setup.varying.iter().zip(setup.targets[0]).zip(&corrected) {
            let (field, targets) = (&mut canvas.components[c], corrected.as_ref().unwrap_or(targets));
            let matching = setup.options.matching;
            errors.push(match_bands(field, &bank, targets, matching, 0.0, &mut coefficients));
            steps.next(report)?;
        }
        report.band_errors.push(root_mean_square(&errors));
        report.slice_errors.push(convergence.error(&canvas, setup));
        steps.report(report)?;
    }
    canvas.match_channels();
    report.final_error = convergence.error(&canvas, setup);
    Ok(canvas)
}

/// Targets with the shape of the distributions of the exemplar and given mean squares.
fn corrected(targets: &BandTargets, mean_squares: &[f64]) -> BandTargets {
    let scaled = targets.of_band.iter().zip(mean_squares).map(|(&target, &wanted)| {
        let target = &targets.targets[target.unwrap_or(0)];
        let own = target.mean_square();
        #[allow(clippy::cast_possible_truncation, reason = "a factor near one")]
        let factor = if own > 0.0 { (wanted / own).sqrt() as f32 } else { 1.0 };
        target.scaled(factor)
    });
    BandTargets {
        targets: scaled.collect(),
        of_band: (0..targets.of_band.len()).map(Some).collect(),
    }
}

/// Moves the first axis of a volume of `first` slices of `rest` samples to the end.
fn first_axis_last(field: &[f32], first: usize, rest: usize) -> Vec<f32> {
    const TILE: usize = 32;
    let mut moved = vec![0.0; field.len()];
    moved
        .par_chunks_mut(first * TILE)
        .enumerate()
        .for_each(|(tile, moved)| {
            let start = tile * TILE;
            for block in (0..first).step_by(TILE) {
                for (j, row) in moved.chunks_exact_mut(first).enumerate() {
                    for (i, value) in row.iter_mut().enumerate().skip(block).take(TILE) {
                        *value = field[i * rest + start + j];
                    }
                }
            }
        });
    moved
}
