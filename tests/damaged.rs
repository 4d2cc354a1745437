//! Tests of damaged and manipulated bags: intact data is read, nothing is invented, and losses are reported.

#[cfg(unix)]
mod agreement;
mod every_byte;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use bagreel::bag::{self, Input, OpenOptions, Report, Tier, Want};
use bagreel::internals::base::notice::NoticeKind;
use bagreel::internals::base::time::{Span, Stamp};
use tempfile::TempDir;

use crate::support::rosbag1::Pack;
use crate::support::tiny::{self, MESSAGES};
use crate::support::{self, Kept, ORIGIN, Recording, mcap, read, read_as, rosbag1, sqlite3};

/// A folder with one file in it.
fn placed(name: &str, bytes: &[u8]) -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    fs::write(&path, bytes).unwrap();
    (dir, path)
}

fn read_bytes(name: &str, bytes: &[u8]) -> (Report, Kept) {
    let (_dir, path) = placed(name, bytes);
    read(&path, Want::Payload).unwrap()
}

/// Runs the command; returns its exit code and output, results first.
pub(crate) fn bagreel(args: &[&str]) -> (Option<i32>, String) {
    let mut run = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    said(&run.args(args).output().unwrap())
}

fn said(output: &Output) -> (Option<i32>, String) {
    let text = [&output.stdout[..], &output.stderr].concat();
    (
        output.status.code(),
        String::from_utf8_lossy(&text).into_owned(),
    )
}

/// A small recording in a few chunks.
fn short() -> Recording {
    let mut recording = support::small();
    recording.messages.retain(|m| m.1 % 7 < 3 || m.0 == 0);
    recording.messages.truncate(120);
    recording
}

/// A MCAP file of a few chunks, with and without a summary.
fn unsummed(compression: Option<mcap::Packed>) -> Vec<u8> {
    let options = mcap::Options {
        summary: false,
        compression,
        chunk: 4000,
        ..mcap::Options::default()
    };
    mcap::write(&short(), &options)
}

/// Numbers that look random and are the same everywhere.
fn places(seed: u64, below: usize) -> impl Iterator<Item = (usize, u8)> {
    let mut state = seed;
    std::iter::repeat_with(move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let at = usize::try_from((state >> 33) % below as u64).unwrap();
        (at, 1 << (state >> 60 & 7))
    })
}

/// Bags that are read from the front, and by their index.
fn chunked() -> Vec<(&'static str, Vec<u8>)> {
    let recording = short();
    let bag = |how| rosbag1::write(&recording, how, 4000);
    let options = |compression| mcap::Options {
        compression,
        chunk: 4000,
        ..mcap::Options::default()
    };
    vec![
        ("none.bag", bag(Pack::None)),
        ("lz4.bag", bag(Pack::Lz4)),
        ("front_none.bag", rosbag1::unindexed(&bag(Pack::None))),
        ("front_lz4.bag", rosbag1::unindexed(&bag(Pack::Lz4))),
        ("front_bz2.bag", rosbag1::unindexed(&bag(Pack::Bz2))),
        ("none.mcap", mcap::write(&recording, &options(None))),
        (
            "zstd.mcap",
            mcap::write(&recording, &options(Some(mcap::Packed::Zstd))),
        ),
        ("front_none.mcap", unsummed(None)),
        ("front_zstd.mcap", unsummed(Some(mcap::Packed::Zstd))),
        ("front_lz4.mcap", unsummed(Some(mcap::Packed::Lz4))),
    ]
}

/// The same bag with more fields in its head.
fn with_fields(bag: &[u8], fields: &[(&str, &[u8])]) -> Vec<u8> {
    const MAGIC: usize = 13;
    let number = |at: usize| u32::from_le_bytes(bag[at..at + 4].try_into().unwrap());
    let head = MAGIC + 4..MAGIC + 4 + number(MAGIC) as usize;
    let mut header = Vec::new();
    for (name, value) in fields {
        header.extend(
            u32::try_from(name.len() + 1 + value.len())
                .unwrap()
                .to_le_bytes(),
        );
        header.extend([name.as_bytes(), b"=", value].concat());
    }
    let padding = number(head.end) as usize - header.len();
    header.extend(&bag[head.clone()]);
    let len = |n: usize| u32::try_from(n).unwrap().to_le_bytes();
    let behind = &bag[head.end + 4 + number(head.end) as usize..];
    [
        &bag[..MAGIC],
        &len(header.len()),
        &header,
        &len(padding),
        &vec![b' '; padding],
        behind,
    ]
    .concat()
}

