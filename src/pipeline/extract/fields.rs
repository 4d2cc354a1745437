//! A table per topic with all fields of its messages decoded, in bag order.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, BufWriter};

use super::{Extract, Extracted, definitions, stop};
use crate::bag::{Connection, ConnectionId, Input, Message, Sink, Want};
use crate::base::error::{Error, Result};
use crate::base::name::{NodeName, TopicName};
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::table::{
    Batch, ColumnKind, ColumnOf, TableCell, TableColumn, TableWriter, columns,
};
use crate::base::time::Stamp;
use crate::base::words;
use crate::evidence::message::fields::{Decoder, Decoders, KnownTypes};
use crate::export::tables::{Folder, Part, TableFormat, begin, file_stem};
use crate::pipeline::Watch;
use crate::pipeline::collect::no_messages;
use crate::pipeline::times::of_report;
use crate::view::none_pass;

/// The columns before a message's fields: its log time, and its publisher if known.
const TIME: &str = "time_ns";
const PUBLISHER: &str = "publisher";
/// The name of the index of tables.
const INDEX: &str = "index";
/// The bytes of messages that one table buffers before its rows are written.
const MOST_WAITING: usize = 4 << 20;
/// The bytes of messages that all tables together buffer.
const MOST_WAITING_IN_ALL: usize = 32 << 20;
/// The most types named in an error.
const MOST_NAMED: usize = 3;
/// The bytes of encoded rows that all tables together keep in memory.
const MOST_HELD_IN_ALL: usize = 64 << 20;

pub(super) fn extract(job: &Extract, watch: &mut dyn Watch) -> Result<Extracted> {
    let mut lost = Lost::default();
    let range = job.range(&mut lost.notices, watch)?;
    let types = definitions::read(&job.msg_paths)?;
    let mut tables = FieldTables {
        folder: Folder::create(job.target.path())?,
        format: job.format,
        all: Vec::new(),
        of_topic: BTreeMap::new(),
        names: BTreeSet::from([INDEX.to_owned()]),
        waiting: 0,
        failed: None,
    };
    for mut reader in job.open()? {
        let mut one = OfBag {
            job,
            types: &types,
            tables: &mut tables,
            lost: &mut lost,
            sources: Vec::new(),
            watch: &mut *watch,
        };
        let report = reader.read(range, &mut one)?;
        one.count_missing();
        lost.notices.extend(of_report(&report, &lost.notices));
        stop(watch)?;
    }
    if tables.all.iter().all(|table| table.rows == 0) {
        return Err(nothing(job, &lost));
    }
    let failed = Error::io("write into", job.target.path());
    let (written, rows) = tables.finish().map_err(failed)??;
    Ok(Extracted {
        tables: written,
        rows,
        undecoded: lost.messages,
        notices: lost.notices,
        topics: lost.topics,
    })
}

/// The error for a job without a single row.
fn nothing(job: &Extract, lost: &Lost) -> Error {
    let is_whole = job.topics.passes_all() && job.start.is_none() && job.end.is_none();
    if lost.types.is_empty() && is_whole {
        return no_messages(&job.inputs, &lost.notices);
    }
    let name = job.inputs.first().map_or_else(String::new, Input::name);
    let topics: Vec<&str> = lost.topics.iter().map(TopicName::as_str).collect();
    if let Some(error) = none_pass("--topic-filter", &job.topics, &topics) {
        return error;
    }
    if lost.types.is_empty() {
        return Error::no_messages(&name, "`bagreel info` lists its topics and times");
    }
    let types = lost.types.iter();
    let types = types.map(|(name, why)| format!("{name}: {why}"));
    let types = words::some_of(types, MOST_NAMED);
    let what = format!("no message could be decoded; {types}");
    let hint = "`--msg-path DIR` names a folder of `.msg`, `.srv`, `.action` or `.idl` files";
    Error::unsupported(name, what, hint)
}

/// What the tables lack: the messages that could not be decoded, their types with a reason each, and notices; and all
/// topics, of which some may not have been requested.
#[derive(Default)]
struct Lost {
    topics: BTreeSet<TopicName>,
    messages: u64,
    types: BTreeMap<String, String>,
    notices: Notices,
}

impl Lost {
    fn add(&mut self, topic: &str, type_name: &str, count: u64, why: &str) {
        self.messages += count;
        let types = self.types.entry(type_name.to_owned());
        types.or_insert_with(|| why.to_owned());
        let text = format!("messages of `{topic}` ({type_name}) were left out: {why}");
        self.notices
            .add(Notice::counted(NoticeKind::Undecodable, count, text));
    }
}

/// One table: messages of one topic and one type, of any number of publishers and bags.
struct FieldTable {
    topic: String,
    type_name: String,
    /// The name of its file, once it is created.
    file: String,
    decoder: Decoder,
    batch: Batch,
    rows: u64,
    /// Bytes of the messages in the batch.
    waiting: usize,
    writer: Option<Box<dyn TableWriter<BufWriter<Part>>>>,
}

