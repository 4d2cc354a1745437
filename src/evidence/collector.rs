//! A collector of any number of bags: the times of all messages, and the observations in their contents.
//!
//! In: bags, through a [`BagSink`] each. Out: [`Recorded`], everything that they contain about the graph.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::sync::Arc;

use crate::bag::straight::ClockFall;
use crate::bag::{Connection, ConnectionId, Message, Sink, Want};
use crate::base::error::{Error, Result};
use crate::base::ids::ById;
use crate::base::name::{in_space, is_log, plain_type};
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::time::{Span, Stamp};
use crate::evidence::clock::{self, Belief, ClockOffset, believed, offsets};
use crate::evidence::inference::{Reliability, Stream};
use crate::evidence::message::cursor::PayloadCursor;
use crate::evidence::message::dynamic::MessageSchema;
use crate::evidence::numbers::{Numbers, is_numbered};
use crate::evidence::observation::{Observations, SourceId};
use crate::evidence::source::equal_stamps::{self, FirstHeader};
use crate::evidence::source::{self, Read, SourceContext, echo, payload, sim_time};
use crate::evidence::times::Stamps;
use crate::evidence::{publishers, source_id};

/// Options for reading.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CollectOptions {
    /// Whether to determine every payload's size, even if that means reading more than the index.
    pub sizes: bool,
    /// The names to keep every piece of evidence for: elements with all of these names (one: a node or topic; two: an
    /// edge).
    pub why: Vec<String>,
    /// Whether to infer subscriptions from header stamps that nodes copy; reads the first bytes of every
    /// message.
    pub infer_stamps: bool,
    /// The number of payload bytes to compare with each other and with log texts, from the beginnings of
    /// payloads; 0: none, and no payload is read for this. [`u64::MAX`]: all, even in bags whose payloads are
    /// not read otherwise.
    pub payload_bytes: u64,
}

impl CollectOptions {
    /// Whether payloads are compared even if they are read for nothing else.
    fn compares_all(&self) -> bool {
        self.payload_bytes == u64::MAX
    }

    /// The wanted part of a connection's payloads, which are read whole or for their stamps.
    fn want(&self, is_read: bool, stamped: bool) -> Want {
        let compared = self.payload_bytes > 0;
        match (is_read, stamped, self.sizes) {
            (true, ..) => Want::Payload,
            _ if compared && (self.sizes || stamped || self.compares_all()) => {
                Want::Head(payload::HEAD)
            }
            _ if compared => Want::Beside(payload::HEAD),
            (false, true, _) => Want::Head(equal_stamps::HEAD),
            (false, false, true) => Want::Sizes,
            (false, false, false) => Want::Stamps,
        }
    }
}

impl Default for CollectOptions {
    fn default() -> Self {
        Self {
            sizes: false,
            why: Vec::new(),
            infer_stamps: false,
            payload_bytes: PAYLOAD_BYTES,
        }
    }
}

/// The default number of payload bytes that are compared, of all topics together: at most the first 16 KiB of
/// each message, plus 64 bytes per message. This is a tenth of a second of work, at most a fifth of the
/// total, and enough for an hour of a small robot without cameras. Bags that are larger on disk are not
/// compared unless requested: most of them are read by their index, an advantage that would be lost if every
/// payload were read.
pub const PAYLOAD_BYTES: u64 = 64 << 20;
/// The cost of a payload besides its bytes, in bytes: its hash is kept, in a table and with its time.
const PAYLOAD_ENTRY: u64 = 64;

/// How the messages of a stream are read.
#[derive(Debug)]
struct StreamLayout {
    /// The sources that read them.
    readers: Vec<(SourceId, Read)>,
    /// Whether their headers begin with a number.
    is_numbered: bool,
    /// Whether their payloads are compared: `/clock` is no copy of anything.
    is_compared: bool,
    /// Their first header, whose stamp is their age.
    header: Option<FirstHeader>,
    /// The schema for parsing them, if they contain words or numbers that are compared.
    schema: Option<Arc<MessageSchema>>,
}