#[test]
fn a_range_finds_messages_in_chunks_of_which_wrong_times_are_stated() {
    let recording = support::small();
    let first = recording.messages[0].1;
    let range = Span::new(Stamp(first), Stamp(first + 1_000_000));
    // Many chunks, of which only a few are inspected, and few.
    for (chunk, count) in [(1, 512..), (20_000, 2..)] {
        let mut bag = rosbag1::write(&recording, Pack::None, chunk);
        let whole = bag.len();
        for field in [&b"start_time="[..], b"end_time="] {
            let at = bag.windows(field.len()).position(|window| window == field);
            let at = at.unwrap() + field.len();
            let seconds = u32::from_le_bytes(bag[at..at + 4].try_into().unwrap()) + 100;
            bag[at..at + 4].copy_from_slice(&seconds.to_le_bytes());
        }
        let chunks = bag.windows(9).filter(|w| *w == b"chunk_pos").count();
        assert!(count.contains(&chunks) && bag.len() == whole, "{chunks}");
        let (_dir, path) = placed("wrong.bag", &bag);
        let options = OpenOptions::default();
        let (_, kept) = read_as(&path, Want::Payload, Some(range), &options).unwrap();
        assert_eq!((kept.stamps.len(), kept.messages.len()), (1, 1));
        // Without asking for the span first.
        let mut kept = Kept::default();
        let mut reader = bag::open(&Input::Path(path), &options).unwrap();
        reader.read(Some(range), &mut kept).unwrap();
        assert_eq!(kept.stamps.len(), 1);
    }
}

#[test]
fn an_encrypted_bag_is_called_encrypted() {
    let bag = rosbag1::write(&short(), Pack::None, 4000);
    let plain = with_fields(&bag, &[("encryptor", b"")]);
    assert_eq!(
        read_bytes("plain.bag", &plain).1.stamps.len(),
        short().messages.len()
    );
    // The encrypted key precedes the name of the encryptor.
    let fields: [(&str, &[u8]); 2] = [
        ("encrypted_key", &[7; 1500]),
        ("encryptor", b"rosbag/AesCbcEncryptor"),
    ];
    let (_dir, path) = placed("secret.bag", &with_fields(&bag, &fields));
    let pipe = || std::process::Stdio::from(fs::File::open(&path).unwrap());
    for (input, from) in [
        (path.as_os_str(), std::process::Stdio::null()),
        ("-".as_ref(), pipe()),
    ] {
        let done = std::process::Command::new(env!("CARGO_BIN_EXE_bagreel"))
            .arg("info")
            .arg(input)
            .stdin(from)
            .output()
            .unwrap();
        let text = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(1), "{text}");
        assert!(
            text.contains("it is encrypted by `rosbag/AesCbcEncryptor`"),
            "{text}"
        );
        assert!(
            text.contains("hint: decrypt it first with `rosbag decrypt`"),
            "{text}"
        );
    }
}

#[test]
fn a_flipped_bit_neither_loses_nor_invents_messages_silently() {
    let truth = short().messages.len();
    for (name, bytes) in chunked() {
        let mut whole = 0;
        for (at, bit) in places(19, bytes.len()).take(150) {
            let mut bytes = bytes.clone();
            bytes[at] ^= bit;
            let (_dir, path) = placed(name, &bytes);
            let Ok((report, kept)) = read(&path, Want::Payload) else {
                // The magic bytes identify the format and have no second copy.
                assert!(at < 16, "{name}: bit {bit} of byte {at}");
                continue;
            };
            let found = kept.stamps.len();
            assert!(
                found <= truth,
                "{name}: bit {bit} of byte {at}: {found} of {truth}"
            );
            assert!(
                found == truth || !report.complete,
                "{name}: bit {bit} of byte {at}: {found} of {truth} and no word"
            );
            whole += u32::from(found == truth);
        }
        assert!(
            whole > 100,
            "{name}: only {whole} of 150 flips cost nothing"
        );
    }
}