const INDEX_COLUMNS: &[ColumnOf<(), FieldTable>] = columns! {
    "topic" Text |(), table| TableCell::text(&table.topic);
    "type" Text |(), table| TableCell::text(&table.type_name);
    "file" Text |(), table| TableCell::text(&table.file);
    "n" I64 |(), table| TableCell::count(table.rows);
};

/// All tables.
struct FieldTables {
    folder: Folder,
    format: TableFormat,
    all: Vec<FieldTable>,
    /// The tables of each topic.
    of_topic: BTreeMap<String, Vec<usize>>,
    /// The file names in use, in lower case: some file systems are case-insensitive.
    names: BTreeSet<String>,
    waiting: usize,
    failed: Option<io::Error>,
}

impl FieldTables {
    /// The index of the table for such messages.
    fn of(&mut self, topic: &str, type_name: &str, decoder: Decoder) -> usize {
        let own = self.of_topic.entry(topic.to_owned()).or_default();
        let all = own.iter().map(|at| (*at, &self.all[*at]));
        let mut same = all.filter(|(_, t)| t.type_name == type_name && t.decoder == decoder);
        if let Some((at, _)) = same.next() {
            return at;
        }
        own.push(self.all.len());
        let columns = [
            TableColumn::full(TIME, ColumnKind::Time, 0),
            TableColumn::known(PUBLISHER, ColumnKind::Text),
        ];
        let fields = decoder.columns(&[TIME, PUBLISHER]);
        self.all.push(FieldTable {
            topic: topic.to_owned(),
            type_name: type_name.to_owned(),
            file: String::new(),
            batch: Batch::of(columns.into_iter().chain(fields)),
            decoder,
            rows: 0,
            waiting: 0,
            writer: None,
        });
        self.all.len() - 1
    }

    /// Adds a message to a table; `false` if it could not be decoded.
    fn add(&mut self, at: usize, message: &Message<'_>, publisher: Option<&str>) -> bool {
        let table = &mut self.all[at];
        table.batch.columns[0].push(&TableCell::Time(message.time));
        table.batch.columns[1].push(&TableCell::known(publisher, TableCell::text));
        let decoded = table.decoder.decode(message.data, &mut table.batch, 2);
        if decoded.is_err() {
            table.batch.take_back();
            return false;
        }
        table.batch.rows += 1;
        table.rows += 1;
        let size = message.data.len() + 16;
        table.waiting += size;
        self.waiting += size;
        if table.waiting > MOST_WAITING {
            self.write(&[at]);
        }
        if self.waiting > MOST_WAITING_IN_ALL {
            self.make_room();
        }
        true
    }

    /// Writes the tables with the most buffered bytes, until half of all bytes are written.
    fn make_room(&mut self) {
        let mut order: Vec<usize> = (0..self.all.len()).collect();
        order.sort_by_key(|at| std::cmp::Reverse(self.all[*at].waiting));
        let mut left = self.waiting;
        order.retain(|at| {
            let is_over = left > MOST_WAITING_IN_ALL / 2;
            left -= self.all[*at].waiting;
            is_over
        });
        self.write(&order);
    }

    /// Writes the buffered rows of some tables.
    fn write(&mut self, tables: &[usize]) {
        for at in tables {
            if self.failed.is_none() {
                self.failed = self.try_write(*at).err();
            }
            let table = &mut self.all[*at];
            self.waiting -= table.waiting;
            table.waiting = 0;
            table.batch.clear();
        }
        if self.failed.is_none() {
            self.failed = self.unload().err();
        }
    }

    fn try_write(&mut self, at: usize) -> io::Result<()> {
        if self.all[at].writer.is_none() {
            self.all[at].writer = Some(self.begin(at)?);
        }
        let FieldTable { writer, batch, .. } = &mut self.all[at];
        writer.as_mut().map_or(Ok(()), |writer| writer.write(batch))
    }

    /// Begins the file of a table under a unique name.
    fn begin(&mut self, at: usize) -> io::Result<Box<dyn TableWriter<BufWriter<Part>>>> {
        let table = &mut self.all[at];
        let stem = file_stem(&table.topic);
        let mut name = stem.clone();
        let mut number = 1;
        while !self.names.insert(name.to_lowercase()) {
            number += 1;
            name = format!("{stem}.{number}");
        }
        table.file = format!("{name}.{}", self.format.word());
        let part = self.folder.file(table.file.clone());
        let part = BufWriter::with_capacity(1 << 16, part);
        let facts = [("topic", table.topic.as_str()), ("type", &table.type_name)];
        begin(self.format, part, &table.batch, &facts)
    }

    /// Bounds the memory for encoded rows.
    fn unload(&mut self) -> io::Result<()> {
        let writers = || self.all.iter().filter_map(|t| t.writer.as_ref());
        if writers().map(|writer| writer.held()).sum::<usize>() < MOST_HELD_IN_ALL {
            return Ok(());
        }
        let mut writers = self.all.iter_mut().filter_map(|t| t.writer.as_mut());
        writers.try_for_each(|writer| writer.unload())
    }

