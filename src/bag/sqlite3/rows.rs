//! The rows of `messages`, part by part, and the wanted parts of their payloads.

use std::ops::ControlFlow;
use std::sync::Arc;

use super::Sqlite3Bag;
use super::db::{Db, QueryRow, Refusal};
use crate::bag::adapters::Gather;
use crate::bag::decompress::{Allowance, zstd_payload};
use crate::bag::model::{ConnectionId, MOST_PAYLOAD, Message, Sink, Want, damaged};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::{Span, Stamp};

/// A range of row ids, both ends included.
pub(super) type RowRange = (i64, i64);

/// The first bytes of a Zstandard frame.
pub(super) const ZSTD: &[u8] = b"\x28\xb5\x2f\xfd";

/// A reader of the rows of one bag; shared by threads.
pub(super) struct RowReader<'a> {
    bag: &'a Sqlite3Bag,
    sql: String,
    /// The query without payloads.
    bare: String,
    wants: &'a [Want],
    /// Whether the sizes of all payloads are reported.
    sized: bool,
    /// Whether rows are returned in id order: not if a range uses the index of times.
    in_order: bool,
    /// The allowance for payloads that are compressed one by one.
    allowance: Arc<Allowance>,
}

/// The numbers of rows that could not be reported completely.
#[derive(Default)]
struct LostRows {
    orphans: u64,
    odd: u64,
    payloads: u64,
    /// The ids that no row has: recorders number the rows from 1 on.
    unused: u64,
}

/// The end from which rows are read.
#[derive(Clone, Copy, PartialEq)]
enum Direction {
    Up,
    Down,
}

/// A part that is being read.
struct RowReading<'a, 's> {
    rows: &'a RowReader<'a>,
    /// The rows that have not been reported.
    left: RowRange,
    /// Whether a row was returned twice: the pages of a damaged table can form a cycle.
    repeated: bool,
    lost: LostRows,
    gather: Gather,
    sink: &'s mut dyn Sink,
}

/// The most unreadable payloads that are skipped, one by one.
const MOST_RETRIES: u64 = 1000;

impl RowReading<'_, '_> {
    /// Reports the remaining rows, starting from one end. For a row with a damaged payload, only the time is reported.
    fn on(&mut self, way: Direction) -> Result<(), String> {
        let order = match way {
            // SQLite returns the rows in id order unless a range uses the index of times.
            Direction::Up if !self.rows.bag.ready.damaged => "",
            Direction::Up => " ORDER BY rowid",
            Direction::Down => " ORDER BY rowid DESC",
        };
        let db = Db::open(&self.rows.bag.ready).map_err(|e| e.to_string())?;
        loop {
            let result = self.some(&db, &format!("{}{order}", self.rows.sql), way);
            let refusal = match result {
                Ok(()) if self.repeated => return Err("they repeat endlessly".to_owned()),
                Ok(()) => return Ok(()),
                Err(refusal) => refusal,
            };
            let before = self.left;
            let end = if way == Direction::Up { "ASC" } else { "DESC" };
            let bare = format!("{} ORDER BY rowid {end} LIMIT 1", self.rows.bare);
            let again = self.lost.payloads < MOST_RETRIES && self.some(&db, &bare, way).is_ok();
            if !again || self.left == before {
                return Err(refusal.to_string());
            }
            self.lost.payloads += 1;
        }
    }

    /// Reports the rows of a query, and narrows the range of remaining rows.
    fn some(&mut self, db: &Db, sql: &str, way: Direction) -> Result<(), Refusal> {
        let in_order = self.rows.in_order;
        self.repeated = false;
        db.each(sql, &[self.left.0, self.left.1], |row| {
            let id = row.integer(0);
            if in_order && id.is_some_and(|id| !(self.left.0..=self.left.1).contains(&id)) {
                self.repeated = true;
                return ControlFlow::Break(());
            }
            let is_sound = in_order && !self.rows.bag.ready.damaged;
            if let (true, Direction::Up, Some(id)) = (is_sound, way, id) {
                let unused = id.saturating_sub(self.left.0.max(1));
                self.lost.unused += u64::try_from(unused).unwrap_or(0);
            }
            match (id, way) {
                (Some(id), Direction::Up) => self.left.0 = id.saturating_add(1),
                (Some(id), Direction::Down) => self.left.1 = id.saturating_sub(1),
                (None, _) => {}
            }
            match (row.integer(1), row.integer(2)) {
                (Some(topic), Some(time)) => match self.rows.bag.ids.get(&topic) {
                    Some(id) => {
                        let time = Stamp(time).min(Stamp::LAST);
                        self.rows.row(row, *id, time, &mut self.gather, self.sink);
                    }
                    None => self.lost.orphans += 1,
                },
                _ => self.lost.odd += 1,
            }
            ControlFlow::Continue(())
        })
    }
}