/// A collector of bags, one after another.
#[derive(Debug, Default)]
pub struct Collector {
    options: CollectOptions,
    streams: Vec<Stream>,
    /// How the messages of each stream are read.
    layouts: Vec<StreamLayout>,
    /// The schemas of all types and definitions.
    schemas: BTreeMap<[Arc<str>; 2], Arc<MessageSchema>>,
    /// The numbers in the headers of streams that have any, by index.
    numbers: ById<usize, Option<Numbers>>,
    /// The number of payload bytes compared so far.
    compared: u64,
    messages: Stamps,
    facts: Observations,
    notices: Notices,
    /// The stream of each connection of each bag.
    bags: Vec<Vec<usize>>,
    /// The namespace of the names in the last bag.
    space: String,
    /// The bags whose payloads are read for more than comparisons.
    read: BTreeSet<usize>,
}

impl Collector {
    /// An empty collector.
    pub fn new(options: CollectOptions) -> Self {
        let mut all = Self::default();
        all.facts.watched.clone_from(&options.why);
        all.options = options;
        all
    }

    /// The sink for the next bag; `progress` receives the reader's progress (bytes done, total bytes).
    pub fn bag<'a>(&'a mut self, progress: &'a mut dyn FnMut(u64, u64)) -> BagSink<'a> {
        self.bag_in("", progress)
    }

    /// As [`Collector::bag`], with all names of nodes and topics in a namespace; empty for none.
    pub(crate) fn bag_in<'a>(
        &'a mut self,
        space: &str,
        progress: &'a mut dyn FnMut(u64, u64),
    ) -> BagSink<'a> {
        self.bags.push(Vec::new());
        self.facts.spaces.insert(space.to_owned());
        space.clone_into(&mut self.space);
        self.on(progress)
    }

    /// The sink for more of the last bag.
    pub(crate) fn on<'a>(&'a mut self, progress: &'a mut dyn FnMut(u64, u64)) -> BagSink<'a> {
        BagSink {
            bag: self.bags.len().saturating_sub(1),
            collector: self,
            progress,
        }
    }

    /// Everything collected so far, with the times of messages from about `from` on. Collecting may continue
    /// afterwards.
    ///
    /// # Errors
    /// As [`Collector::finish`].
    pub(crate) fn so_far(&self, from: Stamp) -> Result<Recorded> {
        let copy = Self {
            options: self.options.clone(),
            streams: self.streams.clone(),
            numbers: self.numbers.clone(),
            messages: self.messages.since(from).map_err(spool_error)?,
            facts: self.facts.copy().map_err(spool_error)?,
            notices: self.notices.clone(),
            read: self.read.clone(),
            ..Self::default()
        };
        copy.finish()
    }

    /// Forgets the times of messages before about `from`.
    ///
    /// # Errors
    /// As [`Collector::finish`].
    pub(crate) fn forget(&mut self, from: Stamp) -> Result<()> {
        self.messages = self.messages.since(from).map_err(spool_error)?;
        Ok(())
    }

    /// The times of the first and the last message that are kept, and the number of messages; `None` if there is none.
    pub(crate) fn extent(&self) -> Option<(Stamp, Stamp, u64)> {
        self.messages.extent()
    }

    /// The number of connections and observations: it grows with every new fact.
    pub(crate) fn known(&self) -> usize {
        self.streams.len() + self.facts.list.len()
    }

    /// The schema of a connection's definition, which is parsed once for all connections of its type.
    fn schema(&mut self, connection: &Connection) -> Arc<MessageSchema> {
        let definition = connection.definition.clone().unwrap_or_default();
        let type_name = Arc::clone(&connection.type_name);
        let known = self.schemas.entry([type_name, definition]);
        let schema = known.or_insert_with(|| Arc::new(MessageSchema::of(connection)));
        Arc::clone(schema)
    }

    /// Passes a message to the sources that know its layout.
    fn read(&mut self, place: usize, message: &Message<'_>) {
        if let Some(Some(numbers)) = self.numbers.get_mut(place) {
            numbers.add(message.time, message.data);
        }
        let layout = &self.layouts[place];
        let mut context = SourceContext {
            facts: &mut self.facts,
            space: &self.space,
            stream: &self.streams[place],
            place,
            source: 0,
            time: Some(message.time),
        };
        if self.numbers.some(place).is_some() {
            sim_time::stamped(&mut context, message.data);
        }
        if let Some(header) = layout.header
            && self.options.infer_stamps
        {
            equal_stamps::collect(&mut context, header, message.data);
        }
        // Payloads are compared as long as the budget lasts.
        let beginning = message.data.get(..payload::HEAD).unwrap_or(message.data);
        let cost = beginning.len() as u64 + PAYLOAD_ENTRY;
        let cost = if layout.is_compared { cost } else { 0 };
        self.compared = self.compared.saturating_add(cost);
        if layout.is_compared && self.compared <= self.options.payload_bytes {
            // The number in the header is set by the publisher, even in a copy.
            let is_numbered = self.numbers.some(place).is_some();
            let own = beginning.get(if is_numbered { 4 } else { 0 }..);
            payload::collect(&mut context, own.unwrap_or_default(), message.size);
            if let Some(header) = layout.header {
                equal_stamps::age(&mut context, header, beginning);
            }
            if let Some(schema) = &layout.schema
                && beginning.len() == message.size as usize
            {
                echo::keep(&mut context, schema, beginning);
            }
        }
        for (source, read) in &layout.readers {
            context.source = *source;
            let done = PayloadCursor::new(&context.stream.connection.encoding, message.data)
                .map(|payload| payload.numbered(layout.is_numbered))
                .and_then(|mut payload| read.read(&mut context, &mut payload));
            if done.is_err() {
                let why = "some messages do not have its layout";
                self.notices.add(undecodable(context.stream, why));
            }
        }
    }

    /// Drops the payloads of bags that were not read otherwise. If such a bag has an index, none was
    /// compared, and the evidence of a bag must not depend on the way in which it is read.
    fn forget_payloads(&mut self) {
        if !self.options.compares_all() {
            let (streams, read) = (&self.streams, &self.read);
            let facts = &mut self.facts;
            for kept in [&mut facts.payloads, &mut facts.ages] {
                for (series, stream) in kept.iter_mut().zip(streams) {
                    *series = series.filter(|_| read.contains(&stream.bag));
                }
            }
        }
    }

    /// Finishes collecting.
    ///
    /// # Errors
    /// If times had to be written to a temporary file and that failed.
    pub fn finish(mut self) -> Result<Recorded> {
        self.forget_payloads();
        self.messages.finish().map_err(spool_error)?;
        self.facts.finish().map_err(spool_error)?;
        let mut all = Recorded {
            streams: self.streams,
            messages: self.messages,
            numbers: self.numbers,
            facts: self.facts,
            notices: self.notices,
            ..Recorded::default()
        };
        all.judge().map_err(spool_error)?;
        Ok(all)
    }
}

