//! `stereology measure`: a solid compared with an image by its slices.

use std::path::{Path, PathBuf};

use clap::Args;
use image::{Rgb, RgbImage};
use ndarray::{Array3, Array4, ArrayView3, Axis, Ix3};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Serialize, Serializer};
use stereology::grid::{SampleType, read_npy, read_volume};
use stereology::metrics::{Comparison, Family, FamilyError, Figure, copying, sections, sections_inside};
use stereology::pipeline::{CompareOptions, compare_solid};
use stereology::segment::read_photo;
use stereology::spectrum::BandPass;

use crate::answer::{Answer, Fields, Notes};
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::outputs::{check_file, write_text};
use crate::progress::{Step, go_on};
use crate::values::{count, pair, positive};
use crate::warnings::Warning;
use stereology_report::{MeasureReport, significant};

/// Measures how similar the slices of a volume are to an image, or to the slices of another volume
///
/// Works on volumes from any program: .npy, .nrrd and .tif (one page per z) of any sample type, grey or RGB. Rows of
/// EXEMPLAR run along z and its columns along x (slices xz) or along y (slices yz); rows of xy slices run along y.
///
/// Every measure is reported with its ideal (0 for a distance, 1 for a ratio, otherwise the exemplar's own value) and
/// its floor: the difference between two halves of the exemplar. A solid at the floor is as similar to its exemplar as
/// the exemplar's halves are to each other. Fringe lengths and tortuosities are meaningful only for layered textures.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology measure exemplar.png solid.npy --slices xz,yz --report measures.html")]
pub struct Measure {
    /// Image (PNG, JPEG, TIFF) or volume (.npy, .nrrd, .tif) that the slices should look like
    pub exemplar: PathBuf,
    /// Volume to measure: .npy, .nrrd or .tif
    pub volume: PathBuf,
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
    pub report: Option<PathBuf>,
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
    guessed: Option<Warning>,
}

/// JSON of `stereology measure`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct MeasureFields {
    /// Every measure with its ideal and its floor.
    #[serde(flatten)]
    figures: Figures,
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