#[test]
fn a_chunk_listed_at_a_wrong_position_is_reported_once() {
    for (name, bytes) in tiny::bags()
        .into_iter()
        .filter(|(name, _)| !name.starts_with("front"))
    {
        let Some(info) = bytes.windows(10).rposition(|w| w == b"chunk_pos=") else {
            continue;
        };
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(name);
        // Into the chunk, before it, after it.
        for moved in [0x80, 0x40, 0x20, 0x10, 0x08, 0x01] {
            let mut bytes = bytes.clone();
            bytes[info + 10] ^= moved;
            fs::write(&path, &bytes).unwrap();
            let (report, kept) = read(&path, Want::Payload).unwrap();
            assert_eq!(kept.stamps.len(), MESSAGES, "{name}: {moved:x}");
            let payloads = kept.payloads().len();
            assert!(
                payloads == MESSAGES || payloads >= MESSAGES - 2 && !report.complete,
                "{name}: {moved:x}: {payloads}"
            );
        }
    }
}

#[test]
fn messages_lost_from_a_chunk_are_counted_by_its_index() {
    let bytes = unsummed(Some(mcap::Packed::Zstd));
    let truth = short().messages.len();
    // The first one describes the connections.
    let mut chunks = bytes.windows(4).enumerate().filter(|(_, w)| w == b"zstd");
    let chunk = chunks.nth(1).unwrap().0;
    let mut lost = 0;
    let (_, whole) = read_bytes("x.mcap", &bytes);
    let body = chunk + 12;
    let len = u64::from_le_bytes(bytes[chunk + 4..body].try_into().unwrap());
    let end = body + usize::try_from(len).unwrap();
    for at in body..end {
        let mut bytes = bytes.clone();
        bytes[at] ^= 0x10;
        let (report, kept) = read_bytes("x.mcap", &bytes);
        assert_eq!(kept.stamps.len(), truth, "byte {at}: {:?}", kept.notices);
        // Some bits of a Zstandard frame are ignored.
        let harmless = kept.payloads() == whole.payloads();
        assert!(
            harmless || !report.complete,
            "byte {at}: a wrong checksum and no word"
        );
        lost += usize::from(kept.messages.len() < truth);
    }
    assert!(
        lost > 0,
        "none of the flips cost a payload: the test is blind"
    );
}

#[test]
fn a_record_of_a_wrong_kind_does_not_end_the_file() {
    let bytes = unsummed(None);
    let truth = short().messages.len();
    let mut seen = 0;
    for (at, byte) in bytes.iter().enumerate() {
        let len = bytes.get(at + 1..at + 9);
        let len = len.map_or(0, |b| u64::from_le_bytes(b.try_into().unwrap()));
        // Message indexes: two bytes of channel, four of length, sixteen for each message.
        if *byte != 7 || len < 22 || len > 6 + 16 * truth as u64 || (len - 6) % 16 != 0 {
            continue;
        }
        for kind in [0, 2, 6, 12, 0x0f] {
            let mut bytes = bytes.clone();
            bytes[at] = kind;
            let (_, kept) = read_bytes("x.mcap", &bytes);
            assert_eq!(kept.stamps.len(), truth, "kind {kind} at byte {at}");
            seen += 1;
        }
    }
    assert!(seen > 8, "{seen}");
}

#[test]
fn messages_of_a_destroyed_chunk_are_counted_by_its_index() {
    let truth = short().messages.len();
    for bytes in [unsummed(None), unsummed(Some(mcap::Packed::Zstd))] {
        let bytes = &bytes;
        let is_chunk = |at: &usize| {
            let number =
                |at: usize| Some(u64::from_le_bytes(bytes.get(at..at + 8)?.try_into().ok()?));
            let name = bytes.get(at + 37).map_or(0, |n| usize::from(*n));
            let head = 40 + name as u64;
            bytes[*at] == 6 && number(at + 1) == number(at + 41 + name).map(|n| n + head)
        };
        let chunks: Vec<usize> = (0..bytes.len()).filter(is_chunk).collect();
        assert!(chunks.len() > 2, "{chunks:?}");
        // The first one describes the connections.
        for at in &chunks[1..] {
            let mut bytes = bytes.clone();
            bytes[*at] = 12;
            let (report, kept) = read_bytes("x.mcap", &bytes);
            assert_eq!(kept.stamps.len(), truth, "{:?}", kept.notices);
            assert!(!report.complete);
        }
    }
}

