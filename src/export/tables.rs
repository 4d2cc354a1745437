//! The mission as tidy tables in CSV or Parquet, from one description of their contents.
//!
//! Column names are in snake case and not reserved in any SQL dialect; an empty cell is unknown.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::TempDir;

#[cfg(feature = "parquet")]
use super::parquet;
use super::sequence::Sequence;
use super::sink::OutputSink;
use super::target::{Target, is_special};
use super::{Started, Written};
use crate::base::csv;
use crate::base::error::{Error, Result};
use crate::base::file::Leftover;
use crate::base::table::{Batch, ColumnKind, ColumnOf, TableCell, TableWriter, columns};
use crate::base::time::{Span, Stamp};
use crate::base::words::worded;
use crate::graph::{Element, ElementState, Id as _, Node, NodeId, NodeLoad, Topic};
use crate::mission::event_log::{Detail, EventId};
use crate::mission::{Change, Mission};

/// Checks whether several files can be derived from this name.
///
/// # Errors
/// [`Error::Usage`] for standard output, devices, and a name with `{n}`.
pub(crate) fn check(target: &Target) -> Result<()> {
    let what = match target {
        Target::Stdout => "standard output is one".to_owned(),
        Target::Path(path) if is_special(path) => format!("`{}` is one", path.display()),
        Target::Path(_) => return target.must_be_one("the tables contain all windows"),
    };
    let what = format!("the tables are several files, {what}");
    Err(Error::usage(
        what,
        "give a file: `-o x.csv` writes `x.edges.csv` and others",
    ))
}

/// The files of all tables in the format of this name.
pub(crate) fn files(target: &Target, word: &str) -> Vec<Target> {
    let file = |table: &Table| target.with_word(table.word, word);
    TABLES.iter().map(file).collect()
}

/// Begins the tables.
///
/// # Errors
/// As [`check`].
pub(crate) fn start<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
    format: TableFormat,
) -> Started<'a> {
    check(target)?;
    let target = target.clone();
    Ok(Box::new(move || {
        let each = TABLES.iter().zip(files(&target, format.word()));
        let write = |(table, file): (&Table, Target)| {
            let rows = |row: RowTaker<'_>| (table.fill)(sequence.data, row);
            write(rows, (table.batch)(), &file, format)
        };
        // All of them are complete before the first one is renamed.
        let mut sinks: Vec<OutputSink> = each.map(write).collect::<Result<_>>()?;
        for sink in &mut sinks {
            sink.flush().map_err(sink.error())?;
        }
        let mut written = Written::to(&target);
        for sink in sinks {
            written.add(sink.commit()?);
        }
        Ok(written)
    }))
}

