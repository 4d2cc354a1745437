//! ROS 2 bags in SQLite, schema versions 1 to 4: two columns of every row, and payloads of wanted topics only.
//!
//! The tables: `sqlite_storage.cpp` of `rosbag2_storage_sqlite3`.

mod db;
mod rows;

use std::collections::{BTreeMap, HashMap};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use db::{Db, Ready, Refusal};
use rows::{RowRange, RowReader, ZSTD};

use crate::bag::adapters::{Clip, in_order};
use crate::bag::input::{BagPlace, FormatRow, file_name};
use crate::bag::model::{
    Connection, ConnectionId, Encoding, Growing, Growth, MOST_PAYLOAD, OpenOptions, Reader, Report,
    Sink, Tier, Want, damaged,
};
use crate::bag::source::FileSource;
use crate::base::budget::CONNECTIONS;
use crate::base::error::{Error, Result};
use crate::base::file::with_suffix;
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::{Span, Stamp};

/// ROS 2 bags in SQLite.
pub(crate) const FORMAT: FormatRow = FormatRow {
    name: "sqlite3",
    what: "ROS 2 bag in SQLite",
    extensions: &["db3"],
    needs_file: true,
    is_inside: |_| false,
    sniff: |_, head| head.starts_with(b"SQLite format 3\0"),
    open,
    follow: Some(|path| Ok(Box::new(GrowingDb::new(path)))),
};

/// A database with its topics.
struct Sqlite3Bag {
    path: PathBuf,
    file_bytes: u64,
    ready: Ready,
    /// The problems found when it was opened.
    notices: Vec<Notice>,
    topics: Vec<Connection>,
    ids: HashMap<i64, ConnectionId>,
    /// Whether payloads are Zstandard frames, so that their lengths are not those of the messages.
    packed: bool,
    verify: bool,
    facts: Vec<(String, String)>,
}

fn open(place: BagPlace, options: &OpenOptions) -> Result<Box<dyn Reader>> {
    let source = match place {
        BagPlace::File(source) => source,
        BagPlace::Folder(path) => return Err(super::explain(&path, &[], true)),
        BagPlace::Pipe(name, _) => {
            let what = "a database cannot be read from a pipe";
            return Err(Error::unsupported(name, what, "save it to a file first"));
        }
    };
    let ready = db::ready(source.path())?;
    bag(ready, &source, options).map(|bag| Box::new(bag) as Box<dyn Reader>)
}

/// The topics of a database and its metadata.
fn bag(mut ready: Ready, source: &FileSource, options: &OpenOptions) -> Result<Sqlite3Bag> {
    let path = source.path().to_owned();
    let mut notices = Vec::new();
    if let Some(text) = cut(source).filter(|_| !ready.is_copy()) {
        notices.push(Notice::new(NoticeKind::Truncated, text));
        ready.damaged = true;
    }
    let broken = |e: Refusal| broken(&path, &e);
    let mut tables = tables(&ready, &path);
    if let Err(Error::Malformed { expected, .. }) = &tables
        && !ready.damaged
    {
        let text = format!("the database is damaged: not {expected}");
        notices.push(Notice::new(NoticeKind::Damaged, text));
        ready.damaged = true;
        tables = self::tables(&ready, &path).or(tables);
    }
    let (db, columns) = tables?;
    let mut bag = Sqlite3Bag {
        notices,
        file_bytes: source.len(),
        topics: Vec::new(),
        ids: HashMap::new(),
        packed: is_packed(&db),
        verify: options.verify,
        facts: facts(&db),
        path: path.clone(),
        ready,
    };
    bag.read_topics(&db, &columns).map_err(broken)?;
    Ok(bag)
}

/// The database, and the columns of its table of topics.
fn tables(ready: &Ready, path: &Path) -> Result<(Db, Vec<String>)> {
    let db = Db::open(ready).map_err(|e| broken(path, &e))?;
    need(&db, path, "messages", &["topic_id", "timestamp", "data"])?;
    let columns = need(&db, path, "topics", &["id", "name", "type"])?;
    Ok((db, columns))
}

