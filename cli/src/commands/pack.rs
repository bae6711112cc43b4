//! `stereology pack`: particles without overlap in a periodic box.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::Serialize;
use stereology::anneal::{
    self, Grain, PackError, PackOptions, Packing, SizeDensities, SizeInBin, box_for_fraction, count_to_fill,
    grains_from_densities, lognormal_sizes, mix, pack, populate, scale_to_fraction, total_volume,
};
use stereology::files::ReadTable;
use stereology::files::densities::{self, DensityHistogram};
use stereology::files::packing::PackingFile;
use stereology::files::profiles::{self, Headless, ProfileReading, ProfileRow};
use stereology::grid::LengthUnit;
use stereology::shape::{Arrangement, PeriodicBox, UnitBody};

use crate::answer::{Answer, Fields, Notes};
use crate::commands::pack_quality::{self, QualityFields};
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure, body};
use crate::outputs::{Output, Outputs, write_png, write_text};
use crate::particle_files::ParticleFormat;
use crate::particle_surfaces;
use crate::progress::{Step, go_on};
use crate::values::{BoxSides, ShapeShare, count, positive, share, shares};
use stereology_report::{percent, significant};

/// Packs particles of given sizes into a periodic box without overlap
///
/// Sizes follow a table of number densities (`stereology unfold -o`) or a lognormal distribution, are all 1, or are
/// listed in a table. The number of particles and the fraction of the volume they fill are met exactly. A separate
/// pass certifies that no particles overlap. A fraction that cannot be reached is an error, which reports the remaining
/// overlap.
///
/// Writes packing.json: the box, the shapes, and for each particle its shape, size, category, position (centre of
/// volume) and orientation (quaternion w,x,y,z).
#[derive(Args, Debug)]
#[command(
    after_long_help = "Example: stereology pack --lognormal 0.3 --count 1000 --fraction 0.5 -o packing.json --also packing.vtp"
)]
pub struct Pack {
    #[command(flatten)]
    pub sizes: Sizes,
    /// Number of particles [default: 1000]
    #[arg(long, value_name = "N", value_parser = count)]
    pub count: Option<usize>,
    /// Side of the box, or its three sides, instead of --count
    #[arg(long = "box", value_name = "L[,L,L]", conflicts_with = "count")]
    pub side: Option<BoxSides>,
    /// Fraction of the volume inside particles [default: that of the densities, otherwise 0.5]
    #[arg(long, value_name = "PHI", value_parser = share)]
    pub fraction: Option<f64>,
    /// Shape of the particles, and its fraction of their number; may be repeated [default: sphere]
    #[arg(long, value_name = "SHAPE[=F]")]
    pub shape: Vec<ShapeShare>,
    /// Packing algorithm
    #[arg(long, value_enum, default_value_t = Mode::Fast)]
    pub mode: Mode,
    /// Shapes that replace meshes during packing; the certificate always applies to the meshes themselves
    #[arg(long, value_enum, default_value_t = Proxy::Parts)]
    pub proxy: Proxy,
    /// Largest volume by which the convex parts of a non-convex shape can exceed it, as a fraction of its volume, 0.005
    /// to 1
    #[arg(long, value_name = "FRACTION", default_value_t = 0.1)]
    pub tolerance: f64,
    /// Maximum number of iterations; with --mode sequential, of positions tried for one particle
    #[arg(long, value_name = "N", default_value_t = 20_000, value_parser = count)]
    pub iterations: usize,
    /// Leave out rows of --sizes with invalid values (empty, words, not above zero), which are counted in a warning,
    /// instead of refusing the table; rows whose size is NaN are always left out
    #[arg(long)]
    pub skip_invalid: bool,
    /// Also compute statistics of the packing: radial distribution, order, orientations, sections
    #[arg(long)]
    pub quality: bool,
    /// File for the packing (JSON)
    #[arg(short, long, value_name = "packing.json")]
    pub output: Output,
    /// Also write packing.csv, packing.xyz (OVITO) or packing.vtp (ParaView, one point per particle); may be repeated
    #[arg(long, value_name = "FILE")]
    pub also: Vec<Output>,
    /// Also write the surfaces of the particles for ParaView; every face has the number, size, shape and category of
    /// its particle
    #[arg(long, value_name = "packing.vtp")]
    pub surfaces: Option<Output>,
    /// Also write an image of the packing (PNG)
    #[arg(long, value_name = "PNG")]
    pub picture: Option<Output>,
    /// Also write the energy of the overlaps at each iteration (CSV)
    #[arg(long, value_name = "CSV")]
    pub trace: Option<Output>,
}

