//! ROS 1 bags, version 2: by the index behind each chunk, else record by record.
//!
//! The format: <https://wiki.ros.org/Bags/Format/2.0>. The files `rosbag1_*.rs` are parts of this one.

mod chunk;
mod forward;
mod plan;
mod records;
mod verify;

use std::collections::BTreeSet;
use std::path::Path;

use crate::bag::adapters::{Clip, GROUP, in_order};
use crate::bag::decompress::Compression;
use crate::bag::index::threads;
use crate::bag::input::{FormatRow, Medium, Place, file_name};
use crate::bag::model::{OpenOptions, Reader, Report, Sink, Tier};
use crate::bag::source::{FAR, Source, Stream};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::Span;
use chunk::Chunk;
use plan::{Plan, Unindexed};

/// ROS 1 bags.
pub(crate) const FORMAT: FormatRow = FormatRow {
    name: "rosbag1",
    what: "ROS 1 bag",
    extensions: &["bag", "bag.active"],
    medium: Medium::Stream,
    sniff: |_, head| head.starts_with(b"#ROSBAG V2.") || head.starts_with(b"#ROSRECORD V"),
    open,
};

/// A bag in a file, with its tail if that can be relied on.
struct Indexed {
    source: Source,
    plan: Result<Plan, Unindexed>,
    verify: bool,
}

/// A bag from a pipe.
struct Piped {
    name: String,
    stream: Stream<'static>,
}

fn open(place: Place, options: &OpenOptions) -> Result<Box<dyn Reader>> {
    match place {
        Place::File(source) => {
            let mut head = [0; 32];
            let got = source.read_at(0, &mut head);
            let got = got.map_err(Error::io("read", source.path()))?;
            version(source.path(), &head[..got])?;
            let plan = plan::of(&source).map_err(Error::io("read", source.path()))?;
            Ok(Box::new(Indexed {
                source,
                plan,
                verify: options.verify,
            }))
        }
        Place::Pipe(name, mut stream) => {
            let head = stream
                .peek(32)
                .map_err(Error::io("read", Path::new(&name)))?;
            version(Path::new(&name), head)?;
            Ok(Box::new(Piped { name, stream }))
        }
        Place::Folder(path) => Err(super::explain(&path, &[], true)),
    }
}

/// Refuses what is older than version 2.
fn version(path: &Path, head: &[u8]) -> Result<()> {
    if head.starts_with(b"#ROSBAG V2.") {
        return Ok(());
    }
    let line = head.split(|b| *b == b'\n').next().unwrap_or_default();
    Err(Error::Unsupported {
        path: path.to_owned(),
        what: format!(
            "it is of an old format, `{}`",
            String::from_utf8_lossy(line)
        ),
        hint: "`rosbag fix old.bag new.bag` of a ROS 1 installation brings it to version 2"
            .to_owned(),
    })
}

