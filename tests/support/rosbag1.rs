//! Described bags as ROS 1 bags, version 2.0.

use std::collections::BTreeMap;
use std::io::Write as _;

use super::{Publisher, Recording};

/// How chunks are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pack {
    None,
    Bz2,
    Lz4,
}

fn header(fields: &[(&str, &[u8])]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (name, value) in fields {
        let len = u32::try_from(name.len() + 1 + value.len()).unwrap();
        bytes.extend(len.to_le_bytes());
        bytes.extend(name.bytes());
        bytes.push(b'=');
        bytes.extend(*value);
    }
    bytes
}

fn record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let header = header(fields);
    let mut bytes = u32::try_from(header.len()).unwrap().to_le_bytes().to_vec();
    bytes.extend(header);
    bytes.extend(u32::try_from(data.len()).unwrap().to_le_bytes());
    bytes.extend(data);
    bytes
}

fn time(nanos: i64) -> [u8; 8] {
    let seconds = u32::try_from(nanos / 1_000_000_000).unwrap();
    let rest = u32::try_from(nanos % 1_000_000_000).unwrap();
    let mut bytes = [0; 8];
    bytes[..4].copy_from_slice(&seconds.to_le_bytes());
    bytes[4..].copy_from_slice(&rest.to_le_bytes());
    bytes
}

fn connection(id: u32, publisher: &Publisher) -> Vec<u8> {
    let latching: &[u8] = if publisher.latching { b"1" } else { b"0" };
    let data = header(&[
        ("topic", publisher.topic.as_bytes()),
        ("type", publisher.type_name.as_bytes()),
        ("md5sum", b"00000000000000000000000000000000"),
        ("message_definition", publisher.definition.as_bytes()),
        ("callerid", publisher.node.as_bytes()),
        ("latching", latching),
    ]);
    let topic = publisher.topic.as_bytes();
    record(
        &[("op", &[7]), ("topic", topic), ("conn", &id.to_le_bytes())],
        &data,
    )
}

fn packed(how: Pack, plain: &[u8]) -> (&'static [u8], Vec<u8>) {
    match how {
        Pack::None => (b"none", plain.to_vec()),
        Pack::Bz2 => {
            let mut to = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
            to.write_all(plain).unwrap();
            (b"bz2", to.finish().unwrap())
        }
        Pack::Lz4 => {
            let info = lz4_flex::frame::FrameInfo::new()
                .block_size(lz4_flex::frame::BlockSize::Max1MB)
                .content_checksum(true);
            let mut to = lz4_flex::frame::FrameEncoder::with_frame_info(info, Vec::new());
            to.write_all(plain).unwrap();
            (b"lz4", to.finish().unwrap())
        }
    }
}

#[derive(Default)]
struct Chunk {
    plain: Vec<u8>,
    /// Per connection: times and offsets.
    index: BTreeMap<u32, Vec<(i64, u32)>>,
    /// Bytes after the compressed records.
    behind: Vec<u8>,
}

/// The chunk's record, its index records, and its entry in the tail.
fn close(chunk: &Chunk, how: Pack, pos: u64) -> (Vec<u8>, Vec<u8>) {
    let (name, mut data) = packed(how, &chunk.plain);
    data.extend(&chunk.behind);
    let size = u32::try_from(chunk.plain.len()).unwrap();
    let mut bytes = record(
        &[
            ("op", &[5]),
            ("compression", name),
            ("size", &size.to_le_bytes()),
        ],
        &data,
    );
    let mut counts = Vec::new();
    for (id, entries) in &chunk.index {
        let mut data = Vec::new();
        for (at, offset) in entries {
            data.extend(time(*at));
            data.extend(offset.to_le_bytes());
        }
        let count = u32::try_from(entries.len()).unwrap().to_le_bytes();
        let fields: [(&str, &[u8]); 4] = [
            ("op", &[4]),
            ("ver", &[1, 0, 0, 0]),
            ("conn", &id.to_le_bytes()),
            ("count", &count),
        ];
        bytes.extend(record(&fields, &data));
        counts.extend(id.to_le_bytes());
        counts.extend(count);
    }
    let times = || chunk.index.values().flatten().map(|e| e.0);
    let connections = u32::try_from(chunk.index.len()).unwrap().to_le_bytes();
    let (first, last) = (time(times().min().unwrap()), time(times().max().unwrap()));
    let info = record(
        &[
            ("op", &[6]),
            ("ver", &[1, 0, 0, 0]),
            ("chunk_pos", &pos.to_le_bytes()),
            ("start_time", &first),
            ("end_time", &last),
            ("count", &connections),
        ],
        &counts,
    );
    (bytes, info)
}