/// Every table of a mission by name: `edges`, `topics`, `nodes`, `changes`, `events`, `phases`, `bags`.
pub fn of_mission(mission: &Mission) -> Vec<(&'static str, Batch)> {
    let fill = |table: &Table| {
        let mut batch = (table.batch)();
        (table.fill)(mission, &mut |row: &[TableCell<'_>]| batch.push(row));
        (table.word, batch)
    };
    TABLES.iter().map(fill).collect()
}

/// The number of rows buffered before they are written.
const MOST_ROWS: usize = 4096;

fn write(
    rows: impl Fn(RowTaker<'_>),
    mut batch: Batch,
    target: &Target,
    format: TableFormat,
) -> Result<OutputSink> {
    let sink = OutputSink::create(target, None)?;
    let failed = Error::io("write", sink.path());
    let write = || {
        let mut writer = begin(format, sink, &batch, &[])?;
        let mut result = Ok(());
        rows(&mut |row: &[TableCell<'_>]| {
            batch.push(row);
            if batch.rows >= MOST_ROWS && result.is_ok() {
                result = writer.write(&batch);
                batch.clear();
            }
        });
        result?;
        writer.write(&batch)?;
        writer.finish()
    };
    write().map_err(failed)
}

// The tables of a mission: their columns, each with its cell, and their rows.

/// A function that takes a row.
type RowTaker<'a> = &'a mut dyn FnMut(&[TableCell<'_>]);

/// A table: its name in the file's name, an empty batch, and the function that fills it.
struct Table {
    word: &'static str,
    batch: fn() -> Batch,
    fill: fn(&Mission, RowTaker<'_>),
}

type Column<R> = ColumnOf<Mission, R>;

/// A table with these columns and a row for each of these.
macro_rules! table {
    ($word:literal, $columns:ident, $mission:ident => $rows:expr) => {
        Table {
            word: $word,
            batch: || Batch::with($columns),
            fill: |$mission, row| {
                for one in $rows {
                    let cells = $columns.iter().map(|column| (column.cell)($mission, &one));
                    row(&cells.collect::<Vec<_>>());
                }
            },
        }
    };
}

/// All tables of a mission.
const TABLES: &[Table] = &[
    table!("edges", EDGES, all => elements(all, Element::is_edge)),
    table!("topics", TOPICS, all => elements(all, Element::is_topic)),
    table!("nodes", NODES, all => elements(all, Element::is_node)),
    table!("changes", CHANGES, all => changes(all)),
    table!("events", EVENTS, all => all.log.events.ids()),
    table!("phases", PHASES, all => 0..all.log.phases.len()),
    table!("bags", BAGS, all => 0..all.bags.len()),
];

/// The columns of a table of elements, including those common to all such tables.
macro_rules! of_elements {
    ($($column:ident)*) => { &[$($column),*] };
}

const EDGES: &[Column<Seen>] = of_elements! {
    WIN START END LENGTH WHAT NODE TOPIC STATE DEGREE EVIDENCE N HZ BYTES DROPS JITTER AGE FIRST LAST
};
const TOPICS: &[Column<Seen>] = of_elements! {
    WIN START END LENGTH TOPIC TYPES STATE DEGREE EVIDENCE N BYTES HZ MEDIAN GAP DROPS JITTER AGE SKEW QOS FIRST LAST
};
const NODES: &[Column<Seen>] = of_elements! {
    WIN START END LENGTH NODE ROLE STATE DEGREE EVIDENCE HZ MESSAGES_IN MESSAGES_OUT BYTES_IN BYTES_OUT TOPICS_IN
    TOPICS_OUT LIFECYCLE FIRST LAST
};

macro_rules! element_columns {
    ($($column:ident $name:literal $kind:ident $cell:expr;)*) => {
        $(const $column: Column<Seen> = ColumnOf { name: $name, kind: ColumnKind::$kind, cell: $cell };)*
    };
}

element_columns! {
    WIN "win" I64 |_, one| TableCell::count(one.win);
    START "start_ns" Time |_, one| TableCell::Time(one.span.start);
    END "end_ns" Time |_, one| TableCell::Time(one.span.end);
    LENGTH "length_ns" I64 |_, one| TableCell::Int(one.span.nanos());
    WHAT "what" Text |_, one| TableCell::text(one.state.what.word());
    NODE "node" Text |all, one| node(all, one.state.what);
    ROLE "node_role" Text |all, one| text(node_of(all, one).map(|node| &*node.role));
    TOPIC "topic" Text |all, one| topic(all, one.state.what);
    TYPES "types" Text |all, one| words(topic_of(all, one).iter().flat_map(|topic| &topic.types).map(|kind| &**kind));
    QOS "qos" Text |all, one| text(topic_of(all, one).and_then(|topic| topic.qos.as_deref()));
    STATE "state" Text |_, one| TableCell::text(one.state.state.word());
    DEGREE "degree" Text |_, one| TableCell::text(one.state.confidence.word());
    EVIDENCE "evidence" Text |all, one| words(all.elements.evidence(one.state.what).words());
    LIFECYCLE "lifecycle" Text |_, one| text(one.state.lifecycle.as_deref());
    N "n" I64 |_, one| count(one.state.count);
    HZ "hz" F64 |_, one| float(one.state.hz);
    BYTES "bytes" I64 |_, one| count(one.state.bytes);
    MEDIAN "median_period_s" F64 |_, one| float(one.state.median_period_s);
    GAP "max_gap_s" F64 |_, one| float(one.state.max_gap_s);
    DROPS "drops" I64 |_, one| count(one.state.measures.drops);
    JITTER "jitter_s" F64 |_, one| float(one.state.measures.jitter_s);
    AGE "age_s" F64 |_, one| float(one.state.measures.age_s);
    SKEW "skew" F64 |_, one| float(one.skew);
    MESSAGES_IN "messages_in" I64 |_, one| count(one.load.map(|load| load.messages_in));
    MESSAGES_OUT "messages_out" I64 |_, one| count(one.load.map(|load| load.messages_out));
    BYTES_IN "bytes_in" I64 |_, one| count(one.load.and_then(|load| load.bytes_in));
    BYTES_OUT "bytes_out" I64 |_, one| count(one.load.and_then(|load| load.bytes_out));
    TOPICS_IN "topics_in" I64 |_, one| count(one.load.map(|load| load.topics_in.into()));
    TOPICS_OUT "topics_out" I64 |_, one| count(one.load.map(|load| load.topics_out.into()));
    FIRST "first_ns" Time |all, one| time(all.elements.seen(one.state.what).first);
    LAST "last_ns" Time |all, one| time(all.elements.seen(one.state.what).last);
}

/// The elements of a kind in each window.
fn elements(all: &Mission, is_kind: fn(&Element) -> bool) -> impl Iterator<Item = Seen> {
    let skews = all.skews();
    // Of nodes, which come first.
    let has_loads = is_kind(&Element::Node(NodeId::of(0)));
    all.each().flat_map(move |(window, graph)| {
        let loads = has_loads.then(|| graph.loads(&all.elements));
        let loads = loads.into_iter().flatten().map(Some);
        let states = graph.states.into_iter();
        let states = states.zip(loads.chain(std::iter::repeat(None)));
        let seen = states.map(|(state, load)| Seen {
            win: window.index,
            span: window.span,
            skew: match state.what {
                Element::Topic(id) => skews.get(id).copied().flatten(),
                _ => None,
            },
            state,
            load,
        });
        let seen = seen.filter(|one| is_kind(&one.state.what));
        seen.collect::<Vec<_>>()
    })
}

/// An element in a window.
struct Seen {
    /// The index of the window.
    win: usize,
    span: Span,
    state: ElementState,
    /// The skew of a topic over all windows.
    skew: Option<f64>,
    load: Option<NodeLoad>,
}

fn node_of<'a>(mission: &'a Mission, one: &Seen) -> Option<&'a Node> {
    match one.state.what {
        Element::Node(id) => mission.elements.nodes.get(id),
        _ => None,
    }
}

fn topic_of<'a>(mission: &'a Mission, one: &Seen) -> Option<&'a Topic> {
    match one.state.what {
        Element::Topic(id) => mission.elements.topics.get(id),
        _ => None,
    }
}

/// A change, and the index of its window.
type WindowChange = (usize, Change);

fn changes(all: &Mission) -> impl Iterator<Item = WindowChange> {
    let windows = all.windows.iter().enumerate();
    windows.flat_map(|(at, window)| window.changes.iter().map(move |one| (at, one.clone())))
}

const CHANGES: &[Column<WindowChange>] = columns! {
    "win" I64 |all, one| TableCell::count(all.windows[one.0].index);
    "start_ns" Time |all, one| TableCell::Time(all.windows[one.0].span.start);
    "end_ns" Time |all, one| TableCell::Time(all.windows[one.0].span.end);
    "length_ns" I64 |all, one| TableCell::Int(all.windows[one.0].span.nanos());
    "kind" Text |_, one| TableCell::text(one.1.word());
    "what" Text |_, one| TableCell::text(one.1.what.word());
    "node" Text |all, one| node(all, one.1.what);
    "topic" Text |all, one| topic(all, one.1.what);
    "time_ns" Time |_, one| time(one.1.time);
    "from_hz" F64 |_, one| float(rates(&one.1.detail).0);
    "to_hz" F64 |_, one| float(rates(&one.1.detail).1);
    "from_value" Text |all, one| values(all, &one.1.detail).0;
    "to_value" Text |all, one| values(all, &one.1.detail).1;
};

const EVENTS: &[Column<EventId>] = columns! {
    "id" I64 |_, id| TableCell::count(id.0);
    "kind" Text |all, id| TableCell::text(all.log.events[*id].kind.word());
    "what" Text |all, id| TableCell::text(all.log.events[*id].what.word());
    "node" Text |all, id| node(all, all.log.events[*id].what);
    "topic" Text |all, id| topic(all, all.log.events[*id].what);
    "time_ns" Time |all, id| TableCell::Time(all.log.events[*id].time);
    "earliest_ns" Time |all, id| TableCell::Time(all.log.events[*id].earliest);
    "latest_ns" Time |all, id| TableCell::Time(all.log.events[*id].latest);
    "until_ns" Time |all, id| time(all.log.events[*id].until);
    "from_hz" F64 |all, id| float(rates(&all.log.events[*id].detail).0);
    "to_hz" F64 |all, id| float(rates(&all.log.events[*id].detail).1);
    "from_value" Text |all, id| values(all, &all.log.events[*id].detail).0;
    "to_value" Text |all, id| values(all, &all.log.events[*id].detail).1;
    "degree" Text |all, id| TableCell::text(all.log.events[*id].confidence.word());
    "evidence" Text |all, id| words(all.log.events[*id].evidence.words());
    "part_of" I64 |all, id| count(all.log.events[*id].part_of.map(|id| id.0.into()));
    "is_quiet" FLAG |all, id| TableCell::Flag(all.log.events[*id].quiet);
    "weight" I64 |all, id| TableCell::count(all.log.events[*id].weight);
};

const PHASES: &[Column<usize>] = columns! {
    "phase" I64 |_, at| TableCell::count(*at);
    "start_ns" Time |all, at| TableCell::Time(all.log.phases[*at].span.start);
    "end_ns" Time |all, at| TableCell::Time(all.log.phases[*at].span.end);
    "length_ns" I64 |all, at| TableCell::Int(all.log.phases[*at].span.nanos());
    "phase_name" Text |all, at| TableCell::text(&*all.log.phases[*at].name);
    "nodes_added" I64 |all, at| TableCell::count(all.log.phases[*at].nodes_added);
    "nodes_removed" I64 |all, at| TableCell::count(all.log.phases[*at].nodes_removed);
    "same_as" I64 |all, at| count(all.log.phases[*at].same_as.map(u64::from));
};

const BAGS: &[Column<usize>] = columns! {
    "bag" Text |all, at| TableCell::text(&all.bags[*at].name);
    "bag_format" Text |all, at| TableCell::text(&all.bags[*at].format);
    "compression" Text |all, at| TableCell::text(all.bags[*at].compression.join(" "));
    "tier" Text |all, at| TableCell::text(all.bags[*at].tier.word());
    "tier_reason" Text |all, at| text(all.bags[*at].tier_reason.as_deref());
    "is_complete" FLAG |all, at| TableCell::Flag(all.bags[*at].complete);
    "file_bytes" I64 |all, at| TableCell::count(all.bags[*at].file_bytes);
};

fn rates(detail: &Detail) -> (Option<f64>, Option<f64>) {
    match detail {
        Detail::Rates { from_hz, to_hz } => (Some(*from_hz), Some(*to_hz)),
        _ => (None, None),
    }
}

fn values<'a>(mission: &Mission, detail: &'a Detail) -> (TableCell<'a>, TableCell<'a>) {
    let names = |nodes: &[NodeId]| {
        let nodes = nodes.iter().map(|n| &mission.elements.nodes[*n]);
        words(nodes.map(|n| n.name.as_str()))
    };
    match detail {
        Detail::None | Detail::Rates { .. } => (TableCell::Null, TableCell::Null),
        Detail::Count { count } => (TableCell::text(""), TableCell::text(count.to_string())),
        Detail::Senders { from, to } => (names(from), names(to)),
        Detail::Values { from, to } => (TableCell::text(&**from), TableCell::text(&**to)),
    }
}

/// The node of an element; unknown for a topic.
fn node(mission: &Mission, what: Element) -> TableCell<'_> {
    text(mission.elements.names(what).0)
}