    /// Writes the index of tables and files.
    fn write_index(&mut self) -> io::Result<()> {
        let mut tables: Vec<&FieldTable> = self.all.iter().filter(|t| t.rows > 0).collect();
        tables.sort_by_key(|t| (&t.topic, &t.file));
        let index = Batch::filled(INDEX_COLUMNS, &(), tables);
        let part = self.folder.file(format!("{INDEX}.{}", self.format.word()));
        let mut writer = begin(self.format, BufWriter::new(part), &index, &[])?;
        writer.write(&index)?;
        writer.finish()?.into_inner()?;
        Ok(())
    }

    /// Writes the remaining rows, one table after another, and renames all files. Returns the number of tables and of
    /// rows; a topic without a decoded message has no table.
    fn finish(mut self) -> io::Result<Result<(usize, u64)>> {
        let (mut tables, mut rows) = (0, 0);
        self.failed.take().map_or(Ok(()), Err)?;
        for at in 0..self.all.len() {
            if self.all[at].rows == 0 {
                continue;
            }
            self.try_write(at)?;
            if let Some(writer) = self.all[at].writer.take() {
                writer.finish()?.into_inner()?;
            }
            tables += 1;
            rows += self.all[at].rows;
        }
        self.write_index()?;
        Ok(self.folder.commit().map(|()| (tables, rows)))
    }
}

/// The target of the messages of one connection.
struct MessageTarget {
    topic: String,
    type_name: String,
    /// The indexes of the tables to try until a message fits one, or the reason why there are none; `None` for topics that
    /// are not requested.
    tables: Option<Result<Vec<usize>, String>>,
    /// The reason why messages fit none of them.
    misfit: String,
    publisher: Option<NodeName>,
    /// The number of stamped messages that have not been delivered.
    missing: u64,
}

/// The sink for one bag.
struct OfBag<'a> {
    job: &'a Extract,
    types: &'a KnownTypes,
    tables: &'a mut FieldTables,
    lost: &'a mut Lost,
    sources: Vec<MessageTarget>,
    watch: &'a mut dyn Watch,
}

impl OfBag<'_> {
    /// Counts announced messages that were not delivered.
    fn count_missing(&mut self) {
        for source in self.sources.iter().filter(|source| source.missing > 0) {
            let why = match &source.tables {
                Some(Err(why)) => why,
                Some(Ok(_)) => "they could not be read",
                None => continue,
            };
            let (topic, type_name) = (&source.topic, &source.type_name);
            self.lost.add(topic, type_name, source.missing, why);
        }
    }
}

impl Sink for OfBag<'_> {
    fn connection(&mut self, connection: &Connection) -> Want {
        let (topic, type_name) = (connection.topic.as_str(), &*connection.type_name);
        self.lost.topics.insert(connection.topic.clone());
        let is_wanted = self.job.topics.passes(topic);
        let mut misfit = String::new();
        let tables = is_wanted.then(|| {
            let decoders = Decoders::new(connection, self.types)?;
            misfit = decoders.why;
            let table = |one| self.tables.of(topic, type_name, one);
            Ok(decoders.all.into_iter().map(table).collect())
        });
        let want = match tables {
            Some(Ok(_)) => Want::Payload,
            _ => Want::Stamps,
        };
        self.sources.push(MessageTarget {
            topic: topic.to_owned(),
            type_name: type_name.to_owned(),
            tables,
            misfit,
            publisher: connection.publisher.clone(),
            missing: 0,
        });
        want
    }

    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], _: Option<&[u32]>) {
        if let Some(source) = self.sources.get_mut(connection.0 as usize) {
            source.missing = source.missing.wrapping_add(stamps.len() as u64);
        }
    }

    fn message(&mut self, message: Message<'_>) {
        let Some(source) = self.sources.get_mut(message.connection.0 as usize) else {
            return;
        };
        let Some(Ok(tables)) = &mut source.tables else {
            return;
        };
        // Messages may be delivered before their stamps.
        source.missing = source.missing.wrapping_sub(1);
        let publisher = source.publisher.as_ref().map(NodeName::as_str);
        let mut each = tables.iter().copied();
        if let Some(fitting) = each.find(|at| self.tables.add(*at, &message, publisher)) {
            tables.retain(|at| *at == fitting);
            return;
        }
        let decoder = &self.tables.all[tables[0]].decoder;
        let why = decoder.other_encoding(message.data);
        let why = why.map(|name| format!("they are encoded as {name}, which is not decoded"));
        let why = why.as_deref().unwrap_or(&source.misfit);
        self.lost.add(&source.topic, &source.type_name, 1, why);
    }

    fn notice(&mut self, notice: Notice) {
        self.lost.notices.add(notice);
    }

    fn progress(&mut self, done: u64, total: u64) {
        self.watch.progress(done, total);
    }
}
