//! MCAP files with every combination of optional parts, written after the specification: all are legal and read in full.

use std::collections::BTreeMap;
use std::fs;
use std::process::Command;

use ::mcap::MAGIC;
use ::mcap::records::op;
use bagreel::bag::{OpenOptions, Tier, Want};
use bagreel::internals::base::notice::NoticeKind;
use bagreel::internals::base::time::{Span, Stamp};

use crate::support::{Kept, read, read_as};

/// An optional part of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Chunk,
    MessageIndex,
    Statistics,
    RepeatedSchemas,
    RepeatedChannels,
    AttachmentIndex,
    MetadataIndex,
    ChunkIndex,
    SummaryOffsets,
    /// Unknown fields at the end of every record that later versions of the format may extend.
    LaterFields,
}

const PARTS: [Part; 10] = [
    Part::Chunk,
    Part::MessageIndex,
    Part::Statistics,
    Part::RepeatedSchemas,
    Part::RepeatedChannels,
    Part::AttachmentIndex,
    Part::MetadataIndex,
    Part::ChunkIndex,
    Part::SummaryOffsets,
    Part::LaterFields,
];

/// What a file contains.
#[derive(Clone, Copy, Debug, Default)]
struct Content {
    schema: bool,
    /// The log times of the messages of one channel; without any there is no channel.
    times: &'static [u64],
    attachment: bool,
    metadata: bool,
}

const CONTENTS: [Content; 6] = [
    Content {
        schema: false,
        times: &[],
        attachment: false,
        metadata: false,
    },
    Content {
        schema: false,
        times: &[2],
        attachment: false,
        metadata: false,
    },
    Content {
        schema: true,
        times: &[2],
        attachment: false,
        metadata: false,
    },
    Content {
        schema: false,
        times: &[],
        attachment: true,
        metadata: false,
    },
    Content {
        schema: false,
        times: &[],
        attachment: false,
        metadata: true,
    },
    Content {
        schema: true,
        times: &[0, 2, 1, 3, 3, 5, 4, 7, 8, 9],
        attachment: false,
        metadata: false,
    },
];

/// The payload of every message.
const PAYLOAD: [u8; 3] = [1, 2, 3];

fn text(text: &str) -> Vec<u8> {
    bytes(text.as_bytes())
}

fn bytes(bytes: &[u8]) -> Vec<u8> {
    let len = u32::try_from(bytes.len()).unwrap();
    [&len.to_le_bytes()[..], bytes].concat()
}

/// A file that is being written.
struct Writer<'a> {
    content: Content,
    parts: &'a [Part],
    /// The unknown fields at the end of records.
    later: &'a [u8],
    /// Whether checksums are stated.
    summed: bool,
    /// The number of messages that follow the chunk.
    outside: usize,
    /// Wrong first and last times, if any.
    stated: Option<[u64; 2]>,
    file: Vec<u8>,
    /// Position and length of records that are listed in the summary: chunk, attachment, metadata.
    placed: BTreeMap<u8, (u64, u64)>,
}