fn bag_header(index_pos: u64, connections: usize, chunks: usize) -> Vec<u8> {
    let connections = u32::try_from(connections).unwrap().to_le_bytes();
    let chunks = u32::try_from(chunks).unwrap().to_le_bytes();
    let fields: [(&str, &[u8]); 4] = [
        ("op", &[3]),
        ("index_pos", &index_pos.to_le_bytes()),
        ("conn_count", &connections),
        ("chunk_count", &chunks),
    ];
    let padding = vec![b' '; 4096 - header(&fields).len()];
    record(&fields, &padding)
}

/// A bag with chunks of about `chunk` plain bytes.
pub fn write(recording: &Recording, how: Pack, chunk: usize) -> Vec<u8> {
    write_with(recording, how, chunk, &[])
}

/// A bag with these bytes after the compressed records of every chunk.
fn write_with(recording: &Recording, how: Pack, chunk: usize, behind: &[u8]) -> Vec<u8> {
    const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
    let mut bytes = MAGIC.to_vec();
    bytes.extend(bag_header(0, 0, 0));
    let (mut open, mut infos, mut seen) = (Chunk::default(), Vec::new(), Vec::new());
    for (publisher, at, payload) in &recording.messages {
        let id = u32::try_from(*publisher).unwrap();
        if !seen.contains(&id) {
            seen.push(id);
            open.plain
                .extend(connection(id, &recording.publishers[*publisher]));
        }
        let offset = u32::try_from(open.plain.len()).unwrap();
        open.index.entry(id).or_default().push((*at, offset));
        let fields: [(&str, &[u8]); 3] = [
            ("op", &[2]),
            ("conn", &id.to_le_bytes()),
            ("time", &time(*at)),
        ];
        open.plain.extend(record(&fields, payload));
        if open.plain.len() >= chunk {
            open.behind = behind.to_vec();
            let (record, info) = close(&std::mem::take(&mut open), how, bytes.len() as u64);
            bytes.extend(record);
            infos.push(info);
        }
    }
    if !open.plain.is_empty() {
        open.behind = behind.to_vec();
        let (record, info) = close(&open, how, bytes.len() as u64);
        bytes.extend(record);
        infos.push(info);
    }
    let index_pos = bytes.len() as u64;
    for id in &seen {
        bytes.extend(connection(*id, &recording.publishers[*id as usize]));
    }
    bytes.extend(infos.concat());
    let head = bag_header(index_pos, seen.len(), infos.len());
    bytes[MAGIC.len()..MAGIC.len() + head.len()].copy_from_slice(&head);
    bytes
}

/// The same bag as if its recorder had been killed: no tail, as stated in the head.
pub fn unindexed(bag: &[u8]) -> Vec<u8> {
    let at = bag.windows(10).position(|w| w == b"index_pos=").unwrap() + 10;
    let index_pos = u64::from_le_bytes(bag[at..at + 8].try_into().unwrap());
    let mut cut = bag[..usize::try_from(index_pos).unwrap()].to_vec();
    cut[at..at + 8].fill(0);
    cut
}

/// Small bags that expand to twenty gigabytes: with an unclosed chunk, with a wrong index, and with a message stated to
/// be deep inside.
pub fn bombs(recording: &Recording) -> Vec<(&'static str, Vec<u8>)> {
    // A record of nearly maximal length, and zeros: 64 MB in each of many streams.
    let mut long = record(&[("op", &[9])], &[]);
    let at = long.len() - 4;
    long[at..].fill(0xff);
    let mut behind = packed(Pack::Bz2, &long).1;
    behind.extend(packed(Pack::Bz2, &vec![0; 64 << 20]).1.repeat(300));
    let bag = write_with(recording, Pack::Bz2, 1 << 20, &behind);
    let behind_field = |name: &[u8], nth: usize| {
        let mut found = bag
            .windows(name.len())
            .enumerate()
            .filter(|(_, w)| *w == name);
        found.nth(nth).unwrap().0 + name.len()
    };
    let (mut open, mut wrong, mut deep) = (unindexed(&bag), bag.clone(), bag.clone());
    let chunk = behind_field(b"compression=bz2", 0);
    let size = behind_field(b"\x09\0\0\0size=", 0);
    open[size..size + 8].fill(0);
    assert!(size > chunk);
    // The bag's head has its own counts under other names.
    let count = behind_field(b"\x0a\0\0\0count=", 0);
    wrong[count] += 1;
    // After the count: the length of the entries, then time and offset of each.
    let second = count + 4 + 4 + 12 + 8;
    deep[second..second + 4].copy_from_slice(&4_000_000_000u32.to_le_bytes());
    vec![("open", open), ("wrong", wrong), ("deep", deep)]
}
