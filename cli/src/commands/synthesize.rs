//! `stereology synthesize`: from a photograph to a solid.

use std::ops::ControlFlow;
use std::path::PathBuf;

use clap::Args;
use image::{Rgb, RgbImage, imageops};
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value, json};
use stereology::anneal::PackOptions;
use stereology::files;
use stereology::grid::{Format, LengthUnit};
use stereology::pipeline::{
    self, Comparison, DensityError, Extent, Finished, ParticleTypes, PopulationFailure, Synthesis, SynthesisError,
    SynthesisOptions,
};
use stereology::pyramid::TextureReport;
use stereology::render::BlockOptions;
use stereology::renderings::render_solid;
use stereology::sample;
use stereology::segment::{PhotoFile, PhotoOptions, read_photo_with};
use stereology::shape::TriangleMesh;
use stereology::volume::{Channel, SlicePlane};

use crate::answer::{Answer, Fields, Notes};
use crate::commands::pack::pack_failure;
use crate::commands::segment::SegmentFields;
use crate::commands::synthesis_verdict::{OutlineFields, ShapeFields, VerdictFields};
use crate::commands::unfold::{CategoryFields, Defaults, UnfoldingFields, types};
use crate::commands::{pack, segment, texture, unfold};
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::outputs::{Output, OutputFolder, write_json, write_png, write_text};
use crate::progress::{Stages, go_on};
use crate::values::{ShapeShare, count, positive, share};
use crate::warnings::advice;
use stereology_report::{
    Invocation, Remark, SolidImages, SynthesisReport, counted, percent, significant, synthesis_page,
};

/// Reconstructs a solid from a photograph of a plane section, with a report on its reliability
///
/// Segments PHOTO, unfolds its profiles to particles per volume, packs such particles without overlap into a periodic
/// box, gives them the photograph's colours, and synthesises the residual texture in three dimensions. Sections of the
/// solid are then measured, segmented like the photograph, and compared with it. Without PHOTO a built-in synthetic
/// test image is used, so that `stereology synthesize -o out` shows every step.
///
/// Writes into DIR: all files of `stereology segment`; densities.csv; packing.json; solid.json and texture.npy (the
/// solid, for slice, render, export and carve); volume.npy (one period, u8 colours); cube.png; comparison.png (the
/// photograph beside a section at the same scale); summary.json; and report.html, which is the file to open first.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology synthesize photo.jpg -o out --shape rock:1 --scale 0.05")]
pub struct Synthesize {
    /// Photograph of a plane section [default: the built-in sample]
    #[arg(value_name = "PHOTO")]
    pub photo: Option<PathBuf>,
    /// Take up the packing and the texture of an earlier run of `synthesize` where their inputs and options are the
    /// same; the result is the same as without
    #[arg(long, value_name = "DIR")]
    pub from: Option<PathBuf>,
    /// Folder for the results
    #[arg(short, long, value_name = "DIR")]
    pub output: Output,
    #[command(flatten)]
    pub segment: segment::Choices,
    #[command(flatten)]
    pub unfold: unfold::Choices,
    #[command(flatten)]
    pub solid: Solid,
    #[command(flatten)]
    pub texture: texture::Choices,
    /// How the residual volume is synthesised
    #[arg(long, value_enum, default_value_t = texture::Mode::Slices, help_heading = "Texture")]
    pub texture_mode: texture::Mode,
}

/// Size and packing of the solid.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Solid")]
#[group(id = "solid-choices")]
pub struct Solid {
    /// Side of the periodic box [default: 4 x the largest particle, or the side that holds 5000 particles if that is
    /// larger]
    #[arg(long = "box", value_name = "L", value_parser = positive, conflicts_with = "count")]
    pub side: Option<f64>,
    /// Number of particles, instead of --box
    #[arg(long, value_name = "N", value_parser = count)]
    pub count: Option<usize>,
    /// Index, from 0, of a --shape whose particles are voids, such as pores and bubbles; may be repeated
    #[arg(long = "void", value_name = "K")]
    pub voids: Vec<usize>,
    /// Fraction of the volume inside particles [default: the area fraction of the photograph]
    #[arg(long, value_name = "PHI", value_parser = share)]
    pub fraction: Option<f64>,
    /// Packing algorithm
    #[arg(long, value_enum, default_value_t = pack::Mode::Fast)]
    pub pack_mode: pack::Mode,
    /// Voxels of volume.npy along the box's longest side
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = count)]
    pub voxels: usize,
    /// Voxels of the residual volume's side, at the photograph's pixel scale
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = count)]
    pub texture_voxels: usize,
}