impl Writer<'_> {
    fn has(&self, part: Part) -> bool {
        self.parts.contains(&part)
    }

    fn crc(&self, bytes: &[u8]) -> [u8; 4] {
        let sum = if self.summed {
            crc32fast::hash(bytes)
        } else {
            0
        };
        sum.to_le_bytes()
    }

    fn record(&self, kind: u8, content: &[&[u8]]) -> Vec<u8> {
        let mut content = content.concat();
        let is_fixed = [op::MESSAGE, op::DATA_END, op::FOOTER].contains(&kind);
        if self.has(Part::LaterFields) && !is_fixed {
            content.extend(self.later);
        }
        let len = content.len() as u64;
        [&[kind][..], &len.to_le_bytes(), &content].concat()
    }

    fn put(&mut self, kind: u8, content: &[&[u8]]) {
        let record = self.record(kind, content);
        let place = (self.file.len() as u64, record.len() as u64);
        self.placed.insert(kind, place);
        self.file.extend(record);
    }

    fn schema(&self) -> Vec<u8> {
        let fields = [
            &1u16.to_le_bytes()[..],
            &text("pkg/Example"),
            &text("ros1msg"),
            &text("uint8 a\n"),
        ];
        if self.content.schema {
            self.record(op::SCHEMA, &fields)
        } else {
            Vec::new()
        }
    }

    fn channel(&self) -> Vec<u8> {
        let metadata = [text("callerid"), text("/node")].concat();
        let schema = u16::from(self.content.schema).to_le_bytes();
        let fields = [
            &1u16.to_le_bytes()[..],
            &schema,
            &text("/example"),
            &text("ros1"),
            &bytes(&metadata),
        ];
        if self.content.times.is_empty() {
            Vec::new()
        } else {
            self.record(op::CHANNEL, &fields)
        }
    }

    /// The times of the messages in the chunk, and of those after it.
    fn times(&self) -> (&'static [u64], &'static [u64]) {
        let times = self.content.times;
        times.split_at(times.len() - self.outside)
    }

    /// The messages with these times, and the entries of their index.
    fn messages(&self, times: &[u64], from: usize) -> (Vec<u8>, Vec<u8>) {
        let (mut records, mut entries) = (Vec::new(), Vec::new());
        for (sequence, time) in (0u32..).zip(times) {
            entries.extend(
                [*time, (from + records.len()) as u64]
                    .map(u64::to_le_bytes)
                    .concat(),
            );
            let time = time.to_le_bytes();
            let head = [
                &1u16.to_le_bytes()[..],
                &sequence.to_le_bytes(),
                &time,
                &time,
            ];
            records.extend(self.record(op::MESSAGE, &[&head.concat(), &PAYLOAD]));
        }
        (records, entries)
    }

    fn ends(&self, times: &[u64]) -> [u8; 16] {
        let first = times.iter().min().copied().unwrap_or(0);
        let last = times.iter().max().copied().unwrap_or(0);
        let ends = self.stated.unwrap_or([first, last]);
        let ends = ends.map(u64::to_le_bytes).concat();
        ends.try_into().unwrap()
    }

    fn data(&mut self) {
        if self.content.attachment {
            let fields = [
                &2u64.to_le_bytes()[..],
                &1u64.to_le_bytes(),
                &text("file"),
                &text("text/plain"),
                &3u64.to_le_bytes(),
                &PAYLOAD,
            ]
            .concat();
            let crc = self.crc(&fields);
            self.put(op::ATTACHMENT, &[&fields, &crc]);
        }
        if self.content.metadata {
            let pairs = [text("foo"), text("bar")].concat();
            self.put(op::METADATA, &[&text("name"), &bytes(&pairs)]);
        }
        let described = [self.schema(), self.channel()].concat();
        let (times, others) = self.times();
        let (messages, entries) = self.messages(times, described.len());
        let records = [described, messages].concat();
        if !self.has(Part::Chunk) {
            return self.file.extend(records);
        }
        let len = (records.len() as u64).to_le_bytes();
        let crc = self.crc(&records);
        let ends = self.ends(times);
        self.put(op::CHUNK, &[&ends, &len, &crc, &text(""), &len, &records]);
        if self.has(Part::MessageIndex) {
            self.put(op::MESSAGE_INDEX, &[&1u16.to_le_bytes(), &bytes(&entries)]);
        }
        let (outside, _) = self.messages(others, 0);
        self.file.extend(outside);
    }

    /// The groups of the summary's records.
    fn summary(&self) -> Vec<(u8, Vec<u8>)> {
        let mut groups = Vec::new();
        if self.has(Part::RepeatedSchemas) {
            groups.push((op::SCHEMA, self.schema()));
        }
        if self.has(Part::RepeatedChannels) {
            groups.push((op::CHANNEL, self.channel()));
        }
        if self.has(Part::Statistics) {
            let count = self.content.times.len() as u64;
            let channels = u32::from(count > 0);
            let counts = [&1u16.to_le_bytes()[..], &count.to_le_bytes()].concat();
            let counts = if count > 0 { counts } else { Vec::new() };
            let fields = [
                &count.to_le_bytes()[..],
                &u16::from(self.content.schema).to_le_bytes(),
                &channels.to_le_bytes(),
                &u32::from(self.content.attachment).to_le_bytes(),
                &u32::from(self.content.metadata).to_le_bytes(),
                &u32::from(self.has(Part::Chunk)).to_le_bytes(),
                &self.ends(self.content.times),
                &bytes(&counts),
            ];
            groups.push((op::STATISTICS, self.record(op::STATISTICS, &fields)));
        }
        if self.has(Part::ChunkIndex) {
            groups.push((op::CHUNK_INDEX, self.chunk_index()));
        }
        let place = |kind: u8| {
            let (at, len) = self.placed[&kind];
            [at.to_le_bytes(), len.to_le_bytes()].concat()
        };
        if self.has(Part::AttachmentIndex) {
            let fields = [
                &place(op::ATTACHMENT)[..],
                &2u64.to_le_bytes(),
                &1u64.to_le_bytes(),
                &3u64.to_le_bytes(),
                &text("file"),
                &text("text/plain"),
            ];
            groups.push((
                op::ATTACHMENT_INDEX,
                self.record(op::ATTACHMENT_INDEX, &fields),
            ));
        }
        if self.has(Part::MetadataIndex) {
            let fields = [&place(op::METADATA)[..], &text("name")];
            groups.push((op::METADATA_INDEX, self.record(op::METADATA_INDEX, &fields)));
        }
        groups
    }

    fn chunk_index(&self) -> Vec<u8> {
        let (at, len) = self.placed[&op::CHUNK];
        let index = self.placed.get(&op::MESSAGE_INDEX);
        let offsets = index.map_or_else(Vec::new, |(at, _)| {
            [&1u16.to_le_bytes()[..], &at.to_le_bytes()].concat()
        });
        let size =
            self.schema().len() + self.channel().len() + self.messages(self.times().0, 0).0.len();
        let fields = [
            &self.ends(self.times().0)[..],
            &at.to_le_bytes(),
            &len.to_le_bytes(),
            &bytes(&offsets),
            &index.map_or(0, |(_, len)| *len).to_le_bytes(),
            &text(""),
            &(size as u64).to_le_bytes(),
            &(size as u64).to_le_bytes(),
        ];
        self.record(op::CHUNK_INDEX, &fields)
    }

    fn write(mut self) -> Vec<u8> {
        self.file.extend(MAGIC);
        let header = self.record(op::HEADER, &[&text("ros1"), &text("tests")]);
        self.file.extend(header);
        self.data();
        let crc = self.crc(&self.file);
        self.put(op::DATA_END, &[&crc]);
        let start = self.file.len();
        let mut offsets = Vec::new();
        for (kind, group) in self.summary() {
            let place = [self.file.len(), group.len()]
                .map(|n| (n as u64).to_le_bytes())
                .concat();
            offsets.extend(self.record(op::SUMMARY_OFFSET, &[&[kind], &place]));
            self.file.extend(group);
        }
        let behind = self.file.len();
        if self.has(Part::SummaryOffsets) {
            self.file.extend(&offsets);
        }
        let or_none = |at: usize| if at == self.file.len() { 0 } else { at as u64 };
        let places = [or_none(start), or_none(behind)]
            .map(u64::to_le_bytes)
            .concat();
        let len = (places.len() as u64 + 4).to_le_bytes();
        let covered = [&self.file[start..], &[op::FOOTER], &len, &places].concat();
        let crc = self.crc(&covered);
        self.put(op::FOOTER, &[&places, &crc]);
        self.file.extend(MAGIC);
        self.file
    }
}