#[test]
fn reading_an_mcap_file_continues_after_damage() {
    let bytes = unsummed(Some(mcap::Packed::Lz4));
    let truth = short().messages.len();
    let second = bytes
        .windows(3)
        .enumerate()
        .filter(|(_, w)| w == b"lz4")
        .nth(1);
    let mut bytes = bytes.clone();
    let at = second.unwrap().0;
    bytes[at - 40..at].fill(0);
    let (report, kept) = read_bytes("x.mcap", &bytes);
    let found = kept.stamps.len();
    assert!(
        !report.complete && found < truth && found > truth / 2,
        "{found} of {truth}"
    );
}

#[test]
fn the_records_behind_a_broken_one_are_read_where_nothing_is_compressed() {
    let recording = short();
    let mcap = |chunked| {
        let options = mcap::Options {
            summary: false,
            compression: None,
            chunk: 1 << 20,
            chunked,
            ..mcap::Options::default()
        };
        mcap::write(&recording, &options)
    };
    let bag = rosbag1::write(&recording, Pack::None, 1 << 20);
    for (name, bytes) in [
        ("x.bag", rosbag1::unindexed(&bag)),
        ("chunk.mcap", mcap(true)),
        ("loose.mcap", mcap(false)),
    ] {
        let at = |part: &[u8]| bytes.windows(part.len()).position(|w| w == part);
        let scan = at(&[1; 400]).unwrap();
        let whole = read_bytes(name, &bytes).1.payloads();
        let without = |head: std::ops::Range<usize>| {
            let mut bytes = bytes.clone();
            bytes[head].fill(0);
            let (report, kept) = read_bytes(name, &bytes);
            assert!(!report.complete, "{name}");
            assert!(kept.stamps.len() >= kept.messages.len(), "{name}");
            kept.payloads()
        };
        let found = without(scan - 30..scan);
        assert_eq!(found.len(), whole.len() - 1, "{name}");
        assert!(found.iter().all(|one| whole.contains(one)), "{name}");
        // The head of the chunk, before its first record.
        let first = at(b"compression=none").map(|at| at - 20..at + 20);
        let first = first.or_else(|| at(b"nav_msgs/OccupancyGrid").map(|at| at - 45..at - 15));
        if name != "loose.mcap" {
            assert_eq!(without(first.unwrap()), whole, "{name}");
        }
    }
}

#[test]
fn connections_that_only_the_chunks_describe_are_found_there() {
    let recording = short();
    let bytes = rosbag1::write(&recording, Pack::Lz4, 4000);
    let field = b"conn=";
    let last = bytes.windows(5).rposition(|w| w == field).unwrap();
    let mut bytes = bytes.clone();
    bytes[last + 5] ^= 0x40;
    let (report, kept) = read_bytes("x.bag", &bytes);
    assert_eq!(kept.counts(), recording.counts(), "{:?}", kept.notices);
    assert_eq!((report.tier, report.complete), (Tier::Forward, false));
    let options = mcap::Options::default();
    let mut bytes = mcap::write(&recording, &options);
    let topic = bytes.windows(5).rposition(|w| w == b"/scan").unwrap();
    // A topic is preceded by its length, the schema, the channel.
    bytes[topic - 8] ^= 0x40;
    let (_, kept) = read_bytes("x.mcap", &bytes);
    assert_eq!(kept.counts(), recording.counts(), "{:?}", kept.notices);
}

/// The recording in two halves.
fn halves() -> [Recording; 2] {
    let whole = short();
    let (first, second) = whole.messages.split_at(whole.messages.len() / 2);
    [first, second].map(|messages| Recording {
        messages: messages.to_vec(),
        ..whole.clone()
    })
}

