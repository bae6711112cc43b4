//! Progress bars on a terminal, and signals that stop the program.

use std::io::{self, IsTerminal, Write};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::failure::Failure;
use crate::outputs::Outputs;

/// Number of the signal that stops the program; 0 before it.
static SIGNAL: AtomicU8 = AtomicU8::new(0);

/// Ctrl-C.
const INTERRUPT: u8 = 2;

/// Time for the running step to stop by itself, before the program ends without it.
const GRACE: Duration = Duration::from_millis(500);

/// Makes Ctrl-C, SIGTERM and SIGHUP stop the running step. If it does not stop soon, or there is a second signal, the
/// outputs are abandoned and the program ends.
#[cfg(unix)]
pub fn stop_on_signals(outputs: Outputs) {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

    let wanted = [SIGINT, SIGTERM, SIGHUP];
    let wanted = wanted
        .into_iter()
        .filter(|&signal| signal != SIGHUP || !is_ignored(signal));
    // Without a handler a signal ends the program at once. That is safe too, because outputs are renamed only when
    // complete, but it leaves temporary files.
    let Ok(mut signals) = signal_hook::iterator::Signals::new(wanted) else {
        return;
    };
    std::thread::spawn(move || {
        let Some(signal) = signals.forever().next() else {
            return;
        };
        SIGNAL.store(u8::try_from(signal).unwrap_or(INTERRUPT), Ordering::SeqCst);
        let since = Instant::now();
        while since.elapsed() < GRACE && signals.pending().next().is_none() {
            std::thread::sleep(Duration::from_millis(10));
        }
        let _ = writeln!(io::stderr(), "error: {}", Failure::stopped());
        outputs.abandon(i32::from(code_of_signal()));
    });
}

/// Programs started with `nohup` ignore SIGHUP, and go on doing so.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

/// Signals end the program at once. That is safe, because outputs are renamed only when complete.
#[cfg(not(unix))]
pub fn stop_on_signals(_: Outputs) {}

/// Was the program told to stop?
pub fn stopped() -> bool {
    SIGNAL.load(Ordering::SeqCst) != 0
}

/// Exit code of a program that a signal stopped.
pub fn code_of_signal() -> u8 {
    match SIGNAL.load(Ordering::SeqCst) {
        0 => 128 + INTERRUPT,
        signal => 128 + signal,
    }
}

/// An error if the program was told to stop; called before outputs get their final names.
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
