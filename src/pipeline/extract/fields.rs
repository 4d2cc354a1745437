//! A table per topic with every field of its messages decoded, in the order of the bag.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, BufWriter};

use super::{Extract, Extracted, of_report, stop};
use crate::bag::{Connection, ConnectionId, Message, Sink, Want};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::table::{Batch, ColumnKind, ColumnValues, TableColumn};
use crate::base::time::Stamp;
use crate::evidence::message::fields::Decoder;
use crate::export::tables::TableFormat;
use crate::export::tables::folder::{Folder, Part, file_stem};
use crate::export::tables::writer::Writer;
use crate::pipeline::Watch;

/// The column in front of a message's fields: its log time.
const TIME: &str = "time_ns";
/// The number of bytes of messages that wait in one table before its rows are written.
const MOST_WAITING: usize = 4 << 20;
/// The same number for all tables together.
const MOST_WAITING_IN_ALL: usize = 32 << 20;
/// The number of bytes of packed rows that all tables hold in memory.
const MOST_HELD_IN_ALL: usize = 64 << 20;

pub(super) fn extract(job: &Extract, watch: &mut dyn Watch) -> Result<Extracted> {
    let range = job.range(watch)?;
    let mut tables = FieldTables {
        folder: Folder::create(job.target.path())?,
        format: job.format,
        all: Vec::new(),
        names: BTreeSet::new(),
        waiting: 0,
        failed: None,
    };
    let mut lost = Lost::default();
    for mut reader in job.open()? {
        let mut one = OfBag {
            job,
            tables: &mut tables,
            lost: &mut lost,
            sources: Vec::new(),
            watch: &mut *watch,
        };
        let report = reader.read(range, &mut one)?;
        one.settle();
        lost.notices.extend(of_report(&report, &lost.notices));
        stop(watch)?;
    }

    let (written, rows) = tables
        .finish()
        .map_err(Error::io("write into", job.target.path()))??;
    Ok(Extracted {
        tables: written,
        rows,
        undecoded: lost.messages,
        notices: lost.notices,
    })
}

/// The messages that could not be decoded: their number, and notices about them.
#[derive(Default)]
struct Lost {
    messages: u64,
    notices: Notices,
}

impl Lost {
    fn add(&mut self, topic: &str, type_name: &str, count: u64, why: &str) {
        self.messages += count;
        self.notices.add(Notice {
            kind: NoticeKind::Undecodable,
            count,
            text: format!("messages of `{topic}` ({type_name}) were left out: {why}"),
        });
    }
}

/// One table: messages of one topic and one type, of any number of publishers and bags.
struct FieldTable {
    topic: String,
    type_name: String,
    decoder: Decoder,
    batch: Batch,
    rows: u64,
    /// Bytes of the messages in the batch.
    waiting: usize,
    writer: Option<Writer<BufWriter<Part>>>,
}

/// All tables.
struct FieldTables {
    folder: Folder,
    format: TableFormat,
    all: Vec<FieldTable>,
    /// Names of files taken so far, in lower case: some systems do not tell cases apart.
    names: BTreeSet<String>,
    waiting: usize,
    failed: Option<io::Error>,
}

impl FieldTables {
    /// The place of the table for such messages.
    fn of(&mut self, connection: &Connection, decoder: Decoder) -> usize {
        let same = |t: &FieldTable| {
            t.topic == connection.topic.as_str()
                && *t.type_name == *connection.type_name
                && t.decoder == decoder
        };
        if let Some(at) = self.all.iter().position(same) {
            return at;
        }
        let columns = std::iter::once(TableColumn::full(TIME, ColumnKind::Time, 0));
        self.all.push(FieldTable {
            topic: connection.topic.as_str().to_owned(),
            type_name: connection.type_name.as_ref().to_owned(),
            batch: Batch::of(columns.chain(decoder.columns(&[TIME]))),
            decoder,
            rows: 0,
            waiting: 0,
            writer: None,
        });
        self.all.len() - 1
    }

    /// Adds a message to a table; `false` if it could not be decoded.
    fn add(&mut self, at: usize, message: &Message<'_>) -> bool {
        let table = &mut self.all[at];
        if let ColumnValues::I64(times) = &mut table.batch.columns[0].values {
            times.push(message.time.0);
        }
        if table
            .decoder
            .decode(message.data, &mut table.batch, 1)
            .is_err()
        {
            table.batch.take_back();
            return false;
        }
        table.batch.rows += 1;
        table.rows += 1;
        let size = message.data.len() + 16;
        table.waiting += size;
        self.waiting += size;
        if table.waiting > MOST_WAITING {
            self.write(at);
        }
        if self.waiting > MOST_WAITING_IN_ALL {
            self.make_room();
        }
        true
    }

    /// Writes the tables with the most bytes waiting, until half of all bytes are written.
    fn make_room(&mut self) {
        let mut order: Vec<usize> = (0..self.all.len()).collect();
        order.sort_by_key(|at| std::cmp::Reverse(self.all[*at].waiting));
        for at in order {
            if self.waiting <= MOST_WAITING_IN_ALL / 2 {
                return;
            }
            self.write(at);
        }
    }