/// Whether these parts are a file's of this content.
fn fits(content: Content, parts: &[Part]) -> bool {
    let has = |part: Part| parts.contains(&part);
    let is_of_chunks = has(Part::Chunk) || has(Part::MessageIndex) || has(Part::ChunkIndex);
    let is_listed = parts.iter().any(|part| {
        use Part::{Chunk, LaterFields, MessageIndex, SummaryOffsets};
        ![Chunk, MessageIndex, SummaryOffsets, LaterFields].contains(part)
    });
    (content.attachment || !has(Part::AttachmentIndex))
        && (content.metadata || !has(Part::MetadataIndex))
        && (content.schema || !has(Part::RepeatedSchemas))
        && (!content.times.is_empty() || !has(Part::RepeatedChannels) && !is_of_chunks)
        && (is_listed || !has(Part::SummaryOffsets))
        && (has(Part::Chunk) || !is_of_chunks)
}

/// Every variant: its name, its content and its parts.
fn variants() -> Vec<(String, Content, Vec<Part>)> {
    let mut all = Vec::new();
    for content in CONTENTS {
        for chosen in 0..1usize << PARTS.len() {
            let parts = PARTS
                .iter()
                .enumerate()
                .filter(|(at, _)| chosen >> at & 1 == 1);
            let parts: Vec<Part> = parts.map(|(_, part)| *part).collect();
            if fits(content, &parts) {
                let name = format!("{}-{:03}.mcap", content.times.len(), all.len());
                all.push((name, content, parts));
            }
        }
    }
    all
}

