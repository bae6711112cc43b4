//! `stereology measure`: a solid judged by its slices.

use std::path::{Path, PathBuf};

use clap::Args;
use image::{Rgb, RgbImage};
use ndarray::{Array3, Array4, ArrayView3, Axis, Ix3};
use serde_json::{Value, json};
use stereology::grid::{SampleType, read_npy, read_volume};
use stereology::metrics::{Comparison, Family, FamilyError, Figure, copying, sections, sections_inside};
use stereology::pipeline::{CompareOptions, compare_solid};
use stereology::segment::read_photo;
use stereology::spectrum::BandPass;

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::{Explain, Failure};
use crate::numbers::significant;
use crate::outputs::{check_file, write_text};
use crate::progress::{Step, go_on};
use crate::report::{MeasureReport, measures_page};
use crate::values::{count, pair, positive};
use crate::warnings::Warning;

/// Tells how like the slices of a volume are to a picture, or to the slices of another volume
///
/// Works on the volumes of any program: .npy, .nrrd and .tif (a page a z) of any sample type, grey or RGB. Rows of EXEMPLAR run along z and its columns along x (slices xz), or along y
/// (slices yz); rows of xy slices run along y.
///
/// Every figure comes with its ideal (0 of a distance, 1 of a ratio, else the exemplar's own) and its floor: how far from the ideal two halves of the exemplar are from each other. A solid at the
/// floor cannot be told from its exemplar. Fringe lengths and windings mean something only for layered textures.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology measure exemplar.png solid.npy --slices xz,yz --report measures.html")]
pub struct Measure {
    /// Picture (PNG, JPEG, TIFF) or volume (.npy, .nrrd, .tif) that the slices should look like
    pub exemplar: PathBuf,
    /// Volume to be judged: .npy, .nrrd or .tif
    pub volume: PathBuf,
    /// Slices to look at, any of xz, yz, xy
    #[arg(long, value_name = "FAMILIES", default_value = "xz,yz,xy")]
    pub slices: Families,
    /// Most slices of a family that are measured, evenly spread
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = count)]
    pub at_most: usize,
    /// Values of the volume that mean black and white [default: 0 and 255 or 65,535 of unsigned samples, 0 and 1 of floating point between them, else the volume's least and greatest]
    #[arg(long, value_name = "LOW,HIGH", value_parser = pair, allow_hyphen_values = true)]
    pub range: Option<[f32; 2]>,
    /// The same of the exemplar, if it is a volume or a float picture
    #[arg(long, value_name = "LOW,HIGH", value_parser = pair, allow_hyphen_values = true)]
    pub exemplar_range: Option<[f32; 2]>,
    /// Distance from fringe to fringe, pixels [default: the strongest period of the exemplar]
    #[arg(long, value_name = "PIXELS", value_parser = positive)]
    pub period: Option<f64>,
    /// Which texel each voxel was copied from (.npy of u32: row x width + column): tells coverage and copying too
    #[arg(long, value_name = "NPY")]
    pub sources: Option<PathBuf>,
    /// Volume of the same size (.npy, .nrrd, .tif), not 0 inside, such as `grow --cells`: of each slice the largest rectangle inside is measured
    #[arg(long, value_name = "FILE")]
    pub mask: Option<PathBuf>,
    /// A page with all curves and pictures
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

/// Pixels that a slice needs inside the mask, each way.
const LEAST_INSIDE: usize = 16;

/// A picture or volume with values 0 to 1.
struct Samples {
    values: Array4<f32>,
    guessed: Option<Warning>,
}

