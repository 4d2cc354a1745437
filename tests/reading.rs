//! Tests of reading bags in every way: healthy ones by index, damaged ones as far as possible, hostile ones bounded.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use bagreel::bag::{self, FORMATS, Input, InputKind, OpenOptions, Tier, Want};
use bagreel::internals::base::error::Error;
use bagreel::internals::base::notice::NoticeKind;
use bagreel::internals::base::time::{Span, Stamp};
use tempfile::TempDir;

use crate::support::rosbag1::Pack;
use crate::support::{self, Kept, ORIGIN, Recording, mcap, read, read_as, rosbag1, sqlite3};

/// A folder with one file in it.
fn placed(name: &str, bytes: &[u8]) -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    fs::write(&path, bytes).unwrap();
    (dir, path)
}

/// The recording in every format with an index.
fn everywhere(recording: &Recording) -> Vec<(String, Vec<u8>)> {
    let mut all = Vec::new();
    for how in [Pack::None, Pack::Bz2, Pack::Lz4] {
        all.push((format!("{how:?}.bag"), rosbag1::write(recording, how, 4000)));
    }
    for profile in ["ros1", "ros2"] {
        for compression in [None, Some(mcap::Packed::Zstd), Some(mcap::Packed::Lz4)] {
            let name = format!("{profile}_{compression:?}.mcap");
            let options = mcap::Options {
                profile,
                compression,
                ..mcap::Options::default()
            };
            all.push((name, mcap::write(recording, &options)));
        }
    }
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("x.db3");
    sqlite3::write(recording, &path);
    all.push(("x.db3".to_owned(), fs::read(path).unwrap()));
    all
}

#[test]
fn the_same_mission_has_the_same_counts_in_every_format() {
    let recording = support::small();
    for (name, bytes) in everywhere(&recording) {
        let (_dir, path) = placed(&name, &bytes);
        let (report, kept) = read(&path, Want::Payload).unwrap();
        assert_eq!(kept.counts(), recording.counts(), "{name}");
        assert_eq!(
            (report.tier, report.complete),
            (Tier::Index, true),
            "{name}"
        );
        assert_eq!(kept.messages.len(), recording.messages.len(), "{name}");
        assert!(kept.notices.is_empty(), "{name}: {:?}", kept.notices);
        let sizes: u64 = kept.stamps.iter().filter_map(|s| s.2).map(u64::from).sum();
        let sent: usize = recording.messages.iter().map(|m| m.2.len()).sum();
        assert_eq!(sizes, sent as u64, "{name}");
    }
}

#[test]
fn publishers_are_known_if_the_format_records_them() {
    let recording = support::small();
    let publishers = |kept: &Kept| {
        kept.count(|c| {
            (
                c.topic.to_string(),
                c.publisher.as_ref().map(ToString::to_string),
            )
        })
    };
    let mut sent = BTreeMap::new();
    for (publisher, ..) in &recording.messages {
        let p = &recording.publishers[*publisher];
        *sent
            .entry((p.topic.clone(), Some(p.node.clone())))
            .or_default() += 1;
    }
    for (name, bytes) in everywhere(&recording) {
        let (_dir, path) = placed(&name, &bytes);
        let kept = read(&path, Want::Stamps).unwrap().1;
        if name.contains(".bag") || name.starts_with("ros1") {
            assert_eq!(publishers(&kept), sent, "{name}");
            assert!(kept.connections[0].latching, "{name}");
        } else {
            assert!(
                kept.connections.iter().all(|c| c.publisher.is_none()),
                "{name}"
            );
        }
    }
}

#[test]
fn the_span_is_known_before_reading() {
    let recording = support::small();
    let start = Stamp(recording.messages[0].1);
    let end = Stamp(recording.messages.last().unwrap().1 + 1);
    for (name, bytes) in everywhere(&recording) {
        let (_dir, path) = placed(&name, &bytes);
        let mut reader = bag::open(&Input::Path(path), &OpenOptions::default()).unwrap();
        assert_eq!(reader.span().unwrap(), Some(Span { start, end }), "{name}");
    }
}

