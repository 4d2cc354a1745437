//! A collector of any number of bags: the times of all messages, and the observations in their contents.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::sync::Arc;

use crate::bag::{Connection, Message, Want};
use crate::base::error::{Error, Result};
use crate::base::name::is_log;
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::time::Stamp;
use crate::evidence::SOURCES;
use crate::evidence::inference::Stream;
use crate::evidence::message::cursor::PayloadCursor;
use crate::evidence::message::dynamic::MessageSchema;
use crate::evidence::numbers::Numbers;
use crate::evidence::observation::{Observations, SourceId};
use crate::evidence::source::equal_stamps::FirstHeader;
use crate::evidence::source::{self, Read, SourceContext, echo, equal_stamps, payload};
use crate::evidence::times::Stamps;

pub use recorded::Recorded;
pub use sink::BagSink;

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
/// The cost of a payload besides its bytes, in bytes: its hash is kept.
const PAYLOAD_ENTRY: u64 = 64;

/// How the messages of a stream are read.
#[derive(Debug)]
struct StreamLayout {
    /// The sources that read them.
    readers: Vec<(SourceId, Read)>,
    /// Whether their headers begin with a number.
    is_numbered: bool,
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
    numbers: BTreeMap<usize, Numbers>,
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

    /// Passes the announcement of the newest stream to every source.
    fn announced(&mut self) {
        let Some((place, stream)) = self.streams.iter().enumerate().next_back() else {
            return;
        };
        for (source, row) in SOURCES.iter().enumerate() {
            if let Some(announced) = row.announced {
                announced(&mut SourceContext {
                    facts: &mut self.facts,
                    space: &self.space,
                    stream,
                    place,
                    source,
                    time: None,
                });
            }
        }
    }

    /// Passes a message to the sources that know its layout.
    fn read(&mut self, place: usize, message: &Message<'_>) {
        if let Some(numbers) = self.numbers.get_mut(&place) {
            numbers.add(message.time, message.data);
        }
        let stream = &self.streams[place];
        if let Some(header) = self.layouts[place].header
            && self.options.infer_stamps
        {
            let mut context = SourceContext {
                facts: &mut self.facts,
                space: &self.space,
                stream,
                place,
                source: 0,
                time: Some(message.time),
            };
            equal_stamps::collect(&mut context, header, message.data);
        }
        self.compare(place, message);
        let stream = &self.streams[place];
        let layout = &self.layouts[place];
        for (source, read) in &layout.readers {
            let mut context = SourceContext {
                facts: &mut self.facts,
                space: &self.space,
                stream,
                place,
                source: *source,
                time: Some(message.time),
            };
            let done = PayloadCursor::new(&stream.connection.encoding, message.data)
                .map(|payload| payload.numbered(layout.is_numbered))
                .and_then(|mut payload| read.read(&mut context, &mut payload));
            if done.is_err() {
                self.notices
                    .add(undecodable(stream, "some messages do not have its layout"));
            }
        }
    }

    /// Keeps the content of a payload for comparisons, as long as the budget lasts.
    fn compare(&mut self, place: usize, message: &Message<'_>) {
        let beginning = message.data.get(..payload::HEAD).unwrap_or(message.data);
        self.compared = self
            .compared
            .saturating_add(beginning.len() as u64 + PAYLOAD_ENTRY);
        if self.compared > self.options.payload_bytes {
            return;
        }
        let mut context = SourceContext {
            facts: &mut self.facts,
            space: &self.space,
            stream: &self.streams[place],
            place,
            source: 0,
            time: Some(message.time),
        };
        // The number in the header is set by the publisher, even in a copy.
        let own = if self.numbers.contains_key(&place) {
            4
        } else {
            0
        };
        let compared = beginning.get(own..).unwrap_or_default();
        payload::collect(&mut context, compared, message.size);
        let layout = &self.layouts[place];
        if let Some(header) = layout.header {
            equal_stamps::age(&mut context, header, beginning);
        }
        if let Some(schema) = &layout.schema
            && beginning.len() == message.size as usize
        {
            echo::keep(&mut context, schema, beginning);
        }
    }

    /// Drops the payloads of bags that were not read otherwise. If such a bag has an index, none was
    /// compared, and the evidence of a bag must not depend on the way in which it is read.
    fn forget_payloads(&mut self) {
        if !self.options.compares_all() {
            let (streams, read) = (&self.streams, &self.read);
            let facts = &mut self.facts;
            for kept in [&mut facts.payloads, &mut facts.ages] {
                kept.retain(|at, _| read.contains(&streams[*at].bag));
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
    let kept = connection.latching || source::qos::is_transient_local(qos);
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

mod recorded;
mod sink;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_ros2;
