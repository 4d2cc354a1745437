//! The rows of `messages`, part by part, and what is wanted of their payloads.

use std::ops::ControlFlow;
use std::sync::Arc;

use super::Bag;
use super::db::{Db, Refusal, Row};
use crate::bag::adapters::Gather;
use crate::bag::decompress::{Allowance, zstd_payload};
use crate::bag::model::{ConnectionId, MOST_PAYLOAD, Message, Sink, Want};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::{Span, Stamp};

/// Rows whose ids lie between these, both included.
pub(super) type Part = (i64, i64);

/// What a Zstandard frame begins with.
pub(super) const ZSTD: &[u8] = b"\x28\xb5\x2f\xfd";

/// Reads rows of one bag; shared by threads.
pub(super) struct Rows<'a> {
    bag: &'a Bag,
    sql: String,
    wants: &'a [Want],
    /// Whether the sizes of all payloads are told.
    sized: bool,
    /// For payloads that are compressed one by one.
    allowance: Arc<Allowance>,
}

/// Rows that say nothing.
#[derive(Default)]
struct Lost {
    orphans: u64,
    odd: u64,
}

impl<'a> Rows<'a> {
    /// The rows of `bag` inside `range`.
    pub(super) fn new(bag: &'a Bag, wants: &'a [Want], range: Option<Span>) -> Self {
        let sized = !bag.packed || wants.iter().all(|w| *w >= Want::Sizes);
        let sql = sql(bag, wants, range);
        Self {
            bag,
            sql,
            wants,
            sized,
            allowance: Arc::default(),
        }
    }

    /// Tells `sink` the rows of a part. Where a page is damaged, the rows behind it are read from the other end.
    pub(super) fn read(&self, part: Part, sink: &mut dyn Sink) {
        let mut gather = Gather::default();
        gather.sizeless = !self.sized;
        let mut left = part;
        let mut lost = Lost::default();
        let mut told = self.some(&mut left, "", &mut lost, &mut gather, sink);
        if told.is_err() && left.0 <= left.1 {
            let back = self.some(
                &mut left,
                " ORDER BY rowid DESC",
                &mut lost,
                &mut gather,
                sink,
            );
            told = told.and(back);
        }
        gather.flush(sink);
        lost.tell(sink);
        if let Err(e) = told {
            let text = format!("rows could not be read: {e}");
            sink.notice(Notice::new(NoticeKind::Damaged, text));
        }
    }

    /// Tells the rows of `left` in an order, and narrows it to those that have not been told.
    fn some(
        &self,
        left: &mut Part,
        order: &str,
        lost: &mut Lost,
        gather: &mut Gather,
        sink: &mut dyn Sink,
    ) -> Result<(), Refusal> {
        let db = Db::open(&self.bag.ready)?;
        let args = [left.0, left.1];
        db.each(&format!("{}{order}", self.sql), &args, |row| {
            match row.integer(0) {
                Some(id) if order.is_empty() => left.0 = id.saturating_add(1),
                Some(id) => left.1 = id.saturating_sub(1),
                None => {}
            }
            match (row.integer(1), row.integer(2)) {
                (Some(topic), Some(time)) => match self.bag.ids.get(&topic) {
                    Some(id) => self.row(row, *id, Stamp(time), gather, sink),
                    None => lost.orphans += 1,
                },
                _ => lost.odd += 1,
            }
            ControlFlow::Continue(())
        })
    }

    fn row(
        &self,
        row: &Row<'_>,
        id: ConnectionId,
        time: Stamp,
        gather: &mut Gather,
        sink: &mut dyn Sink,
    ) {
        let stored = row
            .integer(3)
            .and_then(|n| u32::try_from(n).ok())
            .unwrap_or(0);
        let want = self.wants[id.0 as usize];
        if want == Want::Stamps || want == Want::Sizes && !self.bag.packed {
            return gather.add(id, time, stored, sink);
        }
        let data = row.bytes(4);
        let size =
            data.and_then(|data| tell_payload(data, (id, time), want, &self.allowance, sink));
        if size.is_none() {
            let text =
                "payloads larger than 16 MiB or badly compressed were counted and not looked into";
            sink.notice(Notice::new(NoticeKind::Undecodable, text));
        }
        gather.add(id, time, size.unwrap_or(stored), sink);
    }
}

/// The query for a part's rows: id, topic, time, length, and the payload where it is wanted. SQLite leaves payloads
/// that nobody asks for on the disk.
fn sql(bag: &Bag, wants: &[Want], range: Option<Span>) -> String {
    let wanted = |want: Want| want > Want::Sizes || bag.packed && want == Want::Sizes;
    let ids = bag
        .ids
        .iter()
        .filter(|(_, id)| wanted(wants[id.0 as usize]));
    let mut ids: Vec<String> = ids.map(|(raw, _)| raw.to_string()).collect();
    ids.sort_unstable();
    let which = match (bag.verify, ids.is_empty()) {
        (true, _) => "1".to_owned(),
        (false, true) => "0".to_owned(),
        (false, false) => format!("topic_id IN ({})", ids.join(",")),
    };
    let time = range.map_or(String::new(), |r| {
        format!(
            " AND timestamp >= {} AND timestamp < {}",
            r.start.0, r.end.0
        )
    });
    format!(
        "SELECT rowid, topic_id, timestamp, octet_length(data), \
         CASE WHEN {which} AND octet_length(data) <= {MOST_PAYLOAD} THEN data END \
         FROM messages WHERE rowid BETWEEN ?1 AND ?2{time}"
    )
}

/// Tells `sink` a payload, unpacked if it is packed; answers its length.
fn tell_payload(
    data: &[u8],
    (connection, time): (ConnectionId, Stamp),
    want: Want,
    allowance: &Arc<Allowance>,
    sink: &mut dyn Sink,
) -> Option<u32> {
    let unpacked;
    let data = if data.starts_with(ZSTD) {
        unpacked = zstd_payload(data, MOST_PAYLOAD, allowance)?;
        &unpacked
    } else {
        data
    };
    let size = u32::try_from(data.len()).ok()?;
    if want > Want::Sizes {
        sink.message(Message {
            connection,
            time,
            data,
            size,
        });
    }
    Some(size)
}

impl Lost {
    fn tell(&self, sink: &mut dyn Sink) {
        let kinds = [
            (
                self.orphans,
                "rows belong to a topic that the bag does not name",
            ),
            (self.odd, "rows hold no topic or no time"),
        ];
        for (count, text) in kinds.into_iter().filter(|(count, _)| *count > 0) {
            let text = text.to_owned();
            sink.notice(Notice {
                kind: NoticeKind::Damaged,
                count,
                text,
            });
        }
    }
}
