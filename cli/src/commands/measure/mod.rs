//! `stereology measure`: a solid compared with an image by its slices.

mod figures;
mod geometry;

use std::path::{Path, PathBuf};

use clap::Args;
use image::{Rgb, RgbImage};
use ndarray::{Array3, Array4, ArrayView3, Axis, Ix3};
use schemars::JsonSchema;
use serde::Serialize;
use stereology::grid::{SampleType, read_npy, read_volume};
use stereology::metrics::{
    BlockSource, BlockTest, Comparison, Family, FamilyError, Figure, block_test, copying, sections, sections_inside,
};
use stereology::pipeline::{CompareOptions, Level, compare_solid};
use stereology::segment::{PhotoFile, read_photo_with};
use stereology::spectrum::BandPass;

use crate::answer::{Answer, Fields, Notes};
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::outputs::{Output, write_text};
use crate::pictures::ImageLimit;
use crate::progress::{Step, go_on};
use crate::values::{count, pair, positive};
use crate::warnings::Warning;
use figures::{Figures, VerdictFields};
use geometry::PhasesFields;
use stereology_report::{MeasureReport, significant};

/// Memory for each pixel of an image, bytes.
const BYTES_PER_PIXEL: u64 = 100;

/// Measures how similar the slices of a volume are to an image, or to the slices of another volume
///
/// Works on volumes from any program: .npy, .nrrd and .tif (one page per z) of any sample type, grey or RGB. Rows of
/// EXEMPLAR run along z and its columns along x (slices xz) or along y (slices yz); rows of xy slices run along y.
///
/// Every measure is reported with its ideal (0 for a distance, 1 for a ratio, otherwise the exemplar's own value) and
/// its floor: the mean difference between halves of the exemplar. It is good up to 2 floors from its ideal, needs care
/// up to 4, and is bad beyond. A classifier also decides for blocks of slices and exemplar where each comes from: if
/// it cannot, they are as similar as its 17 features can show. Fringe lengths and tortuosities are meaningful only for
/// layered textures.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology measure exemplar.png solid.npy --slices xz,yz --report measures.html")]
pub struct Measure {
    /// Image (PNG, JPEG, TIFF) or volume (.npy, .nrrd, .tif) that the slices should look like
    pub exemplar: PathBuf,
    /// Volume to measure: .npy, .nrrd or .tif
    pub volume: PathBuf,
    #[command(flatten)]
    pub limit: ImageLimit,
    /// Families of slices to measure: any of xz, yz, xy
    #[arg(long, value_name = "FAMILIES", default_value = "xz,yz,xy")]
    pub slices: Families,
    /// Maximum number of slices per family, evenly spaced
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = count)]
    pub at_most: usize,
    /// Values of the volume for black and white [default: 0 and 255 or 65,535 for unsigned samples; 0 and 1 for
    /// floating point within that range; otherwise the least and greatest value]
    #[arg(long, value_name = "LOW,HIGH", value_parser = pair, allow_hyphen_values = true)]
    pub range: Option<[f32; 2]>,
    /// The same for the exemplar, if it is a volume or a floating-point image
    #[arg(long, value_name = "LOW,HIGH", value_parser = pair, allow_hyphen_values = true)]
    pub exemplar_range: Option<[f32; 2]>,
    /// Distance between fringes in pixels [default: the strongest period of the exemplar]
    #[arg(long, value_name = "PIXELS", value_parser = positive)]
    pub period: Option<f64>,
    /// Texel from which each voxel was copied (.npy of u32: row x width + column); adds coverage and copying to the
    /// result
    #[arg(long, value_name = "NPY")]
    pub sources: Option<PathBuf>,
    /// Mask of the same size (.npy, .nrrd, .tif), not 0 inside, such as `grow --cells`; the largest rectangle inside is
    /// measured on each slice
    #[arg(long, value_name = "FILE")]
    pub mask: Option<PathBuf>,
    /// Also write a page with all curves and images (HTML)
    #[arg(long, value_name = "FILE")]
    pub report: Option<Output>,
}

/// Families of slices, `xz,yz`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Families(pub Vec<Family>);

impl std::str::FromStr for Families {
    type Err = FamilyError;

    fn from_str(text: &str) -> Result<Self, FamilyError> {
        let mut families: Vec<Family> = Vec::new();
        for name in text.split(',') {
            let family = name.parse()?;
            if !families.contains(&family) {
                families.push(family);
            }
        }
        Ok(Self(families))
    }
}

