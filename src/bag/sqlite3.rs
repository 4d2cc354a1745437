//! ROS 2 bags in SQLite, schema versions 1 to 4: two columns of every row, payloads only of wanted topics.
//!
//! The tables: `rosbag2_storage_sqlite3/src/.../sqlite_storage.cpp`. Nothing in the file is trusted: it is opened
//! read-only, views and triggers are off, and what should be a table is checked to be one.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{OpenFlags, Row};

use super::index::TOO_LARGE;
use super::{
    Clip, Connection, ConnectionId, Encoding, FormatRow, Gather, MOST_PAYLOAD, Message,
    OpenOptions, Place, Reader, Report, Sink, Tier, Want, file_name, in_order,
};
use crate::decompress::zstd_payload;
use crate::error::{Error, Result};
use crate::notice::{Notice, NoticeKind};
use crate::time::{Span, Stamp};
use place::Ready;

#[path = "sqlite3_place.rs"]
mod place;

/// ROS 2 bags in SQLite.
pub(super) const FORMAT: FormatRow = FormatRow {
    name: "sqlite3",
    what: "ROS 2 bag in SQLite",
    extensions: &["db3"],
    sniff: |_, head| head.starts_with(b"SQLite format 3\0"),
    open,
};

type Db = rusqlite::Connection;

/// A database with its topics.
struct Bag {
    path: PathBuf,
    file_bytes: u64,
    ready: Ready,
    topics: Vec<Connection>,
    ids: HashMap<i64, ConnectionId>,
    /// Payloads are Zstandard frames, so their lengths are not those of the messages.
    packed: bool,
    verify: bool,
    facts: Vec<(String, String)>,
}

fn open(place: Place, options: &OpenOptions) -> Result<Box<dyn Reader>> {
    let source = match place {
        Place::File(source) => source,
        Place::Folder(path) => return Err(super::unknown::explain(&path, &[], true)),
        Place::Pipe(name, _) => {
            return Err(Error::Unsupported {
                path: name.into(),
                what: "a database cannot be read from a pipe".to_owned(),
                hint: "name the file itself".to_owned(),
            });
        }
    };
    let path = source.path().to_owned();
    let ready = place::ready(&path)?;
    let broken = |e: rusqlite::Error| broken(&path, &e);
    let db = connect(&ready).map_err(broken)?;
    let mut bag = Bag {
        file_bytes: source.len(),
        topics: Vec::new(),
        ids: HashMap::new(),
        packed: false,
        verify: options.verify,
        facts: Vec::new(),
        path: path.clone(),
        ready,
    };
    need(&db, &path, "messages", &["topic_id", "timestamp", "data"])?;
    let columns = need(&db, &path, "topics", &["id", "name", "type"])?;
    bag.read_topics(&db, &columns).map_err(broken)?;
    bag.read_facts(&db);
    bag.packed = is_packed(&db);
    Ok(Box::new(bag))
}

fn broken(path: &Path, error: &rusqlite::Error) -> Error {
    Error::Malformed {
        path: path.to_owned(),
        offset: 0,
        expected: format!("a database that SQLite can read ({error})"),
        hint: format!(
            "the recording was cut or damaged; `sqlite3 {} .recover` may bring rows back",
            file_name(path)
        ),
    }
}

/// Opens the database so that nothing in it can run, write or grow.
fn connect(ready: &Ready) -> rusqlite::Result<Db> {
    let access = if ready.is_copy() {
        OpenFlags::SQLITE_OPEN_READ_WRITE
    } else {
        OpenFlags::SQLITE_OPEN_READ_ONLY
    };
    let flags = access | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let db = Db::open_with_flags(place::address(ready), flags)?;
    db.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true)?;
    db.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
    db.set_db_config(DbConfig::SQLITE_DBCONFIG_ENABLE_VIEW, false)?;
    db.set_db_config(DbConfig::SQLITE_DBCONFIG_ENABLE_TRIGGER, false)?;
    db.set_limit(Limit::SQLITE_LIMIT_LENGTH, LONGEST_ROW)?;
    for (name, value) in [("cell_size_check", 1), ("query_only", 1), ("mmap_size", 0)] {
        db.pragma_update(None, name, value)?;
    }
    Ok(db)
}

/// No value that SQLite makes for us is longer, in bytes; a larger payload is counted and not looked into.
const LONGEST_ROW: i32 = 64 << 20;

/// The columns of `table`, which must be a table with real columns of these names.
fn need(db: &Db, path: &Path, table: &str, names: &[&str]) -> Result<Vec<String>> {
    let columns = columns(db, table).map_err(|e| broken(path, &e))?;
    if names.iter().all(|n| columns.iter().any(|c| c == n)) {
        return Ok(columns);
    }
    Err(Error::Malformed {
        path: path.to_owned(),
        offset: 0,
        expected: format!("a table `{table}` with the columns {}", names.join(", ")),
        hint: "this database is no recording, or the recorder was stopped before it began"
            .to_owned(),
    })
}

