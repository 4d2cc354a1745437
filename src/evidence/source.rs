//! The interface of a kind of evidence. In: messages of known layouts, announcements of connections, and all conclusions so
//! far. Out: observations, and inferences from them. One file per subject; begin with `rosout`, the log of every node.

pub(crate) mod action;
pub(crate) mod connection;
pub(crate) mod contract;
pub(crate) mod conventions;
pub(crate) mod diagnostics;
pub(crate) mod echo;
pub(crate) mod equal_stamps;
pub(crate) mod events;
pub(crate) mod log_text;
pub(crate) mod payload;
pub(crate) mod recorder;
pub(crate) mod rosgraph;
pub(crate) mod rosout;
pub(crate) mod sim_time;
pub(crate) mod statistics;

use crate::base::name::{in_space, plain_type};
use crate::base::time::{Span, Stamp};
use crate::evidence::SOURCES;
use crate::evidence::inference::{Conclusions, Stream};
use crate::evidence::message::cursor::{PayloadCursor, PayloadResult};
use crate::evidence::message::dynamic::{
    LayoutFit, LogRecord, MessageLayout, MessageSchema, is_ros1_log,
};
use crate::evidence::observation::{
    Confidence, Measurement, Name, Observation, Observations, SourceId, Statement,
};
use crate::evidence::source::events::ParameterEvent;

/// A kind of evidence.
pub struct Source {
    /// The source's word in JSON.
    pub word: &'static str,
    /// A description in one line.
    pub about: &'static str,
    /// The layouts of the messages that it reads.
    pub(crate) reads: &'static [(&'static [MessageLayout], Read)],
    /// Whether nodes make these observations about themselves, so that the node was running at that time.
    pub(crate) own: bool,
    /// Whether each of its snapshots is valid until the next one: they are made whenever something changes.
    pub(crate) holds: bool,
    /// Conclusions from the whole mission; run in the order of the rows.
    pub(crate) conclude: &'static [Conclude],
}

/// A function that draws a conclusion.
pub(crate) type Conclude = fn(&mut Conclusions<'_>);

/// An empty source, for rows to fill in.
pub(crate) const NOTHING: Source = Source {
    word: "",
    about: "",
    reads: &[],
    own: false,
    holds: false,
    conclude: &[],
};

/// The input of a source, and the collection of its observations.
pub(crate) struct SourceContext<'a> {
    pub(crate) facts: &'a mut Observations,
    /// The namespace of the names in this recording; empty for none.
    pub(crate) space: &'a str,
    pub(crate) stream: &'a Stream,
    /// The stream's index among all streams.
    pub(crate) place: usize,
    pub(crate) source: SourceId,
    /// The time at which the message was recorded; `None` at an announcement.
    pub(crate) time: Option<Stamp>,
}

impl SourceContext<'_> {
    /// The name of a text; a resolved name is put into the namespace of its recording.
    pub(crate) fn name(&mut self, text: &str) -> Name {
        if text.starts_with('/') {
            self.facts.name(&in_space(self.space, text))
        } else {
            self.facts.name(text)
        }
    }

    /// Adds a statistic of an interval, which ends now if it has no length.
    pub(crate) fn measure(&mut self, measurement: Measurement) {
        let now = self.time.unwrap_or(measurement.span.end);
        let nanos = measurement.span.nanos().clamp(1, 3_600_000_000_000);
        // Intervals are measured by the node's clock, so only their length is used.
        let span = Span::new(now.plus(-nanos), now);
        self.facts.measure(Measurement {
            span,
            ..measurement
        });
    }

    /// Adds an observation that the message states, made now, with its explanation.
    pub(crate) fn states(&mut self, observation: Observation, words: impl FnOnce() -> String) {
        self.observation(observation, Confidence::Stated, words);
    }

    /// Adds an observation that the message states as a part of a snapshot.
    pub(crate) fn states_in(
        &mut self,
        snapshot: Name,
        observation: Observation,
        words: impl FnOnce() -> String,
    ) {
        let said = Statement {
            snapshot: Some(snapshot),
            ..Statement::new(observation, Confidence::Stated)
        };
        self.facts.state(self.source, said, self.time, words);
    }

    /// Adds an observation, made now, with its explanation.
    pub(crate) fn observation(
        &mut self,
        observation: Observation,
        confidence: Confidence,
        words: impl FnOnce() -> String,
    ) {
        let said = Statement::new(observation, confidence);
        self.facts.state(self.source, said, self.time, words);
    }
}

/// Topics that any node may publish, so that one known publisher does not imply that it is the only one.
pub(crate) const SHARED: [&str; 8] = [
    "/tf",
    "/tf_static",
    "/rosout",
    "/rosout_agg",
    "/diagnostics",
    "/parameter_events",
    "/statistics",
    "/clock",
];

/// A reader of one layout.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Read {
    Payload(fn(&mut SourceContext<'_>, &mut PayloadCursor<'_>) -> PayloadResult<()>),
    Log(fn(&mut SourceContext<'_>, &LogRecord<'_>)),
    Parameters(fn(&mut SourceContext<'_>, &ParameterEvent<'_>)),
}

impl Read {
    /// Reads a message.
    ///
    /// # Errors
    /// If it has another layout.
    pub(crate) fn read(
        self,
        context: &mut SourceContext<'_>,
        payload: &mut PayloadCursor<'_>,
    ) -> PayloadResult<()> {
        match self {
            Self::Payload(read) => read(context, payload)?,
            Self::Log(read) => {
                let is_ros1 = is_ros1_log(&context.stream.connection.type_name);
                read(context, &LogRecord::read(payload, is_ros1)?);
            }
            Self::Parameters(read) => read(context, &ParameterEvent::read(payload)?),
        }
        Ok(())
    }
}

/// The sources that read a connection's messages, with their readers; and whether some source knows its type by another
/// layout.
pub(crate) fn readers(stream: &Stream, schema: &MessageSchema) -> (Vec<(SourceId, Read)>, bool) {
    let type_name = plain_type(&stream.connection.type_name);
    let mut readers = Vec::new();
    let mut foreign = false;
    for (id, source) in SOURCES.iter().enumerate() {
        let layouts = source.reads.iter();
        let layouts = layouts.flat_map(|(layouts, read)| layouts.iter().map(move |l| (l, read)));
        let fits = layouts.map(|(layout, read)| {
            let fit = layout.fit(&stream.connection, &type_name, schema.outline());
            (read, fit)
        });
        let fits: Vec<_> = fits.collect();
        match fits.iter().find(|(_, fit)| *fit == LayoutFit::Same) {
            Some((read, _)) => readers.push((id, **read)),
            None => foreign |= fits.iter().any(|(_, fit)| *fit == LayoutFit::OtherFields),
        }
    }
    (readers, foreign)
}
