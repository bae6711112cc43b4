//! `stereology pack`: particles without overlap in a box that repeats.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use nalgebra::Vector3;
use stereology::anneal::{
    self, Grain, PackError, PackOptions, SizeDensities, SizeInBin, box_for_fraction, count_to_fill,
    grains_from_densities, lognormal_sizes, mix, pack, populate, scale_to_fraction, total_volume,
};
use stereology::files::PackingFile;
use stereology::shape::{PeriodicBox, UnitBody};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::density_table::read_densities;
use crate::failure::{Explain, Failure, body};
use crate::numbers::{percent, significant};
use crate::outputs::check_file;
use crate::particle_files::ParticleFormat;
use crate::profile_table::read_profiles;
use crate::progress::{Step, go_on};
use crate::values::{ShapeShare, count, positive, share, shares};

/// Packs particles of given sizes into a box that repeats in x, y and z, until a separate pass certifies that none overlap
///
/// Sizes come from a table of number densities (`stereology unfold -o`), from a lognormal law, are all one, or are listed. The number of particles and the
/// fraction of the volume they fill are met exactly; a fraction that cannot be reached is refused, with the overlap that was left.
///
/// Writes packing.json: the box, the shapes, and for each particle its shape, size, category, position (centre of volume) and orientation (quaternion w,x,y,z).
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
    /// Side of the box, instead of --count
    #[arg(long = "box", value_name = "L", value_parser = positive, conflicts_with = "count")]
    pub side: Option<f64>,
    /// Fraction of the volume inside particles [default: what the densities say, otherwise 0.5]
    #[arg(long, value_name = "PHI", value_parser = share)]
    pub fraction: Option<f64>,
    /// Shape of the particles and its share of them; may be repeated [default: sphere]
    #[arg(long, value_name = "SHAPE[=F]")]
    pub shape: Vec<ShapeShare>,
    /// How overlaps are removed
    #[arg(long, value_enum, default_value_t = Mode::Fast)]
    pub mode: Mode,
    /// File for the packing (JSON)
    #[arg(short, long, value_name = "packing.json")]
    pub output: PathBuf,
    /// Also write packing.csv, packing.xyz (OVITO) or packing.vtp (ParaView); may be repeated
    #[arg(long, value_name = "FILE")]
    pub also: Vec<PathBuf>,
}

/// Where sizes come from.
#[derive(Args, Debug)]
#[group(required = true, multiple = false)]
pub struct Sizes {
    /// Table of number densities, as `stereology unfold -o` writes it
    #[arg(long, value_name = "FILE")]
    pub densities: Option<PathBuf>,
    /// Lognormal sizes of median 1 and this standard deviation of the logarithm
    #[arg(long, value_name = "SIGMA", value_parser = positive)]
    pub lognormal: Option<f64>,
    /// All sizes 1
    #[arg(long)]
    pub constant: bool,
    /// Table with a column `size`, one row a particle (CSV)
    #[arg(long, value_name = "CSV")]
    pub sizes: Option<PathBuf>,
}

/// How overlaps are removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Mode {
    /// Overlap energy minimised by FIRE
    Fast,
    /// The paper's relaxation
    Paper,
    /// Simulated annealing (not available yet)
    Anneal,
    /// One particle at a time at random (not available yet)
    Sequential,
}

impl Mode {
    /// The way of packing.
    pub fn way(self) -> Result<anneal::Mode, Failure> {
        match self {
            Self::Fast => Ok(anneal::Mode::Fast),
            Self::Paper => Ok(anneal::Mode::Paper),
            Self::Anneal => Err(Failure::not_available("--mode anneal")),
            Self::Sequential => Err(Failure::not_available("--mode sequential")),
        }
    }
}

