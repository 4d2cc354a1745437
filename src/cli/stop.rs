//! Signals: the first requests a stop, and the process ends soon after even if the work does not.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::thread;
use std::time::Duration;

use crate::base::file;

/// The time that the work may take to stop by itself: people notice half a second. Its temporary files are removed.
const GRACE: Duration = Duration::from_millis(250);
/// The time limit for the last message: standard error may be a pipe that is not read.
const REPORT_LIMIT: Duration = Duration::from_millis(50);
/// The base of exit codes for signals, as in shells.
const BY_SIGNAL: u8 = 128;

/// The signal that requested a stop, if any.
#[derive(Clone, Debug)]
pub(super) struct Stop {
    signal: Arc<AtomicU8>,
    /// Whether the first signal is only recorded, and the work ends when it is done.
    pub(super) is_noted: Arc<AtomicBool>,
    /// Reports why the process ends.
    report: fn(),
}

impl Stop {
    /// Handles SIGINT, SIGTERM, and SIGHUP unless that is ignored already; `report` prints why the process ends, if
    /// that becomes necessary.
    pub(super) fn listen(report: fn()) -> Self {
        let stop = Self {
            signal: Arc::default(),
            is_noted: Arc::default(),
            report,
        };
        listen(&stop);
        stop
    }

    /// The exit code for the received signal, if any.
    pub(super) fn code(&self) -> Option<u8> {
        match self.signal.load(Ordering::Relaxed) {
            0 => None,
            signal => Some(BY_SIGNAL + signal),
        }
    }

    /// Whether a signal was received; resets the flag.
    pub(super) fn take(&self) -> bool {
        self.signal.swap(0, Ordering::Relaxed) != 0
    }

    /// Handles a signal: the first requests a stop, a second ends the process at once.
    fn on_signal(&self, signal: u8) {
        let report = self.report;
        if self.signal.swap(signal, Ordering::Relaxed) != 0 {
            end(signal, report);
        }
        if self.is_noted.load(Ordering::Relaxed) {
            return;
        }
        thread::spawn(move || {
            thread::sleep(GRACE);
            end(signal, report);
        });
    }
}

/// Ends the process without leaving partial files: those are unnamed, or registered and removed.
fn end(signal: u8, report: fn()) {
    file::remove_leftovers();
    let message = thread::spawn(report);
    let mut waited = Duration::ZERO;
    while !message.is_finished() && waited < REPORT_LIMIT {
        thread::sleep(REPORT_LIMIT / 10);
        waited += REPORT_LIMIT / 10;
    }
    #[expect(
        clippy::exit,
        reason = "the work may hang at a point where it does not check for signals"
    )]
    std::process::exit(i32::from(BY_SIGNAL + signal));
}

#[cfg(unix)]
fn listen(stop: &Stop) {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use std::time::Instant;
    let mut wanted = vec![SIGINT, SIGTERM];
    if !is_hangup_ignored() {
        wanted.push(SIGHUP);
    }
    // Without a handler, a signal ends the process at once.
    let Ok(mut signals) = signal_hook::iterator::Signals::new(wanted) else {
        return;
    };
    let stop = stop.clone();
    thread::spawn(move || {
        let mut last: Option<(i32, Instant)> = None;
        for signal in signals.forever() {
            // `timeout` sends its signal to the process and then to the whole group.
            let is_again = |(other, at): (i32, Instant)| other == signal && at.elapsed() < GRACE;
            if !last.is_some_and(is_again) {
                stop.on_signal(u8::try_from(signal).unwrap_or(1));
            }
            last = Some((signal, Instant::now()));
        }
    });
}

/// Whether SIGHUP is ignored, as under `nohup`: a handler would undo that. Only detected on Linux.
#[cfg(unix)]
fn is_hangup_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    // One bit per signal, the lowest for signal 1, SIGHUP.
    mask.is_some_and(|mask| mask.trim().ends_with(|c: char| "13579bdf".contains(c)))
}

#[cfg(not(unix))]
fn listen(stop: &Stop) {
    use signal_hook::consts::{SIGBREAK, SIGINT};
    /// The pause between two looks, of which people notice nothing.
    const PAUSE: Duration = Duration::from_millis(20);
    let is_raised = Arc::new(AtomicBool::new(false));
    // Without a handler, Ctrl-C ends the process at once.
    for signal in [SIGINT, SIGBREAK] {
        let _ = signal_hook::flag::register(signal, Arc::clone(&is_raised));
    }
    let stop = stop.clone();
    thread::spawn(move || {
        loop {
            thread::sleep(PAUSE);
            if is_raised.swap(false, Ordering::Relaxed) {
                stop.on_signal(u8::try_from(SIGINT).unwrap_or(1));
            }
        }
    });
}