/// Whether the last message keeps its meaning after its time (latched). The logs of rospy and ROS 2 are
/// latched too, but their last record is not evidence of the time at which the node ended.
fn is_held(connection: &Connection) -> bool {
    let qos = connection.qos.as_deref().unwrap_or_default();
    let kept = connection.latching || source::connection::is_transient_local(qos);
    kept && !is_log(connection.topic.as_str())
}

/// A notice that a stream, or a message of it, has another layout than its type implies.
fn undecodable(stream: &Stream, why: &str) -> Notice {
    let (topic, kind) = (&stream.connection.topic, &stream.connection.type_name);
    Notice::new(
        NoticeKind::Undecodable,
        format!("`{topic}` of type `{kind}` was not read for evidence: {why}"),
    )
}

/// The error for the temporary file of times, which could not be written or read.
pub(crate) fn spool_error(source: io::Error) -> Error {
    Error::Io {
        path: "a temporary file".into(),
        doing: "use",
        source,
    }
}

/// A sink that feeds one bag into a [`Collector`].
pub struct BagSink<'a> {
    collector: &'a mut Collector,
    progress: &'a mut dyn FnMut(u64, u64),
    bag: usize,
}

impl BagSink<'_> {
    fn stream(&self, connection: ConnectionId) -> Option<usize> {
        let streams = self.collector.bags.get(self.bag)?;
        streams.get(connection.0 as usize).copied()
    }
}