impl Measure {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        if let Some(report) = &self.report {
            check_file(report, everywhere.force)?;
        }
        let mut answer = Answer::new("measure");
        let exemplar = read(&self.exemplar, self.exemplar_range, "--exemplar-range")?;
        let volume = read(&self.volume, self.range, "--range")?;
        if volume.values.dim().0 == 1 && self.slices.0 != [Family::Xy] {
            return Err(Failure::run(format!(
                "{}: is one picture, no volume; to compare it as it is, give --slices xy",
                self.volume.display()
            )));
        }
        for warning in [exemplar.guessed, volume.guessed].into_iter().flatten() {
            answer.warn(warning);
        }
        let mask = self.inside(&volume.values)?;
        let (slices, left_out) = self.of(&volume.values, mask.as_ref());
        if slices.is_empty() {
            return Err(Failure::run(format!(
                "{}: no slice has a square of {LEAST_INSIDE} pixels inside the mask",
                self.volume.display()
            )));
        }
        let pictures = if exemplar.values.dim().0 == 1 {
            vec![exemplar.values.index_axis(Axis(0), 0)]
        } else {
            self.of(&exemplar.values, None).0
        };
        if left_out > 0 {
            answer.warn(Warning::new(
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
        tell(&mut answer, &found, slices.len(), &self.slices);
        if let Some(path) = &self.sources {
            self.copying(&mut answer, path, &exemplar.values, &volume.values)?;
        }
        if let Some(path) = &self.report {
            let middle = |pictures: &[ArrayView3<'_, f32>]| pictures.get(pictures.len() / 2).map(picture);
            let shown = self.slices.0.iter().filter_map(|&family| {
                let of = sections(volume.values.view(), family);
                middle(&of).map(|picture| (format!("Slice {family} of the volume"), picture))
            });
            let page = measures_page(&MeasureReport {
                exemplar_name: name(&self.exemplar),
                volume_name: name(&self.volume),
                exemplar: middle(&pictures),
                slices: shown.collect(),
                number: slices.len(),
                comparison: &found,
                command: everywhere.invocation.command.clone(),
                parameters: everywhere.invocation.parameters.clone(),
            });
            write_text(path, &page)?;
        }
        Ok(answer)
    }

    /// Which voxels of the volume count; all if `None`.
    fn inside(&self, volume: &Array4<f32>) -> Result<Option<Array3<bool>>, Failure> {
        let Some(path) = &self.mask else { return Ok(None) };
        let samples = read_volume(path).at(path)?.samples;
        let mask = samples.map_axis(Axis(3), |channels| channels.iter().any(|v| *v != 0.0));
        let (nz, ny, nx, _) = volume.dim();
        if mask.dim() != (nz, ny, nx) {
            return Err(Failure::run(format!(
                "{}: a mask of {:?} voxels for a volume of {nz} x {ny} x {nx}",
                path.display(),
                mask.dim()
            )));
        }
        Ok(Some(mask))
    }

    /// The slices that are measured, and how many are left out.
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
        answer: &mut Answer,
        path: &Path,
        exemplar: &Array4<f32>,
        volume: &Array4<f32>,
    ) -> Result<(), Failure> {
        let (nz, ny, nx, _) = volume.dim();
        let sources = read_npy::<u32>(path).at(path)?;
        let shape = sources.shape().to_vec();
        let sources = sources
            .into_dimensionality::<Ix3>()
            .ok()
            .filter(|sources| sources.dim() == (nz, ny, nx))
            .ok_or_else(|| {
                Failure::run(format!(
                    "{}: has axes {shape:?}, the volume {nz} x {ny} x {nx}; give the sources of this volume",
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
        answer
            .field("coverage", found.coverage)
            .field("perplexity", found.perplexity)
            .field("longest_copy", found.longest_copy)
            .line(format!(
                "sources: coverage {}, perplexity {} of the texels, longest copy {} pixels",
                significant(found.coverage),
                significant(found.perplexity),
                found.longest_copy
            ));
        Ok(())
    }
}

fn tell(answer: &mut Answer, found: &Comparison, slices: usize, families: &Families) {
    let number = |value: Option<f64>| value.map_or(Value::Null, |value| json!(value));
    let said = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), significant);
    answer.line(format!(
        "{:<22} {:>10} {:>10} {:>10} {:>10}",
        "", "volume", "ideal", "floor", "floors off"
    ));
    for (name, figure) in found.figures() {
        let Figure { value, ideal, floor } = figure;
        answer
            .field(name, number(value))
            .field(&format!("{name}_ideal"), number(ideal))
            .field(&format!("{name}_floor"), number(floor))
            .line(format!(
                "{name:<22} {:>10} {:>10} {:>10} {:>10}",
                said(value),
                said(ideal),
                said(floor),
                said(figure.in_floors())
            ));
    }
    let curves = &found.curves;
    let names: Vec<String> = families.0.iter().map(ToString::to_string).collect();
    answer
        .field("slices", slices)
        .field("families", names)
        .field("threshold", f64::from(curves.threshold))
        .field("period", number(curves.period))
        .field("direction", number(curves.direction))
        .field("window", curves.window.to_vec())
        .field("fringes", curves.fringe_lengths[1].len())
        .field("fringes_exemplar", curves.fringe_lengths[0].len())
        .line(format!("{slices} slices; fringes {} pixels apart", said(curves.period)));
    if found.fringe_length.value.is_none() || found.fringe_length.ideal.is_none() {
        answer.warn(Warning::new(
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
}

/// A file's samples brought to 0 to 1.
fn read(path: &Path, range: Option<[f32; 2]>, option: &str) -> Result<Samples, Failure> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let is_tiff = matches!(ending.as_deref(), Some("tif" | "tiff"));
    let stored = match ending.as_deref() {
        Some("npy" | "nrrd" | "nhdr") => read_volume(path).at(path)?,
        Some("tif" | "tiff") => match read_volume(path) {
            Ok(stored) => stored,
            // Photographs come in more ways than volumes.
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
    // Opacity is left out; beside grey only TIFF has it.
    let channels = values.dim().3;
    if channels == 4 || (channels == 2 && is_tiff) {
        values = values.slice_axis(Axis(3), (..channels - 1).into()).to_owned();
    }
    values.mapv_inplace(|v| (v - black) / (white - black));
    Ok(Samples { values, guessed })
}

/// A photograph; grey if it shows nothing else.
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
