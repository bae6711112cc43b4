//! The papers' figures, acceptance on real data, benchmark reports and the built-in sample.
//!
//! Each part is a command of `cargo xtask`, which runs this program in release mode.

mod acceptance;
mod bench_report;
mod exemplar_solids;
mod figures;
mod grown_stones;
mod laminar_study;
mod particle_noise;
mod relief_table;
mod renderer_check;
mod sample;
mod sand;
mod scale_table;
mod texture_table;
mod workspace;

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::{Parser, Subcommand, ValueEnum};

use workspace::root;

/// Figures, acceptance, benchmark reports and the built-in sample.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask")]
struct Program {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Runs the released program on data outside the project and writes the results into the pages under docs/
    Acceptance {
        /// Folder that holds images/, textures/, meshes/, exemplars/ and volumes/
        #[arg(long)]
        data: PathBuf,
        /// Folder for the solids
        #[arg(long, default_value = "target/acceptance")]
        results: PathBuf,
        /// Run this part only
        #[arg(long)]
        only: Option<Part>,
        /// Python with mitsuba, the reference of the renderer; without it that part is left out
        #[arg(long)]
        python: Option<PathBuf>,
    },
    /// Prints the part of docs/acceptance.md about the CT volume of sand
    Sand {
        /// Folder that holds volumes/
        #[arg(long)]
        data: PathBuf,
    },
    /// Draws the papers' figures into docs/figures
    Figures {
        /// Draw only the figures whose name contains this
        only: Option<String>,
    },
    /// Times our tasks beside other programs and writes docs/bench-report.md
    BenchReport {
        /// Python with the other programs (trimesh with scipy, shapely, networkx, rtree; spheropack; pyrtools); without
        /// it only our times are reported
        #[arg(long)]
        python: Option<PathBuf>,
        /// Measure only the section of this title; the others keep their old text
        #[arg(long)]
        only: Option<String>,
    },
    /// Writes the built-in sample and its true values
    Sample,
    /// Counts the profiles of test images as JPEGs and at other sizes and writes the table into docs/segment.md
    Scales,
}

/// A part of acceptance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
    /// docs/acceptance.md: profiles, unfolding, packing and solids from photographs
    Photographs,
    /// docs/texture.md: synthesised textures
    Textures,
    /// docs/texture.md: noise of particles
    Noise,
    /// docs/grow.md: solids grown around measurements
    Grow,
    /// docs/measure.md: measurements of solids
    Measure,
    /// docs/exemplar.md: solids from exemplars
    Solids,
    /// docs/exemplar.md: the laminar study
    Laminar,
    /// docs/microgeometry.md: reliefs
    Reliefs,
    /// The renderer against mitsuba; needs --python
    Renderer,
}

fn main() -> Result<()> {
    match Program::parse().task {
        Task::Acceptance {
            data,
            results,
            only,
            python,
        } => accept(&data, &results, only, python.as_deref()),
        Task::Sand { data } => {
            println!("{}", sand::compare(&data)?);
            Ok(())
        }
        Task::Figures { only } => figures::run(&root()?.join("docs/figures"), only.as_deref()),
        Task::BenchReport { python, only } => bench_report::run(
            &root()?.join("docs/bench-report.md"),
            python.as_deref(),
            only.as_deref(),
        ),
        Task::Sample => sample::run(&root()?.join("stereology/assets")),
        Task::Scales => scale_table::run(&root()?.join("docs/segment.md")),
    }
}

/// Runs all parts of acceptance, or one.
fn accept(data: &Path, results: &Path, only: Option<Part>, python: Option<&Path>) -> Result<()> {
    let wanted = |part: Part| only.is_none_or(|only| only == part);
    let program = root()?.join("target/release/stereology");
    let page = |name: &str| Ok::<_, anyhow::Error>(root()?.join("docs").join(name));
    if wanted(Part::Photographs) {
        acceptance::run(&program, data, results, &page("acceptance.md")?)?;
    }
    if wanted(Part::Textures) {
        texture_table::run(&data.join("textures"), &results.join("textures"), &page("texture.md")?)?;
    }
    if wanted(Part::Noise) {
        particle_noise::run(&data.join("images"), &page("texture.md")?)?;
    }
    if wanted(Part::Grow) {
        grown_stones::grow(&program, data, results, &page("grow.md")?)?;
    }
    if wanted(Part::Measure) {
        grown_stones::measure(&program, data, results, &page("measure.md")?)?;
    }
    if wanted(Part::Solids) {
        exemplar_solids::solids(&program, data, results, &page("exemplar.md")?)?;
    }
    if wanted(Part::Laminar) {
        exemplar_solids::laminar(data, &page("exemplar.md")?)?;
    }
    if wanted(Part::Reliefs) {
        relief_table::run(&program, data, &results.join("reliefs"), &page("microgeometry.md")?)?;
    }
    match python {
        Some(python) if wanted(Part::Renderer) => renderer_check::run(python, &results.join("renderer")),
        None if only == Some(Part::Renderer) => anyhow::bail!("the renderer's reference needs --python"),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::Program;
    use clap::Parser;

    /// An unknown part is an error that lists the known ones, not an empty run.
    #[test]
    fn an_unknown_part_is_an_error_that_lists_the_known_ones() {
        let arguments = |part| ["studies", "acceptance", "--data", "d", "--only", part];
        assert!(Program::try_parse_from(arguments("reliefs")).is_ok());
        let error = Program::try_parse_from(arguments("relief"))
            .map(|_| ())
            .unwrap_err()
            .to_string();
        for known in [
            "photographs",
            "textures",
            "noise",
            "grow",
            "measure",
            "solids",
            "laminar",
            "reliefs",
            "renderer",
        ] {
            assert!(error.contains(known), "{error}");
        }
    }
}
