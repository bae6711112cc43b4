//! One section of the report: its tasks, their CPU times, and the script that times the reference program.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use rayon::ThreadPool;
use serde_json::Value;

/// Our tasks beside those of one reference program.
pub(super) struct Section {
    /// What each program does, and what is included in the times.
    pub(super) words: String,
    /// Name and version of the reference program, or why there is none.
    pub(super) peer: Result<String, String>,
    pub(super) rows: Vec<Row>,
}

/// One task; CPU seconds of one core.
pub(super) struct Row {
    pub(super) task: String,
    pub(super) ours: f64,
    pub(super) peer: Option<f64>,
    /// How the results of both compare.
    pub(super) remark: String,
}

/// The Python and the thread pool of the measurements.
pub(super) struct Bench {
    python: Option<PathBuf>,
    /// One thread, so that its CPU time is the time of the whole task.
    one_core: ThreadPool,
}

impl Bench {
    /// Measures on one core, with the reference programs of this Python if there is one.
    pub(super) fn new(python: Option<&Path>) -> Result<Self> {
        Ok(Self {
            python: python.map(Path::to_owned),
            one_core: rayon::ThreadPoolBuilder::new().num_threads(1).build()?,
        })
    }

    /// CPU seconds of one run: the shortest of three batches of `batch` runs, as the system counts in steps of
    /// milliseconds. Also returns the result of the last run.
    pub(super) fn time<T: Send>(&self, batch: u32, task: impl Fn() -> Result<T> + Sync) -> Result<(f64, T)> {
        self.one_core.install(|| {
            let mut best = f64::INFINITY;
            let mut answer = None;
            for _ in 0..3 {
                let start = cpu_seconds()?;
                for _ in 0..batch.max(1) {
                    answer = Some(task()?);
                }
                best = best.min((cpu_seconds()? - start) / f64::from(batch.max(1)));
            }
            Ok((best, answer.context("at least one run")?))
        })
    }

    /// The JSON object that a script prints, with `version`; or why the reference program cannot be run.
    pub(super) fn ask_peer(&self, name: &str, script: &str, arguments: &[String]) -> Result<Result<Value, String>> {
        let Some(python) = &self.python else {
            return Ok(Err("not measured: no --python was given".to_owned()));
        };
        let output = Command::new(python)
            .args(["-c", script])
            .args(arguments)
            .env("OPENBLAS_NUM_THREADS", "1")
            .env("OMP_NUM_THREADS", "1")
            .output()
            .with_context(|| format!("{} cannot be run", python.display()))?;
        ensure!(
            output.status.success(),
            "the script of the reference program failed: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        let answer: Value =
            serde_json::from_slice(&output.stdout).context("the script of the reference program printed no JSON")?;
        Ok(match answer.get("missing").and_then(Value::as_str) {
            Some(missing) => Err(format!("not measured: that Python lacks {missing}, which {name} needs")),
            None => Ok(answer),
        })
    }
}

/// CPU time of this thread.
fn cpu_seconds() -> Result<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat")
        .context("processor times are read from /proc/thread-self/schedstat, which only Linux has")?;
    let nanoseconds: f64 = text.split_whitespace().next().context("an empty schedstat")?.parse()?;
    Ok(1e-9 * nanoseconds)
}