/// The columns of a table that hold what they say; none if it is no table.
fn columns(db: &Db, table: &str) -> rusqlite::Result<Vec<String>> {
    let is_table =
        "SELECT count(*) FROM sqlite_schema WHERE name = ?1 AND type = 'table' AND rootpage > 0";
    if db.query_row(is_table, [table], |row| row.get::<_, i64>(0))? == 0 {
        return Ok(Vec::new());
    }
    let mut query = db.prepare(&format!("PRAGMA table_xinfo({table})"))?;
    let mut rows = query.query([])?;
    let mut columns = Vec::new();
    while let Some(row) = rows.next()? {
        // Generated columns compute what they like when they are read.
        if row.get_ref(6)? == ValueRef::Integer(0) && columns.len() < 100 {
            columns.extend(text(row, 1));
        }
    }
    Ok(columns)
}

/// A column's text, whatever its encoding; `None` if it is no text.
fn text(row: &Row<'_>, column: usize) -> Option<String> {
    match row.get_ref(column).ok()? {
        ValueRef::Text(bytes) => Some(String::from_utf8_lossy(bytes).into_owned()),
        _ => None,
    }
}

/// A column's whole number; `None` if it is none.
fn integer(row: &Row<'_>, column: usize) -> Option<i64> {
    match row.get_ref(column).ok()? {
        ValueRef::Integer(n) => Some(n),
        _ => None,
    }
}

/// More topics than this are not kept; real bags stay below 1,000.
const MOST_TOPICS: i64 = 100_000;

impl Bag {
    fn read_topics(&mut self, db: &Db, columns: &[String]) -> rusqlite::Result<()> {
        let or_null = |name: &'static str| {
            if columns.iter().any(|c| c == name) {
                name
            } else {
                "NULL"
            }
        };
        let definitions = definitions(db).unwrap_or_default();
        let mut query = db.prepare(&format!(
            "SELECT id, name, type, {}, {}, {} FROM topics LIMIT {MOST_TOPICS}",
            or_null("serialization_format"),
            or_null("offered_qos_profiles"),
            or_null("type_description_hash"),
        ))?;
        let mut rows = query.query([])?;
        while let Some(row) = rows.next()? {
            let (Some(id), Some(name)) = (integer(row, 0), text(row, 1)) else {
                continue;
            };
            let Ok(place) = u32::try_from(self.topics.len()) else {
                break;
            };
            if self.ids.contains_key(&id) {
                continue;
            }
            self.ids.insert(id, ConnectionId(place));
            let type_name: Arc<str> = text(row, 2).unwrap_or_default().into();
            let some = |at| {
                text(row, at)
                    .filter(|t| !t.is_empty())
                    .map(Arc::<str>::from)
            };
            self.topics.push(Connection {
                id: ConnectionId(place),
                topic: name.into(),
                definition: definitions.get(&type_name).cloned(),
                type_name,
                type_hash: some(5),
                publisher: None,
                latching: false,
                qos: some(4),
                encoding: match text(row, 3).as_deref() {
                    None | Some("" | "cdr") => Encoding::Cdr,
                    Some(other) => Encoding::Other(other.to_owned()),
                },
            });
        }
        Ok(())
    }

    fn read_facts(&mut self, db: &Db) {
        let Ok(columns) = columns(db, "schema") else {
            return;
        };
        for name in ["schema_version", "ros_distro"] {
            if !columns.iter().any(|c| c == name) {
                continue;
            }
            let sql = format!("SELECT CAST({name} AS TEXT) FROM schema LIMIT 1");
            if let Ok(Some(value)) = db.query_row(&sql, [], |row| Ok(text(row, 0))) {
                self.facts.push((name.to_owned(), value));
            }
        }
    }

    /// Whether every row that would be first, or last, counts.
    fn ends(&self, db: &Db) -> rusqlite::Result<Option<Span>> {
        let first = self.end(db, "ASC")?;
        let last = self.end(db, "DESC")?;
        Ok(first.zip(last).map(|(start, last)| Span {
            start,
            end: last.plus(1),
        }))
    }

    /// The first stamp in this order that belongs to a topic.
    fn end(&self, db: &Db, order: &str) -> rusqlite::Result<Option<Stamp>> {
        let sql = format!("SELECT timestamp, topic_id FROM messages ORDER BY timestamp {order}");
        let mut query = db.prepare(&sql)?;
        let mut rows = query.query([])?;
        while let Some(row) = rows.next()? {
            let topic = integer(row, 1).filter(|id| self.ids.contains_key(id));
            if let (Some(time), Some(_)) = (integer(row, 0), topic) {
                return Ok(Some(Stamp(time)));
            }
        }
        Ok(None)
    }
}