/// Source of the sizes.
#[derive(Args, Debug)]
#[group(required = true, multiple = false)]
pub struct Sizes {
    /// Table of number densities, as `stereology unfold -o` writes it
    #[arg(long, value_name = "FILE")]
    pub densities: Option<PathBuf>,
    /// Lognormal sizes with median 1 and this standard deviation of the logarithm
    #[arg(long, value_name = "SIGMA", value_parser = positive)]
    pub lognormal: Option<f64>,
    /// All sizes are 1
    #[arg(long)]
    pub constant: bool,
    /// Table with a column `size` and one row per particle (CSV), or a single column without a header
    #[arg(long, value_name = "CSV")]
    pub sizes: Option<PathBuf>,
}

/// The table of the sizes, with its file.
enum SizeTable<'a> {
    /// None is given.
    None,
    /// Number densities.
    Densities(&'a Path, ReadTable<DensityHistogram>),
    /// A row per particle.
    Sizes(&'a Path, ReadTable<ProfileRow>),
}

/// Packing algorithm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Mode {
    /// Descent with momentum on the energy of overlaps
    Fast,
    /// The relaxation of the paper
    Paper,
    /// Simulated annealing with translations, rotations, swaps and re-insertions, then a quench
    Anneal,
    /// Random sequential addition, the largest particles first; reaches a fraction of about 0.35
    Sequential,
}

impl Mode {
    fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Paper => "paper",
            Self::Anneal => "anneal",
            Self::Sequential => "sequential",
        }
    }

    /// The library's mode, with its default limits.
    pub fn by_default(self) -> anneal::Mode {
        match self {
            Self::Fast => anneal::Mode::fast(),
            Self::Paper => anneal::Mode::paper(),
            Self::Anneal => anneal::Mode::anneal(),
            Self::Sequential => anneal::Mode::sequential(),
        }
    }

    /// The library's mode with `--iterations`.
    fn limited(self, iterations: usize) -> anneal::Mode {
        let swelling = None;
        match self {
            Self::Fast => anneal::Mode::Fast { iterations, swelling },
            Self::Paper => anneal::Mode::Paper { iterations, swelling },
            Self::Anneal => anneal::Mode::Anneal { iterations, swelling },
            Self::Sequential => anneal::Mode::Sequential { tries: iterations },
        }
    }
}

/// Shapes that replace meshes during packing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Proxy {
    /// The meshes themselves, or their convex parts
    Parts,
    /// Their convex hulls
    Hull,
    /// Polyhedra with 26 faces around them
    Outline,
}

/// Explains a failed packing.
pub fn pack_failure(error: PackError) -> Failure {
    match error {
        PackError::Cancelled => Failure::stopped(),
        other => Failure::run(other),
    }
}

/// The shapes that are packed.
struct Shapes {
    names: Vec<String>,
    shares: Vec<f64>,
    bodies: Vec<UnitBody>,
}

/// The particles to pack, and their box.
struct Population {
    grains: Vec<Grain>,
    period: PeriodicBox,
    /// Number of particles expected from the densities in the box, before rounding.
    expected: Option<f64>,
}

impl Population {
    fn listed(grains: Vec<Grain>, period: PeriodicBox) -> Self {
        Self {
            grains,
            period,
            expected: None,
        }
    }
}

/// Where to write.
struct Files {
    packing: PathBuf,
    also: Vec<(ParticleFormat, PathBuf)>,
    surfaces: Option<PathBuf>,
    picture: Option<PathBuf>,
    trace: Option<PathBuf>,
}

impl Files {
    fn write(&self, packing: &Packing, names: Vec<String>, unit: Option<LengthUnit>) -> Result<(), Failure> {
        for (format, path) in &self.also {
            format.write(path, packing, unit)?;
        }
        if let Some(path) = &self.surfaces {
            particle_surfaces::write(path, packing.bodies(), packing.particles())?;
        }
        if let Some(path) = &self.picture {
            write_png(path, &pack_quality::picture(packing).or_fail()?)?;
        }
        if let Some(path) = &self.trace {
            write_text(path, &pack_quality::trace(packing))?;
        }
        PackingFile::new(names, packing.particles(), packing.period())
            .with_unit(unit)
            .write(&self.packing)
            .at(&self.packing)
    }
}

