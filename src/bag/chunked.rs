//! Bags made of chunks, ROS 1 and MCAP alike: one driver over two grammars of records.
//!
//! A [`Grammar`] parses the records of a bag and its tail. The driver reads a file by the index after each chunk, or
//! record by record from the front where that is missing, and always from a pipe.

mod forward;
mod index;
mod record;

use std::collections::BTreeSet;
use std::marker::PhantomData;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use index::Query;

use crate::bag::adapters::{Bounds, Clip, GROUP, in_order};
use crate::bag::decompress::Compression;
use crate::bag::input::{BagPlace, file_name, head};
use crate::bag::model::{Connection, OpenOptions, Reader, Report, Sink, Tier, Want, damaged};
use crate::bag::source::{ByteStream, FAR, FileSource};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::rhythm::OUT_OF_ORDER_NS;
use crate::base::time::{Span, Stamp};

pub(crate) use forward::follow;
pub(crate) use index::{ChunkBody, Index, IndexSum, LONGEST_INDEX};
pub(crate) use record::{
    ChunkHead, Connections, Counts, MessageHead, NoRecord, RecordHead, RecordKind, SecondFinds,
    pass, peek_whole, walk,
};

/// The parser for one format of chunked bags. A value keeps the state that later descriptions depend on.
pub(crate) trait Grammar: Default + Send + 'static {
    /// The format's name in JSON.
    const NAME: &'static str;
    /// Whether a bag ends in a special last record.
    const HAS_END: bool;
    /// Whether messages may also be outside chunks.
    const IS_LOOSE: bool;
    /// The first bytes of a bag.
    const OPENING: &'static [u8];
    /// The bytes after that record.
    const CLOSING: &'static [u8];
    /// The head of a description record.
    type Description;

    /// Rejects input that is not of this format, judging by its first bytes; returns the facts that they state, to show in
    /// `info`.
    fn accept(path: &Path, head: &[u8]) -> Result<Vec<(String, String)>>;

    /// Goes to the first record.
    fn begin(stream: &mut ByteStream<'_>);

    /// Takes the head of the next record.
    fn next(stream: &mut ByteStream<'_>) -> Result<RecordHead<Self::Description>, NoRecord>;

    /// The connection that a description announces, with its number in the bag; `None` if there is none or it is
    /// known already.
    ///
    /// # Errors
    /// If lengths inside it exceed it.
    fn describe(
        &mut self,
        what: &Self::Description,
        data: &[u8],
        known: &Connections,
    ) -> Result<Option<(u32, Connection)>, NoRecord>;

    /// Whether a chunk begins here. Called at every byte after a broken record.
    fn is_chunk(bytes: &[u8]) -> bool;

    /// Whether a message or a description begins here, which another record or the end of the bytes follows. Called at every
    /// byte after a broken record.
    fn is_content(bytes: &[u8]) -> bool;

    /// The index records in `bytes`, if they add up to `promised`.
    fn index(bytes: &[u8], promised: &IndexSum) -> Option<Index>;

    /// The times in the data of one index record.
    fn index_stamps(data: &[u8]) -> Vec<Stamp>;

    /// Reads the tail.
    fn plan(source: &FileSource) -> std::io::Result<Result<ChunkPlan, Unindexed>>;

    /// The checksum of all data as stated at its end, 0 for none; `None` if the writer did not end the bag, which it may do without
    /// an index.
    fn stated_sum(_source: &FileSource) -> Option<u32> {
        None
    }

    /// Reports everything that an independent reader finds to `sink`.
    fn verify(
        source: &FileSource,
        plan: &Result<ChunkPlan, Unindexed>,
        sink: &mut dyn Sink,
    ) -> SecondReading;
}

/// The result of the second, independent reader.
#[derive(Default)]
pub(crate) struct SecondReading {
    pub(crate) compression: BTreeSet<Compression>,
    /// The reason why it did not reach the end, if so.
    pub(crate) stopped: Option<String>,
    /// Whether it reported nothing at all.
    pub(crate) refused: bool,
}

/// A bag in a file, with its tail if that is reliable.
struct Indexed<G> {
    source: FileSource,
    plan: Result<ChunkPlan, Unindexed>,
    facts: Vec<(String, String)>,
    /// Whether its first bytes are those of a bag.
    is_opened: bool,
    verify: bool,
    grammar: PhantomData<fn() -> G>,
}

/// A bag from a pipe.
struct Piped<G> {
    name: String,
    stream: ByteStream<'static>,
    grammar: PhantomData<fn() -> G>,
}

/// The number of first bytes that decide whether the format can be read: the head of a ROS 1 bag.
const HEAD: usize = 4096;

/// Opens a bag of this grammar.
pub(crate) fn open<G: Grammar>(
    mut place: BagPlace,
    options: &OpenOptions,
) -> Result<Box<dyn Reader>> {
    let grammar = PhantomData;
    let head = head(&mut place, HEAD)?;
    match place {
        BagPlace::File(source) => {
            let facts = G::accept(source.path(), &head)?;
            let plan = G::plan(&source).map_err(Error::io("read", source.path()))?;
            Ok(Box::new(Indexed::<G> {
                source,
                plan,
                facts,
                is_opened: head.starts_with(G::OPENING),
                verify: options.verify,
                grammar,
            }))
        }
        BagPlace::Pipe(name, stream) => {
            G::accept(Path::new(&name), &head)?;
            Ok(Box::new(Piped::<G> {
                name,
                stream,
                grammar,
            }))
        }
        BagPlace::Folder(path) => Err(super::explain(&path, &[], true)),
    }
}

impl<G: Grammar> Reader for Indexed<G> {
    fn is_straight(&self) -> bool {
        let plan = self.plan.as_ref().ok();
        let mut pairs = plan.iter().flat_map(|plan| plan.chunks.windows(2));
        !pairs.any(|pair| pair[0].last.since(pair[1].first) > OUT_OF_ORDER_NS)
    }

    fn stated(&self) -> Option<Span> {
        let chunks = self.plan.iter().flat_map(|plan| &plan.chunks);
        let full = chunks.filter(|chunk| chunk.holds_messages());
        full.filter_map(Chunk::stated)
            .reduce(|all, span| all.hull(span))
    }

    fn span(&mut self) -> Result<Option<Span>> {
        let Ok(plan) = &self.plan else {
            return Ok(None);
        };
        let wants = vec![Want::Stamps; plan.connections.list().len()];
        let query = self.query(plan, &wants, None);
        let spans = plan.spans(|chunk, sink| query.read(chunk, sink));
        let mut whole: Option<Span> = None;
        for (at, span) in spans {
            whole = Some(whole.map_or(span, |whole| whole.hull(span)));
            if let Ok(plan) = &mut self.plan {
                plan.chunks[at].seen = Some(span);
            }
        }
        Ok(whole)
    }

    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report> {
        // Stated times of chunks may be wrong.
        let mut chunks = self.plan.iter().flat_map(|plan| &plan.chunks);
        if range.is_some() && chunks.all(|chunk| chunk.seen.is_none()) {
            self.span()?;
        }
        let mut sink = Clip::new(range, sink);
        opened(self.is_opened, &mut sink);
        let report = match &self.plan {
            _ if self.verify => self.by_the_second_reader(&mut sink),
            Ok(plan) => self.by_index(plan, range, &mut sink),
            Err(reason) => self.front_to_back(reason, &mut sink),
        };
        Ok(Report {
            complete: report.complete && !sink.lost,
            bytes_read: self.source.bytes_read(),
            file_bytes: self.source.len(),
            facts: self.facts.clone(),
            ..report
        })
    }
}

impl<G: Grammar> Indexed<G> {
    fn query<'a>(
        &'a self,
        plan: &'a ChunkPlan,
        wants: &'a [Want],
        range: Option<Span>,
    ) -> Query<'a, G> {
        Query {
            source: &self.source,
            allowance: Arc::default(),
            plan,
            wants,
            range,
            grammar: PhantomData,
        }
    }

    fn by_index(&self, plan: &ChunkPlan, range: Option<Span>, sink: &mut Clip<'_>) -> Report {
        let connections = plan.connections.list().iter();
        let mut wants: Vec<Want> = connections.map(|c| sink.connection(c)).collect();
        Want::resolve(&mut wants);
        let reaches = |chunk: &&Chunk| range.is_none_or(|range| chunk.reaches(range));
        let chunks: Vec<&Chunk> = plan.chunks.iter().filter(reaches).collect();
        let query = self.query(plan, &wants, range);
        let groups: Vec<&[&Chunk]> = chunks.chunks(GROUP).collect();
        let work = |at: usize, sink: &mut dyn Sink| {
            groups[at].iter().for_each(|chunk| query.read(chunk, sink));
        };
        let threads = threads(chunks.len(), plan.longest_index());
        in_order(groups.len(), threads, &work, sink, self.source.len());
        let samples = BTreeSet::from([0, chunks.len() / 2, chunks.len().saturating_sub(1)]);
        let samples = samples.into_iter().filter_map(|at| chunks.get(at));
        let compression = samples
            .filter_map(|c| Some(query.body(c.start, c.end).ok()??.how))
            .collect();
        self.report(Tier::Index, &compression)
    }

    fn front_to_back(&self, reason: &Unindexed, sink: &mut Clip<'_>) -> Report {
        let text = format!("read from the front, since {}", reason.why);
        let is_wrong = reason.fault == Fault::Wrong;
        let kind = if is_wrong {
            NoticeKind::Damaged
        } else {
            NoticeKind::Downgraded
        };
        sink.notice(Notice::new(kind, text));
        let compression = self.forward(sink);
        if reason.fault == Fault::Cut && !sink.is_cut {
            // Cut exactly between records, so only the head reveals it.
            let text = "the end of the bag is missing";
            sink.notice(Notice::new(NoticeKind::Truncated, text));
        }
        Report {
            tier_reason: Some(reason.why.clone()),
            ..self.report(Tier::Forward, &compression)
        }
    }

    /// Reads everything with the independent reader; if that fails, reads from the front with ours, which uses no
    /// index and verifies nothing if there was none.
    fn by_the_second_reader(&self, sink: &mut Clip<'_>) -> Report {
        let verified = G::verify(&self.source, &self.plan, sink);
        let stopped = verified.stopped;
        if let Some(why) = stopped.as_ref().filter(|_| verified.refused) {
            let why =
                format!("the second reader cannot read it ({why}); read from the front instead");
            return Report {
                // Without an index, the first reading did the same.
                complete: self.plan.is_ok(),
                tier_reason: Some(why),
                ..self.report(Tier::Verify, &self.forward(sink))
            };
        }
        Report {
            complete: stopped.is_none(),
            tier_reason: stopped.map(|why| format!("the second reader stopped: {why}")),
            ..self.report(Tier::Verify, &verified.compression)
        }
    }

    fn forward(&self, sink: &mut dyn Sink) -> BTreeSet<Compression> {
        let mut stream = ByteStream::of_file(&self.source, 0, self.source.len(), FAR);
        // Reading bytes that could be skipped pays off only if no damage is known yet.
        let is_sound = matches!(&self.plan, Err(reason) if reason.fault == Fault::Missing);
        if is_sound && G::HAS_END && G::stated_sum(&self.source) != Some(0) {
            stream.sum_up();
        }
        G::begin(&mut stream);
        forward::read::<G>(&mut stream, self.source.len(), sink)
    }

    fn report(&self, tier: Tier, compression: &BTreeSet<Compression>) -> Report {
        report::<G>(file_name(self.source.path()), tier, compression)
    }
}

