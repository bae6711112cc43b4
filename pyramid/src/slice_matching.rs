//! The rounds of a synthesis: bands of slices, of oblique planes or of the volume given their distributions, again and again.

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

/// How much nearer each slice's band powers are brought to the mean over the slices before matching, as an exponent: 0 lets
/// some slices of a coarse texture have half of the contrast of others, 1 makes them all alike.
const EVENNESS: f64 = 0.5;
/// A colour component with a smaller share of the variance cannot move the others' bands when the channels are matched.
const HARDLY_ANY: f64 = 0.02;

/// What all rounds need to know.
pub(crate) struct Rounds<'a> {
    pub(crate) size: [usize; 3],
    /// Colour components that vary, brightness first: it alone has its bands matched on oblique planes too.
    pub(crate) varying: &'a [usize],
    /// The share of the variance that each has.
    pub(crate) shares: Vec<f64>,
    /// By axis (z, y, x) and component that varies.
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

impl Rounds<'_> {
    /// Planes of one round. Slices come first and last; between, rounds of slices and of oblique planes take turns, the last
    /// of them normal to the space diagonals.
    fn planes(&self, round: usize) -> &'static [Planes] {
        let to_come = self.options.iterations - 1 - round;
        if self.options.mode == Mode::Oriented || self.options.cuts == Cut::Axes {
            return &[Planes::Axes];
        }
        match (to_come, round) {
            (0, _) => &[Planes::FaceDiagonals, Planes::Axes],
            (_, 0) => &[Planes::Axes],
            (1, _) => &[Planes::FaceDiagonals, Planes::SpaceDiagonals],
            (_, round) if round.is_multiple_of(2) => &[Planes::Axes],
            _ => &[Planes::FaceDiagonals],
        }
    }

    /// Passes over components, of all rounds.
    fn passes(&self) -> usize {
        let slices = matches!(self.options.mode, Mode::Slices | Mode::Oriented);
        let of = |planes: &Planes| match planes {
            Planes::Axes => 3 * self.varying.len(),
            Planes::FaceDiagonals => 6,
            Planes::SpaceDiagonals => 4,
        };
        if slices {
            let rounds = 0..self.options.iterations;
            rounds.flat_map(|round| self.planes(round)).map(of).sum()
        } else {
            self.varying.len() * self.options.iterations
        }
    }
}

/// Tells the caller how far a synthesis is, and whether to stop.
struct Steps<'a> {
    done: usize,
    of: usize,
    watch: Watch<'a>,
}

impl Steps<'_> {
    fn next(&mut self, report: &TextureReport) -> Result<(), TextureError> {
        self.done += 1;
        self.say(report)
    }

    fn say(&self, report: &TextureReport) -> Result<(), TextureError> {
        if (self.watch)(self.done as f64 / self.of as f64, report).is_break() {
            return Err(TextureError::Cancelled);
        }
        Ok(())
    }
}

/// How far the bands of the slices are from the exemplar's.
struct Convergence {
    cuts: Cuts,
    normals: Vec<Unit<Vector3<f64>>>,
    /// Mean squares wanted, by axis (z, y, x), component and band.
    wanted: [Vec<Vec<f64>>; 3],
    /// What is known of each component, once asked.
    curvatures: Vec<Option<Curvature>>,
}

impl Convergence {
    fn new(rounds: &Rounds<'_>) -> Self {
        let orientations = match rounds.options.mode {
            Mode::Slices | Mode::Oriented => rounds.options.orientations,
            Mode::Spectrum | Mode::Volume => 1,
        };
        let of = |targets: &[BandTargets]| targets.iter().map(|t| t.level_mean_squares(orientations)).collect();
        let mut normals = vec![Vector3::z_axis(), Vector3::y_axis(), Vector3::x_axis()];
        if rounds.options.mode != Mode::Oriented {
            // Two of each kind stand for it.
            normals.extend(face_diagonals().into_iter().take(2));
            normals.extend(space_diagonals().into_iter().take(2));
        }
        Self {
            cuts: Cuts::new(rounds.size, rounds.levels),
            normals,
            wanted: rounds.targets.map(of),
            curvatures: rounds.varying.iter().map(|_| None).collect(),
        }
    }

    /// Root mean square over cuts and bands, in the first component, of ln(variance / exemplar's).
    fn error(&mut self, canvas: &Canvas<'_>, rounds: &Rounds<'_>) -> f64 {
        let Some(&first) = rounds.varying.first() else {
            return 0.0;
        };
        let (mut sum, mut count) = (0.0, 0.0);
        let found = self.cuts.variances(&canvas.components[first], &self.normals);
        for (n, found) in found.iter().enumerate() {
            let wanted = &self.wanted[if n < 3 { n } else { 0 }][0];
            let bands = found[..found.len() - 1].iter().zip(wanted);
            for (f, w) in bands.filter(|(f, w)| **f > 0.0 && **w > 0.0) {
                sum += (f / w).ln().powi(2);
                count += 1.0;
            }
        }
        if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
    }

    /// Gives the cuts of all directions the band variances wanted on the first axis, in components of a share of `least` or more.
    fn reweight(&mut self, canvas: &mut Canvas<'_>, rounds: &Rounds<'_>, least: f64) {
        let wanted = self.wanted[0].iter().zip(&mut self.curvatures);
        for ((&c, &share), (wanted, curvature)) in rounds.varying.iter().zip(&rounds.shares).zip(wanted) {
            if share >= least {
                self.cuts.reweight(&mut canvas.components[c], wanted, curvature);
            }
        }
    }
}