#[test]
fn a_range_contains_exactly_the_messages_inside() {
    let recording = support::small();
    let at = |s: i64| Stamp(ORIGIN + s * 1_000_000_000);
    let range = Span {
        start: at(10),
        end: at(35),
    };
    let inside = |t: i64| range.contains(Stamp(t));
    let mut expected = recording.clone();
    expected.messages.retain(|m| inside(m.1));
    for (name, bytes) in everywhere(&recording) {
        let (_dir, path) = placed(&name, &bytes);
        let (_, kept) =
            read_as(&path, Want::Payload, Some(range), &OpenOptions::default()).unwrap();
        assert_eq!(kept.counts(), expected.counts(), "{name}");
        assert_eq!(kept.messages.len(), expected.messages.len(), "{name}");
        assert_eq!(
            kept.connections.len(),
            read(&path, Want::Stamps).unwrap().1.connections.len(),
            "{name}"
        );
    }
}

#[test]
fn the_second_reader_agrees() {
    let recording = support::small();
    for (name, bytes) in everywhere(&recording) {
        let (_dir, path) = placed(&name, &bytes);
        let options = OpenOptions { verify: true };
        let (report, second) = read_as(&path, Want::Payload, None, &options).unwrap();
        let (_, first) = read(&path, Want::Payload).unwrap();
        assert_eq!(
            (report.tier, report.tier_reason, report.complete),
            (Tier::Verify, None, true),
            "{name}"
        );
        assert_eq!(second.payloads(), first.payloads(), "{name}");
        assert_eq!(second.counts(), first.counts(), "{name}");
    }
}

#[test]
fn a_bag_without_index_is_read_from_the_front() {
    let recording = support::small();
    for how in [Pack::None, Pack::Bz2, Pack::Lz4] {
        let whole = rosbag1::write(&recording, how, 4000);
        let (_dir, path) = placed("killed.bag.active", &rosbag1::unindexed(&whole));
        let (report, kept) = read(&path, Want::Payload).unwrap();
        assert_eq!((report.tier, report.complete), (Tier::Forward, true));
        assert_eq!(kept.counts(), recording.counts());
        let (_dir, path) = placed("whole.bag", &whole);
        assert_eq!(
            kept.payloads(),
            read(&path, Want::Payload).unwrap().1.payloads()
        );
    }
    let default = mcap::Options::default;
    for options in [
        mcap::Options {
            summary: false,
            ..default()
        },
        mcap::Options {
            message_index: false,
            ..default()
        },
        mcap::Options {
            chunked: false,
            ..default()
        },
    ] {
        let (_dir, path) = placed("x.mcap", &mcap::write(&recording, &options));
        let (report, kept) = read(&path, Want::Payload).unwrap();
        assert_eq!(
            (report.tier, report.complete),
            (Tier::Forward, true),
            "{options:?}"
        );
        assert_eq!(kept.counts(), recording.counts(), "{options:?}");
    }
}

#[test]
fn messages_before_the_cut_are_read() {
    let recording = support::small();
    for (name, bytes) in everywhere(&recording) {
        if name.contains(".db3") {
            continue;
        }
        let mut before = 0;
        for part in 1..8 {
            let (_dir, path) = placed(&name, &bytes[..bytes.len() * part / 8]);
            let (report, kept) = read(&path, Want::Payload).unwrap();
            assert!(
                !report.complete && report.tier == Tier::Forward,
                "{name} {part}"
            );
            assert!(kept.stamps.len() >= before, "{name} {part}");
            assert!(
                kept.notices.iter().any(|n| n.kind == NoticeKind::Truncated),
                "{name} {part}"
            );
            before = kept.stamps.len();
        }
        assert!(before > recording.messages.len() / 2, "{name}: {before}");
    }
}

