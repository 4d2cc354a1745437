//! Bags made of chunks, ROS 1 and MCAP alike: one driver over two grammars of records.
//!
//! A [`Grammar`] parses the records of a bag and its tail. The driver reads a file by the index after each chunk, or
//! record by record from the front where that is missing, and always from a pipe.

mod check;
mod chunk;
mod forward;
mod growing;
mod index;
mod plan;
mod record;
mod search;
mod unpack;

use std::collections::BTreeSet;
use std::marker::PhantomData;
use std::path::Path;
use std::sync::Arc;

use crate::bag::adapters::{Clip, GROUP, in_order, share};
use crate::bag::decompress::Compression;
use crate::bag::input::{BagPlace, file_name};
use crate::bag::model::{Connection, OpenOptions, Reader, Report, Sink, Tier, Want, damaged};
use crate::bag::source::{ByteStream, FAR, FileSource};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::rhythm::OUT_OF_ORDER_NS;
use crate::base::time::{Span, Stamp};

pub(crate) use growing::follow;
use index::Query;
pub(crate) use index::{ChunkBody, Index, IndexSum, LONGEST_INDEX};
pub(crate) use plan::{Chunk, ChunkPlan, Fault, Tail, Unindexed};
pub(crate) use record::{
    ChunkHead, Connections, Counts, MessageHead, NoRecord, RecordHead, SecondFinds, pass,
    peek_whole, walk,
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

    /// Rejects input that is not of this format, judging by its first bytes.
    fn accept(path: &Path, head: &[u8]) -> Result<()>;

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

    /// Whether the end of the data may state a checksum of all of it; `None` for a pipe, because its end is not known yet.
    fn is_summed(_source: Option<&FileSource>) -> bool {
        false
    }

    /// Whether the writer ended the bag, also where it wrote no index.
    fn is_ended(_source: &FileSource) -> bool {
        false
    }

    /// Facts from the first bytes, to show in `info`.
    fn facts(head: &[u8]) -> Vec<(String, String)>;

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
pub(crate) fn open<G: Grammar>(place: BagPlace, options: &OpenOptions) -> Result<Box<dyn Reader>> {
    let grammar = PhantomData;
    match place {
        BagPlace::File(source) => {
            let path = source.path().to_owned();
            let mut head = vec![0; HEAD];
            let got = source
                .read_at(0, &mut head)
                .map_err(Error::io("read", &path))?;
            G::accept(&path, &head[..got])?;
            let facts = G::facts(&head[..got]);
            let plan = G::plan(&source).map_err(Error::io("read", &path))?;
            Ok(Box::new(Indexed::<G> {
                source,
                plan,
                facts,
                is_opened: head.starts_with(G::OPENING),
                verify: options.verify,
                grammar,
            }))
        }
        BagPlace::Pipe(name, mut stream) => {
            let path = Path::new(&name);
            let head = stream.peek(HEAD).map_err(Error::io("read", path))?;
            G::accept(path, head)?;
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
            connections: &plan.connections,
            wants,
            range,
            tail: plan.body.end,
            grammar: PhantomData,
        }
    }

    fn by_index(&self, plan: &ChunkPlan, range: Option<Span>, sink: &mut Clip<'_>) -> Report {
        let connections = plan.connections.list().iter();
        let mut wants: Vec<Want> = connections.map(|c| sink.connection(c)).collect();
        Want::resolve(&mut wants);
        let chunks = plan.within(range);
        let query = self.query(plan, &wants, range);
        let groups: Vec<&[&Chunk]> = chunks.chunks(GROUP).collect();
        let work = |at: usize, sink: &mut dyn Sink| {
            groups[at].iter().for_each(|chunk| query.read(chunk, sink));
        };
        let whole = self.source.len();
        let threads = threads(chunks.len(), plan.longest_index());
        in_order(groups.len(), threads, &work, sink, |at, sink| {
            sink.progress(share(at + 1, groups.len(), whole), whole);
        });
        let samples = BTreeSet::from([0, chunks.len() / 2, chunks.len().saturating_sub(1)]);
        let samples = samples.into_iter().filter_map(|at| chunks.get(at));
        let compression = samples
            .filter_map(|c| Some(query.body(c).ok()??.how))
            .collect();
        Report {
            complete: !sink.lost,
            ..self.report(Tier::Index, &compression)
        }
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
            complete: !sink.lost,
            tier_reason: Some(reason.why.clone()),
            ..self.report(Tier::Forward, &compression)
        }
    }

    /// Reads everything with the independent reader; if that fails, reads from the front with ours, which uses no
    /// index and verifies nothing if there was none.
    fn by_the_second_reader(&self, sink: &mut Clip<'_>) -> Report {
        let verified = G::verify(&self.source, &self.plan, sink);
        let Some(why) = verified.stopped else {
            return Report {
                complete: !sink.lost,
                ..self.report(Tier::Verify, &verified.compression)
            };
        };
        if !verified.refused {
            return Report {
                complete: false,
                tier_reason: Some(format!("the second reader stopped: {why}")),
                ..self.report(Tier::Verify, &verified.compression)
            };
        }
        let compression = self.forward(sink);
        Report {
            // Without an index, the first reading did the same.
            complete: !sink.lost && self.plan.is_ok(),
            tier_reason: Some(format!(
                "the second reader cannot read it ({why}); read from the front instead"
            )),
            ..self.report(Tier::Verify, &compression)
        }
    }

    fn forward(&self, sink: &mut dyn Sink) -> BTreeSet<Compression> {
        let mut stream = ByteStream::of_file(&self.source, 0, self.source.len(), FAR);
        // Reading bytes that could be skipped pays off only if no damage is known yet.
        let is_sound = matches!(&self.plan, Err(reason) if reason.fault == Fault::Missing);
        if is_sound && G::is_summed(Some(&self.source)) {
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
        if G::is_summed(None) {
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