/// Reports that the first bytes of a bag are damaged.
fn opened(is_opened: bool, sink: &mut dyn Sink) {
    let text = "its first bytes are not those of a bag";
    damaged(sink, u64::from(!is_opened), text);
}

/// Whether a chunk begins near the beginning of these bytes, of a bag whose first bytes are damaged.
pub(crate) fn has_chunk<G: Grammar>(bytes: &[u8]) -> bool {
    (0..bytes.len()).any(|at| G::is_chunk(&bytes[at..]))
}

/// A report with the values common to all tiers.
fn report<G: Grammar>(name: String, tier: Tier, compression: &BTreeSet<Compression>) -> Report {
    Report {
        name,
        format: G::NAME.to_owned(),
        compression: compression.iter().map(|c| c.word().to_owned()).collect(),
        tier,
        complete: true,
        ..Report::default()
    }
}

impl<G: Grammar> Reader for Piped<G> {
    fn span(&mut self) -> Result<Option<Span>> {
        Ok(None)
    }

    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report> {
        // Whether its end states a checksum is not known yet.
        if G::HAS_END {
            self.stream.sum_up();
        }
        let head = self.stream.peek(G::OPENING.len());
        let is_opened = head.is_ok_and(|head| head == G::OPENING);
        let mut sink = Clip::new(range, sink);
        opened(is_opened, &mut sink);
        G::begin(&mut self.stream);
        let compression = forward::read::<G>(&mut self.stream, 0, &mut sink);
        Ok(Report {
            complete: !sink.lost,
            tier_reason: Some("a pipe has no index".to_owned()),
            bytes_read: self.stream.position(),
            ..report::<G>(self.name.clone(), Tier::Forward, &compression)
        })
    }
}