#[test]
fn chunks_missing_from_a_wrong_summary_are_read() {
    let truth = short().counts();
    let [first, second] = halves().map(|half| mcap::write(&half, &mcap::Options::default()));
    let number =
        |bytes: &[u8], at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
    let start = |bytes: &[u8]| usize::try_from(number(bytes, bytes.len() - 28)).unwrap();
    // The chunks of the second half, put before the end of the data of the first.
    let end = start(&first) - 13;
    let chunk = second.windows(4).position(|w| w == b"zstd").unwrap() - 41;
    let hidden = second[chunk..start(&second) - 13].to_vec();
    let mut bytes = [&first[..end], &hidden, &first[end..]].concat();
    let footer = bytes.len() - 28;
    for at in [footer, footer + 8] {
        let moved = number(&bytes, at) + hidden.len() as u64;
        bytes[at..at + 8].copy_from_slice(&moved.to_le_bytes());
    }
    // Without a checksum of the summary.
    bytes[footer + 16..footer + 20].fill(0);
    let (report, kept) = read_bytes("x.mcap", &bytes);
    assert_eq!(kept.counts(), truth, "{:?}", kept.notices);
    assert!(report.tier_reason.unwrap().contains("does not list"));
}

#[test]
fn chunks_missing_from_a_wrong_tail_are_read() {
    let truth = short().counts();
    let [first, second] = halves().map(|half| rosbag1::write(&half, Pack::None, 1_000_000));
    let place = |bytes: &[u8]| {
        let at = bytes.windows(10).position(|w| w == b"index_pos=").unwrap() + 10;
        (
            at,
            usize::try_from(u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap())).unwrap(),
        )
    };
    let ((at, end), (_, second_end)) = (place(&first), place(&second));
    let body = first
        .windows(12)
        .position(|w| w == b"compression=")
        .unwrap();
    let start = (0..body)
        .rev()
        .find(|at| first[*at..].starts_with(b"op=\x05"))
        .map_or(body, |op| op.min(body));
    // From the length of the chunk record's header on.
    let start = (0..start).rev().find(|at| {
        let len = u32::from_le_bytes(first[*at..*at + 4].try_into().unwrap()) as usize;
        (20..80).contains(&len) && at + 4 + len > body
    });
    let start = start.unwrap();
    let mut bytes = [&first[..end], &second[start..second_end], &first[end..]].concat();
    let moved = (end + second_end - start) as u64;
    bytes[at..at + 8].copy_from_slice(&moved.to_le_bytes());
    let (_, kept) = read_bytes("x.bag", &bytes);
    assert_eq!(kept.counts(), truth, "{:?}", kept.notices);
}

#[test]
fn rows_of_a_truncated_database_are_read() {
    let recording = support::small();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("x.db3");
    sqlite3::write(&recording, &path);
    let bytes = fs::read(&path).unwrap();
    for (percent, least) in [(95, 70), (80, 50), (50, 20)] {
        let cut = bytes.len() * percent / 100;
        for want in [Want::Stamps, Want::Payload] {
            let (_dir, path) = placed("cut.db3", &bytes[..cut]);
            let (report, kept) = read(&path, want).unwrap();
            let (found, truth) = (kept.stamps.len(), recording.messages.len());
            assert!(!report.complete && found < truth, "{percent} %: {found}");
            assert!(
                found * 100 > truth * least,
                "{percent} %: {found} of {truth}"
            );
            let kinds: Vec<_> = kept.notices.iter().map(|n| n.kind).collect();
            assert!(kinds.contains(&NoticeKind::Truncated), "{:?}", kept.notices);
        }
    }
    assert!(read(&path, Want::Payload).unwrap().0.complete);
}

#[test]
fn a_table_that_is_empty_unlike_its_index_is_damaged() {
    let (name, mut bytes) = tiny::bags().pop().unwrap();
    // A page of rows, and their number in two bytes.
    let page = [0x0d, 0, 0, 0, u8::try_from(MESSAGES).unwrap()];
    let at = bytes.windows(5).rposition(|w| w == page).unwrap();
    bytes[at + 4] = 0;
    let (report, kept) = read_bytes(name, &bytes);
    assert_eq!((kept.stamps.len(), report.complete), (0, false));
}

