//! Progress bars on a terminal.

use std::io::{self, IsTerminal};
use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};

use crate::failure::Failure;
use crate::signals::stopped;

/// An error if a signal has stopped the program; called before outputs get their final names.
pub fn go_on() -> Result<(), Failure> {
    if stopped() { Err(Failure::stopped()) } else { Ok(()) }
}

/// The progress of one step.
#[derive(Debug)]
pub struct Step {
    bar: ProgressBar,
}

impl Step {
    /// Begins a step called `name`; its bar is visible only if stderr is a terminal and `quiet` is not set.
    pub fn begin(name: &str, quiet: bool) -> Self {
        if quiet || !io::stderr().is_terminal() {
            return Self {
                bar: ProgressBar::hidden(),
            };
        }
        let bar = ProgressBar::new(1000);
        if let Ok(style) = ProgressStyle::with_template("{prefix:12} {bar:40} {percent:>3} % {elapsed:>4}") {
            bar.set_style(style);
        }
        bar.set_prefix(name.to_owned());
        bar.tick();
        Self { bar }
    }

    /// Prints a line above the bar.
    pub fn print(&self, line: &str) {
        self.bar.println(line);
    }

    /// Sets the progress of the step (0 to 1); breaks after Ctrl-C.
    pub fn at(&self, done: f64) -> ControlFlow<()> {
        self.bar.set_position((done.clamp(0.0, 1.0) * 1000.0) as u64);
        if stopped() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

impl Drop for Step {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// The progress of several consecutive steps, and the time each took.
#[derive(Debug)]
pub struct Stages {
    quiet: bool,
    running: Mutex<Running>,
}

#[derive(Debug, Default)]
struct Running {
    step: Option<(&'static str, Step, Instant)>,
    seconds: Vec<(&'static str, f64)>,
}

impl Stages {
    /// Begins, with no step yet.
    pub fn begin(quiet: bool) -> Self {
        Self {
            quiet,
            running: Mutex::default(),
        }
    }

    /// Sets the running step and its progress; breaks after Ctrl-C.
    pub fn at(&self, name: &'static str, done: f64) -> ControlFlow<()> {
        let mut running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        if running.step.as_ref().is_none_or(|(of, ..)| *of != name) {
            running.end();
            running.step = Some((name, Step::begin(name, self.quiet), Instant::now()));
        }
        match &running.step {
            Some((_, step, _)) => step.at(done),
            None => ControlFlow::Continue(()),
        }
    }

    /// Ends the last step and returns the seconds by step.
    pub fn end(self) -> Vec<(&'static str, f64)> {
        let mut running = self.running.into_inner().unwrap_or_else(PoisonError::into_inner);
        running.end();
        running.seconds
    }
}

impl Running {
    fn end(&mut self) {
        if let Some((name, _, since)) = self.step.take() {
            self.seconds.push((name, since.elapsed().as_secs_f64()));
        }
    }
}
