//! Terminal output: results, notices, errors and hints; the only file that prints.

mod progress;

use std::io::{self, IsTerminal as _, Write as _};
use std::path::Path;
use std::sync::atomic::Ordering;

use terminal_size::{Height, Width, terminal_size_of};

use super::stop::Stop;
use super::{Colour, Typed};
use crate::base::columns::{fitted, hang};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::words::{self, visible};
use crate::mission::event_log::Kind;
use crate::mission::event_log::{LogFormat, LogLine};
use crate::pipeline::{Stage, Watch};
use progress::Progress;

/// Standard error and output, as configured by the user.
#[derive(Debug)]
pub(crate) struct Terminal {
    quiet: bool,
    verbose: bool,
    /// Whether messages have colours, and whether results have.
    colours: (bool, bool),
    progress: Progress,
    stop: Stop,
}

impl Terminal {
    /// A terminal as set by the common options.
    pub(super) fn new(typed: &Typed) -> Self {
        Self {
            quiet: typed.quiet,
            verbose: typed.verbose,
            colours: (
                has_colour(typed.color, true),
                has_colour(typed.color, false),
            ),
            progress: Progress::new(!typed.quiet),
            stop: Stop::listen(report_stop),
        }
    }

    /// The width of the terminal on which results are printed; `None` if they go elsewhere.
    #[expect(
        clippy::unused_self,
        reason = "only code with access to the terminal may measure it"
    )]
    pub(crate) fn width(&self) -> Option<usize> {
        columns(terminal_size_of(io::stdout()))
    }

    /// Prints an error and its hint.
    pub(crate) fn error(&mut self, error: &Error) {
        self.progress.end();
        self.line("31", "error", &error.to_string());
        let hint = error.hint();
        if !hint.is_empty() {
            self.line("36", "hint", &hint);
        }
    }

    /// Prints notices, one line each; several routine ones are summarized in one line, unless all are requested.
    pub(crate) fn notices(&mut self, notices: &Notices) {
        self.progress.end();
        if self.quiet {
            return;
        }
        let is_routine = |notice: &Notice| notice.kind.is_routine();
        let (routine, rest): (Vec<Notice>, Vec<Notice>) = notices.iter().partition(is_routine);
        for notice in &rest {
            self.notice(notice);
        }
        match &routine[..] {
            several if several.len() > 1 && !self.verbose => self.note(&summary(several)),
            all => all.iter().for_each(|notice| self.notice(notice)),
        }
    }

    fn notice(&self, notice: &Notice) {
        let (colour, label) = if notice.kind.is_loss() {
            ("33", "warning")
        } else {
            ("36", "note")
        };
        let text = notice.text.clone() + &notice.times();
        self.line(colour, label, &text);
    }

    /// Prints a line on standard error unless quiet.
    pub(crate) fn status(&mut self, text: &str) {
        self.progress.end();
        if !self.quiet {
            // Nothing can be reported if standard error is closed.
            let line = hang("", &visible(text), 2, error_width());
            let _ = io::stderr().write_all(line.as_bytes());
        }
    }

    /// Prints the files written, what is in them, and the time taken, in one line, as [`Terminal::status`].
    pub(crate) fn wrote<'a>(&mut self, files: impl IntoIterator<Item = &'a Path>, what: &str) {
        let names = words::joined(files.into_iter().map(Path::display), ", ");
        let seconds = self.seconds();
        self.status(&format!("wrote {names}: {what}, in {seconds:.1} s"));
    }

    /// Prints results on standard output. A closed pipe is not an error.
    ///
    /// # Errors
    /// [`Error::Io`] if not all of it could be written.
    pub(crate) fn results(&mut self, text: &str) -> Result<()> {
        self.progress.end();
        print(printable(text).as_bytes()).map(drop)
    }

    /// As [`Terminal::results`], with lines that fit a terminal.
    ///
    /// # Errors
    /// As [`Terminal::results`].
    pub(crate) fn fitted(&mut self, text: &str) -> Result<()> {
        match self.width() {
            Some(width) => self.results(&fitted(text, width)),
            None => self.results(text),
        }
    }

    /// As [`Terminal::results`], for a table: bytes that are not text are printed unchanged.
    ///
    /// # Errors
    /// As [`Terminal::results`].
    pub(crate) fn table(&mut self, table: &[u8]) -> Result<()> {
        self.progress.end();
        match std::str::from_utf8(table) {
            Ok(text) => self.results(text),
            Err(_) => print(table).map(drop),
        }
    }

    /// Sets whether the next signal is only recorded, for [`Terminal::take_signal`]; a second one still ends the
    /// process.
    pub(crate) fn note_signals(&self, on: bool) {
        self.stop.is_noted.store(on, Ordering::Relaxed);
    }

    /// Whether a signal was received; resets the flag, as the work ends as requested.
    pub(crate) fn take_signal(&self) -> bool {
        self.stop.take()
    }

    /// Prints lines of a log on standard output, those for people with a hanging indent, in the colour of their kind; false
    /// if it was closed.
    ///
    /// # Errors
    /// As [`Terminal::results`].
    pub(crate) fn log(&mut self, lines: &[LogLine], format: LogFormat) -> Result<bool> {
        self.progress.end();
        let is_text = format == LogFormat::Text;
        let width = self.width().filter(|_| is_text);
        let is_coloured = self.colours.1 && is_text;
        let mut text = String::new();
        for line in lines {
            let shown = printable(&line.text(width));
            if is_coloured {
                let colour = line.kind.map_or("1", colour);
                let start = line.lead.len().min(shown.len());
                let end = shown[start..].find([':', '\n']);
                let end = end.map_or(shown.len(), |at| start + at);
                let (lead, head, rest) = (&shown[..start], &shown[start..end], &shown[end..]);
                text.extend([lead, "\u{1b}[", colour, "m", head, "\u{1b}[0m", rest]);
            } else {
                text.push_str(&shown);
            }
        }
        print(text.as_bytes())
    }

    /// Hides the progress bar if something else writes results to standard output and that is the terminal.
    pub(crate) fn make_room(&mut self) {
        if io::stdout().is_terminal() {
            self.progress.hide();
        }
    }

    /// The exit code for the signal that requested a stop, if any.
    pub(crate) fn stopped_by(&self) -> Option<u8> {
        self.stop.code()
    }

    /// Prints a note unless quiet.
    pub(crate) fn note(&self, text: &str) {
        if !self.quiet {
            self.progress.aside(|| self.line("36", "note", text));
        }
    }

    /// Seconds since the command began.
    pub(crate) fn seconds(&self) -> f64 {
        self.progress.seconds()
    }

    fn line(&self, colour: &str, label: &str, text: &str) {
        let lead = format!("{label}: ");
        let line = hang(&lead, &visible(text), lead.len(), error_width());
        let line = match self.colours {
            (true, _) => format!("\u{1b}[1;{colour}m{label}\u{1b}[0m{}", &line[label.len()..]),
            (false, _) => line,
        };
        let _ = io::stderr().write_all(line.as_bytes());
    }
}