#[test]
fn table_names_are_case_insensitive() {
    let recording = short();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("x.db3");
    sqlite3::write(&recording, &path);
    let db = rusqlite::Connection::open(&path).unwrap();
    db.execute_batch(
        "ALTER TABLE topics RENAME TO a; ALTER TABLE a RENAME TO Topics;
         ALTER TABLE messages RENAME TO b; ALTER TABLE b RENAME TO MESSAGES;
         ALTER TABLE MESSAGES RENAME COLUMN topic_id TO Topic_ID;",
    )
    .unwrap();
    db.close().unwrap();
    assert_eq!(
        read(&path, Want::Payload).unwrap().1.counts(),
        recording.counts()
    );
}

#[test]
fn messages_at_the_end_of_time_are_counted() {
    let mut recording = Recording::default();
    let clock = recording.publisher("/clock", "/clock", "std_msgs/String");
    for at in [i64::MAX - 1_000_000_000, i64::MAX] {
        recording.messages.push((clock, at, vec![0; 8]));
    }
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("x.db3");
    sqlite3::write(&recording, &path);
    let (code, shown) = bagreel(&["info", path.to_str().unwrap(), "--format", "json"]);
    assert!(
        code == Some(0) && shown.contains("\"messages\": 2"),
        "{shown}"
    );
    recording.messages.remove(0);
    let (_dir, path) = placed(
        "x.mcap",
        &mcap::write(&recording, &mcap::Options::default()),
    );
    let (code, shown) = bagreel(&["info", path.to_str().unwrap(), "--format", "json"]);
    assert!(
        code == Some(0) && shown.contains("\"messages\": 1"),
        "{shown}"
    );
}

#[test]
fn messages_set_aside_set_the_exit_code() {
    let mut recording = short();
    recording.messages[5].1 += 1 << 62;
    recording.messages.sort_by_key(|m| m.1);
    let (_dir, path) = placed(
        "x.mcap",
        &mcap::write(&recording, &mcap::Options::default()),
    );
    let (code, shown) = bagreel(&["info", path.to_str().unwrap()]);
    assert!(
        code == Some(3) && shown.contains("impossible time"),
        "{shown}"
    );
}

#[test]
fn a_second_reader_that_stops_verifies_nothing() {
    let mut bytes = mcap::write(&short(), &mcap::Options::default());
    let (_dir, path) = placed("sound.mcap", &bytes);
    let (code, shown) = bagreel(&["info", "--verify", path.to_str().unwrap()]);
    assert!(
        code == Some(0) && shown.contains("counts the same"),
        "{shown}"
    );
    // The checksum of the last chunk precedes the name of its compression.
    let last = bytes
        .windows(4)
        .enumerate()
        .filter(|(at, w)| *w == b"zstd" && bytes[at - 4..*at] == 4u32.to_le_bytes());
    let data_end = bytes.len() - 8 - 29;
    let last = last
        .map(|(at, _)| at)
        .rfind(|at| bytes[at - 41] == 6 && *at < data_end);
    bytes[last.unwrap() - 5] ^= 1;
    let (_dir, path) = placed("x.mcap", &bytes);
    let (code, shown) = bagreel(&["info", "--verify", path.to_str().unwrap()]);
    assert_eq!(code, Some(3), "{shown}");
    assert!(shown.contains("could not be verified"), "{shown}");
    assert!(
        !shown.contains("a second reader counts the same"),
        "{shown}"
    );
}

#[test]
fn a_record_longer_than_its_chunk_stops_the_second_reader() {
    let options = mcap::Options {
        compression: None,
        ..mcap::Options::default()
    };
    let mut bytes = mcap::write(&short(), &options);
    let truth = short().messages.len();
    // The first message: its kind, eight bytes of length, the channel.
    let channel = bytes
        .windows(10)
        .position(|w| w[0] == 5 && w[2..9] == [0; 7]);
    let message = channel.unwrap_or_else(|| {
        let long = bytes
            .windows(10)
            .position(|w| w[0] == 5 && w[3..9] == [0; 6]);
        long.unwrap()
    });
    bytes[message + 3] = 0x7f;
    let (_dir, path) = placed("x.mcap", &bytes);
    let options = OpenOptions { verify: true };
    let (report, kept) = read_as(&path, Want::Payload, None, &options).unwrap();
    assert!(!report.complete && kept.stamps.len() < truth, "{report:?}");
}