/// The ways to write a variant: the unknown fields, and whether checksums are stated. The length of an entry of an index
/// is the most treacherous one.
const WAYS: [(&[u8], bool); 3] = [
    (&[1, 0xff, 0xff], true),
    (&[7; 16], false),
    (&[0; 1000], true),
];

fn writer<'a>(
    content: Content,
    parts: &'a [Part],
    (later, summed): (&'a [u8], bool),
) -> Writer<'a> {
    Writer {
        content,
        parts,
        later,
        summed,
        outside: 0,
        stated: None,
        file: Vec::new(),
        placed: BTreeMap::new(),
    }
}

/// Checks that nothing was missed, added, or called a loss.
fn assert_whole(kept: &Kept, content: Content, at: &str) {
    let count = content.times.len();
    assert!(
        kept.notices
            .iter()
            .all(|n| n.kind == NoticeKind::Downgraded),
        "{at}: {:?}",
        kept.notices
    );
    let mut times: Vec<u64> = content.times.to_vec();
    let mut found: Vec<u64> = kept
        .stamps
        .iter()
        .map(|(_, time, _)| u64::try_from(time.0).unwrap())
        .collect();
    times.sort_unstable();
    found.sort_unstable();
    assert_eq!(found, times, "{at}");
    assert_eq!(kept.messages.len(), count, "{at}");
    assert!(kept.messages.iter().all(|m| m.2 == PAYLOAD), "{at}");
    assert_eq!(kept.connections.len(), usize::from(count > 0), "{at}");
    for connection in &kept.connections {
        assert_eq!(connection.topic.as_str(), "/example", "{at}");
        assert_eq!(
            connection.publisher.as_ref().unwrap().as_str(),
            "/node",
            "{at}"
        );
        let type_name = if content.schema { "pkg/Example" } else { "" };
        assert_eq!(&*connection.type_name, type_name, "{at}");
    }
}