/// Message definitions by type (schema 4).
fn definitions(db: &Db) -> rusqlite::Result<BTreeMap<Arc<str>, Arc<str>>> {
    let mut found = BTreeMap::new();
    let names = ["topic_type", "encoded_message_definition"];
    let columns = columns(db, "message_definitions")?;
    if !names.iter().all(|n| columns.iter().any(|c| c == n)) {
        return Ok(found);
    }
    let sql = "SELECT topic_type, encoded_message_definition FROM message_definitions LIMIT 10000";
    let mut query = db.prepare(sql)?;
    let mut rows = query.query([])?;
    let mut held = 0;
    while let Some(row) = rows.next()? {
        let (Some(name), Some(definition)) = (text(row, 0), text(row, 1)) else {
            continue;
        };
        held += definition.len();
        if held < MOST_PAYLOAD && !definition.is_empty() {
            found.insert(name.into(), definition.into());
        }
    }
    Ok(found)
}

/// Whether the first payload is a Zstandard frame; a CDR payload never begins so.
fn is_packed(db: &Db) -> bool {
    let sql =
        "SELECT substr(data, 1, 4) FROM messages WHERE octet_length(data) BETWEEN 4 AND ?1 LIMIT 1";
    let magic = |row: &Row<'_>| Ok(row.get_ref(0)?.as_blob().is_ok_and(|b| b == ZSTD));
    db.query_row(sql, [1 << 20], magic).unwrap_or(false)
}

const ZSTD: &[u8] = b"\x28\xb5\x2f\xfd";

/// Below this size in bytes one thread reads all rows.
const BIG: u64 = 128 << 20;
/// Parts of a big bag.
const PARTS: i64 = 64;

impl Reader for Bag {
    fn span(&mut self) -> Result<Option<Span>> {
        let ends = connect(&self.ready).and_then(|db| self.ends(&db));
        // What cannot be told now shows when the rows are read.
        Ok(ends.unwrap_or(None))
    }

    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report> {
        let mut clip = Clip::new(range, sink);
        let wants: Vec<Want> = self.topics.iter().map(|t| clip.connection(t)).collect();
        if self.ready.left_behind {
            let text = "the newest rows lie in a log beside the bag that is too large to copy";
            clip.notice(Notice::new(NoticeKind::Damaged, text));
        }
        let db = connect(&self.ready).map_err(|e| broken(&self.path, &e))?;
        let rows = Rows {
            bag: self,
            sql: self.sql(&wants, range),
            wants: &wants,
        };
        let parts = self.parts(&db, range);
        drop(db);
        let threads = if parts.len() > 1 { 8 } else { 1 };
        let work = |at: usize, sink: &mut dyn Sink| rows.read(parts[at], sink);
        let total = parts.len() as u64;
        in_order(parts.len(), threads, &work, &mut clip, |at, sink| {
            sink.progress(at as u64 + 1, total);
        });
        Ok(Report {
            name: file_name(&self.path),
            format: FORMAT.name.to_owned(),
            compression: vec![if self.packed { "zstd" } else { "none" }.to_owned()],
            tier: if self.verify {
                Tier::Verify
            } else {
                Tier::Index
            },
            tier_reason: None,
            complete: !clip.lost,
            bytes_read: 0,
            file_bytes: self.file_bytes,
            facts: self.facts.clone(),
        })
    }
}

/// Rows whose ids lie between these, both included.
type Part = (i64, i64);

impl Bag {
    /// The rows in parts: one unless the bag is big. With a range SQLite's own index finds the rows.
    fn parts(&self, db: &Db, range: Option<Span>) -> Vec<Part> {
        let whole = vec![(i64::MIN, i64::MAX)];
        if self.file_bytes < BIG || range.is_some() || self.verify {
            return whole;
        }
        let sql = "SELECT min(rowid), max(rowid) FROM messages";
        let ends = db.query_row(sql, [], |row| Ok(integer(row, 0).zip(integer(row, 1))));
        let Ok(Some((first, last))) = ends else {
            return whole;
        };
        let step = last.saturating_sub(first) / PARTS;
        (0..PARTS)
            .map(|at| {
                let low = first.saturating_add(step.saturating_mul(at));
                let high = if at + 1 == PARTS {
                    last
                } else {
                    low.saturating_add(step - 1)
                };
                (low, high)
            })
            .collect()
    }