/// The number of threads to use for `chunks` chunks whose longest index takes `index` bytes: reads wait for the
/// disk, and a long index takes memory.
fn threads(chunks: usize, index: u64) -> usize {
    if index > LONGEST_INDEX / 16 {
        return 1;
    }
    (chunks / 256).clamp(1, 8)
}

// The tail of a bag: its connections and chunks, and whether they are reliable.

/// A chunk as the tail describes it. Sums of its numbers do not overflow.
#[derive(Clone, Debug)]
pub(crate) struct Chunk {
    /// The position of its record.
    pub(crate) start: u64,
    /// The expected position of its index.
    pub(crate) index: Range<u64>,
    /// The latest possible end of its index.
    pub(crate) end: u64,
    /// The times of its first and last message, as stated.
    pub(crate) first: Stamp,
    pub(crate) last: Stamp,
    /// The expected sum of its index; `None` if it has none.
    pub(crate) promised: Option<IndexSum>,
    /// The time that its messages cover, if it was inspected.
    pub(crate) seen: Option<Span>,
}

impl Chunk {
    fn holds_messages(&self) -> bool {
        self.promised.is_some_and(|sum| sum.messages > 0)
    }

    /// The time that it covers, as stated.
    fn stated(&self) -> Option<Span> {
        (self.first <= self.last).then(|| Span::new(self.first, self.last.plus(1)))
    }