/// Smallest side in pixels of a rectangle inside the mask.
const LEAST_INSIDE: usize = 16;

/// An image or volume with values 0 to 1.
struct Samples {
    values: Array4<f32>,
    guessed: Vec<Warning>,
}

/// JSON of `stereology measure`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct MeasureFields {
    /// Every measure with its ideal and its floor.
    #[serde(flatten)]
    figures: Figures,
    /// The worst of it, and how many figures have which level.
    verdict: VerdictFields,
    /// Whether a classifier distinguishes blocks of the slices from blocks of the exemplar; null if there are fewer
    /// than 8 blocks of 16 pixels on a side.
    classifier: Option<ClassifierFields>,
    /// Geometry of the phases above and below the threshold.
    phases: PhasesFields,
    /// Correlation of the amplitudes of neighbouring octave bands, finest pair first.
    scale_magnitudes_by_pair: SidesFields<Vec<f64>>,
    /// Correlation of the phases of neighbouring octave bands, finest pair first: real part (positive for bright lines,
    /// negative for dark ones) and imaginary part (negative for edges).
    scale_phases_by_pair: SidesFields<Vec<f64>>,
    /// Number of slices measured.
    slices: usize,
    /// Families of slices.
    families: Vec<String>,
    /// Grey level, 0 to 1, above which pixels belong to the bright phase.
    threshold: f64,
    /// Distance between fringes in pixels; null if the exemplar has no period.
    period: Option<f64>,
    /// Main direction of the exemplar in degrees; null if it has none.
    direction: Option<f64>,
    /// Height and width in pixels of the windows in which fringes are measured.
    window: [usize; 2],
    /// Fringes measured in the volume.
    fringes: usize,
    /// Fringes measured in the exemplar.
    fringes_exemplar: usize,
    /// How voxels were copied from the exemplar; with --sources.
    #[serde(flatten)]
    copying: Option<CopyingFields>,
}

/// A quantity of both sides.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SidesFields<T> {
    /// Of the exemplar.
    exemplar: T,
    /// Of the volume.
    volume: T,
}

impl<T> SidesFields<T> {
    fn of([exemplar, volume]: [T; 2]) -> Self {
        Self { exemplar, volume }
    }
}

/// A classifier two-sample test of blocks.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ClassifierFields {
    /// Fraction of the blocks whose side is found by a classifier that has not seen them: about 0.5 if it cannot
    /// distinguish them.
    accuracy: f64,
    /// Probability of at least this accuracy if the blocks are exchangeable.
    p_value: f64,
    /// good: p above .01; care: p up to .01; bad: also an accuracy of at least .8.
    #[schemars(with = "String")]
    level: Level,
    /// Blocks of each side.
    blocks: usize,
    /// Side of a block in pixels.
    side: usize,
    /// Means of the features, the largest difference first.
    features: Vec<FeatureFields>,
}

/// Means of one feature over the blocks.
#[derive(Debug, Serialize, JsonSchema)]
pub struct FeatureFields {
    /// Its name.
    name: &'static str,
    /// Mean over the blocks of the exemplar.
    exemplar: f64,
    /// Mean over the blocks of the volume.
    volume: f64,
    /// Difference in standard deviations of all blocks.
    difference: f64,
}

impl ClassifierFields {
    /// Fields of a test.
    pub fn of(test: &BlockTest) -> Self {
        let feature = |of: &stereology::metrics::FeatureMeans| FeatureFields {
            name: of.name,
            exemplar: of.exemplar,
            volume: of.solid,
            difference: of.difference,
        };
        Self {
            accuracy: test.accuracy,
            p_value: test.p_value,
            level: test.level(),
            blocks: test.blocks,
            side: test.side,
            features: test.features.iter().map(feature).collect(),
        }
    }
}

/// How the voxels of a solid were copied from the pixels of its exemplar.
#[derive(Debug, Serialize, JsonSchema)]
pub struct CopyingFields {
    /// Fraction of the texels that were copied at least once.
    coverage: f64,
    /// Evenness of the copying: exponential of the entropy, over the number of texels.
    perplexity: f64,
    /// Longest run of pixels copied in one piece.
    longest_copy: usize,
}

