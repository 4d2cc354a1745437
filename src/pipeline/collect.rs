//! Reads every bag once and gathers its evidence.

use std::collections::BTreeSet;
use std::path::PathBuf;

use super::{Reading, Watch};
use crate::bag::{self, Input, OpenOptions, Reader, Report};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::time::Span;
use crate::evidence::collector::{self, Collector, Recorded};
use crate::graph::window;

/// The bags of a mission, read.
pub(super) struct Collected {
    pub(super) reports: Vec<Report>,
    pub(super) recorded: Recorded,
    /// The time that the windows divide.
    pub(super) range: Span,
}

/// Reads every bag once; with `verify` by the second, independent reader.
pub(super) fn collect(reading: &Reading, verify: bool, watch: &mut dyn Watch) -> Result<Collected> {
    let options = OpenOptions {
        verify,
        ..OpenOptions::default()
    };
    let (inputs, twice) = each_once(&reading.inputs)?;
    let mut readers = bag::open_each(inputs, &options).collect::<Result<Vec<_>>>()?;
    let cut = reading.division.start.is_some() || reading.division.end.is_some();
    let known = if cut { known_span(&mut readers)? } else { None };
    let range = known
        .map(|span| window::range(&reading.division, span))
        .transpose()?;
    let mut collector = Collector::new(affordable(reading));
    let mut reports = Vec::new();
    for mut reader in readers {
        let mut progress = |done, total| watch.progress(done, total);
        reports.push(reader.read(range, &mut collector.bag(&mut progress))?);
    }
    let mut recorded = collector.finish()?;
    recorded.notices.extend(twice);
    let Some(span) = recorded.span else {
        return Err(no_messages(&reading.inputs, &recorded.notices));
    };
    let range = match range {
        Some(range) => range,
        None => window::range(&reading.division, span)?,
    };
    Ok(Collected {
        reports,
        recorded,
        range,
    })
}

/// The options of collecting, without the payloads of bags that are too large, or too far away, to be compared: an index
/// would be of no use if every payload were read. Where all are asked for they are read.
fn affordable(reading: &Reading) -> collector::CollectOptions {
    let mut options = reading.collect.clone();
    let sizes = reading.inputs.iter().filter_map(bag::size_on_disk);
    let is_far = |input: &Input| matches!(input, Input::Url(_));
    let is_large = sizes.fold(0, u64::saturating_add) > options.payload_bytes;
    let is_bounded = options.payload_bytes < u64::MAX;
    if is_bounded && (is_large || reading.inputs.iter().any(is_far)) {
        options.payload_bytes = 0;
    }
    options
}

/// Every input once, with a notice for those named twice, which would count twice.
fn each_once(inputs: &[Input]) -> Result<(Vec<Input>, Vec<Notice>)> {
    let mut seen = BTreeSet::new();
    let (mut once, mut twice) = (Vec::new(), Vec::new());
    for input in inputs {
        let real = match input {
            Input::Path(path) => path.canonicalize().unwrap_or_else(|_| path.clone()),
            Input::Url(url) => PathBuf::from(url),
            Input::Stdin => PathBuf::from("-"),
        };
        if seen.insert(real) {
            once.push(input.clone());
        } else if input.is_pipe() {
            let what = format!("{} was named twice, and can be read once", input.name());
            return Err(Error::usage(what, "name it once"));
        } else {
            let text = format!("`{}` was named twice and read once", input.name());
            twice.push(Notice::new(NoticeKind::Note, text));
        }
    }
    Ok((once, twice))
}

/// The words for a bag that is whole and empty.
pub(super) const NOTHING_RECORDED: &str = "it was closed before anything was recorded";

/// The error for bags without a message, with the losses on the way.
fn no_messages(inputs: &[Input], notices: &Notices) -> Error {
    let lost: Vec<String> = notices
        .iter()
        .filter(|n| n.kind.is_loss())
        .take(3)
        .map(|n| format!("{} (×{})", n.text, n.count))
        .collect();
    Error::NoMessages {
        path: inputs
            .first()
            .map_or_else(PathBuf::new, |i| PathBuf::from(i.name())),
        hint: if lost.is_empty() {
            NOTHING_RECORDED.to_owned()
        } else {
            lost.join("; ")
        },
    }
}

/// The time that all bags cover; `None` unless every one of them tells its own without being read.
pub(super) fn known_span(readers: &mut [Box<dyn Reader>]) -> Result<Option<Span>> {
    let mut all: Option<Span> = None;
    for reader in readers {
        let Some(span) = reader.span()? else {
            return Ok(None);
        };
        all = Some(all.map_or(span, |a| Span {
            start: a.start.min(span.start),
            end: a.end.max(span.end),
        }));
    }
    Ok(all)
}