/// A notice if the file is shorter than its own head states.
///
/// The head: <https://www.sqlite.org/fileformat2.html>, sections 1.3.2 and 1.3.7.
fn cut(source: &FileSource) -> Option<String> {
    let mut head = [0; 100];
    source.read_at(0, &mut head).ok().filter(|n| *n == 100)?;
    let number = |at: usize| Some(u32::from_be_bytes(head.get(at..at + 4)?.try_into().ok()?));
    let page = match u16::from_be_bytes([head[16], head[17]]) {
        1 => 65_536,
        size => u64::from(size),
    };
    // The page count is only valid if the last writer maintained it.
    let pages = number(28).filter(|_| number(24) == number(92))?;
    let whole = page * u64::from(pages);
    let is = source.len();
    (is < whole).then(|| format!("the database is cut at byte {is} of {whole}"))
}

fn broken(path: &Path, why: &Refusal) -> Error {
    Error::Malformed {
        path: path.to_owned(),
        expected: format!("a database that SQLite can read ({why})"),
        hint: format!(
            "the recording was cut or damaged; `sqlite3 {} .recover` may recover rows",
            file_name(path)
        ),
    }
}

/// The columns of `table`; an error unless it is a table with real columns of these names.
fn need(db: &Db, path: &Path, table: &str, names: &[&str]) -> Result<Vec<String>> {
    let columns = db.columns(table).map_err(|e| broken(path, &e))?;
    if has(&columns, names) {
        return Ok(columns);
    }
    Err(Error::Malformed {
        path: path.to_owned(),
        expected: format!("a table `{table}` with the columns {}", names.join(", ")),
        hint: "this database is not a recording, or the recorder was stopped before it began"
            .to_owned(),
    })
}

fn has(columns: &[String], names: &[&str]) -> bool {
    let is = |name: &str| columns.iter().any(|c| c.eq_ignore_ascii_case(name));
    names.iter().all(|name| is(name))
}

impl Sqlite3Bag {
    fn read_topics(&mut self, db: &Db, columns: &[String]) -> Result<(), Refusal> {
        let or_null = |name| if has(columns, &[name]) { name } else { "NULL" };
        let definitions = definitions(db).unwrap_or_default();
        let sql = format!(
            "SELECT id, name, type, {}, {}, {} FROM topics LIMIT {CONNECTIONS}",
            or_null("serialization_format"),
            or_null("offered_qos_profiles"),
            or_null("type_description_hash"),
        );
        db.each(&sql, &[], |row| {
            let (Some(raw), Some(name)) = (row.integer(0), row.text(1)) else {
                return ControlFlow::Continue(());
            };
            let place = ConnectionId(u32::try_from(self.topics.len()).unwrap_or(u32::MAX));
            if self.ids.contains_key(&raw) {
                return ControlFlow::Continue(());
            }
            self.ids.insert(raw, place);
            let type_name: Arc<str> = row.text(2).unwrap_or_default().into();
            let stored = definition(&definitions, &type_name);
            let some = |at| row.text(at).filter(|t| !t.is_empty()).map(Arc::<str>::from);
            self.topics.push(Connection {
                id: place,
                topic: name.into(),
                definition: stored.map(|stored| Arc::clone(&stored.text)),
                is_idl: stored.is_some_and(|stored| stored.is_idl),
                type_name,
                type_hash: some(5),
                publisher: None,
                latching: false,
                qos: some(4),
                encoding: match row.text(3).as_deref() {
                    None | Some("" | "cdr") => Encoding::Cdr,
                    Some(other) => Encoding::Other(other.to_owned()),
                },
            });
            ControlFlow::Continue(())
        })
    }

    /// The first stamp of a message with a known topic, in the order `order`.
    fn end(&self, db: &Db, order: &str) -> Result<Option<Stamp>, Refusal> {
        let sql = format!("SELECT timestamp, topic_id FROM messages ORDER BY timestamp {order}");
        let mut found = None;
        db.each(&sql, &[], |row| {
            let topic = row.integer(1).filter(|id| self.ids.contains_key(id));
            found = row.integer(0).filter(|_| topic.is_some()).map(Stamp);
            match found {
                Some(_) => ControlFlow::Break(()),
                None => ControlFlow::Continue(()),
            }
        })?;
        Ok(found)
    }

    fn ends(&self) -> Result<Option<Span>, Refusal> {
        let db = Db::open(&self.ready)?;
        let ends = self.end(&db, "ASC")?.zip(self.end(&db, "DESC")?);
        Ok(ends.map(|(start, last)| Span::new(start, last.plus(1))))
    }
}

