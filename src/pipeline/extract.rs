//! Messages as tables: a row per message, or a table per topic with all fields decoded.

mod definitions;
mod fields;
mod messages;

use std::collections::BTreeSet;
use std::path::PathBuf;

use super::inputs::each_once;
use super::read::files;
use super::times::MessageTimes;
use super::{Stage, Watch};
use crate::bag::{self, Input, OpenOptions, Reader, Want, known_span};
use crate::base::error::{Error, Result};
use crate::base::name::TopicName;
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::time::{Moment, Span};
use crate::evidence::clock;
use crate::export::check::{check, check_folder, make_folder};
use crate::export::tables::TableFormat;
use crate::export::target::Target;
use crate::graph::window::{self, Division};
use crate::view::{NameFilter, unmatched_topics};

/// The whole job of `bagreel extract`.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Extract {
    /// Bags, whose messages become one table, or one set of tables.
    pub inputs: Vec<Input>,
    /// The file to write; with `fields` the folder of the tables.
    pub target: Target,
    /// The format of the tables.
    pub format: TableFormat,
    /// Whether messages are decoded.
    pub fields: bool,
    /// The topics to extract.
    pub topics: NameFilter,
    /// Folders of `.msg`, `.srv`, `.action` and `.idl` files for types that the bags do not define.
    pub msg_paths: Vec<PathBuf>,
    /// The start; earlier messages are left out.
    pub start: Option<Moment>,
    /// The end; later messages are left out.
    pub end: Option<Moment>,
}

/// The outcome of `bagreel extract`.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Extracted {
    /// The number of tables written.
    pub tables: usize,
    /// The total number of their rows.
    pub rows: u64,
    /// The number of messages that could not be decoded.
    pub undecoded: u64,
    /// The notices for the user.
    pub notices: Notices,
    /// All topics of the bags.
    topics: BTreeSet<TopicName>,
}

/// Reads bags and writes their messages as tables, atomically.
///
/// # Errors
/// If an input cannot be read at all, an output cannot be written, or times are invalid.
pub fn extract(job: &Extract, watch: &mut dyn Watch) -> Result<Extracted> {
    let kept = files(&job.inputs);
    let (inputs, twice) = each_once(&job.inputs)?;
    let once = Extract {
        inputs,
        ..job.clone()
    };
    let mut done = if job.fields {
        check_folder(job.target.path(), job.format.word(), &kept)?;
        watch.stage(Stage::Read);
        fields::extract(&once, watch)?
    } else {
        check(std::slice::from_ref(&job.target), &kept)?;
        make_folder(&job.target)?;
        watch.stage(Stage::Read);
        messages::extract(&once, watch)?
    };
    done.notices.extend(twice);
    let topics: Vec<&str> = done.topics.iter().map(TopicName::as_str).collect();
    done.notices.extend(unmatched_topics(&job.topics, &topics));
    if done.rows == 0 {
        let text = "no message of these topics is in that time";
        done.notices.add(Notice::new(NoticeKind::Note, text));
    }
    Ok(done)
}

impl Extract {
    /// Every input, open.
    fn open(&self) -> Result<Vec<Box<dyn Reader>>> {
        let options = OpenOptions::default();
        let inputs = self.inputs.iter();
        inputs.map(|i| bag::open(i, &options)).collect()
    }

    /// The requested part of the bags; `None` for all of it. Bags whose time range is not in their tails, or not credible,
    /// are read to determine it. Adds to `notices` what is said of messages at incredible times, if these were looked for.
    fn range(&self, notices: &mut Notices, watch: &mut dyn Watch) -> Result<Option<Span>> {
        let is_whole = self.start.is_none() && self.end.is_none();
        // A row per message is only written once all times are known.
        if is_whole && (!self.fields || self.inputs.iter().any(Input::is_pipe)) {
            return Ok(None);
        }
        let known = known_span(&mut self.open_files()?)?;
        let span = match known.filter(|span| clock::is_sure(*span)) {
            Some(_) if is_whole => return Ok(None),
            Some(span) => Some(span),
            None => self.measure(notices, watch)?,
        };
        let division = Division {
            start: self.start,
            end: self.end,
            ..Division::default()
        };
        span.map(|span| window::range(&division, span)).transpose()
    }

    /// As [`Extract::open`], but refuses pipes, which cannot be read twice.
    fn open_files(&self) -> Result<Vec<Box<dyn Reader>>> {
        if self.inputs.iter().any(Input::is_pipe) {
            return Err(Error::usage(
                "the time range of a pipe is unknown until it ends",
                "save it to a file first, or leave `--start` and `--end` out",
            ));
        }
        self.open()
    }

    fn measure(&self, notices: &mut Notices, watch: &mut dyn Watch) -> Result<Option<Span>> {
        let all = NameFilter::default();
        let mut times = MessageTimes::new(&all, Want::Stamps);
        for mut reader in self.open()? {
            times.read(&mut *reader, None, watch)?;
            stop(watch)?;
        }
        notices.extend(times.finish()?);
        Ok(times.span())
    }
}

/// Fails with [`Error::Interrupted`] if the user asked to stop.
fn stop(watch: &dyn Watch) -> Result<()> {
    if watch.stopped() {
        return Err(Error::Interrupted);
    }
    Ok(())
}
