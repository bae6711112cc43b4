//! What is left when the program is killed, stopped, raced by itself or runs out of disk: docs/reliability.md.
//!
//! Every command writes into a folder of its own. Whatever happens to it, the folder holds afterwards what it held
//! before or all outputs of a run without faults, to the byte; temporary files stay only after `kill -9`.

mod commands;
mod full_disk;
mod kills;
mod program;
mod races;
mod snapshot;

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};

use crate::workspace::root;
use program::{Program, Row};

/// Runs all tests with `program`, by default the released one, and prints the table.
///
/// # Errors
///
/// If a command fails without a fault, or there are findings.
pub fn run(program: Option<&Path>, rounds: usize) -> Result<()> {
    let root = root()?;
    let program = match program {
        Some(program) => Program(program.canonicalize().context("the program")?),
        None => {
            let built = Command::new("cargo")
                .args(["build", "--release", "--locked", "--quiet", "--bin", "stereology"])
                .current_dir(root)
                .status()?;
            ensure!(built.success(), "the program cannot be built");
            Program(root.join("target/release/stereology"))
        }
    };
    let place = tempfile::tempdir()?;
    let inputs = place.path().join("inputs");
    std::fs::create_dir(&inputs)?;
    commands::make_inputs(&program, &inputs)?;
    let since = Instant::now();
    let mut rows = kills::run(&program, place.path(), rounds)?;
    rows.extend(races::run(&program, place.path(), rounds)?);
    rows.push(full_disk::run(&program, place.path())?);
    print(&rows, since.elapsed());
    let findings: Vec<&String> = rows.iter().flat_map(|row| &row.findings).collect();
    for finding in &findings {
        println!("finding: {finding}");
    }
    ensure!(findings.is_empty(), "faults: {} findings", findings.len());
    Ok(())
}

fn print(rows: &[Row], time: Duration) {
    println!("| fault | runs | outputs whole | as before | findings |");
    println!("|---|---|---|---|---|");
    let mut all = Row::named("all");
    for row in rows {
        let Row {
            name,
            runs,
            whole,
            before,
            findings,
        } = row;
        println!("| {name} | {runs} | {whole} | {before} | {} |", findings.len());
        all.runs += runs;
        all.whole += whole;
        all.before += before;
        all.findings.extend(findings.iter().cloned());
    }
    println!(
        "| all, in {} s | {} | {} | {} | {} |",
        time.as_secs(),
        all.runs,
        all.whole,
        all.before,
        all.findings.len()
    );
}