/// The topic of an element; unknown for a node.
fn topic(mission: &Mission, what: Element) -> TableCell<'_> {
    text(mission.elements.names(what).1)
}

fn words<'a>(words: impl Iterator<Item = &'a str>) -> TableCell<'static> {
    TableCell::text(words.collect::<Vec<_>>().join(" "))
}

fn text(text: Option<&str>) -> TableCell<'_> {
    TableCell::known(text, TableCell::text)
}

fn count(count: Option<u64>) -> TableCell<'static> {
    TableCell::known(count, TableCell::count)
}

fn float(number: Option<f64>) -> TableCell<'static> {
    TableCell::known(number, TableCell::Float)
}

fn time(stamp: Option<Stamp>) -> TableCell<'static> {
    TableCell::known(stamp, TableCell::Time)
}

// A folder of tables in progress: hidden until all of them are complete, with few files open at a time.

/// Files that appear together in a folder. Dropped without [`Folder::commit`], they are removed.
pub(crate) struct Folder {
    path: PathBuf,
    hidden: TempDir,
    /// The guard that removes the hidden folder when a signal ends the process.
    _left: Leftover,
    /// Dropped after the hidden folder inside it.
    _made: Made,
    names: Vec<String>,
}

/// Folders created for the files, the outermost first. Those still empty on drop are removed.
struct Made(Vec<PathBuf>);