    /// Whether it may contain messages inside `range`.
    fn reaches(&self, range: Span) -> bool {
        let span = self.seen.or_else(|| self.stated());
        span.is_none_or(|span| span.start < range.end && range.start < span.end)
    }
}

/// The contents of the tail.
#[derive(Debug, Default)]
pub(crate) struct ChunkPlan {
    pub(crate) connections: Connections,
    /// The chunks in file order, without duplicates or overlaps.
    pub(crate) chunks: Vec<Chunk>,
    /// The part of the file that contains the chunks.
    pub(crate) body: Range<u64>,
}

/// The most chunks that are planned for: a tail of at most 100 MB in memory, a bag of at least 768 GB.
pub(crate) const MOST_CHUNKS: usize = 1 << 20;

/// The most chunks that are all inspected to determine the covered time.
const MOST_LOOKED_INTO: usize = 512;

impl ChunkPlan {
    /// The number of bytes of the longest index.
    fn longest_index(&self) -> u64 {
        let len = |c: &Chunk| c.index.end - c.index.start;
        self.chunks.iter().map(len).max().unwrap_or(0)
    }

    /// The time that each chunk covers which `read` inspects: the chunks stated to be first and last, or all of them if
    /// they are few or one of these two has other times than stated.
    fn spans(&self, read: impl Fn(&Chunk, &mut dyn Sink)) -> Vec<(usize, Span)> {
        let seen = |(at, chunk): &(usize, &Chunk)| {
            let mut seen = Bounds::default();
            read(chunk, &mut seen);
            Some((*at, seen.0?))
        };
        let full = self.chunks.iter().enumerate();
        let full: Vec<(usize, &Chunk)> = full.filter(|(_, c)| c.holds_messages()).collect();
        if full.len() > MOST_LOOKED_INTO {
            let first = full.iter().min_by_key(|(_, c)| c.first);
            let last = full.iter().max_by_key(|(_, c)| c.last);
            let ends: Vec<_> = first.into_iter().chain(last).filter_map(seen).collect();
            let is_right = |(at, span): &(usize, Span)| self.chunks[*at].stated() == Some(*span);
            if ends.iter().all(is_right) {
                return ends;
            }
        }
        full.iter().filter_map(seen).collect()
    }
}