/// Largest number of voxels along a side; more would take longer than the rest of the synthesis, and `export` writes
/// them.
const MOST_VOXELS: usize = 2048;
/// With ten bins the profile sizes on sections of the solid would show steps. The report shows confidence intervals.
const DEFAULTS: Defaults = Defaults {
    bins: 16,
    replicates: Some(200),
};
/// White between photograph and section in comparison.png, in pixels.
const GAP: u32 = 8;
/// Normals of the sections in the report, and their offsets as fractions of the box's side; oblique, so that the period
/// is not visible.
const SECTIONS: [([f64; 3], f64); 2] = [([1.0, 2.0, 3.0], 0.37), ([-3.0, 2.0, 1.5], 0.61)];

/// JSON of `stereology synthesize`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SynthesizeFields {
    /// Unit of all lengths; null if it is not known, or pixels.
    unit: Option<&'static str>,
    /// The segmentation of the photograph.
    segment: SegmentFields,
    /// The particles per volume.
    unfold: UnfoldedPhoto,
    /// The packing.
    pack: PackedPhoto,
    /// The texture of binder and particles.
    texture: TexturedPhoto,
    /// Sections of the solid compared with the photograph.
    verification: VerificationFields,
    /// Particles per volume if all particles had one of several shapes: how far the shape decides the number.
    shapes: Vec<ShapeFields>,
    /// Whether the numbers and the appearance of the solid can be trusted.
    verdict: VerdictFields,
}

/// Particles per volume.
#[derive(Debug, Serialize, JsonSchema)]
pub struct UnfoldedPhoto {
    #[serde(flatten)]
    all: UnfoldingFields,
    /// Densities of each colour category, which sum to those of all particles.
    by_category: Vec<CategoryFields>,
    /// Probability of such an association of size and colour if they are independent; null if there is one colour
    /// category.
    size_and_colour_p_value: Option<f64>,
}

/// The packing of a solid.
#[derive(Debug, Serialize, JsonSchema)]
pub struct PackedPhoto {
    /// Number of particles.
    particles: usize,
    /// Sides of the periodic box.
    #[serde(rename = "box")]
    sides: [f64; 3],
    /// Fraction of the volume inside particles.
    fraction: f64,
    /// The fraction that was requested: the photograph's area fraction unless --fraction is given.
    requested_fraction: f64,
    /// The volume fraction of the unfolded densities.
    unfolded_fraction: f64,
    /// Factor from the unfolded densities to those of the packing.
    density_factor: f64,
    /// Largest penetration of two particles over the mean size, from a separate pass.
    max_overlap: f64,
    /// Whether no particles overlap.
    certified: bool,
    /// Iterations used.
    iterations: usize,
}

/// The resynthesised residual texture.
#[derive(Debug, Serialize, JsonSchema)]
pub struct TexturedPhoto {
    /// Voxels along z, y and x.
    shape: Vec<usize>,
    /// How the volume was synthesised.
    mode: &'static str,
    /// Number of iterations.
    iterations: usize,
    /// Synthesis of the binder's texture; null if it has a uniform colour.
    binder: Option<Resynthesis>,
    /// Synthesis of the particles' texture; null if it has a uniform colour.
    particles: Option<Resynthesis>,
}

/// A texture synthesis.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Resynthesis {
    /// Number of pyramid levels.
    levels: usize,
    /// Error of the sub-band statistics before each iteration.
    band_errors: Vec<f64>,
    /// Error of the statistics of the sections after each iteration.
    slice_errors: Vec<f64>,
    /// Error of the statistics of the sections of the result.
    final_error: f64,
    /// Whether further iterations would change little.
    settled: bool,
}

impl Resynthesis {
    fn of(report: &TextureReport) -> Self {
        Self {
            levels: report.levels,
            band_errors: report.band_errors.clone(),
            slice_errors: report.slice_errors.clone(),
            final_error: report.final_error,
            settled: report.has_settled(),
        }
    }
}

