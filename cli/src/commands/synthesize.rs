//! `stereology synthesize`: a photograph in, a solid out.

use std::ops::ControlFlow;
use std::path::PathBuf;

use clap::Args;
use image::{Rgb, RgbImage, imageops};
use serde_json::{Map, Value, json};
use stereology::anneal::PackOptions;
use stereology::files;
use stereology::grid::Format;
use stereology::pictures::picture_of_solid;
use stereology::pipeline::{self, Comparison, Extent, ParticleTypes, Synthesis, SynthesisError, SynthesisOptions};
use stereology::pyramid::TextureReport;
use stereology::render::BlockOptions;
use stereology::sample;
use stereology::segment::{read_labels_for, read_photo};
use stereology::shape::TriangleMesh;
use stereology::volume::{Channel, SlicePlane};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::commands::pack::pack_failure;
use crate::commands::unfold::{Defaults, types};
use crate::commands::{pack, segment, texture, unfold};
use crate::failure::{Explain, Failure};
use crate::numbers::{counted, percent, significant};
use crate::outputs::{OutputFolder, write_json, write_png, write_text};
use crate::progress::{Stages, go_on};
use crate::report::{self, Pictures, report_input};
use crate::values::{ShapeShare, count, positive, share};

/// From a photograph of a cut to the solid it came from, and a report that tells whether to trust it
///
/// Segments PHOTO, unfolds its profiles to particles per volume, packs such particles without overlap into a box that repeats, gives them the photograph's
/// colours, and resynthesises the residual texture in three dimensions. Then sections of the solid are measured and segmented like the photograph and
/// compared with it. Without PHOTO a built-in sample is used: `stereology synthesize -o out` shows all there is to see.
///
/// Writes into DIR: all files of `stereology segment`; densities.csv; packing.json; solid.json and texture.npy (the solid, opened again by slice, render and
/// export); volume.npy (one period, u8 colours); cube.png; comparison.png (photograph beside a section at the same scale); summary.json; and report.html,
/// which is the file to open first.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology synthesize photo.jpg -o out --shape rock:1 --scale 0.05")]
pub struct Synthesize {
    /// Photograph of a cut [default: the built-in sample]
    #[arg(value_name = "PHOTO")]
    pub photo: Option<PathBuf>,
    /// Folder for the results
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    #[command(flatten)]
    pub segment: segment::Choices,
    #[command(flatten)]
    pub unfold: unfold::Choices,
    #[command(flatten)]
    pub solid: Solid,
    #[command(flatten)]
    pub texture: texture::Choices,
    /// How the residual volume is made
    #[arg(long, value_enum, default_value_t = texture::Mode::Slices, help_heading = "Texture")]
    pub texture_mode: texture::Mode,
}

/// How large the solid is and how it is packed.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Solid")]
#[group(id = "solid-choices")]
pub struct Solid {
    /// Side of the box that repeats [default: 4 x the largest particle, or more: enough for 5000 particles]
    #[arg(long = "box", value_name = "L", value_parser = positive, conflicts_with = "count")]
    pub side: Option<f64>,
    /// Number of particles, instead of --box
    #[arg(long, value_name = "N", value_parser = count)]
    pub count: Option<usize>,
    /// Number of a --shape, from 0, whose particles are voids: pores, bubbles; may be repeated
    #[arg(long = "void", value_name = "K")]
    pub voids: Vec<usize>,
    /// Fraction of the volume inside particles [default: the photograph's area fraction]
    #[arg(long, value_name = "PHI", value_parser = share)]
    pub fraction: Option<f64>,
    /// How overlaps are removed
    #[arg(long, value_enum, default_value_t = pack::Mode::Fast)]
    pub pack_mode: pack::Mode,
    /// Voxels of volume.npy along the box's longest side
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = count)]
    pub voxels: usize,
    /// Voxels of the residual volume's side, at the photograph's pixel scale
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = count)]
    pub texture_voxels: usize,
}

