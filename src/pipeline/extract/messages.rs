//! A row per message, sorted by time over all bags, from the index, without payloads.

use super::{Extract, Extracted, stop};
use crate::bag::Want;
use crate::base::error::{Error, Result};
use crate::base::name::TopicName;
use crate::base::table::{Batch, ColumnKind, TableCell, TableColumn};
use crate::evidence::times::Timed;
use crate::export::sink::OutputSink;
use crate::export::tables::begin;
use crate::pipeline::Watch;
use crate::pipeline::collect::no_messages;
use crate::pipeline::times::{MessageTimes, Sender};
use crate::view::none_pass;

/// The number of rows buffered before they are written.
const MOST_ROWS: usize = 16 * 1024;

/// Reads all times first, then writes them sorted, so that bags that overlap in time make one sorted table.
pub(super) fn extract(job: &Extract, watch: &mut dyn Watch) -> Result<Extracted> {
    let sink = OutputSink::create(&job.target, None)?;
    let mut times = MessageTimes::new(&job.topics, Want::Sizes);
    let range = job.range(&mut times.notices, watch)?;
    for mut reader in job.open()? {
        times.read(&mut *reader, range, watch)?;
        stop(watch)?;
    }
    let aside = times.finish()?;
    times.notices.extend(aside);
    let topics: Vec<&str> = times.topics.iter().map(TopicName::as_str).collect();
    if let Some(error) = none_pass("--topic-filter", &job.topics, &topics) {
        return Err(error);
    }
    let is_whole = job.topics.passes_all() && job.start.is_none() && job.end.is_none();
    if is_whole && times.span().is_none() {
        return Err(no_messages(&job.inputs, &times.notices));
    }
    Ok(Extracted {
        tables: 1,
        rows: write(job, &times, sink, watch)?,
        undecoded: 0,
        notices: times.notices,
        topics: times.topics,
    })
}

/// The table without rows. A text is stored once per sender, and referenced in rows by the sender's number.
fn table(senders: &[Sender]) -> Batch {
    let topics = senders.iter().map(|s| s.topic.as_str());
    let types = senders.iter().map(|s| &*s.type_name);
    let publishers = senders.iter().map(|s| s.node.as_deref().unwrap_or(""));
    Batch::of([
        TableColumn::full("time_ns", ColumnKind::Time, 0),
        TableColumn::words("topic", topics),
        TableColumn::words("type", types),
        TableColumn::words("publisher", publishers),
        TableColumn::known("size_bytes", ColumnKind::I64),
    ])
}

/// Writes all rows sorted by time, then by connection.
fn write(
    job: &Extract,
    times: &MessageTimes<'_>,
    sink: OutputSink,
    watch: &mut dyn Watch,
) -> Result<u64> {
    let failed = || Error::io("write", job.target.path());
    let mut batch = table(&times.senders);
    let mut writer = begin(job.format, sink, &batch, &[]).map_err(failed())?;
    let (mut rows, mut result) = (0, Ok(()));
    let each = |timed: Timed| {
        if result.is_err() {
            return;
        }
        let number = TableCell::Word(u32::try_from(timed.series).unwrap_or(u32::MAX));
        let is_sized = times.stamps.sized(times.series[timed.series]);
        batch.push(&[
            TableCell::Time(timed.time),
            number.clone(),
            number.clone(),
            TableCell::known(times.senders[timed.series].node.as_ref(), |_| number),
            TableCell::known(is_sized.then_some(timed.size), TableCell::count),
        ]);
        rows += 1;
        if batch.rows == MOST_ROWS {
            let written = writer.write(&batch).map_err(failed());
            result = written.and_then(|()| stop(watch));
            batch.clear();
        }
    };
    times.merge(&times.series, each)?;
    result?;
    writer.write(&batch).map_err(failed())?;
    writer.finish().map_err(failed())?.commit()?;
    Ok(rows)
}
