//! Signals: the first asks the work to end, and the process ends soon after where the work does not.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::thread;
use std::time::Duration;

use crate::base::leftovers;

/// The time that the work may take to end by itself. People notice half a second; files that the work leaves we remove
/// too.
const GRACE: Duration = Duration::from_millis(250);
/// The time that the last message may take: standard error may be a pipe that nobody reads.
const LAST_WORDS: Duration = Duration::from_millis(50);
/// The number that a shell adds to that of the signal that ended a command.
const BY_SIGNAL: u8 = 128;

/// The signal that asked us to end, if any.
#[derive(Clone, Debug)]
pub(super) struct Stop {
    signal: Arc<AtomicU8>,
    /// Whether the first signal only asks, and the work ends when it is done.
    pub(super) is_noted: Arc<AtomicBool>,
    /// The function that tells why the process ends.
    say: fn(),
}

impl Stop {
    /// Listens from now on for an interrupt, a termination, and a hang-up unless that is ignored already; `say` tells
    /// why the process ends, should that become necessary.
    pub(super) fn listen(say: fn()) -> Self {
        let signal = Arc::new(AtomicU8::new(0));
        let is_noted = Arc::default();
        let stop = Self {
            signal,
            is_noted,
            say,
        };
        listen(&stop);
        stop
    }

    /// The exit code for the signal that came; `None` if none did.
    pub(super) fn code(&self) -> Option<u8> {
        match self.signal.load(Ordering::Relaxed) {
            0 => None,
            signal => Some(BY_SIGNAL + signal),
        }
    }

    /// Whether a signal came, which is forgotten.
    pub(super) fn take(&self) -> bool {
        self.signal.swap(0, Ordering::Relaxed) != 0
    }

    /// Takes in a signal: the first asks the work to end, a second ends the process at once.
    fn hear(&self, signal: u8) {
        let say = self.say;
        if self.signal.swap(signal, Ordering::Relaxed) != 0 {
            end(signal, say);
        }
        if self.is_noted.load(Ordering::Relaxed) {
            return;
        }
        thread::spawn(move || {
            thread::sleep(GRACE);
            end(signal, say);
        });
    }
}

/// Ends the process, leaving nothing half-written: files that are not whole have no name, or one that we remove.
fn end(signal: u8, say: fn()) {
    leftovers::remove();
    let said = thread::spawn(say);
    let mut waited = Duration::ZERO;
    while !said.is_finished() && waited < LAST_WORDS {
        thread::sleep(LAST_WORDS / 10);
        waited += LAST_WORDS / 10;
    }
    #[expect(clippy::exit, reason = "the work may hang where it cannot hear")]
    std::process::exit(i32::from(BY_SIGNAL + signal));
}

#[cfg(unix)]
fn listen(stop: &Stop) {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let mut wanted = vec![SIGINT, SIGTERM];
    if !is_hangup_ignored() {
        wanted.push(SIGHUP);
    }
    // Without a handler a signal ends us at once, which is what it did before.
    let Ok(mut signals) = signal_hook::iterator::Signals::new(wanted) else {
        return;
    };
    let stop = stop.clone();
    thread::spawn(move || {
        for signal in signals.forever() {
            stop.hear(u8::try_from(signal).unwrap_or(1));
        }
    });
}

/// Whether hang-ups are ignored, as `nohup` makes them: a handler would undo that. Only Linux tells.
#[cfg(unix)]
fn is_hangup_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    // A bit for each signal, the first for signal 1, which is this one.
    mask.is_some_and(|mask| mask.trim().ends_with(|c: char| "13579bdf".contains(c)))
}

#[cfg(not(unix))]
fn listen(stop: &Stop) {
    /// The number of Ctrl-C on other systems; it has none here.
    const INTERRUPT: u8 = 2;
    let stop = stop.clone();
    // Without a handler Ctrl-C ends us at once, which is what it did before.
    let _ = ctrlc::set_handler(move || stop.hear(INTERRUPT));
}