/// Matches the 2D bands of all slices, one axis (z, y, x) after the other, and in [`Mode::Slices`] those of oblique planes, one
/// normal after the other; at the end, there, the band variances of cuts of all directions.
pub(crate) fn match_slices<'a>(
    mut canvas: Canvas<'a>,
    rounds: &Rounds<'_>,
    report: &mut TextureReport,
) -> Result<Canvas<'a>, TextureError> {
    let [nz, ny, nx] = rounds.size;
    let (options, matching) = (rounds.options, rounds.options.matching);
    // The volume's axes are turned after each pass, so that the slices always lie one after the other.
    let turns = [[nz, ny, nx], [ny, nx, nz], [nx, nz, ny]];
    let plane = Directions::plane(options.orientations);
    let banks = turns.map(|[_, rows, columns]| FilterBank::new(&[rows, columns], &[], rounds.levels, &plane));
    let mut isotropy = (options.mode == Mode::Slices).then(|| Isotropy::new(rounds.size));
    let mut oblique = None;
    let mut convergence = Convergence::new(rounds);
    let mut steps = Steps {
        done: 0,
        of: rounds.passes(),
        watch: rounds.watch,
    };
    let mut coefficients = Vec::new();
    for round in 0..options.iterations {
        let mut errors = Vec::new();
        if let Some(isotropy) = isotropy.as_mut().filter(|_| round > 0) {
            for &c in rounds.varying {
                isotropy.restore(&mut canvas.components[c]);
            }
        }
        canvas.match_channels();
        for planes in rounds.planes(round) {
            let diagonals = match planes {
                Planes::Axes => {
                    for (axis, (bank, [slices, rows, columns])) in banks.iter().zip(turns).enumerate() {
                        for (&c, targets) in rounds.varying.iter().zip(rounds.targets[axis]) {
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
            // Not both at once: together they would double the memory.
            coefficients = Vec::new();
            let oblique = oblique.get_or_insert_with(|| Oblique::new(rounds.size, rounds.levels, options.orientations));
            for (&first, targets) in rounds.varying.iter().zip(rounds.targets[0]).take(1) {
                for normal in &diagonals {
                    errors.push(oblique.match_cuts(&mut canvas.components[first], normal, targets, matching));
                    steps.next(report)?;
                }
            }
        }
        report.band_errors.push(root_mean_square(&errors));
        report.slice_errors.push(convergence.error(&canvas, rounds));
        steps.say(report)?;
    }
    if options.mode == Mode::Slices && options.cuts == Cut::All && options.iterations > 0 {
        convergence.reweight(&mut canvas, rounds, HARDLY_ANY);
        canvas.match_channels();
        convergence.reweight(&mut canvas, rounds, 0.0);
    }
    canvas.match_channels();
    report.final_error = convergence.error(&canvas, rounds);
    Ok(canvas)
}

/// Matches the isotropic 3D bands of a volume.
pub(crate) fn match_volume<'a>(
    mut canvas: Canvas<'a>,
    rounds: &Rounds<'_>,
    report: &mut TextureReport,
) -> Result<Canvas<'a>, TextureError> {
    let bank = FilterBank::new(&rounds.size, &[], rounds.levels, &Directions::none());
    let mut convergence = Convergence::new(rounds);
    let fields = rounds.varying.iter().zip(rounds.targets[0]);
    let corrected: Vec<Option<BandTargets>> = fields
        .map(|(&c, targets)| {
            let field = &canvas.components[c];
            (rounds.options.mode == Mode::Spectrum).then(|| corrected(targets, &band_mean_squares(field, &bank)))
        })
        .collect();
    let mut steps = Steps {
        done: 0,
        of: rounds.passes(),
        watch: rounds.watch,
    };
    let mut coefficients = Vec::new();
    for _ in 0..rounds.options.iterations {
        let mut errors = Vec::new();
        canvas.match_channels();
        for ((&c, targets), corrected) in rounds.varying.iter().zip(rounds.targets[0]).zip(&corrected) {
            let (field, targets) = (&mut canvas.components[c], corrected.as_ref().unwrap_or(targets));
            let matching = rounds.options.matching;
            errors.push(match_bands(field, &bank, targets, matching, 0.0, &mut coefficients));
            steps.next(report)?;
        }
        report.band_errors.push(root_mean_square(&errors));
        report.slice_errors.push(convergence.error(&canvas, rounds));
        steps.say(report)?;
    }
    canvas.match_channels();
    report.final_error = convergence.error(&canvas, rounds);
    Ok(canvas)
}

/// Targets with the shape of the exemplar's distributions, and given mean squares.
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

/// A volume of `first` slices of `rest` samples with its first axis made the last.
fn first_axis_last(field: &[f32], first: usize, rest: usize) -> Vec<f32> {
    const TILE: usize = 32;
    let mut turned = vec![0.0; field.len()];
    turned
        .par_chunks_mut(first * TILE)
        .enumerate()
        .for_each(|(tile, turned)| {
            let start = tile * TILE;
            for block in (0..first).step_by(TILE) {
                for (j, row) in turned.chunks_exact_mut(first).enumerate() {
                    for (i, value) in row.iter_mut().enumerate().skip(block).take(TILE) {
                        *value = field[i * rest + start + j];
                    }
                }
            }
        });
    turned
}