/// What a failed packing means for the program's user.
pub fn pack_failure(error: PackError) -> Failure {
    match error {
        PackError::NotConvex { .. } => Failure::not_available("packing of shapes that are not convex"),
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

impl Pack {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let options = PackOptions::default()
            .with_mode(self.mode.way()?)
            .with_seed(everywhere.seed);
        check_file(&self.output, everywhere.force)?;
        let also = self
            .also
            .iter()
            .map(|path| Ok((path, ParticleFormat::of(path)?)))
            .collect::<Result<Vec<_>, Failure>>()?;
        for path in &self.also {
            check_file(path, everywhere.force)?;
        }
        let started = Instant::now();
        let Shapes { names, shares, bodies } = self.shapes()?;
        let (grains, period) = self.grains(&bodies, &shares, everywhere)?;
        let requested = total_volume(&bodies, &grains).or_fail()? / period.volume();
        let step = Step::begin("packing", everywhere.quiet);
        let progress = |done: f64| step.at(done);
        let packing = pack(
            &bodies,
            populate(&grains, &period, everywhere.seed),
            &period,
            &options,
            &progress,
        )
        .map_err(pack_failure)?;
        drop(step);
        go_on()?;
        for (path, format) in also {
            format.write(path, &period, packing.particles())?;
        }
        PackingFile::new(names, packing.particles(), packing.period())
            .write(&self.output)
            .at(&self.output)?;

        let sides: [f64; 3] = packing.sides().into();
        let mut answer = Answer::new("pack");
        answer
            .field("particles", packing.particles().len())
            .field("box", sides.to_vec())
            .field("fraction", packing.fraction())
            .field("requested_fraction", self.fraction.unwrap_or(requested))
            .field("max_overlap", packing.max_overlap())
            .field("certified", packing.max_overlap() <= 0.0)
            .field("iterations", packing.iterations())
            .seconds(started.elapsed().as_secs_f64())
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
                significant(started.elapsed().as_secs_f64())
            ));
        Ok(answer)
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
        bodies: &[UnitBody],
        shares: &[f64],
        everywhere: &Everywhere,
    ) -> Result<(Vec<Grain>, PeriodicBox), Failure> {
        let seed = everywhere.seed;
        let scale = everywhere.scale;
        if let Some(table) = &self.sizes.densities {
            return self.grains_of_table(table, bodies, shares, everywhere);
        }
        let fraction = self.fraction.unwrap_or(0.5);
        let cube = |side: f64| PeriodicBox::new(Vector3::repeat(side * scale)).or_usage("--box");
        if let Some(table) = &self.sizes.sizes {
            if self.count.is_some() {
                return Err(Failure::usage(
                    "--count does not go with --sizes: every row of the table is a particle",
                ));
            }
            let mut grains = Vec::new();
            let rows = read_profiles(table).at(table)?;
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
                        "--box and --fraction together do not go with --sizes: give one",
                    ));
                }
                (None, _) => box_for_fraction(bodies, &grains, fraction).or_fail()?,
            };
            return Ok((grains, period));
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
            return Ok((grains, period));
        };
        let period = cube(side)?;
        let count = count_to_fill(bodies, &grains(1000)?, &period, fraction).or_fail()?;
        let mut grains = grains(count)?;
        // Whole particles fill a given box only nearly; their sizes take up the rest, all by one factor.
        scale_to_fraction(bodies, &mut grains, &period, fraction).or_fail()?;
        Ok((grains, period))
    }

    fn grains_of_table(
        &self,
        table: &Path,
        bodies: &[UnitBody],
        shares: &[f64],
        everywhere: &Everywhere,
    ) -> Result<(Vec<Grain>, PeriodicBox), Failure> {
        let mut histograms = Vec::new();
        for histogram in read_densities(table)? {
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
            Some(side) => side.powi(3),
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
                let period = PeriodicBox::new(Vector3::repeat(side.unwrap_or(volume.cbrt()))).or_usage("--box")?;
                if let Some(fraction) = fraction {
                    scale_to_fraction(bodies, &mut grains, &period, fraction).or_fail()?;
                }
                period
            }
        };
        Ok((grains, period))
    }
}

fn no_such_shape(table: &Path, shape: usize, shapes: usize) -> Failure {
    Failure::run(format!(
        "{}: a row has type {shape}, but there are {shapes} --shape (types are numbered from 0)",
        table.display()
    ))
}
