//! The program under test, and what became of its runs.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Result, ensure};

/// Ends the commands that never do.
const PATIENCE: Duration = Duration::from_secs(120);

/// A line of the table.
#[derive(Debug, Default)]
pub struct Row {
    pub name: String,
    pub runs: usize,
    /// Runs after which the outputs were whole, or as before.
    pub whole: usize,
    pub before: usize,
    pub findings: Vec<String>,
}

impl Row {
    pub fn named(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            ..Self::default()
        }
    }
}

/// The program under test.
#[derive(Debug)]
pub struct Program(pub PathBuf);

impl Program {
    pub fn command(&self, line: &str, folder: &Path) -> Command {
        let mut command = Command::new(&self.0);
        command
            .args(line.split_whitespace())
            .current_dir(folder)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        command
    }

    /// Runs a command that must succeed.
    pub fn succeed(&self, line: &str, folder: &Path) -> Result<Duration> {
        let since = Instant::now();
        let done = self.command(line, folder).stderr(Stdio::piped()).output()?;
        ensure!(
            done.status.success(),
            "stereology {line}: {}",
            String::from_utf8_lossy(&done.stderr).trim_end()
        );
        Ok(since.elapsed())
    }
}

/// Waits for a process, which is killed if it does not end. Returns its exit code, if it has one.
pub fn wait(child: &mut std::process::Child) -> Result<Option<i32>> {
    let since = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status.code());
        }
        if since.elapsed() > PATIENCE {
            child.kill()?;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}
