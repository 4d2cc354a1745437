//! The sink through which a collector reads one bag.

use super::{Collector, StreamLayout, is_held, undecodable};
use crate::bag::{Connection, ConnectionId, Message, Sink, Want};
use crate::base::name::in_space;
use crate::base::notice::Notice;
use crate::base::time::Stamp;
use crate::evidence::inference::{Reliability, Stream};
use crate::evidence::numbers::{Numbers, is_numbered};
use crate::evidence::source::{self, echo, equal_stamps};

/// A sink that feeds one bag into a [`Collector`].
pub struct BagSink<'a> {
    pub(super) collector: &'a mut Collector,
    pub(super) progress: &'a mut dyn FnMut(u64, u64),
    pub(super) bag: usize,
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
        let topic = all
            .facts
            .name(&in_space(&all.space, connection.topic.as_str()));
        let publisher = connection.publisher.as_ref();
        let publisher = publisher.map(|p| in_space(&all.space, p.as_str()));
        let stream = Stream {
            bag: self.bag,
            connection: connection.clone(),
            topic,
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
            all.notices
                .add(undecodable(&stream, "its definition is not the known one"));
        }
        let header = equal_stamps::first_header(connection, &schema);
        let stamped = all.options.infer_stamps && header.is_some();
        let compared = all.options.payload_bytes > 0;
        let want = all.options.want(!readers.is_empty(), stamped);
        if want == Want::Payload || stamped {
            all.read.insert(self.bag);
        }
        if is_numbered(connection, &schema) {
            all.numbers.insert(all.streams.len(), Numbers::default());
        }
        if let Some(streams) = all.bags.get_mut(self.bag) {
            streams.push(all.streams.len());
        }
        all.streams.push(stream);
        all.layouts.push(StreamLayout {
            readers,
            is_numbered: schema.numbers_headers(&connection.encoding),
            header,
            schema: echo::schema(&connection.type_name, &schema).filter(|_| compared),
        });
        all.announced();
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