impl Sink for BagSink<'_> {
    fn connection(&mut self, connection: &Connection) -> Want {
        let all = &mut *self.collector;
        let topic = in_space(&all.space, connection.topic.as_str());
        let publisher = connection.publisher.as_ref();
        let publisher = publisher.map(|p| in_space(&all.space, p.as_str()));
        let stream = Stream {
            bag: self.bag,
            connection: connection.clone(),
            topic: all.facts.name(&topic),
            publisher: publisher.map(|p| all.facts.name(&p)),
            latched: is_held(connection),
            trust: Reliability::Whole,
            is_outside: false,
            times: all.messages.series_of(self.bag),
        };
        let schema = all.schema(connection);
        let (mut readers, foreign) = source::readers(&stream, &schema);
        // It repeats the records of `/rosout` up to half a minute later, so that lists of topics would be out
        // of order.
        let own = all.bags.get(self.bag).into_iter().flatten();
        let of = |name: &str| {
            let streams = own.clone().copied();
            let of = streams.filter(|at| all.streams[*at].connection.topic.as_str() == name);
            of.collect::<Vec<usize>>()
        };
        match connection.topic.as_str() {
            "/rosout_agg" if !of("/rosout").is_empty() => readers.clear(),
            "/rosout" => of("/rosout_agg")
                .into_iter()
                .for_each(|at| all.layouts[at].readers.clear()),
            _ => {}
        }
        if foreign {
            let why = "its definition is not the known one";
            all.notices.add(undecodable(&stream, why));
        }
        let header = equal_stamps::first_header(connection, &schema);
        let stamped = all.options.infer_stamps && header.is_some();
        let compared = all.options.payload_bytes > 0;
        let want = all.options.want(!readers.is_empty(), stamped);
        if want == Want::Payload || stamped {
            all.read.insert(self.bag);
        }
        if is_numbered(connection, &schema) {
            *all.numbers.grown(all.streams.len()) = Some(Numbers::default());
        }
        if let Some(streams) = all.bags.get_mut(self.bag) {
            streams.push(all.streams.len());
        }
        source::connection::announced(&mut SourceContext {
            facts: &mut all.facts,
            space: &all.space,
            stream: &stream,
            place: all.streams.len(),
            source: source_id("qos"),
            time: None,
        });
        all.streams.push(stream);
        all.layouts.push(StreamLayout {
            readers,
            is_numbered: schema.numbers_headers(&connection.encoding),
            is_compared: plain_type(&connection.type_name) != sim_time::CLOCK.type_name,
            header,
            schema: echo::schema(&connection.type_name, &schema).filter(|_| compared),
        });
        want
    }

    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        if let Some(stream) = self.stream(connection) {
            let times = self.collector.streams[stream].times;
            self.collector.messages.add(times, stamps, sizes);
        }
    }

    fn message(&mut self, message: Message<'_>) {
        if let Some(stream) = self.stream(message.connection) {
            self.collector.read(stream, &message);
        }
    }

    fn notice(&mut self, notice: Notice) {
        self.collector.notices.add(notice);
    }

    fn progress(&mut self, done: u64, total: u64) {
        (self.progress)(done, total);
    }
}

/// Everything that the bags of a mission contain about its graph.
#[derive(Debug, Default)]
pub struct Recorded {
    pub(crate) streams: Vec<Stream>,
    pub(crate) messages: Stamps,
    /// The bags of each recording, if that is known from messages that were left out since.
    pub(crate) parts: Vec<Vec<usize>>,
    /// The numbers in the headers of streams, by index, as far as they were read.
    pub(crate) numbers: ById<usize, Option<Numbers>>,
    pub(crate) facts: Observations,
    /// Problems that did not stop the reading.
    pub notices: Notices,
    /// The points at which a recorder's clock went back, sorted by time.
    pub(crate) falls: Vec<ClockFall>,
    /// Whether runs overlap in time, since they could not be shifted.
    pub(crate) overlaps: bool,
    /// The differences between the clocks of several recorders.
    pub(crate) offsets: Vec<ClockOffset>,
    /// The time from the first log time to the last plus 1 ns, without messages at impossible times; `None` if there is
    /// no message.
    pub span: Option<Span>,
}