/// JSON of `stereology pack`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct PackFields {
    /// Number of particles.
    particles: usize,
    /// Sides of the periodic box.
    #[serde(rename = "box")]
    sides: [f64; 3],
    /// Unit of all lengths; null if it is not known.
    unit: Option<&'static str>,
    /// Fraction of the volume inside particles.
    fraction: f64,
    /// The fraction that was requested.
    requested_fraction: f64,
    /// Largest penetration of two particles over the mean size, from a separate pass.
    max_overlap: f64,
    /// Whether no particles overlap.
    certified: bool,
    /// Iterations used.
    iterations: usize,
    /// Packing algorithm.
    mode: &'static str,
    /// Energy of the overlaps after the last iteration; null if there was none.
    final_energy: Option<f64>,
    /// Number of particles expected from the densities, before rounding; with --densities.
    #[serde(skip_serializing_if = "Option::is_none")]
    expected_particles: Option<f64>,
    /// Statistics of the packing; with --quality.
    #[serde(skip_serializing_if = "Option::is_none")]
    quality: Option<QualityFields>,
}

impl Fields for PackFields {
    const COMMAND: &'static str = "pack";
}

impl Pack {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let options = PackOptions::default()
            .with_mode(self.mode.limited(self.iterations))
            .with_proxy(match self.proxy {
                Proxy::Parts => anneal::Proxy::Parts,
                Proxy::Hull => anneal::Proxy::Hull,
                Proxy::Outline => anneal::Proxy::Outline,
            })
            .with_tolerance(self.tolerance)
            .with_seed(everywhere.seed);
        if !(0.005..=1.0).contains(&self.tolerance) {
            return Err(Failure::usage("--tolerance: a fraction from 0.005 to 1 is needed"));
        }
        let files = self.files(&everywhere.outputs)?;
        let started = Instant::now();
        let mut table = self.table(everywhere)?;
        let unit = unit(&table, everywhere)?;
        let findings = match &mut table {
            SizeTable::None => Vec::new(),
            SizeTable::Densities(_, of) => std::mem::take(&mut of.findings),
            SizeTable::Sizes(_, of) => std::mem::take(&mut of.findings),
        };
        let Shapes { names, shares, bodies } = self.shapes()?;
        let Population {
            grains,
            period,
            expected,
        } = self.grains(table, &bodies, &shares, everywhere)?;
        let requested = total_volume(&bodies, &grains).or_fail()? / period.volume();
        let step = Step::begin("packing", everywhere.quiet);
        let progress = |done: f64| step.at(done);
        let packing = pack(
            &Arrangement::new(&bodies[..], populate(&grains, &period, everywhere.seed), period).or_fail()?,
            &options,
            &progress,
        )
        .map_err(pack_failure)?;
        drop(step);
        go_on()?;
        files.write(&packing, names, unit)?;

