//! `follow`: polls a recording, prints what is new, and writes the outputs at the end.

use std::ffi::OsString;
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use clap::Args;

use super::render;
use super::show::NO_EVENTS;
use super::terminal::Terminal;
use super::values::{one_of, period};
use super::{DONE, SKIPPED, code, gate};
use crate::bag::Growth;
use crate::base::error::Result;
use crate::base::time::Period;
use crate::export::Output;
use crate::gate::FORMATS;
use crate::graph::window::Length;
use crate::mission::event_log::LogFormat;
use crate::pipeline::follow::{Feed, FindingFeed, Follow};
use crate::pipeline::{Reading, Render};

#[derive(Debug, Args)]
pub(super) struct FollowArgs {
    /// The recording: `.bag.active`, `.bag`, `.mcap`, `.db3`, a rosbag2 folder, or a folder whose newest recording
    /// is followed.
    #[arg(value_name = "WHAT")]
    what: PathBuf,
    /// Output format: a line per event for people, or an object per line for programs.
    #[arg(long, value_name = "text|ndjson", default_value = "text", value_parser = one_of([LogFormat::Text, LogFormat::Ndjson]))]
    format: LogFormat,
    /// Check the recording against this expectations file: print findings when they are certain, and exit
    /// as `check` does.
    #[arg(long, value_name = "FILE")]
    expect: Option<PathBuf>,
    /// Output file, written at the end as `render` writes it from the closed recording. Repeatable.
    #[arg(long = "output", short, value_name = "FILE")]
    outputs: Vec<OsString>,
    /// Stop when nothing was written, or no recording was there, for this long. [default: when the recorder closes the recording, or at a signal]
    #[arg(long, value_name = "TIME", value_parser = period)]
    idle: Option<Period>,
}

pub(super) const HELP: &str = "Nothing is written to the recording, and a database is never locked. A line is marked `(so far)` until it is certain.\n\n\
    Exit codes: 0 done, 1 failed or a rule is broken, 2 usage error, 3 done but data was skipped (damaged bag).";

/// The time between two looks at the recording.
const PAUSE: Duration = Duration::from_millis(200);
/// The number of newest messages in which events are detected: less than a tenth of a second of work, and
/// several minutes for most robots.
const MOST: u64 = 500_000;
/// The pause between two analyses as a multiple of their duration: with the reading, three percent of a core.
const REST: f64 = 45.0;
/// The shortest pause in seconds between two analyses: in general, and after something new appeared, when
/// people are waiting for the output.
const LEAST: f64 = 1.0;
const LEAST_NEW: f64 = 0.2;
/// The part of the recording that is kept in memory for events and findings: an hour, so that memory is bounded however
/// long the recording.
const KEPT: Period = match Period::from_nanos(3_600_000_000_000) {
    Some(hour) => hour,
    None => unreachable!(),
};
/// The seconds from the first sign of something new to its analysis: a first message alone does not show a rhythm.
const SETTLED: f64 = 0.5;

/// A recurring task, and the next time at which it may run.
#[derive(Default)]
struct Pace {
    due: f64,
    /// The time at which it may run if something new appeared.
    due_new: f64,
}

impl Pace {
    /// Runs the task and schedules the next run.
    fn spend<T>(&mut self, terminal: &Terminal, work: impl FnOnce() -> T) -> T {
        let begun = terminal.seconds();
        let done = work();
        let now = terminal.seconds();
        self.due = now + ((now - begun) * REST).max(LEAST);
        self.due_new = now + ((now - begun) * REST / 4.0).max(LEAST_NEW);
        done
    }
}

/// The state of a followed recording and its outputs.
struct Follower<'a> {
    args: &'a FollowArgs,
    follow: Follow,
    feed: Feed,
    findings: Option<FindingFeed>,
    job: Render,
    events: Pace,
    checks: Pace,
    /// Whether no event has been printed.
    is_silent: bool,
}

/// Follows a recording to its end.
pub(super) fn follow(args: &FollowArgs, terminal: &mut Terminal) -> Result<u8> {
    let reading = Reading::of([&args.what]);
    let outputs = args.outputs.iter().map(|o| Output::named(o, None));
    let job = Render::new(reading.clone(), outputs.collect::<Result<_>>()?)?;
    crate::pipeline::check_outputs(&job)?;
    let findings = args.expect.as_deref().map(FindingFeed::new).transpose()?;
    let Some(follow) = begun(args, &reading, terminal)? else {
        return Ok(DONE);
    };
    if args.what.is_dir() && follow.path() != args.what {
        let newest = follow.path().display();
        terminal.note(&format!(
            "following `{newest}`, the newest recording in `{}`",
            args.what.display()
        ));
    }
    let follower = Follower {
        args,
        follow,
        feed: Feed::default(),
        findings,
        job,
        events: Pace::default(),
        checks: Pace::default(),
        is_silent: true,
    };
    follower.run(terminal)
}

