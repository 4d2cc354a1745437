//! MCAP files: by the summary and the message indexes, else record by record.
//!
//! The format: <https://mcap.dev/spec>. The files `mcap_*.rs` are parts of this one.

mod chunk;
mod forward;
mod records;
mod summary;
mod verify;

use std::collections::BTreeSet;
use std::path::Path;

use crate::bag::adapters::{Clip, GROUP, in_order};
use crate::bag::decompress::Compression;
use crate::bag::index::threads;
use crate::bag::input::{FormatRow, Medium, Place, file_name};
use crate::bag::model::{OpenOptions, Reader, Report, Sink, Tier};
use crate::bag::source::{FAR, NEAR, Source, Stream};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::Span;
use chunk::Chunk;
use records::{Cursor, MAGIC, op};
use summary::{Summary, Unindexed};

/// MCAP files.
pub(crate) const FORMAT: FormatRow = FormatRow {
    name: "mcap",
    what: "MCAP file (ROS 1 or ROS 2)",
    extensions: &["mcap"],
    medium: Medium::Stream,
    sniff: |_, head| head.starts_with(MAGIC),
    open,
};

/// A file, with its summary if that can be relied on.
struct Indexed {
    source: Source,
    summary: Result<Summary, Unindexed>,
    facts: Vec<(String, String)>,
    verify: bool,
}

/// A file from a pipe.
struct Piped {
    name: String,
    stream: Stream<'static>,
}

fn open(place: Place, options: &OpenOptions) -> Result<Box<dyn Reader>> {
    match place {
        Place::File(source) => {
            let summary = summary::of(&source).map_err(Error::io("read", source.path()))?;
            let facts = facts(&source);
            Ok(Box::new(Indexed {
                source,
                summary,
                facts,
                verify: options.verify,
            }))
        }
        Place::Pipe(name, stream) => Ok(Box::new(Piped { name, stream })),
        Place::Folder(path) => Err(super::explain(&path, &[], true)),
    }
}

/// What the file's header says of itself.
fn facts(source: &Source) -> Vec<(String, String)> {
    let mut stream = Stream::of_file(source, MAGIC.len() as u64, source.len(), NEAR);
    let Ok(Some((op::HEADER, len))) = records::next(&mut stream) else {
        return Vec::new();
    };
    let Ok(Some(record)) = records::whole(&mut stream, len) else {
        return Vec::new();
    };
    let mut cursor = Cursor(record);
    let values = [("profile", cursor.text()), ("library", cursor.text())];
    let known = values
        .into_iter()
        .filter_map(|(name, value)| Some((name.to_owned(), value?)));
    known.filter(|(_, value)| !value.is_empty()).collect()
}

impl Reader for Indexed {
    fn span(&mut self) -> Result<Option<Span>> {
        Ok(self
            .summary
            .as_ref()
            .ok()
            .and_then(|s| s.span(&self.source)))
    }

    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report> {
        let mut sink = Clip::new(range, sink);
        let report = match &self.summary {
            _ if self.verify => by_the_crate(&self.source, &mut sink),
            Ok(summary) => by_index(&self.source, summary, range, &mut sink),
            Err(reason) => from_the_front(&self.source, reason, &mut sink),
        };
        Ok(Report {
            bytes_read: self.source.bytes_read(),
            file_bytes: self.source.len(),
            facts: self.facts.clone(),
            ..report
        })
    }
}

/// What every report of this format begins with.
fn report(name: String, tier: Tier, compression: &BTreeSet<Compression>) -> Report {
    Report {
        name,
        format: FORMAT.name.to_owned(),
        compression: compression.iter().map(|c| c.word().to_owned()).collect(),
        tier,
        tier_reason: None,
        complete: true,
        bytes_read: 0,
        file_bytes: 0,
        facts: Vec::new(),
    }
}

fn by_index(
    source: &Source,
    summary: &Summary,
    range: Option<Span>,
    sink: &mut Clip<'_>,
) -> Report {
    let wants: Vec<_> = summary
        .table
        .list()
        .iter()
        .map(|c| sink.connection(c))
        .collect();
    let inside = |c: &&Chunk| range.is_none_or(|r| c.first < r.end && r.start <= c.last);
    let chunks: Vec<&Chunk> = summary.chunks.iter().filter(inside).collect();
    let resolve = |raw| summary.resolve(raw);
    let reader = summary::reader(source, &resolve, &wants, range);
    let groups: Vec<&[&Chunk]> = chunks.chunks(GROUP).collect();
    let work = |at: usize, sink: &mut dyn Sink| {
        for chunk in groups[at] {
            reader.read(chunk, sink);
        }
    };
    let total = groups.len() as u64;
    let threads = threads(chunks.len(), summary.longest_index());
    in_order(groups.len(), threads, &work, sink, |at, sink| {
        sink.progress(at as u64 + 1, total);
    });
    let samples = [chunks.first(), chunks.get(chunks.len() / 2), chunks.last()];
    let samples = samples.into_iter().flatten();
    let compression = samples
        .filter_map(|c| Some(reader.body(c).ok()??.how))
        .collect();
    Report {
        complete: !sink.lost,
        ..report(file_name(source.path()), Tier::Index, &compression)
    }
}

/// Everything, by the crate `mcap`.
fn by_the_crate(source: &Source, sink: &mut Clip<'_>) -> Report {
    let mut stream = Stream::of_file(source, 0, source.len(), FAR);
    let stopped = verify::read(&mut stream, sink).err();
    Report {
        complete: stopped.is_none() && !sink.lost,
        tier_reason: stopped.map(|why| format!("the second reader stopped: {why}")),
        ..report(file_name(source.path()), Tier::Verify, &BTreeSet::new())
    }
}

fn from_the_front(source: &Source, reason: &Unindexed, sink: &mut dyn Sink) -> Report {
    let text = format!("read from the front, since {}", reason.0);
    sink.notice(Notice::new(NoticeKind::Downgraded, text));
    let mut stream = Stream::of_file(source, MAGIC.len() as u64, source.len(), FAR);
    let found = forward::read(&mut stream, source.len(), sink);
    Report {
        complete: found.complete,
        tier_reason: Some(reason.0.clone()),
        ..report(file_name(source.path()), Tier::Forward, &found.compression)
    }
}

impl Reader for Piped {
    fn span(&mut self) -> Result<Option<Span>> {
        Ok(None)
    }

    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report> {
        let name = self.name.clone();
        self.stream
            .peek(MAGIC.len())
            .map_err(Error::io("read", Path::new(&name)))?;
        self.stream.advance(MAGIC.len());
        let found = forward::read(&mut self.stream, 0, &mut Clip::new(range, sink));
        Ok(Report {
            complete: found.complete,
            tier_reason: Some("a pipe has no index".to_owned()),
            bytes_read: self.stream.position(),
            ..report(name, Tier::Forward, &found.compression)
        })
    }
}