/// The measures by name, each as NAME, NAME_ideal and NAME_floor.
#[derive(Debug)]
pub struct Figures([(&'static str, Figure); MEASURES.len()]);

/// Names and meanings of the measures, in the order of [`Comparison::figures`].
const MEASURES: [(&str, &str); 15] = [
    (
        "kl_grey",
        "Kullback-Leibler divergence of the histograms of grey levels, in nats",
    ),
    (
        "std_ratio",
        "Standard deviation of grey levels over that of the exemplar",
    ),
    ("skewness", "Skewness of grey levels"),
    (
        "kl_orientation",
        "Kullback-Leibler divergence of the histograms of directions, in nats",
    ),
    ("coherence", "Coherence of the structure tensor, 0 to 1"),
    (
        "fringe_length",
        "Mean length of the fringes that lie inside a window, in pixels",
    ),
    (
        "fringe_length_by_ends",
        "Twice the visible length of fringes over their visible ends, in pixels",
    ),
    (
        "tortuosity",
        "Mean length of a fringe over the distance between its ends",
    ),
    (
        "s2",
        "Root mean square difference of the two-point correlation of the bright phase",
    ),
    (
        "lineal_path",
        "Largest difference of the lineal-path function of the bright phase",
    ),
    (
        "chord_ratio",
        "Mean chord length of the bright phase over that of the exemplar",
    ),
    (
        "local_porosity",
        "Wasserstein-1 distance of the local fractions of the bright phase",
    ),
    ("swd7", "Sliced Wasserstein distance of patches of 7 x 7 pixels"),
    ("swd16", "Sliced Wasserstein distance of patches of 16 x 16 pixels"),
    ("gradient_ratio", "Mean gradient over that of the exemplar"),
];

impl Serialize for Figures {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let rows = self.0.iter().flat_map(|(name, Figure { value, ideal, floor })| {
            [
                ((*name).to_owned(), value),
                (format!("{name}_ideal"), ideal),
                (format!("{name}_floor"), floor),
            ]
        });
        serializer.collect_map(rows)
    }
}

impl JsonSchema for Figures {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Figures".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let (mut properties, mut required) = (serde_json::Map::new(), Vec::new());
        for (name, meaning) in MEASURES {
            for (key, what) in [
                (name.to_owned(), format!("{meaning}; null if not measurable.")),
                (format!("{name}_ideal"), format!("Ideal value of `{name}`.")),
                (
                    format!("{name}_floor"),
                    format!("Distance of `{name}` from its ideal between two halves of the exemplar."),
                ),
            ] {
                properties.insert(
                    key.clone(),
                    serde_json::json!({ "description": what, "type": ["number", "null"] }),
                );
                required.push(key);
            }
        }
        json_schema!({ "type": "object", "properties": properties, "required": required })
    }
}

impl Fields for MeasureFields {
    const COMMAND: &'static str = "measure";
}

impl Measure {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        if let Some(report) = &self.report {
            check_file(report, everywhere.force)?;
        }
        let mut notes = Notes::default();
        let exemplar = read(&self.exemplar, self.exemplar_range, "--exemplar-range")?;
        let volume = read(&self.volume, self.range, "--range")?;
        if volume.values.dim().0 == 1 && self.slices.0 != [Family::Xy] {
            return Err(Failure::run(format!(
                "{} is an image, not a volume; to compare it as a single slice, give --slices xy",
                self.volume.display()
            )));
        }
        for warning in [exemplar.guessed, volume.guessed].into_iter().flatten() {
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
        let found = compare_solid(&pictures, &slices, &options, &|done| step.at(done)).or_fail()?;
        drop(step);
        go_on()?;
        let mut fields = fields(&mut notes, &found, slices.len(), &self.slices);
        if let Some(path) = &self.sources {
            fields.copying = Some(self.copying(&mut notes, path, &exemplar.values, &volume.values)?);
        }
        if let Some(path) = &self.report {
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
                command: everywhere.invocation.command.clone(),
                parameters: everywhere.invocation.parameters.clone(),
            };
            write_text(path, &report.page().or_fail()?)?;
        }
        Answer::new(&fields, notes)
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

fn fields(notes: &mut Notes, found: &Comparison, slices: usize, families: &Families) -> MeasureFields {
    let shown = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), significant);
    notes.line(format!(
        "{:<22} {:>10} {:>10} {:>10} {:>10}",
        "", "volume", "ideal", "floor", "in floors"
    ));
    for (name, figure) in found.figures() {
        let Figure { value, ideal, floor } = figure;
        notes.line(format!(
            "{name:<22} {:>10} {:>10} {:>10} {:>10}",
            shown(value),
            shown(ideal),
            shown(floor),
            shown(figure.in_floors())
        ));
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
fn read(path: &Path, range: Option<[f32; 2]>, option: &str) -> Result<Samples, Failure> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let is_tiff = matches!(ending.as_deref(), Some("tif" | "tiff"));
    let stored = match ending.as_deref() {
        Some("npy" | "nrrd" | "nhdr") => read_volume(path).at(path)?,
        Some("tif" | "tiff") => match read_volume(path) {
            Ok(stored) => stored,
            // Images use more TIFF variants than volumes.
            Err(error) => match read_photo(path) {
                Ok(photo) => return Ok(of_photo(&photo)),
                Err(_) => return Err(error).at(path),
            },
        },
        _ => return read_photo(path).map(|photo| of_photo(&photo)).at(path),
    };
    let (mut values, kind) = (stored.samples, stored.sample_type);
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let (low, high) = finite().fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let mut guessed = None;
    let [black, white] = match (range, kind.white()) {
        (Some([black, white]), _) if black < white => [black, white],
        (Some(_), _) => return Err(Failure::usage(format!("{option}: LOW must be below HIGH"))),
        (None, Some(white)) => [0.0, white],
        _ if low >= 0.0 && high <= 1.0 && matches!(kind, SampleType::F32 | SampleType::F64) => [0.0, 1.0],
        _ if low < high => {
            guessed = Some(Warning::new(
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
fn of_photo(photo: &RgbImage) -> Samples {
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
        guessed: None,
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