/// Begins to follow a recording as soon as its recorder has created it; `None` at a signal.
fn begun(args: &FollowArgs, reading: &Reading, terminal: &Terminal) -> Result<Option<Follow>> {
    let idle = args.idle.map(|idle| idle.nanos() as f64 / 1e9);
    let begun = terminal.seconds();
    let is_empty = |at: std::fs::Metadata| at.is_file() && at.len() == 0;
    let is_absent = || args.what.metadata().map_or(true, is_empty);
    let is_waiting = || idle.is_none_or(|idle| terminal.seconds() - begun < idle) && is_absent();
    if is_waiting() {
        terminal.note(&format!("waiting for `{}`", args.what.display()));
    }
    terminal.note_signals(true);
    while is_waiting() {
        if terminal.take_signal() {
            return Ok(None);
        }
        thread::sleep(PAUSE);
    }
    terminal.note_signals(false);
    Follow::new(reading.clone(), KEPT).map(Some)
}

impl Follower<'_> {
    fn run(mut self, terminal: &mut Terminal) -> Result<u8> {
        terminal.note_signals(true);
        let (mut grew, mut known, mut appeared) = (terminal.seconds(), 0, None);
        let (mut is_behind, mut is_unchecked) = (false, false);
        let idle = self.args.idle.map(|idle| idle.nanos() as f64 / 1e9);
        let is_complete = loop {
            let growth = self.follow.poll()?;
            let now = terminal.seconds();
            if growth == Growth::More {
                (grew, is_behind, is_unchecked) = (now, true, true);
            }
            if self.follow.known() > known {
                known = self.follow.known();
                appeared.get_or_insert(now);
            }
            let is_idle = idle.is_some_and(|idle| now - grew >= idle);
            let is_over = growth == Growth::Ended || is_idle || terminal.take_signal();
            if is_over {
                // Another one ends the remaining work.
                terminal.note_signals(false);
            }
            let is_settled = appeared.is_some_and(|at| now >= at + SETTLED);
            let is_new = is_settled && now >= self.events.due_new;
            if is_behind && (is_over || is_new || now >= self.events.due) {
                is_behind = false;
                appeared = appeared.filter(|_| !is_settled);
                if !self.print_events(terminal)? {
                    break false;
                }
            }
            if is_unchecked && (is_over || now >= self.checks.due) {
                is_unchecked = false;
                self.print_findings(terminal)?;
            }
            if is_idle && let Some(idle) = self.args.idle {
                terminal.status(&format!("nothing was written for {idle}"));
            }
            if is_over {
                break growth == Growth::Ended || is_idle;
            }
            thread::sleep(PAUSE);
        };
        self.end(is_complete, terminal)
    }

    /// Prints the new events; false if standard output was closed.
    fn print_events(&mut self, terminal: &mut Terminal) -> Result<bool> {
        let (follow, feed, format) = (&self.follow, &mut self.feed, self.args.format);
        let lines = self.events.spend(terminal, || {
            let known = follow.so_far(MOST, Length::All)?;
            Ok(known.map_or_else(Vec::new, |known| feed.new_lines(&known, format)))
        });
        let lines = lines?;
        self.is_silent &= lines.is_empty();
        terminal.log(&lines, format)
    }

    /// Prints new findings.
    fn print_findings(&mut self, terminal: &mut Terminal) -> Result<()> {
        let Some(findings) = &mut self.findings else {
            return Ok(());
        };
        let length = findings.length();
        let (follow, format) = (&self.follow, self.args.format);
        let lines = self.checks.spend(terminal, || {
            let known = follow.so_far(u64::MAX, length)?;
            Ok(known.map_or_else(Vec::new, |known| findings.new_lines(&known, format)))
        });
        terminal.log(&lines?, format).map(drop)
    }

    /// Checks the recording as it is now and writes the outputs. Nothing more is expected of a complete one.
    fn end(self, is_complete: bool, terminal: &mut Terminal) -> Result<u8> {
        terminal.note_signals(false);
        if self.is_silent {
            terminal.note(NO_EVENTS);
        }
        let mut done = DONE;
        if self.job.outputs.is_empty() && self.args.expect.is_none() {
            let losses = self.follow.losses(is_complete)?;
            terminal.notices(&losses);
            done = if losses.is_empty() { DONE } else { SKIPPED };
        }
        let job = Render {
            reading: self.follow.closed(),
            ..self.job
        };
        if !job.outputs.is_empty() {
            let rendered = crate::pipeline::render(&job, terminal)?;
            render::report(&rendered, terminal);
            done = code(&rendered.mission.notices);
        }
        let Some(expect) = &self.args.expect else {
            return Ok(done);
        };
        let format = (self.args.format == LogFormat::Text).then_some(&FORMATS[0]);
        let mut check = gate::job(job.reading, expect.clone());
        check.bags = vec![self.args.what.display().to_string()];
        gate::verdict(&check, format, terminal)
    }
}