impl Reader for Indexed {
    fn span(&mut self) -> Result<Option<Span>> {
        let Ok(plan) = &self.plan else {
            return Ok(None);
        };
        Ok(plan.span(&self.source))
    }

    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report> {
        let mut sink = Clip::new(range, sink);
        match &self.plan {
            Ok(plan) if self.verify => Ok(by_the_crate(&self.source, plan, &mut sink)),
            Ok(plan) => Ok(by_index(&self.source, plan, range, &mut sink)),
            Err(reason) => Ok(from_the_front(&self.source, reason, &mut sink)),
        }
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

fn by_index(source: &Source, plan: &Plan, range: Option<Span>, sink: &mut Clip<'_>) -> Report {
    let wants: Vec<_> = plan
        .table
        .list()
        .iter()
        .map(|c| sink.connection(c))
        .collect();
    plan.notices(sink);
    let inside = |c: &&Chunk| range.is_none_or(|r| c.first < r.end && r.start <= c.last);
    let chunks: Vec<&Chunk> = plan.chunks.iter().filter(inside).collect();
    let resolve = |raw| plan.table.get(raw);
    let reader = plan.reader(source, &resolve, &wants, range);
    let groups: Vec<&[&Chunk]> = chunks.chunks(GROUP).collect();
    let work = |at: usize, sink: &mut dyn Sink| {
        for chunk in groups[at] {
            reader.read(chunk, sink);
        }
    };
    let total = groups.len() as u64;
    in_order(
        groups.len(),
        threads(chunks.len(), plan.longest_index()),
        &work,
        sink,
        |at, sink| sink.progress(at as u64 + 1, total),
    );
    let complete = !sink.lost;
    let samples = [chunks.first(), chunks.get(chunks.len() / 2), chunks.last()];
    let compression = samples.into_iter().flatten();
    let compression = compression
        .filter_map(|c| Some(reader.body(c).ok()??.how))
        .collect();
    Report {
        complete,
        bytes_read: source.bytes_read(),
        file_bytes: source.len(),
        ..report(file_name(source.path()), Tier::Index, &compression)
    }
}

/// Everything, by the crate `rosbag`.
fn by_the_crate(source: &Source, plan: &Plan, sink: &mut Clip<'_>) -> Report {
    let verified = verify::read(source, plan, sink);
    let stopped = verified.stopped.as_ref();
    if let (true, Some(why)) = (verified.refused, stopped) {
        // Our own way from the front is the next best: it looks at no index.
        let mut stream = Stream::of_file(source, 0, source.len(), FAR);
        let found = forwards(&mut stream, source.len(), sink);
        return Report {
            complete: found.complete,
            tier_reason: Some(format!(
                "the crate `rosbag` refuses ({why}); read from the front instead"
            )),
            bytes_read: source.bytes_read(),
            file_bytes: source.len(),
            ..report(file_name(source.path()), Tier::Verify, &found.compression)
        };
    }
    let reason = stopped.map(|why| format!("the second reader stopped: {why}"));
    Report {
        complete: reason.is_none() && !sink.lost,
        tier_reason: reason,
        bytes_read: source.len(),
        file_bytes: source.len(),
        ..report(
            file_name(source.path()),
            Tier::Verify,
            &verified.compression,
        )
    }
}

fn from_the_front(source: &Source, reason: &Unindexed, sink: &mut dyn Sink) -> Report {
    let mut stream = Stream::of_file(source, 0, source.len(), FAR);
    sink.notice(Notice::new(
        NoticeKind::Downgraded,
        format!("read from the front, since {}", reason.why),
    ));
    let mut found = forwards(&mut stream, source.len(), sink);
    if reason.cut && found.complete {
        // Cut where a record ends, so that only the head knows.
        found.complete = false;
        sink.notice(Notice::new(
            NoticeKind::Truncated,
            "the end of the bag is missing",
        ));
    }
    Report {
        complete: found.complete,
        tier_reason: Some(reason.why.clone()),
        bytes_read: source.bytes_read(),
        file_bytes: source.len(),
        ..report(file_name(source.path()), Tier::Forward, &found.compression)
    }
}

fn forwards(stream: &mut Stream<'_>, total: u64, sink: &mut dyn Sink) -> forward::Found {
    if let Ok(head) = stream.peek(32) {
        let line = head.iter().position(|b| *b == b'\n');
        stream.advance(line.map_or(0, |at| at + 1));
    }
    forward::read(stream, total, sink)
}

impl Reader for Piped {
    fn span(&mut self) -> Result<Option<Span>> {
        Ok(None)
    }

    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report> {
        let found = forwards(&mut self.stream, 0, &mut Clip::new(range, sink));
        Ok(Report {
            complete: found.complete,
            tier_reason: Some("a pipe has no index".to_owned()),
            bytes_read: self.stream.position(),
            ..report(self.name.clone(), Tier::Forward, &found.compression)
        })
    }
}
