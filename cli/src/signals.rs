//! Signals that stop the program.

use std::sync::atomic::{AtomicU8, Ordering};
use std::time::{Duration, Instant};

/// Number of the signal that stops the program; 0 before it.
static SIGNAL: AtomicU8 = AtomicU8::new(0);

/// Ctrl-C.
const INTERRUPT: u8 = 2;

/// Time for the running step to stop by itself, before the program ends without it.
const GRACE: Duration = Duration::from_millis(500);

/// Makes Ctrl-C, SIGTERM and SIGHUP stop the running step. If it does not stop soon, or there is a second signal,
/// `abandon` is called, which ends the program.
#[cfg(unix)]
pub fn stop_on_signals(abandon: impl FnOnce() + Send + 'static) {
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
        abandon();
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
pub fn stop_on_signals(_: impl FnOnce() + Send + 'static) {}

/// Whether a signal has stopped the program.
pub fn stopped() -> bool {
    SIGNAL.load(Ordering::SeqCst) != 0
}

/// Exit code of a program that a signal stopped.
pub fn exit_code() -> u8 {
    match SIGNAL.load(Ordering::SeqCst) {
        0 => 128 + INTERRUPT,
        signal => 128 + signal,
    }
}