/// Sections of the solid compared with the photograph.
#[derive(Debug, Serialize, JsonSchema)]
pub struct VerificationFields {
    #[serde(flatten)]
    exact: ComparisonFields,
    /// The same for sections that were segmented like the photograph; null if there are none.
    resegmented: Option<ComparisonFields>,
    /// Outlines of the profiles on sections that were segmented like the photograph; null with fewer than 20 profiles
    /// of at least 50 pixels on a side.
    outlines: Option<OutlineFields>,
}

/// A comparison of sections with the photograph.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ComparisonFields {
    /// Profiles on the photograph.
    profiles_photo: usize,
    /// Profiles on the sections.
    profiles_synthetic: usize,
    /// Wasserstein-1 distance of profile sizes over their mean.
    size_w1: f64,
    /// Fraction of the photograph inside profiles.
    area_fraction_photo: f64,
    /// Fraction of the sections inside profiles.
    area_fraction_synthetic: f64,
    /// Wasserstein-1 distance of colours, encoded, 0 to 1.
    colour_distance: f64,
}

impl ComparisonFields {
    fn of(of: &Comparison) -> Self {
        Self {
            profiles_photo: of.profiles_photo,
            profiles_synthetic: of.profiles_synthetic,
            size_w1: of.size_w1,
            area_fraction_photo: of.area_fraction_photo,
            area_fraction_synthetic: of.area_fraction_synthetic,
            colour_distance: of.colour_distance,
        }
    }
}

impl Fields for SynthesizeFields {
    const COMMAND: &'static str = "synthesize";
}