#[test]
fn reading_from_the_front_continues_after_damage() {
    let recording = support::small();
    let mut bytes = rosbag1::unindexed(&rosbag1::write(&recording, Pack::Lz4, 4000));
    let chunks: Vec<usize> = (0..bytes.len())
        .filter(|at| bytes[*at..].starts_with(b"op=\x05"))
        .collect();
    // Garbage over the head of a chunk in the middle.
    let at = chunks[chunks.len() / 2];
    bytes[at - 30..at + 20].fill(0x77);
    let (_dir, path) = placed("x.bag", &bytes);
    let (report, kept) = read(&path, Want::Stamps).unwrap();
    assert!(!report.complete);
    let (found, sent) = (kept.stamps.len(), recording.messages.len());
    assert!(found < sent && found > sent * 9 / 10, "{found} of {sent}");
}

#[test]
fn a_wrong_index_loses_no_message() {
    let recording = support::small();
    let mut bytes = rosbag1::write(&recording, Pack::Lz4, 4000);
    // The count of the first index record is wrong.
    let field = b"\x0a\0\0\0count=";
    let at = bytes.windows(field.len()).position(|w| w == field).unwrap() + field.len();
    bytes[at] = bytes[at].wrapping_add(1);
    let (_dir, path) = placed("x.bag", &bytes);
    let (report, kept) = read(&path, Want::Stamps).unwrap();
    assert_eq!(kept.counts(), recording.counts());
    assert_eq!(report.tier, Tier::Index);
    assert_eq!(kept.notices[0].kind, NoticeKind::Damaged);
}

#[test]
fn rows_in_a_leftover_log_are_read_without_creating_files() {
    let recording = support::small();
    let source = tempfile::tempdir().unwrap();
    let path = source.path().join("x.db3");
    sqlite3::write(&recording, &path);
    let db = rusqlite::Connection::open(&path).unwrap();
    db.pragma_update(None, "journal_mode", "wal").unwrap();
    db.pragma_update(None, "wal_autocheckpoint", 0).unwrap();
    db.execute(
        "INSERT INTO messages SELECT NULL, topic_id, timestamp, data FROM messages",
        [],
    )
    .unwrap();
    let crashed = tempfile::tempdir().unwrap();
    for file in ["x.db3", "x.db3-wal"] {
        fs::copy(source.path().join(file), crashed.path().join(file)).unwrap();
    }
    let (_, kept) = read(&crashed.path().join("x.db3"), Want::Payload).unwrap();
    assert_eq!(kept.stamps.len(), 2 * recording.messages.len());
    let beside: Vec<_> = fs::read_dir(crashed.path())
        .unwrap()
        .map(|e| e.unwrap().file_name())
        .collect();
    assert_eq!(beside.len(), 2, "{beside:?}");
}

#[test]
fn invalid_rows_are_counted_and_skipped() {
    let recording = support::small();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("x.db3");
    sqlite3::write(&recording, &path);
    let db = rusqlite::Connection::open(&path).unwrap();
    db.execute_batch(
        "INSERT INTO messages VALUES (NULL, 999, 5, x'00');
         INSERT INTO messages VALUES (NULL, 1, 'noon', x'00');
         INSERT INTO messages VALUES (NULL, 1, 2.5, x'00');",
    )
    .unwrap();
    db.close().unwrap();
    let (report, kept) = read(&path, Want::Payload).unwrap();
    assert_eq!(kept.counts(), recording.counts());
    assert!(!report.complete);
    let lost: u64 = kept
        .notices
        .iter()
        .filter(|n| n.kind == NoticeKind::Damaged)
        .map(|n| n.count)
        .sum();
    assert_eq!(lost, 3);
}

#[test]
fn a_database_with_views_or_computed_columns_is_refused() {
    let schemas = [
        "CREATE TABLE topics(id, name, type); CREATE VIEW messages AS WITH RECURSIVE n(x) AS (VALUES(1) UNION ALL SELECT x FROM n) \
         SELECT x AS topic_id, x AS timestamp, x AS data FROM n",
        "CREATE TABLE topics(id, name, type); CREATE TABLE messages(id INTEGER PRIMARY KEY, timestamp, data, \
         topic_id AS (length(hex(zeroblob(400000000)))))",
        "CREATE TABLE other(x)",
    ];
    for schema in schemas {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("x.db3");
        let db = rusqlite::Connection::open(&path).unwrap();
        db.execute_batch(schema).unwrap();
        db.close().unwrap();
        let refused = read(&path, Want::Payload).map(|_| ());
        assert!(
            matches!(refused, Err(Error::Malformed { .. })),
            "{refused:?}"
        );
    }
}

