//! Writes the file of graphs: `/rosgraph` with a message per graph and `/bagreel/events` with a line per event.

use std::collections::BTreeMap;
use std::io::{self, Seek, Write};

use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};

use super::cdr::CdrWriter;
use super::definitions::CHANNELS;
use crate::base::name::OWN_NODE;
use crate::base::time::Stamp;
use crate::evidence::source::qos::{depth, policy};

/// The channel of graphs.
pub(crate) const GRAPH: usize = 0;
/// The channel of the event log.
pub(crate) const LOG: usize = 1;

/// A file being written.
pub(crate) struct GraphFile<W: Write + Seek> {
    to: Writer<W>,
    channels: Vec<u16>,
    sequence: u32,
}

impl<W: Write + Seek> GraphFile<W> {
    /// Begins a file with messages in compressed chunks, or readable as soon as they are flushed.
    ///
    /// # Errors
    /// If it cannot be written, as for all functions below.
    pub(crate) fn new(to: W, in_chunks: bool) -> io::Result<Self> {
        let options = WriteOptions::new()
            .compression(Some(Compression::Zstd))
            .use_chunks(in_chunks);
        let to = options.profile("ros2").library("bagreel").create(to);
        let mut file = Self {
            to: to.map_err(io::Error::other)?,
            channels: Vec::new(),
            sequence: 0,
        };
        for (topic, kind, definition) in CHANNELS {
            file.own_channel(topic, kind, definition.to_owned())?;
        }
        Ok(file)
    }

    /// Adds a channel about the robot: our own reader recognizes by the node that its topic is not the robot's. Returns the
    /// number to write to.
    pub(crate) fn own_channel(
        &mut self,
        topic: &str,
        kind: &str,
        text: String,
    ) -> io::Result<usize> {
        let metadata = BTreeMap::from([("callerid".to_owned(), OWN_NODE.to_owned())]);
        self.channel(topic, "cdr", (kind, "ros2msg", text), &metadata)
    }

    /// Adds a channel with its encoding and its schema (name, encoding, text); returns the number to write to.
    pub(crate) fn channel(
        &mut self,
        topic: &str,
        encoding: &str,
        (kind, schema_encoding, schema): (&str, &str, String),
        metadata: &BTreeMap<String, String>,
    ) -> io::Result<usize> {
        let to = &mut self.to;
        let schema = to.add_schema(kind, schema_encoding, schema.as_bytes());
        let id = schema.and_then(|schema| to.add_channel(schema, topic, encoding, metadata));
        self.channels.push(id.map_err(io::Error::other)?);
        Ok(self.channels.len() - 1)
    }

    /// Writes a message of [`GRAPH`], [`LOG`] or a channel that was added.
    pub(crate) fn write(&mut self, channel: usize, at: Stamp, payload: &[u8]) -> io::Result<()> {
        let time = u64::try_from(at.0).unwrap_or(0);
        let header = MessageHeader {
            channel_id: self.channels[channel],
            sequence: self.sequence,
            log_time: time,
            publish_time: time,
        };
        self.sequence = self.sequence.wrapping_add(1);
        let written = self.to.write_to_known_channel(&header, payload);
        written.map_err(io::Error::other)
    }

    /// Makes the written data visible to other processes.
    pub(crate) fn flush(&mut self) -> io::Result<()> {
        self.to.flush().map_err(io::Error::other)
    }

    /// Ends the file with its summary.
    pub(crate) fn finish(mut self) -> io::Result<W> {
        self.to.finish().map_err(io::Error::other)?;
        Ok(self.to.into_inner())
    }
}

/// A node of a graph.
pub(crate) struct GraphNode<'a> {
    name: &'a str,
    /// Publishers, subscriptions, clients of services, servers of services.
    pub(crate) ends: [Vec<GraphEnd<'a>>; 4],
}

impl<'a> GraphNode<'a> {
    pub(crate) fn new(name: &'a str) -> Self {
        Self {
            name,
            ends: Default::default(),
        }
    }
}

/// A topic or service at a node.
#[derive(Clone, Copy)]
pub(crate) struct GraphEnd<'a> {
    pub(crate) name: &'a str,
    /// Its type; empty if unknown.
    pub(crate) kind: &'a str,
    /// The offered quality of service, as text.
    pub(crate) qos: Option<&'a str>,
}

/// A record of the event log: information, or a warning.
pub(crate) fn log(time: Stamp, text: &str, warns: bool) -> Vec<u8> {
    let mut cdr = CdrWriter::new();
    cdr.time(time);
    cdr.u8(if warns { 3 } else { 2 });
    cdr.text(text);
    cdr.text("bagreel");
    cdr.text("");
    cdr.u32(0);
    cdr.done()
}

/// A graph, its nodes without parameters, and with their actions as topics.
pub(crate) fn graph(nodes: &[GraphNode<'_>]) -> Vec<u8> {
    let mut cdr = CdrWriter::new();
    cdr.count(nodes.len());
    for node in nodes {
        cdr.text(node.name);
        cdr.count(0);
        cdr.count(0);
        for (side, ends) in node.ends.iter().enumerate() {
            cdr.count(ends.len());
            for end in ends {
                cdr.text(end.name);
                let offered = end.qos.filter(|_| side % 2 == 0);
                // A service has the types of its request and of its response.
                for _ in 0..=side / 2 {
                    interface(&mut cdr, end.kind);
                    quality(&mut cdr, offered);
                }
            }
        }
        cdr.count(0);
        cdr.count(0);
    }
    cdr.done()
}

/// A type, without the hash of its definition.
fn interface(cdr: &mut CdrWriter, kind: &str) {
    cdr.text(kind);
    cdr.u8(1);
    cdr.bytes(&[0; 32]);
}

/// A quality of service from its text; the rest is unknown.
fn quality(cdr: &mut CdrWriter, words: Option<&str>) {
    // 1 and 2 are the two words of each policy, 3 is unknown.
    let policy = |known| policy(words, known).map_or(3, |at| if at == 0 { 1 } else { 2 });
    let depth = depth(words);
    cdr.u32(depth.unwrap_or(0));
    for _ in 0..4 {
        cdr.u32(0);
    }
    cdr.u8(depth.map_or_else(|| policy(["keep_last", "keep_all"]), |_| 1));
    cdr.u8(policy(["reliable", "best_effort"]));
    cdr.u8(policy(["transient_local", "volatile"]));
    cdr.u8(4);
    cdr.u32(0);
    cdr.u32(0);
}