impl Synthesize {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        everywhere.refuse_unit_of_pixels()?;
        let mut options = self.options(everywhere)?;
        if self.solid.voxels > MOST_VOXELS {
            return Err(Failure::run(format!(
                "--voxels {}: volume.npy would need {:.1e} bytes; give at most {MOST_VOXELS}, or use `stereology export` on the finished solid",
                self.solid.voxels,
                3.0 * (self.solid.voxels as f64).powi(3)
            )));
        }
        let folder = everywhere.outputs.folder(&self.output)?;
        let (read, name) = self.photo()?;
        options.segment.compression = read.compression;
        let types = self.types()?;
        let shapes = types.types().len();
        if let Some(none) = self.solid.voids.iter().find(|&&k| k >= shapes) {
            return Err(Failure::usage(format!(
                "--void {none}: the shapes are numbered from 0, and there are {shapes}"
            )));
        }
        let labels = self
            .segment
            .labels
            .as_ref()
            .map(|path| read.labels(path).at(path))
            .transpose()?;
        let (labels, mut noticed) = labels.map_or((None, Vec::new()), |read| (Some(read.labels), read.findings));
        let PhotoFile { photo, findings, .. } = read;
        noticed.extend(findings);
        let finished = match &self.from {
            Some(earlier) => files::steps::read(earlier).at(earlier)?,
            None => Finished::default(),
        };
        let stages = Stages::begin(everywhere.quiet);
        let synthesis = pipeline::synthesize_from(&photo, labels, &types, &options, &finished, &|step, done| {
            stages.at(step.name(), done)
        })
        .map_err(|error| self.failure(error))?;
        go_on()?;
        let mut answer = self.answer(&synthesis, everywhere)?;
        for finding in noticed {
            answer
                .notes
                .warn(crate::warnings::Warning::new(finding.code, finding.message));
        }
        self.write(&folder, &synthesis, &types, &name, everywhere, &stages)?;
        files::steps::write(folder.file(""), &synthesis).or_fail()?;
        write_json(&folder.file("summary.json"), &answer.summary())?;
        go_on()?;
        if self.from.is_some() {
            answer
                .notes
                .taken_up(synthesis.taken_up.iter().map(|step| step.name()).collect());
        }
        let seconds: Map<String, Value> = stages
            .end()
            .into_iter()
            .map(|(step, seconds)| (step.to_owned(), json!(seconds)))
            .collect();
        answer.notes.seconds(seconds);
        answer
            .notes
            .line(format!("open {}", self.output.name().join("report.html").display()));
        Ok(answer)
    }

    fn options(&self, everywhere: &Everywhere) -> Result<SynthesisOptions, Failure> {
        let seed = everywhere.seed;
        Ok(SynthesisOptions {
            pixel: everywhere.scale,
            segment: self.segment.options(seed),
            densities: self.unfold.density_options(1.0, seed, &DEFAULTS),
            extent: match (self.solid.side, self.solid.count) {
                (Some(side), _) => Extent::Side(side),
                (None, Some(count)) => Extent::Count(count),
                (None, None) => Extent::Auto,
            },
            fraction: self.solid.fraction,
            voids: self.solid.voids.clone(),
            pack: PackOptions::default()
                .with_mode(self.solid.pack_mode.by_default())
                .with_seed(seed),
            texture: self.texture.options(self.texture_mode, seed),
            texture_voxels: self.solid.texture_voxels,
            seed,
        })
    }

    /// The photograph and its name.
    fn photo(&self) -> Result<(PhotoFile, String), Failure> {
        let Some(path) = &self.photo else {
            let sample = PhotoFile {
                photo: sample::photo().or_fail()?,
                name: None,
                compression: None,
                turned: None,
                findings: Vec::new(),
            };
            return Ok((sample, "The built-in sample".to_owned()));
        };
        let name = path
            .file_name()
            .unwrap_or(path.as_os_str())
            .to_string_lossy()
            .into_owned();
        let options = PhotoOptions {
            exif: self.segment.exif.choice(),
            ..PhotoOptions::default()
        };
        Ok((read_photo_with(path, &options).at(path)?, name))
    }

    fn types(&self) -> Result<ParticleTypes, Failure> {
        if self.photo.is_some() || !self.unfold.shape.is_empty() {
            return self.unfold.types();
        }
        let shapes = sample::truth().or_fail()?.shapes;
        types(
            &shapes
                .into_iter()
                .map(|of| ShapeShare {
                    shape: of.shape,
                    fraction: Some(of.share),
                })
                .collect::<Vec<_>>(),
        )
    }

    fn failure(&self, error: SynthesisError) -> Failure {
        match error {
            SynthesisError::Pack(error) => pack_failure(error),
            // The photograph or its labels are unsuitable: name the file.
            SynthesisError::Segment(error) => match self.segment.labels.as_ref().or(self.photo.as_ref()) {
                Some(path) => Failure::run(format!("{}: {error}", path.display())),
                None => Failure::run(error),
            },
            other if other.is_cancelled() => Failure::stopped(),
            SynthesisError::Population(error @ PopulationFailure::Side { .. }) => {
                Failure::run(format!("{error} (--box or --count)"))
            }
            SynthesisError::Densities(error @ DensityError::NoProfiles(_)) => {
                Failure::run(format!("{error} (--edge-rule)"))
            }
            other => Failure::run(other),
        }
    }

    fn answer(&self, synthesis: &Synthesis, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let (packing, population, verification) = (&synthesis.packing, &synthesis.population, &synthesis.verification);
        let pixel = synthesis.details.residual.voxel;
        let sides: [f64; 3] = packing.sides().into();
        let fields = SynthesizeFields {
            unit: everywhere.unit.map(LengthUnit::symbol),
            segment: SegmentFields::of(&synthesis.segmentation, pixel, everywhere.unit),
            unfold: UnfoldedPhoto {
                all: UnfoldingFields::of(&synthesis.densities.all, self.unfold.kernel_name()),
                by_category: CategoryFields::of(&synthesis.densities),
                size_and_colour_p_value: Some(synthesis.densities.association.p_value).filter(|p| p.is_finite()),
            },
            pack: PackedPhoto {
                particles: packing.particles().len(),
                sides,
                fraction: packing.fraction(),
                requested_fraction: population.fraction,
                unfolded_fraction: population.unfolded_fraction,
                density_factor: population.density_factor,
                max_overlap: packing.max_overlap(),
                certified: packing.max_overlap() <= 0.0,
                iterations: packing.iterations(),
            },
            texture: TexturedPhoto {
                shape: synthesis.details.residual.binder.shape()[..3].to_vec(),
                mode: self.texture_mode.name(),
                iterations: self.texture.iterations,
                binder: synthesis.details.binder.as_ref().map(Resynthesis::of),
                particles: synthesis.details.particles.as_ref().map(Resynthesis::of),
            },
            verification: VerificationFields {
                exact: ComparisonFields::of(&verification.exact),
                resegmented: verification.resegmented.as_ref().map(ComparisonFields::of),
                outlines: verification.outlines.as_ref().map(OutlineFields::of),
            },
            shapes: synthesis.by_shape.iter().map(ShapeFields::of).collect(),
            verdict: VerdictFields::of(&synthesis.verdict),
        };
        let mut notes = Notes::default();
        for warning in &synthesis.findings {
            notes.warn(warning.clone());
        }
        let exact = &verification.exact;
        notes
            .line(format!(
                "{} profiles, {} of the area",
                exact.profiles_photo,
                percent(exact.area_fraction_photo)
            ))
            .line(format!(
                "{} particles in a box of {}, {} of the volume, none overlap",
                counted(packing.particles().len() as u64),
                sides.map(significant).join(" x "),
                percent(packing.fraction())
            ))
            .line(format!(
                "sections of the solid: area fraction {}, profile sizes differ by {} of their mean",
                percent(exact.area_fraction_synthetic),
                percent(exact.size_w1)
            ));
        Answer::new(&fields, notes)
    }

    fn write(
        &self,
        folder: &OutputFolder,
        synthesis: &Synthesis,
        types: &ParticleTypes,
        name: &str,
        everywhere: &Everywhere,
        stages: &Stages,
    ) -> Result<(), Failure> {
        let (solid, pixel) = (&synthesis.solid, everywhere.scale);
        let unit = everywhere.unit;
        let rule = self.segment.options(everywhere.seed).edge_rule;
        let head = files::profiles::head(&synthesis.segmentation, pixel, unit, rule);
        segment::write_files(folder, &synthesis.segmentation, pixel, &head)?;
        files::densities::write(folder.file("densities.csv"), &synthesis.densities, unit).or_fail()?;
        files::solid::write(folder.file(""), solid, Some(&synthesis.details.residual), types, unit).or_fail()?;
        solid
            .write_voxels(
                folder.file("volume.npy"),
                Format::Npy,
                &solid.voxel_grid(self.solid.voxels),
                Channel::Rgb,
                &|done| stages.at("voxels", done),
            )
            .or_fail()?;
        let _ = stages.at("pictures", 0.0);
        let pictures = self.pictures(synthesis, pixel)?;
        go_on()?;
        write_png(&folder.file("cube.png"), &pictures.cube)?;
        if let Some(section) = pictures.sections.first() {
            write_png(
                &folder.file("comparison.png"),
                &beside(synthesis.segmentation.photo(), section),
            )?;
        }
        let remarks = synthesis.findings.iter().map(|warning| Remark {
            code: warning.code.to_owned(),
            message: warning.message.clone(),
            advice: advice(warning.code).map(str::to_owned),
        });
        let invocation = Invocation {
            photo_name: name.to_owned(),
            command: everywhere.invocation.command.clone(),
            parameters: everywhere.invocation.parameters.clone(),
            unit,
        };
        let report = SynthesisReport::new(synthesis, types, pictures, invocation, remarks.collect());
        write_text(&folder.file("report.html"), &synthesis_page(&report).or_fail()?)
    }

    fn pictures(&self, synthesis: &Synthesis, pixel: f64) -> Result<SolidImages, Failure> {
        let solid = &synthesis.solid;
        let (width, height) = synthesis.segmentation.photo().dimensions();
        let mut pictures = SolidImages {
            cube: cube(solid)?,
            sections: Vec::new(),
        };
        for (normal, share) in SECTIONS {
            let plane = SlicePlane::oblique(normal.into(), share * solid.period().sides().x).or_fail()?;
            pictures
                .sections
                .push(solid.slice(&plane, width, height, pixel).or_fail()?);
        }
        Ok(pictures)
    }
}

/// One period of the solid as a block.
fn cube(solid: &stereology::volume::Solid) -> Result<RgbImage, Failure> {
    let sides = solid.period().sides();
    let block = TriangleMesh::cuboid(sides.into()).mapped(|p| p + 0.5 * sides);
    let BlockOptions {
        camera,
        render: picture,
    } = BlockOptions::default();
    render_solid(
        solid,
        &block,
        &|p| *p,
        &camera,
        &picture,
        &|_| ControlFlow::Continue(()),
    )
    .or_fail()
}

/// Two images side by side.
fn beside(left: &RgbImage, right: &RgbImage) -> RgbImage {
    let height = left.height().max(right.height());
    let mut both = RgbImage::from_pixel(left.width() + GAP + right.width(), height, Rgb([255; 3]));
    imageops::replace(&mut both, left, 0, 0);
    imageops::replace(&mut both, right, i64::from(left.width() + GAP), 0);
    both
}