impl Drop for Made {
    fn drop(&mut self) {
        for folder in self.0.iter().rev() {
            // Fails for folders with files, as intended.
            let _ = fs::remove_dir(folder);
        }
    }
}

impl Folder {
    /// Files that will appear in the folder `path`, which is created if missing.
    ///
    /// # Errors
    /// Where the system refuses.
    pub(crate) fn create(path: &Path) -> Result<Self> {
        let missing = path.ancestors();
        let missing = missing.take_while(|f| !f.as_os_str().is_empty() && !f.exists());
        let mut missing: Vec<PathBuf> = missing.map(Path::to_owned).collect();
        missing.reverse();
        fs::create_dir_all(path).map_err(Error::io("create the folder", path))?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(".bagreel-").suffix(".part");
        let hidden = builder.tempdir_in(path);
        let hidden = hidden.map_err(Error::io("write into", path))?;
        Ok(Self {
            path: path.to_owned(),
            _left: Leftover::at(hidden.path()),
            hidden,
            _made: Made(missing),
            names: Vec::new(),
        })
    }

    /// A new file with the unique name `name`.
    pub(crate) fn file(&mut self, name: String) -> Part {
        let path = self.hidden.path().join(&name);
        self.names.push(name);
        Part(path)
    }

    /// Renames all files, replacing existing ones.
    ///
    /// # Errors
    /// Where the system refuses.
    pub(crate) fn commit(self) -> Result<()> {
        for name in &self.names {
            let to = self.path.join(name);
            let given = fs::rename(self.hidden.path().join(name), &to);
            given.map_err(Error::io("write", &to))?;
        }
        Ok(())
    }
}