/// A message definition, and whether it is in IDL.
#[derive(Clone)]
struct StoredDefinition {
    text: Arc<str>,
    is_idl: bool,
}

/// Message definitions by type (schema 4).
fn definitions(db: &Db) -> Result<BTreeMap<String, StoredDefinition>, Refusal> {
    let mut found = BTreeMap::new();
    let columns = db.columns("message_definitions")?;
    let needed = ["topic_type", "encoding", "encoded_message_definition"];
    if !has(&columns, &needed) {
        return Ok(found);
    }
    let sql = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions LIMIT 10000";
    let mut held = 0;
    db.each(sql, &[], |row| {
        if let (Some(name), Some(encoding), Some(text)) = (row.text(0), row.text(1), row.text(2)) {
            held += text.len();
            let is_idl = encoding.ends_with("idl");
            if held < MOST_PAYLOAD && (!text.is_empty() || encoding.starts_with("ros")) {
                let text = text.into();
                found.insert(name, StoredDefinition { text, is_idl });
            }
        }
        ControlFlow::Continue(())
    })?;
    Ok(found)
}

/// The definition of a type. Those of services and actions are stored under the names of their files: that of
/// `a/srv/B_Event` is in `a/srv/B`.
fn definition<'a>(
    all: &'a BTreeMap<String, StoredDefinition>,
    type_name: &str,
) -> Option<&'a StoredDefinition> {
    let is_file = |name: &&str| name.contains("/srv/") || name.contains("/action/");
    let ends = type_name.rmatch_indices('_');
    let files = ends.map(|(at, _)| &type_name[..at]).filter(is_file);
    std::iter::once(type_name)
        .chain(files)
        .find_map(|name| all.get(name))
}

/// The facts that the database states about itself (schema 3 and later).
fn facts(db: &Db) -> Vec<(String, String)> {
    let columns = db.columns("schema").unwrap_or_default();
    let names = ["schema_version", "ros_distro"];
    let known = names.iter().filter(|n| has(&columns, &[n]));
    let value = |name: &&&str| {
        let sql = format!("SELECT CAST({name} AS TEXT) FROM schema LIMIT 1");
        db.first(&sql, |row| row.text(0)).ok().flatten()
    };
    let facts = known.filter_map(|name| Some(((*name).to_owned(), value(&name)?)));
    facts.collect()
}

/// Whether the first payload is a Zstandard frame; a CDR payload never begins like one.
fn is_packed(db: &Db) -> bool {
    let sql = "SELECT substr(data, 1, 4) FROM messages WHERE octet_length(data) BETWEEN 4 AND 1000000 LIMIT 1";
    let first = db.first(sql, |row| Some(row.bytes(0)? == ZSTD));
    first.ok().flatten() == Some(true)
}

/// The size in bytes below which one thread reads all rows.
const BIG: u64 = 128 << 20;
/// The number of parts of a big bag.
const PARTS: i64 = 64;

impl Sqlite3Bag {
    /// The rows in parts: one unless the bag is big. For a range, SQLite's own index finds the rows.
    fn parts(&self, db: &Db, range: Option<Span>) -> Vec<RowRange> {
        let whole = vec![(i64::MIN, i64::MAX)];
        if self.file_bytes < BIG || range.is_some() || self.verify {
            return whole;
        }
        let sql = "SELECT min(rowid), max(rowid) FROM messages";
        let ends = db.first(sql, |row| row.integer(0).zip(row.integer(1)));
        let Ok(Some((first, last))) = ends else {
            return whole;
        };
        let step = last.saturating_sub(first) / PARTS;
        let part = |at| {
            let low = first.saturating_add(step.saturating_mul(at));
            let high = low.saturating_add(step - 1);
            (low, if at + 1 == PARTS { last } else { high })
        };
        (0..PARTS).map(part).collect()
    }
}

/// Has SQLite check the whole file for damage, and the index of times against the rows.
fn check(db: &Db, sink: &mut dyn Sink) {
    let found = db.first("PRAGMA integrity_check(1)", |row| row.text(0));
    let result = found.map_or_else(|e| e.to_string(), Option::unwrap_or_default);
    if result != "ok" {
        // A first line names the database only.
        let fault = result.lines().last().unwrap_or_default();
        damaged(sink, 1, &format!("the database is damaged: {fault}"));
    }
}