    /// Writes the rows that wait in a table.
    fn write(&mut self, at: usize) {
        if self.failed.is_none() {
            let result = self.try_write(at);
            self.failed = result.and_then(|()| self.unload()).err();
        }
        let table = &mut self.all[at];
        self.waiting -= table.waiting;
        table.waiting = 0;
        table.batch.clear();
    }

    fn try_write(&mut self, at: usize) -> io::Result<()> {
        if self.all[at].writer.is_none() {
            self.all[at].writer = Some(self.begin(at)?);
        }
        let table = &mut self.all[at];
        match &mut table.writer {
            Some(writer) => writer.write(&table.batch),
            None => Ok(()),
        }
    }

    /// Begins the file of a table, under a name that no other has.
    fn begin(&mut self, at: usize) -> io::Result<Writer<BufWriter<Part>>> {
        let table = &self.all[at];
        let stem = file_stem(&table.topic);
        let mut name = stem.clone();
        let mut number = 1;
        while !self.names.insert(name.to_lowercase()) {
            number += 1;
            name = format!("{stem}.{number}");
        }
        let part = self.folder.file(format!("{name}.{}", self.format.word()));
        let facts = [("topic", table.topic.as_str()), ("type", &table.type_name)];
        Writer::new(
            self.format,
            BufWriter::with_capacity(1 << 16, part),
            &table.batch,
            &facts,
        )
    }

    /// Keeps the memory for packed rows within bounds.
    fn unload(&mut self) -> io::Result<()> {
        let writers = || self.all.iter().filter_map(|t| t.writer.as_ref());
        if writers().map(Writer::held).sum::<usize>() < MOST_HELD_IN_ALL {
            return Ok(());
        }
        let mut writers = self.all.iter_mut().filter_map(|t| t.writer.as_mut());
        writers.try_for_each(Writer::unload)
    }

    /// Writes the rest, one table after another, and gives all of them their names. Returns the number of tables and of
    /// rows; a topic without a decoded message has no table.
    fn finish(mut self) -> io::Result<Result<(usize, u64)>> {
        let (mut tables, mut rows) = (0, 0);
        for at in 0..self.all.len() {
            if self.all[at].rows == 0 {
                continue;
            }
            self.write(at);
            if let Some(failed) = self.failed.take() {
                return Err(failed);
            }
            if let Some(writer) = self.all[at].writer.take() {
                writer.finish()?.into_inner()?;
            }
            tables += 1;
            rows += self.all[at].rows;
        }
        Ok(self.folder.commit().map(|()| (tables, rows)))
    }
}

/// The target of the messages of one connection.
struct MessageTarget {
    topic: String,
    type_name: String,
    /// The place of the table, or the reason why there is none; `None` for topics that are not asked for.
    table: Option<Result<usize, String>>,
    /// The number of messages stamped and not seen since.
    missing: u64,
}

/// The reader's visitor of one bag.
struct OfBag<'a> {
    job: &'a Extract,
    tables: &'a mut FieldTables,
    lost: &'a mut Lost,
    sources: Vec<MessageTarget>,
    watch: &'a mut dyn Watch,
}

impl OfBag<'_> {
    /// Counts messages that were announced and never came.
    fn settle(&mut self) {
        let mut reasons: BTreeMap<usize, &str> = BTreeMap::new();
        for (at, source) in self.sources.iter().enumerate() {
            match &source.table {
                Some(Err(why)) => reasons.insert(at, why),
                Some(Ok(_)) => reasons.insert(at, "they could not be read"),
                None => None,
            };
        }
        for (at, why) in reasons {
            let source = &self.sources[at];
            if source.missing > 0 {
                self.lost
                    .add(&source.topic, &source.type_name, source.missing, why);
            }
        }
    }
}

impl Sink for OfBag<'_> {
    fn connection(&mut self, connection: &Connection) -> Want {
        let is_wanted = self.job.topics.passes(connection.topic.as_str());
        let table = is_wanted.then(|| {
            let decoder = Decoder::new(connection)?;
            Ok(self.tables.of(connection, decoder))
        });
        let want = match table {
            Some(Ok(_)) => Want::Payload,
            _ => Want::Stamps,
        };
        self.sources.push(MessageTarget {
            topic: connection.topic.as_str().to_owned(),
            type_name: connection.type_name.as_ref().to_owned(),
            table,
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
        let Some(Ok(table)) = source.table else {
            return;
        };
        // Messages may come before their stamps.
        source.missing = source.missing.wrapping_sub(1);
        if !self.tables.add(table, &message) {
            let why = "they do not have the layout of its definition";
            self.lost.add(&source.topic, &source.type_name, 1, why);
        }
    }

    fn notice(&mut self, notice: Notice) {
        self.lost.notices.add(notice);
    }

    fn progress(&mut self, done: u64, total: u64) {
        self.watch.progress(done, total);
    }
}