/// One of its files. It is only open while bytes are added, as a bag may have more topics than a process may have open
/// files; write large blocks.
#[derive(Debug)]
pub(crate) struct Part(PathBuf);

impl Write for Part {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut file = File::options().create(true).append(true).open(&self.0)?;
        file.write_all(bytes)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The longest file name without extension, in bytes, that every system supports.
const LONGEST: usize = 200;

/// The name of a topic's file: `/base/scan` is `base.scan`. A character that is neither letter, digit, `_` nor `-` is
/// written as its bytes, `%2E`, so that no name leaves the folder; different topics have different names, except for a
/// leading slash.
pub(crate) fn file_stem(topic: &str) -> String {
    let mut stem = String::new();
    for byte in topic.strip_prefix('/').unwrap_or(topic).bytes() {
        match byte {
            b'/' => stem.push('.'),
            b if b.is_ascii_alphanumeric() || b == b'_' || b == b'-' => stem.push(char::from(b)),
            b => {
                // Writing to a string cannot fail.
                let _ = write!(stem, "%{b:02X}");
            }
        }
    }
    stem.truncate(LONGEST);
    // Neither hidden nor empty, nor an option of a command.
    if stem.is_empty() || stem.starts_with(['.', '-']) {
        stem.insert(0, '_');
    }
    stem
}

// Writes the rows of a table as CSV or Parquet.

worded! {
    /// The format of a table; its word is also its file extension.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum TableFormat {
        /// Comma-separated values, stamps as nanoseconds since 1970.
        #[default]
        Csv = "csv",
        /// Apache Parquet, stamps as timestamps; written with the feature `parquet`.
        Parquet = "parquet",
    }
}