impl Reader for Sqlite3Bag {
    fn stated(&self) -> Option<Span> {
        // An error that is ignored here recurs when the rows are read.
        self.ends().unwrap_or(None)
    }

    fn span(&mut self) -> Result<Option<Span>> {
        Ok(self.stated())
    }

    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report> {
        let mut clip = Clip::new(range, sink);
        let mut wants: Vec<Want> = self.topics.iter().map(|t| clip.connection(t)).collect();
        Want::resolve(&mut wants);
        if self.ready.left_behind {
            let text = "the newest rows lie in a log beside the bag that is too large to copy";
            damaged(&mut clip, 1, text);
        }
        self.notices.iter().for_each(|n| clip.notice(n.clone()));
        let db = Db::open(&self.ready).map_err(|e| broken(&self.path, &e))?;
        // SQLite returns no rows where the first page of a table lost its rows.
        let any = "SELECT rowid FROM messages NOT INDEXED LIMIT 1";
        if self.verify || matches!(db.first(any, |row| row.integer(0)), Ok(None)) {
            check(&db, &mut clip);
        }
        let rows = RowReader::new(self, &wants, range);
        let parts = self.parts(&db, range);
        drop(db);
        let threads = if parts.len() > 1 { 8 } else { 1 };
        let work = |at: usize, sink: &mut dyn Sink| rows.read(parts[at], sink);
        in_order(parts.len(), threads, &work, &mut clip, self.file_bytes);
        Ok(Report {
            name: file_name(&self.path),
            format: FORMAT.name.to_owned(),
            compression: vec![if self.packed { "zstd" } else { "none" }.to_owned()],
            tier: [Tier::Index, Tier::Verify][usize::from(self.verify)],
            tier_reason: None,
            complete: !clip.lost,
            bytes_read: 0,
            file_bytes: self.file_bytes,
            facts: self.facts.clone(),
        })
    }
}

// A database that is still being written: its new rows, read without a lock.
//
// rosbag2 writes with `journal_mode=MEMORY` and aborts if the database is locked, so SQLite opens it as immutable and
// takes no lock; a half-written page ends a poll, and the next one continues there. With a log beside it (`-wal`) a
// reader never blocks the writer, and a short transaction reads both.

/// The number of polls between two openings of the database: polling is cheap, starting SQLite is not.
const EVERY: u32 = 4;

/// A database, read up to the last reported row.
#[derive(Default)]
struct GrowingDb {
    path: PathBuf,
    /// The sizes and times of change of the database and its log when it was last read.
    seen: Vec<(u64, Option<SystemTime>)>,
    /// The polls since then.
    looks: u32,
    /// The first row that has not been reported.
    next: i64,
    wants: Vec<Want>,
}

impl GrowingDb {
    fn new(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            looks: EVERY,
            next: i64::MIN,
            ..Self::default()
        }
    }
}

impl Growing for GrowingDb {
    fn poll(&mut self, sink: &mut dyn Sink) -> Result<Growth> {
        self.looks += 1;
        let source = FileSource::open(&self.path)?;
        let wal = with_suffix(&self.path, "-wal");
        let state = |path: &Path| {
            let meta = path.metadata().ok()?;
            Some((meta.len(), meta.modified().ok()))
        };
        let files = [self.path.as_path(), &wal].into_iter();
        let now: Vec<_> = files.filter_map(state).collect();
        if now == self.seen {
            return Ok(Growth::Same);
        }
        if self.looks < EVERY {
            return Ok(Growth::More);
        }
        (self.seen, self.looks) = (now, 0);
        let has_log = wal.metadata().is_ok_and(|log| log.len() > 0);
        let ready = Ready::growing(&self.path, has_log);
        // The table may not exist yet.
        let Ok(bag) = bag(ready, &source, &OpenOptions::default()) else {
            return Ok(Growth::More);
        };
        for topic in bag.topics.iter().skip(self.wants.len()) {
            self.wants.push(sink.connection(topic));
        }
        if let Ok(db) = Db::open(&bag.ready) {
            self.next = RowReader::new(&bag, &self.wants, None).read_from(&db, self.next, sink);
        }
        Ok(Growth::More)
    }

    fn path(&self) -> &Path {
        &self.path
    }
}