#[test]
fn every_combination_of_optional_parts_is_read_in_full() {
    let all = variants();
    assert_eq!(all.len(), 416);
    let dir = tempfile::tempdir().unwrap();
    let mut indexed = 0;
    for ((name, content, parts), way) in all
        .iter()
        .flat_map(|one| WAYS.iter().map(move |way| (one, *way)))
    {
        let path = dir.path().join(name);
        let at = format!("{name} {content:?} {parts:?} {way:?}");
        fs::write(&path, writer(*content, parts, way).write()).unwrap();
        let (report, kept) = read(&path, Want::Payload).unwrap();
        assert!(report.complete, "{at}: {:?}", kept.notices);
        assert_whole(&kept, *content, &at);
        indexed += usize::from(report.tier == Tier::Index && !content.times.is_empty());
        let options = OpenOptions { verify: true };
        let (report, kept) = read_as(&path, Want::Payload, None, &options).unwrap();
        assert!(report.complete, "{at}: {:?}", report.tier_reason);
        assert_whole(&kept, *content, &at);
    }
    // With chunks, both indexes, statistics and everything repeated, in each way.
    assert_eq!(indexed, 2 * 3 * WAYS.len());
}

#[test]
fn a_survey_of_all_combinations_skips_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let mut expected = 0;
    for (name, content, parts) in variants()
        .iter()
        .filter(|(_, content, _)| !content.times.is_empty())
    {
        fs::write(
            dir.path().join(name),
            writer(*content, parts, WAYS[0]).write(),
        )
        .unwrap();
        expected += 1;
    }
    let done = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .args(["info", "--format", "csv"])
        .arg(dir.path())
        .output()
        .unwrap();
    let text = String::from_utf8(done.stdout).unwrap();
    assert_eq!(
        done.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    assert_eq!(text.lines().count() - 1, expected);
    println!("{}", text.lines().take(5).collect::<Vec<_>>().join("\n"));
}

/// All parts that fit a content with messages, as the present version writes them.
fn all_parts(content: Content) -> Vec<Part> {
    let present = PARTS.into_iter().filter(|part| *part != Part::LaterFields);
    present
        .filter(|part| fits(content, &[Part::Chunk, Part::Statistics, *part]))
        .collect()
}

#[test]
fn messages_outside_chunks_are_read_too() {
    let content = CONTENTS[5];
    for outside in [1, 9] {
        for without in PARTS {
            let mut parts = all_parts(content);
            parts.retain(|part| *part != without || without == Part::Chunk);
            for way in WAYS {
                let dir = tempfile::tempdir().unwrap();
                let path = dir.path().join("mixed.mcap");
                let writer = Writer {
                    outside,
                    ..writer(content, &parts, way)
                };
                fs::write(&path, writer.write()).unwrap();
                let (report, kept) = read(&path, Want::Payload).unwrap();
                let at = format!("{outside} without {without:?}");
                assert!(report.complete, "{at}: {:?}", kept.notices);
                assert_whole(&kept, content, &at);
            }
        }
    }
}

#[test]
fn a_range_finds_a_message_at_zero_that_the_stated_times_ignore() {
    const SECOND: u64 = 1_000_000_000;
    let content = Content {
        schema: true,
        times: &[0, SECOND, 2 * SECOND],
        attachment: false,
        metadata: false,
    };
    let parts = all_parts(content);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("zero.mcap");
    // As writers that take 0 for unknown state them, and as none should.
    for (stated, is_known) in [
        ([SECOND, 2 * SECOND], true),
        ([5 * SECOND, 6 * SECOND], false),
        ([2 * SECOND, 0], false),
    ] {
        let writer = Writer {
            stated: Some(stated),
            ..writer(content, &parts, WAYS[0])
        };
        fs::write(&path, writer.write()).unwrap();
        let range = Span::new(Stamp(0), Stamp(500_000_000));
        let (report, kept) =
            read_as(&path, Want::Payload, Some(range), &OpenOptions::default()).unwrap();
        assert_eq!(
            (kept.stamps.len(), kept.messages.len()),
            (1, 1),
            "{stated:?}"
        );
        assert_eq!(
            (report.tier, report.complete),
            (Tier::Index, is_known),
            "{stated:?}: {:?}",
            kept.notices
        );
    }
}