/// A folder with the recording split in two.
fn split(recording: &Recording) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    let middle = recording.messages.len() / 2;
    for (part, messages) in [&recording.messages[..middle], &recording.messages[middle..]]
        .iter()
        .enumerate()
    {
        let mut half = recording.clone();
        half.messages = messages.to_vec();
        // The parts number their topics differently.
        if part == 1 {
            half.publishers.push(support::Publisher {
                topic: "/new".to_owned(),
                ..Default::default()
            });
            half.publishers.reverse();
            let last = half.publishers.len() - 1;
            half.messages.iter_mut().for_each(|m| m.0 = last - m.0);
        }
        sqlite3::write(&half, &dir.path().join(format!("run_{part}.db3")));
    }
    sqlite3::write_metadata(
        recording,
        dir.path(),
        "sqlite3",
        &["run_0.db3", "run_1.db3"],
    );
    dir
}

#[test]
fn parts_with_different_topic_ids_are_one_recording() {
    let recording = support::small();
    let dir = split(&recording);
    let (report, kept) = read(dir.path(), Want::Payload).unwrap();
    assert_eq!((kept.counts(), report.complete), (recording.counts(), true));
    assert_eq!(kept.connections.len(), recording.counts().len() + 1);
    assert_eq!(report.format, "sqlite3");
    fs::remove_file(dir.path().join("metadata.yaml")).unwrap();
    assert_eq!(
        read(dir.path(), Want::Stamps).unwrap().1.counts(),
        recording.counts()
    );
}

#[test]
fn missing_and_renamed_parts_are_found_or_reported() {
    let recording = support::small();
    let dir = split(&recording);
    fs::remove_file(dir.path().join("run_1.db3")).unwrap();
    let (report, kept) = read(dir.path(), Want::Stamps).unwrap();
    assert!(
        !report.complete && kept.notices.iter().any(|n| n.text.contains("run_1.db3")),
        "{:?}",
        kept.notices
    );
    fs::rename(dir.path().join("run_0.db3"), dir.path().join("renamed.db3")).unwrap();
    let (_, kept) = read(dir.path(), Want::Stamps).unwrap();
    assert_eq!(kept.stamps.len(), recording.messages.len() / 2);
    assert!(
        kept.notices.iter().any(|n| n.text.contains("instead")),
        "{:?}",
        kept.notices
    );
}

#[test]
fn a_path_that_leaves_the_folder_is_not_followed() {
    let recording = support::small();
    let outside = tempfile::tempdir().unwrap();
    let secret = outside.path().join("secret.db3");
    sqlite3::write(&recording, &secret);
    for name in [secret.to_str().unwrap(), "../secret.db3"] {
        let dir = tempfile::tempdir_in(outside.path()).unwrap();
        sqlite3::write_metadata(&recording, dir.path(), "sqlite3", &[name]);
        let refused = read(dir.path(), Want::Stamps).map(|_| ());
        let why = refused.expect_err("the path was followed").to_string();
        assert!(
            why.contains("secret.db3") && why.contains("not followed"),
            "{why}"
        );
    }
}

#[test]
fn files_compressed_as_a_whole_are_read() {
    let recording = support::small();
    for (name, bytes) in everywhere(&recording) {
        let packed = zstd::encode_all(&bytes[..], 1).unwrap();
        let (dir, path) = placed(&format!("{name}.zstd"), &packed);
        let (report, kept) = read(&path, Want::Payload).unwrap();
        assert_eq!(kept.counts(), recording.counts(), "{name}");
        assert_eq!(
            (report.complete, report.compression),
            (true, vec!["zstd".to_owned()]),
            "{name}"
        );
        assert_eq!(
            fs::read_dir(dir.path()).unwrap().count(),
            1,
            "nothing appears beside {name}"
        );
    }
}