/// More voxels along a side would take longer than the whole solid: a matter for `export`.
const MOST_VOXELS: usize = 2048;
/// Ten bins leave steps in the profile sizes of the solid's sections; the report shows intervals.
const DEFAULTS: Defaults = Defaults {
    bins: 16,
    replicates: Some(200),
};
/// White between photograph and section in comparison.png, in pixels.
const GAP: u32 = 8;
/// Normals of the sections that the report shows, and their offsets as fractions of the box's side: aslant, so that the solid's period does not show.
const SECTIONS: [([f64; 3], f64); 2] = [([1.0, 2.0, 3.0], 0.37), ([-3.0, 2.0, 1.5], 0.61)];

impl Synthesize {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let options = self.options(everywhere)?;
        if self.solid.voxels > MOST_VOXELS {
            return Err(Failure::run(format!(
                "--voxels {}: volume.npy would need {:.1e} bytes; ask for at most {MOST_VOXELS}, or export a finished solid",
                self.solid.voxels,
                3.0 * (self.solid.voxels as f64).powi(3)
            )));
        }
        let folder = OutputFolder::begin(&self.output, everywhere.force)?;
        let (photo, name) = self.photo()?;
        let types = self.types()?;
        let shapes = types.types().len();
        if let Some(none) = self.solid.voids.iter().find(|&&k| k >= shapes) {
            return Err(Failure::usage(format!(
                "--void {none}: there are {shapes} shapes, counted from 0"
            )));
        }
        let labels = self
            .segment
            .labels
            .as_ref()
            .map(|path| read_labels_for(path, (photo.height() as usize, photo.width() as usize)).at(path))
            .transpose()?;
        let (labels, noticed) = labels.map_or((None, Vec::new()), |read| (Some(read.labels), read.findings));
        let stages = Stages::begin(everywhere.quiet);
        let synthesis = pipeline::synthesize(&photo, labels, &types, &options, &|step, done| {
            stages.at(step.name(), done)
        })
        .map_err(|error| self.failure(error))?;
        go_on()?;
        let mut answer = self.answer(&synthesis);
        for finding in noticed {
            answer.warn(crate::warnings::Warning::new(finding.code, finding.message));
        }
        self.write(&folder, &synthesis, &types, &name, everywhere, &stages)?;
        write_json(&folder.file("summary.json"), &answer.summary())?;
        go_on()?;
        folder.publish()?;
        let seconds: Map<String, Value> = stages
            .end()
            .into_iter()
            .map(|(step, seconds)| (step.to_owned(), json!(seconds)))
            .collect();
        answer.seconds(seconds);
        answer.line(format!("open {}", self.output.join("report.html").display()));
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
    fn photo(&self) -> Result<(RgbImage, String), Failure> {
        let Some(path) = &self.photo else {
            return Ok((sample::photo().or_fail()?, "The built-in sample".to_owned()));
        };
        let name = path
            .file_name()
            .unwrap_or(path.as_os_str())
            .to_string_lossy()
            .into_owned();
        Ok((read_photo(path).at(path)?, name))
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
            // What was wrong with the photograph or its labels: they are named.
            SynthesisError::Segment(error) => match self.segment.labels.as_ref().or(self.photo.as_ref()) {
                Some(path) => Failure::run(format!("{}: {error}", path.display())),
                None => Failure::run(error),
            },
            other if other.is_cancelled() => Failure::stopped(),
            other => Failure::run(other),
        }
    }

    fn answer(&self, synthesis: &Synthesis) -> Answer {
        let object = |fields: Vec<(&'static str, Value)>| -> Value {
            Value::Object(
                fields
                    .into_iter()
                    .map(|(name, value)| (name.to_owned(), value))
                    .collect(),
            )
        };
        let figures = |of: &Comparison| {
            vec![
                ("profiles_photo", json!(of.profiles_photo)),
                ("profiles_synthetic", json!(of.profiles_synthetic)),
                ("size_w1", json!(of.size_w1)),
                ("area_fraction_photo", json!(of.area_fraction_photo)),
                ("area_fraction_synthetic", json!(of.area_fraction_synthetic)),
                ("colour_distance", json!(of.colour_distance)),
            ]
        };
        let (packing, population, verification) = (&synthesis.packing, &synthesis.population, &synthesis.verification);
        let mut compared = figures(&verification.exact);
        compared.push((
            "resegmented",
            verification
                .resegmented
                .as_ref()
                .map_or(Value::Null, |again| object(figures(again))),
        ));
        let report = |of: &Option<TextureReport>| {
            of.as_ref().map_or(
                Value::Null,
                |of| {
                    json!({
                        "levels": of.levels, "band_errors": of.band_errors, "slice_errors": of.slice_errors, "final_error": of.final_error,
                        "settled": of.has_settled(),
                    })
                },
            )
        };
        let pixel = synthesis.details.residual.voxel;
        let sides: [f64; 3] = packing.sides().into();
        let mut unfolded = unfold::figures(&synthesis.densities.all, self.unfold.kernel_name());
        unfolded.push((
            "size_and_colour_p_value",
            json!(synthesis.densities.association.p_value),
        ));
        let mut answer = Answer::new("synthesize");
        answer
            .field("segment", object(segment::figures(&synthesis.segmentation, pixel)))
            .field("unfold", object(unfolded))
            .field(
                "pack",
                json!({
                    "particles": packing.particles().len(),
                    "box": sides,
                    "fraction": packing.fraction(),
                    "requested_fraction": population.fraction,
                    "unfolded_fraction": population.unfolded_fraction,
                    "density_factor": population.density_factor,
                    "max_overlap": packing.max_overlap(),
                    "certified": packing.max_overlap() <= 0.0,
                    "iterations": packing.iterations(),
                }),
            )
            .field(
                "texture",
                json!({
                    "shape": synthesis.details.residual.binder.shape()[..3].to_vec(),
                    "mode": self.texture_mode.name(),
                    "iterations": self.texture.iterations,
                    "binder": report(&synthesis.details.binder),
                    "particles": report(&synthesis.details.particles),
                }),
            )
            .field("verification", object(compared))
            .field("verdict", json!(synthesis.verdict));
        for warning in &synthesis.findings {
            answer.warn(warning.clone());
        }
        let exact = &verification.exact;
        answer
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
                "sections of the solid: area fraction {}, profile sizes apart by {} of their mean",
                percent(exact.area_fraction_synthetic),
                percent(exact.size_w1)
            ));
        answer
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
        segment::write_files(folder, &synthesis.segmentation, pixel)?;
        files::densities::write(folder.file("densities.csv"), &synthesis.densities).or_fail()?;
        files::solid::write(folder.file(""), solid, &synthesis.details.residual, types).or_fail()?;
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
        let input = report_input(synthesis, types, pictures, name, &everywhere.invocation);
        write_text(&folder.file("report.html"), &report::page(&input))
    }

    fn pictures(&self, synthesis: &Synthesis, pixel: f64) -> Result<Pictures, Failure> {
        let solid = &synthesis.solid;
        let (width, height) = synthesis.segmentation.photo().dimensions();
        let mut pictures = Pictures {
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
    picture_of_solid(
        solid,
        &block,
        &|p| *p,
        &camera,
        &picture,
        &|_| ControlFlow::Continue(()),
    )
    .or_fail()
}

/// Two pictures of one height side by side.
fn beside(left: &RgbImage, right: &RgbImage) -> RgbImage {
    let height = left.height().max(right.height());
    let mut both = RgbImage::from_pixel(left.width() + GAP + right.width(), height, Rgb([255; 3]));
    imageops::replace(&mut both, left, 0, 0);
    imageops::replace(&mut both, right, i64::from(left.width() + GAP), 0);
    both
}