impl Fields for MeasureFields {
    const COMMAND: &'static str = "measure";
}

impl Measure {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let report_file = self
            .report
            .as_ref()
            .map(|output| everywhere.outputs.file(output))
            .transpose()?;
        let mut notes = Notes::default();
        let exemplar = read(&self.exemplar, self.exemplar_range, "--exemplar-range", self.limit)?;
        let volume = read(&self.volume, self.range, "--range", self.limit)?;
        if volume.values.dim().0 == 1 && self.slices.0 != [Family::Xy] {
            return Err(Failure::run(format!(
                "{} is an image, not a volume; to compare it as a single slice, give --slices xy",
                self.volume.display()
            )));
        }
        for warning in [exemplar.guessed, volume.guessed].concat() {
            notes.warn(warning);
        }
        let mask = self.inside(&volume.values)?;
        let (slices, left_out) = self.of(&volume.values, mask.as_ref());
        if slices.is_empty() {
            return Err(Failure::run(format!(
                "{}: no slice has a rectangle of at least {LEAST_INSIDE} x {LEAST_INSIDE} pixels inside the mask",
                self.volume.display()
            )));
        }
        let pictures = if exemplar.values.dim().0 == 1 {
            vec![exemplar.values.index_axis(Axis(0), 0)]
        } else {
            self.of(&exemplar.values, None).0
        };
        if left_out > 0 {
            notes.warn(Warning::new(
                "slices-left-out",
                format!("{} slices were measured, {left_out} left out", slices.len()),
            ));
        }
        let options = CompareOptions {
            seed: everywhere.seed,
            band: self.period.map(BandPass::new),
            ..CompareOptions::default()
        };
        let step = Step::begin("measure", everywhere.quiet);
        let found = compare_solid(&pictures, &slices, &options, &|done| step.at(0.9 * done)).or_fail()?;
        go_on()?;
        let test = self.block_test(&exemplar.values, &volume.values, mask.as_ref(), everywhere.seed);
        let geometry = PhasesFields::of(
            [&pictures, &slices],
            [&exemplar.values, &volume.values],
            mask.is_none(),
            found.curves.threshold,
        );
        drop(step);
        go_on()?;
        let mut fields = fields(&mut notes, &found, slices.len(), &self.slices, test.as_ref(), geometry);
        if let Some(path) = &self.sources {
            fields.copying = Some(self.copying(&mut notes, path, &exemplar.values, &volume.values)?);
        }
        if let Some(path) = &report_file {
            let middle = |pictures: &[ArrayView3<'_, f32>]| pictures.get(pictures.len() / 2).map(picture);
            let shown = self.slices.0.iter().filter_map(|&family| {
                let of = sections(volume.values.view(), family);
                middle(&of).map(|picture| (format!("Slice {family} of the volume"), picture))
            });
            let report = MeasureReport {
                exemplar_name: name(&self.exemplar),
                volume_name: name(&self.volume),
                exemplar: middle(&pictures),
                slices: shown.collect(),
                number: slices.len(),
                comparison: &found,
                blocks: test.as_ref(),
                phases: fields.phases.rows(),
                command: everywhere.invocation.command.clone(),
                parameters: everywhere.invocation.parameters.clone(),
            };
            write_text(path, &report.page().or_fail()?)?;
        }
        Answer::new(&fields, notes)
    }

    /// Blocks of the volume against blocks of the exemplar.
    fn block_test(
        &self,
        exemplar: &Array4<f32>,
        volume: &Array4<f32>,
        mask: Option<&Array3<bool>>,
        seed: u64,
    ) -> Option<BlockTest> {
        let families = &self.slices.0;
        let planes = [exemplar.index_axis(Axis(0), 0)];
        let exemplar = if exemplar.dim().0 == 1 {
            BlockSource::Images(&planes)
        } else {
            BlockSource::Volume {
                voxels: exemplar.view(),
                families,
                mask: None,
            }
        };
        let pictures = [volume.index_axis(Axis(0), 0)];
        let volume = if volume.dim().0 == 1 {
            BlockSource::Images(&pictures)
        } else {
            BlockSource::Volume {
                voxels: volume.view(),
                families,
                mask: mask.map(|mask| mask.view()),
            }
        };
        block_test(&exemplar, &volume, seed)
    }