#[test]
fn files_that_are_not_bags_are_reported_with_advice() {
    let cases: &[(&[u8], &str)] = &[
        (b"", "empty"),
        (
            b"version https://git-lfs.github.com/spec/v1\noid sha256:00\n",
            "git-LFS",
        ),
        (b"PK\x03\x04", "zip"),
        (&[0; 600], "zeros"),
        (b"#ROSRECORD V1.2\n", "V1.2"),
        (b"hello", "unrecognized format"),
    ];
    for (bytes, word) in cases {
        let (_dir, path) = placed("x.bag", bytes);
        let error = read(&path, Want::Stamps).map(|_| ()).unwrap_err();
        assert!(error.to_string().contains(word), "{error}");
        assert!(!error.hint().is_empty(), "{error}");
    }
    let (dir, path) = placed("x.json", b" {\"schema\": 1}");
    assert!(matches!(
        bag::sniff(&Input::Path(path)),
        Ok(InputKind::Json)
    ));
    assert!(matches!(
        read(dir.path(), Want::Stamps),
        Err(Error::UnknownBag { .. })
    ));
}

#[test]
#[cfg(unix)]
fn a_pipe_is_read_from_the_front() {
    let recording = support::small();
    for (name, bytes) in everywhere(&recording) {
        let dir = tempfile::tempdir().unwrap();
        let pipe = dir.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        if !made.is_ok_and(|s| s.success()) {
            return println!("skipped: no mkfifo");
        }
        let writer = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::write(pipe, bytes)
        });
        let mut kept = Kept {
            want: Want::Payload,
            ..Kept::default()
        };
        let read = bag::open(&Input::Path(pipe), &OpenOptions::default());
        match read.and_then(|mut r| r.read(None, &mut kept)) {
            Err(e) => assert!(
                name.contains(".db3") && e.to_string().contains("pipe"),
                "{e}"
            ),
            Ok(report) => {
                assert_eq!(
                    (report.tier, report.complete),
                    (Tier::Forward, true),
                    "{name}"
                );
                assert_eq!(kept.counts(), recording.counts(), "{name}");
            }
        }
        // A reader that gives up early leaves the writer with a broken pipe.
        let _ = writer.join().unwrap();
    }
}

/// Pseudo-random numbers, the same on every machine.
struct Dice(u64);

impl Dice {
    fn member_list(&mut self, below: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        usize::try_from((self.0 >> 33) % below as u64).unwrap()
    }
}

/// Damages a bag: flipped bytes, big numbers, cuts, gaps of zeros, doubled parts.
fn damage(bytes: &[u8], dice: &mut Dice) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=dice.member_list(3) {
        let at = dice.member_list(bytes.len());
        let len = 1 + dice.member_list(64);
        let end = (at + len).min(bytes.len());
        match dice.member_list(8) {
            0..=2 => bytes[at] ^= 1 << dice.member_list(8),
            3 => bytes[at..end.min(at + 8)].fill(0xff),
            4 => bytes[at..end].fill(0),
            5 => drop(bytes.drain(at..end)),
            6 => {
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            _ => bytes.truncate(at.max(1)),
        }
    }
    bytes
}

#[test]
fn damage_never_causes_panics_hangs_or_invented_messages() {
    let mut recording = support::small();
    recording.messages.retain(|m| m.1 % 7 < 3 || m.0 == 0);
    recording.messages.truncate(150);
    let mut dice = Dice(2026);
    for (name, bytes) in everywhere(&recording) {
        // SQLite is slow to open, and handles damage itself.
        let rounds = if name.contains(".db3") { 15 } else { 60 };
        for round in 0..rounds {
            let (_dir, path) = placed(&name, &damage(&bytes, &mut dice));
            for options in [OpenOptions::default(), OpenOptions { verify: true }] {
                if let Ok((_, kept)) = read_as(&path, Want::Payload, None, &options) {
                    let most = recording.messages.len() * 3;
                    assert!(
                        kept.stamps.len() <= most,
                        "{name} round {round}: {} messages",
                        kept.stamps.len()
                    );
                }
            }
        }
    }
}