impl<'a> RowReader<'a> {
    /// The rows of `bag` inside `range`.
    pub(super) fn new(bag: &'a Sqlite3Bag, wants: &'a [Want], range: Option<Span>) -> Self {
        let sized = !bag.packed || wants.iter().all(|w| *w >= Want::Sizes);
        Self {
            bag,
            sql: sql(bag, &wanted(bag, wants), range),
            bare: sql(bag, "0", range),
            wants,
            sized,
            in_order: range.is_none() || bag.ready.damaged,
            allowance: Arc::default(),
        }
    }

    fn reading<'s>(&self, left: RowRange, sink: &'s mut dyn Sink) -> RowReading<'_, 's> {
        let mut gather = Gather::default();
        gather.sizeless = !self.sized;
        RowReading {
            rows: self,
            left,
            repeated: false,
            lost: LostRows::default(),
            gather,
            sink,
        }
    }

    /// Reports the rows of a part to `sink`. Rows after a damaged page are read from the other end.
    pub(super) fn read(&self, part: RowRange, sink: &mut dyn Sink) {
        let mut reading = self.reading(part, sink);
        let mut result = reading.on(Direction::Up);
        if result.is_err() && reading.left.0 <= reading.left.1 {
            result = result.and(reading.on(Direction::Down));
        }
        reading.gather.flush(reading.sink);
        reading.lost.report(reading.sink);
        if let Err(e) = result {
            damaged(sink, 1, &format!("rows could not be read: {e}"));
        }
    }

    /// Reports the rows from `next` on, up to one that cannot be read; returns the row after the last.
    pub(super) fn read_from(&self, db: &Db, next: i64, sink: &mut dyn Sink) -> i64 {
        let mut reading = self.reading((next, i64::MAX), sink);
        // Rows that cannot be read yet follow at the next poll.
        let _ = reading.some(db, &format!("{} ORDER BY rowid", self.sql), Direction::Up);
        reading.gather.flush(reading.sink);
        reading.left.0
    }

    fn row(
        &self,
        row: &QueryRow<'_>,
        id: ConnectionId,
        time: Stamp,
        gather: &mut Gather,
        sink: &mut dyn Sink,
    ) {
        let stored = row.integer(3).and_then(|n| u32::try_from(n).ok());
        let stored = stored.unwrap_or(0);
        let want = self.wants[id.0 as usize];
        if want == Want::Stamps || want == Want::Sizes && !self.bag.packed {
            return gather.add(id, time, stored, sink);
        }
        let data = row.bytes(4);
        let size =
            data.and_then(|data| report_payload(data, (id, time), want, &self.allowance, sink));
        if size.is_none() {
            let text = "payloads larger than 16 MiB or badly compressed were counted but not read";
            sink.notice(Notice::new(NoticeKind::Undecodable, text));
        }
        gather.add(id, time, size.unwrap_or(stored), sink);
    }
}

/// The condition in SQL for rows whose payloads are wanted.
fn wanted(bag: &Sqlite3Bag, wants: &[Want]) -> String {
    let wanted = |want: Want| want > Want::Sizes || bag.packed && want == Want::Sizes;
    let ids = bag.ids.iter();
    let ids = ids.filter(|(_, id)| wanted(wants[id.0 as usize]));
    let mut ids: Vec<String> = ids.map(|(raw, _)| raw.to_string()).collect();
    ids.sort_unstable();
    match (bag.verify, ids.is_empty()) {
        (true, _) => "1".to_owned(),
        (false, true) => "0".to_owned(),
        (false, false) => format!("topic_id IN ({})", ids.join(",")),
    }
}

/// The query for a part's rows: id, topic, time, length, and the payload if `which` selects it. SQLite does not read
/// payloads that are not selected.
fn sql(bag: &Sqlite3Bag, which: &str, range: Option<Span>) -> String {
    // The index of times may be damaged although the rows are not; the unary plus keeps SQLite from using it.
    let time = if bag.ready.damaged {
        "+timestamp"
    } else {
        "timestamp"
    };
    let inside = range.map_or(String::new(), |r| {
        format!(" AND {time} >= {} AND {time} < {}", r.start.0, r.end.0)
    });
    format!(
        "SELECT rowid, topic_id, timestamp, octet_length(data), \
         CASE WHEN {which} AND octet_length(data) <= {MOST_PAYLOAD} THEN data END \
         FROM messages WHERE rowid BETWEEN ?1 AND ?2{inside}"
    )
}

/// Reports a payload to `sink`, decompressed if necessary; returns its length.
fn report_payload(
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

impl LostRows {
    fn report(&self, sink: &mut dyn Sink) {
        let orphans = "rows belong to a topic that the bag does not name";
        damaged(sink, self.orphans, orphans);
        damaged(sink, self.odd, "rows have no topic or no time");
        let unread = "rows were counted but could not be read";
        damaged(sink, self.payloads, unread);
        if self.unused > 0 {
            let text = "rows are missing among the others: deleted, or lost by damage";
            sink.notice(Notice::counted(NoticeKind::Note, self.unused, text));
        }
    }
}