    /// Which voxels of the volume count; all if `None`.
    fn inside(&self, volume: &Array4<f32>) -> Result<Option<Array3<bool>>, Failure> {
        let Some(path) = &self.mask else { return Ok(None) };
        let samples = read_volume(path).at(path)?.samples;
        let mask = samples.map_axis(Axis(3), |channels| channels.iter().any(|v| *v != 0.0));
        let (nz, ny, nx, _) = volume.dim();
        if mask.dim() != (nz, ny, nx) {
            return Err(Failure::run(format!(
                "{}: the mask has {:?} voxels, but the volume {nz} x {ny} x {nx}",
                path.display(),
                mask.dim()
            )));
        }
        Ok(Some(mask))
    }

    /// The slices to measure, and the number left out.
    fn of<'a>(&self, volume: &'a Array4<f32>, mask: Option<&Array3<bool>>) -> (Vec<ArrayView3<'a, f32>>, usize) {
        let (mut taken, mut all) = (Vec::new(), 0);
        for &family in &self.slices.0 {
            let whole = sections(volume.view(), family);
            all += whole.len();
            let of = match mask {
                Some(mask) => sections_inside(volume.view(), mask.view(), family, LEAST_INSIDE),
                None => whole,
            };
            let n = of.len();
            let most = self.at_most.min(n);
            taken.extend((0..most).map(|i| of[(2 * i + 1) * n / (2 * most)]));
        }
        let left_out = all - taken.len();
        (taken, left_out)
    }

    fn copying(
        &self,
        notes: &mut Notes,
        path: &Path,
        exemplar: &Array4<f32>,
        volume: &Array4<f32>,
    ) -> Result<CopyingFields, Failure> {
        let (nz, ny, nx, _) = volume.dim();
        let sources = read_npy::<u32>(path).at(path)?;
        let shape = sources.shape().to_vec();
        let sources = sources
            .into_dimensionality::<Ix3>()
            .ok()
            .filter(|sources| sources.dim() == (nz, ny, nx))
            .ok_or_else(|| {
                Failure::run(format!(
                    "{}: the shape {shape:?} differs from that of the volume, {nz} x {ny} x {nx}; give the sources of this volume",
                    path.display()
                ))
            })?;
        let pictures: Vec<_> = self
            .slices
            .0
            .iter()
            .flat_map(|family| sources.axis_iter(family.normal()))
            .collect();
        let found = copying(&pictures, exemplar.dim().1, exemplar.dim().2);
        notes.line(format!(
            "sources: coverage {}, perplexity {} of the texels, longest copy {} pixels",
            significant(found.coverage),
            significant(found.perplexity),
            found.longest_copy
        ));
        Ok(CopyingFields {
            coverage: found.coverage,
            perplexity: found.perplexity,
            longest_copy: found.longest_copy,
        })
    }
}

fn fields(
    notes: &mut Notes,
    found: &Comparison,
    slices: usize,
    families: &Families,
    test: Option<&BlockTest>,
    phases: PhasesFields,
) -> MeasureFields {
    let shown = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), significant);
    let verdict = VerdictFields::of(found, test);
    notes.line(verdict.line());
    notes.line(match test {
        Some(test) => format!(
            "classifier: {} of {} blocks of {} pixels recognised, p {} ({})",
            significant(test.accuracy),
            2 * test.blocks,
            test.side,
            significant(test.p_value),
            figures::word(test.level())
        ),
        None => "classifier: too few blocks of 16 pixels".to_owned(),
    });
    notes.line(format!(
        "{:<22} {:>10} {:>10} {:>10} {:>10}  {}",
        "", "volume", "ideal", "floor", "in floors", "level"
    ));
    for (name, figure) in found.figures() {
        let Figure { value, ideal, floor } = figure;
        notes.line(format!(
            "{name:<22} {:>10} {:>10} {:>10} {:>10}  {}",
            shown(value),
            shown(ideal),
            shown(floor),
            shown(figure.in_floors()),
            figure.level().map_or("-", figures::word)
        ));
    }
    for line in phases.lines() {
        notes.line(line);
    }
    let curves = &found.curves;
    notes.line(format!(
        "{slices} slices; distance between fringes {} pixels",
        shown(curves.period)
    ));
    if found.fringe_length.value.is_none() || found.fringe_length.ideal.is_none() {
        notes.warn(Warning::new(
            "no-fringes",
            format!(
                "{} fringes in the exemplar and {} in the volume lie inside windows of {} x {} pixels",
                curves.fringe_lengths[0].len(),
                curves.fringe_lengths[1].len(),
                curves.window[1],
                curves.window[0]
            ),
        ));
    }
    MeasureFields {
        figures: Figures(found.figures()),
        verdict,
        classifier: test.map(ClassifierFields::of),
        phases,
        scale_magnitudes_by_pair: SidesFields::of(curves.scale_magnitudes.clone()),
        scale_phases_by_pair: SidesFields::of(curves.scale_phases.clone()),
        slices,
        families: families.0.iter().map(ToString::to_string).collect(),
        threshold: f64::from(curves.threshold),
        period: curves.period,
        direction: curves.direction,
        window: curves.window,
        fringes: curves.fringe_lengths[1].len(),
        fringes_exemplar: curves.fringe_lengths[0].len(),
        copying: None,
    }
}