/// Copies of a bag, each with one occurrence of the number after `field` replaced.
fn with_number(bytes: &[u8], field: &[u8], value: &[u8]) -> Vec<Vec<u8>> {
    let places = (0..bytes.len()).filter(|at| bytes[*at..].starts_with(field));
    let changed = places.map(|at| {
        let mut bytes = bytes.to_vec();
        let start = at + field.len();
        bytes[start..start + value.len()].copy_from_slice(value);
        bytes
    });
    changed.take(4).collect()
}

#[test]
fn wrong_numbers_are_tolerated_or_reported() {
    let recording = support::small();
    let bag = rosbag1::write(&recording, Pack::Lz4, 20_000);
    let huge = [0xff; 8];
    let mut cases = Vec::new();
    for field in ["index_pos=", "chunk_pos=", "start_time=", "end_time="] {
        cases.extend(with_number(&bag, field.as_bytes(), &huge));
        cases.extend(with_number(&bag, field.as_bytes(), &[0; 8]));
        cases.extend(with_number(&bag, field.as_bytes(), &5000u64.to_le_bytes()));
    }
    for field in ["count=", "conn=", "size=", "ver="] {
        cases.extend(with_number(&bag, field.as_bytes(), &huge[..4]));
        cases.extend(with_number(&bag, field.as_bytes(), &[0; 4]));
    }
    for bytes in cases {
        let (_dir, path) = placed("x.bag", &bytes);
        for options in [OpenOptions::default(), OpenOptions { verify: true }] {
            let (report, kept) = read_as(&path, Want::Payload, None, &options).unwrap();
            let all = kept.stamps.len() == recording.messages.len();
            assert!(
                all || !report.complete,
                "{} messages without a notice",
                kept.stamps.len()
            );
        }
    }
}