        let sides: [f64; 3] = packing.sides().into();
        let mut notes = notes(&packing, started.elapsed(), expected);
        findings.into_iter().for_each(|finding| {
            notes.warn(finding);
        });
        let fields = PackFields {
            particles: packing.particles().len(),
            sides,
            unit: unit.map(LengthUnit::symbol),
            fraction: packing.fraction(),
            requested_fraction: self.fraction.unwrap_or(requested),
            max_overlap: packing.max_overlap(),
            certified: packing.max_overlap() <= 0.0,
            iterations: packing.iterations(),
            mode: self.mode.name(),
            final_energy: packing.energies().last().copied(),
            expected_particles: expected,
            quality: self
                .quality
                .then(|| pack_quality::quality(&packing, everywhere.seed, &mut notes)),
        };
        Answer::new(&fields, notes)
    }

    fn files(&self, outputs: &Outputs) -> Result<Files, Failure> {
        let file = |output: &Option<Output>| output.as_ref().map(|output| outputs.file(output)).transpose();
        if let Some(output) = &self.surfaces {
            particle_surfaces::check_ending(output.name())?;
        }
        let also = self
            .also
            .iter()
            .map(|output| Ok((ParticleFormat::of(output.name())?, outputs.file(output)?)));
        Ok(Files {
            packing: outputs.file(&self.output)?,
            also: also.collect::<Result<_, Failure>>()?,
            surfaces: file(&self.surfaces)?,
            picture: file(&self.picture)?,
            trace: file(&self.trace)?,
        })
    }

    /// Reads the table of sizes or densities.
    fn table(&self, everywhere: &Everywhere) -> Result<SizeTable<'_>, Failure> {
        if self.skip_invalid && self.sizes.sizes.is_none() {
            return Err(Failure::usage("--skip-invalid is for the rows of --sizes"));
        }
        if let Some(path) = &self.sizes.densities {
            return Ok(SizeTable::Densities(path, densities::read(path).or_fail()?));
        }
        let Some(path) = &self.sizes.sizes else {
            return Ok(SizeTable::None);
        };
        let reading = ProfileReading {
            unit: everywhere.unit.filter(|_| everywhere.scale_given.is_none()),
            skip_invalid: self.skip_invalid,
            headless: Headless::Sizes,
        };
        Ok(SizeTable::Sizes(path, profiles::read(path, &reading).or_fail()?))
    }

    fn shapes(&self) -> Result<Shapes, Failure> {
        let sphere = [ShapeShare {
            shape: "sphere".to_owned(),
            fraction: None,
        }];
        let shapes = if self.shape.is_empty() {
            &sphere[..]
        } else {
            &self.shape
        };
        Ok(Shapes {
            names: shapes.iter().map(|shape| shape.shape.clone()).collect(),
            shares: shares(shapes).or_usage("--shape")?,
            bodies: shapes
                .iter()
                .map(|shape| Ok(UnitBody::new(&body(&shape.shape)?)))
                .collect::<Result<_, Failure>>()?,
        })
    }

    /// The particles' sizes, shapes and categories, and their box.
    fn grains(
        &self,
        table: SizeTable<'_>,
        bodies: &[UnitBody],
        shares: &[f64],
        everywhere: &Everywhere,
    ) -> Result<Population, Failure> {
        let seed = everywhere.seed;
        let scale = everywhere.scale;
        if let SizeTable::Densities(path, histograms) = table {
            return self.grains_of_table(path, histograms.rows, bodies, shares, everywhere);
        }
        let fraction = self.fraction.unwrap_or(0.5);
        let cube = |side: BoxSides| PeriodicBox::new(Vector3::from(side.0) * scale).or_usage("--box");
        if let SizeTable::Sizes(table, ReadTable { rows, .. }) = table {
            if self.count.is_some() {
                return Err(Failure::usage(
                    "--count cannot be combined with --sizes: every row of the table is a particle",
                ));
            }
            let mut grains = Vec::new();
            let drawn = mix(
                &rows.iter().map(|row| row.size * scale).collect::<Vec<_>>(),
                shares,
                seed,
            )
            .or_fail()?;
            for (row, drawn) in rows.iter().zip(drawn) {
                let shape = row.kind.unwrap_or(drawn.shape);
                if shape >= bodies.len() {
                    return Err(no_such_shape(table, shape, bodies.len()));
                }
                grains.push(Grain {
                    shape,
                    category: row.category.unwrap_or(0),
                    ..drawn
                });
            }
            let period = match (self.side, self.fraction) {
                (Some(side), None) => cube(side)?,
                (Some(_), Some(_)) => {
                    return Err(Failure::usage(
                        "--box and --fraction cannot both be combined with --sizes: give one of them",
                    ));
                }
                (None, _) => box_for_fraction(bodies, &grains, fraction).or_fail()?,
            };
            return Ok(Population::listed(grains, period));
        }
        let sizes = |count: usize| match self.sizes.lognormal {
            Some(sigma) => lognormal_sizes(count, sigma, seed).or_fail(),
            None => Ok(vec![1.0; count]),
        };
        let grains = |count: usize| {
            let sizes: Vec<f64> = sizes(count)?.iter().map(|size| size * scale).collect();
            mix(&sizes, shares, seed).or_fail()
        };
        let Some(side) = self.side else {
            let grains = grains(self.count.unwrap_or(1000))?;
            let period = box_for_fraction(bodies, &grains, fraction).or_fail()?;
            return Ok(Population::listed(grains, period));
        };
        let period = cube(side)?;
        let count = count_to_fill(bodies, &grains(1000)?, &period, fraction).or_fail()?;
        let mut grains = grains(count)?;
        // A whole number of particles gives only almost the requested fraction: all sizes are scaled by one factor.
        scale_to_fraction(bodies, &mut grains, &period, fraction).or_fail()?;
        Ok(Population::listed(grains, period))
    }

    fn grains_of_table(
        &self,
        table: &Path,
        densities: Vec<DensityHistogram>,
        bodies: &[UnitBody],
        shares: &[f64],
        everywhere: &Everywhere,
    ) -> Result<Population, Failure> {
        let mut histograms = Vec::new();
        for histogram in densities {
            match histogram.shape {
                Some(shape) if shape >= bodies.len() => return Err(no_such_shape(table, shape, bodies.len())),
                Some(shape) => histograms.push((shape, histogram)),
                None => {
                    for (shape, share) in shares.iter().enumerate() {
                        let mut part = histogram.clone();
                        part.number_density.iter_mut().for_each(|n| *n *= share);
                        histograms.push((shape, part));
                    }
                }
            }
        }
        let total: f64 = histograms
            .iter()
            .flat_map(|(_, histogram)| &histogram.number_density)
            .sum();
        let volume = match self.side {
            Some(BoxSides(sides)) => sides.iter().product(),
            None => self.count.unwrap_or(1000) as f64 / total,
        };
        let densities: Vec<SizeDensities<'_>> = histograms
            .iter()
            .map(|(shape, histogram)| SizeDensities {
                shape: *shape,
                category: histogram.category,
                edges: &histogram.edges,
                number_density: &histogram.number_density,
            })
            .collect();
        let mut grains = grains_from_densities(&densities, volume, SizeInBin::Spread, everywhere.seed).at(table)?;
        if grains.is_empty() {
            return Err(Failure::run(format!(
                "{}: the box holds less than one particle; take a larger --box",
                table.display()
            )));
        }
        let period = match (self.side, self.fraction) {
            (None, Some(fraction)) => box_for_fraction(bodies, &grains, fraction).or_fail()?,
            (side, fraction) => {
                let sides = side.map_or([volume.cbrt(); 3], |side| side.0);
                let period = PeriodicBox::new(Vector3::from(sides)).or_usage("--box")?;
                if let Some(fraction) = fraction {
                    scale_to_fraction(bodies, &mut grains, &period, fraction).or_fail()?;
                }
                period
            }
        };
        Ok(Population {
            grains,
            period,
            expected: Some(total * volume),
        })
    }
}

