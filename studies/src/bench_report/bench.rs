//! One section of the report: its tasks, their CPU times, and the script that times the reference program.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use rayon::ThreadPool;
use serde_json::Value;

/// Our tasks against one peer's.
pub(super) struct Section {
    /// What was done by whom, what is counted and what is not.
    pub(super) words: String,
    /// Name and version of the peer, or why there is none.
    pub(super) peer: Result<String, String>,
    pub(super) rows: Vec<Row>,
}

/// One task; CPU seconds of one core.
pub(super) struct Row {
    pub(super) task: String,
    pub(super) ours: f64,
    pub(super) peer: Option<f64>,
    /// Whether both came to the same answer.
    pub(super) remark: String,
}

/// Where times are taken.
pub(super) struct Bench {
    python: Option<PathBuf>,
    /// One thread, so that its processor time is all of it.
    one_core: ThreadPool,
}

impl Bench {
    /// Times on one core, with the peers of this Python if there is one.
    pub(super) fn new(python: Option<&Path>) -> Result<Self> {
        Ok(Self {
            python: python.map(Path::to_owned),
            one_core: rayon::ThreadPoolBuilder::new().num_threads(1).build()?,
        })
    }

    /// CPU seconds of one run: of three batches of so many runs the shortest, for the system counts in steps of milliseconds. And what the
    /// last run answered.
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

    /// What a script of ours prints, a JSON object with `version`; or why the peer cannot be asked.
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
            "the peer's script failed: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        let answer: Value = serde_json::from_slice(&output.stdout).context("the peer's script printed no JSON")?;
        Ok(match answer.get("missing").and_then(Value::as_str) {
            Some(missing) => Err(format!("not measured: {name} is not whole in that Python ({missing})")),
            None => Ok(answer),
        })
    }
}

/// Processor time of this thread.
fn cpu_seconds() -> Result<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat")
        .context("processor times are read from /proc/thread-self/schedstat, which only Linux has")?;
    let nanoseconds: f64 = text.split_whitespace().next().context("an empty schedstat")?.parse()?;
    Ok(1e-9 * nanoseconds)
}
