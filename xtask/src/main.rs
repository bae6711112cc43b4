//! `cargo xtask`: checks of the workspace, and the way to its studies.

mod faults;
mod features;
mod licence;
mod policy;
mod readers;
mod tidy;
mod workspace;

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::{Args, Parser, Subcommand};

/// Checks of the workspace, and its studies.
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
    /// Compiles every crate with each of its features alone and with none
    Features,
    /// Checks licences, sources, bans and Rust versions of all dependencies against deny.toml
    Dependencies,
    /// Writes files of every format and reads them with h5py, zarr, tifffile, pynrrd, VTK, DAMASK and OVITO
    Readers {
        /// Python that has these packages; without it they are installed under target/, or the check is skipped
        #[arg(long)]
        python: Option<PathBuf>,
    },
    /// Kills and stops the program, lets it race with itself, fills its disk; prints the table of docs/reliability.md
    Faults {
        /// Program to test; by default the release build
        #[arg(long)]
        program: Option<PathBuf>,
        /// Repetitions of each test
        #[arg(long, default_value_t = 4)]
        rounds: usize,
    },
    /// Runs all that has to pass before a change lands
    Ci,
    /// Runs the released program on data outside the project and writes the results into the pages under docs/
    Acceptance(Forwarded),
    /// Prints the part of docs/acceptance.md about the CT volume of sand
    Sand(Forwarded),
    /// Draws the papers' figures into docs/figures
    Figures(Forwarded),
    /// Times our tasks beside other programs and writes docs/bench-report.md
    BenchReport(Forwarded),
    /// Writes the built-in sample and its true values
    Sample(Forwarded),
    /// Counts the profiles of test images as JPEGs and at other sizes and writes the table into docs/segment.md
    Scales(Forwarded),
}

/// Arguments of a task of the crate studies/, which parses them.
#[derive(Args, Debug)]
#[command(disable_help_flag = true)]
struct Forwarded {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

fn main() -> Result<()> {
    match Program::parse().task {
        Task::Tidy => tidy::run(),
        Task::Features => features::run(),
        Task::Dependencies => policy::run(),
        Task::Readers { python } => readers::run(python.as_deref()),
        Task::Faults { program, rounds } => faults::run(program.as_deref(), rounds),
        Task::Ci => ci(),
        Task::Acceptance(forwarded) => study("acceptance", &forwarded),
        Task::Sand(forwarded) => study("sand", &forwarded),
        Task::Figures(forwarded) => study("figures", &forwarded),
        Task::BenchReport(forwarded) => study("bench-report", &forwarded),
        Task::Sample(forwarded) => study("sample", &forwarded),
        Task::Scales(forwarded) => study("scales", &forwarded),
    }
}

fn ci() -> Result<()> {
    let status = Command::new("bash")
        .arg(".ci/run")
        .current_dir(workspace::root()?)
        .status()
        .context("bash cannot be run")?;
    ensure!(status.success(), ".ci/run failed");
    Ok(())
}

/// Runs a task of the crate studies/ in release mode.
fn study(task: &str, forwarded: &Forwarded) -> Result<()> {
    let status = Command::new("cargo")
        .args([
            "run",
            "--release",
            "--quiet",
            "--package",
            "stereology-studies",
            "--",
            task,
        ])
        .args(&forwarded.arguments)
        .status()
        .context("cargo cannot be run")?;
    ensure!(status.success(), "{task} failed");
    Ok(())
}
