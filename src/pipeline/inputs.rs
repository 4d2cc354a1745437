//! The bags of a mission, without duplicates.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::Reading;
use crate::bag::{self, Connection, ConnectionId, Input, Moved, OpenOptions, Reader, Sink, Want};
use crate::base::error::{Error, Result};
use crate::base::ids::grouped;
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::Stamp;
use crate::evidence::collector::CollectOptions;

/// Every input once, sorted by name, with a notice for duplicates, which would be counted twice.
pub(super) fn each_once(inputs: &[Input]) -> Result<(Vec<Input>, Vec<Notice>)> {
    let mut seen = BTreeMap::new();
    let (mut once, mut twice) = (Vec::new(), Vec::new());
    for input in inputs.iter().flat_map(bag::parts_of) {
        let real = match &input {
            Input::Path(path) => bag::plain(&path.canonicalize().unwrap_or_else(|_| path.clone())),
            Input::Stdin => PathBuf::from("-"),
        };
        let first = seen.entry(real).or_insert_with(|| input.clone());
        if once.contains(first) {
            let (known, name) = (first.name(), input.name());
            if input.is_pipe() {
                let what = format!("{name} was given twice, but can be read only once");
                return Err(Error::usage(what, "give it once"));
            }
            let text = if known == name {
                format!("`{name}` was given twice and read once")
            } else {
                format!("`{known}` and `{name}` are copies of one recording, which was read once")
            };
            twice.push(Notice::new(NoticeKind::Note, text));
        } else {
            once.push(input);
        }
    }
    // The order in which they are given does not matter.
    once.sort_by_key(|input| (input.name(), input.given()));
    refuse_copies(&once)?;
    Ok((once, twice))
}

/// The reader of an input with the offset of its recorder's clock.
pub(super) fn in_time(
    reading: &Reading,
    input: &Input,
    reader: Box<dyn Reader>,
) -> Box<dyn Reader> {
    match given_offset(reading, input) {
        None | Some(0) => reader,
        Some(by) => Box::new(Moved::new(reader, by)),
    }
}

/// The time by which the clock of an input's recorder is corrected, in nanoseconds; `None` if it is not.
pub(super) fn given_offset(reading: &Reading, input: &Input) -> Option<i64> {
    let all = reading.offsets.iter();
    let own = all.filter(|(name, _)| is_of(name, input));
    own.map(|(_, by)| *by).reduce(i64::saturating_add)
}

/// The namespace for the names in an input; empty for none.
pub(super) fn space_of(reading: &Reading, input: &Input) -> String {
    let own = reading.namespaces.iter().rev();
    let mut own = own.filter(|(name, _)| is_of(name, input));
    own.next()
        .map_or_else(String::new, |(_, space)| space.clone())
}

/// Whether an option given for `name` applies to this input.
fn is_of(name: &Path, input: &Input) -> bool {
    match input {
        Input::Path(path) => path.starts_with(name) || path.file_name() == Some(name.as_os_str()),
        Input::Stdin => name == Path::new("-"),
    }
}

/// The collection options without comparing payloads of large bags, where reading all payloads would defeat the index.
/// They are compared on request.
pub(super) fn affordable(reading: &Reading) -> CollectOptions {
    let mut options = reading.collect.clone();
    let sizes = reading.inputs.iter().filter_map(bag::size_on_disk);
    let is_large = sizes.fold(0, u64::saturating_add) > options.payload_bytes;
    let is_bounded = options.payload_bytes < u64::MAX;
    if is_bounded && is_large {
        options.payload_bytes = 0;
    }
    options
}

/// Refuses an offset or a namespace that applies to none of the inputs.
pub(super) fn check_named(reading: &Reading, inputs: &[Input]) -> Result<()> {
    let offsets = reading.offsets.iter();
    let offsets = offsets.map(|(name, _)| (name, "offset", "+0.35s"));
    let spaces = reading.namespaces.iter();
    let spaces = spaces.map(|(name, _)| (name, "ns", "/robot2"));
    let is_used = |name: &Path| inputs.iter().any(|input| is_of(name, input));
    match offsets.chain(spaces).find(|(name, ..)| !is_used(name)) {
        None => Ok(()),
        Some((name, option, value)) => {
            let name = name.display();
            Err(Error::usage(
                format!("`--{option}` names `{name}`, which is not among the bags"),
                format!("write the bag as on the command line: `--{option} run_2.bag={value}`"),
            ))
        }
    }
}

/// Refuses bags with the same messages, which would be counted twice: copies and conversions. Pipes are not checked.
fn refuse_copies(inputs: &[Input]) -> Result<()> {
    let near = inputs.iter();
    let near = near.filter(|i| matches!(i, Input::Path(_)) && !i.is_pipe());
    let near: Vec<&Input> = near.collect();
    // Errors of opening are reported when the bag is read.
    let open = |input: &Input| bag::open(input, &OpenOptions::default()).ok();
    // Copies have the same time span or, if that is unknown, the same size.
    let ends = |input: &Input| {
        let span = open(input).and_then(|mut bag| bag.span().ok().flatten());
        let size = || bag::size_on_disk(input);
        span.map_or_else(|| Err(size()), |span| Ok((span.start, span.end)))
    };
    let contents = |input: &Input| {
        let mut sink = ContentsSink::default();
        open(input)?.read(None, &mut sink).ok()?;
        (sink.messages > 0).then_some((sink.messages, sink.sum))
    };
    let are_several = near.len() > 1;
    let near = near.into_iter().filter(|_| are_several);
    let alike = grouped(near.map(|input| (ends(input), input)));
    for inputs in alike.values().filter(|inputs| inputs.len() > 1) {
        let mut known = BTreeMap::new();
        for input in inputs {
            let other = contents(input).and_then(|own| known.insert(own, input.name()));
            if let Some(other) = other {
                let own = input.name();
                let what = format!(
                    "`{own}` contains the same messages as `{other}`, which would be counted twice"
                );
                return Err(Error::usage(what, "give only one of them"));
            }
        }
    }
    Ok(())
}

/// The number of messages of a bag, and a sum over their topics and times in which their order does not matter.
#[derive(Default)]
struct ContentsSink {
    messages: usize,
    sum: u64,
    /// A number for the topic of each connection.
    topics: Vec<u64>,
}

impl Sink for ContentsSink {
    fn connection(&mut self, connection: &Connection) -> Want {
        let bytes = connection.topic.as_str().bytes();
        let topic = bytes.fold(0, |sum, byte| mixed(sum ^ u64::from(byte)));
        self.topics.push(topic);
        Want::Stamps
    }

    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], _: Option<&[u32]>) {
        let topic = self.topics.get(connection.0 as usize);
        let topic = topic.copied().unwrap_or_default();
        for at in stamps {
            self.sum = self.sum.wrapping_add(mixed(topic ^ at.0.cast_unsigned()));
        }
        self.messages += stamps.len();
    }
}

/// A number of which each bit depends on every bit of `number` (`SplitMix64`).
fn mixed(number: u64) -> u64 {
    let number = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let number = (number ^ (number >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let number = (number ^ (number >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    number ^ (number >> 31)
}
