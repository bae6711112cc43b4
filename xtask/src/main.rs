//! `cargo xtask`: the work on the workspace that is not the program itself.

mod acceptance;
mod bench_report;
mod exemplar_solids;
mod figures;
mod grown_stones;
mod label_scores;
mod laminar_study;
mod particle_noise;
mod relief_table;
mod renderer_check;
mod sample;
mod sand;
mod texture_table;
mod tidy;

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::{Parser, Subcommand};

/// Checks, figures, the built-in sample and acceptance of the workspace.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask")]
struct Program {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Checks the invariants of ARCHITECTURE.md that a program can check
    Tidy,
    /// Runs the released program on photographs outside the project and writes docs/acceptance.md, and synthesises textures
    /// outside the project and writes the table of docs/texture.md; likewise reliefs and docs/microgeometry.md
    Acceptance {
        /// Folder that holds images/, textures/, meshes/ and exemplars/
        #[arg(long)]
        data: PathBuf,
        /// Where the solids go
        #[arg(long, default_value = "target/acceptance")]
        results: PathBuf,
        /// Only this part: photographs, textures, noise, reliefs, renderer, grow, measure, solids or laminar
        #[arg(long)]
        only: Option<String>,
        /// Python that has mitsuba, against which the renderer is held; without it that part is left out
        #[arg(long)]
        python: Option<PathBuf>,
    },
    /// Prints the part of docs/acceptance.md about the CT volume of sand
    Sand {
        /// Folder that holds volumes/
        #[arg(long)]
        data: PathBuf,
    },
    /// Draws the paper's figures into docs/figures
    Figures {
        /// Only those whose name holds this
        only: Option<String>,
    },
    /// Times our tasks beside other programs' and writes docs/bench-report.md; run it in release
    BenchReport {
        /// Python in which the peers are installed (trimesh with scipy, shapely, networkx, rtree; spheropack; pyrtools); without it our times stand alone
        #[arg(long)]
        python: Option<PathBuf>,
        /// Only the section of this title
        #[arg(long)]
        only: Option<String>,
    },
    /// Makes the built-in sample and its truth anew
    Sample,
    /// Runs all that has to pass before a change lands
    Ci,
}

fn main() -> Result<()> {
    match Program::parse().task {
        Task::Tidy => tidy::run(),
        Task::Acceptance {
            data,
            results,
            only,
            python,
        } => {
            let wanted = |part: &str| only.as_deref().is_none_or(|only| only == part);
            let program = root()?.join("target/release/stereology");
            if wanted("photographs") {
                acceptance::run(&program, &data, &results, &root()?.join("docs/acceptance.md"))?;
            }
            let page = root()?.join("docs/texture.md");
            if wanted("textures") {
                texture_table::run(&data.join("textures"), &results.join("textures"), &page)?;
            }
            if wanted("noise") {
                particle_noise::run(&data.join("images"), &page)?;
            }
            if wanted("grow") {
                grown_stones::grow(&program, &data, &results, &root()?.join("docs/grow.md"))?;
            }
            if wanted("measure") {
                grown_stones::measure(&program, &data, &results, &root()?.join("docs/measure.md"))?;
            }
            let page = root()?.join("docs/exemplar.md");
            if wanted("solids") {
                exemplar_solids::solids(&program, &data, &results, &page)?;
            }
            if wanted("laminar") {
                exemplar_solids::laminar(&data, &page)?;
            }
            if wanted("reliefs") {
                let page = root()?.join("docs/microgeometry.md");
                relief_table::run(&program, &data, &results.join("reliefs"), &page)?;
            }
            if let Some(python) = python.filter(|_| wanted("renderer")) {
                renderer_check::run(&python, &results.join("renderer"))?;
            }
            Ok(())
        }
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
        Task::Ci => ci(),
    }
}

fn root() -> Result<&'static Path> {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .context("xtask stands inside the workspace")
}

fn ci() -> Result<()> {
    let status = Command::new("bash")
        .arg(".ci/run")
        .current_dir(root()?)
        .status()
        .context("bash cannot be run")?;
    ensure!(status.success(), ".ci/run failed");
    Ok(())
}
