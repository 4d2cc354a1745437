//! A row per message, sorted by time over all bags, from the index, without payloads.

use super::{Extract, Extracted, of_report, stop};
use crate::bag::{Connection, ConnectionId, Sink as Takes, Want};
use crate::base::error::{Error, Result};
use crate::base::name::{NodeName, TopicName};
use crate::base::notice::{Notice, Notices};
use crate::base::table::{Batch, ColumnKind, TableCell, TableColumn};
use crate::base::time::Stamp;
use crate::evidence::times::{SeriesId, Stamps, Timed};
use crate::export::sink::OutputSink;
use crate::export::tables::writer::begin;
use crate::pipeline::Watch;
use crate::view::NameFilter;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// The number of rows buffered before they are written.
const MOST_ROWS: usize = 16 * 1024;

/// Reads all times first, spilling to an unnamed file if necessary, then writes them sorted, so that bags that overlap
/// in time make one sorted table.
pub(super) fn extract(job: &Extract, watch: &mut dyn Watch) -> Result<Extracted> {
    let sink = OutputSink::create(&job.target, None)?;
    let range = job.range(watch)?;
    let mut taken = Taken::default();
    for mut reader in job.open()? {
        let mut one = OfBag {
            taken: &mut taken,
            filter: &job.topics,
            sources: Vec::new(),
            watch: &mut *watch,
        };
        let report = reader.read(range, &mut one)?;
        taken.notices.extend(of_report(&report, &taken.notices));
        stop(watch)?;
    }
    let rows = write(job, &mut taken, sink, watch)?;
    Ok(Extracted {
        tables: 1,
        rows,
        undecoded: 0,
        notices: taken.notices,
        topics: taken.topics,
    })
}

/// The source of messages: the cells that are the same in all rows of one connection.
struct RowSource {
    topic: TopicName,
    type_name: Arc<str>,
    publisher: Option<Arc<str>>,
    /// Whether the sizes of its messages are known.
    is_sized: bool,
}

/// The times of all extracted messages.
#[derive(Default)]
struct Taken {
    stamps: Stamps,
    /// The source of each series, by the number of the series.
    sources: Vec<RowSource>,
    series: Vec<SeriesId>,
    notices: Notices,
    /// All topics of the bags.
    topics: BTreeSet<TopicName>,
}

impl Taken {
    fn add(&mut self, connection: &Connection, is_sized: bool) -> SeriesId {
        self.sources.push(RowSource {
            topic: connection.topic.clone(),
            type_name: Arc::clone(&connection.type_name),
            publisher: connection.publisher.as_ref().map(NodeName::shared),
            is_sized,
        });
        let id = self.stamps.series();
        self.series.push(id);
        id
    }
}

/// The series of a connection: messages of known size, and the others.
type Series = Option<[SeriesId; 2]>;

/// The sink for one bag.
struct OfBag<'a> {
    taken: &'a mut Taken,
    filter: &'a NameFilter,
    sources: Vec<Series>,
    watch: &'a mut dyn Watch,
}

impl Takes for OfBag<'_> {
    fn connection(&mut self, connection: &Connection) -> Want {
        let is_wanted = self.filter.passes(connection.topic.as_str());
        self.taken.topics.insert(connection.topic.clone());
        let mut series = |is_sized| self.taken.add(connection, is_sized);
        self.sources
            .push(is_wanted.then(|| [series(true), series(false)]));
        if is_wanted { Want::Sizes } else { Want::Stamps }
    }

    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        let series = self.sources.get(connection.0 as usize);
        if let Some(Some([sized, sizeless])) = series {
            let series = if sizes.is_some() { *sized } else { *sizeless };
            self.taken.stamps.add(series, stamps, sizes);
        }
    }

    fn notice(&mut self, notice: Notice) {
        self.taken.notices.add(notice);
    }

    fn progress(&mut self, done: u64, total: u64) {
        self.watch.progress(done, total);
    }
}

/// The table without rows. A text is stored once per source, and referenced in rows by the source's number.
fn table(sources: &[RowSource]) -> Batch {
    let topics = sources.iter().map(|s| s.topic.as_str());
    let types = sources.iter().map(|s| &*s.type_name);
    let publishers = sources.iter().map(|s| s.publisher.as_deref().unwrap_or(""));
    Batch::of([
        TableColumn::full("time_ns", ColumnKind::Time, 0),
        TableColumn::words("topic", topics),
        TableColumn::words("type", types),
        TableColumn::words("publisher", publishers),
        TableColumn::known("size_bytes", ColumnKind::I64),
    ])
}

/// Writes all rows sorted by time, then by connection.
fn write(job: &Extract, taken: &mut Taken, sink: OutputSink, watch: &mut dyn Watch) -> Result<u64> {
    let spool = |e| Error::io("read", Path::new("temporary file of times"))(e);
    taken.stamps.finish().map_err(spool)?;
    let failed = || Error::io("write", job.target.path());
    let sources = &taken.sources;
    let mut batch = table(sources);
    let mut writer = begin(job.format, sink, &batch, &[]).map_err(failed())?;
    let (mut rows, mut result) = (0, Ok(()));
    let each = |timed: Timed| {
        if result.is_err() {
            return;
        }
        batch.push(&row(&sources[timed.series], &timed));
        rows += 1;
        if batch.rows == MOST_ROWS {
            let written = writer.write(&batch).map_err(failed());
            result = written.and_then(|()| stop(watch));
            batch.clear();
        }
    };
    taken.stamps.merge(&taken.series, each).map_err(spool)?;
    result?;
    writer.write(&batch).map_err(failed())?;
    writer.finish().map_err(failed())?.commit()?;
    Ok(rows)
}

fn row(source: &RowSource, timed: &Timed) -> [TableCell<'static>; 5] {
    let number = u32::try_from(timed.series).unwrap_or(u32::MAX);
    [
        TableCell::Time(timed.time),
        TableCell::Word(number),
        TableCell::Word(number),
        TableCell::known(source.publisher.as_ref(), |_| TableCell::Word(number)),
        TableCell::known(source.is_sized.then_some(timed.size), TableCell::count),
    ]
}