#[test]
fn the_head_of_a_record_beyond_its_chunk_stops_the_second_reader() {
    let options = mcap::Options {
        compression: None,
        chunk: 4000,
        ..mcap::Options::default()
    };
    let bytes = mcap::write(&short(), &options);
    // A chunk: its kind, its length, two times, the unpacked length, a checksum, no compression, the packed length.
    let is_chunk = |at: &usize| {
        let number = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        bytes[*at] == 6 && bytes.len() > at + 49 && number(at + 1) == number(at + 41) + 40
    };
    let chunk = (0..bytes.len()).find(is_chunk).unwrap();
    let packed = u64::from_le_bytes(bytes[chunk + 41..chunk + 49].try_into().unwrap());
    // Five bytes after its last record: the beginning of a head, which continues after the chunk.
    let mut bytes = bytes.clone();
    let end = chunk + 49 + usize::try_from(packed).unwrap();
    for (at, less) in [(1, 40), (41, 0), (25, 0)] {
        let longer = packed + 5 + less;
        bytes[chunk + at..chunk + at + 8].copy_from_slice(&longer.to_le_bytes());
    }
    bytes[chunk + 33..chunk + 37].fill(0);
    bytes.splice(end..end, [0x80, 0, 0, 0, 0]);
    bytes.splice(end + 5..end + 5, [0; 20]);
    let (_dir, path) = placed("x.mcap", &bytes);
    let options = OpenOptions { verify: true };
    let (report, _) = read_as(&path, Want::Payload, None, &options).unwrap();
    assert!(!report.complete, "{report:?}");
}

#[test]
fn unverified_bags_are_reported() {
    let bytes = rosbag1::unindexed(&rosbag1::write(&short(), Pack::Lz4, 4000));
    let (_dir, path) = placed("killed.bag.active", &bytes);
    let (_, shown) = bagreel(&["info", "--verify", path.to_str().unwrap()]);
    assert!(shown.contains("could not be verified"), "{shown}");
    assert!(
        !shown.contains("a second reader counts the same"),
        "{shown}"
    );
}

#[test]
fn a_bag_given_twice_counts_once_and_is_reported() {
    let recording = short();
    let (_dir, path) = placed(
        "x.mcap",
        &mcap::write(&recording, &mcap::Options::default()),
    );
    let path = path.to_str().unwrap();
    let (code, shown) = bagreel(&["info", path, path]);
    let count = format!("{} messages", recording.messages.len());
    assert!(code == Some(0) && shown.contains("given twice"), "{shown}");
    assert!(shown.contains(&count), "no `{count}` in {shown}");
    let (code, shown) = bagreel(&["info", "-", "-"]);
    assert!(code == Some(2) && shown.contains("only once"), "{shown}");
    let (code, shown) = bagreel(&["info", "--verify", "-"]);
    assert!(
        code == Some(2) && shown.contains("reads a bag twice"),
        "{shown}"
    );
}

#[test]
fn a_survey_reports_and_lists_unreadable_bags() {
    let (dir, _) = placed(
        "good.mcap",
        &mcap::write(&short(), &mcap::Options::default()),
    );
    let folder = dir.path().join("bags");
    fs::create_dir(&folder).unwrap();
    fs::rename(dir.path().join("good.mcap"), folder.join("good.mcap")).unwrap();
    fs::create_dir(folder.join("below")).unwrap();
    fs::copy(folder.join("good.mcap"), folder.join("below/other.mcap")).unwrap();
    // A folder of storage files would be one recording.
    fs::rename(folder.join("good.mcap"), folder.join("below/third.mcap")).unwrap();
    let (code, shown) = bagreel(&["info", folder.to_str().unwrap()]);
    assert_eq!(code, Some(0), "{shown}");
    fs::write(folder.join("bad.bag"), b"#ROSBAG V1.0\n").unwrap();
    let (code, shown) = bagreel(&["info", folder.to_str().unwrap()]);
    assert!(code == Some(3) && shown.contains("bad.bag"), "{shown}");
}

