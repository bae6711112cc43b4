//! A disk that becomes full.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::Result;

use crate::faults::commands::TASKS;
use crate::faults::program::{Program, Row, wait};
use crate::faults::snapshot::Snapshot;

/// Sizes of the file system, in KiB.
const ROOM: [usize; 4] = [16, 64, 256, 1024];

/// Runs every command on file systems of few bytes, if one can be mounted.
pub fn run(program: &Program, place: &Path) -> Result<Row> {
    let mut row = Row::named("full disk");
    let works = place.join("full");
    fs::create_dir(&works)?;
    let disk = works.join("disk");
    fs::create_dir(&disk)?;
    for kib in ROOM {
        let Some(_mounted) = Mounted::new(&disk, kib) else {
            row.name = "full disk: left out, as no file system can be mounted here".to_owned();
            return Ok(row);
        };
        for (number, task) in TASKS.iter().enumerate() {
            let folder = disk.join(number.to_string());
            fs::create_dir(&folder)?;
            // Inputs are two folders up from the place where commands run.
            let line = task.line.replace("../../inputs", "../../../inputs");
            let code = wait(&mut program.command(&line, &folder).spawn()?)?;
            row.runs += 1;
            let after = Snapshot::of(&folder)?;
            match code {
                Some(0) => row.whole += 1,
                Some(1) if after == Snapshot::default() => row.before += 1,
                _ => row.findings.push(format!(
                    "full disk of {kib} KiB, {}: exit code {code:?}, {:?} {:?}",
                    task.name,
                    after.names(),
                    after.left
                )),
            }
            fs::remove_dir_all(&folder)?;
        }
    }
    Ok(row)
}

/// A file system in memory.
struct Mounted<'a>(&'a Path);

impl<'a> Mounted<'a> {
    fn new(at: &'a Path, kib: usize) -> Option<Self> {
        let done = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &format!("size={kib}k"), "tmpfs"])
            .arg(at)
            .output();
        done.is_ok_and(|done| done.status.success()).then_some(Self(at))
    }
}

impl Drop for Mounted<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0).output();
    }
}