#[test]
fn offsets_of_an_mcap_summary_are_not_trusted() {
    let recording = support::small();
    let bytes = mcap::write(&recording, &mcap::Options::default());
    let footer = bytes.len() - 8 - 20;
    let start = usize::try_from(u64::from_le_bytes(
        bytes[footer..footer + 8].try_into().unwrap(),
    ))
    .unwrap();
    // Every eight bytes of the summary in turn, as the largest number.
    for at in (start..footer).step_by(23) {
        let mut bytes = bytes.clone();
        bytes[at..at + 8].fill(0xff);
        let (_dir, path) = placed("x.mcap", &bytes);
        let (report, kept) = read(&path, Want::Payload).unwrap();
        let all = kept.counts() == recording.counts();
        // Channel names come from the summary alone if it is used.
        let renamed = kept.stamps.len() == recording.messages.len();
        assert!(
            all || renamed || !report.complete,
            "at {at}: {} messages without a notice",
            kept.stamps.len()
        );
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_decompression_bomb_takes_no_memory() {
    let mut recording = Recording::default();
    let bomb = recording.publisher("/bomb", "/bomb", "std_msgs/String");
    recording.send(bomb, (0, 1), 1, &vec![0; 500 << 20]);
    let bag = rosbag1::write(&recording, Pack::Lz4, 1);
    for bytes in [rosbag1::unindexed(&bag), bag] {
        let (_dir, path) = placed("bomb.bag", &bytes);
        let limited = format!(
            "ulimit -v 400000; exec {} info {}",
            env!("CARGO_BIN_EXE_bagreel"),
            path.display()
        );
        let run = std::process::Command::new("sh")
            .args(["-c", &limited])
            .output()
            .unwrap();
        assert!(matches!(run.status.code(), Some(0 | 3)), "{run:?}");
    }
}

/// Messages per topic according to the crates `rosbag` and `mcap`, and SQL, none of it our code. `None` if they fail.
fn independent(path: &Path) -> Option<BTreeMap<String, u64>> {
    let mut counts = BTreeMap::new();
    let mut head = [0; 16];
    std::io::Read::read(&mut fs::File::open(path).ok()?, &mut head).ok()?;
    if head.starts_with(b"#ROSBAG") {
        let bytes = fs::read(path).ok()?;
        let at = bytes.windows(10).position(|w| w == b"index_pos=")? + 10;
        let index_pos = u64::from_le_bytes(bytes.get(at..at + 8)?.try_into().ok()?);
        if index_pos == 0 || index_pos > bytes.len() as u64 {
            return None;
        }
        let bag = ::rosbag::RosBag::new(path).ok()?;
        let mut topics = BTreeMap::new();
        for record in bag.chunk_records() {
            let ::rosbag::ChunkRecord::Chunk(chunk) = record.ok()? else {
                continue;
            };
            for message in chunk.messages() {
                match message.ok()? {
                    ::rosbag::MessageRecord::Connection(c) => {
                        drop(topics.insert(c.id, c.storage_topic.to_owned()));
                    }
                    ::rosbag::MessageRecord::MessageData(m) => {
                        *counts.entry(topics.get(&m.conn_id)?.clone()).or_default() += 1;
                    }
                }
            }
        }
    } else if head.starts_with(b"SQLite") {
        let dir = tempfile::tempdir().ok()?;
        let copy = dir.path().join("x.db3");
        fs::copy(path, &copy).ok()?;
        if let Some(wal) =
            Some(PathBuf::from(format!("{}-wal", path.display()))).filter(|p| p.exists())
        {
            fs::copy(wal, dir.path().join("x.db3-wal")).ok()?;
        }
        let db = rusqlite::Connection::open(copy).ok()?;
        let sql =
            "SELECT name, count(*) FROM messages JOIN topics ON topics.id = topic_id GROUP BY name";
        let mut query = db.prepare(sql).ok()?;
        let rows = query
            .query_map([], |r| Ok((r.get(0)?, r.get::<_, i64>(1)?)))
            .ok()?;
        for (name, count) in rows.map_while(Result::ok) {
            counts.insert(name, u64::try_from(count).ok()?);
        }
    } else {
        let bytes = fs::read(path).ok()?;
        for message in ::mcap::MessageStream::new(&bytes).ok()? {
            *counts
                .entry(message.ok()?.channel.topic.clone())
                .or_default() += 1;
        }
    }
    Some(counts)
}

fn bags_below(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            // Intentionally damaged bags have their own tests.
            let name = path.file_name().unwrap().to_string_lossy();
            if !name.starts_with("hostile") {
                bags_below(&path, found);
            }
        } else if path
            .extension()
            .is_some_and(|e| e == "bag" || e == "active" || e == "db3" || e == "mcap")
        {
            found.push(path);
        }
    }
}

#[test]
fn real_bags_have_the_counts_of_independent_readers() {
    let Some(folder) = support::shared("data") else {
        return;
    };
    let mut bags = Vec::new();
    bags_below(&folder, &mut bags);
    let mut checked = 0;
    for path in &bags {
        let Some(expected) = independent(path) else {
            continue;
        };
        let (report, kept) = read(path, Want::Stamps).unwrap();
        assert_eq!(kept.counts(), expected, "{}", path.display());
        // These have no usable index: no chunks, no summary, a truncated one, or crafted without some part.
        let name = path.to_string_lossy();
        let without = ["unchunked", "nosummary", "indexcut", "/reports/"]
            .iter()
            .any(|w| name.contains(w));
        if !without && !expected.is_empty() {
            assert_eq!(report.tier, Tier::Index, "{name}: {:?}", report.tier_reason);
            assert!(report.complete, "{name}: {:?}", kept.notices);
        }
        checked += 1;
    }
    assert!(checked > 40, "{checked} of {}", bags.len());
}

#[test]
fn every_format_has_a_file_and_a_row() {
    let names: Vec<&str> = FORMATS.iter().map(|f| f.name).collect();
    assert_eq!(names, ["rosbag1", "mcap", "sqlite3", "rosbag2", "zstd"]);
}