#[test]
#[cfg(unix)]
fn more_parts_than_the_limit_of_open_files_are_all_read() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("run");
    fs::create_dir(&folder).unwrap();
    let mut paths = Vec::new();
    for part in 0..90i64 {
        let mut recording = Recording::default();
        let one = recording.publisher("/one", "/one", "std_msgs/String");
        recording
            .messages
            .push((one, ORIGIN + part * 1_000_000_000, vec![0; 8]));
        let name = format!("run_{part}.mcap");
        fs::write(
            folder.join(&name),
            mcap::write(&recording, &mcap::Options::default()),
        )
        .unwrap();
        paths.push(format!("run/{name}"));
    }
    for inputs in ["run".to_owned(), paths.join(" ")] {
        let command = format!(
            "ulimit -n 40; exec {} info {inputs} --format json",
            env!("CARGO_BIN_EXE_bagreel")
        );
        let mut run = Command::new("sh");
        let run = run.current_dir(dir.path()).args(["-c", &command]);
        let (code, shown) = said(&run.output().unwrap());
        assert!(
            code == Some(0) && shown.contains("\"messages\": 90"),
            "{shown}"
        );
    }
}

#[test]
#[cfg(unix)]
fn a_link_out_of_a_folder_is_not_followed() {
    let recording = short();
    let outside = tempfile::tempdir().unwrap();
    let secret = outside.path().join("secret.db3");
    sqlite3::write(&recording, &secret);
    for named in [true, false] {
        let dir = tempfile::tempdir_in(outside.path()).unwrap();
        if named {
            sqlite3::write_metadata(&recording, dir.path(), "sqlite3", &["link.db3"]);
        }
        std::os::unix::fs::symlink(&secret, dir.path().join("link.db3")).unwrap();
        let refused = read(dir.path(), Want::Stamps).map(|(_, kept)| kept.stamps.len());
        let why = refused.expect_err("the link was followed").to_string();
        assert!(
            why.contains("link.db3") && why.contains("not followed"),
            "{why}"
        );
        // It is also ignored beside a file of the folder's own.
        sqlite3::write(&recording, &dir.path().join("own.db3"));
        let (_, kept) = read(dir.path(), Want::Stamps).unwrap();
        assert_eq!(kept.stamps.len(), recording.messages.len());
    }
}

/// A chunk whose compressed zeros expand to terabytes, in a ROS 1 bag that is read in each of the three ways.
fn bombs() -> Vec<(&'static str, Vec<u8>)> {
    let mut recording = Recording::default();
    let bomb = recording.publisher("/rosout", "/rosout", "rosgraph_msgs/Log");
    recording.send(bomb, (0, 2), 1, &[0; 64]);
    rosbag1::bombs(&recording)
}

#[test]
fn a_decompression_bomb_is_refused_in_every_format() {
    for (name, bytes) in bombs() {
        assert!(bytes.len() < 1_000_000, "{name}");
        let (_dir, path) = placed("bomb.bag", &bytes);
        let (report, _) = read(&path, Want::Payload).unwrap();
        assert!(!report.complete, "{name}");
    }
}

/// Compares with the reports that come with the hostile files, if available.
#[test]
fn hostile_files_are_read_as_far_as_possible() {
    let Some(folder) = support::shared("data/hostile") else {
        return;
    };
    let count = |name: &str| {
        let (report, kept) = read(&folder.join(name), Want::Stamps).unwrap();
        (kept.stamps.len(), report.complete)
    };
    assert_eq!(count("03_forward_crc.mcap"), (30, false));
    assert_eq!(count("03_forward_false_data_end.mcap"), (30, false));
    assert_eq!(count("03_forward_opcode.mcap"), (30, false));
    assert!(count("04_cut95.db3").0 >= 620);
    let path: &Path = &folder.join("06_max_ts.db3");
    let (_, kept) = read(path, Want::Stamps).unwrap();
    assert!(kept.stamps.iter().all(|(_, at, _)| *at <= Stamp::LAST));
}