/// The unit of the table of sizes or densities, or of the options.
fn unit(table: &SizeTable<'_>, everywhere: &Everywhere) -> Result<Option<LengthUnit>, Failure> {
    let (path, head) = match table {
        SizeTable::None => return Ok(everywhere.unit),
        SizeTable::Densities(path, of) => (path, &of.head),
        SizeTable::Sizes(path, of) => (path, &of.head),
    };
    match (head.unit.unit(), everywhere.unit) {
        (Some(stated), Some(given)) if stated != given => Err(Failure::run(format!(
            "--unit {given} contradicts {}, whose lengths are in {stated} (unit={stated}); leave the option out, or correct the table",
            path.display()
        ))),
        (Some(stated), _) if everywhere.scale_given.is_some() => Err(Failure::run(format!(
            "--scale contradicts {}: its lengths are in {stated} already (unit={stated})",
            path.display()
        ))),
        (stated, given) => Ok(stated.or(given)),
    }
}

fn no_such_shape(table: &Path, shape: usize, shapes: usize) -> Failure {
    Failure::run(format!(
        "{}: a row has type {shape}, but there are {shapes} --shape (types are numbered from 0)",
        table.display()
    ))
}

/// What the packing is like.
fn notes(packing: &Packing, time: Duration, expected: Option<f64>) -> Notes {
    let sides: [f64; 3] = packing.sides().into();
    let mut notes = Notes::default();
    notes
        .seconds(time.as_secs_f64())
        .line(format!(
            "{} particles in a box of {}",
            packing.particles().len(),
            sides.map(significant).join(" x ")
        ))
        .line(format!(
            "{} of the volume; no two overlap (certified by a separate pass)",
            percent(packing.fraction())
        ))
        .line(format!(
            "{} iterations, {} s",
            packing.iterations(),
            significant(time.as_secs_f64())
        ));
    if let Some(expected) = expected {
        notes.line(format!(
            "{} expected from the densities; cumulative numbers are rounded to whole particles",
            significant(expected)
        ));
    }
    notes
}