/// Reads samples and scales them to 0 to 1.
fn read(path: &Path, range: Option<[f32; 2]>, option: &str, limit: ImageLimit) -> Result<Samples, Failure> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let is_tiff = matches!(ending.as_deref(), Some("tif" | "tiff"));
    let stored = match ending.as_deref() {
        Some("npy" | "nrrd" | "nhdr") => read_volume(path).at(path)?,
        Some("tif" | "tiff") => match read_volume(path) {
            Ok(stored) => stored,
            // Images use more TIFF variants than volumes.
            Err(error) => match read_photo_with(path, &limit.options(BYTES_PER_PIXEL)) {
                Ok(photo) => return Ok(of_photo(photo, path)),
                Err(_) => return Err(error).at(path),
            },
        },
        _ => {
            let read = read_photo_with(path, &limit.options(BYTES_PER_PIXEL));
            return read.map(|photo| of_photo(photo, path)).at(path);
        }
    };
    let (mut values, kind) = (stored.samples, stored.sample_type);
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let (low, high) = finite().fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let mut guessed = Vec::new();
    let [black, white] = match (range, kind.white()) {
        (Some([black, white]), _) if black < white => [black, white],
        (Some(_), _) => return Err(Failure::usage(format!("{option}: LOW must be below HIGH"))),
        (None, Some(white)) => [0.0, white],
        _ if low >= 0.0 && high <= 1.0 && matches!(kind, SampleType::F32 | SampleType::F64) => [0.0, 1.0],
        _ if low < high => {
            guessed.push(Warning::new(
                "range-guessed",
                format!("{}: {low} was taken as black and {high} as white", name(path)),
            ));
            [low, high]
        }
        _ => [low, low + 1.0],
    };
    // Opacity is dropped; of the grey formats only TIFF has it.
    let channels = values.dim().3;
    if channels == 4 || (channels == 2 && is_tiff) {
        values = values.slice_axis(Axis(3), (..channels - 1).into()).to_owned();
    }
    values.mapv_inplace(|v| (v - black) / (white - black));
    Ok(Samples { values, guessed })
}

/// Samples of an image; one channel if it is grey.
fn of_photo(PhotoFile { photo, findings, .. }: PhotoFile, path: &Path) -> Samples {
    let named = findings
        .into_iter()
        .map(|f| Warning::new(f.code, format!("{}: {}", name(path), f.message)));
    let is_grey = photo.pixels().all(|p| p[0] == p[1] && p[1] == p[2]);
    let shape = (
        1,
        photo.height() as usize,
        photo.width() as usize,
        if is_grey { 1 } else { 3 },
    );
    Samples {
        values: Array4::from_shape_fn(shape, |(_, y, x, c)| {
            f32::from(photo.get_pixel(x as u32, y as u32)[c]) / 255.0
        }),
        guessed: named.collect(),
    }
}

fn picture(samples: &ArrayView3<'_, f32>) -> RgbImage {
    let (height, width, channels) = samples.dim();
    RgbImage::from_fn(width as u32, height as u32, |x, y| {
        let at = |c: usize| samples[[y as usize, x as usize, if channels >= 3 { c } else { 0 }]];
        Rgb([0, 1, 2].map(|c| (at(c) * 255.0).round().clamp(0.0, 255.0) as u8))
    })
}

fn name(path: &Path) -> String {
    path.file_name().map_or_else(
        || path.display().to_string(),
        |name| name.to_string_lossy().into_owned(),
    )
}