/// The reason why a bag cannot be read by its index.
#[derive(Clone, Debug)]
pub(crate) struct Unindexed {
    pub(crate) why: String,
    fault: Fault,
}

/// What a missing or wrong index implies about the bag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fault {
    /// No damage: the index was never written.
    Missing,
    /// The head states that the bag was longer.
    Cut,
    /// The index contradicts itself or the bag.
    Wrong,
}

impl Unindexed {
    fn of<T>(fault: Fault, why: impl Into<String>) -> Result<T, Self> {
        let why = why.into();
        Err(Self { why, fault })
    }

    /// An error with this reason: the index is missing.
    pub(crate) fn missing<T>(why: impl Into<String>) -> Result<T, Self> {
        Self::of(Fault::Missing, why)
    }

    /// An error with this reason: the head states that the bag was longer.
    pub(crate) fn cut<T>(why: impl Into<String>) -> Result<T, Self> {
        Self::of(Fault::Cut, why)
    }

    /// An error with this reason: the index contradicts itself or the bag.
    pub(crate) fn wrong<T>(why: impl Into<String>) -> Result<T, Self> {
        Self::of(Fault::Wrong, why)
    }
}

/// The part of a tail that has been read.
#[derive(Default)]
pub(crate) struct Tail<G> {
    pub(crate) plan: ChunkPlan,
    pub(crate) grammar: G,
    /// The numbers of connections that chunks are stated to contain, but that were not described before.
    undescribed: BTreeSet<u32>,
}

impl<G: Grammar> Tail<G> {
    /// Adds the connection that a record describes, if it is a new one.
    ///
    /// # Errors
    /// As [`Grammar::describe`].
    pub(crate) fn describe(&mut self, what: &G::Description, data: &[u8]) -> Result<(), NoRecord> {
        let connections = &mut self.plan.connections;
        if let Some((raw, connection)) = self.grammar.describe(what, data, connections)? {
            connections.add(raw, connection);
        }
        Ok(())
    }

    /// Adds a chunk at byte `start` whose first and last message have these `times`, of which `counts` are the numbers of
    /// messages by connection, `None` if they are not stated. Its index is at the bytes `index`.
    ///
    /// # Errors
    /// If there are too many chunks.
    pub(crate) fn list(
        &mut self,
        (start, index): (u64, Range<u64>),
        (first, last): (Stamp, Stamp),
        counts: Option<Vec<(u32, u32)>>,
    ) -> Result<(), NoRecord> {
        if self.plan.chunks.len() >= MOST_CHUNKS {
            return Err(NoRecord::Broken);
        }
        let promised = counts.map(|counts| {
            let mut sum = IndexSum::default();
            for (raw, count) in counts {
                sum.add(raw, count);
                if count > 0 && self.plan.connections.get(raw).is_none() {
                    self.undescribed.insert(raw);
                }
            }
            sum
        });
        self.plan.chunks.push(Chunk {
            start,
            end: index.end,
            index,
            first,
            last,
            promised,
            seen: None,
        });
        Ok(())
    }

    /// Puts the chunks into the order of the file, each once.
    pub(crate) fn sort(&mut self) {
        self.plan.chunks.sort_by_key(|chunk| chunk.start);
        self.plan.chunks.dedup_by_key(|chunk| chunk.start);
    }

    /// Checks that all connections are described of which chunks are stated to contain messages. If not, the chunks themselves
    /// may describe the others.
    pub(crate) fn is_described(&self) -> Result<(), Unindexed> {
        let mut numbers = self.undescribed.iter();
        if numbers.all(|raw| self.plan.connections.get(*raw).is_some()) {
            return Ok(());
        }
        Unindexed::wrong("its index counts messages of undescribed connections")
    }
}
