//! Processes that are killed or stopped at random times.

use std::fs;
use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use anyhow::{Result, ensure};

use crate::faults::commands::{TASKS, VOLUMES};
use crate::faults::program::{Program, Row, wait};
use crate::faults::snapshot::Snapshot;

/// Signals, and whether the program can clean up.
const SIGNALS: [(&str, i32, bool); 4] = [
    ("KILL", 9, false),
    ("TERM", 15, true),
    ("HUP", 1, true),
    ("INT", 2, true),
];
/// Longest time from a signal to the end of the program.
const PROMPT: Duration = Duration::from_secs(1);

/// Kills and stops every command `rounds` times with each signal, half of them over an older output.
pub fn run(program: &Program, place: &Path, rounds: usize) -> Result<Vec<Row>> {
    let mut rows: Vec<Row> = SIGNALS
        .iter()
        .map(|(name, ..)| Row::named(format!("SIG{name}")))
        .collect();
    let mut chance = Chance(1);
    let mut slowest = (Duration::ZERO, "");
    for (number, task) in TASKS.iter().enumerate() {
        let works = place.join(format!("kill-{number}"));
        fs::create_dir(&works)?;
        let (new, time) = outputs(program, task.line, &works.join("new"))?;
        let (old, _) = outputs(program, &format!("{} {}", task.line, task.other), &works.join("old"))?;
        ensure!(!new.same(&old), "{}: its two runs give the same outputs", task.name);
        for round in 0..rounds {
            for (row, &(name, signal_number, cleans)) in rows.iter_mut().zip(&SIGNALS) {
                let folder = works.join(format!("{name}-{round}"));
                let over = (round + number) % 2 == 1;
                let before = if over {
                    outputs(program, &format!("{} {}", task.line, task.other), &folder)?.0
                } else {
                    fs::create_dir(&folder)?;
                    Snapshot::default()
                };
                let line = format!("{} --force", task.line);
                let mut child = program.command(&line, &folder).spawn()?;
                std::thread::sleep(time.mul_f64(1.05 * chance.next()));
                let told = Instant::now();
                signal(&child, name);
                let code = wait(&mut child)?;
                let took = told.elapsed();
                if cleans && code != Some(0) && took > slowest.0 {
                    slowest = (took, task.name);
                }
                let after = Snapshot::of(&folder)?;
                let mut find = |what: String| row.findings.push(format!("SIG{name}, {}: {what}", task.name));
                row.runs += 1;
                if after.same(&new) {
                    row.whole += 1;
                } else if after.same(&before) {
                    row.before += 1;
                } else {
                    find(format!(
                        "the outputs are neither whole nor as before: {:?}",
                        after.names()
                    ));
                }
                if cleans && !after.left.is_empty() {
                    find(format!("left {:?}", after.left));
                }
                if cleans && took > PROMPT && code != Some(0) {
                    find(format!("ended {:.1} s after the signal", took.as_secs_f64()));
                }
                if cleans && ![Some(0), Some(128 + signal_number)].contains(&code) {
                    find(format!("exit code {code:?}"));
                }
                // What a killed run has left is not in the way of the next one.
                program.succeed(&line, &folder)?;
                if !Snapshot::of(&folder)?.same(&new) {
                    row.findings
                        .push(format!("SIG{name}, {}: the next run gives other outputs", task.name));
                }
                fs::remove_dir_all(&folder)?;
            }
        }
    }
    println!(
        "slowest answer to a signal: {:.2} s ({})",
        slowest.0.as_secs_f64(),
        slowest.1
    );
    rows.push(resumed(program, place, rounds, &mut chance)?);
    Ok(rows)
}

/// An export that is killed again and again, and resumed until it is done.
fn resumed(program: &Program, place: &Path, rounds: usize, chance: &mut Chance) -> Result<Row> {
    let mut row = Row::named("SIGKILL, resumed until done");
    for (number, ending) in VOLUMES.iter().enumerate() {
        let line = format!("export ../../inputs/solid --voxels 160 -o v.{ending}");
        let works = place.join(format!("resume-{number}"));
        fs::create_dir(&works)?;
        let (whole, time) = outputs(program, &line, &works.join("whole"))?;
        for round in 0..rounds {
            let folder = works.join(format!("resumed-{round}"));
            fs::create_dir(&folder)?;
            let line = format!("{line} --resume");
            for _ in 0..4 {
                let mut child = program.command(&line, &folder).spawn()?;
                std::thread::sleep(time.mul_f64(chance.next()));
                signal(&child, "KILL");
                row.runs += 1;
                let done = wait(&mut child)? == Some(0);
                let after = Snapshot::of(&folder)?;
                if after.same(&whole) {
                    row.whole += 1;
                } else if after.same(&Snapshot::default()) {
                    row.before += 1;
                } else {
                    row.findings.push(format!("resumed .{ending}: {:?}", after.names()));
                }
                if done || after.same(&whole) {
                    break;
                }
            }
            if !Snapshot::of(&folder)?.same(&whole) {
                program.succeed(&line, &folder)?;
            }
            if Snapshot::of(&folder)? != whole {
                row.findings.push(format!("resumed .{ending}: not as written at once"));
            }
            fs::remove_dir_all(&folder)?;
        }
    }
    Ok(row)
}

/// What a command writes into a new folder, and the time it takes.
fn outputs(program: &Program, line: &str, folder: &Path) -> Result<(Snapshot, Duration)> {
    fs::create_dir(folder)?;
    let time = program.succeed(line, folder)?;
    Ok((Snapshot::of(folder)?, time))
}

/// Sends a signal; a process that has ended already gets none.
fn signal(child: &Child, name: &str) {
    let _ = Command::new("kill")
        .args([format!("-{name}"), child.id().to_string()])
        .output();
}

/// Numbers from 0 to 1, the same in every run (xorshift).
#[derive(Debug)]
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}