/// Prints an error of the command line, with its colours.
pub(super) fn print_usage(error: &str) {
    let text = error_width().map_or_else(|| error.to_owned(), |width| fitted(error, width));
    let _ = io::stderr().write_all(text.as_bytes());
}

/// Whether standard error, or standard output, has colours: only on a terminal that has them, and if `NO_COLOR` is not set,
/// unless `--color` overrides it.
pub(super) fn has_colour(asked: Colour, is_error: bool) -> bool {
    match asked {
        Colour::Auto => {
            let is_refused = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
            let (out, error) = (io::stdout().is_terminal(), io::stderr().is_terminal());
            !is_refused && !progress::is_dumb() && if is_error { error } else { out }
        }
        Colour::Always => true,
        Colour::Never => false,
    }
}

/// The width of standard error as of [`Terminal::width`].
fn error_width() -> Option<usize> {
    columns(terminal_size_of(io::stderr()))
}

fn columns(size: Option<(Width, Height)>) -> Option<usize> {
    size.map(|(width, _)| usize::from(width.0).max(LEAST_WIDTH))
}

/// The width below which results are not fitted: so narrow a terminal shows nothing useful anyway.
const LEAST_WIDTH: usize = 40;

/// The colour of an event: green for a start, red for an end, yellow for a temporary absence, magenta for a handover,
/// cyan for every other change.
fn colour(kind: Kind) -> &'static str {
    match kind {
        Kind::Started | Kind::Appeared => "32",
        Kind::Stopped | Kind::Vanished => "31",
        Kind::Restarted | Kind::Silent => "33",
        Kind::HandedOver => "35",
        _ => "36",
    }
}

/// Several routine notices in one line.
fn summary(notices: &[Notice]) -> String {
    let of = |kind: NoticeKind| notices.iter().filter(move |notice| notice.kind == kind);
    let hidden: u64 = of(NoticeKind::Hidden).map(|notice| notice.count).sum();
    let [chosen, fonts] =
        [NoticeKind::Chosen, NoticeKind::Glyph].map(|kind| of(kind).count() as u64);
    let parts = [
        (hidden, "element", "left out or collapsed"),
        (chosen, "setting", "chosen"),
        (fonts, "font", "about missing characters"),
    ];
    let parts = parts.iter().filter(|(count, ..)| *count > 0);
    let parts = parts.map(|(count, what, how)| format!("{} {how}", words::count(*count, what)));
    format!("{}; `-v` lists them", words::joined(parts, ", "))
}

impl Watch for Terminal {
    fn stage(&mut self, stage: Stage) {
        self.progress.begin(stage);
    }

    fn progress(&mut self, done: u64, total: u64) {
        self.progress.set(done, total);
    }

    fn note(&mut self, text: &str) {
        Self::note(self, text);
    }

    fn stopped(&self) -> bool {
        self.stop.code().is_some()
    }
}

/// Prints why the process ends, on a line of its own.
fn report_stop() {
    let _ = writeln!(io::stderr(), "\nerror: {}", Error::Interrupted);
}

/// Writes to standard output; false if that is a closed pipe, which is not an error.
fn print(bytes: &[u8]) -> Result<bool> {
    let mut out = io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(Error::io("write", Path::new("standard output"))(error)),
        Ok(()) => Ok(true),
    }
}

/// Lines that are safe to print: all control characters except line ends and tabs are escaped.
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
    fn names_cannot_control_the_terminal() {
        assert_eq!(
            printable("/a\u{1b}[2J\u{202e}b\n"),
            "/a\\u{1b}[2J\\u{202e}b\n"
        );
        assert_eq!(printable("/größe ✓\ta\n\nb"), "/größe ✓\ta\n\nb");
    }
}
