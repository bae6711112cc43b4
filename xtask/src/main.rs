//! `cargo xtask`: the work on the workspace that is not the program itself.

mod figures;
mod sample;
mod tidy;

use std::path::Path;
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
    /// Draws the paper's figures into docs/figures
    Figures {
        /// Only those whose name holds this
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
        Task::Figures { only } => figures::run(&root()?.join("docs/figures"), only.as_deref()),
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
