//! The output for people: progress, notices, errors and hints; the only file that prints or measures time.

use std::collections::BTreeMap;
use std::io::{self, IsTerminal as _, Write as _};
use std::path::Path;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::stop::Stop;
use crate::base::error::{Error, Result};
use crate::base::notice::Notices;
use crate::base::words::visible;
use crate::pipeline::{Stage, Watch};

/// Standard error and output, as the user set them up.
#[derive(Debug)]
pub(crate) struct Terminal {
    quiet: bool,
    colour: bool,
    bar: Option<ProgressBar>,
    stage: Option<(Stage, Instant)>,
    spent: BTreeMap<Stage, Duration>,
    /// The shares of the time of each stage, in words.
    shares: BTreeMap<Stage, String>,
    begun: Instant,
    stop: Stop,
}

impl Terminal {
    /// A terminal that prints only errors if `quiet`. Colours only where standard error is a terminal and `no_colour`
    /// is false; progress only on a terminal.
    pub(crate) fn new(quiet: bool, no_colour: bool) -> Self {
        Self {
            quiet,
            colour: io::stderr().is_terminal() && !no_colour,
            bar: None,
            stage: None,
            spent: BTreeMap::new(),
            shares: BTreeMap::new(),
            begun: Instant::now(),
            stop: Stop::listen(last_words),
        }
    }

    /// Prints an error and its hint.
    pub(crate) fn error(&mut self, error: &Error) {
        self.end_stage();
        self.line("31", "error", &error.to_string());
        let hint = error.hint();
        if !hint.is_empty() {
            self.line("36", "hint", &hint);
        }
    }

    /// Prints one of several errors that did not end the run, as only tables have them.
    #[cfg(feature = "parquet")]
    pub(crate) fn failed(&mut self, why: &str) {
        self.end_stage();
        self.line("31", "error", why);
    }

    /// Prints notices, one line each.
    pub(crate) fn notices(&mut self, notices: &Notices) {
        if self.quiet {
            return;
        }
        for notice in notices.iter() {
            let (colour, label) = if notice.kind.is_loss() {
                ("33", "warning")
            } else {
                ("36", "note")
            };
            let times = if notice.count > 1 {
                format!(" ({} times)", notice.count)
            } else {
                String::new()
            };
            self.line(colour, label, &format!("{}{times}", notice.text));
        }
    }

    /// Prints a line on standard error unless quiet.
    pub(crate) fn say(&mut self, text: &str) {
        if !self.quiet {
            // A closed standard error is nobody to tell.
            let _ = writeln!(io::stderr(), "{}", visible(text));
        }
    }

    /// Prints results on standard output. A closed pipe is not an error: the reader has what it wanted.
    ///
    /// # Errors
    /// [`Error::Io`] where not all of it could be written.
    #[expect(
        clippy::unused_self,
        reason = "whoever holds the terminal may print and wait"
    )]
    pub(crate) fn results(&mut self, text: &str) -> Result<()> {
        print(printable(text).as_bytes())
    }

    /// As [`Terminal::results`], of a table: bytes that are not text are printed as they are.
    ///
    /// # Errors
    /// As [`Terminal::results`].
    pub(crate) fn table(&mut self, table: &[u8]) -> Result<()> {
        match std::str::from_utf8(table) {
            Ok(text) => self.results(text),
            Err(_) => print(table),
        }
    }

    /// The exit code for the signal that asked us to stop; `None` if none did.
    pub(crate) fn stopped_by(&self) -> Option<u8> {
        self.stop.code()
    }

    /// Prints a note unless quiet.
    pub(crate) fn note(&mut self, text: &str) {
        if !self.quiet {
            self.line("36", "note", text);
        }
    }

    /// Waits a moment before looking at a file again.
    #[expect(
        clippy::unused_self,
        reason = "whoever holds the terminal may print and wait"
    )]
    pub(crate) fn wait(&self) {
        std::thread::sleep(Duration::from_millis(200));
    }

    /// Seconds since the command began.
    pub(crate) fn seconds(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    /// Prints the time of each stage, and its largest steps.
    pub(crate) fn timings(&mut self) {
        self.end_stage();
        let lines: Vec<String> = self
            .spent
            .iter()
            .map(|(stage, time)| {
                let shares = self.shares.get(stage).map_or("", String::as_str);
                format!("{:>9.3} s  {}{shares}", time.as_secs_f64(), stage.word())
            })
            .collect();
        for line in &lines {
            self.say(line);
        }
    }

    fn line(&self, colour: &str, label: &str, text: &str) {
        let text = visible(text);
        let _ = if self.colour {
            writeln!(io::stderr(), "\u{1b}[1;{colour}m{label}\u{1b}[0m: {text}")
        } else {
            writeln!(io::stderr(), "{label}: {text}")
        };
    }

    fn end_stage(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
        if let Some((stage, since)) = self.stage.take() {
            *self.spent.entry(stage).or_default() += since.elapsed();
        }
    }
}

impl Watch for Terminal {
    fn stage(&mut self, stage: Stage) {
        self.end_stage();
        self.stage = Some((stage, Instant::now()));
        if !self.quiet && io::stderr().is_terminal() {
            self.bar = Some(bar(stage));
        }
    }

    fn progress(&mut self, done: u64, total: u64) {
        if let Some(bar) = &self.bar {
            bar.set_length(total.max(done));
            bar.set_position(done);
        }
    }

    fn note(&mut self, text: &str) {
        self.end_stage();
        Self::note(self, text);
    }

    fn shares(&mut self, shares: &[(&'static str, f64)]) {
        let Some((stage, _)) = self.stage else {
            return;
        };
        let shares = shares.iter().filter(|(_, share)| *share >= 0.005);
        let words: Vec<String> = shares
            .map(|(word, share)| format!("{word} {:.0} %", share * 100.0))
            .collect();
        if !words.is_empty() {
            self.shares
                .insert(stage, format!(" ({})", words.join(", ")));
        }
    }

    fn stopped(&self) -> bool {
        self.stop.code().is_some()
    }
}

fn bar(stage: Stage) -> ProgressBar {
    let template = match stage {
        Stage::Read | Stage::Verify => "{msg:>9} [{bar:40}] {bytes}/{total_bytes}",
        Stage::Draw => "{msg:>9} [{bar:40}] frame {pos} of {len}, {eta} left",
        _ => "{msg:>9} [{bar:40}] {pos}/{len}",
    };
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    bar.set_style(style.progress_chars("=> "));
    bar.set_message(stage.word());
    bar
}

/// Prints why the process ends, on a line of its own.
fn last_words() {
    let _ = writeln!(io::stderr(), "\nerror: {}", Error::Interrupted);
}

/// Writes to standard output. A closed pipe is not an error.
fn print(bytes: &[u8]) -> Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other.map_err(Error::io("write", Path::new("standard output"))),
    }
}

/// Lines as they may be printed, whatever names they hold: all but line ends and tabs is made visible.
fn printable(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for part in text.split_inclusive(['\n', '\t']) {
        let kept = part.trim_end_matches(['\n', '\t']);
        out.push_str(&visible(kept));
        out.push_str(&part[kept.len()..]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_steer_the_terminal() {
        assert_eq!(
            printable("/a\u{1b}[2J\u{202e}b\n"),
            "/a\\u{1b}[2J\\u{202e}b\n"
        );
        assert_eq!(printable("/größe ✓\ta\n\nb"), "/größe ✓\ta\n\nb");
    }
}