impl Recorded {
    /// Judges the times and the names of publishers, once everything is collected.
    fn judge(&mut self) -> io::Result<()> {
        let belief = believed(self.messages.calendars());
        let jumps = belief.jumps.iter();
        let jumps = jumps.map(|text| Notice::new(NoticeKind::Note, text));
        self.notices.extend(jumps);
        // What is set aside may show by how much clocks differ.
        self.offsets = offsets(&self.streams, &self.facts)?;
        self.set_aside(&belief)?;
        source::rosout::interpret_lists(&mut self.facts);
        let (streams, facts) = (&mut self.streams, &mut self.facts);
        let judged = publishers::judge(streams, facts, &mut self.messages, &self.numbers)?;
        self.notices.extend(judged);
        if self.facts.dropped > 0 {
            let text = "there are implausibly many or long names: an observation was left out";
            let dropped = self.facts.dropped;
            let notice = Notice::counted(NoticeKind::Damaged, dropped, text);
            self.notices.add(notice);
        }
        self.facts.seal();
        self.span = self.measure();
        Ok(())
    }

    /// Removes the messages at incredible times, and notes the offsets of other clocks so that their first messages are
    /// together.
    fn set_aside(&mut self, belief: &Belief) -> io::Result<()> {
        let Some(span) = belief.span else {
            return Ok(());
        };
        let before = self.firsts();
        let aside = self.clip(span)?;
        let aside = clock::set_aside(self.messages.calendars(), span, aside);
        self.notices.extend(aside);
        let firsts = self.firsts();
        let kept = firsts.somes().min_by_key(|(_, first)| **first);
        let offset = |bag: &usize| {
            let ((other, start), first) = kept.zip(before.some(*bag))?;
            Some(ClockOffset {
                bag: *bag,
                other,
                ahead: first.since(*start),
                messages: 0,
                is_one_robot: false,
            })
        };
        self.offsets.extend(belief.others.iter().filter_map(offset));
        Ok(())
    }

    /// Removes the messages at other times than these, and everything that they state: they prove nothing. Returns their
    /// number.
    fn clip(&mut self, span: Span) -> io::Result<u64> {
        let mut removed = 0;
        for stream in &self.streams {
            removed += self.messages.clip(stream.times, span)?;
        }
        self.facts.clip(span)?;
        for (series, stream) in self.facts.headers.iter_mut().zip(&self.streams) {
            *series = series.filter(|_| self.messages.count(stream.times) > 0);
        }
        for own in self.numbers.iter_mut().flatten() {
            own.clip(span);
        }
        Ok(removed)
    }

    /// Keeps a part of the recording, from its beginning on (`is_first`) or not, and marks the streams without a message in it.
    ///
    /// # Errors
    /// If the temporary file of times cannot be read or written.
    pub(crate) fn cut(&mut self, part: Span, is_first: bool) -> Result<()> {
        self.clip(part).map_err(spool_error)?;
        // In a part from the beginning on, those without a message have no latched one yet.
        for stream in &mut self.streams {
            stream.is_outside = self.messages.bounds(stream.times).is_none();
            stream.latched &= !(stream.is_outside && is_first);
        }
        self.span = self.measure();
        Ok(())
    }

    /// The time of the first message of each bag with messages.
    pub(crate) fn firsts(&self) -> ById<usize, Option<Stamp>> {
        let mut firsts = ById::default();
        for stream in &self.streams {
            if let Some((first, _)) = self.messages.bounds(stream.times) {
                let own: &mut Option<Stamp> = firsts.grown(stream.bag);
                *own = Some(own.map_or(first, |own| first.min(own)));
            }
        }
        firsts
    }

    /// The span of all messages.
    fn measure(&self) -> Option<Span> {
        let bounds = self.streams.iter();
        let bounds = bounds.filter_map(|stream| self.messages.bounds(stream.times));
        let (first, last) = bounds.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
        Some(Span::new(first, last.plus(1)))
    }
}

#[cfg(test)]
mod tests;