    /// The query for a part's rows: id, topic, time, length, and the payload where it is wanted.
    fn sql(&self, wants: &[Want], range: Option<Span>) -> String {
        let wanted = |want: &Want| matches!(want, Want::Payload | Want::Head(_));
        let mut ids: Vec<i64> = self
            .ids
            .iter()
            .filter(|(_, id)| wanted(&wants[id.0 as usize]))
            .map(|(raw, _)| *raw)
            .collect();
        ids.sort_unstable();
        let list = ids.iter().map(i64::to_string).collect::<Vec<_>>().join(",");
        let which = if self.verify {
            "1".to_owned()
        } else {
            format!("topic_id IN ({list})")
        };
        let data = if ids.is_empty() && !self.verify {
            "NULL".to_owned()
        } else {
            format!("CASE WHEN {which} AND octet_length(data) <= {MOST_PAYLOAD} THEN data END")
        };
        let time = range.map_or(String::new(), |r| {
            format!(
                " AND timestamp >= {} AND timestamp < {}",
                r.start.0, r.end.0
            )
        });
        format!(
            "SELECT rowid, topic_id, timestamp, octet_length(data), {data} FROM messages \
             WHERE rowid BETWEEN ?1 AND ?2{time}"
        )
    }
}

/// Reads rows of one bag; shared by threads.
struct Rows<'a> {
    bag: &'a Bag,
    sql: String,
    wants: &'a [Want],
}

impl Rows<'_> {
    /// Tells `sink` the rows of a part. Where a page is damaged, the rows behind it are read from the other end.
    fn read(&self, part: Part, sink: &mut dyn Sink) {
        let mut gather = Gather::default();
        gather.sizeless = self.bag.packed;
        let mut left = part;
        let mut told = self.some(&mut left, "", &mut gather, sink);
        if told.is_err() && left.0 <= left.1 {
            let back = self.some(&mut left, " ORDER BY rowid DESC", &mut gather, sink);
            told = told.and(back);
        }
        gather.flush(sink);
        if let Err(e) = told {
            sink.notice(Notice::new(
                NoticeKind::Damaged,
                format!("rows could not be read: {e}"),
            ));
        }
    }

    /// Tells the rows of `left` in an order, and narrows it to those that have not been told.
    fn some(
        &self,
        left: &mut Part,
        order: &str,
        gather: &mut Gather,
        sink: &mut dyn Sink,
    ) -> rusqlite::Result<()> {
        let db = connect(&self.bag.ready)?;
        let mut query = db.prepare(&format!("{}{order}", self.sql))?;
        let mut rows = query.query([left.0, left.1])?;
        let (mut orphans, mut odd) = (0, 0);
        let told = loop {
            let row = match rows.next() {
                Ok(Some(row)) => row,
                Ok(None) => break Ok(()),
                Err(e) => break Err(e),
            };
            if let Some(id) = integer(row, 0) {
                if order.is_empty() {
                    left.0 = id.saturating_add(1);
                } else {
                    left.1 = id.saturating_sub(1);
                }
            }
            match (integer(row, 1), integer(row, 2)) {
                (Some(topic), Some(time)) => match self.bag.ids.get(&topic) {
                    Some(id) => self.row(row, *id, Stamp(time), gather, sink),
                    None => orphans += 1,
                },
                _ => odd += 1,
            }
        };
        tell_lost(
            sink,
            orphans,
            "rows belong to a topic that the bag does not name",
        );
        tell_lost(sink, odd, "rows hold no topic or no time");
        told
    }

    fn row(
        &self,
        row: &Row<'_>,
        id: ConnectionId,
        time: Stamp,
        gather: &mut Gather,
        sink: &mut dyn Sink,
    ) {
        let size = integer(row, 3)
            .and_then(|n| u32::try_from(n).ok())
            .unwrap_or(0);
        gather.add(id, time, size, sink);
        if self.wants[id.0 as usize] <= Want::Sizes {
            return;
        }
        let Ok(ValueRef::Blob(data)) = row.get_ref(4) else {
            return sink.notice(Notice::new(NoticeKind::Undecodable, TOO_LARGE));
        };
        if !data.starts_with(ZSTD) {
            return sink.message(Message {
                connection: id,
                time,
                data,
                size,
            });
        }
        match zstd_payload(data, MOST_PAYLOAD) {
            Some(data) => sink.message(Message {
                connection: id,
                time,
                size: u32::try_from(data.len()).unwrap_or(u32::MAX),
                data: &data,
            }),
            None => sink.notice(Notice::new(
                NoticeKind::Undecodable,
                "payloads could not be decompressed",
            )),
        }
    }
}

fn tell_lost(sink: &mut dyn Sink, count: u64, text: &str) {
    if count > 0 {
        let text = text.to_owned();
        sink.notice(Notice {
            kind: NoticeKind::Damaged,
            count,
            text,
        });
    }
}
