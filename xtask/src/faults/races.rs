//! Two processes that write one output at the same time.

use std::fs;
use std::path::Path;

use anyhow::Result;

use crate::faults::commands::{TASKS, VOLUMES};
use crate::faults::program::{Program, Row, wait};
use crate::faults::snapshot::Snapshot;

/// Lets two commands race for one output, in every format and for folders and sets.
pub fn run(program: &Program, place: &Path, rounds: usize) -> Result<Vec<Row>> {
    let volumes = VOLUMES.iter().map(|ending| {
        let line = |voxels: usize| format!("export ../../inputs/solid --voxels {voxels} -o v.{ending}");
        (format!(".{ending}"), [line(64), line(72)])
    });
    let sets = TASKS
        .iter()
        .filter(|task| ["segment and label maps", "assemble", "pack and its set", "turntable"].contains(&task.name))
        .map(|task| {
            (
                task.name.to_owned(),
                [task.line.to_owned(), format!("{} {}", task.line, task.other)],
            )
        });
    let mut rows = [Row::named("two writers"), Row::named("two writers, --force")];
    for (number, (name, lines)) in volumes.chain(sets).enumerate() {
        let works = place.join(format!("race-{number}"));
        fs::create_dir(&works)?;
        let mut whole = Vec::new();
        for (k, line) in lines.iter().enumerate() {
            let folder = works.join(format!("alone-{k}"));
            fs::create_dir(&folder)?;
            program.succeed(line, &folder)?;
            whole.push(Snapshot::of(&folder)?);
        }
        for round in 0..rounds {
            for (row, force) in rows.iter_mut().zip(["", " --force"]) {
                let folder = works.join(format!("race-{round}{}", force.trim()));
                fs::create_dir(&folder)?;
                let mut both = Vec::new();
                for line in &lines {
                    both.push(program.command(&format!("{line}{force}"), &folder).spawn()?);
                }
                let mut codes = Vec::new();
                for child in &mut both {
                    codes.push(wait(child)?);
                }
                row.runs += 1;
                let after = Snapshot::of(&folder)?;
                let winner = whole.iter().position(|of| of.same(&after));
                if winner.is_some() {
                    row.whole += 1;
                } else {
                    row.findings.push(format!("race, {name}{force}: mixed"));
                }
                if !after.left.is_empty() {
                    row.findings.push(format!("race, {name}{force}: left {:?}", after.left));
                }
                let expected = match (force, winner) {
                    ("", Some(0)) => [Some(0), Some(1)],
                    ("", Some(_)) => [Some(1), Some(0)],
                    _ => [Some(0), Some(0)],
                };
                if winner.is_some() && codes != expected {
                    row.findings.push(format!("race, {name}{force}: exit codes {codes:?}"));
                }
                fs::remove_dir_all(&folder)?;
            }
        }
    }
    Ok(rows.into())
}