impl TableFormat {
    /// The format, if this build writes it.
    ///
    /// # Errors
    /// [`Error::Usage`] if not, with the builds that do.
    pub(crate) fn built(self) -> Result<Self> {
        if self == Self::Parquet && cfg!(not(feature = "parquet")) {
            let hint =
                "packages and the Python wheel do, and `cargo install --path . --features parquet`";
            return Err(Error::usage(NO_PARQUET, hint));
        }
        Ok(self)
    }
}

const NO_PARQUET: &str = "this build of bagreel does not write Parquet";

/// A whole small table as bytes.
///
/// # Errors
/// [`Error::Io`] if the format cannot represent it.
pub(crate) fn whole(format: TableFormat, table: &Batch) -> Result<Vec<u8>> {
    let write = || {
        let mut writer = begin(format, Vec::new(), table, &[])?;
        writer.write(table)?;
        writer.finish()
    };
    write().map_err(Error::io("write", Path::new("-")))
}

/// Begins a table with the columns of `batch`; `facts` about it are stored if the format supports it.
pub(crate) fn begin<'a, W: Write + Send + 'a>(
    format: TableFormat,
    to: W,
    batch: &Batch,
    facts: &[(&str, &str)],
) -> io::Result<Box<dyn TableWriter<W> + 'a>> {
    let _ = facts;
    Ok(match format {
        TableFormat::Csv => Box::new(csv::CsvRows::new(to, batch)?),
        #[cfg(feature = "parquet")]
        TableFormat::Parquet => Box::new(parquet::Rows::new(to, batch, facts)?),
        #[cfg(not(feature = "parquet"))]
        TableFormat::Parquet => return Err(io::Error::other(NO_PARQUET)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_topic_leaves_the_folder() {
        assert_eq!(file_stem("/base/scan"), "base.scan");
        assert_eq!(
            file_stem("/../../etc/x y"),
            "_%2E%2E.%2E%2E.etc.x%20y".trim_start_matches('_')
        );
        assert_eq!(file_stem("//a"), "_.a");
        assert_eq!(file_stem("/"), "_");
        assert_eq!(file_stem(&"/a".repeat(500)).len(), LONGEST);
    }

    #[test]
    fn files_appear_together_or_not_at_all() {
        let dir = tempfile::tempdir().unwrap();
        let write = |word: &[u8]| {
            let mut folder = Folder::create(&dir.path().join("t")).unwrap();
            for name in ["a", "b"] {
                let mut part = folder.file(name.to_owned());
                part.write_all(word).unwrap();
                part.write_all(b"!").unwrap();
            }
            folder
        };
        drop(write(b"lost"));
        assert!(!dir.path().join("t").exists());
        write(b"old").commit().unwrap();
        write(b"new").commit().unwrap();
        assert_eq!(fs::read(dir.path().join("t/b")).unwrap(), b"new!");
        assert_eq!(fs::read_dir(dir.path().join("t")).unwrap().count(), 2);
    }
}
