//! The progress bar; the only file that measures time.

use std::io::{self, IsTerminal as _};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::pipeline::Stage;

/// The tick interval of a bar without reported progress, as in a long layout.
const TICK: Duration = Duration::from_millis(120);

/// The current stage.
#[derive(Debug)]
pub(super) struct Progress {
    is_shown: bool,
    bar: Option<(Stage, ProgressBar)>,
    begun: Instant,
}

impl Progress {
    /// Progress, shown only if standard error is a terminal and `is_shown`.
    pub(super) fn new(is_shown: bool) -> Self {
        Self {
            is_shown: is_shown && io::stderr().is_terminal() && !is_dumb(),
            bar: None,
            begun: Instant::now(),
        }
    }

    /// Hides the bar: results are written to the same terminal.
    pub(super) fn hide(&mut self) {
        self.end();
        self.is_shown = false;
    }

    /// Begins a stage and ends the previous one.
    pub(super) fn begin(&mut self, stage: Stage) {
        self.end();
        self.bar = self.is_shown.then(|| (stage, bar(stage)));
    }

    /// Sets the progress of the current stage: `done` of `total`, which is 0 if unknown.
    pub(super) fn set(&self, done: u64, total: u64) {
        if let Some((stage, bar)) = &self.bar {
            if total > 0 {
                if bar.length().is_none() {
                    bar.set_style(style(counted(*stage)));
                }
                bar.set_length(total.max(done));
            }
            bar.set_position(done);
        }
    }

    /// Ends the current stage and clears its bar.
    pub(super) fn end(&mut self) {
        if let Some((_, bar)) = self.bar.take() {
            bar.finish_and_clear();
        }
    }

    /// Prints something with the bar hidden.
    pub(super) fn aside(&self, print: impl FnOnce()) {
        match &self.bar {
            Some((_, bar)) => bar.suspend(print),
            None => print(),
        }
    }

    /// Seconds since the command began.
    pub(super) fn seconds(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }
}

/// Whether the terminal can neither move its cursor nor show colours.
pub(super) fn is_dumb() -> bool {
    std::env::var_os("TERM").is_some_and(|term| term == "dumb")
}

/// A spinner until the total is known.
fn bar(stage: Stage) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    let turning = match stage {
        Stage::Read | Stage::Verify => "{msg:>9} {spinner} {bytes}",
        _ => "{msg:>9} {spinner} {elapsed}",
    };
    bar.set_style(style(turning));
    bar.set_message(stage.word());
    bar.enable_steady_tick(TICK);
    bar
}

/// The template of a bar with a known total.
fn counted(stage: Stage) -> &'static str {
    match stage {
        Stage::Read | Stage::Verify => "{msg:>9} [{bar:40}] {bytes}/{total_bytes}",
        Stage::Draw => "{msg:>9} [{bar:40}] frame {pos} of {len}, {eta} left",
        _ => "{msg:>9} [{bar:40}] {pos}/{len}",
    }
}

fn style(template: &str) -> ProgressStyle {
    let style = ProgressStyle::with_template(template);
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    style.progress_chars("=> ")
}
